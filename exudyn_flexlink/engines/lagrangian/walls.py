r"""Forces between the link's rods and the walls of its guide, in the coordinates of `equations`.

With the guide's pivot C, its axes e, e^ and its start at (a, b) in them, node i at r_i has

    x = e.(r_i - C) - a,    y = e^.(r_i - C) - b,
    x' = e.r_i' + omega (y + b),    y' = e^.r_i' - omega (x + a)

and touches a wall where ``|y| > c``, ``0 <= x <= L``. The corner K = C + (a + X) e + (b + s c) e^
is at ``place = e_j.(K - r_j)``, ``lateral = e^_j.(K - r_j)`` of rod j and touches it where
``s lateral < 0``, ``0 <= place <= l_j``. The pairs are numbered as in `mechanism.channels`; a
channel without clearance holds nodes and rods on its axis from both sides.

A chain is the coordinates of the rods, that of P, the rods' lengths, and the numbers of the walls:
C (2), a, b, L, c, stiffness, restitution, transition speed, coefficient of friction, slip speed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.lagrangian.compiled import compiled

FloatArray = NDArray[np.float64]
Root = tuple[float, float, float, float, float, float]
Chain = tuple[FloatArray, float, FloatArray, FloatArray]

PRESS, RUB, GAP, GAP_RATE, SLIP = 0, 1, 2, 3, 4  # columns of `wall_states`


@compiled
def _nodes(q: FloatArray, v: FloatArray, root: Root, chain: Chain) -> FloatArray:
    """Nodes from the guide's pivot, and their velocities, (n + 1, 4), global axes."""
    rods, p, lengths, walls = chain
    n, moved = len(rods), v[int(p)]
    nodes = np.empty((n + 1, 4))
    nodes[0, 0], nodes[0, 1] = root[0] - walls[0], root[1] - walls[1]
    nodes[0, 2], nodes[0, 3] = root[2] * moved, root[3] * moved
    for i in range(n):
        j = int(rods[i])
        x, y = lengths[i] * np.cos(q[j]), lengths[i] * np.sin(q[j])
        nodes[i + 1, 0], nodes[i + 1, 1] = nodes[i, 0] + x, nodes[i, 1] + y
        nodes[i + 1, 2], nodes[i + 1, 3] = nodes[i, 2] - y * v[j], nodes[i, 3] + x * v[j]
    return nodes


@compiled
def _press(state: FloatArray, gap: float, gap_rate: float, slip: float, walls: FloatArray) -> None:
    """Fill in a pair that touches: the law of `laws.RestitutionPenalty`, with friction."""
    e2 = walls[7] * walls[7]
    rising = np.tanh(-gap_rate / walls[8])
    force = -gap * walls[6] * ((1 + e2) / 2 + (1 - e2) / 2 * rising)
    state[PRESS], state[GAP], state[GAP_RATE], state[SLIP] = force, gap, gap_rate, slip
    state[RUB] = -walls[9] * force * np.tanh(slip / walls[10])


@compiled
def wall_states(q: FloatArray, v: FloatArray, root: Root, chain: Chain) -> FloatArray:
    """Pairs as rows of pressing force, friction (N), gap (m), its rate and the slip (m/s).

    Zero where a pair does not touch.
    """
    rods, _, lengths, walls = chain
    n, clearance = len(rods), walls[5]
    sides = 2 if clearance > 0 else 1
    states = np.zeros((sides * (3 * n + 1), 5))
    nodes = _nodes(q, v, root, chain)
    c, s, omega = np.cos(q[0]), np.sin(q[0]), v[0]
    for i in range(n + 1):
        x = c * nodes[i, 0] + s * nodes[i, 1] - walls[2]
        y = c * nodes[i, 1] - s * nodes[i, 0] - walls[3]
        if x < 0 or x > walls[4] or abs(y) <= clearance:
            continue
        slip = c * nodes[i, 2] + s * nodes[i, 3] + omega * (y + walls[3])
        across = c * nodes[i, 3] - s * nodes[i, 2] - omega * (x + walls[2])
        side = 1.0 if y > 0 else -1.0
        k = sides * i + (1 if sides == 2 and side < 0 else 0)
        _press(states[k], clearance - side * y, -side * across, slip, walls)
    first = sides * (n + 1)
    for j in range(n):
        angle = q[int(rods[j])]
        cosine, sine, turning = np.cos(angle), np.sin(angle), v[int(rods[j])]
        for corner in range(2 * sides):
            mouth, way = corner // sides, corner % sides
            x = walls[2] + mouth * walls[4]
            y = walls[3] + (clearance if way == 0 else -clearance)
            kx, ky = c * x - s * y, s * x + c * y
            dx, dy = kx - nodes[j, 0], ky - nodes[j, 1]
            place, lateral = cosine * dx + sine * dy, cosine * dy - sine * dx
            if place < 0 or place > lengths[j]:
                continue
            side = 1.0 if way == 0 else -1.0
            if sides == 1:
                side = -1.0 if lateral > 0 else 1.0
            if side * lateral >= 0:
                continue
            ux, uy = -omega * ky - nodes[j, 2], omega * kx - nodes[j, 3]
            rate = cosine * uy - sine * ux - turning * place
            slip = cosine * ux + sine * uy + turning * lateral
            _press(states[first + 2 * sides * j + corner], side * lateral, side * rate, slip, walls)
    return states


@compiled
def _push_node(
    force: FloatArray, i: int, at: tuple[FloatArray, FloatArray], root: Root, chain: Chain
) -> None:
    """Add to the generalised forces `at[1]` a force (2,), global, on node i."""
    rods, p, lengths, _ = chain
    q, right = at
    right[int(p)] += force[0] * root[2] + force[1] * root[3]
    for h in range(i):
        j = int(rods[h])
        right[j] += lengths[h] * (force[1] * np.cos(q[j]) - force[0] * np.sin(q[j]))


@compiled
def add_wall_forces(
    q: FloatArray, v: FloatArray, root: Root, chain: Chain, right: FloatArray
) -> FloatArray:
    """Add the walls' forces to the generalised forces (N,); return their sum on the link (2,)."""
    rods, _, _, walls = chain
    n, total = len(rods), np.zeros(2)
    states = wall_states(q, v, root, chain)
    sides = 2 if walls[5] > 0 else 1
    first = sides * (n + 1)
    nodes = _nodes(q, v, root, chain)
    c, s = np.cos(q[0]), np.sin(q[0])
    force = np.zeros(2)
    for k in range(len(states)):
        press, rub = states[k, PRESS], states[k, RUB]
        if press == 0.0:
            continue
        if k < first:
            i = k // sides
            x, y = nodes[i, 0], nodes[i, 1]
            side = 1.0 if c * y - s * x - walls[3] > 0 else -1.0
            force[0], force[1] = rub * c + side * press * s, rub * s - side * press * c
            _push_node(force, i, (q, right), root, chain)
            right[0] -= x * force[1] - y * force[0]
        else:
            i, corner = (k - first) // (2 * sides), (k - first) % (2 * sides)
            j = int(rods[i])
            ax = walls[2] + (corner // sides) * walls[4]
            ay = walls[3] + (walls[5] if corner % sides == 0 else -walls[5])
            x, y = c * ax - s * ay, s * ax + c * ay
            cosine, sine = np.cos(q[j]), np.sin(q[j])
            dx, dy = x - nodes[i, 0], y - nodes[i, 1]
            side = 1.0 if cosine * dy - sine * dx < 0 else -1.0
            # On the corner the rod gives a force along its normal; the rod takes the opposite.
            force[0] = side * press * sine - rub * cosine
            force[1] = -side * press * cosine - rub * sine
            _push_node(force, i, (q, right), root, chain)
            right[j] += dx * force[1] - dy * force[0]
            right[0] -= x * force[1] - y * force[0]
        total += force
    return total


@compiled
def wall_power(q: FloatArray, v: FloatArray, root: Root, chain: Chain) -> float:
    """Power that the walls take, stored and lost, W."""
    states = wall_states(q, v, root, chain)
    power = 0.0
    for k in range(len(states)):
        power -= states[k, PRESS] * states[k, GAP_RATE] + states[k, RUB] * states[k, SLIP]
    return power
