"""Where event functions fall to zero within a step.

An event function (m, or any length) is positive as long as the present equations hold. It is looked
at a few times within the step; one that falls below zero and rises again between two looks is found
by the zero of its rate. Right after an event it may start at zero: then it falls after its highest
place.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isnan
from typing import Any

import numpy as np
from scipy.optimize import brentq

from exudyn_flexlink.integrate.problem import DIVERGED, NoConvergenceError

EVENT_TIME = 1e-13  # s: to which events are located, where the clock tells that apart
LOOKS = 8  # at event functions within a step in which they may fall
GAP_ROUNDING = 1e-14  # m: a gap, or another event function, so little below zero is zero, rounded
HALVINGS = 40  # of the time to the next look, in the search for where a function rises from zero

Function = Callable[[float], float]
"""A value, or a rate, by the time (s)."""


@dataclass(frozen=True)
class Event:
    """What happens first within a step, and when (s); `what` is the problem's own.

    Where forces only bend, the last step still tells where the next one goes (`bends`).
    """

    time: float
    what: Any
    bends: bool = False


def zero(value: Function, begin: float, end: float) -> float:
    """Instant (s) of the zero of a value that changes its sign between two instants.

    Raises:
        NoConvergenceError: the value is no number in between.

    """

    def number(t: float) -> float:
        found = value(t)
        if isnan(found):
            raise NoConvergenceError(DIVERGED)
        return found

    return float(brentq(number, begin, end, xtol=EVENT_TIME, rtol=1e-15))


def fall(value: Function, begin: float, end: float) -> float:
    """Instant at which a value falls to zero that is below it at the end."""
    return begin if value(begin) <= 0 else zero(value, begin, end)


def first_fall(
    value: Function, rate: Function | None, within: tuple[float, float], looks: int = LOOKS
) -> float | None:
    """Find when an event function falls below zero first; None if it does not.

    With its `rate` it is also found between two looks. One that starts at zero falls only as it
    gets lower than there: how far below zero it starts is how exactly events are located.
    """
    t, end = within
    slope = next_slope = 0.0 if rate is None else rate(t)
    for after in np.linspace(t, end, looks + 1)[1:].tolist():
        lowest = after
        if rate is not None:
            slope, next_slope = next_slope, rate(after)
            if slope < 0 < next_slope:
                lowest = zero(rate, t, after)
        if value(lowest) < -GAP_ROUNDING:
            if value(t) > GAP_ROUNDING:
                return zero(value, t, lowest)
            if value(lowest) < value(t) - GAP_ROUNDING:
                return _after_rising(value, t, lowest)
        t = after
    return None


def _after_rising(value: Function, t: float, after: float) -> float:
    """When a value falls that starts at zero; at once if it does not rise first."""
    between = (t + (after - t) * 0.5**k for k in range(1, HALVINGS))
    risen = next((place for place in between if value(place) > 0), None)
    return t if risen is None else zero(value, risen, after)
