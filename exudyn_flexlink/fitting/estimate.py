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
    def _parts(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Sizes (P,) of slopes, and the singular value decomposition of slopes of size 1."""
        size = np.linalg.norm(self.slopes, axis=0)
        size[size == 0] = 1.0
        return size, *np.linalg.svd(self.slopes / size, full_matrices=False)

    @cached_property
    def unknown(self) -> list[list[str]]:
        """Names of numbers of which the data don't tell a combination, or of one number alone."""
        _, _, values, rows = self._parts
        return [
            [name for name, x in zip(self.names, row, strict=True) if abs(x) > TAKES_PART]
            for row in rows[values < SINGULAR]
        ]

    @cached_property
    def _covariance(self) -> FloatArray:
        """(J^T J)^-1 (P, P) of slopes of size 1, of what the data tell."""
        _, _, values, rows = self._parts
        known = values >= SINGULAR
        return np.asarray((rows[known].T / values[known] ** 2) @ rows[known])

    @cached_property
    def standard_error(self) -> FloatArray:
        """Standard errors (P,); inf where the data don't tell a number."""
        scatter = np.sqrt(np.sum(self.residuals**2) / np.subtract(*self.slopes.shape))
        found = scatter * np.sqrt(np.diag(self._covariance)) / self._parts[0]
        lost = [any(name in each for each in self.unknown) for name in self.names]
        return np.where(lost, inf, found)

    @property
    def correlations(self) -> FloatArray:
        """Correlations (P, P); nan where the data don't tell a number."""
        root = np.sqrt(np.diag(self._covariance))
        root = np.where(np.isfinite(self.standard_error) & (root > 0), root, np.nan)
        return np.asarray(self._covariance / np.outer(root, root))

    def moved_by(self, residuals: FloatArray) -> FloatArray:
        """How far (P,) the numbers would move if these were the residuals (N,)."""
        size, left, values, rows = self._parts
        known = values >= SINGULAR
        along = (left.T[known] @ (residuals - self.residuals)) / values[known]
        return np.asarray(-(rows[known].T @ along) / size)
