"""How struck bodies answer: over the whole run, and strike by strike."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.interpolate import make_interp_spline

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.observables import (
    ANGLE,
    LeverResponse,
    Strike,
    lever_response,
    strikes,
    struck_bodies,
    turned_since_start,
    turns,
)
from exudyn_flexlink.plots.frame import new_figure
from exudyn_flexlink.plots.given import Given, placed
from exudyn_flexlink.plots.panels import (
    engine_colour,
    is_beyond,
    legend_outside,
    length_unit,
    letter,
    position_error,
    shade_beyond,
    shown_in,
    sized,
    told,
)
from exudyn_flexlink.plots.style import BLACK, GREY, ORANGE, OTHERS, SCREEN, Style, styled
from exudyn_flexlink.result import Result

Function = Callable[[Any], FloatArray]

STRIKES_SHOWN = len(OTHERS)
SHOWN_BEFORE, SHOWN_AFTER = 0.005, 0.15  # s before and after the first touch
_interpolated = partial(make_interp_spline, k=1)
"""Piecewise linear function, going on straight beyond its ends as matplotlib needs."""
ROUNDED = 12  # decimals of angles (rad) that tell one from another


@styled
def lever(result: Result, *, style: Style = SCREEN, ax: Given = None) -> Figure | None:
    """Angle or displacement of every struck body over time; below, strike by strike.

    None if the scene has no contact.
    """
    bodies = struck_bodies(result.scene)
    if not bodies or len(result.time) < 2:
        return None
    draw, names = list[Callable[[Axes], None]](), list[str]()
    for body, contact in bodies.items():
        response, found = lever_response(result, contact), strikes(result, contact)
        own: dict[str, Any] = {"result": result, "response": response, "found": found}
        draw.append(partial(_whole_run, **own, style=style))
        names.append(body)
        if found:
            draw.append(partial(_strike_by_strike, **own))
            names.append(f"{body}, strike by strike")
    subject, height = "Response of " + ", ".join(bodies), 2.9 * len(names)
    figure, panels = placed(ax, names, lambda: new_figure(result, subject, height, style))
    for axes, panel in zip(panels, draw, strict=False):
        panel(axes)
    letter(panels)
    return figure


def _whole_run(
    axes: Axes, result: Result, response: LeverResponse, found: list[Strike], style: Style
) -> None:
    shade_beyond(axes, result, result.time)
    factor, ylabel = _scale(response)
    values = factor * response.value
    axes.plot(response.time, values, color=engine_colour(result), linewidth=1.1)
    for i, strike in enumerate(found):
        span, mark = ("in contact", "first contact") if i == 0 else (None, None)
        axes.axvspan(strike.begin, strike.end, color=ORANGE, alpha=0.6, linewidth=0, label=span)
        at = float(np.interp(strike.begin, response.time, values))
        axes.plot(strike.begin, at, "v", color=BLACK, markersize=sized(6), label=mark, zorder=5)
    _mark_impacts(axes, result, response.body)
    axes.set_xlim(response.time[0], response.time[-1])
    axes.margins(y=0.2 / style.scale)  # room for the numbers of the peaks
    axes.set_ylabel(ylabel)
    axes.set_xlabel("time (s)")
    _annotate_peaks(axes, result, response)
    second = bool(axes.child_axes)  # of another run, in axes that were given
    if not style.narrow and not second:  # in a narrow figure the legend stands above
        _turns_on_top(axes, result)
    has_scale = not second and _tip_scale(axes, response)
    legend_outside(axes, 1.13 if has_scale else 1.01)


def _scale(response: LeverResponse) -> tuple[float, str]:
    """Factor from the value's unit to that which is shown, and the label of its axis."""
    factor, unit = shown_in(response.measure.unit, response.value)
    return factor, f"{response.measure.word} of {response.body} ({unit})"


def _mark_impacts(axes: Axes, result: Result, body: str) -> None:
    """Tick every impact at the lower edge: impulses have no duration that a span could show."""
    own = [n for n, c in result.scene.all_contacts.items() if c.struck == body]
    hits = [
        interval.begin for n in own for interval in result.contacts[n].touches if interval.impact
    ]
    if hits:
        ground = axes.get_xaxis_transform()
        axes.plot(hits, [0.03] * len(hits), "|", color=BLACK, markersize=sized(8),
                  transform=ground, label="impacts")  # fmt: skip


def _annotate_peaks(axes: Axes, result: Result, response: LeverResponse) -> None:
    if not np.any(response.value):
        return
    scale, shown = shown_in(response.measure.unit, response.value)
    factor, unit = length_unit(response.tip_displacement)
    tip_of = _tip_of_angle(response)
    for value, time in (response.least, response.greatest):
        axes.plot(time, scale * value, ".", color=BLACK, markersize=sized(5))
        off = position_error(result, time)
        error = None if off is None else _error_of(response, off)
        if error is not None and 0 < abs(value) <= error:
            continue  # no digit of it is known
        text = f"{told(scale * value, error and scale * error, signed=True)} {shown}"
        if tip_of:
            moved = told(factor * float(tip_of[0](value)), off and factor * off, signed=True)
            text += f" ({moved} {unit})"
        third, above = int(3 * time / response.time[-1]), value == response.greatest[0]
        axes.annotate(
            text,
            (time, scale * value),
            # Beyond an extreme there is nothing that the text could cover.
            xytext=(0, 4 if above else -4),
            textcoords="offset points",
            # In print a text may be two thirds as wide as the axes, beside which numbers stand.
            ha=("left", "center", "right")[min(third, 2)],
            va="bottom" if above else "top",
            fontsize=mpl.rcParams["legend.fontsize"],
        )


def _error_of(response: LeverResponse, off: float) -> float | None:
    """Error of the value where places are off by `off` (m); None where the tip does not tell."""
    if response.measure is not ANGLE:
        return off
    arm = float(np.max(np.abs(response.tip_displacement)) / np.max(np.abs(response.value)))
    return off / arm if arm > 0 else None


def _turns_on_top(axes: Axes, result: Result) -> None:
    """Add the crank's turns above the axes, where the crank only goes forward."""
    if not turns(result):
        return
    made = turned_since_start(result) / (2 * np.pi)
    if np.any(np.diff(made) <= 0) or np.any(np.diff(result.time) <= 0):
        return
    functions = (_interpolated(result.time, made), _interpolated(made, result.time))
    top = axes.secondary_xaxis("top", functions=functions)
    top.set_xlabel("turns of the crank")


def _tip_of_angle(response: LeverResponse) -> tuple[Function, Function] | None:
    """Tip displacement (m) as a function of the angle, and the other way round.

    None where it does not follow an angle, or has one displacement at two angles, as a wheel has.
    """
    if response.measure is not ANGLE:
        return None
    angle, first = np.unique(np.round(response.value, ROUNDED), return_index=True)
    tip = response.tip_displacement[first]
    if len(tip) < 2 or not (np.all(np.diff(tip) > 0) or np.all(np.diff(tip) < 0)):
        return None
    order = np.argsort(tip)
    return _interpolated(angle, tip), _interpolated(tip[order], angle[order])


def _tip_scale(axes: Axes, response: LeverResponse) -> bool:
    """Add a second scale with the tip's displacement; False where there can be none."""
    found = _tip_of_angle(response)
    if found is None:
        return False
    forward, backward = found
    factor, unit = length_unit(response.tip_displacement)
    both = (lambda x: factor * forward(x), lambda y: backward(y / factor))
    right = axes.secondary_yaxis("right", functions=both)
    right.set_ylabel(f"tip displacement ({unit})")
    return True


def _strike_by_strike(
    axes: Axes, result: Result, response: LeverResponse, found: list[Strike]
) -> None:
    """Lay the first strikes over each other, from their first touch on."""
    factor, ylabel = _scale(response)
    thin = float(mpl.rcParams["lines.linewidth"])
    count = min(len(found), STRIKES_SHOWN)
    for i, strike in enumerate(found[:STRIKES_SHOWN]):
        following = found[i + 1].begin if i + 1 < len(found) else np.inf
        until = min(strike.begin + SHOWN_AFTER, following)
        shown = max(strike.begin - SHOWN_BEFORE, response.time[0]), min(until, response.time[-1])
        time = np.linspace(*shown, 1000)
        since, colour = 1e3 * (time - strike.begin), OTHERS[i]
        label = f"strike {i + 1}" + ("" if strike.lap is None else f" (lap {strike.lap})")
        if is_beyond(result, strike.begin):
            label += ",\nbeyond the horizon"
        # Strikes alike lie on each other: the earlier ones are broader.
        alpha = 1.0 if i == count - 1 else 0.6
        axes.plot(since, factor * response.value_at(time), color=colour, label=label, alpha=alpha,
                  linewidth=thin * (count - i))  # fmt: skip
        held = 1e3 * (strike.end - strike.begin)
        axes.axvspan(0, held, color=colour, alpha=0.08, linewidth=0)
        axes.axvline(held, color=colour, linestyle=":", linewidth=1.0)
    axes.plot([], [], color=GREY, linestyle=":", label="end of contact")
    axes.margins(x=0)
    axes.set_xlabel("time since the first touch of the strike (ms)")
    axes.set_ylabel(ylabel)
    legend_outside(axes)
