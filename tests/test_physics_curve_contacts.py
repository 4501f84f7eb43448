"""Beads, balls and rollers on curves that they can't cross: closed forms, equations by hand."""

from math import cos, pi, sin, sqrt

import numpy as np
import pytest
from physics_tools import alone, energy_change, where
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

G = 9.81

# --- a ball on a floor ------------------------------------------------------------------------

FLOOR = """
curves: {{floor: {{type: line, from: [-1, 0], to: [1, 0]}}}}
bodies:
  ball: {{type: rigid, mass: 1, inertia: 1.0e-3, points: {{c: [0, 0]}}}}
  ground_plate: {{type: rigid, mass: 1, inertia: 1, points: {{a: [-1, 0], b: [1, 0]}}}}
joints: {{bolts: {{type: weld, points: [ground, ground_plate.a], at: [-1, 0]}}}}
contacts:
  floor: {{{shape}, law: {{stiffness: 1.0e6, restitution: 0.8, friction: 0.2}}}}
gravity: [0, -9.81]
initial: {{positions: {{ball: [0, 1]}}, velocities: {{ball: [0.3, 0]}}, speeds: {{ball: 3}}}}
run: {{duration: 1.2}}
accuracy: {{tolerance: 1.0e-8}}
"""
ON_CURVE = "type: point_on_curve, point: ball.c, curve: floor, side: left"
ON_LINE = "type: point_on_line, point: ball.c, line: [ground_plate.a, ground_plate.b]"


def test_a_ball_bounces_on_a_straight_curve_as_on_a_line():
    """First touch by free fall; the rest as with another shape of contact."""
    curve, line = (alone(FLOOR.format(shape=shape)) for shape in (ON_CURVE, ON_LINE))
    first = next(iter(curve.intervals["floor"]))
    assert first.begin == pytest.approx(sqrt(2 / G), abs=1e-12)
    assert first.approach_speed == pytest.approx(sqrt(2 * G), abs=1e-11)
    one, other = curve.intervals["floor"], line.intervals["floor"]
    assert len(one) == len(other) > 1
    for name in ("begin", "end", "place", "end_place", "impulse", "penetration"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=1e-6)
    np.testing.assert_allclose(where(curve, "ball.c")[-1], where(line, "ball.c")[-1], atol=1e-8)
    np.testing.assert_allclose(curve.poses[-1, 0, 2], line.poses[-1, 0, 2], atol=1e-12)


# --- a bead in a hoop -------------------------------------------------------------------------

HOOP = """
curves: {{hoop: {{{curve}}}}}
bodies: {{bead: {{type: rigid, mass: 2, inertia: 1.0e-3, points: {{c: [0, 0]}}}}{carrier}}}
{joints}
contacts:
  hoop:
    type: point_on_curve
    point: bead.c
    curve: hoop
    law: {{stiffness: {k}, restitution: 1}}
gravity: [0, -9.81]
initial: {{positions: {{bead: [{x}, {y}]}}}}
run: {{duration: {duration}}}
accuracy: {{tolerance: {tolerance}}}
"""
CIRCLE = "type: circle, centre: [0, 0], radius: 0.5"
ARC = "{type: circle, centre: [0, 0], radius: 0.5, "
HALVES = (
    f"type: joined, pieces: [{ARC} from: -170 deg, to: -60 deg}}, {ARC} from: -60 deg, to: 2}}]"
)
PLATE = ", plate: {type: rigid, mass: 1, inertia: 1, points: {a: [0.1, 0.2]}}"
BOLT = "joints: {bolt: {type: weld, points: [ground, plate.a], at: [0.3, 0.3], angle: 30 deg}}"


def bead(angle, duration, *, k=1e7, curve=CIRCLE, carrier="", joints="", at=(0, 0), tolerance=1e-8):
    """Scene of a bead in a hoop of radius 0.5 m around `at`, from rest by its angle from below."""
    return HOOP.format(curve=curve, carrier=carrier, joints=joints, k=k, duration=duration,
                       x=at[0] + 0.5 * sin(angle),
                       y=at[1] - 0.5 * cos(angle), tolerance=tolerance)  # fmt: skip


def hand(angle, duration, k):
    """Place of the bead at the end: polar equations, with a wall that gives way."""

    def rates(_, s):
        r, a, u, w = s
        return [
            u,
            w,
            r * w * w + G * cos(a) - k / 2 * max(r - 0.5, 0.0),
            (-G * sin(a) - 2 * u * w) / r,
        ]

    end = solve_ivp(rates, (0, duration), [0.5, angle, 0, 0], "DOP853", rtol=1e-12, atol=1e-13,
                    max_step=1e-3).y[:, -1]  # fmt: skip
    return np.array([end[0] * sin(end[1]), -end[0] * cos(end[1])])


@pytest.mark.parametrize("kind", ["closed", "joined", "carried"])
def test_a_bead_in_a_soft_hoop_follows_its_polar_equations(kind):
    """Of one piece or two, on the ground or on a body that stands still, turned and moved."""
    angle, duration, at = 1.2, 1.0, np.zeros(2)
    given = {"k": 1e5}
    if kind == "joined":
        given["curve"] = HALVES
    if kind == "carried":
        # The plate's point a, [0.1, 0.2] on it, is at [0.3, 0.3], and the plate turned by 30 deg.
        c, s = cos(pi / 6), sin(pi / 6)
        at = np.array([0.3 - (0.1 * c - 0.2 * s), 0.3 - (0.1 * s + 0.2 * c)])
        given |= {"curve": f"{CIRCLE}, on: plate", "carrier": PLATE, "joints": BOLT, "at": at}
    result = alone(bead(angle, duration, **given))
    got = where(result, "bead.c")[-1] - at
    np.testing.assert_allclose(got, hand(angle, duration, 1e5), atol=2e-8)


@pytest.mark.parametrize("curve", [CIRCLE, HALVES])
def test_a_bead_on_a_rigid_hoop_is_a_pendulum(curve):
    """By impulse nothing gives way: the length is the radius, whatever the pieces."""
    text = bead(1.2, 1.0, curve=curve).replace("stiffness: 10000000.0, ", "type: impulse, ")
    result = alone(text.replace("restitution: 1}", "restitution: 0}"))
    end = solve_ivp(lambda _, s: [s[1], -G / 0.5 * sin(s[0])], (0, 1), [1.2, 0], "DOP853",
                    rtol=1e-12, atol=1e-13).y[0, -1]  # fmt: skip
    got = where(result, "bead.c")[-1]
    np.testing.assert_allclose(got, [0.5 * sin(end), -0.5 * cos(end)], atol=2e-8)


RAMP = """
curves:
  way:
    type: joined
    pieces:
      - {{type: line, from: [-1, 0], to: [0, 0]}}
      - {{type: circle, centre: [0, 0.5], radius: 0.5, from: -90 deg, to: 60 deg}}
bodies: {{bead: {{type: rigid, mass: 1, inertia: 1.0e-3, points: {{c: [0, 0]}}}}}}
contacts:
  way: {{type: point_on_curve, point: bead.c, curve: way, law: {{stiffness: {k}, restitution: 1}}}}
gravity: [0, -9.81]
initial: {{positions: {{bead: [-0.4, 0]}}, velocities: {{bead: [{speed}, 0]}}}}
run: {{duration: {duration}}}
accuracy: {{tolerance: 1.0e-9}}
"""


def test_steps_end_where_a_straight_way_begins_to_bend():
    """The force's derivative jumps there: by equations for the line, then those for the arc."""
    k, speed_, duration = 1e5, 2.0, 0.4
    result = alone(RAMP.format(k=k, speed=speed_, duration=duration))

    def rates(_, s):
        x, y, u, v = s
        if x <= 0:
            return [u, v, 0.0, k * max(-y, 0.0) - G]
        far = np.hypot(x, y - 0.5)
        pull = -k * max(far - 0.5, 0.0) / far
        return [u, v, pull * x, pull * (y - 0.5) - G]

    def seam(_, s):
        return s[0]

    seam.terminal = True
    keep = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13, "max_step": 1e-3}
    leg = solve_ivp(rates, (0, duration), [-0.4, 0, speed_, 0], events=seam, **keep)
    assert leg.t[-1] == pytest.approx(0.2)
    # The step that ended there ends a step of the run, too: the first on the arc starts on it.
    leg = solve_ivp(rates, (leg.t[-1], duration), leg.y[:, -1] + [1e-15, 0, 0, 0], **keep)
    np.testing.assert_allclose(where(result, "bead.c")[-1], leg.y[:2, -1], atol=1e-7)


# --- a drum that turns ------------------------------------------------------------------------

DRUM = """
curves: {wall: {type: circle, centre: [0, 0], radius: 0.5, on: drum}}
bodies:
  drum: {type: rigid, mass: 5, inertia: 1, points: {hub: [0, 0]}}
  disc: {type: rigid, mass: 2, inertia: 0.01, points: {c: [0, 0]}}
joints: {hub: {type: revolute, points: [ground, drum.hub], at: [0, 0]}}
contacts:
  rim:
    type: point_on_curve
    point: disc.c
    curve: wall
    radius: 0.1
    law: {stiffness: 1.0e6, restitution: 1, friction: 0.3, slip_speed: 0.05}
gravity: [0, -9.81]
initial: {positions: {disc: [0.1, -0.35]}, angles: {drum: 0.4}, speeds: {drum: 6}}
run: {duration: 0.5}
accuracy: {tolerance: 1.0e-9}
"""


def test_a_roller_in_a_turning_drum_follows_its_equations_written_for_it_alone():
    """Friction between both rims, rotation of both bodies, bounces: by another method."""
    k, mu, slip, r = 1e6, 0.3, 0.05, 0.1

    def rates(_, s):
        x, y, _, _, u, v, spin, drum = s
        far = np.hypot(x, y)
        ex, ey = x / far, y / far
        press = k * max(far + r - 0.5, 0.0)
        grip = 0.4 / max(far, 0.4)  # as the rims would slide undeformed
        slides = grip * (-ey * u + ex * v) + spin * r - drum * 0.5
        rub = -mu * press * np.tanh(slides / slip)
        ax, ay = (-press * ex - grip * rub * ey) / 2, (-press * ey + grip * rub * ex) / 2 - G
        return [u, v, spin, drum, ax, ay, rub * r / 0.01, -rub * 0.5]

    def gap(_, s):
        return 0.4 - np.hypot(s[0], s[1])

    gap.terminal = True
    keep = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13, "max_step": 1e-3}
    t, state = 0.0, [0.1, -0.35, 0, 0.4, 0, 0, 0, 6]
    while t < 0.5:
        leg = solve_ivp(rates, (t, 0.5), state, events=gap, **keep)
        t, state = leg.t[-1], leg.y[:, -1]
        if t < 0.5:  # go on a little beyond the event, which else is found again
            leg = solve_ivp(rates, (t, t + 1e-7), state, **keep)
            t, state = leg.t[-1], leg.y[:, -1]
    result = alone(DRUM)
    assert abs(result.rates[-1, 1, 2]) > 1  # it was driven to turn
    got = [*result.poses[-1, 1], result.poses[-1, 0, 2]]
    np.testing.assert_allclose(got, state[:4], atol=1e-6)
    assert energy_change(result) < 1e-6


# --- an open curve's ends ---------------------------------------------------------------------

LEDGE = """
curves: {{ledge: {{type: line, from: [0, 0], to: [0.3, 0]}}}}
bodies: {{bead: {{type: rigid, mass: 1, inertia: 1.0e-3, points: {{c: [0, 0]}}}}}}
contacts:
  ledge:
    type: point_on_curve
    point: bead.c
    curve: ledge
    law: {{stiffness: 1.0e6, restitution: 1}}
gravity: [0, -9.81]
initial: {{positions: {{bead: [{x}, {y}]}}, velocities: {{bead: [{u}, {v}]}}}}
run: {{duration: 0.5}}
accuracy: {{tolerance: 1.0e-9}}
"""


def test_a_bead_falls_off_the_end_of_a_straight_curve():
    result = alone(LEDGE.format(x=0.1, y=0, u=1, v=0))
    (touch,) = result.intervals["ledge"]
    assert touch.slides_off
    assert touch.end == pytest.approx(0.2, abs=1e-9)
    assert touch.end_place == pytest.approx(0.3, abs=1e-9)
    # It swings on the ledge, between 0 and 2 m g/k, by which it starts to fall.
    fallen = where(result, "bead.c")[-1, 1] + G * 0.3**2 / 2
    assert abs(fallen) < 2 * G / 1e6 + 0.3 * G / sqrt(1e6) * 2


def test_a_bead_that_came_from_below_is_not_held():
    """It passes beside the end, is over the ledge, and falls on it; the ledge's back lets pass."""
    result = alone(LEDGE.format(x=-0.1, y=-0.2, u=0.7, v=3))
    flight = lambda t: (-0.1 + 0.7 * t, -0.2 + 3 * t - G * t * t / 2)  # noqa: E731
    crosses = 3 / G - sqrt(9 - 2 * G * 0.2) / G
    assert flight(crosses)[0] < 0  # beside it
    x, y = flight(0.5)
    np.testing.assert_allclose(where(result, "bead.c")[-1], [x, y], atol=1e-10)
    assert not len(result.intervals["ledge"])


# --- a body that turns away from a hoop --------------------------------------------------------

TURNING = """
curves: {{hoop: {{type: circle, centre: [0, 0], radius: 1}}}}
bodies: {{top: {{type: rigid, mass: 1, inertia: 0.2, points: {{p: [0.3, 0.1]}}}}}}
contacts:
  hoop: {{type: point_on_curve, point: top.p, curve: hoop, law: {{type: impulse, restitution: 0}}}}
initial: {{velocities: {{top: [{speed}, 0.2]}}, angles: {{top: 0.3}}, speeds: {{top: -14}}}}
run: {{duration: 1}}
accuracy: {{tolerance: 1.0e-7}}
"""


@pytest.mark.parametrize("speed", [1.9, 2.3])
def test_a_point_that_a_plastic_impact_stops_turns_away(speed):
    """Rounding puts the point a little beyond the hoop, as the impact ends: it goes nevertheless.

    The body flies freely before and after: one impact, whose impulse stops its point.
    """
    start, turning, arm = np.array([speed, 0.2]), -14.0, np.array([0.3, 0.1])

    def out(angle):
        return np.array([[cos(angle), -sin(angle)], [sin(angle), cos(angle)]]) @ arm

    hit = brentq(lambda t: np.linalg.norm(start * t + out(0.3 + turning * t)) - 1, 0.35, 0.45)
    lever = out(0.3 + turning * hit)
    inward = -(start * hit + lever)
    across = lever[0] * inward[1] - lever[1] * inward[0]
    impulse = -(inward @ start + across * turning) / (1 + across**2 / 0.2)
    result = alone(TURNING.format(speed=speed))
    [touch] = result.intervals["hoop"]
    assert touch.impulse == pytest.approx(impulse, rel=1e-9)
    assert touch.begin == touch.end == pytest.approx(hit, abs=1e-11)
    since = np.maximum(result.time - hit, 0)
    centre = start * result.time[:, None] + impulse * since[:, None] * inward
    np.testing.assert_allclose(result.poses[:, 0, :2], centre, atol=1e-7)
    turned = 0.3 + turning * result.time + impulse * across / 0.2 * since
    np.testing.assert_allclose(result.poses[:, 0, 2], turned, atol=1e-7)


# --- an inner corner --------------------------------------------------------------------------

CORNER = """
curves: {{{curves}}}
bodies: {{bead: {{type: rigid, mass: 1, inertia: 0, points: {{c: [0, 0]}}}}}}
contacts: {{{contacts}}}
initial: {{positions: {{bead: [-0.3, {y}]}}, velocities: {{bead: [1, -1]}}}}
run: {{duration: 0.8}}
accuracy: {{tolerance: 1.0e-6}}
"""
APART = ("floor: {{type: line, from: [-1, 0], to: [{past}, 0]}}, "
         "wall: {{type: line, from: [0, -{past}], to: [0, 1]}}")  # fmt: skip
ROUNDED = ("joined: {type: joined, pieces: [{type: line, from: [-1, 0], to: [-0.05, 0]}, "
           "{type: circle, centre: [-0.05, 0.05], radius: 0.05, from: -90 deg, to: 0 deg}, "
           "{type: line, from: [0, 0.05], to: [0, 1]}]}")  # fmt: skip


def thrown_into_corner(curves, y):
    """Where a bead is at last that flies into the corner of a floor and a wall, y above it."""
    names = ["joined"] if "joined" in curves else ["floor", "wall"]
    law = "law: {stiffness: 1.0e5, restitution: 0.5}"
    each = (f"{n}: {{type: point_on_curve, point: bead.c, curve: {n}, side: left, {law}}}"
            for n in names)  # fmt: skip
    result = alone(CORNER.format(curves=curves, contacts=", ".join(each), y=y))
    return where(result, "bead.c")[-1]


def test_a_corner_of_lines_that_end_there_leaks():
    np.testing.assert_allclose(thrown_into_corner(APART.format(past=0), 0.3), [0.5, -0.5])


@pytest.mark.parametrize("y", [0.2997, 0.3, 0.3003])
@pytest.mark.parametrize("curves", [APART.format(past=0.1), ROUNDED], ids=["longer", "rounded"])
def test_a_corner_of_longer_lines_or_an_arc_holds(curves, y):
    last = thrown_into_corner(curves, y)
    assert last[0] < -0.2
    assert last[1] > 0.2
