"""Published numbers as a file gives them: which quantity of a run, its value, what it may miss."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field, Strict, model_validator

from exudyn_flexlink.quantities import (
    Angle,
    AngularSpeed,
    Coordinate,
    NonNegativeDuration,
    Number,
    PositiveDuration,
    Speed,
)
from exudyn_flexlink.scene.base import (
    ByType,
    MovingPointName,
    Name,
    Part,
    Text,
    listed,
    refuse,
)

AtTime = Annotated[
    NonNegativeDuration | None, Field(description="instant, one of the samples; left out: the end")
]


class _Number(Part):
    """What every published number says beside its quantity."""

    unit: ClassVar[str]
    one_of = (("allowed", "allowed_part"),)

    allowed: Annotated[float, Number(above=0.0)] | None = Field(
        None, description="largest difference, in the SI unit of the value; or 'allowed_part'"
    )
    allowed_part: Annotated[float, Number(above=0.0)] | None = Field(
        None, description="largest difference as a part of the value; or 'allowed'"
    )
    because: Text = Field(description="why that difference is allowed")
    source: Text = Field("", description="who published it; left out: the source of the file")


class PublishedPosition(_Number):
    """A coordinate of a point, in the ground's axes or in those of a body."""

    unit: ClassVar[str] = "m"
    type: Literal["position"] = "position"
    point: MovingPointName = Field(description="'body.point'")
    axis: Literal["x", "y"] = Field(description="which coordinate")
    seen_from: Name | None = Field(
        None, description="body in whose axes it counts; left out: the ground"
    )
    at: AtTime = None
    value: Coordinate = Field(description="published value")


class PublishedVelocity(_Number):
    """A component of a point's velocity, in the ground's axes."""

    unit: ClassVar[str] = "m/s"
    type: Literal["velocity"] = "velocity"
    point: MovingPointName = Field(description="'body.point'")
    axis: Literal["x", "y"] = Field(description="which component")
    at: AtTime = None
    value: Speed = Field(description="published value")


class _OfBody(_Number):
    """What is said of a number of a body's turning."""

    body: Name = Field(description="name of a body; of a flexible one the first rod counts")
    relative_to: Name | None = Field(None, description="other body; left out: the ground")
    at: AtTime = None


class PublishedAngle(_OfBody):
    """The angle of a body, or the difference of two bodies' angles."""

    unit: ClassVar[str] = "rad"
    type: Literal["angle"] = "angle"
    value: Angle = Field(description="published value")


class PublishedAngularSpeed(_OfBody):
    """The angular speed of a body, or the difference of two bodies'."""

    unit: ClassVar[str] = "rad/s"
    type: Literal["angular_speed"] = "angular_speed"
    value: AngularSpeed = Field(description="published value")


class PublishedEnergyDrift(_Number):
    """The largest error of the energy balance over the run."""

    unit: ClassVar[str] = "J"
    type: Literal["energy_drift"] = "energy_drift"
    value: Annotated[float, Number(at_least=0.0)] = Field(description="published value, J")


class PublishedFrequency(_Number):
    """An angular frequency in the motion of a point: its strongest line within a band."""

    unit: ClassVar[str] = "rad/s"
    type: Literal["frequency"] = "frequency"
    point: MovingPointName = Field(description="'body.point'")
    axis: Literal["x", "y"] = Field(description="coordinate that vibrates")
    between: Annotated[tuple[AngularSpeed, AngularSpeed], listed("lowest", "highest")] = Field(
        description="[lowest, highest] of the band"
    )
    value: AngularSpeed = Field(description="published value")

    @model_validator(mode="after")
    def _band(self) -> PublishedFrequency:
        if not 0 < self.between[0] < self.between[1]:
            refuse("a band begins above 0 and ends higher", at="between")
        return self


class PublishedTouch(_Number):
    """The instant at which one of the touches of a contact begins or ends."""

    unit: ClassVar[str] = "s"
    type: Literal["touch"] = "touch"
    contact: Name = Field(description="name of a contact, or of a joint with clearance")
    number: Annotated[int, Strict()] = Field(
        1, description="which touch, from 1; -1: the last, -2: the one before it"
    )
    edge: Literal["begins", "ends"] = Field("begins", description="begin or end of the touch")
    value: PositiveDuration = Field(description="published value")

    @model_validator(mode="after")
    def _counts_from_one(self) -> PublishedTouch:
        if self.number == 0:
            refuse("touches are counted from 1, or from -1 backwards", at="number")
        return self


PublishedNumber = Annotated[
    PublishedPosition
    | PublishedVelocity
    | PublishedAngle
    | PublishedAngularSpeed
    | PublishedEnergyDrift
    | PublishedFrequency
    | PublishedTouch,
    ByType(),
]
