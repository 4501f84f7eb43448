"""The mechanism itself, drawn at a few instants, and larger in the strike."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.observables import Strike, lever_response, strikes, turned_since_start, turns
from exudyn_flexlink.plots.frame import new_figure
from exudyn_flexlink.plots.panels import is_beyond, legend_outside, letter, title_at, told_time
from exudyn_flexlink.plots.sketch import Sketch
from exudyn_flexlink.plots.style import BLACK, SCREEN, Style, styled
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import split_point

COLUMNS = 2
LEGEND = 2.6  # inches on a screen, of legend and labels beside the panels
LABELS = 0.75  # inches in print, of labels beside the panels
LEGEND_ROW = 0.3  # inches on a screen, of a line of the legend below
TALLEST = 4.4  # inches, of a panel
ZOOM_INSTANTS = 6  # that a zoom shows
ZOOM_TIME = 3.0  # durations of a strike that it lasts: what is struck, and what strikes, vibrate
ZOOM_ROOM = 1.25  # of what a zoom is to show
LEAST_ZOOM = 0.1  # of the whole drawing: a window is no smaller
FIRST = "first contact"
IN_TURN = np.deg2rad([0.0, 100.0, 200.0, 300.0])  # no two of them mirrored at a dead centre


@styled
def mechanism(
    result: Result, instants: Sequence[float] | None = None, *, style: Style = SCREEN
) -> Figure | None:
    """Draw the mechanism at `instants` (s): bodies, curves of slots, path of the watched point S.

    Without `instants`: the start, the first contact, the greatest angle of the struck body and the
    same crank angle one turn after the first contact, in order of time; without contacts four
    instants of a turn.
    What happens in the first strike, if it lasts, is drawn larger in a panel of its own.
    """
    found = [one for name in result.scene.contacts for one in strikes(result, name)]
    first = min(found, key=lambda strike: strike.begin, default=None) if instants is None else None
    shown = _instants(result, first) if instants is None else [(time, "") for time in instants]
    if not shown:
        return None
    sketch = Sketch(result.scene, result.poses, result)
    strike = first if first is not None and first.end > first.begin else None
    count = len(shown) + (strike is not None)
    handles = sketch.legend()
    heights = [_panel_height(sketch, style)] * ceil(count / COLUMNS)
    height = sum(heights) + 0.2
    if style.narrow and count % COLUMNS == 0:
        height += LEGEND_ROW * ceil(len(handles) / COLUMNS)
    figure = new_figure(result, "The mechanism at some instants", height, style)
    grid = figure.subplots(len(heights), COLUMNS, squeeze=False)
    panels = list(grid.flat[:count])
    for axes, (time, what) in zip(panels, shown, strict=False):
        index = result.sample_at(time)
        sketch.draw(axes, index)
        sketch.draw_path(axes, slice(index + 1))
        sketch.name_points(axes, index)
        sketch.window(axes, sketch.box)
        axes.set_title(_panel_title(result, index, what, style), loc="left")
    if strike is not None:
        low, high = _zoom(panels[-1], sketch, strike)
        at = [what for _, what in shown].index(FIRST)
        corner, size = sketch.unit[0] * low, sketch.unit[0] * (high - low)
        panels[at].indicate_inset((*corner, *size), edgecolor=BLACK, alpha=0.8)
    _label(panels, sketch.unit[1], zoomed=strike is not None)
    for axes in grid.flat[count:]:
        axes.set_axis_off()
    letter(panels)
    if style.narrow and count % COLUMNS:  # there is room in the cell that is left over
        grid[-1, -1].legend(handles=handles, loc="center left", bbox_to_anchor=(0.0, 0.5))
    else:
        legend_outside(grid[0, -1], below=True, handles=handles)
    return figure


def _panel_height(sketch: Sketch, style: Style) -> float:
    """Height (inches on a screen) of a panel with its title."""
    width, height = sketch.box[1] - sketch.box[0]
    room = (style.width - (LABELS if style.narrow else LEGEND)) / COLUMNS / style.scale
    return min(TALLEST, max(0.9, room * float(height / width))) + 0.75


def _label(panels: Sequence[Axes], unit: str, *, zoomed: bool) -> None:
    """Label the axes at the edges; a zoom, the last panel, has numbers of its own."""
    for i, axes in enumerate(panels):
        zoom = zoomed and i == len(panels) - 1
        alike = len(panels) - zoomed
        lowest = zoom or i + COLUMNS >= alike
        axes.xaxis.set_major_locator(MaxNLocator(5))
        axes.yaxis.set_major_locator(MaxNLocator(5))
        axes.tick_params(labelbottom=lowest, labelleft=zoom or i % COLUMNS == 0)
        axes.set_xlabel(f"x ({unit})" if lowest else "")
        axes.set_ylabel(f"y ({unit})" if i % COLUMNS == 0 else "")


def _zoom(axes: Axes, sketch: Sketch, strike: Strike) -> tuple[FloatArray, FloatArray]:
    """Draw a strike, and what vibrates after it, larger, at instants from its begin on.

    The window, whose corners (2,) m are returned, has the shape of the whole drawing.
    """
    result = sketch.result
    until = min(strike.begin + ZOOM_TIME * (strike.end - strike.begin), float(result.time[-1]))
    times = np.linspace(strike.begin, until, ZOOM_INSTANTS)
    indices = [result.sample_at(time) for time in times]
    around = slice(indices[0], indices[-1] + 1)
    body = split_point(result.scene.contacts[strike.contact].striking)[0]
    # Of the body that strikes, the half at its end is to be seen.
    halves = [line[len(line) // 2 :] for line in sketch.lines(body, indices[0])]
    points = np.concatenate([sketch.track[around], *halves])
    size = sketch.box[1] - sketch.box[0]
    part = max(LEAST_ZOOM, ZOOM_ROOM * float(np.max(np.ptp(points, axis=0) / size)))
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    window = middle - part * size / 2, middle + part * size / 2
    for i, index in enumerate(indices):
        sketch.draw(axes, index, alpha=0.2 + 0.8 * i / (ZOOM_INSTANTS - 1))
    sketch.draw_path(axes, around)
    sketch.name_points(axes, indices[-1])
    sketch.window(axes, window)
    first, last = (told_time(result, float(time)) for time in times[[0, -1]])
    axes.set_title(f"strike and vibration,\nt = {first} to {last} s", loc="left")
    return window


def _instants(result: Result, strike: Strike | None) -> list[tuple[float, str]]:
    """Choose times worth a drawing, in their order, with what happens there."""
    if strike is None:
        return [(time, "") for time in _over_a_turn(result)]
    chosen = [(float(result.time[0]), "start"), (strike.begin, FIRST)]
    if result.scene.contacts[strike.contact].struck is not None:
        response = lever_response(result, strike.contact)
        peak = max(response.least, response.greatest, key=lambda peak: abs(peak[0]))[1]
        chosen.append((peak, f"{response.body} farthest"))
    if turns(result):
        turned = turned_since_start(result)
        at = float(np.interp(strike.begin, result.time, turned)) + 2 * np.pi
        if turned[-1] >= at:
            time = result.time[int(np.argmin(np.abs(turned - at)))]
            chosen.append((float(time), "one turn later"))
    return sorted(chosen, key=lambda instant: instant[0])


def _over_a_turn(result: Result) -> list[float]:
    """Four instants of the first turn of the crank; if it makes none, of the whole run."""
    if turns(result):
        turned = turned_since_start(result)
        if turned[-1] >= 2 * np.pi:
            return [float(result.time[np.argmin(np.abs(turned - a))]) for a in IN_TURN]
    even = np.linspace(result.time[0], result.time[-1], min(5, len(result.time)))
    return [float(time) for time in even[:4]]


def _panel_title(result: Result, index: int, what: str, style: Style) -> str:
    words = title_at(result, index)
    if style.narrow and not what:  # there is room for one line beside the letter
        words = words.replace(", ", ",\n")
    beyond = "beyond the horizon" if is_beyond(result, float(result.time[index])) else ""
    return "\n".join(filter(None, (what, words, beyond)))
