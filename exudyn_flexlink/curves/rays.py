"""Where a straight line crosses a curve."""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.curves.base import OVERLAP, Curve, cross, unit


def ray_crossings(curve: Curve, origin: FloatArray, direction: FloatArray) -> FloatArray:
    """All u, ascending over one period, where the line through ``origin`` crosses the curve.

    The line runs both ways from ``origin`` (2,) along ``direction`` (2,), of any length. Points of
    contact count; a straight piece that lies in the line contributes its two ends. A crossing next
    to a break may be given as the break itself, 1e-7 of a piece away at most. Closed form for
    arcs and lines, roots of the cubics for splines.
    """
    along = unit(direction)
    found = [
        begin + _on_piece(piece, piece.crossings(origin, along))
        for piece, begin in zip(curve.pieces, curve.breaks[:-1], strict=True)
    ]
    u = np.sort(np.concatenate(found))
    misses = np.abs(cross(along, curve.point(u) - origin))
    kept: list[int] = []
    for i in range(len(u)):
        # neighbouring pieces both report a crossing at their joint: keep the better
        if kept and u[i] - u[kept[-1]] <= OVERLAP * curve.period:
            kept[-1] = i if misses[i] < misses[kept[-1]] else kept[-1]
        else:
            kept.append(i)
    return _without_seam(curve, u[kept], misses[kept])


def _on_piece(piece: Curve, u: FloatArray) -> FloatArray:
    """Parameters counted from the piece's start: those just outside a closed piece come round."""
    if piece.closed:
        return np.asarray(np.mod(u - piece.start, piece.period))
    return np.asarray(np.clip(u, piece.start, piece.end) - piece.start)


def _without_seam(curve: Curve, u: FloatArray, misses: FloatArray) -> FloatArray:
    """Drop the second of two equal crossings where a closed curve ends and starts."""
    if not curve.closed or not len(u):
        return np.asarray(u)
    if len(u) > 1 and u[0] + curve.period - u[-1] <= OVERLAP * curve.period:
        u = u[:-1] if misses[0] <= misses[-1] else u[1:]
    return np.sort(np.where(u >= curve.end, curve.start, u))
