"""Sleeves with clearance in minimal coordinates: against an independent integration and energy."""

from pathlib import Path

import pytest
from cli_runs import MODELS

from exudyn_flexlink import load_scene, simulate
from exudyn_flexlink.comparison import compare

HERE = Path(__file__).parent


def test_walls_that_lose_nothing_keep_the_energy():
    """The link bounces in its guide; no touch takes energy, and the balance is kept."""
    settings = ["joints.sleeve.law.restitution=1", "bodies.link.rods=3", "run.turns=0.4"]
    scene = load_scene(MODELS / "clearance.yaml", [*settings, "accuracy.tolerance=1e-6"])
    result = simulate(scene, measure=False)
    touches = result.sleeves["sleeve"].touches
    assert len(touches.end) > 3
    assert result.checks.energy_residual < 1e-5 * result.checks.largest_kinetic_energy
    closed = touches.end < result.time[-1]
    assert abs(touches.energy_lost[closed]).max() < 1e-5 * result.checks.largest_kinetic_energy


def test_a_fixed_step_is_shortened_while_a_wall_is_touched():
    """A touch lasts 0.09 ms: steps of 1 ms would go over it."""
    short = "run={duration: 0.2, sample: 1 ms}"
    fixed = ["accuracy={step: 1.0e-3}", "solver.formulation=minimal"]
    result, exact = (
        simulate(load_scene(MODELS / "clearance.yaml", [short, *settings]), measure=False)
        for settings in (fixed, ["accuracy.tolerance=1e-8"])
    )
    assert any("in contact steps were" in warning for warning in result.warnings)
    assert compare(result, exact).deviation.largest < 1e-6


@pytest.mark.parametrize("model", ["clearance.yaml", "clearance_friction.yaml"])
@pytest.mark.parametrize("tolerance", [1e-8, 1e-10])
def test_a_rod_that_bends_past_the_end_of_its_guide_touches_however_short(model, tolerance):
    """Of 26 touches some last 3e-7 to 2e-6 s: one rod's joint passes the end as the gap closes.

    A run that misses one is off by 1e-8 m. Against the Lagrangian.
    """
    settings = ["run.turns=0.477"]
    tight = load_scene(MODELS / model, [*settings, "accuracy.tolerance=1e-11"])
    exact = simulate(tight, engine="lagrangian", measure=False)
    scene = load_scene(MODELS / model, [*settings, f"accuracy.tolerance={tolerance}"])
    assert compare(exact, simulate(scene, measure=False)).deviation.largest < tolerance
