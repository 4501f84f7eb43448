"""The command `sweep`: a model at many points, each a row of one table."""

from __future__ import annotations

import argparse
import os
from collections import Counter
from functools import partial
from pathlib import Path

from exudyn_flexlink import engines, storage, sweeps
from exudyn_flexlink.cli.figures import draw_figure
from exudyn_flexlink.cli.keeping import kept
from exudyn_flexlink.cli.placing import contents, run_name
from exudyn_flexlink.cli.running import changed, read_scene, refuse_idle_integrator
from exudyn_flexlink.cli.terminal import (
    BAD_INPUT,
    FAILED,
    INTERRUPTED,
    complain,
    progress_bar,
    refuse,
    tell,
)
from exudyn_flexlink.cli.values import model_path
from exudyn_flexlink.report import sweep_text
from exudyn_flexlink.source import Document, Mistake


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
    """Make the plan that a study file, or the options, ask for."""
    if options.over:
        options.model = model_path(options.source)
        mistakes: list[Mistake] = []
        given = _varied(options.over, mistakes)
        design = sweeps.grid(given, (), mistakes)
        scene, document = read_scene(options), Document("--over")
        engine = options.engine or "exudyn"
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
    """Read '--over path=values'; a path twice would be varied by one of them alone."""
    found: dict[str, str] = {}
    for text in texts:
        path, equals, values = (part.strip() for part in text.partition("="))
        if not equals or not all(path.split(".")):
            hint = "for example --over 'drives.motor.value=6:14:9 rad/s'"
            mistakes.append(Mistake((text,), "expected path=values", hint))
        elif path in found:
            mistakes.append(Mistake((path,), "is varied twice"))
        else:
            found[path] = values
            if not {":", ","} & set(values):  # '5-15' is a difference
                examples = "a range is '6:14:9', a list '6, 14'"
                complain(f"hint: {path} has one value, '{values}'; {examples}")
    return found


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
    """Rows that are there, and how many have no numbers."""
    failed = f", {count[sweeps.FAILED]} failed" if count[sweeps.FAILED] else ""
    return f"sweep: {count.total()} of {points} runs{failed}"


def _write(
    plan: sweeps.Sweep, table: sweeps.SweepTable, folder: Path, options: argparse.Namespace
) -> int:
    """Write the table, then its figure; returns the exit code, see `kept`."""
    with storage.staged_folder(folder, force=options.force) as staged:
        wanted = table.whole and not (options.no_plots or options.ending.asked)
        draw = partial(draw_figure, options, "sweep", table, staged) if wanted else None
        code = kept(partial(storage.save_table, plan, table, staged), draw, staged)
    return code if table.whole else INTERRUPTED


def _tell(table: sweeps.SweepTable, folder: Path, options: argparse.Namespace, code: int) -> int:
    """Print the summary; that rows are missing, or all failed, also where it is not wanted."""
    if not options.quiet:
        tell(sweep_text(table))
        tell(f"\nWritten to {folder}{os.sep}:\n  {contents(folder)}")
    if not table.whole:
        there = f"{len(table.rows)} of {table.points} rows are in {folder}{os.sep}"
        return complain(f"interrupted: {there}; with '--resume' they are not made again", code)
    if code == INTERRUPTED:
        return complain(f"interrupted: the sweep is whole, in {folder}{os.sep}", code)
    if table.count(sweeps.FAILED) == len(table.rows):
        return complain("no row has numbers", FAILED)
    return code
