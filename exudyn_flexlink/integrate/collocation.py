r"""Coefficients of the Radau IIA method of five stages, of order 9.

E. Hairer and G. Wanner, *Solving Ordinary Differential Equations II*, IV.8. The stages collocate
``y' = f`` at the nodes c: roots of a Jacobi polynomial, and 1: L-stable, and the step ends with its
last stage. With ``A_ij`` the integral of Lagrange's polynomial l_j from 0 to c_i, the inverse B of
A has one real eigenvalue and two conjugate pairs. Of each pair one is kept: ``B = T
diag(lambda) T^-1``. The estimate of a step's error is ``h (gamma f(y_0) + sum_i d_i f_i)``, gamma
the inverse of the real eigenvalue, of order 5.
"""

from __future__ import annotations

import numpy as np
from scipy.special import roots_jacobi

STAGES = 5
C = np.append((1 + roots_jacobi(STAGES - 1, 1, 0)[0]) / 2, 1.0)

_powers = C[:, None] ** np.arange(STAGES)
_of_integral = np.arange(1, STAGES + 1)
A = (C[:, None] ** _of_integral / _of_integral) @ np.linalg.inv(_powers)
B = np.linalg.inv(A)
WEIGHTS = A[-1]

_values, _columns = np.linalg.eig(B)
# The real eigenvalue, then those with a positive imaginary part.
_kept = np.argsort(_values.imag)[STAGES // 2 :]
EIGENVALUES = _values[_kept]
REAL = float(EIGENVALUES[0].real)
FROM = _columns[:, _kept] * [1, 2, 2]  # a pair counts twice its real part
TO = np.linalg.inv(_columns)[_kept]

_exact = 1.0 / _of_integral - np.eye(STAGES)[0] / REAL
ERROR = REAL * (np.linalg.solve(_powers.T, _exact) - WEIGHTS) @ B  # of increments of the speeds

# Coefficients, in powers of the part of a step, of the polynomial through its start and its stages.
POWERS = np.linalg.inv(np.append(0.0, C)[:, None] ** np.arange(STAGES + 1))
