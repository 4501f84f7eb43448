"""Pulses of formulas that are shorter than a step, in time or along the way: closed forms."""

from __future__ import annotations

from math import cos, pi, sin, sqrt

import pytest

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import scene_of
from exudyn_flexlink.result import Result
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
WHEEL = """title: a wheel gets a pulse of torque where it points up
bodies: {wheel: {type: rigid, mass: 1, inertia: 0.01, points: {rim: [0.1, 0]}}}
joints: {hub: {type: revolute, points: [ground, wheel.centre], at: [0, 0]}}
drives:
  kick: {type: torque, joint: hub, value: "100*exp(-((angle(hub) - pi/2)/1e-4)**2)"}
initial: {speeds: {wheel: 1}}
run: {duration: 2}
accuracy: {tolerance: 1.0e-6}
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


def run(text: str) -> Result:
    return simulate(scene_of(parse_document(text, "test")))


@pytest.mark.parametrize(
    ("force", "at", "impulse"),
    [
        ("1e4*exp(-((t - 0.5003)/1e-5)**2)", 0.5003, 0.1 * sqrt(pi)),
        ("100*exp(-((t - 0.5003)/1e-3)**2)", 0.5003, 0.1 * sqrt(pi)),
        ("0.01/(1 + ((t - 0.7)/1e-7)**2)", 0.7, 1e-9 * pi),
        ("100*(tanh((t - 0.5003)/1e-6) - tanh((t - 0.5004)/1e-6))", 0.50035, 0.02),
    ],
)
def test_no_pulse_in_time_is_overlooked(force: str, at: float, impulse: float) -> None:
    found = run(BLOCK.format(force=force, speed=0, lasts=1))
    assert found.poses[-1, 0, 0] == pytest.approx(impulse / MASS * (1 - at), abs=TOLERANCE)
    assert found.rates[-1, 0, 0] == pytest.approx(impulse / MASS, abs=10 * TOLERANCE)


def test_no_pulse_is_hidden_behind_another_term() -> None:
    force = "5*sin(9*t) + 50*exp(-((t - 0.31)/1e-5)**2)"
    found = run(BLOCK.format(force=force, speed=0, lasts=1))
    pulse = 5e-4 * sqrt(pi) / MASS
    waves = 5 / 9 * (1 - sin(9) / 9) / MASS
    assert found.poses[-1, 0, 0] == pytest.approx(waves + pulse * 0.69, abs=TOLERANCE)


def test_no_pulse_along_the_way_is_overlooked() -> None:
    """It adds its work: 1e3 N over a bell of 0.1 mm."""
    found = run(BLOCK.format(force="1e3*exp(-((place(way) - 0.3003)/1e-4)**2)", speed=1, lasts=1))
    speed = sqrt(1 + 2 * 0.1 * sqrt(pi) / MASS)
    assert found.rates[-1, 0, 0] == pytest.approx(speed, abs=1e-6)
    # Within the bell the block is slower than after it, by no more than 0.1 mm of way in all.
    assert found.poses[-1, 0, 0] == pytest.approx(0.3003 + (1 - 0.3003) * speed, abs=1e-5)


def test_no_pulse_of_torque_at_an_angle_is_overlooked() -> None:
    found = run(WHEEL)
    assert found.rates[-1, 0, 2] == pytest.approx(sqrt(1 + 2 * 0.01 * sqrt(pi) / 0.01), abs=1e-6)


def test_a_pulse_too_weak_to_matter_costs_no_steps() -> None:
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
def test_no_pulse_of_a_prescribed_motion_is_overlooked(drive: str, value: str) -> None:
    """The block jumps by 0.18 mm, and the mass swings about its new place with omega = 5 rad/s."""
    found = run(LED.format(drive=drive, value=value))
    jump = 1e-4 * sqrt(pi)
    assert found.poses[-1, 0, 0] == pytest.approx(jump, abs=TOLERANCE)
    load = jump * (1 - cos(5 * (1 - 0.5003)))
    assert found.poses[-1, 1, 0] == pytest.approx(load, abs=TOLERANCE)


def test_the_energy_of_a_drive_in_a_pulse_is_summed_up() -> None:
    """Where nothing is free: at its end the block is as fast as before, so that none is left."""
    text = BLOCK.format(force="0*t", speed=1, lasts=1)
    text = text.replace("type: force, point: block.b", "type: speed, joint: way")
    text = text.replace('["0*t", 0]', '"1 + 10*exp(-((t - 0.5003)/1e-4)**2)"')
    found = run(text.replace(", speeds_along: {way: 1}", ""))
    assert found.poses[-1, 0, 0] == pytest.approx(1 + 1e-3 * sqrt(pi), abs=TOLERANCE)
    largest = MASS / 2 * 11**2
    assert found.energy.supplied[-1] == pytest.approx(0, abs=1e-5 * largest)
