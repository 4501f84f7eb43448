"""Numbers that fit by least squares, and how well data tell them: what a search leaves behind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf

import numpy as np

from exudyn_flexlink.arrays import FloatArray

SINGULAR = 1e-4  # singular value of slopes of size 1: below it a combination is not known at all
TAKES_PART = 0.1  # in such a combination, of a size of 1


@dataclass(frozen=True)
class Estimate:
    """P numbers by `names`, with `residuals` (N,) and their `slopes` (N, P) by the numbers.

    s^2 = RSS / (N - P), and standard errors are the roots of the diagonal of s^2 (J^T J)^-1.
    """

    names: Sequence[str]
    value: FloatArray
    residuals: FloatArray
    slopes: FloatArray

    @cached_property
    def unknown(self) -> list[list[str]]:
        """Names of numbers of which the data don't tell a combination, or of one number alone."""
        unit = self.slopes / self._size
        values, columns = np.linalg.eigh(unit.T @ unit)
        lost = np.abs(columns.T[values < SINGULAR**2]) > TAKES_PART
        return [[own for own, gone in zip(self.names, row, strict=True) if gone] for row in lost]

    @cached_property
    def _size(self) -> FloatArray:
        size = np.linalg.norm(self.slopes, axis=0)
        return np.where(size == 0, 1.0, size)

    @cached_property
    def _inverse(self) -> FloatArray:
        """Pseudo-inverse (P, N) of the slopes, of what the data tell."""
        return np.asarray(np.linalg.pinv(self.slopes / self._size, SINGULAR) / self._size[:, None])

    @cached_property
    def standard_error(self) -> FloatArray:
        """Standard errors (P,); inf where the data don't tell a number."""
        scatter = np.sqrt(np.sum(self.residuals**2) / np.subtract(*self.slopes.shape))
        lost = [any(name in each for each in self.unknown) for name in self.names]
        return np.where(lost, inf, scatter * np.linalg.norm(self._inverse, axis=1))

    @property
    def correlations(self) -> FloatArray:
        """Correlations (P, P); nan where the data don't tell a number."""
        root = np.linalg.norm(self._inverse, axis=1)
        root = np.where(np.isfinite(self.standard_error) & (root > 0), root, np.nan)
        return np.asarray(self._inverse @ self._inverse.T / np.outer(root, root))

    def moved_by(self, residuals: FloatArray) -> FloatArray:
        """How far (P,) the numbers would move if these were the residuals (N,)."""
        return np.asarray(self._inverse @ (self.residuals - residuals))
