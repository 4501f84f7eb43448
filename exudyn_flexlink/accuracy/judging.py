"""Runs of a study to what they say: errors against a reference, a floor, sources of error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from exudyn_flexlink.accuracy.errors import Errors, Horizon, agreement, errors
from exudyn_flexlink.accuracy.methods import Method
from exudyn_flexlink.accuracy.runs import Runs, Trial
from exudyn_flexlink.accuracy.sources import extrapolated
from exudyn_flexlink.observables import STILL, judged_points, room
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene

ROUNDING = 1e-15  # m: nobody knows a position better
TRUSTED = 3.0  # times the error of time: a smaller difference is not told apart from it


@dataclass(frozen=True)
class Point:
    """One point of the work-precision figure: processor time (s), errors (m) against the truth."""

    method: Method
    value: float
    processor: float
    repeats: int
    steps: int
    errors: Errors
    claimed: float  # m: the largest error, or the floor if that is higher

    @property
    def below_floor(self) -> bool:
        """Whether the references do not agree well enough to tell this error."""
        return self.claimed > self.errors.largest

    @property
    def told(self) -> str:
        """The point in words."""
        return self.method.told(self.value)


@dataclass(frozen=True)
class Source:
    """Error at the model's own settings that comes from one cause: time, rods or contact.

    `at_most`: the runs it was told from differ by little more than their errors of time.
    `order` is that at which it falls with the number of rods, or the stiffness; `dearer` is the
    cost of the finer model over that of the scene's.
    """

    kind: str
    errors: Errors
    order: float = 0.0
    at_most: bool = False
    dearer: float = 1.0


@dataclass(frozen=True)
class Bench:
    """What everything is judged by: a reference run, and the `check` it was held against, if any.

    `independent`: by other equations of motion or another formulation. `horizon` tells why errors
    are not judged up to the end, None if they are.
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
        """Distance of reference and check, m: smaller errors can't be told; 0 without a check."""
        return 0.0 if self._apart is None else max(self._apart.largest, ROUNDING)

    @property
    def force_floor(self) -> float:
        """Distance of the force that is farthest off, as a part of it; 0 without a check."""
        return 0.0 if self._apart is None else self._apart.force

    def errors(self, result: Result, reference: Result | None = None) -> Errors:
        """Errors of a run as far as any are judged, by the reference or another run."""
        return errors(result, reference or self.reference.result, self.until)


@dataclass(frozen=True)
class Study(Bench):
    """What a study found: `points` of the figure are settings that were run, `own` the model's."""

    scene: Scene
    target: float
    points: tuple[Point, ...]
    own: Point | None
    sources: tuple[Source, ...]
    runs: Runs

    @property
    def judged_by(self) -> tuple[str, ...]:
        """Names of the points of the mechanism whose errors are told."""
        return judged_points(self.reference.result.scene)

    @cached_property
    def still(self) -> bool:
        """Whether none of these points moves."""
        return room(self.reference.result, self.judged_by) <= STILL


class NothingRunError(Exception):
    """No two runs ended, so that there is nothing to compare; the message says why."""


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
    given = runs.own and (runs.own.method, runs.own.value)
    own = next((point for point in points if (point.method, point.value) == given), None)
    return Study(
        truth,
        check,
        independent,
        horizon,
        scene=runs.scene,
        target=runs.target,
        points=tuple(sorted(points, key=lambda p: (p.method.name, -p.value))),
        own=own,
        sources=(*_of_time(runs, own, bench), *_of_the_model(runs, bench)),
        runs=runs,
    )


def _reference(runs: Runs) -> Trial | None:
    """Find the run that everything is judged by: the tight one, or else the finest there is."""
    if len(runs.trials) + (runs.reference is not None) < 2:
        return None
    if runs.reference is not None:
        return runs.reference
    fit = [t for t in runs.trials if t.method.of_rods and t.method.knob == "tolerance"]
    fit = fit or [t for t in runs.trials if t.method.of_rods]
    return min(fit, key=lambda t: (t.value, -t.processor), default=None)


def _check(truth: Trial, others: Sequence[Trial]) -> tuple[Trial | None, bool]:
    """Find what the reference is held against: the independent run nearest to it, or any run."""
    rods = [t for t in others if t.method.of_rods]
    independent = [t for t in rods if _independent(t.method, truth.method)]
    end = float(truth.result.time[-1])

    def far(trial: Trial) -> float:
        return errors(trial.result, truth.result, end).largest

    return min(independent or rods, key=far, default=None), bool(independent)


def _independent(one: Method, other: Method) -> bool:
    """Whether two methods share no equations: other engines, or other formulations of one."""
    return (one.engine, dict(one.settings)) != (other.engine, dict(other.settings))


def _point(trial: Trial, bench: Bench) -> Point:
    found = bench.errors(trial.result)
    steps = trial.result.checks.steps
    claimed = max(found.largest, bench.floor)
    return Point(
        trial.method, trial.value, trial.processor, len(trial.times), steps, found, claimed
    )


def _of_time(runs: Runs, own: Point | None, bench: Bench) -> list[Source]:
    """Error of the time steps at the model's own settings; none where nothing tells it.

    A link that is not made of rods is held against the finest run of its own kind.
    """
    if runs.own is bench.reference and bench.check is not None:
        # The finest run of all: it is off by no more than the check is from it.
        return [Source("time", bench.errors(bench.check.result), at_most=True)]
    if own is None:
        return []
    if own.method.of_rods:
        return [Source("time", own.errors, at_most=own.below_floor)]
    finest, trial = runs.of(own.method)[0], runs.own
    if trial is None or trial is finest:
        return []
    return [Source("time", bench.errors(trial.result, finest.result))]


def _of_the_model(runs: Runs, bench: Bench) -> list[Source]:
    """Errors of rods and contacts, from the scene changed in them."""
    found = []
    for varied in runs.varied:
        finer, base = varied.finer, varied.base
        apart = bench.errors(varied.result, base.result)
        in_time = bench.floor if base is bench.reference else bench.errors(base.result).largest
        at_most = apart.largest < TRUSTED * in_time
        estimate = apart.times(extrapolated(finer.ratio, finer.order))
        dearer = varied.processor / base.processor
        found.append(Source(finer.kind, estimate, finer.order, at_most, dearer))
    return found
