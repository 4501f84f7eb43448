"""What a run gives for each published number, and whether that is near enough."""

from __future__ import annotations

from dataclasses import dataclass
from functools import singledispatch
from math import isfinite, nan

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import build_mechanism, turned
from exudyn_flexlink.observables import between_samples, path
from exudyn_flexlink.result import Result
from exudyn_flexlink.source import Mistake, SceneError
from exudyn_flexlink.verification.numbers import (
    PublishedAngle,
    PublishedAngularSpeed,
    PublishedEnergyDrift,
    PublishedFrequency,
    PublishedNumber,
    PublishedPosition,
    PublishedTouch,
    PublishedVelocity,
)
from exudyn_flexlink.verification.reading import Benchmark, BenchmarkRun
from exudyn_flexlink.verification.spectrum import strongest_line

SAME_INSTANT = 1e-9  # of the run: rounding of instants
AXES = {"x": 0, "y": 1}


@dataclass(frozen=True)
class Compared:
    """A published number and what was computed, in `unit`; nan if the run did not come to it."""

    name: str
    unit: str
    published: float
    computed: float
    allowed: float
    because: str
    source: str

    @property
    def difference(self) -> float:
        """Distance of the two, without sign."""
        return abs(self.computed - self.published)

    @property
    def fine(self) -> bool:
        """Whether the difference is allowed."""
        return isfinite(self.computed) and self.difference <= self.allowed


@dataclass(frozen=True)
class VerifiedRun:
    """A run of a benchmark with all its numbers; `seconds` of wall time; why it stopped, if so."""

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


class MissingError(ValueError):
    """A run has no sample at the instant that a number asks for by 'at'."""


def judged(benchmark: Benchmark, run: BenchmarkRun, result: Result) -> VerifiedRun:
    """Hold a result against the numbers of a run.

    Raises:
        SceneError: a number is of an instant at which the run has no sample.

    """
    outcome = result.outcome
    stopped = "" if outcome.completed else outcome.told
    numbers, mistakes = [], []
    for name, number in run.numbers.items():
        value = nan
        try:
            value = nan if stopped else computed(number, result)
        except MissingError as error:
            where = ("runs", run.name, "numbers", name, "at")
            mistakes.append(Mistake(where, str(error)))
        numbers.append(
            Compared(
                name,
                number.unit,
                number.value,
                value,
                number.allowed or (number.allowed_part or 0.0) * abs(number.value),
                number.because,
                number.source or benchmark.source,
            )
        )
    if mistakes:
        raise SceneError(benchmark.document, mistakes)
    return VerifiedRun(
        benchmark.name,
        run.name,
        result.scene.title,
        result.engine,
        result.checks.steps,
        sum(result.timings.values()),
        stopped,
        tuple(numbers),
    )


@singledispatch
def computed(number: PublishedNumber, result: Result) -> float:
    """Value of a quantity in a run, SI; nan if nothing of the kind happened in it.

    Raises:
        MissingError: the run has no sample at the instant asked for.

    """
    raise TypeError(f"{type(number).__name__} is told of no run, nor of '{result.scene.title}'")


@computed.register
def _(number: PublishedPosition, result: Result) -> float:
    k = _sample(number.at, result)
    place = path(result, number.point).position[k]
    if number.seen_from is not None:
        pose = result.poses[k, _part(number.seen_from, result)]
        place = turned(place - pose[:2], -pose[2])
    return float(place[AXES[number.axis]])


@computed.register
def _(number: PublishedVelocity, result: Result) -> float:
    velocity = path(result, number.point).velocity
    return float(velocity[_sample(number.at, result), AXES[number.axis]])


@computed.register
def _(number: PublishedAngle, result: Result) -> float:
    return _turned(number, result.poses, result)


@computed.register
def _(number: PublishedAngularSpeed, result: Result) -> float:
    return _turned(number, result.rates, result)


@computed.register(PublishedEnergyDrift)
def _(_: PublishedEnergyDrift, result: Result) -> float:
    return result.checks.energy_residual


@computed.register
def _(number: PublishedFrequency, result: Result) -> float:
    moved = path(result, number.point)
    even = np.linspace(result.time[0], result.time[-1], len(result.time))
    k = AXES[number.axis]
    signal = between_samples(result.time, moved.position[:, k], moved.velocity[:, k], even)
    return strongest_line(even, signal, *number.between)


@computed.register
def _(number: PublishedTouch, result: Result) -> float:
    touches = result.intervals[number.contact]
    instants = touches.begin if number.edge == "begins" else touches.end
    index = number.number - 1 if number.number > 0 else number.number + len(instants)
    return float(instants[index]) if 0 <= index < len(instants) else nan


def _turned(
    number: PublishedAngle | PublishedAngularSpeed, values: FloatArray, result: Result
) -> float:
    k = _sample(number.at, result)
    angle = values[k, _part(number.body, result), 2]
    if number.relative_to is not None:
        angle = angle - values[k, _part(number.relative_to, result), 2]
    return float(angle)


def _part(body: str, result: Result) -> int:
    """First rigid part of a body."""
    return build_mechanism(result.scene).bodies[body][0]


def _sample(at: float | None, result: Result) -> int:
    """Index of the sample of an instant (s), None: of the last; nothing is interpolated.

    Raises:
        MissingError: there is none.

    """
    if at is None:
        return len(result.time) - 1
    k = result.sample_at(at)
    if abs(float(result.time[k]) - at) > SAME_INSTANT * float(result.time[-1]):
        raise MissingError(f"the run has no sample at {at:g} s: choose 'run.sample' for it")
    return k
