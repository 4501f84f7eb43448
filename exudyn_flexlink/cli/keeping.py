"""Numbers first: no failure of a figure, or of a page, may cost what a run of hours has given."""

from __future__ import annotations

from argparse import ArgumentTypeError, Namespace
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from exudyn_flexlink.cli.ctrl_c import deferrable_interrupts
from exudyn_flexlink.cli.figures import FIGURE_FORMATS, draw_figure
from exudyn_flexlink.cli.terminal import DONE, FAILED, INTERRUPTED, complain
from exudyn_flexlink.loading import ImpossibleLengthError
from exudyn_flexlink.source import SceneError
from exudyn_flexlink.storage import StorageError, replace_file
from exudyn_flexlink.sweeps import CannotStartError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

REFUSALS = (ArgumentTypeError, CannotStartError, ImpossibleLengthError, SceneError, StorageError)
"""Errors by which a command refuses what it is asked for, and ends with exit code 2.

Options that can't be, models with mistakes, places that can't be read or written, no workers.
"""


def kept(save: Callable[[], Any], draw: Callable[[], Any] | None, folder: Path) -> int:
    """Save numbers, which Ctrl-C does not hinder; then `draw` figures, if any are wanted.

    Returns the exit code; see `drawn`.
    """
    with deferrable_interrupts() as ctrl_c:
        ctrl_c.defer()
        save()
    if ctrl_c.pending or draw is None:
        return INTERRUPTED if ctrl_c.pending else DONE
    return drawn(folder, draw)


def written(
    found: Any, folder: Path, options: Namespace, save: Callable[..., Any], figure: str
) -> int:
    """Write what was found: `save` takes it and `folder`; then its figure, unless none is wanted.

    Returns the exit code; see `drawn`.
    """
    draw = None if options.no_plots else partial(draw_figure, options, figure, found, folder)
    return kept(partial(save, found, folder=folder), draw, folder)


def drawn(folder: Path, draw: Callable[[], Any]) -> int:
    """Draw figures into a folder beside the numbers.

    Returns the exit code: `DONE`; with no figure left, `INTERRUPTED` if the user did not wait for
    them, and `FAILED` if they can't be drawn, which is said.
    """
    code = added("figures", draw)
    for suffix in FIGURE_FORMATS if code else ():
        for file in folder.rglob(f"*.{suffix}"):  # the last may be half a figure
            file.unlink()
    return code


def added(what: str, make: Callable[[], Any]) -> int:
    """Make something beside numbers that are saved; returns the exit code, and says a failure."""
    try:
        make()
    except KeyboardInterrupt:
        return INTERRUPTED
    except Exception as error:  # a mistake of the program, too
        return complain(f"no {what}: {_why_not(error)}; the numbers are kept", FAILED)
    return DONE


def write_figure(file: Path, draw: Callable[[], Figure], *, force: bool) -> int:
    """Draw a figure into a file; returns the exit code, see `made`."""
    from exudyn_flexlink.plots import figure_bytes, is_figure

    def write() -> None:
        content = figure_bytes(draw(), file.suffix[1:].lower())
        replace_file(file, content, is_figure, force=force)

    return made("figure", write)


def made(what: str, make: Callable[[], Any]) -> int:
    """Make something of sound numbers; returns the exit code, and says a mistake of the program.

    Raises:
        REFUSALS: it refuses what it is asked for.

    """
    try:
        make()
    except REFUSALS:
        raise
    except Exception as error:
        return complain(f"no {what}: {_why_not(error)}; please report it", FAILED)
    return DONE


def _why_not(error: Exception) -> str:
    """Say why there are no figures, or no page."""
    if isinstance(error, MemoryError):
        return "not enough memory"
    if isinstance(error, OSError):
        return f"they can't be written: {error.strerror or error}"
    return str(error) if isinstance(error, StorageError) else f"{type(error).__name__}: {error}"
