"""Commands that read a model: their options, and the help of each."""

from __future__ import annotations

import argparse

from exudyn_flexlink.cli.completing import BENCHMARK, MODEL_OR_FILE, completes
from exudyn_flexlink.cli.options import (
    add_changes,
    add_engine,
    add_figure_file,
    add_impact,
    add_measure,
    add_model,
    add_output,
    add_without,
    helps,
)
from exudyn_flexlink.cli.values import (
    at_least_one,
    count,
    degrees,
    duration,
    length,
    published_file,
)

LAPS, AFTER = 24, 4
"""Laps of a study of stability, and those of them in which the motion settles."""


@helps(
    "Simulate a model, save its results and draw its figures.",
    "simulate no_clearance",
    "simulate no_clearance --set run.turns=2 --out runs/short",
    "simulate no_clearance --engine lagrangian --impact impulse",
    "simulate clearance_friction --without friction,damping",
    "simulate clearance --set run.turns=1 --no-measure --report",
)
def simulate_options(parser: argparse.ArgumentParser) -> None:
    """Add what `simulate` takes."""
    add_model(parser)
    add_engine(parser)
    add_impact(parser)
    add_without(parser)
    add_measure(parser)
    parser.add_argument(
        "--report",
        action="store_true",
        help="write report.html, too: one page with outcome, figures, tables and the model, which "
        "loads nothing else",
    )
    add_output(parser, "runs/<name of the model>")


@helps(
    "Compare both engines on a model, or a model with and without an effect.",
    "compare smooth --set run.turns=2 --tolerance 1e-5",
    "compare no_clearance --set accuracy.tolerance=1e-6",
    "compare no_clearance --impact impulse --out runs/impulse",
    "compare clearance --without clearance --set run.turns=1",
)
def compare_options(parser: argparse.ArgumentParser) -> None:
    """Add what `compare` takes."""
    add_model(parser)
    parser.add_argument(
        "--tolerance",
        type=length,
        metavar="M",
        help="end with code 1 if a point differs by more than this, in m, up to the horizon",
    )
    add_impact(parser)
    add_without(parser, "compare the model with itself without the effect, in one engine: ")
    add_engine(parser, "the engine of '--without'; default: exudyn", None)
    add_measure(parser)
    add_output(parser, "runs/<name of the model>-compare")


@helps(
    "Study what accuracy costs in a model: error over processor time, and what limits it.",
    "accuracy smooth",
    "accuracy no_clearance --set run.turns=2 --target 1e-5",
    "accuracy no_clearance --watch link.end",
    "accuracy clearance --set run.turns=0.5 --budget 300",
)
def accuracy_options(parser: argparse.ArgumentParser) -> None:
    """Add what `accuracy` takes."""
    add_model(parser)
    parser.add_argument(
        "--target",
        type=length,
        metavar="M",
        help="error that is good enough, in m; default: the model's tolerance, or 1e-4",
    )
    parser.add_argument(
        "--budget",
        type=duration,
        default=60.0,
        metavar="SECONDS",
        help="time that the study may take; runs that do not fit in are left out; default: 60",
    )
    add_impact(parser)
    add_without(parser)
    add_output(parser, "runs/<name of the model>-accuracy")


@helps(
    "Tell whether a motion repeats itself, and how fast neighbouring motions part.",
    "stability no_clearance --engine lagrangian",
    "stability clearance --engine lagrangian --twice",
    "stability clearance --engine lagrangian --set joints.sleeve.clearance=1mm",
    "stability slider_crank_clearance --laps 40 --at 90",
)
def stability_options(parser: argparse.ArgumentParser) -> None:
    """Add what `stability` takes."""
    add_model(parser)
    parser.add_argument(
        "--laps",
        type=count,
        default=LAPS,
        metavar="N",
        help=f"laps to run, whatever the model's 'run' says; default: {LAPS}",
    )
    parser.add_argument(
        "--after",
        type=count,
        default=AFTER,
        metavar="N",
        help=f"laps in which the motion settles, which do not count; default: {AFTER}",
    )
    parser.add_argument(
        "--lap",
        type=duration,
        metavar="SECONDS",
        help="how long a lap is; default: a turn of the joint that a drive turns at one speed",
    )
    parser.add_argument(
        "--at",
        type=degrees,
        default=0.0,
        metavar="DEG",
        help="crank angle of the Poincare section, in degrees; default: 0",
    )
    parser.add_argument(
        "--tolerance",
        type=length,
        metavar="M",
        help="error that runs may make, in m; default: the model's, or less, so that neighbours "
        "are well above it",
    )
    parser.add_argument(
        "--twice",
        action="store_true",
        help="make the exponent again at a tenth of the tolerance, to see whether that matters",
    )
    add_engine(parser)
    add_impact(parser)
    add_without(parser)
    add_output(parser, "runs/<name of the model>-stability")


@helps(
    "Simulate a model at many points, each a row of one table.",
    "sweep no_clearance --vary drives.motor.value=5:15:11 --set run.turns=2",
    "sweep clearance --vary joints.sleeve.clearance=1,2,5mm --workers 2",
    "sweep clearance --vary drives.motor.value=5:15:11 --resume",
    "sweep study.yaml",
    "sweep study.yaml --scheduler tcp://192.168.0.10:8786",
)
def sweep_options(parser: argparse.ArgumentParser) -> None:
    """Add what `sweep` takes."""
    source = parser.add_argument(
        "source",
        metavar="MODEL|STUDY",
        help="with '--vary' a model, its file or the name of one that comes with the program; "
        "without it a study file, which says what is varied",
    )
    completes(source, MODEL_OR_FILE)
    parser.add_argument(
        "--vary",
        action="append",
        default=[],
        metavar="PATH=VALUES",
        help="values of the model, start:stop:count such as 'run.turns=1:3:5' or a list such as "
        "'joints.sleeve.clearance=0.5, 1, 2 mm'; may be repeated: each value with every other",
    )
    add_changes(parser)
    add_engine(parser, "what solves the equations of motion; default: exudyn, or the study's", None)
    add_impact(parser)
    add_without(parser)
    add_measure(parser)
    parser.add_argument(
        "--series", action="store_true", help="save every run whole, in the sweep's folder"
    )
    parser.add_argument(
        "--resume",
        action="store_true",
        help="go on with a sweep that was interrupted: rows that are there are not made again",
    )
    parser.add_argument(
        "--workers",
        type=at_least_one,
        metavar="N",
        help="processes that run; default: one for every core",
    )
    parser.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="run on the workers of this scheduler of Dask, such as tcp://host:8786",
    )
    add_output(parser, "runs/<name of the model>-sweep")


@helps(
    "Run benchmarks and hold the results against published numbers.",
    "verify",
    "verify pendulum n_four_bar",
    "verify cantilever --figure cantilever.png",
    "verify pendulum --as json",
)
def verify_options(parser: argparse.ArgumentParser) -> None:
    """Add what `verify` takes."""
    benchmarks = parser.add_argument(
        "benchmarks",
        nargs="*",
        type=published_file,
        metavar="NAME",
        help="a model with published numbers that comes with the program, or a file "
        "'MODEL.published.yaml' beside a model; default: all that come with the program",
    )
    completes(benchmarks, BENCHMARK)
    parser.add_argument(
        "--as",
        dest="form",
        choices=("text", "markdown", "json"),
        default="text",
        help="how results are printed; default: text",
    )
    add_figure_file(
        parser, "draw the differences, and what is allowed; png, pdf or svg by FILE's ending"
    )
    parser.add_argument("--quiet", action="store_true", help="no progress; results stay")
    parser.set_defaults(impact=None)


@helps(
    "Check a model without simulating it: parts, effects, frequencies, steps, formulation.",
    "check no_clearance",
    "check no_clearance --set bodies.link.hinges.stiffness=beam",
    "check smooth --set bodies.link.rods=20",
    "check clearance --without impact",
    "check whitworth --figure whitworth.png",
)
def check_options(parser: argparse.ArgumentParser) -> None:
    """Add what `check` takes."""
    add_model(parser)
    add_without(parser)
    add_figure_file(
        parser, "draw the mechanism where it starts, with names; png, pdf or svg by FILE's ending"
    )
    parser.set_defaults(impact=None)
