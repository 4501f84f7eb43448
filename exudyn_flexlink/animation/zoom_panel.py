"""Panels below the picture: guides with clearance and struck faces, larger; touches over time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.collections import PolyCollection

from exudyn_flexlink.animation.actors import (
    Actor,
    GlowsActor,
    Place,
    PointsActor,
    mechanism_actors,
    words,
)
from exudyn_flexlink.animation.film import strength
from exudyn_flexlink.animation.look import ARROW, INK, PALE, TOUCH
from exudyn_flexlink.animation.shots import Shots
from exudyn_flexlink.animation.zooms import Zoom
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import Channel, pair_sides
from exudyn_flexlink.observables import State, contact_states
from exudyn_flexlink.plots.outline import Line, through
from exudyn_flexlink.plots.panels import BEYOND
from exudyn_flexlink.plots.style import BLUE

STATES = {
    State.FREE: "free",
    State.ONE_POINT: "one point",
    State.SAME_SIDE: "two points, same side",
    State.OPPOSITE_SIDES: "two points, opposite sides",
}
EDGE = 0.02  # of the width, beside the line
LEAST = 0.15  # of its height: a touch is no lower
TOP, BOTTOM = 0.9, 0.25  # of the height


class ZoomPanel:
    """The zoom of a name, of one run or of two over each other.

    `scale` is that of the picture above, pixels per m.
    """

    def __init__(self, place: Place, takes: Sequence[Shots], name: str, scale: float) -> None:
        zooms = {i: shots.zooms[name] for i, shots in enumerate(takes) if name in shots.zooms}
        own = next(iter(zooms.values()))
        larger = _fit(place, own, scale)
        if own.channel is not None:
            draw_walls(place, own.channel)
        self._actors: list[Actor] = []
        for i, zoom in zooms.items():
            seen = replace(place, rank=i if len(takes) > 1 else -1, view=zoom.view)
            self._actors += _shown(seen, takes[i], zoom)
        self._title = place.axes.text(
            0.012, 0.98, "", transform=place.axes.transAxes, va="top", color="#666666",
            fontsize=place.points(12),
        )  # fmt: skip
        self._told = own.words + larger
        alone = len(takes) == 1 and own.channel is not None
        self._states = contact_states(takes[0].take.result, name) if alone else None
        self._frames = takes[0].frames
        self.artists: list[Artist] = []

    def show(self, frame: int) -> None:
        """Move to a frame."""
        state = ""
        if self._states is not None:
            now = self._states.at(self._frames.times[frame : frame + 1])[0]
            state = f" \N{EN DASH} {STATES[State(int(now))]}"
        self._title.set_text(self._told + state)
        for actor in self._actors:
            actor.show(frame)
        self.artists = [self._title, *(own for actor in self._actors for own in actor.artists)]


def _shown(place: Place, shots: Shots, zoom: Zoom) -> Iterator[Actor]:
    """What moves in the zoom of one run."""
    if zoom.channel is not None:
        yield WalledLink(place, shots, zoom.channel)
        return
    yield from mechanism_actors(place, shots)
    if place.rank <= 0:
        yield PointsActor(place, shots, zoom.length)
    yield GlowsActor(place, shots, only=zoom.name)


def _fit(place: Place, own: Zoom, scale: float) -> str:
    """Let axes show a zoom; tells how much larger it is.

    A guide is larger across than along where there is room, a face never, or angles would be wrong.
    """
    axes = place.axes
    room = axes.get_window_extent()
    head = 20 * place.thick  # pixels: the line of words
    low, high = own.across
    across = (room.height - head) / (high - low)
    along = min(room.width / own.length, across)
    if own.channel is None:
        across = along
    middle, half = sum(own.along) / 2, room.width / along / 2
    axes.set_xlim(middle - half, middle + half)
    middle, half = sum(own.across) / 2, (room.height - head) / across / 2
    axes.set_ylim(middle - half, middle + half + head / across)
    if own.channel is None:
        return f", {along / scale:.2g} times larger"
    ratio = across / along
    return f", {ratio:.2g} times larger across" if ratio > 1.05 else ""


def draw_walls(place: Place, own: Channel) -> None:
    """Draw what stands still in a zoom: walls, the room between them, and its middle."""
    axes, ends, c = place.axes, [0, own.length], own.clearance
    axes.fill_between(ends, -c, c, color="#A9A9A9", alpha=0.14, linewidth=0)
    for y in (c, -c):
        axes.plot(ends, [y, y], color=PALE, linewidth=place.points(3))
    axes.plot(ends, [0, 0], color=PALE, linewidth=place.points(0.8), linestyle=":")


class WalledLink:
    """A link between the walls of its guide, and arrows for the forces on it."""

    def __init__(self, place: Place, shots: Shots, channel: Channel) -> None:
        self._place, self._shots = place, shots
        wide, pale = place.wide_and_pale
        colour = shots.take.colour or BLUE
        look: dict[str, Any] = {"color": colour, "alpha": pale, "marker": ".",
                                "markersize": place.points(9)}  # fmt: skip
        self._line = place.axes.plot([], [], **look, linewidth=place.points(2.4) * wide)[0]
        self._nodes = through(channel.name, *channel.nodes)
        self._sides = pair_sides(channel)
        self._own = next(own for own in shots.touching if own.name == channel.name)
        self.artists: list[Any] = []

    def show(self, frame: int) -> None:
        """Move to a frame."""
        self._line.set_data(*self._seen(self._nodes, frame).T)
        for artist in self.artists[1:]:
            artist.remove()
        self.artists = [self._line]
        force = self._shots.forces(self._own, frame)
        assert self._own.places is not None
        at = self._seen(self._own.places, frame)
        for pair in np.flatnonzero(force > 0).tolist():
            self._arrow(at[pair], float(force[pair]), self._sides[pair])

    def _seen(self, line: Line, frame: int) -> FloatArray:
        """Points (n, 2) m along and across the guide."""
        poses = self._shots.poses[frame]
        return self._place.seen(line.at(poses), poses)

    def _arrow(self, at: FloatArray, force: float, side: float) -> None:
        """An arrow that presses on the link: down from the upper wall, up from the lower."""
        place = self._place
        length = place.points(ARROW[0] + ARROW[1] * min(self._shots.film.part(force), 1.0) ** 0.5)
        arrow = {"arrowstyle": "-|>", "color": TOUCH, "linewidth": place.points(2.2),
                 "shrinkA": 0, "shrinkB": 0, "mutation_scale": place.points(11)}  # fmt: skip
        shaft = place.axes.annotate(
            "", tuple(at), (0, side * length), textcoords="offset points", arrowprops=arrow,
            annotation_clip=False,
        )  # fmt: skip
        low, high = place.axes.get_xlim()
        left = at[0] > high - 0.12 * (high - low)
        told = words(place, 12, ha="right" if left else "left", va="center")
        told.set(text=f"{force:.3g} N", color=TOUCH, weight="bold")
        told.xy = tuple(at)
        told.set_position(((-1) ** left * place.points(7), side * length))
        self.artists += [shaft, told]


class Timeline:
    """Touches as high as their force, and a mark at the frame."""

    def __init__(self, place: Place, takes: Sequence[Shots]) -> None:
        axes, film, self._frames = place.axes, takes[0].film, takes[0].frames
        span = film.end - film.begin
        margin = EDGE * span / (1 - 2 * EDGE)
        axes.set_xlim(film.begin - margin, film.end + margin)
        axes.set_ylim(0, 1)
        axes.fill_between([film.begin, film.end], BOTTOM, TOP, color=PALE, alpha=0.12, linewidth=0)
        if film.horizon is not None and film.horizon[0] < film.end:
            begin = max(film.horizon[0], film.begin)
            axes.fill_between([begin, film.end], BOTTOM, TOP, zorder=1, **BEYOND)
        for slow in film.slow:
            axes.fill_between(
                [slow.begin, slow.end], BOTTOM, TOP, color=BLUE, alpha=0.2, linewidth=0
            )
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
                own = PolyCollection(
                    bars, facecolors=TOUCH, edgecolors=TOUCH, linewidths=place.points(1),
                    alpha=0.9 if touching.places is None else 0.5,
                )  # fmt: skip
                axes.add_collection(own, autolim=False)
        self._mark = axes.plot([], [], color=INK, linewidth=place.points(2))[0]
        self._dot = axes.plot([], [], "o", color=INK, markersize=place.points(9))[0]
        self.artists: list[Artist] = [self._mark, self._dot]

    def show(self, frame: int) -> None:
        """Move to a frame."""
        at = self._frames.times[frame]
        self._mark.set_data([at, at], [BOTTOM, TOP + 0.05])
        self._dot.set_data([at], [BOTTOM])
