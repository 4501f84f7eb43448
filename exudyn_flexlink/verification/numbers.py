"""Published numbers as a file gives them: which quantity of a run, its value, what it may miss.

Each tells what a run gives for it, `computed`, in SI: nan if nothing of the kind happened in it. A
run that has no sample at the instant asked for raises MissingError.
"""

from __future__ import annotations

from math import nan
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, Strict, model_validator

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import build_mechanism, turned
from exudyn_flexlink.observables import path, strongest_line
from exudyn_flexlink.quantities import (
    Angle,
    AngularSpeed,
    Coordinate,
    NonNegativeDuration,
    Number,
    PositiveDuration,
    Speed,
)
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene.base import (
    ByType,
    MovingPointName,
    Name,
    Part,
    Text,
    listed,
    refuse,
)

SAME_INSTANT = 1e-9  # of the run: rounding of instants


class MissingError(ValueError):
    """A run has no sample at the instant that a number asks for by 'at'."""


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


class _AtSample(_Number):
    """What is said of a number at an instant."""

    at: NonNegativeDuration | None = Field(
        None, description="instant, one of the samples; left out: the end"
    )

    def _sample(self, result: Result) -> int:
        """Index of that sample; nothing is interpolated."""
        if self.at is None:
            return len(result.time) - 1
        k = result.sample_at(self.at)
        if abs(float(result.time[k]) - self.at) > SAME_INSTANT * float(result.time[-1]):
            told = f"the run has no sample at {self.at:g} s: choose 'run.sample' for it"
            raise MissingError(told)
        return k


class _OfPoint(_Number):
    """What is said of a number of a point's motion."""

    point: MovingPointName = Field(description="'body.point'")
    axis: Literal["x", "y"] = Field(description="along which axis")

    def _along(self, vectors: FloatArray) -> FloatArray:
        return np.asarray(vectors[..., "xy".index(self.axis)])


class PublishedPosition(_OfPoint, _AtSample):
    """A coordinate of a point, in the ground's axes or in those of a body."""

    unit: ClassVar[str] = "m"
    type: Literal["position"] = "position"
    seen_from: Name | None = Field(
        None, description="body in whose axes it counts; left out: the ground"
    )
    value: Coordinate = Field(description="published value")

    def computed(self, result: Result) -> float:
        """Place of the point along the axis, m."""
        k = self._sample(result)
        place = path(result, self.point).position[k]
        if self.seen_from is not None:
            pose = result.poses[k, _part(self.seen_from, result)]
            place = turned(place - pose[:2], -pose[2])
        return float(self._along(place))


class PublishedVelocity(_OfPoint, _AtSample):
    """A component of a point's velocity, in the ground's axes."""

    unit: ClassVar[str] = "m/s"
    type: Literal["velocity"] = "velocity"
    value: Speed = Field(description="published value")

    def computed(self, result: Result) -> float:
        """Component of the point's velocity, m/s."""
        return float(self._along(path(result, self.point).velocity[self._sample(result)]))


class _OfBody(_AtSample):
    """What is said of a number of a body's turning."""

    body: Name = Field(description="name of a body; of a flexible one the first rod counts")
    relative_to: Name | None = Field(None, description="other body; left out: the ground")

    def _of(self, values: FloatArray, result: Result) -> float:
        """Difference of the bodies' third columns in values (N, parts, 3)."""
        own = values[self._sample(result), :, 2]
        other = 0.0 if self.relative_to is None else own[_part(self.relative_to, result)]
        return float(own[_part(self.body, result)] - other)


class PublishedAngle(_OfBody):
    """The angle of a body, or the difference of two bodies' angles."""

    unit: ClassVar[str] = "rad"
    type: Literal["angle"] = "angle"
    value: Angle = Field(description="published value")

    def computed(self, result: Result) -> float:
        """Angle, rad."""
        return self._of(result.poses, result)


class PublishedAngularSpeed(_OfBody):
    """The angular speed of a body, or the difference of two bodies'."""

    unit: ClassVar[str] = "rad/s"
    type: Literal["angular_speed"] = "angular_speed"
    value: AngularSpeed = Field(description="published value")

    def computed(self, result: Result) -> float:
        """Angular speed, rad/s."""
        return self._of(result.rates, result)


class PublishedEnergyDrift(_Number):
    """The largest error of the energy balance over the run."""

    unit: ClassVar[str] = "J"
    type: Literal["energy_drift"] = "energy_drift"
    value: Annotated[float, Number(at_least=0.0)] = Field(description="published value, J")

    def computed(self, result: Result) -> float:
        """Largest error of the energy balance, J."""
        return result.checks.energy_residual


class PublishedFrequency(_OfPoint):
    """An angular frequency in the motion of a point: its strongest line within a band."""

    unit: ClassVar[str] = "rad/s"
    type: Literal["frequency"] = "frequency"
    between: Annotated[tuple[AngularSpeed, AngularSpeed], listed("lowest", "highest")] = Field(
        description="[lowest, highest] of the band"
    )
    value: AngularSpeed = Field(description="published value")

    @model_validator(mode="after")
    def _band(self) -> PublishedFrequency:
        if not 0 < self.between[0] < self.between[1]:
            refuse("a band begins above 0 and ends higher", at="between")
        return self

    def computed(self, result: Result) -> float:
        """Angular frequency of the strongest line, rad/s."""
        even = np.linspace(result.time[0], result.time[-1], len(result.time))
        signal = self._along(path(result, self.point).at(even))
        return strongest_line(even, signal, *self.between)


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

    def computed(self, result: Result) -> float:
        """Instant of the touch, s."""
        touches = result.intervals[self.contact]
        instants = touches.begin if self.edge == "begins" else touches.end
        index = self.number - 1 if self.number > 0 else self.number + len(instants)
        return float(instants[index]) if 0 <= index < len(instants) else nan


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


def _part(body: str, result: Result) -> int:
    """First rigid part of a body."""
    return build_mechanism(result.scene).bodies[body][0]
