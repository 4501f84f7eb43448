"""Whether a step has overlooked a short pulse of a formula of the state, along the way.

A step knows torques and forces at its stages alone, and so does the estimate of its error: a pulse
between two of them is in neither. So each term of a formula that senses the state is looked at over
the whole step: see `expressions.strays`. Pulses of time alone are known before: `mechanism.pulses`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.minimal.loads import Given, Now
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.expressions import Addend, Bounds, strays
from exudyn_flexlink.integrate.problem import Evaluation
from exudyn_flexlink.integrate.radau import Step
from exudyn_flexlink.integrate.window import Window

SHORTEST = 1e-9  # of the run: a step is made no shorter by a value that is one instant's alone
DEGREE = 8  # of the polynomials by which what is sensed is followed
POWERS = np.arange(DEGREE + 1)
ON_WAY = np.linspace(0.0, 1.0, DEGREE + 1)
THROUGH = np.linalg.inv(ON_WAY[:, None] ** POWERS)  # coefficients of the polynomial through these


class _Inputs(NamedTuple):
    """What a formula takes within a step: its t (s), and coefficients of what is sensed."""

    begin: float
    h: float
    window: Window
    clock: float  # s: what t is as the run begins
    sensed: FloatArray  # (sensed, powers)

    def time(self, part: FloatArray) -> FloatArray:
        return self.clock + self.window.all_inside(self.begin + self.h * part)

    def state(self, part: FloatArray) -> list[FloatArray]:
        return list(self.sensed @ (part[:, None] ** POWERS).T)

    def bounds(self, begin: FloatArray, width: float) -> tuple[Bounds, list[Bounds]]:
        """Bounds of the time and of what is sensed, over parts of the step."""
        ends = [begin, begin + width / 2, begin + width]
        found = []
        for first, middle, last in zip(*(self.state(part) for part in ends), strict=True):
            bulge = np.abs(middle - (first + last) / 2)  # a parabola leaves its chord by no more
            found.append(Bounds(np.minimum(first, last) - bulge, np.maximum(first, last) + bulge))
        return Bounds(self.time(begin), self.time(begin + width)), found


class Overlooked:
    """Looks at the steps of a model."""

    def __init__(self, model: MinimalModel, end: float) -> None:
        """`end` (s) is that of the run."""
        self._model, self._end = model, end
        self._senses = any(size.senses for size in model.loads.by_formula)

    def part(self, step: Step, allowed: float) -> float:
        """Part of a step after which a formula is not what its stages tell; 1 if nowhere.

        `allowed` is how far (m/s^2) anything's acceleration may be off, on average over the run.
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
            coefficients = np.array(on_way.sensed) @ THROUGH.T
            window, clock = self._model.window, on_way.formula.clock
            inputs = _Inputs(step.t, step.h, window, clock, coefficients)
            area = allowed / moved * self._end / step.h  # of a part of the step
            for addend in on_way.formula.expression.addends:
                found = self._of_one(addend, inputs, on_way.sensed, area)
                earliest = min(earliest, found)
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

    def _of_one(
        self, addend: Addend, inputs: _Inputs, sensed: Sequence[FloatArray], area: float
    ) -> float:
        """As `part`, of a term that senses so on the way."""
        coefficients = THROUGH @ addend.values(inputs.time(ON_WAY), sensed)
        found = strays(
            addend,
            inputs,
            lambda part: (part[:, None] ** POWERS) @ coefficients,
            lambda width: area / width,
        )
        return 1.0 if found is None or found * inputs.h <= SHORTEST * self._end else found
