"""How figures look, on a screen and in print, and how they become files."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import wraps
from io import BytesIO
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.style import use

Parameters = ParamSpec("Parameters")
Drawn = TypeVar("Drawn")

# Okabe and Ito: told apart by colour-blind readers, and in grey by their lightness.
BLUE, GREEN, RED, ORANGE = "#0072B2", "#009E73", "#D55E00", "#E69F00"
SKY, PURPLE, BLACK, GREY = "#56B4E9", "#CC79A7", "#222222", "#777777"
FAILED = "#C00000"
OTHERS = (GREEN, PURPLE, ORANGE, SKY, BLACK)
"""Colours of lines that no engine has."""
SERIES = (BLUE, RED, GREEN, PURPLE, ORANGE, SKY, BLACK, GREY)
"""Colours of lines in one panel, in order."""

ENGINE_COLOURS = {"exudyn": BLUE, "lagrangian": RED}
"""The colour of each engine in every figure."""

_SHARED: dict[str, Any] = {
    # Text in a PDF as outlines that printers take (TrueType); the same file from the same run.
    "pdf.fonttype": 42,
    "svg.hashsalt": "exudyn-flexlink",
    "font.family": "sans-serif",
    "text.usetex": False,
    "legend.frameon": False,
    "axes.grid": True,
    "axes.titlelocation": "left",
    "axes.axisbelow": True,
    "axes.edgecolor": "#999999",
    "grid.color": "#E3E3E3",
}


NARROW = 5.0  # inches: a figure less wide has no room for a legend beside its axes
FORMATS = ("png", "pdf", "svg")
"""Formats that figures are written in; the first is the usual one."""

_UNDATED = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}


@dataclass(frozen=True)
class Style:
    """Where figures are for: `width` (inches), `scale` of heights, font sizes and lines (points).

    `titled` figures have a title above and a caption below; in print the page has these.
    """

    name: str
    width: float
    scale: float
    titled: bool
    font: float
    small: float
    line: float
    dpi: int

    @property
    def narrow(self) -> bool:
        """Whether figures have no room beside their axes: legends stand above these then."""
        return self.width < NARROW

    @property
    def rc(self) -> dict[Any, Any]:
        """Settings of matplotlib."""
        small = ("xtick.labelsize", "ytick.labelsize", "legend.fontsize", "axes.titlesize")
        return {
            **_SHARED,
            "font.size": self.font,
            "axes.labelsize": self.font,
            **dict.fromkeys(small, self.small),
            "legend.title_fontsize": self.small,
            "lines.linewidth": self.line,
            "lines.markersize": 4.6 * self.line,
            **dict.fromkeys(("xtick.major.size", "ytick.major.size"), 2.7 * self.line),
            "axes.linewidth": 0.6 * self.line,
            "grid.linewidth": 0.45 * self.line,
        }


SCREEN = Style("screen", 8.0, 1.0, titled=True, font=10, small=9, line=1.3, dpi=150)
COLUMN = 86 / 25.4  # inches: one of a journal's two columns
PRINT = Style("print", COLUMN, 0.6, titled=False, font=8, small=7, line=0.9, dpi=300)
STYLES = {style.name: style for style in (SCREEN, PRINT)}


@contextmanager
def settings(rc: Mapping[Any, Any], *, users: bool = False) -> Iterator[None]:
    """Draw with settings of matplotlib; letters without a font are boxes, and no warnings.

    What `rc` leaves out is as matplotlib has it by itself, not as a style or file of the user's
    has it, but with `users`.
    """
    with mpl.rc_context(), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from font")
        use([*(["default"] if not users else []), dict(rc)])
        yield


def styled(draw: Callable[Parameters, Drawn]) -> Callable[Parameters, Drawn]:
    """Let a function draw in the style it is given by keyword, `style`, or for the screen.

    Into axes of the user's, `ax`, it draws with the user's settings for what that leaves out.
    """

    @wraps(draw)
    def inside(*args: Parameters.args, **kwargs: Parameters.kwargs) -> Drawn:
        style = kwargs.get("style", SCREEN)
        assert isinstance(style, Style)
        users = kwargs.get("ax") is not None
        with settings(style.rc, users=users):
            drawn, ink = draw(*args, **kwargs), mpl.rcParams["text.color"]
            another = users and ink != mpl.rcParamsDefault["text.color"]
            for line in drawn.findobj(Line2D) if another and isinstance(drawn, Figure) else ():
                if line.get_color() == BLACK:  # on a dark page of the user's nobody sees it
                    line.set_color(ink)
            return drawn

    return inside


def save_figure(
    figure: Figure, folder: Path, name: str, formats: Sequence[str] = FORMATS[:1]
) -> list[Path]:
    """Write a figure as ``<name>.<format>`` into an existing folder; returns the files.

    Raises:
        OSError: a file can't be written.

    """
    written = [Path(folder) / f"{name}.{suffix}" for suffix in formats]
    for file, suffix in zip(written, formats, strict=True):
        file.write_bytes(figure_bytes(figure, suffix))
    return written


def figure_bytes(figure: Figure, suffix: str, dpi: float | None = None) -> bytes:
    """Return a figure as the content of a file of a format, with its own dots per inch or `dpi`."""
    written = BytesIO()
    with settings(SCREEN.rc):
        figure.savefig(written, format=suffix, dpi=dpi or figure.dpi, metadata=_UNDATED.get(suffix))
    return written.getvalue()


def is_figure(content: bytes) -> bool:
    """Whether the content of a file is a figure of matplotlib's, which it says in every format."""
    return b"atplotlib" in content
