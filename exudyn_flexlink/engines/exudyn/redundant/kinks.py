"""Steps end where torques and forces bend with the state, and are short from there on.

What the longest step out of a kink errs by, no second run need show: it may go over the kink
likewise.
"""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.redundant.events import end_on, first_zero
from exudyn_flexlink.engines.exudyn.redundant.step_end import StepEnd
from exudyn_flexlink.integrate.window import Window
from exudyn_flexlink.mechanism import Mechanism, sensed
from exudyn_flexlink.mechanism.prescribed import Formula

# Of the largest value so far, and at least of 1 in its SI unit: what the solver leaves of a rest.
REST = 1e-10


class Kinks:
    """Follows what max, min and abs compare in formulas of the state, from step to step."""

    def __init__(self, mechanism: Mechanism, window: Window) -> None:
        formulas = [(size.value, size.senses) for _, size in mechanism.sizes]
        self._bent = [(f, s) for f, s in formulas if isinstance(f, Formula) and f.expression.kinks]
        self._window = window
        self._last, self._rates, self._step = np.zeros(0), np.zeros(0), 0.0
        self._largest = np.zeros(1)

    def after_step(self, now: StepEnd, step: float) -> tuple[float, bool]:
        """Shorten the next step (s) to end on a kink; tell whether the last one passed any."""
        if not self._bent:
            return step, False
        values, last, h = self._values(now), self._last, now.step
        self._largest = np.maximum(self._largest, np.abs(values))
        values[np.abs(values) <= REST * np.maximum(self._largest, 1.0)] = 0.0
        self._last = values
        if h == 0:  # the run begins
            self._rates, self._step = 0 * values, 0.0
            return step, False
        rates = (values - last) / h
        bends = 2 * (rates - self._rates) / (h + self._step) if self._step > 0 else 0 * rates
        self._rates, self._step = rates, h
        own = np.sign(values) * np.array([values, rates + bends * h / 2, bends])
        for value, rate, bend in own.T.tolist():
            step = end_on(step, first_zero(value, rate, bend)) if value > 0 else step
        # One that is zero may stay so, or pass.
        passed = bool((np.sign(values) != np.sign(last)).any())
        return step, passed

    def _values(self, now: StepEnd) -> FloatArray:
        q, v = (np.reshape(x, (1, -1, 3)) for x in (now.q_list, now.v_list))
        time = np.array([self._window.inside(now.time)])
        found = [
            formula.expression.switches(time + formula.clock, [sensed(s, q, v) for s in senses])
            for formula, senses in self._bent
        ]
        return np.concatenate(found)[:, 0]
