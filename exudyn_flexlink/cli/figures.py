"""What the commands ask of figures: their formats, and the style they are drawn in."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from exudyn_flexlink.cli.completing import FILE, completes
from exudyn_flexlink.cli.values import names_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from exudyn_flexlink.result import Result

FIGURE_FORMATS = ("png", "pdf", "svg")
"""Those of `plots`, which is too slow to import for a help text; likewise"""
FIGURE_STYLES = ("screen", "print")


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
        """Draw one figure of something into an existing folder, if there is any."""
        from exudyn_flexlink.plots import STYLES, save_figure

        figure = draw(what, style=STYLES[self.style])
        if figure is not None:
            save_figure(figure, folder, name, self.formats)


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
    parser.add_argument(
        "--force", action="store_true", help="replace FILE also if it is no figure of this program"
    )


def _figure_file(text: str) -> Path:
    """Read the name of a figure's file; its ending says the format."""
    file = Path(text)
    if file.suffix[1:].lower() not in FIGURE_FORMATS:
        endings = ", ".join(f".{name}" for name in FIGURE_FORMATS)
        raise argparse.ArgumentTypeError(f"'{text}' does not end in one of {endings}")
    return file


def look_of(options: argparse.Namespace) -> Look:
    """Return how figures shall look."""
    usual = Look()
    formats = tuple(dict.fromkeys(options.format or usual.formats))
    return Look(formats, options.style or usual.style)


def idle_options(options: argparse.Namespace) -> str:
    """Say which options mean nothing, since no figures are wanted; empty if none does."""
    if not getattr(options, "no_plots", False):
        return ""
    given = [f"'--{name}'" for name in ("format", "style") if getattr(options, name)]
    verb = "are" if len(given) > 1 else "is"
    told = f"{' and '.join(given)} {verb} for figures, which '--no-plots' leaves out"
    return told if given else ""
