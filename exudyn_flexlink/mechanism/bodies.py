"""The parts of every body, hinges within flexible ones, and named points as anchors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, hypot, sqrt

from exudyn_flexlink.chain import Beam, Chain, Hinge, discretise
from exudyn_flexlink.mechanism.model import LinearSpring, Pin, RotarySpring, Slide
from exudyn_flexlink.mechanism.parts import GROUND, Anchor, RigidPart
from exudyn_flexlink.scene import (
    FlexibleBody,
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


def station(lengths: Sequence[float], place: float) -> tuple[int, float, float]:
    """Rod at a distance (m) from the start, of rods of these lengths, and the place in its axes.

    On a hinge, but for rounding, that is the rod before it.
    """
    rod = 0
    while rod < len(lengths) - 1 and place > lengths[rod] * (1 + 1e-9):
        place -= lengths[rod]
        rod += 1
    return rod, min(place, lengths[rod]), 0.0


@dataclass(frozen=True)
class _Body:
    """Parts of a body, and its named points as anchors."""

    first: int
    last: int
    points: dict[str, tuple[int, float, float]]  # part (index from the body's first), x, y


class Bodies:
    """All parts, in the order of the scene's bodies, and what holds those of one body together."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.parts: list[RigidPart] = []
        self.pins: list[Pin] = []
        self.slides: list[Slide] = []
        self.springs: list[RotarySpring] = []
        self.linear_springs: list[LinearSpring] = []
        self._bodies = {name: self._add_body(name) for name in scene.bodies}

    def first_part(self, body: str) -> int:
        """Index of the first part of a body."""
        return self._bodies[body].first

    def anchor(self, point: str, at: tuple[float, float] | None = None) -> Anchor:
        """Anchor of 'body.point', or of the place `at` for 'ground'."""
        body, name = split_point(point)
        if body not in self._bodies:
            x, y = at if at is not None else (0.0, 0.0)
            return Anchor(GROUND, x, y)
        part, x, y = self._bodies[body].points[name]
        return Anchor(self._bodies[body].first + part, x, y)

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

    def _add_body(self, name: str) -> _Body:
        body = self.scene.bodies[name]
        first = len(self.parts)
        if isinstance(body, FlexibleBody):
            points = self._add_chain(name, body)
        elif isinstance(body, RodBody):
            points = self._add_rod(name, body)
        else:
            points = self._add_rigid(name, body)
        return _Body(first, len(self.parts) - 1, points)

    def _add_chain(self, name: str, body: FlexibleBody) -> dict[str, tuple[int, float, float]]:
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
        lengths = [rod.length for rod in rods]
        stations = {key: station(lengths, place) for key, place in body.points.items()}
        last = len(rods) - 1
        return {"start": (0, 0.0, 0.0), "end": (last, lengths[last], 0.0), **stations}

    def _add_hinge(self, label: str, before: Anchor, after: Anchor, hinge: Hinge) -> None:
        self.pins.append(Pin(label, before, after))
        ends = before.part, after.part
        self.springs.append(RotarySpring(label, *ends, hinge.stiffness, hinge.damping, 0.0))

    def _add_stretch(self, label: str, before: Anchor, after: Anchor, stiffness: float) -> None:
        """Let one half of a rod slide on the other, under its axial stiffness (N/m)."""
        self.slides.append(Slide(label, before, after))
        self.linear_springs.append(LinearSpring(label, before, after, stiffness, 0.0, 0.0, True))

    def _add_rod(self, name: str, body: RodBody) -> dict[str, tuple[int, float, float]]:
        rod, half = beam_of(self.scene, body).rod(body.length), body.length / 2
        end = ((body.length, 0.0),)
        self.parts.append(RigidPart(name, name, rod.mass, rod.inertia, (half, 0.0), end))
        return {
            "start": (0, 0.0, 0.0),
            "end": (0, body.length, 0.0),
            "centre": (0, half, 0.0),
            **{key: (0, place, 0.0) for key, place in body.points.items()},
        }

    def _add_rigid(self, name: str, body: RigidBody) -> dict[str, tuple[int, float, float]]:
        x, y = body.centre_of_mass
        points = {"centre": (0, x, y)} | {key: (0, *at) for key, at in body.points.items()}
        apart = [(px, py) for _, px, py in points.values() if px or py]
        if not apart:
            # A body that refers to its own origin only still has a size, to weigh its angle by.
            size = max((body.inertia / body.mass) ** 0.5, (body.mass / STEEL) ** (1 / 3))
            apart = [(size, 0.0)]
        # A point mass that nothing turns stays as it is, whatever its inertia: its size gives one.
        # Where others turn with it, its own must not count.
        alone = stays_a_point(Parts.of(dict(self.scene)), name, body)
        reach = max(hypot(*at) for at in apart)
        least = body.mass * ((1.0 if alone else POINT) * reach) ** 2
        inertia = body.inertia or least
        self.parts.append(RigidPart(name, name, body.mass, inertia, (x, y), tuple(apart)))
        return points
