"""Whether a step has overlooked what a formula does between its stages, such as a short pulse.

A step knows torques, forces and prescribed motions at its stages alone, and so does the estimate
of its error: a pulse between two of them, in time or along the way, is in neither. So each term of
a formula is looked at over the whole step: see `expressions.strays`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.minimal.loads import Given, Now
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.expressions import LITTLE, Addend, Bounds, strays
from exudyn_flexlink.integrate.collocation import NODES, STAGES, C
from exudyn_flexlink.integrate.problem import Evaluation
from exudyn_flexlink.integrate.radau import Step
from exudyn_flexlink.integrate.window import Window
from exudyn_flexlink.mechanism.prescribed import Formula, SpeedOf

SHORTEST = 1e-9  # of the run: a step is made no shorter by a value that is one instant's alone
LITTLE_DRIVEN = 1e-3  # likewise as LITTLE, where nothing is free and no error is estimated
DEGREE = 8  # of the polynomials by which what is sensed is followed
POWERS = np.arange(DEGREE + 1)
ON_WAY = np.linspace(0.0, 1.0, DEGREE + 1)
AT_STAGES = np.array([0.0, *C])
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
    """Looks at the steps of a model; knows the largest value of each term at the stages so far."""

    def __init__(self, model: MinimalModel, end: float) -> None:
        """`end` (s) is that of the run."""
        self._model = model
        self._shortest = SHORTEST * end
        self._senses = any(size.senses for size in model.loads.by_formula)
        free = len(model.coordinates.independent()[0])
        self._little = LITTLE if free else LITTLE_DRIVEN
        self._drives = list(_driven(model))
        self._largest: dict[Addend, float] = {}

    def part(self, step: Step, allowed: float) -> float:
        """Part of a step after which a formula is not what its stages tell; 1 if nowhere.

        `allowed` is how far (m/s^2) anything's acceleration may be off, on average over the step.
        """
        earliest = 1.0
        for addends, clock, reach in self._drives:
            inputs = _Inputs(step.t, step.h, self._model.window, clock, np.zeros((0, DEGREE + 1)))
            earliest = min(earliest, self._earliest(addends, inputs, [], allowed / reach))
        if not self._model.loads.by_formula or not len(step.start.q):
            return earliest
        try:
            known = self._at_stages(step)
            within = self._within(step) if self._senses else known
        except (ValueError, ArithmeticError):  # no place within: the step itself was good
            return earliest
        for at, on_way in zip(known, within, strict=True):
            moved = self._moved(step.begin, at.unit[0])
            if moved == 0:
                continue
            coefficients = np.zeros((len(at.sensed), DEGREE + 1))
            if at.sensed:
                coefficients[:] = np.array(on_way.sensed) @ THROUGH.T
            window, clock = self._model.window, at.formula.clock
            inputs = _Inputs(step.t, step.h, window, clock, coefficients)
            found = self._earliest(
                at.formula.expression.addends, inputs, at.sensed, allowed / moved
            )
            earliest = min(earliest, found)
        return earliest

    def _at_stages(self, step: Step) -> list[Given]:
        begin, stages = step.begin.kept.state, step.stages.kept.state
        t = self._model.window.all_inside(step.t + step.h * AT_STAGES)
        x, v = np.vstack([begin.x, stages.x]), np.vstack([begin.v, stages.v])
        return self._model.loads.formulas(self._model.loads.now(t, x, v))

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

    def _earliest(
        self,
        addends: Sequence[Addend],
        inputs: _Inputs,
        sensed: Sequence[FloatArray],
        allowed: float,
    ) -> float:
        """As `part`, of terms that sense so at the start and the stages."""
        found = [self._of_one(addend, inputs, sensed, allowed) for addend in addends]
        return min(found, default=1.0)

    def _of_one(
        self, addend: Addend, inputs: _Inputs, sensed: Sequence[FloatArray], allowed: float
    ) -> float:
        known = addend.values(inputs.time(AT_STAGES), sensed)
        largest = max(self._largest.get(addend, 0.0), float(np.abs(known).max()))
        self._largest[addend] = largest
        coefficients, powers = NODES @ known, np.arange(STAGES + 1)
        found = strays(
            addend,
            inputs,
            lambda part: (part[:, None] ** powers) @ coefficients,
            lambda width: max(self._little * largest, allowed / width),
        )
        return 1.0 if found is None or found * inputs.h <= self._shortest else found


def _driven(model: MinimalModel) -> Iterator[tuple[list[Addend], float, float]]:
    """Of drives that prescribe by formulas: the terms of the acceleration, clock, and a length.

    Over that length (m) an angular acceleration moves what turns; 1 along a line.
    """
    mechanism = model.assembly.mechanism
    for motor in mechanism.speed_motors:
        reach = 1.0 if motor.slide else max(part.reach for part in mechanism.parts)
        if isinstance(motor.speed, Formula):
            yield motor.speed.expression.rate_addends, motor.speed.clock, reach
        elif isinstance(motor.speed, SpeedOf) and isinstance(motor.speed.motion, Formula):
            yield motor.speed.motion.expression.second_rate_addends, motor.speed.motion.clock, reach
