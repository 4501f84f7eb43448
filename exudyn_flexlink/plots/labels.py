"""Names beside what they name, where they hide least."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
from matplotlib.axes import Axes

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
        self._taken = np.empty((0, 2, 2))  # boxes: lower left and upper right corner, pixels
        self._spots = np.asarray(axes.transData.transform(spots))
        figure = axes.get_figure()
        assert figure is not None
        self._pixels = figure.dpi / 72  # in a point

    def keep_free(self, places: FloatArray, size: float) -> None:
        """Keep names off symbols `size` (points) wide at places (N, 2), in data coordinates."""
        half = size / 2 * self._pixels
        at = np.asarray(self._axes.transData.transform(places))
        self._take(np.stack([at - half, at + half], axis=1))

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
        middles, farther = self._choices(half, float(np.arctan2(towards[1], towards[0])))
        at = np.asarray(self._axes.transData.transform(place)) + middles
        boxes = np.stack([at - half, at + half], axis=1)
        best = int(np.argmin(self._hidden(boxes) + OF_DISTANCE * farther * _area(boxes)))
        shown.set_position(tuple(middles[best] / self._pixels))
        apart = APART * self._pixels * np.array([[-1.0], [1.0]])
        self._take(boxes[best : best + 1] + apart)

    def _choices(self, half: FloatArray, first: float) -> tuple[FloatArray, FloatArray]:
        """Middles (N, 2) of a label about its place, pixels; how much worse (N,) each is for that.

        `half` (2,) is half of its size, and `first` (rad) the direction that is best.
        """
        turns = np.arange(DIRECTIONS)
        angles = first + (turns + 1) // 2 * (-1) ** turns * 2 * pi / DIRECTIONS
        away = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        far = np.array(FARTHER)
        # As far as the label's own size in that direction, and a little farther.
        middles = NEAR * self._pixels * far[:, None, None] * away + half * away
        return middles.reshape(-1, 2), (far[:, None] - 1 + turns / DIRECTIONS).ravel()

    def _hidden(self, boxes: FloatArray) -> FloatArray:
        """How much labels in `boxes` (N, 2, 2) would hide, or leave the axes, squares of pixels."""
        area = _area(boxes)
        window = self._axes.get_window_extent().get_points()[None]
        cost = OUTSIDE * (area - _shared(boxes, window)[:, 0])
        shared = _shared(boxes, self._taken)
        cost += np.sum(3 * shared + (shared > 0), axis=1)
        low, high = boxes[:, None, 0], boxes[:, None, 1]
        within = np.all((self._spots > low) & (self._spots < high), axis=2)
        return np.asarray(cost + OF_LINE * area * np.count_nonzero(within, axis=1))

    def _take(self, boxes: FloatArray) -> None:
        self._taken = np.concatenate([self._taken, boxes])


def _area(boxes: FloatArray) -> FloatArray:
    return np.asarray(np.prod(boxes[..., 1, :] - boxes[..., 0, :], axis=-1))


def _shared(boxes: FloatArray, others: FloatArray) -> FloatArray:
    """Areas (N, M) that boxes (N, 2, 2) share with others (M, 2, 2)."""
    low = np.maximum(boxes[:, None, 0], others[None, :, 0])
    high = np.minimum(boxes[:, None, 1], others[None, :, 1])
    return np.asarray(np.prod(np.maximum(high - low, 0.0), axis=-1))
