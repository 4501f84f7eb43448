"""The commands that make many runs of one model: `accuracy`, `fit` and `stability`."""

from __future__ import annotations

import argparse
import signal
import time
from collections.abc import Callable
from functools import partial
from math import inf

from exudyn_flexlink import accuracy, engines, stability
from exudyn_flexlink.cli.ctrl_c import deferrable_interrupts, ends_runs
from exudyn_flexlink.cli.figures import draw_figure
from exudyn_flexlink.cli.keeping import drawn, written
from exudyn_flexlink.cli.placing import Place
from exudyn_flexlink.cli.running import read_scene, refuse_idle_integrator, simulating, single_runs
from exudyn_flexlink.cli.terminal import (
    BAD_INPUT,
    DONE,
    FAILED,
    INTERRUPTED,
    Quiet,
    complain,
    progress_bar,
)
from exudyn_flexlink.cli.values import pairs
from exudyn_flexlink.engines.interrupts import LateInterruptError
from exudyn_flexlink.fitting import NoFitError, fit, read_series
from exudyn_flexlink.loading import require_length
from exudyn_flexlink.report import accuracy_text, fit_text, recommendation, stability_text
from exudyn_flexlink.result import INTERRUPTED as STOPPED
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.storage import save_accuracy, save_fit, save_stability

DEFAULT_TARGET = 1e-4  # m, where the model gives a step
IMPOSSIBLE = stability.ImpossibleLapsError, stability.NoRhythmError, stability.TooShortError
UNTOLD = "interrupted before anything was found; nothing was written"


def accuracy_command(options: argparse.Namespace) -> int:
    """Study a model, write and print what accuracy costs; returns the exit code."""
    place = Place(options, "-accuracy", "study")
    scene = read_scene(options)
    require_length("--target", options.target, scene)
    try:
        # The folder is staged first: one that can't be written is no news for the end of a study.
        with place.written() as folder:
            runs = _runs(scene, options)
            with deferrable_interrupts() as ctrl_c:
                ctrl_c.defer()
                found = accuracy.judge(runs)
                save_accuracy(found, recommendation(found), folder)
            code = INTERRUPTED if ctrl_c.pending else DONE
            if code == DONE and not options.no_plots:
                draw = partial(draw_figure, options, "work_precision", found, folder)
                code = drawn(folder, draw)
    except accuracy.NothingRunError as error:
        if runs.interrupted:
            told = "interrupted before there were two runs to compare; nothing was written"
            return complain(told, INTERRUPTED)
        budget = f"raise '--budget' ({options.budget:g} s)"
        shorter = "shorten the run with '--set run.turns=...'"
        return complain(f"{error}\n{budget}, or {shorter}", FAILED)
    place.tell(accuracy_text(found, simulating(options)))
    if found.runs.interrupted:
        settings = f"setting{'s' * (len(found.points) != 1)}"
        return place.ended(INTERRUPTED, f"the {len(found.points)} {settings} judged until then")
    return place.ended(code, "the study is whole")


def _runs(scene: Scene, options: argparse.Namespace) -> accuracy.Runs:
    ways = {engine: engines.formulations(scene, engine) for engine in engines.ENGINES}
    methods = accuracy.methods_of(scene, ways)
    target = options.target or scene.accuracy.tolerance or DEFAULT_TARGET
    with progress_bar(options.quiet, "accuracy") as bar:
        return accuracy.study(scene, methods, target, Solver(bar, options.budget), options.budget)


class Solver:
    """Runs scenes and shows the part of the budget that is used; stops runs that take too long."""

    def __init__(self, bar: Quiet, budget: float) -> None:
        self._bar, self._budget = bar, budget
        self._ends = time.monotonic() + budget

    def __call__(self, scene: Scene, engine: str, label: str, allowed: float) -> accuracy.Solved:
        """Run a scene; see `accuracy.Solve`."""
        self._bar.say(label)
        watch = Watch(allowed, self._show)
        began = time.process_time()
        try:
            with ends_runs():
                result = engines.simulate(scene, engine, watch, measure=False)
        except LateInterruptError as error:
            if not watch.given_up:
                raise
            result = error.result
        except engines.NotRepresentableError as error:
            raise accuracy.RefusedError(str(error)) from error
        used = time.process_time() - began
        if allowed == inf:  # warming up is not counted
            self._ends = time.monotonic() + self._budget
        self._show()
        if result.outcome.reason == STOPPED and not watch.given_up:
            raise KeyboardInterrupt
        wall = sum(result.timings.values())
        part = result.timings["solve"] / wall if wall > 0 else 1.0
        return accuracy.Solved(result, part * used, given_up=watch.given_up)

    def _show(self) -> None:
        left = max(self._ends - time.monotonic(), 0.0)
        self._bar(max(1 - left / self._budget, 0.0))


class Watch:
    """Follows a run; stops it, as Ctrl-C would, once it has taken longer than allowed (s)."""

    def __init__(self, allowed: float, show: Callable[[], None]) -> None:
        self._ends, self._show = time.monotonic() + allowed, show
        self.given_up = False

    def __call__(self, done: float) -> None:
        """Look at the clock; a run that is `done`, 1, is not stopped."""
        self._show()
        if done < 1 and time.monotonic() > self._ends and not self.given_up:
            self.given_up = True
            signal.raise_signal(signal.SIGINT)


def fit_command(options: argparse.Namespace) -> int:
    """Fit numbers of a model to a measured series; returns the exit code."""
    place = Place(options, "-fit", "fit")
    refuse_idle_integrator(options, options.engine)
    scene = read_scene(options)
    series = read_series(scene, options.measured, pairs("--column", options.column))
    vary = {path: bounds or None for path, bounds in pairs("--vary", options.vary).items()}
    try:
        # The folder is staged first: one that can't be written is no news for the end of a fit.
        with place.written() as folder:
            with single_runs(scene, options, "fit") as (simulate, bar):
                found = fit(scene, series, vary, simulate, bar)
            code = written(found, folder, options, save_fit, "fit")
    except NoFitError as error:
        return complain(f"no fit: {error}", FAILED)
    except KeyboardInterrupt:
        return complain(UNTOLD, INTERRUPTED)
    again = simulating(options, *(f"{path}={x:.10g}" for path, x in found.values.items()))
    place.tell(f"{fit_text(found)}\n\nThe model with these values:\n  {again}")
    for warning in found.warnings:
        complain(f"warning: {warning}")
    return place.ended(code, "the fit is whole")


def stability_command(options: argparse.Namespace) -> int:
    """Study a model's motion, write and print how stable it is; returns the exit code."""
    place = Place(options, "-stability", "stability")
    refuse_idle_integrator(options, options.engine)
    scene = read_scene(options)
    require_length("--tolerance", options.tolerance, scene)
    try:
        # The folder is staged first: one that can't be written is no news for the end of a study.
        with place.written() as folder:
            found = _studied(scene, options)
            told = stability_text(found)
            code = written(
                found, folder, options, partial(save_stability, sentence=told), "stability"
            )
    except IMPOSSIBLE as error:
        return complain(f"{error}\n{_advice(error, options)}", BAD_INPUT)
    except stability.StoppedError as error:
        return complain(str(error), FAILED)
    except KeyboardInterrupt:
        return complain(UNTOLD, INTERRUPTED)
    place.tell(told)
    return place.ended(code, "the study is whole")


def _advice(error: Exception, options: argparse.Namespace) -> str:
    if isinstance(error, stability.TooShortError):
        return f"hint: more than '--laps {options.laps}', or less than '--after {options.after}'"
    if isinstance(error, stability.ImpossibleLapsError):
        return "hint: '--laps' says how many, '--lap' how many seconds each takes"
    return "hint: '--lap SECONDS'"


def _studied(scene: Scene, options: argparse.Namespace) -> stability.Stability:
    asked = stability.Asked(
        options.laps, options.after, options.lap, options.at, options.tolerance, options.twice
    )
    with single_runs(scene, options, "stability") as (simulate, bar):
        return stability.study(scene, simulate, asked, bar)
