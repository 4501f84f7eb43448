"""Contacts by impulse in Exudyn's minimal coordinates: closed forms of impact, rest and release."""

from math import sin, sqrt

import numpy as np
import pytest
from physics_tools import FLOOR, MODELS, alone, angle, arm_and_ball, scene, speed, velocity

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.engines.lagrangian.run import prepare
from exudyn_flexlink.engines.touching import Change
from exudyn_flexlink.loading import load_scene

G = 9.81


def impacts(result, name):
    """Contacts without duration."""
    return [touch for touch in result.intervals[name] if touch.impact]


def balanced(result):
    """Whether energy is what it was, but for losses and drives."""
    checks = result.checks
    return checks.energy_residual < 1e-9 * checks.largest_kinetic_energy


STEPPED = """
bodies: {block: {type: rigid, mass: 1, inertia: 1, points: {b: [0, 0]}}}
joints: {way: {type: prismatic, points: [ground, block.b], at: [0, 0], axis: [0, 1]}}
curves: {floor: {type: line, from: [-1, 0], to: [1, 0]}}
contacts:
  on: {type: point_on_curve, point: block.b, curve: floor, law: {type: impulse, restitution: 0}}
drives: {lift: {type: force, point: block.b, value: [0, "where(t < 0.5, 0, LIFT)"]}}
gravity: 9.81
initial: {along: {way: 0}}
run: {duration: 1}
accuracy: {tolerance: 1.0e-8}
"""


@pytest.mark.parametrize("lift", [9, 9.82, 20])
def test_what_a_force_lifts_all_at_once_leaves_the_floor(lift):
    result = alone(STEPPED.replace("LIFT", f"{lift}"))
    assert result.poses[-1, 0, 1] == pytest.approx(max(0, lift - G) / 2 * 0.25, abs=1e-8)
    (touch,) = result.intervals["on"]
    assert touch.lasts if lift < G else touch.end == pytest.approx(0.5)
    assert balanced(result) or lift < G


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
    result = simulate(scene(text))
    assert not result.outcome.completed
    assert result.outcome.time == pytest.approx(0.2, abs=1e-9)
    assert "can't hold" in result.outcome.reason
    assert "torque" in result.outcome.advice
    assert result.time[-1] == pytest.approx(0.2, abs=1e-9)


# --- bodies that touch one another ------------------------------------------------------------


def cradle(play, restitution):
    """Three balls of 1 kg in a row; the first comes at 1 m/s, the others touch but for a play."""
    places = [-0.3, 0.0, 0.1 + play]
    lines = [
        "bodies:",
        *(f"  b{i}: {{type: rigid, mass: 1, inertia: 1, points: {{c: [0, 0]}}}}" for i in range(3)),
        "joints:",
        *(
            f"  s{i}: {{type: prismatic, points: [ground, b{i}.c], at: [0, 0], axis: [1, 0]}}"
            for i in range(3)
        ),
        "contacts:",
        *(
            f"  k{i}: {{type: circle_on_circle, circles: [{{at: b{i}.c, radius: 0.05}},"
            f" {{at: b{i + 1}.c, radius: 0.05}}],"
            f" law: {{type: impulse, restitution: {restitution}}}}}"
            for i in range(2)
        ),
        "initial:",
        "  velocities: {b0: [1, 0]}",
        "  positions: {" + ", ".join(f"b{i}: [{x}, 0]" for i, x in enumerate(places)) + "}",
        "run: {duration: 0.4}",
        "accuracy: {tolerance: 1.0e-6}",
    ]
    return "\n".join(lines)


def test_what_touches_takes_up_an_impact_at_once_and_the_run_says_so():
    """Newton's law for both: p1 (2 - 1/2) = 2 m v, p2 = p1/2; one after the other: v and 0."""
    result = alone(cradle(0, 1))
    np.testing.assert_allclose(result.rates[-1, :, 0], [-1 / 3, 2 / 3, 2 / 3], atol=1e-9)
    (told,) = result.warnings
    assert "'k0', 'k1' took up one impact at 0.2 s" in told
    assert "Newton's law of impact holds for all of them at once" in told
    assert "in which order bodies that touch strike one another is not modelled" in told


def test_what_has_a_little_play_is_struck_in_turn():
    result = alone(cradle(1e-6, 1))
    np.testing.assert_allclose(result.rates[-1, :, 0], [0, 0, 1], atol=1e-9)
    assert result.warnings == ()


def test_where_nothing_bounces_the_order_does_not_matter():
    for play in (0, 1e-6):
        result = alone(cradle(play, 0))
        np.testing.assert_allclose(result.rates[-1, :, 0], [1 / 3] * 3, atol=1e-9)
        assert result.warnings == ()


def test_impacts_at_one_instant_that_do_not_meet_are_no_matter():
    """Two balls fall on the floor side by side: no impulse in one moves the other's gap."""
    text = """
bodies:
  a: {type: rigid, mass: 1, inertia: 1, points: {c: [0, 0]}}
  b: {type: rigid, mass: 2, inertia: 1, points: {c: [0, 0]}}
contacts:
  a: {type: circle_on_circle, circles: [{at: a.c, radius: 0.1}, {at: ground, place: [0, -1], radius: 0.5}], law: {type: impulse, restitution: 0.5}}
  b: {type: circle_on_circle, circles: [{at: b.c, radius: 0.1}, {at: ground, place: [3, -1], radius: 0.5}], law: {type: impulse, restitution: 0.5}}
gravity: [0, -9.81]
initial: {positions: {a: [0, 0], b: [3, 0]}}
run: {duration: 0.4}
accuracy: {tolerance: 1.0e-6}
"""  # noqa: E501
    result = alone(text)
    assert [len(result.contacts[name].touches) for name in "ab"] == [1, 1]
    assert result.warnings == ()


def test_the_lagrangian_says_so_where_a_lasting_contact_takes_up_an_impact():
    """A lever bounces back on a point that lies on its other side, and can't give way."""
    second = (
        "{type: point_on_line, point: link.start, line: [lever.start, lever.end], side: right, "
    )
    settings = (
        "contacts.strike.law={type: impulse, restitution: 0.5}",
        "contacts.second=" + second + "law: {type: impulse, restitution: 0}}",
    )
    run = prepare(load_scene(MODELS / "rigid.yaml", settings))
    problem = run.problem
    problem.v[-1] = 10.0  # rad/s, of the lever: the gap on its upper side closes
    problem.change(0.0, 1, Change.CLOSES, problem.seen)
    problem.look_now()
    problem.impacts.meet(0.0, 0)
    assert problem.impacts.together == [(0.0, ("strike", "second"))]
