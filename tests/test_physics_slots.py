"""Laws of nature: slots along circles, lines, ellipses and splines."""

from math import pi

import numpy as np
import pytest
from physics_tools import (
    KILOGRAM,
    STEEL,
    rod,
    run,
    scene,
    where,
)

from exudyn_flexlink.engines import simulate

G = 9.81


# --- a rod in a slot ---------------------------------------------------------------------------


FREE = """
{steel}
curves: {{way: {curve}}}
bodies: {{rod: {rod}}}
joints: {{pin: {{type: slot, point: rod.{point}, curve: way}}}}
gravity: [0, -9.81]
initial: {{angles: {{rod: 20 deg}}, speeds: {{rod: 0}}}}
run: {{duration: 0.5}}
accuracy: {{tolerance: 1.0e-6}}
"""


def test_turned_ellipse_is_the_unturned_one_turned_with_everything():
    """The general constraint against the native one: 35 deg of turn for curve, start and weight."""
    words = {"steel": STEEL, "rod": rod(0.3), "point": "start"}
    flat = "{type: ellipse, centre: [0, 0], semi_axes: [0.1, 0.06]}"
    turned = "{type: ellipse, centre: [0, 0], semi_axes: [0.1, 0.06], rotation: 35 deg}"
    one = run(FREE.format(curve=flat, **words))
    turn = 35 * pi / 180
    c, s = np.cos(turn), np.sin(turn)
    text = FREE.format(curve=turned, **words).replace("20 deg", "55 deg")
    other = run(text.replace("[0, -9.81]", f"[{float(s * G)!r}, {float(-c * G)!r}]"))
    back = where(other, "rod.end") @ np.array([[c, -s], [s, c]])
    np.testing.assert_allclose(back, where(one, "rod.end"), atol=2e-6)
    force = other.slot_forces["pin"] @ np.array([[c, -s], [s, c]])
    np.testing.assert_allclose(force, one.slot_forces["pin"], atol=0.1)


# --- a straight slot is a slider ---------------------------------------------------------------

SLIDER_CRANK = f"""
{STEEL}
curves: {{rail: {{type: line, from: [-1, 0], to: [1, 0]}}}}
bodies:
  crank: {rod(0.1)}
  rod: {rod(0.3)}
joints:
  hub: {{type: revolute, points: [ground, crank.start], at: [0, 0]}}
  pin: {{type: revolute, points: [crank.end, rod.start]}}
  slider: {{type: slot, point: rod.end, curve: rail}}
drives: {{motor: {{type: speed, joint: hub, value: 10}}}}
run: {{turns: 2, of: hub}}
accuracy: {{tolerance: 1.0e-5}}
"""


def _rod_motion(theta, w, r, length):
    """Angle, rate and acceleration of a connecting rod, and acceleration of its centre."""
    phi = -np.arcsin(r * np.sin(theta) / length)
    rate = -r * w * np.cos(theta) / (length * np.cos(phi))
    bend = (r * w**2 * np.sin(theta) / length + rate**2 * np.sin(phi)) / np.cos(phi)
    half = length / 2
    ax = -r * w**2 * np.cos(theta) - half * (bend * np.sin(phi) + rate**2 * np.cos(phi))
    ay = -r * w**2 * np.sin(theta) + half * (bend * np.cos(phi) - rate**2 * np.sin(phi))
    return phi, rate, bend, ax, ay


def test_straight_slot_is_the_rail_of_a_slider_crank():
    """Moments about the crank pin: l cos(phi) N = r x m a + J phi''; the motor gives the power."""
    result = run(SLIDER_CRANK)
    theta = 10 * result.time
    x = 0.1 * np.cos(theta) + np.sqrt(0.3**2 - (0.1 * np.sin(theta)) ** 2)
    exact = np.column_stack([x, np.zeros_like(x)])
    np.testing.assert_allclose(where(result, "rod.end"), exact, atol=1e-7)
    assert result.checks.constraint_error < 1e-9
    phi, rate, bend, ax, ay = _rod_motion(theta, 10, 0.1, 0.3)
    mass, half = 0.3 * KILOGRAM, 0.15
    moment = half * mass * (np.cos(phi) * ay - np.sin(phi) * ax) + mass * 0.3**2 / 12 * bend
    push = moment / (0.3 * np.cos(phi))
    got = result.slot_forces["slider"]
    np.testing.assert_allclose(got[:, 0], 0, atol=1e-8)
    np.testing.assert_allclose(got[:, 1], push, atol=5e-3 * abs(push).max())
    vx = -1.0 * np.sin(theta) - 0.15 * rate * np.sin(phi)
    vy = 1.0 * np.cos(theta) + 0.15 * rate * np.cos(phi)
    power = mass * (ax * vx + ay * vy) + mass * 0.3**2 / 12 * bend * rate
    torque = result.drive_torques["motor"]
    np.testing.assert_allclose(torque, power / 10, atol=5e-3 * abs(power / 10).max())


def test_bead_on_a_circle_is_pushed_by_its_weight_and_its_speed():
    """A small body sliding down a ring from the side: N = 3 m g sin(depth)."""
    text = """
curves: {ring: {type: circle, centre: [1, 2], radius: 0.5}}
bodies: {bead: {type: rigid, mass: 2, inertia: 1.0e-6, points: {p: [0, 0]}}}
joints: {wire: {type: slot, point: bead.p, curve: ring}}
gravity: [0, -9.81]
run: {duration: 2}
accuracy: {tolerance: 1.0e-5}
"""
    result = run(text)
    out = (where(result, "bead.p") - [1, 2]) / 0.5
    inward = -np.sum(result.slot_forces["wire"] * out, axis=1)
    np.testing.assert_allclose(inward, -3 * 2 * G * out[:, 1], atol=0.02 * G)


def test_open_slot_that_is_too_short_ends_the_run_and_keeps_it():
    text = SLIDER_CRANK.replace("from: [-1, 0], to: [1, 0]", "from: [0.25, 0], to: [1, 0]")
    result = simulate(scene(text))
    assert not result.outcome.completed
    assert "slider" in result.outcome.reason
    assert result.outcome.advice
    # x = 0.25: cos(theta) = (r^2 + x^2 - l^2)/(2 r x)
    ends = np.arccos((0.01 + 0.0625 - 0.09) / 0.05) / 10
    assert result.outcome.time == pytest.approx(ends, abs=1e-5)
    assert result.time[-1] == pytest.approx(result.outcome.time, abs=1e-12)
    x = where(result, "rod.end")[:, 0]
    assert x[-1] == pytest.approx(0.25, abs=1e-5)
    theta = 10 * result.time
    exact = 0.1 * np.cos(theta) + np.sqrt(0.09 - (0.1 * np.sin(theta)) ** 2)
    np.testing.assert_allclose(x, exact, atol=1e-7)


ROCKING = """
{steel}
curves:
  egg:
    type: joined
    pieces:
      - {{type: ellipse, centre: [0, 0], semi_axes: [0.04, 0.03], from: -90 deg, to: 90 deg}}
      - {{type: circle, centre: [0, 0], radius: 0.03, from: 90 deg, to: 270 deg}}
bodies:
  guide: {rod}
  link: {rod}
joints:
  crank: {{type: revolute, points: [ground, guide.start], at: [0.02, 0]}}
  sleeve: {{type: sleeve, guide: guide, link: link}}
  pin: {{type: slot, point: link.start, curve: egg}}
drives: {{motor: {{type: speed, joint: crank, value: "{speed}*cos({omega}*t)"}}}}
initial: {{angles: {{guide: {start} deg}}}}
run: {{duration: 1, sample: 1 ms}}
accuracy: {{tolerance: 1.0e-6}}
"""


def rays_to_the_egg(angle):
    """Points where rays from (0.02, 0) at these angles meet the egg: roots of quadratics."""
    e = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = []
    for width in (0.04, 0.03):  # of the half ellipse on the right, of the half circle on the left
        square, both, rest = (
            e[:, 0] ** 2 / width**2 + e[:, 1] ** 2 / 0.03**2,
            0.02 * e[:, 0] / width**2,
            0.02**2 / width**2 - 1,
        )
        r = (-both + np.sqrt(both**2 - square * rest)) / square
        points.append([0.02, 0] + r[:, None] * e)
    right, left = points
    return np.where(left[:, :1] < 0, left, right)


@pytest.mark.parametrize(("omega", "start"), [(20, 123), (200, 123.4), (200, 124.4)])
def test_a_crank_that_rocks_over_the_seam_of_its_track_is_on_the_right_piece(start, omega):
    """The seam is at 123.69 deg: P passes it and is back within one step of the solver."""
    text = ROCKING.format(steel=STEEL, rod=rod(0.09), start=start, speed=0.02 * omega, omega=omega)
    found = simulate(scene(text))
    angle = np.deg2rad(start) + 0.02 * np.sin(omega * found.time)
    expected = rays_to_the_egg(angle)
    assert np.ptp(np.sign(expected[:, 0])) == 2, "both pieces are reached"
    np.testing.assert_allclose(where(found, "link.start"), expected, atol=1e-12)
    assert not found.warnings
