"""Springs and dampers of a tree that its joints do not have: across several of them, or none."""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray


class SpringsAcross:
    """Springs and dampers that act across several hinges of the tree, or none."""

    def __init__(self, count: int) -> None:
        self.stiffness, self.damping = np.zeros((2, count, count))
        self._pull = np.zeros(count)
        self.any = False

    def add(self, row: FloatArray, stiffness: float, damping: float, rest: float) -> None:
        """Add a spring whose angle is ``row @ x``, at rest where that is `rest` (rad)."""
        square = np.outer(row, row)
        self.stiffness += stiffness * square
        self.damping += damping * square
        self._pull += stiffness * rest * row
        self.any = True

    def pull(self, x: FloatArray, v: FloatArray) -> FloatArray:
        """Generalised forces (instants, links) at coordinates and speeds (instants, links)."""
        return np.asarray(self._pull - x @ self.stiffness - v @ self.damping)
