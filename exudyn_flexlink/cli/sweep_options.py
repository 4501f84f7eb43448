"""The options of the command `sweep`."""

from __future__ import annotations

from typing import Any

from exudyn_flexlink.cli.completing import MODEL_OR_FILE, completes
from exudyn_flexlink.cli.options import (
    add_changes,
    add_command,
    add_engine,
    add_impact,
    add_output,
    add_retries,
    add_without,
)
from exudyn_flexlink.cli.values import at_least_one


def add_sweep(commands: Any) -> None:
    """Add the command."""
    parser = add_command(
        commands,
        "sweep",
        "sweeping",
        "simulate a model at many points, each a row of one table",
        """\
        exudyn-flexlink sweep no_clearance --vary drives.motor.value=5:15:11 --set run.turns=2
        exudyn-flexlink sweep clearance --vary joints.sleeve.clearance=1,2,5mm --workers 2
        exudyn-flexlink sweep clearance --vary drives.motor.value=5:15:11 --resume
        exudyn-flexlink sweep study.yaml
        exudyn-flexlink sweep study.yaml --scheduler tcp://192.168.0.10:8786""",
    )
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
    parser.add_argument(
        "--no-horizon",
        dest="measure",
        action="store_false",
        help="make no second run where contacts multiply errors: errors are not known then",
    )
    add_retries(parser)
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
