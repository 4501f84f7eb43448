"""The line below the picture: touches over time, and how much of the film was seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.collections import PolyCollection

from exudyn_flexlink.animation.actors import Place
from exudyn_flexlink.animation.look import INK, PALE, TOUCH
from exudyn_flexlink.animation.shots import Largest, Shots
from exudyn_flexlink.animation.touches import strength
from exudyn_flexlink.plots.panels import BEYOND
from exudyn_flexlink.plots.style import BLUE

EDGE = 0.02  # of the width, beside the line
LEAST = 0.15  # of its height: a touch is no lower
TOP, BOTTOM = 0.9, 0.25  # of the height


class Timeline:
    """Touches as high as their force, and a mark at the frame."""

    def __init__(self, place: Place, takes: Sequence[Shots], largest: Largest) -> None:
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
                high = [max(largest.part(v) ** 0.5, LEAST) for v in strength(touches).tolist()]
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
