"""Where torques and forces bend with the state: at what max, min and abs compare in their formulas.

Within a step a formula is held on one side of each kink, and so goes on smoothly beyond it: the
step's error is that of smooth equations. What is compared is an event function. The step is made
again to end at its zero, and from there the formula is held on the other side.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.minimal.coordinates import TreeState
from exudyn_flexlink.engines.exudyn.minimal.loads import LoadSize, Now
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.integrate.clock import instant
from exudyn_flexlink.integrate.events import EVENT_TIME, Event, first_fall
from exudyn_flexlink.integrate.radau import Step
from exudyn_flexlink.integrate.turning import StepPolynomial, chebyshev_sum

DEGREE = 8  # of the polynomials by which event functions are followed within a step
PARTS = (1 - np.cos(np.linspace(0.0, np.pi, DEGREE + 1))) / 2
THROUGH = np.linalg.inv(chebyshev.chebvander(2 * PARTS - 1, DEGREE)).T


class KinkPassed(NamedTuple):
    """A torque or force passes its kink of this number, at which its switch has this rate (1/s)."""

    load: LoadSize
    kink: int
    rate: float


class KinkWatch:
    """Looks at steps; knows the largest value of each switch so far, beside which others round."""

    def __init__(self, model: MinimalModel) -> None:
        self._model = model
        self._largest: dict[LoadSize, FloatArray] = {}

    def take_sides(self, time: float, q: FloatArray, v: FloatArray) -> None:
        """Hold formulas on the sides that the present state tells: times or speeds may jump."""
        for load in self._model.loads.bent:
            load.sides = []
            switches = load.switches(self._now(time, self._model.state(time, q, v)))
            load.sides = (switches[:, 0] < 0).astype(float).tolist()

    def cross(self, passed: KinkPassed) -> None:
        """Hold a formula on the other side of a kink."""
        passed.load.sides[passed.kink] = 1.0 - passed.load.sides[passed.kink]

    def first(self, step: Step) -> Event | None:
        """Passage of a kink that comes first within a step; None if there is none."""
        if not self._model.loads.bent:
            return None
        t = step.t + step.h * PARTS
        state = self._model.states(t, *step.at(t))
        now = self._model.loads.now(self._model.window.all_inside(t), state.x, state.v)
        found = []
        for load in self._model.loads.bent:
            values = load.switches(now)
            largest = np.maximum(self._largest.get(load, 0.0), np.abs(values).max(axis=1))
            self._largest[load] = largest
            ways = np.where(load.sides, -1.0, 1.0) / np.maximum(largest, np.finfo(float).tiny)
            for k, falling in enumerate(ways[:, None] * values @ THROUGH):
                if falling[0] > np.abs(falling[1:]).sum():  # it surely stays above zero
                    continue
                slopes = StepPolynomial.derivative(falling[None])[0].tolist()
                value = partial(chebyshev_sum, falling.tolist())
                part = first_fall(value, partial(chebyshev_sum, slopes), (0.0, 1.0))
                if part is not None:
                    rate = chebyshev_sum(slopes, part) / (ways[k] * step.h)
                    passed = KinkPassed(load, k, rate)
                    found.append(Event(step.t + part * step.h, passed, bends=True))
        return min(found, key=lambda event: event.time, default=None)

    def late(self, passed: KinkPassed, end: TreeState, time: float) -> float:
        """How long (s) before a step's end at this time the kink was; negative: after.

        0 where it is there.
        """
        value = float(passed.load.switches(self._now(time, end))[passed.kink, 0])
        near = abs(value) <= abs(passed.rate) * instant(time, EVENT_TIME)
        return 0.0 if near or passed.rate == 0 else value / passed.rate

    def _now(self, time: float, at: TreeState) -> Now:
        inside = self._model.window.inside(time)
        return self._model.loads.now(np.array([inside]), at.x[None], at.v[None])
