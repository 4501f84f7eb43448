"""The link in a guide with clearance, as a zoom shows it: between walls, with their forces."""

from __future__ import annotations

from typing import Any

import numpy as np

from exudyn_flexlink.animation.actors import Place, words
from exudyn_flexlink.animation.look import ARROW, PALE, TOUCH
from exudyn_flexlink.animation.shots import Largest, Shots
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import Channel, pair_sides
from exudyn_flexlink.plots.outline import Line, link_line
from exudyn_flexlink.plots.style import BLUE


def draw_walls(place: Place, own: Channel) -> None:
    """Draw what stands still in a zoom: walls, the room between them, and its middle."""
    axes, ends, c = place.axes, [0, own.length], own.clearance
    axes.fill_between(ends, -c, c, color="#A9A9A9", alpha=0.14, linewidth=0)
    for y in (c, -c):
        axes.plot(ends, [y, y], color=PALE, linewidth=place.points(3))
    axes.plot(ends, [0, 0], color=PALE, linewidth=place.points(0.8), linestyle=":")


class WalledLink:
    """A link between the walls of its guide, and arrows for the forces on it."""

    def __init__(self, place: Place, shots: Shots, channel: Channel, largest: Largest) -> None:
        self._place, self._shots, self._largest = place, shots, largest
        wide, pale = place.wide_and_pale
        colour = shots.take.colour or BLUE
        look: dict[str, Any] = {"color": colour, "alpha": pale, "marker": ".",
                                "markersize": place.points(9)}  # fmt: skip
        self._line = place.axes.plot([], [], **look, linewidth=place.points(2.4) * wide)[0]
        self._nodes = link_line(channel)
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
        length = place.points(ARROW[0] + ARROW[1] * min(self._largest.part(force), 1.0) ** 0.5)
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
