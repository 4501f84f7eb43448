"""Pulses of formulas that are shorter than a step, in time or along the way: closed forms."""

from math import asin, cos, pi, sin, sqrt

import pytest

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.expressions import parse_expression
from exudyn_flexlink.loading import assemble_scene, scene_of
from exudyn_flexlink.source import parse_document

MASS, TOLERANCE = 2.0, 1e-6  # kg, m

BLOCK = """title: a block slides freely, but for a pulse
bodies: {{block: {{type: rigid, mass: 2, inertia: 1, points: {{b: [0, 0]}}}}}}
joints: {{way: {{type: prismatic, points: [ground, block.b], at: [0, 0], axis: [1, 0]}}}}
drives: {{push: {{type: force, point: block.b, value: ["{force}", 0]}}}}
initial: {{along: {{way: 0}}, speeds_along: {{way: {speed}}}}}
run: {{duration: {lasts}}}
accuracy: {{tolerance: 1.0e-6}}
"""
LED = """title: a block is led along a line, and a mass on a spring hangs on it
bodies:
  block: {{type: rigid, mass: 2, inertia: 1, points: {{b: [0, 0]}}}}
  load: {{type: rigid, mass: 1, inertia: 1, points: {{c: [0, 0]}}}}
joints:
  way: {{type: prismatic, points: [ground, block.b], at: [0, 0], axis: [1, 0]}}
  shelf: {{type: prismatic, points: [block.b, load.c], axis: [1, 0]}}
springs: {{s: {{type: linear, joint: shelf, stiffness: 25, length: 0}}}}
drives: {{lead: {{type: {drive}, joint: way, value: "{value}"}}}}
initial: {{along: {{shelf: 0}}}}
run: {{duration: 1}}
accuracy: {{tolerance: 1.0e-6}}
"""


ARM = """title: an arm is turned
bodies: {{arm: {{type: rigid, mass: 1, inertia: 1, points: {{hub: [0, 0], tip: [1, 0]}}}}}}
joints: {{axle: {{type: revolute, points: [ground, arm.hub], at: [0, 0]}}}}
drives: {{motor: {{type: {drive}, joint: axle, value: "{value}"}}}}
run: {{duration: 0.6}}
accuracy: {{tolerance: 1.0e-6}}
"""


def run(text, *settings):
    return simulate(scene_of(parse_document(text, "test"), settings))


BELL, ROOF = "exp(-((t-0.3)/1e-4)**2)", "max(0, 1 - abs((t-0.3)/2e-5))"
FORMULATIONS = [["solver.formulation=minimal"], ["solver.formulation=redundant"]]


@pytest.mark.parametrize("settings", FORMULATIONS)
@pytest.mark.parametrize(
    ("force", "way"),
    [  # of 2 kg after 1 s
        (f"where(t < 0.1, 1000, 10*{BELL})", 50 * 0.95 + 5e-4 * sqrt(pi) * 0.7),
        (f"3*cos(3*t)*(1 + {ROOF})", 1 / 6 * (1 - cos(3)) + 3e-5 * cos(0.9) * 0.7),
        ("2000 + where(abs(t - 0.30007) < 1e-6, 100, 0)", 500 + 1e-4 * 0.69993),
        ("12*t + 4/(exp((t-0.3)/1e-4) + exp((0.3-t)/1e-4))", 1 + 1e-4 * pi * 0.7),
        (f"50*({BELL} - exp(-((t-0.302)/1e-4)**2))", 25e-4 * sqrt(pi) * 2e-3),
    ],
)
def test_a_pulse_counts_by_the_tolerance(force, way, settings):
    """Whatever else the force does, and however large it is."""
    found = run(BLOCK.format(force=force, speed=0, lasts=1), *settings)
    assert found.poses[-1, 0, 0] == pytest.approx(way, abs=TOLERANCE, rel=0)


@pytest.mark.parametrize("settings", FORMULATIONS)
@pytest.mark.parametrize(
    ("drive", "value", "turn"),
    [
        ("speed", "10*(1 + 0.0199*exp(-((t-0.3)/3e-3)**2))", 6 + 0.199 * 3e-3 * sqrt(pi)),
        ("speed", f"20*t + 0.1*{BELL} + 3*{ROOF}", 3.6 + 1e-5 * sqrt(pi) + 6e-5),
        ("speed", "1e3*sin(20*t)*exp(-((t-0.3)/1e-7)**2)", 1e-4 * sqrt(pi) * sin(6)),
        ("torque", f"where(t < 0.1, 200, 0) + {BELL} - 3*{ROOF}", 11 + 3e-5 * sqrt(pi) - 18e-6),
        ("motion", "3*t + 1e-5*(1 + tanh((t-0.3)/1e-6))", 1.8 + 2e-5),
    ],
)
def test_a_pulse_turns_an_arm(drive, value, turn, settings):
    found = run(ARM.format(drive=drive, value=value), *settings)
    assert found.poses[-1, 0, 2] == pytest.approx(turn, abs=TOLERANCE, rel=0)


def test_a_run_by_steps_ends_them_at_pulses():
    """Without a tolerance a millionth of the mechanism's reach stands for it."""
    text = BLOCK.format(force=f"1000 + 10*{BELL}", speed=0, lasts=1)
    text = text.replace("tolerance: 1.0e-6", "step: 0.01")
    found = run(text, "solver.formulation=minimal")
    assert found.poses[-1, 0, 0] == pytest.approx(250 + 5e-4 * sqrt(pi) * 0.7, abs=TOLERANCE)


def test_a_force_too_fast_to_look_into_is_told():
    text = BLOCK.format(force="1e4*sin(1e7*t)", speed=0, lasts=1)
    (told,) = assemble_scene(scene_of(parse_document(text, "test"))).mechanism.unfound
    assert told.startswith("drive 'push' varies too fast to look for pulses shorter than")


def test_a_condition_is_not_missed_between_looks():
    found = parse_expression("where(abs(t - 0.3) < 1e-9, 1, 0)*abs(cos(1e3*t))").bends(0.0, 1.0)
    rest = [t for t in found if abs(t - 0.3) > 1e-6]
    assert rest == pytest.approx([(k + 0.5) * pi / 1e3 for k in range(318)], abs=1e-14)
    near = [t - 0.3 for t in found if abs(t - 0.3) < 1e-6]
    assert near == pytest.approx([-1e-9, 0.0, 1e-9], abs=1e-15)


@pytest.mark.parametrize(("size", "width"), [(1.0, 1e-4), (0.3, 1e-3), (1e3, 1e-6)])
def test_a_weak_pulse_along_the_way_counts_by_the_tolerance(size, width):
    """On a block that a thousandfold force pulls back, in the same term and as another."""
    bell = f"exp(-((place(way) - 0.3003)/{width})**2)"
    found = run(BLOCK.format(force=f"-200*place(way) + {size}*{bell}", speed=9, lasts=0.1))
    passed = asin(0.3003 * 10 / 9) / 10
    after = sqrt(81 * cos(10 * passed) ** 2 + 2 * size * width * sqrt(pi) / MASS)
    left = 0.1 - passed
    right = 0.3003 * cos(10 * left) + after / 10 * sin(10 * left)
    # Within the bell it is slower than after it: by less than the time that this takes.
    allowed = TOLERANCE + size * width**2 / MASS / 9
    assert found.poses[-1, 0, 0] == pytest.approx(right, abs=allowed, rel=0)


def test_a_pulse_too_weak_to_matter_costs_no_steps():
    """A force of 1e-9 N that swings a million times: 1e-16 m at most."""
    found = run(BLOCK.format(force="1e-9*sin(1e6*t)", speed=1, lasts=1))
    assert found.checks.steps < 100


@pytest.mark.parametrize(
    ("drive", "value"),
    [
        ("speed", "10*exp(-((t - 0.5003)/1e-5)**2)"),
        ("motion", "1e-4*sqrt(pi)*0.5*(1 + tanh((t - 0.5003)/1e-5))"),
    ],
)
def test_no_pulse_of_a_prescribed_motion_is_overlooked(drive, value):
    """The block jumps by 0.18 mm, and the mass swings about its new place with omega = 5 rad/s."""
    found = run(LED.format(drive=drive, value=value))
    jump = 1e-4 * sqrt(pi)
    assert found.poses[-1, 0, 0] == pytest.approx(jump, abs=TOLERANCE)
    load = jump * (1 - cos(5 * (1 - 0.5003)))
    assert found.poses[-1, 1, 0] == pytest.approx(load, abs=TOLERANCE)


def test_the_energy_of_a_drive_in_a_pulse_is_summed_up():
    """Where nothing is free: at its end the block is as fast as before, so that none is left."""
    text = BLOCK.format(force="0*t", speed=1, lasts=1)
    text = text.replace("type: force, point: block.b", "type: speed, joint: way")
    text = text.replace('["0*t", 0]', '"1 + 10*exp(-((t - 0.5003)/1e-4)**2)"')
    found = run(text.replace(", speeds_along: {way: 1}", ""))
    assert found.poses[-1, 0, 0] == pytest.approx(1 + 1e-3 * sqrt(pi), abs=TOLERANCE)
    largest = MASS / 2 * 11**2
    assert found.energy.supplied[-1] == pytest.approx(0, abs=1e-5 * largest)
