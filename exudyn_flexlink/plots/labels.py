"""Names beside what they name, where they hide least."""

from __future__ import annotations

from math import cos, pi, sin
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.transforms import Bbox

from exudyn_flexlink.arrays import FloatArray

DIRECTIONS = 12
NEAR = 7.0  # points, from a place to its label
FARTHER = (1.0, 2.0, 3.2, 4.6)  # times as far, where there is no room
APART = 2.0  # points, between two names, so that they don't read as one
OF_LINE = 0.15  # of a hidden name counts a spot of a line that is hidden
OUTSIDE = 4.0  # times as bad as on another name is a name beyond the axes
OF_DISTANCE = 0.25  # of its own area: what a name may hide rather than stand farther off


class Labels:
    """Places names one after the other; what is placed first has the best place.

    The limits of the axes, and the layout of the figure, have to be final. `spots` (N, 2), in data
    coordinates, are places that had better stay free.
    """

    def __init__(self, axes: Axes, spots: FloatArray) -> None:
        self._axes = axes
        self._taken: list[Bbox] = []
        self._spots = np.asarray(axes.transData.transform(spots))
        figure = axes.get_figure()
        assert figure is not None
        self._pixels = figure.dpi / 72  # in a point

    def keep_free(self, places: FloatArray, size: float) -> None:
        """Keep names off symbols `size` (points) wide at places (N, 2), in data coordinates."""
        half = size / 2 * self._pixels
        for at in np.asarray(self._axes.transData.transform(places)):
            self._taken.append(Bbox([at - half, at + half]))

    def write(self, text: str, place: FloatArray, towards: FloatArray, **look: Any) -> None:
        """Write a name beside a place (data coordinates), rather in the direction `towards`."""
        x, y = (float(one) for one in place)
        shown = self._axes.annotate(
            text, (x, y), (0, 0), textcoords="offset points", ha="center", va="center", zorder=8,
            **look,
        )  # fmt: skip
        shown.set_in_layout(False)
        size = shown.get_window_extent()
        half = np.array([size.width, size.height]) / 2
        at = np.asarray(self._axes.transData.transform(place))
        first = float(np.arctan2(towards[1], towards[0]))
        best: tuple[float, FloatArray, Bbox] | None = None
        for far in FARTHER:
            for i in range(DIRECTIONS):
                turned = first + (i + 1) // 2 * (-1) ** i * 2 * pi / DIRECTIONS
                away = np.array([cos(turned), sin(turned)])
                # As far as the label's own size in that direction, and a little farther.
                middle = far * NEAR * self._pixels * away + half * away
                box = Bbox([at + middle - half, at + middle + half])
                cost = self._hidden(box) + OF_DISTANCE * (far - 1 + i / DIRECTIONS) * _area(box)
                if best is None or cost < best[0]:
                    best = cost, middle, box
        assert best is not None
        _, middle, box = best
        shown.set_position((middle[0] / self._pixels, middle[1] / self._pixels))
        self._taken.append(box.padded(APART * self._pixels))

    def _hidden(self, box: Bbox) -> float:
        """How much a label would hide, or leave the axes, in squares of pixels."""
        window = self._axes.get_window_extent()
        inside = Bbox.intersection(box, window)
        cost = OUTSIDE * (_area(box) - (0.0 if inside is None else _area(inside)))
        for other in self._taken:
            shared = Bbox.intersection(box, other)
            cost += 0.0 if shared is None else 3 * _area(shared) + 1.0
        within = np.all((self._spots > box.min) & (self._spots < box.max), axis=1)
        return cost + OF_LINE * _area(box) * float(np.count_nonzero(within))


def _area(box: Bbox) -> float:
    return float(box.width * box.height)
