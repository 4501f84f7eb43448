"""What both engines say of a sleeve's walls that give way."""

from __future__ import annotations

from collections.abc import Iterable

from exudyn_flexlink.mechanism import Channel

SOFT = 0.1  # of the clearance: where walls give way more, their stiffness takes over
BROKEN_WALL_ADVICE = "raise the stiffness of the sleeve's law, or run slower"


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
