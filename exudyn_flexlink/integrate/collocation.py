r"""Coefficients of Radau IIA methods, of s stages and order 2 s - 1.

E. Hairer and G. Wanner, *Solving Ordinary Differential Equations II*, IV.8. The stages collocate
``y' = f`` at the nodes c, the roots of a Jacobi polynomial and 1. So the method is L-stable, and
the last stage is the end of the step. With ``A_ij`` the integral of Lagrange's polynomial l_j from
0 to c_i, the inverse B of A has one real eigenvalue and conjugate pairs: ``B = T diag(lambda)
T^-1``. One of each pair is kept. A step's error is estimated as ``h (gamma f(y_0) + sum_i d_i
f_i)``, of order s; gamma is the inverse of the real eigenvalue.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.polynomial import chebyshev
from scipy.special import roots_jacobi

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.integrate.events import StepPolynomial
from exudyn_flexlink.integrate.problem import order_of


class Collocation:
    """One method; `nodes` (1 + s,) are its start and stages, as parts of a step."""

    def __init__(self, stages: int) -> None:
        self.stages, self.order = stages, order_of(stages)
        self.degrees = np.arange(stages + 1)
        self.c = np.append((1 + roots_jacobi(stages - 1, 1, 0)[0]) / 2, 1.0)
        self.nodes = np.append(0.0, self.c)
        powers, of_integral = self.c[:, None] ** np.arange(stages), np.arange(1, stages + 1)
        # Chebyshev's polynomials lose less by rounding than powers.
        x, basis = 2 * self.c - 1, np.eye(stages)
        integrals = chebyshev.chebval(x, chebyshev.chebint(basis, lbnd=-1, scl=0.5)).T
        self.a = integrals @ np.linalg.inv(chebyshev.chebvander(x, stages - 1))
        self.b = np.linalg.inv(self.a)
        self.weights = self.a[-1]
        values, columns = np.linalg.eig(self.b)
        kept = np.argsort(values.imag)[stages // 2 :]  # the real eigenvalue, then one of each pair
        self.eigenvalues = values[kept]
        self.real = float(self.eigenvalues[0].real)
        twice = np.where(np.arange(len(kept)) > 0, 2, 1)  # a pair counts twice its real part
        self.from_systems = columns[:, kept] * twice
        self.to_systems = np.linalg.inv(columns)[kept]
        exact = 1.0 / of_integral - np.eye(stages)[0] / self.real
        self.error = self.real * (np.linalg.solve(powers.T, exact) - self.weights) @ self.b
        # Coefficients, by powers of the part of a step, of the polynomials through all nodes, and
        # of those through the stages only.
        self.powers = np.linalg.inv(self.nodes[:, None] ** self.degrees)
        self.by_stages = np.linalg.inv(powers)
        self.polynomial = StepPolynomial(self.nodes)

    def to_parts(self, parts: FloatArray) -> FloatArray:
        """Weights (k, 1 + s) of values at the nodes, for values at parts (k,) of a step."""
        return np.asarray(np.vander(parts, self.stages + 1, increasing=True) @ self.powers)


@cache
def collocation(stages: int) -> Collocation:
    """Return the method with this number of stages."""
    return Collocation(stages)
