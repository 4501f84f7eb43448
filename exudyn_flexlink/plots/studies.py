"""What accuracy costs, how far benchmarks are off, and how stable a motion is."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, log10
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from exudyn_flexlink.accuracy import Errors, Method, Point, Study
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.observables import name_of
from exudyn_flexlink.plots.frame import framed_figure, links_of, new_figure
from exudyn_flexlink.plots.panels import BEYOND, legend_outside, letter, sized
from exudyn_flexlink.plots.style import (
    BLACK,
    BLUE,
    ENGINE_COLOURS,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    RED,
    SCREEN,
    SERIES,
    SKY,
    Style,
    styled,
)
from exudyn_flexlink.plots.style import (
    FAILED as OF_FAILED,
)
from exudyn_flexlink.stability import Branches, Stability
from exudyn_flexlink.verification import VerifiedRun

LOOKS = {"minimal": ("o", "-"), "redundant": ("s", "--"), "beam": ("D", ":"),
         "fixed step": ("^", "-."), "": ("o", "-")}  # fmt: skip
"""Markers and lines of formulations; of an engine without a choice those of none."""
_OF_SOURCES = {"rods": (GREEN, "error of the rods"), "contact": (PURPLE, "contact compliance")}
LEGEND = 2.4  # inches on a screen, of the legend above in print
LOWEST = 1e-16  # m: nothing is drawn below it,
DEEPEST = 1e-3  # nor below this part of the floor
FEW_DECADES = 2.0  # of the axis of time: then more than powers of ten are labelled
ROW = 0.24  # inches on a screen, of a number
LEAST_SHOWN = 1e-17  # a smaller difference, in any unit, is none: it is drawn here
FAINTEST = 1e-8  # of a spectrum's peak: nothing is drawn below


@styled
def work_precision(study: Study, *, style: Style = SCREEN) -> Figure:
    """Largest error of the points that are judged over processor time, log-log.

    Points below the floor, to which the two references agree, are hollow: nothing independent tells
    them. Lines across mark the target and the errors that no setting removes.
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


def _panels_of(errors: Errors, floor: float = 0.0) -> float:
    """Where an error is drawn, m: far below the floor there is nothing to see."""
    return max(errors.largest, DEEPEST * floor, LOWEST)


def _caption_of(study: Study) -> list[tuple[str, str]]:
    """Say against which runs errors and their floor are; lines with their colours."""
    told = [(f"errors against {study.reference.told}", GREY)]
    if study.check is not None:
        told.append((f"floor: its distance from {study.check.told}", GREY))
    links = "; ".join(links_of(study.scene))
    return [*([(links, GREY)] if links else []), *told]


def _draw(axes: Axes, study: Study) -> None:
    """Draw a curve for each method, and lines across for what no setting removes."""
    for method in dict.fromkeys(point.method for point in study.points):
        points = [point for point in study.points if point.method == method]
        _curve(axes, method, sorted(points, key=lambda p: -p.value), study.floor)
    for source in study.sources:
        level = _panels_of(source.errors)
        if source.kind in _OF_SOURCES and level > LOWEST:
            colour, name = _OF_SOURCES[source.kind]
            axes.axhline(level, color=colour, linestyle=(0, (6, 3)), linewidth=1.0, label=name)
    label = f"target asked for, {study.target:.2g} m"
    axes.axhline(study.target, color=BLACK, linewidth=0.8, linestyle=(0, (1, 2)), label=label)
    low, high = axes.get_ylim()
    if study.floor > 0:
        low = min(low, study.floor / 3)
        told = "below the floor"
        axes.axhspan(low, study.floor, color=GREY, alpha=0.15, linewidth=0, label=told)
    if study.own is not None:
        place = (study.own.processor, _panels_of(study.own.errors, study.floor))
        axes.plot(*place, "o", color=ORANGE, markersize=sized(11), markerfacecolor="none",
                  markeredgewidth=1.6, label="the model's own settings")  # fmt: skip
    axes.set_ylim(low, high)


def _curve(axes: Axes, method: Method, points: Sequence[Point], floor: float) -> None:
    """Draw the points of a method, hollow where their error lies below the floor (m)."""
    kind = "fixed step" if method.knob == "step" else str(method.settings.get("formulation", ""))
    marker, line = LOOKS.get(kind, LOOKS[""])
    style: dict[str, Any] = {"linestyle": line, "marker": marker, "markersize": sized(5)}
    colour = ENGINE_COLOURS.get(method.engine, BLACK)
    x = np.array([point.processor for point in points])
    y = np.array([_panels_of(point.errors, floor) for point in points])
    axes.plot(x, y, color=colour, label=method.name, **style)
    hollow = {**style, "linestyle": "", "markerfacecolor": "white"}
    axes.plot(x[y < floor], y[y < floor], color=colour, **hollow)


@styled
def differences(runs: Sequence[VerifiedRun], *, style: Style = SCREEN) -> Figure:
    """Every number of some runs in a row of its own: its difference, and what is allowed."""
    numbers = [(one, number) for one in runs for number in one.numbers]
    title = "Benchmarks against published numbers"
    subject = "Difference of each number, in its SI unit; a bar ends at what is allowed"
    notes = [f"{one.benchmark}, {one.run}: {one.stopped}" for one in runs if one.stopped]
    figure = framed_figure((title, subject), 0.9 + ROW * len(numbers), style, notes=notes)
    axes = figure.subplots()
    axes.set_xscale("log")
    for row, (_, number) in enumerate(numbers):
        colour = BLUE if number.fine else OF_FAILED
        axes.plot([LEAST_SHOWN, number.allowed], [row, row], color=GREY, linewidth=0.7)
        axes.plot([number.allowed], [row], "|", color=BLACK, markersize=sized(8))
        if isfinite(number.computed):
            axes.plot([max(number.difference, LEAST_SHOWN)], [row], "o", color=colour)
    for fine, colour, label in ((True, BLUE, "as near as allowed"), (False, OF_FAILED, "off")):
        if any(number.fine == fine for _, number in numbers):
            axes.plot([], [], "o", color=colour, label=label)
    axes.plot([], [], "|", color=BLACK, markersize=sized(8), label="allowed")
    axes.set_yticks(
        range(len(numbers)),
        [f"{one.benchmark}, {one.run}: {n.name} ({n.unit})" for one, n in numbers],
    )
    axes.set_ylim(len(numbers) - 0.5, -0.5)
    axes.set_xlabel("difference")
    legend_outside(axes)
    return figure


@styled
def stability(found: Stability, *, style: Style = SCREEN) -> Figure:
    """Four panels: growth of neighbours, laps against earlier ones, section, spectrum."""
    told = f"How stable the motion of {found.point} is: {found.told}"
    columns, height = (1, 13.0) if style.narrow else (2, 6.6)
    figure = new_figure(found.run, told, height, style)
    panels = figure.subplots(4 // columns, columns, squeeze=False).ravel()
    for draw, axes in zip((_growth, _laps, _section, _spectrum), panels, strict=True):
        draw(axes, found)
    letter(panels)
    return figure


def _growth(axes: Axes, found: Stability) -> None:
    """Growth in each lap, and the mean up to there with its uncertainty in the end."""
    own = found.exponent
    laps = own.times / found.rhythm.lap
    axes.stairs(*growth_of_laps(laps, own.rates), color=SKY, linewidth=sized(0.8),
                label="each lap")  # fmt: skip
    counted = laps[own.settled + 1 :]
    whole = counted > laps[own.settled] + 1  # before, a mean tells where in the lap it ends
    axes.plot(counted[whole], own.running[whole], color=BLUE, label="mean")
    low, high = own.value - own.uncertainty, own.value + own.uncertainty
    axes.axhspan(low, high, color=BLUE, alpha=0.2, linewidth=0, label="95 %")
    axes.axhline(0.0, color=BLACK, linewidth=sized(0.6))
    axes.set_xlabel("laps")
    axes.set_ylabel("growth of distance (1/s)")
    axes.legend(loc="best")


def growth_of_laps(laps: FloatArray, rates: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean growth (L,) 1/s in each lap, and where laps begin and end (L + 1,).

    `rates` (K,) 1/s are those of stretches between `laps` (K + 1,), which are too many to be seen.
    """
    bounds = laps[0] + np.arange(max(1, round(laps[-1] - laps[0])) + 1)
    grown = np.concatenate([[0.0], np.cumsum(rates * np.diff(laps))])
    return np.diff(np.interp(bounds, laps, grown)), bounds


def _laps(axes: Axes, found: Stability) -> None:
    """Largest distance from where the point was one to eight laps before."""
    laps = found.laps
    number = laps.end / found.rhythm.lap
    for colour, before, row in zip(SERIES, laps.before.tolist(), laps.largest, strict=False):
        seen = np.isfinite(row) & (row > 0)
        axes.semilogy(number[seen], row[seen], "o-", color=colour, markersize=sized(3),
                      linewidth=sized(0.8), label=f"{before}")  # fmt: skip
    axes.axhline(found.tolerance, color=BLACK, linestyle=":", label="tolerance")
    known = (found.after + found.horizon) / found.rhythm.lap
    if isfinite(known) and known < number[-1]:
        axes.axvspan(known, float(number[-1]), zorder=0, label="beyond the\nhorizon", **BEYOND)
    axes.set_xlabel("lap")
    axes.set_ylabel("distance from laps before (m)")
    legend_outside(axes, title="laps before")


def _section(axes: Axes, found: Stability) -> None:
    """Place of the point once a lap, the darker the later."""
    section = found.section
    order = np.arange(len(section.time))
    x, y = 1e3 * section.position.T
    axes.scatter(x, y, c=order, cmap="viridis_r", s=sized(14), zorder=3)
    axes.ticklabel_format(useOffset=False)
    axes.set_xlabel(f"x of {section.point} (mm)")
    axes.set_ylabel("y (mm)")
    at = f"at {np.degrees(section.phase):.4g} deg" if section.by_crank else "once a lap"
    axes.set_title(f"{at}; later laps darker", loc="left")


def _spectrum(axes: Axes, found: Stability) -> None:
    """Power of what the point is off its ideal place; x lies below y, broad and pale."""
    vibration = found.vibration
    top = 0.0
    looks = ({"linewidth": sized(3.0), "alpha": 0.45}, {"linewidth": sized(0.6)})
    both = (("x", BLUE, vibration.x), ("y", RED, vibration.y))
    for (name, colour, own), look in zip(both, looks, strict=True):
        if len(own.frequency):
            axes.loglog(own.frequency[1:], own.power[1:], color=colour, label=name, **look)
            top = max(top, float(own.power[1:].max()))
    if top > 0:
        axes.set_ylim(FAINTEST * top, 3 * top)
        axes.legend(loc="best")
    axes.set_xlabel("frequency (Hz)")
    axes.set_ylabel(
        "off its ideal place\n(m$^2$/Hz)" if vibration.off_ideal else "power (m$^2$/Hz)"
    )


@styled
def bifurcation(found: Branches, *, axis: str = "y", style: Style = SCREEN) -> Figure:
    """Place of a point once a lap, over the value that is varied; `axis` is x or y."""
    values, places = found.points
    point = found.sections[0].point if found.sections else ""
    reasons = (("failed", found.failed), ("doubtful", found.doubtful))
    notes = [f"{len(which)} {how}" for how, which in reasons if which]
    title = f"{axis} of {point} once a lap"
    figure = framed_figure((title, f"over {found.path}"), 4.0, style, notes=notes)
    axes = figure.subplots()
    axes.plot(values, 1e3 * places[:, "xy".index(axis)], ".", color=BLUE, markersize=sized(3))
    axes.set_xlabel(f"{found.path} (SI)")
    axes.set_ylabel(f"{axis} of {point} (mm)")
    return figure
