"""Foot points: where the distance from a point to a curve is smallest.

The sign of ``g(u) = (P - q) . dP/du`` tells downhill; g is continuous up to positive jumps at the
breaks, hence bracketing plus Newton, which needs no smoothness where pieces meet.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IndexArray

if TYPE_CHECKING:
    from exudyn_flexlink.curves.base import Curve

MOST_CANDIDATES = 16
AT_ONCE = 4096  # points whose distances from all samples are held in memory together
ROUNDS = 60  # of halving: to rounding


def candidates(curve: Curve, target: FloatArray) -> FloatArray:
    """Parameters of local minima of the distance to ``target`` (2,), the closest first.

    Only minima that can be the closest, given the spacing of the samples, and at most
    ``MOST_CANDIDATES`` of them (the centre of a circle has infinitely many).
    """
    u, points = curve.samples
    lows = _sampled_minima(curve, np.linalg.norm(points - target, axis=1), points)
    found = [_refine(curve, target, u, int(i)) for i in lows]
    feet = curve.wrap(np.array(found))
    distances = np.linalg.norm(curve.point(feet) - target, axis=1)
    return np.asarray(feet[np.argsort(distances, kind="stable")])


def closest(curve: Curve, targets: FloatArray) -> FloatArray:
    """Parameters (...) of the places next to `targets` (..., 2), in the parameter range."""
    points = targets.reshape(-1, 2)
    found = [_closest(curve, points[i : i + AT_ONCE]) for i in range(0, len(points), AT_ONCE)]
    return np.concatenate([np.empty(0), *found]).reshape(targets.shape[:-1])


def _closest(curve: Curve, targets: FloatArray) -> FloatArray:
    """Zero of g between the neighbours of the nearest sample: Newton, halves where it goes astray.

    An end of an open curve where g has one sign only.
    """
    grid, points = curve.samples
    away = targets[:, None] - points
    i = np.argmin(np.sum(away * away, axis=-1), axis=1)
    u, last = grid[i], len(grid) - 1
    if curve.closed:  # its last sample is the first one again
        low = np.where(i > 0, grid[i - 1], grid[-2] - curve.period)
        high = np.where(i < last, grid[np.minimum(i + 1, last)], grid[1] + curve.period)
    else:
        low, high = grid[np.maximum(i - 1, 0)], grid[np.minimum(i + 1, last)]
    for _ in range(ROUNDS):
        place, first, second = curve.derivatives(u)
        away = place - targets
        g = np.sum(away * first, axis=-1)
        growth = np.sum(first * first, axis=-1) + np.sum(away * second, axis=-1)
        low, high = np.where(g < 0, u, low), np.where(g < 0, high, u)
        with np.errstate(divide="ignore", invalid="ignore"):
            following = u - g / growth
        inside = (growth > 0) & (low <= following) & (following <= high)
        following = np.where(inside, following, 0.5 * (low + high))
        if np.all(abs(following - u) <= 1e-15 * np.maximum(abs(u), curve.period)):
            return curve.wrap(following)
        u = following
    return curve.wrap(u)


def _sampled_minima(curve: Curve, distance: FloatArray, points: FloatArray) -> IndexArray:
    ends = np.inf if not curve.closed else None
    before = np.concatenate([[ends or distance[-2]], distance[:-1]])
    after = np.concatenate([distance[1:], [ends or distance[1]]])
    # The distance changes by no more than the way along the curve: a chord, with room for bending.
    slack = 2 * np.max(np.linalg.norm(np.diff(points, axis=0), axis=1))
    low = (distance <= before) & (distance <= after) & (distance <= distance.min() + slack)
    if curve.closed:
        low[-1] = False  # the same place as the first sample
    index = np.flatnonzero(low)
    return np.asarray(index[np.argsort(distance[index], kind="stable")][:MOST_CANDIDATES])


def _refine(curve: Curve, target: FloatArray, u: FloatArray, i: int) -> float:
    """Settle downhill of sample i, no further than its neighbours."""
    here = float(u[i])
    if _slope(curve, target, here)[0] < 0:
        return _settle(curve, target, here, float(u[min(i + 1, len(u) - 1)]))
    if i > 0:
        return _settle(curve, target, float(u[i - 1]), here)
    return _settle(curve, target, float(u[-2] - curve.period) if curve.closed else here, here)


def _slope(curve: Curve, target: FloatArray, u: float) -> tuple[float, float]:
    """``g`` and ``dg/du`` at u."""
    away, first, second = curve.derivatives(u)
    away = away - target
    return float(away @ first), float(first @ first + away @ second)


def _settle(curve: Curve, target: FloatArray, low: float, high: float) -> float:
    """Zero of g between low and high, an end where g has one sign only."""
    if _slope(curve, target, low)[0] >= 0:
        return low
    if _slope(curve, target, high)[0] <= 0:
        return high
    u = 0.5 * (low + high)
    for _ in range(100):
        g, growth = _slope(curve, target, u)
        low, high = (u, high) if g < 0 else (low, u)
        step = -g / growth if growth > 0 else np.inf
        following = u + step if low <= u + step <= high else 0.5 * (low + high)
        if abs(following - u) <= 1e-15 * max(abs(u), curve.period):
            return following
        u = following
    return u


def descend(curve: Curve, target: FloatArray, near: float) -> float:
    """Walk downhill from ``near`` until the distance grows again, and settle there."""
    g, growth = _slope(curve, target, near)
    if g == 0:
        return near
    down = -1 if g > 0 else 1
    # Twice a Newton step brackets the foot at once when near is close, as in time stepping.
    step = 2 * abs(g) / growth if growth > 0 else np.inf
    here = near
    while abs(here - near) <= curve.period:
        there = here + down * min(step, _to_next_sample(curve, here, down))
        if not curve.closed:
            there = min(max(there, curve.start), curve.end)
        if there == here or _slope(curve, target, there)[0] * down >= 0:
            return _settle(curve, target, min(here, there), max(here, there))
        here, step = there, 2 * step
    return here


def _to_next_sample(curve: Curve, u: float, down: int) -> float:
    """Way from u to the next sample: never over a break, after which u may mean a length."""
    grid = curve.samples[0]
    aside = 1e-12 * curve.period
    at = float(curve.wrap(u))
    if down > 0:
        following = int(np.searchsorted(grid, at + aside, side="right"))
        return float(grid[following]) - at if following < len(grid) else aside
    before = int(np.searchsorted(grid, at - aside, side="left")) - 1
    return at - float(grid[before]) if before >= 0 else aside
