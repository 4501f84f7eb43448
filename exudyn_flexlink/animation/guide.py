"""The zoom into a guide with clearance, seen from it and drawn larger across than along."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from numpy.typing import NDArray

from exudyn_flexlink.animation.actors import Place, words
from exudyn_flexlink.animation.look import ARROW, BESIDE, PALE, ROOM, TOUCH
from exudyn_flexlink.animation.shots import Largest, Shots
from exudyn_flexlink.mechanism import Channel, anchor_position, angle_of, pair_sides, turned
from exudyn_flexlink.observables import State, contact_states
from exudyn_flexlink.plots.outline import Line, link_line, walled
from exudyn_flexlink.plots.style import BLUE

FloatArray = NDArray[np.float64]

STATES = {
    State.FREE: "free",
    State.ONE_POINT: "one point",
    State.SAME_SIDE: "two points, same side",
    State.OPPOSITE_SIDES: "two points, opposite sides",
}


class GuidePanel:
    """The link of one guide, or of the same guide in two runs, with the forces of its walls."""

    def __init__(
        self, axes: Axes, thick: float, takes: Sequence[Shots], name: str, largest: Largest
    ) -> None:
        self._largest = largest
        channels = {i: _channel(shots, name) for i, shots in enumerate(takes)}
        own = next(channel for channel in channels.values() if channel is not None)
        self._shares(axes, own, thick)
        self._walls(Place(axes, thick), own)
        self._links = []
        for i, channel in channels.items():
            if channel is not None:
                place = Place(axes, thick, i if len(takes) > 1 else -1)
                self._links.append(_Link(place, takes[i], channel))
        self._title = axes.text(
            0.012, 0.98, "", transform=axes.transAxes, va="top", color="#666666",
            fontsize=Place(axes, thick).points(12),
        )  # fmt: skip
        self._told = f"in {name}{self._larger}"
        self._states = contact_states(takes[0].take.result, name) if len(takes) == 1 else None
        self._frames = takes[0].frames
        self.artists: list[Artist] = []

    def _shares(self, axes: Axes, own: Channel, thick: float) -> None:
        """Let axes show the guide; never larger along it than across."""
        room = axes.get_window_extent()
        head = 20 * thick / room.height  # of the height: the line of words
        across = room.height * (1 - head) / (2 * ROOM * own.clearance)
        along = min(room.width / ((1 + 2 * BESIDE) * own.length), across)
        half = room.width / along / 2
        axes.set_xlim(own.length / 2 - half, own.length / 2 + half)
        reach = ROOM * own.clearance
        axes.set_ylim(-reach, reach * (1 + head) / (1 - head))
        ratio = across / along
        self._larger = f", {ratio:.2g} times larger across" if ratio > 1.05 else ""

    def _walls(self, place: Place, own: Channel) -> None:
        axes, ends = place.axes, [0, own.length]
        c = own.clearance
        axes.fill_between(ends, -c, c, color="#A9A9A9", alpha=0.14, linewidth=0)
        for y in (c, -c):
            axes.plot(ends, [y, y], color=PALE, linewidth=place.points(3))
        axes.plot(ends, [0, 0], color=PALE, linewidth=place.points(0.8), linestyle=":")

    def show(self, frame: int) -> None:
        """Move to a frame."""
        state = ""
        if self._states is not None:
            now = self._states.at(self._frames.times[frame : frame + 1])[0]
            state = f" \N{EN DASH} {STATES[State(int(now))]}"
        self._title.set_text(self._told + state)
        for link in self._links:
            link.show(frame, self._largest)
        self.artists = [self._title, *(own for link in self._links for own in link.artists)]


class _Link:
    """A link in its guide, and arrows for the forces on it."""

    def __init__(self, place: Place, shots: Shots, channel: Channel) -> None:
        self._place, self._shots, self._channel = place, shots, channel
        wide, pale = place.wide_and_pale
        colour = shots.take.colour or BLUE
        look: dict[str, Any] = {"color": colour, "alpha": pale, "marker": ".",
                                "markersize": place.points(9)}  # fmt: skip
        self._line = place.axes.plot([], [], **look, linewidth=place.points(2.4) * wide)[0]
        self._nodes = link_line(channel)
        self._sides = pair_sides(channel)
        self._own = next(own for own in shots.touching if own.name == channel.name)
        self.artists: list[Any] = []

    def show(self, frame: int, largest: Largest) -> None:
        """Move to a frame."""
        self._line.set_data(*self._seen(self._nodes, frame).T)
        for artist in self.artists[1:]:
            artist.remove()
        self.artists = [self._line]
        force = self._shots.forces(self._own, frame)
        assert self._own.places is not None
        at = self._seen(self._own.places, frame)
        for pair in np.flatnonzero(force > 0).tolist():
            self._arrow(at[pair], float(force[pair]), self._sides[pair], largest)

    def _seen(self, line: Line, frame: int) -> FloatArray:
        """Points (n, 2) m along and across the guide."""
        poses, guide = self._shots.poses[frame], self._channel.guide
        away = line.at(poses) - anchor_position(guide, poses)
        return np.asarray(turned(away, -angle_of(guide.part, poses)))

    def _arrow(self, at: FloatArray, force: float, side: float, largest: Largest) -> None:
        """An arrow that presses on the link: down from the upper wall, up from the lower."""
        place = self._place
        length = place.points(ARROW[0] + ARROW[1] * min(largest.part(force), 1.0) ** 0.5)
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


def _channel(shots: Shots, name: str) -> Channel | None:
    return next((own for own in walled(shots.take.model) if own.name == name), None)
