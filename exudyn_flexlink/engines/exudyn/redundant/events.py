"""Steps that end on events: where a track's curvature jumps, a contact begins, a run ends.

Across a jump of the forces a method of order 2 is only of order 1, so the step before an event is
shortened to end on it.
"""

from __future__ import annotations

from math import inf, sqrt

# Of a step: an event nearer than this counts as reached. A step so short would fill the
# multipliers, which an index-3 method divides by the square of its step, with rounding.
REACHED = 1e-2


def end_on(step: float, until: float) -> float:
    """Shorten `step` (s) so that a whole number of steps ends on an event `until` seconds ahead.

    An event between one and two steps ahead is reached by two equal ones, so that none is tiny.
    """
    if until <= step * (1 + REACHED):
        return max(until, REACHED * step)
    if until < 2 * step:
        return until / 2
    return step


def first_zero(value: float, rate: float, curvature: float) -> float:
    """Time until ``value + rate t + curvature t^2/2`` falls to 0 from above, s; inf if it does not.

    `value` must be positive.
    """
    if abs(curvature) * value < 1e-12 * rate * rate or curvature == 0:
        return -value / rate if rate < 0 else inf
    discriminant = rate * rate - 2 * curvature * value
    if discriminant < 0:
        return inf
    root = sqrt(discriminant)
    # The smaller positive root, in the form that does not cancel.
    if rate < 0:
        return 2 * value / (-rate + root)
    return (rate + root) / -curvature if curvature < 0 else inf
