"""How all coordinates of a tree follow the independent ones: the velocity transformation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from exudyn_flexlink.arrays import BoolArray, FloatArray, IndexArray

Which = int | slice | IndexArray | BoolArray | None
"""One of several instants, some of them, or (None) the only one as one of one."""


@dataclass(frozen=True)
class Transform:
    """T of ``x'' = T z'' + b``, (links, independent); of several instants with one axis more.

    Where the independent coordinates are some of the tree's, `chosen`, and no other follows them, T
    is the same at all instants and only picks those: then nothing needs to be multiplied.
    """

    matrix: FloatArray
    chosen: slice | IndexArray | None = None

    def __getitem__(self, which: Which) -> Transform:
        """One of several instants, or some of them: see `coordinates.TreeState`."""
        return self if self.chosen is not None else Transform(self.matrix[which])

    def reduced_rows(self, rows: FloatArray) -> FloatArray:
        """Rows (..., links), as of forces, times T: those of the independent coordinates."""
        if self.chosen is not None:
            return np.asarray(rows[..., self.chosen])
        return np.asarray((rows[..., None, :] @ self.matrix)[..., 0, :])

    def reduced(self, matrices: FloatArray) -> FloatArray:
        """``T^T M T`` of matrices (..., links, links)."""
        if self.chosen is not None:
            return np.asarray(matrices[..., self.chosen][..., self.chosen, :])
        return np.asarray(np.swapaxes(self.matrix, -1, -2) @ matrices @ self.matrix)

    def expanded(self, free: FloatArray) -> FloatArray:
        """T times independent values (..., independent): those of all coordinates."""
        if self.chosen is None:
            return np.asarray((self.matrix @ free[..., None])[..., 0])
        found = np.zeros((*free.shape[:-1], len(self.matrix)))
        found[..., self.chosen] = free
        return found
