"""How far a run is off that multiplies errors: told by a neighbouring run, not by counts."""

from dataclasses import replace
from math import inf
from pathlib import Path

import numpy as np
import pytest
import results

from exudyn_flexlink.cli import main
from exudyn_flexlink.engines import LateInterruptError, simulate
from exudyn_flexlink.engines.diagnostics.amplification import multiplying
from exudyn_flexlink.engines.diagnostics.neighbour import (
    HIGH_ORDER,
    measured_by,
    neighbouring,
    retuned,
    unmeasured,
)
from exudyn_flexlink.intervals import Interval, Intervals
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.measured_error import NOT_MEASURED, MeasuredError
from exudyn_flexlink.observables import common_times, separation
from exudyn_flexlink.report import run_text
from exudyn_flexlink.result import INTERRUPTED, ContactHistory, Outcome, SleeveHistory
from exudyn_flexlink.scene import Accuracy
from exudyn_flexlink.sensitivity import SCATTER, TOUCHED_SCATTER
from exudyn_flexlink.storage import load, save

MODELS = Path(__file__).parents[1] / "models"
PENDULUM = MODELS / "textbook" / "double_pendulum.yaml"

# A scene that was 7 mm off after a turn and 84 touches, and said nothing.
RATTLING = [
    "bodies.link.section={width: 10 mm, thickness: 0.890817 mm}",
    "bodies.link.rods=3",
    "bodies.link.hinges={stiffness: 0.696254, damping: 3.90284e-06}",
    "bodies.lever.length=0.0362237",
    "bodies.lever.section={width: 10 mm, thickness: 1.67567 mm}",
    "joints.crank.at=[0.0196528, 0]",
    "joints.pivot.at=[-0.1290539, 0]",
    "joints.sleeve.clearance=0.00320422",
    "joints.sleeve.law={stiffness: 69458.6, restitution: 0.903846}",
    "springs.lever_return={type: torsional, joint: pivot, frequency: 34.285 Hz, "
    "damping_ratio: 0.111551}",
    "drives.motor.value=14.5294 rad/s",
    "contacts.strike.law={stiffness: 6052.39, restitution: 0.0569073, transition_speed: 0.005}",
    "accuracy.tolerance=1e-5",
]
EXPLICIT = ["solver.integrator=dop853", "accuracy.tolerance=1e-7"]


def touched(times, settings=None):
    """A made-up run of the paper's mechanism, whose link touched walls so many times."""
    run = results.tilting_link()
    # To the end: else the link would swing free.
    touches = Intervals.of(Interval(0.0, float(run.time[-1])) for _ in range(times))
    history = SleeveHistory(("wall",), (1.0,), np.zeros((len(run.time), 1)), touches, 0)
    settings = {"tolerance": 1e-5} if settings is None else settings
    accuracy = {"step": 1e-4} if "step" in settings else {"tolerance": 1e-5}
    scene = run.scene.changed(accuracy=type(run.scene.accuracy).model_validate(accuracy))
    return replace(
        run,
        scene=scene,
        settings=settings,
        sleeves={"sleeve": history},
        laps=(),
        warnings=(),
        outcome=Outcome(True, float(run.time[-1])),
    )


def off_by(run, off, begin=0.5):
    """The run, but from an instant on so far off (m)."""
    poses = run.poses.copy()
    poses[run.time >= begin, :, 0] += off
    return replace(run, poses=poses)


@pytest.mark.parametrize(("times", "scatter"), [(0, SCATTER), (5, TOUCHED_SCATTER)])
def test_after_touches_a_neighbour_tells_less_exactly(times, scatter):
    """Run and neighbour may graze the same wall, and be nearer to each other than to the truth."""
    run = touched(times)
    error = measured_by(run, lambda _: off_by(run, 1e-6)).result.error
    assert error.largest == pytest.approx(scatter / (1 - HIGH_ORDER) * 1e-6, rel=1e-6)


# --- what is told


def test_a_run_that_will_be_millimetres_off_is_told_from_which_instant_on():
    """By a tolerance of 1e-7 m, which a count of touches was silent about: fewer than a hundred.

    A run at 1e-9 m is 1e-7 m away from 0.152 s on, and 4e-5 m in the end.
    """
    scene = load_scene(MODELS / "clearance.yaml", [*RATTLING, *EXPLICIT, "run.turns=0.44"])
    run = simulate(scene, "lagrangian")
    assert len(run.sleeves["sleeve"].touches.end) < 100
    assert run.error.exceeds_from == pytest.approx(0.152, abs=0.01)
    assert 2e-5 < run.error.largest < 5e-4
    (told,) = run.warnings
    assert told.startswith(f"from t = {run.error.exceeds_from:.4g} s on, points may be off by more")


@pytest.mark.parametrize("engine", ["exudyn", "lagrangian"])
def test_a_right_run_is_not_warned_of_because_of_its_touches(engine):
    scene = load_scene(
        MODELS / "clearance.yaml",
        ["bodies.link.rods=2", "run.turns=0.3", "accuracy.tolerance=2e-4"],
    )
    run = simulate(scene, engine)
    assert len(run.sleeves["sleeve"].touches.end) > 2
    assert run.warnings == ()
    assert 0 < run.error.largest < 2e-4
    assert run.error.exceeds_from is None


def test_what_is_told_of_a_neighbour_that_parts():
    run = touched(3)
    found = measured_by(run, lambda scene: off_by(run, 1e-3)).result
    (told,) = found.warnings
    assert told == (
        "from t = 0.5 s on, points may be off by more than 1e-05 m, and link.end by up to "
        "0.0026 m, as a neighbouring run with other steps shows: errors grow with every touch "
        "(3 of the walls of 'sleeve')"
    )
    said = " ".join(run_text(found).split())
    assert "within 1e-05 m up to t = 0.5 s; then off by up to 0.0026 m (link.end)" in said


def test_nothing_is_told_of_a_neighbour_that_agrees():
    run = touched(200)
    found = measured_by(run, lambda scene: off_by(run, 1e-7))
    assert found.result.warnings == ()
    assert found.neighbour is not None
    said = " ".join(run_text(found.result).split())
    assert "named points off by 2.6e-07 m at most (link.end), of 1e-05 m" in said


def test_a_neighbour_that_stops_measures_no_further():
    run = touched(3)
    part = results.first_samples(run, 31)
    part = replace(part, outcome=Outcome(False, float(part.time[-1]), "broke"))
    (told,) = measured_by(run, lambda scene: part).result.warnings
    assert f"up to t = {part.time[-1]:.4g} s only, where the neighbouring run stopped" in told


# --- when a neighbour is run


def test_play_asks_for_a_neighbour_and_its_absence_for_none():
    assert unmeasured(touched(0)).error.missing == NOT_MEASURED
    assert unmeasured(replace(touched(3), sleeves={})).error is None


def test_steps_that_only_aim_at_a_tolerance_ask_for_a_neighbour():
    smooth = replace(touched(0, {"tolerance": 1e-5, "steps_per_contact": 60}), sleeves={})
    found = measured_by(smooth, lambda scene: off_by(smooth, 1e-3)).result
    assert unmeasured(smooth).error.missing == NOT_MEASURED
    (told,) = found.warnings
    assert told.endswith(
        "as a neighbouring run with other steps shows: its steps only aim at the tolerance "
        "(steps of order 2)"
    )
    own = replace(touched(0, {"step": 1e-4, "steps_per_contact": 60}), sleeves={})
    assert unmeasured(own).error is None


def test_a_burst_of_one_strike_asks_for_no_neighbour():
    run = replace(touched(1), sleeves={})
    for count in (3, 4):
        bounces = Intervals.of(Interval(0.1 + k / 100, 0.105 + k / 100) for k in range(count))
        none = np.zeros(len(run.time))
        struck = {"strike": ContactHistory(none, none, none, bounces)}
        told = multiplying(replace(run, contacts=struck))
        assert told == (
            "" if count == 3 else "errors grow with every strike (4 of 'strike' in a row)"
        )


def test_a_run_that_stopped_is_left_as_it_is():
    stopped = replace(touched(9), outcome=Outcome(False, 0.1, "broke"))
    assert measured_by(stopped, lambda scene: 1 / 0).result is stopped


@pytest.mark.parametrize(
    ("settings", "factor", "changed"),
    [
        ({"tolerance": 1e-6}, HIGH_ORDER, {"tolerance": HIGH_ORDER * 1e-6}),
        (
            {"tolerance": 1e-5, "steps_per_contact": 60.0},
            0.25,
            {"tolerance": 2.5e-6, "steps_per_contact": 120},
        ),
        ({"step": 1e-4, "steps_per_contact": 60.0}, 0.25, {"step": 5e-5}),
    ],
)
def test_a_neighbour_is_more_accurate_where_it_can_be(settings, factor, changed):
    run = touched(3, settings)
    assert neighbouring(run) == factor
    near = retuned(run.scene, run, factor)
    found = near.accuracy.model_dump() | near.solver.model_dump()
    assert {key: found[key] for key in changed} == pytest.approx(changed)


def test_where_a_step_is_given_that_the_run_had_no_use_for_its_neighbour_has_a_tolerance():
    """The Lagrangian's methods choose their steps themselves."""
    run = touched(3, {"tolerance": 1e-7})
    stepped = run.scene.changed(accuracy=Accuracy(step=1e-4))
    near = retuned(stepped, run, HIGH_ORDER)
    assert near.accuracy == Accuracy(tolerance=HIGH_ORDER * 1e-7)


def test_the_lagrangian_measures_a_scene_that_gives_a_step(capsys, tmp_path):
    settings = ["--set", "accuracy.step=1e-4", "--set", "run.turns=0.2"]
    out = ["--out", str(tmp_path / "run")]
    command = ["simulate", "rigid", "--engine", "lagrangian", "--no-plots", "--horizon"]
    assert main([*command, *settings, *out]) == 0, capsys.readouterr()


def test_steps_that_are_given_in_minimal_coordinates_are_judged_by_error_control():
    """A step of half the length changed nothing here: contacts and turns bound the steps."""
    settings = ["run.duration=1", "accuracy.step=1", "solver.formulation=minimal"]
    run = simulate(load_scene(PENDULUM, settings), measure=False)
    found = measured_by(run, lambda scene: simulate(scene, measure=False)).result.error
    exact = simulate(load_scene(PENDULUM, [settings[0], "accuracy.tolerance=1e-10"]))
    off = separation(run, exact, common_times(run, exact)).max()
    assert off > 1e-8
    assert off < found.largest < 4 * off


@pytest.mark.parametrize(("enough", "squared"), [(1e-7, 1), (1e-8, 1), (1e-10, 2), (0, 3)])
def test_a_neighbour_whose_steps_stay_the_same_is_made_ever_tighter_a_few_times(enough, squared):
    """By squares: what a turn bounds at one tolerance, a much tighter one need not bound."""
    run, tolerances = replace(touched(1), sleeves={}), []
    made = [1e-5 * HIGH_ORDER ** (2**k) for k in range(squared + 1)]

    def again(scene):
        tolerances.append(scene.accuracy.tolerance)
        more = 2 if tolerances[-1] < enough else 1
        return replace(run, checks=replace(run.checks, steps=more * run.checks.steps))

    measured_by(run, again)
    assert len(tolerances) == len(made)
    assert tolerances[:3] == pytest.approx(made[:3])
    assert tolerances[-1] >= made[-1]


# --- no neighbour


def test_without_measuring_the_result_says_that_its_error_is_not_known():
    settings = ["bodies.link.rods=2", "run.turns=0.3", "accuracy.tolerance=2e-4"]
    run = simulate(load_scene(MODELS / "clearance.yaml", settings), measure=False)
    assert run.error == MeasuredError(missing=NOT_MEASURED)
    assert f"not measured: {NOT_MEASURED}" in run_text(run)


def interrupted(scene):
    raise KeyboardInterrupt


def broken_off(scene):
    return replace(touched(3), outcome=Outcome(False, 0.1, INTERRUPTED))


def late(scene):
    raise LateInterruptError(touched(3))


@pytest.mark.parametrize("again", [interrupted, broken_off, late])
def test_ctrl_c_in_the_neighbour_keeps_the_run_and_says_that_nothing_was_measured(again):
    run = touched(3)
    with pytest.raises(LateInterruptError) as caught:
        measured_by(run, again)
    kept = caught.value.result
    assert kept.outcome.completed
    assert kept.error.missing == "the neighbouring run was interrupted"
    assert kept.error.largest == inf
    (told,) = kept.warnings
    assert told.startswith("how far points are off was not measured")


def test_too_little_memory_for_the_neighbour_costs_nothing():
    def again(scene):
        raise MemoryError

    assert "not enough memory" in measured_by(touched(3), again).result.error.missing


def test_the_error_is_kept_with_the_run(tmp_path):
    run = touched(3)
    for again in (lambda scene: off_by(run, 1e-3), lambda scene: run):
        found = measured_by(run, again).result
        save(found, tmp_path)
        assert load(tmp_path).error == found.error
    save(unmeasured(run), tmp_path)
    assert load(tmp_path).error == MeasuredError(missing=NOT_MEASURED)


# --- at a terminal


@pytest.mark.parametrize(("option", "runs"), [([], 2), (["--no-horizon"], 1), (["--horizon"], 2)])
def test_simulate_runs_a_neighbour_unless_told_not_to(option, runs, run_of, capsys):
    made = []

    def fake(scene, engine="exudyn", progress=None):
        made.append(scene)
        run = touched(3)
        return unmeasured(run if len(made) == 1 else off_by(run, 1e-3))

    run_of(fake)
    model = str(MODELS / "clearance.yaml")
    assert main(["simulate", model, "--no-plots", "--out=here", *option]) == 0
    said = capsys.readouterr()
    assert len(made) == runs
    kept = load(Path("here"))
    if runs == 1:
        assert f"positions       not measured: {NOT_MEASURED}" in said.out
        assert kept.error.missing == NOT_MEASURED
    else:
        assert "warning: from t = 0.5 s on" in said.err
        assert kept.error.exceeds_from == 0.5
    assert ("can be trusted instant by instant" in said.out) == (option == ["--horizon"])
