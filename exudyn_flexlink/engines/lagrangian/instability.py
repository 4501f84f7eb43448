"""How much small errors may grow by themselves between contacts; see `integrate.growth`."""

from __future__ import annotations

from functools import partial

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.lagrangian.system import System
from exudyn_flexlink.integrate.growth import Growth
from exudyn_flexlink.integrate.radau import Step

# Far fewer looks overlook limp links whose motion changes within a few dozen steps.
MOST_LOOKS = 16
SHIFT = 1e-5  # rad: changes of angles that derivatives are taken from


class Instability:
    """Follows the steps of a run that ends at `end` (s)."""

    def __init__(self, system: System, end: float) -> None:
        self._system = system
        # With play the error is measured in any case: touches multiply it.
        self._idle = system.model.mechanism.has_play
        self.growth = Growth(end / MOST_LOOKS)

    def follow(self, step: Step) -> None:
        """Go along a step, before its end is taken up."""
        if self._idle or not len(step.start.q) or self._strikes():
            return
        if self.growth.due(step.t):
            shift = np.full(len(step.start.q), SHIFT)
            state = step.start.q, step.start.v
            accelerations = partial(self._accelerations, step.t)
            self.growth.look(step.t, state, (shift, shift / step.h), accelerations)
        self.growth.go(step.h)

    def _strikes(self) -> bool:
        """Whether anything touches but walls that always hold the link."""
        return bool((self._system.touching & ~self._system.contacts.held).any())

    def _accelerations(self, t: float, q: FloatArray, v: FloatArray) -> FloatArray:
        at = self._system.motion(np.full(len(q), t), q, v)
        return self._system.accelerations(at)[0][:, self._system.model.first :]
