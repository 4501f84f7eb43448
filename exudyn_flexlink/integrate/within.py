"""Instants within several steps, and all that is polynomial between their nodes, at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.integrate.collocation import POWERS
from exudyn_flexlink.integrate.radau import DEGREES, Step


class Within(NamedTuple):
    """Instants `t` (n,), s, and in `which` (n,) of the steps each of them is."""

    steps: Sequence[Step]
    which: IndexArray
    t: FloatArray

    @property
    def parts(self) -> FloatArray:
        """The part (n,) of its step after which each instant is."""
        begins = np.array([step.t for step in self.steps])[self.which]
        return np.asarray((self.t - begins) / self._lengths)

    @property
    def _lengths(self) -> FloatArray:
        return np.array([step.h for step in self.steps])[self.which]

    def through(self, nodes: FloatArray) -> FloatArray:
        """Values (n, ...) of polynomials through those (steps, 1 + stages, ...) at starts, stages.

        They are of degree 5.
        """
        return self._summed(self.parts[:, None] ** DEGREES, nodes)

    def coordinates(self) -> tuple[FloatArray, FloatArray]:
        """Coordinates and speeds (n, ...), as `Step.at` has them."""
        starts = np.array([step.start.q for step in self.steps])[self.which]
        speeds, parts = np.array([step.speeds for step in self.steps]), self.parts[:, None]
        moved = self._summed(parts ** (DEGREES + 1) / (DEGREES + 1), speeds)
        return starts + self._lengths[:, None] * moved, self._summed(parts**DEGREES, speeds)

    def _summed(self, powers: FloatArray, nodes: FloatArray) -> FloatArray:
        """Polynomials by weights (n, 1 + stages) of their coefficients."""
        coefficients = (POWERS @ nodes)[self.which]
        return np.asarray((powers[:, None] @ coefficients)[:, 0])
