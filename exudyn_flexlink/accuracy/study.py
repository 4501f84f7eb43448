"""The runs of a work-precision study, in the order of what they tell, within a budget of time.

First the model's own settings, by its own method and by the judge, then the tight reference, then
the scene with more rods and stiffer contacts, then ever finer settings from coarse ones on, next
that of the method whose last run was the cheapest. A run that takes more than half of the time left
is stopped, and nothing finer is tried by its method.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import takewhile
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
from exudyn_flexlink.accuracy.runs import RefusedError, Runs, Solve, Solved, Trial, Varied
from exudyn_flexlink.accuracy.sources import finer_scenes
from exudyn_flexlink.mechanism import build_mechanism, end_of_run
from exudyn_flexlink.scene import Run, Scene

JUDGE = "lagrangian"  # the engine whose tight run everything is held against
SHARE = 0.5  # of the time left: what a run may take
NO_TIME = "no time"
REPEATS = 3
AT_ONCE = 1.0  # s: runs are repeated that take no longer with all repetitions
WARM_UP = 0.01  # of a run
COARSER = (1.0, 10.0, 100.0)  # times the model's own setting, where that takes too long
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
        self._budget = budget - min(LEFT_FOR_FILES, budget / 10)
        self._deadline = inf

    @property
    def _allowed(self) -> float:
        """Time that a run may take, s."""
        return SHARE * max(self._deadline - self._clock(), 0.0)

    def run(self) -> Runs:
        """Make all runs there is time for."""
        began = self._clock()
        try:
            self._warm_up()
            self._deadline = self._clock() + self._budget
            self._own_settings()
            self._refer()
            self._vary()
            self._climb()
        except KeyboardInterrupt:
            self.runs.interrupted = True
        self.runs.spent = self._clock() - began
        return self.runs

    def _methods(self) -> list[Method]:
        """Methods that represent the scene, as far as is known: the model's own first."""
        return [m for m in self.runs.methods if m.name not in self.runs.left_out]

    def _warm_up(self) -> None:
        """Run the beginning of the motion by every method: what can't be run is found at once.

        Engines are imported by that, which is no part of the budget.
        """
        scene = self.runs.scene
        end = end_of_run(scene, build_mechanism(scene))
        part = WARM_UP * end if isfinite(end) else WARM_UP
        short = scene.changed(run=Run(duration=part, sample=part))
        for method in self.runs.methods:
            begun = method.at(short, own_value(scene, method) or part / 10)
            try:
                self._solve(begun, method.engine, f"{method.name}, warming up", inf)
            except RefusedError as error:
                self.runs.left_out[method.name] = str(error)

    def _own_settings(self) -> None:
        """Run the model's own settings, or the nearest that take not too long; so does the judge.

        The others begin with coarser ones, but something has to run.
        """
        own = own_method(self.runs.scene, self.runs.methods)
        for method in self._methods():
            value = own_value(self.runs.scene, method)
            if value is None or (method != own and method.engine != JUDGE and self.runs.trials):
                continue
            for factor in COARSER:
                if self._try(method, factor * value) or self.runs.trials:
                    break

    def _try(self, method: Method, value: float) -> Trial | None:
        """Run a method at a value; None if it failed, or there was no time."""
        label, scene = method.told(value), method.at(self.runs.scene, value)
        solved = self._solved(scene, method, label)
        if solved is None:
            return None
        trial = Trial(method, value, solved.result, [solved.processor])
        self.runs.trials.append(trial)
        if REPEATS * solved.processor < AT_ONCE:  # the least of several times is the truest
            for _ in range(REPEATS - 1):
                again = self._solve(scene, method.engine, f"{label}, again", self._allowed)
                trial.times += [] if again.given_up else [again.processor]
        return trial

    def _solved(self, scene: Scene, method: Method, label: str) -> Solved | None:
        """Run a scene; None if it was refused, failed, or takes too long."""
        try:
            solved = self._solve(scene, method.engine, label, self._allowed)
        except RefusedError as error:
            self.runs.left_out[label] = str(error)
            return None
        outcome = solved.result.outcome
        if solved.given_up or not outcome.completed:
            self.runs.left_out[label] = NO_TIME if solved.given_up else outcome.told
            return None
        return solved

    def _refer(self) -> None:
        """Run the tight reference, if there is an independent engine for it."""
        for method in self._methods():
            if method.engine == JUDGE:
                scene = method.at(self.runs.scene, REFERENCE)
                solved = self._solved(scene, method, f"{method.told(REFERENCE)}, reference")
                if solved is not None:
                    times = [solved.processor]
                    self.runs.reference = Trial(method, REFERENCE, solved.result, times)

    def _vary(self) -> None:
        """Run the scene with more rods and with stiffer contacts, by the cheapest method.

        Each is held against the finest run of that method, one rung finer than the model's own
        setting if there is time for it.
        """
        known = [t for t in self.runs.trials if t.method.of_rods and t.method.knob == "tolerance"]
        scenes = finer_scenes(self.runs.scene)
        if not known or not scenes:
            return
        method = min(known, key=lambda t: t.processor).method
        value = own_tolerance(self.runs.scene)
        if self.runs.has(method, value):
            self._try(method, value / 10)
        base = self.runs.of(method)[0]
        for finer in scenes:
            label = f"{method.name}, varying: {finer.kind}"
            solved = self._solved(method.at(finer.scene, base.value), method, label)
            if solved is not None:
                self.runs.varied.append(Varied(finer, solved.result, base, solved.processor))

    def _climb(self) -> None:
        """Run ever finer settings, next that of the method whose last run was the cheapest."""
        waiting = {method: self._rungs(method) for method in self._methods()}
        last = dict.fromkeys(waiting, 0.0)
        while ready := [method for method, rungs in waiting.items() if rungs]:
            method = min(ready, key=lambda m: last[m])
            value = waiting[method].pop(0)
            trial = self._try(method, value)
            if trial is not None:
                last[method] = trial.processor
            elif (out := self.runs.left_out)[method.told(value)] == NO_TIME:
                finer = waiting.pop(method)
                out |= {f"{method.told(x)}, and what is finer": NO_TIME for x in finer[:1]}

    def _rungs(self, method: Method) -> list[float]:
        """Rungs of a method's ladder that were not run yet, up to one that took too long."""
        value = self._begin(method)
        rungs = [] if value is None else ladder(method.knob, value, self.runs.target)
        out = self.runs.left_out
        short = takewhile(lambda rung: out.get(method.told(rung)) != NO_TIME, rungs)
        return [rung for rung in short if not self.runs.has(method, rung)]

    def _begin(self, method: Method) -> float | None:
        """Value that the model gives, or a step (s) from its own run's mean one; None: unknown."""
        own, value = self.runs.own, own_value(self.runs.scene, method)
        if value is not None or own is None or own.result.checks.steps < 1:
            return value
        mean = own.result.time[-1] / own.result.checks.steps
        return float(f"{mean / SECOND_ORDER:.1g}")


def study(scene: Scene, methods: Sequence[Method], target: float, solve: Solve,
          budget: float) -> Runs:  # fmt: skip
    """Make all runs that a budget (s) allows; `target` (m) is the error somebody wants."""
    return Studying(Runs(scene, target, list(methods)), solve, budget).run()
