"""Panels below the picture: guides with clearance and struck faces, larger; touches over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from matplotlib.collections import PolyCollection

from exudyn_flexlink.animation.drawing import (
    ARROW,
    INK,
    PALE,
    TOUCH,
    Place,
    draw_glows,
    draw_mechanism,
    draw_points,
)
from exudyn_flexlink.animation.film import strength
from exudyn_flexlink.animation.shots import Shots
from exudyn_flexlink.animation.zooms import Zoom
from exudyn_flexlink.mechanism import Channel, anchor_position, pair_sides
from exudyn_flexlink.observables import State, contact_states
from exudyn_flexlink.plots.outline import through
from exudyn_flexlink.plots.panels import BEYOND, length_unit
from exudyn_flexlink.plots.sleeve import STATE_WORDS
from exudyn_flexlink.plots.style import BLUE

EDGE = 0.02  # of the width, beside the line
LEAST = 0.15  # of its height: a touch is no lower
TOP, BOTTOM = 0.9, 0.25  # of the height


class ZoomPanel:
    """The zoom of a name, of one run or of two over each other.

    `scale` is that of the picture above, pixels per m.
    """

    def __init__(self, place: Place, takes: Sequence[Shots], name: str, scale: float) -> None:
        self._place, self._takes = place, takes
        self._zooms = {i: shots.zooms[name] for i, shots in enumerate(takes) if name in shots.zooms}
        own = next(iter(self._zooms.values()))
        self._told = own.words + _fit(place, own, scale)
        if own.channel is not None:
            draw_walls(place, own.channel)
        alone = len(takes) == 1 and own.channel is not None
        self._states = contact_states(takes[0].take.result, name) if alone else None

    def draw(self, frame: int) -> None:
        """Draw what moves, at a frame."""
        axes, told = self._place.axes, self._told
        if self._states is not None:
            now = self._states.at(self._takes[0].frames.times[frame : frame + 1])[0]
            told += f" \N{EN DASH} {STATE_WORDS[State(int(now))]}"
        elif len(self._takes) == 1:
            told += self._away(frame)
        axes.text(
            0.012, 0.98, told, transform=axes.transAxes, va="top", color="#666666",
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
        """How far off the point that may strike is, as long as it is outside the zoom on a face."""
        zoom, shots = self._zooms[0], self._takes[0]
        assert zoom.point is not None
        poses = shots.poses[frame]
        at = zoom.view.seen(anchor_position(zoom.point, poses)[None], poses)[0]
        box = np.array([self._place.axes.get_xlim(), self._place.axes.get_ylim()]).T
        away = float(np.linalg.norm(at - np.clip(at, *box)))
        factor, unit = length_unit(shots.film.size)
        words = f"{zoom.point_name} is {factor * away:.3g} {unit} away"
        return f" \N{EN DASH} {words}" if away > 0 else ""


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


def draw_walled_link(place: Place, shots: Shots, channel: Channel, frame: int) -> None:
    """Draw a link between the walls of its guide, and arrows for the forces on it."""
    poses, (wide, pale) = shots.poses[frame], place.wide_and_pale
    nodes = place.seen(through(channel.name, *channel.nodes).at(poses), poses)
    place.axes.plot(*nodes.T, color=shots.take.colour or BLUE, alpha=pale, marker=".",
                    markersize=place.points(9), linewidth=place.points(2.4) * wide)  # fmt: skip
    own = next(own for own in shots.touching if own.name == channel.name)
    force = shots.forces(own, frame)
    assert own.places is not None
    at, sides = place.seen(own.places.at(poses), poses), pair_sides(channel)
    for pair in np.flatnonzero(force > 0).tolist():
        strong = min(shots.film.part(float(force[pair])), 1.0) ** 0.5
        # Arrows press on the link: down from the upper wall, up from the lower.
        up = sides[pair] * place.points(ARROW[0] + ARROW[1] * strong)
        arrow = {"arrowstyle": "-|>", "color": TOUCH, "linewidth": place.points(2.2),
                 "shrinkA": 0, "shrinkB": 0, "mutation_scale": place.points(11)}  # fmt: skip
        place.axes.annotate(
            "", tuple(at[pair]), (0, up), textcoords="offset points", arrowprops=arrow,
            annotation_clip=False,
        )  # fmt: skip
        low, high = place.axes.get_xlim()
        left = at[pair, 0] > high - 0.12 * (high - low)
        place.write(
            f"{force[pair]:.3g} N", at[pair], ((-1) ** left * place.points(7), up), 12,
            color=TOUCH, weight="bold", ha="right" if left else "left", va="center",
        )  # fmt: skip


def draw_timeline(place: Place, takes: Sequence[Shots]) -> None:
    """Draw the line of time: touches as high as their force."""
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
            own = PolyCollection(
                bars, facecolors=TOUCH, edgecolors=TOUCH, linewidths=place.points(1),
                alpha=0.9 if touching.places is None else 0.5,
            )  # fmt: skip
            axes.add_collection(own, autolim=False)


def draw_instant(place: Place, at: float) -> None:
    """Mark an instant (s) on the line of time."""
    place.axes.plot([at, at], [BOTTOM, TOP + 0.05], color=INK, linewidth=place.points(2))
    place.axes.plot(at, BOTTOM, "o", color=INK, markersize=place.points(9))
