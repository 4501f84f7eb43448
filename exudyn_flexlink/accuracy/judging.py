"""Results of a work-precision study: errors, their sources, and advice.

Errors are distances of all judged points from a reference run; errors below a floor are not known.
The advice is the cheapest setting for a target, and the largest source of error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import takewhile
from math import ceil

import numpy as np

from exudyn_flexlink.accuracy.study import Method, Runs, Trial, extrapolated
from exudyn_flexlink.observables import (
    common_points,
    common_times,
    farthest,
    first_beyond,
    force_deviations,
    judged_points,
    lever_response,
    parting_limit,
    room,
    separation,
    separations,
    struck_bodies,
    worst_force,
)
from exudyn_flexlink.result import Result
from exudyn_flexlink.rounding import LEAST_LENGTH, PLACE_ROUNDING
from exudyn_flexlink.scene import Scene

SURE = 0.03  # part of the limit at which runs have parted; errors are judged up to there


@dataclass(frozen=True)
class Errors:
    """Errors of a run. At each instant the point with the largest distance counts.

    `largest` (m) is the largest distance over time, of the point `worst`; `rms` (m) is the root of
    the mean square. `levers` are differences of the largest absolute angle (rad) or
    displacement (m) of struck bodies. `force` is the largest error of a force relative to that
    force's largest value, and `worst_force` its name: see `observables.worst_force`.
    """

    rms: float
    largest: float
    worst: str
    levers: dict[str, float]
    force: float
    worst_force: str

    def times(self, factor: float) -> Errors:
        """Return these errors times a factor."""
        levers = {body: factor * x for body, x in self.levers.items()}
        scaled = {name: factor * getattr(self, name) for name in ("rms", "largest", "force")}
        return replace(self, levers=levers, **scaled)


@dataclass(frozen=True)
class Horizon:
    """Instants up to which two runs agree, s.

    From `parted` on they differ by more than `limit` (m) and can't be compared instant by instant.
    Errors are judged up to `sure`: from there to `parted` the difference only shows that runs part.
    """

    parted: float
    sure: float
    limit: float


def errors(result: Result, reference: Result, until: float) -> Errors:
    """Errors of a run up to `until` (s)."""
    time = common_times(reference, result)
    time = time[time <= until]
    points = common_points(reference, result)
    each = separations(result, reference, time, points)
    apart = each.max(axis=1)
    worst, force = worst_force(force_deviations(reference, result, np.nextafter(until, np.inf)))
    return Errors(
        float(np.sqrt(np.mean(apart**2))),
        float(apart.max()),
        farthest(points, each.max(axis=0)),
        {
            body: abs(_peak(result, contact, until) - _peak(reference, contact, until))
            for body, contact in struck_bodies(reference.scene).items()
        },
        force,
        worst,
    )


def _peak(result: Result, contact: str, until: float) -> float:
    return lever_response(result, contact).between(-np.inf, np.nextafter(until, np.inf)).farthest


def agreement(reference: Result, check: Result) -> Horizon | None:
    """Find where two tight runs part; None if they never do."""
    limit = parting_limit(reference)
    time = common_times(reference, check)
    apart = separation(reference, check, time)
    parted, sure = (first_beyond(time, apart, part * limit) for part in (1.0, SURE))
    return None if parted is None or sure is None else Horizon(parted, sure, limit)


TRUSTED = 3.0  # times the error of time steps: a smaller difference may come from these alone


@dataclass(frozen=True)
class Point:
    """One point of the work-precision figure: processor time (s), and errors (m)."""

    method: Method
    value: float
    processor: float
    repeats: int
    steps: int
    errors: Errors
    claimed: float  # m: the largest error, or the floor if that is higher

    @property
    def below_floor(self) -> bool:
        """Whether the references differ too much to tell this error."""
        return self.claimed > self.errors.largest

    @property
    def label(self) -> str:
        """The point in words."""
        return self.method.label(self.value)


@dataclass(frozen=True)
class Source:
    """Error at the model's own settings from one cause: time, rods or contact.

    `at_most` is true if it is only a bound: the runs differ by little more than their errors of
    time. The error falls with the power `order` of the number of rods, or of the stiffness.
    `dearer` is the cost of the finer model divided by the cost of the scene.
    """

    kind: str
    errors: Errors
    order: float = 0.0
    at_most: bool = False
    dearer: float = 1.0


@dataclass(frozen=True)
class Bench:
    """The runs that judge all others: a reference, and a `check` of the reference, if any.

    A check is `independent` if it has other equations of motion, or another formulation. Errors are
    judged up to the `horizon`; None means up to the end.
    """

    reference: Trial
    check: Trial | None
    independent: bool
    horizon: Horizon | None

    @property
    def end(self) -> float:
        """End of the reference, s."""
        return float(self.reference.result.time[-1])

    @property
    def until(self) -> float:
        """Instant up to which errors are judged, s."""
        return self.end if self.horizon is None else self.horizon.sure

    @cached_property
    def _apart(self) -> Errors | None:
        return None if self.check is None else self.errors(self.check.result)

    @property
    def floor(self) -> float:
        """Distance of reference and check, m: smaller errors are unknown; 0 without a check."""
        return 0.0 if self._apart is None else max(self._apart.largest, LEAST_LENGTH)

    @property
    def force_floor(self) -> float:
        """Largest error of a force between both, relative to its size; 0 without a check."""
        return 0.0 if self._apart is None else self._apart.force

    def errors(self, result: Result, reference: Result | None = None) -> Errors:
        """Errors of a run up to `until`, against the reference or another run."""
        return errors(result, reference or self.reference.result, self.until)


@dataclass(frozen=True)
class Study(Bench):
    """The result of a study: `points` of the figure; `model_point` has the model's settings."""

    scene: Scene
    target: float
    points: tuple[Point, ...]
    model_point: Point | None
    sources: tuple[Source, ...]
    runs: Runs

    @property
    def judged_by(self) -> tuple[str, ...]:
        """Names of the mechanism's points whose errors count."""
        return judged_points(self.reference.result.scene)

    @cached_property
    def still(self) -> bool:
        """Whether none of these points moves."""
        return room(self.reference.result, self.judged_by) <= PLACE_ROUNDING


class NothingRunError(Exception):
    """Fewer than two runs ended, so nothing can be compared; the message says why."""


def judge(runs: Runs) -> Study:
    """Judge all runs by a reference.

    Raises:
        NothingRunError: there are not two runs to compare.

    """
    truth = _reference(runs)
    if truth is None:
        why = [f"{name}: {reason}" for name, reason in runs.left_out.items()]
        raise NothingRunError(
            "\n".join(["no two runs ended, so there is nothing to compare", *why])
        )
    check, independent = _check(truth, [trial for trial in runs.trials if trial is not truth])
    horizon = agreement(truth.result, check.result) if check else None
    bench = Bench(truth, check, independent, horizon)
    points = [_point(trial, bench) for trial in runs.trials if trial is not truth]
    given = runs.model_trial and (runs.model_trial.method, runs.model_trial.value)
    known = next((point for point in points if (point.method, point.value) == given), None)
    return Study(
        truth,
        check,
        independent,
        horizon,
        scene=runs.scene,
        target=runs.target,
        points=tuple(sorted(points, key=lambda p: (p.method.name, -p.value))),
        model_point=known,
        sources=(*_of_time(runs, known, bench), *_of_the_model(runs, bench)),
        runs=runs,
    )


def _reference(runs: Runs) -> Trial | None:
    """Return the reference: the tight run, or else the finest of all."""
    if len(runs.trials) + (runs.reference is not None) < 2:
        return None
    if runs.reference is not None:
        return runs.reference
    fit = [t for t in runs.trials if t.method.of_rods and t.method.knob == "tolerance"]
    fit = fit or [t for t in runs.trials if t.method.of_rods]
    return min(fit, key=lambda t: (t.value, -t.processor), default=None)


def _check(truth: Trial, others: Sequence[Trial]) -> tuple[Trial | None, bool]:
    """Return the check of the reference: the nearest of independent runs, or else of all runs."""
    rods = [t for t in others if t.method.of_rods]
    independent = [t for t in rods if _independent(t.method, truth.method)]
    end = float(truth.result.time[-1])

    def far(trial: Trial) -> float:
        return errors(trial.result, truth.result, end).largest

    return min(independent or rods, key=far, default=None), bool(independent)


def _independent(method: Method, other: Method) -> bool:
    """Whether two methods share no equations: different engines, or different formulations."""
    return (method.engine, dict(method.settings)) != (other.engine, dict(other.settings))


def _point(trial: Trial, bench: Bench) -> Point:
    off = bench.errors(trial.result)
    steps = trial.result.checks.steps
    claimed = max(off.largest, bench.floor)
    return Point(trial.method, trial.value, trial.processor, len(trial.times), steps, off, claimed)


def _of_time(runs: Runs, point: Point | None, bench: Bench) -> list[Source]:
    """Error of the time steps at the model's own settings; empty where it is not known.

    A link that is not made of rods is compared with the finest run of its own method.
    """
    if runs.model_trial is bench.reference and bench.check is not None:
        # The model's own run is the finest. Its distance from the check bounds its error.
        return [Source("time", bench.errors(bench.check.result), at_most=True)]
    if point is None:
        return []
    if point.method.of_rods:
        return [Source("time", point.errors, at_most=point.below_floor)]
    finest, trial = runs.of(point.method)[0], runs.model_trial
    if trial is None or trial is finest:
        return []
    return [Source("time", bench.errors(trial.result, finest.result))]


def _of_the_model(runs: Runs, bench: Bench) -> list[Source]:
    """Errors of rods and contacts, from runs with more rods and with stiffer contacts."""
    sources = []
    for varied in runs.varied:
        finer, base = varied.finer, varied.base
        apart = bench.errors(varied.result, base.result)
        in_time = bench.floor if base is bench.reference else bench.errors(base.result).largest
        at_most = apart.largest < TRUSTED * in_time
        estimate = apart.times(extrapolated(finer.ratio, finer.order))
        dearer = varied.processor / base.processor
        sources.append(Source(finer.kind, estimate, finer.order, at_most, dearer))
    return sources


MARGIN = 1 / 3  # of the target: largest measured error of an advised setting


@dataclass(frozen=True)
class Advice:
    """`choice` is the cheapest point well within the target, or None; `best` is the most accurate.

    Points with error control at the target, or below, come first: coarser settings reach the target
    by luck. `limit` is a source of error in the model that exceeds the target at any step, or None.
    `below_floor` is true if the references do not agree well enough to judge this target.
    """

    choice: Point | None
    best: Point | None
    limit: Source | None
    below_floor: bool


def advise(study: Study) -> Advice:
    """Choose a setting for the study's target."""
    rods = [point for point in study.points if point.method.of_rods]
    asked, well = study.target * (1 + 1e-9), MARGIN * study.target  # rungs are rounded
    controlled = [p for p in rods if p.method.knob == "tolerance" and p.value <= asked]
    models = [
        s
        for s in study.sources
        if s.kind != "time" and s.errors.largest > study.target and not s.at_most
    ]
    return Advice(
        _cheapest(controlled, well) or _cheapest(rods, well),
        min(rods, key=lambda p: (p.claimed, p.processor), default=None),
        max(models, key=lambda s: s.errors.largest, default=None),
        well < study.floor,
    )


def _cheapest(points: Sequence[Point], most: float) -> Point | None:
    """Return the cheapest point with an error of at most `most` (m); None if there is none.

    For each method only one setting counts: the coarsest for which all finer ones are good enough,
    too. Otherwise noise in the times would decide between similar settings.
    """
    fit = []
    for method in dict.fromkeys(p.method for p in points):
        rungs = sorted((p for p in points if p.method == method), key=lambda p: p.value)
        fit += list(takewhile(lambda p: p.claimed <= most, rungs))[-1:]
    return min(fit, key=lambda p: p.processor, default=None)


def dominating(sources: Sequence[Source]) -> Source | None:
    """Return the largest source of error; None with fewer than two sources, or if all are 0."""
    if len(sources) < 2:
        return None
    largest = max(sources, key=lambda s: s.errors.largest)
    return largest if largest.errors.largest > 0 else None


def needed(value: float, source: Source, target: float) -> float:
    """Return the number of rods, or the stiffness, at which a source falls to the target."""
    return float(value * (source.errors.largest / target) ** (1 / source.order))


def rods_needed(rods: int, source: Source, target: float) -> int:
    """Return the whole number of rods that represents the beam within the target (m)."""
    return ceil(needed(rods, source, target) * (1 - 1e-9))
