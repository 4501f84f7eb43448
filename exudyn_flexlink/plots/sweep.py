"""Observables of a sweep over what varied: lines, maps, or dots."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, nan

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exudyn_flexlink.arrays import BoolArray, FloatArray
from exudyn_flexlink.plots.frame import framed_figure, settle
from exudyn_flexlink.plots.panels import legend_outside, letter, sized
from exudyn_flexlink.plots.style import BLACK, BLUE, GREY, SCREEN, Style, styled
from exudyn_flexlink.plots.style import FAILED as OF_FAILED
from exudyn_flexlink.source import did_you_mean
from exudyn_flexlink.sweeps import DOUBTFUL, FAILED, Scalar, SweepTable, in_si, label_of

MOST_PANELS = 6
NOTICEABLE = 1e-4  # of a number: the summary prints numbers that differ by less alike
ROUNDING, LEAST_CHANGE = 1e-9, 1e-12  # of a number; SI: smaller differences tell nothing
FEW = 8  # values that all have a tick
LINES, MAP = 1.5, 2.6  # inches on a screen, of a panel


@dataclass(frozen=True)
class Scale:
    """Places (N,) of the rows along an axis, its label, and the words at whole places, if any."""

    places: FloatArray
    label: str
    words: tuple[str, ...] = ()


@styled
def sweep(table: SweepTable, names: Sequence[str] = (), *, style: Style = SCREEN) -> Figure | None:
    """Draw observables by their columns' `names`, or the first that differ from row to row.

    Over one value that varied as lines, over two as maps, over each of more as dots. Rows that
    failed or are doubtful are marked; None if no row has numbers.

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
    draw = _maps if len(along) == 2 else _lines
    return draw(table, along, seen[: max(MOST_PANELS, len(names))], style)


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
        if np.ptp(numbers) > max(part * float(np.max(np.abs(numbers))), LEAST_CHANGE):
            found.append(name)
    return found


def _along(table: SweepTable, i: int) -> Scale:
    """Values that varied, in the unit in which the user gave them."""
    varied = table.varied[i]
    values = [row[i] for row in table.values]
    one = in_si(f"1 {varied.given}", varied.unit) if varied.given else 1.0
    if isinstance(one, float) and all(isinstance(value, float) for value in values):
        return _scale([float(v) / one for v in values], varied.path, varied.given or varied.unit)
    return _scale(values, varied.path, "")


def _scale(values: Sequence[Scalar], name: str, unit: str) -> Scale:
    """Values with their label; nan where there is none that can be drawn."""
    label = f"{name} ({unit})" if unit else name
    if any(isinstance(value, str) for value in values):
        words = tuple(dict.fromkeys(str(value) for value in values))
        return Scale(np.array([words.index(str(v)) for v in values], dtype=float), label, words)
    numbers = [nan if v is None or isinstance(v, str) else float(v) for v in values]
    return Scale(np.where(np.isfinite(numbers), numbers, nan), label)


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
    """A row of panels for each observable, a column for each value that varied.

    Lines join the rows where one value varied alone.
    """
    alone = len(along) == 1
    subject = f"over {along[0].label}" if alone else f"over each of {len(along)} values"
    figure = _frame(table, subject, 0.5 + LINES * len(seen), style)
    count = len(seen), len(along)
    panels = figure.subplots(*count, sharex="col", sharey="row", squeeze=False)
    for row, own in zip(panels, seen, strict=True):
        for axes, x in zip(row, along, strict=True):
            if alone:
                order = np.argsort(x.places, kind="stable")
                axes.plot(x.places[order], own.places[order], color=BLUE, alpha=0.6)
            _dots(axes, table, x, own)
        row[0].set_title(own.label, parse_math=False)
        if not own.words:  # no number that would have to be added to each
            row[0].yaxis.get_major_formatter().set_useOffset(False)
    for axes, x in zip(panels[-1], along, strict=True):
        _ticked(axes, x, "x")
        if not alone:  # there is no room for long names, in print not even for short ones
            name = x.label.replace(".", ".\n").replace(" (", "\n(")
            axes.set_xlabel(name, rotation=90 * style.narrow, parse_math=False)
            axes.tick_params("x", rotation=90 * style.narrow)
    letter(panels[:, 0])
    if table.count(FAILED) or table.count(DOUBTFUL):
        legend_outside(panels[0, -1], below=not alone)
        settle(figure)
    return figure


def _dots(axes: Axes, table: SweepTable, x: Scale, own: Scale) -> None:
    """A dot for each row, hollow if it is doubtful; a line across for one that failed."""
    failed, doubtful = _of(table, FAILED), _of(table, DOUBTFUL)
    for chosen, filled, label in ((~failed & ~doubtful, BLUE, "done"),
                                  (doubtful, "white", "doubtful")):  # fmt: skip
        if chosen.any():
            axes.plot(x.places[chosen], own.places[chosen], "o", color=BLUE, label=label,
                      markerfacecolor=filled, markersize=sized(4))  # fmt: skip
    for k, place in enumerate(x.places[failed]):
        axes.axvline(place, color=OF_FAILED, linestyle=":", label="failed" if k == 0 else None)


def _maps(table: SweepTable, along: list[Scale], seen: list[Scale], style: Style) -> Figure:
    """One map for each observable over both values: cells of a grid, or else dots."""
    x, y = along
    columns = 1 if style.narrow or len(seen) == 1 else 2
    rows = ceil(len(seen) / columns)
    size, words = 0.4 + MAP * rows, (" (crosses)", " (white dots)")
    figure = _frame(table, f"over {x.label} and {y.label}", size, style, words)
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    cells = len(np.unique(x.places)) * len(np.unique(y.places))
    grid = len(x.places) > 1 and cells <= 2 * len(x.places)  # interrupted, it has holes
    marks = ((_of(table, FAILED), "x", OF_FAILED), (_of(table, DOUBTFUL), "o", BLACK))
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


def _cells(
    x: FloatArray, y: FloatArray, values: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Columns, rows and a matrix of values, nan where there is none."""
    columns, i = np.unique(x, return_inverse=True)
    rows, k = np.unique(y, return_inverse=True)
    found = np.full((len(rows), len(columns)), nan)
    found[k, i] = values
    return columns, rows, found
