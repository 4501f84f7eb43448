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
    points = curve.samples[1]
    lows = _sampled_minima(curve, np.linalg.norm(points - target, axis=1), points)
    feet = curve.wrap(_settled(curve, target, *_around(curve, lows)))
    distances = np.linalg.norm(curve.point(feet) - target, axis=1)
    return np.asarray(feet[np.argsort(distances, kind="stable")])


def closest(curve: Curve, targets: FloatArray) -> FloatArray:
    """Parameters (...) of the places next to `targets` (..., 2), in the parameter range."""
    points, found = targets.reshape(-1, 2), [np.empty(0)]
    for first in range(0, len(points), AT_ONCE):
        some = points[first : first + AT_ONCE]
        away = some[:, None] - curve.samples[1]
        nearest = np.argmin(np.sum(away * away, axis=-1), axis=1)
        found.append(curve.wrap(_settled(curve, some, *_around(curve, nearest))))
    return np.concatenate(found).reshape(targets.shape[:-1])


def _around(curve: Curve, i: IndexArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Parameters of samples, and of those before and after each."""
    grid, _ = curve.samples
    last = len(grid) - 1
    low, high = grid[np.maximum(i - 1, 0)], grid[np.minimum(i + 1, last)]
    if curve.closed:  # its last sample is the first one again
        low = np.where(i > 0, low, grid[-2] - curve.period)
        high = np.where(i < last, high, grid[1] + curve.period)
    return grid[i], low, high


def _settled(
    curve: Curve, targets: FloatArray, u: FloatArray, low: FloatArray, high: FloatArray
) -> FloatArray:
    """Zeros (n,) of g between two parameters, from `u`: Newton, halves where that goes astray.

    An end where g has one sign only.
    """
    for _ in range(ROUNDS):
        g, growth = _slope(curve, targets, u)
        low, high = np.where(g < 0, u, low), np.where(g < 0, high, u)
        with np.errstate(divide="ignore", invalid="ignore"):
            following = u - g / growth
        inside = (growth > 0) & (low <= following) & (following <= high)
        following = np.where(inside, following, 0.5 * (low + high))
        if np.all(abs(following - u) <= 1e-15 * np.maximum(abs(u), curve.period)):
            return following
        u = following
    return u


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


def _slope(curve: Curve, targets: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """``g`` and ``dg/du`` (n,) at u (n,)."""
    place, first, second = curve.derivatives(u)
    away = place - targets
    return np.sum(away * first, axis=-1), np.sum(first * first + away * second, axis=-1)


def descend(curve: Curve, target: FloatArray, near: float) -> float:
    """Walk downhill from ``near`` until the distance grows again, and settle there."""
    g, growth = (float(one) for one in _slope(curve, target, np.float64(near)))
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
        if there == here:
            return here
        if _slope(curve, target, np.float64(there))[0] * down >= 0:
            low, high = np.sort([here, there])
            return float(_settled(curve, target, 0.5 * (low + high), low, high))
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
