"""Scene to mechanism: bodies become rigid parts, names become indices."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, pi
from weakref import finalize

from exudyn_flexlink import sections
from exudyn_flexlink.chain import Beam, Chain, discretise
from exudyn_flexlink.curves import Curve
from exudyn_flexlink.laws import Friction, Impulse, RestitutionPenalty
from exudyn_flexlink.mechanism.model import (
    GROUND,
    Anchor,
    Channel,
    FaceContact,
    Mechanism,
    Motor,
    Pin,
    RigidPart,
    RotarySpring,
    Slide,
    Slot,
    Weld,
)
from exudyn_flexlink.mechanism.ramps import Ramp
from exudyn_flexlink.mechanism.tracks import build_curves
from exudyn_flexlink.scene import (
    ContactLaw,
    FlexibleBody,
    ImpulseLaw,
    PointOnLine,
    RevoluteJoint,
    RigidBody,
    RodBody,
    Scene,
    SleeveJoint,
    SlotJoint,
    SpeedDrive,
    TorqueDrive,
    TorsionalSpring,
    WeldJoint,
    split_point,
)
from exudyn_flexlink.source import SceneError

_BUILT: dict[int, Mechanism] = {}  # by the identity of a scene, as long as that lives


def build_mechanism(scene: Scene) -> Mechanism:
    """Turn a scene into rigid parts, joints, springs, drives and contacts.

    Once for each scene: both are frozen, and whoever looks at a result asks for it again.

    Raises:
        SceneError: a curve of the scene can't be.

    """
    key = id(scene)
    if key not in _BUILT:
        _BUILT[key] = _built(scene)
        finalize(scene, _BUILT.pop, key, None).atexit = False
    return _BUILT[key]


def _built(scene: Scene) -> Mechanism:
    curves, mistakes = build_curves(scene.curves)
    if mistakes:
        raise SceneError(scene.document, mistakes)
    return _Builder(scene, curves).build()


def chain_of(scene: Scene, name: str) -> Chain:
    """Rods and hinges of the flexible body `name`."""
    body = scene.bodies[name]
    if not isinstance(body, FlexibleBody):
        raise TypeError(f"'{name}' is not flexible")
    return discretise(
        beam_of(scene, name), body.rods, body.layout, body.hinges.stiffness, body.hinges.damping
    )


def beam_of(scene: Scene, name: str) -> Beam:
    """Length, mass per length and bending stiffness of the flexible body `name`."""
    body = scene.bodies[name]
    if not isinstance(body, FlexibleBody):
        raise TypeError(f"'{name}' is not flexible")
    material = scene.materials[body.material]
    section = sections.Section(body.section.area, body.section.second_moment)
    return Beam(
        body.length,
        sections.mass_per_length(material.density, section),
        sections.bending_stiffness(material.youngs_modulus, section),
        None if body.slender else section.thickness,
    )


@dataclass(frozen=True)
class _Body:
    """Parts of a body, and its named points as anchors."""

    first: int
    last: int
    points: dict[str, tuple[int, float, float]]  # part (index from the body's first), x, y


class _Builder:
    """Builds the parts first, since everything else refers to them."""

    def __init__(self, scene: Scene, curves: dict[str, Curve]) -> None:
        self.scene = scene
        self.curves = curves
        self.parts: list[RigidPart] = []
        self.hinge_pins: list[Pin] = []
        self.hinge_springs: list[RotarySpring] = []
        self.bodies = {name: self._add_body(name) for name in scene.bodies}

    def build(self) -> Mechanism:
        joints = self.scene.joints.items()
        drives = self.scene.drives.items()
        return Mechanism(
            parts=tuple(self.parts),
            pins=(
                *(self._pin(n, j) for n, j in joints if isinstance(j, RevoluteJoint)),
                *self.hinge_pins,
            ),
            welds=tuple(self._weld(n, j) for n, j in joints if isinstance(j, WeldJoint)),
            slides=tuple(
                self._slide(n, j)
                for n, j in joints
                if isinstance(j, SleeveJoint) and j.clearance == 0
            ),
            slots=tuple(
                Slot(n, self.anchor(j.point), self.curves[j.curve])
                for n, j in joints
                if isinstance(j, SlotJoint)
            ),
            springs=(
                *(self._spring(n, s) for n, s in self.scene.springs.items()),
                *self.hinge_springs,
            ),
            speed_motors=tuple(self._motor(n, d) for n, d in drives if isinstance(d, SpeedDrive)),
            torque_motors=tuple(self._motor(n, d) for n, d in drives if isinstance(d, TorqueDrive)),
            contacts=tuple(self._contact(n, c) for n, c in self.scene.contacts.items()),
            channels=tuple(
                self._channel(n, j, j.law)
                for n, j in joints
                if isinstance(j, SleeveJoint) and j.law is not None
            ),
            gravity=self.scene.gravity,
        )

    def anchor(self, point: str, at: tuple[float, float] | None = None) -> Anchor:
        """Anchor of 'body.point', or of the place `at` for 'ground'."""
        body, name = split_point(point)
        if body not in self.bodies:
            x, y = at if at is not None else (0.0, 0.0)
            return Anchor(GROUND, x, y)
        part, x, y = self.bodies[body].points[name]
        return Anchor(self.bodies[body].first + part, x, y)

    def _add_body(self, name: str) -> _Body:
        body = self.scene.bodies[name]
        first = len(self.parts)
        if isinstance(body, FlexibleBody):
            points = self._add_chain(name)
        elif isinstance(body, RodBody):
            points = self._add_rod(name, body)
        else:
            points = self._add_rigid(name, body)
        return _Body(first, len(self.parts) - 1, points)

    def _add_chain(self, name: str) -> dict[str, tuple[int, float, float]]:
        chain = chain_of(self.scene, name)
        first = len(self.parts)
        for i, rod in enumerate(chain.rods, start=1):
            centre = (rod.length / 2, 0.0)
            label = f"{name} {i}"
            self.parts.append(RigidPart(label, name, rod.mass, rod.inertia, centre, rod.length))
        for i, hinge in enumerate(chain.hinges):
            before, after = first + i, first + i + 1
            label = f"{name} hinge {i + 1}"
            end = Anchor(before, chain.rods[i].length, 0.0)
            self.hinge_pins.append(Pin(label, end, Anchor(after, 0.0, 0.0)))
            self.hinge_springs.append(
                RotarySpring(label, before, after, hinge.stiffness, hinge.damping, 0.0)
            )
        last = len(chain.rods) - 1
        return {"start": (0, 0.0, 0.0), "end": (last, chain.rods[last].length, 0.0)}

    def _add_rod(self, name: str, body: RodBody) -> dict[str, tuple[int, float, float]]:
        section = sections.Section(body.section.area, body.section.second_moment)
        density = self.scene.materials[body.material].density
        mass = sections.rod_mass(density, section, body.length)
        thickness = None if body.slender else section.thickness
        inertia = sections.rod_inertia(mass, body.length, thickness)
        half = body.length / 2
        self.parts.append(RigidPart(name, name, mass, inertia, (half, 0.0), body.length))
        return {
            "start": (0, 0.0, 0.0),
            "end": (0, body.length, 0.0),
            "centre": (0, half, 0.0),
        }

    def _add_rigid(self, name: str, body: RigidBody) -> dict[str, tuple[int, float, float]]:
        x, y = body.centre_of_mass
        points = {"centre": (0, x, y)} | {key: (0, *at) for key, at in body.points.items()}
        reach = max(hypot(px, py) for _, px, py in points.values())
        # A body that refers to its own origin only still has a size: its radius of gyration.
        reach = reach or (body.inertia / body.mass) ** 0.5
        self.parts.append(RigidPart(name, name, body.mass, body.inertia, (x, y), reach))
        return points

    def _pin(self, name: str, joint: RevoluteJoint) -> Pin:
        first, second = (self.anchor(point, joint.at) for point in joint.points)
        return Pin(name, first, second)

    def _weld(self, name: str, joint: WeldJoint) -> Weld:
        first, second = (self.anchor(point, joint.at) for point in joint.points)
        return Weld(name, first, second, joint.angle)

    def _slide(self, name: str, joint: SleeveJoint) -> Slide:
        return Slide(name, self.anchor(f"{joint.guide}.start"), self.anchor(f"{joint.link}.start"))

    def _channel(self, name: str, joint: SleeveJoint, law: ContactLaw) -> Channel:
        start, end = self.anchor(f"{joint.guide}.start"), self.anchor(f"{joint.guide}.end")
        body = self.scene.bodies[joint.link]
        first = self.bodies[joint.link].first
        if isinstance(body, FlexibleBody):
            lengths = tuple(rod.length for rod in chain_of(self.scene, joint.link).rods)
        else:
            lengths = (self.anchor(f"{joint.link}.end").x,)
        rods = tuple(range(first, first + len(lengths)))
        return Channel(
            name,
            start,
            end.x - start.x,
            joint.clearance,
            rods,
            lengths,
            _penalty(law),
            _friction(law),
        )

    def _joint_parts(self, joint: str) -> tuple[int, int]:
        """Parts that a revolute joint of the scene connects, first and second."""
        found = self.scene.joints[joint]
        assert isinstance(found, RevoluteJoint)  # the scene's names are checked
        first, second = (self.anchor(point, found.at).part for point in found.points)
        return first, second

    def _spring(self, name: str, spring: TorsionalSpring) -> RotarySpring:
        first, second = self._joint_parts(spring.joint)
        stiffness, damping = spring.stiffness or 0.0, spring.damping or 0.0
        if spring.frequency is not None or spring.damping_ratio is not None:
            inertia = self._inertia_about_joint(spring.joint)
            if spring.frequency is not None:
                stiffness = inertia * (2 * pi * spring.frequency) ** 2
            if spring.damping_ratio is not None:
                damping = 2 * spring.damping_ratio * (stiffness * inertia) ** 0.5
        return RotarySpring(name, first, second, stiffness, damping, spring.rest_angle)

    def _inertia_about_joint(self, joint: str) -> float:
        found = self.scene.joints[joint]
        assert isinstance(found, RevoluteJoint)
        anchors = [self.anchor(point, found.at) for point in found.points]
        anchor = next(anchor for anchor in anchors if anchor.part != GROUND)
        part = self.parts[anchor.part]
        arm = hypot(anchor.x - part.centre[0], anchor.y - part.centre[1])
        return part.inertia + part.mass * arm**2

    def _motor(self, name: str, drive: SpeedDrive | TorqueDrive) -> Motor:
        first, second = self._joint_parts(drive.joint)
        return Motor(name, first, second, Ramp(drive.value, drive.ramp))

    def _contact(self, name: str, contact: PointOnLine) -> FaceContact:
        start, end = (self.anchor(point) for point in contact.line)
        return FaceContact(
            name,
            self.anchor(contact.point),
            start,
            end,
            1.0 if contact.side == "left" else -1.0,
            _law(contact.law),
            _friction(contact.law),
        )


def _law(law: ContactLaw | ImpulseLaw) -> RestitutionPenalty | Impulse:
    return Impulse(law.restitution) if isinstance(law, ImpulseLaw) else _penalty(law)


def _penalty(law: ContactLaw) -> RestitutionPenalty:
    return RestitutionPenalty(law.stiffness, law.restitution, law.transition_speed)


def _friction(law: ContactLaw | ImpulseLaw) -> Friction | None:
    if isinstance(law, ImpulseLaw) or law.friction == 0:
        return None
    return Friction(law.friction, law.slip_speed)
