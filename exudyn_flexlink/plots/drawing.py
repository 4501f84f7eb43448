"""The figure of a mechanism: at a few instants, and larger in the strike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.observables import (
    Strike,
    lever_response,
    strikes,
    turned_since_start,
    turns,
)
from exudyn_flexlink.plots.frame import new_figure
from exudyn_flexlink.plots.given import Given, is_given, required
from exudyn_flexlink.plots.panels import (
    columns_of,
    is_beyond,
    legend_outside,
    letter,
    title_at,
    told_time,
)
from exudyn_flexlink.plots.sketch import Sketch
from exudyn_flexlink.plots.style import BLACK, SCREEN, Style, styled
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import split_point

COLUMNS = 2  # at least, and in print at most
LABELS = 0.75  # inches, of labels beside the panels
BETWEEN = 0.15  # inches on a screen, of the gap beside a panel
TITLE = 0.75  # inches on a screen, of what is above and below a panel
LEGEND_ROW = 0.3  # inches on a screen, of a line of the legend below
TALLEST = 4.4  # inches, of a panel
ZOOM_INSTANTS = 6  # that a zoom shows
ZOOM_TIME = 3.0  # durations of a strike that it lasts: what is struck, and what strikes, vibrate
ZOOM_ROOM = 1.25  # of what a zoom is to show
LEAST_ZOOM, MOST_ZOOM = 0.1, 0.5  # of the whole drawing: a window is no smaller, and no larger
FIRST = "first contact"
IN_TURN = np.deg2rad([0.0, 100.0, 200.0, 300.0])  # no two of them mirrored at a dead centre


@styled
def mechanism(
    result: Result,
    instants: Sequence[float] | None = None,
    *,
    style: Style = SCREEN,
    ax: Given = None,
) -> Figure | None:
    """Draw the mechanism at `instants` (s): bodies, curves of slots, path of the watched point S.

    Without `instants`: the start, the first contact, the greatest angle of the struck body and the
    same crank angle one turn after the first contact, in order of time; without contacts four
    instants of a turn.
    What happens in the first strike, if it lasts, is drawn larger in a panel of its own.
    """
    found = [one for name in result.scene.all_contacts for one in strikes(result, name)]
    first = min(found, key=lambda strike: strike.begin, default=None) if instants is None else None
    shown = _instants(result, first) if instants is None else [(time, "") for time in instants]
    if not shown:
        return None
    sketch = Sketch(result.scene, result.poses, result)
    zoom = None if first is None else _zoom_of(sketch, result, first)
    names = [what or f"t = {time:g} s" for time, what in shown] + ["strike"] * bool(zoom)
    if ax is not None:
        panels, columns = required(ax, names), len(names)
        zoom = zoom if len(panels) == len(names) else None
        legend_outside(panels[-1], below=True, handles=sketch.legend())
    else:
        panels, columns = _new_panels(result, sketch, len(names), style)
    size = float(np.max(sketch.box[1] - sketch.box[0]))
    for axes, (time, what) in zip(panels, shown, strict=False):
        index = result.sample_at(time)
        sketch.draw(axes, index)
        sketch.draw_path(axes, slice(index + 1))
        sketch.name_points(axes, index, size)
        sketch.window(axes, sketch.box)
        axes.set_title(_panel_title(result, index, what, style), loc="left")
    if zoom is not None:
        _draw_zoom(panels[-1], sketch, result, zoom)
        at = [what for _, what in shown].index(FIRST)
        corner, sides = sketch.unit[0] * zoom.low, sketch.unit[0] * (zoom.high - zoom.low)
        panels[at].indicate_inset((*corner, *sides), edgecolor=BLACK, alpha=0.8)
    _label(panels, columns, sketch.unit[1], zoomed=zoom is not None)
    letter(panels)
    return panels[0].figure.figure


def _new_panels(result: Result, sketch: Sketch, count: int, style: Style) -> tuple[list[Axes], int]:
    """Panels of a new figure, with its legend, and how many are side by side."""
    handles, (columns, room) = sketch.legend(), _columns(sketch, count, style)
    rows = ceil(count / columns)
    heights = [room] * rows
    over_all = count == rows * columns  # no cell is left over for the legend
    if over_all:
        heights.append(LEGEND_ROW * ceil(len(handles) / (COLUMNS if style.narrow else 4)) + 0.1)
    title = "The mechanism at some instants"
    figure = new_figure(result, title, sum(heights) + 0.2, style)
    grid = figure.add_gridspec(len(heights), columns, height_ratios=heights)
    panels = [figure.add_subplot(grid[divmod(i, columns)]) for i in range(count)]
    below = figure.add_subplot(grid[-1, :] if over_all else grid[-1, -1])
    below.set_axis_off()
    names = [str(handle.get_label()) for handle in handles]
    below.legend(handles=handles, loc="center" if over_all else "center left",
                 ncols=columns_of(names, figure, 0.95) if over_all else 1)  # fmt: skip
    return panels, columns


def _columns(sketch: Sketch, count: int, style: Style) -> tuple[int, float]:
    """Columns that fill a page best, and the height (inches on a screen) of a panel with its title.

    A tall mechanism has more of them side by side than a broad one.
    """
    width, height = sketch.box[1] - sketch.box[0]
    ratio, best = float(height / width), (0.0, 0, 0.0)
    for columns in range(min(COLUMNS, count), (COLUMNS if style.narrow else count) + 1):
        room = (style.width - LABELS) / columns / style.scale - BETWEEN
        tall = min(TALLEST, max(0.9, room * ratio))
        broad = min(room, tall / ratio)
        filled = broad * tall * count / ceil(count / columns) / (tall + TITLE)
        best = max(best, (filled, columns, tall + TITLE))
    return best[1:]


def _label(panels: Sequence[Axes], columns: int, unit: str, *, zoomed: bool) -> None:
    """Label the axes at the edges; a zoom, the last panel, has numbers of its own."""
    for i, axes in enumerate(panels):
        zoom = is_given(axes) or (zoomed and i == len(panels) - 1)
        alike = len(panels) - zoomed
        lowest = zoom or i + columns >= alike
        axes.xaxis.set_major_locator(MaxNLocator(5))
        axes.yaxis.set_major_locator(MaxNLocator(5))
        axes.tick_params(labelbottom=lowest, labelleft=zoom or i % columns == 0)
        axes.set_xlabel(f"x ({unit})" if lowest else "")
        axes.set_ylabel(f"y ({unit})" if is_given(axes) or i % columns == 0 else "")


@dataclass(frozen=True)
class _Zoom:
    """Samples of a strike and of what vibrates after it, in a window by its corners (2,) m."""

    samples: list[int]
    low: FloatArray
    high: FloatArray


def _zoom_of(sketch: Sketch, result: Result, strike: Strike) -> _Zoom | None:
    """What a zoom on a strike shows; None of an impact, or if it would not be much larger.

    The window has the shape of the whole drawing, and lies within it.
    """
    until = min(strike.begin + ZOOM_TIME * (strike.end - strike.begin), float(result.time[-1]))
    samples = [result.sample_at(t) for t in np.linspace(strike.begin, until, ZOOM_INSTANTS)]
    body = split_point(result.scene.all_contacts[strike.contact].striking)[0]
    # Of the body that strikes, the half at its end is to be seen.
    halves = [line[len(line) // 2 :] for line in sketch.lines(body, samples[0])]
    points = np.concatenate([sketch.track[samples[0] : samples[-1] + 1], *halves])
    (low, high), size = sketch.box, sketch.box[1] - sketch.box[0]
    part = max(LEAST_ZOOM, ZOOM_ROOM * float(np.max(np.ptp(points, axis=0) / size)))
    if strike.end <= strike.begin or part > MOST_ZOOM:
        return None
    half = part * size / 2
    middle = np.clip((points.min(axis=0) + points.max(axis=0)) / 2, low + half, high - half)
    return _Zoom(samples, middle - half, middle + half)


def _draw_zoom(axes: Axes, sketch: Sketch, result: Result, zoom: _Zoom) -> None:
    """Draw a strike, and what vibrates after it, larger, at instants from its begin on."""
    first, last = zoom.samples[0], zoom.samples[-1]
    for i, index in enumerate(zoom.samples):
        sketch.draw(axes, index, alpha=0.2 + 0.8 * i / (ZOOM_INSTANTS - 1))
    sketch.draw_path(axes, slice(first, last + 1))
    sketch.name_points(axes, last, float(np.max(zoom.high - zoom.low)))
    sketch.window(axes, (zoom.low, zoom.high))
    begin, end = (told_time(result, float(result.time[at])) for at in (first, last))
    axes.set_title(f"strike and vibration,\nt = {begin} to {end} s", loc="left")


def _instants(result: Result, strike: Strike | None) -> list[tuple[float, str]]:
    """Choose times worth a drawing, in their order, with what happens there."""
    if strike is None:
        return [(time, "") for time in _over_a_turn(result)]
    chosen = [(float(result.time[0]), "start"), (strike.begin, FIRST)]
    if result.scene.all_contacts[strike.contact].struck is not None:
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
    """Say what a panel shows, its instant, and that it lies beyond the horizon if it does."""
    words = title_at(result, index)
    if style.narrow and not what:  # there is room for one line beside the letter
        words = words.replace(", ", ",\n")
    beyond = "beyond the horizon" if is_beyond(result, float(result.time[index])) else ""
    return "\n".join(filter(None, (what, words, beyond)))
