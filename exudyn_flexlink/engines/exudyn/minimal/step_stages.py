"""All coordinates near a step, from those at its stages: where searches for them begin."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.integrate.collocation import STAGES, C
from exudyn_flexlink.integrate.events import EVENT_TIME

CLOSE = 1e-9  # of a step: instants so little before it are within
FARTHEST = 2.0  # lengths of a step beyond its end: so far its polynomial tells places
DEGREES = np.arange(STAGES)
BY_STAGES = np.linalg.inv(C[:, None] ** DEGREES)  # coefficients of the polynomial through stages


class StepStages(NamedTuple):
    """Instants (stages,), s, independent coordinates z (stages, independent), and all y.

    `reach` (stages, all, independent) are the derivatives of y by z.
    """

    t: FloatArray
    z: FloatArray
    y: FloatArray
    reach: FloatArray

    def near(self, t: FloatArray, z: FloatArray) -> FloatArray | None:
        """Coordinates (n, all) about those at instants (n,) with these independent ones.

        None where those are far: there another way of closing the loops may be nearer.
        """
        if t is self.t or np.array_equal(t, self.t):
            return np.asarray(self.y + (self.reach @ (z - self.z)[:, :, None])[:, :, 0])
        h = max((self.t[-1] - self.t[0]) / (C[-1] - C[0]), EVENT_TIME)
        parts = 1 + (t - self.t[-1]) / h
        if parts.min() < -CLOSE or parts.max() > 1 + FARTHEST:
            return None
        weights = parts[:, None] ** DEGREES @ BY_STAGES
        _, coordinates, free = self.reach.shape
        reach = weights @ self.reach.reshape(STAGES, coordinates * free)
        moved = reach.reshape(len(t), coordinates, free) @ (z - weights @ self.z)[:, :, None]
        return np.asarray(weights @ self.y + moved[:, :, 0])
