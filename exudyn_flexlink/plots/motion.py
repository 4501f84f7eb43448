"""Where the watched point goes: its coordinates over the crank angle, lap by lap, and polar."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes
from matplotlib.ticker import FixedLocator, MaxNLocator, MultipleLocator, NullLocator

from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.observables import (
    crank_angle,
    laps,
    path,
    sleeves_with_play,
    strikes,
    turned_since_start,
    turns,
    watched_point,
)
from exudyn_flexlink.plots.frame import new_figure
from exudyn_flexlink.plots.given import Given, placed
from exudyn_flexlink.plots.panels import (
    BEYOND_LINE,
    forward,
    horizon,
    legend_outside,
    length_unit,
    letter,
    shade_beyond,
    sized,
)
from exudyn_flexlink.plots.sleeve import strip, strip_height
from exudyn_flexlink.plots.style import BLACK, BLUE, GREEN, GREY, PURPLE, SCREEN, SKY, Style, styled
from exudyn_flexlink.result import Result
from exudyn_flexlink.stability import laps_of_cycle

X_COLOURS = (BLUE, GREEN, SKY, BLACK)
Y_COLOURS = ("#8C1C13", "#E8704A", "#F2A541", PURPLE)

FLAT = 1e-6  # of a radius: what differs by less is rounding
OFF = -0.1  # of a polar plot's width: where its radial scale stands
NESTED = 4  # laps, at most, that are drawn each thinner than the one before and named alone
STEP = 0.8  # line widths between two of them
BAND = 11.0  # points, of the shading along a line


@styled
def coordinates(
    result: Result, point: str | None = None, *, style: Style = SCREEN, ax: Given = None
) -> Figure | None:
    """Both coordinates of a point (default: the watched one) lap by lap (paper, Fig. 3).

    Over the crank angle within each lap; over time without a crank that goes round and never back.
    None if there is nothing but one sample.

    Raises:
        ValueError: the scene has no such point.

    """
    if len(result.time) < 2:
        return None
    point = point or watched_point(result.scene)
    strips = sleeves_with_play(result)
    heights = [4.0, *(strip_height(result) for _ in strips)]
    subject = f"Coordinates of {point}" + ("; below, how the link touches its guide" * bool(strips))
    names = ["coordinates", *(f"link in {joint}" for joint in strips)]
    figure, (axes, *below) = placed(
        ax,
        names,
        lambda: new_figure(result, subject, 0.4 + sum(heights), style),
        sharex=True,
        height_ratios=heights,
    )
    position = path(result, point).position
    factor, unit = length_unit(position)
    if forward(result):
        _coordinates_by_lap(axes, result, factor * position)
    else:
        shade_beyond(axes, result, result.time)
        for i, (name, colour) in enumerate((("x", BLUE), ("y", Y_COLOURS[0]))):
            axes.plot(result.time, factor * position[:, i], color=colour, label=f"${name}$")
        axes.set_xlim(result.time[0], result.time[-1])
        axes.set_xlabel("time (s)")
    axes.set_ylabel(f"coordinates of {point} ({unit})")
    axes.axhline(0, color=GREY, linewidth=0.8)
    legend_outside(axes)
    for lower, joint in zip(below, strips, strict=False):
        strip(lower, result, joint)
        lower.set_xlabel(axes.get_xlabel())
    if below:
        axes.set_xlabel("")
    letter([axes, *below])
    return figure


def _coordinates_by_lap(axes: Axes, result: Result, position: FloatArray) -> None:
    """Draw places (N, 2), in the unit that is shown, over the crank angle within each lap."""
    cycle, every = laps_of_cycle(result.scene), list(by_lap(result))
    shade_laps(axes, result, [lap.turned for lap in every], every, position)
    for i, (name, colours) in enumerate((("$x$, ", X_COLOURS), ("$y$, ", Y_COLOURS))):
        for lap in every:
            look = lap_look(lap.number, cycle, every[-1].number, colours, name)
            axes.plot(lap.turned, position[lap.samples, i], **look)
    _mark_strikes(axes, result, position)
    largest = max(float(np.max(lap.turned)) for lap in every)
    axes.set_xlim(0.0, largest or 2 * np.pi)  # a crank that stands still
    axes.xaxis.set_major_locator(MultipleLocator(np.pi / 4 if largest > np.pi else np.pi / 12))
    axes.xaxis.set_major_formatter(lambda x, _: f"{np.degrees(x):.0f}")
    axes.set_xlabel("crank angle within each lap (degrees)")


def _mark_strikes(axes: Axes, result: Result, position: FloatArray) -> None:
    """Mark where the first touch of every strike is on the lines of places (N, 2)."""
    found = [strike for name in result.scene.all_contacts for strike in strikes(result, name)]
    begins = [strike.begin for strike in found]
    before = 2 * np.pi * np.array([(strike.lap or 1) - 1 for strike in found])
    x = np.interp(begins, result.time, turned_since_start(result)) - before
    for series, label in zip(position.T, ("first contact", None), strict=True):
        y = np.interp(begins, result.time, series)
        axes.plot(x, y, "o", color=BLACK, markersize=sized(5), mfc="white", zorder=5,
                  label=label if found else None)  # fmt: skip


@styled
def polar(result: Result, *, style: Style = SCREEN, ax: Given = None) -> Figure | None:
    """Distance of the watched point from the origin O over the crank angle (paper, Fig. 5).

    None without a crank that goes round: an angle that swings says nothing in polar form. Axes that
    are given keep their radial scale.

    Raises:
        ValueError: the axes that are given are not polar.

    """
    if not turns(result) or len(result.time) < 2:
        return None
    point = watched_point(result.scene)
    subject = f"Distance of S, {point}, from O over the crank angle"
    figure, (axes,) = placed(
        ax,
        ["polar"],
        lambda: new_figure(result, subject, 5.6, style),
        subplot_kw={"projection": "polar"},
    )
    if not isinstance(axes, PolarAxes):
        raise ValueError(
            "ax: polar needs polar axes: plt.subplots(subplot_kw={'projection': 'polar'})"
        )
    radius = np.linalg.norm(path(result, point).position, axis=1)
    factor, unit = length_unit(radius)
    draw_radius(axes, result, factor * radius)
    if ax is not None:
        return figure
    radial_scale(axes, factor * radius, f"distance OS ({unit})")
    legend_outside(axes, 1.06, below=True)
    return figure


def draw_radius(axes: PolarAxes, result: Result, radius: FloatArray) -> None:
    """Draw a radius (N,) over the crank angle, lap by lap."""
    angle, every = crank_angle(result), list(by_lap(result))
    places = [angle[lap.samples] for lap in every]
    shade_laps(axes, result, places, every, radius[:, None])
    cycle, last = laps_of_cycle(result.scene), every[-1].number
    for place, lap in zip(places, every, strict=True):
        axes.plot(place, radius[lap.samples], **lap_look(lap.number, cycle, last))


def radial_scale(axes: PolarAxes, radius: FloatArray, label: str) -> None:
    """Set the circles for these radii, and tell their size by a scale off the data, at the left.

    Most of the radius is the same everywhere: what differs gets most of the room. Where nothing
    does but by rounding, the scale begins at 0.
    """
    low, high = float(np.min(radius)), float(np.max(radius))
    if high - low <= FLAT * high:
        low, high = 0.0, high * (1 - FLAT)  # a circle at 300 mm is that of 300.0000001 mm, too
    span = (high - low) or 1.0
    circles = MaxNLocator(5).tick_values(max(0.0, low - 0.1 * span), high)
    start, end = max(0.0, float(circles[0])), high + 0.05 * span
    middle = start - 0.9 * (high - start) if start > 0 else 0.0
    axes.set_rlim(start, end)
    axes.set_rorigin(middle)
    shown = [circle for circle in circles if start <= circle <= end]
    axes.set_rgrids(shown, [""] * len(shown))
    axes.xaxis.set_major_formatter(lambda x, _: f"{np.degrees(x):.0f}")
    axes.set_xlabel("crank angle (degrees)")
    inner = 0.5 * (start - middle) / (end - middle)  # of the circle's width, the hole's radius
    scale = axes.inset_axes((OFF, 0.5 + inner, 1e-3, 0.5 - inner), projection="rectilinear")
    scale.set_ylim(start, end)
    scale.yaxis.set_major_locator(FixedLocator(shown))
    scale.xaxis.set_major_locator(NullLocator())
    scale.set_ylabel(label)
    scale.grid(visible=False)
    if start > 0:
        told = f"the scale begins\nat {start:g}, not at zero"
        axes.text(0.5, 0.5, told, transform=axes.transAxes, ha="center", va="center", color=GREY,
                  fontsize=mpl.rcParams["legend.fontsize"])  # fmt: skip


@dataclass(frozen=True)
class Lap:
    """Samples of one lap: its number, crank angle turned since it began (rad), their indices."""

    number: int
    turned: FloatArray
    samples: IndexArray


def by_lap(result: Result) -> Iterator[Lap]:
    """Split a run into laps; each but the last goes on to the first sample of the next."""
    turned, lap = turned_since_start(result), laps(result)
    for number in range(1, int(lap.max()) + 1):
        samples = np.flatnonzero(lap == number)
        if not len(samples):
            continue
        if samples[-1] + 1 < len(lap):
            samples = np.append(samples, samples[-1] + 1)
        yield Lap(number, turned[samples] - 2 * np.pi * (number - 1), samples)


def lap_look(
    number: int, cycle: int, last: int, colours: Sequence[str] = X_COLOURS, name: str = ""
) -> dict[str, Any]:
    """How a lap of `last` is drawn: laps on one curve of the `cycle` share a colour.

    A few laps are nested, each broader and paler than those after it, so that all are seen where
    they lie on each other. Of many, those of the first cycle are, and later ones are thin lines;
    those alike have one entry in the legend.
    """
    rank, label = last - number, f"{name}lap {number}"
    if last > NESTED:
        rank = 1 + cycle - number if number <= cycle else 0
        alike = range(number, last + 1, cycle)
        if number > 2 * cycle:
            label = ""
        elif number > cycle and len(alike) > 1:
            label = f"{name}laps {alike[0]} to {alike[-1]}"
    rank = min(rank, NESTED)
    return {
        "label": label or None,
        "color": colours[(number - 1) % cycle % len(colours)],
        "linewidth": float(mpl.rcParams["lines.linewidth"]) * (0.7 + STEP * rank),
        "alpha": 0.45 if rank else 1.0,
        "zorder": 3 - rank / 9,
    }


def shade_laps(
    axes: Axes, result: Result, x: Sequence[FloatArray], every: Sequence[Lap], series: FloatArray
) -> None:
    """Shade, along the lines of laps, what lies beyond the horizon.

    `x` holds the places of each lap's samples, `series` (N, k) the values of the whole run.
    """
    found = horizon(result)
    if found is None:
        return
    begin, label = found
    for place, lap in zip(x, every, strict=True):
        beyond = result.time[lap.samples] >= begin
        for values in series[lap.samples].T if beyond.any() else ():
            axes.plot(place[beyond], values[beyond], label=label or None, linewidth=sized(BAND),
                      **BEYOND_LINE)  # fmt: skip
            label = ""
