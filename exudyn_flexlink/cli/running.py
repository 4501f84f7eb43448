"""The scene that a command line asks for, its run, and the command `simulate`."""

from __future__ import annotations

import argparse
import os
import shlex
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any

from exudyn_flexlink import engines, storage
from exudyn_flexlink.cli.figures import look_of
from exudyn_flexlink.cli.keeping import (
    Place,
    add_output,
    ends_runs,
    save_and_draw,
)
from exudyn_flexlink.cli.terminal import (
    DONE,
    FAILED,
    INTERRUPTED,
    Quiet,
    complain,
    how_called,
    progress_bar,
)
from exudyn_flexlink.effects import EFFECTS, absent, idealise, with_impact
from exudyn_flexlink.engines.interrupts import Beside, LateInterruptError
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.observables import watched_point
from exudyn_flexlink.report import (
    failure_text,
    idle_settings,
    run_text,
)
from exudyn_flexlink.result import INTERRUPTED as STOPPED
from exudyn_flexlink.result import NOT_ASKED, Result
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.shipped import EXUDYN
from exudyn_flexlink.source import Mistake, SceneError


def refuse_idle_integrator(options: argparse.Namespace, engine: str) -> None:
    """Refuse a setting of the command line that Exudyn does not use."""
    asked = any(
        setting.startswith("solver.integrator")
        or (setting.startswith("solver=") and "integrator:" in setting)
        for setting in options.settings
    )
    if asked and engine == EXUDYN:
        raise argparse.ArgumentTypeError(
            "'solver.integrator' is for '--engine lagrangian'; the method of Exudyn is its "
            "formulation's"
        )


def read_scene(options: argparse.Namespace) -> Scene:
    """Load the model with the settings of the command line, its impacts and its effects."""
    scene = load_scene(options.model, options.settings, options.allow_outside)
    return changed(scene, options.impact, options.without)


def changed(scene: Scene, impact: str | None, without: list[str]) -> Scene:
    """Return the scene with another kind of impact, and without effects; its title tells so."""
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


def removable(scene: Scene) -> str:
    """Return a hint at the effects that `compare` can leave out of a scene; empty without any."""
    names = []
    for name in EFFECTS:
        with suppress(SceneError):
            ideal = idealise(scene, [name])
            if ideal != scene and watched_point(ideal) == watched_point(scene):
                names.append(f"'--without {name}'")
    return f"Exudyn compares this model {' or '.join(names)}" if names else ""


def run(
    scene: Scene,
    engine: str,
    options: argparse.Namespace,
    what: str = "simulating",
    beside: Beside | None = None,
) -> tuple[Result, bool]:
    """Run an engine once, and show its progress; `what` names the activity.

    The second run may begin `beside` it. Also returns whether the user pressed Ctrl-C. If that was
    too late to stop the run, the run is complete; else its outcome says that it was interrupted.
    """
    with _refusals(scene, engine, options):
        try:
            with progress_bar(options.quiet, what) as progress, ends_runs():
                watched = progress if beside is None else beside.watch(progress)
                first = beside is not None
                result = engines.simulate(scene, engine, watched, first=first)
        except LateInterruptError as error:
            return error.result, True
        return result, result.outcome.reason == STOPPED


def measured(
    result: Result,
    options: argparse.Namespace,
    beside: Beside,
    what: str = "again, to measure errors",
) -> tuple[Result, bool]:
    """Make the second run, which tells the error of the first, and show its progress.

    Returns the more accurate run, and whether the user interrupted.
    """
    try:
        with progress_bar(options.quiet, what) as progress, ends_runs():
            return engines.measured(result, progress, beside, first=True), False
    except LateInterruptError as error:
        return error.result, True


def simulating(options: argparse.Namespace, *values: str) -> str:
    """Return the command that simulates the scene of a study, with all options that change it.

    `values` are settings beside those of the command line.
    """
    words = [
        "simulate",
        str(options.model),
        *(f"--set={text}" for text in (*options.settings, *values)),
    ]
    words += [f"--without={effect}" for effect in options.without]
    words += ["--allow-outside"] * options.allow_outside
    words += [f"--impact={options.impact}"] * (options.impact is not None)
    return f"{how_called()} {shlex.join(words)}"


@contextmanager
def single_runs(
    scene: Scene, options: argparse.Namespace, what: str
) -> Iterator[tuple[Any, Quiet]]:
    """Yield a function that runs a scene without measuring its error, and a bar for progress."""
    simulate = partial(engines.simulate, engine=options.engine, measure=False)
    with _refusals(scene, options.engine, options), progress_bar(options.quiet, what) as bar:
        yield simulate, bar


@contextmanager
def _refusals(scene: Scene, engine: str, options: argparse.Namespace) -> Iterator[None]:
    """If an engine refuses a scene, name the part of the file that it can't represent."""
    try:
        yield
    except engines.NotRepresentableError as error:
        asked = options.impact is not None and error.path[2:] == ("law",)
        why = f"; '--impact {options.impact}' asks for it" if asked else ""
        mistake = Mistake(error.path, error.message, f"refused by the engine '{engine}'{why}")
        raise SceneError(scene.document, [mistake]) from error


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
    """Make and write the run and the one that measures its error; also return the exit code."""
    # Prepare the folder first: a user learns before the run if it can't be written.
    with place.written() as folder:
        measuring = beside if options.measure else None
        result, interrupted = run(scene, options.engine, options, beside=measuring)
        late = interrupted and result.outcome.reason != STOPPED
        _announce(result, options)
        second = options.measure and not late and result.error == NOT_ASKED
        code = _write(result, folder, options, late=late, figures=not second)
    code = place.code(code)
    if second and code == DONE:  # keep the first run even if the second fails
        result, late = measured(result, options, beside)
        with place.written() as folder:
            code = _write(result, folder, options, late=late)
        code = place.code(code)
    return result, code


def _write(
    result: Result, folder: Path, options: argparse.Namespace, *, late: bool, figures: bool = True
) -> int:
    """Write a run, after Ctrl-C without figures; returns the exit code, see `save_and_draw`."""
    drawn = figures and not late and not options.ending.asked
    draw = None if options.no_plots else partial(look_of(options).save_run, result, folder)
    code = save_and_draw(
        partial(storage.save, result, folder, options.every), draw if drawn else None, folder
    )
    if options.report and drawn and code == DONE:
        from exudyn_flexlink.page import PAGE, write_page

        code = add_output("report", partial(write_page, result, folder / PAGE))
    return code or (INTERRUPTED if late else DONE)


def _announce(result: Result, options: argparse.Namespace) -> None:
    """After Ctrl-C say what is still to be done, since it may take some seconds.

    A process that ends the run by another signal may not wait; so no figures are drawn then.
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
    """Print the summary; with `quiet` only warnings and a failure.

    `code` is the exit code if the run is complete.
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
