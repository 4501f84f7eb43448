"""What the command line knows: commands, their options, and the help of each."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, NoReturn

from exudyn_flexlink.cli.completing import (
    BENCHMARK,
    FILE,
    MODEL,
    SHELLS,
    completes,
)
from exudyn_flexlink.cli.options import (
    add_command,
    add_engine,
    add_figure_file,
    add_force,
    add_impact,
    add_model,
    add_out,
    add_output,
    add_retries,
    add_without,
)
from exudyn_flexlink.cli.saved_options import add_animate, add_plot, add_report
from exudyn_flexlink.cli.stability_options import add_stability
from exudyn_flexlink.cli.sweep_options import add_sweep
from exudyn_flexlink.cli.terminal import BAD_INPUT, PROGRAM, complain
from exudyn_flexlink.cli.values import (
    duration,
    length,
    published_file,
    shipped_model,
)

NEW_MODEL = "no_clearance"
"""What `new` copies if nothing is named."""


def program_parser(called: str = PROGRAM) -> argparse.ArgumentParser:
    """Return what reads the arguments of a command line; `called` as usage lines say."""
    parser = _Parser(
        prog=called,
        description="Slot-driven flexible mechanisms with impact, from a YAML model to numbers.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="first steps:\n"
        f"  {called} simulate no_clearance\n"
        f"  {called} new no_clearance mine.yaml\n"
        f"  {called} simulate --help",
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version")
    parser.set_defaults(command=lambda _: complain(parser.format_help().rstrip(), BAD_INPUT))
    commands = parser.add_subparsers(metavar="COMMAND")
    _add_simulate(commands)
    _add_compare(commands)
    _add_accuracy(commands)
    add_stability(commands)
    add_sweep(commands)
    _add_verify(commands)
    _add_check(commands)
    add_plot(commands)
    add_report(commands)
    add_animate(commands)
    _add_new(commands)
    _add_schema(commands)
    _add_completion(commands)
    return parser


class _Parser(argparse.ArgumentParser):
    """A parser that says what is wrong, without ten lines of usage before it."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Refuse here what is unknown: a command knows its own options, the program does not."""
        found, unknown = super().parse_known_args(args, namespace)
        if unknown:
            from exudyn_flexlink.source import did_you_mean

            word = next((one for one in unknown if one.startswith("-")), unknown[0])
            name = word.partition("=")[0]
            self.error(
                f"unknown argument '{word}'{did_you_mean(name, self._option_string_actions)}"
            )
        return found, unknown

    def error(self, message: str) -> NoReturn:
        """Say it, with a hint, and end the program: bad input."""
        complain(f"{self.prog}: {message}")
        if "\nhint: " not in message:
            complain(f"hint: '{self.prog} --help' tells what it takes")
        self.exit(BAD_INPUT)


class _Version(argparse.Action):
    """Looks the version up only when it is asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        from exudyn_flexlink.versions import THIS, version_of

        print(f"{THIS} {version_of(THIS)}")
        parser.exit()


def _add_simulate(commands: Any) -> None:
    parser = add_command(
        commands,
        "simulate",
        "simulating",
        "simulate a model, save its results and draw its figures",
        """\
        exudyn-flexlink simulate no_clearance
        exudyn-flexlink simulate no_clearance --set run.turns=2 --out runs/short
        exudyn-flexlink simulate no_clearance --engine lagrangian --impact impulse
        exudyn-flexlink simulate clearance_friction --without friction,damping
        exudyn-flexlink simulate clearance --set run.turns=1 --horizon --report""",
    )
    add_model(parser)
    add_engine(parser)
    add_impact(parser)
    add_without(parser)
    parser.add_argument(
        "--horizon",
        action=argparse.BooleanOptionalAction,
        help="make a second, more accurate run, and say up to when points can be trusted; "
        "without this option: make one only where contacts multiply errors, and warn if these "
        "exceed the tolerance; --no-horizon: make none",
    )
    add_retries(parser)
    parser.add_argument(
        "--report",
        action="store_true",
        help="write report.html, too: one page with outcome, figures, tables and the model, which "
        "loads nothing else",
    )
    add_output(parser, "runs/<name of the model>")


def _add_compare(commands: Any) -> None:
    parser = add_command(
        commands,
        "compare",
        "comparing",
        "compare both engines on a model, or a model with and without an effect",
        """\
        exudyn-flexlink compare smooth --set run.turns=2 --tolerance 1e-5
        exudyn-flexlink compare no_clearance --set accuracy.tolerance=1e-6
        exudyn-flexlink compare no_clearance --impact impulse --out runs/impulse
        exudyn-flexlink compare clearance --without clearance --set run.turns=1""",
    )
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
    add_output(parser, "runs/<name of the model>-compare")


def _add_accuracy(commands: Any) -> None:
    parser = add_command(
        commands,
        "accuracy",
        "studying",
        "study what accuracy costs in a model: error over processor time, and what limits it",
        """\
        exudyn-flexlink accuracy smooth
        exudyn-flexlink accuracy no_clearance --set run.turns=2 --target 1e-5
        exudyn-flexlink accuracy no_clearance --watch link.end
        exudyn-flexlink accuracy clearance --set run.turns=0.5 --budget 300""",
    )
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


def _add_check(commands: Any) -> None:
    parser = add_command(
        commands,
        "check",
        "commands",
        "check a model without simulating it: parts, effects, frequencies, steps, formulation",
        """\
        exudyn-flexlink check no_clearance
        exudyn-flexlink check no_clearance --set bodies.link.hinges.stiffness=beam
        exudyn-flexlink check smooth --set bodies.link.rods=20
        exudyn-flexlink check clearance --without impact
        exudyn-flexlink check whitworth --figure whitworth.png""",
    )
    add_model(parser)
    add_without(parser)
    add_figure_file(
        parser, "draw the mechanism where it starts, with names; png, pdf or svg by FILE's ending"
    )
    parser.set_defaults(impact=None)


def _add_verify(commands: Any) -> None:
    parser = add_command(
        commands,
        "verify",
        "verifying",
        "run benchmarks and hold the results against published numbers",
        """\
        exudyn-flexlink verify
        exudyn-flexlink verify pendulum n_four_bar
        exudyn-flexlink verify cantilever --figure cantilever.png
        exudyn-flexlink verify pendulum --as json""",
    )
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


def _add_new(commands: Any) -> None:
    parser = add_command(
        commands,
        "new",
        "copying",
        "copy a model that comes with the program, to change it",
        """\
        exudyn-flexlink new
        exudyn-flexlink new clearance mine.yaml
        exudyn-flexlink new spline_track dwells.yaml
        exudyn-flexlink new --list""",
    )
    model = parser.add_argument(
        "model",
        nargs="?",
        type=shipped_model,
        default=NEW_MODEL,
        metavar="MODEL",
        help=f"its name, as '--list' tells it; default: {NEW_MODEL}",
    )
    completes(model, MODEL)
    file = parser.add_argument(
        "file",
        nargs="?",
        type=Path,
        metavar="FILE",
        help="where to, a file or a folder; default: the model's name, here. What the model "
        "needs, and the schema for editors, is put beside it",
    )
    completes(file, FILE)
    parser.add_argument("--list", action="store_true", help="list all models with their titles")
    add_force(parser, "replace files that stand there, too")


def _add_completion(commands: Any) -> None:
    parser = add_command(
        commands,
        "completion",
        "completing",
        "print a script with which a shell completes commands, options and models",
        """\
        exudyn-flexlink completion bash
        exudyn-flexlink completion zsh""",
    )
    parser.add_argument("shell", choices=SHELLS, help="the shell it is for")


def _add_schema(commands: Any) -> None:
    parser = add_command(
        commands,
        "schema",
        "commands",
        "print the JSON schema of model files, which editors complete and check with",
        """\
        exudyn-flexlink schema
        exudyn-flexlink schema --out flexlink.schema.json""",
    )
    add_out(parser, "FILE", "write it to this file")
    add_force(parser, "replace the file also if it is no such schema")
