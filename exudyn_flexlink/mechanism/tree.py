"""A mechanism as a spanning tree of links, and the closures of what the tree leaves over.

Parts that are welded together move as one group. Pins and slides span the tree of groups, from the
ground outwards, with one coordinate for each joint; a group that nothing holds hangs on two slides
and a hinge without mass. A speed motor fixes the coordinate of its hinge. What is left of the
joints closes loops: those constraints tie coordinates of the tree to one another.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism.constraints import Frame, frame_about, weld_groups
from exudyn_flexlink.mechanism.joints import GROUND, Anchor, Gear, Geared, Pin, Slide, Slot, Weld
from exudyn_flexlink.mechanism.model import Mechanism, Motor

HINGE, ALONG_X, ALONG_Y = "hinge", "along x", "along y"


@dataclass(frozen=True)
class Link:
    """A joint and the parts that it carries.

    `parent` is a link (GROUND: the ground), `offset` (m) the joint's place in the parent's axes and
    `turn` (rad) the angle of the joint's axes in these; `parts` are carried. A `held` link never
    moves: the force that holds it is that in the next joint, which is measured so.
    """

    parent: int
    kind: str
    offset: tuple[float, float]
    turn: float = 0.0
    parts: tuple[int, ...] = ()
    held: bool = False


@dataclass(frozen=True)
class GuidedSlot:
    """A slot whose point is on a sliding link in a turning link: both links, and offsets.

    The point is at ``pivot + R(angle) (ahead + s, aside)``, s being the slide's coordinate; `pivot`
    (m) is where the guide is hinged to the ground.
    """

    slot: Slot
    turning: int
    sliding: int
    pivot: tuple[float, float]
    ahead: float
    aside: float


@dataclass(frozen=True)
class Ride:
    """A slot whose point carries a group without other joints: its slides along x and y."""

    slot: Slot
    along: tuple[int, int]


Closure = Pin | Slide | Slot | Gear | Motor


@dataclass
class TreeLayout:
    """Links, parents first; fixed coordinates; and the closures of loops.

    `frames` are those of the parts' origins, by part. `joints` has the link of each joint of the
    tree, and 1 if its coordinate moves the second part against the first, else -1. If no other
    joint closes a loop, slots need no closures: in `slots` the point's place follows from the
    guide's angle; in `rides` the place on the curve is a coordinate and replaces two slides.
    """

    links: list[Link] = field(default_factory=list)
    frames: dict[int, Frame] = field(default_factory=dict)
    motors: dict[int, tuple[Motor, float]] = field(default_factory=dict)  # by link, with its sign
    slots: list[GuidedSlot] = field(default_factory=list)
    rides: list[Ride] = field(default_factory=list)
    closures: list[Closure] = field(default_factory=list)
    joints: dict[str, tuple[int, float]] = field(default_factory=dict)
    felt: dict[str, tuple[int, ...]] = field(default_factory=dict)  # links held before a joint

    @property
    def free(self) -> list[int]:
        """Coordinates of the tree that neither a motor nor a slot fixes."""
        fixed = {*self.known, *(slot.sliding for slot in self.slots)}
        fixed |= {link for ride in self.rides for link in ride.along}
        return [i for i in range(len(self.links)) if i not in fixed]

    @property
    def known(self) -> list[int]:
        """Coordinates that motors prescribe, and coordinates of held links."""
        return sorted({*self.motors, *(link for links in self.felt.values() for link in links)})

    def path(self, link: int) -> list[int]:
        """Links from the ground to a link, which is the last."""
        links: list[int] = []
        while link != GROUND:
            links.append(link)
            link = self.links[link].parent
        return links[::-1]

    def frame(self, part: int) -> Frame:
        """Frame of a part's origin, also of the ground's."""
        return Frame(GROUND) if part == GROUND else self.frames[part]

    def place(self, anchor: Anchor) -> tuple[int, float, float]:
        """Link of an anchor, and its place (m) in the link's axes."""
        frame = self.frame(anchor.part)
        return (frame.link, *frame.place(anchor.x, anchor.y))

    def turn(self, first: int, second: int) -> float:
        """Angle (rad) of part `second` against `first` if all coordinates are 0."""
        of_first, of_second = (
            frame.angle + sum(self.links[i].turn for i in self.path(frame.link))
            for frame in (self.frame(first), self.frame(second))
        )
        return of_second - of_first

    def turning_row(self, first: int, second: int) -> FloatArray:
        """Derivative (links,) of part `second`'s angle against `first` by the coordinates."""
        row = np.zeros(len(self.links))
        row[self.hinges(second)] += 1.0
        row[self.hinges(first)] -= 1.0
        return row

    def sliding_row(self, slide: Slide) -> FloatArray | None:
        """As `turning_row`, for the stroke of a slide; None if the slide closes a loop."""
        if slide.name not in self.joints:
            return None
        link, sign = self.joints[slide.name]
        return np.asarray(sign * np.eye(len(self.links))[link])

    def summed_row(self, ties: Iterable[Geared], weights: Iterable[float]) -> FloatArray:
        """As `turning_row`, for a sum of angles and of strokes of slides of the tree."""
        row = np.zeros(len(self.links))
        for tie, weight in zip(ties, weights, strict=True):
            moving = self.sliding_row(tie.slide) if tie.slide else self.turning_row(*tie.parts)
            assert moving is not None  # gears of other slides are refused
            row += weight * moving
        return row

    def hinges(self, part: int) -> list[int]:
        """Links whose angles add up to that of a part."""
        path = self.path(self.frame(part).link)
        return [i for i in path if self.links[i].kind == HINGE]


def tree_layout(mechanism: Mechanism) -> TreeLayout:
    """Find the spanning tree of a mechanism."""
    layout = _Spanning(mechanism).layout
    layout.closures += mechanism.gears
    for motor in mechanism.speed_motors:
        ends = motor.first, motor.second
        row = layout.sliding_row(motor.slide) if motor.slide else layout.turning_row(*ends)
        moved = [] if row is None else np.flatnonzero(row).tolist()
        if row is None or len(moved) != 1 or moved[0] in layout.motors:
            layout.closures.append(motor)
        else:
            layout.motors[moved[0]] = (motor, float(row[moved[0]]))
    _place_slots(layout, mechanism)
    return layout


# --- the spanning tree --------------------------------------------------------------------------


class _Spanning:
    """Hangs the groups of welded parts into the tree, joint by joint."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.layout = TreeLayout()
        self._groups = weld_groups(mechanism)
        self._frames = {part: frame for group in self._groups for part, frame in group.items()}
        self._felt = {friction.name for friction in mechanism.frictions if friction.share > 0}
        self._hung: dict[int, Frame] = {}  # frame of each group's axes, by its number
        self._number = {part: k for k, group in enumerate(self._groups) for part in group}
        self._hang(0, Frame(GROUND))  # the group of the ground
        # Slides come first: so coordinates that motors and slots fix precede free ones.
        joints: list[Pin | Slide] = [*mechanism.slides, *mechanism.pins]
        while len(self._hung) < len(self._groups):
            joint = next((j for j in joints if sum(self._ends_hung(j)) == 1), None)
            if joint is None:
                self._add_free(self._loose(mechanism))
            else:
                self._add(joint)
                joints.remove(joint)
        self.layout.closures += joints

    def _hang(self, group: int, axes: Frame) -> None:
        self._hung[group] = axes
        for part, joint in self._groups[group].items():
            if part != GROUND:
                x, y = axes.place(joint.x, joint.y)
                self.layout.frames[part] = Frame(axes.link, x, y, axes.angle + joint.angle)

    def _carried(self, group: int) -> tuple[int, ...]:
        return tuple(part for part in self._groups[group] if part != GROUND)

    def _ends_hung(self, joint: Pin | Slide) -> tuple[bool, bool]:
        first, second = joint.first, joint.second
        return self._number[first.part] in self._hung, self._number[second.part] in self._hung

    def _add(self, joint: Pin | Slide) -> None:
        """Hang that part of a joint which is not yet in the tree onto the other."""
        first, second = joint.first, joint.second
        turned = not self._ends_hung(joint)[0]
        near, far = (second, first) if turned else (first, second)
        parent, x, y = self.layout.place(near)
        carrier = self._frames[far.part]
        group = self._number[far.part]
        origin = carrier.place(far.x, far.y)
        if isinstance(joint, Pin):
            kind, turn, angle = HINGE, 0.0, 0.0
        else:
            # The slide's x-axis is the joint's line; its angles on the near part and on the far
            # part.
            along, back = joint.direction, joint.angle - joint.direction
            along, back = (-back, -along) if turned else (along, back)
            kind, turn = ALONG_X, self.layout.frame(near.part).angle + along
            angle = back - carrier.angle
        before = Link(parent, kind, (x, y), turn)
        if joint.name in self._felt:
            before = self._held(joint, before)
        link = len(self.layout.links)
        self.layout.joints[joint.name] = (link, -1.0 if turned else 1.0)
        self.layout.links.append(replace(before, kind=kind, parts=self._carried(group)))
        self._hang(group, frame_about(origin, link, angle))

    def _held(self, joint: Pin | Slide, before: Link) -> Link:
        """Add held slides, which measure the force in a joint; return the link after them."""
        first = len(self.layout.links)
        for kind in (ALONG_X, ALONG_Y) if isinstance(joint, Pin) else (ALONG_Y,):
            self.layout.links.append(replace(before, kind=kind, held=True))
            before = Link(len(self.layout.links) - 1, kind, (0.0, 0.0))
        self.layout.felt[joint.name] = tuple(range(first, len(self.layout.links)))
        return before

    def _loose(self, mechanism: Mechanism) -> tuple[int, tuple[float, float]]:
        """Return a group without joints to the tree, and the best origin for its coordinates."""
        for slot in mechanism.slots:
            group = self._number[slot.anchor.part]
            if group not in self._hung and slot.carrier == GROUND:
                return group, self._frames[slot.anchor.part].place(slot.anchor.x, slot.anchor.y)
        group = next(k for k in range(len(self._groups)) if k not in self._hung)
        return group, self._centre_of_mass(mechanism, group)

    def _centre_of_mass(self, mechanism: Mechanism, group: int) -> tuple[float, float]:
        """Centre of mass in the group's axes: rotation about it is independent of translation."""
        parts = [(mechanism.parts[part], self._frames[part]) for part in self._carried(group)]
        places = [(part.mass, frame.place(*part.centre)) for part, frame in parts]
        total = sum(mass for mass, _ in places)
        x = sum(mass * place[0] for mass, place in places) / total
        return x, sum(mass * place[1] for mass, place in places) / total

    def _add_free(self, loose: tuple[int, tuple[float, float]]) -> None:
        group, origin = loose
        count = len(self.layout.links)
        self.layout.links += [
            Link(GROUND, ALONG_X, (0.0, 0.0)),
            Link(count, ALONG_Y, (0.0, 0.0)),
            Link(count + 1, HINGE, (0.0, 0.0), 0.0, self._carried(group)),
        ]
        self._hang(group, frame_about(origin, count + 2, 0.0))


# --- slots --------------------------------------------------------------------------------------


def _place_slots(layout: TreeLayout, mechanism: Mechanism) -> None:
    """Sort slots into `slots` and `rides` if no joint closes a loop, else into `closures`."""
    if layout.closures or any(slot.carrier != GROUND for slot in mechanism.slots):
        layout.closures += mechanism.slots
        return
    taken: set[int] = set()
    for slot in mechanism.slots:
        guided, ride = _guided(layout, slot), _ride(layout, slot)
        links = {guided.sliding} if guided else set(ride.along) if ride else set()
        if not links or links & taken:
            layout.slots, layout.rides, layout.closures = [], [], list(mechanism.slots)
            return
        taken |= links
        layout.slots += [guided] if guided else []
        layout.rides += [ride] if ride and not guided else []


def _ride(layout: TreeLayout, slot: Slot) -> Ride | None:
    """The ride of a slot if its point is the origin of a free group, else None."""
    link, x, y = layout.place(slot.anchor)
    if link == GROUND or layout.links[link].kind != HINGE or (x, y) != (0.0, 0.0):
        return None
    across = layout.links[link].parent
    if across == GROUND or layout.links[across].kind != ALONG_Y or layout.links[across].held:
        return None
    return Ride(slot, (layout.links[across].parent, across))


def _guided(layout: TreeLayout, slot: Slot) -> GuidedSlot | None:
    """The guided slot of a point on a rod in a guide that is hinged to the ground, else None."""
    sliding, ahead, aside = layout.place(slot.anchor)
    if sliding == GROUND:
        return None
    link = layout.links[sliding]
    if link.kind != ALONG_X or link.parent == GROUND or link.turn != 0.0 or not link.parts:
        return None
    if sliding in layout.motors:
        return None
    guide = layout.links[link.parent]
    if guide.kind != HINGE or guide.parent != GROUND:
        return None
    return GuidedSlot(
        slot, link.parent, sliding, guide.offset, link.offset[0] + ahead, link.offset[1] + aside
    )


def hanging_on(
    mechanism: Mechanism, layout: TreeLayout, name: str
) -> tuple[list[int], float] | None:
    """Parts that a joint holds, seen from the ground, and a sign; None outside the tree.

    The sign is 1 if the joint's second point is on these parts, -1 if its first point is. Welds
    count as joints of the tree.
    """
    movable: tuple[Pin | Slide, ...] = (*mechanism.pins, *mechanism.slides)
    joints = [*mechanism.welds, *(joint for joint in movable if joint.name in layout.joints)]
    held = next((joint for joint in joints if joint.name == name), None)
    if held is None:
        return None
    others = [joint for joint in joints if joint is not held]
    beyond = _reached(held.second.part, others)
    if GROUND not in beyond:
        return sorted(beyond), 1.0
    return sorted(_reached(held.first.part, others)), -1.0


def _reached(part: int, joints: Sequence[Pin | Slide | Weld]) -> set[int]:
    """A part, and all parts that joints connect with it."""
    reached, more = {part}, {part}
    while more:
        ends = [{joint.first.part, joint.second.part} for joint in joints]
        more = set().union(*(pair for pair in ends if pair & reached)) - reached
        reached |= more
    return reached
