"""What a run's own numbers say against it: told, or refused."""

import re
import signal
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import results
from hard.case import MODELS

from exudyn_flexlink.comparison import compare
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.engines.diagnostics import (
    diagnosed,
    doubts,
    many_iterations,
    thin_overlaps,
    tiny_steps,
)
from exudyn_flexlink.integrate.solve import Solution
from exudyn_flexlink.loading import assemble_scene, load_scene, scene_of
from exudyn_flexlink.report import check_text
from exudyn_flexlink.result import (
    INTERRUPTED,
    EnergyHistory,
    EngineSettings,
    Integrator,
    Interval,
    Outcome,
)
from exudyn_flexlink.source import parse_document

STRIKE = MODELS / "strike_stiffness.yaml"


@pytest.fixture(scope="module")
def run():
    return simulate(load_scene(STRIKE, ["accuracy.tolerance=1e-4"]))


def off_by(run, share, from_sample=50):
    """The run with an energy balance that misses a share of the largest kinetic energy."""
    missing = share * run.checks.largest_kinetic_energy
    supplied = run.energy.supplied.copy()
    supplied[from_sample:] += missing
    energy = EnergyHistory(run.energy.kinetic, run.energy.stored, run.energy.dissipated, supplied)
    return replace(run, energy=energy, checks=replace(run.checks, energy_residual=missing))


def test_a_run_that_misses_energy_says_so(run):
    (told,) = diagnosed(off_by(run, 0.05)).warnings
    assert told.startswith("the energy balance misses")
    assert told.endswith("tighten the tolerance and compare")


def test_what_is_grossly_wrong_is_refused_with_time_reason_and_advice(run):
    kept = diagnosed(off_by(run, 3.0, from_sample=70))
    assert not kept.outcome.completed
    assert kept.outcome.time == run.time[70]
    assert "energy balance misses" in kept.outcome.reason
    assert "tighten the tolerance" in kept.outcome.advice
    assert len(kept.time) == len(run.time)  # what was computed is kept


def test_a_step_of_the_users_own_is_to_be_shortened(run):
    own = EngineSettings(Integrator("any", 9, step=1e-4))
    wrong = replace(off_by(run, 0.05), settings=own)
    assert "shorten the step and compare" in diagnosed(wrong).warnings[-1]


def test_a_coarse_lagrangian_tells():
    scene = load_scene(MODELS / "undamped.yaml", ["accuracy.tolerance=3e-2"])
    told = simulate(scene, "lagrangian")
    assert doubts(told)
    assert set(doubts(told)) <= set(told.warnings)


def test_a_step_too_long_for_a_contact_is_shortened_there():
    """At 1e6 N/m a strike lasts half a period, 4e-5 s: steps of 6e-5 s would jump over it.

    The first three strikes begin at 0.05236, 0.05261 and 0.05289 s.
    """

    def stiff_strike(*settings):
        stiff = ("contacts.strike.law.stiffness=1e6", "run={duration: 0.0531}")
        return simulate(load_scene(STRIKE, [*stiff, *settings]), measure=False)

    right = stiff_strike("accuracy.tolerance=1e-8")
    for formulation, most in (("minimal", 1e-6), ("redundant", 1e-5)):
        result = stiff_strike(f"solver.formulation={formulation}", "accuracy.step=6e-5")
        assert np.abs(result.poses[-1] - right.poses[-1])[:, :2].max() < most
        (told,) = result.warnings
        assert told.startswith("a step of 6e-05 s is too long for a contact, which lasts 4e-05 s")
        assert "in contact steps were" in told


def test_a_strike_deeper_than_its_overlap_is_told_with_both(run):
    length = 0.03
    thin = Interval(0.3, 0.31, length - 1e-4, length - 5e-5, penetration=1e-4)
    (told,) = thin_overlaps(results.touched(run, thin))
    assert "the point of 'strike' sinks 0.0001 m into the face" in told
    assert "1 of the 0.0001 m by which it overlaps the face" in told


DOME = """
title: a ball on a dome
curves: {dome: {type: circle, centre: [0, -0.1], radius: 0.1}}
bodies: {ball: {type: rigid, mass: 1, inertia: 0}}
contacts: {top: {type: point_on_curve, point: ball.centre, curve: dome, side: right, radius: 0.02,
                 law: {stiffness: STIFFNESS, restitution: 1}}}
initial: {positions: {ball: [0, 0.02]}, velocities: {ball: [0, -2]}}
run: {duration: 0.2}
accuracy: {tolerance: 1.0e-6}
"""


@pytest.mark.parametrize(("stiffness", "told"), [(1600, "0.05 m deep, 0.42 of"), (1e5, "")])
def test_a_strike_deep_in_what_is_round_is_told_with_its_radius(stiffness, told):
    """A ball of 1 kg at 2 m/s sinks v sqrt(m/k) deep: into 0.1 + 0.02 m, half of that or less."""
    result = simulate(results.scene_from(DOME.replace("STIFFNESS", str(stiffness))), measure=False)
    warnings = [warning for warning in result.warnings if "m deep" in warning]
    assert len(warnings) == bool(told)
    assert all(f"{told} the radius of 0.12 m there" in warning for warning in warnings)
    depth = result.contacts["top"].touches.penetration[0]
    assert depth == pytest.approx(2 / np.sqrt(stiffness), rel=1e-6)


OVAL = """
title: a cam between its nose and its side, the follower pressed harder and harder
curves: {oval: {type: ellipse, centre: [0, 0], semi_axes: [0.04, 0.01], on: cam}}
bodies:
  cam: {type: rigid, mass: 1, inertia: 1.0e-3, points: {hub: [0, 0]}}
  follower: {type: rigid, mass: 0.02, inertia: 1.0e-4, points: {c: [0, 0]}}
joints:
  hub: {type: revolute, points: [ground, cam.hub], at: [0, 0]}
  rail: {type: prismatic, points: [ground, follower.c], at: [0, 0], axis: [1, 0]}
drives:
  motor: {type: speed, joint: hub, value: 3.14159}
  push: {type: force, point: follower.c, value: [PUSH, 0]}
contacts: {touch: {type: point_on_curve, point: follower.c, curve: oval, side: right,
                   law: {stiffness: 1.0e+4, restitution: 0.2}}}
initial: {angles: {cam: ANGLE deg}, positions: {follower: [PLACE, 0]}}
run: {duration: 0.5, sample: 1 ms}
accuracy: {tolerance: 1.0e-6}
"""


@pytest.mark.parametrize(
    ("start", "push", "told"),
    [((0, 0.04), '"-0.3-50*t**2"', False), ((90, 0.01), '"-1-20*t"', True)],
)
def test_depth_counts_against_the_radius_where_it_is(start, push, told):
    """1.5 mm are little at a cam's side, of radius 160 mm, and much at its nose, of 2.5 mm."""
    text = OVAL.replace("PUSH", push).replace("ANGLE", str(start[0]))
    result = simulate(results.scene_from(text.replace("PLACE", str(start[1]))), measure=False)
    assert result.contacts["touch"].gap.min() < -1e-3
    assert any("m deep" in warning for warning in result.warnings) == told


@pytest.mark.parametrize(
    ("formulation", "right", "duration"), [("minimal", True, 1.1), ("redundant", False, 0.8)]
)
def test_a_row_of_bounces_is_told_where_it_is_off(formulation, right, duration):
    """By formulation `minimal` the 12 bounces keep even to 1e-9 m; by `redundant` not one."""
    bouncing = [f"solver.formulation={formulation}", f"run.duration={duration}"]
    result = simulate(load_scene(MODELS / "bouncing.yaml", bouncing), measure=True)
    assert (result.error.exceeds_from is None) == right
    assert any("may be off by more than" in text for text in result.warnings) == (not right)


def test_steps_that_newton_hardly_solves_are_told(run):
    hard = replace(run.checks, steps=100, newton_iterations=1250)
    assert not list(many_iterations(run))
    (told,) = many_iterations(replace(run, checks=hard))
    assert "12 iterations a step" in told


def test_a_tolerance_that_is_large_beside_a_clearance_is_told_and_used_as_it_is():
    hard = "joints.sleeve.law.stiffness=1e8", "run.turns=0.01"
    fine, coarse = (
        simulate(load_scene(MODELS / "micron_clearance.yaml", [*hard, f"accuracy.tolerance={t}"]))
        for t in ("1e-7", "4e-5")
    )
    assert not any("10% of the clearance" in text for text in fine.warnings)
    (told,) = (text for text in coarse.warnings if "10% of the clearance" in text)
    assert "'sleeve', 1e-06 m: touches of its walls may be missed; ask for 1e-07 m" in told
    assert coarse.settings.integrator.tolerance == 4e-5


@pytest.mark.parametrize("engine", ["exudyn", "lagrangian"])
def test_energy_that_one_wall_takes_over_from_another_is_no_gain(engine):
    """A node comes into the guide as deep as the corner has pressed the rod in, which loses it."""
    settings = [
        "drives.motor.value=21.4",
        "run={duration: 0.17}",
        "bodies.link.rods=4",
        "joints.sleeve.clearance=1.2 mm",
        "joints.sleeve.law={stiffness: 1e4, restitution: 0.8}",
    ]
    run = simulate(load_scene(MODELS / "../clearance.yaml", settings), engine, measure=False)
    energy_lost = run.sleeves["sleeve"].touches.energy_lost
    assert energy_lost.min() < -8e-4 * run.checks.largest_kinetic_energy
    assert doubts(run) == []


def test_a_link_that_swings_free_of_its_walls_has_its_error_measured():
    """With a metre of clearance it is a pendulum on P that touches no wall."""
    model = MODELS / "../clearance.yaml"
    settings = ["joints.sleeve.clearance=1 m", "bodies.link.rods=1", "run.turns=1"]
    result = simulate(load_scene(model, settings), measure=True)
    tight = load_scene(model, [*settings, "accuracy.tolerance=1e-9"])
    exact = simulate(tight, "lagrangian", measure=False)
    assert compare(result, exact).deviation.largest < result.error.largest


def test_steps_too_few_for_a_strike_at_this_tolerance_are_told():
    """With 60 steps the tip is 1.4e-5 m off at 1e-5 m, with 120 steps 1.3e-6 m."""
    joints = ["run.turns=0.55", "solver.formulation=redundant", "accuracy.tolerance=1e-5"]
    few, enough = (
        simulate(
            load_scene(MODELS / "../rigid.yaml", [*joints, f"solver.steps_per_contact={n}"]),
            measure=True,
        )
        for n in (60, 120)
    )
    (told,) = few.warnings
    assert "points may be off by more than 1e-05 m, and lever.end by up to" in told
    assert enough.warnings == ()


class Strides:
    """In place of a stepper: it goes on by what `strides` (s) has for each step."""

    time, steps = 0.0, 0

    def __init__(self, strides):
        self.strides = strides

    def begin(self):
        """There is nothing to begin."""

    def advance(self, stop):
        self.time = min(self.time + self.strides[self.steps], stop)
        self.steps += 1


@pytest.mark.parametrize(
    ("slow", "ratio", "creeps"), [(1200, 2e-4, True), (1200, 4e-3, False), (400, 2e-4, False)]
)
def test_a_run_creeps_where_500_steps_make_less_than_a_thousandth_of_the_mean(
    slow, ratio, creeps, caplog
):
    """1000 steps of 1 ms, slow ones, and long ones to the end."""
    stepper = Strides([1e-3] * 1000 + [1e-3 * ratio] * slow + [0.5] * 10)
    solution = Solution(stepper, SimpleNamespace(over=False), [3.0], reason=lambda: "at a wall")
    solution.run()
    assert solution.time == 3.0
    told = "from t = 1 s on the run creeps: 500 steps took it on by 0.0001 s, less than a "
    whole = (f"{told}thousandth of the mean: at a wall",)
    assert solution.creeps == whole * creeps
    assert [record.message for record in caplog.records] == [
        f"warning: {own}" for own in whole * creeps
    ]


def test_a_run_that_creeps_at_a_dead_centre_says_so_at_once_and_in_its_warnings(
    monkeypatch, caplog
):
    """There all rods are in line, now and then; at which of these it stays rounding decides."""
    monkeypatch.setattr("exudyn_flexlink.integrate.solve.WATCHED", 200)

    def interrupt(_):
        if caplog.records:
            signal.raise_signal(signal.SIGINT)

    scene = load_scene(MODELS.parent / "benchmarks/n_four_bar.yaml", ["accuracy.tolerance=5e-11"])
    crept = simulate(scene, progress=interrupt)
    assert crept.outcome.reason == INTERRUPTED
    assert crept.outcome.time < 10
    (warning,) = (text for text in crept.warnings if "creeps" in text)
    since = float(re.match(r"from t = (\S+) s on the run creeps", warning)[1])
    assert since == pytest.approx(crept.outcome.time, rel=1e-3)
    assert warning.endswith(
        "a loop of joints is at a dead centre, where it can move in more than one way"
    )
    assert [record.message for record in caplog.records] == [f"warning: {warning}"]


def test_an_interrupted_crawl_names_the_contact(run):
    begin = run.contacts["strike"].touches.begin[0]
    sample = int(np.searchsorted(run.time, begin, side="right"))
    force = np.append(run.contacts["strike"].force[:sample], 1.0)
    crawling = replace(
        run,
        outcome=Outcome(False, float(begin), INTERRUPTED),
        contacts={"strike": replace(run.contacts["strike"], force=force)},
        checks=replace(run.checks, smallest_step=7e-12),
    )
    (told,) = tiny_steps(crawling)
    assert told.startswith("contact 'strike' acted as the run was ended")
    assert "transition_speed" in told
    rigid = ["contacts.strike.law={type: impulse, restitution: 0.5}"]
    by_impulse = load_scene(STRIKE, ["accuracy.tolerance=1e-4", *rigid])
    assert not list(tiny_steps(replace(crawling, scene=by_impulse)))


# --- springs


WOUND = """title: two arms with a spring between them
bodies:
  a: &arm {type: rigid, mass: 1, inertia: 0.01, points: {p: [0, 0], q: [0.3, 0]}}
  b: *arm
joints:
  A: {type: revolute, points: [ground, a.p], at: [0, 0]}
  B: {type: revolute, points: [a.q, b.p]}
springs:
  s: {type: torsional, joint: B, stiffness: 1, rest_angle: 10 deg}
run: {duration: 0.01}
accuracy: {tolerance: 1.0e-8}
"""


@pytest.mark.parametrize(("angle", "told"), [("-175 deg", "-355 deg"), ("185 deg", "")])
def test_a_spring_that_starts_wound_by_whole_turns_says_so(angle, told):
    scene = scene_of(
        parse_document(f"{WOUND}initial: {{angles: {{a: 170 deg, b: {angle}}}}}\n", "test")
    )
    warned = [text for text in simulate(scene).warnings if "starts wound by" in text]
    assert [told in text for text in warned] == ([True] if told else [])
    assert ("starts wound by" in check_text(scene, assemble_scene(scene))) == bool(told)
