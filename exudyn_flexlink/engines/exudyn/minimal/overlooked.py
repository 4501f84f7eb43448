"""Whether a step has overlooked what a formula does between its stages, such as a short pulse.

A step knows torques and forces at its stages alone, and so does the estimate of its error: a pulse
between two of them, in time or along the way, is in neither. Here each term of a formula is bounded
over parts of the step, by interval arithmetic. Where it may leave the polynomial through the
stages, it is looked at, in ever shorter parts, until it is found to do so or can't do so by enough
to matter.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.minimal.loads import Given, Now
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.expressions import Addend, Bounds
from exudyn_flexlink.integrate.collocation import NODES, STAGES, C
from exudyn_flexlink.integrate.problem import Evaluation
from exudyn_flexlink.integrate.radau import Step
from exudyn_flexlink.integrate.window import Window

PARTS = 8  # of a step that are looked at first
MOST_PARTS = 32  # looked at together: a formula that takes the same thing twice has wide bounds
HALVINGS = 40  # of these parts: then rounding of the time is near
SHORTEST = 1e-9  # of the run: a step is made no shorter by a value that is one instant's alone
LITTLE = 0.02  # of the largest value at any stage so far: less is left to the estimate of the error
POWERS = np.arange(PARTS + 1)
ON_WAY = np.linspace(0.0, 1.0, PARTS + 1)
THROUGH = np.linalg.inv(ON_WAY[:, None] ** POWERS)  # coefficients of the polynomial through these


class _Course(NamedTuple):
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
        self._largest: dict[Addend, float] = {}

    def part(self, step: Step, allowed: float) -> float:
        """Part of a step after which a formula is not what its stages tell; 1 if nowhere.

        `allowed` is how far (m/s^2) anything's acceleration may be off, on average over the step.
        """
        if not self._model.loads.by_formula or not len(step.start.q):
            return 1.0
        try:
            known = self._at_stages(step)
            within = self._within(step) if self._senses else known
        except (ValueError, ArithmeticError):  # no place within: the step itself was good
            return 1.0
        earliest = 1.0
        for at, on_way in zip(known, within, strict=True):
            moved = self._moved(step.begin, at.unit[0])
            if moved == 0:
                continue
            coefficients = np.zeros((len(at.sensed), PARTS + 1))
            if at.sensed:
                coefficients[:] = np.array(on_way.sensed) @ THROUGH.T
            window, clock = self._model.window, at.formula.clock
            course = _Course(step.t, step.h, window, clock, coefficients)
            times = course.time(np.array([0.0, *C]))
            for addend in at.formula.addends:
                values = addend.values(times, at.sensed)
                earliest = min(earliest, self._earliest(addend, course, values, allowed / moved))
        return earliest

    def _at_stages(self, step: Step) -> list[Given]:
        begin, stages = step.begin.kept.held, step.stages.kept.held
        t = self._model.window.all_inside(step.t + step.h * np.array([0.0, *C]))
        x, v = np.vstack([begin.x, stages.x]), np.vstack([begin.v, stages.v])
        return self._model.loads.formulas(self._model.loads.now(t, x, v))

    def _within(self, step: Step) -> list[Given]:
        """What formulas sense on the step's polynomial."""
        model = self._model
        t = model.window.all_inside(step.t + step.h * ON_WAY)
        held = model.coordinates.hold(t, *step.at(t))
        now: Now = model.loads.now(t, held.x, held.v)
        return model.loads.formulas(now)

    def _moved(self, begin: Evaluation, unit: FloatArray) -> float:
        """How much (m/s^2) anything accelerates by a unit of a torque or force."""
        reach = self._model.reach(begin.kept.held)
        return self._model.size(np.linalg.solve(begin.mass, reach.T @ unit))

    def _earliest(
        self, addend: Addend, course: _Course, known: FloatArray, allowed: float
    ) -> float:
        """As `part`, of one term; `known` are its values at the start and the stages."""
        largest = max(self._largest.get(addend, 0.0), float(np.abs(known).max()))
        self._largest[addend] = largest
        polynomial, powers = NODES @ known, np.arange(STAGES + 1)
        begin, width = np.arange(PARTS) / PARTS, 1.0 / PARTS
        for _ in range(HALVINGS):
            middle = begin + width / 2
            ends = np.array([begin, middle, begin + width])
            expected = (ends[..., None] ** powers) @ polynomial
            enough = max(LITTLE * largest, allowed / width)
            off = np.abs(addend.values(course.time(middle), course.state(middle)) - expected[1])
            if (off > enough).any():
                first = float(middle[off > enough].min())
                return first if first * course.h > self._shortest else 1.0
            low, high = addend.ranges(*course.bounds(begin, width))
            beyond = np.maximum(high - expected.max(0), expected.min(0) - low)
            left = np.flatnonzero(beyond > enough)
            if not len(left):
                return 1.0
            left = left[np.argsort(beyond[left])[-MOST_PARTS:]]
            begin, width = np.sort(np.concatenate([begin[left], middle[left]])), width / 2
        return 1.0
