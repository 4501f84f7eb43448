"""How much small errors may grow by themselves between contacts; see `integrate.growth`."""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.lagrangian.sampling import motions_at
from exudyn_flexlink.engines.lagrangian.system import System
from exudyn_flexlink.integrate.growth import Growth

# A look takes as long as some five steps. These are as many as short runs can afford: far fewer
# overlook limp links whose motion changes within a few dozen steps.
MOST_LOOKS = 16
STEPS_APART = 12  # from one look to the next, at least
SHIFT = 1e-5  # rad: changes of angles that derivatives are taken from


class Instability:
    """Follows the steps of a run that ends at `end` (s)."""

    def __init__(self, system: System, end: float) -> None:
        self._system = system
        # With play the error is measured in any case: touches multiply it.
        self._idle = system.model.mechanism.has_play or not system.free
        self.growth = Growth(end / MOST_LOOKS)
        self._since = STEPS_APART  # steps

    def follow(self, times: FloatArray, states: FloatArray, places: FloatArray) -> None:
        """Go along m steps from `times` (m,) to the next of `times` (m + 1,), s.

        They begin in `states` (m, size), with P at `places` (m,) of its piece.
        """
        if self._idle or self._system.acting.any():
            return
        for t, h, y, near in zip(times[:-1].tolist(), np.diff(times), states, places, strict=False):
            if self._since >= STEPS_APART and self.growth.due(t):
                self._look(t, float(h), y, float(near))
                self._since = 0
            self.growth.go(float(h))
            self._since += 1

    def _look(self, t: float, h: float, y: FloatArray, near: float) -> None:
        free, mode = self._system.free, self._system.mode()
        first = self._system.first

        def accelerations(q: FloatArray, v: FloatArray) -> FloatArray:
            count = len(q)
            others = np.broadcast_to(y[2 * free :], (count, len(y) - 2 * free))
            # Of one coordinate `hstack` makes columns: machine code would be compiled anew for it.
            states = np.ascontiguousarray(np.hstack([q, v, others]))
            instants, near_p = np.full(count, t), np.full(count, near)
            found = motions_at(instants, states, near_p, mode, True)
            return np.asarray(found.a[:, first:])

        shifts = np.full(free, SHIFT), np.full(free, SHIFT / h)
        self.growth.look(t, (y[:free], y[free : 2 * free]), shifts, accelerations)
