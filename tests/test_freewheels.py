"""Freewheels: one way free, the other held, without a memory of the angle.

Numbers are closed forms, with the roots of these refined.
"""

import numpy as np
import pytest
from physics_tools import alone, scene

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.source import SceneError

MOTOR = """
bodies:
  motor: {type: rigid, mass: 1, inertia: 0.1, points: {hub: [0, 0]}}
  load: {type: rigid, mass: 1, inertia: 0.3, points: {hub: [0, 0]}}
joints:
  axle: {type: revolute, points: [ground, motor.hub], at: [0, 0]}
  clutch: {type: revolute, points: [motor.hub, load.hub], freewheel: forward}
run: {duration: 1}
accuracy: {tolerance: 1.0e-9}
"""
PULSES = (
    MOTOR,
    "bodies.load.inertia=0.2",
    "drives={shake: {type: speed, joint: axle, value: 10*sin(2*pi*t)},"
    " load: {type: torque, joint: clutch, value: -1}}",
    "run.duration=3.5",
)
SWITCHED = (
    MOTOR,
    # The load drags by 0.05 times its speed on the ground; what that does to the motor is put back.
    "drives={"
    "motor: {type: torque, joint: axle, value: 'where(t < 1, 2, where(t < 3, 0, 2))"
    " - 0.2*speed(axle) - 0.05*(speed(axle) + speed(clutch))'},"
    "drag: {type: torque, joint: clutch, value: -0.05*(speed(axle) + speed(clutch))}}",
    "run.duration=6",
)
BACKSTOP = """
bodies: {rod: {type: rigid, mass: 1.2, inertia: 0.064, centre_of_mass: [0.4, 0],
               points: {o: [0, 0], tip: [0.8, 0]}}}
joints: {pin: {type: revolute, points: [ground, rod.o], at: [0, 0], freewheel: forward}}
gravity: [0, -9.81]
initial: {angles: {rod: -90 deg}, speeds: {rod: 3}}
run: {duration: 1}
accuracy: {tolerance: 1.0e-10}
"""


def turning(result, time, body):
    """Rate of a body at an instant."""
    return result.rates[result.sample_at(time), result.part_names.index(body), 2]


def test_a_swinging_shaft_drives_a_flywheel_by_pulses():
    """3A: it lets go where ``J w' + T`` falls to 0, and locks where both turn alike again."""
    result = alone(*PULSES)
    clutch = result.frictions["clutch"]
    lets_go = 0.2626785534 + np.arange(4)
    np.testing.assert_allclose(clutch.end, lets_go, atol=1e-8)
    np.testing.assert_allclose(clutch.begin, [0, *(1.098283552 + np.arange(3))], atol=1e-8)
    assert clutch.torque[0] == pytest.approx(13.56637061)
    assert turning(result, lets_go[0], "load") == pytest.approx(9.968286844, abs=1e-7)
    assert turning(result, 1.098283552, "load") == pytest.approx(5.79026185, abs=1e-7)
    angle = result.poses[result.sample_at(1.098283552), :, 2]
    np.testing.assert_allclose(angle, [0.2939449422, 8.302161942], atol=1e-7)
    each = [result.poses[result.sample_at(t), 1, 2] for t in lets_go]
    assert each[1] == pytest.approx(9.72641791, abs=1e-7)
    assert np.diff(each)[1:] == pytest.approx(8.008217, abs=1e-5)
    assert clutch.torque.min() >= -1e-10


def test_a_load_runs_on_as_its_motor_is_switched_off():
    """3B: the clutch would have to brake, so that it lets go at once."""
    result = alone(*SWITCHED)
    clutch = result.frictions["clutch"]
    assert clutch.torque[0] == pytest.approx(1.5)
    before = result.sample_at(1.0 - 1e-12)
    assert clutch.torque[before] == pytest.approx(0.9887875714, abs=1e-7)
    assert clutch.end[0] == pytest.approx(1, abs=1e-9)
    assert clutch.begin[1] == pytest.approx(3.147100924, abs=1e-8)
    assert turning(result, 1.0, "load") == pytest.approx(3.717908572, abs=1e-8)
    assert turning(result, 3.0, "motor") == pytest.approx(0.06809587082, abs=1e-8)
    assert turning(result, 3.0, "load") == pytest.approx(2.663997902, abs=1e-8)
    assert turning(result, 3.147100924, "load") == pytest.approx(2.59947927, abs=1e-7)
    assert result.rates[-1, :, 2] == pytest.approx([7.092050521] * 2, abs=1e-8)


def test_a_backstop_holds_a_rod_where_it_turns_back():
    """3C: no friction, no stop at an angle."""
    result = alone(BACKSTOP)
    pin = result.frictions["pin"]
    assert pin.begin == pytest.approx([0.3782994313], abs=1e-8)
    assert result.poses[-1, 0, 2] + np.pi / 2 == pytest.approx(0.714605716, abs=1e-8)
    assert pin.torque[-1] == pytest.approx(3.085769142, abs=1e-8)
    assert pin.lost[-1] == pytest.approx(0, abs=1e-12)


def test_drag_and_lock_are_one_torque():
    """Friction brakes what overruns; locked, it helps to hold."""
    result = alone(BACKSTOP, "joints.pin.friction={torque: 0.5}")
    pin = result.frictions["pin"]
    assert pin.torque[1] == pytest.approx(-0.5)
    # G (1 - cos a) + T a = J w^2/2, at the top.
    top = result.poses[-1, 0, 2] + np.pi / 2
    weight = 1.2 * 9.81 * 0.4
    assert weight * (1 - np.cos(top)) + 0.5 * top == pytest.approx(0.5 * 0.256 * 9, abs=1e-8)
    assert pin.torque[-1] == pytest.approx(weight * np.sin(top), abs=1e-8)


STRUCK = """
bodies:
  arm: {type: rigid, mass: 1, inertia: 0.2, points: {o: [0, 0], tip: [0.5, 0]}}
  wheel: {type: rigid, mass: 1, inertia: 0.3, points: {o: [0, 0]}}
  ball: {type: rigid, mass: 0.4, inertia: 1.0e-3, points: {c: [0, 0]}}
joints:
  axle: {type: revolute, points: [ground, arm.o], at: [0, 0]}
  clutch: {type: revolute, points: [arm.o, wheel.o], freewheel: WAY}
contacts:
  hit: {type: point_on_line, point: ball.c, line: [arm.o, arm.tip],
        law: {type: impulse, restitution: 0.5}}
initial: {positions: {ball: [0.4, 0.1]}, velocities: {ball: [0, -2]}}
run: {duration: 0.06}
accuracy: {tolerance: 1.0e-10}
"""


@pytest.mark.parametrize(("way", "inertia"), [("forward", 0.2), ("backward", 0.5)])
def test_an_impact_is_passed_on_one_way_alone(way, inertia):
    """The ball turns the arm clockwise: backward, the wheel is taken along, without a bounce."""
    result = alone(STRUCK.replace("WAY", way))
    (hit,) = result.intervals["hit"]
    mass = 1 / (1 / 0.4 + 0.4**2 / inertia)
    assert hit.impulse == pytest.approx(1.5 * 2 * mass)
    turned = -0.4 * hit.impulse / inertia
    along = turned if way == "backward" else 0.0
    assert result.rates[-1, :2, 2] == pytest.approx([turned, along], abs=1e-10)
    assert result.checks.energy_residual < 1e-12


def test_a_light_arm_passes_an_impact_on_to_a_heavy_wheel_where_it_rubs_too():
    """The arm has a fifteenth of the wheel's inertia, the ball much more than both there."""
    result = alone(
        STRUCK.replace("WAY", "backward"),
        "bodies.arm.inertia=0.02",
        "bodies.ball.mass=4",
        "contacts.hit.law={type: impulse, restitution: 0.5, friction: 0.1}",
        "initial.velocities.ball=[1, -2]",
        "initial.positions.ball=[0.35, 0.1]",
    )
    (hit,) = result.intervals["hit"]
    mass = 1 / (1 / 4 + 0.4**2 / 0.32)
    assert hit.impulse == pytest.approx(1.5 * 2 * mass)
    assert result.rates[-1, :2, 2] == pytest.approx([-0.4 * hit.impulse / 0.32] * 2, abs=1e-10)
    assert result.rates[-1, 2, 0] == pytest.approx(1 - 0.1 * hit.impulse / 4)
    assert result.checks.energy_residual < 1e-12


LIGHT = (
    MOTOR,
    "bodies.motor.inertia=0.001",
    "joints.axle.limits={from: -10 deg, to: 1 rad, law: {type: impulse, restitution: 0.5}}",
    "run.duration=0.2",
)


def test_a_stop_turns_back_all_that_hangs_on_a_locked_freewheel():
    """The wheel, with 300 times the inertia of what is stopped, comes back with it."""
    result = alone(*LIGHT, "initial.speeds={motor: -2, load: -2}")
    (hit,) = result.intervals["axle.from"]
    assert hit.impulse == pytest.approx(0.301 * 3)
    assert result.rates[-1, :, 2] == pytest.approx([1, 1], abs=1e-10)


def test_what_is_caught_up_with_in_an_impact_costs_the_contact_energy():
    """The stop throws what is light after the wheel, which locks; friction would lose nothing."""
    result = alone(*LIGHT, "bodies.motor.inertia=0.1", "initial.speeds={motor: -2, load: 0.5}")
    (hit,) = result.intervals["axle.from"]
    assert result.rates[-1, :, 2] == pytest.approx([1, 1], abs=1e-10)
    energy = [0.1 * 4 + 0.3 * 0.25, 0.4]
    assert hit.energy_lost == pytest.approx((energy[0] - energy[1]) / 2)
    assert np.abs(result.frictions["clutch"].lost).max() < 1e-12


def test_an_impact_that_would_gain_energy_ends_the_run():
    """The stop, which loses nothing, throws what is light after the wheel that is just faster."""
    law = "joints.axle.limits.law.restitution=1"
    outcome = simulate(scene(*LIGHT, law, "initial.speeds={motor: -2, load: 0.5}"), measure=False)
    assert outcome.outcome.time == pytest.approx(np.radians(10) / 2, abs=1e-9)
    assert "restitution of 'axle.from' with a freewheel would gain energy" in outcome.outcome.reason


BACKWARD = "'clutch' is turned the way in which it locks"


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (["initial.speeds={motor: 5}"], BACKWARD),
        (["drives={back: {type: speed, joint: clutch, value: -1}}"], BACKWARD),
        (
            [
                "joints.clutch.clearance=0.1 mm",
                "joints.clutch.law={type: penalty, stiffness: 1e6, restitution: 0.5}",
            ],
            "a freewheel has no clearance",
        ),
        (["joints.clutch.freewheel=left"], "one of forward, backward"),
    ],
    ids=["start", "drive", "clearance", "a word"],
)
def test_what_a_freewheel_can_not_do_is_refused(settings, message):
    with pytest.raises(SceneError, match=message):
        simulate(scene(MOTOR, *settings), measure=False)


def test_a_drive_that_turns_it_back_ends_the_run():
    drive = "drives={back: {type: speed, joint: clutch, value: cos(2*pi*t)}}"
    outcome = simulate(scene(MOTOR, drive), measure=False).outcome
    assert outcome.time == pytest.approx(0.25, abs=1e-6)
    assert BACKWARD in outcome.reason
