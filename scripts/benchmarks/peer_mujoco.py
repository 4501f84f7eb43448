"""Our engines against MuJoCo on a free ringing chain, at the same error of its end."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, partial
from pathlib import Path

import numpy as np

from benchmarks import mujoco_chain, numpy_lagrangian
from benchmarks.measuring import FINE, Measured, Run, Table, cheapest, ladder, repeated
from benchmarks.peers import against
from benchmarks.stepping import completed
from benchmarks.strike import scene_of
from benchmarks.variants import VARIANTS, Variant
from exudyn_flexlink import Result, simulate
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.observables import path

MODEL = Path(__file__).parent / "ringing_chain.yaml"
WEIGHT = -1000.0  # m/s^2, along y
START = np.array([0.04, 0.0])  # m: P
ERRORS = (1e-4, 1e-6, 1e-8)  # m
DURATION, BRIEF = 0.2, 0.03  # s
TRUTH = 1e-9  # tolerance of the independent computation: leaves 1e-12 m
# steps in a millisecond
EVERY = (5, 10, 20, 30, 40, 50, 70, 100, 140, 200, 300, 400, 500, 1000, 2000)
BUDGET = 4.0  # s


@cache
def truth(duration: float) -> FloatArray:
    """S (N, 2) m every millisecond, by SciPy on the numpy Lagrangian."""
    time = np.arange(round(duration * 1e3) + 1) * 1e-3
    return numpy_lagrangian.ring(WEIGHT, time, TRUTH).position


def off(position: FloatArray, duration: float) -> float:
    """Largest distance from the truth, m; inf where the motion has burst."""
    distance = np.linalg.norm(position - truth(duration), axis=1)
    return float(distance.max()) if np.isfinite(distance).all() else float("inf")


def run(variant: Variant, duration: float, rung: float) -> Result:
    """The chain by one of our engines."""
    settings = (f"run={{duration: {duration}, sample: 1 ms}}", *variant.at(rung))
    return completed(simulate(scene_of(MODEL, settings), variant.engine, measure=False))


def ours(variant: Variant, duration: float, rung: float) -> tuple[float, int]:
    """Error of a variant (m) at a rung, and its number of steps."""
    result = run(variant, duration, rung)
    time = np.arange(len(truth(duration))) * 1e-3
    index = np.searchsorted(result.time, time - 1e-9)
    return off(path(result, "link.end").position[index], duration), result.checks.steps


def by_mujoco(integrator: object, duration: float, every: float) -> tuple[float, int]:
    """Error of MuJoCo (m) with so many steps in a millisecond, and its number of steps."""
    count = len(truth(duration)) - 1
    place = START + mujoco_chain.ring(WEIGHT, count, int(every), integrator)
    return off(place, duration), count * int(every)


def measure(
    duration: float, errors: Sequence[float], repeat: int
) -> dict[tuple[str, float], Measured]:
    """The cheapest run at every error reached, by name."""
    truth(duration)  # not on anyone's bill
    runs: dict[str, Run] = {
        f"mujoco {name}": partial(by_mujoco, integrator, duration)
        for name, integrator in mujoco_chain.integrators().items()
    }
    rungs = {name: list[float](EVERY) for name in runs}
    for variant in VARIANTS:
        run(variant, 1e-3, variant.first)  # load
        runs[variant.name] = partial(ours, variant, duration)
        rungs[variant.name] = list(ladder(variant.first, mantissas=FINE))  # as fine as EVERY
    return repeated(runs, cheapest(runs, rungs, errors, BUDGET), repeat - 1)


def tables(quick: bool = False, repeat: int = 3) -> list[Table]:
    """Measure, and tell it."""
    title = "A free ringing chain of ten rods, end against an independent integration"
    if mujoco_chain.mujoco is None:
        return [Table(title, (), (), "Left out: MuJoCo is not installed (pip install '.[peers]').")]
    duration = BRIEF if quick else DURATION
    errors = ERRORS[:2] if quick else ERRORS
    found = measure(duration, errors, repeat)
    return [against("MuJoCo", title, found, errors, duration)]
