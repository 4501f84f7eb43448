"""Error over processor time, every method of a study on one plot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import log10
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from exudyn_flexlink.accuracy import Error, Errors, Method, Point, Source, Study
from exudyn_flexlink.plots.frame import Words, framed_figure, links_of
from exudyn_flexlink.plots.panels import legend_outside, letter
from exudyn_flexlink.plots.style import (
    BLACK,
    ENGINE_COLOURS,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SCREEN,
    Style,
    styled,
)

MARKERS = {"minimal": "o", "redundant": "s", "beam": "D", "fixed step": "^", "": "o"}
LINES = {"minimal": "-", "redundant": "--", "beam": ":", "fixed step": "-.", "": "-"}
_OF_SOURCES = {"rods": (GREEN, "error of the rods"), "contact": (PURPLE, "contact compliance")}
LOWEST = 1e-16  # m: nothing is drawn below it,
DEEPEST = 1e-3  # nor below this part of the floor
FEW_DECADES = 2.0  # of the axis of time: then more than powers of ten are labelled


@dataclass(frozen=True)
class Part:
    """What one pair of axes shows: errors of a point, which are told down to `floor` (m)."""

    name: str
    of: Callable[[Errors], Error | None]
    floor: float

    def largest(self, errors: Errors) -> float:
        """Largest error, m, that can be drawn on a log axis."""
        error = self.of(errors)
        return max(error.largest if error is not None else 0.0, LOWEST)

    def height(self, point: Point) -> float:
        """Where a point is drawn, m: far below the floor there is nothing to see."""
        return max(self.largest(point.errors), DEEPEST * self.floor)


@styled
def work_precision(study: Study, *, style: Style = SCREEN) -> Figure:
    """Largest errors of the watched point, and of the tips below, over processor time, log-log.

    Points below the floor, to which the two references agree, are hollow: nothing independent tells
    them. Lines across mark the target and the errors that no setting removes.
    """
    parts = [Part(study.point, lambda errors: errors.point, study.floor)]
    if study.tips:
        parts.append(Part(" and ".join(study.tips), lambda errors: errors.tip, study.tip_floor))
    height = 3.6 * len(parts) + 0.4
    words = Words(study.scene.title, _subject(study), [], _caption(study))
    figure = framed_figure(words, height, style)
    rows = figure.subplots(len(parts), 1, sharex=True, squeeze=False)[:, 0]
    for axes, part in zip(rows, parts, strict=True):
        axes.set_xscale("log")
        axes.set_yscale("log")
        _draw(axes, study, part)
        axes.set_ylabel(f"largest error of {part.name} (m)")
    legend_outside(rows[0])
    rows[-1].set_xlabel("processor time of the solve (s)")
    _label_times(rows[-1])
    letter(rows)
    return figure


def _label_times(axes: Axes) -> None:
    low, high = axes.get_xlim()
    subs = (1.0, 2.0, 5.0) if log10(high / low) < FEW_DECADES else (1.0,)
    axes.xaxis.set_major_locator(LogLocator(subs=subs))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())


def _subject(study: Study) -> str:
    return f"What accuracy costs: error over processor time, to t = {study.until:.4g} s"


def _caption(study: Study) -> list[tuple[str, str]]:
    told = [(f"errors against {study.reference}", GREY)]
    if study.check:
        told.append((f"floor: its distance from {study.check}", GREY))
    links = "; ".join(links_of(study.scene))
    return [*([(links, GREY)] if links else []), *told]


def _draw(axes: Axes, study: Study, part: Part) -> None:
    for method in dict.fromkeys(point.method for point in study.points):
        points = [point for point in study.points if point.method == method]
        _curve(axes, method, sorted(points, key=lambda p: -p.value), part)
    for source in study.sources:
        _level(axes, source, part)
    label = f"target asked for, {study.target:.2g} m"
    axes.axhline(study.target, color=BLACK, linewidth=0.8, linestyle=(0, (1, 2)), label=label)
    low, high = axes.get_ylim()
    if part.floor > 0:
        low = min(low, part.floor / 3)
        told = "below the floor: the\nreferences differ by as much"
        axes.axhspan(low, part.floor, color=GREY, alpha=0.15, linewidth=0, label=told)
    if study.own is not None:
        place = (study.own.processor, part.height(study.own))
        axes.plot(*place, "o", color=ORANGE, markersize=11, markerfacecolor="none",
                  markeredgewidth=1.6, label="the model's own settings")  # fmt: skip
    axes.set_ylim(low, high)


def _curve(axes: Axes, method: Method, points: Sequence[Point], part: Part) -> None:
    kind, style = _style(method)
    colour = ENGINE_COLOURS.get(method.engine, BLACK)
    seen = [(point.processor, part.height(point)) for point in points]
    axes.plot(*zip(*seen, strict=True), color=colour, label=method.name, **style)
    for x, y in seen:
        face = "white" if y < part.floor else colour
        axes.plot([x], [y], MARKERS[kind], color=colour, markerfacecolor=face, markersize=5)


def _style(method: Method) -> tuple[str, dict[str, Any]]:
    kind = "fixed step" if method.knob == "step" else str(method.settings.get("formulation", ""))
    kind = kind if kind in MARKERS else ""
    return kind, {"linestyle": LINES[kind], "marker": MARKERS[kind], "markersize": 5}


def _level(axes: Axes, source: Source, part: Part) -> None:
    if source.kind in _OF_SOURCES and part.largest(source.errors) > LOWEST:
        colour, name = _OF_SOURCES[source.kind]
        level = part.largest(source.errors)
        axes.axhline(level, color=colour, linestyle=(0, (6, 3)), linewidth=1.0, label=name)
