"""Contacts by impulse that last, in minimal coordinates: reactions and release by closed forms."""

from math import cos, radians, sin, sqrt

import numpy as np
import pytest
from physics_tools import (
    FLOOR,
    alone,
    angle,
    arm_and_ball,
    scene,
    speed,
    tree_contacts,
    where,
)
from scipy.optimize import brentq
from test_physics_impulse import LEVER, balanced

from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.mechanism.tree import tree_layout

G = 9.81

# --- bodies that rest -------------------------------------------------------------------------


def table(*legs):
    """A table that stands on some of its legs."""
    contacts = "".join(
        f"  {leg}: {{type: point_on_line, point: table.{leg}, line: [floor.a, floor.b], "
        "law: {type: impulse, restitution: 0.5}}\n"
        for leg in legs
    )
    return f"""
bodies:
  table:
    type: rigid
    mass: 4
    inertia: 0.3
    centre_of_mass: [0.1, 0.2]
    points: {{left: [-0.5, 0], middle: [0, 0], right: [0.5, 0]}}
{FLOOR}
contacts:
{contacts}
gravity: 9.81
initial: {{positions: {{table: [0, 0.5]}}}}
run: {{duration: 2}}
accuracy: {{tolerance: 1.0e-6}}
"""


def test_a_table_that_falls_flat_bounces_flat_and_rests_by_statics():
    """Both legs strike at once: the table keeps level, and each carries by the lever rule."""
    result = alone(table("left", "right"))
    left, right = (list(result.intervals[leg]) for leg in ("left", "right"))
    assert len(left) == len(right) > 10
    first, v = sqrt(2 * 0.5 / G), sqrt(G)
    assert left[1].begin == pytest.approx(2 * first, abs=1e-9)
    assert [hit.begin for hit in left] == [hit.begin for hit in right]
    total = 4 * 1.5 * v
    assert (left[0].impulse, right[0].impulse) == pytest.approx((0.4 * total, 0.6 * total))
    lost = left[0].energy_lost + right[0].energy_lost
    assert lost == pytest.approx(0.5 * 4 * 0.75 * v * v)
    assert abs(angle(result, "table")).max() < 1e-9
    assert left[-1].begin == pytest.approx(first * 1.5 / 0.5, abs=2e-6)
    assert result.contacts["left"].force[-1] == pytest.approx(0.4 * 4 * G)
    assert result.contacts["right"].force[-1] == pytest.approx(0.6 * 4 * G)
    assert balanced(result)


def test_three_legs_carry_a_table_though_two_would_do():
    legs = ("left", "middle", "right")
    result = alone(table(*legs), "initial.positions.table=[0, 0]", "run.duration=0.2")
    left, middle, right = (result.contacts[leg].force[-1] for leg in legs)
    assert left + middle + right == pytest.approx(4 * G)
    assert right - left == pytest.approx(0.1 * 4 * G / 0.5)
    assert middle == pytest.approx((left + right) / 2)  # the least forces
    assert abs(angle(result, "table")).max() < 1e-12


SLOPE = radians(20)
CHUTE = f"""
bodies:
  ball: {{type: rigid, mass: 2, inertia: 0, points: {{c: [0, 0]}}}}
  chute:
    type: rigid
    mass: 1
    inertia: 1
    points: {{o: [0, 0], a: [0, 0], b: [{cos(SLOPE)}, {-sin(SLOPE)}]}}
joints: {{hold: {{type: weld, points: [ground, chute.o], at: [0, 0]}}}}
contacts:
  slide:
    type: point_on_line
    point: ball.c
    line: [chute.a, chute.b]
    law: {{type: impulse, restitution: 0.5}}
gravity: 9.81
initial: {{positions: {{ball: [{0.1 * cos(SLOPE)}, {-0.1 * sin(SLOPE)}]}}}}
run: {{duration: 1}}
accuracy: {{tolerance: 1.0e-8}}
"""


def test_a_ball_slides_down_and_off_the_end_of_a_chute():
    """It goes down by g sin a, pressed by m g cos a, and falls freely from the end."""
    result = alone(CHUTE)
    (touch,) = result.intervals["slide"]
    assert touch.begin == 0
    assert touch.end == pytest.approx(sqrt(2 * 0.9 / (G * sin(SLOPE))), abs=1e-9)
    assert touch.slides_off
    assert touch.peak_force == pytest.approx(2 * G * cos(SLOPE))
    assert touch.impulse == pytest.approx(2 * G * cos(SLOPE) * touch.end)
    v, fall = sqrt(2 * 0.9 * G * sin(SLOPE)), 1 - touch.end
    end = np.array([cos(SLOPE), -sin(SLOPE)])
    expected = end * (1 + v * fall) + [0, -0.5 * G * fall**2]
    assert where(result, "ball.c")[-1] == pytest.approx(expected, abs=1e-8)
    assert balanced(result)


# --- springs that are just unloaded -------------------------------------------------------------

BUFFER = """
bodies:
  bar:
    type: rigid
    mass: 2
    inertia: 0.02
    centre_of_mass: [0.4, 0]
    points: {pivot: [0, 0], tip: [0.5, 0]}
  bumper:
    type: rigid
    mass: 1.0e-3
    inertia: 1.0e-9
    points: {low: [0, -0.05], mid: [0, 0], high: [0, 0.05]}
joints:
  pivot: {type: revolute, points: [ground, bar.pivot], at: [0, 0]}
  way: {type: prismatic, points: [ground, bumper.mid], at: [0, -0.5], axis: [1, 0]}
springs: {buffer: {type: linear, joint: way, stiffness: 20 N/mm, length: 0}}
contacts:
  hit:
    type: point_on_line
    point: bar.tip
    line: [bumper.low, bumper.high]
    side: right
    law: {type: impulse, restitution: 0}
gravity: 9.81
initial: {angles: {bar: 0}, along: {way: 0}}
run: {duration: 0.45}
accuracy: {tolerance: 3.0e-7}
"""


@pytest.mark.parametrize("begin", [-20, -40, -60])
def test_a_bar_that_hangs_straight_presses_a_light_bumper_that_is_just_unloaded(begin):
    """Nothing but rounding accelerates the gap as it closes; then the spring presses, and lets go.

    It lets go where it is unloaded again, at the speed that the impact left. Energy gives the time
    until then: ``(I + m l^2 cos^2 a) a'^2 / 2`` at the bar's angle a from where it hangs.
    """
    result = alone(BUFFER, f"initial.angles.bar={begin} deg")
    inertia, light, length, stiffness = 0.02 + 2 * 0.4**2, 1e-3, 0.5, 2e4
    before = sqrt(2 * 2 * G * 0.4 * (1 + sin(radians(begin))) / inertia)
    after = before * inertia / (inertia + light * length**2)
    impact, lasting = result.intervals["hit"]
    assert impact.impulse == pytest.approx(light * length * after, rel=1e-5)
    lost = 0.5 * inertia * before * (before - after)
    assert impact.energy_lost == pytest.approx(lost, rel=1e-5)
    assert lasting.energy_lost == pytest.approx(0, abs=1e-7)

    def left(a):
        lifted = 2 * G * 0.4 * (1 - cos(a)) + 0.5 * stiffness * (length * sin(a)) ** 2
        return 0.5 * (inertia + light * length**2) * after**2 - lifted

    turn = brentq(left, 0, 0.5)
    parts = (np.arange(200) + 0.5) * np.pi / 400  # a = turn sin(part) takes the root's end away
    angles = turn * np.sin(parts)
    speeds = [
        sqrt(2 * left(a) / (inertia + light * (length * cos(a)) ** 2)) for a in angles.tolist()
    ]
    pressed = 2 * np.sum(turn * np.cos(parts) / speeds) * np.pi / 400
    assert lasting.begin == pytest.approx(impact.begin, abs=1e-9)
    assert lasting.end - lasting.begin == pytest.approx(pressed, abs=1e-6)
    back = result.time > lasting.end + 0.01
    hanging = angle(result, "bar")[back] + np.pi / 2
    energy = 0.5 * inertia * after**2 - 2 * G * 0.4 * (1 - np.cos(hanging))
    assert speed(result, "bar")[back] == pytest.approx(np.sqrt(2 * energy / inertia), abs=1e-6)
    # What the spring stores is off by no more than its largest force times the tolerance.
    assert result.checks.energy_residual < stiffness * length * sin(turn) * 3e-7


# --- drives ---------------------------------------------------------------------------------


def test_a_lever_is_lifted_off_its_stop_as_the_torque_outweighs_it():
    """The stop carries m g/2 - T/l until that is nothing."""
    drive = "drives: {lift: {type: torque, joint: pivot, value: 20, ramp: 1}}\n"
    result = alone(LEVER + drive)
    (touch,) = result.intervals["rest"]

    def torque(t):
        return 20 * t**3 * (10 - 15 * t + 6 * t * t)

    lifted = brentq(lambda t: G - torque(t), 0, 1)
    assert (touch.begin, touch.end) == pytest.approx((0, lifted), abs=1e-9)
    assert not touch.slides_off
    assert touch.energy_lost == pytest.approx(0, abs=1e-12)
    force = np.where(result.time < touch.end, G - torque(result.time), 0)
    assert result.contacts["rest"].force == pytest.approx(force, abs=1e-8)
    i = np.searchsorted(result.time, touch.end)
    assert angle(result, "lever")[:i].max() < 1e-12
    assert angle(result, "lever")[-1] > 0.1
    assert balanced(result)


def test_a_turning_arm_carries_a_ball_outwards():
    """Pressed along a driven straight groove it goes as r0 cosh(w t), by 2 m w r'."""
    omega = 3.0
    start = "angles: {arm: 0}, velocities: {ball: [0, 3]}"
    result = alone(arm_and_ball((0, 5), start, 0.5))
    (touch,) = result.intervals["push"]
    assert (touch.begin, touch.lasts) == (0, True)
    radius = np.cosh(omega * result.time)
    turned = np.column_stack([np.cos(omega * result.time), np.sin(omega * result.time)])
    assert where(result, "ball.c") == pytest.approx(radius[:, None] * turned, abs=1e-8)
    force = 2 * 2 * omega**2 * np.sinh(omega * result.time)
    assert result.contacts["push"].force[1:] == pytest.approx(force[1:], abs=1e-5)
    assert abs(result.contacts["push"].gap).max() < 1e-9


# --- accelerations of gaps --------------------------------------------------------------------

TURNING = """
curves:
  egg: {type: spline, points: [[0.9, 0], [0, 0.6], [-0.5, 0], [0, -0.6]], closed: true, on: ball}
bodies:
  arm:
    type: rigid
    mass: 1
    inertia: 0.1
    points: {o: [0, 0], e: [0.7, 0.1], a: [0.2, 0.1], b: [0.9, 0.3]}
  hand: {type: rigid, mass: 1, inertia: 0.1, points: {o: [0, 0], a: [0.1, -0.2], b: [0.8, 0.1]}}
  ball: {type: rigid, mass: 1, inertia: 0.1, points: {c: [0.1, 0.05]}}
joints:
  pivot: {type: revolute, points: [ground, arm.o], at: [0, 0]}
  wrist: {type: revolute, points: [arm.e, hand.o]}
contacts:
  on_arm:
    type: point_on_line
    point: ball.c
    line: [arm.a, arm.b]
    law: &law {type: impulse, restitution: 0}
  on_hand: {type: point_on_line, side: right, point: ball.c, line: [hand.a, hand.b], law: *law}
  of_hand:
    type: circle_on_circle
    circles: [{at: hand.b, radius: 0.1}, {at: ball.c, radius: 0.2}]
    law: *law
  within:
    type: circle_on_circle
    circles: [{at: ball.c, radius: 0.1}, {at: arm.b, radius: 5, inside: true}]
    law: *law
  on_egg: {type: point_on_curve, point: hand.b, curve: egg, side: right, radius: 0.05, law: *law}
  flat: {type: line_on_curve, line: [hand.a, hand.b], side: right, curve: egg, law: *law}
initial: {angles: {arm: 0.3, hand: 0.9}, positions: {ball: [2, 1.5]}}
run: {duration: 1}
accuracy: {tolerance: 1.0e-6}
"""


@pytest.mark.parametrize("name", ["on_arm", "on_hand", "of_hand", "within", "on_egg", "flat"])
def test_gaps_bend_at_steady_speeds_as_their_rates_change(name):
    """Against differences of the gap's rate along the motion, of any speeds."""
    mechanism = assemble_scene(scene(TURNING)).mechanism
    layout, random = tree_layout(mechanism), np.random.default_rng(1)
    k = next(k for k, contact in enumerate(mechanism.contacts) if contact.name == name)
    contacts, count = tree_contacts(mechanism), len(layout.links)
    for _ in range(5):
        x, v = random.uniform(0.5, 1.5, count), random.uniform(-2, 2, count)
        steps = np.array([-2, -1, 1, 2]) * 1e-3
        rates = [contacts.touch(k, x + h * v, v).gap_rate for h in steps]
        slope = np.array(rates) @ [1 / 12, -2 / 3, 2 / 3, -1 / 12] / 1e-3
        moving = contacts.kinematics.moving(x, v)
        bend = contacts.whole_group.gap_bends(moving, contacts.whole_group.look(moving)[0])
        assert bend[k] == pytest.approx(slope, abs=1e-8)
