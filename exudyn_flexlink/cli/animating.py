"""The command `animate`: a saved run, or two over each other, as a video, a GIF and a page."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from exudyn_flexlink.cli.completing import FOLDER, completes
from exudyn_flexlink.cli.figures import add_formats
from exudyn_flexlink.cli.keeping import why_not
from exudyn_flexlink.cli.options import add_command, add_force, add_out
from exudyn_flexlink.cli.terminal import (
    BAD_INPUT,
    DONE,
    FAILED,
    complain,
    progress_bar,
    refuse,
)
from exudyn_flexlink.cli.values import count, instant, rate

if TYPE_CHECKING:
    from exudyn_flexlink.animation import Film, Filming
    from exudyn_flexlink.result import Result

FORMATS = ("mp4", "gif", "html")
"""Those of `animation`, which is too slow to import for a help text."""


def add_animate(commands: Any) -> None:
    """Add the command with its options."""
    parser = add_command(
        commands,
        "animate",
        animate_command,
        "animate a saved run: a video, a GIF, and a page to play and step through it",
        """\
        exudyn-flexlink animate runs/no_clearance
        exudyn-flexlink animate runs/no_clearance --slow strike
        exudyn-flexlink animate runs/no_clearance --slow strike:2 --from 1.5 --to 1.7 --format gif
        exudyn-flexlink animate runs/clearance --with runs/no_clearance --format html""",
    )
    run = parser.add_argument("run", type=Path, metavar="RUN", help="folder that 'simulate' wrote")
    completes(run, FOLDER)
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
    add_formats(parser, FORMATS, "formats", "mp4, or gif without ffmpeg, and html")
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


def animate_command(options: argparse.Namespace) -> int:
    """Write the animation of a run; returns the exit code."""
    from exudyn_flexlink.animation import FilmError, Filming, usual_formats
    from exudyn_flexlink.storage import StorageError, staged_files

    formats = tuple(dict.fromkeys(options.format or usual_formats()))
    filming = Filming(options.fps, options.speed, options.width)
    folder: Path = options.out or options.run
    mistakes = _idle(options, formats)
    mistakes += dict.fromkeys(told for name in formats for told in filming.mistakes(name))
    film, why = _film(options)
    mistakes += why
    if film is None or mistakes:
        return complain("\n".join(mistakes), BAD_INPUT)
    written = []
    try:
        with staged_files(folder, force=options.force) as staged:
            for name in formats:
                file = staged / f"{_stem(options)}.{name}"
                file.write_bytes(_content(film, name, filming, quiet=options.quiet))
                written.append(file.name)
    except (StorageError, FilmError) as error:
        return refuse(error)
    except Exception as error:  # a mistake of the program: the run itself is sound
        return complain(f"no animation: {why_not(error)}; please report it", FAILED)
    if not options.quiet:
        print(f"Written to {folder}{os.sep}: {', '.join(written)}")
    return DONE


def _film(options: argparse.Namespace) -> tuple[Film | None, list[str]]:
    """What is to be shown; None, and all that keeps it from that."""
    from exudyn_flexlink.animation import FilmError, film_of
    from exudyn_flexlink.storage import StorageError, load

    runs: list[Result] = []
    mistakes = []
    for folder in [options.run, *([] if options.other is None else [options.other])]:
        try:
            runs.append(load(folder))
        except StorageError as error:
            mistakes.append(str(error))
    if mistakes:
        return None, mistakes
    names = None
    if len(runs) > 1 and runs[0].engine == runs[1].engine:
        names = options.run.resolve().name, options.other.resolve().name
    window = options.begin, options.end
    try:
        return film_of(*runs, names=names, window=window, slow=options.slow), []
    except FilmError as error:
        return None, [str(error)]


def _content(film: Film, name: str, filming: Filming, *, quiet: bool) -> bytes:
    """The content of a file in a format; progress is shown."""
    from exudyn_flexlink.animation import film_bytes

    with progress_bar(quiet, f"drawing the {name}") as progress:
        return film_bytes(film, name, filming, progress)


def _stem(options: argparse.Namespace) -> str:
    """Name of the files, without their endings."""
    return f"animation_with_{options.other.resolve().name}" if options.other else "animation"


def _idle(options: argparse.Namespace, formats: tuple[str, ...]) -> list[str]:
    """Say which options mean nothing in the formats."""
    given = [f"'--{name}'" for name in ("fps", "width") if getattr(options, name) is not None]
    if not given or formats != ("html",):
        return []
    verb = "are" if len(given) > 1 else "is"
    return [f"{' and '.join(given)} {verb} for mp4 and gif: a page has no frames of its own"]


def _slow(text: str) -> Any:
    from exudyn_flexlink.animation.slowing import Slow

    try:
        return Slow.of(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
