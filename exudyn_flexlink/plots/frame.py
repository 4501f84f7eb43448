"""Frames of figures on a screen and in print: styles, titles, captions, notes, and files."""

from __future__ import annotations

import re
import textwrap
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import wraps
from io import BytesIO
from math import ceil, floor, isfinite, log10
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import matplotlib as mpl
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.style import use
from matplotlib.text import Text
from matplotlib.textpath import text_to_path

from exudyn_flexlink.result import MeasuredError, Result
from exudyn_flexlink.scene import FlexibleBody, Scene
from exudyn_flexlink.shipped import ENGINES, FIGURE_FORMATS

Parameters = ParamSpec("Parameters")
Drawn = TypeVar("Drawn")

# Palette of Okabe and Ito: colour-blind readers can tell its colours apart, also in grey.
BLUE, GREEN, RED, ORANGE = "#0072B2", "#009E73", "#D55E00", "#E69F00"
SKY, PURPLE, BLACK, GREY = "#56B4E9", "#CC79A7", "#222222", "#777777"
FAILED = "#C00000"
OTHERS = (GREEN, PURPLE, ORANGE, SKY, BLACK)
"""Colours of lines that do not stand for an engine."""
SERIES = (BLUE, RED, GREEN, PURPLE, ORANGE, SKY, BLACK, GREY)
"""Colours of the lines in one panel, in order."""

ENGINE_COLOURS = dict(zip(ENGINES, SERIES, strict=False))
"""The colour of each engine in every figure."""

_SHARED: dict[str, Any] = {
    # Printers want TrueType text in a PDF. With a fixed salt, a run always gives the same file.
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


NARROW = 5.0  # inches: a narrower figure has no room for a legend beside its axes
_UNDATED = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}


@dataclass(frozen=True)
class Style:
    """Look of figures: `width` (inches), `scale` of heights, font sizes and lines (points).

    `titled` figures have a title above and a caption below; in print the page has both.
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
        """Whether figures have no room beside their axes; legends then stand above the axes."""
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
    """Draw with settings of matplotlib, without warnings about letters that the font lacks.

    Settings that `rc` omits have matplotlib's defaults; with `users`, the user's values.
    """
    with mpl.rc_context(), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from font")
        use([*(["default"] if not users else []), dict(rc)])
        yield


def styled(draw: Callable[Parameters, Drawn]) -> Callable[Parameters, Drawn]:
    """Let a function draw in the style of its argument `style`; the default is the screen's.

    In axes of the user, `ax`, settings that the style omits have the user's values.
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
                if line.get_color() == BLACK:  # black would be invisible on a dark page
                    line.set_color(ink)
            return drawn

    return inside


def save_figure(
    figure: Figure, folder: Path, name: str, formats: Sequence[str] = FIGURE_FORMATS[:1]
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
    """Return a figure as the content of a file, with the figure's dots per inch or with `dpi`.

    A PNG is drawn once, by its canvas: `savefig` draws each figure twice, first for its layout,
    which each drawing makes anyway.
    """
    written, dots, canvas = BytesIO(), figure.dpi, figure.canvas
    with settings(SCREEN.rc):
        if suffix != "png":
            figure.savefig(written, format=suffix, dpi=dpi or dots, metadata=_UNDATED.get(suffix))
            return written.getvalue()
        try:
            figure.set_dpi(dpi or dots)
            printer: Any = FigureCanvasAgg(figure)
            printer.print_png(written)
        finally:
            figure.set_dpi(dots)
            figure.set_canvas(canvas)
    return written.getvalue()


def is_figure(content: bytes) -> bool:
    """Whether the content of a file is a figure of matplotlib; each format contains that name."""
    return b"atplotlib" in content


FLAT = 1e-6  # of the drawing: places, or radii, count as equal if they differ by less
LEGEND = 2.4  # inches on a screen: legend beside the axes; in print it is above or below
ROW_HEIGHT = 0.24  # inches on a screen: a line of a legend, or a row beside it
LINE = 0.022  # inches per point of the font: height of a line of text
MOST_LINES = 4  # most lines of a title, note or caption; the rest is omitted
LONG = re.compile(r"\S{33,}")  # a name so long that the figure has no room
EDGE = 0.1  # inches: margin left and right of text
SHOWN = 100  # dots per inch in a notebook
MOST_PASSES = 12  # most passes of the layout; a tall mechanism beside a broad legend takes four


class ShownFigure(Figure):
    """A figure that a notebook shows as the value of a cell, with or without its inline backend.

    The figure keeps its style for drawing: only then does matplotlib make ticks and choose the
    colour of the page.
    """

    style = SCREEN

    def draw(self, renderer: RendererBase) -> None:
        """Draw the figure in its style, whatever the user's style is now; shorten long names."""
        with settings(self.style.rc):
            self.shorten()
            super().draw(renderer)

    def shorten(self) -> None:
        """Shorten long names in panels and legends."""
        for text in set(self.findobj(Text)) - set(self.texts):
            text.set_text(shortened(text.get_text()))

    def savefig(self, fname: Any, **more: Any) -> None:
        """Write the figure on a white page, unless the caller gives a colour."""
        super().savefig(fname, **{"facecolor": "auto", **more})

    def _repr_png_(self) -> bytes:
        return figure_bytes(self, "png", SHOWN)


def new_figure(result: Result, subject: str, height: float, style: Style = SCREEN) -> Figure:
    """Return an empty figure with title, subject and caption, and a note if the run is doubtful.

    `height` (inches) is the height of the panels on a screen, without title and caption.
    """
    notes, caption = [doubts_of(result)], [(caption_of(result), GREY)]
    head = result.scene.title, subject
    figure = framed_figure(head, height, style, notes=notes, caption=caption)
    if style.titled:
        colour = ENGINE_COLOURS.get(result.engine, GREY)
        place = 1 - EDGE / style.width, 0.07 / figure.get_figheight()
        figure.text(*place, f"engine: {result.engine}", ha="right", fontsize=9, color=colour,
                    parse_math=False)  # fmt: skip
    return figure


def framed_figure(
    heading: tuple[str, str],
    height: float,
    style: Style,
    *,
    notes: Sequence[str] = (),
    caption: Sequence[tuple[str, str]] = (),
) -> Figure:
    """Return an empty figure with its texts: title and subject, notes, a coloured caption.

    `height` (inches) is the height of the panels on a screen. In print there are only notes.
    """
    (title, subject), font, small = heading, style.font, style.small
    room = style.width - 2 * EDGE
    above = [(line, font, FAILED, "normal") for n in notes for line in wrapped(n, room, font)]
    below: list[tuple[str, str]] = []
    if style.titled:
        titles = wrapped(title, room, font + 1, "bold")
        named = [(line, font + 1, "black", "bold") for line in titles]
        above = [*named, (shortened(subject), font, BLACK, "normal"), *above]
        # The last line leaves room at the right for the name of the engine.
        below = [(line, c) for text, c in caption for line in wrapped(text, room - 1.5, small)]
    line_height = LINE * font
    top = line_height * len(above) + 0.12 * bool(above)
    bottom = line_height * len(below) + 0.08 * bool(below)
    whole = style.scale * height + top + bottom
    layout = ConstrainedLayoutEngine(rect=(0.0, bottom / whole, 1.0, style.scale * height / whole))
    figure = ShownFigure((style.width, whole), style.dpi, layout=layout, facecolor="white")
    FigureCanvasAgg(figure)  # measures texts; a figure without a canvas makes one for each text
    figure.style = style
    figure.set_label(subject)  # a page uses the label as its caption
    left = EDGE / style.width
    for i, (line, size, colour, weight) in enumerate(above):
        place = left, 1 - (0.08 + line_height * i) / whole
        figure.text(
            *place, line, va="top", fontsize=size, color=colour, weight=weight, parse_math=False
        )
    for i, (line, colour) in enumerate(reversed(below)):
        place = left, (0.07 + line_height * i) / whole
        figure.text(*place, line, fontsize=small, color=colour, parse_math=False)
    return figure


def settle(figure: Figure) -> None:
    """Repeat the layout of a figure until its edges cut nothing off.

    Matplotlib makes one pass for each drawing. Axes of fixed aspect need more: labels and the
    legend move as the axes shrink, and lie partly outside after the first passes.
    """
    assert isinstance(figure, ShownFigure)
    engine = figure.get_layout_engine()
    assert engine is not None
    figure.shorten()
    for _ in range(MOST_PASSES):
        engine.execute(figure)
        boxes = [box for axes in figure.axes if (box := axes.get_tightbbox()) is not None]
        if all(box.x0 >= 0 and box.x1 <= figure.bbox.width for box in boxes):
            return


def shortened(text: str) -> str:
    """Return a text; names that are too long keep only their first and last letters."""
    return LONG.sub(lambda text: f"{text[0][:16]}\N{HORIZONTAL ELLIPSIS}{text[0][-15:]}", text)


def wrapped(text: str, width: float, size: float, weight: str = "normal") -> list[str]:
    """Break a text into lines no wider than `width` (inches) in a font of `size` points.

    A text has at most a few lines; dots stand for the rest.
    """
    font = FontProperties(size=size, weight=weight)
    columns = max(int(len(text) * 72 * width / (text_width(text, font) or 1.0)), 10)
    while True:
        lines = textwrap.wrap(text, columns, max_lines=MOST_LINES, placeholder=" ...")
        widest = max((text_width(line, font) for line in lines), default=0.0)
        if widest <= 72 * width or columns <= 10:
            return lines
        columns = int(0.9 * columns)


def text_width(line: str, font: FontProperties) -> float:
    """Return the width of a line in points; a dollar sign is a letter and begins no formula."""
    with settings({}):
        return float(text_to_path.get_text_width_height_descent(line, font, ismath=False)[0])


def caption_of(result: Result) -> str:
    """Return the caption: hinges and rods, accuracy, and the error of the run."""
    words, asked = links_of(result.scene), result.scene.accuracy
    if (elements := result.settings.elements) is not None:
        words.append(f"as beams of {elements} elements, shown by rods")
    if result.error.missing:
        words.append(
            f"step {asked.step:.3g} s"
            if asked.tolerance is None
            else f"tolerance {asked.tolerance:.3g} m"
        )
    return "; ".join([*words, error_of(result.error)])


def error_of(error: MeasuredError) -> str:
    """Say how large the error of points is, at first and later, as far as it is known."""
    exceeds, end = error.exceeds_from, error.known_until
    if error.missing:
        return "error not measured"
    about, known = "points off by at most ", f" up to t = {end:.4g} s" if isfinite(end) else ""
    if exceeds is not None and exceeds < end:
        about += f"{error.limit:.3g} m up to t = {exceeds:.4g} s, then by "
    return f"{about}{error_text(error.largest)} m{known}"


def doubts_of(result: Result) -> str:
    """Say that a run failed, from when its error may exceed the tolerance, or that it warns."""
    error, count = result.error, len(result.warnings)
    if not result.outcome.completed:
        return result.outcome.ending
    if error.exceeds_from is not None:
        return f"from t = {error.exceeds_from:.4g} s on maybe off by more than {error.limit:.3g} m"
    return f"{count} warning{'s' * (count > 1)}: see the run's summary" if count else ""


def error_text(error: float) -> str:
    """Return an error as text: one significant digit, rounded up."""
    if not (error > 0 and isfinite(error)):
        return f"{error:g}"
    size = 10.0 ** floor(log10(error))
    most = ceil(error / size * (1 - 1e-9)) * size
    return f"{most:.0f}" if most >= 1 else f"{most:.1g}".replace("e-0", "e-")


def links_of(scene: Scene) -> list[str]:
    """Return hinges and rods of flexible bodies, in words."""
    texts = []
    for name, body in scene.bodies.items():
        if isinstance(body, FlexibleBody):
            rule = body.hinges.stiffness
            hinges = f"'{rule}'" if isinstance(rule, str) else f"{rule:.4g} N m/rad"
            ends = ", half ends" if body.layout == "half_ends" else ""
            texts.append(f"{shortened(name)}: hinges {hinges}, n = {body.rods}{ends}")
    return texts
