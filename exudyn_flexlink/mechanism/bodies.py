"""The parts of every body, hinges within flexible ones, and named points as anchors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import atan2, hypot, isclose, sqrt

from exudyn_flexlink.chain import Beam, Chain, Hinge, discretise
from exudyn_flexlink.mechanism.model import LinearSpring, Pin, RotarySpring, Slide
from exudyn_flexlink.mechanism.parts import GROUND, Anchor, RigidPart
from exudyn_flexlink.scene import GROUND as GROUND_NAME
from exudyn_flexlink.scene import (
    FlexibleBody,
    LineOnCurve,
    PointOnLine,
    PointsJoint,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    RodBody,
    Scene,
    SleeveJoint,
    split_point,
    stays_a_point,
)
from exudyn_flexlink.scene.lookup import Parts
from exudyn_flexlink.source import Mistake

POINT = 1e-6  # of its reach: radius of gyration of a point mass, since equations need some inertia
STEEL = 7850.0  # kg/m^3: density of a body without any extent of its own


def chain_of(scene: Scene, body: FlexibleBody) -> Chain:
    """Rods and hinges of a flexible body."""
    return discretise(
        beam_of(scene, body), body.rods, body.layout, body.hinges.stiffness, body.hinges.damping
    )


def beam_of(scene: Scene, body: FlexibleBody | RodBody) -> Beam:
    """Length, mass per length, bending stiffness and thickness of a uniform body.

    Of whatever section, the thickness is that of the rectangle with its second moment and area.
    """
    material, section = scene.materials[body.material], body.section
    return Beam(
        body.length,
        material.density * section.area,
        material.youngs_modulus * section.second_moment,
        0.0 if body.slender else sqrt(12 * section.second_moment / section.area),
    )


def _station(lengths: Sequence[float], place: float) -> tuple[int, float]:
    """Rod at a distance (m) from the start, of rods of these lengths, and the place along it.

    On a hinge, but for rounding, that is the rod before it.
    """
    rod = 0
    while rod < len(lengths) - 1 and place > lengths[rod] * (1 + 1e-9):
        place -= lengths[rod]
        rod += 1
    return rod, min(place, lengths[rod])


class Bodies:
    """All parts, in the order of the scene's bodies, and what holds those of one body together."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.parts: list[RigidPart] = []
        self.pins: list[Pin] = []
        self.slides: list[Slide] = []
        self.springs: list[RotarySpring] = []
        self.linear_springs: list[LinearSpring] = []
        self.mistakes: list[Mistake] = []
        self.points: dict[str, Anchor] = {}  # by 'body.point'
        self._first: dict[str, int] = {}
        for name in scene.bodies:
            self._first[name] = len(self.parts)
            own = self._add_body(name)
            self.points |= {f"{name}.{point}": anchor for point, anchor in own.items()}

    def first_part(self, body: str) -> int:
        """Index of the first part of a body."""
        return self._first[body]

    def anchor(self, point: str, at: tuple[float, float] | None = None) -> Anchor:
        """Anchor of 'body.point', or of the place `at` for 'ground'."""
        if point == GROUND_NAME:
            return Anchor(GROUND, *(at or (0.0, 0.0)))
        return self.points[point]

    def _on_one_rod(self, one: Anchor, other: Anchor) -> tuple[Anchor, Anchor]:
        """Two points of a body, as points of one of its rods where a hinge lets them be."""
        for pin in self.pins:
            parts = pin.first.part, pin.second.part
            if (one.part, other.part) == parts and isclose(one.x, pin.first.x):
                return pin.second, other
            if (other.part, one.part) == parts and isclose(other.x, pin.first.x):
                return one, pin.second
        return one, other

    def face(self, contact: PointOnLine | LineOnCurve) -> tuple[Anchor, Anchor]:
        """Both ends of a straight face, on one part if there is one that has both."""
        start, end = (self.anchor(point) for point in contact.line)
        return self._on_one_rod(start, end)

    def bent_faces(self) -> Iterator[Mistake]:
        """Refuse lines of contacts that are no straight faces: that bend, or have no length."""
        for name, contact in self.scene.contacts.items():
            if not isinstance(contact, PointOnLine | LineOnCurve):
                continue
            path = ("contacts", name, "line")
            start, end = self.face(contact)
            if start.part != end.part:
                body = split_point(contact.line[0])[0]
                own = range(self.first_part(body), min(start.part, end.part) + 1)
                place = sum(self.parts[part].reach for part in own)
                message = f"'{body}' gives way at {place:g} m, between the two points"
                hint = "a face is straight: take both on one side of that place"
                yield Mistake(path, message, hint)
            elif (start.x, start.y) == (end.x, end.y):
                yield Mistake(path, "both points are at one place: a line needs a length")

    def carrier(self, curve: str) -> int:
        """Index of the part that carries a curve, GROUND where none does."""
        on = self.scene.curves[curve].on
        return GROUND if on is None else self.first_part(on)

    def ends(self, joint: PointsJoint) -> tuple[Anchor, Anchor]:
        """First and second point of a joint of the scene."""
        first, second = (self.anchor(point, joint.at) for point in joint.points)
        return first, second

    def joint_parts(self, joint: str) -> tuple[int, int]:
        """Parts that a revolute joint of the scene connects, first and second."""
        found = self.scene.joints[joint]
        assert isinstance(found, RevoluteJoint)  # the scene's names are checked
        first, second = self.ends(found)
        return first.part, second.part

    def slide(self, joint: str) -> Slide:
        """Line and anchors of a prismatic joint, or of a sleeve, of the scene."""
        found = self.scene.joints[joint]
        if isinstance(found, SleeveJoint):
            ends = (self.anchor(f"{found.guide}.start"), self.anchor(f"{found.link}.start"))
            return Slide(joint, *ends)
        assert isinstance(found, PrismaticJoint)  # the scene's names are checked
        x, y = found.axis
        return Slide(joint, *self.ends(found), atan2(y, x), found.angle)

    def _add_body(self, name: str) -> dict[str, Anchor]:
        """Add the parts of a body; return its named points."""
        body = self.scene.bodies[name]
        if isinstance(body, FlexibleBody):
            return self._add_chain(name, body)
        if isinstance(body, RodBody):
            return self._add_rod(name, body)
        return self._add_rigid(name, body)

    def _add_chain(self, name: str, body: FlexibleBody) -> dict[str, Anchor]:
        chain, beam = chain_of(self.scene, body), beam_of(self.scene, body)
        first, rods = len(self.parts), chain.rods
        if body.stretch:  # each rod gives way between its halves
            rods = tuple(beam.rod(rod.length / 2) for rod in rods for _ in range(2))
        for i, rod in enumerate(rods, start=1):
            centre, end = (rod.length / 2, 0.0), ((rod.length, 0.0),)
            label = f"{name} {i}"
            self.parts.append(RigidPart(label, name, rod.mass, rod.inertia, centre, end))
        axial = self.scene.materials[body.material].youngs_modulus * body.section.area
        count = len(rods) // len(chain.rods)  # parts of each rod
        for i, rod in enumerate(rods[:-1]):
            before, after = Anchor(first + i, rod.length, 0.0), Anchor(first + i + 1, 0.0, 0.0)
            k = i // count
            if (i + 1) % count:
                label = f"{name} stretch {k + 1}"
                self._add_stretch(label, before, after, axial / chain.rods[k].length)
            else:
                self._add_hinge(f"{name} hinge {k + 1}", before, after, chain.hinges[k])
        lengths, last = [rod.length for rod in rods], first + len(rods) - 1
        points = {"start": Anchor(first, 0.0, 0.0), "end": Anchor(last, lengths[-1], 0.0)}
        for key, along in body.points.items():
            part, place = _station(lengths, along)
            points[key] = Anchor(first + part, place, 0.0)
        return points

    def _add_hinge(self, label: str, before: Anchor, after: Anchor, hinge: Hinge) -> None:
        self.pins.append(Pin(label, before, after))
        ends = before.part, after.part
        self.springs.append(RotarySpring(label, *ends, hinge.stiffness, hinge.damping, 0.0))

    def _add_stretch(self, label: str, before: Anchor, after: Anchor, stiffness: float) -> None:
        """Let one half of a rod slide on the other, under its axial stiffness (N/m)."""
        slide = Slide(label, before, after)
        self.slides.append(slide)
        self.linear_springs.append(LinearSpring(label, before, after, stiffness, 0.0, 0.0, slide))

    def _add_rod(self, name: str, body: RodBody) -> dict[str, Anchor]:
        rod, half = beam_of(self.scene, body).rod(body.length), body.length / 2
        end, places = ((body.length, 0.0),), {"start": 0.0, "end": body.length, "centre": half}
        places |= body.points
        points = {key: Anchor(len(self.parts), place, 0.0) for key, place in places.items()}
        self.parts.append(RigidPart(name, name, rod.mass, rod.inertia, (half, 0.0), end))
        return points

    def _add_rigid(self, name: str, body: RigidBody) -> dict[str, Anchor]:
        x, y = body.centre_of_mass
        places = {"centre": (x, y), **body.points}
        points = {key: Anchor(len(self.parts), *place) for key, place in places.items()}
        apart = [place for place in places.values() if any(place)]
        if not apart:
            # A body that refers to its own origin only still has a size, to weigh its angle by.
            size = max((body.inertia / body.mass) ** 0.5, (body.mass / STEEL) ** (1 / 3))
            apart = [(size, 0.0)]
        # A point mass that nothing turns stays as it is, whatever its inertia: its size gives one.
        # Where others turn with it, its own must not count.
        alone = stays_a_point(Parts(dict(self.scene)), name, body)
        reach = max(hypot(*at) for at in apart)
        least = body.mass * (POINT * reach) ** 2
        if 0 < body.inertia < least:  # beside a mass off its origin, rounding leaves nothing of it
            message = f"{body.inertia:g} kg m^2 is lost by rounding beside {body.mass:g} kg"
            hint = f"0 for a point mass, else at least {least:.2g} kg m^2"
            self.mistakes.append(Mistake(("bodies", name, "inertia"), message, hint))
        inertia = body.inertia or (body.mass * reach**2 if alone else least)
        self.parts.append(RigidPart(name, name, body.mass, inertia, (x, y), tuple(apart)))
        return points
