"""Names beside what they name, where they hide least."""

from __future__ import annotations

from itertools import product
from math import pi
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.transforms import Bbox

from exudyn_flexlink.arrays import FloatArray

DIRECTIONS = 12
NEAR = 7.0  # points, from a place to its label
FARTHER = (1.0, 2.0, 3.2, 4.6)  # times as far, where there is no room
APART = 2.0  # points, between two names, so that they don't read as one
# What a place for a name costs, which is 1 where it lies on another:
OF_LINE = 0.15  # for a spot of a line that is hidden
OUTSIDE = 4.0  # for leaving the axes
OF_DISTANCE = 0.06  # for standing farther off


class Labels:
    """Places names one after the other; what is placed first has the best place.

    The limits of the axes, and the layout of the figure, have to be final. `spots` (N, 2), in data
    coordinates, are places that had better stay free.
    """

    def __init__(self, axes: Axes, spots: FloatArray) -> None:
        self._axes, self._window = axes, axes.get_window_extent()
        self._taken: list[Bbox] = []
        self._spots = axes.transData.transform(spots)
        figure = axes.get_figure()
        assert figure is not None
        self._pixels = figure.dpi / 72  # in a point

    def keep_free(self, places: FloatArray, size: float) -> None:
        """Keep names off symbols `size` (points) wide at places (N, 2), in data coordinates."""
        half = size / 2 * self._pixels
        self._taken += [
            Bbox([at - half, at + half]) for at in self._axes.transData.transform(places)
        ]

    def write(self, text: str, place: FloatArray, towards: FloatArray, **look: Any) -> None:
        """Write a name beside a place (data coordinates), rather in the direction `towards`."""
        x, y = (float(one) for one in place)
        shown = self._axes.annotate(
            text, (x, y), (0, 0), textcoords="offset points", ha="center", va="center", zorder=8,
            **look,
        )  # fmt: skip
        shown.set_in_layout(False)
        half = np.array(shown.get_window_extent().size) / 2
        first, at = float(np.arctan2(towards[1], towards[0])), self._axes.transData.transform(place)
        found = []
        for far, turn in product(FARTHER, range(DIRECTIONS)):
            angle = first + (turn + 1) // 2 * (-1) ** turn * 2 * pi / DIRECTIONS
            away = np.array([np.cos(angle), np.sin(angle)])
            # As far as the name's own size in that direction, and a little farther.
            middle = NEAR * self._pixels * far * away + half * away
            box = Bbox([at + middle - half, at + middle + half])
            cost = self._hidden(box) + OF_DISTANCE * (far - 1 + turn / DIRECTIONS)
            found.append((cost, middle, box))
        _, middle, box = min(found, key=lambda one: one[0])
        shown.set_position(tuple(middle / self._pixels))
        self._taken.append(box.padded(APART * self._pixels))

    def _hidden(self, box: Bbox) -> float:
        """What a name in a box costs by what it hides, and where it leaves the axes."""
        within = Bbox.intersection(box, self._window)
        inside = 0.0 if within is None else within.width * within.height
        outside = 1 - inside / (box.width * box.height)
        on_lines = OF_LINE * box.count_contains(self._spots)
        return float(OUTSIDE * outside + box.count_overlaps(self._taken) + on_lines)
