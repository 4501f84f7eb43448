"""What a sleeve's clearance asks of an engine's accuracy; what is said of walls that give way."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from exudyn_flexlink.mechanism import Channel

SOFT = 0.1  # of the clearance: where walls give way more, their stiffness takes over
# Of the clearance: what positions may err for the link to touch where it does. Of the 64 touches of
# models/hard/micron_clearance.yaml, walls of 1e8 N/m, 63 are found; 40 clearances found 31.
RESOLVED = 0.1
BROKEN_WALL_ADVICE = "raise the stiffness of the sleeve's law, or run slower"
COARSE_WALL_ADVICE = f"shorten the step; else {BROKEN_WALL_ADVICE}"


def resolving(tolerance: float, channels: Sequence[Channel]) -> float:
    """Return the tolerance, or a tenth of the smallest clearance where that is less, m."""
    return min([tolerance, *(RESOLVED * c.clearance for c in channels if c.clearance > 0)])


def made_finer(tolerance: float, finer: float, channels: Sequence[Channel]) -> str:
    """Say that steps were those of a `finer` tolerance than that asked for, m."""
    least = min((c for c in channels if c.clearance > 0), key=lambda c: c.clearance)
    return (
        f"the tolerance of {tolerance:.3g} m is no small part of the clearance of '{least.name}', "
        f"{least.clearance:.3g} m: to touch its walls where it does, steps were those of "
        f"{finer:.3g} m"
    )


def soft_walls(walls: Iterable[tuple[Channel, float]]) -> list[str]:
    """Warn of channels whose largest penetration (m) is no small part of their clearance."""
    return [
        f"the walls of '{channel.name}' give way by {depth:.3g} m, {depth / channel.clearance:.2g} "
        "of the clearance: their stiffness, not the clearance, decides there; raise the stiffness"
        for channel, depth in walls
        if depth > SOFT * channel.clearance > 0
    ]


def broken_wall(channel: Channel) -> str:
    """Why a run stopped."""
    return f"the link broke through a wall of '{channel.name}'"
