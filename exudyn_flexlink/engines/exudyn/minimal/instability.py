"""How much small errors may grow by themselves between contacts; see `integrate.growth`.

A mechanism with one independent coordinate that nothing drives follows one path, and two motions
along it part as its own speed and acceleration change: what it loses in one place it wins in the
next. There that ratio bounds the growth, as of a rod that turns over its top again and again.
"""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.integrate.growth import Growth
from exudyn_flexlink.integrate.radau import Step

EVALUATIONS = 2000  # of the equations in a run: where this was chosen, less than a tenth of it
MOST_LOOKS = 64
TINY = 1e-300  # m/s: stands for rest, whose logarithm is none


class Instability:
    """Follows the steps of a run that ends at `end` (s)."""

    def __init__(self, model: MinimalModel, end: float) -> None:
        self._model = model
        mechanism, free = model.assembly.mechanism, len(model.coordinates.independent()[0])
        # With play the error is measured in any case: touches multiply it.
        self._idle = mechanism.has_play or not free
        driven = mechanism.speed_motors or model.loads.any
        looks = min(MOST_LOOKS, EVALUATIONS // (4 * max(free, 1)))
        self._growth = Growth(end / max(1, looks))
        self._on_one_path = free == 1 and not driven
        self._along_path: list[tuple[float, float]] = []  # speeds (m/s), accelerations (m/s^2)

    @property
    def e_folds(self) -> float:
        """By how many factors e errors may have grown so far."""
        found = self._growth.e_folds
        if found == 0 or not self._on_one_path:
            return found
        speed, acceleration = np.array(self._along_path).T
        own = np.hypot(speed, acceleration / self._growth.fastest)
        own = np.log(np.maximum(own, TINY))
        return min(found, float((own - np.minimum.accumulate(own)).max()))

    def ringing(self, time: float, steps: int) -> float:
        """How many steps of a run fast vibrations last over: of so many steps in a time (s)."""
        return self._growth.ringing(time, steps)

    def follow(self, step: Step) -> None:
        """Go along a step that is accepted, before its end is the model's present state."""
        if self._idle or self._model.pressed_of_scene:
            return
        start, size = step.start, self._model.size
        if self._growth.due(step.t):
            places = self._model.shifts()
            self._growth.look(
                step.t,
                (start.q, start.v),
                (places, places / step.h),
                lambda q, v: self._model.evaluate_all(np.full(len(q), step.t), q, v).accelerations,
            )
        self._growth.go(step.h)
        if self._on_one_path:
            self._along_path.append((float(size(start.v)), float(size(start.a))))
