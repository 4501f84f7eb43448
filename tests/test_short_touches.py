"""Touches that are short against a step are found: a gap changes by no more than the way."""

from math import pi, sqrt

import numpy as np
import pytest
from physics_tools import scene
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from exudyn_flexlink.curves import Spline, circle_arc, reach
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.engines.pair_events import (
    Flight,
    Glimpse,
    Seen,
    calm,
    first_of,
    first_part,
)
from exudyn_flexlink.integrate.problem import FEW
from exudyn_flexlink.integrate.radau import collocation

NODES = collocation(FEW).nodes
BALL = "bodies: {ball: {type: rigid, mass: 1, inertia: 1, points: {c: [0, 0]}}}"
HILL = [[1, 0], [0.5, 0], [0.25, 0], [0.15, 0], [0.1, 0.005], [0.05, 0.03], [0, 0.05],
        [-0.05, 0.03], [-0.1, 0.005], [-0.15, 0], [-0.25, 0], [-0.5, 0], [-1, 0]]  # fmt: skip


def first_touch(text, name, *settings):
    result = simulate(scene(text, *settings), measure=True)
    assert result.outcome.completed
    assert result.error.exceeds_from is None
    return result.intervals[name].begin[0]


@pytest.mark.parametrize("start", [-0.3, -0.6, -0.8])
def test_a_point_that_flies_level_strikes_a_hill(start):
    """Its gap does not change at either end of a step that passes the hill."""
    text = f"""
{BALL}
curves: {{floor: {{type: spline, closed: false, points: {HILL}}}}}
contacts: {{hit: {{type: point_on_curve, point: ball.c, curve: floor, side: right,
           law: {{type: impulse, restitution: 1}}}}}}
initial: {{positions: {{ball: [{start}, 0.04]}}, velocities: {{ball: [10, 0]}}}}
run: {{duration: 0.16}}
accuracy: {{tolerance: 1.0e-6}}
"""
    points = np.array(HILL)
    chords = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    x, y = (CubicSpline(chords, points[:, k]) for k in (0, 1))
    flank = brentq(lambda u: y(u) - 0.04, chords[6], chords[7])  # on the far side of the top: x < 0
    assert first_touch(text, "hit") == pytest.approx((x(flank) - start) / 10, abs=1e-9)


PIN = """
contacts:
  pin:
    type: circle_on_circle
    circles:
      - {at: ball.centre, radius: 0.0625}
      - {at: ground, place: [0.03125, 0.015625], radius: 0.125}
    law: {type: impulse, restitution: 1}
  ground: {type: point_on_curve, point: ball.c, curve: floor, side: left, radius: 0.0625,
           law: {type: impulse, restitution: 1}}
curves: {floor: {type: line, from: [-5, -0.5], to: [5, -0.5]}}
gravity: 9.81
initial: {positions: {ball: [-1.35, 0.5]}, velocities: {ball: [0.96, -0.69]}}
"""


@pytest.mark.parametrize("duration", [2, 6, 8])
def test_a_ball_meets_a_pin_in_its_third_hop_however_long_the_run(duration):
    """After two strikes of the floor, parabolas, the distance of the middles falls to 0.1875 m."""
    g, floor = 9.81, -0.5 + 0.0625
    fast = sqrt(0.69**2 + 2 * g * (0.5 - floor))
    landed = (fast - 0.69) / g + 2 * fast / g  # the second time

    def gap(t):
        s = t - landed
        place = complex(-1.35 + 0.96 * t, floor + fast * s - g * s * s / 2)
        return abs(place - complex(0.03125, 0.015625)) - 0.1875

    looks = landed + np.arange(0, 0.2, 1e-4)
    below = looks[next(k for k, t in enumerate(looks) if gap(t) < 0)]
    right = brentq(gap, below - 1e-4, below, xtol=1e-15)
    settings = f"run={{duration: {duration}}}", "accuracy={tolerance: 1.0e-6}"
    assert first_touch(BALL + PIN, "pin", *settings) == pytest.approx(right, abs=1e-10)


def test_a_ball_that_bounces_on_a_pin_within_a_hundredth_of_a_step_strikes_it_each_time():
    """On the pin it bounces four times; the last flight is 28 ms of the 5.8 s that are left.

    Instants by parabolas between circles, to sixty digits.
    """
    text = f"""
{BALL}
contacts:
  pin: {{type: circle_on_circle, circles: [{{at: ball.c, radius: 0.0212847}},
    {{at: ground, place: [-0.3585741994162238, 0.6302656629510038], radius: 0.00768597}}],
    law: {{type: impulse, restitution: 1}}}}
  ground: {{type: point_on_curve, point: ball.c, radius: 0.0212847, curve: floor, side: left,
    law: {{type: impulse, restitution: 1}}}}
curves: {{floor: {{type: line, from: [-100, 0], to: [100, 0]}}}}
gravity: [0, -9.81]
initial:
  positions: {{ball: [0, 0.2559897]}}
  velocities: {{ball: [-0.34872043798724217, 2.8083706096730374]}}
run: {{duration: 6.866}}
accuracy: {{tolerance: 1.0e-7}}
"""
    struck = simulate(scene(text), measure=False).intervals["pin"].begin
    right = [1.0034970154280125, 1.0275166259177853, 1.0507234614442897, 1.0789992102212052]
    assert struck == pytest.approx(right, abs=1e-8)


def test_a_narrow_lobe_of_a_cam_that_turns_freely_strikes_a_roller():
    """A third of a degree wide; the distance of the middles falls to the sum of both radii."""
    text = """
bodies:
  cam: {type: rigid, mass: 1, inertia: 1.0e3, points: {hub: [0, 0], lobe: [50 mm, 0]}}
  follower: {type: rigid, mass: 1, inertia: 1, points: {c: [0, 0]}}
joints:
  shaft: {type: revolute, points: [ground, cam.hub], at: [0, 0]}
  guide: {type: prismatic, points: [ground, follower.c], at: [0, 0], axis: [1, 0]}
curves: {lobe: {type: circle, on: cam, centre: [50 mm, 0], radius: 0.2 mm}}
contacts: {hit: {type: point_on_curve, point: follower.c, radius: 0.1 mm, curve: lobe, side: right,
           law: {type: impulse, restitution: 1}}}
initial: {speeds: {cam: 1}, angles: {cam: -170 deg}, along: {guide: 50.1 mm}}
run: {duration: 4}
accuracy: {tolerance: 1.0e-6}
"""
    apart = np.arccos((0.05**2 + 0.0501**2 - 0.0003**2) / (2 * 0.05 * 0.0501))
    assert first_touch(text, "hit") == pytest.approx(17 / 18 * pi - apart, abs=1e-9)


def test_a_corner_of_a_disc_that_turns_freely_strikes_a_flat_face():
    """An ellipse with axes 60 mm and 2 mm reaches a face 59.9 mm from its middle twice a turn."""
    text = """
bodies:
  disc: {type: rigid, mass: 1, inertia: 1.0e3, points: {hub: [0, 0]}}
  table: {type: rigid, mass: 1, inertia: 1, points: {c: [0, 0], a: [-1, 0], b: [1, 0]}}
joints:
  shaft: {type: revolute, points: [ground, disc.hub], at: [0, 0]}
  guide: {type: prismatic, points: [ground, table.c], at: [0, 0], axis: [0, 1]}
curves: {rim: {type: ellipse, centre: [0, 0], semi_axes: [60 mm, 2 mm], on: disc}}
contacts: {hit: {type: line_on_curve, line: [table.a, table.b], side: right, curve: rim,
           law: {type: impulse, restitution: 1}}}
initial: {speeds: {disc: 1}, along: {guide: 59.9 mm}}
run: {duration: 2}
accuracy: {tolerance: 1.0e-6}
"""
    # The support function of an ellipse, at the angle of the face's normal in the disc's axes.
    sine = sqrt((0.0599**2 - 0.002**2) / (0.06**2 - 0.002**2))
    assert first_touch(text, "hit") == pytest.approx(np.arcsin(sine), abs=1e-9)


# --- the search itself, against looks at 20,000 places in a step ---------------------------------

PARTS = np.linspace(0.0, 1.0, 20_001)


def nodes_of(coefficients):
    """Places at a step's nodes of polynomials (c, k), and their rates per step."""
    powers = NODES[:, None] ** np.arange(coefficients.shape[1])
    places = powers @ coefficients.T
    rates = powers[:, :-1] @ (coefficients[:, 1:] * np.arange(1, coefficients.shape[1])).T
    return places, rates


def along(coefficients):
    return PARTS[:, None] ** np.arange(coefficients.shape[1]) @ coefficients.T


def test_two_circles_touch_within_a_step_when_looks_find_it():
    for number in range(300):
        circles_touch_when_looks_find_it(np.random.default_rng([7, number]))


def circles_touch_when_looks_find_it(rng):
    radius = 10.0 ** rng.uniform(-2, 0)
    polynomial = (rng.normal(size=4) + 1j * rng.normal(size=4)) * [1, 3, 2, 0.5]
    # It passes the circle by so much at some instant, on either side of touching.
    at = rng.uniform(0.05, 0.95)
    place = (at ** np.arange(4)) @ polynomial
    aim = radius * (1 + rng.normal() * 0.1) * np.exp(2j * pi * rng.uniform())
    polynomial[0] += aim - place

    def glance(place, rate):
        far = abs(place)
        return Glimpse(far - radius, (place.conjugate() * rate).real / far)

    gaps = np.abs(along(polynomial[None])[:, 0]) - radius
    if gaps[0] < 0 or abs(gaps.min()) < 1e-7:
        return  # it begins within the circle, or grazes it as nearly as looks tell
    places, rates = nodes_of(polynomial[None])
    part = first_part(Flight(glance, radius, (places[:, 0], rates[:, 0]), 1.0))
    below = np.flatnonzero(gaps < 0)
    if len(below):
        assert part == pytest.approx(PARTS[below[0]], abs=2 * PARTS[1])
    else:
        assert part is None


@pytest.mark.parametrize("pressing", [False, True])
def test_a_point_touches_a_face_within_a_step_when_looks_find_it(pressing):
    for number in range(300):
        face_is_touched_when_looks_find_it(np.random.default_rng([11, number]), pressing)


def face_is_touched_when_looks_find_it(rng, pressing):
    polynomials = rng.normal(size=(2, 5)) * [1, 2, 2, 1, 1]
    at = rng.uniform(0.05, 0.95)
    length = 10.0 ** rng.uniform(-2, 0.5)
    aims = rng.normal() * 0.05, length * (0.5 + rng.normal() * 0.5)
    polynomials[:, 0] += np.array(aims) - polynomials @ at ** np.arange(5)
    gap, place = along(polynomials).T
    value = np.maximum(gap, np.maximum(-place, place - length)) * (-1 if pressing else 1)
    if value[0] < 0 or abs(value.min()) < 1e-6:
        return
    places, rates = nodes_of(polynomials)
    path = Seen(places[:, :1], places[:, 1:], rates[:, :1], rates[:, 1:])
    lengths, presses = np.array([length]), np.array([pressing])
    found = first_of(np.array([0]), path, lengths, presses, 1.0)
    below = np.flatnonzero(value < 0)
    if len(below):
        assert not calm(path, lengths, presses, 1.0)[0]
        assert found is not None
        assert found[0] == pytest.approx(PARTS[below[0]], abs=2 * PARTS[1])
    else:
        assert found is None


# --- how near a curve comes to itself -----------------------------------------------------------


def test_a_circle_reaches_its_radius_and_a_roller_adds_its_own_outside():
    circle = circle_arc((0.0, 0.0), 0.3)
    assert reach(circle, 1.0, 0.0) == pytest.approx(0.3)
    assert reach(circle, 1.0, 0.1) == pytest.approx(0.2)  # inside: left of a counter-clockwise one
    assert reach(circle, -1.0, 0.1) == pytest.approx(0.4)


def test_a_neck_counts_by_half_its_width():
    """A closed spline whose two long sides are 2 mm apart in the middle."""
    x = np.linspace(-1, 1, 41)
    width = 0.001 + 0.2 * x**2
    loop = np.concatenate([np.c_[x, -width], np.c_[x, width][::-1]])
    assert reach(Spline(loop, closed=True), 1.0, 0.0) == pytest.approx(0.001, rel=0.1)


ROPE_BETWEEN_STOPS = """
bodies:
  ball: {type: rigid, mass: 1, inertia: 1, points: {c: [0, 0]}}
  ram: {type: rigid, mass: 1, inertia: 1, points: {c: [0, 0]}}
joints:
  way:
    type: prismatic
    points: [ground, ram.c]
    at: [0, 3]
    axis: [0, 1]
    limits: {from: 0, law: {stiffness: 3 kN/m, damping: 2 N s/m}}
springs:
  rope: {type: linear, points: [ground, ball.c], at: [0, 0], acts: tension, length: 0.2,
         stiffness: 3 kN/m}
  buffer: {type: linear, joint: way, acts: compression, length: 0.2, stiffness: 1 kN/m}
gravity: [9.81, 0]
initial: {positions: {ball: [0.1, 0]}, along: {way: 0.5}}
run: {duration: 0.2}
accuracy: {tolerance: 1.0e-6}
"""


@pytest.mark.parametrize("start", [0.1, 0.12, 0.15])
def test_a_rope_becomes_taut_whatever_contacts_stand_before_and_after_it(start):
    """Stops move along a line, the ends of a rope in a plane; the run ends just after the catch."""
    taut = sqrt(2 * (0.2 - start) / 9.81)
    settings = f"initial.positions.ball=[{start}, 0]", f"run.duration={taut + 1e-3}"
    begin = first_touch(ROPE_BETWEEN_STOPS, "rope", *settings)
    assert begin == pytest.approx(taut, abs=1e-9)
