"""Figures of studies: accuracy over cost, benchmarks, stability, series, sweeps, comparisons.

A run is drawn over a measured series, or over another run of its scene; a panel below shows the
differences. Observables of a sweep are lines, maps or dots over the values that varied.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, isfinite, log10, nan
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter
from numpy.typing import NDArray

from exudyn_flexlink.accuracy import Errors, Method, Point, Study
from exudyn_flexlink.arrays import BoolArray, FloatArray
from exudyn_flexlink.comparison import Comparison
from exudyn_flexlink.fitting import Against, Fit
from exudyn_flexlink.observables import Measure, name_of
from exudyn_flexlink.plots.frame import (
    BLACK,
    BLUE,
    ENGINE_COLOURS,
    GREEN,
    GREY,
    LEGEND,
    ORANGE,
    OTHERS,
    PURPLE,
    RED,
    ROW_HEIGHT,
    SCREEN,
    SERIES,
    SKY,
    Style,
    doubts_of,
    error_of,
    framed_figure,
    links_of,
    new_figure,
    settle,
    styled,
)
from exudyn_flexlink.plots.frame import (
    FAILED as OF_FAILED,
)
from exudyn_flexlink.plots.panels import (
    BEYOND,
    along,
    colours_of_both,
    engine_colour,
    legend_outside,
    length_unit,
    letter,
    limits,
    logarithmic,
    mark_doubt,
    shade_beyond,
    shown_in,
    sized,
)
from exudyn_flexlink.source import did_you_mean
from exudyn_flexlink.stability import Branches, Stability
from exudyn_flexlink.sweeps import DOUBTFUL, FAILED, Scalar, SweepTable, in_si, label_of
from exudyn_flexlink.verification import VerifiedRun


@styled
def against(beside: Against, *, style: Style = SCREEN) -> Figure:
    """Draw each quantity of a series and of its run, and the difference: run minus series."""
    what = f"{beside.result.engine} and {beside.series.source}"
    shift = f", shifted by {beside.shift:.4g} s" if beside.shift else ""
    return _drawn(beside, f"{what}{shift}, and their difference", "difference", style)


@styled
def fit(fitted: Fit, *, style: Style = SCREEN) -> Figure:
    """Draw each fitted quantity with the measured values, and the residuals."""
    names = (
        " and ".join(fitted.values) if len(fitted.values) < 3 else f"{len(fitted.values)} values"
    )
    subject = f"Fit of {names} to {fitted.against.series.source}"
    return _drawn(fitted.against, subject, "residual", style)


def _drawn(beside: Against, subject: str, difference: str, style: Style) -> Figure:
    """Draw two panels for each quantity: run and series; the difference, labelled `difference`."""
    result = beside.result
    figure = new_figure(result, subject, 0.4 + 2.9 * len(beside.measured), style)
    ratios = (1.7, 1) * len(beside.measured)
    rows = figure.subplots(len(ratios), 1, sharex=True, squeeze=False, height_ratios=ratios)[:, 0]
    shown = (result.time >= beside.time[0]) & (result.time <= beside.time[-1])
    time, marks = result.time[shown], {"color": BLACK, "markersize": sized(2)}
    for both, below, (name, measured) in zip(
        rows[::2], rows[1::2], beside.measured.items(), strict=True
    ):
        signal = beside.series.signals[name]
        factor, unit = shown_in(signal.unit, measured)
        line = factor * signal.at(result, time)
        both.plot(beside.time, factor * measured, ".", label=beside.series.source, **marks)
        both.plot(time, line, color=engine_colour(result), label=result.engine)
        both.set_ylabel(f"{name}\n({unit})")
        apart = beside.differences[name]
        small, unit = shown_in(signal.unit, apart)
        below.plot(beside.time, small * apart, ".", **marks)
        below.axhline(0.0, color=GREY, linewidth=sized(0.8))
        below.set_ylabel(f"{difference}\n({unit})")
        for axes in (both, below):
            shade_beyond(axes, result, result.time, named=axes is rows[0])
    legend_outside(rows[0])
    rows[-1].set_xlabel("time (s)")
    limits(rows[-1], np.asarray(beside.time))
    letter(rows)
    return figure


LOOKS = {"minimal": ("o", "-"), "redundant": ("s", "--"), "beam": ("D", ":"),
         "fixed step": ("^", "-."), "": ("o", "-")}  # fmt: skip
"""Markers and lines by formulation; an engine without formulations has the key ''."""
_OF_SOURCES = {"rods": (GREEN, "error of the rods"), "contact": (PURPLE, "contact compliance")}
LOWEST = 1e-16  # m: smallest error in the figure
DEEPEST = 1e-3  # of the floor: smallest error in the figure
FEW_DECADES = 2.0  # decades: a shorter axis of time also has labels between powers of ten
LEAST_SHOWN = 1e-12  # of the allowed difference: smaller differences are drawn at this value
FAINTEST = 1e-8  # of a spectrum's peak: smallest value in the figure


@styled
def work_precision(study: Study, *, style: Style = SCREEN) -> Figure:
    """Draw the largest error of the judged points over processor time, log-log.

    Points below the floor are hollow: the two references differ by the floor, so no independent run
    confirms smaller errors. Horizontal lines mark the target and errors that no setting removes.
    """
    subject = f"What accuracy costs: error over processor time, to t = {study.until:.4g} s"
    height = 4.0 + LEGEND * style.narrow
    figure = framed_figure((study.scene.title, subject), height, style, caption=_caption_of(study))
    axes = figure.subplots()
    axes.set_xscale("log")
    axes.set_yscale("log")
    _draw(axes, study)
    axes.set_ylabel(f"largest error of\n{name_of(study.judged_by)} (m)")
    legend_outside(axes)
    axes.set_xlabel("processor time of the solve (s)")
    low, high = axes.get_xlim()
    subs = (1.0, 2.0, 5.0) if log10(high / low) < FEW_DECADES else (1.0,)
    axes.xaxis.set_major_locator(LogLocator(subs=subs))
    axes.xaxis.set_major_formatter(lambda x, _: f"{x:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())
    return figure


def _drawn_height(errors: Errors, floor: float = 0.0) -> float:
    """Return the height (m) at which an error is drawn, not far below the floor."""
    return max(errors.largest, DEEPEST * floor, LOWEST)


def _caption_of(study: Study) -> list[tuple[str, str]]:
    """Return the caption with its colours: the runs that give the errors and their floor."""
    texts = [(f"errors against {study.reference.label}", GREY)]
    if study.check is not None:
        texts.append((f"floor: its distance from {study.check.label}", GREY))
    links = "; ".join(links_of(study.scene))
    return [*([(links, GREY)] if links else []), *texts]


def _draw(axes: Axes, study: Study) -> None:
    """Draw a curve for each method, and horizontal lines for errors that no setting removes."""
    for method in dict.fromkeys(point.method for point in study.points):
        points = [point for point in study.points if point.method == method]
        _curve(axes, method, sorted(points, key=lambda p: -p.value), study.floor)
    for source in study.sources:
        level = _drawn_height(source.errors)
        if source.kind in _OF_SOURCES and level > LOWEST:
            colour, name = _OF_SOURCES[source.kind]
            axes.axhline(level, color=colour, linestyle=(0, (6, 3)), linewidth=1.0, label=name)
    label = f"target asked for, {study.target:.2g} m"
    axes.axhline(study.target, color=BLACK, linewidth=0.8, linestyle=(0, (1, 2)), label=label)
    low, high = axes.get_ylim()
    if study.floor > 0:
        low = min(low, study.floor / 3)
        label = "below the floor"
        axes.axhspan(low, study.floor, color=GREY, alpha=0.15, linewidth=0, label=label)
    if study.model_point is not None:
        place = (study.model_point.processor, _drawn_height(study.model_point.errors, study.floor))
        axes.plot(*place, "o", color=ORANGE, markersize=sized(11), markerfacecolor="none",
                  markeredgewidth=1.6, label="the model's own settings")  # fmt: skip
    axes.set_ylim(low, high)


def _curve(axes: Axes, method: Method, points: Sequence[Point], floor: float) -> None:
    """Draw the points of a method; they are hollow if their error is below the floor (m)."""
    kind = "fixed step" if method.knob == "step" else str(method.settings.get("formulation", ""))
    marker, line = LOOKS.get(kind, LOOKS[""])
    style: dict[str, Any] = {"linestyle": line, "marker": marker, "markersize": sized(5)}
    colour = ENGINE_COLOURS.get(method.engine, BLACK)
    x = np.array([point.processor for point in points])
    y = np.array([_drawn_height(point.errors, floor) for point in points])
    axes.plot(x, y, color=colour, label=method.name, **style)
    hollow = {**style, "linestyle": "", "markerfacecolor": "white"}
    axes.plot(x[y < floor], y[y < floor], color=colour, **hollow)


@styled
def differences(runs: Sequence[VerifiedRun], *, style: Style = SCREEN) -> Figure:
    """Draw a row for every number of some runs: its difference over the allowed difference."""
    numbers = [(run, number) for run in runs for number in run.numbers]
    title = "Benchmarks against published numbers"
    subject = "Difference of each number, over what is allowed"
    notes = [f"{run.benchmark}, {run.run}: {run.stopped}" for run in runs if run.stopped]
    figure = framed_figure((title, subject), 0.9 + ROW_HEIGHT * len(numbers), style, notes=notes)
    axes = figure.subplots()
    axes.set_xscale("log")
    axes.axvline(1.0, color=BLACK, label="allowed")
    for fine, colour, label in ((True, BLUE, "as near as allowed"), (False, OF_FAILED, "off")):
        rows = [
            (max(number.difference / number.allowed, LEAST_SHOWN), row)
            for row, (_, number) in enumerate(numbers)
            if number.fine == fine and isfinite(number.computed)
        ]
        if rows:
            axes.plot(*zip(*rows, strict=True), "o", color=colour, label=label)
    axes.set_yticks(
        range(len(numbers)),
        [f"{run.benchmark}, {run.run}: {n.name} ({n.unit})" for run, n in numbers],
    )
    axes.set_ylim(len(numbers) - 0.5, -0.5)
    axes.set_xlabel("difference / allowed difference")
    legend_outside(axes)
    return figure


@styled
def stability(study: Stability, *, style: Style = SCREEN) -> Figure:
    """Draw four panels: growth of neighbours, laps against earlier laps, section, spectrum."""
    title = f"How stable the motion of {study.point} is: {study.behaviour}"
    columns, height = (1, 13.0) if style.narrow else (2, 6.6)
    figure = new_figure(study.run, title, height, style)
    panels = figure.subplots(4 // columns, columns, squeeze=False).ravel()
    for draw, axes in zip((_growth, _laps, _section, _spectrum), panels, strict=True):
        draw(axes, study)
    letter(panels)
    return figure


def _growth(axes: Axes, study: Stability) -> None:
    """Draw the growth in each lap, its mean up to each lap, and the last mean's uncertainty."""
    rate = study.exponent
    laps = rate.times / study.rhythm.lap
    axes.stairs(*growth_of_laps(laps, rate.rates), color=SKY, linewidth=sized(0.8),
                label="each lap")  # fmt: skip
    counted = laps[rate.settled + 1 :]
    whole = counted > laps[rate.settled] + 1  # an earlier mean depends on the phase within the lap
    axes.plot(counted[whole], rate.running[whole], color=BLUE, label="mean")
    low, high = rate.value - rate.uncertainty, rate.value + rate.uncertainty
    axes.axhspan(low, high, color=BLUE, alpha=0.2, linewidth=0, label="95 %")
    axes.axhline(0.0, color=BLACK, linewidth=sized(0.6))
    axes.set_xlabel("laps")
    axes.set_ylabel("growth of distance (1/s)")
    axes.legend(loc="best")


def growth_of_laps(laps: FloatArray, rates: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the mean growth (L,) 1/s in each lap, and the limits of the laps (L + 1,).

    `rates` (K,) 1/s belong to the many short stretches between `laps` (K + 1,).
    """
    bounds = laps[0] + np.arange(max(1, round(laps[-1] - laps[0])) + 1)
    grown = np.concatenate([[0.0], np.cumsum(rates * np.diff(laps))])
    return np.diff(np.interp(bounds, laps, grown)), bounds


def _laps(axes: Axes, study: Stability) -> None:
    """Draw the largest distance of the point from its places one to eight laps before."""
    laps = study.laps
    number = laps.end / study.rhythm.lap
    for colour, before, row in zip(SERIES, laps.before.tolist(), laps.largest, strict=False):
        seen = np.isfinite(row) & (row > 0)
        axes.semilogy(number[seen], row[seen], "o-", color=colour, markersize=sized(3),
                      linewidth=sized(0.8), label=f"{before}")  # fmt: skip
    axes.axhline(study.tolerance, color=BLACK, linestyle=":", label="tolerance")
    known = (study.after + study.horizon) / study.rhythm.lap
    if isfinite(known) and known < number[-1]:
        axes.axvspan(known, float(number[-1]), zorder=0, label="beyond the\nhorizon", **BEYOND)
    axes.set_xlabel("lap")
    axes.set_ylabel("distance from laps before (m)")
    legend_outside(axes, title="laps before")


def _section(axes: Axes, study: Stability) -> None:
    """Draw the place of the point once a lap; later places are darker."""
    section = study.section
    order = np.arange(len(section.time))
    x, y = 1e3 * section.position.T
    axes.scatter(x, y, c=order, cmap="viridis_r", s=sized(14), zorder=3)
    axes.ticklabel_format(useOffset=False)
    axes.xaxis.set_major_locator(MaxNLocator(3))
    axes.set_xlabel(f"x of {section.point} (mm)")
    axes.set_ylabel("y (mm)")
    section_text = f"at {np.degrees(section.phase):.4g} deg" if section.by_crank else "by time"
    axes.set_title(f"{len(order)} laps {section_text}; later ones darker", loc="left")


def _spectrum(axes: Axes, study: Stability) -> None:
    """Draw the power spectrum of the point's deviation; x is broad and pale, below y.

    The deviation is the distance from the ideal place. A periodic motion has lines at multiples of
    one frequency, so dense that they would fill the panel. So only the largest value near each
    multiple is drawn.
    """
    vibration = study.vibration
    top = 0.0
    looks = ({"linewidth": sized(3.0), "alpha": 0.45}, {"linewidth": sized(0.6)})
    both = (("x", BLUE, vibration.x), ("y", RED, vibration.y))
    for (name, colour, spectrum), look in zip(both, looks, strict=True):
        if len(spectrum.frequency):
            multiples = np.rint(spectrum.frequency * study.rhythm.cycle)
            first = np.flatnonzero(np.diff(multiples, prepend=-1.0))
            power = np.maximum.reduceat(spectrum.power, first)[1:]
            frequency = multiples[first][1:] / study.rhythm.cycle
            axes.loglog(frequency, power, color=colour, label=name, marker=".", **look)
            top = max(top, float(power.max(initial=0.0)))
    if top > 0:
        axes.set_ylim(FAINTEST * top, 3 * top)
        axes.legend(loc="best")
    axes.set_xlabel("frequency (Hz)")
    axes.set_ylabel(
        "off its ideal place\n(m$^2$/Hz)" if vibration.off_ideal else "power (m$^2$/Hz)"
    )


@styled
def bifurcation(branches: Branches, *, axis: str = "y", style: Style = SCREEN) -> Figure:
    """Draw the place of a point once a lap over the varied value; `axis` is x or y."""
    values, places = branches.points
    point = branches.sections[0].point if branches.sections else ""
    reasons = (("failed", branches.failed), ("doubtful", branches.doubtful))
    notes = [f"{len(which)} {how}" for how, which in reasons if which]
    title = f"{axis} of {point} once a lap"
    figure = framed_figure((title, f"over {branches.path}"), 4.0, style, notes=notes)
    axes = figure.subplots()
    axes.plot(values, 1e3 * places[:, "xy".index(axis)], ".", color=BLUE, markersize=sized(3))
    axes.set_xlabel(f"{branches.path} (SI)")
    axes.set_ylabel(f"{axis} of {point} (mm)")
    return figure


MOST_PANELS = 6
SMALL = 1e-7  # of the largest number in the same unit: columns of smaller numbers are rounding
NOTICEABLE = 1e-4  # of a number: smaller differences change no digit of the summary
ALL_BUT_ROUNDING, LEAST_CHANGE = 1e-9, 1e-12  # of a number; SI: smaller changes are rounding
FEW = 8  # an axis has a tick for each value if it has at most so many values
LINES, MAP = 1.5, 2.6  # inches on a screen: height of a panel with lines; with a map


@dataclass(frozen=True)
class Scale:
    """Places (N,) of the rows along an axis, its label, and texts at integer places, if any."""

    places: FloatArray
    label: str
    words: tuple[str, ...] = ()


@styled
def sweep(table: SweepTable, names: Sequence[str] = (), *, style: Style = SCREEN) -> Figure | None:
    """Draw observables: the columns `names`, or the first ones that differ from row to row.

    One varied value gives lines, two give maps, more give dots over each value. Rows of failed or
    doubtful runs are marked. None if no row has numbers.

    Raises:
        ValueError: there is no such column.

    """
    # Columns with visible differences come first, if there are any.
    chosen = list(names) or _differing(table, NOTICEABLE) or _differing(table, ALL_BUT_ROUNDING)
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
    """Return numeric observables that differ from row to row by more than a `part` of their size.

    Differences below `LEAST_CHANGE` do not count, nor columns that are rounding beside others.
    """
    numbers = dict[str, list[float]]()
    largest = dict[str, float]()
    for name, values in table.columns().items():
        known = [value for value in values if isinstance(value, float | int)]
        texts = any(isinstance(value, str) for value in values)
        if name in table.observables and not texts:
            finite = [float(value) for value in known if isfinite(value)]
            unit = label_of(name)[1]
            largest[unit] = max([largest.get(unit, 0.0), *map(abs, finite)])
            numbers[name] = finite

    def differs(name: str, values: list[float]) -> bool:
        most, unit = max(map(abs, values), default=0.0), label_of(name)[1]
        if most <= SMALL * largest[unit]:
            return False
        return bool(np.ptp(values) > max(part * most, LEAST_CHANGE))

    return [name for name, values in numbers.items() if differs(name, values)]


def _along(table: SweepTable, i: int) -> Scale:
    """Return the scale of a varied value, in the unit that the user gave."""
    varied = table.varied[i]
    values = [row[i] for row in table.values]
    factor = in_si(f"1 {varied.given}", varied.unit) if varied.given else 1.0
    if isinstance(factor, float) and all(isinstance(value, float) for value in values):
        return _scale([float(v) / factor for v in values], varied.path, varied.given or varied.unit)
    return _scale(values, varied.path, "")


def _scale(values: Sequence[Scalar], name: str, unit: str) -> Scale:
    """Return values with their label; a value that can't be drawn is nan."""
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
    """Return an empty figure: title, numbers of failed, missing and doubtful runs, their marks."""
    crossed, ringed = marks
    failed, missing = table.count(FAILED), table.points - len(table.rows)
    notes = [f"{failed} of {len(table.rows)} runs failed{crossed}: see 'reason' in the table"]
    notes *= failed > 0
    notes += [f"{missing} of {table.points} runs are missing"] * (missing > 0)
    doubtful = table.count(DOUBTFUL)
    about = f"; {doubtful} doubtful{ringed}, which their 'reason' explains" if doubtful else ""
    caption = [(f"{len(table.rows)} runs by {table.engine}{about}", GREY)]
    return framed_figure((table.title, subject), height, style, notes=notes, caption=caption)


def _ticked(axes: Axes, scale: Scale, which: str) -> None:
    """Label an axis, and its places if they are texts or few."""
    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_label_text(scale.label, parse_math=False)
    given = np.unique(scale.places)
    if scale.words:
        axis.set_ticks(range(len(scale.words)), scale.words)
    elif len(given) <= FEW:
        axis.set_ticks(given, [f"{place:.4g}" for place in given])


def _lines(table: SweepTable, along: list[Scale], seen: list[Scale], style: Style) -> Figure:
    """Draw a row of panels for each observable, with a column for each varied value.

    If only one value varied, lines join the rows of the table.
    """
    alone = len(along) == 1
    subject = f"over {along[0].label}" if alone else f"over each of {len(along)} values"
    figure = _frame(table, subject, 0.5 + LINES * len(seen), style)
    count = len(seen), len(along)
    panels = figure.subplots(*count, sharex="col", sharey="row", squeeze=False)
    for row, scale in zip(panels, seen, strict=True):
        for axes, x in zip(row, along, strict=True):
            if alone:
                order = np.argsort(x.places, kind="stable")
                axes.plot(x.places[order], scale.places[order], color=BLUE, alpha=0.6)
            _dots(axes, table, x, scale)
        row[0].set_title(scale.label, parse_math=False)
        if not scale.words:  # no offset on the axis: readers would have to add it to each number
            row[0].yaxis.get_major_formatter().set_useOffset(False)
    for axes, x in zip(panels[-1], along, strict=True):
        _ticked(axes, x, "x")
        if not alone:  # no room for long names; in print, not even for short ones
            name = x.label.replace(".", ".\n").replace(" (", "\n(")
            axes.set_xlabel(name, rotation=90 * style.narrow, parse_math=False)
            axes.tick_params("x", rotation=90 * style.narrow)
    letter(panels[:, 0])
    if table.count(FAILED) or table.count(DOUBTFUL):
        legend_outside(panels[0, -1], below=not alone)
        settle(figure)
    return figure


def _dots(axes: Axes, table: SweepTable, x: Scale, scale: Scale) -> None:
    """Draw a dot for each row, hollow if it is doubtful; a vertical line for a failed row."""
    failed, doubtful = _of(table, FAILED), _of(table, DOUBTFUL)
    for chosen, filled, label in ((~failed & ~doubtful, BLUE, "done"),
                                  (doubtful, "white", "doubtful")):  # fmt: skip
        if chosen.any():
            axes.plot(x.places[chosen], scale.places[chosen], "o", color=BLUE, label=label,
                      markerfacecolor=filled, markersize=sized(4))  # fmt: skip
    for k, place in enumerate(x.places[failed]):
        axes.axvline(place, color=OF_FAILED, linestyle=":", label="failed" if k == 0 else None)


def _maps(table: SweepTable, along: list[Scale], seen: list[Scale], style: Style) -> Figure:
    """Draw one map for each observable over both values: cells of a grid, or dots."""
    x, y = along
    columns = 1 if style.narrow or len(seen) == 1 else 2
    rows = ceil(len(seen) / columns)
    size, words = 0.4 + MAP * rows, (" (crosses)", " (white dots)")
    figure = _frame(table, f"over {x.label} and {y.label}", size, style, words)
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    cells = len(np.unique(x.places)) * len(np.unique(y.places))
    grid = len(x.places) > 1 and cells <= 2 * len(x.places)  # interrupted sweeps leave holes
    marks = ((_of(table, FAILED), "x", OF_FAILED), (_of(table, DOUBTFUL), "o", BLACK))
    for axes, scale in zip(panels.flat, seen, strict=False):
        if grid:
            shown = axes.pcolormesh(*_cells(x.places, y.places, scale.places), shading="nearest")
        else:
            shown = axes.scatter(x.places, y.places, c=scale.places, s=sized(5) ** 2)
        figure.colorbar(shown, ax=axes)
        for of, shape, colour in marks:
            axes.plot(x.places[of], y.places[of], shape, color=colour, markerfacecolor="white",
                      markersize=sized(4))  # fmt: skip
        axes.set_title(scale.label, parse_math=False)
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
    """Return columns, rows and a matrix of values; missing values are nan."""
    columns, i = np.unique(x, return_inverse=True)
    rows, k = np.unique(y, return_inverse=True)
    cells = np.full((len(rows), len(columns)), nan)
    cells[k, i] = values
    return columns, rows, cells


@styled
def comparison(compared: Comparison, *, style: Style = SCREEN) -> Figure | None:
    """Draw watched point and struck bodies of both runs, and below their differences on log axes.

    Strikes and the horizon are marked; beyond the horizon no single instant can be compared. None
    if the runs share only one instant.
    """
    if len(compared.time) < 2:
        return None
    runs = compared.both
    subject = f"{compared.point}: {runs[0].name} and {runs[1].name}, and their difference"
    notes = [f"{seen.name}: {doubts}" for seen in runs if (doubts := doubts_of(seen.result))]
    title = runs[1].result.scene.title
    count = 3 + len(_kinds(compared)) + len(compared.levers)
    height, caption = 0.3 + 1.6 * count, _caption(compared)
    figure = framed_figure((title, subject), height, style, notes=notes, caption=caption)
    rows = figure.subplots(count, 1, sharex=True)
    turns, label = along(runs[0].result)
    x = np.interp(compared.time, runs[0].result.time, turns)
    _motions(rows, compared, x)
    _differences(rows[2 + len(compared.levers) :], compared, x)
    for axes in rows:
        _marks(axes, compared, x, named=axes is rows[0])
    for axes in (rows[0], rows[-1]):
        legend_outside(axes)
    rows[-1].set_xlabel(label)
    limits(rows[-1], x)
    letter(rows)
    return figure


def _caption(compared: Comparison) -> list[tuple[str, str]]:
    """Return lines of text with their colours: the links, then the settings of both runs."""
    runs = compared.both
    links = ["; ".join(links_of(seen.result.scene)) for seen in runs]
    alike = links[0] == links[1]
    texts = [(links[0], GREY)] if alike else []
    for seen, response, style in zip(runs, links, _styles(compared), strict=True):
        engine = seen.result.engine
        words = ["" if engine in seen.name else engine, "" if alike else response, seen.accuracy,
                 error_of(seen.result.error)]  # fmt: skip
        texts.append((f"{seen.name}: {'; '.join(word for word in words if word)}", style["color"]))
    return texts


def _styles(compared: Comparison) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the looks: the first run is a broad pale band, the second a thin line on it."""
    first_colour, second_colour = colours_of_both(compared.first.result, compared.second.result)
    line = float(mpl.rcParams["lines.linewidth"])
    return (
        {"color": first_colour, "linewidth": 2.6 * line, "alpha": 0.45},
        {"color": second_colour, "linewidth": 0.8 * line},
    )


def _motions(rows: NDArray[Any], compared: Comparison, x: FloatArray) -> None:
    """Draw both coordinates of the point and the motions of struck bodies, of both runs."""
    factor, unit = length_unit(compared.first.position)
    answers = compared.first.answers
    scales = {body: shown_in(compared.measures[body].unit, answers[body]) for body in answers}
    for seen, style in zip(compared.both, _styles(compared), strict=True):
        motions = (scales[body][0] * values for body, values in seen.answers.items())
        shown = [*(factor * seen.position.T), *motions]
        for axes, values in zip(rows, shown, strict=False):
            axes.plot(x, values, label=seen.name, **style)
    for axes, coordinate in zip(rows, "xy", strict=False):
        axes.set_ylabel(f"${coordinate}$ of {compared.point}\n({unit})")
    for axes, body in zip(rows[2:], compared.levers, strict=False):
        axes.set_ylabel(f"{compared.measures[body].word} of\n{body} ({scales[body][1]})")


def _differences(rows: NDArray[Any], compared: Comparison, x: FloatArray) -> None:
    """Draw the distance between the points and, below, the differences of struck bodies."""
    factor, unit = length_unit(compared.first.position)
    away = {"": factor * compared.deviation.distance}
    logarithmic(rows[0], x, away, OTHERS[::-1], "no difference")
    rows[0].set_ylabel(f"difference of\n{name_of(compared.judged_by)}\n({unit})")
    for axes, measure in zip(rows[1:], _kinds(compared), strict=True):
        apart = {
            body: values
            for body, values in compared.answer_differences.items()
            if compared.measures[body] is measure
        }
        factor, unit = shown_in(measure.unit, [compared.first.answers[body] for body in apart])
        shown = {body * (len(apart) > 1): factor * values for body, values in apart.items()}
        logarithmic(axes, x, shown, OTHERS[::-1], "no difference")
        axes.set_ylabel(f"difference of\n{measure.word}s\n({unit})")


def _kinds(compared: Comparison) -> list[Measure]:
    """Return the measures of the motions of struck bodies, each once."""
    return list(dict.fromkeys(compared.measures.values()))


def _marks(axes: Axes, compared: Comparison, x: FloatArray, *, named: bool) -> None:
    """Mark the first touch of every strike, and the horizon; `named` adds a legend entry once."""
    begins = [
        strike.begin
        for seen in compared.both
        for of_contact in seen.strikes.values()
        for strike in of_contact
        if strike.begin <= compared.time[-1]
    ]
    if begins:
        places, height = np.interp(begins, compared.time, x), axes.get_xaxis_transform()
        look: dict[str, Any] = {"color": ORANGE, "linewidth": 1.0, "zorder": 1}
        axes.vlines(places, 0, 1, label="strike" * named, transform=height, **look)
    for i, seen in enumerate(compared.both):
        mark_doubt(axes, seen.result, compared.time, x, named=named and i == 0)
    if compared.horizon is None:
        return
    place = float(np.interp(compared.horizon, compared.time, x))
    label = "beyond the horizon" if named else None
    axes.axvline(place, color=BLACK, linestyle="--", linewidth=0.8)
    axes.axvspan(place, float(x[-1]), label=label, zorder=0, **BEYOND)
