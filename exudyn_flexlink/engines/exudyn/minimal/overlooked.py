"""Whether a step has overlooked a short pulse of a formula of the state, along the way.

A step knows torques and forces at its stages alone, and so does the estimate of its error: a pulse
between two of them is in neither. So each term of a formula that senses the state is looked at over
the whole step, by bounds: see `expressions.resolved`. Pulses of time alone are found before the
run: see `mechanism.pulses`.
"""

from __future__ import annotations

from math import factorial
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.minimal.loads import Given, Now
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.expressions import RATES, SHORTER, Bounds, resolved
from exudyn_flexlink.integrate.problem import Evaluation
from exudyn_flexlink.integrate.radau import Step

SHORTEST = 1e-9  # of the run: a step is made no shorter by a value that is one instant's alone
DEGREE = 8  # of the polynomials by which what is sensed is followed
POWERS = np.arange(DEGREE + 1)
BETWEEN = np.maximum(POWERS - POWERS[:, None], 0)
FACTORIALS = np.array([float(factorial(power)) for power in POWERS])
ON_WAY = np.linspace(0.0, 1.0, DEGREE + 1)
THROUGH = np.linalg.inv(ON_WAY[:, None] ** POWERS)  # coefficients of the polynomial through these


class _Along(NamedTuple):
    """What formulas sense along a step: derivatives (powers, sensed) at its begin `t` (s)."""

    t: float
    rates: FloatArray

    def bounds(self, within: Bounds) -> dict[int, Bounds]:
        """Bounds of it and of its time derivatives, over parts of the step."""
        middle, radius = (within.high + within.low) / 2 - self.t, (within.high - within.low) / 2
        values = _taylor(middle) @ self.rates
        off = (_taylor(radius) - np.eye(DEGREE + 1)) @ np.abs(values)
        low, high = (values - off).transpose(1, 2, 0), (values + off).transpose(1, 2, 0)
        return {
            k + RATES * j: Bounds(low[j, k], high[j, k])
            for j, k in np.ndindex(low.shape[0], low.shape[1])
        }


def _taylor(ahead: FloatArray) -> FloatArray:
    """Derivatives of a polynomial from those a time (n,) s before: matrices (n, powers, powers)."""
    return np.triu(ahead[:, None, None] ** BETWEEN / FACTORIALS[BETWEEN])


class Overlooked:
    """Looks at the steps of a model."""

    def __init__(self, model: MinimalModel, end: float) -> None:
        """`end` (s) is that of the run."""
        self._model, self._end = model, end
        self._senses = any(size.senses for size in model.loads.by_formula)

    def part(self, step: Step, allowed: float) -> float:
        """Part of a step after which a formula is not what its stages tell; 1 if nowhere.

        `allowed` is how far (m) that may have moved anything by the end of the run.
        """
        earliest = 1.0
        if not self._senses or not len(step.start.q):
            return earliest
        try:
            within = self._within(step)
        except (ValueError, ArithmeticError):  # no place within: the step itself was good
            return earliest
        for on_way in within:
            moved = self._moved(step.begin, on_way.unit[0])
            if moved == 0 or not on_way.sensed:
                continue
            clock = on_way.formula.clock
            rates = (FACTORIALS / step.h**POWERS)[:, None] * (THROUGH @ np.array(on_way.sensed).T)
            ends = clock + self._model.window.all_inside(step.t + step.h * ON_WAY[[0, -1]])
            along = _Along(clock + step.t, rates)
            by_area = allowed / (moved * (self._end - step.t))
            terms = on_way.formula.expression.addends
            for addend in (term for term in terms if not term.of_time):
                edges, _ = resolved(addend, ends, lambda _: 1.0, by_area, along.bounds)
                short = np.flatnonzero(np.diff(edges) < step.h / SHORTER)
                inner = np.union1d(edges[short], edges[short + 1]) - ends[0]
                inner = inner[(inner > SHORTEST * self._end) & (inner < step.h)]
                earliest = min(earliest, *(inner[:1] / step.h), 1.0)
        return earliest

    def _within(self, step: Step) -> list[Given]:
        """What formulas sense on the step's polynomial."""
        model = self._model
        t = model.window.all_inside(step.t + step.h * ON_WAY)
        state = model.coordinates.states(t, *step.at(t))
        now: Now = model.loads.now(t, state.x, state.v)
        return model.loads.formulas(now)

    def _moved(self, begin: Evaluation, unit: FloatArray) -> float:
        """How much (m/s^2) anything accelerates by a unit of a torque or force."""
        push = begin.kept.state.transform.reduced_rows(unit)
        return self._model.size(np.linalg.solve(begin.mass, push))
