"""Drives by expressions, tables, motions, forces: closed forms, and the same written otherwise."""

from itertools import pairwise
from math import pi, radians

import numpy as np
import pytest
from physics_tools import MODELS, angle, run, scene, speed, where

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.mechanism.prescribed import Antiderivative

G, MASS, ARM = 9.81, 2.0, 0.5
J = 0.3 + MASS * ARM**2  # about the hook
BOB = """
bodies:
  bob: {type: rigid, mass: 2, inertia: 0.3, points: {hook: [0, 0]}, centre_of_mass: [0.5, 0]}
joints: {pivot: {type: revolute, points: [ground, bob.hook], at: [0, 0]}}
run: {duration: 3}
accuracy: {tolerance: 1.0e-8}
"""
HANGING = BOB + "gravity: [0, -9.81]\n"
HALF = "run.duration=1.5"
REDUNDANT = ("accuracy.tolerance=1e-5", "solver.formulation=redundant")
BOTH = pytest.mark.parametrize(
    ("settings", "off"), [((), 1e-8), (REDUNDANT, 1e-5)], ids=["minimal", "redundant"]
)


def driven(drive, text=BOB, *settings):
    return run(f"{text}drives: {{m: {drive}}}\n", *settings)


@pytest.mark.parametrize("unit", [" U/min", " Upm", " min-1", " min⁻¹", " 1/min", "/min"])
@pytest.mark.parametrize("beside", ["", ", ramp: 0.1"])
def test_a_motor_reads_turns_a_minute_as_german_sheets_have_them(unit, beside):
    """'95 min-1' is no formula, 95 minutes less 1, and '95/min' none without its end."""
    text = f"{BOB}drives: {{m: {{type: speed, joint: pivot, value: '95{unit}'{beside}}}}}\n"
    assert scene(text).drives["m"].value == pytest.approx(95 * 2 * pi / 60, rel=1e-15)


# --- motions --------------------------------------------------------------------------------


@BOTH
def test_a_pendulum_swung_by_a_motion_takes_the_torque_of_newton(settings, off):
    """J theta'' + m g a cos(theta), with theta = 0.3 + 20 deg sin(w t)."""
    swing = "{type: motion, joint: pivot, value: 0.3 + 20 deg * sin(2*pi*t / 1.5 s)}"
    result = driven(swing, HANGING, *settings)
    w, size, t = 2 * pi / 1.5, radians(20), result.time
    turned = 0.3 + size * np.sin(w * t)
    np.testing.assert_allclose(angle(result, "bob"), turned, atol=off)
    np.testing.assert_allclose(speed(result, "bob"), size * w * np.cos(w * t), atol=10 * off)
    torque = -J * size * w * w * np.sin(w * t) + MASS * G * ARM * np.cos(turned)
    np.testing.assert_allclose(result.drive_torques["m"], torque, atol=1e-12 if not settings else
                               2e-2)  # fmt: skip
    assert result.checks.energy_residual < 1e-4


def test_a_motion_and_its_speed_move_alike():
    """The integral of a speed is no source of error: both follow one course to 1e-12 rad."""
    motion = "exp(-t/2)*sin(3*t)*(1 + t**2)"
    course = "exp(-t/2)*((3*cos(3*t) - sin(3*t)/2)*(1 + t**2) + 2*t*sin(3*t))"
    one = driven(f"{{type: motion, joint: pivot, value: '{motion}'}}", HANGING)
    other = driven(f"{{type: speed, joint: pivot, value: '{course}'}}", HANGING)
    for result in (one, other):
        t = result.time
        exact = np.exp(-t / 2) * np.sin(3 * t) * (1 + t**2)
        np.testing.assert_allclose(angle(result, "bob"), exact, atol=1e-12)


def test_a_step_ends_where_a_speed_bends():
    """Of a speed that rises and then stays, the acceleration jumps: torque on either side."""
    result = driven("{type: speed, joint: pivot, value: 'min(4*t, 4.4)'}")
    t = result.time
    turned = np.where(t < 1.1, 2 * t**2, 2.42 + 4.4 * (t - 1.1))
    np.testing.assert_allclose(angle(result, "bob"), turned, atol=1e-12)
    np.testing.assert_allclose(result.drive_torques["m"][t < 1.1 - 1e-9], 4 * J, atol=1e-12)
    np.testing.assert_allclose(result.drive_torques["m"][t > 1.1 + 1e-9], 0, atol=1e-12)
    assert result.checks.energy_residual < 1e-10


FOUR_BAR = """
bodies:
  crank: {type: rigid, mass: 1, inertia: 0.1, points: {o: [0, 0], a: [1, 0]}}
  coupler: {type: rigid, mass: 1, inertia: 0.1, points: {a: [0, 0], b: [2, 0]}}
  rocker: {type: rigid, mass: 1, inertia: 0.1, points: {o: [0, 0], b: [1, 0]}}
joints:
  in: {type: revolute, points: [ground, crank.o], at: [0, 0]}
  a: {type: revolute, points: [crank.a, coupler.a]}
  b: {type: revolute, points: [coupler.b, rocker.b]}
  out: {type: revolute, points: [ground, rocker.o], at: [2, 0]}
run: {duration: 2}
accuracy: {tolerance: 1.0e-8}
"""


@pytest.mark.parametrize("joint", ["in", "out", "a"])
def test_a_motion_of_any_joint_of_a_loop(joint):
    """A parallelogram: crank and rocker turn alike, the coupler not, whoever is driven."""
    sign = -1 if joint == "a" else 1
    value = f"{sign}*(1 + 0.5*sin(3*t))"
    guesses = "initial: {guesses: {crank: 1.1, coupler: 0.1, rocker: 0.9}}\n"
    result = driven(f"{{type: motion, joint: {joint}, value: '{value}'}}", FOUR_BAR + guesses)
    turned = 1 + 0.5 * np.sin(3 * result.time)
    np.testing.assert_allclose(angle(result, "crank"), turned, atol=1e-8)
    np.testing.assert_allclose(angle(result, "rocker"), turned, atol=1e-8)
    np.testing.assert_allclose(angle(result, "coupler"), 0, atol=1e-8)
    # Both cranks turn about their centres; the coupler, of 1 kg, goes round with 1 m.
    torque = (2 * 0.1 + 1.0) * 4.5 * np.sin(3 * result.time)
    np.testing.assert_allclose(abs(result.drive_torques["m"]), abs(torque), atol=1e-6)


# --- torques --------------------------------------------------------------------------------


@BOTH
def test_a_governed_crank_comes_to_its_speed_as_an_exponential(settings, off):
    """J w' = -k (w - w0): w = w0 (1 - exp(-k t/J))."""
    result = driven("{type: torque, joint: pivot, value: '-2*(speed(pivot) - 14)'}", BOB, *settings)
    t, rate = result.time, 2 / J
    turned = 14 * (t - (1 - np.exp(-rate * t)) / rate)
    np.testing.assert_allclose(angle(result, "bob"), turned, atol=off)
    torque = 28 * np.exp(-rate * t)
    np.testing.assert_allclose(result.drive_torques["m"], torque, atol=100 * off)
    np.testing.assert_allclose(
        result.energy.supplied, J * speed(result, "bob") ** 2 / 2, atol=1e-7 if not settings else
        1e-3)  # fmt: skip


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5, 1e-7])
def test_a_sprung_crank_keeps_the_tolerance(tolerance):
    """A torque -k angle is a torsional spring: a swing of frequency sqrt(k/J)."""
    result = driven(
        "{type: torque, joint: pivot, value: '-50 N m/rad * angle(pivot)'}",
        BOB + "initial: {angles: {bob: 0.2}}\n", f"accuracy.tolerance={tolerance}",
    )  # fmt: skip
    exact = 0.2 * np.cos(np.sqrt(50 / J) * result.time)
    assert abs(angle(result, "bob") - exact).max() * ARM < tolerance


@BOTH
def test_a_torque_in_steps(settings, off):
    """J w' = T, T of a table with rule step: w is piecewise linear, whatever the steps."""
    table = "{points: [[0, 2], [1, -3], [1.5, 0.5], [3, 7]], rule: step}"
    settings = [setting.replace("1e-5", "1e-6") for setting in settings]
    result = driven(f"{{type: torque, joint: pivot, value: {table}}}", BOB, *settings)
    knots = np.array([0, 1, 1.5, 3])
    exact = np.interp(result.time, knots, np.cumsum([0, 2, -1.5, 0.75]) / J)
    # Steps of the redundant run end within 1e-12 s of a row, where 8.5 N m in all are leapt.
    allowed = 1e-12 if off == 1e-8 else 2e-11
    np.testing.assert_allclose(speed(result, "bob"), exact, atol=allowed)
    # What the speed may be off by is J w times as much kinetic energy, and the work as much again.
    assert result.checks.energy_residual < 2 * J * abs(exact).max() * allowed


def test_a_torque_that_senses_a_point_is_a_spring_to_it():
    """A point at arm r lifted by y: the torque -k x y is that of a spring k along y."""
    sensed = "-30*place(bob.centre, y)*place(bob.centre, x)"
    one = driven(f"{{type: torque, joint: pivot, value: '{sensed}'}}",
                 BOB + "initial: {angles: {bob: 0.7}}\n")  # fmt: skip
    force = "{type: force, point: bob.centre, value: [0, '-30*place(bob.centre, y)']}"
    other = driven(force, BOB + "initial: {angles: {bob: 0.7}}\n")
    y = where(one, "bob.centre")[:, 1]
    stored = J * speed(one, "bob") ** 2 / 2 + 30 * y**2 / 2
    np.testing.assert_allclose(stored, stored[0], atol=1e-7)
    assert abs(angle(one, "bob")[-1] - angle(other, "bob")[-1]) < 1e-8


PUSHES = "a: {type: torque, joint: pivot, value: 28}, " \
         "b: {type: torque, joint: pivot, value: '-2*speed(pivot)'}"  # fmt: skip


@BOTH
def test_torques_at_one_joint_add_beside_a_spring(settings, off):
    """J w'' + d w' + k (w - w0) = 28 - 2 w': of the damped oscillator with both dampers in it."""
    spring = "springs: {s: {type: torsional, joint: pivot, stiffness: 40, damping: 1}}\n"
    result = run(f"{BOB}{spring}drives: {{{PUSHES}}}\n", *settings, HALF)
    decay, t = 3 / (2 * J), result.time
    swing = np.sqrt(40 / J - decay**2)
    turned = 0.7 * (
        1 - np.exp(-decay * t) * (np.cos(swing * t) + decay / swing * np.sin(swing * t))
    )
    np.testing.assert_allclose(angle(result, "bob"), turned, atol=off)
    np.testing.assert_allclose(result.drive_torques["a"], 28, atol=1e-12)
    np.testing.assert_allclose(
        result.drive_torques["b"], -2 * speed(result, "bob"), atol=1e-12 if not settings else 1e-3
    )


@BOTH
@pytest.mark.parametrize("first", [True, False])
def test_a_motor_takes_what_torques_beside_it_leave(settings, off, first):
    """J theta'' + m g a cos(theta) is the sum of all, and each supplies its own work."""
    motor = "m: {type: motion, joint: pivot, value: 0.3 + 0.4*sin(4*t)}"
    drives = f"{motor}, {PUSHES}" if first else f"{PUSHES}, {motor}"
    result = run(f"{HANGING}drives: {{{drives}}}\n", *settings, HALF)
    t, turned, rate = (
        result.time,
        0.3 + 0.4 * np.sin(4 * result.time),
        1.6 * np.cos(4 * result.time),
    )
    np.testing.assert_allclose(angle(result, "bob"), turned, atol=off)
    total = -J * 6.4 * np.sin(4 * t) + MASS * G * ARM * np.cos(turned)
    torques = result.drive_torques
    allowed = 1e-11 if not settings else 3e-2
    np.testing.assert_allclose(torques["m"], total - 28 + 2 * rate, atol=allowed)
    gained = J * (rate**2 - 1.6**2) / 2 + MASS * G * ARM * (np.sin(turned) - np.sin(0.3))
    np.testing.assert_allclose(result.energy.supplied, gained, atol=allowed)


def test_a_torque_beside_a_motor_of_a_loop():
    """A parallelogram, driven at the rocker: what the torque adds the motor need not give."""
    drives = "m: {type: motion, joint: out, value: 1 + 0.5*sin(3*t)}, " \
             "help: {type: torque, joint: out, value: 2*cos(t)}"  # fmt: skip
    guesses = "initial: {guesses: {crank: 1.1, coupler: 0.1, rocker: 0.9}}\n"
    result = run(f"{FOUR_BAR}{guesses}drives: {{{drives}}}\n")
    total = -(2 * 0.1 + 1.0) * 4.5 * np.sin(3 * result.time)
    left = total - 2 * np.cos(result.time)
    np.testing.assert_allclose(result.drive_torques["m"], left, atol=1e-6)


@pytest.mark.parametrize("engine", ["exudyn", "lagrangian"])
def test_torques_beside_a_speed_take_load_off_the_motor_of_the_guide(engine):
    short = "run={duration: 5 ms}"
    drives = [f"drives.{n}={{type: torque, joint: crank, value: {x}}}" for n, x in ("a1", "b2")]
    bare, helped = (
        simulate(load_scene(MODELS / "no_clearance.yaml", [short, *more]), engine, measure=False)
        for more in ([], drives)
    )
    found = helped.drive_torques["motor"]
    np.testing.assert_allclose(found, bare.drive_torques["motor"] - 3, atol=1e-9)


# --- forces ---------------------------------------------------------------------------------

BALL = """
bodies: {ball: {type: rigid, mass: 2, inertia: 0.1}}
run: {duration: 3}
accuracy: {tolerance: 1.0e-8}
"""


@BOTH
def test_a_force_by_a_table_throws_a_ball(settings, off, tmp_path):
    """m x'' = F(t), F linear between rows: x is a cubic on each; the file is CSV."""
    rows = [(0, 0), (1, 4), (1.8, -3), (3, -1)]
    (tmp_path / "push.csv").write_text("t, F\n" + "\n".join(f"{t}, {f}" for t, f in rows))
    text = f"title: push{BALL}drives: {{f: {{type: force, point: ball.centre, " \
           "value: [{file: push.csv, rule: linear}, '-1 N']}}\n"  # fmt: skip
    model = tmp_path / "push.yaml"
    model.write_text(text)
    result = simulate(load_scene(model, settings), measure=False)
    assert result.outcome.completed
    x = v = 0.0
    for (begin, f0), (end, f1) in pairwise(rows):
        inside = (result.time >= begin) & (result.time <= end)
        t, k = result.time[inside] - begin, (f1 - f0) / (end - begin)
        place = where(result, "ball.centre")[inside, 0]
        np.testing.assert_allclose(place, x + v * t + f0 * t**2 / 4 + k * t**3 / 12, atol=off)
        h = end - begin
        x, v = x + v * h + f0 * h**2 / 4 + k * h**3 / 12, v + f0 * h / 2 + k * h**2 / 4
    np.testing.assert_allclose(where(result, "ball.centre")[:, 1], -(result.time**2) / 4, atol=off)
    np.testing.assert_allclose(
        result.drive_forces["f"][:, 0], np.interp(result.time, *np.transpose(rows)), atol=1e-9
    )


@BOTH
def test_a_force_that_turns_with_its_body(settings, off):
    """Across the body it is a torque about the pivot: J theta'' = r 3 t."""
    result = driven(
        "{type: force, point: bob.centre, axes: bob, value: [5, '3*t']}", BOB, *settings
    )
    turned = ARM * 3 * result.time**3 / 6 / J
    np.testing.assert_allclose(angle(result, "bob"), turned, atol=off)
    expected = 5 + 3j * result.time
    found = result.drive_forces["m"] @ [1, 1j] * np.exp(-1j * turned)
    np.testing.assert_allclose(found, expected, atol=1e3 * off)


WELDED = """
bodies:
  arm: {type: rigid, mass: 2, inertia: 0.3, points: {hub: [0, 0], end: [0.5, 0]}}
  plate: {type: rigid, mass: 1, inertia: 0.1, points: {foot: [0, 0], tip: [0.2, 0]}}
joints:
  pivot: {type: revolute, points: [ground, arm.hub], at: [0, 0]}
  seam: {type: weld, points: [arm.end, plate.foot], angle: 40 deg}
drives: {m: {type: force, point: plate.tip, axes: plate, value: [3, 4]}}
initial: {angles: {arm: 0}}
run: {duration: 1}
accuracy: {tolerance: 1.0e-8}
"""


@BOTH
def test_a_force_in_the_axes_of_a_part_that_is_welded_at_an_angle(settings, off):
    """Its moment about the pivot stays as it is: the plate turns with the arm, 40 deg ahead."""
    turn = np.exp(1j * np.radians(40))
    inertia = 0.3 + 0.1 + 1 * 0.5**2  # its middle is where its foot is
    moment = np.imag(np.conj(0.5 + 0.2 * turn) * (3 + 4j) * turn)
    result = simulate(scene(WELDED, *settings), measure=False)
    turned = moment / inertia * result.time**2 / 2
    np.testing.assert_allclose(angle(result, "arm"), turned, atol=10 * off)


CHAIN = """
bodies:
  upper: {type: rigid, mass: 1, inertia: 0.1, points: {a: [0, 0], b: [1, 0]}}
  lower: {type: rigid, mass: 1, inertia: 0.1, points: {a: [0, 0], tip: [0.7, 0.1]}}
joints:
  shoulder: {type: revolute, points: [ground, upper.a], at: [0, 0]}
  elbow: {type: revolute, points: [upper.b, lower.a]}
drives:
  t:
    type: torque
    joint: elbow
    value: -3*speed(elbow)*place(lower.tip, x) + sin(angle(shoulder))
  f:
    type: force
    point: lower.tip
    axes: lower
    value: ["4 + place(upper.b, y)", "tanh(speed(shoulder))"]
  g: {type: force, point: lower.centre, value: [2, "t"]}
initial: {angles: {upper: 0.4, lower: -0.8}, speeds: {upper: 1, lower: 2}}
run: {duration: 1}
accuracy: {tolerance: 1.0e-8}
"""


def test_engines_agree_on_a_chain_with_every_kind_of_load():
    fine, coarse = run(CHAIN), simulate(scene(CHAIN, *REDUNDANT), measure=False)
    ends = [where(result, "lower.tip")[-1] for result in (fine, coarse)]
    np.testing.assert_allclose(*ends, atol=2e-5)
    assert fine.checks.energy_residual < 1e-7


# --- integrals ------------------------------------------------------------------------------


def test_integrals_to_rounding():
    """Over pieces of very different lengths, and past bends that nothing tells of."""
    fast = Antiderivative(lambda t: 40 * np.cos(40 * t) + 1e-3 * np.exp(t))
    bent = Antiderivative(lambda t: np.abs(t - 0.7))
    for t in (0.0, 1e-5, 0.3, 2.0, 7.7):
        assert fast(np.array([t])) == pytest.approx(
            np.sin(40 * t) + 1e-3 * (np.exp(t) - 1), abs=2e-13
        )
        exact = 0.245 + np.sign(t - 0.7) * (t - 0.7) ** 2 / 2
        assert bent(np.array([t])) == pytest.approx(exact, abs=1e-12)


def test_integrals_late_in_a_long_run():
    """At t = 100 s a phase is rounded to 4e-12: pieces are not halved to resolve that."""
    late = Antiderivative(lambda t: np.cos(100 * pi * t))
    assert late(np.array([100.3])) == pytest.approx(
        np.sin(100 * pi * 100.3) / (100 * pi), abs=1e-10
    )
    assert len(late._pieces) < 3 * 50 * 100  # three in each period
