"""Contacts by impulse in Exudyn's minimal coordinates: closed forms of impact, rest and release."""

from math import sin, sqrt

import numpy as np
import pytest
from test_physics_tools import FLOOR, alone, angle, arm_and_ball, scene, speed, velocity

from exudyn_flexlink.engines import simulate

G = 9.81


def impacts(result, name):
    """Contacts without duration."""
    return [touch for touch in result.intervals[name] if touch.impact]


def balanced(result):
    """Whether energy is what it was, but for losses and drives."""
    checks = result.checks
    return checks.energy_residual < 1e-9 * checks.largest_kinetic_energy


# --- two bodies -------------------------------------------------------------------------------

TWO = """
bodies:
  one: {type: rigid, mass: 3, inertia: 0.1, points: {c: [0, 0]}}
  two: {type: rigid, mass: 2, inertia: 0.2, points: {c: [0, 0]}}
contacts:
  meet:
    type: circle_on_circle
    circles: [{at: one.c, radius: 0.1}, {at: two.c, radius: 0.2}]
    law: {type: impulse, restitution: 0.6}
initial:
  positions: {one: [0, 0], two: [1, 0]}
  velocities: {one: [4, 0.5], two: [-1, 0.5]}
run: {duration: 0.5}
accuracy: {tolerance: 1.0e-6}
"""


def test_two_bodies_collide_on_a_line():
    """Newton's law of impact: momentum stays, -e times the speed of approach is that after."""
    result = alone(TWO)
    (hit,) = result.intervals["meet"]
    assert hit.begin == pytest.approx(0.7 / 5, abs=1e-12)
    assert hit.approach_speed == pytest.approx(5)
    assert hit.impulse == pytest.approx(1.6 * 5 * 3 * 2 / 5)
    assert hit.energy_lost == pytest.approx(0.5 * (1 - 0.36) * 6 / 5 * 25)
    mean = (3 * 4 - 2) / 5
    assert velocity(result, "one.c")[-1] == pytest.approx([mean - 0.6 * 5 * 2 / 5, 0.5])
    assert velocity(result, "two.c")[-1] == pytest.approx([mean + 0.6 * 5 * 3 / 5, 0.5])
    assert balanced(result)


def test_an_impact_gives_no_energy_to_what_is_free_of_it():
    """Off the line of the centres smooth circles push along it alone, and don't turn."""
    result = alone(TWO, "initial.positions.two=[1, 0.18]")
    (hit,) = result.intervals["meet"]
    gap = sqrt(0.3**2 - 0.18**2)
    assert hit.begin == pytest.approx((1 - gap) / 5, abs=1e-11)
    assert hit.approach_speed == pytest.approx(5 * gap / 0.3)
    normal = np.array([gap, 0.18]) / 0.3
    expected = np.array([4, 0.5]) - hit.impulse / 3 * normal
    assert velocity(result, "one.c")[-1] == pytest.approx(expected)
    assert abs(speed(result, "one")).max() < 1e-13


def test_a_ball_that_lies_on_the_floor_passes_a_blow_on():
    """Moreau's law: the lower ball stays, the upper one returns with e times its speed."""
    result = alone(f"""
bodies:
  upper: {{type: rigid, mass: 1, inertia: 0, points: {{c: [0, 0]}}}}
  lower: {{type: rigid, mass: 2, inertia: 0, points: {{c: [0, 0]}}}}
{FLOOR}
contacts:
  carry:
    type: point_on_line
    point: lower.c
    line: [floor.a, floor.b]
    law: {{type: impulse, restitution: 0.5}}
  meet:
    type: circle_on_circle
    circles: [{{at: upper.c, radius: 0.1}}, {{at: lower.c, radius: 0.1}}]
    law: {{type: impulse, restitution: 0.5}}
gravity: 9.81
initial: {{positions: {{upper: [0, 1.2], lower: [0, 0]}}}}
run: {{duration: 0.6}}
accuracy: {{tolerance: 1.0e-6}}
""")
    hit = impacts(result, "meet")[0]
    before = sqrt(2 * G)
    assert hit.begin == pytest.approx(sqrt(2 / G), abs=1e-11)
    assert (hit.impulse, hit.separation_speed) == pytest.approx((1.5 * before, 0.5 * before))
    (carry,) = result.intervals["carry"]
    assert carry.lasts
    assert carry.impulse == pytest.approx(2 * G * 0.6 + hit.impulse)
    assert balanced(result)


# --- levers and drives ------------------------------------------------------------------------

LEVER = """
bodies:
  lever:
    type: rigid
    mass: 2
    inertia: 0.5
    centre_of_mass: [0.5, 0]
    points: {o: [0, 0], tip: [1, 0]}
  stop: {type: rigid, mass: 1, inertia: 1, points: {o: [0, 0], a: [0, 0], b: [1, 0]}}
joints:
  pivot: {type: revolute, points: [ground, lever.o], at: [0, 0]}
  hold: {type: weld, points: [ground, stop.o], at: [0.5, 0]}
contacts:
  rest:
    type: point_on_line
    point: lever.tip
    line: [stop.a, stop.b]
    law: {type: impulse, restitution: 0.3}
gravity: 9.81
initial: {angles: {lever: 0}}
run: {duration: 1, sample: 1 ms}
accuracy: {tolerance: 1.0e-8}
"""


def test_a_lever_that_drops_on_its_stop_bounces_by_its_speed_there():
    """Inertia J about the pivot: omega^2 = 2 m g c sin(a)/J, impulse (1 + e) J omega/l."""
    result = alone(LEVER, "initial.angles.lever=0.5")
    hits = impacts(result, "rest")
    inertia = 0.5 + 2 * 0.25
    omega = sqrt(2 * 2 * G * 0.5 * sin(0.5) / inertia)
    assert hits[0].approach_speed == pytest.approx(omega, abs=1e-8)
    assert hits[0].impulse == pytest.approx(1.3 * inertia * omega, abs=1e-8)
    assert hits[0].energy_lost == pytest.approx(0.5 * 0.91 * inertia * omega**2, abs=1e-7)
    assert hits[1].approach_speed == pytest.approx(0.3 * omega, abs=1e-8)
    assert balanced(result)


def test_a_drive_that_keeps_its_speed_works_in_an_impact():
    """A mass at rest leaves with (1 + e) times the arm's speed, which the drive pays for."""
    e, v = 0.5, 3.0
    result = alone(arm_and_ball((0.5, 1.5), "angles: {arm: -0.3}", 0.2))
    (hit,) = result.intervals["push"]
    assert hit.begin == pytest.approx(0.1, abs=1e-11)
    assert hit.impulse == pytest.approx(2 * (1 + e) * v)
    assert hit.motor_work == pytest.approx(2 * (1 + e) * v * v)
    assert hit.energy_lost == pytest.approx(0.5 * 2 * (1 - e * e) * v * v)
    assert velocity(result, "ball.c")[-1] == pytest.approx([0, (1 + e) * v])
    assert result.energy.supplied[-1] == pytest.approx(hit.motor_work)
    assert balanced(result)


# --- loops ------------------------------------------------------------------------------------

PARALLELOGRAM = """
bodies:
  left: &crank {type: rigid, mass: 1, inertia: 0.1, points: {a: [0, 0], b: [0.5, 0]}}
  right: *crank
  coupler: {type: rigid, mass: 2, inertia: 0.3, points: {a: [0, 0], b: [1, 0], nose: [1.2, 0]}}
  stop: {type: rigid, mass: 1, inertia: 1, points: {o: [0, 0], a: [0, 1], b: [0, -1]}}
joints:
  o: {type: revolute, points: [ground, left.a], at: [0, 0]}
  p: {type: revolute, points: [ground, right.a], at: [1, 0]}
  l: {type: revolute, points: [left.b, coupler.a]}
  r: {type: revolute, points: [right.b, coupler.b]}
  hold: {type: weld, points: [ground, stop.o], at: [1.5, 0.4]}
contacts:
  nose:
    type: point_on_line
    point: coupler.nose
    line: [stop.a, stop.b]
    side: right
    law: {type: impulse, restitution: 0.7}
initial:
  angles: {left: 2, right: 2, coupler: 0}
  speeds: {left: -2}
run: {duration: 1}
accuracy: {tolerance: 1.0e-8}
"""


def test_a_parallelogram_bounces_back_from_a_stop():
    """The cranks turn at -e times their speed from the angle at which the nose meets the stop."""
    result = alone(PARALLELOGRAM)
    meets = np.arccos((1.5 - 1.2) / 0.5)
    (hit,) = result.intervals["nose"]
    assert hit.begin == pytest.approx((2 - meets) / 2, abs=1e-9)
    inertia = 2 * 0.1 + 2 * 0.25
    assert hit.approach_speed == pytest.approx(2 * 0.5 * sin(meets), abs=1e-9)
    assert hit.impulse == pytest.approx(1.7 * inertia * 2 / (0.5 * sin(meets)), rel=1e-8)
    assert hit.energy_lost == pytest.approx(0.5 * 0.51 * inertia * 4, rel=1e-8)
    assert angle(result, "left")[-1] == pytest.approx(meets + 1.4 * (1 - hit.begin), abs=1e-8)
    assert balanced(result)


# --- what can't be ----------------------------------------------------------------------------


def test_a_driven_arm_that_presses_a_ball_on_the_floor_ends_the_run():
    """Nothing gives way: the run says so, and keeps what it computed."""
    text = f"""
bodies:
  arm: {{type: rigid, mass: 1, inertia: 0.1, points: {{o: [0, 0], a: [0, 0], b: [2, 0]}}}}
  ball: {{type: rigid, mass: 2, inertia: 0, points: {{c: [0, 0]}}}}
{FLOOR}
  pivot: {{type: revolute, points: [ground, arm.o], at: [0, 0]}}
drives: {{turn: {{type: speed, joint: pivot, value: -1}}}}
contacts:
  above:
    type: point_on_line
    point: ball.c
    line: [arm.b, arm.a]
    law: {{type: impulse, restitution: 0.5}}
  below:
    type: point_on_line
    point: ball.c
    line: [floor.a, floor.b]
    law: {{type: impulse, restitution: 0.5}}
gravity: 9.81
initial:
  angles: {{arm: 0.2}}
  positions: {{ball: [1, 0]}}
  speeds: {{arm: -1}}
run: {{duration: 1}}
accuracy: {{tolerance: 1.0e-6}}
"""
    result = simulate(scene(text), measure=False)
    assert not result.outcome.completed
    assert result.outcome.time == pytest.approx(0.2, abs=1e-9)
    assert "can't hold" in result.outcome.reason
    assert "torque" in result.outcome.advice
    assert result.time[-1] == pytest.approx(0.2, abs=1e-9)
