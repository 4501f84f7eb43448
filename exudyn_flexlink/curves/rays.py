"""Where a straight line crosses a curve."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.curves.base import OVERLAP, Curve, CurveError, as_point, cross

# Newton from a start that meets h = |f f''|/f'^2 <= 1/2 finds the one root there (Kantorovich);
# f'' is only known at the start, hence a tighter bound.
SAFE_START = 0.05


def ray_crossings(curve: Curve, origin: ArrayLike, direction: ArrayLike) -> FloatArray:
    """All u, ascending over one period, where the line through ``origin`` crosses the curve.

    The line runs both ways from ``origin`` (2,) along ``direction`` (2,), of any length. Points of
    contact count; a straight piece that lies in the line contributes its two ends. A crossing next
    to a break may be given as the break itself, 1e-7 of a piece away at most. Closed form for
    arcs and lines, roots of the cubics for splines.

    Raises:
        CurveError: the direction is zero, or something is not finite.

    """
    start, along = _line(origin, direction)
    found = [
        begin + _on_piece(piece, piece.crossings(start, along))
        for piece, begin in zip(curve.pieces, curve.breaks[:-1], strict=True)
    ]
    u = np.sort(np.concatenate(found))
    misses = np.abs(cross(along, curve.point(u) - start))
    kept: list[int] = []
    for i in range(len(u)):
        # neighbouring pieces both report a crossing at their joint: keep the better
        if kept and u[i] - u[kept[-1]] <= OVERLAP * curve.period:
            kept[-1] = i if misses[i] < misses[kept[-1]] else kept[-1]
        else:
            kept.append(i)
    return _without_seam(curve, u[kept], misses[kept])


def intersect_ray(curve: Curve, origin: ArrayLike, direction: ArrayLike, near_u: float) -> float:
    """Find the u closest to ``near_u`` where the line through ``origin`` crosses the curve.

    As in :func:`ray_crossings`, both ways along the line. On a closed curve u counts on over the
    laps with ``near_u``. From a good ``near_u`` (time stepping) a few Newton steps suffice.

    Raises:
        CurveError: the line misses the curve, or the direction is zero or not finite.

    """
    start, along = _line(origin, direction)
    u = _newton(curve, start, along, near_u)
    return _closest(curve, start, along, near_u) if u is None else u


def _on_piece(piece: Curve, u: FloatArray) -> FloatArray:
    """Parameters counted from the piece's start: those just outside a closed piece come round."""
    if piece.closed:
        return np.asarray(np.mod(u - piece.start, piece.period))
    return np.asarray(np.clip(u, piece.start, piece.end) - piece.start)


def _line(origin: ArrayLike, direction: ArrayLike) -> tuple[FloatArray, FloatArray]:
    start, along = np.array(as_point(origin, "origin")), np.array(as_point(direction, "direction"))
    length = float(np.linalg.norm(along))
    if length == 0:
        raise CurveError("the direction of a line must not be zero")
    return start, along / length


def _without_seam(curve: Curve, u: FloatArray, misses: FloatArray) -> FloatArray:
    """Drop the second of two equal crossings where a closed curve ends and starts."""
    if not curve.closed or not len(u):
        return np.asarray(u)
    if len(u) > 1 and u[0] + curve.period - u[-1] <= OVERLAP * curve.period:
        u = u[:-1] if misses[0] <= misses[-1] else u[1:]
    return np.sort(np.where(u >= curve.end, curve.start, u))


def _newton(curve: Curve, origin: FloatArray, along: FloatArray, near: float) -> float | None:
    """Find the crossing next to ``near`` if it is certain to be the closest, else None."""
    point, first, second = curve.derivatives(near)
    f, slope = float(cross(along, point - origin)), float(cross(along, first))
    if abs(f * float(cross(along, second))) > SAFE_START * slope**2 or slope == 0:
        return None
    reach = 2 * abs(f / slope)
    if reach > 0.05 * curve.period / len(curve.pieces) or _break_within(curve, near, reach):
        return None
    u = near
    for _ in range(8):
        step = -f / slope
        u += step
        if abs(u - near) > reach or abs(step) <= 1e-13 * curve.period:
            break
        f = float(cross(along, curve.point(u) - origin))
        slope = float(cross(along, curve.derivative(u)))
    converged = abs(u - near) <= reach and abs(step) <= 1e-13 * curve.period
    return u if converged else None


def _break_within(curve: Curve, near: float, reach: float) -> bool:
    wrapped = float(curve.wrap(near))
    gap = np.abs(curve.breaks - wrapped)
    return bool(np.any(gap <= reach)) and reach > 0


def _closest(curve: Curve, origin: FloatArray, along: FloatArray, near: float) -> float:
    u = ray_crossings(curve, origin, along)
    if not len(u):
        raise CurveError(
            f"the line from ({origin[0]:.6g}, {origin[1]:.6g}) along "
            f"({along[0]:.6g}, {along[1]:.6g}) misses the curve"
        )
    if curve.closed:
        u = u + curve.period * np.round((near - u) / curve.period)
    return float(u[np.argmin(np.abs(u - near))])
