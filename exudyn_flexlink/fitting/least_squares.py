"""Numbers of a scene that make its run fit a measured series best, by least squares.

The integrator's error moves these numbers, too, and no standard error shows that. So a finer run is
compared with the last one. The fit tells how far the difference would move each number. If this is
more than a tenth of a standard error, the fit is made again with a smaller tolerance. Several
quantities are weighted by the scatter of their own residuals.

A fit varies numbers of a scene, given by their paths, from their start values and within bounds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf
from typing import Any, cast

import numpy as np
from pydantic_core import PydanticCustomError

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.continuing import springs_as_assembled
from exudyn_flexlink.fitting.series import Against, Series, against
from exudyn_flexlink.loading import assemble_scene, document_of, run_mistakes, scene_of
from exudyn_flexlink.mechanism import extent, kept_interval, least_tolerance
from exudyn_flexlink.observables.parting import TIGHTER
from exudyn_flexlink.quantities import Dimension, Measure, Quantity, to_si
from exudyn_flexlink.result import INTERRUPTED, Result
from exudyn_flexlink.rounding import UNIT_ROUNDING
from exudyn_flexlink.scene import (
    Accuracy,
    Run,
    Scene,
    TorsionalSpring,
    apply_settings,
    check_document,
)
from exudyn_flexlink.source import Document, Mistake, SceneError
from exudyn_flexlink.sweeps import ValuesError, quantity_at, range_of, symbol_of

Vary = str | Sequence[str] | Mapping[str, Any]
"""A path, several paths, or paths with bounds: two numbers (SI), a text '1:20 N/m', or None."""


@dataclass(frozen=True)
class Parameter:
    """A number of a scene that a fit varies, in its SI `unit`, from `start` within bounds."""

    path: str
    unit: str
    start: float
    low: float
    high: float


def parameters_of(scene: Scene, vary: Vary, called: str = "vary") -> list[Parameter]:
    """Return the parameters, each from the scene's value; default bounds are its key's limits.

    `called` is the name of the argument that gives `vary`.

    Raises:
        SceneError: a path leads to no number, or bounds can't be; all such mistakes are in it.

    """
    paths = [vary] if isinstance(vary, str) else vary
    given = paths if isinstance(paths, Mapping) else dict.fromkeys(paths)
    mistakes, parameters = list[Mistake](), list[Parameter]()
    if not given:
        mistakes.append(Mistake((), "nothing is varied", "for example springs.s.stiffness"))
    for path, bounds in given.items():
        try:
            parameters.append(_parameter(scene, path, bounds))
        except (SceneError, ValuesError) as error:
            each = error.mistakes if isinstance(error, SceneError) else [error]
            mistakes += [
                Mistake(tuple(path.split(".")), mistake.message, mistake.hint) for mistake in each
            ]
    if mistakes:
        raise SceneError(Document(called), mistakes)
    return parameters


def _parameter(scene: Scene, path: str, given: Any) -> Parameter:
    steps, value = tuple(path.split(".")), cast(Any, scene.to_data())
    for step in steps:
        value = value.get(step) if isinstance(value, Mapping) else None
    # This raises an error where a path leads nowhere. A key that the scene does not have gets a
    # number; the mistakes of this scene tell whether the key may exist.
    tried = apply_settings(document_of(scene), [(path, 1.0 if value is None else value)])
    if value is None:
        mistakes = [
            mistake
            for mistake in check_document(tried, True).mistakes
            if mistake.path and mistake.path[: len(steps)] == steps[: len(mistake.path)]
        ]
        if mistakes:
            raise SceneError(tried, mistakes)
        raise ValuesError("has no number to start from", f"give it one: {path}=...")
    if not isinstance(value, float):
        raise ValuesError("is no number that varies without steps", "")
    quantity = quantity_at(scene, path) or Quantity(Dimension.NUMBER)
    lows = [end for end in (quantity.above, quantity.at_least) if end is not None]
    low, high = max(lows, default=-inf), inf if quantity.at_most is None else quantity.at_most
    if given is not None:
        bounds = range_of(given)
        ends = [_in_si(bounds.at(part), quantity.dimension) for part in (0.0, 1.0)]
        low, high = max(low, ends[0]), min(high, ends[1])
    if not low <= value <= high:
        raise ValuesError(f"starts at {value:g}, outside its bounds {low:g} to {high:g}", "")
    return Parameter(path, symbol_of(quantity.dimension), value, low, high)


def _in_si(value: float | str, dimension: Measure) -> float:
    try:
        return to_si(value, dimension)
    except PydanticCustomError as error:
        context = error.context or {}
        raise ValuesError(context["message"], context["hint"]) from None


PART = 0.1  # of a standard error: what the integrator may add
MOST_ROUNDS = 4  # of fits, each with a smaller tolerance
SMOOTH = 1e-6  # of the mechanism's reach: no larger tolerance, since slopes are differences of runs
DIFFERENCE = 2e-4  # of a number, to both sides: the relative error of slopes is then 1e-6
MOST_STEPS = 100  # of one search
UNKNOWN_COMBINATION = (
    1e-4  # least singular value of normalised slopes: below it a combination is unknown
)
TAKES_PART = 0.1  # least coefficient of a number that counts as part of such a combination (norm 1)
ALIKE = 0.99  # from this correlation on two numbers can hardly be told apart

Simulate = Callable[[Scene], Result]
Progress = Callable[[float], None]


class NoFitError(ValueError):
    """No numbers could be found; the text says why."""


@dataclass(frozen=True)
class Fit:
    """Numbers of a scene that fit a series best; P of them, SI, by their paths.

    `scene` is the given scene with the fitted `values`. Where the data don't determine a number,
    its standard error is inf, and its `correlations` (P, P) are nan. `integrator` is how far the
    integrator's error at the last tolerance moves each number. The fit took `runs` runs; `against`
    compares the last of them with the series. `warnings` say why numbers can't be trusted.
    """

    scene: Scene
    parameters: tuple[Parameter, ...]
    values: Mapping[str, float]
    standard_errors: Mapping[str, float]
    correlations: FloatArray
    integrator: Mapping[str, float]
    against: Against
    runs: int
    warnings: tuple[str, ...]

    @property
    def residuals(self) -> dict[str, FloatArray]:
        """Computed minus measured values (N,) by quantity, in SI."""
        return self.against.differences


def fit(
    scene: Scene, series: Series, vary: Vary, simulate: Simulate, progress: Progress | None = None
) -> Fit:
    """Fit numbers of a scene to a series; runs are as long as the series, not as the scene's `run`.

    Raises:
        NoFitError: the run with the start values fails, or the search does not converge.
        SceneError: a parameter can't be varied; see `parameters_of`.

    """
    parameters = parameters_of(scene, vary)
    count, time = sum(map(len, series.values.values())), series.time
    if count <= len(parameters):
        raise NoFitError(f"{count} measured values can't tell {len(parameters)} numbers")
    if time[0] < 0 or time[-1] == 0:
        raise NoFitError(f"{series.source} goes from {time[0]:g} to {time[-1]:g} s, a run from 0 s")
    report = progress or (lambda _: None)
    search, value = (
        _Search(scene, series, parameters, simulate, report),
        _values(parameters, "start"),
    )
    for _ in range(MOST_ROUNDS):
        estimate, active = search.estimate(value)
        value, error = estimate.value, estimate.standard_error
        moved = np.abs(estimate.moved_by(search.finer(value)))
        if (moved <= PART * error).all() or not search.tighten():
            break
    last = against(search.run(value), series)
    report(1.0)
    values, errors, by_integrator = (
        {p.path: x for p, x in zip(parameters, values.tolist(), strict=True)}
        for values in (value, error, moved)
    )
    return Fit(
        scene_of(document_of(scene), list(values.items()), True),
        tuple(parameters), values, errors, estimate.correlations, by_integrator, last, search.runs,
        (*_warnings(parameters, estimate, moved, active), *_resting_elsewhere(scene, parameters)),
    )  # fmt: skip


def _warnings(
    parameters: list[Parameter], estimate: Estimate, moved: FloatArray, active: FloatArray
) -> Iterator[str]:
    """Reasons why the fitted numbers can't be trusted."""
    for paths in estimate.unknown:
        reason = f"the data do not depend on {paths[0]}: it is where it began"
        yield reason if len(paths) == 1 else f"the data can't tell {' and '.join(paths)} apart"
    for (i, j), value in np.ndenumerate(estimate.correlations):
        if i < j and abs(value) > ALIKE:
            names = f"{estimate.names[i]} and {estimate.names[j]}"
            yield f"the data hardly tell {names} apart: their correlation is {value:.5f}"
    rows = zip(parameters, moved.tolist(), estimate.standard_error.tolist(), active, strict=True)
    for p, moves, error, bound in rows:
        if bound:
            yield f"{p.path} ends at its bound, {p.low if bound < 0 else p.high:g}"
        if moves > PART * error:
            yield (
                f"the integrator's error moves {p.path} by {moves:.2g}, more than a tenth of its "
                f"standard error, {error:.2g}: no smaller tolerance helped"
            )


def _resting_elsewhere(scene: Scene, parameters: list[Parameter]) -> Iterator[str]:
    """Warn of springs whose rest is the assembled state: other numbers may move this state."""
    rests = springs_as_assembled(scene)
    for p in parameters:
        change = DIFFERENCE * (abs(p.start) or 1.0)
        value = p.start + change if p.start + change <= p.high else p.start - change
        varied = scene_of(document_of(scene), [(p.path, value)], True)
        changed = springs_as_assembled(varied)
        for name, spring in scene.springs.items():
            turns = isinstance(spring, TorsionalSpring)
            key, unit = ("rest_angle", "rad") if turns else ("length", "m")
            before, after = (getattr(springs[name], key) for springs in (rests, changed))
            if getattr(spring, key) is None and before != after:
                yield (
                    f"{p.path} also moves where spring '{name}' rests, as the mechanism is "
                    f"assembled: give its '{key}', {before:.4g} {unit} as the fit began"
                )


def _values(parameters: list[Parameter], field: str) -> FloatArray:
    return np.array([getattr(p, field) for p in parameters])


@dataclass(frozen=True)
class Estimate:
    """P numbers by `names`, with `residuals` (N,) and their `slopes` (N, P) by the numbers.

    s^2 = RSS / (N - P). Standard errors are the square roots of the diagonal of s^2 (J^T J)^-1.
    """

    names: Sequence[str]
    value: FloatArray
    residuals: FloatArray
    slopes: FloatArray

    @cached_property
    def unknown(self) -> list[list[str]]:
        """Groups of names: the data don't determine a combination of each, or a single number."""
        unit = self.slopes / self._size
        values, columns = np.linalg.eigh(unit.T @ unit)
        lost = np.abs(columns.T[values < UNKNOWN_COMBINATION**2]) > TAKES_PART
        return [[name for name, gone in zip(self.names, row, strict=True) if gone] for row in lost]

    @cached_property
    def _size(self) -> FloatArray:
        size = np.linalg.norm(self.slopes, axis=0)
        return np.where(size == 0, 1.0, size)

    @cached_property
    def _inverse(self) -> FloatArray:
        """Pseudo-inverse (P, N) of the slopes, without unknown combinations."""
        return np.asarray(
            np.linalg.pinv(self.slopes / self._size, UNKNOWN_COMBINATION) / self._size[:, None]
        )

    @cached_property
    def standard_error(self) -> FloatArray:
        """Standard errors (P,); inf where the data don't determine a number."""
        scatter = np.sqrt(np.sum(self.residuals**2) / np.subtract(*self.slopes.shape))
        lost = [any(name in each for each in self.unknown) for name in self.names]
        return np.where(lost, inf, scatter * np.linalg.norm(self._inverse, axis=1))

    @property
    def correlations(self) -> FloatArray:
        """Correlations (P, P); nan where the data don't determine a number."""
        root = np.linalg.norm(self._inverse, axis=1)
        root = np.where(np.isfinite(self.standard_error) & (root > 0), root, np.nan)
        return np.asarray(self._inverse @ self._inverse.T / np.outer(root, root))

    def moved_by(self, residuals: FloatArray) -> FloatArray:
        """How far (P,) the numbers would move if these were the residuals (N,)."""
        return np.asarray(self._inverse @ (self.residuals - residuals))


class _Search:
    """Runs a scene with different numbers, and searches for the numbers that fit best."""

    def __init__(
        self, scene: Scene, series: Series, parameters: list[Parameter], simulate: Simulate,
        progress: Progress,
    ) -> None:  # fmt: skip
        self._series, self._parameters, self._simulate = series, parameters, simulate
        self._progress, self.runs, self._failed = progress, 0, ""
        self._scale = np.array([abs(p.start) or 1.0 for p in parameters])
        self._scatter = {n: float(np.std(values)) or 1.0 for n, values in series.values.items()}
        accuracy, reach = scene.accuracy, extent(assemble_scene(scene))
        if accuracy.tolerance is not None:
            accuracy = Accuracy(tolerance=min(accuracy.tolerance, SMOOTH * reach))
        self._base = scene.changed(accuracy=accuracy, run=self._run_of(scene))
        for mistake in run_mistakes(self._base):
            raise NoFitError(f"the series can't be run through: the run {mistake.message}")

    def _run_of(self, scene: Scene) -> Run:
        """A run as long as the series; samples are at its instants if these are evenly spaced."""
        end = float(self._series.time[-1])
        spacing = np.diff(np.unique(self._series.time), prepend=0.0)
        long, mechanism = scene.changed(run=Run(duration=end)), assemble_scene(scene).mechanism
        most, usual = kept_interval(long, mechanism, end), float(np.median(spacing))
        most = min(most, scene.run.sample or inf)
        return Run(duration=end, sample=usual / float(np.ceil(usual / most * (1 - 1e-9))))

    def run(self, value: FloatArray, base: Scene | None = None) -> Result:
        """Run the scene with these numbers.

        Raises:
            NoFitError: the run stops before its end.
            SceneError: the scene has mistakes with these numbers.

        """
        numbers = [(p.path, x) for p, x in zip(self._parameters, value.tolist(), strict=True)]
        result = self._simulate(scene_of(document_of(base or self._base), numbers, True))
        if result.outcome.reason == INTERRUPTED:
            raise KeyboardInterrupt
        if not result.outcome.completed:
            raise NoFitError(f"a run {result.outcome.ending}")
        self.runs += 1
        usual = 6 * (1 + 2 * len(self._parameters))  # runs, as an estimate for the progress
        self._progress(self.runs / (self.runs + usual))
        return result

    def finer(self, value: FloatArray) -> FloatArray:
        """Weighted residuals (N,) of a run with a smaller error, and twice as many samples."""
        usual = self._base.run
        run = Run(duration=usual.duration, until=usual.until, sample=(usual.sample or inf) / 2)
        return self._residuals(self.run(value, self._finer().changed(run=run)))

    def _finer(self) -> Scene:
        """The scene with a smaller tolerance or step, if it has either."""
        accuracy = self._base.accuracy
        if accuracy.tolerance is None:
            return self._base.changed(accuracy=Accuracy(step=(accuracy.step or inf) * TIGHTER))
        least = least_tolerance(assemble_scene(self._base))
        finer = Accuracy(tolerance=max(accuracy.tolerance * TIGHTER, least))
        return self._base.changed(accuracy=finer)

    def tighten(self) -> bool:
        """Run with a smaller tolerance or step from now on, if possible."""
        before, self._base = self._base, self._finer()
        return self._base.accuracy != before.accuracy

    def _residuals(self, result: Result) -> FloatArray:
        """Weighted residuals (N,) of a run."""
        apart = against(result, self._series).differences
        return np.concatenate([residual / self._scatter[name] for name, residual in apart.items()])

    def _tried(self, scaled: FloatArray) -> FloatArray:
        """Residuals (N,) at scaled numbers (P,); nan if a run fails: a shorter step follows."""
        try:
            return self._residuals(self.run(scaled * self._scale))
        except (NoFitError, SceneError) as error:
            self._failed = str(error)
            return np.full(sum(map(len, self._series.values.values())), np.nan)

    def estimate(self, value: FloatArray) -> tuple[Estimate, FloatArray]:
        """Search from numbers (P,), and again if the series has several quantities.

        The second search weights each quantity by the scatter of its residuals after the first one.
        Also returns the bound that each number is at: -1 the lower, 1 the upper, 0 none.

        Raises:
            NoFitError: a run fails, or the search does not converge.

        """
        estimate, active = self._minimised(value)
        if len(self._scatter) > 1:
            each = np.split(estimate.residuals, len(self._scatter))
            for name, residual in zip(self._scatter, each, strict=True):
                self._scatter[name] *= float(np.sqrt(np.mean(residual**2))) or 1.0
            estimate, active = self._minimised(estimate.value)
        return estimate, active

    def _minimised(self, value: FloatArray) -> tuple[Estimate, FloatArray]:
        from scipy.optimize import least_squares  # noqa: PLC0415 - see `against`

        bounds = [_values(self._parameters, end) / self._scale for end in ("low", "high")]
        try:
            solved = least_squares(
                self._tried, value / self._scale, "3-point", bounds, gtol=UNIT_ROUNDING,
                x_scale="jac", diff_step=DIFFERENCE, max_nfev=MOST_STEPS,
            )  # fmt: skip
        except ValueError as error:
            raise NoFitError(self._failed or str(error)) from None
        if solved.status == 0:
            raise NoFitError(f"no end was found in {MOST_STEPS} steps: start nearer, or vary less")
        names = [p.path for p in self._parameters]
        estimate = Estimate(names, solved.x * self._scale, solved.fun, solved.jac / self._scale)
        return estimate, solved.active_mask
