r"""Coefficients of the Radau IIA methods of s stages, order 2 s - 1.

E. Hairer and G. Wanner, *Solving Ordinary Differential Equations II*, IV.8. The stages collocate
``y' = f`` at the nodes c, the roots of ``d^(s-1)/dx^(s-1) [x^(s-1) (x-1)^s]``, the last of which is
1: L-stable, and the step ends with its last stage. With ``A_ij`` the integral of Lagrange's
polynomial l_j from 0 to c_i, the inverse B of A has, for odd s, one real eigenvalue and pairs of
complex ones: ``B = T diag(lambda) T^-1``.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import polynomial

from exudyn_flexlink.arrays import ComplexArray, FloatArray


class Collocation(NamedTuple):
    """A Radau IIA method; of the complex eigenvalues one of each pair.

    The estimate of a step's error is ``h (gamma f(y_0) + sum_i d_i f_i)``, gamma = 1/real, of
    order s; `differences` holds d.
    """

    nodes: FloatArray  # c, (s,)
    matrix: FloatArray  # A, (s, s)
    inverse: FloatArray  # B, (s, s)
    real: float  # the real eigenvalue
    column: FloatArray  # (s,): its column of T
    row: FloatArray  # (s,): its row of T^-1
    pairs: ComplexArray  # ((s - 1)/2,) eigenvalues with positive imaginary part
    columns: ComplexArray  # (s, (s - 1)/2) of T
    rows: ComplexArray  # ((s - 1)/2, s) of T^-1
    differences: FloatArray  # d, (s,)
    powers: FloatArray  # (s, s): increments at sigma h are sum_k sigma^(k+1) sum_i powers[k, i] Z_i


@cache
def radau(stages: int) -> Collocation:
    """Return the method of an odd number of stages."""
    nodes = _nodes(stages)
    exponents = np.arange(1, stages + 1)
    powers = np.linalg.inv(nodes[:, None] ** exponents)
    vandermonde = nodes[:, None] ** (exponents - 1)
    matrix = (nodes[:, None] ** exponents / exponents) @ np.linalg.inv(vandermonde)
    inverse = np.linalg.inv(matrix)
    values, columns = np.linalg.eig(inverse)
    rows = np.linalg.inv(columns)
    alone = int(np.argmin(np.abs(values.imag)))
    upper = np.flatnonzero(values.imag > 1e-6)
    real = float(values[alone].real)
    factor = columns[np.argmax(abs(columns[:, alone])), alone]
    return Collocation(
        nodes,
        matrix,
        inverse,
        real,
        np.ascontiguousarray((columns[:, alone] / factor).real),
        np.ascontiguousarray((rows[alone] * factor).real),
        np.ascontiguousarray(values[upper]),
        np.ascontiguousarray(columns[:, upper]),
        np.ascontiguousarray(rows[upper]),
        _differences(nodes, matrix[-1], 1.0 / real),
        np.asarray(powers, dtype=np.float64),
    )


def _nodes(stages: int) -> FloatArray:
    """Roots of the polynomial above, polished by Newton's method."""
    whole = polynomial.polymul(
        np.eye(stages)[-1], polynomial.polypow(np.array([-1.0, 1.0]), stages)
    )
    derived = polynomial.polyder(whole, stages - 1)
    roots = np.sort(polynomial.polyroots(derived).real)
    slope = polynomial.polyder(derived)
    for _ in range(3):
        roots = roots - polynomial.polyval(roots, derived) / polynomial.polyval(roots, slope)
    roots[-1] = 1.0
    return np.asarray(roots)


def _differences(nodes: FloatArray, weights: FloatArray, gamma: float) -> FloatArray:
    """Weights, less the method's own, that with ``gamma f(y_0)`` integrate to order s."""
    stages = len(nodes)
    exact = 1.0 / np.arange(1, stages + 1)
    exact[0] -= gamma
    return np.asarray(np.linalg.solve(nodes ** np.arange(stages)[:, None], exact) - weights)


STAGES = 5  # order 9
RADAU = radau(STAGES)

# The same method for NumPy, which takes all systems and all stages together.
C, A, B = RADAU.nodes, RADAU.matrix, RADAU.inverse
WEIGHTS = A[-1]
REAL = RADAU.real
EIGENVALUES = np.array([REAL, *RADAU.pairs])
FROM = np.column_stack([RADAU.column, 2.0 * RADAU.columns])  # a pair counts twice its real part
TO = np.vstack([RADAU.row, RADAU.rows])
ERROR = REAL * RADAU.differences @ B  # of the speeds' increments, in the embedded formula

NODES = np.eye(STAGES + 1)  # coefficients, in powers of the part of a step, of the polynomial
NODES[1:, 1:], NODES[1:, 0] = RADAU.powers, -RADAU.powers.sum(1)  # through start and stages
