"""The time between two instants at which forces leap: a step that ends at one still knows neither.

Steps end at such instants, to rounding: what counts there is the limit from within the step.
"""

from __future__ import annotations

from math import inf, isfinite

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.integrate.clock import instant

JUST = 2e-13  # s: twice as near as steps end at an instant


class Window:
    """Times from one such instant to the next."""

    def __init__(self) -> None:
        self._after, self._before = 0.0, inf

    def go_on(self, begin: float, end: float) -> None:
        """Go on to the time between two instants (s); the run's start and end are none."""
        self._after = begin + instant(begin, JUST) if begin > 0 else 0.0
        self._before = end - instant(end, JUST) if isfinite(end) else inf

    def inside(self, time: float) -> float:
        """Return a time (s), or the nearest one within."""
        return min(max(time, self._after), self._before)

    def all_inside(self, times: FloatArray) -> FloatArray:
        """As `inside`, of times (n,) in order; the same array where they are."""
        if not len(times) or (self._after <= times[0] and times[-1] <= self._before):
            return times
        return np.minimum(np.maximum(times, self._after), self._before)
