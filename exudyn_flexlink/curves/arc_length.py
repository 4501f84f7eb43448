"""How long a curve is from its start to a place, as a table between whose rows cubics run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from exudyn_flexlink.curves.base import Curve

FloatArray = NDArray[np.float64]

NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)


class ArcLength:
    """Lengths (m) along a curve by its parameter; beyond its ends they go on as there."""

    def __init__(self, curve: Curve) -> None:
        self._u = curve.samples[0]
        low, high = self._u[:-1], self._u[1:]
        half = 0.5 * (high - low)
        inside = low[:, None] + half[:, None] * (1 + NODES)
        parts = half * (np.linalg.norm(curve._raw(inside, 1), axis=-1) @ WEIGHTS)
        lengths = np.concatenate([[0.0], np.cumsum(parts)])
        # Speeds |dP/du| at both ends of every part, by its own piece: they jump where pieces meet.
        which = curve._indices(0.5 * (low + high))
        first, last = np.empty(len(low)), np.empty(len(low))
        for i, piece in enumerate(curve.pieces):
            own, by = which == i, piece.start - curve.breaks[i]
            for speeds, ends in ((first, low), (last, high)):
                speeds[own] = np.linalg.norm(piece._raw(ends[own] + by, 1), axis=-1)
        first, last = 2 * half * first, 2 * half * last
        self._cubics = np.array(
            [lengths[:-1], first, 3 * parts - 2 * first - last, first + last - 2 * parts]
        ).T
        self._spans = 2 * half
        self.whole = float(lengths[-1])

    def to(self, u: FloatArray) -> FloatArray:
        """Lengths from the start to places (...)."""
        i = np.clip(np.searchsorted(self._u, u, side="right") - 1, 0, len(self._u) - 2)
        w = (u - self._u[i]) / self._spans[i]
        begin, slope, bend, bent = np.moveaxis(self._cubics[i], -1, 0)
        return np.asarray(begin + w * (slope + w * (bend + w * bent)))
