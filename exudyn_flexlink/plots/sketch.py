"""A mechanism in some poses, as figures draw it into axes: bodies, path of S, named points."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import Mechanism, anchor_position, build_mechanism
from exudyn_flexlink.observables import point_anchor, watched_point
from exudyn_flexlink.plots.outline import (
    Drawn,
    body_lines,
    box_around,
    drawn_lines,
    lettered,
    named_points,
    pivots,
    together,
)
from exudyn_flexlink.plots.panels import BEYOND_LINE, horizon, length_unit, sized
from exudyn_flexlink.plots.style import BLACK, GREY
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import RigidBody, Scene

BODIES = ("wall", "guide", "bar", "link")  # kinds of lines that show bodies
SHOWN = ("curve", "ring", "rope", "stop", *BODIES)
LABELLED = {"curve": "", "stop": "stop", "rope": "rope or buffer"}
TOGETHER = 0.06  # of what is shown: names of points nearer than this would hide each other
BAND = 7.0  # points, of the shading along the path beyond the horizon
_MARKS = {"O": "+", "P": "s", "S": "o"}


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

    def body_legend(self, letters: Mapping[str, str] | None = None) -> list[Line2D]:
        """Entries for bodies, guides and curves; `letters` of bodies stand after their names."""
        curve = "track" if self.model.slots else "curve"
        bodies, curves = {}, {}
        for own in self.shown:
            look, body = _look(self.scene, own), own.line.name
            if own.kind in BODIES:
                told = f"{body} {(letters or {}).get(body, '')}".rstrip()
                label = f"walls of {told}" if own.kind == "wall" else told
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

    def name_points(self, axes: Axes, index: int, size: float) -> None:
        """Mark and name points as the paper does, in axes that show as much as `size` (m).

        S is drawn last; names of points near to each other stand together.
        """
        points = {
            name: np.asarray(anchor_position(anchor, self.poses[index]))
            for name, anchor in named_points(self.scene, self.model).items()
        }
        for name, place in points.items():
            if name in _MARKS:
                axes.plot(*self.unit[0] * place, **_mark(name), zorder=7 if name == "S" else 6)
        for first, names in together(points, TOGETHER * size).items():
            x, y = self.unit[0] * points[first]
            axes.annotate(
                ", ".join(sorted(names)),
                (x, y),
                xytext=(0, sized(5)),
                textcoords="offset points",
                ha="center",
                fontsize=mpl.rcParams["legend.fontsize"],
                annotation_clip=True,
                zorder=8,
                bbox={"fc": axes.get_facecolor(), "edgecolor": "none", "alpha": 0.6, "pad": 0.3},
            )

    def legend(self) -> list[Line2D]:
        """Entries for all that is drawn."""
        scene, model = self.scene, self.model
        handles = self.body_legend({body: pair for pair, body in lettered(scene).items()})
        told = {"S": f"S: {watched_point(scene)}, path", "P": "P: in the slot", "O": "O: origin"}
        for name in ("S", "P", "O") if len(model.slots) == 1 else ("S", "O"):
            line = "-" if name == "S" else ""
            look = {**_mark(name), "linestyle": line, "linewidth": 1.0}
            handles.append(Line2D([], [], label=told[name], **look))
        if pivots(model):
            pivot: dict[str, Any] = {"marker": "^", "color": BLACK, "mfc": "white", "linestyle": ""}
            handles.append(Line2D([], [], label="pivot on the ground", **pivot))
        if self.result is not None and (found := horizon(self.result)) is not None:
            handles.append(Line2D([], [], label=found[1], **BEYOND_LINE, linewidth=sized(BAND)))
        return handles


def _mark(name: str) -> dict[str, Any]:
    """How a point is marked; P is open and larger, so that S is seen where both are one point."""
    open_or_full = {"mfc": "white", "markersize": sized(7)} if name == "P" else {}
    return {"marker": _MARKS[name], "color": BLACK, "markersize": sized(4), **open_or_full}


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
