"""What can touch in a sleeve with clearance: nodes of the link and walls, mouth corners and rods.

A channel's contacts, numbered by `pairs`, for n rods, hence n + 1 nodes:

- node i (0 .. n) on the upper wall and on the lower wall: 2 i, 2 i + 1;
- rod i (0 .. n - 1) on the corners of the guide's start, upper and lower, then of its end:
  2 (n + 1) + 4 i + 0 .. 3.

A channel without clearance has one contact where that with clearance has two: node i on the axis
(number i), rod i on the middle of the start and of the end (n + 1 + 2 i + 0 .. 1).
"""

from __future__ import annotations

from exudyn_flexlink.mechanism.contact_pairs import Channel, FaceContact
from exudyn_flexlink.mechanism.parts import Anchor

UPPER, LOWER = 1.0, -1.0
_WALLS = {UPPER: "upper wall", LOWER: "lower wall", 0.0: "axis"}
_CORNERS = {UPPER: "upper corner", LOWER: "lower corner", 0.0: "middle"}


def pairs(channel: Channel) -> tuple[FaceContact, ...]:
    """All pairs of a channel that can touch, as contacts of a point with a face."""
    sides = _sides(channel)
    nodes = range(len(channel.nodes))
    mouths = (("start", 0.0), ("end", channel.length))
    return (
        *(_on_wall(channel, node, side) for node in nodes for side in sides),
        *(
            _on_corner(channel, rod, mouth, x, side)
            for rod in range(len(channel.rods))
            for mouth, x in mouths
            for side in sides
        ),
    )


def pair_sides(channel: Channel) -> tuple[float, ...]:
    """Side of the link on which each pair touches it: +1 upper, -1 lower, 0 held on the axis."""
    return _sides(channel) * (len(channel.nodes) + 2 * len(channel.rods))


def _sides(channel: Channel) -> tuple[float, ...]:
    return (UPPER, LOWER) if channel.clearance > 0 else (0.0,)


def _at(channel: Channel, x: float, side: float) -> Anchor:
    guide = channel.guide
    return Anchor(guide.part, guide.x + x, guide.y + side * channel.clearance)


def _on_wall(channel: Channel, node: int, side: float) -> FaceContact:
    # The free side of the upper wall is to the right of its direction, along the guide.
    return FaceContact(
        f"{channel.name}: node {node + 1} on {_WALLS[side]}",
        channel.nodes[node],
        _at(channel, 0.0, side),
        _at(channel, channel.length, side),
        -side,
        channel.law,
        channel.friction,
    )


def _on_corner(channel: Channel, rod: int, mouth: str, x: float, side: float) -> FaceContact:
    part = channel.rods[rod]
    return FaceContact(
        f"{channel.name}: rod {rod + 1} on {_CORNERS[side]} of the {mouth}",
        _at(channel, x, side),
        Anchor(part, 0.0, 0.0),
        Anchor(part, channel.lengths[rod], 0.0),
        side,
        channel.law,
        channel.friction,
    )


def deepest_allowed(channel: Channel) -> float:
    """Penetration (m) beyond which the link has broken through the wall rather than pressed on it.

    The clearance, or a hundredth of the guide's length where that is more: a link that deep is held
    by nothing that a penalty law means.
    """
    return max(channel.clearance, 0.01 * channel.length)
