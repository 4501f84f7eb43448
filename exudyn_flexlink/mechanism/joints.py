"""Joints, and what may touch: pairs of shapes, also those of joints with play.

An anchor is a point of a part in the part's axes, or a point of the ground. Contacts are a point
and a face or a curve, two circles, joints at a stop, a link and its guide, and the points of a
rope. All is plain numbers, in SI.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import hypot, inf

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.curves import Closest, Curve, Farthest, curves_of_laps, reach
from exudyn_flexlink.laws import Friction, Penalty, PressingLaw
from exudyn_flexlink.mechanism.prescribed import Prescribed

GROUND = -1  # in place of a part, or of a link of the tree
NO_ITEM = -1  # stands for the number of a joint, or of another item, that does not exist


@dataclass(frozen=True)
class Anchor:
    """A point of a part in its own axes, or of the ground (part = GROUND), in m."""

    part: int
    x: float
    y: float


MOST_ANCHORS = 16  # along a curve: between them a body moves much as it does there
UPPER, LOWER = 1.0, -1.0
LEFT, RIGHT = 1.0, -1.0
_SLOT_WALLS = {LEFT: "left", RIGHT: "right"}
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

    @property
    def feature(self) -> float:
        """Smallest radius (m) of what the place of the first part can't cross."""
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
    def feature(self) -> float:
        """Distance (m) of the centres at which they touch."""
        return self.distance

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
    right. A `radius` (m) is that of a roller around the anchor. What can't be crossed may be a wall
    that runs beside the curve, by the `offset` (m) behind it.
    """

    name: str
    point: Anchor
    curve: Curve
    carrier: int
    side: float
    radius: float
    law: PressingLaw
    friction: Friction | None = None
    offset: float = 0.0

    @property
    def distance(self) -> float:
        """How far (m) the anchor is from the curve as it touches, on the free side."""
        return self.radius - self.offset

    @cached_property
    def search(self) -> Closest:
        """Finds the place of the curve that is nearest to a point."""
        return Closest(self.curve)

    @cached_property
    def feature(self) -> float:
        """Smallest radius (m) of the line on which the roller's centre is as it touches."""
        return reach(self.curve, self.side, self.distance)

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

    @cached_property
    def search(self) -> Farthest:
        """Finds the place of the curve that is nearest to the face."""
        return Farthest(self.curve)

    @cached_property
    def farthest(self) -> float:
        """How far (m) the curve reaches from the origin of its axes."""
        return float(np.hypot(*self.curve.samples[1].T).max())

    @cached_property
    def feature(self) -> float:
        """As if the place went past a circle whose gap bends as much.

        By the curve's support function h the gap is s - h(angle): h' is at most the farthest place,
        and h'' at most that and the largest radius.
        """
        largest = float((1 / np.abs(self.curve.curvature(self.curve.samples[0]))).max())
        return 4 * self.farthest**2 / (largest + self.farthest)

    @property
    def width(self) -> float:
        """Length between both anchors, m."""
        return hypot(self.end.x - self.start.x, self.end.y - self.start.y)

    @property
    def anchors(self) -> Anchors:
        """Anchors of both parts between which the contact may push: some along the curve."""
        return (self.start, self.end), _along(self.curve, self.carrier)


SHORTEST_PIECE = 1e-6  # of a rope's length: the direction of a shorter piece is not known


@dataclass(frozen=True)
class RopeContact(_Pair):
    """A rope over several anchors, with one tension. Its length is that of all pieces together.

    Its gap is its `free_length` (m, by time) less its length; its depth is its stretch.
    """

    name: str
    over: tuple[Anchor, ...]
    free_length: Prescribed
    law: PressingLaw
    friction: None = None

    @cached_property
    def pieces(self) -> tuple[CircleContact, ...]:
        """The pieces: each is a rope of length 0, which pulls its two ends together."""
        return tuple(
            CircleContact(self.name, second, first, (0.0, 0.0), True, self.law)
            for first, second in pairwise(self.over)
        )

    @property
    def shortest(self) -> float:
        """Length (m) of a piece at which a run ends."""
        return SHORTEST_PIECE * self.free_length.at(0.0)

    @property
    def point(self) -> Anchor:
        """The last anchor that is on a body."""
        return next(anchor for anchor in reversed(self.over) if anchor.part != GROUND)

    @property
    def weights(self) -> FloatArray:
        """How many pieces pull at each anchor."""
        return np.array([1.0, *[2.0] * (len(self.over) - 2), 1.0])

    @property
    def anchors(self) -> Anchors:
        """The last anchor as the first part of the contact, all others as the second."""
        return (self.over[-1],), self.over[-2::-1]


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

    @cached_property
    def contacts(self) -> tuple[FaceContact, ...]:
        """All pairs that can touch, as contacts of a point with a face.

        They are numbered, for n rods, hence n + 1 nodes:

        - node i (0 .. n) on the upper wall and on the lower wall: 2 i, 2 i + 1;
        - rod i (0 .. n - 1) on the corners of the guide's start, upper and lower, then of its end:
          2 (n + 1) + 4 i + 0 .. 3.

        Without clearance there is one contact where there are two with clearance: node i on the
        axis (number i), rod i on the middle of the start and of the end (n + 1 + 2 i + 0 .. 1).
        """
        mouths, walls = (("start", 0.0), ("end", self.length)), self._walls
        return (
            *(self._on_wall(node, side) for node in range(len(self.nodes)) for side in walls),
            *(
                self._on_corner(rod, mouth, x, side)
                for rod in range(len(self.rods))
                for mouth, x in mouths
                for side in walls
            ),
        )

    @property
    def sides(self) -> tuple[float, ...]:
        """Side of the link on which each pair touches it: +1 upper, -1 lower, 0 on the axis."""
        return self._walls * (len(self.nodes) + 2 * len(self.rods))

    @property
    def _walls(self) -> tuple[float, ...]:
        return (UPPER, LOWER) if self.clearance > 0 else (0.0,)

    def _at(self, x: float, side: float) -> Anchor:
        guide = self.guide
        return Anchor(guide.part, guide.x + x, guide.y + side * self.clearance)

    def _on_wall(self, node: int, side: float) -> FaceContact:
        # The free side of the upper wall is to the right of its direction, along the guide.
        return FaceContact(
            f"{self.name}: node {node + 1} on {_WALLS[side]}",
            self.nodes[node],
            self._at(0.0, side),
            self._at(self.length, side),
            -side,
            self.law,
            self.friction,
        )

    def _on_corner(self, rod: int, mouth: str, x: float, side: float) -> FaceContact:
        part = self.rods[rod]
        return FaceContact(
            f"{self.name}: rod {rod + 1} on {_CORNERS[side]} of the {mouth}",
            self._at(x, side),
            Anchor(part, 0.0, 0.0),
            Anchor(part, self.lengths[rod], 0.0),
            side,
            self.law,
            self.friction,
        )

    @property
    def anchors(self) -> Anchors:
        """Anchors of link and guide between which a wall may push."""
        guide = self.guide
        return self.nodes, (guide, Anchor(guide.part, guide.x + self.length, guide.y))


def deepest_allowed(channel: Channel) -> float:
    """Penetration (m) beyond which the link has broken through the wall rather than pressed on it.

    The clearance, or a hundredth of the guide's length where that is more: a link that deep is held
    by nothing that a penalty law means.
    """
    return max(channel.clearance, 0.01 * channel.length)


@dataclass(frozen=True)
class Pin:
    """Revolute joint: two anchors coincide."""

    name: str
    first: Anchor
    second: Anchor


@dataclass(frozen=True)
class Weld:
    """Two anchors coincide and the second part is turned by `angle` (rad) against the first."""

    name: str
    first: Anchor
    second: Anchor
    angle: float


@dataclass(frozen=True)
class Slide:
    """Prismatic joint, or ideal sleeve: the second anchor lies on a line through the first.

    The line has the angle `direction` (rad) in the first part's axes, and the second part is turned
    by `angle` (rad) against the first. In a sleeve both are 0: a rod lies on its guide's x-axis.
    """

    name: str
    first: Anchor
    second: Anchor
    direction: float = 0.0
    angle: float = 0.0


@dataclass(frozen=True)
class Slot:
    """An anchor runs along a curve in the axes of the part `carrier`, GROUND: fixed."""

    name: str
    anchor: Anchor
    curve: Curve
    carrier: int = GROUND


@dataclass(frozen=True)
class Groove:
    """A slot with play: its anchor is the middle of a pin between two walls along the curve.

    It stays within the `clearance` (m) of the curve on each side; the walls are at the pin's
    `radius` (m) and that. Of a curve with laps each lap has walls of its own; `lap` is the one in
    which the pin starts. `slot` is the same without play.
    """

    slot: Slot
    clearance: float
    radius: float
    law: PressingLaw
    friction: Friction | None
    lap: int = 1

    @property
    def name(self) -> str:
        """Name of the joint."""
        return self.slot.name

    @cached_property
    def curves(self) -> tuple[Curve, ...]:
        """Curves of the laps, in turn."""
        return curves_of_laps(self.slot.curve)

    @cached_property
    def contacts(self) -> tuple[CurveContact, ...]:
        """Left wall and right wall, of each of the curves."""
        walls = []
        for number in range(len(self.curves)):
            walls += [self._wall(number, LEFT), self._wall(number, RIGHT)]
        return tuple(walls)

    @property
    def sides(self) -> tuple[float, ...]:
        """Side of the curve on which each wall is: +1 left, -1 right."""
        return (LEFT, RIGHT) * len(self.curves)

    def walls(self, lap: int) -> range:
        """Numbers of the walls of a lap among its contacts."""
        first = 2 * ((abs(lap) - 1) % len(self.curves))
        return range(first, first + 2)

    def _wall(self, number: int, side: float) -> CurveContact:
        name = f"{self.name}: {_SLOT_WALLS[side]} wall"
        if len(self.curves) > 1:
            name += f" of curve {number + 1}"
        slot, half = self.slot, self.radius + self.clearance
        curve, laws = self.curves[number], (self.law, self.friction)
        return CurveContact(
            name, slot.anchor, curve, slot.carrier, -side, self.radius, *laws, offset=half
        )


@dataclass(frozen=True)
class Geared:
    """One side of a gear: the angle of `far` against `near`, on the arm, or a slide's length."""

    near: Anchor
    far: Anchor
    slide: Slide | None
    hinges: tuple[tuple[str, bool], ...]  # to the arm; whether the second part is the gear's side

    @property
    def parts(self) -> tuple[int, int]:
        """First and second part of the angle, or of the slide."""
        first, second = (self.near, self.far)[:: int(self.side)]
        return first.part, second.part

    @property
    def side(self) -> float:
        """-1 where the length of a slide counts from the gear, else 1."""
        return -1.0 if self.slide is not None and self.slide.first == self.far else 1.0


@dataclass(frozen=True)
class Gear:
    """Gears in mesh, a rack or a belt: ``w_1 c_1 + w_2 c_2`` is constant.

    The c are angles (rad) or lengths (m); the weights w are in m if pitch circles have `radii` (m).
    It `meshes` if teeth push; a belt has none. `beyond` is -1 if the first gear is inside the
    second, else 1. `start` is the value of the sum, 0 if only its changes count.
    """

    name: str
    ties: tuple[Geared, Geared]
    weights: tuple[float, float]
    radii: tuple[float | None, float | None] = (None, None)
    meshes: bool = True
    beyond: float = 1.0
    start: float = 0.0

    @property
    def in_newtons(self) -> bool:
        """Whether the multiplier of the gear is a force, N; otherwise it is a torque, N m."""
        return any(self.radii) or self.ties[0].slide is not None


@dataclass(frozen=True)
class SumStop(_Pair):
    """A stop of a hinge, or of a gear with play: a sum of angles and lengths has a `bound`.

    The terms have `weights`. The sum, its gap and its depth have the unit of the last of the
    `ties`: rad, or m of a slide. Accordingly the law's force is a torque (N m) or a force (N).
    `way` is +1 if the sum may be greater than the bound, -1 if it may be smaller; whole turns
    count. The bound of a flank of a `gear` counts from the start of the run.
    """

    name: str
    ties: tuple[Geared, ...]
    weights: tuple[float, ...]
    bound: float
    way: float
    law: PressingLaw
    gear: Gear | None = None
    friction: None = None

    @property
    def terms(self) -> list[tuple[Geared, float]]:
        """Ties with their weights."""
        return list(zip(self.ties, self.weights, strict=True))

    @property
    def turns(self) -> bool:
        """Whether the sum is an angle."""
        return self.ties[-1].slide is None

    @property
    def point(self) -> Anchor:
        """Anchor of the last hinge, or of the last slide."""
        return self.ties[-1].far

    @property
    def anchors(self) -> Anchors:
        """Anchors of both parts at the hinge; of a gear those of both wheels."""
        return (self.point,), (self.ties[0].near if self.gear is None else self.ties[0].far,)

    def tooth_force(self, press: FloatArray) -> FloatArray:
        """Multiplier (n,) of the gear, see `Gear`, by the force that presses (n,): N m, or N."""
        assert self.gear is not None  # flanks have a gear
        return np.asarray(self.way * self.weights[-1] / self.gear.weights[-1] * press)


Contact = FaceContact | CircleContact | CurveContact | FlatContact | SumStop | RopeContact


@dataclass(frozen=True)
class JointFriction:
    """Dry friction in a joint: it brakes with a bound while the joint slides, and holds up to it.

    The bound is `constant` (N m; N along a slide) plus `share` times the force in the joint. Of a
    pin the share is its coefficient times its radius (m), of a slide its coefficient, and the force
    is that across the line. Where friction is regularised, `slip_speed` (rad/s or m/s) is the speed
    at which it acts almost in full. A freewheel turns only in the direction `one_way`, 1 forward or
    -1 backward, and holds without bound against the other; 0 is no freewheel.
    """

    name: str
    joint: Pin | Slide
    constant: float
    share: float
    slip_speed: float
    one_way: int = 0

    def regularised(self, speed: FloatArray) -> FloatArray:
        """Torque or force (...) by the constant part of the bound, regularised, at speeds (...)."""
        return np.asarray(-self.constant * np.tanh(speed / self.slip_speed))
