"""The two engines against each other: no shared equation of motion, the same answer.

Short runs; scripts/promises.py measures the same over two turns.
"""

from functools import cache
from importlib import metadata

import pytest
from cli_runs import MODELS

from exudyn_flexlink.comparison import compare
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.observables import strikes

TIGHT = ("solver.integrator=dop853", "accuracy.tolerance=1e-7")  # of the Lagrangian, as a judge
SMOOTH = ("smooth.yaml", "run.turns=0.2", "run.sample=1 ms", "bodies.link.rods=3")
STRIKE = (
    "no_clearance.yaml",
    "run.turns=0.55",
    "run.sample=1 ms",
    "bodies.link.hinges.stiffness=beam",
    "bodies.link.rods=3",
)


@cache
def run(engine, model, *settings):
    return simulate(load_scene(MODELS / model, settings), engine, measure=False)


def against_lagrangian(case, *settings):
    return compare(run("exudyn", *case, *settings), run("lagrangian", *case, *TIGHT))


def test_smooth_motions_agree_to_1e_8_and_with_the_step_squared():
    steps = ("accuracy.step=1e-4", "accuracy.step=5e-5")
    coarse, fine = (against_lagrangian(SMOOTH, step).deviation.largest for step in steps)
    assert fine < 1e-8
    assert coarse / fine == pytest.approx(4, abs=0.4)


@pytest.mark.parametrize("engine", ["exudyn", "lagrangian"])
def test_a_result_says_by_which_version_of_this_program_it_was_made(engine):
    assert run(engine, *SMOOTH).versions["exudyn-flexlink"] == metadata.version("exudyn-flexlink")


def test_a_strike_agrees_at_tight_settings_and_takes_the_same_impulse_and_energy():
    """Tighter by Radau's method: `test_lagrangian_run` holds the other against a reference."""
    ours, judge = (
        run("exudyn", *STRIKE, "accuracy.tolerance=1e-6"),
        run("lagrangian", *STRIKE, "accuracy.tolerance=1e-8"),
    )
    found = compare(ours, judge)
    assert found.deviation.largest < 2e-6
    assert abs(found.answer_differences["lever"]).max() < 1e-4
    one, other = (strikes(result, "strike")[0] for result in (ours, judge))
    assert one.impulse == pytest.approx(other.impulse, rel=1e-3)
    assert one.energy_lost == pytest.approx(other.energy_lost, rel=5e-3)
    assert one.peak_force == pytest.approx(other.peak_force, rel=2e-5)
    depths = [result.checks.largest_penetration for result in (ours, judge)]
    assert depths[0] == pytest.approx(depths[1], rel=1e-5)


@pytest.mark.parametrize("start", ["0", "-20 deg"])
def test_a_crank_that_runs_backwards_takes_the_laps_in_the_same_order(start):
    case = ("rigid.yaml", "drives.motor.value=-10", "run.turns=2.2", "run.sample=1 ms",
            f"initial.angles.guide={start}", "contacts={}")  # fmt: skip
    found = against_lagrangian(case)
    assert found.deviation.largest < 4e-5
    laps = [
        [event.details["lap"] for event in run(engine, *case).events if event.kind == "lap"]
        for engine in ("exudyn", "lagrangian")
    ]
    assert laps[0] == laps[1]
    # From the seam the first lap is the ellipse: S is 110 mm from O on the far side, not 100.
    assert laps[0] == ([-1, -2, -3] if start == "0" else [-1, -2])


@pytest.mark.parametrize("engine", ["exudyn", "lagrangian"])
def test_the_end_of_an_open_curve_ends_the_run_and_keeps_it(engine):
    line = "curves={t: {type: line, from: [0.04, -0.03], to: [0.04, 0.03]}}"
    result = run(engine, "smooth.yaml", line, "joints.pin.curve=t", "run.turns=0.5")
    assert not result.outcome.completed
    assert "'pin' reached the curve's end" in result.outcome.reason
    assert result.time[-1] == pytest.approx(result.outcome.time, abs=1e-9)


@pytest.mark.parametrize("engine", ["exudyn", "lagrangian"])
def test_turns_cut_short_are_not_a_completed_run(engine):
    outcome = run(engine, "rigid.yaml", "run.at_most=0.01").outcome
    assert not outcome.completed
    # 10 rad/s for 0.01 s
    assert "'at_most' was reached when joint 'crank' had made 0.0159 turns of 4" in outcome.reason
    assert outcome.advice == "raise 'at_most', or a drive's value"
