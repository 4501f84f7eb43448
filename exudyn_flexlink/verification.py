"""Runs of benchmarks compared with numbers that others published.

A benchmark is a model and, beside it, a file ``<name>.published.yaml``. For each number this has
the quantity of a run, its value, and the allowed difference. A quantity computes its value from a
run, in SI units. The value is nan if the run has no such event; MissingError is raised if the run
has no sample at the given instant. No engine is used here: the caller passes the results.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import isfinite, nan
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, Strict, ValidationError, model_validator

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.mechanism import build_mechanism, turned
from exudyn_flexlink.observables import path, point_names, strongest_line
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
from exudyn_flexlink.rounding import NEGLIGIBLE
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.scene.base import (
    ByType,
    MovingPointName,
    Name,
    Named,
    Part,
    Text,
    listed,
    refuse,
)
from exudyn_flexlink.scene.wording import mistakes_of
from exudyn_flexlink.shipped import EXUDYN, PUBLISHED, EngineName
from exudyn_flexlink.source import (
    Document,
    KeyPath,
    Mistake,
    SceneError,
    did_you_mean,
    load_document,
)


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
        if abs(float(result.time[k]) - self.at) > NEGLIGIBLE * float(result.time[-1]):
            about = f"the run has no sample at {self.at:g} s: choose 'run.sample' for it"
            raise MissingError(about)
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
        """Third column of values (N, parts, 3) at the sample, of a body or between two."""
        angles = values[self._sample(result), :, 2]
        other = 0.0 if self.relative_to is None else angles[_part(self.relative_to, result)]
        return float(angles[_part(self.body, result)] - other)


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


class RunSpec(Part):
    """One run of the model."""

    settings: tuple[Text, ...] = Field((), alias="set", description="such as 'run.duration=2'")
    engine: EngineName = Field(EXUDYN, description="who solves it")
    numbers: Named[PublishedNumber] = Field(description="published numbers, by name")


class PublishedFile(Part):
    """What a file of published numbers says."""

    source: Text = Field(description="who published the numbers")
    runs: Named[RunSpec] = Field(description="runs of the model, by name", min_length=1)


@dataclass(frozen=True)
class BenchmarkRun:
    """A run of a benchmark: its scene, the engine that solves it, and published numbers."""

    name: str
    scene: Scene
    engine: str
    numbers: Mapping[str, PublishedNumber]


@dataclass(frozen=True)
class Benchmark:
    """A model with published numbers; `document` is the file that gives them."""

    name: str
    source: str
    runs: tuple[BenchmarkRun, ...]
    document: Document


def read_benchmark(file: Path) -> Benchmark:
    """Read a file of published numbers, and the model beside it, once for every run.

    Raises:
        SceneError: either file has mistakes, or a number names a part that the model lacks.

    """
    document = load_document(file)
    try:
        file_read = PublishedFile.model_validate(document.data)
    except ValidationError as error:
        mistakes = mistakes_of(error, PublishedFile, document.data, ())
        raise SceneError(document, mistakes) from None
    stem = file.name.removesuffix(PUBLISHED)
    model = file.with_name(f"{stem}.yaml")
    runs, mistakes = list[BenchmarkRun](), list[Mistake]()
    for name, run in file_read.runs.items():
        scene = load_scene(model, run.settings)
        for what, number in run.numbers.items():
            mistakes += _unknown(number, scene, ("runs", name, "numbers", what))
        runs.append(BenchmarkRun(name, scene, run.engine, run.numbers))
    if mistakes:
        raise SceneError(document, mistakes)
    return Benchmark(stem, file_read.source, tuple(runs), document)


def _unknown(number: PublishedNumber, scene: Scene, path: KeyPath) -> Iterator[Mistake]:
    """Names of parts that the scene does not have."""
    joints = scene.joints.items()
    with_clearance = [name for name, joint in joints if getattr(joint, "clearance", 0.0) > 0]
    known = {
        "point": point_names(scene),
        "body": list(scene.bodies),
        "relative_to": list(scene.bodies),
        "seen_from": list(scene.bodies),
        "contact": [*scene.all_contacts, *with_clearance],
    }
    for key, names in known.items():
        given = getattr(number, key, None)
        if given is not None and given not in names:
            hint = f"there are: {', '.join(names)}" if names else "the model has none"
            what = "point" if key == "point" else "contact" if key == "contact" else "body"
            message = f"the model has no {what} '{given}'{did_you_mean(given, names)}"
            yield Mistake((*path, key), message, hint)


@dataclass(frozen=True)
class Compared:
    """A published number and the computed one, in `unit`; nan if the run did not reach it."""

    name: str
    unit: str
    published: float
    computed: float
    allowed: float
    because: str
    source: str

    @property
    def difference(self) -> float:
        """Absolute difference of both numbers."""
        return abs(self.computed - self.published)

    @property
    def fine(self) -> bool:
        """Whether the difference is allowed."""
        return isfinite(self.computed) and self.difference <= self.allowed


@dataclass(frozen=True)
class VerifiedRun:
    """A run of a benchmark: all its numbers, `seconds` of wall time, and why it stopped early."""

    benchmark: str
    run: str
    title: str
    engine: str
    steps: int
    seconds: float
    stopped: str
    numbers: tuple[Compared, ...]

    @property
    def fine(self) -> bool:
        """Whether it ran to its end, and every number is near enough."""
        return not self.stopped and all(number.fine for number in self.numbers)


def judged(benchmark: Benchmark, run: BenchmarkRun, result: Result) -> VerifiedRun:
    """Compare a result with the numbers of a run.

    Raises:
        SceneError: the run has no sample at the instant of a number.

    """
    outcome = result.outcome
    stopped = "" if outcome.completed else outcome.ending
    numbers, mistakes = [], []
    for name, number in run.numbers.items():
        value = nan
        try:
            value = nan if stopped else number.computed(result)
        except MissingError as error:
            where = ("runs", run.name, "numbers", name, "at")
            mistakes.append(Mistake(where, str(error)))
        allowed = number.allowed or (number.allowed_part or 0.0) * abs(number.value)
        source = number.source or benchmark.source
        numbers.append(
            Compared(name, number.unit, number.value, value, allowed, number.because, source)
        )
    if mistakes:
        raise SceneError(benchmark.document, mistakes)
    made = result.scene.title, result.engine, result.checks.steps, sum(result.timings.values())
    return VerifiedRun(benchmark.name, run.name, *made, stopped, tuple(numbers))
