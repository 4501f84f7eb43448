"""Saved runs beside each other or beside measurements, and the command `fit`."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from typing import Any

from exudyn_flexlink import engines
from exudyn_flexlink.cli.figures import draw_figure
from exudyn_flexlink.cli.keeping import kept
from exudyn_flexlink.cli.placing import Place
from exudyn_flexlink.cli.running import read_scene, refusals, refuse_idle_integrator, simulating
from exudyn_flexlink.cli.terminal import FAILED, INTERRUPTED, complain, progress_bar
from exudyn_flexlink.comparison import Comparison, compare
from exudyn_flexlink.fitting import Against, Fit, NoFitError, against, fit, read_series
from exudyn_flexlink.report import against_text, comparison_text, excess_text, fit_text
from exudyn_flexlink.result import later
from exudyn_flexlink.storage import load, save_against, save_comparison, save_fit

OF_MODELS = {"settings": "set", "impact": "impact", "without": "without", "engine": "engine"}
"""Options of `compare` that change a model, which a saved run no longer is."""
FIGURES = {Fit: ("fit", "fit"), Against: ("against", "comparison"), Comparison: ("comparison", "")}
"""Figures by what they show, with the names of their files."""
UNTOLD = "interrupted before the fit was found; nothing was written"


def compare_saved(options: argparse.Namespace) -> int:
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
    run, save = load(first), partial(save_comparison, tolerance=options.tolerance)
    found: Against | Comparison
    try:
        if measured:
            series = read_series(run.scene, second, _pairs("--column", options.column))
            found = against(run, series, options.shift)
        else:
            other = load(second)
            other = later(other, other.scene.initial.clock - run.scene.initial.clock)
            found = compare(run, other, (str(first), str(second)))
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    if isinstance(found, Against):
        return _written(place, options, found, save_against, against_text(found))
    code = _written(place, options, found, save, comparison_text(found))
    if options.tolerance is not None and found.exceeds(options.tolerance):
        return complain(excess_text(found, options.tolerance), FAILED)
    return code


def fit_command(options: argparse.Namespace) -> int:
    """Fit numbers of a model to a measured series; returns the exit code."""
    place = Place(options, "-fit", "fit")
    refuse_idle_integrator(options, options.engine)
    scene = read_scene(options)
    series = read_series(scene, options.measured, _pairs("--column", options.column))
    vary = {path: bounds or None for path, bounds in _pairs("--vary", options.vary).items()}
    simulate = partial(engines.simulate, engine=options.engine, measure=False)
    try:
        with refusals(scene, options.engine, options), progress_bar(options.quiet, "fit") as bar:
            found = fit(scene, series, vary, simulate, bar)
    except NoFitError as error:
        return complain(f"no fit: {error}", FAILED)
    except KeyboardInterrupt:
        return complain(UNTOLD, INTERRUPTED)
    again = simulating(options, *(f"{path}={x:.10g}" for path, x in found.values.items()))
    told = f"{fit_text(found)}\n\nThe model with these values:\n  {again}"
    code = _written(place, options, found, save_fit, told)
    for warning in found.warnings:
        complain(f"warning: {warning}")
    return code


def _written(
    place: Place, options: argparse.Namespace, found: Any, save: Callable[..., None], told: str
) -> int:
    """Write numbers, then the figure, and tell of both; returns the exit code."""
    figure, name = FIGURES[type(found)]
    with place.written() as folder:
        draw = partial(draw_figure, options, figure, found, folder, name)
        code = kept(partial(save, found, folder=folder), None if options.no_plots else draw, folder)
    place.tell(told)
    code = place.code(code)
    if code == INTERRUPTED:
        complain("interrupted: the numbers are whole", INTERRUPTED)
    return place.ended(code)


def _pairs(option: str, texts: list[str]) -> dict[str, str]:
    """Read NAME=TEXT of an option that may be repeated; '--vary' may leave the text out."""
    found: dict[str, str] = {}
    for text in texts:
        name, _, own = (part.strip() for part in text.partition("="))
        if option == "--column" and not (name and own):
            told = f"{option}: expected NAME=QUANTITY such as 'theta=lever.angle', got '{text}'"
            raise argparse.ArgumentTypeError(told)
        if name in found:
            raise argparse.ArgumentTypeError(f"{option}: '{name}' is given twice")
        found[name] = own
    return found
