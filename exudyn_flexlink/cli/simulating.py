"""The command `simulate`."""

from __future__ import annotations

import argparse
import os
from functools import partial
from pathlib import Path

from exudyn_flexlink import storage
from exudyn_flexlink.cli.figures import look_of
from exudyn_flexlink.cli.keeping import added, kept
from exudyn_flexlink.cli.placing import Place
from exudyn_flexlink.cli.running import measured, read_scene, refuse_idle_integrator, run
from exudyn_flexlink.cli.terminal import DONE, FAILED, INTERRUPTED, complain
from exudyn_flexlink.engines.beside import Beside
from exudyn_flexlink.measured_error import NOT_ASKED
from exudyn_flexlink.report import failure_text, idle_settings, run_text
from exudyn_flexlink.result import INTERRUPTED as STOPPED
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene


def simulate_command(options: argparse.Namespace) -> int:
    """Simulate a model, write its folder, print its summary; returns the exit code."""
    place = Place(options)
    refuse_idle_integrator(options, options.engine)
    scene = read_scene(options)
    if options.impact is not None and not scene.all_contacts:
        complain(f"warning: '--impact {options.impact}' changes nothing: there is no contact")
    with Beside(scene, options.engine) as beside:
        result, code = _both(scene, options, place, beside)
    return _tell(result, place, options.quiet, code)


def _both(
    scene: Scene, options: argparse.Namespace, place: Place, beside: Beside
) -> tuple[Result, int]:
    """Make the run, and the one that measures it, and write them; returns the exit code, too."""
    # The folder is staged first: one that can't be written is no news for the end of a run.
    with place.written() as folder:
        may = beside if options.measure else None
        result, enough = run(scene, options.engine, options, beside=may)
        late = enough and result.outcome.reason != STOPPED
        _announce(result, options)
        second = options.measure and not late and result.error == NOT_ASKED
        code = _write(result, folder, options, late=late, figures=not second)
    code = place.code(code)
    if second and code == DONE:  # the first is kept, whatever becomes of the second
        result, late = measured(result, options, beside)
        with place.written() as folder:
            code = _write(result, folder, options, late=late)
        code = place.code(code)
    return result, code


def _write(
    result: Result, folder: Path, options: argparse.Namespace, *, late: bool, figures: bool = True
) -> int:
    """Write a run; returns the exit code, see `kept`. One who did not wait waits for no figures."""
    drawn = figures and not late and not options.ending.asked
    draw = None if options.no_plots else partial(look_of(options).save_run, result, folder)
    code = kept(partial(storage.save, result, folder), draw if drawn else None, folder)
    if options.report and drawn and code == DONE:
        from exudyn_flexlink.page import PAGE, write_page

        code = added("report", partial(write_page, result, folder / PAGE))
    return code or (INTERRUPTED if late else DONE)


def _announce(result: Result, options: argparse.Namespace) -> None:
    """Say what is still done after Ctrl-C, since it may take some seconds.

    Whoever asked for the end by a signal may not wait: figures are left out.
    """
    if result.outcome.reason != STOPPED:
        return
    asked = options.ending.asked
    if asked:
        complain(f"interrupted by {asked.name}: writing what was computed, without figures")
    else:
        more = "" if options.no_plots else "; once more: without figures"
        complain(f"interrupted: writing what was computed{more}")


def _tell(result: Result, place: Place, quiet: bool, code: int) -> int:
    """Print the summary; warnings and a failure also where the summary is not wanted.

    `code` is the exit code of a run that is whole.
    """
    place.tell(run_text(result))
    for hint in () if quiet else idle_settings(result):
        complain(f"hint: {hint}")
    for warning in result.warnings:
        complain(f"warning: {warning}")
    if result.outcome.completed:
        return place.ended(code, "the run is whole")
    kept = f"what was computed until then is in {place.target}{os.sep}, marked as incomplete"
    complain(f"{failure_text(result)}\n{kept}")
    return place.ended(INTERRUPTED if result.outcome.reason == STOPPED else FAILED)
