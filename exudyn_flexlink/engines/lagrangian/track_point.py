r"""A smooth piece of track in machine code: its place, and where the guide's axis crosses it.

P lies on the guide's axis, ``gamma - C = r e(theta)``, and on the piece ``gamma(u)``, so that
``e x (gamma - C) = 0`` (x the 2D cross product). Differentiated once and twice by theta:

    u'  = r / (e x gamma_u)
    u'' = (2 (e.gamma_u) u' - (e x gamma_uu) u'^2) / (e x gamma_u)
    gamma' = gamma_u u',   gamma'' = gamma_uu u'^2 + gamma_u u''
"""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.curves import Arc, Curve, LineSegment, Spline, SplinePiece
from exudyn_flexlink.engines.lagrangian.compiled import compiled, inlined, inner

TrackPoint = tuple[float, float, float, float, float, float]
"""Place of P and its first two derivatives by its coordinate (x, y each)."""

ARC, LINE, SPLINE = 0.0, 1.0, 2.0
START, END = 1, 2  # of the parameter, in a packed piece
FINE, TOUCHES, MISSES, FAR = 0, 1, 2, 3  # how a search for the crossing ended
NEWTON_STEPS = 40
MOST_PARTS, LEAST_PART = 400, 1e-6  # of the way that the guide has turned: how many, how short
LEAST_NEWTON_STEP = 4e-16  # of 1 + |u|: twice the machine epsilon; smaller steps are rounding
LEAST_SLOPE = 1e-9  # sine of the angle between guide and track at a dead centre


def has_knots(curve: Curve) -> bool:
    """Tell whether a curve's third derivative jumps within a piece: if one is of a spline."""
    return any(isinstance(piece, (Spline, SplinePiece)) for piece in curve.pieces)


def packed_piece(piece: Curve) -> FloatArray:
    """Kind, start and end of a smooth piece, then the numbers of its kind, in one array.

    Arc: C, A, B. Line: a and the tangent. Spline: period (0 if open), number of spans, knots, and
    of every span the coefficients x, y of w^3, w^2, w, 1; then the places within the piece at which
    its third derivative jumps, in x and in y.

    Raises:
        TypeError: the curve is not a single smooth piece.

    """
    if isinstance(piece, Arc):
        return np.concatenate([[ARC, piece.start, piece.end], *piece.conic])
    if isinstance(piece, LineSegment):
        a, b = np.array(piece.a), np.array(piece.b)
        return np.concatenate([[LINE, piece.start, piece.end], a, (b - a) / piece.end])
    spline = piece.spline if isinstance(piece, SplinePiece) else piece
    if not isinstance(spline, Spline):
        raise TypeError(f"not a smooth piece: {type(piece).__name__}")
    knots, spans = spline.cubics()
    head = [SPLINE, piece.start, piece.end, spline.period if spline.closed else 0.0, len(spans)]
    inner = np.column_stack(piece.knots)
    return np.concatenate([head, knots, np.ravel(spans), np.ravel(inner)])


@inner
def _span(piece: FloatArray, u: float) -> int:
    """Index of the spline's span with u; the first or the last one beyond the ends."""
    low, high = 0, int(piece[4]) - 1
    while low < high:
        middle = (low + high + 1) // 2
        if piece[5 + middle] <= u:
            low = middle
        else:
            high = middle - 1
    return low


@compiled
def place_on(piece: FloatArray, u: float) -> TrackPoint:
    """Return x, y, dx/du, dy/du, d2x/du2, d2y/du2 at u, also beyond the piece's ends."""
    if piece[0] == ARC:
        c, s = np.cos(u), np.sin(u)
        x, y = piece[5] * c + piece[7] * s, piece[6] * c + piece[8] * s
        dx, dy = piece[7] * c - piece[5] * s, piece[8] * c - piece[6] * s
        return piece[3] + x, piece[4] + y, dx, dy, -x, -y
    if piece[0] == LINE:
        return piece[3] + piece[5] * u, piece[4] + piece[6] * u, piece[5], piece[6], 0.0, 0.0
    if piece[3] > 0.0:
        u = u % piece[3]
    span = _span(piece, u)
    w = u - piece[5 + span]
    k = 6 + int(piece[4]) + 8 * span
    x3, y3, x2, y2 = piece[k], piece[k + 1], piece[k + 2], piece[k + 3]
    x1, y1 = piece[k + 4], piece[k + 5]
    return (
        ((x3 * w + x2) * w + x1) * w + piece[k + 6],
        ((y3 * w + y2) * w + y1) * w + piece[k + 7],
        (3 * x3 * w + 2 * x2) * w + x1,
        (3 * y3 * w + 2 * y2) * w + y1,
        6 * x3 * w + 2 * x2,
        6 * y3 * w + 2 * y2,
    )


@inlined
def _bend_at_knots(piece: FloatArray, axis: tuple[float, float], u: float, v: float) -> float:
    """Largest |e x gamma_uu| at the knots between two places on a spline, e = axis."""
    low, high = min(u, v), max(u, v)
    period, count = piece[3], int(piece[4])
    if period > 0.0:
        shift = np.floor(low / period) * period
        low, high = low - shift, high - shift
        if high - low >= period:
            return np.inf
    largest, span = 0.0, _span(piece, low) + 1
    while True:
        if span == count:
            if period == 0.0:
                return largest
            span, high = 0, high - period
        if piece[5 + span] >= high:
            return largest
        k = 8 + count + 8 * span
        largest = max(largest, 2 * abs(axis[0] * piece[k + 1] - axis[1] * piece[k]))
        span += 1


@inner
def _newton(
    piece: FloatArray, centre: tuple[float, float], theta: float, near: float
) -> tuple[float, TrackPoint, int]:
    """Where the guide's axis crosses the piece, by Newton's method to rounding from `near`.

    Return u, place and derivatives there, and how the search ended: FAR where it is not sure to
    end at the crossing that `near` belongs to. It is if at every step Kantorovich's condition
    holds, 2 |f'' step| <= |f'| (f'' between the ends of the step, f' at its start), and the pivot
    is not passed.
    """
    c, s = np.cos(theta), np.sin(theta)
    cx, cy = centre
    u, last = near, np.inf
    x, y, dx, dy, ddx, ddy = place_on(piece, u)
    slope, reach, ended = c * dy - s * dx, c * (x - cx) + s * (y - cy), FAR
    wx, wy = x - cx, y - cy
    was = (wx * dy - wy * dx) / np.sqrt(wx * wx + wy * wy)  # the slope when P was there
    if slope * reach * was < 0.0:
        return u, (x, y, dx, dy, ddx, ddy), FAR
    least = min(abs(slope), abs(was))
    for _ in range(NEWTON_STEPS):
        if abs(slope) < LEAST_SLOPE * np.sqrt(dx * dx + dy * dy):
            ended = TOUCHES
            break
        step = (c * (y - cy) - s * (x - cx)) / slope
        if abs(step) <= LEAST_NEWTON_STEP * (1 + abs(u)):
            u, ended = u - step, FINE
            break
        small = abs(step) <= 1e-9 * (1 + abs(u))
        if not (small or 2 * abs(step) <= last):
            break
        bend, last = abs(c * ddy - s * ddx), abs(step)
        x, y, dx, dy, ddx, ddy = place_on(piece, u - step)
        slope = c * dy - s * dx
        if small:
            u, ended = u - step, FINE  # quadratic: this one is exact
            break
        bend = max(bend, abs(c * ddy - s * ddx))
        if piece[0] == SPLINE:
            bend = max(bend, _bend_at_knots(piece, (c, s), u, u - step))
        if not 2 * bend * last <= least:
            break
        u, least = u - step, abs(slope)
    if ended == FINE and (c * (x - cx) + s * (y - cy)) * reach < 0.0:
        ended = FAR
    return u, (x, y, dx, dy, ddx, ddy), ended


@inlined
def _walk(
    piece: FloatArray, centre: tuple[float, float], theta: float, near: float
) -> tuple[float, TrackPoint, int]:
    """As `_newton`, on the way from the angle at which the axis passes through `near`.

    That angle is less than a right one away; parts of the way are as long as is sure.
    """
    place = place_on(piece, near)
    x, y = place[0] - centre[0], place[1] - centre[1]
    c, s = np.cos(theta), np.sin(theta)
    along, across = c * x + s * y, c * y - s * x
    way = np.arctan2(-across, abs(along)) if along > 0.0 else np.arctan2(across, abs(along))
    u, done, part, ended = near, 0.0, 0.5, FAR
    for _ in range(MOST_PARTS):
        ahead = min(1.0, done + part)
        found, place, ended = _newton(piece, centre, theta - (1.0 - ahead) * way, u)
        if ended == FINE:
            u, done, part = found, ahead, 2 * part
            if done == 1.0:
                return u, place, FINE
        else:
            part /= 2
            if part < LEAST_PART:
                break
    return u, place, TOUCHES if ended == TOUCHES else MISSES


def cross(
    piece: FloatArray, centre: tuple[float, float], theta: float, near: float
) -> tuple[float, TrackPoint, int]:
    """Where the guide's axis crosses the piece, followed from the place `near` as the guide turns.

    Return u, the components of gamma, gamma', gamma'' by theta, and how the search ended. Of
    several crossings it is the one that P comes to from `near` without a jump, if the guide has
    turned by less than a right angle since P was there.
    """
    u, place, ended = _newton(piece, centre, theta, near)
    if ended != FINE:
        u, place, ended = _walk(piece, centre, theta, near)
    if ended != FINE:
        nan = np.nan
        return u, (nan, nan, nan, nan, nan, nan), ended
    x, y, dx, dy, ddx, ddy = place
    c, s = np.cos(theta), np.sin(theta)
    r, slope = c * (x - centre[0]) + s * (y - centre[1]), c * dy - s * dx
    first = r / slope
    second = (2 * (c * dx + s * dy) * first - (c * ddy - s * ddx) * first * first) / slope
    square = first * first
    point = (
        x,
        y,
        dx * first,
        dy * first,
        ddx * square + dx * second,
        ddy * square + dy * second,
    )
    return u, point, ended
