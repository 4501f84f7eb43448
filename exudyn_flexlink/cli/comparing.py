"""The command `compare`: one scene, both engines."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from exudyn_flexlink.cli.simulating import read_scene, run, write
from exudyn_flexlink.cli.terminal import BAD_INPUT, DONE, FAILED, complain, names_in

if TYPE_CHECKING:
    from exudyn_flexlink.compare import Comparison
    from exudyn_flexlink.result import Result
    from exudyn_flexlink.scene import Scene

LOOSER = 10.0  # times the Lagrangian's tolerances: the run that finds the horizon
_TOLERANCES = ("relative_tolerance", "absolute_tolerance")


def compare_command(options: argparse.Namespace) -> int:
    """Run both engines, write both runs and what they differ in; returns the exit code."""
    from exudyn_flexlink.compare import compare
    from exudyn_flexlink.source import SceneError
    from exudyn_flexlink.storage import StorageError, staged_folder

    target: Path = options.out or Path("runs") / f"{options.model.stem}-compare"
    try:
        scene = read_scene(options, options.impact)
        # Impulses are the Lagrangian's alone; a model that gives no penalty is refused here.
        other = read_scene(options, "penalty")
        with staged_folder(target) as folder:
            # The Lagrangian first: it represents less, and what it refuses should cost no time.
            judge = _whole(run(scene, "lagrangian", options, "lagrangian"))
            exudyn = _whole(run(other, "exudyn", options, "exudyn"))
            looser = _looser(scene, judge)
            again = _whole(run(looser, "lagrangian", options, "lagrangian, for the horizon"))
            found = compare(exudyn, judge, again)
            _write(found, folder, options)
    except (SceneError, StorageError) as error:
        return complain(str(error), BAD_INPUT)
    return _tell(found, target, options)


def _whole(result: Result) -> Result:
    """Hand a result on, unless the user has had enough: then there is nothing to compare."""
    from exudyn_flexlink.result import INTERRUPTED as STOPPED

    if result.outcome.reason == STOPPED:
        raise KeyboardInterrupt
    return result


def _looser(scene: Scene, judge: Result) -> Scene:
    settings = judge.settings
    looser = {key: LOOSER * float(settings[key]) for key in _TOLERANCES if key in settings}
    given = scene.accuracy.model_dump(exclude_none=True)
    return scene.changed(accuracy=type(scene.accuracy).model_validate(given | looser))


def _write(found: Comparison, folder: Path, options: argparse.Namespace) -> None:
    from exudyn_flexlink.storage import save_comparison

    figures = not options.no_plots
    for seen in (found.first, found.second):
        write(seen.result, folder / seen.result.engine, figures=figures)
    save_comparison(found, folder, options.tolerance)
    if figures:
        from exudyn_flexlink.plots import comparison

        figure = comparison(found)
        if figure is not None:
            figure.savefig(folder / "comparison.png", dpi=150)


def _tell(found: Comparison, target: Path, options: argparse.Namespace) -> int:
    """Print the table; warnings, failures and an excess also where the table is not wanted."""
    from exudyn_flexlink.report import comparison_text, excess_text, failure_text

    if not options.quiet:
        print(comparison_text(found))
        print(f"\nWritten to {target}{os.sep}: {', '.join(names_in(target))}")
        sys.stdout.flush()  # so that what follows on stderr stands below it
    code = DONE
    for seen in (found.first, found.second):
        for warning in seen.result.warnings:
            complain(f"warning: {seen.name}: {warning}")
        if not seen.result.outcome.completed:
            code = complain(f"{seen.name}: {failure_text(seen.result)}", FAILED)
    if options.tolerance is not None and found.exceeds(options.tolerance):
        code = complain(excess_text(found, options.tolerance), FAILED)
    return code
