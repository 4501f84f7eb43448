"""Bodies, walls, slots and named points of a mechanism at one instant, drawn into axes."""

from __future__ import annotations

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
    body_lines,
    box_around,
    curve_line,
    curved,
    guides,
    is_flexible,
    pivots,
    rings,
    wall_lines,
    walled,
)
from exudyn_flexlink.plots.panels import BEYOND_LINE, horizon, length_unit, sized
from exudyn_flexlink.plots.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, RED
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import RigidBody, Scene

_WALL: dict[str, Any] = {"color": "#A9A9A9", "linewidth": 2.0, "zorder": 2}
_BODY_COLOURS = ("#9A9A9A", BLUE, RED, GREEN, PURPLE, ORANGE)
BAND = 7.0  # points, of the shading along the path beyond the horizon
_MARKS = {"O": "+", "P": "s", "S": "o"}


@dataclass(frozen=True)
class Posed:
    """A scene's mechanism in some poses (N, parts, 3): x, y in m and the angle of every part."""

    scene: Scene
    poses: FloatArray

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
        every = max(1, len(self.poses) // 200)
        points = [self.track]
        for body in self.scene.bodies:
            points += self.lines(body, slice(None, None, every))
        ends = self.poses[[0, -1]]
        points += [curve_line(track).at(ends) for track in curved(self.model)]
        points += [np.array([at.x, at.y]) for at in pivots(self.model)]
        points += [ring.at(self.poses[0]) for ring in rings(self.model)]
        return box_around(points)

    @cached_property
    def unit(self) -> tuple[float, str]:
        """Factor from m, and name, of the unit of lengths."""
        low, high = self.box
        return length_unit(float(np.max(high - low)))

    def window(self, axes: Axes, box: tuple[FloatArray, FloatArray]) -> None:
        """Let axes show a box, by its corners (2,) m."""
        low, high = (self.unit[0] * corner for corner in box)
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
        axes.set_aspect("equal")

    def lines(self, body: str, samples: slice) -> list[FloatArray]:
        """Polylines (instants, points, 2) in m for a body: its rods, or rays to its points."""
        own = body_lines(self.scene, self.model, body)
        return [line.at(self.poses[samples]) for line in own]

    def draw(self, axes: Axes, index: int, alpha: float = 1.0) -> None:
        """Draw curves, bodies and pivots on the ground at a sample."""
        factor, model, q = self.unit[0], self.model, self.poses[index]
        for track in curved(model):
            axes.plot(*(factor * curve_line(track).at(q)).T, color=PURPLE, linewidth=1.0, zorder=1)
        for i, body in enumerate(self.scene.bodies):
            own = model.parts_of(body)
            walls = [c for c in walled(model) if c.guide.part in own]
            lines = [wall for channel in walls for wall in wall_lines(model, channel)]
            look = _WALL if walls else _body_style(self.scene, body, i)
            for line in lines or body_lines(self.scene, model, body):
                axes.plot(*(factor * line.at(q)).T, **look, alpha=alpha)
        for ring in rings(model):
            axes.plot(*(factor * ring.at(q)).T, color=GREY, linewidth=sized(1.2), alpha=alpha,
                      zorder=3)  # fmt: skip
        for at in pivots(model):
            axes.plot(factor * at.x, factor * at.y, "^", color=BLACK, mfc="white",
                      markersize=sized(7), zorder=5)  # fmt: skip

    def body_legend(self) -> list[Line2D]:
        """Entries for bodies, guides and curves."""
        scene, model = self.scene, self.model
        with_walls = {model.parts[channel.guide.part].body for channel in walled(model)}
        handles = []
        for i, body in enumerate(scene.bodies):
            if body in with_walls:
                handles.append(Line2D([], [], label=f"walls of {body}", **_WALL))
                continue
            handles.append(Line2D([], [], label=body, **_body_style(scene, body, i)))
        if curved(model):
            label = "track" if model.slots else "curve"
            handles.append(Line2D([], [], color=PURPLE, linewidth=1.0, label=label))
        return handles


@dataclass(frozen=True)
class Sketch(Posed):
    """What is drawn of a run: its mechanism, and the path of the watched point S."""

    result: Result

    @classmethod
    def of(cls, result: Result) -> Sketch:
        """Return that of a run."""
        return cls(result.scene, result.poses, result)

    def draw_path(self, axes: Axes, done: slice) -> None:
        """Draw where S goes, the part of the samples `done` in black."""
        factor, _ = self.unit
        axes.plot(*(factor * self.track).T, color=GREY, linewidth=sized(0.7), zorder=1)
        axes.plot(*(factor * self.track[done]).T, color=BLACK, linewidth=sized(1.0), zorder=2)
        found = horizon(self.result)
        if found is not None:
            beyond = self.track[self.result.time >= found[0]]
            axes.plot(*(factor * beyond).T, **BEYOND_LINE, linewidth=sized(BAND))

    def name_points(self, axes: Axes, index: int) -> None:
        """Mark and name, as the paper does, the origin O, P in the one slot, and S."""
        points = {"O": np.zeros(2), "S": self.track[index]}
        if len(self.model.slots) == 1:
            at = self.model.slots[0].anchor
            points["P"] = np.asarray(anchor_position(at, self.result.poses[index]))
        for name, place in points.items():
            shown = self.unit[0] * place
            axes.plot(*shown, _MARKS[name], color=BLACK, markersize=sized(4), zorder=6)
            together = [k for k, other in points.items() if np.allclose(other, place, atol=1e-9)]
            if name != together[0]:
                continue
            axes.annotate(
                ", ".join(sorted(together)),
                shown,
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
        mark: dict[str, Any] = {"color": BLACK, "markersize": sized(4)}
        handles.append(
            Line2D(
                [], [], marker="o", linewidth=1.0, label=f"S: {watched_point(scene)}, path", **mark
            )
        )
        if len(model.slots) == 1:
            handles.append(Line2D([], [], marker="s", linestyle="", label="P: in the slot", **mark))
        handles.append(Line2D([], [], marker="+", linestyle="", label="O: origin", **mark))
        if pivots(model):
            pivot: dict[str, Any] = {"marker": "^", "color": BLACK, "mfc": "white", "linestyle": ""}
            handles.append(Line2D([], [], label="pivot on the ground", **pivot))
        found = horizon(self.result)
        if found is not None:
            handles.append(Line2D([], [], label=found[1], **BEYOND_LINE, linewidth=sized(BAND)))
        return handles


def body_colour(number: int) -> str:
    """Colour of a body, by its number in the scene."""
    return _BODY_COLOURS[number % len(_BODY_COLOURS)]


def _body_style(scene: Scene, body: str, number: int) -> dict[str, Any]:
    """Guides are broad and pale, so that what slides in them is seen; hinges are dots."""
    if body in guides(scene):
        return {"color": "#C9C9C9", "linewidth": sized(7), "solid_capstyle": "butt", "zorder": 2}
    style: dict[str, Any] = {"color": body_colour(number), "linewidth": sized(2.2), "zorder": 4}
    if is_flexible(scene, body):
        style |= {"linewidth": 1.5, "marker": ".", "markersize": sized(3)}
    dots = {"marker": "o", "markersize": sized(4)}
    return style | (dots if isinstance(scene.bodies[body], RigidBody) else {})
