"""What every figure shares: size, title, caption, a note on a failed run, colours, units."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence
from functools import wraps
from io import BytesIO
from typing import Any, ParamSpec, TypeVar

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MultipleLocator
from numpy.typing import NDArray

from exudyn_flexlink.observables import crank_angle, turns
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import FlexibleBody, Scene

FloatArray = NDArray[np.float64]
Parameters = ParamSpec("Parameters")
Drawn = TypeVar("Drawn")

# Okabe and Ito: told apart by colour-blind readers, and in grey by their lightness.
BLUE, GREEN, RED, ORANGE = "#0072B2", "#009E73", "#D55E00", "#E69F00"
SKY, PURPLE, BLACK, GREY = "#56B4E9", "#CC79A7", "#222222", "#777777"
FAILED = "#C00000"

ENGINE_COLOURS = {"exudyn": BLUE, "lagrangian": RED}
"""The colour of each engine in every figure."""

WIDTH = 8.0  # inches
LINE = 0.22  # inches, of title and caption
TITLE_COLUMNS = 88
CAPTION_COLUMNS = 100
_STYLE: dict[Any, Any] = {
    "font.family": "sans-serif",
    "font.size": 10,
    "text.usetex": False,
    "axes.titlesize": 10,
    "axes.labelsize": 10,
    "xtick.labelsize": 9,
    "ytick.labelsize": 9,
    "legend.fontsize": 9,
    "legend.frameon": False,
    "axes.grid": True,
    "grid.color": "#E3E3E3",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "axes.edgecolor": "#999999",
    "axes.linewidth": 0.8,
    "lines.linewidth": 1.3,
}


class ShownFigure(Figure):
    """A figure that a notebook shows as the value of a cell, with its inline backend or without."""

    def _repr_png_(self) -> bytes:
        written = BytesIO()
        self.savefig(written, format="png", dpi=100)
        return written.getvalue()


def styled(draw: Callable[Parameters, Drawn]) -> Callable[Parameters, Drawn]:
    """Let a function draw in this program's style, whatever the user's own matplotlibrc says."""

    @wraps(draw)
    def inside(*args: Parameters.args, **kwargs: Parameters.kwargs) -> Drawn:
        with mpl.rc_context(), mpl.rc_context(_STYLE):
            return draw(*args, **kwargs)

    return inside


def new_figure(result: Result, subject: str, height: float) -> Figure:
    """Return an empty figure with title, subject, caption and, if the run failed, a note.

    `height` (inches) is that of what is drawn, without title and caption.
    """
    note = "" if result.outcome.completed else stopped(result)
    caption = [(line, GREY) for line in textwrap.wrap(caption_of(result), CAPTION_COLUMNS)]
    figure = framed_figure(result.scene.title, subject, [note], caption, height)
    colour = ENGINE_COLOURS.get(result.engine, GREY)
    up = (0.07 + LINE * (len(caption) - 1)) / figure.get_figheight()
    figure.text(0.988, up, f"engine: {result.engine}", ha="right", fontsize=9, color=colour)
    return figure


def framed_figure(
    title: str,
    subject: str,
    notes: Sequence[str],
    caption: Sequence[tuple[str, str]],
    height: float,
) -> Figure:
    """Return an empty figure with title, subject and notes above, lines with colours below.

    `height` (inches) is that of what is drawn.
    """
    titles = textwrap.wrap(title, TITLE_COLUMNS)
    warned = [line for note in notes for line in textwrap.wrap(note, TITLE_COLUMNS + 8)]
    top = LINE * (len(titles) + 1 + len(warned)) + 0.12
    bottom = LINE * len(caption) + 0.08
    whole = height + top + bottom
    figure = ShownFigure(figsize=(WIDTH, whole), dpi=150, layout="constrained", facecolor="white")
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.set(rect=(0.0, bottom / whole, 1.0, height / whole))  # type: ignore[call-arg]
    down = iter(1 - (0.08 + LINE * i) / whole for i in range(99))
    for line in titles:
        figure.text(0.012, next(down), line, va="top", fontsize=11, fontweight="bold")
    figure.text(0.012, next(down), subject, va="top", fontsize=10, color=BLACK)
    for line in warned:
        figure.text(0.012, next(down), line, va="top", fontsize=10, color=FAILED)
    for i, (line, colour) in enumerate(reversed(caption)):
        figure.text(0.012, (0.07 + LINE * i) / whole, line, fontsize=9, color=colour)
    return figure


def caption_of(result: Result) -> str:
    """Say what the numbers depend on: hinges and rods of flexible bodies, accuracy."""
    accuracy = result.scene.accuracy
    words = links_of(result.scene)
    if "elements" in result.settings:
        words.append(f"as beams of {result.settings['elements']:.0f} elements, shown by rods")
    if accuracy.tolerance is not None:
        words.append(f"tolerance {accuracy.tolerance:.3g} m")
    else:
        words.append(f"step {accuracy.step:.3g} s")
    return "; ".join(words)


def links_of(scene: Scene) -> list[str]:
    """Hinges and rods of flexible bodies, in words."""
    return [
        f"{name}: hinges {_stiffness(body)}, n = {body.rods}"
        + (", half ends" if body.layout == "half_ends" else "")
        for name, body in scene.bodies.items()
        if isinstance(body, FlexibleBody)
    ]


def _stiffness(body: FlexibleBody) -> str:
    rule = body.hinges.stiffness
    return f"'{rule}'" if isinstance(rule, str) else f"{rule:.4g} N m/rad"


def stopped(result: Result) -> str:
    """Say when and why a run stopped."""
    return f"stopped at t = {result.outcome.time:.4g} s: {result.outcome.reason}"


def engine_colour(result: Result) -> str:
    """Colour of the result's engine; black for one without a colour of its own."""
    return ENGINE_COLOURS.get(result.engine, BLACK)


def legend_outside(axes: Axes, left: float = 1.01) -> None:
    """Put the legend, if there is anything to say, right of the axes, from `left` axes widths."""
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="upper left", bbox_to_anchor=(left, 1.0), borderaxespad=0.0)


def along(result: Result) -> tuple[FloatArray, str]:
    """Return the axis (N,) of a whole run and its label: turns of the crank, else time."""
    if turns(result):
        angle = crank_angle(result)
        return np.asarray(angle / (2 * np.pi)), "crank angle (turns)"
    return result.time, "time (s)"


def ticks_in_degrees(axes: Axes, largest: float) -> None:
    """Let the x-axis, in rad, run from 0 to `largest` and show degrees."""
    axes.set_xlim(0.0, largest)
    axes.xaxis.set_major_locator(MultipleLocator(np.pi / 4 if largest > np.pi else np.pi / 12))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{np.degrees(x):.0f}°"))


def length_unit(size: float) -> tuple[float, str]:
    """Factor from m, and its name, of the unit fit for lengths of this size (m)."""
    return (1e3, "mm") if size < 1 else (1.0, "m")


def subscripted(point: str, coordinate: str) -> str:
    """Label of a coordinate of 'body.point', as math text."""
    return rf"${coordinate}$ of {point}"


def cycle_of(scene: Scene) -> int:
    """Laps after which the mechanism does the same again: the curves of a track of laps, else 1."""
    for curve in scene.curves.values():
        if curve.type == "laps":
            return len(curve.curves)
    return 1
