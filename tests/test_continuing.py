"""A run goes on from a state of another: the two together are as one run that was never stopped."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from physics_tools import MODELS, STEEL, scene
from results import tilting_link

from exudyn_flexlink.continuing import (
    CannotContinueError,
    continued,
    free_spans,
    joined,
    moved,
    state_at,
)
from exudyn_flexlink.effects import idealise
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import assemble_scene, load_scene
from exudyn_flexlink.observables import common_times, judged_points, paths, separation
from exudyn_flexlink.scene import Run
from exudyn_flexlink.source import SceneError

CLOSE = "accuracy.tolerance=1e-7"
ENGINES = [("lagrangian", ()), ("exudyn", ()), ("exudyn", ("solver.formulation=redundant",))]
BOTH = pytest.mark.parametrize(
    ("engine", "settings"), ENGINES, ids=["lagrangian", "minimal", "redundant"]
)


def rest_of(result, at, **more):
    """Run the rest of a run again, from a state of it."""
    begun = continued(result, at)
    left = float(result.time[-1]) - (begun.initial.clock - result.scene.initial.clock)
    again = simulate(begun.changed(run=Run(duration=left), **more), result.engine, measure=False)
    assert again.outcome.completed, again.outcome
    return again


def apart(result, again):
    """Largest distance (m) of the points by which errors are judged, at the end."""
    points = judged_points(result.scene)
    here, there = (
        np.array([p.position[-1] for p in paths(run, points)]) for run in (result, again)
    )
    return float(np.linalg.norm(here - there, axis=1).max())


def both_off(result):
    """Distance (m) that two runs may be apart of which each keeps its tolerance."""
    return 2 * result.scene.accuracy.tolerance


@BOTH
def test_the_papers_mechanism_goes_on_in_its_second_lap(engine, settings):
    """P is on the egg then, and not on the ellipse; the lever still rings from its strike."""
    tolerance = 1e-5 if settings else 1e-6  # m: redundant coordinates take many more steps
    small = ("run.turns=0.6", "bodies.link.rods=3", f"accuracy.tolerance={tolerance}")
    start = "initial.angles.guide=178 deg"  # just before the strike
    model = load_scene(MODELS / "no_clearance.yaml", (*small, start, *settings))
    whole = simulate(model, engine, measure=False)
    again = rest_of(whole, 0.35)
    assert again.scene.initial.laps == {"pin": 2}
    assert again.laps == ()
    allowed = both_off(whole)
    if settings:  # redundant coordinates only aim at the tolerance: a closer run tells the error
        exact = simulate(load_scene(MODELS / "no_clearance.yaml", (*small[:2], start, CLOSE)))
        allowed = 2 * separation(whole, exact, common_times(whole, exact)).max()
    assert apart(whole, again) < allowed
    assert np.abs(again.poses[0] - whole.poses[np.abs(whole.time - 0.35).argmin()]).max() < 1e-12


def test_a_link_with_clearance_goes_on_between_two_touches():
    settings = ("run.turns=0.35", "accuracy.tolerance=1e-7", "bodies.link.rods=2")
    whole = simulate(load_scene(MODELS / "clearance.yaml", settings), "lagrangian", measure=False)
    touches = whole.intervals["sleeve"]
    free = next(span for span in free_spans(whole) if span[0] > 0.1)
    assert apart(whole, rest_of(whole, free.mean())) < both_off(whole)
    longest = int(np.argmax(touches.until(float(whole.time[-1])) - touches.begin))
    pressed = (touches.begin + touches.until(float(whole.time[-1])))[longest] / 2
    with pytest.raises(CannotContinueError, match=r"'sleeve' presses at .* nothing does from "):
        continued(whole, pressed)


def test_in_minimal_coordinates_a_run_goes_on_while_contacts_press():
    """The force of the lever's law asks how fast S touched it, 3 ms before."""
    settings = ("bodies.link.rods=2", "run={duration: 20 ms}", "accuracy.tolerance=1e-8")
    model = load_scene(MODELS / "no_clearance.yaml", (*settings, "initial.angles.guide=178 deg"))
    whole = simulate(model, measure=False)
    strike = whole.intervals["strike"]
    pressed = float(strike.begin[0] + 0.4 * (strike.end - strike.begin)[0])
    first = simulate(model.changed(run=Run(duration=pressed)), measure=False)
    begun = continued(first)
    pairs = begun.initial.pressing["strike"]
    assert pairs == ((0, pytest.approx(strike.approach_speed[0], rel=1e-6)),)
    rest = Run(duration=model.run.duration - pressed)
    again = simulate(begun.changed(run=rest), measure=False)
    assert apart(whole, again) < both_off(whole)
    both = joined(first, again).intervals["strike"]
    assert len(both) == len(strike)
    assert both.impulse[0] == pytest.approx(strike.impulse[0], rel=1e-5)


PASSING = """
bodies:
  floor: {type: rigid, mass: 1, inertia: 1, points: {a: [0, 0], b: [1, 0]}}
  ball: {type: rigid, mass: 1, inertia: 0, points: {c: [0, 0]}}
joints: {fixed: {type: weld, points: [ground, floor.a], at: [0, 0]}}
contacts:
  hit: {type: point_on_line, point: ball.c, line: [floor.a, floor.b],
        law: {stiffness: 1.0e+4, restitution: 0.5}}
initial: {positions: {ball: [1.6, 1]}, velocities: {ball: [-1, -2]}}
run: {duration: 1.0}
accuracy: {tolerance: 1.0e-9}
"""


def test_what_came_round_the_end_of_a_face_stays_behind_it():
    whole = simulate(scene(PASSING), measure=False)
    again = rest_of(whole, 0.8)
    assert not len(again.intervals["hit"])
    assert again.poses[-1, 1, :2] == pytest.approx([0.6, -1.0], abs=1e-12)


def test_a_short_span_is_told_by_ends_that_differ():
    """Between two touches of a rattle there may be less than a microsecond."""
    run = tilting_link()
    begins, ends = np.array([0.0, 0.34635312]), np.array([0.34635301, np.inf])
    touches = replace(run.sleeves["sleeve"].touches, begin=begins, end=ends)
    sleeve = replace(run.sleeves["sleeve"], touches=touches)
    pressed = replace(run, engine="lagrangian", sleeves={"sleeve": sleeve})
    with pytest.raises(CannotContinueError, match=r"from 0\.346353 to 0\.3463531 s"):
        continued(pressed)


DRIVEN = """
bodies:
  rod: {type: rod, length: 0.4, material: steel, section: {width: 20 mm, thickness: 5 mm}}
  slider: {type: rigid, mass: 1, inertia: 0.1, points: {p: [0, 0]}}
joints:
  pivot: {type: revolute, points: [ground, rod.start], at: [0, 0]}
  rail: {type: prismatic, points: [ground, slider.p], at: [0.5, 0], axis: [1, 0]}
springs:
  twist: {type: torsional, joint: pivot, stiffness: 3, damping: 0.05}
  pull: {type: linear, joint: rail, stiffness: 40}
  band: {type: linear, points: [rod.end, slider.p], stiffness: 20}
drives:
  push: {type: torque, joint: pivot, value: "where(t < 0.9, 2*sin(5*t), 1.5)"}
  shove: {type: force, point: slider.p, value: [{points: [[0, 0], [0.7, 4], [3, -4]], rule: linear}, 0]}
gravity: 9.81
initial: {angles: {rod: 0.3}, speeds: {rod: 1}}
run: {duration: 1.1}
accuracy: {tolerance: 1.0e-9}
"""  # noqa: E501


@pytest.mark.parametrize("settings", [(), ("solver.formulation=redundant",)])
def test_drives_go_on_by_their_clock_and_springs_rest_as_they_did(settings):
    settings = (*settings, "accuracy.tolerance=1e-4") if settings else ()
    whole = simulate(scene(STEEL + DRIVEN, *settings), measure=False)
    again = rest_of(whole, 0.4)
    assert again.scene.springs["twist"].rest_angle == pytest.approx(0.3)
    assert again.scene.springs["pull"].length == pytest.approx(0.0, abs=1e-12)
    assert apart(whole, again) < both_off(whole)
    third = rest_of(again, 0.3)
    assert third.scene.initial.clock == pytest.approx(0.7, abs=1e-3)
    assert apart(whole, third) < both_off(whole)


MOTION = """
bodies:
  rod: {type: rod, length: 0.4, material: steel, section: {width: 20 mm, thickness: 5 mm}}
  bob: {type: rod, length: 0.3, material: steel, section: {width: 20 mm, thickness: 5 mm}}
joints:
  pivot: {type: revolute, points: [ground, rod.start], at: [0, 0]}
  elbow: {type: revolute, points: [rod.end, bob.start]}
drives: {swing: {type: motion, joint: pivot, value: 0.5*sin(3*t)}}
gravity: 9.81
run: {duration: 1.2}
accuracy: {tolerance: 1.0e-9}
"""


def test_a_motion_goes_on_where_it_was():
    whole = simulate(scene(STEEL + MOTION), measure=False)
    assert apart(whole, rest_of(whole, 0.5)) < both_off(whole)


def test_a_neighbour_moves_as_joints_and_drives_allow():
    """Each part is moved by 1e-4; what is left closes the elbow and is not ahead of 'swing'."""
    whole = simulate(scene(STEEL + MOTION), measure=False)
    begun = continued(whole, 0.5)
    off = 1e-4 * np.random.default_rng(2).standard_normal((2, 6))
    near = assemble_scene(moved(begun, state_at(whole, begun.initial.clock) + off)).state
    here = assemble_scene(begun).state
    assert near.q[0] == pytest.approx(here.q[0], abs=1e-12)
    assert 1e-6 < abs(near.q[1, 2] - here.q[1, 2]) < 1e-3
    assert 1e-6 < abs(near.v[1, 2] - here.v[1, 2]) < 1e-3


@pytest.mark.parametrize(("off", "lap"), [(-1e-6, -1), (0.0, 1), (1e-6, 1)])
def test_a_neighbour_behind_the_seam_is_in_the_lap_before(off, lap):
    """P starts at (0.04, 0), where laps -1 and 1 meet, both on the ellipse."""
    settings = ("run.turns=0.1", "bodies.link.rods=2")
    begun = continued(simulate(load_scene(MODELS / "clearance.yaml", settings), "lagrangian"), 0.0)
    state = np.concatenate([np.array(rows) for rows in begun.initial.states.values()])
    state[1:3, 1] += off
    near = moved(begun, state)
    assert near.initial.laps == {"pin": lap}
    place = float(assemble_scene(near).state.places[0])
    assert place == pytest.approx((2 * pi if off < 0 else 0.0) + off / 0.03, abs=1e-9)


def test_what_a_scene_can_not_go_on_with():
    text = (
        MOTION
        + """
initial:
  states:
    rod: [[0, 0, 0, 0, 0, 0]]
    rob: [[0.4, 0, 0, 0, 0, 0]]
  speeds: {bob: 1}
  laps: {elbow: 2, pin: 1}
"""
    )
    with pytest.raises(SceneError) as refused:
        scene(STEEL + text)
    told = str(refused.value)
    assert "initial.speeds: follow from 'states', which give everything" in told
    text = text.replace("  speeds: {bob: 1}\n", "")
    with pytest.raises(SceneError) as refused:
        scene(STEEL + text)
    told = str(refused.value)
    for part in (
        "unknown body 'rob'",
        "initial.states: missing 'bob'",
        "initial.laps.elbow: 'elbow' is no slot",
        "unknown joint 'pin'",
    ):
        assert part in told


def test_no_run_begins_within_a_ramp():
    settings = ("run.turns=0.3", "bodies.link.rods=2", "drives.motor.ramp=0.1 s")
    whole = simulate(load_scene(MODELS / "smooth.yaml", settings), "lagrangian")
    with pytest.raises(SceneError, match=r"the drive 'motor' comes up to its value until 0\.1 s"):
        continued(whole, 0.05)
    assert apart(whole, rest_of(whole, 0.15)) < both_off(whole)


def test_effects_keep_the_clock():
    begun = scene(STEEL + DRIVEN, "initial.clock=0.5 s")
    assert idealise(begun, ["damping"]).initial.clock == 0.5
    assert replace(assemble_scene(begun)).mechanism.knots(1.0) == pytest.approx([0.2, 0.4])
