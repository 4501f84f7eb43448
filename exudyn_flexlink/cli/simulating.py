"""The command `simulate`."""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from importlib.util import find_spec
from pathlib import Path

from exudyn_flexlink import engines, storage
from exudyn_flexlink.cli.ctrl_c import ends_runs
from exudyn_flexlink.cli.figures import look_of
from exudyn_flexlink.cli.keeping import kept
from exudyn_flexlink.cli.placing import Place, place_of
from exudyn_flexlink.cli.reporting import reported
from exudyn_flexlink.cli.terminal import (
    DONE,
    FAILED,
    INTERRUPTED,
    complain,
    progress_bar,
    tell,
)
from exudyn_flexlink.effects import absent, idealise, with_impact
from exudyn_flexlink.engines.interrupts import LateInterruptError
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.report import failure_text, idle_settings, run_text, sensitivity_text
from exudyn_flexlink.result import INTERRUPTED as STOPPED
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.sensitivity import sensitivity
from exudyn_flexlink.source import Mistake, SceneError


def simulate_command(options: argparse.Namespace) -> int:
    """Simulate a model, write its folder, print its summary; returns the exit code."""
    place = place_of(options)
    refuse_idle_integrator(options, options.engine)
    scene = read_scene(options)
    if options.impact is not None and not scene.contacts:
        complain(f"warning: '--impact {options.impact}' changes nothing: there is no contact")
    # The folder is staged first: one that can't be written is no news for the end of a run.
    with place.written() as folder:
        result, late = _kept(scene, options)
        _announce(result, options)
        second = not late and _asks_for_second(result, options)
        code = _write(result, folder, options, late=late, figures=not second)
    code, told = place.code(code), ""
    if second and code == DONE:  # the first is kept, whatever becomes of the second
        result, told, late = _measured(result, options)
        with place.written() as folder:
            code = _write(result, folder, options, late=late)
        code = place.code(code)
    return place.ended(_tell(result, place, told, options.quiet, code))


def _kept(scene: Scene, options: argparse.Namespace) -> tuple[Result, bool]:
    """Run; also tell whether Ctrl-C came so late that the run is whole all the same."""
    hint_at_numba(options.engine, options)
    try:
        return run(scene, options.engine, options, retries=options.retries), False
    except LateInterruptError as error:
        return error.result, True


def _asks_for_second(result: Result, options: argparse.Namespace) -> bool:
    """Tell whether a neighbouring run is to be made: the user says so, or the run does."""
    if options.horizon is None:
        return result.error is not None
    return bool(options.horizon) and result.outcome.completed


def _write(
    result: Result, folder: Path, options: argparse.Namespace, *, late: bool, figures: bool = True
) -> int:
    """Write a run; returns the exit code, see `kept`. One who did not wait waits for no figures."""
    drawn = figures and not late and not options.ending.asked
    draw = None if options.no_plots else partial(look_of(options).save_run, result, folder)
    code = kept(partial(storage.save, result, folder), draw if drawn else None, folder)
    if options.report and drawn and code == DONE:
        code = reported(result, folder)
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


def _measured(result: Result, options: argparse.Namespace) -> tuple[Result, str, bool]:
    """Return a run with its error, what '--horizon' asks for, and whether the user gave up."""
    try:
        with progress_bar(options.quiet, "again, to measure errors") as progress, ends_runs():
            found = engines.measured(result, progress)
    except LateInterruptError as error:
        return error.result, "", True
    if not options.horizon or found.neighbour is None:
        return found.result, "", False
    return found.result, sensitivity_text(sensitivity(result, found.neighbour)), False


def refuse_idle_integrator(options: argparse.Namespace, engine: str) -> None:
    """Refuse a setting of the command line that means nothing to Exudyn.

    Raises:
        ArgumentTypeError: there is one, and the engine is Exudyn.

    """
    asked = any(
        setting.startswith("solver.integrator")
        or (setting.startswith("solver=") and "integrator:" in setting)
        for setting in options.settings
    )
    if asked and engine == "exudyn":
        raise argparse.ArgumentTypeError(
            "'solver.integrator' is for '--engine lagrangian'; the method of Exudyn is its "
            "formulation's"
        )


def read_scene(options: argparse.Namespace) -> Scene:
    """Load the model with the settings of the command line, its impacts and its effects.

    Raises:
        SceneError: the model, or a setting, has mistakes.

    """
    scene = load_scene(options.model, options.settings, options.allow_outside)
    return changed(scene, options.impact, options.without)


def changed(scene: Scene, impact: str | None, without: list[str]) -> Scene:
    """Return the scene with another kind of impact, and without some effects, which its title says.

    Raises:
        SceneError: what is left can't be.

    """
    if impact is None and not without:
        return scene

    effects = present(scene, without)
    if effects:
        scene = idealise(scene, effects)
        scene = scene.changed(title=f"{scene.title} (without {', '.join(effects)})")
    return scene if impact is None else with_impact(scene, impact)


def present(scene: Scene, effects: list[str]) -> list[str]:
    """Return the effects that the scene has, each once; give a hint for every other."""
    wanted = list(dict.fromkeys(effects))
    missing = absent(scene, wanted)
    for name in missing:
        complain(f"hint: '--without {name}' changes nothing: the scene has no {name}")
    return [name for name in wanted if name not in missing]


def hint_at_numba(engine: str, options: argparse.Namespace) -> None:
    """Say, once a command, what would make its runs faster."""
    if engine == "lagrangian" and find_spec("numba") is None and not options.quiet:
        complain("hint: the Lagrangian is 20 to 40 times faster with numba: pip install numba")


COMPILING = {
    "once": "compiles the Lagrangian first, for half a minute or so, once after installing",
    "every run": "compiles the Lagrangian in memory first, for half a minute or so, and will in "
    "every run: no folder can be written to keep the code; NUMBA_CACHE_DIR may name one",
}


def run(
    scene: Scene,
    engine: str,
    options: argparse.Namespace,
    what: str = "simulating",
    retries: int = 0,
) -> Result:
    """Run an engine, and show its progress: `what` is going on; for `retries` see `simulate`.

    Raises:
        SceneError: the engine can't represent what the scene asks for; shown where it stands.

    """
    with refusals(scene, engine, options):
        compiles = "none" if options.quiet else engines.compiles(scene, engine)
        if compiles != "none":
            complain(f"hint: {COMPILING[compiles]}")
        before = "" if compiles == "none" else "compiling"
        with progress_bar(options.quiet, what, before) as progress, ends_runs():
            return engines.simulate(scene, engine, progress, measure=False, retries=retries)


@contextmanager
def refusals(scene: Scene, engine: str, options: argparse.Namespace) -> Iterator[None]:
    """Show what an engine refuses of a scene where it stands in the file.

    Raises:
        SceneError: the engine can't represent what the scene asks for.

    """
    try:
        yield
    except engines.NotRepresentableError as error:
        asked = options.impact is not None and error.path[2:] == ("law",)
        why = f"; '--impact {options.impact}' asks for it" if asked else ""
        mistake = Mistake(error.path, error.message, f"refused by the engine '{engine}'{why}")
        raise SceneError(scene.document, [mistake]) from error


def _tell(result: Result, place: Place, told: str, quiet: bool, code: int) -> int:
    """Print the summary; warnings and a failure also where the summary is not wanted.

    `code` is the exit code of a run that is whole.
    """
    target = place.target
    place.tell(run_text(result))
    if told:
        tell(told if quiet else f"\n{told}")
    for hint in () if quiet else idle_settings(result):
        complain(f"hint: {hint}")
    for warning in result.warnings:
        complain(f"warning: {warning}")
    if result.outcome.completed and code != INTERRUPTED:
        return code
    if result.outcome.completed:
        return complain(f"interrupted: the run is whole, in {target}{os.sep}", INTERRUPTED)
    code = INTERRUPTED if result.outcome.reason == STOPPED else FAILED
    kept = f"what was computed until then is in {target}{os.sep}, marked as incomplete"
    return complain(f"{failure_text(result)}\n{kept}", code)
