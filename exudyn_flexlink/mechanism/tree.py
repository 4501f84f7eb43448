"""A mechanism as a tree of links: one coordinate for each joint, instead of three for each part.

Pins and slides that form no loop span the tree, from the ground outwards; a part that nothing holds
hangs on two slides and a hinge without mass. What is left of the constraints fixes coordinates:
a speed motor that of its hinge, a slot that of the slide which carries its point.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from exudyn_flexlink.mechanism.model import (
    GROUND,
    Anchor,
    Mechanism,
    Motor,
    Pin,
    Slide,
    Slot,
)

HINGE, ALONG_X, ALONG_Y = "hinge", "along x", "along y"
ROOT = -1


class NoTreeError(ValueError):
    """A mechanism is no tree; `path` names the part of the scene at fault."""

    def __init__(self, path: tuple[str, ...], message: str) -> None:
        super().__init__(f"{'.'.join(path)}: {message}")
        self.path = path
        self.message = message


@dataclass(frozen=True)
class Link:
    """One joint and what it carries.

    `parent` is a link (ROOT: the ground), `offset` (m) the joint's place in the parent's axes; the
    link's own frame stands at `origin` (m) of the part that it carries, None if it carries none.
    """

    parent: int
    kind: str
    offset: tuple[float, float]
    part: int | None
    origin: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class GuidedSlot:
    """A slot whose point rides on a slide: the turning link, the sliding link, and their offsets.

    The point is at ``pivot + R(angle) (ahead + s, aside)``, s being the slide's coordinate; `pivot`
    (m) is where the guide is hinged to the ground.
    """

    slot: Slot
    turning: int
    sliding: int
    pivot: tuple[float, float]
    ahead: float
    aside: float


@dataclass
class TreeLayout:
    """Links in order, parents first, and which coordinates are not free."""

    links: list[Link] = field(default_factory=list)
    of_part: dict[int, int] = field(default_factory=dict)
    motors: dict[int, tuple[Motor, float]] = field(default_factory=dict)  # by link, with its sign
    slots: list[GuidedSlot] = field(default_factory=list)
    pins: dict[str, tuple[int, bool]] = field(default_factory=dict)  # link; pin.second is on it

    @property
    def free(self) -> list[int]:
        """Coordinates that neither a motor nor a slot fixes."""
        fixed = {*self.motors, *(slot.sliding for slot in self.slots)}
        return [i for i in range(len(self.links)) if i not in fixed]

    def path(self, link: int) -> list[int]:
        """Links from the ground to this one, which is the last."""
        found: list[int] = []
        while link != ROOT:
            found.append(link)
            link = self.links[link].parent
        return found[::-1]


def tree_layout(mechanism: Mechanism) -> TreeLayout:
    """Find the tree of a mechanism.

    Raises:
        NoTreeError: joints form a loop, or there is something that a tree can't have.

    """
    _refuse(mechanism)
    layout = TreeLayout()
    # Slides first: what motors and slots fix then comes before what is free.
    joints: list[Pin | Slide] = [*mechanism.slides, *mechanism.pins]
    while len(layout.of_part) < len(mechanism.parts):
        joint = next((j for j in joints if _can_hang(j, layout)), None)
        if joint is None:
            _add_free_part(layout, next(i for i in range(len(mechanism.parts))
                                        if i not in layout.of_part))  # fmt: skip
        else:
            _hang(joint, layout)
            joints.remove(joint)
    if joints:
        raise NoTreeError(
            ("joints", joints[0].name),
            "closes a loop of joints, which a tree can't have; formulation 'joints' can",
        )
    for motor in mechanism.speed_motors:
        _fix_motor(layout, motor)
    for slot in mechanism.slots:
        layout.slots.append(_guided(layout, slot))
    for spring in mechanism.springs:
        _require_hinge(layout, ("springs", spring.name), spring.first, spring.second)
    for motor in mechanism.torque_motors:
        _require_hinge(layout, ("drives", motor.name), motor.first, motor.second)
    return layout


def _require_hinge(layout: TreeLayout, path: tuple[str, ...], first: int, second: int) -> None:
    if hinge_between(layout, first, second) is None:
        raise NoTreeError(path, "does not act on a hinge of the tree")


def is_tree(mechanism: Mechanism) -> bool:
    """Tell whether `tree_layout` can represent a mechanism."""
    try:
        tree_layout(mechanism)
    except NoTreeError:
        return False
    return True


def _refuse(mechanism: Mechanism) -> None:
    for weld in mechanism.welds:
        raise NoTreeError(("joints", weld.name), "a tree has no welded joints")
    for channel in mechanism.channels:
        raise NoTreeError(("joints", channel.name), "a tree has no walls; formulation 'joints' has")


def _ends(joint: Pin | Slide) -> tuple[Anchor, Anchor]:
    return (joint.first, joint.second) if isinstance(joint, Pin) else (joint.guide, joint.rod)


def _can_hang(joint: Pin | Slide, layout: TreeLayout) -> bool:
    """Tell whether one end of a joint hangs in the tree and the other does not yet."""
    first, second = (a.part == GROUND or a.part in layout.of_part for a in _ends(joint))
    return first != second and (first or isinstance(joint, Pin))


def _hang(joint: Pin | Slide, layout: TreeLayout) -> None:
    first, second = _ends(joint)
    turned = first.part != GROUND and first.part not in layout.of_part
    near, far = (second, first) if turned else (first, second)
    kind = HINGE if isinstance(joint, Pin) else ALONG_X
    parent, offset = ROOT, (near.x, near.y)
    if near.part != GROUND:
        parent = layout.of_part[near.part]
        origin = layout.links[parent].origin
        offset = (near.x - origin[0], near.y - origin[1])
    layout.of_part[far.part] = len(layout.links)
    if isinstance(joint, Pin):
        layout.pins[joint.name] = (len(layout.links), not turned)
    layout.links.append(Link(parent, kind, offset, far.part, (far.x, far.y)))


def _add_free_part(layout: TreeLayout, part: int) -> None:
    count = len(layout.links)
    layout.links += [
        Link(ROOT, ALONG_X, (0.0, 0.0), None),
        Link(count, ALONG_Y, (0.0, 0.0), None),
        Link(count + 1, HINGE, (0.0, 0.0), part),
    ]
    layout.of_part[part] = count + 2


def hinge_between(layout: TreeLayout, first: int, second: int) -> tuple[int, float] | None:
    """Link whose coordinate is the angle of part `second` relative to `first`, with its sign.

    None if the two are not next to each other on a hinge.
    """
    for near, far, sign in ((first, second, 1.0), (second, first, -1.0)):
        if far == GROUND:
            continue
        link = layout.of_part[far]
        parent = ROOT if near == GROUND else layout.of_part[near]
        if layout.links[link].kind == HINGE and layout.links[link].parent == parent:
            return link, sign
    return None


def _fix_motor(layout: TreeLayout, motor: Motor) -> None:
    found = hinge_between(layout, motor.first, motor.second)
    if found is None or found[0] in layout.motors:
        raise NoTreeError(("drives", motor.name), "does not turn a hinge of a tree of its own")
    layout.motors[found[0]] = (motor, found[1])


def _guided(layout: TreeLayout, slot: Slot) -> GuidedSlot:
    """Recognise the point as one on a rod that slides in a guide hinged to the ground."""
    trouble = NoTreeError(
        ("joints", slot.name),
        "in a tree the point of a slot must be on a rod that slides in a guide hinged to the "
        "ground; formulation 'joints' knows every slot",
    )
    sliding = layout.of_part[slot.anchor.part]
    link = layout.links[sliding]
    if link.kind != ALONG_X or link.parent == ROOT or link.part is None:
        raise trouble
    guide = layout.links[link.parent]
    taken = [other.sliding for other in layout.slots]
    if guide.kind != HINGE or guide.parent != ROOT or sliding in taken:
        raise trouble
    return GuidedSlot(
        slot,
        link.parent,
        sliding,
        guide.offset,
        link.offset[0] + slot.anchor.x - link.origin[0],
        link.offset[1] + slot.anchor.y - link.origin[1],
    )
