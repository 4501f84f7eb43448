"""What errors of speeds become: a lever that swings slowly, or coasts, makes angles of them."""

from __future__ import annotations

from exudyn_flexlink.integrate.radau import ErrorTimes
from exudyn_flexlink.mechanism import Mechanism, swings

SHORTEST_SWING = 4e-3  # s, 1/omega at 40 Hz: lower limit
FREE = 0.25  # of the swing of a lever at 40 Hz: errors of speeds count so long out of contact


def error_times(mechanism: Mechanism, end: float) -> ErrorTimes:
    """Times that turn errors of speeds into errors of places, in a run to `end` (s)."""
    longest = max(swings(mechanism), default=0.0)
    tau = max(SHORTEST_SWING, min(longest, end))
    return ErrorTimes(tau, tau - (1 - FREE) * SHORTEST_SWING)
