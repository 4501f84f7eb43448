r"""Newton's method with one system for all stages of a step, where a mechanism has few coordinates.

The matrices of the simplified method hold at the middle of a step, and leave out what turns with
the mechanism. That costs rounds where a step turns it far. Here every stage has its own mass
matrix, and all have the derivatives of what is left, ``R = f - M A``, at the middle stage:

    M_i sum_j b_ij dW_j / h + D dW_i + h K sum_j a_ij dW_j = R_i,   K = -dR/dq,   D = -dR/dq'

K and D are differences, found along with the residual of the guess: that is the whole price.
"""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.integrate.collocation import STAGES, A, B
from exudyn_flexlink.integrate.problem import Evaluation

MIDDLE = STAGES // 2  # stage beside which the differences are taken
EACH = np.eye(STAGES)[:, :, None, None]


def with_neighbours(
    h: float, stages: tuple[FloatArray, FloatArray, FloatArray], shifts: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Instants (s), coordinates and speeds of a step's stages, then of 2 n states beside one.

    `shifts` (n,) are the differences of coordinates; those of speeds make the same in a step.
    """
    t, q, v = stages
    apart, none = np.diag(shifts), np.zeros((len(shifts), len(shifts)))
    return (
        np.append(t, np.full(2 * len(shifts), t[MIDDLE])),
        np.concatenate([q, q[MIDDLE] + apart, q[MIDDLE] + none]),
        np.concatenate([v, v[MIDDLE] + none, v[MIDDLE] + apart / h]),
    )


def slopes(
    h: float, neighbours: Evaluation, a: FloatArray, residual: FloatArray, shifts: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """K and D (n, n), by 2 n neighbours of a state with accelerations `a` and a residual (n,)."""
    n = len(shifts)
    changes = residual - (neighbours.force - neighbours.mass @ a)  # (2 n, n)
    return (changes[:n] / shifts[:, None]).T, (changes[n:] * (h / shifts[:, None])).T


def inverse(h: float, mass: FloatArray, stiffness: FloatArray, damping: FloatArray) -> FloatArray:
    """Inverse (stages n, stages n) of the system, with a mass matrix of each stage.

    Raises:
        numpy.linalg.LinAlgError: the system is singular.

    """
    n = len(stiffness)
    # (stages, stages, n, n): of each stage's residual by each stage's speeds
    blocks = (B / h)[:, :, None, None] * mass[:, None] + EACH * damping
    blocks += (h * A)[:, :, None, None] * stiffness
    return np.asarray(np.linalg.inv(blocks.transpose(0, 2, 1, 3).reshape(STAGES * n, STAGES * n)))
