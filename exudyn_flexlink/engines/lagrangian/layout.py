"""Which scenes have hand-written equations, and the numbers of those that do.

One guide pinned to the ground, one link in its sleeve that starts in a slot, any number of levers
pinned to the ground. Whatever else a scene has is refused by name.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from types import UnionType

from exudyn_flexlink.engines import NotRepresentableError
from exudyn_flexlink.laws import Impulse
from exudyn_flexlink.mechanism import (
    GROUND,
    Anchor,
    Applied,
    Contact,
    FaceContact,
    Mechanism,
    Motor,
    Pin,
    Ramp,
    TorqueMotor,
)
from exudyn_flexlink.scene import (
    BeltJoint,
    FlexibleBody,
    GearJoint,
    PrismaticJoint,
    RevoluteJoint,
    Scene,
    SleeveJoint,
    SlotJoint,
    SpeedDrive,
    WeldJoint,
)

ON_AXIS = 1e-12  # m


@dataclass(frozen=True)
class Pivot:
    """A part hinged to the ground: its joint, the place on the ground, the hinge in its axes.

    `second` tells whether the part is the joint's second body.
    """

    joint: str
    part: int
    at: tuple[float, float]
    pin: tuple[float, float]
    second: bool


@dataclass(frozen=True)
class Layout:
    """Which parts are guide, link (its rods in order) and levers, what drives and what is struck.

    With `play` between link and guide rod 1 has an angle of its own, and so has P a place on its
    track, the last coordinate: `track_coordinate`. Without, the guide's angle determines both.
    """

    guide: Pivot
    rods: tuple[int, ...]
    levers: tuple[Pivot, ...]
    motor: Motor | None
    ramp: Ramp | None  # of that motor
    torques: tuple[tuple[TorqueMotor, Ramp], ...]
    play: bool
    faces: tuple[FaceContact, ...]

    @property
    def track_coordinate(self) -> int:
        """Coordinate that determines where P is."""
        return 1 + len(self.rods) + len(self.levers) if self.play else 0

    @property
    def way(self) -> float:
        """Which way the motor turns the guide: -1 where the guide is its joint's first part."""
        return -1.0 if self.motor is not None and self.motor.second == GROUND else 1.0

    @property
    def count(self) -> int:
        """Number of coordinates."""
        return len(self.rods) + len(self.levers) + (2 if self.play else 0)

    def coordinate(self, part: int) -> int:
        """Coordinate that is the angle of a part; -1 for the ground."""
        if part == GROUND:
            return -1
        if part == self.guide.part:
            return 0
        first = 1 if self.play else 0
        if part in self.rods:
            return first + self.rods.index(part)
        return first + len(self.rods) + [lever.part for lever in self.levers].index(part)


def layout_of(scene: Scene, mechanism: Mechanism) -> Layout:
    """Find guide, link and levers.

    Raises:
        NotRepresentableError: the scene has something else, or lacks one of them.

    """
    for path, lacks in _lacking(scene, mechanism):
        raise NotRepresentableError(path, f"the Lagrangian engine has {lacks}")
    pivots = {name: _pivot(mechanism, name) for name in _joints(scene, RevoluteJoint)}
    sleeve = _only(scene, SleeveJoint, "sleeve", "a link that slides in a guide")
    slot = _only(scene, SlotJoint, "slot", "a link whose start runs along a curve")
    needs = ("joints", slot), "the Lagrangian engine needs"
    if mechanism.slots[0].carrier != GROUND:
        raise NotRepresentableError(needs[0], f"{needs[1]} a track that stands still")
    joint = scene.joints[sleeve]
    assert isinstance(joint, SleeveJoint)
    rods = mechanism.bodies[joint.link]
    if mechanism.slots[0].anchor != Anchor(rods[0], 0.0, 0.0):
        raise NotRepresentableError(needs[0], f"{needs[1]} '{joint.link}.start' in the slot")
    guide = _guide(mechanism, joint.guide, sleeve, pivots)
    levers = _levers(mechanism, (guide.part, *rods), pivots, guide)
    motor = _motor(scene, mechanism, guide)
    ramp = None if motor is None else _ramp(motor.name, motor.speed)
    torques = tuple((own, _ramp(own.name, own.size.value)) for own in mechanism.torque_motors)
    faces = tuple(_face(contact, rods, levers) for contact in mechanism.contacts)
    return Layout(guide, rods, levers, motor, ramp, torques, mechanism.has_play, faces)


def _lacking(scene: Scene, mechanism: Mechanism) -> Iterator[tuple[tuple[str, ...], str]]:
    """Parts of a scene that no mechanism of this engine has, and what it lacks for them."""
    for bearing in mechanism.bearings:
        yield ("joints", bearing.name, "clearance"), "no journals in bearings"
    for stop in scene.stops.values():
        yield stop.path, "no stops of joints"
    for kind, lacks in (
        (WeldJoint, "no welds"),
        (GearJoint | BeltJoint, "no gears"),
        (PrismaticJoint, "no such joints"),
    ):
        for name in _joints(scene, kind):
            yield ("joints", name), lacks
    for friction in mechanism.frictions:
        yield ("joints", friction.name, "friction"), "no friction in joints"
    for name, body in scene.bodies.items():
        if isinstance(body, FlexibleBody) and body.stretch:
            yield ("bodies", name, "stretch"), "rods that do not stretch"
    for force in mechanism.forces:
        yield ("drives", force.name), "no forces at points"
    yield from _other_springs(scene, mechanism)


def _other_springs(scene: Scene, mechanism: Mechanism) -> Iterator[tuple[tuple[str, ...], str]]:
    """Springs that this engine does not know, and what it lacks for them."""
    for name in (*scene.ropes, *(spring.name for spring in mechanism.linear_springs)):
        yield ("springs", name), "torsional springs alone"
    for turning in (spring for spring in mechanism.springs if spring.law):
        yield ("springs", turning.name, "torque"), "springs of one stiffness"


def _joints(scene: Scene, kind: type | UnionType) -> list[str]:
    return [name for name, joint in scene.joints.items() if isinstance(joint, kind)]


def _only(scene: Scene, kind: type, word: str, meaning: str) -> str:
    names = _joints(scene, kind)
    if not names:
        message = f"the Lagrangian engine needs a {word} joint: {meaning}"
        raise NotRepresentableError(("joints",), message)
    for name in names[1:]:
        raise NotRepresentableError(("joints", name), f"a second {word}: the engine knows one")
    return names[0]


def _pivot(mechanism: Mechanism, name: str) -> Pivot:
    """Read a revolute joint as the hinge of a part on the ground."""
    joint: Pin = next(pin for pin in mechanism.pins if pin.name == name)
    ground, moving = joint.first, joint.second
    if joint.second.part == GROUND:
        ground, moving = moving, ground
    if ground.part != GROUND:
        message = "joins two moving bodies: the Lagrangian engine has pins to the ground"
        raise NotRepresentableError(("joints", name), message)
    second = moving is joint.second
    return Pivot(name, moving.part, (ground.x, ground.y), (moving.x, moving.y), second)


def _guide(mechanism: Mechanism, body: str, sleeve: str, pivots: dict[str, Pivot]) -> Pivot:
    parts = mechanism.bodies[body]
    if len(parts) > 1:
        raise NotRepresentableError(("bodies", body), "a guide must be rigid: rod or rigid")
    found = [pivot for pivot in pivots.values() if pivot.part == parts[0]]
    if not found:
        message = "a guide must turn about a point on the ground"
        raise NotRepresentableError(("bodies", body), message)
    guide = found[0]
    if mechanism.slides and abs(guide.pin[1] - mechanism.slides[0].first.y) > ON_AXIS:
        message = f"must lie on the axis of the sleeve '{sleeve}'"
        raise NotRepresentableError(("joints", guide.joint), message)
    return guide


def _levers(
    mechanism: Mechanism, taken: tuple[int, ...], pivots: dict[str, Pivot], guide: Pivot
) -> tuple[Pivot, ...]:
    levers: list[Pivot] = []
    used = {guide.part}
    for name, pivot in pivots.items():
        if pivot is guide:
            continue
        if pivot.part in used or pivot.part in taken:
            raise NotRepresentableError(("joints", name), "its body is held by another joint")
        used.add(pivot.part)
        levers.append(pivot)
    for index, part in enumerate(mechanism.parts):
        several = len(mechanism.bodies[part.body]) > 1
        if index not in taken and (several or index not in used):
            message = "neither guide nor link nor a rigid body on a pin"
            raise NotRepresentableError(("bodies", part.body), message)
    return tuple(levers)


def _ramp(drive: str, value: Applied) -> Ramp:
    if not isinstance(value, Ramp):
        message = "the Lagrangian engine has numbers, with a ramp, alone"
        raise NotRepresentableError(("drives", drive, "value"), message)
    return value


def _motor(scene: Scene, mechanism: Mechanism, guide: Pivot) -> Motor | None:
    """Motor that prescribes the guide's speed."""
    for k, motor in enumerate(mechanism.speed_motors):
        drive = scene.drives[motor.name]
        if k > 0 or not (isinstance(drive, SpeedDrive) and drive.joint == guide.joint):
            message = "only the speed of the guide can be prescribed, once"
            raise NotRepresentableError(("drives", motor.name), message)
    return next(iter(mechanism.speed_motors), None)


def _face(contact: Contact, rods: tuple[int, ...], levers: tuple[Pivot, ...]) -> FaceContact:
    """Read a contact as a point of the link and a face of a lever."""
    own = ("contacts", contact.name)
    if not isinstance(contact, FaceContact):
        raise NotRepresentableError(own, "the Lagrangian engine has points on lines alone")
    if contact.point.part not in rods or contact.point.y != 0.0:
        raise NotRepresentableError((*own, "point"), "must be a point of the link")
    if contact.start.part not in [lever.part for lever in levers]:
        raise NotRepresentableError((*own, "line"), "must be on a body pinned to the ground")
    if isinstance(contact.law, Impulse) and contact.friction is not None:
        message = "the Lagrangian engine has no friction in impacts"
        raise NotRepresentableError((*own, "law", "friction"), message)
    return contact
