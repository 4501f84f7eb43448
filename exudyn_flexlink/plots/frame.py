"""Around what is drawn: size, title, caption, and a note on a failed run."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.textpath import text_to_path

from exudyn_flexlink.plots.style import (
    BLACK,
    ENGINE_COLOURS,
    FAILED,
    GREY,
    SCREEN,
    Style,
    figure_bytes,
    settings,
)
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import FlexibleBody, Scene

LINE = 0.022  # inches, of a line of text for each point of its font
LETTERS = 145  # that fit into an inch of a line, over the points of their font
MOST_LINES = 4  # of a title, note or caption: the rest is left out
EDGE = 0.1  # inches, left and right of text
SHOWN = 100  # dots per inch in a notebook
MOST_PASSES = 12  # of the layout; a tall mechanism beside a broad legend takes four


class ShownFigure(Figure):
    """A figure that a notebook shows as the value of a cell, with its inline backend or without."""

    def _repr_png_(self) -> bytes:
        return figure_bytes(self, "png", SHOWN)


def new_figure(result: Result, subject: str, height: float, style: Style = SCREEN) -> Figure:
    """Return an empty figure with title, subject, caption and, if the run failed, a note.

    `height` (inches) is that of what is drawn on a screen, without title and caption.
    """
    note = "" if result.outcome.completed else result.outcome.told
    title, caption = result.scene.title, [(caption_of(result), GREY)]
    figure = framed_figure((title, subject), height, style, notes=[note], caption=caption)
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
    """Return an empty figure with words around it: title and subject, notes, a coloured caption.

    `height` (inches) is that of what is drawn on a screen. In print only the notes are there.
    """
    (title, subject), font, small = heading, style.font, style.small
    room = style.width - 2 * EDGE
    above = [(line, font, FAILED, "normal") for n in notes for line in wrapped(n, room, font)]
    below: list[tuple[str, str]] = []
    if style.titled:
        titles = wrapped(title, room, font + 1, "bold")
        named = [(line, font + 1, "black", "bold") for line in titles]
        above = [*named, (subject, font, BLACK, "normal"), *above]
        # The name of the engine stands at the right of the last line.
        below = [(line, c) for text, c in caption for line in wrapped(text, room - 1.5, small)]
    line_height = LINE * font
    top = line_height * len(above) + 0.12 * bool(above)
    bottom = line_height * len(below) + 0.08 * bool(below)
    whole = style.scale * height + top + bottom
    layout = ConstrainedLayoutEngine(rect=(0.0, bottom / whole, 1.0, style.scale * height / whole))
    figure = ShownFigure((style.width, whole), style.dpi, layout=layout, facecolor="white")
    figure.set_label(subject)  # which a page shows as its caption
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
    """Lay out a figure until nothing beside its axes is cut off at its edges.

    Matplotlib makes one pass a drawing. It takes more where axes keep their aspect: labels and the
    legend move as the axes shrink, and the first passes leave them partly outside.
    """
    for _ in range(MOST_PASSES):
        figure.draw_without_rendering()
        boxes = [box for axes in figure.axes if (box := axes.get_tightbbox()) is not None]
        if all(box.x0 >= 0 and box.x1 <= figure.bbox.width for box in boxes):
            return


def wrapped(text: str, width: float, size: float, weight: str = "normal") -> list[str]:
    """Break a text into lines no wider than `width` (inches) in a font of `size` points.

    What does not fit into a few lines is left out, and dots stand for it.
    """
    font = FontProperties(size=size, weight=weight)
    columns = max(int(width * LETTERS / size), 10)
    while True:
        lines = textwrap.wrap(text, columns, max_lines=MOST_LINES, placeholder=" ...")
        widest = max((_points(line, font) for line in lines), default=0.0)
        if widest <= 72 * width or columns <= 10:
            return lines
        columns = int(0.9 * columns)


def _points(line: str, font: FontProperties) -> float:
    """Width of a line in points; a dollar sign is a letter, and begins no formula."""
    with settings({}):
        return float(text_to_path.get_text_width_height_descent(line, font, ismath=False)[0])


def caption_of(result: Result) -> str:
    """Say what the numbers depend on: hinges and rods of flexible bodies, accuracy."""
    accuracy = result.scene.accuracy
    words = links_of(result.scene)
    if (elements := result.settings.elements) is not None:
        words.append(f"as beams of {elements} elements, shown by rods")
    if accuracy.tolerance is not None:
        words.append(f"tolerance {accuracy.tolerance:.3g} m")
    else:
        words.append(f"step {accuracy.step:.3g} s")
    return "; ".join(words)


def links_of(scene: Scene) -> list[str]:
    """Hinges and rods of flexible bodies, in words."""
    told = []
    for name, body in scene.bodies.items():
        if isinstance(body, FlexibleBody):
            rule = body.hinges.stiffness
            hinges = f"'{rule}'" if isinstance(rule, str) else f"{rule:.4g} N m/rad"
            ends = ", half ends" if body.layout == "half_ends" else ""
            told.append(f"{name}: hinges {hinges}, n = {body.rods}{ends}")
    return told
