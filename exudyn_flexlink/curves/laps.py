"""In which lap a point runs along a curve and on which piece of it, forwards and backwards.

A lap of a closed curve goes from its seam once around. Laps are counted from where lap 1 begins: 2,
3, .. where the point passes the seam forwards, and -1, -2, .. where it passes it backwards. There
is no lap 0. Of `Laps` lap -k is on the same curve as lap k, so that a point takes the curves in the
same order whichever way it leaves the place where lap 1 begins.
"""

from __future__ import annotations

from exudyn_flexlink.curves.base import Curve
from exudyn_flexlink.curves.joined import Laps


def next_lap(lap: int, way: int) -> int:
    """Lap that a point comes into over the seam, forwards (`way` 1) or backwards (-1)."""
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
