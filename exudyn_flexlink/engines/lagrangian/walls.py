r"""Forces between the link's rods and the walls of its guide, in the coordinates of `equations`.

With the guide's pivot C, its axes e, e^ and its start at (a, b) in them, node i at r_i has

    x = e.(r_i - C) - a,    y = e^.(r_i - C) - b,
    x' = e.r_i' + omega (y + b),    y' = e^.r_i' - omega (x + a)

and touches a wall where ``|y| > c``, ``0 <= x <= L``. The corner K = C + (a + X) e + (b + s c) e^
is at ``place = e_j.(K - r_j)``, ``lateral = e^_j.(K - r_j)`` of rod j and touches it where
``s lateral < 0``, ``0 <= place <= l_j``. The pairs are numbered as in `mechanism.channels`; a
channel without clearance holds nodes and rods on its axis from both sides.

Forces set in by a bend where a gap closes, and by a jump where a face ends; which pairs touch is
therefore given, and changes by events only (see `touching`). Until then the law is continued.

The numbers of `Constants.channel` are C (2), a, b, L, c, stiffness, restitution, transition speed,
coefficient of friction, slip speed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IntArray
from exudyn_flexlink.engines.lagrangian.compiled import compiled, inlined, inner
from exudyn_flexlink.engines.lagrangian.constants import Constants
from exudyn_flexlink.engines.lagrangian.penalty import fill_slopes, friction, penalty_force
from exudyn_flexlink.engines.lagrangian.track_point import TrackPoint

# Columns of a pair: gap, its rate, way inside the face from its nearer end, its rate, slip (m, m/s)
GAP, GAP_RATE, INSIDE, INSIDE_RATE, SLIP = range(5)
LAW = 6  # of the numbers of the walls: where those of `penalty` begin
PRESS, RUB = range(2)  # columns of `wall_forces`


class Looked(NamedTuple):
    """Pairs (pairs, 5), sides on which they are (pairs,), nodes and axes they were made of."""

    pairs: FloatArray
    sides: FloatArray  # +1 on the upper side of the link, -1 on the lower
    nodes: FloatArray  # (n + 1, 4): places from the guide's pivot, velocities, global axes
    axes: FloatArray  # (n + 1, 2): cosine and sine of the guide's angle, then of the rods'


@inlined
def _nodes(
    q: FloatArray, v: FloatArray, point: TrackPoint, constants: Constants
) -> tuple[FloatArray, FloatArray]:
    """Nodes and axes of `Looked`."""
    rods, lengths, walls = constants.rods, constants.lengths, constants.channel
    n, moved = len(rods), v[int(constants.track_coordinate)]
    nodes, axes = np.empty((n + 1, 4)), np.empty((n + 1, 2))
    axes[0, 0], axes[0, 1] = np.cos(q[0]), np.sin(q[0])
    nodes[0, 0], nodes[0, 1] = point[0] - walls[0], point[1] - walls[1]
    nodes[0, 2], nodes[0, 3] = point[2] * moved, point[3] * moved
    for i in range(n):
        j = int(rods[i])
        c, s = np.cos(q[j]), np.sin(q[j])
        x, y = lengths[i] * c, lengths[i] * s
        axes[i + 1, 0], axes[i + 1, 1] = c, s
        nodes[i + 1, 0], nodes[i + 1, 1] = nodes[i, 0] + x, nodes[i, 1] + y
        nodes[i + 1, 2], nodes[i + 1, 3] = nodes[i, 2] - y * v[j], nodes[i, 3] + x * v[j]
    return nodes, axes


@inlined
def _fill(  # noqa: PLR0913, PLR0917 - a tuple more to take apart costs more than the rest
    pair: FloatArray, gap: float, rate: float, place: float, slip: float, length: float
) -> None:
    pair[GAP], pair[GAP_RATE], pair[SLIP] = gap, rate, slip
    near = place < length - place
    pair[INSIDE], pair[INSIDE_RATE] = (place, slip) if near else (length - place, -slip)


@compiled
def look(q: FloatArray, v: FloatArray, point: TrackPoint, constants: Constants) -> Looked:
    """All pairs at coordinates and speeds (N,)."""
    rods, lengths, walls = constants.rods, constants.lengths, constants.channel
    n, clearance = len(rods), walls[5]
    ways = 2 if clearance > 0.0 else 1
    nodes, axes = _nodes(q, v, point, constants)
    pairs, sides = np.empty((ways * (3 * n + 1), 5)), np.empty(ways * (3 * n + 1))
    c, s, omega = axes[0, 0], axes[0, 1], v[0]
    k = 0
    for i in range(n + 1):
        x = c * nodes[i, 0] + s * nodes[i, 1] - walls[2]
        y = c * nodes[i, 1] - s * nodes[i, 0] - walls[3]
        slip = c * nodes[i, 2] + s * nodes[i, 3] + omega * (y + walls[3])
        across = c * nodes[i, 3] - s * nodes[i, 2] - omega * (x + walls[2])
        for way in range(ways):
            side = 1.0 if way == 0 else -1.0
            if ways == 1 and y < 0.0:
                side = -1.0
            sides[k] = side
            _fill(pairs[k], clearance - side * y, -side * across, x, slip, walls[4])
            k += 1
    for j in range(n):
        cosine, sine, turning = axes[j + 1, 0], axes[j + 1, 1], v[int(rods[j])]
        for corner in range(2 * ways):
            x = walls[2] + (walls[4] if corner >= ways else 0.0)
            y = walls[3] + (clearance if corner % ways == 0 else -clearance)
            kx, ky = c * x - s * y, s * x + c * y
            dx, dy = kx - nodes[j, 0], ky - nodes[j, 1]
            place, lateral = cosine * dx + sine * dy, cosine * dy - sine * dx
            side = 1.0 if corner % ways == 0 else -1.0
            if ways == 1 and lateral > 0.0:
                side = -1.0
            ux, uy = -omega * ky - nodes[j, 2], omega * kx - nodes[j, 3]
            rate = cosine * uy - sine * ux - turning * place
            slip = cosine * ux + sine * uy + turning * lateral
            sides[k] = side
            _fill(pairs[k], side * lateral, side * rate, place, slip, lengths[j])
            k += 1
    return Looked(pairs, sides, nodes, axes)


@inner
def fill_rows(
    k: int, looked: Looked, point: TrackPoint, constants: Constants, rows: FloatArray
) -> tuple[float, float, float, float]:
    """Fill in the gradients (2, N) of pair k's gap and place.

    Return the directions, global, of the forces that the link feels by pressing and by friction.
    """
    rods, lengths, walls = constants.rods, constants.lengths, constants.channel
    p = int(constants.track_coordinate)
    _, sides, nodes, axes = looked
    n = len(rods)
    ways = 2 if walls[5] > 0.0 else 1
    c, s, side = axes[0, 0], axes[0, 1], sides[k]
    for j in range(rows.shape[1]):
        rows[0, j] = rows[1, j] = 0.0
    if k < ways * (n + 1):
        last = k // ways
        x, y = nodes[last, 0], nodes[last, 1]
        nx, ny, tx, ty = side * s, -side * c, c, s
        rows[0, 0], rows[1, 0] = side * (c * x + s * y), c * y - s * x
    else:
        last, corner = (k - ways * (n + 1)) // (2 * ways), (k - ways * (n + 1)) % (2 * ways)
        x = walls[2] + (walls[4] if corner >= ways else 0.0)
        y = walls[3] + (walls[5] if corner % ways == 0 else -walls[5])
        kx, ky = c * x - s * y, s * x + c * y
        cosine, sine = axes[last + 1, 0], axes[last + 1, 1]
        dx, dy = kx - nodes[last, 0], ky - nodes[last, 1]
        nx, ny, tx, ty = side * sine, -side * cosine, -cosine, -sine
        rows[0, 0], rows[1, 0] = side * (cosine * kx + sine * ky), sine * kx - cosine * ky
        own = int(rods[last])
        rows[0, own] -= side * (cosine * dx + sine * dy)
        rows[1, own] += cosine * dy - sine * dx
    for h in range(last):
        j = int(rods[h])
        x, y = -lengths[h] * axes[h + 1, 1], lengths[h] * axes[h + 1, 0]
        rows[0, j] += nx * x + ny * y
        rows[1, j] += tx * x + ty * y
    rows[0, p] += nx * point[2] + ny * point[3]
    rows[1, p] += tx * point[2] + ty * point[3]
    return nx, ny, tx, ty


@inner
def any_is(numbers: IntArray, value: int) -> bool:
    """Tell whether a value is among numbers."""
    found = False
    for k in range(len(numbers)):
        found = found or numbers[k] == value
    return found


@inner
def pressing(pair: FloatArray, walls: FloatArray) -> tuple[float, float]:
    """Force of a pair by the law of `laws.RestitutionPenalty`, and its friction, N."""
    law = walls[LAW:]
    force = penalty_force(pair[GAP], pair[GAP_RATE], law)
    return force, friction(force, pair[SLIP], law)


def add_wall_forces(
    state: tuple[FloatArray, FloatArray, TrackPoint],
    touching: IntArray,
    constants: Constants,
    right: FloatArray,
) -> float:
    """Add the walls' forces to the generalised forces (N,); return the power they take, W."""
    if not any_is(touching, 1):
        return 0.0
    looked = look(state[0], state[1], state[2], constants)
    rows = np.empty((2, len(right)))
    power = 0.0
    for k in range(len(touching)):
        if touching[k] == 0:
            continue
        pair = looked.pairs[k]
        press, rub = pressing(pair, constants.channel)
        fill_rows(k, looked, state[2], constants, rows)
        for j in range(len(right)):
            right[j] += press * rows[0, j] + rub * rows[1, j]
        power -= press * pair[GAP_RATE] + rub * pair[SLIP]
    return power


def take_wall_slopes(
    state: tuple[FloatArray, FloatArray, TrackPoint],
    touching: IntArray,
    constants: Constants,
    found: FloatArray,
) -> None:
    """Fill in how pairs that touch give way, damp and drag (pairs, 3), N/m, N s/m and N s/m."""
    law = constants.channel[LAW:]
    pairs = look(state[0], state[1], state[2], constants).pairs
    for k in range(len(touching)):
        if touching[k] != 0:
            pair = pairs[k]
            fill_slopes(pair[GAP], pair[GAP_RATE], pair[SLIP], law, found[k])


def add_wall_slopes(
    state: tuple[FloatArray, FloatArray, TrackPoint],
    slopes: FloatArray,
    constants: Constants,
    into: tuple[FloatArray, FloatArray],
) -> None:
    """Add what walls, of the `slopes` of `take_wall_slopes`, give by coordinates and by speeds.

    Both are (N, N); directions count as fixed.
    """
    springs, dampers = into
    walls, count = constants.channel, len(springs)
    looked = look(state[0], state[1], state[2], constants)
    rows = np.empty((2, count))
    for k in range(len(slopes)):
        spring, damper, drag = slopes[k, 0], slopes[k, 1], slopes[k, 2]
        if spring == 0.0:
            continue
        fill_rows(k, looked, state[2], constants, rows)
        rubbed = walls[9] * np.tanh(looked.pairs[k, SLIP] / walls[10])
        for i in range(count):
            pushed = rows[0, i] - rubbed * rows[1, i]
            for j in range(count):
                springs[i, j] -= spring * pushed * rows[0, j]
                dampers[i, j] -= damper * pushed * rows[0, j] + drag * rows[1, i] * rows[1, j]


@compiled
def wall_forces(
    q: FloatArray, v: FloatArray, points: FloatArray, constants: Constants
) -> tuple[FloatArray, FloatArray]:
    """Force and friction of all pairs (m, pairs, 2), N, and their sum on the link (m, 2).

    The motion q, v (m, N), P (m, 6) has m instants; sums are in global axes. Those press that are
    in touch by their places alone.
    """
    count = (3 * len(constants.rods) + 1) * (2 if constants.channel[5] > 0.0 else 1)
    forces, totals = np.zeros((len(q), count, 2)), np.zeros((len(q), 2))
    rows = np.empty((2, q.shape[1]))
    for i in range(len(q)):
        point = _point(points[i])
        looked, total = look(q[i], v[i], point, constants), totals[i]
        for k in range(count):
            if looked.pairs[k, GAP] < 0.0 <= looked.pairs[k, INSIDE]:
                nx, ny, tx, ty = fill_rows(k, looked, point, constants, rows)
                press, rub = pressing(looked.pairs[k], constants.channel)
                forces[i, k, PRESS], forces[i, k, RUB] = press, rub
                total[0] += press * nx + rub * tx
                total[1] += press * ny + rub * ty
    return forces, totals


@inlined
def _point(row: FloatArray) -> TrackPoint:
    return row[0], row[1], row[2], row[3], row[4], row[5]


@compiled
def wall_work(
    q: FloatArray, v: FloatArray, points: FloatArray, touching: IntArray, constants: Constants
) -> FloatArray:
    """Pressing forces, powers that pairs take, and depths (m, pairs, 3) of a motion (m, ..).

    Zero where a pair does not touch.
    """
    found = np.zeros((len(q), len(touching), 3))
    for i in range(len(q)):
        pairs = look(q[i], v[i], _point(points[i]), constants).pairs
        for k in range(len(touching)):
            if touching[k] != 0:
                press, rub = pressing(pairs[k], constants.channel)
                found[i, k, 0] = press
                found[i, k, 1] = -press * pairs[k, GAP_RATE] - rub * pairs[k, SLIP]
                found[i, k, 2] = max(0.0, -pairs[k, GAP])
    return found


def depths_squared(
    q: FloatArray, v: FloatArray, point: TrackPoint, touching: IntArray, constants: Constants
) -> float:
    """Sum of the squares of how deep the pairs are that touch, m^2: of the energy they store."""
    pairs, total = look(q, v, point, constants).pairs, 0.0
    for k in range(len(touching)):
        if touching[k] != 0:
            total += pairs[k, GAP] * pairs[k, GAP]
    return total
