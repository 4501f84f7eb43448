"""Observables of a sweep over what varied: lines, maps, or parallel coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, nan
from textwrap import fill

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exudyn_flexlink.arrays import BoolArray, FloatArray
from exudyn_flexlink.plots.frame import framed_figure
from exudyn_flexlink.plots.panels import legend_outside, letter, sized
from exudyn_flexlink.plots.style import BLACK, BLUE, GREY, SCREEN, Style, styled
from exudyn_flexlink.plots.style import FAILED as RED
from exudyn_flexlink.source import did_you_mean
from exudyn_flexlink.sweeps import DOUBTFUL, FAILED, Scalar, SweepTable, in_si, label_of

MOST_PANELS = 6
MOST_TOLD = 4  # axes of observables beside those of what varied
NOTICEABLE = 1e-4  # of a number: the summary prints numbers that differ by less alike
ROUNDING, LEAST = 1e-9, 1e-12  # of a number; SI: smaller differences tell nothing
FEW = 8  # values that all have a tick
LINES, MAP = 1.5, 2.6  # inches on a screen, of a panel
TICKS = 5
DISTINCT = 200  # lines that can still be told apart
LETTERS = 9.0  # of a label, in an inch


@dataclass(frozen=True)
class Scale:
    """Places (N,) of the rows along an axis, its label, and the words at whole places, if any."""

    places: FloatArray
    label: str
    words: tuple[str, ...] = ()


@styled
def sweep(table: SweepTable, names: Sequence[str] = (), *, style: Style = SCREEN) -> Figure | None:
    """Draw observables by their columns' `names`, or the first that differ from row to row.

    Over one value that varied as lines, over two as maps, of more as parallel coordinates. Rows
    that failed or are doubtful are marked; None if no row has numbers.

    Raises:
        ValueError: there is no such column.

    """
    # Those that differ to the eye, if there are any.
    chosen = list(names) or _differing(table, NOTICEABLE) or _differing(table, ROUNDING)
    unknown = [name for name in chosen if name not in table.observables]
    if unknown:
        near = did_you_mean(unknown[0], table.observables)
        raise ValueError(f"the sweep has no column '{unknown[0]}'{near}")
    if not chosen:
        return None
    along = [_along(table, i) for i in range(len(table.varied))]
    columns = table.columns()
    seen = [_scale(columns[name], *label_of(name)) for name in chosen]
    draw, most = {1: (_lines, MOST_PANELS), 2: (_maps, MOST_PANELS)}.get(
        len(along), (_parallel, MOST_TOLD)
    )
    return draw(table, along, seen[: max(most, len(names))], style)


def _differing(table: SweepTable, part: float) -> list[str]:
    """Observables that are numbers and differ from row to row by more than a part of them.

    What differs by nearly nothing in SI does not.
    """
    columns = table.columns()
    found = []
    for name in table.observables:
        values = [value for value in columns[name] if value is not None]
        numbers = [float(value) for value in values if isinstance(value, float | int)]
        if not numbers or len(numbers) < len(values):
            continue
        if np.ptp(numbers) > max(part * float(np.max(np.abs(numbers))), LEAST):
            found.append(name)
    return found


def _along(table: SweepTable, i: int) -> Scale:
    """Values that varied, in the unit in which the user gave them."""
    varied = table.varied[i]
    values = [row[i] for row in table.values]
    one = in_si(f"1 {varied.given}") if varied.given else 1.0
    if isinstance(one, float) and all(isinstance(value, float) for value in values):
        return _scale([float(v) / one for v in values], varied.path, varied.given or varied.unit)
    return _scale(values, varied.path, "")


def _scale(values: Sequence[Scalar], name: str, unit: str) -> Scale:
    """Values with their label; nan where there is none."""
    label = f"{name} ({unit})" if unit else name
    if any(isinstance(value, str) for value in values):
        words = tuple(dict.fromkeys(str(value) for value in values))
        return Scale(np.array([words.index(str(v)) for v in values], dtype=float), label, words)
    numbers = [nan if v is None or isinstance(v, str) else float(v) for v in values]
    return Scale(np.array(numbers), label)


def _of(table: SweepTable, status: str) -> BoolArray:
    return np.array([row.status == status for row in table.rows], dtype=bool)


def _frame(
    table: SweepTable, subject: str, height: float, style: Style, marks: tuple[str, str] = ("", "")
) -> Figure:
    """Title, and how many runs failed or are doubtful, with how each of both is marked."""
    crossed, ringed = marks
    failed, missing = table.count(FAILED), table.points - len(table.rows)
    notes = [f"{failed} of {len(table.rows)} runs failed{crossed}: see 'reason' in the table"]
    notes *= failed > 0
    notes += [f"{missing} of {table.points} runs are missing"] * (missing > 0)
    doubtful = table.count(DOUBTFUL)
    told = f"; {doubtful} doubtful{ringed}, which their 'reason' explains" if doubtful else ""
    caption = [(f"{len(table.rows)} runs by {table.engine}{told}", GREY)]
    return framed_figure((table.title, subject), height, style, notes=notes, caption=caption)


def _ticked(axes: Axes, scale: Scale, which: str) -> None:
    """Label an axis, and name its places, if they are words."""
    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_label_text(scale.label, parse_math=False)
    given = np.unique(scale.places)
    if scale.words:
        axis.set_ticks(range(len(scale.words)), scale.words)
    elif len(given) <= FEW:
        axis.set_ticks(given, [f"{place:.4g}" for place in given])


def _lines(table: SweepTable, along: list[Scale], seen: list[Scale], style: Style) -> Figure:
    """One panel for each observable, over the value that varied."""
    x = along[0]
    figure = _frame(table, f"over {x.label}", 0.5 + LINES * len(seen), style)
    panels = figure.subplots(len(seen), sharex=True, squeeze=False)[:, 0]
    order = np.argsort(x.places, kind="stable")
    failed, doubtful = _of(table, FAILED), _of(table, DOUBTFUL)
    for axes, own in zip(panels, seen, strict=True):
        axes.plot(x.places[order], own.places[order], color=BLUE, alpha=0.6)
        for chosen, filled, label in ((~failed & ~doubtful, BLUE, "done"),
                                      (doubtful, "white", "doubtful")):  # fmt: skip
            if chosen.any():
                axes.plot(x.places[chosen], own.places[chosen], "o", color=BLUE, label=label,
                          markerfacecolor=filled, markersize=sized(4))  # fmt: skip
        for k, place in enumerate(x.places[failed]):
            axes.axvline(place, color=RED, linestyle=":", label="failed" if k == 0 else None)
        axes.set_title(own.label, parse_math=False)
        if not own.words:  # no number that would have to be added to each
            axes.yaxis.get_major_formatter().set_useOffset(False)
    _ticked(panels[-1], x, "x")
    letter(panels)
    if failed.any() or doubtful.any():
        legend_outside(panels[0])
    return figure


def _maps(table: SweepTable, along: list[Scale], seen: list[Scale], style: Style) -> Figure:
    """One map for each observable over both values: cells of a grid, or else dots."""
    x, y = along
    columns = 1 if style.narrow or len(seen) == 1 else 2
    rows = ceil(len(seen) / columns)
    size, words = 0.4 + MAP * rows, (" (crosses)", " (white dots)")
    figure = _frame(table, f"over {x.label} and {y.label}", size, style, words)
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    grid = _is_grid(x.places, y.places)
    marks = ((_of(table, FAILED), "x", RED), (_of(table, DOUBTFUL), "o", BLACK))
    for axes, own in zip(panels.flat, seen, strict=False):
        if grid:
            shown = axes.pcolormesh(*_cells(x.places, y.places, own.places), shading="nearest")
        else:
            shown = axes.scatter(x.places, y.places, c=own.places, s=sized(5) ** 2)
        figure.colorbar(shown, ax=axes)
        for of, shape, colour in marks:
            axes.plot(x.places[of], y.places[of], shape, color=colour, markerfacecolor="white",
                      markersize=sized(4))  # fmt: skip
        axes.set_title(own.label, parse_math=False)
        axes.grid(visible=False)
    for axes in panels.flat[len(seen) :]:
        axes.set_visible(False)
    for axes in panels[-1]:
        _ticked(axes, x, "x")
    for axes in panels[:, 0]:
        _ticked(axes, y, "y")
    letter(panels.flat[: len(seen)])
    return figure


def _is_grid(x: FloatArray, y: FloatArray) -> bool:
    """Whether points are several, and most places of one value are there with those of the other.

    A sweep that was interrupted has holes.
    """
    cells = len(np.unique(x)) * len(np.unique(y))
    return len(x) > 1 and cells <= 2 * len(x)


def _cells(
    x: FloatArray, y: FloatArray, values: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Columns, rows and a matrix of values, nan where there is none."""
    columns, i = np.unique(x, return_inverse=True)
    rows, k = np.unique(y, return_inverse=True)
    found = np.full((len(rows), len(columns)), nan)
    found[k, i] = values
    return columns, rows, found


def _parallel(table: SweepTable, along: list[Scale], seen: list[Scale], style: Style) -> Figure:
    """An axis for every value that varied and every observable, a line for every row.

    Its colour is that of the first observable, or grey without a number there. Rows that failed
    are drawn across what varied only, doubtful ones are dashed.
    """
    # Names stand upright where there is no room for them.
    height = 6.5 if style.narrow else 3.6
    marks = (" (dotted red)", " (dashed)")
    figure = _frame(table, f"coloured by {seen[0].label}", height, style, marks)
    axes = figure.subplots()
    scales, varied = [*along, *seen], len(along)
    places, count = np.stack([scale.places for scale in scales], axis=1), len(scales)
    # An axis without numbers is one of zeros.
    known = np.where(np.isfinite(places).any(axis=0), places, 0.0)
    low, high = np.nanmin(known, axis=0), np.nanmax(known, axis=0)
    scaled = (places - low) / np.where(high > low, high - low, 1.0)
    scaled[:, high == low] = 0.5
    colours = mpl.colormaps["viridis"]
    alpha = 0.8 if len(places) <= DISTINCT else 0.25
    for row, made in zip(scaled, table.rows, strict=True):
        if made.status == FAILED:
            axes.plot(range(varied), row[:varied], color=RED, linestyle=":", alpha=alpha)
            continue
        colour = colours(row[varied]) if np.isfinite(row[varied]) else GREY
        axes.plot(range(count), row, color=colour, alpha=alpha, linewidth=sized(1.0),
                  linestyle="--" if made.status == DOUBTFUL else "-")  # fmt: skip
    for k, scale in enumerate(scales):
        axes.axvline(k, color=BLACK, linewidth=sized(0.8))
        for at, text in _ticks(low[k], high[k], scale.words):
            axes.annotate(text, (k, at), (3, 0), textcoords="offset points", va="center",
                          fontsize=mpl.rcParams["xtick.labelsize"], color=GREY,
                          bbox={"color": "white", "alpha": 0.7, "pad": 0.5},
                          parse_math=False)  # fmt: skip
    names = [scale.label for scale in scales]
    if style.narrow:
        axes.tick_params("x", rotation=90)
    else:
        names = [_broken(name, figure.get_figwidth() / count) for name in names]
    axes.set_xticks(range(count), names, parse_math=False)
    axes.set_xlim(-0.1, count - 0.6)
    axes.set_yticks([])
    axes.grid(visible=False)
    axes.set_frame_on(False)
    return figure


def _broken(name: str, room: float) -> str:
    """Break a name after dots and underscores, into lines of `room` (inches)."""
    words = name.replace(".", ". ").replace("_", "_ ").replace(" (", "  (")
    lines = fill(words, max(int(room * LETTERS), 8), break_long_words=False).split("\n")
    return "\n".join(line.replace("  ", "\0").replace(" ", "").replace("\0", " ") for line in lines)


def _ticks(low: float, high: float, words: Sequence[str]) -> list[tuple[float, str]]:
    """Heights (0 to 1) along an axis and what stands there."""
    if high == low:
        return [(0.5, words[0] if words else f"{low:.3g}")]
    if words:
        return [(k / (len(words) - 1), word) for k, word in enumerate(words)]
    parts = np.linspace(0, 1, TICKS).tolist()
    return [(part, f"{low + part * (high - low):.3g}") for part in parts]
