"""Our engines against MuJoCo on a slider-crank that turns by itself, at the same error.

MuJoCo closes a loop by a stiff spring. What is best for it is searched: of each of its integrators
the cheapest run counts, wherever the loop is cut and however stiff it is closed.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, partial

import numpy as np

from benchmarks import mujoco_loop
from benchmarks.measuring import Measured, Run, Table, cheapest, ladder, repeated
from benchmarks.mujoco_chain import integrators, mujoco
from benchmarks.mujoco_loop import SAMPLE, Closing
from benchmarks.peers import against
from benchmarks.stepping import completed
from benchmarks.strike import ROOT, SAME_INSTANT, scene_of
from benchmarks.variants import VARIANTS, Variant
from exudyn_flexlink import Result, simulate
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.observables import path

MODEL = ROOT / "models" / "textbook" / "free_slider_crank.yaml"
ERRORS = (1e-4, 1e-6, 1e-8)  # m
DURATION, BRIEF = 3.0, 0.5  # s
TRUTH = 1e-10  # tolerance of the reference: leaves 5e-11 m
# wh: softer closes worse, stiffer leaves more errors of the spring's own motion
STIFFNESSES = (0.3, 0.5)
CLOSINGS = [Closing(body, stiffness) for body in ("crank", "slider") for stiffness in STIFFNESSES]
EVERY = (1, 2, 4, 5, 8, 10, 16, 20, 25, 40, 50, 80, 100, 160, 200, 250, 400, 500)  # in a sample
FIRST = 1e-2  # tolerance
BUDGET = 1.5  # s
OURS = [variant for variant in VARIANTS if variant.engine == "exudyn"]  # the other has no loops


def run(variant: Variant, duration: float, rung: float) -> Result:
    """The slider-crank by one of our formulations."""
    settings = (f"run={{duration: {duration}, sample: {SAMPLE}}}", *variant.at(rung))
    return completed(simulate(scene_of(MODEL, settings), variant.engine, measure=False))


def places(result: Result, count: int) -> FloatArray:
    """Crank pin and slider (count + 1, 2, 2), m, at all samples."""
    index = np.searchsorted(result.time, np.arange(count + 1) * SAMPLE - SAME_INSTANT)
    return np.stack([path(result, name).position[index] for name in ("crank.pin", "slider.pin")], 1)


@cache
def truth(duration: float) -> FloatArray:
    """Both points by minimal coordinates at a tight tolerance."""
    minimal = next(v for v in OURS if v.name == "Exudyn, minimal")
    return places(run(minimal, duration, TRUTH), round(duration / SAMPLE))


def off(position: FloatArray, duration: float) -> float:
    """Largest distance of both points from the truth, m; inf where the motion has burst."""
    distance = np.linalg.norm(position - truth(duration), axis=2)
    return float(distance.max()) if np.isfinite(distance).all() else float("inf")


def ours(variant: Variant, duration: float, rung: float) -> tuple[float, int]:
    """Error of a variant (m) at a rung, and its number of steps."""
    result = run(variant, duration, rung)
    return off(places(result, len(truth(duration)) - 1), duration), result.checks.steps


@cache
def _made_once(closing: Closing) -> object:
    """A model, made once as our scene is loaded once: what is repeated is the run."""
    return mujoco_loop.model(closing)


def by_mujoco(
    integrator: object, closing: Closing, duration: float, step: float
) -> tuple[float, int]:
    """Error of MuJoCo (m) with equal steps (s), and their number."""
    count, every = len(truth(duration)) - 1, round(SAMPLE / step)
    position = mujoco_loop.turn(_made_once(closing), closing, count, every, integrator)
    return off(position, duration), count * every


def of_each(
    found: dict[tuple[str, float], Measured], names: Sequence[str]
) -> dict[tuple[str, float], Measured]:
    """Of all runs whose name begins with one of `names`, the one of fewest steps at each error."""
    best: dict[tuple[str, float], tuple[str, float]] = {}
    for key, point in found.items():
        kind = next((name for name in names if key[0].startswith(f"{name} (")), key[0])
        before = best.setdefault((kind, key[1]), key)
        if (point.steps, point.error) < (found[before].steps, found[before].error):
            best[kind, key[1]] = key
    return {key: found[key] for key in best.values()}


def measure(
    duration: float, errors: Sequence[float], repeat: int
) -> dict[tuple[str, float], Measured]:
    """The cheapest run at every error reached, of each variant and of each MuJoCo's integrator."""
    truth(duration)  # not on anyone's bill
    kinds = {f"mujoco {name}": integrator for name, integrator in integrators().items()}
    runs: dict[str, Run] = {
        f"{name} ({closing})": partial(by_mujoco, integrator, closing, duration)
        for name, integrator in kinds.items()
        for closing in CLOSINGS
    }
    rungs = {name: [SAMPLE / every for every in EVERY] for name in runs}
    for variant in OURS:
        run(variant, 1e-3, variant.first)  # load
        runs[variant.name] = partial(ours, variant, duration)
        rungs[variant.name] = list(ladder(FIRST))
    found = of_each(cheapest(runs, rungs, errors, BUDGET), list(kinds))
    return repeated(runs, found, repeat - 1)


def tables(quick: bool = False, repeat: int = 3) -> list[Table]:
    """Measure, and tell it."""
    title = "A slider-crank that turns by itself, crank pin and slider against a tight run"
    if mujoco is None:
        return [Table(title, (), (), "Left out: MuJoCo is not installed (pip install '.[peers]').")]
    duration = BRIEF if quick else DURATION
    errors = ERRORS[:2] if quick else ERRORS
    found = measure(duration, errors, repeat)
    return [against("MuJoCo", title, found, errors, duration)]
