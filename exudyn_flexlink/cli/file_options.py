"""Commands on files: saved runs, models to copy, the schema, completion; their options and help."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from exudyn_flexlink.cli.completing import FILE, FOLDER, MODEL, SHELLS, completes
from exudyn_flexlink.cli.options import add_figures, add_force, add_formats, add_out, helps
from exudyn_flexlink.cli.values import count, instant, names, rate, shipped_model

NEW_MODEL = "no_clearance"
"""What `new` copies if nothing is named."""
PAGE_ENDINGS = (".html", ".htm")
ANIMATIONS = ("mp4", "gif", "html")
"""Formats of `animation`, which is too slow to import for a help text."""


@helps(
    "Draw the figures of a saved run, or of a sweep, again.",
    "plot runs/no_clearance",
    "plot runs/no_clearance --out figures",
    "plot runs/no_clearance --out paper --format pdf,svg --style print",
    "plot runs/no_clearance-sweep --of lever.swing_rad,strike.strikes",
)
def plot_options(parser: argparse.ArgumentParser) -> None:
    """Add what `plot` takes."""
    _add_run(parser, "'simulate' or 'sweep'")
    add_out(parser, "DIR", "where to; default: that folder")
    parser.add_argument(
        "--of",
        type=names,
        default=[],
        metavar="COLUMN[,COLUMN]",
        help="columns of a sweep's table to draw; default: the first that differ",
    )
    add_figures(parser)
    add_force(parser, "replace also figures that no run drew, or that were changed since")


@helps(
    "Write the report of a saved run as one page of HTML, which loads nothing else.",
    "report runs/no_clearance",
    "report runs/no_clearance --out strike.html",
)
def report_options(parser: argparse.ArgumentParser) -> None:
    """Add what `report` takes."""
    _add_run(parser, "'simulate'")
    out = parser.add_argument(
        "--out",
        type=_page_file,
        metavar="FILE",
        help="where to, a file .html; default: report.html in the folder of the run",
    )
    completes(out, FILE)
    add_force(parser, "replace the file also if it is no report, or was changed since")


@helps(
    "Animate a saved run: a video, a GIF, and a page to play and step through it.",
    "animate runs/no_clearance",
    "animate runs/no_clearance --slow strike",
    "animate runs/no_clearance --slow strike:2 --from 1.5 --to 1.7 --format gif",
    "animate runs/clearance --with runs/no_clearance --format html",
)
def animate_options(parser: argparse.ArgumentParser) -> None:
    """Add what `animate` takes."""
    _add_run(parser, "'simulate'")
    other = parser.add_argument(
        "--with",
        dest="other",
        type=Path,
        metavar="RUN",
        help="show this run over the first, each in its engine's colour",
    )
    completes(other, FOLDER)
    parser.add_argument(
        "--slow",
        type=_slow,
        metavar="NAME[:NUMBER]",
        help="slow motion around the strikes of a contact, or the touches in a joint with "
        "clearance; or around one of them, counted from 1; 'strike' stands for all contacts",
    )
    parser.add_argument(
        "--from", dest="begin", type=instant, metavar="S", help="begin at this instant, in s"
    )
    parser.add_argument("--to", dest="end", type=instant, metavar="S", help="end there")
    add_formats(parser, ANIMATIONS, "formats", "mp4, or gif without ffmpeg, and html")
    parser.add_argument(
        "--speed",
        type=rate,
        metavar="X",
        help="seconds of the run in a second of the film: 0.1 is ten times slower than it is; "
        "default: one at which motions can be followed",
    )
    parser.add_argument(
        "--fps", type=rate, metavar="N", help="frames in a second; default: mp4 30, gif 20"
    )
    parser.add_argument("--width", type=count, metavar="PIXELS", help="default: mp4 1280, gif 640")
    add_out(parser, "DIR", "where to; default: the folder of RUN")
    add_force(parser, "replace also files that this program did not write, or that were changed")
    parser.add_argument("--quiet", action="store_true", help="no progress")


@helps(
    "Copy a model that comes with the program, to change it.",
    "new",
    "new clearance mine.yaml",
    "new spline_track dwells.yaml",
    "new --list",
)
def new_options(parser: argparse.ArgumentParser) -> None:
    """Add what `new` takes."""
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


@helps(
    "Print the JSON schema of model files, which editors complete and check with.",
    "schema",
    "schema --out flexlink.schema.json",
)
def schema_options(parser: argparse.ArgumentParser) -> None:
    """Add what `schema` takes."""
    add_out(parser, "FILE", "write it to this file")
    add_force(parser, "replace the file also if it is no such schema")


@helps(
    "Print a script with which a shell completes commands, options and models.",
    "completion bash",
    "completion zsh",
)
def completion_options(parser: argparse.ArgumentParser) -> None:
    """Add what `completion` takes."""
    parser.add_argument("shell", choices=SHELLS, help="the shell it is for")


def _add_run(parser: argparse.ArgumentParser, commands: str) -> None:
    """Add the folder of a saved run; `commands` write it."""
    run = parser.add_argument("run", type=Path, metavar="RUN", help=f"folder that {commands} wrote")
    completes(run, FOLDER)


def _page_file(text: str) -> Path:
    """Read the name of a page's file, by whose ending a browser knows it."""
    file = Path(text)
    if file.suffix.lower() not in PAGE_ENDINGS:
        raise argparse.ArgumentTypeError(f"'{text}' does not end in {' or '.join(PAGE_ENDINGS)}")
    return file


def _slow(text: str) -> Any:
    from exudyn_flexlink.animation.slowing import Slow

    try:
        return Slow.of(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
