"""Times that are one, as a clock tells, and the time between two instants at which forces leap.

A clock that reads 3000 s goes on by 5e-13 s at least. A step that ends at an instant at which
forces leap, to rounding, still knows neither: what counts there is the limit from within the step.
"""

from __future__ import annotations

from math import inf, isfinite

import numpy as np

from exudyn_flexlink.arrays import FloatArray

CLOCK = 1e-15  # of the time: 4 to 9 times what it is rounded to


JUST = 2e-13  # s: twice as near as steps end at an instant


def instant(t: float, least: float) -> float:
    """How near (s) times are that count as one at t (s): `least`, or what the clock tells apart."""
    return max(least, CLOCK * abs(t))


def later(t: float, by: float) -> float:
    """Return the instant that is later than t (s) by so much (s), if at all, or as clocks tell."""
    return t + instant(t, by) if by else t


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
