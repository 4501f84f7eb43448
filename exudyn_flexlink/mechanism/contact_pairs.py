"""What can touch: a point and a face or a curve, two circles, a hinge and its stop, a guide."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import hypot, inf

from exudyn_flexlink.curves import Curve, Farthest
from exudyn_flexlink.laws import Friction, Penalty, PressingLaw
from exudyn_flexlink.mechanism.parts import Anchor

MOST_ANCHORS = 16  # along a curve: between them a body moves much as it does there
UPPER, LOWER = 1.0, -1.0
_WALLS = {UPPER: "upper wall", LOWER: "lower wall", 0.0: "axis"}
_CORNERS = {UPPER: "upper corner", LOWER: "lower corner", 0.0: "middle"}
Anchors = tuple[tuple[Anchor, ...], tuple[Anchor, ...]]


class _Pair:
    """What two parts strike with: anchors of each, and how long what is struck is."""

    @property
    def anchors(self) -> Anchors:
        """Anchors of the part that is pushed, and of that pushed back, where they may touch."""
        raise NotImplementedError

    @cached_property
    def parts(self) -> tuple[int, int]:
        """Part that the contact pushes, or turns, and the one that it pushes back."""
        pushed, back = self.anchors
        return pushed[0].part, back[0].part

    @property
    def length(self) -> float:
        """Length of what is struck, m; infinite if it has no ends."""
        return inf


@dataclass(frozen=True)
class FaceContact(_Pair):
    """An anchor that cannot cross the segment from `start` to `end` of another part.

    `side` is +1 if the free side is left of the direction from start to end, -1 if right, and 0 if
    neither is: the point is held on the line. What came behind the face beside its ends may pass;
    pairs of a `Channel` push it back. Nothing comes round one `across` the slide of its point.
    """

    name: str
    point: Anchor
    start: Anchor
    end: Anchor
    side: float
    law: PressingLaw
    friction: Friction | None = None
    across: bool = False

    @property
    def length(self) -> float:
        """Length of the face, m."""
        return hypot(self.end.x - self.start.x, self.end.y - self.start.y)

    @property
    def anchors(self) -> Anchors:
        """Anchors of both parts between which the contact may push."""
        return (self.point,), (self.start, self.end)


@dataclass(frozen=True)
class CircleContact(_Pair):
    """Two circles that cannot cross, the first outside or `inside` the second.

    By the anchors of their centres and their radii, m; one of 0 is a point. A journal in the
    bearing of a revolute joint with clearance is one, too: that is the difference of the radii.
    """

    name: str
    first: Anchor
    second: Anchor
    radii: tuple[float, float]
    inside: bool
    law: PressingLaw
    friction: Friction | None = None

    @property
    def distance(self) -> float:
        """Distance (m) of the centres at which the circles touch."""
        first, second = self.radii
        return second - first if self.inside else second + first

    @property
    def anchors(self) -> Anchors:
        """Anchors of both parts between which the contact may push."""
        return (self.first,), (self.second,)


def _along(curve: Curve, carrier: int) -> tuple[Anchor, ...]:
    points = curve.samples[1]
    some = points[:: max(1, len(points) // MOST_ANCHORS)].tolist()
    return tuple(Anchor(carrier, x, y) for x, y in some)


@dataclass(frozen=True)
class CurveContact(_Pair):
    """An anchor that cannot cross a curve in the axes of the part `carrier`, GROUND: fixed.

    `side` is +1 if the free side is left of the curve, in the direction of its parameter, -1 if
    right. A `radius` (m) is that of a roller around the anchor.
    """

    name: str
    point: Anchor
    curve: Curve
    carrier: int
    side: float
    radius: float
    law: PressingLaw
    friction: Friction | None = None

    @property
    def length(self) -> float:
        """Length of the curve, m; infinite if closed: it has no ends."""
        return inf if self.curve.closed else self.curve.arc_length.whole

    @property
    def anchors(self) -> Anchors:
        """Anchors of both parts between which the contact may push: some along the curve."""
        return (self.point,), _along(self.curve, self.carrier)


@dataclass(frozen=True)
class FlatContact(_Pair):
    """A straight face through two anchors that can't cross a convex curve of the part `carrier`.

    `side` is +1 if the curve is left of the direction from start to end, -1 if right. The face goes
    on straight beyond both.
    """

    name: str
    start: Anchor
    end: Anchor
    side: float
    curve: Curve
    carrier: int
    law: PressingLaw
    friction: Friction | None = None
    radius = 0.0

    @cached_property
    def search(self) -> Farthest:
        """Finds the place of the curve that is nearest to the face."""
        return Farthest(self.curve)

    @property
    def point(self) -> Anchor:
        """Where places on the face are counted from."""
        return self.start

    @property
    def width(self) -> float:
        """Length between both anchors, m."""
        return hypot(self.end.x - self.start.x, self.end.y - self.start.y)

    @property
    def anchors(self) -> Anchors:
        """Anchors of both parts between which the contact may push: some along the curve."""
        return (self.start, self.end), _along(self.curve, self.carrier)


@dataclass(frozen=True)
class TurnStop(_Pair):
    """A hinge that can't turn beyond the angle `bound` (rad): its gap is an angle, as is its depth.

    `way` is +1 if greater angles of the second part against the first are free, -1 if smaller ones
    are. The law's force is a torque (N m); whole turns count.
    """

    name: str
    first: Anchor
    second: Anchor
    bound: float
    way: float
    law: PressingLaw
    friction: None = None

    @property
    def point(self) -> Anchor:
        """Where the hinge is."""
        return self.second

    @property
    def anchors(self) -> Anchors:
        """Anchors of both parts, where the hinge is."""
        return (self.second,), (self.first,)


Contact = FaceContact | CircleContact | CurveContact | FlatContact | TurnStop


@dataclass(frozen=True)
class Channel:
    """A link's rods between the two walls of a guide, at ``y = +-clearance`` for 0 <= x <= length.

    x, y are the guide's axes at the anchor `guide`; `lengths` (m) are those of the `rods` (parts).
    A clearance of 0 holds the rods on the axis; then rod 1 is in a `Slide` as well.
    """

    name: str
    guide: Anchor
    length: float
    clearance: float
    rods: tuple[int, ...]
    lengths: tuple[float, ...]
    law: Penalty
    friction: Friction | None

    @cached_property
    def nodes(self) -> tuple[Anchor, ...]:
        """Starts of the rods, and the end of the last one."""
        starts = tuple(Anchor(rod, 0.0, 0.0) for rod in self.rods)
        return (*starts, Anchor(self.rods[-1], self.lengths[-1], 0.0))

    @property
    def anchors(self) -> Anchors:
        """Anchors of link and guide between which a wall may push."""
        guide = self.guide
        return self.nodes, (guide, Anchor(guide.part, guide.x + self.length, guide.y))


def pairs(channel: Channel) -> tuple[FaceContact, ...]:
    """All pairs of a channel that can touch, as contacts of a point with a face.

    They are numbered, for n rods, hence n + 1 nodes:

    - node i (0 .. n) on the upper wall and on the lower wall: 2 i, 2 i + 1;
    - rod i (0 .. n - 1) on the corners of the guide's start, upper and lower, then of its end:
      2 (n + 1) + 4 i + 0 .. 3.

    A channel without clearance has one contact where that with clearance has two: node i on the
    axis (number i), rod i on the middle of the start and of the end (n + 1 + 2 i + 0 .. 1).
    """
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
