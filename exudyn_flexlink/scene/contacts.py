"""Contacts, their laws, and limits of joints, as a model file gives them.

The forces of the laws are in `exudyn_flexlink.laws`. Limits of a joint are stops at its least and
greatest angle, or at its least and greatest length along a slide; flanks of gears are stops, too.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import degrees
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field, ValidationInfo, field_validator, model_validator

from exudyn_flexlink import quantities as si
from exudyn_flexlink.laws import FACTORS, restitution_of
from exudyn_flexlink.quantities import Dimension, NonNegativeLength, PositiveLength
from exudyn_flexlink.scene.base import (
    GROUND,
    ByType,
    CurveName,
    Flag,
    MaterialName,
    MovingPointName,
    Part,
    Point,
    PointName,
    listed,
    refuse,
    split_point,
)

if TYPE_CHECKING:
    from exudyn_flexlink.scene.forces import LinearSpring, RopeSpring


Restitution = Annotated[
    float,
    si.Number(at_least=0.0, at_most=1.0),
    Field(description="speed after an impact over speed before, 0 to 1"),
]
Coefficient = Annotated[
    float,
    si.Number(at_least=0.0),
    Field(description="Coulomb's coefficient; left out: smooth"),
]
SlipSpeed = Annotated[
    si.PositiveSpeed,
    Field(description="above it the friction acts in full; below, the contact creeps"),
]
Power = Annotated[float, si.Number(at_least=1.0, at_most=10.0)]


class ContactLaw(Part):
    """Penalty contact with restitution; see `exudyn_flexlink.laws`."""

    type: Literal["penalty"] = "penalty"
    stiffness: si.PositiveStiffness = Field(
        description="force per penetration at speed; at rest (1 + restitution^2)/2 of it"
    )
    restitution: Restitution
    transition_speed: si.PositiveSpeed = Field(
        5e-3, description="above it the restitution acts in full"
    )
    friction: Coefficient = 0.0
    slip_speed: SlipSpeed = 1e-3


class DampedLaw(Part):
    """Penalty contact F = K d^n (1 + (a/v) d'), v the approach speed; `type` gives the factor a.

    See `exudyn_flexlink.laws`. Only `exact` returns the restitution asked; `check` tells what the
    others return.
    """

    type: Literal["hunt_crossley", "lankarani_nikravesh", "flores", "gonthier", "exact"]
    exponent: Power = Field(si.HERTZ, description="n, of the penetration; 1.5: Hertz")
    stiffness: si.PowerStiffness = Field(
        description="K, in units that fit the exponent n: force at a penetration of 1 m"
    )
    restitution: Restitution
    transition_speed: si.PositiveSpeed = Field(
        1e-3, description="least approach speed that counts: slower touches are damped less"
    )
    friction: Coefficient = 0.0
    slip_speed: SlipSpeed = 1e-3

    @model_validator(mode="after")
    def _has_a_factor(self) -> DampedLaw:
        if self.restitution == 0 and self.type in ("flores", "gonthier", "exact"):
            hint = "a small one, or 'hunt_crossley', which returns more than is asked"
            refuse(f"must be greater than 0: '{self.type}' divides by it", hint, at="restitution")
        return self

    @property
    def factor(self) -> float:
        """Factor a of the law."""
        return FACTORS[self.type](self.restitution)

    @property
    def returned(self) -> float:
        """Restitution that it really gives."""
        return restitution_of(self.factor)


class HertzLaw(Part):
    """Penalty contact of elastic bodies without losses, by its stiffness or by their materials."""

    restitution: ClassVar[float] = 1.0  # nothing is lost
    type: Literal["hertz"] = "hertz"
    one_of = (("stiffness", "materials"),)
    belonging: ClassVar = {
        "stiffness": ("exponent",),
        "materials": ("formula", "radii", "length"),
    }
    exponent: Power | None = Field(
        None, description="n, of the penetration; left out: 1.5, that of spheres"
    )
    stiffness: si.PowerStiffness | None = Field(
        None, description="K, in units that fit the exponent n: force at a penetration of 1 m"
    )
    materials: (
        Annotated[tuple[MaterialName, MaterialName], listed("material", "material")] | None
    ) = Field(None, description="names of the materials of both bodies")
    formula: Literal["sphere", "lankarani_nikravesh", "johnson", "radzimovsky"] | None = Field(
        None,
        description="left out: sphere, which is lankarani_nikravesh of a pin in a bore; johnson "
        "and radzimovsky: parallel cylinders",
    )
    radii: Annotated[tuple[si.Coordinate, ...], Field(min_length=1, max_length=2)] | None = Field(
        None,
        description="of both bodies where they touch, metres, that of a hollow negative; one: the "
        "other is flat; not for circles and bearings, which have radii",
    )
    length: si.PositiveLength | None = Field(None, description="of both cylinders along their axes")
    friction: Coefficient = 0.0
    slip_speed: SlipSpeed = 1e-3

    @model_validator(mode="after")
    def _fits_its_formula(self) -> HertzLaw:
        lines = self.formula in ("johnson", "radzimovsky")
        if lines and self.length is None:
            refuse("missing 'length', that of the cylinders", at="formula")
        if not lines and self.length is not None:
            refuse("no length enters", "'formula: johnson' or 'radzimovsky' has one", at="length")
        return self


class ImpulseLaw(Part):
    """Rigid contact with restitution: speeds jump. Not for redundant coordinates."""

    type: Literal["impulse"] = "impulse"
    restitution: Restitution


class RubbingImpulse(ImpulseLaw):
    """Rigid contact with restitution and friction: speeds jump. Not for redundant coordinates."""

    friction: Coefficient = 0.0
    tangential_restitution: Annotated[float, si.Number(at_least=0.0, at_most=1.0)] = Field(
        0.0,
        description="slip after an impact over slip before, the other way, 0 to 1, as far as "
        "friction is enough; of what is round",
    )
    slip_speed: si.PositiveSpeed = Field(
        1e-3,
        description="of what lasts: above it the friction acts in full; below, the contact creeps",
    )

    @model_validator(mode="after")
    def _turns_back_by_friction(self) -> RubbingImpulse:
        if self.tangential_restitution > 0 and self.friction == 0:
            message = "needs 'friction', which turns the slip back"
            refuse(message, "e.g. friction: 0.5", at="tangential_restitution")
        return self


PenaltyLaw = ContactLaw | DampedLaw | HertzLaw
"""Laws of compliant contacts."""
GivingLaw = Annotated[PenaltyLaw, ByType(default="penalty")]
Law = Annotated[ContactLaw | DampedLaw | HertzLaw | RubbingImpulse, ByType(default="penalty")]


def refuse_misfit(law: PenaltyLaw | ImpulseLaw, radii: tuple[float, float] | None = None) -> None:
    """Refuse Hertz's law by materials if its radii are missing, or do not fit it.

    `radii` (m) are the contact's own, if it has any; that of a hollow is negative.
    """
    if not isinstance(law, HertzLaw) or law.materials is None:
        return
    if radii is not None and law.radii is not None:
        refuse("the circles give the radii", "leave these out", at=("law", "radii"))
    both_radii, key = (radii, ("law",)) if radii else (law.radii, ("law", "radii"))
    if both_radii is None:
        refuse("missing 'radii' of both bodies where they touch", "e.g. [10 mm, -12 mm]", at="law")
    lines = law.formula in ("johnson", "radzimovsky")
    if len(both_radii) == 1 and lines:
        refuse(f"'{law.formula}' needs two radii: on a flat its depth has no bound", at=key)
    if 0 in both_radii or not 0 < sum(1 / radius for radius in both_radii) < math.inf:
        hint = "that of a hollow is negative, and the larger one"
        refuse("bodies of these radii do not touch at one place", hint, at=key)
    if law.formula == "lankarani_nikravesh" and min(both_radii) > 0:
        hint = "'formula: sphere', with the same exponent"
        refuse("'lankarani_nikravesh' is for a pin in a bore: nothing is hollow", hint, at=key)


Line = Annotated[tuple[MovingPointName, MovingPointName], listed("body.point", "body.point")]


def _require_line(line: tuple[str, str]) -> str:
    """Return the body of a line; refuse a line without two different points of one body."""
    first, second = (split_point(point)[0] for point in line)
    if first != second:
        refuse("the two points must be of one body", at="line")
    if line[0] == line[1]:
        refuse("a line needs two different points", at="line")
    return first


class PointOnLine(Part):
    """A point of a body can't cross the segment between two points of another body."""

    type: Literal["point_on_line"] = "point_on_line"
    point: MovingPointName = Field(description="point 'body.point' that strikes")
    line: Line = Field(description="two points of the struck body")
    side: Literal["left", "right"] = Field(
        "left", description="which side of the line, from its first to its second point, is free"
    )
    law: Law = Field(description="force of the contact, or its impulse")

    @property
    def striking(self) -> str:
        """Point that strikes, 'body.point'."""
        return self.point

    @property
    def struck(self) -> str:
        """Body that is struck."""
        return split_point(self.line[0])[0]

    def __str__(self) -> str:
        """Say what meets what, in the words of a report."""
        return f"{self.point} on the line from {self.line[0]} to {self.line[1]}"

    @model_validator(mode="after")
    def _two_bodies(self) -> PointOnLine:
        if split_point(self.point)[0] == _require_line(self.line):
            refuse("the point is on the same body as the line", at="point")
        refuse_misfit(self.law)
        return self


class Circle(Part):
    """A circle around a point of a body, or around a place on the ground."""

    at: PointName = Field(description="its centre: a point 'body.point', or 'ground'")
    place: Point | None = Field(None, description="of the centre on the ground, [x, y], metres")
    radius: PositiveLength = Field(description="radius of the circle")
    inside: Flag = Field(False, description="true: the other circle is inside this one")

    @model_validator(mode="after")
    def _sits_on_ground(self) -> Circle:
        if self.at == GROUND and self.place is None:
            refuse("missing 'place'", "where its centre is on the ground, e.g. place: [0.02, 0]")
        if self.at != GROUND and self.place is not None:
            refuse("only a circle on the ground has a fixed place", at="place")
        return self


class CircleOnCircle(Part):
    """Two circles of two bodies can't cross: outside each other, or one inside the other."""

    type: Literal["circle_on_circle"] = "circle_on_circle"
    circles: Annotated[tuple[Circle, Circle], listed("circle", "circle")] = Field(
        description="two circles of different bodies"
    )
    law: Law = Field(description="force of the contact, or its impulse")

    @property
    def inner_and_outer(self) -> tuple[Circle, Circle]:
        """The two circles; if one is hollow, it is the last."""
        first, second = self.circles
        return (second, first) if first.inside else (first, second)

    @property
    def striking(self) -> str:
        """Centre that strikes, 'body.point': the first, or the second if that is on the ground."""
        first, second = self.inner_and_outer
        return second.at if first.at == GROUND else first.at

    @property
    def struck(self) -> str | None:
        """Body that is struck; None for the ground."""
        first, second = self.inner_and_outer
        return None if GROUND in (first.at, second.at) else split_point(second.at)[0]

    def __str__(self) -> str:
        """Say what meets what, in the words of a report."""
        first, second = self.inner_and_outer
        way = "in" if second.inside else "on"
        return f"circle around {first.at} {way} that around {second.at}"

    @model_validator(mode="after")
    def _two_bodies(self) -> CircleOnCircle:
        first, second = self.inner_and_outer
        first_body, second_body = (split_point(circle.at)[0] for circle in (first, second))
        if first_body == second_body:
            where = "on the ground" if first_body == GROUND else f"of the body '{first_body}'"
            refuse(f"both circles are {where}", "give circles of different bodies", at="circles")
        if first.inside and second.inside:
            refuse("each circle can't be inside the other", "leave one 'inside' out", at="circles")
        if second.inside and not first.radius < second.radius:
            hint, number = f"a radius below {second.radius:g} m", self.circles.index(first)
            message = "the circle inside must be the smaller one"
            refuse(message, hint, at=("circles", number, "radius"))
        refuse_misfit(self.law, self.radii)
        return self

    @property
    def radii(self) -> tuple[float, float]:
        """Radii (m) of both circles; negative for a hollow one."""
        first, second = self.inner_and_outer
        return first.radius, -second.radius if second.inside else second.radius


class PointOnCurve(Part):
    """A point of a body, or a roller around it, can't cross a curve."""

    struck: ClassVar[str | None] = None  # a body with a curve is not a struck lever
    type: Literal["point_on_curve"] = "point_on_curve"
    point: MovingPointName = Field(description="point 'body.point' that strikes")
    curve: CurveName = Field(description="name of the curve; 'on' a body it moves with that")
    side: Literal["left", "right"] = Field(
        "left",
        description="which side of the curve is free, seen along it; left of an arc is inside",
    )
    radius: NonNegativeLength = Field(0.0, description="of a roller around the point; 0: none")
    law: Law = Field(description="force of the contact, or its impulse")

    @property
    def striking(self) -> str:
        """Point that strikes, 'body.point'."""
        return self.point

    def __str__(self) -> str:
        """Say what meets what, in the words of a report."""
        what = f"roller around {self.point}" if self.radius > 0 else self.point
        return f"{what} on the curve {self.curve}"

    @model_validator(mode="after")
    def _law_fits(self) -> PointOnCurve:
        refuse_misfit(self.law)
        return self


class LineOnCurve(Part):
    """A straight face of a body can't cross a closed convex curve, such as a cam."""

    struck: ClassVar[str | None] = None  # a body with a curve is not a struck lever
    type: Literal["line_on_curve"] = "line_on_curve"
    line: Line = Field(description="two points of the face, which goes on straight beyond them")
    side: Literal["left", "right"] = Field(
        "left", description="which side of the line, seen along it, the curve is on"
    )
    curve: CurveName = Field(description="name of the curve; 'on' a body it moves with that")
    law: Law = Field(description="force of the contact, or its impulse")

    @property
    def striking(self) -> str:
        """First point of the face, 'body.point'."""
        return self.line[0]

    def __str__(self) -> str:
        """Say what meets what, in the words of a report."""
        return f"face from {self.line[0]} to {self.line[1]} on the curve {self.curve}"

    @model_validator(mode="after")
    def _line_and_law_fit(self) -> LineOnCurve:
        _require_line(self.line)
        refuse_misfit(self.law)
        return self


Contact = Annotated[PointOnLine | CircleOnCircle | PointOnCurve | LineOnCurve, ByType()]


class _StopPenalty(Part):
    """A stop that gives way: by a stiffness with a restitution, or as a spring with a damper."""

    one_of = (("restitution", "damping"),)
    belonging: ClassVar[Mapping[str, tuple[str, ...]]] = {"restitution": ("transition_speed",)}
    type: Literal["penalty"] = "penalty"
    restitution: Annotated[float, si.Number(at_least=0.0, at_most=1.0)] | None = Field(
        None, description="speed after an impact over speed before, 0 to 1; or 'damping'"
    )


class SlidePenalty(_StopPenalty):
    """A stop of a slide that gives way."""

    stiffness: si.PositiveStiffness = Field(description="force per penetration")
    damping: si.NonNegativeDamping | None = Field(
        None, description="force per speed; the stop never pulls; or 'restitution'"
    )
    transition_speed: si.PositiveSpeed | None = Field(
        None, description="above it the restitution acts in full; left out: 5 mm/s"
    )


class TurnPenalty(_StopPenalty):
    """A stop of a hinge that gives way."""

    stiffness: si.PositiveTorsionalStiffness = Field(description="torque per angle beyond the stop")
    damping: si.NonNegativeTorsionalDamping | None = Field(
        None, description="torque per angular speed; the stop never pulls; or 'restitution'"
    )
    transition_speed: si.PositiveAngularSpeed | None = Field(
        None, description="above it the restitution acts in full; left out: 5e-3 rad/s"
    )


class FlankPenalty(_StopPenalty):
    """Teeth that give way, by an angle, or by a length if the second joint is a slide."""

    stiffness: Annotated[float, si.OfGear(Dimension.TORSIONAL_STIFFNESS, above=0.0)] = Field(
        description="torque per angle of the second joint, or force per length"
    )
    damping: Annotated[float, si.OfGear(Dimension.TORSIONAL_DAMPING, at_least=0.0)] | None = Field(
        None, description="torque per angular speed, or force per speed; teeth never pull"
    )
    transition_speed: Annotated[float, si.OfGear(Dimension.ANGULAR_SPEED, above=0.0)] | None = (
        Field(None, description="above it the restitution acts in full; left out: 5e-3 in SI units")
    )


FlankLaw = Annotated[FlankPenalty | ImpulseLaw, ByType(default="penalty")]


class _Limits(Part):
    """Stops of a joint at one end or at both ends."""

    @field_validator("to", check_fields=False)
    @classmethod
    def _above_from(cls, to: float | None, info: ValidationInfo) -> float | None:
        """Compare both ends even if the law has mistakes; then no check of the whole part runs."""
        low = info.data.get("from_")
        if low is not None and to is not None and low >= to:
            refuse("must be greater than 'from'")
        return to

    @model_validator(mode="after")
    def _has_an_end(self) -> _Limits:
        if getattr(self, "from_", None) is None and getattr(self, "to", None) is None:
            refuse("needs 'from' or 'to'", "e.g. limits: {from: -30 deg, to: 405 deg, law: ...}")
        return self


class SlideLimits(_Limits):
    """Stops of a slide: how far its second point can be from its first, along the line."""

    from_: si.Coordinate | None = Field(
        None, alias="from", description="least length along the line"
    )
    to: si.Coordinate | None = Field(None, description="greatest length along the line")
    law: Annotated[SlidePenalty | DampedLaw | HertzLaw | ImpulseLaw, ByType(default="penalty")] = (
        Field(description="force of both stops, or their impulse")
    )

    @model_validator(mode="after")
    def _law_fits(self) -> SlideLimits:
        if isinstance(self.law, DampedLaw | HertzLaw):
            for key in ("friction", "slip_speed"):
                if getattr(self.law, key) != type(self.law).model_fields[key].default:
                    hint = "the joint's own 'friction' brakes it"
                    refuse("nothing slips at a stop of a slide", hint, at=("law", key))
            refuse_misfit(self.law)
        return self


class TurnLimits(_Limits):
    """Stops of a hinge: how far its second body can be turned on its first."""

    from_: si.Angle | None = Field(
        None, alias="from", description="least angle of the joint; whole turns count"
    )
    to: si.Angle | None = Field(None, description="greatest angle of the joint; whole turns count")
    law: Annotated[TurnPenalty | ImpulseLaw, ByType(default="penalty")] = Field(
        description="torque of both stops, or their impulse"
    )


Limits = SlideLimits | TurnLimits
StopLaw = SlidePenalty | TurnPenalty | DampedLaw | HertzLaw | ImpulseLaw


TURNED = {"N": "N m", "N s": "N m s", "m": "rad", "m/s": "rad/s"}
"""Units at the stop of a hinge, by the units that other contacts have."""


@dataclass(frozen=True)
class Stop:
    """One end of a joint's limits: a contact like those of the scene, with its own name.

    `at` is the joint's angle (rad) or length (m) at the stop, and `end` the key, 'from' or 'to'.
    Reports and figures show the stop at the joint's point `striking`.
    """

    joint: str
    end: str
    at: float
    law: StopLaw
    turns: bool  # true: it acts by a torque (N m), at an angle
    striking: str
    struck: None = None

    noun: ClassVar[str] = "stops of joints"

    @property
    def path(self) -> tuple[str, ...]:
        """Path of the stop's key in the scene."""
        return "joints", self.joint, "limits", self.end

    @property
    def law_path(self) -> tuple[str, ...]:
        """Path of the stop's law in the scene."""
        return "joints", self.joint, "limits", "law"

    def text(self, value: float) -> str:
        """Angle (rad) or length (m) of the joint as a text, with its unit."""
        return f"{degrees(value):.6g} deg" if self.turns else f"{value:.6g} m"

    def __str__(self) -> str:
        """Say which joint is stopped, and where, in the words of a report."""
        return f"{self.joint} stops at {self.text(self.at)}"


class Flank(Stop):
    """One side of a gear's play: `at` is the way of the second joint from the play's middle."""

    noun = "backlash"

    @property
    def path(self) -> tuple[str, ...]:
        """Path of the key 'backlash'."""
        return "joints", self.joint, "backlash"

    @property
    def law_path(self) -> tuple[str, ...]:
        """Path of the gear's law."""
        return "joints", self.joint, "law"

    def __str__(self) -> str:
        """Say where the flank is, in the words of a report."""
        return f"flank of {self.joint} at {self.text(self.at)} from the middle"


@dataclass(frozen=True)
class Rope:
    """A rope or a buffer as a contact; `striking` is a point on which it acts, 'body.point'."""

    law: LinearSpring | RopeSpring
    striking: str
    struck: None = None


def moving(points: Sequence[str]) -> str:
    """Return the last of some points that is not the ground."""
    return next(point for point in reversed(points) if point != GROUND)


def stops_of(joint: str, limits: Limits, points: tuple[str, str]) -> Iterator[tuple[str, Stop]]:
    """Yield the stops of a joint between these points, with their names."""
    for end, bound in (("from", limits.from_), ("to", limits.to)):
        if bound is not None:
            turns = isinstance(limits, TurnLimits)
            yield f"{joint}.{end}", Stop(joint, end, bound, limits.law, turns, moving(points))


_PENALTIES: dict[bool, type[SlidePenalty | TurnPenalty]] = {False: SlidePenalty, True: TurnPenalty}


def flanks_of(
    gear: str, play: float, law: FlankPenalty | ImpulseLaw, turns: bool, points: tuple[str, str]
) -> Iterator[tuple[str, Flank]]:
    """Yield both flanks of a gear with play (rad or m), with their names.

    `turns` and `points` belong to the gear's second joint.
    """
    acting = law if isinstance(law, ImpulseLaw) else _PENALTIES[turns](**dict(law))
    for end, way in (("from", -1.0), ("to", 1.0)):
        yield f"{gear}.{end}", Flank(gear, end, way * play / 2, acting, turns, moving(points))
