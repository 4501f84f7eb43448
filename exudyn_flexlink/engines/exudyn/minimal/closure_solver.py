"""Which coordinates follow others where loops close, and where they are: by Newton's method."""

from __future__ import annotations

from itertools import count
from typing import NamedTuple

import numpy as np
from scipy.linalg import qr

from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.engines.exudyn.minimal.closures import Closures, Where
from exudyn_flexlink.engines.track_follower import DeadCentreError
from exudyn_flexlink.integrate.collocation import STAGES, C
from exudyn_flexlink.integrate.events import EVENT_TIME

RANK = 1e-9  # of the largest pivot: a smaller one counts as zero
CLOSE = 1e-9  # of a step: instants so little before it are within
FARTHEST = 2.0  # lengths of a step beyond its end: so far its polynomial tells places
DEGREES = np.arange(STAGES)
BY_STAGES = np.linalg.inv(C[:, None] ** DEGREES)  # coefficients of the polynomial through stages
MOST_ITERATIONS = 12
NEAR = 1e-9  # of the mechanism's size: Newton's method is quadratic, but right at a dead centre
OPEN = 1e-9  # m, or of the size for angles: redundant joints open by more contradict others
ROUNDING = 1e-14  # of the mechanism's size: to which lengths are summed up

NOT_CLOSED = "the joints of a loop can't all stay closed"


class Partition(NamedTuple):
    """Indices of dependent and independent coordinates, and of the closures' rows in use."""

    dependent: IndexArray
    free: IndexArray
    rows: IndexArray


def partition(jacobian: FloatArray, known: IndexArray) -> Partition:
    """Choose by pivoting the closures' scaled Jacobian (rows, coordinates).

    The `known` coordinates are those of motors: neither independent nor dependent, and their
    columns are 0. Rows that others imply are left out.
    """
    upper, order = qr(jacobian, mode="r", pivoting=True)
    pivots = np.abs(np.diag(upper))
    rank = int(np.sum(pivots > RANK * pivots[0]))
    dependent = np.sort(order[:rank])
    rows = np.sort(qr(jacobian[:, dependent].T, mode="r", pivoting=True)[1][:rank])
    fixed = {*dependent.tolist(), *known.tolist()}
    free = np.array([i for i in range(jacobian.shape[1]) if i not in fixed], dtype=int)
    return Partition(dependent, free, rows)


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
