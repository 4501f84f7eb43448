"""Figures of motion: the watched point by lap and in polar form, and struck bodies by strike."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes
from matplotlib.ticker import FixedLocator, MaxNLocator, MultipleLocator, NullLocator
from scipy.interpolate import make_interp_spline

from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.observables import (
    ANGLE,
    LeverResponse,
    Strike,
    crank_angle,
    laps,
    lever_response,
    path,
    sleeves_with_play,
    strikes,
    struck_bodies,
    turned_since_start,
    turns,
    watched_point,
)
from exudyn_flexlink.plots.drawing import SYMBOL, UP, Labels
from exudyn_flexlink.plots.forces import strip, strip_height, within
from exudyn_flexlink.plots.frame import (
    BLACK,
    BLUE,
    FLAT,
    GREEN,
    GREY,
    ORANGE,
    OTHERS,
    PURPLE,
    SCREEN,
    SKY,
    Style,
    error_text,
    new_figure,
    settle,
    styled,
)
from exudyn_flexlink.plots.panels import (
    BAND,
    BEYOND_LINE,
    Given,
    engine_colour,
    forward,
    horizon,
    is_beyond,
    legend_outside,
    length_unit,
    letter,
    number_text,
    placed,
    position_error,
    shade_beyond,
    shown_in,
    sized,
)
from exudyn_flexlink.result import Result
from exudyn_flexlink.stability import laps_of_cycle

X_COLOURS = (BLUE, GREEN, SKY, BLACK)
Y_COLOURS = ("#8C1C13", "#E8704A", "#F2A541", PURPLE)

OFF = -0.1  # of a polar plot's width: place of its radial scale
NESTED = 4  # most laps that are drawn each thinner than the one before, each with its own name
STEP = 0.8  # line widths: difference in width of two such laps


@styled
def coordinates(
    result: Result, point: str | None = None, *, style: Style = SCREEN, ax: Given = None
) -> Figure | None:
    """Draw both coordinates of a point (default: the watched point) lap by lap (paper, Fig. 3).

    The abscissa is the crank angle within each lap. It is time if no crank goes round without going
    back. None if the run has only one sample.

    Raises:
        ValueError: the scene has no such point.

    """
    if len(result.time) < 2:
        return None
    point = point or watched_point(result.scene)
    strips = sleeves_with_play(result)
    heights = [4.0, *(strip_height(result) for _ in strips)]
    touching = {within(result, joint).split()[0] for joint in strips}
    below_it = f"; below, how the {' and the '.join(sorted(touching))} touches its guide"
    subject = f"Coordinates of {point}{below_it if strips else ''}"
    names = ["coordinates", *(within(result, joint) for joint in strips)]
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
    """Draw places (N, 2), in the unit of the figure, over the crank angle within each lap."""
    cycle, laps = laps_of_cycle(result.scene), list(by_lap(result))
    shade_laps(axes, result, [lap.turned for lap in laps], laps, position)
    for i, (name, colours) in enumerate((("$x$, ", X_COLOURS), ("$y$, ", Y_COLOURS))):
        for lap in laps:
            look = lap_look(lap.number, cycle, laps[-1].number, colours, name)
            axes.plot(lap.turned, position[lap.samples, i], **look)
    _mark_strikes(axes, result, position)
    largest = max(float(np.max(lap.turned)) for lap in laps)
    axes.set_xlim(0.0, largest or 2 * np.pi)  # 2 pi for a crank that does not move
    axes.xaxis.set_major_locator(MultipleLocator(np.pi / 4 if largest > np.pi else np.pi / 12))
    axes.xaxis.set_major_formatter(lambda x, _: f"{np.degrees(x):.0f}")
    axes.set_xlabel("crank angle within each lap (degrees)")


def _mark_strikes(axes: Axes, result: Result, position: FloatArray) -> None:
    """Mark the first touch of every strike on the lines of places (N, 2)."""
    all_strikes = [strike for name in result.scene.all_contacts for strike in strikes(result, name)]
    begins = [strike.begin for strike in all_strikes]
    before = 2 * np.pi * np.array([(strike.lap or 1) - 1 for strike in all_strikes])
    x = np.interp(begins, result.time, turned_since_start(result)) - before
    for series, label in zip(position.T, ("first contact", None), strict=True):
        y = np.interp(begins, result.time, series)
        axes.plot(x, y, "o", color=BLACK, markersize=sized(5), mfc="white", zorder=5,
                  label=label if all_strikes else None)  # fmt: skip


@styled
def polar(result: Result, *, style: Style = SCREEN, ax: Given = None) -> Figure | None:
    """Draw the watched point's distance from the origin O over the crank angle (paper, Fig. 5).

    None if no crank goes round: a swinging angle suits no polar plot. Axes of the user keep their
    radial scale.

    Raises:
        ValueError: axes of the user are not polar.

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
    angle, laps = crank_angle(result), list(by_lap(result))
    places = [angle[lap.samples] for lap in laps]
    shade_laps(axes, result, places, laps, radius[:, None])
    cycle, last = laps_of_cycle(result.scene), laps[-1].number
    for place, lap in zip(places, laps, strict=True):
        axes.plot(place, radius[lap.samples], **lap_look(lap.number, cycle, last))


def radial_scale(axes: PolarAxes, radius: FloatArray, label: str) -> None:
    """Set the circles of a polar plot for these radii; a scale at the left gives their size.

    Most of a radius is equal at all angles, so the scale gives most room to the differences. If
    all radii are equal but for rounding, the scale begins at 0.
    """
    low, high = float(np.min(radius)), float(np.max(radius))
    if high - low <= FLAT * high:
        low, high = 0.0, high * (1 - FLAT)  # a circle of 300 mm shall not depend on rounding
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
    inner = 0.5 * (start - middle) / (end - middle)  # the hole's radius over the circle's width
    scale = axes.inset_axes((OFF, 0.5 + inner, 1e-3, 0.5 - inner), projection="rectilinear")
    scale.set_ylim(start, end)
    scale.yaxis.set_major_locator(FixedLocator(shown))
    scale.xaxis.set_major_locator(NullLocator())
    scale.set_ylabel(label)
    scale.grid(visible=False)
    if start > 0:
        about = f"the scale begins\nat {start:g}, not at zero"
        axes.text(0.5, 0.5, about, transform=axes.transAxes, ha="center", va="center", color=GREY,
                  fontsize=mpl.rcParams["legend.fontsize"])  # fmt: skip


@dataclass(frozen=True)
class Lap:
    """One lap: its number, the crank angle (rad) since its begin, the indices of its samples."""

    number: int
    turned: FloatArray
    samples: IndexArray


def by_lap(result: Result) -> Iterator[Lap]:
    """Split a run into laps; each lap but the last includes the first sample of the next."""
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
    """Return the look of a lap out of `last`; laps on one curve of the `cycle` have one colour.

    A few laps are nested: each is broader and paler than later ones, so that laps on one curve are
    all visible. Of many laps only those of the first cycle are nested; later ones are thin lines.
    Laps of one colour share one entry of the legend; of many laps, those of the first cycle have
    another.
    """
    rank, label = last - number, f"{name}lap {number}"
    if last <= NESTED:
        same_curve = range(number, last + 1, cycle)
        label = f"{name}laps {', '.join(map(str, same_curve))}" if len(same_curve) > 1 else label
        label = label if number <= cycle else ""
    else:
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
    axes: Axes, result: Result, x: Sequence[FloatArray], laps: Sequence[Lap], series: FloatArray
) -> None:
    """Shade the part of each lap's line that lies beyond the horizon.

    `x` has the abscissas of each lap's samples, `series` (N, k) the values of the whole run.
    """
    extent = horizon(result)
    if extent is None:
        return
    begin, label = extent
    for place, lap in zip(x, laps, strict=True):
        beyond = result.time[lap.samples] >= begin
        for values in series[lap.samples].T if beyond.any() else ():
            axes.plot(place[beyond], values[beyond], label=label or None, linewidth=sized(BAND),
                      **BEYOND_LINE)  # fmt: skip
            label = ""


Function = Callable[[Any], FloatArray]

STRIKES_SHOWN = len(OTHERS)
SHOWN_BEFORE, SHOWN_AFTER = 0.005, 0.15  # s: time shown before and after the first touch
_interpolated = partial(make_interp_spline, k=1)
"""Piecewise linear function; straight beyond its ends, because matplotlib evaluates it there."""
ANGLE_DECIMALS = 12  # decimals (rad): angles that are equal in these count as one


@styled
def lever(result: Result, *, style: Style = SCREEN, ax: Given = None) -> Figure | None:
    """Draw angle or displacement of every struck body that moves over time, and below by strike.

    None if no struck body moves.
    """
    struck = struck_bodies(result.scene).items() if len(result.time) > 1 else ()
    responses = {contact: lever_response(result, contact) for _, contact in struck}
    moving = {contact: response for contact, response in responses.items() if response.moves}
    if not moving:
        return None
    draw, names = list[Callable[[Axes], None]](), list[str]()
    peaks = dict[int, tuple[LeverResponse, list[Strike]]]()
    for contact, response in moving.items():
        body, all_strikes = response.body, strikes(result, contact)
        peaks[len(draw)] = response, all_strikes
        what: dict[str, Any] = {
            "result": result,
            "response": response,
            "all_strikes": all_strikes,
        }
        draw.append(partial(_whole_run, **what, style=style))
        names.append(body)
        if all_strikes:
            draw.append(partial(_strike_by_strike, **what))
            names.append(f"{body}, strike by strike")
    bodies = ", ".join(response.body for response in moving.values())
    subject, height = f"Response of {bodies}", 2.9 * len(names)
    figure, panels = placed(ax, names, lambda: new_figure(result, subject, height, style))
    for axes, panel in zip(panels, draw, strict=False):
        panel(axes)
    letter(panels)
    if ax is None:
        settle(panels[0].figure.figure)  # the layout must be final before numbers are placed
    for i, axes in enumerate(panels):
        if i in peaks:
            _annotate_peaks(axes, result, *peaks[i])
    return figure


def _whole_run(
    axes: Axes, result: Result, response: LeverResponse, all_strikes: list[Strike], style: Style
) -> None:
    shade_beyond(axes, result, result.time)
    factor, ylabel = _scale(response)
    values = factor * response.value
    axes.plot(response.time, values, color=engine_colour(result), linewidth=1.1)
    for i, strike in enumerate(all_strikes):
        span, mark = ("in contact", "first contact") if i == 0 else (None, None)
        axes.axvspan(strike.begin, strike.end, color=ORANGE, alpha=0.6, linewidth=0, label=span)
        value = float(np.interp(strike.begin, response.time, values))
        axes.plot(strike.begin, value, "v", color=BLACK, markersize=sized(6), label=mark, zorder=5)
    _mark_impacts(axes, result, response.body)
    axes.set_xlim(response.time[0], response.time[-1])
    axes.margins(y=0.2 / style.scale)  # room for the numbers at the peaks
    axes.set_ylabel(ylabel)
    axes.set_xlabel("time (s)")
    second = bool(axes.child_axes)  # axes of the user that already have a run
    if not style.narrow and not second:  # in a narrow figure the legend is above the axes
        _turns_on_top(axes, result)
    has_scale = not second and _tip_scale(axes, response)
    legend_outside(axes, 1.13 if has_scale else 1.01)


def _scale(response: LeverResponse) -> tuple[float, str]:
    """Return the factor from the value's unit to the unit of the figure, and the axis label."""
    factor, unit = shown_in(response.measure.unit, response.value)
    return factor, f"{response.measure.word} of {response.body} ({unit})"


def _mark_impacts(axes: Axes, result: Result, body: str) -> None:
    """Mark every impact by a tick at the lower edge, because an impulse has no duration."""
    contacts = [n for n, c in result.scene.all_contacts.items() if c.struck == body]
    hits = [
        interval.begin
        for n in contacts
        for interval in result.contacts[n].touches
        if interval.impact
    ]
    if hits:
        ground = axes.get_xaxis_transform()
        axes.plot(hits, [0.03] * len(hits), "|", color=BLACK, markersize=sized(8),
                  transform=ground, label="impacts")  # fmt: skip


def _annotate_peaks(
    axes: Axes, result: Result, response: LeverResponse, all_strikes: list[Strike]
) -> None:
    """Write both extremes beside them, away from the line and from marks in the axes.

    If the error leaves few digits, the text has one more digit, and the error.
    """
    if not np.any(response.value):
        return
    scale, shown = shown_in(response.measure.unit, response.value)
    factor, unit = length_unit(response.tip_displacement)
    tip_functions = _tip_of_angle(response)
    line = np.stack([response.time, scale * response.value], axis=1)
    low, high = axes.get_ylim()
    marked = [edge for strike in all_strikes for edge in (strike.begin, strike.end)]
    marked += [result.error.exceeds_from] if result.error.exceeds_from is not None else []
    edges = [np.array([(edge, low), (edge, high)]) for edge in marked]
    labels = Labels(axes, [line, *edges])
    for (value, time), away in ((response.least, -UP), (response.greatest, UP)):
        place = np.array([time, scale * value])
        axes.plot(*place, ".", color=BLACK, markersize=sized(5))
        labels.keep_free(place[None], sized(SYMBOL))
        off = position_error(result, time)
        error = None if off is None else _error_of(response, off)
        if error is not None and 0 < abs(value) <= error:
            continue  # its error leaves no digit
        text = number_text(scale * value, error and scale * error, signed=True)
        more = number_text(scale * value, error and scale * error / 10, signed=True)
        if error is not None and more != text:
            text = f"{more} \N{PLUS-MINUS SIGN} {error_text(scale * error)}"
        text += f" {shown}"
        if tip_functions:
            moved = number_text(
                factor * float(tip_functions[0](value)), off and factor * off, signed=True
            )
            text += f" ({moved} {unit})"
        labels.write(
            text,
            place,
            away,
            fontsize=mpl.rcParams["legend.fontsize"],
            bbox={"fc": axes.get_facecolor(), "edgecolor": "none", "alpha": 0.85, "pad": 0.3},
        )


def _error_of(response: LeverResponse, off: float) -> float | None:
    """Return the error of the value for an error `off` (m) of places; None if the tip rests."""
    if response.measure is not ANGLE:
        return off
    arm = float(np.max(np.abs(response.tip_displacement)) / np.max(np.abs(response.value)))
    return off / arm if arm > 0 else None


def _turns_on_top(axes: Axes, result: Result) -> None:
    """Add the crank's turns above the axes, if the crank only goes forward."""
    if not turns(result):
        return
    made = turned_since_start(result) / (2 * np.pi)
    if np.any(np.diff(made) <= 0) or np.any(np.diff(result.time) <= 0):
        return
    functions = (_interpolated(result.time, made), _interpolated(made, result.time))
    top = axes.secondary_xaxis("top", functions=functions)
    top.set_xlabel("turns of the crank")


def _tip_of_angle(response: LeverResponse) -> tuple[Function, Function] | None:
    """Return the tip displacement (m) as a function of the angle, and the inverse function.

    None if the displacement does not depend on an angle, or is equal at two angles, as of a wheel.
    """
    if response.measure is not ANGLE:
        return None
    angle, first = np.unique(np.round(response.value, ANGLE_DECIMALS), return_index=True)
    tip = response.tip_displacement[first]
    if len(tip) < 2 or not (np.all(np.diff(tip) > 0) or np.all(np.diff(tip) < 0)):
        return None
    order = np.argsort(tip)
    return _interpolated(angle, tip), _interpolated(tip[order], angle[order])


def _tip_scale(axes: Axes, response: LeverResponse) -> bool:
    """Add a second scale with the tip's displacement; return False if this is impossible."""
    scale = _tip_of_angle(response)
    if scale is None:
        return False
    forward, backward = scale
    factor, unit = length_unit(response.tip_displacement)
    both = (lambda x: factor * forward(x), lambda y: backward(y / factor))
    right = axes.secondary_yaxis("right", functions=both)
    right.set_ylabel(f"tip displacement ({unit})")
    return True


def _strike_by_strike(
    axes: Axes, result: Result, response: LeverResponse, all_strikes: list[Strike]
) -> None:
    """Draw the first strikes in one panel; time counts from the first touch of each."""
    factor, ylabel = _scale(response)
    thin = float(mpl.rcParams["lines.linewidth"])
    count = min(len(all_strikes), STRIKES_SHOWN)
    for i, strike in enumerate(all_strikes[:STRIKES_SHOWN]):
        following = all_strikes[i + 1].begin if i + 1 < len(all_strikes) else np.inf
        until = min(strike.begin + SHOWN_AFTER, following)
        shown = max(strike.begin - SHOWN_BEFORE, response.time[0]), min(until, response.time[-1])
        time = np.linspace(*shown, 1000)
        since, colour = 1e3 * (time - strike.begin), OTHERS[i]
        label = f"strike {i + 1}" + ("" if strike.lap is None else f" (lap {strike.lap})")
        if is_beyond(result, strike.begin):
            label += ",\nbeyond the horizon"
        # Equal strikes hide each other, so earlier ones are broader.
        alpha = 1.0 if i == count - 1 else 0.6
        axes.plot(since, factor * response.at(time).value, color=colour, label=label, alpha=alpha,
                  linewidth=thin * (count - i))  # fmt: skip
        held = 1e3 * (strike.end - strike.begin)
        axes.axvspan(0, held, color=colour, alpha=0.08, linewidth=0)
        axes.axvline(held, color=colour, linestyle=":", linewidth=1.0)
    axes.plot([], [], color=GREY, linestyle=":", label="end of contact")
    axes.margins(x=0)
    axes.set_xlabel("time since the first touch of the strike (ms)")
    axes.set_ylabel(ylabel)
    legend_outside(axes)
