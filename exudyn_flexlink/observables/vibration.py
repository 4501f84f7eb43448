"""How the watched point vibrates: off the place where an ideal mechanism would have it."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.observables.interpolation import between_samples
from exudyn_flexlink.observables.parting import common_times
from exudyn_flexlink.observables.perturbation import perturbation
from exudyn_flexlink.observables.points import path, watched_point
from exudyn_flexlink.observables.spectra import Spectrum, spectrum
from exudyn_flexlink.result import Result


@dataclass(frozen=True)
class Vibration:
    """Spectra (m^2/Hz) of `moved` (N, 2) m, the watched point's motion along x and y.

    With `off_ideal` that is what the point is off from where a straight link on its guide's axis
    would have it (see `perturbation`); where there is no such place, where it is.
    """

    moved: FloatArray
    x: Spectrum
    y: Spectrum
    off_ideal: bool

    @property
    def rms(self) -> FloatArray:
        """Roots of the mean squares (2,) of x and y, m."""
        return np.asarray(np.sqrt(np.mean(self.moved**2, axis=0)))

    @property
    def peak(self) -> FloatArray:
        """Largest absolute values (2,) of x and y, m."""
        return np.asarray(np.abs(self.moved).max(axis=0))


def vibration(result: Result, begin: float = 0.0, end: float = inf) -> Vibration:
    """Vibration of the watched point from `begin` to `end` (s)."""
    point, time = watched_point(result.scene), common_times(result, result)
    time = time[(time >= begin) & (time <= end)]
    off = perturbation(result, point, time)
    ideal = off is not None
    if off is None:
        seen = path(result, point)
        off = between_samples(seen.time, seen.position, seen.velocity, time)
    x, y = (spectrum(time, column) for column in off.T)
    return Vibration(off, x, y, ideal)
