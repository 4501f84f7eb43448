"""The program at a terminal: arguments in, one function called, an exit code out.

Exit codes: 0 done; 1 the run, or only its figures, failed, what was computed is kept, or a
comparison exceeds its tolerance; 2 bad input, or a place that can't be written; 130 interrupted;
143 or 129 asked to end, by SIGTERM or by SIGHUP.
Whatever is slow to import is imported by the command that needs it: `check` must answer at once.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from math import inf
from pathlib import Path
from typing import Any

from exudyn_flexlink.cli.commands import check_command, plot_command, schema_command
from exudyn_flexlink.cli.comparing import compare_command
from exudyn_flexlink.cli.ending import Ending, ended_by_signals
from exudyn_flexlink.cli.figures import add_figures, idle_options
from exudyn_flexlink.cli.simulating import simulate_command
from exudyn_flexlink.cli.studying import accuracy_command
from exudyn_flexlink.cli.terminal import (
    BAD_INPUT,
    DONE,
    FAILED,
    INTERRUPTED,
    complain,
    prepare_streams,
    release_streams,
)

EFFECT_NAMES = ("clearance", "flexibility", "impact", "friction", "damping")
"""Those of `effects`, which is too slow to import for a help text."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the program with the arguments of a command line; returns its exit code."""
    prepare_streams()
    with ended_by_signals() as ending:
        try:
            return ending.code(_run(arguments, ending))
        finally:
            release_streams()


def _run(arguments: Sequence[str] | None, ending: Ending) -> int:
    try:
        try:
            options = _parser().parse_args(arguments)
            options.ending = ending
            idle = idle_options(options)
            code: int = complain(idle, BAD_INPUT) if idle else options.command(options)
        finally:
            sys.stdout.flush()
    except KeyboardInterrupt:
        return complain("interrupted; nothing was written", INTERRUPTED)
    except MemoryError:
        return complain("not enough memory: shorten the run, or give a longer run.sample", FAILED)
    except OSError as error:  # of files the commands tell themselves: this is the output's
        if ending.asked:  # the terminal was closed
            return INTERRUPTED
        if isinstance(error, BrokenPipeError):  # the reader, such as `head`, has seen enough
            return DONE
        return complain(f"can't write to the output: {error.strerror or error}", FAILED)
    return code


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="exudyn-flexlink",
        description="Slot-driven flexible mechanisms with impact, from a YAML model to numbers.",
        epilog="'exudyn-flexlink COMMAND --help' shows the options of a command, with examples",
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    _add_simulate(commands)
    _add_compare(commands)
    _add_accuracy(commands)
    _add_check(commands)
    _add_plot(commands)
    _add_schema(commands)
    return parser


class _Version(argparse.Action):
    """Looks the version up only when it is asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        from importlib.metadata import PackageNotFoundError, version

        try:
            print(f"exudyn-flexlink {version('exudyn-flexlink')}")
        except PackageNotFoundError:
            print("exudyn-flexlink, not installed: run from its source")
        parser.exit()


def _add_simulate(commands: Any) -> None:
    parser = _command(
        commands,
        "simulate",
        simulate_command,
        "simulate a model, save its results and draw its figures",
        """\
        exudyn-flexlink simulate models/no_clearance.yaml
        exudyn-flexlink simulate models/no_clearance.yaml --set run.turns=2 --out runs/short
        exudyn-flexlink simulate models/no_clearance.yaml --engine lagrangian --impact impulse
        exudyn-flexlink simulate models/clearance_friction.yaml --without friction,damping
        exudyn-flexlink simulate models/clearance.yaml --set run.turns=1 --horizon""",
    )
    _add_model(parser)
    _add_engine(parser, "what solves the equations of motion; default: exudyn", "exudyn")
    _add_impact(parser)
    _add_without(parser)
    parser.add_argument(
        "--horizon",
        action=argparse.BooleanOptionalAction,
        help="make a second, neighbouring run, and say up to when points can be trusted; "
        "left out: make one where contacts multiply errors, and say when they outgrow the "
        "tolerance; --no-horizon: make none",
    )
    parser.add_argument(
        "--retries",
        type=_count,
        default=0,
        metavar="N",
        help="make a run again whose numbers are doubtful (energy, joints, impacts), up to N "
        "times, each time ten times as accurate; left out: it warns",
    )
    _add_output(parser, "runs/<name of the model>")


def _add_compare(commands: Any) -> None:
    parser = _command(
        commands,
        "compare",
        compare_command,
        "compare both engines on a model, or a model with and without an effect",
        """\
        exudyn-flexlink compare models/smooth.yaml --set run.turns=2 --tolerance 1e-5
        exudyn-flexlink compare models/no_clearance.yaml --set accuracy.tolerance=1e-6
        exudyn-flexlink compare models/no_clearance.yaml --impact impulse --out runs/impulse
        exudyn-flexlink compare models/clearance.yaml --without clearance --set run.turns=1""",
    )
    _add_model(parser)
    parser.add_argument(
        "--tolerance",
        type=_length,
        metavar="M",
        help="end with code 1 if a point differs by more, m, up to the horizon",
    )
    _add_impact(parser, "; impulse is for the Lagrangian alone")
    _add_without(parser, "compare the model with itself without the effect, in one engine: ")
    _add_engine(parser, "the engine of '--without'; default: exudyn", None)
    _add_output(parser, "runs/<name of the model>-compare")


def _add_accuracy(commands: Any) -> None:
    parser = _command(
        commands,
        "accuracy",
        accuracy_command,
        "study what accuracy costs in a model: error over processor time, and what limits it",
        """\
        exudyn-flexlink accuracy models/smooth.yaml
        exudyn-flexlink accuracy models/no_clearance.yaml --set run.turns=2 --target 1e-5
        exudyn-flexlink accuracy models/no_clearance.yaml --watch link.end
        exudyn-flexlink accuracy models/clearance.yaml --set run.turns=0.5 --budget 300""",
    )
    _add_model(parser)
    parser.add_argument(
        "--target",
        type=_length,
        metavar="M",
        help="error that is good enough, m; default: the model's tolerance, or 1e-4",
    )
    parser.add_argument(
        "--budget",
        type=_duration,
        default=60.0,
        metavar="SECONDS",
        help="time the study may take; what does not fit in is left out; default: 60",
    )
    _add_impact(parser)
    _add_without(parser)
    _add_output(parser, "runs/<name of the model>-accuracy")


def _duration(text: str) -> float:
    return _length(text)


_duration.__name__ = "time in s"


def _length(text: str) -> float:
    value = float(text)
    if not 0 < value < inf:
        raise ValueError(text)
    return value


_length.__name__ = "length in m"  # what argparse calls it in its complaint


def _count(text: str) -> int:
    value = int(text)
    if value < 0:
        raise ValueError(text)
    return value


_count.__name__ = "number"


def _add_impact(parser: argparse.ArgumentParser, more: str = "") -> None:
    parser.add_argument(
        "--impact",
        choices=("penalty", "impulse"),
        help=f"how contacts strike, instead of what the model says{more}",
    )


def _add_engine(parser: argparse.ArgumentParser, about: str, default: str | None) -> None:
    parser.add_argument("--engine", choices=("exudyn", "lagrangian"), default=default, help=about)


def _add_without(parser: argparse.ArgumentParser, more: str = "") -> None:
    parser.add_argument(
        "--without",
        type=_effects,
        action="extend",
        default=[],
        metavar="EFFECT[,EFFECT]",
        help=f"{more}leave out {', '.join(EFFECT_NAMES)} (of hinges and springs; restitution "
        "stays); may be repeated",
    )


def _effects(text: str) -> list[str]:
    """Names of effects, separated by commas."""
    names = [name.strip() for name in text.split(",")]
    for name in names:
        if name not in EFFECT_NAMES:
            listed = ", ".join(EFFECT_NAMES)
            raise argparse.ArgumentTypeError(f"no effect '{name}'; there is: {listed}")
    return names


def _add_output(parser: argparse.ArgumentParser, default: str) -> None:
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help=f"where to write; default: {default}"
    )
    _add_force(
        parser,
        "replace also what no run wrote or was changed since, where names are the same, and a "
        "complete result by an incomplete one",
    )
    parser.add_argument("--no-plots", action="store_true", help="draw no figures")
    add_figures(parser)
    parser.add_argument(
        "--quiet", action="store_true", help="no progress and no summary; warnings stay"
    )


def _add_check(commands: Any) -> None:
    parser = _command(
        commands,
        "check",
        check_command,
        "check a model without simulating it: parts, effects, frequencies, steps, formulation",
        """\
        exudyn-flexlink check models/no_clearance.yaml
        exudyn-flexlink check models/no_clearance.yaml --set bodies.link.hinges.stiffness=beam
        exudyn-flexlink check models/smooth.yaml --set bodies.link.rods=20
        exudyn-flexlink check models/clearance.yaml --without impact""",
    )
    _add_model(parser)
    _add_without(parser)


def _add_plot(commands: Any) -> None:
    parser = _command(
        commands,
        "plot",
        plot_command,
        "draw the figures of a saved run again",
        """\
        exudyn-flexlink plot runs/no_clearance
        exudyn-flexlink plot runs/no_clearance --out figures
        exudyn-flexlink plot runs/no_clearance --out paper --format pdf,svg --style print""",
    )
    parser.add_argument("run", type=Path, metavar="RUN", help="folder that 'simulate' wrote")
    parser.add_argument("--out", type=Path, metavar="DIR", help="where to; default: that folder")
    add_figures(parser)
    _add_force(parser, "replace also figures that no run drew, or that were changed since")


def _add_schema(commands: Any) -> None:
    parser = _command(
        commands,
        "schema",
        schema_command,
        "print the JSON schema of model files, which editors complete and check with",
        """\
        exudyn-flexlink schema
        exudyn-flexlink schema --out models/flexlink.schema.json""",
    )
    parser.add_argument("--out", type=Path, metavar="FILE", help="write it to this file")
    _add_force(parser, "replace the file also if it is no such schema")


def _add_force(parser: argparse.ArgumentParser, about: str) -> None:
    parser.add_argument("--force", action="store_true", help=about)


def _command(
    commands: Any, name: str, function: Any, about: str, examples: str
) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = commands.add_parser(
        name,
        help=about,
        description=about[0].upper() + about[1:] + ".",
        epilog="examples:\n" + examples.replace("        ", "  "),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(command=function)
    return parser


def _add_model(parser: argparse.ArgumentParser) -> None:
    about = "model file, YAML; or the name of a model that comes with the program"
    parser.add_argument("model", type=_model, metavar="MODEL", help=about)
    parser.add_argument(
        "--set",
        dest="settings",
        action="append",
        default=[],
        metavar="PATH=VALUE",
        help="replace a value of the model, such as run.turns=2; may be repeated",
    )
    parser.add_argument(
        "--watch",
        dest="settings",
        action="append",
        type="outputs.watch={}".format,
        metavar="BODY.POINT",
        help="show this point, and judge errors by it alone, not by all named points; short for "
        "--set outputs.watch=BODY.POINT",
    )
    parser.add_argument(
        "--allow-outside",
        action="store_true",
        help="let the model read CSV files outside its own folder",
    )


def _model(text: str) -> Path:
    """Return a file, or that of a model by its name where there is no such file."""
    path = Path(text)
    if path.suffix or path.exists():
        return path
    from exudyn_flexlink.shipped import model_file

    return model_file(text) or path
