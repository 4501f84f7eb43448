"""Points and rollers on curves that they can't cross: closed forms, and equations by hand."""

from dataclasses import replace
from math import cos, pi, sin, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipk
from test_physics_tools import run_model, scene, total_energy, where

from exudyn_flexlink.effects import idealise
from exudyn_flexlink.engines import NotRepresentableError, simulate
from exudyn_flexlink.engines.exudyn.minimal.contacts import PenaltyContact, RigidContact, Side
from exudyn_flexlink.engines.exudyn.run import formulations
from exudyn_flexlink.laws import Impulse
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.mechanism import approach, build_mechanism, formulation
from exudyn_flexlink.mechanism.tree import tree_layout

G = 9.81


def alone(text, *settings):
    """Result of a run by itself, without a neighbour that measures its error."""
    result = simulate(scene(text, *settings), measure=False)
    assert result.outcome.completed, result.outcome
    return result


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


def test_a_bead_that_slides_down_a_hoop_swings_like_a_pendulum():
    """From the horizontal, where nothing presses, with the elliptic period and no loss."""
    quarter = sqrt(0.5 / G) * ellipk(0.5)
    result = alone(bead(pi / 2, 2.1 * quarter))
    energy = total_energy(result)
    assert abs(energy - energy[0]).max() < 1e-7
    x = where(result, "bead.c")[:, 0]
    i = int(np.flatnonzero(x < 0)[0])
    below = result.time[i - 1] + x[i - 1] / (x[i - 1] - x[i]) * np.diff(result.time[i - 1 : i + 1])
    # The hoop gives way by a few parts in a million: so much longer is the pendulum.
    assert below == pytest.approx(quarter, rel=2e-5)
    bottom = int(np.argmin(abs(x)))
    assert result.contacts["hoop"].force[bottom] == pytest.approx(3 * 2 * G, rel=1e-3)


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
    keep = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13, "max_step": 2e-4}
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
    """Friction at the roller's edge, rotation of both bodies, bounces: by another method."""
    k, mu, slip, r = 1e6, 0.3, 0.05, 0.1

    def rates(_, s):
        x, y, _, _, u, v, spin, drum = s
        far = np.hypot(x, y)
        ex, ey = x / far, y / far
        press = k * max(far + r - 0.5, 0.0)
        slides = -ey * u + ex * v + spin * r - drum * (far + r)
        rub = -mu * press * np.tanh(slides / slip)
        ax, ay = (-press * ex - rub * ey) / 2, (-press * ey + rub * ex) / 2 - G
        return [u, v, spin, drum, ax, ay, rub * r / 0.01, -rub * (far + r)]

    def gap(_, s):
        return 0.4 - np.hypot(s[0], s[1])

    gap.terminal = True
    keep = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13, "max_step": 2e-4}
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
    assert energy_kept(result) < 1e-6


def energy_kept(result):
    """Largest change (J) of energy with what was lost and supplied."""
    energy = result.energy
    total = energy.kinetic + energy.stored + energy.dissipated - energy.supplied
    return abs(total - total[0]).max()


# --- cams and followers -----------------------------------------------------------------------

E, STIFF, PRELOAD, MASS = 0.01, 2000.0, 20.0, 0.5

FLAT = """
curves: {{sole: {{type: line, from: [-0.05, 0], to: [0.05, 0], on: follower}}}}
bodies:
  cam: {{type: rigid, mass: 1, inertia: 1.0e-3, points: {{hub: [0, 0], middle: [0.01, 0]}}}}
  follower: {{type: rigid, mass: 0.5, inertia: 1.0e-3, points: {{foot: [0, 0]}}}}
joints:
  shaft: {{type: revolute, points: [ground, cam.hub], at: [0, 0]}}
  guide: {{type: prismatic, points: [ground, follower.foot], at: [0, 0.02], axis: [0, 1]}}
springs:
  # Without force 10 mm below the guide's point: pressed by 20 N where the follower is lowest.
  spring: {{type: linear, joint: guide, stiffness: 2000, length: -0.01}}
drives: {{motor: {{type: speed, joint: shaft, value: {speed}}}}}
contacts:
  heel:
    type: point_on_curve
    point: cam.middle
    curve: sole
    side: right
    radius: 0.03
    law: {{stiffness: 1.0e9, restitution: 0, transition_speed: 0.02}}
initial: {{angles: {{cam: -90 deg}}, positions: {{follower: [0, 0.02]}}}}
run: {{duration: {duration}}}
accuracy: {{tolerance: 1.0e-9}}
"""
LIMIT = sqrt((PRELOAD + 2 * STIFF * E) / (MASS * E))  # rad/s: nothing presses as it is highest


def test_a_flat_follower_stays_on_an_eccentric_disc_below_the_limit_of_its_speed():
    """y = e (1 - cos wt), as the contact force of a rigid follower never vanishes."""
    speed_ = 0.99 * LIMIT
    result = alone(FLAT.format(speed=speed_, duration=2.2 * pi / speed_))
    lift = where(result, "follower.foot")[:, 1] - 0.02
    np.testing.assert_allclose(lift, E * (1 - np.cos(speed_ * result.time)), atol=2e-6)
    (touch,) = result.intervals["heel"]
    assert touch.lasts


def test_a_flat_follower_leaves_an_eccentric_disc_where_its_contact_force_vanishes():
    """And flies on its spring until it meets the disc again."""
    speed_ = 1.2 * LIMIT
    result = alone(FLAT.format(speed=speed_, duration=2 * pi / speed_))
    touches = list(result.intervals["heel"])
    leaves = np.arccos(-(PRELOAD + STIFF * E) / (E * (MASS * speed_**2 - STIFF))) / speed_
    assert touches[0].end == pytest.approx(leaves, abs=1e-7)
    own, rest = sqrt(STIFF / MASS), -PRELOAD / STIFF
    y, v = E * (1 - cos(speed_ * leaves)), E * speed_ * sin(speed_ * leaves)

    def gap(t):
        flown = own * (t - leaves)
        flight = rest + (y - rest) * cos(flown) + v / own * sin(flown)
        return flight - E * (1 - cos(speed_ * t))

    meets = brentq(gap, leaves + 0.2 / speed_, 2 * pi / speed_)
    assert touches[1].begin == pytest.approx(meets, abs=1e-6)
    assert energy_kept(result) < 1e-6 * result.energy.kinetic.max()


ROLLER = "textbook/cam_follower.yaml"


@pytest.mark.parametrize(("rpm", "stays"), [(990, True), (1030, False)])
def test_a_roller_jumps_off_an_eccentric_cam_above_the_speed_of_its_closed_form(rpm, stays):
    """Nothing presses at the top at w^2 = F/(m e (1 + e/L)), L both radii: 1007.5 rpm."""
    far, e, m, k = 0.042, 0.01, 0.5, 2000.0
    limit = sqrt((k * (far + e - 0.02) + m * G) / (m * e * (1 + e / far))) * 30 / pi
    assert limit == pytest.approx(1007.5, abs=0.05)
    # Lossy, so that what rings as it starts has died away as it comes to the top.
    law = "contacts.cam_face.law.restitution=0", "contacts.cam_face.law.transition_speed=0.02"
    stiff = "contacts.cam_face.law.stiffness=1.0e9"
    result = run_model(ROLLER, f"drives.motor.value={rpm} rpm", "run.turns=0.9", *law, stiff)
    touches = list(result.intervals["cam_face"])
    assert (len(touches) == 1 and touches[0].lasts) == stays
    a = (rpm * pi / 30) * result.time - pi / 2
    y = e * np.sin(a) + np.sqrt(far**2 - (e * np.cos(a)) ** 2)
    on = result.contacts["cam_face"].force > 0
    np.testing.assert_allclose(where(result, "follower.roller")[on, 1], y[on], atol=2e-6)


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


# --- geometry ---------------------------------------------------------------------------------

SHAPES = {
    "ellipse": "type: ellipse, centre: [0.1, 0], semi_axes: [0.5, 0.2], rotation: 20 deg",
    "spline": "type: spline, points: [[0.5, 0], [0, 0.4], [-0.4, 0.2], [-0.2, -0.4], [0.3, -0.3]]",
    "open": "type: ellipse, centre: [0, 0], semi_axes: [0.5, 0.3], from: 10 deg, to: 350 deg",
}
MOVING = """
curves: {{way: {{{shape}, on: plate}}}}
bodies:
  bead: {{type: rigid, mass: 1, inertia: 1.0e-3, points: {{c: [0.01, 0.02]}}}}
  plate: {{type: rigid, mass: 1, inertia: 1.0e-2, points: {{hub: [0, 0]}}}}
contacts:
  way:
    type: point_on_curve
    point: bead.c
    curve: way
    side: {side}
    radius: 0.02
    law: {{stiffness: 1.0e4, restitution: 1}}
initial: {{positions: {{bead: [0.05, 0.1], plate: [0, 0]}}, angles: {{bead: 0, plate: 0}}}}
run: {{duration: 1}}
accuracy: {{tolerance: 1.0e-6}}
"""


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("held", [False, True])
def test_gap_place_and_their_rates_are_those_of_the_curve(shape, held):
    """Both ways that know them agree, rates are derivatives, also the curve's second one."""
    assembly = assemble_scene(scene(MOVING.format(shape=SHAPES[shape], side="left")))
    (own,) = assembly.mechanism.contacts
    layout = tree_layout(assembly.mechanism)
    contact = PenaltyContact(layout, own, own.law)
    rng = np.random.default_rng(3)
    x, v = rng.normal(scale=0.1, size=6), rng.normal(size=6)
    if held:
        contact.side = Side.PRESSED
        contact.follow(x)
    h = 1e-6
    seen = [contact.touch(x + by * v, v) for by in (-h, 0.0, h)]
    assert seen[1].gap_rate == pytest.approx((seen[2].gap - seen[0].gap) / (2 * h), abs=1e-8)
    q, rate = poses(layout, x), poses(layout, v)
    at = approach(own, q, rate)
    for mine, other in (
        (seen[1].gap, at.gap),
        (seen[1].place, at.place),
        (seen[1].gap_rate, at.gap_rate),
        (seen[1].slip, at.slip),
    ):
        assert mine == pytest.approx(float(other), abs=1e-12)
    assert contact.gradient(x, v) @ v == pytest.approx(seen[1].gap_rate, abs=1e-12)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("side", ["left", "right"])
def test_the_stiffness_across_the_normal_is_the_force_times_the_second_derivative_of_the_gap(
    shape, side
):
    assembly = assemble_scene(scene(MOVING.format(shape=SHAPES[shape], side="left")))
    own = replace(assembly.mechanism.contacts[0], side=1.0 if side == "left" else -1.0)
    layout = tree_layout(assembly.mechanism)
    contact = PenaltyContact(layout, own, own.law)
    contact.side = Side.PRESSED
    curve = own.curve
    u = 0.4 * (curve.start + curve.end)
    inside = curve.point(u) - own.side * 0.01 * curve.normal(u)
    x = np.zeros(6)
    moves = layout.path(layout.frames[0].link)[:2]
    x[moves] = inside - [0.01, 0.02]  # the point of the bead
    contact.follow(x)
    touch, h = contact.touch(x, np.zeros(6)), 1e-4
    assert touch.gap == pytest.approx(-0.03, abs=1e-12)  # with the roller's radius

    def gap(one, other):
        at = x.copy()
        at[moves] += [one, other]
        return contact.touch(at, np.zeros(6)).gap

    across = (gap(h, h) - gap(h, -h) - gap(-h, h) + gap(-h, -h)) / 4
    bends = np.array([[gap(h, 0) + gap(-h, 0), across], [across, gap(0, h) + gap(0, -h)]])
    bends -= np.diag([2 * touch.gap] * 2)
    stiffness, damping = contact.slopes(x, np.zeros(6))
    np.testing.assert_allclose(
        stiffness[np.ix_(moves, moves)], -1e4 * 0.03 * bends / h**2, atol=1e-3, rtol=1e-5
    )
    assert not damping.any()


@pytest.mark.parametrize("shape", SHAPES)
def test_a_gap_bends_with_the_motion_of_point_and_curve(shape):
    """Where no coordinate of the tree accelerates: the derivative of its rate."""
    assembly = assemble_scene(scene(MOVING.format(shape=SHAPES[shape], side="left")))
    own = replace(assembly.mechanism.contacts[0], law=Impulse(0.5))
    contact = RigidContact(tree_layout(assembly.mechanism), own, own.law)
    rng = np.random.default_rng(3)
    x, v, h = rng.normal(scale=0.1, size=6), rng.normal(size=6), 1e-5
    rates = [contact.touch(x + by * v, v).gap_rate for by in (-h, h)]
    bend = (rates[1] - rates[0]) / (2 * h)
    assert contact.steady_bend(x, v) == pytest.approx(bend, rel=1e-6)


def poses(layout, x):
    """Coordinates (parts, 3) of two free bodies, which the tree has in another order."""
    found = np.zeros((2, 3))
    for part in range(2):
        last = layout.frames[part].link
        links = layout.path(last)
        for i, axis in zip(links, (0, 1, 2), strict=True):
            found[part, axis] = x[i]
    return found


def test_a_given_step_does_not_ask_for_a_solver_that_has_no_points_on_curves():
    fixed = scene(FLAT.format(speed=50, duration=0.01).replace("tolerance: 1.0e-9", "step: 1.0e-5"))
    assert formulation(fixed) == "minimal"
    assert formulations(fixed) == ("minimal",)


def test_the_engines_that_have_no_points_on_curves_say_so():
    text = FLAT.format(speed=50, duration=0.01)
    with pytest.raises(NotRepresentableError, match="heel"):
        simulate(scene(text, "solver.formulation=redundant"), measure=False)
    with pytest.raises(NotRepresentableError):
        simulate(scene(text), engine="lagrangian", measure=False)


def test_without_impact_the_contact_goes_and_the_cam_stays():
    without = idealise(scene(FLAT.format(speed=50, duration=0.01)), ["impact"])
    assert not without.contacts
    assert set(without.bodies) == {"cam", "follower"}
    assert build_mechanism(without).contacts == ()
