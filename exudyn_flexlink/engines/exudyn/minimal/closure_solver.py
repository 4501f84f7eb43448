"""Newton's method for the coordinates that follow others in closed loops, at many instants."""

from __future__ import annotations

from itertools import count
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.minimal.closures import Closures, Where
from exudyn_flexlink.engines.exudyn.minimal.partition import Partition
from exudyn_flexlink.engines.track_follower import DeadCentreError

MOST_ITERATIONS = 12
NEAR = 1e-9  # of the mechanism's size: Newton's method is quadratic, but right at a dead centre
OPEN = 1e-9  # m, or of the size for angles: redundant joints open by more contradict others
ROUNDING = 1e-14  # of the mechanism's size: to which lengths are summed up

NOT_CLOSED = "the joints of a loop can't all stay closed"


class Placed(NamedTuple):
    """All coordinates y (n, all) at some instants, and how the dependent ones follow.

    `jacobian` (n, rows, all) is that of the rows in use, `inverse` that of its dependent columns;
    `reach` (n, all, independent) are the derivatives by the independent ones.
    """

    y: FloatArray
    at: Where
    jacobian: FloatArray
    inverse: FloatArray
    reach: FloatArray


class ClosureSolver:
    """Solves for the dependent coordinates of a mechanism of this `size` (m)."""

    def __init__(self, closures: Closures, size: float) -> None:
        self._closures, self._size = closures, size
        self.row_scale = np.where(closures.angles, size, 1.0)  # m by residuals

    def placed(self, t: FloatArray, y: FloatArray, split: Partition, lengths: FloatArray) -> Placed:
        """Close all loops, from coordinates `y` (n, all) on, which are overwritten.

        `lengths` (dependent,), m, are how far a unit of each dependent coordinate moves anything.

        Raises:
            DeadCentreError: there is no place near where all closures hold.

        """
        at, jacobian, inverse = self._closed(t, y, split, lengths)
        reach = np.zeros((*y.shape, len(split.free)))
        reach[:, split.free, np.arange(len(split.free))] = 1.0
        reach[:, split.dependent] = -inverse @ jacobian.take(split.free, axis=2)
        return Placed(y, at, jacobian, inverse, reach)

    def _closed(
        self, t: FloatArray, y: FloatArray, split: Partition, lengths: FloatArray
    ) -> tuple[Where, FloatArray, FloatArray]:
        """Where everything is, the Jacobian of the rows in use, and the dependent ones' inverse."""
        closures, size = self._closures, np.inf
        for rounds in count():
            at = closures.where(y)
            residual = closures.residual(t, at)
            jacobian = closures.jacobian(at).take(split.rows, axis=1)
            try:
                inverse = np.linalg.inv(jacobian.take(split.dependent, axis=2))
            except np.linalg.LinAlgError as error:
                raise DeadCentreError(NOT_CLOSED) from error
            if size <= NEAR * self._size or rounds == MOST_ITERATIONS:
                break
            change = (inverse @ residual.take(split.rows, axis=1)[:, :, None])[:, :, 0]
            before, size = size, float(np.abs(change * lengths).max(initial=0.0))
            if not size < 2 * before or not np.isfinite(size):
                raise DeadCentreError(NOT_CLOSED)
            y[:, split.dependent] -= change
            if size <= ROUNDING * self._size:
                break
        if np.abs(residual * self.row_scale).max(initial=0.0) > OPEN * max(1.0, self._size):
            raise DeadCentreError(NOT_CLOSED)
        return at, jacobian, np.asarray(inverse)
