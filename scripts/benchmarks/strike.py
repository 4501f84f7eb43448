"""The scene that engines are judged by: the paper's strike, n = 10, `beam` stiffness, two turns."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.variants import BEAM, VARIANTS, Variant
from exudyn_flexlink import Result, load_scene, simulate
from exudyn_flexlink.observables import deviation, lever_response, path
from exudyn_flexlink.storage import read_series

FloatArray = NDArray[np.float64]

ROOT = Path(__file__).parent.parent.parent
MODEL = ROOT / "models" / "no_clearance.yaml"
SERIES = ROOT / "tests" / "data" / "strike_n10_beam.csv"
SERIES_KNOWS = 1e-6  # m: errors below are judged by the tight Lagrangian
TIGHT = ("accuracy.relative_tolerance=1e-11", "accuracy.absolute_tolerance=1e-13")
WARM_UP = 0.005  # s of motion


def run(variant: Variant, rung: float, *settings: str) -> Result:
    """Simulate the strike by a variant at a rung of its ladder.

    Raises:
        RuntimeError: the run stopped early.

    """
    told = (BEAM, "run.turns=2", "run.sample=1 ms", *settings, *variant.at(rung))
    result = simulate(load_scene(MODEL, told), variant.engine)
    if not result.outcome.completed:
        raise RuntimeError(f"{variant.name} at {rung:g}: {result.outcome.reason}")
    return result


def warm_up(variant: Variant) -> None:
    """Load and compile what the variant needs."""
    run(variant, variant.first, f"run={{duration: {WARM_UP}, sample: 1 ms}}")


@cache
def series() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Instants (N,) s, S (N, 2) m and the lever's angle (N,) rad, known to 1e-7 m."""
    read = read_series(SERIES)
    return read.time, read.position, read.lever_angle


@cache
def tight() -> tuple[FloatArray, FloatArray, FloatArray]:
    """The same instants by the Lagrangian with tight tolerances."""
    variant = next(variant for variant in VARIANTS if variant.engine == "lagrangian")
    result = run(replace(variant, accuracy=TIGHT), variant.first)
    time = series()[0]
    index = np.searchsorted(result.time, time - 1e-9)
    return (
        time,
        path(result, "link.end").position[index],
        lever_response(result, "strike").angle[index],
    )


def error(result: Result, finer: bool = False) -> float:
    """Largest distance (m) of S from the truth; `finer`: from the tight Lagrangian."""
    return deviation(result, *(tight() if finer else series())).largest
