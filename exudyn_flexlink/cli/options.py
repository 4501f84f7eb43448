"""Options that several commands share, and how a command is added."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from exudyn_flexlink.cli.completing import FILE, FOLDER, MODEL_OR_FILE, completes
from exudyn_flexlink.cli.figures import FIGURE_FORMATS, FIGURE_STYLES
from exudyn_flexlink.cli.terminal import refuse
from exudyn_flexlink.cli.values import EFFECT_NAMES, model_path, names_of


def add_impact(parser: argparse.ArgumentParser) -> None:
    """Add how contacts strike."""
    parser.add_argument(
        "--impact",
        choices=("penalty", "impulse"),
        help="how contacts strike, instead of what the model says",
    )


def add_engine(
    parser: argparse.ArgumentParser,
    about: str = "what solves the equations of motion; default: exudyn",
    default: str | None = "exudyn",
) -> None:
    """Add which engine runs."""
    parser.add_argument("--engine", choices=("exudyn", "lagrangian"), default=default, help=about)


def add_without(parser: argparse.ArgumentParser, more: str = "") -> None:
    """Add effects that are left out."""
    parser.add_argument(
        "--without",
        type=names_of(EFFECT_NAMES, "effect"),
        action="extend",
        default=[],
        metavar="EFFECT[,EFFECT]",
        help=f"{more}leave out {', '.join(EFFECT_NAMES)} (of hinges and springs; restitution "
        "stays); may be repeated",
    )


def add_measure(parser: argparse.ArgumentParser) -> None:
    """Add that runs are made once only."""
    parser.add_argument(
        "--no-measure",
        dest="measure",
        action="store_false",
        help="make each run once: its errors are not known then; without this option a second, "
        "finer run measures them, and is the result",
    )


def add_output(parser: argparse.ArgumentParser, default: str) -> None:
    """Add where a run is written, with which figures, and how quietly."""
    add_out(parser, "DIR", f"where to write; default: {default}, with the options in its name")
    add_force(
        parser,
        "replace also files that no run wrote, or that were changed since, where names are the "
        "same, and a complete result by an incomplete one",
    )
    parser.add_argument("--no-plots", action="store_true", help="draw no figures")
    add_figures(parser)
    parser.add_argument(
        "--quiet", action="store_true", help="no progress and no summary; warnings stay"
    )


def add_out(parser: argparse.ArgumentParser, metavar: str, about: str) -> None:
    """Add where something is written."""
    out = parser.add_argument("--out", type=Path, metavar=metavar, help=about)
    completes(out, FOLDER if metavar == "DIR" else FILE)


def add_force(parser: argparse.ArgumentParser, about: str) -> None:
    """Add that files are replaced."""
    parser.add_argument("--force", action="store_true", help=about)


def add_figures(parser: argparse.ArgumentParser) -> None:
    """Add the options that say how figures look."""
    add_formats(parser, FIGURE_FORMATS, "formats of figures", FIGURE_FORMATS[0])
    parser.add_argument(
        "--style",
        choices=FIGURE_STYLES,
        help="how figures look: print is one column of a page wide, 86 mm, without titles; "
        f"default: {FIGURE_STYLES[0]}",
    )


def add_formats(
    parser: argparse.ArgumentParser, known: tuple[str, ...], about: str, default: str
) -> None:
    """Add the option that names formats of files; `default` says in words which are usual."""
    read = names_of(known, "format")
    parser.add_argument(
        "--format",
        type=lambda text: read(text.lower()),
        action="extend",
        metavar="FORMAT[,FORMAT]",
        help=f"{about}: {', '.join(known)}; default: {default}; may be repeated",
    )


def add_figure_file(parser: argparse.ArgumentParser, about: str) -> None:
    """Add the option that asks for one figure, by the name of its file."""
    figure = parser.add_argument("--figure", type=_figure_file, metavar="FILE", help=about)
    completes(figure, FILE)
    add_force(parser, "replace FILE also if it is no figure of this program")


def _figure_file(text: str) -> Path:
    """Read the name of a figure's file; its ending says the format."""
    file = Path(text)
    if file.suffix[1:].lower() not in FIGURE_FORMATS:
        endings = ", ".join(f".{name}" for name in FIGURE_FORMATS)
        raise argparse.ArgumentTypeError(f"'{text}' does not end in one of {endings}")
    return file


class Command(NamedTuple):
    """What a command takes, and its help: one sentence, and examples without the program's name."""

    add_options: Callable[[argparse.ArgumentParser], None]
    about: str
    examples: tuple[str, ...]


def helps(
    about: str, *examples: str
) -> Callable[[Callable[[argparse.ArgumentParser], None]], Command]:
    """Make a command of what adds its options; ``python -OO`` leaves no docstring to tell more."""
    return lambda add_options: Command(add_options, about, examples)


def add_command(commands: Any, name: str, module: str, command: Command) -> None:
    """Add a command; ``NAME_command`` of a module of this room carries it out.

    That is imported when it is called: it takes much longer than to print a help text.
    """
    parser: argparse.ArgumentParser = commands.add_parser(
        name,
        help=command.about[:1].lower() + command.about[1:].rstrip("."),
        description=command.about,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    called = parser.prog.removesuffix(f" {name}")
    parser.epilog = "\n".join(["examples:", *(f"  {called} {one}" for one in command.examples)])
    parser.set_defaults(command=partial(_carried_out, module, f"{name}_command"))
    command.add_options(parser)


def _carried_out(module: str, function: str, options: argparse.Namespace) -> int:
    try:
        code: int = getattr(import_module(f"exudyn_flexlink.cli.{module}"), function)(options)
    except Exception as error:
        from exudyn_flexlink.cli.keeping import REFUSALS

        if isinstance(error, REFUSALS):
            return refuse(error)
        raise
    return code


def add_model(parser: argparse.ArgumentParser) -> None:
    """Add the model, with what changes it."""
    about = "model file, YAML; or the name of a model that comes with the program"
    model = parser.add_argument("model", type=model_path, metavar="MODEL", help=about)
    completes(model, MODEL_OR_FILE)
    add_changes(parser)


def add_changes(parser: argparse.ArgumentParser) -> None:
    """Add what replaces values of the model, and what the model may read."""
    parser.add_argument(
        "--set",
        dest="settings",
        action="append",
        default=[],
        metavar="PATH=VALUE",
        help="replace a value of the model, such as run.turns=2; null takes a key away that is "
        "there; may be repeated",
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
