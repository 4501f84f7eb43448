"""The Radau IIA method of order 9: nodes, weights and what its steps and error estimate need.

E. Hairer and G. Wanner, *Solving Ordinary Differential Equations II*, IV.8. With c the nodes and a
the coefficients, B is the inverse of a; FROM and TO turn the stages into its eigenvectors and back,
one real and one of each complex pair.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def collocation(stages: int) -> tuple[FloatArray, FloatArray]:
    """Nodes c and coefficients a of the Radau IIA method; its order is 2 stages - 1."""
    legendre = np.polynomial.legendre
    last, before = np.zeros(stages + 1), np.zeros(stages + 1)
    last[stages], before[stages - 1] = 1.0, -1.0
    # c are the zeros of P_s(2 c - 1) - P_(s-1)(2 c - 1), of which 1 is one
    c = (np.sort(legendre.legroots(last + before).real) + 1) / 2
    c[-1] = 1.0
    powers = np.arange(1, stages + 1)
    a = (c[:, None] ** powers / powers) @ np.linalg.inv(np.vander(c, increasing=True))
    return c, a


STAGES = 5
C, A = collocation(STAGES)
WEIGHTS = A[-1]
B = np.linalg.inv(A)
POWERS = np.arange(1, STAGES + 2)
NODES = np.linalg.inv(np.vander(np.array([0.0, *C]), increasing=True))


def _finer_rule() -> tuple[FloatArray, FloatArray]:
    """Values at 12 places of Gauss's rule by those at the start and the stages; its weights."""
    places, weights = np.polynomial.legendre.leggauss(12)
    return np.vander((places + 1) / 2, STAGES + 1, increasing=True) @ NODES, weights / 2


TO_LOOKS, LOOK_WEIGHTS = _finer_rule()


def _systems() -> tuple[list[complex], FloatArray, FloatArray]:
    """Eigenvalues of B, the real one first and one of each pair, with the matrices T and T^-1."""
    values, vectors = np.linalg.eig(B)
    back = np.linalg.inv(vectors)
    real = int(np.argmin(np.abs(values.imag)))
    chosen = [real, *np.flatnonzero(values.imag > 1e-6 * abs(values[real])).tolist()]
    # A pair counts twice its real part.
    factors = np.array([1.0, *[2.0] * (len(chosen) - 1)])
    return [complex(values[i]) for i in chosen], vectors[:, chosen] * factors, back[chosen]


EIGENVALUES, FROM, TO = _systems()
REAL = EIGENVALUES[0].real


def _error_weights() -> FloatArray:
    """Weights e of the embedded formula, which has the start as another node."""
    powers = np.arange(1, STAGES + 1)
    right = 1.0 / powers
    right[0] -= 1 / REAL
    embedded = np.linalg.solve(np.vander(C, increasing=True).T, right)
    return np.asarray(REAL * (embedded - WEIGHTS) @ B)


ERROR = _error_weights()
