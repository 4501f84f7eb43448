"""The paper's scenes against an independent integration (tests/data, see the headers there).

The limit at shipped accuracy is the models' own tolerance, the peaks are those of the same
independent integration. scripts/promises.py prints the measured deviations, with
tighter settings than a test has time for.
"""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from benchmarks import measuring, strike
from benchmarks.measuring import Measured
from benchmarks.naive_exudyn import simulate_by_hand
from benchmarks.series import deviation, read_series
from cli_runs import MODELS

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.observables import lever_response

HERE = Path(__file__).parent

SCENES = {
    "smooth_n10_beam": ("smooth.yaml", ()),
    "strike_n5_beam": (
        "no_clearance.yaml",
        ("bodies.link.hinges.stiffness=beam", "bodies.link.rods=5"),
    ),
    "strike_n10_beam": ("no_clearance.yaml", ("bodies.link.hinges.stiffness=beam",)),
    "strike_n10_paper": ("no_clearance.yaml", ()),
}


@cache
def run(name, *settings):
    model, own = SCENES[name]
    scene = load_scene(MODELS / model, ("run.turns=2", "run.sample=1 ms", *own, *settings))
    return simulate(scene, measure=False)


LEVER = 0.03  # m


def off(result, name):
    series = read_series(HERE / "data" / f"{name}.csv")
    found = deviation(result, series.time, series.position, series.lever_angle)
    assert len(found.time) == len(series.time)
    return found.largest, found.largest_angle


PEAKS = {  # rad
    "strike_n5_beam": (-0.35792, 0.26101),
    "strike_n10_beam": (-0.34439, 0.25115),
    "strike_n10_paper": (-0.16300, 0.11887),
}


@pytest.mark.parametrize("name", SCENES)
def test_s_and_lever_at_the_accuracy_the_models_ship_with(name):
    result = run(name)
    distance, angle = off(result, name)
    assert distance < 1e-6  # the tolerance that the models ask for
    assert LEVER * angle < 1e-6
    assert result.checks.constraint_error < 1e-12
    assert result.checks.energy_residual < 2e-5 * result.checks.largest_kinetic_energy
    if name in PEAKS:
        response = lever_response(result, "strike")
        assert (response.least[0], response.greatest[0]) == pytest.approx(PEAKS[name], abs=5e-5)


def test_s_and_lever_with_joints():
    """Rigid bodies with joints, steps of order 2: what every mechanism can fall back on."""
    settings = ("solver.formulation=redundant", "accuracy.tolerance=4e-5")
    distance, angle = off(run("strike_n5_beam", *settings), "strike_n5_beam")
    assert distance < 4e-5
    assert LEVER * angle < 4e-5


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5, 1e-7])
def test_the_tolerance_is_the_error_made(tolerance):
    """Neither more than it nor a hundred times less, in the scene with the paper's hinges."""
    distance, _ = off(
        run("strike_n10_paper", f"accuracy.tolerance={tolerance}"), "strike_n10_paper"
    )
    known = 9.1e-8  # m, to which the series itself is
    assert tolerance / 100 - known < distance < tolerance + known


def test_smooth_scene_at_a_tight_tolerance():
    distance, _ = off(run("smooth_n10_beam", "accuracy.tolerance=1e-8"), "smooth_n10_beam")
    assert distance < 1e-8


# --- the benchmark's own arithmetic, and the script by hand ---------------------------------------


def power_law(*settings):
    """Error h^2, cost 3/h: cost is 3 error^-1/2."""
    return [Measured(h, h**2, 3 / h) for h in settings]


def test_cost_at_an_error_lies_on_the_power_law_within_and_beyond_the_points():
    points = power_law(1e-1, 1e-3, 1e-2)
    for error, beyond in ((1e-3, False), (1e-4, False), (1e-5, False), (1e-1, True), (1e-8, True)):
        cost, told = measuring.cost_at(points, error)
        assert cost == pytest.approx(3 * error**-0.5)
        assert told is beyond


def test_the_script_by_hand_simulates_the_same_mechanism():
    """Before the strike it differs from the independent integration by its steps' errors."""
    motion = simulate_by_hand(1e-3, end=0.05)
    _, position, _ = strike.series()
    off = np.linalg.norm(motion.position - position[: len(motion.time)], axis=1)
    assert off.max() < 1e-5
    assert not motion.lever_angle.any()
    finer = simulate_by_hand(2.5e-4, end=0.05)
    better = np.linalg.norm(finer.position - position[: len(finer.time)], axis=1)
    assert better.max() < off.max() / 8  # second order: 16 times
