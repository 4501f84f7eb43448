"""Joints between bodies; gears, racks and belts tie angles or lengths of other joints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field, Strict, field_validator, model_validator

from exudyn_flexlink import quantities as si
from exudyn_flexlink.quantities import Dimension, Number, PositiveLength
from exudyn_flexlink.rounding import NEGLIGIBLE
from exudyn_flexlink.scene.base import (
    GROUND,
    XY,
    BodyName,
    ByType,
    CurveName,
    Flag,
    MovingPointName,
    Part,
    Point,
    Refers,
    TwoPoints,
    listed,
    refuse,
    refuse_place,
    split_point,
)
from exudyn_flexlink.scene.contacts import (
    ContactLaw,
    FlankLaw,
    GivingLaw,
    HertzLaw,
    Law,
    PenaltyLaw,
    RubbingImpulse,
    SlideLimits,
    TurnLimits,
    refuse_misfit,
)

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
    backlash: Annotated[float, si.OfGear(Dimension.ANGLE, at_least=0.0)] = Field(
        0.0,
        description="whole play of the second joint, from flank to flank, while the first stands "
        "still: an angle, or a length of a slide; 0: none",
    )
    start: Annotated[float, si.OfGear(Dimension.ANGLE)] = Field(
        0.0, description="where the second joint is within the play at time 0, from the middle"
    )
    law: FlankLaw | None = Field(
        None, description="of both flanks, in units of the second joint; required with backlash"
    )

    @model_validator(mode="after")
    def _a_rack_lies_on_one_side(self) -> GearJoint:
        if self.radius is not None and self.internal:
            refuse("a rack has no inside", "turn its 'axis' round to reverse it", at="internal")
        return self

    @model_validator(mode="after")
    def _play_needs_a_law(self) -> GearJoint:
        if self.backlash > 0 and self.law is None:
            hint = "of teeth that strike, e.g. law: {type: impulse, restitution: 0.5}"
            refuse("'backlash' needs a 'law'", hint, at="backlash")
        return self

    @property
    def beyond(self) -> bool:
        """Whether the gear starts beyond a flank."""
        return abs(self.start) > self.backlash / 2 * (1 + NEGLIGIBLE)

    @property
    def turns(self) -> float:
        """Turns of the first gear for one turn of the second; 1 for a rack."""
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
    """Return the arm of a gear, and how each joint holds its gear. The scene must be checked."""
    (arm,) = arms_of(joints, gear)
    first, second = (_mesh(joints, name, arm) for name in gear.joints)
    return arm, (first, second)


def arms_of(joints: Joints, gear: Gear) -> list[str]:
    """Bodies that could carry both gears: bodies that both joints share; else see `concentric`."""
    ends = [ends_of(joints[name]) for name in gear.joints]
    shared = [body for body in ends[0] if body in ends[1]]
    if shared:
        return shared
    near = [
        {body for hinge in concentric(joints, name) for body in ends_of(joints[hinge])}
        for name in gear.joints
    ]
    return sorted(near[0] & near[1])


def concentric(joints: Joints, name: str) -> list[str]:
    """Names of a joint and, if it is a hinge, of hinges without clearance at the same place."""
    places = _places(joints[name])
    return [
        name,
        *(
            other
            for other, joint_spec in joints.items()
            if other != name
            and joint_spec is not None
            and places & _places(joint_spec)
            and joint_spec.clearance == 0
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


_EXAMPLE = "e.g. law: {stiffness: 1.0e5, restitution: 0.5}"


class PointsJoint(Part):
    """A joint of two points, which says where it sits if one of them is the ground."""

    points: TwoPoints = Field(description="two points 'body.point'; one may be 'ground'")
    at: Point | None = Field(None, description="where the joint sits on the ground, [x, y], metres")

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies it joins, the ground left out."""
        return tuple(split_point(text)[0] for text in self.points if text != GROUND)

    @model_validator(mode="after")
    def _sits_on_ground(self) -> PointsJoint:
        refuse_place("joint", self.points, self.at)
        return self


def _gives_way(what: str) -> BeforeValidator:
    """Refuse a law by impulse, in the words of the joint."""

    def check(law: Any) -> Any:
        if isinstance(law, Mapping) and law.get("type") == "impulse":
            refuse(f"{what} a penalty law", _EXAMPLE, at="type")
        return law

    return BeforeValidator(check)


def _gives_clearance(joint: Part) -> bool:
    """Tell whether the scene gives a clearance; 0 counts as given.

    A study may vary the clearance from 0 on; its other values need the law. A law without any
    clearance is a mistake: the user has forgotten the clearance.
    """
    return "clearance" in joint.model_fields_set


class PinFriction(Part):
    """Dry friction of a pin, by Coulomb: a torque, a coefficient, or both; it holds what rests."""

    torque: si.NonNegativeTorque = Field(0.0, description="that it brakes by, and holds up to")
    coefficient: Annotated[float, si.Number(at_least=0.0)] = Field(
        0.0, description="Coulomb's, by the force in the joint; needs a radius"
    )
    radius: si.PositiveLength | None = Field(
        None, description="of the pin, on which that force rubs"
    )
    slip_speed: si.PositiveAngularSpeed = Field(
        1e-3, description="in redundant coordinates alone: below it the joint creeps"
    )

    @property
    def acts(self) -> bool:
        """Whether there is any friction."""
        return self.torque > 0 or self.coefficient > 0

    @model_validator(mode="after")
    def _has_a_size(self) -> PinFriction:
        if not self.model_fields_set & {"torque", "coefficient"}:
            refuse("missing 'torque' or 'coefficient'", "e.g. friction: {torque: 0.2 N m}")
        if self.coefficient > 0 and self.radius is None:
            refuse("missing 'radius', that of the pin, on which the force in the joint rubs")
        if "coefficient" not in self.model_fields_set and self.radius is not None:
            refuse("a radius is for a 'coefficient'; a torque needs none", at="radius")
        return self


class SlideFriction(Part):
    """Dry friction of a slide, by Coulomb: a force, a coefficient, or both; it holds what rests."""

    force: si.NonNegativeForce = Field(0.0, description="that it brakes by, and holds up to")
    coefficient: Annotated[float, si.Number(at_least=0.0)] = Field(
        0.0, description="Coulomb's, by the force across the line"
    )
    slip_speed: si.PositiveSpeed = Field(
        1e-3, description="in redundant coordinates alone: below it the joint creeps"
    )

    @property
    def acts(self) -> bool:
        """Whether there is any friction."""
        return self.force > 0 or self.coefficient > 0

    @model_validator(mode="after")
    def _has_a_size(self) -> SlideFriction:
        if not self.model_fields_set & {"force", "coefficient"}:
            refuse("missing 'force' or 'coefficient'", "e.g. friction: {force: 5 N}")
        return self


class RevoluteJoint(PointsJoint):
    """Two points coincide, the bodies turn; positive: the second turns counter-clockwise.

    With clearance, the first point is the middle of a journal in a bearing around the second. At a
    clearance of 0 that the scene gives, its law does nothing: the two points coincide.
    """

    type: Literal["revolute"] = "revolute"
    clearance: si.NonNegativeLength = Field(
        0.0, description="radius of the bearing less that of the journal"
    )
    radius: si.PositiveLength | None = Field(
        None, description="of the journal: where friction acts; needed with friction alone"
    )
    law: Annotated[GivingLaw | None, _gives_way("a bearing needs")] = Field(
        None, description="force between journal and bearing; with clearance, idle if that is 0"
    )
    limits: TurnLimits | None = Field(None, description="stops at a least and a greatest angle")
    friction: PinFriction | None = Field(
        None, description="dry friction, without clearance; with it, that is the law's"
    )
    freewheel: Literal["forward", "backward"] | None = Field(
        None,
        description="direction in which the second body may turn relative to the first; forward: "
        "counter-clockwise; the other direction is locked; not with clearance",
    )

    @property
    def acting(self) -> PenaltyLaw | None:
        """The law, if anything can press."""
        return self.law if self.clearance > 0 else None

    @model_validator(mode="after")
    def _bearing_needs_a_law(self) -> RevoluteJoint:
        if self.clearance > 0 and self.friction is not None:
            hint = "give 'friction', a coefficient, under 'law'; or no clearance"
            refuse("a joint with clearance rubs by its law", hint, at="friction")
        if self.clearance > 0 and self.freewheel is not None:
            hint = "give the clearance to another joint of the shaft"
            refuse("a freewheel has no clearance", hint, at="freewheel")
        if self.clearance > 0 and self.law is None:
            refuse("missing 'law', the force between journal and bearing", _EXAMPLE)
        for key, lacking in (("law", "bearing to press on"), ("radius", "journal")):
            if not _gives_clearance(self) and getattr(self, key) is not None:
                message = f"a revolute joint without clearance has no {lacking}"
                hint = f"give a clearance, 0 for one that does nothing; else leave the {key} out"
                refuse(message, hint, at=key)
        if self.law is not None and self.law.friction > 0 and self.radius is None:
            refuse("missing 'radius', that of the journal, on which friction acts")
        by_materials = isinstance(self.law, HertzLaw) and self.law.materials
        if self.acting and by_materials and self.radius is None:
            refuse("missing 'radius', that of the journal, which Hertz's law needs")
        if self.acting and self.radius is not None:
            refuse_misfit(self.acting, (self.radius, -self.radius - self.clearance))
        return self


class WeldJoint(PointsJoint):
    """Two points coincide and the angle between the bodies is fixed."""

    type: Literal["weld"] = "weld"
    angle: si.Angle | None = Field(
        None, description="of the second body relative to the first; left out: 0"
    )


class PrismaticJoint(PointsJoint):
    """The second point slides on a straight line through the first; no body turns on the other."""

    type: Literal["prismatic"] = "prismatic"
    axis: Annotated[tuple[si.Ratio, si.Ratio], XY] = Field(
        description="direction [x, y] of the line, of any length, in the first body's axes; the "
        "ground's if that is 'ground'"
    )
    angle: si.Angle | None = Field(
        None, description="of the second body relative to the first; left out: 0"
    )
    limits: SlideLimits | None = Field(None, description="stops at a least and a greatest length")
    friction: SlideFriction | None = Field(None, description="dry friction")

    @field_validator("axis")
    @classmethod
    def _points_somewhere(cls, axis: tuple[float, float]) -> tuple[float, float]:
        if axis == (0.0, 0.0):
            refuse("has no direction", "e.g. [1, 0] along x, [0, 1] along y")
        return axis


class SlotJoint(Part):
    """A point of a body stays on a curve, which stands on the ground or moves with its body.

    With clearance, the point is the middle of a pin between two walls along the curve. At a
    clearance of 0 that the scene gives, its law does nothing: the point stays on the curve.
    """

    type: Literal["slot"] = "slot"
    point: MovingPointName = Field(description="point 'body.point' that stays on the curve")
    curve: CurveName = Field(description="name of a curve")
    clearance: si.NonNegativeLength = Field(
        0.0, description="how far the point may leave the curve, on each side: half the play"
    )
    radius: si.NonNegativeLength = Field(
        0.0, description="of the pin: where friction acts; the slot is as much wider"
    )
    law: Law | None = Field(
        None,
        description="force between pin and walls, or its impulse; with clearance, idle if that "
        "is 0",
    )

    @property
    def bodies(self) -> tuple[str, ...]:
        """Name of the body it holds."""
        return (split_point(self.point)[0],)

    @property
    def acting(self) -> PenaltyLaw | RubbingImpulse | None:
        """The law, if anything can press."""
        return self.law if self.clearance > 0 else None

    @model_validator(mode="after")
    def _walls_need_a_law(self) -> SlotJoint:
        if self.clearance > 0 and self.law is None:
            refuse("missing 'law', the force between pin and walls", _EXAMPLE)
        for key, lacking in (("law", "walls to press on"), ("radius", "pin")):
            if not _gives_clearance(self) and key in self.model_fields_set and getattr(self, key):
                message = f"a slot without clearance has no {lacking}"
                hint = f"give a clearance, 0 for one that does nothing; else leave the {key} out"
                refuse(message, hint, at=key)
        if self.acting:
            refuse_misfit(self.acting)
        return self


class SleeveJoint(Part):
    """A link that slides in a guide: on its axis, or with clearance between two walls.

    At a clearance of 0 that the scene gives, its law does nothing: the link slides on the axis.
    """

    type: Literal["sleeve"] = "sleeve"
    guide: BodyName = Field(
        description="name of the body slid along, from its start to its end: rod or rigid"
    )
    link: BodyName = Field(description="name of the body that slides: rod or flexible")
    clearance: si.NonNegativeLength = Field(
        0.0, description="gap between guide and link, on each side"
    )
    supported: Flag = Field(
        False,
        description="without clearance; true: the law holds all rods inside the guide on its axis; "
        "false: the first rod alone is held",
    )
    law: Annotated[GivingLaw | None, _gives_way("the walls of a sleeve need")] = Field(
        None,
        description="force between link and walls; with 'supported', or with clearance, idle if "
        "that is 0",
    )

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies it joins."""
        return (self.guide, self.link)

    @property
    def acting(self) -> PenaltyLaw | None:
        """The law, if anything can press."""
        return self.law if self.clearance > 0 or self.supported else None

    @model_validator(mode="after")
    def _walls_need_a_law(self) -> SleeveJoint:
        if self.clearance > 0 and self.supported:
            hint = "give 'clearance' or 'supported', not both"
            refuse("a supported link has no clearance", hint, at="supported")
        if self.supported and not isinstance(self.law, ContactLaw | None):
            refuse("what holds a link on its axis is a 'penalty'", _EXAMPLE, at=("law", "type"))
        walls = self.clearance > 0 or self.supported
        if self.clearance > 0 and self.law is not None:
            refuse_misfit(self.law)
        if walls and self.law is None:
            refuse("missing 'law', the force between link and walls", _EXAMPLE)
        if not walls and not _gives_clearance(self) and self.law is not None:
            refuse(
                "a sleeve without clearance has no walls to press on",
                "give a clearance, 0 for a law that is idle, or 'supported: true'; else leave the "
                "law out",
                at="law",
            )
        return self


Joint = Annotated[
    RevoluteJoint | SlotJoint | SleeveJoint | WeldJoint | PrismaticJoint | GearJoint | BeltJoint,
    ByType(),
]
