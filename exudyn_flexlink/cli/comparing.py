"""The command `compare`: one scene in both engines, or one engine with and without an effect."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from exudyn_flexlink.cli.simulating import (
    FINER,
    LAGRANGIAN_ALONE,
    asks_for_lagrangian,
    changed,
    present,
    read_scene,
    retuned,
    run,
    write,
)
from exudyn_flexlink.cli.terminal import BAD_INPUT, DONE, FAILED, complain, names_in

if TYPE_CHECKING:
    from exudyn_flexlink.compare import Comparison
    from exudyn_flexlink.result import Result
    from exudyn_flexlink.scene import Scene

JUDGE = 0.01  # of the scene's tolerance: what the judge of a comparison may be off
LOOSER = 10.0  # times the Lagrangian's tolerances: the run that finds the horizon


def compare_command(options: argparse.Namespace) -> int:
    """Run both scenes or engines, write both and what they differ in; returns the exit code."""
    from exudyn_flexlink.source import SceneError
    from exudyn_flexlink.storage import StorageError, staged_folder

    target: Path = options.out or Path("runs") / f"{options.model.stem}-compare"
    if options.engine is not None and not options.without:
        return complain("'--engine' belongs to '--without'; else both engines run", BAD_INPUT)
    if options.without and options.engine != "lagrangian" and asks_for_lagrangian(options):
        return complain(LAGRANGIAN_ALONE, BAD_INPUT)
    try:
        # The folder is staged first: one that can't be written is no news for the end of a run.
        with staged_folder(target) as folder:
            found = _without_effects(options) if options.without else _both_engines(options)
            _write(found, folder, options)
    except (SceneError, StorageError, CannotCompareError) as error:
        return complain(str(error), BAD_INPUT)
    return _tell(found, target, options)


def _both_engines(options: argparse.Namespace) -> Comparison:
    """Compare Exudyn with the Lagrangian."""
    from exudyn_flexlink.compare import compare

    scene = read_scene(options, options.impact)
    # Impulses are the Lagrangian's alone; a model that gives no penalty is refused here.
    other = read_scene(options, "penalty")
    # The Lagrangian first: it represents less, and what it refuses should cost no time.
    judge = _whole(run(_tightened(scene), "lagrangian", options, "lagrangian"))
    exudyn = _whole(run(other, "exudyn", options, "exudyn"))
    again = _whole(
        run(retuned(scene, judge, LOOSER), "lagrangian", options, "lagrangian, for the horizon")
    )
    return compare(exudyn, judge, again)


def _tightened(scene: Scene) -> Scene:
    """Return the scene with the tolerance of a judge, where it states one."""
    accuracy = scene.accuracy
    if accuracy.tolerance is None:
        return scene
    tolerance = JUDGE * accuracy.tolerance
    return scene.changed(accuracy=accuracy.model_copy(update={"tolerance": tolerance}))


def _without_effects(options: argparse.Namespace) -> Comparison:
    """Compare the scene without some effects, the paper's (a), with the scene itself, its (b).

    Raises:
        CannotCompareError: there is nothing to compare.

    """
    from exudyn_flexlink.compare import compare_variants
    from exudyn_flexlink.loading import load_scene

    engine = options.engine or "exudyn"
    given = load_scene(options.model, options.settings, options.allow_outside)
    whole = changed(given, options.impact, [])
    effects = present(given, options.without)
    if not effects:
        raise CannotCompareError("nothing to compare: both scenes would be the same")
    ideal = changed(given, options.impact, effects)
    what = " and ".join(effects)
    _require_one_point(whole, ideal, what)
    first = _whole(run(ideal, engine, options, f"without {what}"))
    second = _whole(run(whole, engine, options, f"with {what}"))
    near = retuned(whole, second, FINER)
    again = _whole(run(near, engine, options, f"with {what}, for the horizon"))
    return compare_variants(first, second, (f"without {what}", f"with {what}"), again)


class CannotCompareError(ValueError):
    """A scene and the same without some effects have nothing to be compared in."""


def _require_one_point(whole: Scene, ideal: Scene, what: str) -> None:
    """Refuse two scenes that are not watched at the same point.

    Raises:
        CannotCompareError: that is so.

    """
    from exudyn_flexlink.observables import watched_point

    point, other = watched_point(whole), watched_point(ideal)
    if point != other:
        message = f"the point watched is {point}, but {other} without {what}"
        raise CannotCompareError(f"can't compare: {message}")


def _whole(result: Result) -> Result:
    """Hand a result on, unless the user has had enough: then there is nothing to compare."""
    from exudyn_flexlink.result import INTERRUPTED as STOPPED

    if result.outcome.reason == STOPPED:
        raise KeyboardInterrupt
    return result


def _write(found: Comparison, folder: Path, options: argparse.Namespace) -> None:
    from exudyn_flexlink.storage import save_comparison

    figures = not options.no_plots
    for seen in (found.first, found.second):
        write(seen.result, folder / seen.name.replace(" ", "_"), figures=figures)
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
