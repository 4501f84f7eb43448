"""Dry friction in joints beside impacts: what slides, strikes, sticks and rests on a stop.

Numbers are exact flights, which DOP853 confirms.
"""

import numpy as np
import pytest
from physics_tools import alone

SHAKEN = """
bodies: {block: {type: rigid, mass: 1, inertia: 0.01, points: {o: [0, 0]}}}
joints:
  way: {type: prismatic, points: [ground, block.o], at: [0, 0], axis: [1, 0],
        friction: {force: 2 N},
        limits: {from: -0.03, to: 0.03, law: {type: impulse, restitution: 0.7}}}
drives: {shaker: {type: force, point: block.o, value: [4*sin(8*t), 0]}}
run: {duration: 2.1}
accuracy: {tolerance: 1.0e-10}
"""
LEVER = """
bodies:
  rod: {type: rigid, mass: 1.2, inertia: 0.064, centre_of_mass: [0.4, 0], points: {o: [0, 0]}}
joints:
  pin: {type: revolute, points: [ground, rod.o], at: [0, 0], friction: {torque: 0.8},
        limits: {from: 0, law: {type: impulse, restitution: 0.6}}}
gravity: [0, -9.81]
initial: {angles: {rod: 40 deg}}
run: {duration: 1}
accuracy: {tolerance: 1.0e-10}
"""


def hits(result, name):
    """Begin, speed in and place of the bounces at a stop."""
    return np.array([(hit.begin, hit.approach_speed) for hit in result.intervals[name]])


def test_a_shaken_block_strikes_and_sticks():
    """5A: friction turns its sign at once as the block bounces off."""
    result = alone(SHAKEN)
    right = [0.2828464219, 1.070969313, 1.873581348], [0.3172491459, 0.3944467506, 0.3821552774]
    np.testing.assert_allclose(hits(result, "way.to"), np.transpose(right), atol=1e-8)
    left = [0.7493555742, 1.525173215], [0.3299579272, 0.3368250326]
    np.testing.assert_allclose(hits(result, "way.from"), np.transpose(left), atol=1e-8)
    friction = result.frictions["way"]
    rests = [0, 0.3321546269, 1.136447771, 1.947455758]
    slips = [0.06544984695, 0.4581489286, 1.243547092, 2.028945255]
    np.testing.assert_allclose(friction.begin, rests, atol=1e-8)
    np.testing.assert_allclose(friction.end, slips, atol=1e-8)
    places = [float(result.poses[np.searchsorted(result.time, t), 0, 0]) for t in rests[1:]]
    np.testing.assert_allclose(places, [0.02477225155, 0.02157596626, 0.02109043285], atol=1e-8)
    assert result.checks.energy_residual < 1e-10


def test_a_lever_bounces_ever_lower_and_rests_on_its_stop():
    """5B: bounces fall by e sqrt((G - F)/(G + F)); then stop and friction share the load."""
    result = alone(LEVER)
    right = [
        [0.3405298539, 4.391267022],
        [0.6101820298, 2.21769249],
        [0.7454852122, 1.120790271],
        [0.8138370778, 0.5664576244],
    ]
    bounces = hits(result, "pin.from")
    np.testing.assert_allclose(bounces[:4], right, atol=1e-7)
    ratios = bounces[7:12, 1] / bounces[6:11, 1]
    np.testing.assert_allclose(ratios, 0.5054107471, atol=1e-4)
    *bouncing, last = result.intervals["pin.from"]
    assert last.begin == pytest.approx(0.8836822744, abs=1e-6)
    assert last.end == np.inf
    total = sum(hit.impulse for hit in bouncing)
    load = 1.2 * 9.81 * 0.4
    after = np.searchsorted(result.time, 0.95)
    held = result.contacts["pin.from"].force[after] - result.frictions["pin"].torque[after]
    assert held == pytest.approx(load)
    assert total == pytest.approx(3.63522411, abs=1e-5)
    assert np.abs(result.poses[after:, 0, 2]).max() < 1e-9


def test_a_lever_sticks_in_the_air():
    """5C: more friction than weight, a stop at 75 degrees."""
    result = alone(
        LEVER,
        "joints.pin.friction.torque=1.5",
        "joints.pin.limits={from: 75 deg, law: {type: impulse, restitution: 0.8}}",
        "initial={angles: {rod: 85 deg}, speeds: {rod: -2}}",
        "run.duration=0.5",
    )
    np.testing.assert_allclose(hits(result, "pin.from"), [[0.09428788705, 1.751630213]], atol=1e-8)
    friction = result.frictions["pin"]
    assert friction.begin == pytest.approx([0.2433089112], abs=1e-8)
    assert result.poses[-1, 0, 2] == pytest.approx(1.410061061, abs=1e-9)
    assert abs(friction.torque[-1]) == pytest.approx(0.7536153669, abs=1e-8)


def test_a_stop_bears_what_friction_does_not():
    """A torque pulls the resting lever off: it leaves as the torque beats weight and friction."""
    result = alone(
        LEVER,
        "initial={angles: {rod: 0}}",
        "drives={lift: {type: torque, joint: pin, value: 10*t}}",
        "run.duration=0.7",
    )
    load = 1.2 * 9.81 * 0.4
    (touch,) = result.intervals["pin.from"]
    assert touch.end == pytest.approx(load / 10, abs=1e-9)
    assert result.frictions["pin"].end == pytest.approx([(load + 0.8) / 10], abs=1e-9)


STRUCK = """
bodies:
  arm: {type: rigid, mass: 1.0, inertia: 0.0833333333333, centre_of_mass: [0.5, 0],
        points: {o: [0, 0], tip: [0.9, 0]}}
  ball: {type: rigid, mass: 0.2, inertia: 1.0e-4, points: {c: [0, 0]}}
joints:
  pin: {type: revolute, points: [ground, arm.o], at: [0, 0],
        friction: {coefficient: 0.3, radius: 0.05}}
contacts:
  hit: {type: point_on_line, point: ball.c, line: [arm.o, arm.tip],
        law: {type: impulse, restitution: 0.5}}
initial: {positions: {ball: [0.9, 0.1]}, velocities: {ball: [0, -2]}}
run: {duration: 0.06}
accuracy: {tolerance: 1.0e-10}
"""


def test_friction_in_a_pin_takes_its_part_of_an_impact():
    """By hand: the pin's impulse R is what the arm's momentum lacks, and friction takes 0.3 r |R|.

    With the impulse p on the tip at L: ``J w = L p - T``, ``m l w = p + R``, ``T = share |R|``.
    """
    result = alone(STRUCK)
    (hit,) = result.intervals["hit"]
    inertia, arm, ball, share, speed = 1 / 3, 0.9, 0.2, 0.3 * 0.05, 2.0
    # R points as p does: the tip is beyond the centre of percussion, at 2/3.
    turned = (arm + share) * hit.impulse / (inertia + share * 0.5)
    reaction = 0.5 * turned - hit.impulse
    assert reaction > 0
    lost_in_pin = share * reaction * turned / 2
    after = hit.impulse / ball - speed + arm * turned
    assert after == pytest.approx(0.5 * speed, abs=1e-8)
    assert -result.rates[-1, 0, 2] == pytest.approx(turned - lost_later(turned), abs=1e-6)
    lost = result.frictions["pin"].lost
    now = np.searchsorted(result.time, hit.begin, side="right") - 1
    assert lost[now] == pytest.approx(lost_in_pin, abs=1e-7)
    assert result.checks.energy_residual < 1e-10


def lost_later(turned):
    """By how much friction slows the arm within 0.01 s: by its own centrifugal force."""
    rate = 0.3 * 0.05 * 0.5 * 3  # share m l / J
    return turned - turned / (1 + rate * turned * 0.01)


TIPPING = """
bodies:
  floor: {type: rigid, mass: 1, inertia: 1, points: {a: [-2, 0], b: [2, 0]}}
  bar: {type: rigid, mass: 1, inertia: 0.01, points: {o: [0, 0.1], l: [-0.1, 0], r: [0.1, 0]}}
  wheel: {type: rigid, mass: 1, inertia: 1, points: {o: [0, 0], side: [0.5, 0]}}
joints:
  base: {type: weld, points: [ground, floor.a], at: [-2, 0]}
  hub: {type: revolute, points: [bar.o, wheel.o]}
contacts:
  l: {type: point_on_line, point: bar.l, line: [floor.a, floor.b],
      law: {type: impulse, restitution: 0}}
  r: {type: point_on_line, point: bar.r, line: [floor.a, floor.b],
      law: {type: impulse, restitution: 0}}
drives: {load: {type: force, point: wheel.side, value: [0, -8]}}
gravity: [0, -9.81]
initial: {positions: {bar: [0, 0]}}
run: {duration: 0.05}
accuracy: {tolerance: 1.0e-8}
"""


@pytest.mark.parametrize("holds", ["friction: {torque: 100}", "freewheel: forward"])
def test_a_light_bar_tips_at_once_with_the_heavy_wheel_that_it_holds(holds):
    """As one body: about the right foot 3.2 N m of the load are more than 1.962 of the weight."""
    result = alone(TIPPING.replace("bar.o, wheel.o]", f"bar.o, wheel.o], {holds}"))
    assert len(result.intervals["l"].begin) == 0
    (right,) = result.intervals["r"]
    assert right.lasts
    # The floor is smooth: the foot slides, and the centre of both, 0.1 m beside it, falls upright.
    inertia = 0.01 + 1 + 2 * 0.05**2 + 2 * 0.1**2
    rate = -(3.2 - 1.962) / inertia * 0.05
    assert result.rates[-1, 1:, 2] == pytest.approx([rate, rate], rel=1e-3)
