"""Steps that meet an event exactly: where a track's curvature jumps, a contact begins, a run ends.

Across a jump of the forces a second-order step is only first-order accurate, so the loop aims the
step before an event to end on it.
"""

from __future__ import annotations

from math import inf, sqrt

# An event nearer than this part of the last step is there: to meet it by a step of its own would
# fill the multipliers, which an index-3 step divides by its square, with rounding noise.
THERE = 1e-2


def land(step: float, until: float) -> float:
    """Shorten `step` (s) so that an event `until` seconds ahead is met by a whole step.

    An event between one and two steps ahead is met by two equal ones, not by a sliver.
    """
    if until <= step * (1 + THERE):
        return max(until, THERE * step)
    if until < 2 * step:
        return until / 2
    return step


def first_root(value: float, rate: float, curvature: float) -> float:
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
