"""The commands that solve nothing: `check`, `plot`, `report`, `animate`, `schema`."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from exudyn_flexlink.cli.figures import draw_figure, idle_text, look_of
from exudyn_flexlink.cli.keeping import (
    holds_schema,
    make_output,
    write_figure,
)
from exudyn_flexlink.cli.running import read_scene
from exudyn_flexlink.cli.terminal import (
    BAD_INPUT,
    DONE,
    complain,
    progress_bar,
    tell,
)
from exudyn_flexlink.engines import linear_model
from exudyn_flexlink.linear import NotLinearError
from exudyn_flexlink.loading import assemble_scene, rest_of_scene
from exudyn_flexlink.mechanism import beyond_redundant, formulation, input_notes
from exudyn_flexlink.report import (
    check_text,
    equilibrium_text,
)
from exudyn_flexlink.scene import json_schema
from exudyn_flexlink.source import SceneError, did_you_mean
from exudyn_flexlink.storage import (
    StorageError,
    is_sweep,
    load,
    load_sweep,
    replace_file,
    staged_files,
)
from exudyn_flexlink.sweeps import SweepTable

if TYPE_CHECKING:
    from exudyn_flexlink.animation import Film
    from exudyn_flexlink.result import Result


def check_command(options: argparse.Namespace) -> int:
    """Check a model without simulating it; returns the exit code."""
    scene = read_scene(options)
    assembly = assemble_scene(scene)
    refused = beyond_redundant(scene)
    if refused and formulation(scene) != "minimal":
        raise SceneError(scene.document, refused)
    tell(f"{options.model}: no mistakes\n\n{check_text(scene, assembly)}")
    if options.equilibrium:
        tell(f"\n{equilibrium_text(scene, rest_of_scene(scene))}")
    for note in input_notes(scene, assembly):
        complain(f"warning: {note}")
    if options.figure is None:
        return DONE
    from exudyn_flexlink.plots import modes, start

    draw = partial(start, scene, assembly)
    if options.equilibrium:
        try:
            draw = partial(modes, linear_model(scene))
        except NotLinearError as error:
            raise argparse.ArgumentTypeError(f"no modes can be drawn: {error}") from error
    return write_figure(options.figure, draw, force=options.force)


def plot_command(options: argparse.Namespace) -> int:
    """Draw the figures of a saved run, or of a sweep, again; returns the exit code."""
    folder: Path = options.out or options.run

    def draw() -> None:
        swept = load_sweep(options.run) if is_sweep(options.run) else None
        _require_columns(options.of, swept)
        result = load(options.run) if swept is None else None
        with staged_files(folder, force=options.force) as staged:
            if result is not None:
                look_of(options).save_run(result, staged)
            if swept is not None:
                draw_figure(options, "sweep", swept, staged, names=options.of)

    code = make_output("figures", draw)
    if code == DONE:
        print(f"Figures written to {folder}{os.sep}")
    return code


def _require_columns(names: Sequence[str], swept: SweepTable | None) -> None:
    """Refuse names that are not observables of a sweep."""
    if names and swept is None:
        raise argparse.ArgumentTypeError("'--of' is for the folder of a sweep")
    known = () if swept is None else swept.observables
    wrong = [
        f"no column '{name}'{did_you_mean(name, known)}" for name in names if name not in known
    ]
    if wrong:
        raise argparse.ArgumentTypeError(f"{'; '.join(wrong)}. There are: {', '.join(known)}")


def report_command(options: argparse.Namespace) -> int:
    """Write the page of a saved run; returns the exit code."""
    from exudyn_flexlink.page import PAGE, write_page

    def write() -> None:
        result = load(options.run)
        if options.out is None:
            with staged_files(options.run, force=options.force) as staged:
                write_page(result, staged / PAGE)
        else:
            write_page(result, options.out, force=options.force)

    code = make_output("report", write)
    if code == DONE:
        print(f"Report written to {options.out or options.run / PAGE}")
    return code


def animate_command(options: argparse.Namespace) -> int:
    """Animate a saved run, or two overlaid: a video, a GIF, a page; returns the exit code."""
    from exudyn_flexlink.animation import FilmError, Filming, film_bytes, usual_formats

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
                try:
                    with progress_bar(options.quiet, f"drawing the {name}") as progress:
                        content = film_bytes(film, name, filming, progress)
                except FilmError as error:
                    raise argparse.ArgumentTypeError(str(error)) from error
                (staged / file).write_bytes(content)

    code = make_output("animation", write)
    if code == DONE and not options.quiet:
        print(f"Written to {folder}{os.sep}: {', '.join(files.values())}")
    return code


def _film(options: argparse.Namespace, mistakes: list[str]) -> Film | None:
    """Return the film to show; None if there can't be any: then `mistakes` say why."""
    from exudyn_flexlink.animation import FilmError, film_of

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


def schema_command(options: argparse.Namespace) -> int:
    """Print, or write, the JSON schema of model files; returns the exit code."""
    if sys.flags.optimize > 1:
        raise argparse.ArgumentTypeError(
            "the schema explains keys by docstrings, which Python leaves out with '-OO' or "
            "PYTHONOPTIMIZE=2: call it without"
        )
    text = json.dumps(json_schema(), indent=2, ensure_ascii=False) + "\n"
    if options.out is None:
        print(text, end="")
        return DONE
    replace_file(options.out, text.encode(), holds_schema, force=options.force)
    return DONE
