"""The mechanism itself, drawn into axes: at a few instants, and larger in the strike."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import ceil
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import Mechanism, anchor_position, build_mechanism
from exudyn_flexlink.observables import (
    Strike,
    lever_response,
    point_anchor,
    strikes,
    turned_since_start,
    turns,
    watched_point,
)
from exudyn_flexlink.plots.frame import new_figure
from exudyn_flexlink.plots.outline import (
    Drawn,
    body_lines,
    box_around,
    drawn_lines,
    named_points,
    pivots,
    together,
)
from exudyn_flexlink.plots.panels import (
    BEYOND_LINE,
    horizon,
    is_beyond,
    legend_outside,
    length_unit,
    letter,
    sized,
    title_at,
    told_time,
)
from exudyn_flexlink.plots.style import BLACK, GREY, SCREEN, Style, styled
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import RigidBody, Scene, split_point

BODIES = ("wall", "guide", "bar", "link")  # kinds of lines that show bodies
SHOWN = ("curve", "ring", "rope", "stop", *BODIES)
LABELLED = {"curve": "", "stop": "stop", "rope": "rope or buffer"}
NEAR = 1e-9  # m: points nearer than this are named together
BAND = 7.0  # points, of the shading along the path beyond the horizon
_MARKS = {"O": "+", "P": "s", "S": "o"}
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


@dataclass(frozen=True)
class Sketch:
    """A scene's mechanism in some poses (N, parts, 3): x, y in m and the angle of every part.

    Of a run also the path of the watched point S.
    """

    scene: Scene
    poses: FloatArray
    result: Result | None = None

    @cached_property
    def model(self) -> Mechanism:
        """The mechanism of the scene."""
        return build_mechanism(self.scene)

    @cached_property
    def track(self) -> FloatArray:
        """Where the watched point S goes (N, 2), m."""
        anchor = point_anchor(self.scene, self.model, watched_point(self.scene))
        return np.asarray(anchor_position(anchor, self.poses))

    @cached_property
    def box(self) -> tuple[FloatArray, FloatArray]:
        """Lower left and upper right corner (2,) m of all that is drawn, with a margin."""
        some = self.poses[:: max(1, len(self.poses) // 200)]
        points = [drawn.line.at(some) for drawn in self.shown]
        points += [np.array([at.x, at.y]) for at in pivots(self.model)]
        return box_around([self.track, *points])

    @cached_property
    def shown(self) -> list[Drawn]:
        """Curves, bodies, circles, ropes and stops, as lines."""
        return self.drawn(SHOWN)

    def drawn(self, kinds: Collection[str]) -> list[Drawn]:
        """Lines of some kinds."""
        return [own for own in drawn_lines(self.scene, self.model) if own.kind in kinds]

    @cached_property
    def unit(self) -> tuple[float, str]:
        """Factor from m, and name, of the unit of lengths."""
        low, high = self.box
        return length_unit(high - low)

    def window(self, axes: Axes, box: tuple[FloatArray, FloatArray]) -> None:
        """Let axes show a box, by its corners (2,) m."""
        low, high = (self.unit[0] * corner for corner in box)
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
        axes.set_aspect("equal")

    def lines(self, body: str, index: int) -> list[FloatArray]:
        """Polylines (points, 2) m of a body at a sample: its rods, or rays to its points."""
        own = body_lines(self.scene, self.model, body)
        return [line.at(self.poses[index]) for line in own]

    def draw(self, axes: Axes, index: int, alpha: float = 1.0) -> None:
        """Draw curves, bodies and pivots on the ground at a sample."""
        factor, q = self.unit[0], self.poses[index]
        for own in self.shown:
            axes.plot(*(factor * own.line.at(q)).T, **_look(self.scene, own), alpha=alpha)
        for at in pivots(self.model):
            axes.plot(factor * at.x, factor * at.y, "^", color=BLACK, mfc="white",
                      markersize=sized(7), zorder=5)  # fmt: skip

    def body_legend(self) -> list[Line2D]:
        """Entries for bodies, guides and curves."""
        curve = "track" if self.model.slots else "curve"
        bodies, curves = {}, {}
        for own in self.shown:
            look, body = _look(self.scene, own), own.line.name
            if own.kind in BODIES:
                label = f"walls of {body}" if own.kind == "wall" else body
                bodies[body] = Line2D([], [], label=label, **look)
            elif own.kind in LABELLED:
                curves[own.kind] = Line2D([], [], label=LABELLED[own.kind] or curve, **look)
        return [*bodies.values(), *curves.values()]

    def draw_path(self, axes: Axes, done: slice) -> None:
        """Draw where S goes, the part of the samples `done` in black."""
        factor, _ = self.unit
        axes.plot(*(factor * self.track).T, color=GREY, linewidth=sized(0.7), zorder=1)
        axes.plot(*(factor * self.track[done]).T, color=BLACK, linewidth=sized(1.0), zorder=2)
        if self.result is not None and (found := horizon(self.result)) is not None:
            beyond = self.track[self.result.time >= found[0]]
            axes.plot(*(factor * beyond).T, **BEYOND_LINE, linewidth=sized(BAND))

    def name_points(self, axes: Axes, index: int) -> None:
        """Mark and name, as the paper does, the origin O, P in the one slot, and S."""
        points = {
            name: np.asarray(anchor_position(anchor, self.poses[index]))
            for name, anchor in named_points(self.scene, self.model).items()
        }
        for name, place in points.items():
            mark = self.unit[0] * place
            axes.plot(*mark, _MARKS[name], color=BLACK, markersize=sized(4), zorder=6)
        for first, names in together(points, NEAR).items():
            x, y = self.unit[0] * points[first]
            axes.annotate(
                ", ".join(sorted(names)),
                (x, y),
                xytext=(0, sized(5)),
                textcoords="offset points",
                ha="center",
                fontsize=mpl.rcParams["legend.fontsize"],
                annotation_clip=True,
                zorder=7,
                bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.6, "pad": 0.3},
            )

    def legend(self) -> list[Line2D]:
        """Entries for all that is drawn."""
        scene, model = self.scene, self.model
        handles = self.body_legend()
        mark: dict[str, Any] = {"color": BLACK, "markersize": sized(4), "linewidth": 1.0}
        told = {"S": f"S: {watched_point(scene)}, path", "P": "P: in the slot", "O": "O: origin"}
        for name in ("S", "P", "O") if len(model.slots) == 1 else ("S", "O"):
            mark["linestyle"] = "-" if name == "S" else ""
            handles.append(Line2D([], [], marker=_MARKS[name], label=told[name], **mark))
        if pivots(model):
            pivot: dict[str, Any] = {"marker": "^", "color": BLACK, "mfc": "white", "linestyle": ""}
            handles.append(Line2D([], [], label="pivot on the ground", **pivot))
        if self.result is not None and (found := horizon(self.result)) is not None:
            handles.append(Line2D([], [], label=found[1], **BEYOND_LINE, linewidth=sized(BAND)))
        return handles


def _look(scene: Scene, own: Drawn) -> dict[str, Any]:
    """How a line is drawn; points of rigid bodies and hinges are dots."""
    looks: dict[str, dict[str, Any]] = {
        "curve": {"linewidth": 1.0, "zorder": 1},
        "wall": {"linewidth": 2.0, "zorder": 2},
        "guide": {"linewidth": sized(7), "solid_capstyle": "butt", "zorder": 2},
        "ring": {"linewidth": sized(1.2), "zorder": 3},
        "stop": {"linewidth": sized(2.2), "zorder": 3},
        "rope": {"linewidth": sized(1.2), "zorder": 3},
        "bar": {"linewidth": sized(2.2), "zorder": 4},
        "link": {"linewidth": 1.5, "marker": ".", "markersize": sized(3), "zorder": 4},
    }
    if own.kind == "bar" and isinstance(scene.bodies[own.line.name], RigidBody):
        looks["bar"] |= {"marker": "o", "markersize": sized(4)}
    return {"color": own.colour, **looks[own.kind]}


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
    found = [one for name in result.scene.all_contacts for one in strikes(result, name)]
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
        low, high = _zoom(panels[-1], sketch, result, strike)
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


def _zoom(
    axes: Axes, sketch: Sketch, result: Result, strike: Strike
) -> tuple[FloatArray, FloatArray]:
    """Draw a strike, and what vibrates after it, larger, at instants from its begin on.

    The window, whose corners (2,) m are returned, has the shape of the whole drawing.
    """
    until = min(strike.begin + ZOOM_TIME * (strike.end - strike.begin), float(result.time[-1]))
    times = np.linspace(strike.begin, until, ZOOM_INSTANTS)
    indices = [result.sample_at(time) for time in times]
    around = slice(indices[0], indices[-1] + 1)
    body = split_point(result.scene.all_contacts[strike.contact].striking)[0]
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
    words = title_at(result, index)
    if style.narrow and not what:  # there is room for one line beside the letter
        words = words.replace(", ", ",\n")
    beyond = "beyond the horizon" if is_beyond(result, float(result.time[index])) else ""
    return "\n".join(filter(None, (what, words, beyond)))
