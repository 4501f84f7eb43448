r"""Knots of the track, where its third derivative jumps: over which of them a step may go.

With P's speed u' along the track its acceleration bends at a knot: from there on it has
``J u'^3 (t - t_k)`` more, J the jump. The method takes smooth functions to its order 9, a bend only
to order 2. If a step of length h passes the knots after its parts sigma_k, the speed at its stage i
misses

    h^2 u'^3 sum_k kappa_i(sigma_k) J_k,
    kappa_i(s) = (c_i - s)_+^2 / 2 - sum_j A_ij (c_j - s)_+    (Peano's kernel).

A lone knot counts in full; many close knots of a smooth curve cancel each other, as their jumps
change slowly. A step goes over as many knots as may be, and else ends at one of them.
"""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.lagrangian.compiled import inlined, inner
from exudyn_flexlink.engines.lagrangian.lengths import Scale, length_of
from exudyn_flexlink.engines.lagrangian.mode import (
    Instant,
    Mode,
    fill_rate,
    guide_at,
    torques_at,
    track_point_at,
)
from exudyn_flexlink.engines.lagrangian.step_arrays import Method
from exudyn_flexlink.engines.lagrangian.step_control import MOVED
from exudyn_flexlink.engines.lagrangian.track_point import SPLINE, place_on

Given = tuple[FloatArray, float, FloatArray]

AT_KNOT = 1e-7  # of the step: a knot so close to its start is there
LEAST_SINE = 1e-9  # of the angle between guide and track


@inner
def _knot(piece: FloatArray, k: int) -> tuple[float, float, float]:
    """Place of the knot k of a packed spline, and the jump there."""
    i = 6 + 9 * int(piece[4]) + 3 * k
    return piece[i], piece[i + 1], piece[i + 2]


@inner
def _first_beyond(piece: FloatArray, u: float) -> int:
    """Number of the first knot at u or beyond."""
    low, high = 0, (len(piece) - 6 - 9 * int(piece[4])) // 3
    while low < high:
        middle = (low + high) // 2
        if _knot(piece, middle)[0] < u:
            low = middle + 1
        else:
            high = middle
    return low


@inlined
def _missed(
    piece: FloatArray, way: tuple[float, float], knots: tuple[int, int], method: Method
) -> float:
    """Largest sum of kernel times jump over some knots, for a step from and to two places."""
    nodes, matrix = method.nodes, method.matrix
    stages = len(nodes)
    x, y, since = np.zeros(stages), np.zeros(stages), np.empty(stages)
    for k in range(knots[0], knots[1]):
        u, jump_x, jump_y = _knot(piece, k)
        part = (u - way[0]) / (way[1] - way[0])
        if part <= AT_KNOT:
            continue
        for j in range(stages):
            since[j] = max(nodes[j] - part, 0.0)
        for i in range(stages):
            kernel = since[i] * since[i] / 2
            for j in range(stages):
                kernel -= matrix[i, j] * since[j]
            x[i] += kernel * jump_x
            y[i] += kernel * jump_y
    largest = 0.0
    for i in range(stages):
        largest = max(largest, x[i] * x[i] + y[i] * y[i])
    return float(np.sqrt(largest))


@inlined
def passes(piece: FloatArray, begin: float, end: float) -> bool:
    """Tell whether there is a knot between two places."""
    if piece[0] != SPLINE:
        return False
    return _first_beyond(piece, min(begin, end)) < _first_beyond(piece, max(begin, end))


@inner
def reached(
    piece: FloatArray, way: tuple[float, float], h: float, allowed: float, method: Method
) -> float:
    """How far a step of length h from and to two places may go: there, or to a knot before.

    `allowed` (m/s^2) is what it may miss of P's acceleration, on average.
    """
    begin, end = way
    first, last = _first_beyond(piece, min(way)), _first_beyond(piece, max(way))
    speed = abs(end - begin) / h
    while first < last:
        if (
            speed * speed * abs(end - begin) * _missed(piece, (begin, end), (first, last), method)
            <= allowed
        ):
            break
        # those at the start are no goals
        if end > begin:
            while first < last - 1 and _knot(piece, first)[0] - begin <= AT_KNOT * (end - begin):
                first += 1
            last = first + (last - first) // 2
            end = _knot(piece, last)[0]
        else:
            while first < last - 1 and begin - _knot(piece, last - 1)[0] <= AT_KNOT * (begin - end):
                last -= 1
            first = last - 1 - (last - first) // 2
            end = _knot(piece, first)[0]
            first += 1
    return end


@inlined
def moved_by_point(at: Instant, rate: FloatArray, mode: Mode, scale: Scale) -> float:
    """How much (m/s^2) points accelerate if the track pushes P aside by 1 m/s^2.

    Pushed aside, P slides along the guide by 1 / sine of the angle between the two, unless there is
    play between them. `rate` is the state's.
    """
    count = len(mode.constants.inertias)
    free = count - int(mode.drive[0])
    guide = guide_at(at.t, at.y, free, mode)
    u, point, _ = track_point_at(guide[0], at.y, free, at.near, mode)
    _, _, dx, dy, _, _ = place_on(mode.piece, u)
    length = np.sqrt(dx * dx + dy * dy)
    x, y, speed = -dy / length, dx / length, at.y[2 * free - 1]
    if mode.drive[5] == 0.0:
        c0, s0, speed = np.cos(guide[0]), np.sin(guide[0]), guide[1]
        sine = max(abs(c0 * dy - s0 * dx) / length, LEAST_SINE)
        x, y = c0 / sine, s0 / sine
    if speed == 0.0:
        return 0.0
    square = speed * speed
    pushed = (point[0], point[1], point[2], point[3], point[4] + x / square, point[5] + y / square)
    changed = np.empty(len(rate))
    fill_rate(at.y, (guide, pushed, torques_at(at.t, count, mode)), mode, changed)
    for j in range(free):
        changed[j] = changed[free + j] - rate[free + j]
    return length_of(changed[:free], scale)


@inner
def _allowed(at: Instant, given: Given, mode: Mode, scale: Scale) -> float:
    """What a step may miss of P's acceleration, m/s^2, by the most that P's pushes moved so far."""
    rate, bend, memory = given
    memory[MOVED] = max(memory[MOVED], moved_by_point(at, rate, mode, scale))
    return bend / memory[MOVED] if memory[MOVED] > 0.0 else np.inf


def after_step(
    ends: tuple[Instant, Instant],
    h: float,
    given: Given,
    known: tuple[Mode, Scale],
    method: Method,
) -> float:
    """Part of a step after which it should have ended at a knot; 1 if it is good.

    `ends` are its begin and its end; `given` are the rate of the state at its end, what knots may
    cost, and `Means.memory`.
    """
    mode, scale = known
    piece, begin, end = mode.piece, ends[0].near, ends[1].near
    if not passes(piece, begin, end):
        return 1.0
    to = reached(piece, (begin, end), h, _allowed(ends[1], given, mode, scale), method)
    return 1.0 if to == end else float((to - begin) / (end - begin))
