"""The scene that engines are judged by: the paper's strike, n = 10, `beam` stiffness, two turns."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.series import deviation, read_series
from benchmarks.stepping import completed
from benchmarks.variants import BEAM, VARIANTS, Variant
from exudyn_flexlink import Result, Scene, load_scene, simulate
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.observables import lever_response, path

ROOT = Path(__file__).parent.parent.parent
MODEL = ROOT / "models" / "no_clearance.yaml"
SERIES = ROOT / "tests" / "data" / "strike_n10_beam.csv"
SERIES_KNOWS = 1e-6  # m: errors below are judged by the tight Lagrangian
TIGHT = 1e-12  # m: leaves 2e-13 m, held against DOP853 at relative 1e-11
SAME_INSTANT = 1e-9  # s
WARM_UP = 0.005  # s of motion


@cache
def scene_of(model: Path, settings: tuple[str, ...]) -> Scene:
    """A model file, read once: what is repeated is the simulation; 'startup' has the reading."""
    return load_scene(model, settings)


def run(variant: Variant, rung: float, *settings: str, until: float | None = None) -> Result:
    """Simulate the strike by a variant at a rung of its ladder; two turns, or `until` (s).

    Raises:
        RuntimeError: the run stopped early.

    """
    length = "run={turns: 2, of: crank, sample: 1 ms}"
    if until is not None:
        length = f"run={{duration: {until}, sample: 1 ms}}"
    scene = scene_of(MODEL, (BEAM, length, *settings, *variant.at(rung)))
    return completed(simulate(scene, variant.engine, measure=False))


def warm_up(variant: Variant) -> None:
    """Load what the variant needs."""
    run(variant, variant.first, until=WARM_UP)


@cache
def series() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Instants (N,) s, S (N, 2) m and the lever's angle (N,) rad, known to 1e-7 m."""
    read = read_series(SERIES)
    return read.time, read.position, read.lever_angle


@cache
def tight(until: float | None = None) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The same, up to `until` (s), by the Lagrangian at a tight tolerance."""
    variant = next(variant for variant in VARIANTS if variant.engine == "lagrangian")
    result = run(variant, TIGHT, until=until)
    time = series()[0]
    time = time[time <= result.time[-1] + SAME_INSTANT]
    index = np.searchsorted(result.time, time - SAME_INSTANT)
    return (
        time,
        path(result, "link.end").position[index],
        lever_response(result, "strike").value[index],
    )


def error(result: Result, finer: bool = False, until: float | None = None) -> float:
    """Largest distance (m) of S from the truth; `finer`: from the tight Lagrangian."""
    return deviation(result, *(tight(until) if finer else series())).largest
