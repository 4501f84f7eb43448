"""Steps that end on events: where a track's curvature jumps, a contact begins, a run ends.

Across a jump of the forces a method of order 2 is only of order 1, so the step before an event is
shortened to end on it. Where torques and forces bend with the state, steps are short from there on:
what the longest one errs by, no second run need show, which may go over the kink likewise.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, sqrt

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.integrate.clock import Window
from exudyn_flexlink.mechanism import Mechanism, joint_speed, sensed
from exudyn_flexlink.mechanism.prescribed import Formula

# Of a step: an event nearer than this counts as reached. A step so short would fill the
# multipliers, which an index-3 method divides by the square of its step, with rounding.
REACHED = 1e-2
# Of the largest value so far, and at least of 1 in its SI unit: what the solver leaves of a rest.
REST = 1e-10
STEEP = 10.0  # slip speeds: where friction of a joint is its bound, but for 4e-9


@dataclass(frozen=True, slots=True)
class StepEnd:
    """Time (s), length of the step that ended there (s), coordinates and velocities.

    `q` and `v` are the solver's coordinates; `q_list` and `v_list` those of all parts, one after
    the other: plain lists are faster where a few numbers are needed.
    """

    time: float
    step: float
    q: FloatArray
    v: FloatArray
    q_list: list[float]
    v_list: list[float]


def end_on(step: float, until: float) -> float:
    """Shorten `step` (s) so that a whole number of steps ends on an event `until` seconds ahead.

    An event between one and two steps ahead is reached by two equal ones, so that none is tiny.
    """
    if until <= step * (1 + REACHED):
        return max(until, REACHED * step)
    if until < 2 * step:
        return until / 2
    return step


def first_zero(value: float, rate: float, curvature: float) -> float:
    """Time until ``value + rate t + curvature t^2/2`` falls to 0 from above, s; inf if it does not.

    `value` must be positive.
    """
    if abs(curvature) * value < 1e-12 * rate * rate or curvature == 0:
        return -value / rate if rate < 0 else inf
    discriminant = rate * rate - 2 * curvature * value
    if discriminant < 0:
        return inf
    root = sqrt(discriminant)
    # The smaller positive root, in the form that does not cancel.
    if rate < 0:
        return 2 * value / (-rate + root)
    return (rate + root) / -curvature if curvature < 0 else inf


class Kinks:
    """Follows what max, min and abs compare in formulas of the state, from step to step.

    And where friction of joints, which is smooth but steep, begins and ends to change.
    """

    def __init__(self, mechanism: Mechanism, window: Window) -> None:
        formulas = [(size.value, size.senses) for _, size in mechanism.sizes]
        self._bent = [(f, s) for f, s in formulas if isinstance(f, Formula) and f.expression.kinks]
        self._frictions = mechanism.frictions
        self._window = window
        self._last, self._rates, self._step = np.zeros(0), np.zeros(0), 0.0
        self._largest = np.zeros(1)

    def after_step(self, now: StepEnd, step: float) -> tuple[float, bool]:
        """Shorten the next step (s) to end on a kink; tell whether the last one passed any."""
        if not (self._bent or self._frictions):
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
        speeds = [joint_speed(own.joint, q, v) / own.slip_speed for own in self._frictions]
        steep = [speed + side for speed in speeds for side in (-STEEP, STEEP)]
        return np.concatenate([*(values[:, 0] for values in found), *steep])
