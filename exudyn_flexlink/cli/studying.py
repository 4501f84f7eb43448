"""The commands that make many runs of one model: `accuracy`, `fit` and `stability`.

The command `compare`: both engines, a model without an effect, or a run with measurements.

The command `sweep`: a model at many points, each a row of one table.

The command `verify`: benchmarks, compared with numbers that others published.
"""

from __future__ import annotations

import argparse
import os
import signal
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from math import inf
from pathlib import Path

from exudyn_flexlink import accuracy, engines, stability, storage, sweeps
from exudyn_flexlink.cli.figures import draw_figure, look_of
from exudyn_flexlink.cli.keeping import (
    Place,
    contents,
    deferrable_interrupts,
    draw_figures,
    ends_runs,
    run_name,
    save_and_draw,
    write_figure,
    write_study,
)
from exudyn_flexlink.cli.running import (
    changed,
    measured,
    present,
    read_scene,
    refuse_idle_integrator,
    removable,
    run,
    simulating,
    single_runs,
)
from exudyn_flexlink.cli.terminal import (
    BAD_INPUT,
    DONE,
    FAILED,
    INTERRUPTED,
    Quiet,
    complain,
    progress_bar,
    refuse,
    tell,
)
from exudyn_flexlink.cli.values import model_path, pairs
from exudyn_flexlink.comparison import Comparison, compare
from exudyn_flexlink.engines.interrupts import Beside, LateInterruptError
from exudyn_flexlink.fitting import Against, NoFitError, against, fit, read_series
from exudyn_flexlink.loading import load_scene, require_length
from exudyn_flexlink.observables import watched_point
from exudyn_flexlink.report import (
    accuracy_text,
    against_text,
    comparison_text,
    excess_text,
    failure_text,
    fit_text,
    stability_text,
    sweep_text,
    verification_data,
    verification_markdown,
    verification_text,
)
from exudyn_flexlink.result import INTERRUPTED as STOPPED
from exudyn_flexlink.result import Result, later
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.shipped import ENGINES, EXUDYN, LAGRANGIAN, benchmark_files
from exudyn_flexlink.source import Document, Mistake, SceneError
from exudyn_flexlink.storage import load, save, save_study
from exudyn_flexlink.storage.documents import in_json
from exudyn_flexlink.verification import Benchmark, VerifiedRun, judged, read_benchmark

OF_MODELS = {"settings": "set", "impact": "impact", "without": "without", "engine": "engine"}
"""Options that change a model: they have no effect on a saved run."""
UNCOMPARED = "interrupted before two runs were compared; nothing was written"


def compare_command(options: argparse.Namespace) -> int:
    """Run both scenes or engines, write both and their differences; returns the exit code."""
    if options.other is not None:
        return _compare_saved(options)
    if options.column or options.shift != 0:
        return complain("'--column' and '--shift' need a run and a CSV file", BAD_INPUT)
    options.model = model_path(str(options.model))
    if options.model.is_dir():
        about = f"'{options.model}' is a folder: give what to compare it with, too"
        return complain(f"{about}, another folder of a run or a CSV file", BAD_INPUT)
    place = Place(options, "-compare", "comparison")
    if options.engine is not None and not options.without:
        return complain("'--engine' belongs to '--without'; else both engines run", BAD_INPUT)
    if options.without:
        refuse_idle_integrator(options, options.engine or EXUDYN)
    try:
        # Prepare the folder first: a user learns before the run if it can't be written.
        with place.written() as folder:
            comparison, whole = (
                _without_effects(options) if options.without else _both_engines(options)
            )
            drew = _write_comparison(comparison, folder, options, whole=whole)
    except KeyboardInterrupt:
        return complain(UNCOMPARED, INTERRUPTED)
    return _tell_comparison(comparison, place, options, drew if whole else INTERRUPTED)


def _both_engines(options: argparse.Namespace) -> tuple[Comparison, bool]:
    """Compare Exudyn with the Lagrangian; also tells whether both runs are complete."""
    scene = read_scene(options)
    require_length("--tolerance", options.tolerance, scene)
    # The Lagrangian runs first: it represents fewer scenes, and a refusal then costs no time.
    try:
        judge, _ = _run(scene, LAGRANGIAN, LAGRANGIAN, options, last=False)
    except SceneError as error:
        more = [effect for effect in [removable(scene)] if effect]
        mistakes = [
            replace(mistake, hint="; ".join([mistake.hint, *more])) for mistake in error.mistakes
        ]
        raise SceneError(error.document, mistakes) from error
    result, whole = _run(scene, EXUDYN, EXUDYN, options)
    return compare(result, judge), whole


def _without_effects(options: argparse.Namespace) -> tuple[Comparison, bool]:
    """Compare the scene without some effects, (a) in the paper, with the scene itself, (b)."""
    engine = options.engine or EXUDYN
    given = load_scene(options.model, options.settings, options.allow_outside)
    require_length("--tolerance", options.tolerance, given)
    whole = changed(given, options.impact, [])
    effects = present(given, options.without)
    if not effects:
        about = "nothing to compare: both scenes would be the same"
        offered = removable(given)
        raise argparse.ArgumentTypeError(f"{about}\nhint: {offered}" if offered else about)
    ideal = changed(given, options.impact, effects)
    what = " and ".join(effects)
    point, other = watched_point(whole), watched_point(ideal)
    if point != other:
        about = f"can't compare: the point watched is {point}, but {other} without {what}"
        raise argparse.ArgumentTypeError(about)
    names = f"without {what}", f"with {what}"
    first, _ = _run(ideal, engine, names[0], options, last=False)
    second, ended = _run(whole, engine, names[1], options)
    return compare(first, second, names=names), ended


def _run(
    scene: Scene, engine: str, what: str, options: argparse.Namespace, *, last: bool = True
) -> tuple[Result, bool]:
    """Make one of the two runs to compare, and measure its error; the `last` one may be partial.

    Also tells whether the run was not interrupted.

    Raises:
        KeyboardInterrupt: the user interrupted before there were numbers of both runs.

    """
    measure = options.measure
    with Beside(scene, engine) as beside:
        result, enough = run(scene, engine, options, what, beside if measure else None)
        if measure and not enough:
            result, enough = measured(result, options, beside, f"{what}, to measure errors")
    if enough and not (last and len(result.time) > 1):
        raise KeyboardInterrupt
    return result, not enough


def _write_comparison(
    compared: Comparison, folder: Path, options: argparse.Namespace, *, whole: bool
) -> int:
    """Write numbers, then figures if the runs are `whole`; returns the code of `save_and_draw`."""
    places = [(seen.result, folder / seen.name.replace(" ", "_")) for seen in compared.both]

    def save_all() -> None:
        for result, place in places:
            save(result, place)
        save_study(compared, folder, tolerance=options.tolerance, whole=whole)

    def draw() -> None:
        for result, place in places:
            look_of(options).save_run(result, place)
        draw_figure(options, "comparison", compared, folder)

    return save_and_draw(save_all, draw if whole and not options.no_plots else None, folder)


def _tell_comparison(
    comparison: Comparison, place: Place, options: argparse.Namespace, drew: int
) -> int:
    """Print the table; with `--quiet` only warnings, failures and an exceeded tolerance."""
    place.tell(comparison_text(comparison))
    code = drew
    for seen in comparison.both:
        for warning in seen.result.warnings:
            complain(f"warning: {seen.name}: {warning}")
        if not seen.result.outcome.completed:
            code = complain(f"{seen.name}: {failure_text(seen.result)}", FAILED)
    if options.tolerance is not None and comparison.exceeds(options.tolerance):
        code = complain(excess_text(comparison, options.tolerance), FAILED)
    code = INTERRUPTED if drew == INTERRUPTED else code
    return place.ended(code, "what was compared until then is kept")


def _compare_saved(options: argparse.Namespace) -> int:
    """Compare a saved run with another, or with a measured series; returns the exit code."""
    first, second = options.model, options.other
    measured = not second.is_dir()
    idle = [f"--{name}" for key, name in OF_MODELS.items() if getattr(options, key)]
    idle += [] if options.measure else ["--no-measure"]
    of_series = options.column or options.shift != 0
    for is_so, why in (
        (idle, f"'{', '.join(idle)}' is for models: runs are compared as they were made"),
        (not first.is_dir(), f"with '{second}' goes the folder of a saved run, not '{first}'"),
        (measured and options.tolerance is not None, "'--tolerance' is for two runs"),
        (not measured and of_series, "'--column' and '--shift' are for a CSV file"),
    ):
        if is_so:
            raise argparse.ArgumentTypeError(why)
    place = Place(options, f"-compare-{second.stem if measured else second.name}", "comparison")
    run = load(first)
    comparison: Against | Comparison
    try:
        if measured:
            series = read_series(run.scene, second, pairs("--column", options.column))
            comparison = against(run, series, options.shift)
        else:
            other = load(second)
            other = later(other, other.scene.initial.clock - run.scene.initial.clock)
            comparison = compare(run, other, (str(first), str(second)))
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    with place.written() as folder:
        figure = "against" if measured else "comparison"
        verdict = {} if measured else {"tolerance": options.tolerance}
        code = write_study(comparison, folder, options, figure, **verdict)
    place.tell(
        against_text(comparison) if isinstance(comparison, Against) else comparison_text(comparison)
    )
    code = place.ended(code, "the comparison is whole")
    most = options.tolerance
    if isinstance(comparison, Comparison) and most is not None and comparison.exceeds(most):
        return complain(excess_text(comparison, most), FAILED)
    return code


IMPOSSIBLE = stability.ImpossibleLapsError, stability.NoRhythmError, stability.TooShortError
UNTOLD = "interrupted before anything was found; nothing was written"


def accuracy_command(options: argparse.Namespace) -> int:
    """Study a model, write and print what accuracy costs; returns the exit code."""
    place = Place(options, "-accuracy", "study")
    scene = read_scene(options)
    require_length("--target", options.target, scene)
    try:
        # Prepare the folder first: a user learns before the study if it can't be written.
        with place.written() as folder:
            runs = _runs(scene, options)
            with deferrable_interrupts() as ctrl_c:
                ctrl_c.defer()
                study = accuracy.judge(runs)
                save_study(study, folder)
            code = INTERRUPTED if ctrl_c.pending else DONE
            if code == DONE and not options.no_plots:
                draw = partial(draw_figure, options, "work_precision", study, folder)
                code = draw_figures(folder, draw)
    except accuracy.NothingRunError as error:
        if runs.interrupted:
            about = "interrupted before there were two runs to compare; nothing was written"
            return complain(about, INTERRUPTED)
        budget = f"raise '--budget' ({options.budget:g} s)"
        shorter = "shorten the run with '--set run.turns=...'"
        return complain(f"{error}\n{budget}, or {shorter}", FAILED)
    place.tell(accuracy_text(study, simulating(options)))
    if study.runs.interrupted:
        settings = f"setting{'s' * (len(study.points) != 1)}"
        return place.ended(INTERRUPTED, f"the {len(study.points)} {settings} judged until then")
    return place.ended(code, "the study is whole")


def _runs(scene: Scene, options: argparse.Namespace) -> accuracy.Runs:
    ways = {engine: engines.formulations(scene, engine) for engine in ENGINES}
    methods = accuracy.methods_of(scene, ways)
    target = options.target or accuracy.model_tolerance(scene)
    with progress_bar(options.quiet, "accuracy") as bar:
        return accuracy.study(scene, methods, target, Solver(bar, options.budget), options.budget)


class Solver:
    """Runs scenes and shows the used part of the budget; stops runs that take too long."""

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
        if allowed == inf:  # a warm-up run does not count
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
        """Look at the clock; a run is not stopped at its end, where `done` is 1."""
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
        # Prepare the folder first: a user learns before the fit if it can't be written.
        with place.written() as folder:
            with single_runs(scene, options, "fit") as (simulate, bar):
                fitted = fit(scene, series, vary, simulate, bar)
            code = write_study(fitted, folder, options, "fit")
    except NoFitError as error:
        return complain(f"no fit: {error}", FAILED)
    except KeyboardInterrupt:
        return complain(UNTOLD, INTERRUPTED)
    again = simulating(options, *(f"{path}={x:.10g}" for path, x in fitted.values.items()))
    place.tell(f"{fit_text(fitted)}\n\nThe model with these values:\n  {again}")
    for warning in fitted.warnings:
        complain(f"warning: {warning}")
    return place.ended(code, "the fit is whole")


def stability_command(options: argparse.Namespace) -> int:
    """Study a model's motion, write and print how stable it is; returns the exit code."""
    place = Place(options, "-stability", "stability")
    refuse_idle_integrator(options, options.engine)
    scene = read_scene(options)
    require_length("--tolerance", options.tolerance, scene)
    try:
        # Prepare the folder first: a user learns before the study if it can't be written.
        with place.written() as folder:
            study = _studied(scene, options)
            code = write_study(study, folder, options, "stability")
    except IMPOSSIBLE as error:
        return complain(f"{error}\n{_advice(error, options)}", BAD_INPUT)
    except stability.StoppedError as error:
        return complain(str(error), FAILED)
    except KeyboardInterrupt:
        return complain(UNTOLD, INTERRUPTED)
    place.tell(stability_text(study))
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


def sweep_command(options: argparse.Namespace) -> int:
    """Run a model at many points, write a table of them; returns the exit code."""
    if options.resume and options.force:
        return complain("'--resume' goes on, '--force' begins anew: give one of both", BAD_INPUT)
    try:
        executor = sweeps.executor_of(options.workers, options.scheduler)
    except ValueError as error:
        return refuse(error)
    plan = _planned(options)
    refuse_idle_integrator(options, plan.engine)
    folder: Path = options.out or Path("runs") / run_name(options, "-sweep")
    table, code = _swept(plan, executor, folder, options)
    return _tell(table, folder, options, code)


def _planned(options: argparse.Namespace) -> sweeps.Sweep:
    """Make the plan of a study file, or of the options."""
    if options.over:
        options.model = model_path(options.source)
        mistakes: list[Mistake] = []
        given = _varied(options.over, mistakes)
        design = sweeps.grid(given, (), mistakes)
        scene, document = read_scene(options), Document("--over")
        engine = options.engine or EXUDYN
    else:
        options.model = Path(options.source)
        study = sweeps.read_study(options.model, options.settings, options.allow_outside)
        scene = changed(study.scene, options.impact, options.without)
        design, document, mistakes = study.design, study.document, [*study.mistakes]
        engine = options.engine or study.engine
    return sweeps.planned(
        scene,
        design,
        document,
        engine=engine,
        measure=options.measure,
        observed=f"{sweeps.standard_row.__module__}.{sweeps.standard_row.__qualname__}",
        allow_outside=options.allow_outside,
        mistakes=mistakes,
    )


def _varied(texts: list[str], mistakes: list[Mistake]) -> dict[str, str]:
    """Read '--over path=values'; refuse a path that is given twice."""
    paths: dict[str, str] = {}
    for text in texts:
        path, equals, values = (part.strip() for part in text.partition("="))
        if not equals or not all(path.split(".")):
            hint = "for example --over 'drives.motor.value=6:14:9 rad/s'"
            mistakes.append(Mistake((text,), "expected path=values", hint))
        elif path in paths:
            mistakes.append(Mistake((path,), "is varied twice"))
        else:
            paths[path] = values
            if not {":", ","} & set(values):  # '5-15' would be a difference
                examples = "a range is '6:14:9', a list '6, 14'"
                complain(f"hint: {path} has one value, '{values}'; {examples}")
    return paths


def _swept(
    plan: sweeps.Sweep, executor: sweeps.Executor, folder: Path, options: argparse.Namespace
) -> tuple[sweeps.SweepTable, int]:
    """Carry a sweep out and write its table; returns the exit code, too."""
    work = sweeps.work_of(
        plan,
        partial(engines.simulate, engine=plan.engine, measure=plan.measure),
        sweeps.OneRun(sweeps.standard_row),
        storage.SeriesKeeper(folder.resolve()) if options.series else None,
    )  # fmt: skip
    with storage.open_journal(
        folder, plan, resume=options.resume, force=options.force, series=options.series
    ) as journal:
        made = Counter(row.status for row in journal.known.values())
        if journal.known and not options.quiet:
            rest = "going on with the rest" if len(journal.known) < len(plan) else "none is missing"
            complain(f"{len(journal.known)} of {len(plan)} rows are there; {rest}")
        with progress_bar(options.quiet, _progress(made, len(plan))) as bar:

            def keep(row: sweeps.Row, count: int) -> None:
                journal.add(row)
                made[row.status] += 1
                bar.say(_progress(made, len(plan)))
                bar(count / len(plan))

            table = sweeps.carried_out(plan, work, executor, journal.known, keep)
        return table, _write(plan, table, folder, options)


def _progress(count: Counter[str], points: int) -> str:
    """The number of rows so far, and how many have no numbers."""
    failed = f", {count[sweeps.FAILED]} failed" if count[sweeps.FAILED] else ""
    return f"sweep: {count.total()} of {points} runs{failed}"


def _write(
    plan: sweeps.Sweep, table: sweeps.SweepTable, folder: Path, options: argparse.Namespace
) -> int:
    """Write the table, then its figure; returns the exit code, see `save_and_draw`."""
    with storage.staged_folder(folder, force=options.force) as staged:
        wanted = table.whole and not (options.no_plots or options.ending.asked)
        draw = partial(draw_figure, options, "sweep", table, staged) if wanted else None
        code = save_and_draw(partial(storage.save_table, plan, table, staged), draw, staged)
    return code if table.whole else INTERRUPTED


def _tell(table: sweeps.SweepTable, folder: Path, options: argparse.Namespace, code: int) -> int:
    """Print the summary; with `--quiet` only that rows are missing, or that all failed."""
    if not options.quiet:
        tell(sweep_text(table))
        tell(f"\nWritten to {folder}{os.sep}:\n  {contents(folder)}")
    if not table.whole:
        kept_rows = f"{len(table.rows)} of {table.points} rows are in {folder}{os.sep}"
        return complain(f"interrupted: {kept_rows}; with '--resume' they are not made again", code)
    if code == INTERRUPTED:
        return complain(f"interrupted: the sweep is whole, in {folder}{os.sep}", code)
    if table.count(sweeps.FAILED) == len(table.rows):
        return complain("no row has numbers", FAILED)
    return code


def verify_command(options: argparse.Namespace) -> int:
    """Run benchmarks and print how far they are off; code 1 if one is off by more than allowed."""
    runs: list[VerifiedRun] = []
    files = options.benchmarks or benchmark_files().values()
    # All files are read before the first run, so that mistakes show at once.
    whole = _verify([read_benchmark(file) for file in files], options, runs)
    if runs:
        tell(_printed(runs, options.form))
    if not whole:
        return complain("interrupted: runs are missing", INTERRUPTED)
    code = DONE if all(run.fine for run in runs) else FAILED
    if options.figure is None:
        return code
    from exudyn_flexlink.plots import differences

    return write_figure(options.figure, partial(differences, runs), force=options.force) or code


def _verify(
    benchmarks: Sequence[Benchmark], options: argparse.Namespace, runs: list[VerifiedRun]
) -> bool:
    """Make all runs, and add each to `runs`; tells whether none was interrupted."""
    pairs = [(benchmark, run) for benchmark in benchmarks for run in benchmark.runs]
    for i, (benchmark, planned) in enumerate(pairs, 1):
        what = f"{i} of {len(pairs)}: {benchmark.name}, {planned.name}"
        result, enough = run(planned.scene, planned.engine, options, what)
        if result.outcome.reason != STOPPED:
            runs.append(judged(benchmark, planned, result))
        if enough:
            return False
    return True


def _printed(runs: Sequence[VerifiedRun], form: str) -> str:
    if form == "json":
        return in_json(verification_data(runs), indent=2).decode().rstrip()
    return verification_markdown(runs) if form == "markdown" else verification_text(runs)
