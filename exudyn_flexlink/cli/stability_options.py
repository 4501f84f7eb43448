"""The command `stability` as the command line knows it: its options and its help."""

from __future__ import annotations

from typing import Any

from exudyn_flexlink.cli.options import (
    add_command,
    add_engine,
    add_impact,
    add_model,
    add_output,
    add_without,
)
from exudyn_flexlink.cli.values import count, degrees, duration, length

LAPS, AFTER = 24, 4
"""Laps of a study, and those of them in which the motion settles."""


def add_stability(commands: Any) -> None:
    """Add the command."""
    parser = add_command(
        commands,
        "stability",
        "stability",
        "tell whether a motion repeats itself, and how fast neighbouring motions part",
        """\
        exudyn-flexlink stability no_clearance --engine lagrangian
        exudyn-flexlink stability clearance --engine lagrangian --twice
        exudyn-flexlink stability clearance --engine lagrangian --set joints.sleeve.clearance=1mm
        exudyn-flexlink stability slider_crank_clearance --laps 40 --at 90""",
    )
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
