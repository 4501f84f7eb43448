"""Frames of a film as pixels: a fixed background is drawn once, moving parts in each frame.

The mechanism, the point S and glowing touches are drawn into axes in metres. Panels below enlarge
guides with clearance and struck faces, and show touches over time. Sizes are in pixels of a
picture `WIDE` pixels wide, times `thick`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgb, to_rgba
from matplotlib.figure import Figure
from matplotlib.path import Path
from matplotlib.patheffects import withStroke
from matplotlib.text import Annotation
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

from exudyn_flexlink.animation.film import Film, Zoom, strength
from exudyn_flexlink.animation.shots import GLOW_SECONDS, LABELLED, Frames, Shots
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import Channel, anchor_position
from exudyn_flexlink.observables import State, contact_states, turns
from exudyn_flexlink.plots.drawing import spots_along
from exudyn_flexlink.plots.forces import STATE_WORDS
from exudyn_flexlink.plots.frame import BLACK, BLUE, FAILED, GREY, settings, wrapped
from exudyn_flexlink.plots.outline import (
    Drawn,
    Mark,
    Viewpoint,
    coil,
    through,
    together,
    wall_lines,
    walled,
)
from exudyn_flexlink.plots.panels import BEYOND, length_unit

# Look of animations in every format:
INK, PALE, TOUCH, GLOW = BLACK, GREY, "#E5401A", "#FF7A22"

WIDTHS = {"curve": 1.4, "face": 5.0, "wall": 2.6, "guide": 9.0, "spring": 1.5, "ring": 1.6,
          "rope": 1.5, "stop": 4.0, "spoke": 1.2, "bar": 3.0, "link": 3.0}  # fmt: skip
"""Widths of lines, in pixels of a picture that is `WIDE` pixels wide."""
WIDE = 620.0
THINNEST, BROADEST = 0.75, 1.5  # factors of these widths in small and in large pictures
PALENESS = {"curve": 0.85, "face": 0.35, "spoke": 0.6, "guide": 0.8}
"""Opacity of lines; other lines have 1."""
HALO, HALO_PALE = 8.0, 0.2  # width and opacity of the halo around a bar

BAND, BAND_PALE = 2.4, 0.4  # factors of width and opacity of the first of two runs
THIN = 0.8  # factor of the width of the second run, a line on this band

TRAIL_SECONDS = 1.6  # s of the film without slow motion: time for which the trail of S stays dark
ARROW = (7.0, 15.0)  # pixels: shortest arrow in a zoom, and what the largest force adds
OFF_WALL = 11.0  # pixels: least distance from a wall to a number beside an arrow
BESIDE = 4.0  # pixels: from a glow to its number
BELOW = (13.0, 26.0, 39.0)  # pixels: from a touch down to its number; the choice hides least
SPOT = 5.0  # pixels: numbers keep off spots of a line; this is the distance of two spots
NAME_UP = 13.0  # pixels: from a point up to the middle of its name
MARK_UP = (-5.0, -11.0)  # pixels: from a joint up to two spots of its mark, which is below it

DOTS = 100  # pixels per inch
POINTS = 72 / DOTS  # points per pixel
NAMED_TOGETHER = 0.03  # of the picture: points nearer than this share one label
_RIM = ("white", 3.0)  # colour and width of the rim around words
_LAYERS = ((1.0, 0.22), (0.72, 0.3), (0.42, 0.5))  # of a glow: parts of its radius; opacities


def look_data() -> dict[str, object]:
    """Return the constants of this look that the player needs."""
    return {
        "ink": INK, "pale": PALE, "touch": TOUCH, "widths": WIDTHS, "wide": WIDE,
        "thinnest": THINNEST, "broadest": BROADEST, "paleness": PALENESS,
        "halo": [HALO, HALO_PALE], "band": [BAND, BAND_PALE], "thin": THIN,
        "trail": TRAIL_SECONDS, "glow": GLOW_SECONDS, "labelled": LABELLED,
        "arrow": ARROW, "offWall": OFF_WALL, "beside": BESIDE, "below": BELOW, "spot": SPOT,
        "nameUp": NAME_UP, "markUp": MARK_UP,
    }  # fmt: skip


def thickness(width: float) -> float:
    """Return the factor of line widths in a picture of a width in pixels."""
    return min(max(width / WIDE, THINNEST), BROADEST)


@dataclass(frozen=True)
class Place:
    """Axes in m for one run: factor of widths, and number of two runs; -1 if there is only one.

    A zoom has a viewpoint, in whose axes all its places are; the picture itself has none.
    """

    axes: Axes
    thick: float
    rank: int = -1
    view: Viewpoint | None = None

    def seen(self, points: FloatArray, poses: FloatArray) -> FloatArray:
        """Transform points (..., n, 2) m of the ground to these axes, with parts at `poses`."""
        return points if self.view is None else self.view.seen(points, poses)

    def points(self, pixels: float) -> float:
        """Convert a size in pixels to points."""
        return POINTS * self.thick * pixels

    @property
    def wide_and_pale(self) -> tuple[float, float]:
        """Factors of width and opacity; the first of two runs is a band, the second a line."""
        return {-1: (1.0, 1.0), 0: (BAND, BAND_PALE), 1: (THIN, 1.0)}[self.rank]

    def write(
        self, text: str, spot: FloatArray, away: tuple[float, float], size: float, **look: Any
    ) -> Annotation:
        """Write words at a place in m, shifted by `away` (points), with a rim for legibility.

        Words in a zoom are hidden if their place is outside it.
        """
        return self.axes.annotate(
            text, (float(spot[0]), float(spot[1])), away, textcoords="offset points", zorder=9,
            fontsize=self.points(size), annotation_clip=self.view is not None,
            path_effects=[withStroke(foreground=_RIM[0], linewidth=self.points(_RIM[1]))],
            snap=False, **{"color": INK, **look},  # snapped to pixels, an E would lose lines
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
    """Draw the mechanism of one run; parts in front come last."""
    model, poses = shots.take.model, shots.poses[frame]
    for channel in walled(model):
        upper, lower = (place.seen(wall.at(poses), poses) for wall in wall_lines(model, channel))
        corners = np.concatenate([upper, lower[::-1]])
        place.axes.fill(*corners.T, color="#A9A9A9", alpha=0.16, linewidth=0)
    time = shots.frames.times[frame]
    for drawn in shots.take.lines:
        if shots.take.exists(drawn, time):
            _draw_line(place, drawn, poses)
    for mark in shots.take.marks:
        if shots.take.exists(mark, time):
            _draw_mark(place, mark, poses)


def _draw_line(place: Place, drawn: Drawn, poses: FloatArray) -> None:
    """Draw a line; a bar has a halo, a circle is filled."""
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
    """Draw S and the names of the paper's points, in a picture `size` (m) large."""
    poses = shots.poses[frame]
    spots = {
        name: place.seen(anchor_position(anchor, poses)[None], poses)[0]
        for name, anchor in shots.take.named.items()
    }
    for name, marker in (("S", "o"), ("O", "+")):
        if name in spots:
            rim: dict[str, Any] = {"mec": "white", "mew": place.points(1.0)} if name == "S" else {}
            place.axes.plot(*spots[name], marker, color=INK, markersize=place.points(9), **rim)
    for first, names in together(spots, NAMED_TOGETHER * size).items():
        away = 0, place.points(7)
        place.write(", ".join(names), spots[first], away, 12, va="bottom", ha="center")


def draw_trail(place: Place, shots: Shots, frame: int) -> None:
    """Draw the last part of the path of S."""
    frames, (times, path) = shots.frames, shots.path
    now, lasts = frames.times[frame], TRAIL_SECONDS * frames.speed
    first, last = np.searchsorted(times, [now - lasts, now])
    points = np.concatenate([path[first:last], shots.watched[frame : frame + 1]])
    fresh = 1 - (now - np.append(times[first:last], now)[1:]) / lasts
    rgb = to_rgb(shots.take.colour or INK)
    trail = LineCollection(
        list(np.stack([points[:-1], points[1:]], axis=1)), capstyle="butt",
        linewidths=place.points(1.0) * (1 + 1.6 * fresh),
        colors=[(*rgb, 0.15 + 0.75 * f) for f in fresh.tolist()],
    )  # fmt: skip
    place.axes.add_collection(trail, autolim=False)


def draw_glows(place: Place, shots: Shots, frame: int, only: str = "") -> None:
    """Draw touches, or `only` those of one name: the force, and a glow that grows with it."""
    glows = [glow for glow in shots.glows(frame) if only in ("", glow.name)]
    spots = _spots(place, shots, frame) if any(glow.text for glow in glows) else np.empty((0, 2))
    for glow in glows:
        spot = place.seen(glow.place[None], shots.poses[glow.frame])[0]
        radius, fresh = 5 + 17 * glow.strength**0.5, glow.fresh
        ring = to_rgba(TOUCH, 0.8 * fresh)
        for part, opaque in _LAYERS:
            place.axes.plot(*spot, "o", color=to_rgba(GLOW, opaque * fresh), mew=0,
                            markersize=2 * place.points(part * radius))  # fmt: skip
        place.axes.plot(*spot, "o", mfc="none", color=ring, mew=place.points(1.5),
                        markersize=2 * place.points(radius * (1.25 - 0.6 * fresh)))  # fmt: skip
        if glow.text:
            number = place.write(glow.text, spot, (0, 0), 13, color=TOUCH, alpha=fresh,
                                 weight="bold", va="center", ha="center")  # fmt: skip
            box = _put_beside(place, number, radius, spots)
            # Later numbers keep off this one; corners on the edge of a box are not inside it.
            rim = box.padded(-1).corners()[[0, 2, 3, 1]]
            spots = np.concatenate([spots, spots_along(rim, SPOT)])


def _spots(place: Place, shots: Shots, frame: int) -> FloatArray:
    """Return spots (N, 2) in pixels that numbers keep off: spots of lines, marks and names."""
    poses, model = shots.poses[frame], shots.take.model
    lines = [drawn.line for drawn in shots.take.lines]
    lines += [wall for channel in walled(model) for wall in wall_lines(model, channel)]
    pixels = place.axes.transData.transform
    drawn_lines = [pixels(place.seen(line.at(poses), poses)) for line in lines]
    points = [anchor_position(anchor, poses) for anchor in shots.take.named.values()]
    marks = [anchor_position(mark.anchor, poses) for mark in shots.take.marks]
    beside = pixels(place.seen(np.stack([*points, *marks, *marks]), poses))
    ups = np.repeat([NAME_UP, *MARK_UP], [len(points), len(marks), len(marks)])
    beside[:, 1] += place.thick * ups
    along = [spots_along(line, SPOT) for line in drawn_lines]
    return np.concatenate([beside, *along])


def _put_beside(place: Place, number: Annotation, radius: float, spots: FloatArray) -> Bbox:
    """Put a number beside a glow of a radius, where it hides the fewest spots; return its box.

    Names of points are above, so numbers are below. Of two runs, only the second has numbers.
    """
    [middle] = place.axes.transData.transform([number.xy])
    half = np.array(number.get_window_extent().size) / 2
    aside = half[0] + (radius + BESIDE) * place.thick
    window = place.axes.get_window_extent()
    upwards = 1 if place.rank == 0 else -1
    least = np.inf
    for farther, down in enumerate(BELOW):
        for side in (1, -1, 0):
            lower = down if side else down + radius
            away = np.array([side * aside, upwards * lower * place.thick])
            spot = middle + away
            box = Bbox([spot - half, spot + half])
            hidden = box.count_contains(spots) + farther
            if box.x0 < window.x0 or box.x1 > window.x1:
                hidden += len(spots)
            if hidden < least:
                least, best = hidden, box
                number.set_position(tuple(POINTS * away))
    return best


EDGE = 0.02  # of the width: margin beside the line of time
LEAST = 0.15  # of its height: lowest touch
TOP, BOTTOM = 0.9, 0.25  # of the panel's height: limits of the line of time


class ZoomPanel:
    """The zoom of a name, for one run or for two over each other.

    `scale` is the scale of the picture above, pixels per m.
    """

    def __init__(self, place: Place, takes: Sequence[Shots], name: str, scale: float) -> None:
        self._place, self._takes = place, takes
        self._zooms = {i: shots.zooms[name] for i, shots in enumerate(takes) if name in shots.zooms}
        zoom = next(iter(self._zooms.values()))
        self._caption = zoom.words + _fit(place, zoom, scale)
        if zoom.channel is not None:
            draw_walls(place, zoom.channel)
        alone = len(takes) == 1 and zoom.channel is not None
        self._states = contact_states(takes[0].take.result, name) if alone else None

    def draw(self, frame: int) -> None:
        """Draw the moving parts of a frame."""
        axes, drawn_texts = self._place.axes, self._caption
        if self._states is not None:
            now = self._states.at(self._takes[0].frames.times[frame : frame + 1])[0]
            drawn_texts += f" \N{EN DASH} {STATE_WORDS[State(int(now))]}"
        elif len(self._takes) == 1:
            drawn_texts += self._away(frame)
        axes.text(
            0.012, 0.98, drawn_texts, transform=axes.transAxes, va="top", color="#666666",
            fontsize=self._place.points(12),
        )  # fmt: skip
        for i, zoom in self._zooms.items():
            shots = self._takes[i]
            place = replace(self._place, rank=i if len(self._takes) > 1 else -1, view=zoom.view)
            if zoom.channel is not None:
                draw_walled_link(place, shots, zoom.channel, frame)
                continue
            draw_mechanism(place, shots, frame)
            draw_glows(place, shots, frame, only=zoom.name)
            if place.rank <= 0:
                draw_points(place, shots, zoom.length, frame)

    def _away(self, frame: int) -> str:
        """Return the distance of the point that may strike, if it is outside the zoom on a face."""
        zoom, shots = self._zooms[0], self._takes[0]
        assert zoom.point is not None
        poses = shots.poses[frame]
        spot = zoom.view.seen(anchor_position(zoom.point, poses)[None], poses)[0]
        box = np.array([self._place.axes.get_xlim(), self._place.axes.get_ylim()]).T
        away = float(np.linalg.norm(spot - np.clip(spot, *box)))
        factor, unit = length_unit(shots.film.size)
        words = f"{zoom.point_name} is {factor * away:.3g} {unit} away"
        return f" \N{EN DASH} {words}" if away > 0 else ""


def _fit(place: Place, zoom: Zoom, scale: float) -> str:
    """Set the limits of axes to a zoom; return the text of its magnification.

    A guide may be larger across than along. A face never is, because that would distort angles.
    """
    axes = place.axes
    room = axes.get_window_extent()
    head = 20 * place.thick  # pixels: height of the line of words
    low, high = zoom.across
    across = (room.height - head) / (high - low)
    along = min(room.width / zoom.length, across)
    if zoom.channel is None:
        across = along
    middle, half = sum(zoom.along) / 2, room.width / along / 2
    axes.set_xlim(middle - half, middle + half)
    middle, half = sum(zoom.across) / 2, (room.height - head) / across / 2
    axes.set_ylim(middle - half, middle + half + head / across)
    if zoom.channel is None:
        return f", {along / scale:.2g} times larger"
    ratio = across / along
    return f", {ratio:.2g} times larger across" if ratio > 1.05 else ""


def draw_walls(place: Place, channel: Channel) -> None:
    """Draw the fixed parts of a zoom on a guide: walls, the room between them, and its middle."""
    axes, ends, c = place.axes, [0, channel.length], channel.clearance
    axes.fill_between(ends, -c, c, color="#A9A9A9", alpha=0.14, linewidth=0)
    for y in (c, -c):
        axes.plot(ends, [y, y], color=PALE, linewidth=place.points(3))
    axes.plot(ends, [0, 0], color=PALE, linewidth=place.points(0.8), linestyle=":")


def draw_walled_link(place: Place, shots: Shots, channel: Channel, frame: int) -> None:
    """Draw a link between the walls of its guide, with arrows for the forces on it."""
    poses, (wide, pale) = shots.poses[frame], place.wide_and_pale
    nodes = place.seen(through(channel.name, *channel.nodes).at(poses), poses)
    place.axes.plot(*nodes.T, color=shots.take.colour or BLUE, alpha=pale, marker=".",
                    markersize=place.points(9), linewidth=place.points(2.4) * wide)  # fmt: skip
    link = next(touching for touching in shots.touching if touching.name == channel.name)
    force = shots.forces(link, frame)
    assert link.places is not None
    tips, sides = place.seen(link.places.at(poses), poses), channel.sides
    for pair in np.flatnonzero(force > 0).tolist():
        strong = min(shots.film.part(float(force[pair])), 1.0) ** 0.5
        # Arrows press on the link: downwards from the upper wall, upwards from the lower wall.
        up = sides[pair] * place.points(ARROW[0] + ARROW[1] * strong)
        off = sides[pair] * max(abs(up), place.points(OFF_WALL))
        arrow = {"arrowstyle": "-|>", "color": TOUCH, "linewidth": place.points(2.2),
                 "shrinkA": 0, "shrinkB": 0, "mutation_scale": place.points(11)}  # fmt: skip
        place.axes.annotate(
            "", tuple(tips[pair]), (0, up), textcoords="offset points", arrowprops=arrow,
            annotation_clip=False,
        )  # fmt: skip
        # Numbers lie outside the walls, towards the guide's middle: no link is there.
        left = tips[pair, 0] > channel.length / 2
        place.write(
            f"{force[pair]:.3g} N", tips[pair], ((-1) ** left * place.points(7), off), 12,
            color=TOUCH, weight="bold", ha="right" if left else "left", va="center",
        )  # fmt: skip


def draw_timeline(place: Place, takes: Sequence[Shots]) -> None:
    """Draw the line of time; the height of a touch grows with its force."""
    axes, film = place.axes, takes[0].film
    span = film.end - film.begin
    margin = EDGE * span / (1 - 2 * EDGE)
    axes.set_xlim(film.begin - margin, film.end + margin)
    axes.set_ylim(0, 1)
    axes.fill_between([film.begin, film.end], BOTTOM, TOP, color=PALE, alpha=0.12, linewidth=0)
    if film.horizon is not None and film.horizon[0] < film.end:
        begin = max(film.horizon[0], film.begin)
        axes.fill_between([begin, film.end], BOTTOM, TOP, zorder=1, **BEYOND)
    for slow in film.slow:
        axes.fill_between([slow.begin, slow.end], BOTTOM, TOP, color=BLUE, alpha=0.2, linewidth=0)
    for shots in takes:
        for touching in shots.touching:
            touches = touching.touches
            high = [max(film.part(v) ** 0.5, LEAST) for v in strength(touches).tolist()]
            tops = BOTTOM + (TOP - BOTTOM) * np.array(high)
            ends = touches.until(film.end)
            bars = [
                [(begin, BOTTOM), (begin, top), (end, top), (end, BOTTOM)]
                for begin, end, top in zip(touches.begin, ends, tops, strict=True)
            ]
            shapes = PolyCollection(
                bars, facecolors=TOUCH, edgecolors=TOUCH, linewidths=place.points(1),
                alpha=0.9 if touching.places is None else 0.5,
            )  # fmt: skip
            axes.add_collection(shapes, autolim=False)


def draw_instant(place: Place, time: float) -> None:
    """Mark an instant (s) on the line of time."""
    place.axes.plot([time, time], [BOTTOM, TOP + 0.05], color=INK, linewidth=place.points(2))
    place.axes.plot(time, BOTTOM, "o", color=INK, markersize=place.points(9))


Pixels = NDArray[np.uint8]

HEAD, ZOOM, LINE = 30.0, 112.0, 26.0  # pixels: heights of the words, of a zoom, of the line of time
_FONT: dict[Any, Any] = {"font.family": "sans-serif", "text.usetex": False}
SCALE = 0.16  # of the width: longest scale of lengths


class Picture:
    """A picture of a film at its frames, `width` pixels wide; both sides are even."""

    def __init__(self, film: Film, frames: Frames, width: int) -> None:
        self._film, self._frames = film, frames
        self._shots = [Shots(film, take, frames) for take in film.takes]
        self._thick = thickness(width)
        names = list(dict.fromkeys(name for shots in self._shots for name in shots.zooms))
        low, high = film.box
        main = width * min(1.0, float((high - low)[1] / (high - low)[0]))
        heights = [h * self._thick for h in (HEAD, LINE, *[ZOOM] * len(names))]
        self.width, self.height = 2 * (width // 2), 2 * round((main + sum(heights)) / 2)
        self._figure = Figure((self.width / DOTS, self.height / DOTS), DOTS, facecolor="white")
        self._canvas = FigureCanvasAgg(self._figure)
        head, line, *zooms = heights
        bottom = line + sum(zooms)
        with settings(_FONT):
            self.axes = self._room(bottom, self.height - bottom - head)
            self._words(head)
            self._fit()
            both = len(self._shots) > 1
            self._places = [
                Place(self.axes, self._thick, i if both else -1) for i in range(len(self._shots))
            ]
            for place, shots in zip(self._places, self._shots, strict=True):
                look: dict[str, Any] = {"color": PALE, "linewidth": place.points(0.9)}
                self.axes.plot(*shots.path[1].T, **look, alpha=0.35)
            self._zooms = []
            for i, name in enumerate(names):
                place = Place(self._room(line + sum(zooms[i + 1 :]), zooms[i]), self._thick)
                self._zooms.append(ZoomPanel(place, self._shots, name, self._scale))
            self._line = Place(self._room(0, line), self._thick)
            draw_timeline(self._line, self._shots)
            self._canvas.draw()  # type: ignore[no-untyped-call]
            self._still = self._canvas.copy_from_bbox(self._figure.bbox)  # type: ignore[no-untyped-call]
        self._known = {artist for axes in self._figure.axes for artist in axes.get_children()}

    def __len__(self) -> int:
        return len(self._frames.times)

    def frame(self, frame: int) -> Pixels:
        """Return a frame (height, width, 4): red, green, blue, 255, as canvas and ffmpeg expect."""
        with settings(_FONT):
            self._canvas.restore_region(self._still)  # type: ignore[no-untyped-call]
            self._caption.set_text(self._text(frame))
            self._figure.draw_artist(self._caption)
            self._draw(frame)
            for axes in self._figure.axes:
                for artist in axes.get_children():
                    if artist not in self._known:
                        self._figure.draw_artist(artist)
                        artist.remove()
        return np.array(self._canvas.buffer_rgba())  # type: ignore[no-untyped-call]

    def _draw(self, frame: int) -> None:
        """Draw the moving parts of a frame; parts in front come last."""
        runs = list(zip(self._places, self._shots, strict=True))
        for place, shots in runs:
            draw_trail(place, shots, frame)
        for place, shots in runs:
            draw_mechanism(place, shots, frame)
        for place, shots in runs:
            draw_glows(place, shots, frame)
        draw_points(*runs[0], self._film.size, frame)
        for zoom in self._zooms:
            zoom.draw(frame)
        draw_instant(self._line, float(self._frames.times[frame]))

    def _room(self, bottom: float, height: float) -> Axes:
        """Return axes as wide as the picture; `bottom` and `height` are in pixels."""
        axes = self._figure.add_axes((0, bottom / self.height, 1, height / self.height))
        axes.set_axis_off()
        axes.set_autoscale_on(False)
        return axes

    def _fit(self) -> None:
        """Fit the film's box into the middle of the picture, and draw a scale of lengths."""
        low, high = self._film.box
        room = self.axes.get_window_extent()
        scale = min(room.width / (high - low)[0], room.height / (high - low)[1])
        self._scale = scale  # pixels per m
        half = np.array([room.width, room.height]) / scale / 2
        middle = (low + high) / 2
        self.axes.set_xlim(*(middle[0] + np.array([-1, 1]) * half[0]))
        self.axes.set_ylim(*(middle[1] + np.array([-1, 1]) * half[1]))
        wanted = SCALE * 2 * half[0]
        power = 10.0 ** np.floor(np.log10(wanted))
        length = next(step * power for step in (5, 2, 1) if step * power <= wanted)
        pixel = 1 / scale
        left, bottom = middle - half + 12 * self._thick * pixel
        tick = 4 * self._thick * pixel
        corners = [(left, tick), (left, 0), (left + length, 0), (left + length, tick)]
        x, y = np.array(corners).T
        thin = POINTS * self._thick
        self.axes.plot(x, bottom + y, color=PALE, linewidth=1.2 * thin)
        factor, unit = length_unit(self._film.size)
        self.axes.text(
            left + length / 2, bottom + 1.2 * tick, f"{factor * length:.3g} {unit}", ha="center",
            va="bottom", fontsize=11 * thin, color=PALE,
        )  # fmt: skip
        wide = (1 - 2 * SCALE) * self.width / DOTS
        lines = wrapped(self._film.doubts, wide, 11 * thin)
        self.axes.text(
            2 * middle[0] - left, bottom, "\n".join(lines), ha="right", va="bottom",
            fontsize=11 * thin, color=FAILED, parse_math=False,
        )  # fmt: skip

    def _words(self, head: float) -> None:
        """Write the line of words at the top; two runs also have their names there."""
        size, place = 13 * POINTS * self._thick, 1 - 0.5 * head / self.height
        x = 12 * self._thick / self.width
        self._caption = self._figure.text(x, place, "", va="center", fontsize=size, color=INK)
        self._caption.set_animated(True)
        takes = self._film.takes if len(self._film.takes) > 1 else ()
        right = 1 - x
        for take in reversed(takes):
            name = self._figure.text(
                right, place, take.name, ha="right", va="center", fontsize=size, weight="bold",
                color=take.colour, parse_math=False,
            )  # fmt: skip
            extent = name.get_window_extent()
            right -= (extent.width + 14 * self._thick) / self.width

    def _text(self, frame: int) -> str:
        """Return time, crank angle and speed of a frame as text."""
        time, speed = self._frames.times[frame], self._frames.speeds[frame]
        digits = min(max(int(np.ceil(-np.log10(speed / 25))), 0), 9)
        words = [f"t = {time:.{digits}f} s"]
        crank = self._shots[0].crank
        if crank is not None:
            degrees = float(np.degrees(crank[frame]))
            whole = turns(self._shots[0].take.result)
            words.append(f"crank {degrees:.0f}°" if whole else f"angle {degrees:.1f}°")
        slow = "slow motion, " if speed < self._frames.speed else ""
        words.append(f"{slow}{speed:.2g} \N{MULTIPLICATION SIGN} real time")
        return "   ".join(words).replace("-", "\N{MINUS SIGN}")
