"""Saved runs beside each other or beside measurements, and the command `fit`."""

from __future__ import annotations

import argparse
from functools import partial

from exudyn_flexlink.cli.keeping import written
from exudyn_flexlink.cli.placing import Place
from exudyn_flexlink.cli.running import read_scene, refuse_idle_integrator, simulating, studying
from exudyn_flexlink.cli.terminal import FAILED, INTERRUPTED, complain
from exudyn_flexlink.comparison import Comparison, compare
from exudyn_flexlink.fitting import Against, NoFitError, against, fit, read_series
from exudyn_flexlink.report import against_text, comparison_text, excess_text, fit_text
from exudyn_flexlink.result import later
from exudyn_flexlink.storage import load, save_against, save_comparison, save_fit

OF_MODELS = {"settings": "set", "impact": "impact", "without": "without", "engine": "engine"}
"""Options of `compare` that change a model, which a saved run no longer is."""
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
    run = load(first)
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
    with place.written() as folder:
        if isinstance(found, Against):
            told, code = (
                against_text(found),
                written(found, folder, options, save_against, "against"),
            )
        else:
            save = partial(save_comparison, tolerance=options.tolerance)
            told, code = comparison_text(found), written(found, folder, options, save, "comparison")
    place.tell(told)
    code = place.ended(code, "the comparison is whole")
    judged = isinstance(found, Comparison) and options.tolerance is not None
    if judged and found.exceeds(options.tolerance):
        return complain(excess_text(found, options.tolerance), FAILED)
    return code


def fit_command(options: argparse.Namespace) -> int:
    """Fit numbers of a model to a measured series; returns the exit code."""
    place = Place(options, "-fit", "fit")
    refuse_idle_integrator(options, options.engine)
    scene = read_scene(options)
    series = read_series(scene, options.measured, _pairs("--column", options.column))
    vary = {path: bounds or None for path, bounds in _pairs("--vary", options.vary).items()}
    try:
        # The folder is staged first: one that can't be written is no news for the end of a fit.
        with place.written() as folder:
            with studying(scene, options, "fit") as (simulate, bar):
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
