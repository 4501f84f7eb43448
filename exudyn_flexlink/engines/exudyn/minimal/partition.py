"""Which coordinates of closed loops are independent, and which follow from them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import qr

from exudyn_flexlink.arrays import FloatArray, IndexArray

RANK = 1e-9  # of the largest pivot: a smaller one counts as zero


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
