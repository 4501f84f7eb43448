"""Limits of joints: stops at the least and the greatest angle, or length along a slide."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import degrees
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field, ValidationInfo, field_validator, model_validator

from exudyn_flexlink import quantities as si
from exudyn_flexlink.scene.base import GROUND, ByType, Part, refuse
from exudyn_flexlink.scene.contact_laws import DampedLaw, HertzLaw, ImpulseLaw, refuse_misfit

if TYPE_CHECKING:
    from exudyn_flexlink.scene.forces import LinearSpring


class _StopPenalty(Part):
    """What gives way at a stop: with a restitution, or as a spring with a damper."""

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


class _Limits(Part):
    """Where a joint is stopped; it needs one of both ends at least."""

    @field_validator("to", check_fields=False)
    @classmethod
    def _above_from(cls, to: float | None, info: ValidationInfo) -> float | None:
        """Beside mistakes of the law, too, as no check of the whole part would be."""
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
"""Units of what is told of a hinge's stop, by those of other contacts."""


@dataclass(frozen=True)
class Stop:
    """One end of a joint's limits: a contact like those of the scene, with a name of its own.

    `at` is the joint's angle (rad) or length (m) there, and `end` the key, 'from' or 'to'.
    `striking` is the point of the joint that shows where it is.
    """

    joint: str
    end: str
    at: float
    limits: Limits
    striking: str
    struck: None = None

    @property
    def law(self) -> StopLaw:
        """Law of the stop."""
        return self.limits.law

    @property
    def turns(self) -> bool:
        """Whether it stops a hinge: by a torque, N m, at an angle."""
        return isinstance(self.limits, TurnLimits)

    @property
    def path(self) -> tuple[str, ...]:
        """Where a scene says it."""
        return "joints", self.joint, "limits", self.end

    def told(self, at: float) -> str:
        """Say an angle (rad) or length (m) of the joint, with its unit."""
        return f"{degrees(at):.6g} deg" if self.turns else f"{at:.6g} m"

    def __str__(self) -> str:
        """Say what is stopped where, in the words of a report."""
        return f"{self.joint} stops at {self.told(self.at)}"


@dataclass(frozen=True)
class Rope:
    """A rope or a buffer as a contact; `striking` is a point that it acts on, 'body.point'."""

    law: LinearSpring
    striking: str
    struck: None = None


def moving(points: tuple[str, str]) -> str:
    """Return the second of two points, the first where that is the ground."""
    return next(point for point in reversed(points) if point != GROUND)


def stops_of(joint: str, limits: Limits, points: tuple[str, str]) -> Iterator[tuple[str, Stop]]:
    """Give the stops of a joint of these points, by their names."""
    for end, at in (("from", limits.from_), ("to", limits.to)):
        if at is not None:
            yield f"{joint}.{end}", Stop(joint, end, at, limits, moving(points))
