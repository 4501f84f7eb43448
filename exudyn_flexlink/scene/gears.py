"""Gears, racks and belts: joints whose angles or lengths tie each other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, Strict, model_validator

from exudyn_flexlink.quantities import Number, PositiveLength
from exudyn_flexlink.scene.base import GROUND, Flag, Part, Refers, listed, refuse, split_point

Teeth = Annotated[int, Strict(), Field(ge=1)]
GEARED = Refers("joints", "a revolute or prismatic joint", ("revolute", "prismatic"))
GearedName = Annotated[str, Strict(), GEARED]
Two = Annotated[tuple[GearedName, GearedName], listed("joint", "joint")]


class GearJoint(Part):
    """Two gears in mesh, or a pinion and a rack: the joints that hold them tie each other.

    Angles and lengths count from the arm that carries both, a body or the ground: the one that both
    joints share, or that is hinged at the places of both. Gears turn against each other, with
    `internal` alike. A rack goes along its axis as the pinion turns counter-clockwise.
    """

    one_of = (("ratio", "teeth", "radius"),)
    bodies: ClassVar[tuple[str, ...]] = ()  # its joints hold them
    type: Literal["gear"] = "gear"
    joints: Two = Field(description="the joints that hold both, [first, second], on one arm")
    ratio: Annotated[float, Number(above=0.0)] | None = Field(
        None, description="turns of the first for one of the second; or 'teeth'"
    )
    teeth: Annotated[tuple[Teeth, Teeth], listed("of the first", "of the second")] | None = Field(
        None, description="of the first and the second; or 'ratio'"
    )
    radius: PositiveLength | None = Field(
        None, description="of the pinion's pitch circle, where one joint is a rack's slide"
    )
    internal: Flag = Field(
        False, description="one gear is a ring around the other: they turn alike"
    )

    @model_validator(mode="after")
    def _a_rack_lies_on_one_side(self) -> GearJoint:
        if self.radius is not None and self.internal:
            refuse("a rack has no inside", "turn its 'axis' round to reverse it", at="internal")
        return self

    @property
    def turns(self) -> float:
        """Turns of the first for one of the second; 1 of a rack."""
        return self.teeth[1] / self.teeth[0] if self.teeth else self.ratio or 1.0

    def weights(self, geared: tuple[Any, Any]) -> tuple[float, float]:
        """Return w of the joints, seen from the arm: ``w_1 c_1 + w_2 c_2`` stays as it starts."""
        if self.radius is not None:
            first, second = (-self.radius if j.type == "revolute" else 1.0 for j in geared)
            return first, second
        return 1.0, -self.turns if self.internal else self.turns


class BeltJoint(Part):
    """A belt or a chain around two wheels, which turn alike; it neither slips nor stretches."""

    bodies: ClassVar[tuple[str, ...]] = ()  # its joints hold them
    type: Literal["belt"] = "belt"
    joints: Two = Field(description="the joints that hold both wheels, [first, second], on one arm")
    radii: Annotated[tuple[PositiveLength, PositiveLength], listed("length", "length")] = Field(
        description="of the first wheel and the second, to the middle of the belt"
    )

    def weights(self, _geared: tuple[Any, Any]) -> tuple[float, float]:
        """Return w of the joints, seen from the arm: ``w_1 c_1 + w_2 c_2`` stays as it starts."""
        return self.radii[0], -self.radii[1]


Gear = GearJoint | BeltJoint
Joints = Mapping[str, Any]


@dataclass(frozen=True)
class Mesh:
    """How a joint holds a gear: the gear's body, and the hinges between it and the arm.

    `hinges` are names from the gear on; the gear's own joint is `joint`.
    """

    joint: str
    body: str
    hinges: tuple[str, ...]


def ends_of(joint: Any) -> tuple[str, str]:
    """Names of the two bodies of a joint of two points, the ground's among them."""
    first, second = (split_point(point)[0] for point in joint.points)
    return first, second


def meshes_of(joints: Joints, gear: Gear) -> tuple[str, tuple[Mesh, Mesh]]:
    """Return the arm of a gear of a scene that is checked, and how both joints hold theirs."""
    (arm,) = arms_of(joints, gear)
    first, second = (_mesh(joints, name, arm) for name in gear.joints)
    return arm, (first, second)


def arms_of(joints: Joints, gear: Gear) -> list[str]:
    """Bodies that could carry both gears: those that both joints share; else see `concentric`."""
    own = [ends_of(joints[name]) for name in gear.joints]
    shared = [body for body in own[0] if body in own[1]]
    if shared:
        return shared
    near = [
        {body for hinge in concentric(joints, name) for body in ends_of(joints[hinge])}
        for name in gear.joints
    ]
    return sorted(near[0] & near[1])


def concentric(joints: Joints, name: str) -> list[str]:
    """Name of a joint, and of hinges without clearance at the same place as a hinge."""
    at = _places(joints[name])
    return [
        name,
        *(
            other
            for other, own in joints.items()
            if other != name and own is not None and at & _places(own) and own.clearance == 0
        ),
    ]


def _places(joint: Any) -> set[Any]:
    """Points of bodies, or places of the ground, at which a hinge sits."""
    if joint.type != "revolute":
        return set()
    return {joint.at if point == GROUND else point for point in joint.points}


def _mesh(joints: Joints, name: str, arm: str) -> Mesh:
    ends = ends_of(joints[name])
    if arm in ends:
        return Mesh(name, ends[1] if ends[0] == arm else ends[0], (name,))
    body = ends[0] if ends[1] == GROUND else ends[1]
    hinge = next(other for other in concentric(joints, name) if arm in ends_of(joints[other]))
    return Mesh(name, body, (hinge,) if body in ends_of(joints[hinge]) else (name, hinge))
