"""Small dense linear systems, real and complex, in machine code."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from exudyn_flexlink.arrays import FloatArray, IntArray
from exudyn_flexlink.engines.lagrangian.compiled import compiled, inner


@inner
def _coupled(matrix: NDArray[Any], first: int) -> int:
    """Number of the row at which those begin that stand alone: zero but for their diagonals.

    Such rows at the end, as those of levers that nothing touches, cost next to nothing.
    """
    last = len(matrix)
    while last > first:
        alone = True
        for k in range(first, last - 1):
            alone = alone and matrix[last - 1, k] == 0.0 and matrix[k, last - 1] == 0.0
        if not alone:
            break
        last -= 1
    return last


@inner
def decompose(matrix: NDArray[Any], rows: IntArray) -> None:
    """Factors L U, in place, with partial pivoting; `rows` tells which row was taken."""
    size = _coupled(matrix, 0)
    for p in range(size, len(matrix)):
        rows[p] = p
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
            if factor == 0.0:
                continue
            for j in range(p + 1, size):
                matrix[i, j] -= factor * matrix[p, j]


@inner
def solve(factors: NDArray[Any], rows: IntArray, vector: NDArray[Any]) -> None:
    """Solve in place with the factors of `decompose`."""
    size = _coupled(factors, 0)
    for i in range(size, len(vector)):
        vector[i] /= factors[i, i]
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


@compiled
def eliminate(matrix: FloatArray, vector: FloatArray) -> None:
    """Solve in place by Gauss, without pivoting: both are overwritten, `vector` by the solution.

    Stable for ``[M -G^T; G 0]`` with M positive definite: every pivot is positive.
    """
    size = len(vector)
    for p in range(size):
        pivot = 1.0 / matrix[p, p]
        for i in range(p + 1, size):
            factor = matrix[i, p] * pivot
            if factor == 0.0:
                continue
            for j in range(p + 1, size):
                matrix[i, j] -= factor * matrix[p, j]
            vector[i] -= factor * vector[p]
    for i in range(size - 1, -1, -1):
        for j in range(i + 1, size):
            vector[i] -= matrix[i, j] * vector[j]
        vector[i] /= matrix[i, i]


@inner
def factorise(matrix: FloatArray, first: int, scaled: FloatArray) -> None:
    """Factors L D L^T, in place, of a positive definite matrix from row and column `first` on.

    Only the lower half is written; `scaled` (N,) is room to work in.
    """
    last = _coupled(matrix, first)
    for j in range(first, last):
        pivot = matrix[j, j]
        for k in range(first, j):
            scaled[k] = matrix[j, k] * matrix[k, k]
            pivot -= matrix[j, k] * scaled[k]
        matrix[j, j] = pivot
        for i in range(j + 1, last):
            entry = matrix[i, j]
            for k in range(first, j):
                entry -= matrix[i, k] * scaled[k]
            matrix[i, j] = entry / pivot


@inner
def substitute(factors: FloatArray, first: int, vector: FloatArray) -> None:
    """Solve in place, with the factors of `factorise`, for the entries from `first` on."""
    size = _coupled(factors, first)
    for i in range(size, len(vector)):
        vector[i] /= factors[i, i]
    for i in range(first, size):
        value = vector[i]
        for k in range(first, i):
            value -= factors[i, k] * vector[k]
        vector[i] = value
    for i in range(size - 1, first - 1, -1):
        value = vector[i] / factors[i, i]
        for k in range(i + 1, size):
            value -= factors[k, i] * vector[k]
        vector[i] = value
