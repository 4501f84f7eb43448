"""The command `animate`: a saved run, or two over each other, as a video, a GIF and a page."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from exudyn_flexlink.animation import Film, FilmError, Filming, film_bytes, film_of, usual_formats
from exudyn_flexlink.cli.keeping import why_not
from exudyn_flexlink.cli.terminal import (
    BAD_INPUT,
    DONE,
    FAILED,
    complain,
    progress_bar,
    refuse,
)
from exudyn_flexlink.result import Result
from exudyn_flexlink.storage import StorageError, load, staged_files


def animate_command(options: argparse.Namespace) -> int:
    """Write the animation of a run; returns the exit code."""
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
