"""What moves in a picture, drawn into axes in metres at a frame: mechanism, S, glowing touches.

Sizes are in pixels of a picture `WIDE` pixels wide, times `thick`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb, to_rgba
from matplotlib.path import Path
from matplotlib.patheffects import withStroke

from exudyn_flexlink.animation.shots import GLOW_SECONDS, LABELLED, Shots
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import anchor_position
from exudyn_flexlink.plots.outline import (
    Drawn,
    Mark,
    Viewpoint,
    coil,
    together,
    wall_lines,
    walled,
)
from exudyn_flexlink.plots.style import BLACK, GREY

# How animations look, the same in every format:
INK, PALE, TOUCH, GLOW = BLACK, GREY, "#E5401A", "#FF7A22"

WIDTHS = {"curve": 1.4, "face": 5.0, "wall": 2.6, "guide": 9.0, "spring": 1.5, "ring": 1.6,
          "rope": 1.5, "stop": 4.0, "spoke": 1.2, "bar": 3.0, "link": 3.0}  # fmt: skip
"""Widths of lines, in pixels of a picture that is `WIDE` pixels wide."""
WIDE = 620.0
THINNEST, BROADEST = 0.75, 1.5  # times those widths, in small and in large pictures
PALENESS = {"curve": 0.85, "face": 0.35, "spoke": 0.6, "guide": 0.8}
"""Opacity of lines, where it is not 1."""
HALO, HALO_PALE = 8.0, 0.2  # width and opacity of what is around a bar

BAND, BAND_PALE = 2.4, 0.4  # of two runs the first is a band, so many times as wide and as opaque,
THIN = 0.8  # on which the second is a line so many times as wide

TRAIL_SECONDS = 1.6  # of the film without slow motion: how long the trail of S stays dark
ARROW = (7.0, 15.0)  # pixels: length of an arrow in the zoom, and what the largest force adds

POINTS = 0.72  # in a pixel: pictures have 100 pixels in an inch
NEAR = 0.03  # of the picture: points nearer than this are named together
_RIM = ("white", 3.0)  # colour and width of what is around words
_LAYERS = ((1.0, 0.22), (0.72, 0.3), (0.42, 0.5))  # of a glow: parts of its radius, and opacity


def look_data() -> dict[str, object]:
    """Return what the player needs of it."""
    return {
        "ink": INK, "pale": PALE, "touch": TOUCH, "widths": WIDTHS, "wide": WIDE,
        "thinnest": THINNEST, "broadest": BROADEST, "paleness": PALENESS,
        "halo": [HALO, HALO_PALE], "band": [BAND, BAND_PALE], "thin": THIN,
        "trail": TRAIL_SECONDS, "glow": GLOW_SECONDS, "labelled": LABELLED,
        "arrow": ARROW,
    }  # fmt: skip


def thickness(width: float) -> float:
    """How many times as wide lines are in a picture of a width in pixels."""
    return min(max(width / WIDE, THINNEST), BROADEST)


@dataclass(frozen=True)
class Place:
    """Where something is drawn: axes in m, how thick, and which of two runs; -1: there is one.

    A zoom has a viewpoint, from which it shows all places; the picture itself has none.
    """

    axes: Axes
    thick: float
    rank: int = -1
    view: Viewpoint | None = None

    def seen(self, points: FloatArray, poses: FloatArray) -> FloatArray:
        """Points (..., n, 2) m of the ground in these axes, with the parts at `poses`."""
        return points if self.view is None else self.view.seen(points, poses)

    def points(self, pixels: float) -> float:
        """A size in points, of one in pixels."""
        return POINTS * self.thick * pixels

    @property
    def wide_and_pale(self) -> tuple[float, float]:
        """Of two runs the first is a broad pale band, on which the second is a line."""
        return {-1: (1.0, 1.0), 0: (BAND, BAND_PALE), 1: (THIN, 1.0)}[self.rank]

    def write(
        self, text: str, at: FloatArray, away: tuple[float, float], size: float, **look: Any
    ) -> None:
        """Write words at a place in m, `away` from it by points; with a rim, to be read on lines.

        Those of a zoom are not seen where their place is out of it.
        """
        self.axes.annotate(
            text, (float(at[0]), float(at[1])), away, textcoords="offset points", zorder=9,
            fontsize=self.points(size), annotation_clip=self.view is not None,
            path_effects=[withStroke(foreground=_RIM[0], linewidth=self.points(_RIM[1]))],
            snap=False, **{"color": INK, **look},  # snapped to pixels, the lines of an E vanish
        )  # fmt: skip


_GROUND = Path(
    [(0, 0), (-0.68, -1), (0.68, -1), (0, 0), (-1.36, -1), (1.36, -1)],
    [Path.MOVETO, *[Path.LINETO] * 3, Path.MOVETO, Path.LINETO],
)
_WALL = Path(
    [(0, -1), (0, 1), *(end for k in range(5) for end in ((-0.6, k / 2 - 1.2), (0, k / 2 - 0.8)))],
    [Path.MOVETO, Path.LINETO] * 6,
)
_ROUND: dict[str, Any] = {"marker": "o", "mfc": "white"}
_MARKS: dict[str, list[tuple[dict[str, Any], float]]] = {
    "revolute": [(_ROUND, 7)],
    "revolute, on the ground": [({"marker": _GROUND, "mfc": "white"}, 30), (_ROUND, 7)],
    "weld": [({"marker": "s", "mfc": INK}, 6)],
    "weld, to the ground": [({"marker": _WALL, "mfc": "none"}, 28)],
    "in a slot": [(_ROUND, 8.5)],
    "prismatic": [({"marker": "s", "mfc": "white"}, 10)],
}
"""Markers of a joint, and their sizes in pixels."""


def draw_mechanism(place: Place, shots: Shots, frame: int) -> None:
    """Draw the mechanism of one take, what is in front last."""
    model, poses = shots.take.model, shots.poses[frame]
    for channel in walled(model):
        upper, lower = (place.seen(wall.at(poses), poses) for wall in wall_lines(model, channel))
        corners = np.concatenate([upper, lower[::-1]])
        place.axes.fill(*corners.T, color="#A9A9A9", alpha=0.16, linewidth=0)
    for drawn in shots.take.lines:
        _draw_line(place, drawn, poses)
    for mark in shots.take.marks:
        _draw_mark(place, mark, poses)


def _draw_line(place: Place, drawn: Drawn, poses: FloatArray) -> None:
    """Draw a line; around a bar is a halo, a circle is filled."""
    kind, axes, (wide, pale) = drawn.kind, place.axes, place.wide_and_pale
    points = place.seen(drawn.line.at(poses), poses)
    points = coil(points) if kind == "spring" else points
    look: dict[str, Any] = {"color": drawn.colour, "solid_joinstyle": "round"}
    look["solid_capstyle"] = "butt" if kind == "guide" else "round"
    if kind == "link" and place.rank != 0:
        look |= {"marker": ".", "markersize": place.points(7)}
    if kind == "bar" and len(points) == 1:
        look |= {"marker": "o", "markersize": place.points(10)}
    if kind == "bar":
        axes.plot(*points.T, **look, linewidth=place.points(HALO) * wide, alpha=HALO_PALE * pale)
    if kind == "ring":
        axes.fill(*points.T, color=drawn.colour, alpha=0.12 * pale, linewidth=0)
    width, opaque = place.points(WIDTHS[kind]) * wide, pale * PALENESS.get(kind, 1.0)
    axes.plot(*points.T, **look, linewidth=width, alpha=opaque)


def _draw_mark(place: Place, mark: Mark, poses: FloatArray) -> None:
    """Draw the symbol of a joint."""
    [(x, y)] = place.seen(anchor_position(mark.anchor, poses)[None], poses)
    for marker, size in _MARKS[mark.kind]:
        place.axes.plot(x, y, color=INK, linestyle="", mew=place.points(1.6), **marker,
                        markersize=place.points(size))  # fmt: skip


def draw_points(place: Place, shots: Shots, size: float, frame: int) -> None:
    """Draw S and the names of the points that the paper names, in a picture `size` (m) large."""
    poses = shots.poses[frame]
    at = {
        name: place.seen(anchor_position(anchor, poses)[None], poses)[0]
        for name, anchor in shots.take.named.items()
    }
    for name, marker in (("S", "o"), ("O", "+")):
        if name in at:
            rim: dict[str, Any] = {"mec": "white", "mew": place.points(1.0)} if name == "S" else {}
            place.axes.plot(*at[name], marker, color=INK, markersize=place.points(9), **rim)
    for first, names in together(at, NEAR * size).items():
        away = 0, place.points(7)
        place.write(", ".join(names), at[first], away, 12, va="bottom", ha="center")


def draw_trail(place: Place, shots: Shots, frame: int) -> None:
    """Draw what S went last."""
    frames, (times, path) = shots.frames, shots.path
    at, lasts = frames.times[frame], TRAIL_SECONDS * frames.speed
    first, last = np.searchsorted(times, [at - lasts, at])
    points = np.concatenate([path[first:last], shots.watched[frame : frame + 1]])
    fresh = 1 - (at - np.append(times[first:last], at)[1:]) / lasts
    rgb = to_rgb(shots.take.colour or INK)
    own = LineCollection(
        list(np.stack([points[:-1], points[1:]], axis=1)), capstyle="butt",
        linewidths=place.points(1.0) * (1 + 1.6 * fresh),
        colors=[(*rgb, 0.15 + 0.75 * f) for f in fresh.tolist()],
    )  # fmt: skip
    place.axes.add_collection(own, autolim=False)


def draw_glows(place: Place, shots: Shots, frame: int, only: str = "") -> None:
    """Draw touches, or `only` those of one name: a glow as large as the force, and the force."""
    line, (low, high) = 0, place.axes.get_xlim()
    for glow in shots.glows(frame):
        if only not in ("", glow.name):
            continue
        at = place.seen(glow.place[None], shots.poses[glow.frame])[0]
        radius, fresh = 5 + 17 * glow.strength**0.5, glow.fresh
        ring = to_rgba(TOUCH, 0.8 * fresh)
        for part, opaque in _LAYERS:
            place.axes.plot(*at, "o", color=to_rgba(GLOW, opaque * fresh), mew=0,
                            markersize=2 * place.points(part * radius))  # fmt: skip
        place.axes.plot(*at, "o", mfc="none", color=ring, mew=place.points(1.5),
                        markersize=2 * place.points(radius * (1.25 - 0.6 * fresh)))  # fmt: skip
        if glow.text:
            left = at[0] > high - 0.16 * (high - low)
            aside = place.points(radius + 4) * (-1) ** left
            # Names of points are above: forces are below, of two runs those of the second alone.
            up = place.points(10 + 14 * line) * (1 if place.rank == 0 else -1)
            place.write(glow.text, at, (aside, up), 13, color=TOUCH, alpha=fresh, weight="bold",
                        va="center", ha="right" if left else "left")  # fmt: skip
            line += 1
