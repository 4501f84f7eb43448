"""The command `animate`: a saved run, or two runs overlaid, as a video, a GIF and a page."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from exudyn_flexlink.animation import Film, FilmError, Filming, film_bytes, film_of, usual_formats
from exudyn_flexlink.cli.figures import idle_text
from exudyn_flexlink.cli.keeping import (
    make_output,
)
from exudyn_flexlink.cli.terminal import (
    BAD_INPUT,
    DONE,
    complain,
    progress_bar,
)
from exudyn_flexlink.result import Result
from exudyn_flexlink.storage import (
    StorageError,
    load,
    staged_files,
)


def animate_command(options: argparse.Namespace) -> int:
    """Write the animation of a run; returns the exit code."""
    formats = tuple(dict.fromkeys(options.format or usual_formats()))
    filming = Filming(options.fps, options.speed, options.width)
    folder: Path = options.out or options.run
    frameless = "for mp4 and gif: a page has no frames of its own"
    idle = idle_text(options, ("fps", "width"), frameless) if formats == ("html",) else ""
    mistakes = [idle] if idle else []
    mistakes += dict.fromkeys(mistake for name in formats for mistake in filming.mistakes(name))
    film = _film(options, mistakes)
    if film is None or mistakes:
        return complain("\n".join(mistakes), BAD_INPUT)
    over = "" if options.other is None else f"_with_{options.other.resolve().name}"
    files = {name: f"animation{over}.{name}" for name in formats}

    def write() -> None:
        with staged_files(folder, force=options.force) as staged:
            for name, file in files.items():
                content = _content(film, name, filming, quiet=options.quiet)
                (staged / file).write_bytes(content)

    code = make_output("animation", write)
    if code == DONE and not options.quiet:
        print(f"Written to {folder}{os.sep}: {', '.join(files.values())}")
    return code


def _film(options: argparse.Namespace, mistakes: list[str]) -> Film | None:
    """Return the film to show; None if there can't be any: then `mistakes` say why."""
    runs: list[Result] = []
    folders: list[Path] = [options.run, *([options.other] if options.other else [])]
    for folder in folders:
        try:
            runs.append(load(folder))
        except StorageError as error:
            mistakes.append(str(error))
    if len(runs) < len(folders):
        return None
    alike = len(runs) > 1 and runs[0].engine == runs[1].engine
    first, last = (folder.resolve().name for folder in (folders[0], folders[-1]))
    window = options.begin, options.end
    try:
        return film_of(
            *runs, names=(first, last) if alike else None, window=window, slow=options.slow
        )
    except FilmError as error:
        mistakes.append(str(error))
        return None


def _content(film: Film, name: str, filming: Filming, *, quiet: bool) -> bytes:
    """The content of a file in a format; progress is shown."""
    try:
        with progress_bar(quiet, f"drawing the {name}") as progress:
            return film_bytes(film, name, filming, progress)
    except FilmError as error:
        raise argparse.ArgumentTypeError(str(error)) from error
