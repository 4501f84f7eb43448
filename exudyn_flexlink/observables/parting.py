"""How far two runs are apart, instant by instant, in the points by which runs are judged.

Times in s, lengths in m; N is the number of instants.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import build_mechanism, end_of_run, sample_times
from exudyn_flexlink.observables.points import judged_points, paths, room
from exudyn_flexlink.result import Result

STILL = 1e-13  # m: rounding; what moves by less stands still
ALIKE = 0.999  # of the largest distance: no reason to name another point than the first
VISIBLE = 1e-3  # of the room that points take: runs that differ by more have parted


@dataclass(frozen=True)
class Deviation:
    """Distances (N,) m of what is judged at instants (N,) s."""

    time: FloatArray
    distance: FloatArray

    @property
    def largest(self) -> float:
        """Largest distance, m."""
        return float(self.distance.max())

    @property
    def rms(self) -> float:
        """Root of the mean square of the distances, m."""
        return float(np.sqrt(np.mean(self.distance**2)))

    def until(self, time: float) -> Deviation:
        """Return the part before an instant (s)."""
        before = self.time < time
        return Deviation(self.time[before], self.distance[before])


def first_beyond(time: FloatArray, values: FloatArray, limit: float) -> float | None:
    """First of some instants (N,) s at which a value (N,) is above a limit, or no number.

    Of the distances of two runs of one engine at different settings it tells how long the motion is
    predictable: from it on, pointwise differences say nothing about an engine.
    """
    beyond = np.flatnonzero(~(values <= limit))
    return float(time[beyond[0]]) if len(beyond) else None


def separation(
    first: Result, second: Result, time: FloatArray, points: Sequence[str] = ()
) -> FloatArray:
    """Distance (N,) m of the farthest of some points, or of those judged, at instants (N,) s."""
    points = points or common_points(first, second)
    return np.asarray(separations(first, second, time, points).max(axis=1))


def separations(
    first: Result, second: Result, time: FloatArray, points: Sequence[str]
) -> FloatArray:
    """Distances (N, points) m of points in two runs at instants (N,) s."""
    one, other = (positions(result, points, time) for result in (first, second))
    return np.asarray(np.linalg.norm(one - other, axis=-1))


def farthest(points: Sequence[str], distances: FloatArray) -> str:
    """Name of the point with the largest of distances (points,), the first of those alike."""
    alike = distances >= ALIKE * distances.max()
    return points[int(alike.argmax())]


def common_points(first: Result, second: Result) -> tuple[str, ...]:
    """Names of the points by which both runs are judged."""
    other = judged_points(second.scene)
    return tuple(point for point in judged_points(first.scene) if point in other)


def parting_limit(result: Result) -> float:
    """Difference (m) that counts as parted: a part of the room the judged points take."""
    return VISIBLE * room(result, judged_points(result.scene))


def common_times(first: Result, second: Result) -> FloatArray:
    """Even instants (N,) s that the first run's scene asks for, up to the end of the shorter run.

    Where a run has no sample there, it is interpolated: see `between_samples`.
    """
    scene = first.scene
    begin = float(max(first.time[0], second.time[0]))
    end = float(min(first.time[-1], second.time[-1]))
    if end <= begin:
        return np.array([begin])
    mechanism = build_mechanism(scene)
    grid = sample_times(scene, mechanism, end_of_run(scene, mechanism))
    kept = grid[(grid >= begin) & (grid < end * (1 - 1e-9))]
    return np.append(kept, end)


def positions(result: Result, points: Sequence[str], time: FloatArray) -> FloatArray:
    """Positions (N, points, 2) m at instants (N,) s, interpolated between samples."""
    return np.stack([seen.at(time) for seen in paths(result, points)], axis=1)
