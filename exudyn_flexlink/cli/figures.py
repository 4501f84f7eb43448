"""Figures as the command line asks for them: their formats and their style."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from exudyn_flexlink.shipped import FIGURE_FORMATS, FIGURE_STYLES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from exudyn_flexlink.result import Result

FILES = {
    "against": "comparison",
    "work_precision": "accuracy",
}  # figures whose name is not that of their function in `plots`


@dataclass(frozen=True)
class Look:
    """Formats that figures are written in, and the name of their style."""

    formats: tuple[str, ...] = FIGURE_FORMATS[:1]
    style: str = FIGURE_STYLES[0]

    def save_run(self, result: Result, folder: Path) -> None:
        """Draw all figures of a run into an existing folder."""
        from exudyn_flexlink.plots import STYLES, save_figures

        save_figures(result, folder, self.formats, STYLES[self.style])

    def save(self, draw: Callable[..., Figure | None], what: Any, folder: Path, name: str) -> None:
        """Draw one figure of something into an existing folder, if there is a figure of it."""
        from exudyn_flexlink.plots import STYLES, save_figure

        figure = draw(what, style=STYLES[self.style])
        if figure is not None:
            save_figure(figure, folder, name, self.formats)


def look_of(options: argparse.Namespace) -> Look:
    """Return the look of figures that the options ask for."""
    usual = Look()
    formats = tuple(dict.fromkeys(options.format or usual.formats))
    return Look(formats, options.style or usual.style)


def draw_figure(
    options: argparse.Namespace, figure: str, what: Any, folder: Path, **more: Any
) -> None:
    """Draw a figure of `plots`, if it exists, by its name there, into an existing folder.

    `more` goes to the function that draws it.
    """
    from exudyn_flexlink import plots

    look_of(options).save(
        partial(getattr(plots, figure), **more), what, folder, FILES.get(figure, figure)
    )


def idle_options(options: argparse.Namespace) -> str:
    """Name the options without effect, since no figures are wanted; empty if there are none."""
    if not getattr(options, "no_plots", False):
        return ""
    why = "for figures, which '--no-plots' leaves out"
    return idle_text(options, ("format", "style"), why)


def idle_text(options: argparse.Namespace, names: Sequence[str], why: str) -> str:
    """Name those of some options that are given although they have no effect; empty if none is."""
    given = [f"'--{name}'" for name in names if getattr(options, name) is not None]
    verb = "are" if len(given) > 1 else "is"
    return f"{' and '.join(given)} {verb} {why}" if given else ""
