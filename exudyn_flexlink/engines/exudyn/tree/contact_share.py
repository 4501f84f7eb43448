"""What contacts do in the systems of an implicit step: few forces, whose slopes leap.

A contact's force changes from loading to unloading within a small part of a step. Matrices with its
slopes at one instant mislead the iteration; here each stage has its own, at every round.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.exudyn.tree.collocation import FROM, REAL, STAGES, TO, A

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

BOTH = (FROM[:, None, :] * TO.T[None, :, :]).reshape(STAGES * STAGES, -1)


class ContactShare(NamedTuple):
    """Contacts in the iteration's systems: few forces, whose slopes differ from stage to stage.

    Each adds ``row^T (k_i h a_ij + d_i delta_ij) row`` to the systems, with the slopes k_i, d_i at
    stage i. Woodbury's formula leaves a system for the gaps' changes alone, (stages c).
    """

    rows: FloatArray  # (c, n)
    arms: ComplexArray  # (systems, n, c): inverse times rows
    gains: FloatArray  # (stages c, stages c): changes of the gaps by unit forces at the stages

    @classmethod
    def of(cls, rows: FloatArray, inverses: ComplexArray) -> ContactShare | None:
        """None without contacts."""
        if not len(rows):
            return None
        arms = inverses @ rows.T
        by_system = rows @ arms  # (systems, c, c)
        count = len(rows)
        gains = (BOTH @ by_system.reshape(len(arms), -1)).real  # (stages stages, c c)
        gains = gains.reshape(STAGES, STAGES, count, count).transpose(0, 2, 1, 3)
        gains = gains.reshape(STAGES * count, STAGES * count)
        return cls(rows, arms, gains)

    def share(self, h: float, change: FloatArray, slopes: FloatArray) -> FloatArray:
        """What the contacts take off a change (stages, n) found without them."""
        count = len(self.rows)
        size = STAGES * count
        k, d = slopes[..., 0].reshape(size, 1), slopes[..., 1].ravel()
        forces = k * (h * _spread(count))
        forces.flat[:: size + 1] += d
        gaps = (change @ self.rows.T).reshape(size)
        gaps = np.linalg.solve(np.eye(size) + self.gains @ forces, gaps)
        pushes = TO @ (forces @ gaps).reshape(STAGES, count)  # (systems, c)
        return (FROM @ (self.arms @ pushes[:, :, None])[:, :, 0]).real

    def filtered(self, h: float, change: FloatArray, slopes: FloatArray) -> FloatArray:
        """A change (n,) found by the real system without contacts, with them at their start."""
        of_rates = slopes[:, 0] * h / REAL + slopes[:, 1]
        arm = self.arms[0].real
        system = np.eye(len(arm.T)) + (self.rows @ arm) * of_rates
        return np.asarray(change - arm @ (of_rates * np.linalg.solve(system, self.rows @ change)))


@cache
def _spread(count: int) -> FloatArray:
    """Coefficients a of the method, for each of `count` contacts."""
    return np.kron(A, np.eye(count))
