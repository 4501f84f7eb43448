"""Where the watched point goes: its coordinates over the crank angle, lap by lap, and polar."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from exudyn_flexlink.observables import (
    crank_angle,
    laps,
    path,
    sleeves_with_play,
    strikes,
    turns,
    watched_point,
)
from exudyn_flexlink.plots.frame import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    PURPLE,
    SKY,
    cycle_of,
    legend_outside,
    length_unit,
    new_figure,
    styled,
    subscripted,
    ticks_in_degrees,
)
from exudyn_flexlink.plots.sleeve import strip, strip_height
from exudyn_flexlink.result import Result

FloatArray = NDArray[np.float64]

X_COLOURS = (BLUE, GREEN, SKY, BLACK)
Y_COLOURS = ("#8C1C13", "#E8704A", "#F2A541", PURPLE)
_LINES = ("-", "--", ":", "-.")
NAMED_LAPS = 6  # more laps than this share their legend entries


@dataclass(frozen=True)
class _Lap:
    """Samples of one lap: its number, crank angle turned since it began (rad), their indices."""

    number: int
    turned: FloatArray
    samples: NDArray[np.intp]


@styled
def coordinates(result: Result, point: str | None = None) -> Figure | None:
    """Both coordinates of a point (default: the watched one) lap by lap (paper, Fig. 3).

    Over the crank angle within each lap; without a crank that goes round over time. None if there
    is nothing but one sample.

    Raises:
        ValueError: the scene has no such point.

    """
    if len(result.time) < 2:
        return None
    point = point or watched_point(result.scene)
    strips = sleeves_with_play(result)
    heights = [4.0, *(strip_height(result) for _ in strips)]
    subject = f"Coordinates of {point}" + ("; below, how the link touches its guide" * bool(strips))
    figure = new_figure(result, subject, 0.4 + sum(heights))
    axes, *below = figure.subplots(
        len(heights), 1, sharex=True, squeeze=False, height_ratios=heights
    )[:, 0]
    position = path(result, point).position
    factor, unit = length_unit(float(np.max(np.abs(position))))
    if turns(result):
        _coordinates_by_lap(axes, result, factor * position, point)
    else:
        for i, (name, colour) in enumerate((("x", BLUE), ("y", Y_COLOURS[0]))):
            axes.plot(result.time, factor * position[:, i], color=colour, label=f"${name}$")
        axes.set_xlim(result.time[0], result.time[-1])
        axes.set_xlabel("time (s)")
    axes.set_ylabel(f"coordinates of {point} ({unit})")
    axes.axhline(0, color=GREY, linewidth=0.8)
    legend_outside(axes)
    for lower, joint in zip(below, strips, strict=True):
        strip(lower, result, joint)
        lower.set_xlabel(axes.get_xlabel())
    if below:
        axes.set_xlabel("")
    return figure


def _coordinates_by_lap(axes: Axes, result: Result, position: FloatArray, point: str) -> None:
    cycle = cycle_of(result.scene)
    every = list(_by_lap(result))
    for i, (name, colours) in enumerate((("x", X_COLOURS), ("y", Y_COLOURS))):
        for lap in every:
            style = _lap_style(lap.number, cycle, colours)
            label = _lap_label(lap.number, cycle, every[-1].number)
            label = f"{subscripted(point, name)}, {label}" if label else ""
            axes.plot(lap.turned, position[lap.samples, i], label=label or None, **style)
    _mark_strikes(axes, result, position)
    ticks_in_degrees(axes, max(float(np.max(lap.turned)) for lap in every))
    axes.set_xlabel("crank angle within each lap (degrees)")


def _mark_strikes(axes: Axes, result: Result, position: FloatArray) -> None:
    angle = crank_angle(result)
    first = True
    for name in result.scene.contacts:
        for strike in strikes(result, name):
            turned = abs(float(np.interp(strike.begin, result.time, angle - angle[0])))
            x = turned - 2 * np.pi * (strike.lap - 1)
            for series in position.T:
                y = float(np.interp(strike.begin, result.time, series))
                label = "first contact of a strike" if first else None
                axes.plot(x, y, "o", color=BLACK, markersize=5, mfc="white", label=label, zorder=5)
                first = False


@styled
def polar(result: Result) -> Figure | None:
    """Distance of the watched point from the origin O over the crank angle (paper, Fig. 5).

    None without a crank that goes round: an angle that swings says nothing in polar form.
    """
    if not turns(result) or len(result.time) < 2:
        return None
    point = watched_point(result.scene)
    radius = np.linalg.norm(path(result, point).position, axis=1)
    factor, unit = length_unit(float(np.max(radius)))
    low, high = factor * float(np.min(radius)), factor * float(np.max(radius))
    span = (high - low) or 0.1 * high
    circles = MaxNLocator(5).tick_values(max(0.0, low - 0.1 * span), high)
    start = max(0.0, circles[0])
    subject = f"Distance of {point} from O ({unit}) over the crank angle; "
    subject += f"the inner circle is {start:.4g} {unit}"
    figure = new_figure(result, subject, 5.6)
    axes = figure.subplots(subplot_kw={"projection": "polar"})
    assert isinstance(axes, PolarAxes)
    angle, cycle = crank_angle(result), cycle_of(result.scene)
    every = list(_by_lap(result))
    for lap in every:
        style = _lap_style(lap.number, cycle, X_COLOURS)
        label = _lap_label(lap.number, cycle, every[-1].number)
        axes.plot(angle[lap.samples], factor * radius[lap.samples], label=label or None, **style)
    # Most of the radius is the same everywhere: what differs gets most of the room.
    shown = [circle for circle in circles if start < circle <= high + 0.01 * span]
    axes.set_rlim(start, high + 0.05 * span)
    axes.set_rorigin(start - 0.9 * (high - start) if start > 0 else 0.0)
    axes.set_rgrids(shown, [f"{circle:.4g} {unit}" for circle in shown], angle=67.5, fontsize=9)
    for text in axes.yaxis.get_ticklabels():
        text.set_bbox({"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0})
    axes.set_xlabel("crank angle (degrees)")
    legend_outside(axes, 1.12)
    return figure


def _by_lap(result: Result) -> Iterator[_Lap]:
    """Split a run into laps; each but the last goes on to the first sample of the next."""
    angle, lap = crank_angle(result), laps(result)
    turned = np.abs(angle - angle[0])
    for number in range(1, int(lap.max()) + 1):
        samples = np.flatnonzero(lap == number)
        if not len(samples):
            continue
        if samples[-1] + 1 < len(lap):
            samples = np.append(samples, samples[-1] + 1)
        yield _Lap(number, turned[samples] - 2 * np.pi * (number - 1), samples)


def _lap_style(number: int, cycle: int, colours: tuple[str, ...]) -> dict[str, Any]:
    """Laps on one curve share a colour; the first is a broad band on which later ones are seen."""
    style: dict[str, Any] = {"color": colours[(number - 1) % cycle % len(colours)]}
    if number <= cycle:
        return style | {"linewidth": 3.6, "alpha": 0.4, "zorder": 2}
    again = (number - 1) // cycle - 1
    return style | {"linewidth": 1.1, "zorder": 3, "linestyle": _LINES[again % len(_LINES)]}


def _lap_label(number: int, cycle: int, last: int) -> str:
    """Legend entry of a lap; of many laps those alike have one together."""
    if last <= NAMED_LAPS or number <= cycle:
        return f"lap {number}"
    alike = list(range(number, last + 1, cycle))
    if number > 2 * cycle:
        return ""
    return f"laps {alike[0]} to {alike[-1]}" if len(alike) > 1 else f"lap {number}"
