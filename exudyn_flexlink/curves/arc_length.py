"""How long a curve is from its start to a place."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from exudyn_flexlink.arrays import FloatArray

if TYPE_CHECKING:
    from exudyn_flexlink.curves.base import Curve


NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)


class ArcLength:
    """Lengths (m) along a curve by its parameter, by Gauss quadrature from the sample before."""

    def __init__(self, curve: Curve) -> None:
        self._curve, self._u = curve, curve.samples[0]
        parts = self._between(self._u[:-1], self._u[1:])
        self._lengths = np.concatenate([[0.0], np.cumsum(parts)])
        self.whole = float(self._lengths[-1])

    def to(self, u: FloatArray) -> FloatArray:
        """Lengths from the start to places (...); beyond an end the last piece goes on."""
        i = np.clip(np.searchsorted(self._u, u, side="right") - 1, 0, len(self._u) - 2)
        return np.asarray(self._lengths[i] + self._between(self._u[i], u))

    def place(self, length: FloatArray) -> FloatArray:
        """Places (...) at lengths from the start, as near as the curve's samples tell."""
        return np.interp(length, self._lengths, self._u)

    def _between(self, low: FloatArray, high: FloatArray) -> FloatArray:
        half = 0.5 * (high - low)
        inside = low[..., None] + half[..., None] * (1 + NODES)
        return np.asarray(half * (np.linalg.norm(self._curve._raw(inside, 1), axis=-1) @ WEIGHTS))
