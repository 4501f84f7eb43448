"""Formulas that bend with the state: stops, play, clamps; closed forms and pieces of DOP853."""

from math import pi, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.engines.exudyn.minimal.formulas import KinkGuard
from exudyn_flexlink.loading import scene_of
from exudyn_flexlink.source import parse_document

BLOCK = """title: a block on a rail
bodies: {{block: {{type: rigid, mass: {mass}, inertia: 0, points: {{c: [0, 0]}}}}{bodies}}}
joints: {{way: {{type: prismatic, points: [ground, block.c], at: [0, 0], axis: [1, 0]}}{joints}}}
drives: {{force: {{type: force, point: block.c, value: ["{force}", 0]}}}}
{more}
initial: {{speeds_along: {{way: {speed}}}}}
run: {{duration: {lasts}}}
accuracy: {{tolerance: {tolerance}}}
"""


def run(text):
    found = simulate(scene_of(parse_document(text, "test")))
    assert found.outcome.completed
    return found


def block(force, speed, lasts, tolerance=1e-06, mass=1.0, **more):
    parts = {"bodies": "", "joints": "", "more": ""} | more
    force = force.replace("X", "place(way)").replace("V", "speed(way)")
    values = {"mass": mass, "speed": speed, "lasts": lasts, "tolerance": tolerance}
    return run(BLOCK.format(force=force, **values, **parts))


def by_pieces(law, zeros, speed, times):
    """Places by an acceleration, integrated anew from each of the zeros at which it bends."""
    events = []
    for zero in zeros:

        def event(_, y, zero=zero):
            return zero(y[0], y[1])

        event.terminal = True
        events.append(event)
    t, y, found = 0.0, np.array([0.0, speed]), []
    while True:
        piece = solve_ivp(
            lambda _, y: [y[1], law(*y)], (t, times[-1]), y, "DOP853",
            events=events, dense_output=True, rtol=1e-12, atol=1e-14,
        )  # fmt: skip
        within = times[(times >= t) & (times <= piece.t[-1])]
        found.append(np.reshape(piece.sol(within)[0], -1)) if len(within) else None
        t, y = piece.t[-1], piece.y[:, -1]
        if t >= times[-1]:
            return np.concatenate(found)
        h = 1e-9  # beyond the zero, or it would be found again
        skipped = times[(times > t) & (times < t + h)]
        found.append(np.full(len(skipped), y[0]))
        t, y = t + h, y + h * np.array([y[1], law(*y)])


# --- closed forms ---------------------------------------------------------------------------------


def between_stops(t, play, speed, swing):
    """A block that flies between two springs and swings at `swing` (rad/s) in each."""
    quarter, half = play / speed, pi / swing
    part = np.mod(t, 4 * quarter + 2 * half)
    mirrored = part > 2 * quarter + half
    part = np.where(mirrored, part - 2 * quarter - half, part)
    inside = np.clip(part - quarter, 0, half)
    back = np.maximum(part - quarter - half, 0)
    at = speed * np.minimum(part, quarter) + speed / swing * np.sin(swing * inside) - speed * back
    return np.where(mirrored, -at, at)


@pytest.mark.parametrize(
    ("mass", "stiffness", "play", "speed", "lasts"),
    [
        (0.961615, 241784, 0.0485932, 2.81775, 1.0),
        (2.2, 2e6, 0.03, 3.7, 0.5),
    ],
)
def test_play_between_two_stops(mass, stiffness, play, speed, lasts):
    """The first is off by 24 um after 3 s, if steps go over the kinks: 1 s shows that, too."""
    force = f"-{stiffness}*max(0, X - {play}) + {stiffness}*max(0, -{play} - X)"
    found = block(force, speed, lasts, mass=mass)
    right = between_stops(found.time, play, speed, sqrt(stiffness / mass))
    np.testing.assert_allclose(found.poses[:, 0, 0], right, rtol=0, atol=1e-7)


@pytest.mark.parametrize(
    ("stiffness", "play", "speed", "lasts", "tolerance"),
    [(34540, 0.0450553, 1.17276, 0.1, 1.3e-5), (21000, 0.012, 1.9, 0.1, 3e-5)],
)
def test_play_between_two_stops_in_redundant_coordinates(stiffness, play, speed, lasts, tolerance):
    """A step out of free flight, of any length, went over a kink, and so did its neighbour's."""
    force = f"-{stiffness}*max(0, X - {play}) + {stiffness}*max(0, -{play} - X)"
    found = block(
        force, speed, lasts, tolerance, mass=0.797461, more="solver: {formulation: redundant}"
    )
    right = between_stops(found.time, play, speed, sqrt(stiffness / 0.797461))
    np.testing.assert_allclose(found.poses[:, 0, 0], right, rtol=0, atol=tolerance)
    assert not found.warnings


LEFT = {
    "bodies": ", wall: {type: rigid, mass: 1, inertia: 1, points: {a: [0, -1], b: [0, 1]}}",
    "joints": ", fix: {type: weld, points: [ground, wall.a], at: [-0.02, -1]}",
}


CONTACT = """contacts:
  left: {{type: point_on_line, point: block.c, line: [wall.b, wall.a], law: {{{law}}}}}"""


def test_a_stop_and_a_contact():
    """A stop by formula on the right, a contact of the same stiffness on the left."""
    more = CONTACT.format(law="stiffness: 20000, restitution: 1")
    found = block("-20000*max(0, X - 0.02)", 1.5, 0.5, more=more, **LEFT)
    right = between_stops(found.time, 0.02, 1.5, sqrt(20000))
    np.testing.assert_allclose(found.poses[:, 0, 0], right, rtol=0, atol=1e-6)


def test_a_speed_that_jumps_over_a_kink():
    """What brakes to the right alone does so from the impact on."""
    more = CONTACT.format(law="type: impulse, restitution: 1")
    found = block("-max(0, V)", -1.5, 1, more=more, **LEFT)
    late = np.maximum(found.time - 0.02 / 1.5, 0)
    right = np.where(late > 0, -0.02 + 1.5 * (1 - np.exp(-late)), -1.5 * found.time)
    np.testing.assert_allclose(found.poses[:, 0, 0], right, rtol=0, atol=1e-6)


def test_steps_end_on_kinks(monkeypatch):
    """A step's end is moved to the kink, by how late it says it is: to the rounding of a place."""
    off, cross = [], KinkGuard.cross

    def noted(guard, time):
        off.append(guard.watch._end_of.__self__.finder.x[0] - 0.05)
        cross(guard, time)

    monkeypatch.setattr(KinkGuard, "cross", noted)
    block("-100*X - 5e4*max(0, X - 0.05)", 1, 1, tolerance=1e-4)
    assert len(off) > 4
    assert np.abs(off).max() < 1e-12


def test_a_kink_that_is_grazed():
    """The block turns at the stop, 1 nm before it or 1 nm in it: no more than 1 nm follows."""
    for play in (0.1, 0.1 - 1e-9, 0.1 + 1e-12):
        found = block(f"-100*X - 5e4*max(0, X - {play!r})", 1, 1)
        right = 0.1 * np.sin(10 * found.time)
        np.testing.assert_allclose(found.poses[:, 0, 0], right, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("force", "right"),
    [
        ("-3*abs(V)*V - 100*X", lambda t: 0 * t),
        ("10 - 100*max(0, X)", lambda t: 0.1 * (1 - np.cos(10 * t))),
        ("-1 - 100*max(0, X)", lambda t: -(t**2) / 2),
        ("where(t < 1, 0, -1) - 100*max(0, X)", lambda t: -(np.maximum(t - 1, 0) ** 2) / 2),
        (
            "where(t < 1, 0, 1) - 100*max(0, X)",
            lambda t: 0.01 * (1 - np.cos(10 * np.maximum(t - 1, 0))),
        ),
        (
            "10 - max(0, where(t < 1, -1, 1)*X)",
            lambda t: np.where(t < 1, 5 * t**2, 10 - 5 * np.cos(t - 1) + 10 * np.sin(t - 1)),
        ),
    ],
)
def test_at_rest_on_a_kink(force, right):
    found = block(force, 0, 2, tolerance=1e-7)
    np.testing.assert_allclose(found.poses[:, 0, 0], right(found.time), rtol=0, atol=1e-8)
    assert found.checks.steps < 200


def test_stops_by_torque_in_a_loop():
    """A parallelogram turns as one wheel of 1.2 kg m^2, from whichever joint it is stopped."""
    text = """title: a parallelogram
bodies:
  crank: {{type: rigid, mass: 1, inertia: 0.1, points: {{o: [0, 0], a: [1, 0]}}}}
  coupler: {{type: rigid, mass: 1, inertia: 0.1, points: {{a: [0, 0], b: [2, 0]}}}}
  rocker: {{type: rigid, mass: 1, inertia: 0.1, points: {{o: [0, 0], b: [1, 0]}}}}
joints:
  in: {{type: revolute, points: [ground, crank.o], at: [0, 0]}}
  a: {{type: revolute, points: [crank.a, coupler.a]}}
  b: {{type: revolute, points: [coupler.b, rocker.b]}}
  out: {{type: revolute, points: [ground, rocker.o], at: [2, 0]}}
drives:
  stops:
    type: torque
    joint: {joint}
    value: -6000*max(0, angle({joint}) - 1.1) + 6000*max(0, 0.9 - angle({joint}))
initial:
  {{angles: {{crank: 1}}, guesses: {{coupler: 0.1, rocker: 0.9}}, speeds: {{crank: 3}}}}
run: {{duration: 0.4}}
accuracy: {{tolerance: 1.0e-6}}
"""
    for joint in ("in", "out"):
        found = run(text.format(joint=joint))
        right = 1 + between_stops(found.time, 0.1, 3, sqrt(6000 / 1.2))
        np.testing.assert_allclose(found.poses[:, 0, 2], right, rtol=0, atol=1e-6)


def test_kinks_in_both_components_of_a_force():
    """A point mass between four walls, each way for itself."""
    sides = (
        f"-400*max(0, place(b.c, {axis}) - 0.1) + 400*max(0, -0.1 - place(b.c, {axis}))"
        for axis in "xy"
    )
    found = run(f"""title: between four walls
bodies: {{b: {{type: rigid, mass: 1, inertia: 1, points: {{c: [0, 0]}}}}}}
drives: {{walls: {{type: force, point: b.c, value: {[*sides]}}}}}
initial: {{velocities: {{b: [1, 2]}}}}
run: {{duration: 1}}
accuracy: {{tolerance: 1.0e-7}}
""")
    for axis, speed in enumerate((1, 2)):
        right = between_stops(found.time, 0.1, speed, 20)
        np.testing.assert_allclose(found.poses[:, 0, axis], right, rtol=0, atol=1e-7)


# --- by pieces ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("force", "speed", "law", "zeros"),
    [
        (  # clamp of a force
            "max(-30, min(30, -5e3*X))",
            1.1,
            lambda x, _: max(-30, min(30, -5e3 * x)),
            [lambda x, _: x - 0.006, lambda x, _: x + 0.006],
        ),
        (  # a stop as by Hertz: beyond its kink the power has no value
            "-3e6*max(0, X - 0.01)**1.5 - 300*X",
            1.3,
            lambda x, _: -3e6 * max(0, x - 0.01) ** 1.5 - 300 * x,
            [lambda x, _: x - 0.01],
        ),
        (  # a kink within a kink, and drag
            "-2e5*abs(max(0, X - 0.01) - 0.01)*X - 500*X - 0.2*abs(V)*V",
            1.9,
            lambda x, v: -2e5 * abs(max(0, x - 0.01) - 0.01) * x - 500 * x - 0.2 * abs(v) * v,
            [lambda x, _: x - 0.01, lambda x, _: x - 0.02, lambda _, v: v],
        ),
        (  # one kink switches the other off
            "-4e3*max(0, X - 0.01)*max(0, V) - 500*X",
            1.9,
            lambda x, v: -4e3 * max(0, x - 0.01) * max(0, v) - 500 * x,
            [lambda x, _: x - 0.01, lambda _, v: v],
        ),
    ],
)
def test_against_integration_by_pieces(force, speed, law, zeros):
    found = block(force, speed, 0.1, tolerance=1e-7)
    right = by_pieces(law, zeros, speed, found.time)
    np.testing.assert_allclose(found.poses[:, 0, 0], right, rtol=0, atol=1e-7)
