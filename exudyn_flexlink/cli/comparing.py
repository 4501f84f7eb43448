"""The command `compare`: both engines, a model without an effect, or a run with measurements."""

from __future__ import annotations

import argparse
from dataclasses import replace
from functools import partial
from pathlib import Path

from exudyn_flexlink.cli.figures import draw_figure, look_of
from exudyn_flexlink.cli.keeping import kept, written
from exudyn_flexlink.cli.placing import Place
from exudyn_flexlink.cli.running import (
    changed,
    measured,
    present,
    read_scene,
    refuse_idle_integrator,
    removable,
    run,
)
from exudyn_flexlink.cli.terminal import BAD_INPUT, FAILED, INTERRUPTED, complain
from exudyn_flexlink.cli.values import model_path, pairs
from exudyn_flexlink.comparison import Comparison, compare
from exudyn_flexlink.engines.beside import Beside
from exudyn_flexlink.fitting import Against, against, read_series
from exudyn_flexlink.loading import load_scene, require_length
from exudyn_flexlink.observables import watched_point
from exudyn_flexlink.report import against_text, comparison_text, excess_text, failure_text
from exudyn_flexlink.result import Result, later
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.source import SceneError
from exudyn_flexlink.storage import load, save, save_against, save_comparison

OF_MODELS = {"settings": "set", "impact": "impact", "without": "without", "engine": "engine"}
"""Options that change a model, which a saved run no longer is."""
UNCOMPARED = "interrupted before two runs were compared; nothing was written"


def compare_command(options: argparse.Namespace) -> int:
    """Run both scenes or engines, write both and what they differ in; returns the exit code."""
    if options.other is not None:
        return _compare_saved(options)
    if options.column or options.shift != 0:
        return complain("'--column' and '--shift' need a run and a CSV file", BAD_INPUT)
    options.model = model_path(str(options.model))
    if options.model.is_dir():
        told = f"'{options.model}' is a folder: give what to compare it with, too"
        return complain(f"{told}, another folder of a run or a CSV file", BAD_INPUT)
    place = Place(options, "-compare", "comparison")
    if options.engine is not None and not options.without:
        return complain("'--engine' belongs to '--without'; else both engines run", BAD_INPUT)
    if options.without:
        refuse_idle_integrator(options, options.engine or "exudyn")
    try:
        # The folder is staged first: one that can't be written is no news for the end of a run.
        with place.written() as folder:
            found, whole = _without_effects(options) if options.without else _both_engines(options)
            drew = _write_comparison(found, folder, options, whole=whole)
    except KeyboardInterrupt:
        return complain(UNCOMPARED, INTERRUPTED)
    return _tell_comparison(found, place, options, drew if whole else INTERRUPTED)


def _both_engines(options: argparse.Namespace) -> tuple[Comparison, bool]:
    """Compare Exudyn with the Lagrangian; tells whether both runs are whole, too."""
    scene = read_scene(options)
    require_length("--tolerance", options.tolerance, scene)
    # The Lagrangian first: it represents less, and what it refuses should cost no time.
    try:
        judge, _ = _run(scene, "lagrangian", "lagrangian", options, last=False)
    except SceneError as error:
        more = [own for own in [removable(scene)] if own]
        told = [replace(one, hint="; ".join([one.hint, *more])) for one in error.mistakes]
        raise SceneError(error.document, told) from error
    result, whole = _run(scene, "exudyn", "exudyn", options)
    return compare(result, judge), whole


def _without_effects(options: argparse.Namespace) -> tuple[Comparison, bool]:
    """Compare the scene without some effects, the paper's (a), with the scene itself, its (b)."""
    engine = options.engine or "exudyn"
    given = load_scene(options.model, options.settings, options.allow_outside)
    require_length("--tolerance", options.tolerance, given)
    whole = changed(given, options.impact, [])
    effects = present(given, options.without)
    if not effects:
        told = "nothing to compare: both scenes would be the same"
        offered = removable(given)
        raise argparse.ArgumentTypeError(f"{told}\nhint: {offered}" if offered else told)
    ideal = changed(given, options.impact, effects)
    what = " and ".join(effects)
    point, other = watched_point(whole), watched_point(ideal)
    if point != other:
        told = f"can't compare: the point watched is {point}, but {other} without {what}"
        raise argparse.ArgumentTypeError(told)
    names = f"without {what}", f"with {what}"
    first, _ = _run(ideal, engine, names[0], options, last=False)
    second, ended = _run(whole, engine, names[1], options)
    return compare(first, second, names=names), ended


def _run(
    scene: Scene, engine: str, what: str, options: argparse.Namespace, *, last: bool = True
) -> tuple[Result, bool]:
    """Run one of the two that are compared, and measure it; of the `last` a part will do.

    Tells whether the user let it end.

    Raises:
        KeyboardInterrupt: the user had enough before there was anything of both.

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
    """Write numbers, then figures if it is `whole`; returns the exit code, see `kept`."""
    places = [(seen.result, folder / seen.name.replace(" ", "_")) for seen in compared.both]

    def save_all() -> None:
        for result, place in places:
            save(result, place)
        save_comparison(compared, folder, options.tolerance, whole=whole)

    def draw() -> None:
        for result, place in places:
            look_of(options).save_run(result, place)
        draw_figure(options, "comparison", compared, folder)

    return kept(save_all, draw if whole and not options.no_plots else None, folder)


def _tell_comparison(
    found: Comparison, place: Place, options: argparse.Namespace, drew: int
) -> int:
    """Print the table; warnings, failures and an excess also where the table is not wanted."""
    place.tell(comparison_text(found))
    code = drew
    for seen in found.both:
        for warning in seen.result.warnings:
            complain(f"warning: {seen.name}: {warning}")
        if not seen.result.outcome.completed:
            code = complain(f"{seen.name}: {failure_text(seen.result)}", FAILED)
    if options.tolerance is not None and found.exceeds(options.tolerance):
        code = complain(excess_text(found, options.tolerance), FAILED)
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
    found: Against | Comparison
    try:
        if measured:
            series = read_series(run.scene, second, pairs("--column", options.column))
            found = against(run, series, options.shift)
        else:
            other = load(second)
            other = later(other, other.scene.initial.clock - run.scene.initial.clock)
            found = compare(run, other, (str(first), str(second)))
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    with place.written() as folder:
        if measured:
            code = written(found, folder, options, save_against, "against")
        else:
            save = partial(save_comparison, tolerance=options.tolerance)
            code = written(found, folder, options, save, "comparison")
    place.tell(against_text(found) if isinstance(found, Against) else comparison_text(found))
    code = place.ended(code, "the comparison is whole")
    most = options.tolerance
    if isinstance(found, Comparison) and most is not None and found.exceeds(most):
        return complain(excess_text(found, most), FAILED)
    return code
