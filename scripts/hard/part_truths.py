"""Truths of the hard cases that show one part each: closed forms, and equations for one case.

A truth is a function of a Result that returns the largest deviation (m) of its watched point.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import acos, asin, cos, pi, sin, sqrt

import numpy as np
from scipy.integrate import solve_ivp

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.observables import path, watched_point
from exudyn_flexlink.result import Result
from hard.truths import EXACT, pressed_back

Motion = Callable[[FloatArray], tuple[FloatArray, FloatArray]]  # angle and speed at instants

G = 9.81  # m/s^2, of the models of these cases


def fast_spin(result: Result) -> float:
    """A plate whose centre of mass flies on a parabola, while it turns evenly."""
    scene, t = result.scene, result.time
    plate, initial = scene.bodies["plate"], scene.initial
    angle, turning = initial.angles["plate"], dict(initial.speeds)["plate"]
    centre, corner = np.array(plate.centre_of_mass), np.array(plate.points["corner"])
    off = _turned(centre, np.array([angle]))[0]
    start = initial.positions["plate"] + off
    speed = initial.velocities["plate"] + turning * np.array([-off[1], off[0]])
    flight = start + speed * t[:, None] + 0.5 * np.array(scene.gravity) * t[:, None] ** 2
    return _off(result, flight + _turned(corner - centre, angle + turning * t))


def stops(result: Result) -> float:
    """A block between two elastic stops: free flight and half a period of a stop, in turns."""
    joint = result.scene.joints["way"]
    law, width = joint.limits.law, joint.limits.to
    turning = sqrt(law.stiffness / result.scene.bodies["block"].mass)
    place = _to_and_fro(result.time, width, 1.0, turning)
    return _off(result, np.stack([place, 0 * place], axis=1))


def _to_and_fro(time: FloatArray, width: float, speed: float, turning: float) -> FloatArray:
    """Place between two elastic walls, 0 and `width`, from the middle on."""
    flight, touch = width / speed, pi / turning
    since = (time + flight / 2) % (2 * (flight + touch))  # from a wall on
    back = since > flight + touch
    own = np.where(back, since - flight - touch, since)
    beyond = width + speed / turning * np.sin(turning * (own - flight))
    ahead = np.where(own < flight, speed * own, beyond)
    return np.where(back, width - ahead, ahead)


def rattle(result: Result) -> float:
    """A wheel between elastic flanks: x = c2 + w c1 as `stops`, and J1 c1'/w - J2 c2' stays."""
    scene, w = result.scene, 1.5
    mesh, first, second = scene.joints["mesh"], *(b.inertia for b in scene.bodies.values())
    law, spin = mesh.law, dict(scene.initial.speeds)["pinion"]
    turning = sqrt(law.stiffness * (w**2 / first + 1 / second))
    x = _to_and_fro(result.time, mesh.backlash, w * spin, turning) - mesh.backlash / 2
    angle = (first * x / w**2 - first * spin / w * result.time) / (first / w**2 + second)
    rim = 0.02 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return _off(result, rim + np.array([0.05, 0.0]))


def sheared(result: Result) -> float:
    """A block that a force ``r t`` pulls, held until that is 120 N: ``m x' = r (t^2 - t0^2)/2``."""
    rise, mass, held = 200.0, result.scene.bodies["block"].mass, 120.0
    begin = held / rise
    t = np.maximum(result.time, begin)
    way = rise / mass * ((t**3 - begin**3) / 6 - begin**2 * (t - begin) / 2)
    return _off(result, np.stack([way, 0 * way], axis=1))


def pulley(result: Result) -> float:
    """A stretch s that swings, ``s'' = 2 g - mu T``, and a load that falls: ``M x'' = M g - T``."""
    scene, t = result.scene, result.time
    load, weight = (body.mass for body in scene.bodies.values())
    rope, mu = scene.springs["rope"], 1 / load + 1 / weight
    damped = rope.damping * mu / 2
    turning = sqrt(rope.stiffness * mu - damped**2)
    swing = np.cos(turning * t) + damped / turning * np.sin(turning * t)
    s = 2 * G / (rope.stiffness * mu) * (1 - np.exp(-damped * t) * swing)
    fallen = G * t**2 / 2 - (G * t**2 - s) / (load * mu)
    return _off(result, np.stack([0 * t, -fallen], axis=1))


def trammel(result: Result) -> float:
    """A beam that turns evenly; at 0 its start is on the x axis, left of where the ways cross."""
    scene = result.scene
    beam = scene.bodies["beam"]
    angle = scene.initial.angles["beam"] + dict(scene.initial.speeds)["beam"] * result.time
    start = np.stack([-beam.points["e"][0] * np.cos(angle), 0 * angle], axis=-1)
    return _off(result, start + _turned(np.array(beam.points["pen"]), angle))


def short_spring(result: Result) -> float:
    """A point mass that a spring draws to the origin."""
    scene = result.scene
    mass, spring = scene.bodies["mass"].mass, scene.springs["s"]

    def rates(_: float, s: FloatArray) -> FloatArray:
        long = np.hypot(s[0], s[1])
        return np.array([*s[2:], *(-spring.stiffness / mass * (1 - spring.length / long) * s[:2])])

    start = [*scene.initial.positions["mass"], *scene.initial.velocities["mass"]]
    return _off(result, _states(rates, start, result.time)[:, :2])


def sharp_groove(result: Result) -> float:
    """Bead on an ellipse r(u) that turns: r'.r' u'' + r'.r'' u'^2 = omega^2 r.r', in its axes."""
    scene = result.scene
    a, b = scene.curves["groove"].semi_axes
    omega = scene.drives["motor"].value
    x, y = scene.initial.positions["bead"]

    def rates(_: float, s: FloatArray) -> FloatArray:
        u, speed = s
        c, d = cos(u), sin(u)
        slope = a * a * d * d + b * b * c * c
        bends = (a * a - b * b) * c * d
        return np.array([speed, -bends * (speed**2 + omega**2) / slope])

    u = _states(rates, [np.arctan2(y / b, x / a), 0.0], result.time)[:, 0]
    own = np.stack([a * np.cos(u), b * np.sin(u)], axis=-1)
    turned = omega * result.time
    c, s = np.cos(turned), np.sin(turned)
    return _off(
        result, np.stack([c * own[:, 0] - s * own[:, 1], s * own[:, 0] + c * own[:, 1]], axis=-1)
    )


def squircle(result: Result) -> float:
    """A bead that keeps its speed along |x/a|^n + |y/b|^n = 1, from (a, 0), counter-clockwise.

    The curve's length is that of the polygon through its points, of which there are so many that
    it is short by less than 1e-10 m.
    """
    scene = result.scene
    track = scene.curves["track"]
    a, b = track.semi_axes
    turned = np.linspace(0, 2 * np.pi, 4_000_001)
    c, d = np.cos(turned), np.sin(turned)
    n = track.exponent
    x, y = np.array([a * c, b * d]) / (np.abs(c) ** n + np.abs(d) ** n) ** (1 / n)
    length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    way = np.mod(scene.initial.velocities["bead"][1] * result.time, length[-1])
    return _off(result, np.stack([np.interp(way, length, x), np.interp(way, length, y)], axis=-1))


def rounded_corners(result: Result) -> float:
    """A bead that keeps its speed round a polygon, each corner of which is an arc.

    It starts in the middle of the first side. An arc of radius R, at a corner that turns by d, is
    R tan(d/2) from it on both sides.
    """
    scene = result.scene
    track = scene.curves["track"]
    corners = np.array(track.points) @ [1, 1j]
    ways = np.roll(corners, -1) - corners
    turns = np.angle(np.roll(ways, -1) / ways)  # at the end of each side
    taken = track.round * np.tan(turns / 2)
    straight = np.abs(ways) - taken - np.roll(taken, 1)
    ends = np.cumsum(straight + track.round * turns)
    way = scene.initial.velocities["bead"][0] * result.time + abs(ways[0]) / 2 - taken[-1]
    way = np.mod(way, ends[-1])
    side = np.searchsorted(ends, way, side="right")
    done = way - np.append(0.0, ends)[side]
    along = ways[side] / np.abs(ways[side])
    place = corners[side] + (taken[side - 1] + np.minimum(done, straight[side])) * along
    turned = np.maximum(done - straight[side], 0.0) / track.round
    place += track.round * along * (np.sin(turned) + 1j * (1 - np.cos(turned)))
    return _off(result, np.stack([place.real, place.imag], axis=-1))


def micron_bearing(result: Result) -> float:
    """A pendulum whose journal's middle, at (x, y), is pressed back from the bearing's wall."""
    scene = result.scene
    rod, joint = scene.bodies["rod"], scene.joints["pivot"]
    arm, law, play = rod.centre_of_mass[0], joint.law, joint.clearance

    def rates(_: float, s: FloatArray, touching: bool) -> FloatArray:
        x, y, angle, u, v, turning = s
        push = np.zeros(2)
        if touching:
            far = np.hypot(x, y)
            push = -pressed_back(law, far - play, (x * u + y * v) / far) / far * np.array([x, y])
        c, d = cos(angle), sin(angle)
        bend = -arm * (c * push[1] - d * push[0]) / rod.inertia  # about the centre of mass
        linear = push / rod.mass + [0, -G]
        # The journal's middle is seen from the centre of mass, which Newton's law moves.
        swung = arm * (bend * np.array([-d, c]) - turning**2 * np.array([c, d]))
        return np.array([u, v, turning, *(linear - swung), bend])

    def gap(s: FloatArray) -> float:
        return play - float(np.hypot(s[0], s[1]))

    start = [0.0, 0.0, scene.initial.angles["rod"], 0.0, 0.0, 0.0]
    found = _touching(rates, gap, start, result.time)
    return _off(result, found[:, :2] + _turned(np.array(rod.points["e"]), found[:, 2]))


def grazing_circles(result: Result) -> float:
    """Smooth discs: the line of their centres is what they push along; their middle goes on."""
    scene = result.scene
    one, two = scene.bodies["one"].mass, scene.bodies["two"].mass
    contact = scene.contacts["meet"]
    reach = sum(circle.radius for circle in contact.circles)
    reduced = one * two / (one + two)
    at, speed = (np.array([dict(part)[n] for n in ("one", "two")]) for part in
                 (scene.initial.positions, scene.initial.velocities))  # fmt: skip

    def rates(_: float, s: FloatArray, touching: bool) -> FloatArray:
        x, y, u, v = s
        far = np.hypot(x, y)
        press = pressed_back(contact.law, reach - far, -(x * u + y * v) / far) if touching else 0.0
        return np.array([u, v, press * x / far / reduced, press * y / far / reduced])

    def gap(s: FloatArray) -> float:
        return float(np.hypot(s[0], s[1])) - reach

    apart = _touching(rates, gap, [*(at[1] - at[0]), *(speed[1] - speed[0])], result.time)
    middle = (one * at[0] + two * at[1]) / (one + two)
    drift = (one * speed[0] + two * speed[1]) / (one + two)
    return _off(result, middle + drift * result.time[:, None] + one / (one + two) * apart[:, :2])


def slower_bounces(result: Result) -> float:
    """A ball between a ceiling by Hertz and a floor by Flores et al., of a touch's own speed."""
    scene = result.scene
    mass, top = scene.bodies["ball"].mass, scene.curves["ceiling"].to[1]
    (up, down), start = (scene.contacts[name].law for name in ("up", "down")), scene.initial
    factor, began = 8 * (1 - down.restitution) / (5 * down.restitution), [True, 1.0]

    def rates(_: float, s: FloatArray, touching: bool) -> FloatArray:
        y, v = s
        if touching != began[0]:  # the first look at a touch, or at a flight
            began[:] = touching, max(-v, down.transition_speed)
        press = down.stiffness * max(-y, 0.0) ** 1.5 * (1 - factor * v / began[1])
        return np.array(
            [v, scene.gravity[1] + (press - up.stiffness * max(y - top, 0) ** 1.5) / mass]
        )

    def gap(s: FloatArray) -> float:
        return float(min(s[0], top - s[0]))

    at = [start.positions["ball"][1], start.velocities["ball"][1]]
    height = _touching(rates, gap, at, result.time)[:, 0]
    return _off(result, np.stack([0 * height, height], axis=-1))


def dome(result: Result) -> float:
    """A bead at an angle from the top: a'' = g/R sin a, until cos a is 2/3 of that at the start."""
    scene, t = result.scene, result.time
    radius = scene.curves["dome"].radius
    x, y = scene.initial.positions["bead"]
    begins, leaves = np.arctan2(x, y), acos(2 / 3 * y / radius)

    def rates(_: float, s: FloatArray) -> FloatArray:
        return np.array([s[1], G / radius * sin(s[0])])

    def there(_: float, s: FloatArray) -> float:
        return float(s[0] - leaves)

    there.terminal = True  # type: ignore[attr-defined]
    solved = solve_ivp(rates, (0, t[-1]), [begins, 0.0], events=there, **EXACT)
    end, (angle, turning) = solved.t[-1], solved.y[:, -1]
    on, along = t <= end, np.array([cos(angle), -sin(angle)])
    found = np.empty((len(t), 2))
    a = solved.sol(t[on])[0]
    found[on] = radius * np.stack([np.sin(a), np.cos(a)], axis=-1)
    since = (t[~on] - end)[:, None]
    start = radius * np.array([sin(angle), cos(angle)])
    found[~on] = start + radius * turning * along * since + [0, -G / 2] * since**2
    return _off(result, found)


def skimming_face(result: Result) -> float:
    """A face on an eccentric disc; between leaving it and meeting it again, it swings freely."""
    scene, t = result.scene, result.time
    mass, spring, rim = scene.bodies["follower"].mass, scene.springs["spring"], scene.curves["rim"]
    stiffness, beside, speed = spring.stiffness, rim.centre[0], scene.drives["motor"].value
    middle, own = spring.length - mass * G / stiffness, sqrt(stiffness / mass)
    # Where the disc brakes the face as much as weight and spring do.
    leaves = asin((rim.radius - middle) * stiffness / (mass * beside * (speed**2 - own**2)))
    since = t - (leaves + pi / 2) / speed
    on = rim.radius + beside * np.sin(speed * t - pi / 2)
    high, rising = rim.radius + beside * sin(leaves) - middle, beside * speed * cos(leaves)
    free = middle + high * np.cos(own * since) + rising / own * np.sin(own * since)
    flies = (since > 0) & np.logical_and.accumulate((free >= on) | (since <= 0))
    return _off(result, np.stack([0 * t, np.where(flies, free, on)], axis=-1))


def kinked_drive(result: Result) -> float:
    """Half a period by the soft spring, and half a one by the hard one, in turn."""
    scene = result.scene
    mass, start = scene.bodies["block"].mass, scene.initial.along["way"]
    soft, hard = sqrt(50 / mass), sqrt(200 / mass)
    quarter, half = pi / (2 * soft), pi / (2 * soft) + pi / hard
    since = np.mod(result.time, 2 * quarter + pi / hard)
    depth = start * soft / hard  # at the middle both have the same speed
    x = np.where(
        since < quarter,
        start * np.cos(soft * since),
        np.where(
            since < half,
            -depth * np.sin(hard * (since - quarter)),
            start * np.sin(soft * (since - half)),
        ),
    )
    return _off(result, np.stack([x, 0 * x], axis=-1))


def stiff_rod(result: Result) -> float:
    """Even rod that swings from rest along the x axis: a'' = -3/2 g/l cos a."""
    length = result.scene.bodies["rod"].length

    def rates(_: float, s: FloatArray) -> FloatArray:
        return np.array([s[1], -1.5 * G / length * cos(s[0])])

    angle = _states(rates, [0.0, 0.0], result.time)[:, 0]
    return _off(result, length * np.stack([np.cos(angle), np.sin(angle)], axis=-1))


def force_pulse(result: Result) -> float:
    """A block pushed by a force that is linear between rows: places are cubics of time."""
    scene, x = result.scene, np.zeros(len(result.time))
    rows = np.array(scene.drives["pulse"].value[0].points)
    place, speed = 0.0, 0.0
    for (begin, force), (end, last) in pairwise(rows / [1, scene.bodies["block"].mass]):
        within = (result.time >= begin) & (result.time <= end)
        bend = (last - force) / (end - begin)
        since = np.append(result.time[within], end) - begin
        way = place + speed * since + force / 2 * since**2 + bend / 6 * since**3
        x[within] = way[:-1]
        place, speed = way[-1], speed + (force + last) / 2 * (end - begin)
    return _off(result, np.stack([x, 0 * x], axis=-1))


def jerked_spoke(result: Result) -> float:
    """A bead on a spoke of given motion, between whose pieces omega bends."""
    ends = [0.0, 0.1, 0.11, result.time[-1]]
    motions = (
        lambda t: (t, 1 + 0 * t),
        lambda t: (t + 2000 * (t - 0.1) ** 2, 1 + 4000 * (t - 0.1)),
        lambda t: (41 * t - 4.2, 41 + 0 * t),
    )
    state, found = [result.scene.initial.positions["bead"][0], 0.0], np.empty((len(result.time), 2))
    for (begin, end), motion in zip(pairwise(ends), motions, strict=True):

        def rates(t: float, s: FloatArray, motion: Motion = motion) -> FloatArray:
            return np.array([s[1], motion(t)[1] ** 2 * s[0]])

        solved = solve_ivp(rates, (begin, end), state, **EXACT)
        rows = (result.time >= begin) & (result.time <= end)
        angle, (r, _) = motion(result.time[rows])[0], solved.sol(result.time[rows])
        found[rows] = np.stack([r * np.cos(angle), r * np.sin(angle)], axis=-1)
        state = solved.y[:, -1]
    return _off(result, found)


def narrow_hollow(result: Result) -> float:
    """The middle of a roller is a pendulum as long as its hollow is wider, where it starts."""
    ((x, y),) = result.scene.initial.positions.values()
    arm = float(np.hypot(x, y))

    def rates(_: float, s: FloatArray) -> FloatArray:
        return np.array([s[1], -G / arm * sin(s[0])])

    angle = _states(rates, [np.arctan2(x, -y), 0.0], result.time)[:, 0]
    return _off(result, arm * np.stack([np.sin(angle), -np.cos(angle)], axis=-1))


def unequal_laps(result: Result) -> float:
    """A bead that keeps its speed, on two circles in turn that touch where both are rightmost."""
    curves, speed = result.scene.curves, result.scene.initial.speeds_along["slot"]
    large, small = curves["large"], curves["small"]
    long, short = (2 * pi * one.radius for one in (large, small))
    gone = np.mod(speed * result.time, long + short)
    first = gone < long
    radius = np.where(first, large.radius, small.radius)
    angle = np.where(first, gone, gone - long) / radius
    centre = np.where(first, large.centre[0], small.centre[0])
    return _off(
        result, np.stack([centre + radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
    )


def _turned(vector: FloatArray, angles: FloatArray) -> FloatArray:
    """Return a vector (2,) turned by angles (N,) in rad, (N, 2)."""
    c, s = np.cos(angles), np.sin(angles)
    return np.stack([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]], axis=-1)


def _off(result: Result, expected: FloatArray) -> float:
    """Largest distance (m) of the watched point from where it should be, (N, 2) m."""
    seen = path(result, watched_point(result.scene)).position
    return float(np.linalg.norm(seen - expected, axis=1).max())


def _states(rates: Callable[..., FloatArray], start: list[float], time: FloatArray) -> FloatArray:
    """States (N, n) at instants (N,) s, of smooth equations."""
    return np.asarray(solve_ivp(rates, (0.0, time[-1]), start, **EXACT).sol(time).T)


def _touching(
    rates: Callable[..., FloatArray],
    gap: Callable[[FloatArray], float],
    start: list[float],
    time: FloatArray,
) -> FloatArray:
    """States (N, n) at instants (N,) s of what touches and flies in turn, from a flight on."""
    found = np.empty((len(time), len(start)))
    t, state, touching = 0.0, np.array(start), False
    while t < time[-1]:

        def crosses(_: float, s: FloatArray, __: bool) -> float:
            return gap(s)

        crosses.terminal, crosses.direction = True, 1 if touching else -1  # type: ignore[attr-defined]
        leg = solve_ivp(rates, (t, time[-1]), state, events=crosses, args=(touching,),
                        max_step=time[-1] / 1000, **EXACT)  # fmt: skip
        there = (time >= t) & (time <= leg.t[-1])
        found[there] = leg.sol(time[there]).T
        t, state, touching = float(leg.t[-1]), leg.y[:, -1], not touching
    return found


def barely_held(result: Result) -> float:
    """A block and a rotor that are braked evenly, and then rest for good."""
    scene, t = result.scene, result.time
    way, pin = scene.joints["way"], scene.joints["pin"]
    along = np.array(way.axis) / np.hypot(*way.axis)
    brake = G * (along[1] + way.friction.coefficient * along[0])
    torque = pin.friction.torque + scene.drives["motor"].value
    slid = _braked(dict(scene.initial.speeds_along)["way"], brake, t)
    turned = _braked(dict(scene.initial.speeds)["rotor"], torque / scene.bodies["rotor"].inertia, t)
    hub = np.array(scene.bodies["block"].points["hub"]) + slid[:, None] * along
    return _off(result, hub + _turned(np.array(scene.bodies["rotor"].points["rim"]), turned))


def slow_train(result: Result) -> float:
    """A pointer that turns by ``1 - 101 99 / 100 100`` of an arm, 100 times as fast."""
    arm = result.poses[:, list(result.scene.bodies).index("arm"), 2]
    hub = np.array(result.scene.joints["needle"].at)
    return _off(result, hub + _turned(np.array([0.1, 0.0]), 0.01 * arm))


def _braked(speed: float, brake: float, t: FloatArray) -> FloatArray:
    """Way that something makes which is braked evenly until it rests."""
    moving = np.minimum(t, abs(speed) / brake)
    return np.asarray(np.sign(speed) * (abs(speed) * moving - 0.5 * brake * moving**2))
