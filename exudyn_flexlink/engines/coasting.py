"""What errors of speeds become: a lever that swings slowly, or coasts, makes angles of them."""

from __future__ import annotations

from exudyn_flexlink.mechanism import Mechanism, swings

SHORTEST_SWING = 4e-3  # s, 1/omega at 40 Hz: lower limit
# Of the run, for a guide without a speed drive: for so long it keeps what the solver leaves.
DRIFT_SHARE = 0.1


def coasting(mechanism: Mechanism, end: float) -> float:
    """Time (s) that turns errors of speeds into errors of places, in a run to `end` (s)."""
    longest = max((swing.time for swing in swings(mechanism).values()), default=0.0)
    return max(SHORTEST_SWING, min(longest, end))


def keeping(mechanism: Mechanism, end: float) -> float:
    """Time (s) for which a guide keeps errors of its speed: 0 where a drive sets it, else the run.

    What the solver leaves of its equations at every step counts so long. Errors of the step itself
    need not: its order makes those of the slow guide far smaller than estimated.
    """
    return DRIFT_SHARE * end if mechanism.slots and not mechanism.speed_motors else 0.0
