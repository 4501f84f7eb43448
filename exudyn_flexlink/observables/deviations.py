"""How far two motions are apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from exudyn_flexlink.arrays import FloatArray


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
