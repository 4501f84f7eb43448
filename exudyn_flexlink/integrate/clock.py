"""Times that are one: a clock that reads 3000 s goes on by 5e-13 s at least."""

from __future__ import annotations

CLOCK = 1e-15  # of the time: 4 to 9 times what it is rounded to


def instant(t: float, least: float) -> float:
    """How near (s) times are that count as one at t (s): `least`, or what the clock tells apart."""
    return max(least, CLOCK * abs(t))
