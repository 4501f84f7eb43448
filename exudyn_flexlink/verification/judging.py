"""What a run gives for each published number, and whether that is near enough."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, nan

from exudyn_flexlink.result import Result
from exudyn_flexlink.source import Mistake, SceneError
from exudyn_flexlink.verification.numbers import MissingError
from exudyn_flexlink.verification.reading import Benchmark, BenchmarkRun


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
