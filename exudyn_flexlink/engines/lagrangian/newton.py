"""Dense linear systems of an implicit step, real and complex, in machine code."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.lagrangian.compiled import compiled

FloatArray = NDArray[np.float64]


@compiled
def decompose(matrix: NDArray[Any], rows: NDArray[np.int64]) -> None:
    """Factors L U, in place, with partial pivoting; `rows` tells which row was taken."""
    size = len(matrix)
    for p in range(size):
        best, at = 0.0, p
        for i in range(p, size):
            entry = matrix[i, p]
            large = abs(entry.real) + abs(entry.imag)
            if large > best:
                best, at = large, i
        rows[p] = at
        if at != p:
            for j in range(size):
                matrix[p, j], matrix[at, j] = matrix[at, j], matrix[p, j]
        inverse = 1.0 / matrix[p, p]
        for i in range(p + 1, size):
            factor = matrix[i, p] * inverse
            matrix[i, p] = factor
            for j in range(p + 1, size):
                matrix[i, j] -= factor * matrix[p, j]


@compiled
def solve(factors: NDArray[Any], rows: NDArray[np.int64], vector: NDArray[Any]) -> None:
    """Solve in place with the factors of `decompose`."""
    size = len(vector)
    for p in range(size):
        at = rows[p]
        if at != p:
            vector[p], vector[at] = vector[at], vector[p]
    for i in range(size):
        for k in range(i):
            vector[i] -= factors[i, k] * vector[k]
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            vector[i] -= factors[i, k] * vector[k]
        vector[i] /= factors[i, i]
