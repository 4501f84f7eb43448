"""Draw a mechanism: at some instants, with a zoom on a strike; or at time 0, with all names.

Also draw its modes, and how a point of it answers a force, by its linear equations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from math import ceil, inf, pi
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.path import Path
from matplotlib.ticker import MaxNLocator, MultipleLocator
from matplotlib.transforms import Bbox

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.linear import LinearModel, Response, motion_text
from exudyn_flexlink.mechanism import Assembly, anchor_position
from exudyn_flexlink.observables import (
    Strike,
    lever_response,
    point_anchor,
    strikes,
    turned_since_start,
    turns,
)
from exudyn_flexlink.plots.frame import (
    BLACK,
    BLUE,
    FLAT,
    GREEN,
    GREY,
    LEGEND,
    ORANGE,
    RED,
    ROW_HEIGHT,
    SCREEN,
    Style,
    framed_figure,
    new_figure,
    settle,
    shortened,
    styled,
)
from exudyn_flexlink.plots.outline import (
    Sketch,
    acting_marks,
    body_colour,
    coil,
    is_guide,
    joint_marks,
    pivots,
    together,
)
from exudyn_flexlink.plots.panels import (
    Given,
    columns_of,
    is_beyond,
    is_given,
    legend_outside,
    letter,
    required,
    sized,
    time_text,
    title_at,
)
from exudyn_flexlink.result import Result
from exudyn_flexlink.rounding import NEGLIGIBLE
from exudyn_flexlink.scene import Scene, split_point

COLUMNS = 2  # fewest columns of panels; in print also the most
AROUND = 0.75  # inches: labels beside the panels; on a screen also above and below each panel
BETWEEN = 0.15  # inches on a screen: gap beside a panel
TALLEST = 4.4  # inches: largest height of a panel
ZOOM_INSTANTS = 6  # number of instants in a zoom
ZOOM_TIME = 3.0  # durations of the strike: a zoom also shows the vibration after it
ZOOM_ROOM = 1.25  # size of a zoom, as a multiple of what it has to show
LEAST_ZOOM, MOST_ZOOM = 0.1, 0.5  # smallest and largest zoom window, as parts of the drawing
FIRST = "first contact"
IN_TURN = np.deg2rad([0.0, 100.0, 200.0, 300.0])  # rad; none mirrors another about a dead centre


@styled
def mechanism(
    result: Result,
    instants: Sequence[float] | None = None,
    *,
    style: Style = SCREEN,
    ax: Given = None,
) -> Figure | None:
    """Draw the mechanism at `instants` (s): bodies, curves of slots, path of the watched point S.

    Without `instants` there are four panels in order of time: the start, the first contact, the
    greatest angle of the struck body, and one turn after the first contact. Without contacts they
    show four instants of a turn. If the first strike has a duration, a further panel enlarges it.
    """
    all_strikes = [strike for name in result.scene.all_contacts for strike in strikes(result, name)]
    first = (
        min(all_strikes, key=lambda strike: strike.begin, default=None)
        if instants is None
        else None
    )
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
    samples = [result.sample_at(time) for time, _ in shown]
    for axes, index, (_, what) in zip(panels, samples, shown, strict=False):
        sketch.draw(axes, index)
        sketch.draw_path(axes, slice(index + 1))
        sketch.mark_points(axes, index)
        sketch.window(axes, sketch.box)
        axes.set_title(_panel_title(result, index, what, style), loc="left")
    frames = dict[str, FloatArray]()
    if zoom is not None:
        _draw_zoom(panels[-1], sketch, result, zoom)
        number = [what for _, what in shown].index(FIRST)
        corner, sides = sketch.unit[0] * zoom.low, sketch.unit[0] * (zoom.high - zoom.low)
        panels[number].indicate_inset((*corner, *sides), edgecolor=BLACK, alpha=0.8)
        frames[FIRST] = zoom.frame
    _label(panels, columns, sketch.unit[1], zoomed=zoom is not None)
    letter(panels)
    if ax is None:
        settle(panels[0].figure.figure)  # the layout must be final before names are placed
    for axes, index, (_, what) in zip(panels, samples, shown, strict=False):
        _name_points(axes, sketch, [index], frames.get(what))
    if zoom is not None:
        _name_points(panels[-1], sketch, zoom.samples)
    return panels[0].figure.figure


def _name_points(
    axes: Axes, sketch: Sketch, samples: Sequence[int], frame: FloatArray | None = None
) -> None:
    """Write the names of points, as in the paper, at the last of some samples.

    Names keep off the lines at all of these samples, and off a `frame` (corners, 2), m.
    """
    factor, places = sketch.unit[0], sketch.letters(samples[-1])
    lines = [drawn.line.at(sketch.poses[sample]) for drawn in sketch.shown for sample in samples]
    lines += [sketch.track] if frame is None else [sketch.track, frame]
    labels = Labels(axes, [factor * line for line in lines])
    pivot = [np.array([anchor.x, anchor.y]) for anchor in pivots(sketch.model)]
    labels.keep_free(factor * np.stack([*places.values(), *pivot]), sized(SYMBOL))
    near = TOGETHER * float(np.max(sketch.box[1] - sketch.box[0]))
    for first, names in together(places, near).items():
        labels.write(", ".join(sorted(names)), factor * places[first], UP,
                     fontsize=float(mpl.rcParams["legend.fontsize"]))  # fmt: skip


def _new_panels(result: Result, sketch: Sketch, count: int, style: Style) -> tuple[list[Axes], int]:
    """Return the panels of a new figure with its legend, and the number of columns."""
    handles, (columns, room) = sketch.legend(), _columns(sketch, count, style)
    rows = ceil(count / columns)
    heights = [room] * rows
    over_all = count == rows * columns  # the last row has no free cell for the legend
    if over_all:
        heights.append(ROW_HEIGHT * ceil(len(handles) / (COLUMNS if style.narrow else 4)) + 0.1)
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
    """Return the number of columns that fills a page best, and the height of a panel.

    The height (inches on a screen) includes the title. A tall mechanism gets more columns than a
    broad one.
    """
    width, height = sketch.box[1] - sketch.box[0]
    ratio, best = float(height / width), (0.0, 0, 0.0)
    for columns in range(min(COLUMNS, count), (COLUMNS if style.narrow else count) + 1):
        room = (style.width - AROUND) / columns / style.scale - BETWEEN
        tall = min(TALLEST, max(0.9, room * ratio))
        broad = min(room, tall / ratio)
        filled = broad * tall * count / ceil(count / columns) / (tall + AROUND)
        best = max(best, (filled, columns, tall + AROUND))
    return best[1:]


def _label(panels: Sequence[Axes], columns: int, unit: str, *, zoomed: bool) -> None:
    """Label the axes at the edges of the figure. A zoom, the last panel, has its own numbers."""
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
    """Samples of a strike and of the vibration after it; corners (2,) m of their window."""

    samples: list[int]
    low: FloatArray
    high: FloatArray

    @property
    def frame(self) -> FloatArray:
        """Outline of the window (corners, 2), m."""
        (left, low), (right, high) = self.low, self.high
        return np.array([[left, low], [right, low], [right, high], [left, high], [left, low]])


def _zoom_of(sketch: Sketch, result: Result, strike: Strike) -> _Zoom | None:
    """Return the zoom on a strike; None of an impact, or if a zoom would enlarge too little.

    The window has the proportions of the whole drawing, and lies within it.
    """
    until = min(strike.begin + ZOOM_TIME * (strike.end - strike.begin), float(result.time[-1]))
    samples = [result.sample_at(t) for t in np.linspace(strike.begin, until, ZOOM_INSTANTS)]
    body = split_point(result.scene.all_contacts[strike.contact].striking)[0]
    # The zoom shows the striking body from its middle to its end.
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
    """Draw a strike and the vibration after it in a zoom, at some instants from its begin on."""
    first, last = zoom.samples[0], zoom.samples[-1]
    for i, index in enumerate(zoom.samples):
        sketch.draw(axes, index, alpha=0.2 + 0.8 * i / (ZOOM_INSTANTS - 1))
    sketch.draw_path(axes, slice(first, last + 1))
    sketch.mark_points(axes, last)
    sketch.window(axes, (zoom.low, zoom.high))
    begin, end = (time_text(result, float(result.time[sample])) for sample in (first, last))
    axes.set_title(f"strike and vibration,\nt = {begin} to {end} s", loc="left")


def _instants(result: Result, strike: Strike | None) -> list[tuple[float, str]]:
    """Return the instants (s) to draw, in order, each with a word for what happens then."""
    if strike is None:
        return [(time, "") for time in _over_a_turn(result)]
    chosen = [(float(result.time[0]), "start"), (strike.begin, FIRST)]
    if result.scene.all_contacts[strike.contact].struck is not None:
        response = lever_response(result, strike.contact)
        peak = max(response.least, response.greatest, key=lambda peak: abs(peak[0]))[1]
        if response.moves:
            chosen.append((peak, f"{response.body} farthest"))
    if turns(result):
        turned = turned_since_start(result)
        angle = float(np.interp(strike.begin, result.time, turned)) + 2 * np.pi
        if turned[-1] >= angle:
            time = result.time[int(np.argmin(np.abs(turned - angle)))]
            chosen.append((float(time), "one turn later"))
    return sorted(chosen, key=lambda instant: instant[0])


def _over_a_turn(result: Result) -> list[float]:
    """Return four instants (s) of the crank's first turn; of the whole run if it makes no turn."""
    if turns(result):
        turned = turned_since_start(result)
        if turned[-1] >= 2 * np.pi:
            return [float(result.time[np.argmin(np.abs(turned - a))]) for a in IN_TURN]
    even = np.linspace(result.time[0], result.time[-1], min(5, len(result.time)))
    return [float(time) for time in even[:4]]


def _panel_title(result: Result, index: int, what: str, style: Style) -> str:
    """Return the title of a panel: event, instant, and whether that lies beyond the horizon."""
    words = title_at(result, index)
    if style.narrow and not what:  # the title has only one line beside the letter
        words = words.replace(", ", ",\n")
    beyond = "beyond the horizon" if is_beyond(result, float(result.time[index])) else ""
    return "\n".join(filter(None, (what, words, beyond)))


LOWEST, TALLEST_START = 2.4, 7.5  # inches: smallest and largest height of the drawing
TOGETHER = 2e-3  # of the drawing: points nearer than this share one text
UP = np.array([0.0, 1.0])
MOST_BODIES = 14  # most entries for bodies in the legend; more have no room
MOST_NAMED = 40  # most points with names; more names hide the mechanism
ROOM = 0.08  # of the drawing: margin for names
SYMBOL = 9.0  # points: names keep off a symbol of this width, that of most symbols
SPOT = 3.0  # points: names keep off spots of a line; this is the distance of two spots
DIRECTIONS = 24
LABEL_DISTANCE = 7.0  # points: distance of a name from its point
FARTHER = (1.0, 2.0, 3.2, 4.6)  # multiples of this distance, tried in order to find room
APART = 2.0  # points: distance of a name from other names and from lines
# Cost of a place for a name; a place on another name costs 1:
OF_LINE = 0.15  # for each hidden spot of a line
OUTSIDE = 40.0  # for a name outside the axes
OF_DISTANCE = 0.12  # for a larger distance


_TURN = np.linspace(0.0, 4 * pi, 60)
# A marker: a spiral of two turns, the usual symbol of a torsional spring.
_SPIRAL = Path(np.stack([_TURN * np.cos(_TURN), _TURN * np.sin(_TURN)], axis=1) / (4 * pi))

_SYMBOLS: dict[str, tuple[Any, str, str, float, int]] = {
    "revolute": ("o", BLACK, "white", 6, 6),
    "revolute, on the ground": ("^", BLACK, "white", 8, 5),
    "weld": ("s", BLACK, BLACK, 5, 6),
    "weld, to the ground": ("s", BLACK, BLACK, 9, 6),
    "in a slot": ("D", BLACK, "white", 5, 6),
    "prismatic": ("s", BLACK, "white", 8, 5),
    "torsional spring": (_SPIRAL, GREEN, "none", 13, 7),
    "drive": (r"$\circlearrowleft$", ORANGE, ORANGE, 15, 7),
    "force": (r"$\rightarrow$", ORANGE, ORANGE, 15, 7),
    "point that may strike": ("*", RED, RED, 9, 7),
}
"""Marker, colour of its edge, colour of its face, size (points) and zorder."""
_SPRING: dict[str, Any] = {"color": GREEN, "linewidth": 1.2, "zorder": 3}
# The face is broader than its body, which is drawn over it.
_FACE: dict[str, Any] = {"color": RED, "linewidth": 8.0, "alpha": 0.35, "zorder": 3,
                         "solid_capstyle": "butt"}  # fmt: skip


@styled
def start(scene: Scene, assembly: Assembly, *, style: Style = SCREEN) -> Figure:
    """Draw bodies, joints, curves, springs, drives and contacts at time 0, with names."""
    posed = Sketch(scene, assembly.state.q[None])
    low, high = _room(posed)
    width, height = high - low
    room = (style.width - LEGEND * (not style.narrow) - 0.6) / style.scale
    tall = min(TALLEST_START, max(LOWEST, room * float(height / width)))
    caption = [(_caption(scene, posed), GREY)]
    subject = "The mechanism where it starts"
    whole = tall + 0.5 + LEGEND * style.narrow
    figure = framed_figure((scene.title, subject), whole, style, caption=caption)
    axes = figure.subplots()
    posed.draw(axes, 0)
    drawn = _draw_symbols(axes, posed)
    margin = ROOM * float(max(width, height))
    posed.window(axes, (low - margin, high + margin))
    axes.set_xlabel(f"x ({posed.unit[1]})")
    axes.set_ylabel(f"y ({posed.unit[1]})")
    bodies = posed.body_legend() if len(scene.bodies) <= MOST_BODIES else []
    legend_outside(axes, below=True, handles=[*bodies, *drawn])
    settle(figure)  # the layout must be final before names are placed
    _name(axes, posed)
    return figure


def _room(posed: Sketch) -> tuple[FloatArray, FloatArray]:
    """Return the lower left and upper right corner (2,) m of bodies and springs."""
    low, high = posed.box
    ends = [end for line in posed.drawn(["spring"]) for end in line.line.at(posed.poses[0])]
    return np.min([low, *ends], axis=0), np.max([high, *ends], axis=0)


def _caption(scene: Scene, posed: Sketch) -> str:
    """Return the caption: gravity, and the number of points if they are too many to be named."""
    x, y = scene.gravity
    words = ["no gravity"] if x == y == 0 else [f"gravity ({x:g}, {y:g}) m/s\N{SUPERSCRIPT TWO}"]
    many = len(_named_points(posed))
    words += [f"{many} named points, too many to be named here"] if many > MOST_NAMED else []
    return "; ".join(words).replace("-", "\u2212")


def _draw_symbols(axes: Axes, posed: Sketch) -> list[Line2D]:
    """Draw joints, springs, drives and contacts; return their entries of the legend."""
    factor, _ = posed.unit
    seen: dict[str, Line2D] = {}
    scene, model = posed.scene, posed.model
    for mark in (*joint_marks(scene, model), *acting_marks(scene, model)):
        marker, colour, face, size, front = _SYMBOLS[mark.kind]
        look: dict[str, Any] = {"marker": marker, "color": colour, "mfc": face, "linestyle": "",
                                "markersize": sized(size), "zorder": front}  # fmt: skip
        axes.plot(*(factor * anchor_position(mark.anchor, posed.poses[0])), **look)
        seen[mark.kind] = Line2D([], [], label=mark.kind, **look)
    others = (("spring", "linear spring", _SPRING), ("face", "face of a contact", _FACE))
    for kind, label, look in others:
        for line in posed.drawn([kind]):
            points = line.line.at(posed.poses[0])
            axes.plot(*(factor * (coil(points) if kind == "spring" else points)).T, **look)
            seen[label] = Line2D([], [], label=label, **look)
    return list(seen.values())


def _named_points(posed: Sketch) -> dict[str, FloatArray]:
    """Return the places of the scene's points; a centre only if its body has no other point."""
    scene = posed.scene
    bodies = scene.bodies.items()
    names = [f"{name}.{p}" for name, body in bodies for p in body.point_names if p != "centre"]
    anchors = [point_anchor(scene, posed.model, name) for name in names]
    places = [anchor_position(anchor, posed.poses[0]) for anchor in anchors]
    return dict(zip(names, places, strict=True))


def _name(axes: Axes, posed: Sketch) -> None:
    """Write the names of bodies and of points; points at the same place share one text."""
    factor, _ = posed.unit
    low, high = posed.box
    middle, near = (low + high) / 2, FLAT * float(np.max(high - low))
    lines = {body: posed.lines(body, 0) for body in posed.scene.bodies}
    labels = Labels(axes, [factor * drawn.line.at(posed.poses[0]) for drawn in posed.shown])
    for mark in (*joint_marks(posed.scene, posed.model), *acting_marks(posed.scene, posed.model)):
        place = anchor_position(mark.anchor, posed.poses[0])
        labels.keep_free(factor * place[None], sized(max(SYMBOL, _SYMBOLS[mark.kind][3])))
    for body, shape in lines.items():
        longest = max(shape, key=lambda points: float(np.ptp(points, axis=0).max()))
        place = (longest[0] + longest[-1]) / 2
        colour = GREY if is_guide(posed.scene, body) else body_colour(posed.scene, body)
        labels.write(body, factor * place, place - middle, color=colour, weight="bold")
    named = _named_points(posed)
    small = float(mpl.rcParams["legend.fontsize"]) - 2
    for first, names in together(named, near).items() if len(named) <= MOST_NAMED else ():
        text, place = "\n".join(names), named[first]
        labels.write(text, factor * place, place - middle, color=BLACK, fontsize=small)


class Labels:
    """Places names one after the other; the first names get the best places.

    The limits of the axes and the layout of the figure must be final. Names keep off `lines`
    (points, 2), in data coordinates.
    """

    def __init__(self, axes: Axes, lines: Sequence[FloatArray]) -> None:
        self._axes, self._window = axes, axes.get_window_extent()
        self._taken: list[Bbox] = []
        figure = axes.get_figure()
        assert figure is not None
        self._pixels = figure.dpi / 72  # pixels per point
        drawn = [axes.transData.transform(line) for line in lines]
        self._spots = np.concatenate([spots_along(line, SPOT * self._pixels) for line in drawn])

    def keep_free(self, places: FloatArray, size: float) -> None:
        """Keep names off symbols `size` (points) wide at places (N, 2), in data coordinates."""
        half = size / 2 * self._pixels
        self._taken += [
            Bbox([spot - half, spot + half]) for spot in self._axes.transData.transform(places)
        ]

    def write(self, text: str, place: FloatArray, towards: FloatArray, **look: Any) -> None:
        """Write a name beside a place (data coordinates), preferably in the direction `towards`.

        A name is omitted if its place lies outside the axes.
        """
        x, y = (float(coordinate) for coordinate in place)
        first, spot = (
            float(np.arctan2(towards[1], towards[0])),
            self._axes.transData.transform(place),
        )
        if not self._window.contains(*spot):
            return
        shown = self._axes.annotate(
            shortened(text), (x, y), (0, 0), textcoords="offset points", ha="center", va="center",
            zorder=8, **look,
        )  # fmt: skip
        shown.set_in_layout(False)
        half = np.array(shown.get_window_extent().size) / 2
        best = inf, half, Bbox.unit()
        for far, turn in product(FARTHER, range(DIRECTIONS)):
            if (least := OF_DISTANCE * (far - 1 + turn / DIRECTIONS)) >= best[0]:
                break  # it grows from place to place: no later one costs less
            angle = first + (turn + 1) // 2 * (-1) ** turn * 2 * pi / DIRECTIONS
            away = np.array([np.cos(angle), np.sin(angle)])
            # The distance is half the size of the name in that direction, and a gap.
            middle = LABEL_DISTANCE * self._pixels * far * away + half * away
            box = Bbox([spot + middle - half, spot + middle + half])
            best = min(best, (least + self._hidden(box), middle, box), key=lambda place: place[0])
        shown.set_position(tuple(best[1] / self._pixels))
        self._taken.append(best[2].padded(APART * self._pixels))

    def _hidden(self, box: Bbox) -> float:
        """Return the cost of a box for a name: what it hides, and its part outside the axes."""
        within = Bbox.intersection(box, self._window)
        inside = 0.0 if within is None else within.width * within.height
        outside = 1 - inside / (box.width * box.height)
        on_lines = OF_LINE * box.padded(APART * self._pixels).count_contains(self._spots)
        return float(OUTSIDE * outside + box.count_overlaps(self._taken) + on_lines)


def spots_along(line: FloatArray, apart: float) -> FloatArray:
    """Return spots (N, 2) along a line (points, 2), evenly, with a distance of at most `apart`."""
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    way = np.concatenate([[0.0], np.cumsum(steps)])
    lengths = np.linspace(0.0, way[-1], 2 + int(way[-1] / apart))
    return np.stack([np.interp(lengths, way, across) for across in line.T], axis=1)


MOST_MODES, MODE_COLUMNS = 6, 3
PHASES = np.array([0.0, np.pi / 2, np.pi, 3 * np.pi / 2])  # rad: phases of a mode in a figure
MODE_SIZE = 0.12  # of the mechanism: largest displacement of a mode in the figure
PALE = 0.3
BESIDE, ABOVE = 0.7, 0.9  # inches: room beside the axes of a panel of a mode; above and below them
AHEAD = 1.0  # deg: a smaller phase lead is rounding; a larger one is a lag, by the rest of 360 deg


@styled
def modes(model: LinearModel, *, style: Style = SCREEN) -> Figure:
    """Draw the slowest modes, each in a panel: the mechanism in its state; its amplitudes, pale."""
    shown = model.modes[:MOST_MODES]
    q = model.assembly.state.q
    low, high = Sketch(model.scene, q[None]).box
    size = MODE_SIZE * float(np.max(high - low))
    turns = np.exp(1j * PHASES)[:, None, None]
    moved = [q + size * (turns * mode.poses).real for mode in shown]
    box = Sketch(model.scene, np.concatenate(moved)).box
    columns = 1 if style.narrow else min(MODE_COLUMNS, len(shown))
    rows = ceil(len(shown) / columns)
    width, height = box[1] - box[0]
    about = "its rest" if model.time is None else f"t = {model.time:.4g} s"
    subject = f"Modes about {about}; damping in % of the critical one"
    panel = (style.width / columns - BESIDE) * height / width + ABOVE
    figure = framed_figure((model.scene.title, subject), rows * panel / style.scale, style)
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, mode, poses in zip(panels, shown, moved, strict=False):
        sketch = Sketch(model.scene, np.concatenate([q[None], poses]))
        for k in range(len(sketch.poses)):
            sketch.draw(axes, k, alpha=PALE if k else 1.0)
        sketch.window(axes, box)
        axes.set_title(motion_text(mode.eigenvalue, short=True))
        axes.set_xlabel(f"x ({sketch.unit[1]})")
    for axes in panels[::columns]:
        axes.set_ylabel(f"y ({sketch.unit[1]})")
    for axes in panels[len(shown) :]:
        axes.set_visible(False)
    letter(panels[: len(shown)])
    settle(figure)
    return figure


@styled
def response(answer: Response, *, style: Style = SCREEN) -> Figure:
    """Draw gain and phase of both coordinates over frequency (a Bode plot)."""
    subject = f"{answer.at} for 1 N along {answer.along} at {answer.force}"
    figure = framed_figure((subject, "gain and phase over frequency"), 5.0, style)
    gain, phase = figure.subplots(2, 1, sharex=True)
    largest = max(float(np.abs(moved).max()) for moved in (answer.x, answer.y))
    for name, moved, colour in (("x", answer.x, BLUE), ("y", answer.y, RED)):
        if np.abs(moved).max() > NEGLIGIBLE * largest:
            gain.loglog(answer.frequency, np.abs(moved), color=colour, label=name)
            lag = (AHEAD - np.degrees(np.angle(moved))) % 360 - AHEAD
            phase.semilogx(answer.frequency, -lag, color=colour)
    gain.set_ylabel("gain (m/N)")
    gain.legend(loc="best")
    phase.yaxis.set_major_locator(MultipleLocator(90))
    phase.set_ylabel("phase (deg)")
    phase.set_xlabel("frequency (Hz)")
    letter([gain, phase])
    return figure
