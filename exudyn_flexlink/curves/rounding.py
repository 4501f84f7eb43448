"""Corners between lines and circles, rounded by arcs; polygons of such lines.

At a corner P two pieces meet with unit tangents d1 and d2, normals n = i d to the left, and
curvatures k (1/m; 0 of a line). A circle of radius R on the side to which the curve turns, s = 1
left or -1 right, touches both if its centre P + Y is R away from both:

    n . Y = s R + k w  of each piece,  w = (|Y|^2 - R^2)/2.

Both conditions give Y = a + w b, and this a quadratic equation for w. Its smaller root is the
circle next to the corner. Between two lines b is zero, and each loses R tan(turn/2).
"""

from __future__ import annotations

from cmath import phase, rect
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import pi, sqrt
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.curves.base import (
    DIRECTION_TOLERANCE,
    HALVINGS,
    POSITION_TOLERANCE,
    Curve,
    CurveError,
)
from exudyn_flexlink.curves.pieces import TURN, Arc, Joined, LineSegment, meet_all, show
from exudyn_flexlink.rounding import NEGLIGIBLE


@dataclass(frozen=True)
class CornerArc(Arc):
    """An arc of a circle that rounds a corner; to the right its second semi-axis is negative."""

    @property
    def radius(self) -> float:
        """Radius of the arc, m."""
        return self.semi_axes[0]

    @property
    def way(self) -> float:
        """1 where it turns to the left, -1 to the right."""
        return 1.0 if self.semi_axes[1] > 0 else -1.0


class _Corner(NamedTuple):
    """Pieces that meet at `place` (m) with unit tangents `ways`, all as x + i y."""

    before: Curve
    after: Curve
    place: complex
    ways: tuple[complex, complex]

    @property
    def turn(self) -> float:
        """By how much (rad) the curve turns, positive to the left."""
        return phase(self.ways[0].conjugate() * self.ways[1])


class _Fillet(NamedTuple):
    """An arc, and what it takes off the parameters of the pieces before and after it."""

    arc: CornerArc
    before: float
    after: float


def polygon(points: Sequence[tuple[float, float]], radius: float, *, closed: bool) -> Joined:
    """Join points (m) by lines with corners of a `radius` (m); a closed one goes back to the first.

    It is closed, too, where the last point repeats the first.

    Raises:
        CurveError: neighbours repeat, or corners can't be rounded so; see `rounded`.

    """
    size = float(np.ptp(np.array(points), axis=0).max())
    least = POSITION_TOLERANCE * max(1.0, size)
    ends = [*points]
    if closed and abs(complex(*points[-1]) - complex(*points[0])) > least:
        ends.append(points[0])
    for i in range(1, len(ends)):
        if abs(complex(*ends[i]) - complex(*ends[i - 1])) <= least:
            raise CurveError("repeats the point before", i, "leave one of the two out")
    return rounded([LineSegment(a, b) for a, b in pairwise(ends)], radius)


def rounded(pieces: Sequence[Curve], radius: float) -> Joined:
    """Join pieces as `Joined`, with an arc of `radius` (m) at every corner.

    Raises:
        CurveError: a gap; no corner; a corner that turns back, or is not between lines and arcs of
            circles; or arcs that use up a whole piece. For a corner, `piece` is the index of the
            second of its pieces; for the radius, `key` is 'round'.

    """
    closed = meet_all(pieces)
    smooth = [inner for piece in pieces for inner in piece.pieces]
    given = [i for i, piece in enumerate(pieces) for _ in piece.pieces]
    met = {i: _met(smooth[i - 1], smooth[i]) for i in range(0 if closed else 1, len(smooth))}
    corners = {i: corner for i, corner in met.items() if abs(corner.turn) > DIRECTION_TOLERANCE}
    if not corners:
        raise CurveError("there is no corner to round", key="round")
    for i, corner in corners.items():
        _require_round(corner, given[i])
    laid = _laid(smooth, corners, radius)
    if laid is None:
        largest = _largest(smooth, corners, radius)
        message = f"arcs of {radius:g} m do not fit at all corners: at most {largest:.10g} m"
        hint = "what the arcs at both ends of a piece take of it must be no more than the whole"
        raise CurveError(message, hint=hint, key="round")
    return Joined(tuple(laid))


def _met(before: Curve, after: Curve) -> _Corner:
    _, way, _ = before.places(np.asarray(before.end))
    place, next_way, _ = after.places(np.asarray(after.start))
    ways = complex(way), complex(next_way)
    return _Corner(before, after, complex(place), (ways[0] / abs(ways[0]), ways[1] / abs(ways[1])))


def _require_round(corner: _Corner, number: int) -> None:
    place = show(np.array([corner.place.real, corner.place.imag]))
    if pi - abs(corner.turn) <= DIRECTION_TOLERANCE:
        raise CurveError(f"turns back at {place}: no arc rounds that", number)
    if not all(_is_round(piece) for piece in (corner.before, corner.after)):
        hint = "let the pieces meet without a kink"
        message = (
            f"the corner at {place} is not between lines and arcs of circles: no 'round' there"
        )
        raise CurveError(message, number, hint)


def _is_round(piece: Curve) -> bool:
    circle = isinstance(piece, Arc) and piece.semi_axes[0] == abs(piece.semi_axes[1])
    return circle or isinstance(piece, LineSegment)


def _largest(smooth: Sequence[Curve], corners: Mapping[int, _Corner], radius: float) -> float:
    """Largest radius (m) that fits, if `radius` is too large."""
    low, high = 0.0, radius
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        fits = _laid(smooth, corners, middle, slack=0.0) is not None
        low, high = (middle, high) if fits else (low, middle)
    return low


def _laid(
    smooth: Sequence[Curve],
    corners: Mapping[int, _Corner],
    radius: float,
    slack: float = NEGLIGIBLE,
) -> list[Curve] | None:
    """Pieces and arcs between them; None if a piece is too short by more than `slack` of it."""
    fillets = dict[int, _Fillet]()
    for i, corner in corners.items():
        fillet = _fillet(corner, radius)
        if fillet is None:
            return None
        fillets[i] = fillet
    laid: list[Curve] = []
    for i, piece in enumerate(smooth):
        begin, end, after = piece.start, piece.end, (i + 1) % len(smooth)
        if i in fillets:
            begin += fillets[i].after
        if after in fillets:
            end -= fillets[after].before
        least = slack * piece.period
        if end < begin - least:
            return None
        whole = (begin, end) == (piece.start, piece.end)
        if end > begin + least:
            laid.append(piece if whole else piece.part(begin, end))
        if after in fillets:
            laid.append(fillets[after].arc)
    return laid


def _fillet(corner: _Corner, radius: float) -> _Fillet | None:
    """Return the arc at a corner; None if no circle touches both pieces there."""
    way = 1.0 if corner.turn > 0 else -1.0
    bends = [_bend(piece) for piece in (corner.before, corner.after)]
    if max(way * radius * bend for bend in bends) >= 1:
        return None  # the arc would lie inside a piece's circle but is not smaller than it
    first, second = corner.ways
    across = (first.conjugate() * second).imag
    a = way * radius * (second - first) / across
    b = (bends[0] * second - bends[1] * first) / across
    half = 1 - (a * b.conjugate()).real
    rest = abs(a) ** 2 - radius**2
    root = half**2 - abs(b) ** 2 * rest
    if half <= 0 or root < 0:
        return None
    centre = corner.place + a + b * rest / (half + sqrt(root))
    before = _taken(corner.before, first, corner.place, centre, -1.0)
    after = _taken(corner.after, second, corner.place, centre, 1.0)
    if min(before.taken, after.taken) < 0:
        return None
    begin, end = (way * phase(-1j * way * touch.along) for touch in (before, after))
    last = begin + (end - begin) % TURN
    arc = CornerArc((centre.real, centre.imag), (radius, way * radius), 0.0, begin, last)
    return _Fillet(arc, before.taken, after.taken)


class _Touch(NamedTuple):
    """What an arc takes off the parameter of a piece, and the unit tangent where it touches it."""

    taken: float
    along: complex


def _taken(piece: Curve, along: complex, place: complex, centre: complex, way: float) -> _Touch:
    """Where a circle about `centre` touches a piece with a corner at `place` and a tangent `along`.

    `way` is 1 if the piece begins at the corner, -1 if it ends there.
    """
    if not isinstance(piece, Arc):
        return _Touch(way * ((centre - place) * along.conjugate()).real, along)
    middle = complex(*piece.centre)
    turns = way if piece.semi_axes[1] > 0 else -way
    taken = (turns * phase((centre - middle) / (place - middle))) % TURN
    return _Touch(taken, along * rect(1.0, turns * taken))


def _bend(piece: Curve) -> float:
    """Curvature (1/m) of a line or of an arc of a circle."""
    return 0.0 if isinstance(piece, LineSegment) else float(piece.curvature(piece.start))
