"""Laws of nature: pendulums, chains, drives, springs and welds."""

from math import pi, sin, sqrt

import numpy as np
import pytest
from physics_tools import (
    KILOGRAM,
    STEEL,
    angle,
    rod,
    run,
    speed,
    total_energy,
    where,
)
from scipy.special import ellipj, ellipk

from exudyn_flexlink.chain import discretise, euler_bernoulli_cantilever
from exudyn_flexlink.mechanism import beam_of

G = 9.81


# --- pendulums ------------------------------------------------------------------------------

POINT_MASS = """
bodies:
  bob: {type: rigid, mass: 1, inertia: 1.0e-12, points: {hook: [0, 0]}, centre_of_mass: [1, 0]}
joints: {pivot: {type: revolute, points: [ground, bob.hook], at: [0, 0]}}
gravity: [0, -9.81]
run: {duration: 10}
accuracy: {tolerance: 1.0e-5}
"""


HELD_ANYWHERE = """
bodies:
  bob: BODY
joints: {pivot: {type: revolute, points: [ground, bob.HELD], at: [0, 0]}}
gravity: [0, -9.81]
initial: {angles: {bob: TURN}}
run: {duration: 3}
accuracy: {tolerance: 1.0e-6}
"""
PLATE = (
    "{type: rigid, mass: 2, inertia: 0.02, centre_of_mass: [0, 0.3], "
    "points: {rim: [0.5, 0], far: [-0.2, 0.4]}}"
)


@pytest.mark.parametrize(
    ("body", "held", "point", "arm", "inertia"),
    [
        (rod(0.6), "end", "bob.start", 0.3, 0.6**2 / 3),
        (rod(0.6), "start", "bob.end", 0.3, 0.6**2 / 3),
        (PLATE, "rim", "bob.far", sqrt(0.25 + 0.09), 0.01 + 0.25 + 0.09),
        (PLATE, "far", "bob.rim", sqrt(0.04 + 0.01), 0.01 + 0.04 + 0.01),
    ],
)
def test_pendulum_keeps_its_tolerance_whichever_of_its_points_holds_it(
    body, held, point, arm, inertia
):
    """Jacobi's closed form from rest, by the arm of the mass (m) and inertia per mass (m^2)."""
    text = STEEL + HELD_ANYWHERE.replace("BODY", body).replace("HELD", held)
    result = run(text.replace("TURN", "100 deg"))
    centre = where(result, "bob.centre")
    below = np.arctan2(centre[:, 0], -centre[:, 1])
    k = sin(below[0] / 2)
    rate = sqrt(G * arm / inertia)
    swung = 2 * np.arcsin(k * ellipj(ellipk(k * k) - rate * result.time, k * k)[0])
    farthest = np.hypot(*where(result, point)[0])
    assert farthest * abs(np.angle(np.exp(1j * (below - swung)))).max() < 1e-6


def test_pendulum_pulls_its_pivot_with_three_weights_at_the_bottom():
    """The force on the bob is upwards: m g + m v^2/l with v^2 = 2 g l."""
    pendulum = run(POINT_MASS)
    i = int(np.argmin(abs(angle(pendulum, "bob") + pi / 2)))
    force = pendulum.joint_forces["pivot"][i]
    np.testing.assert_allclose(force, [0, 3 * G], atol=0.02 * G)
    bend = angle(pendulum, "bob")
    pull = -2 * G * np.sin(bend) - G * np.sin(bend)  # centripetal and weight along the string
    expected = -pull[:, None] * np.column_stack([np.cos(bend), np.sin(bend)])
    np.testing.assert_allclose(pendulum.joint_forces["pivot"], expected, atol=5e-2)


# --- drives ---------------------------------------------------------------------------------


def test_torque_gives_a_free_body_the_acceleration_m_over_j():
    text = f"""
{STEEL}
bodies: {{arm: {rod()}}}
joints: {{hub: {{type: revolute, points: [ground, arm.start], at: [0, 0]}}}}
drives: {{motor: {{type: torque, joint: hub, value: 0.5}}}}
run: {{duration: 2}}
accuracy: {{tolerance: 1.0e-5}}
"""
    result = run(text)
    alpha = 0.5 / (KILOGRAM / 3)
    np.testing.assert_allclose(angle(result, "arm"), alpha * result.time**2 / 2, atol=1e-5)
    np.testing.assert_allclose(speed(result, "arm"), alpha * result.time, atol=1e-5)
    # Energies of a sample are those of its motion, also where a step is longer than a sample.
    kinetic = KILOGRAM / 6 * speed(result, "arm") ** 2
    np.testing.assert_allclose(result.energy.kinetic, kinetic, atol=1e-6 * kinetic[-1])
    supplied = 0.5 * angle(result, "arm")
    np.testing.assert_allclose(result.energy.supplied, supplied, atol=1e-5 * supplied[-1])


def test_torque_that_rises_gives_its_integral():
    """J omega at the end of the ramp is M T/2, whatever symmetric step the torque follows."""
    text = f"""
{STEEL}
bodies: {{arm: {rod()}}}
joints: {{hub: {{type: revolute, points: [ground, arm.start], at: [0, 0]}}}}
drives: {{motor: {{type: torque, joint: hub, value: 0.5, ramp: 1}}}}
run: {{duration: 1}}
accuracy: {{tolerance: 1.0e-6}}
"""
    result = run(text)
    assert speed(result, "arm")[-1] == pytest.approx(0.5 * 0.5 / (KILOGRAM / 3), rel=1e-6)


def test_ramped_speed_follows_the_quintic_step():
    text = f"""
{STEEL}
bodies: {{arm: {rod()}}}
joints: {{hub: {{type: revolute, points: [ground, arm.start], at: [0, 0]}}}}
drives: {{motor: {{type: speed, joint: hub, value: -8, ramp: 0.5}}}}
run: {{duration: 1}}
accuracy: {{tolerance: 1.0e-5}}
"""
    result = run(text)
    x = np.minimum(result.time / 0.5, 1)
    turned = -8 * (0.5 * x**4 * (2.5 - 3 * x + x**2) + np.maximum(result.time - 0.5, 0))
    np.testing.assert_allclose(angle(result, "arm"), turned, atol=1e-8)
    np.testing.assert_allclose(
        speed(result, "arm"), -8 * x**3 * (10 - 15 * x + 6 * x**2), atol=2e-4
    )
    torque = KILOGRAM / 3 * -8 * 30 * x**2 * (1 - x) ** 2 / 0.5
    np.testing.assert_allclose(result.drive_torques["motor"], torque, atol=2e-2)


@pytest.mark.parametrize("way", [1, -1])
def test_turns_driven_by_a_torque_end_at_exactly_these_turns(way):
    text = f"""
{STEEL}
bodies: {{arm: {rod()}}}
joints: {{hub: {{type: revolute, points: [ground, arm.start], at: [0, 0]}}}}
drives: {{motor: {{type: torque, joint: hub, value: {way * 0.5}}}}}
run: {{turns: {way * 1.25 if way > 0 else 1.25}, of: hub, at_most: 20}}
accuracy: {{tolerance: 1.0e-4}}
"""
    if way < 0:
        text = text.replace("points: [ground, arm.start]", "points: [arm.start, ground]")
        text = text.replace("-0.5", "0.5")
    result = run(text)
    assert angle(result, "arm")[-1] == pytest.approx(way * 2.5 * pi, abs=1e-8)
    exact = sqrt(2 * 2.5 * pi / (0.5 / (KILOGRAM / 3)))
    assert result.outcome.time == pytest.approx(exact, rel=1e-5)
    assert result.time[-1] == result.outcome.time


def test_drive_between_two_free_bodies_leaves_their_angular_momentum():
    """Wheels on one hinge, at rest: J1 omega1 + J2 omega2 = 0, relative speed as driven."""
    text = """
bodies:
  big: {type: rigid, mass: 1, inertia: 3, points: {hub: [0, 0]}}
  small: {type: rigid, mass: 1, inertia: 1, points: {hub: [0, 0]}}
joints:
  axle: {type: revolute, points: [ground, big.hub], at: [0, 0]}
  pin: {type: revolute, points: [big.hub, small.hub]}
drives: {motor: {type: speed, joint: pin, value: 8, ramp: 0.5}}
run: {duration: 1}
accuracy: {tolerance: 1.0e-6}
"""
    result = run(text)
    np.testing.assert_allclose(3 * speed(result, "big") + speed(result, "small"), 0, atol=1e-6)
    assert speed(result, "big")[-1] == pytest.approx(-2, rel=1e-6)
    assert speed(result, "small")[-1] == pytest.approx(6, rel=1e-6)
    peak = 0.75 * 8 * 1.875 / 0.5  # reduced inertia times the largest rate of the step
    assert result.drive_torques["motor"].max() == pytest.approx(peak, rel=1e-3)


# --- springs and welds ------------------------------------------------------------------------


BOB = "bob: {type: rigid, mass: 0.5, inertia: 2.0e-4, centre_of_mass: [0.02, 0.03]}"
WELDED = "tip: {type: weld, points: [lever.end, bob.centre], angle: 40 deg}"


@pytest.mark.parametrize(
    ("body", "weld", "more"), [("", "", 0.0), (f", {BOB}", f", {WELDED}", 2e-4 + 0.5 * 0.3**2)]
)
def test_sprung_rod_rings_down_with_its_damping_ratio_and_frequency(body, weld, more):
    """phi = A exp(-zeta w t) (cos w_d t + zeta/sqrt(1 - zeta^2) sin w_d t) about the rest angle.

    What is welded to the rod counts.
    """
    text = f"""
{STEEL}
bodies: {{lever: {rod(0.3)}{body}}}
joints: {{pivot: {{type: revolute, points: [ground, lever.start], at: [0, 0]}}{weld}}}
springs:
  spring:
    {{type: torsional, joint: pivot, frequency: 5 Hz, damping_ratio: 0.08, rest_angle: 0.5}}
initial: {{angles: {{lever: 0.8}}}}
run: {{duration: 1}}
accuracy: {{tolerance: 1.0e-6}}
"""
    result = run(text)
    w, zeta = 10 * pi, 0.08
    wd = w * sqrt(1 - zeta**2)
    swing = np.cos(wd * result.time) + zeta * w / wd * np.sin(wd * result.time)
    exact = 0.5 + 0.3 * np.exp(-zeta * w * result.time) * swing
    np.testing.assert_allclose(angle(result, "lever"), exact, atol=5e-6)
    energy = total_energy(result)
    given = 0.5 * (KILOGRAM * 0.3**3 / 3 + more) * w**2 * 0.3**2
    assert energy[0] == pytest.approx(given, rel=1e-12)
    assert result.energy.dissipated[-1] == pytest.approx(given - energy[-1], rel=1e-4)


@pytest.mark.parametrize(
    ("rods", "layout", "error"), [(4, "equal", 33.1), (8, "equal", 14.2), (4, "half_ends", 1.45)]
)
def test_cantilever_rings_with_its_first_frequency(rods, layout, error):
    """Released in weight, about its sagged rest; Euler-Bernoulli, within a chain's error."""
    text = f"""
{STEEL}
bodies:
  strip:
    type: flexible
    length: 0.07
    material: steel
    section: {{width: 10 mm, thickness: 0.5 mm}}
    rods: {rods}
    layout: {layout}
    hinges: {{stiffness: beam}}
joints: {{root: {{type: weld, points: [ground, strip.start], at: [0, 0]}}}}
gravity: [0, -9.81]
run: {{duration: 0.1}}
accuracy: {{step: 4.0e-5}}
"""
    result = run(text)
    sag = where(result, "strip.end")[:, 1]
    spectrum_at = np.linspace(60, 140, 4001)
    window = np.hanning(len(sag))
    signal = (sag - np.average(sag, weights=window)) * window
    response = abs(np.exp(-2j * pi * np.outer(spectrum_at, result.time)) @ signal)
    frequency = spectrum_at[np.argmax(response)]
    beam = beam_of(result.scene, result.scene.bodies["strip"])
    exact = euler_bernoulli_cantilever(beam, 1)[0] / (2 * pi)
    assert frequency == pytest.approx(exact * (1 + error / 100), rel=0.01)
    chain = discretise(beam, rods, layout, "beam").cantilever_frequencies(1)[0] / (2 * pi)
    assert frequency == pytest.approx(chain, rel=2e-3)
