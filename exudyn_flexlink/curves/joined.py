"""Curves joined from pieces; a different curve in every lap, and which piece comes next."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import accumulate

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.curves.base import (
    DIRECTION_TOLERANCE,
    POSITION_TOLERANCE,
    Composite,
    Curve,
    CurveError,
    angle_between,
)
from exudyn_flexlink.curves.feet import candidates


@dataclass(frozen=True)
class Joined(Composite):
    """``pieces`` in order, each starting where the one before ends, in the same direction.

    The parameter starts with the first piece's own and goes on by the ranges of the following ones.
    Closed when the end meets the start; the direction must be the same there too. Joined curves
    among the pieces are taken apart into theirs.

    Raises:
        CurveError: a gap, or a kink; ``piece`` is the index of the later of the two.

    """

    pieces: tuple[Curve, ...]

    def __post_init__(self) -> None:
        given = tuple(self.pieces)
        size = max(piece.size for piece in given)
        for index in range(1, len(given)):
            self._check_gap(given, index, size)
            _check_kink(given[index - 1], given[index], index, (index, index + 1))
        closed = _gap(given[-1], given[0]) <= _tolerance(size)
        if closed:
            _check_kink(given[-1], given[0], 0, (len(given), 1))
        flat = tuple(smooth for piece in given for smooth in piece.pieces)
        self._lay(flat, flat[0].start, closed)

    @staticmethod
    def _check_gap(given: tuple[Curve, ...], index: int, size: float) -> None:
        gap = _gap(given[index - 1], given[index])
        if gap > _tolerance(size):
            end, start = _last(given[index - 1]), _first(given[index])
            raise CurveError(
                f"piece {index + 1} starts at {_show(start)}, {gap:.3g} m away from the end of "
                f"piece {index} at {_show(end)}",
                piece=index,
                hint="let each piece start where the one before ends",
            )


@dataclass(frozen=True)
class Laps(Composite):
    """A different closed curve in each lap, in turn, for ever: lap 1 on the first, and so on.

    All pass through the point ``meet`` (default: where the first curve starts), in the same
    direction, and there the next takes over. The parameter starts at 0 at ``meet``; in each lap it
    goes on by the range of that lap's curve. One ``period`` is one turn through all ``curves``.
    ``firsts`` are the first pieces of the laps, and at last the number of all pieces.

    Raises:
        CurveError: an open curve, one that misses ``meet`` or passes it in another
            direction; ``piece`` is the index of that curve.

    """

    curves: tuple[Curve, ...]
    meet: tuple[float, float] | None = None
    firsts: tuple[int, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        curves = tuple(self.curves)
        meet = np.array(_first(curves[0]) if self.meet is None else self.meet)
        # Where the first curve starts is one pass of it, even if it passes the point again.
        cut = curves[0].start if self.meet is None else None
        heading: FloatArray | None = None
        laps = []
        for index, curve in enumerate(curves):
            _check_closed(curve, index)
            cut = _cut_place(curve, index, meet, heading) if cut is None else cut
            heading = curve.tangent(cut) if heading is None else heading
            laps.append(_rotated(curve, cut))
            cut = None
        object.__setattr__(self, "curves", curves)
        self._lay(tuple(piece for lap in laps for piece in lap), 0.0, closed=True)
        object.__setattr__(self, "firsts", tuple(accumulate(map(len, laps), initial=0)))


def next_lap(lap: int, way: int) -> int:
    """Lap that a point comes into over the seam, forwards (`way` 1) or backwards (-1).

    A lap of a closed curve goes from its seam once around. From where lap 1 begins they are 1, 2,
    .. forwards and -1, -2, .. backwards, without a lap 0. Of `Laps` lap -k is on the same curve as
    lap k: a point takes the curves in the same order whichever way it leaves that place.
    """
    return lap + way or way


def next_piece(curve: Curve, piece: int, lap: int, way: int) -> tuple[int, int] | None:
    """Piece and lap after the end of a piece (`way` 1) or before its start (-1).

    None at an end of an open curve.
    """
    first, last = _pieces_of_lap(curve, lap)
    if first <= piece + way <= last:
        return piece + way, lap
    if not curve.closed:
        return None
    lap = next_lap(lap, way)
    first, last = _pieces_of_lap(curve, lap)
    return (first if way > 0 else last), lap


def ends_of_lap(curve: Curve, lap: int) -> tuple[float, float]:
    """Parameters at which a lap begins and ends; those of the whole curve if it has no laps."""
    first, last = _pieces_of_lap(curve, lap)
    return float(curve.breaks[first]), float(curve.breaks[last + 1])


def _pieces_of_lap(curve: Curve, lap: int) -> tuple[int, int]:
    """First and last piece that a lap runs on; of the whole curve if it has no laps."""
    if not isinstance(curve, Laps):
        return 0, len(curve.pieces) - 1
    number = (abs(lap) - 1) % len(curve.curves)
    return curve.firsts[number], curve.firsts[number + 1] - 1


def _check_closed(curve: Curve, index: int) -> None:
    if not curve.closed:
        raise CurveError(
            f"curve {index + 1} of the laps is open: its ends {_show(_first(curve))} and "
            f"{_show(_last(curve))} are {_gap(curve, curve):.3g} m apart",
            piece=index,
            hint="a lap needs a closed curve",
        )


def _cut_place(curve: Curve, index: int, meet: FloatArray, heading: FloatArray | None) -> float:
    """Parameter at which ``curve`` passes ``meet``, along ``heading`` if it is given."""
    feet = candidates(curve, meet)
    distances = np.linalg.norm(curve.point(feet) - meet, axis=1)
    if distances[0] > _tolerance(curve.size):
        raise CurveError(
            f"curve {index + 1} of the laps passes the meeting point {_show(meet)} "
            f"at a distance of {distances[0]:.3g} m",
            piece=index,
            hint="all curves must pass through the point where the laps change",
        )
    passes = feet[distances <= _tolerance(curve.size)]
    if heading is None:
        return _snapped(curve, float(passes[0]))
    turns = [angle_between(heading, curve.tangent(u)) for u in passes]
    best = int(np.argmin(turns))
    _check_turn(turns[best], index, meet)
    return _snapped(curve, float(passes[best]))


def _check_turn(angle: float, index: int, meet: FloatArray) -> None:
    if angle <= DIRECTION_TOLERANCE:
        return
    opposite = math.pi - angle <= DIRECTION_TOLERANCE
    if opposite:
        message = f"curve {index + 1} of the laps runs through {_show(meet)} the other way round"
        hint = "give its pieces or points in the opposite order"
    else:
        message = (
            f"curve {index + 1} of the laps passes the meeting point {_show(meet)} "
            f"at {math.degrees(angle):.4g} degrees to the first"
        )
        hint = "all curves must have the same tangent where the laps change"
    raise CurveError(message, piece=index, hint=hint)


def _snapped(curve: Curve, u: float) -> float:
    """Return the break at u if there is one: a cut there makes no sliver of a piece."""
    ways = np.abs(curve.breaks - u) * float(np.linalg.norm(curve.derivative(u)))
    closest = int(np.argmin(ways))
    return float(curve.breaks[closest]) if ways[closest] <= POSITION_TOLERANCE else u


def _rotated(curve: Curve, cut: float) -> tuple[Curve, ...]:
    """Pieces of the closed ``curve`` from ``cut`` once around; the piece at the cut is split."""
    index, local = curve.locate(cut)
    piece = curve.pieces[index]
    after, before = curve.pieces[index + 1 :], curve.pieces[:index]
    if local == piece.start:
        return (piece, *after, *before)
    if len(curve.pieces) == 1:
        return (piece.part(local, local + piece.period),)
    return (piece.part(local, piece.end), *after, *before, piece.part(piece.start, local))


def _check_kink(before: Curve, after: Curve, index: int, numbers: tuple[int, int]) -> None:
    one, two = before.pieces[-1], after.pieces[0]
    # Of the pieces themselves: the end of a closed one is not wrapped to its start.
    angle = angle_between(one._raw(np.asarray(one.end), 1), two._raw(np.asarray(two.start), 1))
    if angle > DIRECTION_TOLERANCE:
        raise CurveError(
            f"pieces {numbers[0]} and {numbers[1]} meet at {_show(_first(after))} with a kink of "
            f"{math.degrees(angle):.4g} degrees",
            piece=index,
            hint="a point on it needs a continuous tangent: round the corner with an arc",
        )


def _first(curve: Curve) -> FloatArray:
    piece = curve.pieces[0]
    return piece._raw(np.asarray(piece.start), 0)


def _last(curve: Curve) -> FloatArray:
    # the piece's own end, which a nearly closed curve does not share with its start
    piece = curve.pieces[-1]
    return piece._raw(np.asarray(piece.end), 0)


def _gap(before: Curve, after: Curve) -> float:
    return float(np.linalg.norm(_first(after) - _last(before)))


def _tolerance(size: float) -> float:
    return POSITION_TOLERANCE * max(1.0, size)


def _show(point: FloatArray) -> str:
    x, y = (round(float(value), 12) + 0.0 for value in point)
    return f"({x:.6g}, {y:.6g})"
