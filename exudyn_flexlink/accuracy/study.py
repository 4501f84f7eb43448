"""The runs of a work-precision study, in the order of what they tell, within a budget of time.

First the model's own settings, by its own method and by the judge, then the tight reference, then
the scene with more rods and stiffer contacts, then what the reference is checked by, then ever
finer settings from coarse ones on, cheapest first. A run that would exceed the budget is not
started: see `predict`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import inf, isfinite
from time import monotonic

from exudyn_flexlink.accuracy.methods import (
    REFERENCE,
    Method,
    ladder,
    own_method,
    own_tolerance,
    own_value,
)
from exudyn_flexlink.accuracy.runs import (
    SLOPES,
    RefusedError,
    Runs,
    Solve,
    Solved,
    Trial,
    Varied,
    predict,
)
from exudyn_flexlink.accuracy.sources import MORE_RODS_COST, STIFFER_COST, finer_scenes
from exudyn_flexlink.mechanism import build_mechanism, end_of_run
from exudyn_flexlink.scene import Run, Scene

JUDGE = "lagrangian"  # the engine whose tight run everything is held against
REPEATS = 3
AT_ONCE = 1.0  # s: a run is repeated for as long as that
WARM_UP = 0.01  # of a run: gives a first idea of what a run costs
DEAR = 10  # a run of more than a tenth of the time left is dear: coarser first, no repetition
FIRST_SHARE = 3  # of the time left: what a method of unknown cost may take
COARSER = (1.0, 10.0, 100.0)  # times the model's own setting, where that takes too long
REFERENCE_COST = 8.0  # times that of the judge at the model's own settings, or less
SECOND_ORDER = 3.0  # steps of a fixed length to one under error control, for a fair first error
LEFT_FOR_FILES = 4.0  # s of the budget, for figure and tables


class Studying:
    """Makes the runs of a study; `run` gives them, also if the user stops it in between."""

    def __init__(
        self, runs: Runs, solve: Solve, budget: float, clock: Callable[[], float] = monotonic
    ) -> None:
        self.runs = runs
        self._solve = solve
        self._clock = clock
        self._began = clock()
        self._deadline = self._began + budget - min(LEFT_FOR_FILES, budget / 10)
        self._guesses: dict[str, tuple[float, float]] = {}  # a value, and what a run costs there, s

    @property
    def left(self) -> float:
        """Time left, s."""
        return self._deadline - self._clock()

    def run(self) -> Runs:
        """Make all runs there is time for."""
        try:
            self._warm_up()
            self._own_settings()
            self._refer()
            self._vary()
            self._confirm()
            self._climb()
        except KeyboardInterrupt:
            self.runs.interrupted = True
        self.runs.spent = self._clock() - self._began
        return self.runs

    def _methods(self) -> Iterator[Method]:
        """Methods that represent the scene, as far as is known: the model's own, then by cost."""
        own = own_method(self.runs.scene, self.runs.methods)
        fit = [m for m in self.runs.methods if m.name not in self.runs.refused]
        yield from sorted(fit, key=lambda m: (m != own, self._guesses.get(m.name, (0.0, inf))[1]))

    def _warm_up(self) -> None:
        """Run the beginning of the motion by every method: what can't be run is found at once.

        Twice, since the first imports the engine, which is no part of the budget.
        """
        scene = self.runs.scene
        end = end_of_run(scene, build_mechanism(scene))
        part = WARM_UP * end if isfinite(end) else WARM_UP
        short = scene.changed(run=Run(duration=part, sample=part))
        for method in self.runs.methods:
            value = own_value(scene, method) or part / 10
            try:
                label, begun = f"{method.name}, warming up", method.at(short, value)
                first = self._solve(begun, method.engine, label, inf)
                solved = self._solve(begun, method.engine, label, inf)
                self._deadline += max(first.wall - solved.wall, 0.0)
                around = max(solved.wall - solved.processor, 0.0)
                self._guesses[method.name] = value, around + solved.processor / WARM_UP
            except RefusedError as error:
                self.runs.refused[method.name] = str(error)

    def _own_settings(self) -> None:
        """Run the model's own settings, or the nearest that take not too long; so does the judge.

        The others begin with coarser ones, but something has to run. What is left out at first for
        lack of time may yet be run later, when costs are known.
        """
        own = own_method(self.runs.scene, self.runs.methods)
        for method in self._methods():
            value = own_value(self.runs.scene, method)
            if value is None or (method != own and method.engine != JUDGE and self.runs.trials):
                continue
            for factor in COARSER:
                if self._try(method, factor * value) or self.runs.trials:
                    break
        if self.runs.own is not None and self.runs.own.wall > self.left / DEAR:
            self._try(self.runs.own.method, 10 * self.runs.own.value)

    def _begin(self, method: Method) -> float | None:
        """Value that the model gives, or a step (s) from its own run's mean one; None: unknown."""
        own, value = self.runs.own, own_value(self.runs.scene, method)
        if value is not None or own is None or own.result.checks.steps < 1:
            return value
        mean = own.result.time[-1] / own.result.checks.steps
        return float(f"{mean / SECOND_ORDER:.1g}")

    def _try(self, method: Method, value: float) -> Trial | None:
        """Run a method at a value if time allows; None if not, or if it failed."""
        label = method.told(value)
        expected = self._expected(method, value)
        if expected > self.left and self.runs.trials:  # without any, a guess is not enough
            self._leave_out(label, expected)
            return None
        scene = method.at(self.runs.scene, value)
        unknown = not self.runs.of(method) and self.runs.trials
        solved = self._solved(scene, method, label, FIRST_SHARE if unknown else 1)
        if solved is None:
            return None
        trial = Trial(method, value, scene, solved.result, solved.wall, [solved.processor])
        self.runs.trials.append(trial)
        for _ in range(REPEATS - 1):  # of a short run: the least of several times is the truest
            if (len(trial.times) + 1) * trial.wall < min(AT_ONCE, self.left / DEAR):
                again = self._solve(scene, method.engine, f"{label}, again", self.left)
                trial.times += [] if again.given_up else [again.processor]
        return trial

    def _expected(self, method: Method, value: float) -> float:
        """Expected wall time of a run, s."""
        if known := self.runs.costs(method):
            return self.runs.slowness * predict(known, value, method.knob)
        at, cost = self._guesses[method.name]
        return self.runs.slowness * cost * float((at / value) ** SLOPES[method.knob])

    def _leave_out(self, label: str, expected: float) -> None:
        if not any(told.startswith(f"{label} (") for told in self.runs.left_out):
            self.runs.left_out.append(f"{label} (about {expected:.2g} s)")

    def _solved(self, scene: Scene, method: Method, label: str, share: int = 1) -> Solved | None:
        """Run a scene in the time left, or a `share`-th of it; None if that was not to be.

        It was refused then, failed, or would have taken too long.
        """
        try:
            solved = self._solve(scene, method.engine, label, self.left / share)
        except RefusedError as error:
            self.runs.refused[label] = str(error)
            return None
        if solved.given_up:
            self._leave_out(label, solved.wall)
            return None
        outcome = solved.result.outcome
        if not outcome.completed:
            self.runs.failed[label] = outcome.told
            return None
        return solved

    def _refer(self) -> None:
        """Run the tight reference, if there is an independent engine for it."""
        method = next((m for m in self._methods() if m.engine == JUDGE), None)
        own = self.runs.of(method)[0] if method and self.runs.of(method) else None
        if method is None or own is None:
            return
        label = f"{method.told(REFERENCE)}, reference"
        if REFERENCE_COST * own.wall > self.left:
            self._leave_out(label, REFERENCE_COST * own.wall)
            return
        value = REFERENCE
        scene = method.at(self.runs.scene, value)
        solved = self._solved(scene, method, label)
        if solved is not None:
            times = [solved.processor]
            self.runs.reference = Trial(method, value, scene, solved.result, solved.wall, times)

    def _confirm(self) -> None:
        """Check the reference by the model's own method at one rung finer than its settings.

        And at a coarser one before, which tells what the finer will cost.
        """
        own = self.runs.own
        if self.runs.reference is None or own is None or own.method.knob == "step":
            return
        for value in (10 * own.value, own.value / 10):
            short = self._expected(own.method, value) <= self.left / FIRST_SHARE
            if short and not self.runs.has(own.method, value):
                self._try(own.method, value)

    def _vary(self) -> None:
        """Run the scene with more rods and with stiffer contacts, by the cheapest method."""
        for finer in finer_scenes(self.runs.scene):
            method = self._cheapest()
            if method is None:
                continue
            label = f"{method.name}, varying: {finer.kind}"
            base = self._base(method, finer.dearer)
            if base is None:
                self._leave_out(label, finer.dearer * min(t.wall for t in self.runs.of(method)))
                continue
            solved = self._solved(method.at(finer.scene, base.value), method, label)
            if solved is not None:
                self.runs.varied.append(Varied(finer, solved.result, base, solved.processor))

    def _cheapest(self) -> Method | None:
        """Return the method of rods whose runs at given tolerances have been the cheapest."""
        known = [t for t in self.runs.trials if t.method.of_rods and t.method.knob == "tolerance"]
        if not known:
            return None
        value = own_tolerance(self.runs.scene)
        return min((t.method for t in known), key=lambda m: self._expected(m, value / 10))

    def _base(self, method: Method, dearer: float) -> Trial | None:
        """Return the finest run that a changed scene, `dearer` times as costly, can be held to.

        One rung finer than the model's own setting, if that leaves plenty of time for the others.
        """
        value = own_tolerance(self.runs.scene)
        every = 1 + MORE_RODS_COST + STIFFER_COST
        expected = every * self._expected(method, value / 10)
        if expected <= self.left / 2 and not self.runs.has(method, value / 10):
            self._try(method, value / 10)
        return next((t for t in self.runs.of(method) if dearer * t.wall <= self.left), None)

    def _climb(self) -> None:
        """Run ever finer settings, the cheapest of all methods next."""
        waiting = {m.name: self._rungs(m) for m in self._methods()}
        while any(waiting.values()):
            ready = [m for m in self.runs.methods if waiting.get(m.name)]
            method = min(ready, key=lambda m: self._expected(m, waiting[m.name][0]))
            value = waiting[method.name].pop(0)
            if self._try(method, value) is None and self._ends(method, value):
                finer = waiting.pop(method.name)
                if finer:
                    self.runs.left_out.append(f"{method.told(finer[0])}, and what is finer")

    def _ends(self, method: Method, value: float) -> bool:
        """Tell whether a ladder ends with a rung that did not work: finer ones take longer.

        Unless it was too coarse to work.
        """
        known = self.runs.costs(method)
        return value < max(known) if known else method.told(value) not in self.runs.failed

    def _rungs(self, method: Method) -> list[float]:
        """Rungs of a method's ladder that were not run yet."""
        own = self._begin(method)
        rungs = [] if own is None else ladder(method.knob, own, self.runs.target)
        return [value for value in rungs if not self.runs.has(method, value)]


def study(scene: Scene, methods: Sequence[Method], target: float, solve: Solve,
          budget: float) -> Runs:  # fmt: skip
    """Make all runs that a budget (s) allows; `target` (m) is the error somebody wants."""
    return Studying(Runs(scene, target, list(methods)), solve, budget).run()
