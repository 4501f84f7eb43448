"""How far a run is from given positions and angles at given instants."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.observables.answers import ANGLE
from exudyn_flexlink.observables.levers import lever_response, struck_bodies
from exudyn_flexlink.observables.points import path, watched_point
from exudyn_flexlink.result import Result

FloatArray = NDArray[np.float64]

SAME_INSTANT = 1e-9  # s


@dataclass(frozen=True)
class Deviation:
    """Distances (N,) m of what is judged and differences (N,) rad of the lever's angle."""

    time: FloatArray
    distance: FloatArray
    lever_angle: FloatArray

    @property
    def largest(self) -> float:
        """Largest distance, m."""
        return float(self.distance.max())

    @property
    def rms(self) -> float:
        """Root of the mean square of the distances, m."""
        return float(np.sqrt(np.mean(self.distance**2)))

    @property
    def largest_angle(self) -> float:
        """Largest difference of the lever's angle, rad; 0 without a lever."""
        return float(np.abs(self.lever_angle).max(initial=0.0))

    def until(self, time: float) -> Deviation:
        """Return the part before an instant (s)."""
        before = self.time < time
        return Deviation(self.time[before], self.distance[before], self.lever_angle[before])


def deviation(
    result: Result, time: FloatArray, position: FloatArray, lever_angle: FloatArray
) -> Deviation:
    """Compare the watched point and the lever with values at instants the run has sampled.

    `time` (N,) s, `position` (N, 2) m, `lever_angle` (N,) rad; instants after the run's end are
    left out.

    Raises:
        ValueError: the run has no sample at one of the instants.

    """
    kept = time <= result.time[-1] + SAME_INSTANT
    time, position, lever_angle = time[kept], position[kept], lever_angle[kept]
    index = np.searchsorted(result.time, time - SAME_INSTANT)
    missing = np.abs(result.time[index] - time) > SAME_INSTANT
    if missing.any():
        raise ValueError(
            f"the run has no sample at t = {time[missing][0]:.9g} s: set 'run: sample' to match"
        )
    seen = path(result, watched_point(result.scene)).position[index]
    responses = (lever_response(result, own) for own in struck_bodies(result.scene).values())
    lever = next((own for own in responses if own.measure is ANGLE), None)
    angle = lever_angle if lever is None else lever.value[index]
    return Deviation(time, np.linalg.norm(seen - position, axis=1), angle - lever_angle)
