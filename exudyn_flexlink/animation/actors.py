"""What moves in a picture: lines, marks, points, the trail of S and glowing touches, as artists.

An actor draws into axes in metres, once; `show` moves it to a frame. Sizes are in pixels of a
picture `WIDE` pixels wide, times `thick`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.patches import Polygon
from matplotlib.path import Path
from matplotlib.patheffects import withStroke
from matplotlib.text import Annotation

from exudyn_flexlink.animation.look import (
    BAND,
    BAND_PALE,
    GLOW,
    HALO,
    HALO_PALE,
    INK,
    PALE,
    PALENESS,
    THIN,
    TOUCH,
    TRAIL_SECONDS,
    WIDTHS,
)
from exudyn_flexlink.animation.shots import Glow, Shots
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import anchor_position
from exudyn_flexlink.plots.outline import Drawn, Line, Mark, Viewpoint, coil, wall_lines, walled

POINTS = 0.72  # in a pixel: pictures have 100 pixels in an inch
NEAR = 0.03  # of the picture: points nearer than this are named together
_RIM = ("white", 3.0)  # colour and width of what is around words


class Actor(Protocol):
    """Something that moves."""

    @property
    def artists(self) -> Sequence[Artist]:
        """What is drawn at a frame."""

    def show(self, frame: int) -> None:
        """Move to a frame."""


@dataclass(frozen=True)
class Place:
    """Where actors draw: axes in m, how thick, and which of two runs; -1: there is one.

    A zoom has a viewpoint, from which they see all places; in the picture itself there is none.
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


class LineActor:
    """A line of the mechanism; around a bar is a halo, a circle is filled."""

    def __init__(self, place: Place, shots: Shots, drawn: Drawn) -> None:
        self._line, self._kind = drawn.line, drawn.kind
        self._place, self._shots = place, shots
        (wide, pale), axes, colour = place.wide_and_pale, place.axes, drawn.colour
        look: dict[str, Any] = {"color": colour, "solid_joinstyle": "round"}
        look["solid_capstyle"] = "butt" if drawn.kind == "guide" else "round"
        width = place.points(WIDTHS[drawn.kind])
        opaque = pale * PALENESS.get(drawn.kind, 1.0)
        if drawn.kind == "link" and place.rank != 0:
            look |= {"marker": ".", "markersize": place.points(7)}
        if drawn.kind == "bar" and len(drawn.line.parts) == 1:
            look |= {"marker": "o", "markersize": place.points(10)}
        self.artists: list[Any] = []
        if drawn.kind == "bar":
            halo = {**look, "linewidth": place.points(HALO) * wide, "alpha": HALO_PALE * pale}
            self.artists += axes.plot([], [], **halo)
        if drawn.kind == "ring":
            self.artists += axes.fill([0], [0], color=colour, alpha=0.12 * pale, linewidth=0)
        self.artists += axes.plot([], [], **look, linewidth=width * wide, alpha=opaque)

    def show(self, frame: int) -> None:
        """Move to a frame."""
        poses = self._shots.poses[frame]
        points = self._place.seen(self._line.at(poses), poses)
        points = coil(points) if self._kind == "spring" else points
        for artist in self.artists:
            if isinstance(artist, Polygon):
                artist.set_xy(points)
            else:
                artist.set_data(*points.T)


class ChannelActor:
    """The room between the walls of a guide."""

    def __init__(self, place: Place, shots: Shots, walls: Sequence[Line]) -> None:
        self._walls, self._place, self._shots = walls, place, shots
        self.artists = place.axes.fill([0], [0], color="#A9A9A9", alpha=0.16, linewidth=0)

    def show(self, frame: int) -> None:
        """Move to a frame."""
        poses = self._shots.poses[frame]
        upper, lower = (self._place.seen(wall.at(poses), poses) for wall in self._walls)
        self.artists[0].set_xy(np.concatenate([upper, lower[::-1]]))


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


class MarkActor:
    """The symbol of a joint."""

    def __init__(self, place: Place, shots: Shots, mark: Mark) -> None:
        self._anchor, self._place, self._shots = mark.anchor, place, shots
        look: dict[str, Any] = {"color": INK, "linestyle": "", "mew": place.points(1.6)}
        self.artists = [
            artist
            for marker, size in _MARKS[mark.kind]
            for artist in place.axes.plot([], [], **look, **marker, markersize=place.points(size))
        ]

    def show(self, frame: int) -> None:
        """Move to a frame."""
        poses = self._shots.poses[frame]
        [(x, y)] = self._place.seen(anchor_position(self._anchor, poses)[None], poses)
        for artist in self.artists:
            artist.set_data([x], [y])


class PointsActor:
    """S as a dot, and the names of the points that the paper names."""

    def __init__(self, place: Place, shots: Shots, size: float) -> None:
        self._place, self._shots, self._near = place, shots, NEAR * size
        self._points = shots.take.named
        dot: dict[str, Any] = {"color": INK, "linestyle": ""}
        self._dots = {
            "S": place.axes.plot([], [], "o", **dot, markersize=place.points(8.8))[0],
            "O": place.axes.plot([], [], "+", **dot, markersize=place.points(9))[0],
        }
        self._dots["O"].set_visible("O" in self._points)
        self._names = {name: words(place, 12, va="bottom", ha="center") for name in self._points}
        for name in self._names.values():
            name.set_position((0, place.points(7)))
        self.artists = [*self._dots.values(), *self._names.values()]

    def show(self, frame: int) -> None:
        """Move to a frame."""
        poses = self._shots.poses[frame]
        at = {
            name: self._place.seen(anchor_position(anchor, poses)[None], poses)[0]
            for name, anchor in self._points.items()
        }
        for name in self._dots.keys() & at.keys():
            self._dots[name].set_data(*at[name][:, None])
        told: list[str] = []
        for name, place in at.items():
            near = [k for k in told if np.max(np.abs(at[k] - place)) < self._near]
            self._names[name].set_visible(not near)
            self._names[name].set_text(name)
            self._names[name].xy = tuple(place)
            if near:
                own = self._names[near[0]]
                own.set_text(f"{own.get_text()}, {name}")
            else:
                told.append(name)


class TrailActor:
    """The whole path of S, pale, and what it went last."""

    def __init__(self, place: Place, shots: Shots) -> None:
        self._shots = shots
        self._times, self._path = shots.path
        colour = shots.take.colour or INK
        self._rgb, self._thick = to_rgb(colour), place.points(1.0)
        pale: dict[str, Any] = {"color": PALE, "linewidth": place.points(0.9), "alpha": 0.35}
        self.still: list[Artist] = [*place.axes.plot(*self._path.T, **pale)]
        own = LineCollection([], capstyle="butt")
        place.axes.add_collection(own, autolim=False)
        self._own, self.artists = own, [own]

    def show(self, frame: int) -> None:
        """Move to a frame."""
        frames = self._shots.frames
        at, lasts = frames.times[frame], TRAIL_SECONDS * frames.speed
        first, last = np.searchsorted(self._times, [at - lasts, at])
        points = np.concatenate([self._path[first:last], self._shots.watched[frame : frame + 1]])
        fresh = 1 - (at - np.append(self._times[first:last], at)[1:]) / lasts
        self._own.set_segments(list(np.stack([points[:-1], points[1:]], axis=1)))
        self._own.set_linewidth(self._thick * (1 + 1.6 * fresh))
        self._own.set_color([(*self._rgb, 0.15 + 0.75 * f) for f in fresh.tolist()])


_LAYERS = ((1.0, 0.22), (0.72, 0.3), (0.42, 0.5))  # of a glow: parts of its radius, and opacity


class GlowsActor:
    """Touches, or `only` those of one name: a glow as large as the force, and the force."""

    def __init__(self, place: Place, shots: Shots, only: str = "") -> None:
        self._place, self._shots, self._only = place, shots, only
        axes = place.axes
        self._disks = axes.scatter([], [], linewidths=0, zorder=8)
        self._rings = axes.scatter([], [], facecolors="none", linewidths=place.points(1.5))
        self._texts = [words(place, 13, va="center", weight="bold") for _ in shots.touching]
        for text in self._texts:
            text.set_color(TOUCH)
        self.artists: list[Artist] = [self._disks, self._rings, *self._texts]

    def show(self, frame: int) -> None:
        """Move to a frame."""
        glows = self._shots.glows(frame)
        glows = [glow for glow in glows if self._only in ("", glow.name)]
        for artist in (self._disks, self._rings):
            artist.set_visible(bool(glows))
        for text in self._texts:
            text.set_visible(False)
        if not glows:
            return
        at = np.array([self._at(glow) for glow in glows])
        fresh = np.array([glow.fresh for glow in glows])
        radii = np.array([5 + 17 * glow.strength**0.5 for glow in glows])
        self._disks.set_offsets(np.tile(at, (len(_LAYERS), 1)))
        self._disks.set_sizes(np.concatenate([self._areas(part * radii) for part, _ in _LAYERS]))
        self._disks.set_facecolor(
            [(*to_rgb(GLOW), opaque * f) for _, opaque in _LAYERS for f in fresh.tolist()]
        )
        self._rings.set_offsets(at)
        self._rings.set_sizes(self._areas(radii * (1.25 - 0.6 * fresh)))
        self._rings.set_edgecolor([(*to_rgb(TOUCH), 0.8 * f) for f in fresh.tolist()])
        told = [(glow, radius) for glow, radius in zip(glows, radii, strict=True) if glow.text]
        for i, (text, (glow, radius)) in enumerate(zip(self._texts, told, strict=False)):
            self._tell(text, glow, float(radius), i)

    def _at(self, glow: Glow) -> FloatArray:
        """Where a glow is drawn (2,), m."""
        return np.asarray(self._place.seen(glow.place[None], self._shots.poses[glow.frame])[0])

    def _areas(self, radii: FloatArray) -> FloatArray:
        """Sizes of markers, in square points, of radii in pixels."""
        return np.asarray((2 * self._place.points(1.0) * radii) ** 2)

    def _tell(self, text: Annotation, glow: Glow, radius: float, line: int) -> None:
        """Write the force beside its glow, on the side where there is room."""
        low, high = self._place.axes.get_xlim()
        place = self._at(glow)
        left = place[0] > high - 0.16 * (high - low)
        away = self._place.points(radius + 4)
        text.set(text=glow.text, alpha=glow.fresh, visible=True, ha="right" if left else "left")
        text.xy = tuple(place)
        # The forces of the second run are told below its touches, those of the first above.
        up = self._place.points(10 + 14 * line) * (-1 if self._place.rank > 0 else 1)
        text.set_position((-away if left else away, up))


def mechanism_actors(place: Place, shots: Shots) -> list[Actor]:
    """Return the mechanism of one take, those in front last."""
    model = shots.take.model
    return [
        *(ChannelActor(place, shots, wall_lines(model, channel)) for channel in walled(model)),
        *(LineActor(place, shots, drawn) for drawn in shots.take.lines),
        *(MarkActor(place, shots, mark) for mark in shots.take.marks),
    ]


def words(place: Place, size: float, **look: Any) -> Annotation:
    """Words at a place in m, moved away from it by points; with a rim, to be read on lines.

    Those of a zoom are not seen where their place is out of it.
    """
    own = place.axes.annotate(
        "", (0, 0), (0, 0), textcoords="offset points", fontsize=place.points(size), color=INK,
        annotation_clip=place.view is not None, **look,
    )  # fmt: skip
    own.set_path_effects([withStroke(foreground=_RIM[0], linewidth=place.points(_RIM[1]))])
    own.set_zorder(9)
    return own
