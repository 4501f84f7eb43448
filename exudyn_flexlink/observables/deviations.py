"""How far two motions are apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from exudyn_flexlink.arrays import FloatArray


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
