r"""Newton's method with one system for all stages of a step, where a mechanism has few coordinates.

The matrices of the simplified method hold at the middle of a step, and leave out what turns with
the mechanism. That costs rounds where a step turns it far. Here every stage has its own mass
matrix, and its own derivatives of what is left, ``R = f - M A``:

    M_i sum_j b_ij dW_j / h + D_i dW_i + h K_i sum_j a_ij dW_j = R_i,   K = -dR/dq,   D = -dR/dq'

K and D are differences at two stages, found along with the residual of the guess, and linear in
time between and beyond them. So two rounds are enough, the second of which finds what to leave.
"""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.integrate.collocation import STAGES, A, B, C
from exudyn_flexlink.integrate.problem import Evaluation

PAIR = [1, STAGES - 2]  # stages beside which differences are taken
FROM_PAIR = np.vander(C, 2) @ np.linalg.inv(np.vander(C[PAIR], 2))  # (stages, 2)
EACH = np.eye(STAGES)[:, :, None, None]


def with_neighbours(
    h: float, stages: tuple[FloatArray, FloatArray, FloatArray], shifts: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Instants (s), coordinates and speeds of a step's stages, then of 2 n beside each of two.

    `shifts` (n,) are the differences of coordinates; those of speeds make the same in a step.
    """
    t, q, v = stages
    n = len(shifts)
    apart, still = np.diag(shifts), np.zeros((n, n))
    beside = np.concatenate([apart, still]), np.concatenate([still, apart / h])
    places, speeds = (
        (own[PAIR][:, None] + by).reshape(-1, n) for own, by in zip((q, v), beside, strict=True)
    )
    return (
        np.append(t, np.repeat(t[PAIR], 2 * n)),
        np.concatenate([q, places]),
        np.concatenate([v, speeds]),
    )


def inverse(
    h: float,
    found: Evaluation,
    accelerations: FloatArray,
    residual: FloatArray,
    shifts: FloatArray,
) -> FloatArray:
    """Inverse (stages n, stages n) of the system, by what `with_neighbours` has asked for.

    `accelerations` and `residual` (stages, n) are those of the stages.

    Raises:
        numpy.linalg.LinAlgError: the system is singular.

    """
    n = len(shifts)
    inertia = found.mass[STAGES:].reshape(2, 2 * n, n, n) @ accelerations[PAIR, None, :, None]
    left = found.force[STAGES:].reshape(2, 2 * n, n) - inertia[..., 0]
    # Derivatives (2, 2 n, n), by coordinates, then by speeds, of what is left.
    by_shift = (residual[PAIR, None] - left) / np.tile(shifts, 2)[:, None]
    slopes = np.swapaxes((FROM_PAIR @ by_shift.reshape(2, -1)).reshape(STAGES, 2, n, n), 2, 3)
    stiffness, damping = slopes[:, 0], h * slopes[:, 1]
    # (stages, stages, n, n): of each stage's residual by each stage's speeds
    blocks = (B / h)[:, :, None, None] * found.mass[:STAGES, None] + EACH * damping[:, None]
    blocks += (h * A)[:, :, None, None] * stiffness[:, None]
    return np.asarray(np.linalg.inv(blocks.transpose(0, 2, 1, 3).reshape(STAGES * n, STAGES * n)))
