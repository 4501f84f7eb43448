"""The formula that ends a run, of time, state and forces in joints, as it rises through zero.

What the formula senses is represented within a step by polynomials: through values of the motion at
Chebyshev's points, and through forces at the step's nodes. They give bounds of the formula in any
part of the step. A part in which it may come to zero is halved, the first half first, so that the
first of several crossings is located. The step is made again to end there.

If the formula is no longer below zero when a step begins, it has jumped: by an impact, as friction
changes sign, or at a knot of a force or of the formula. A run that goes on from another one, as a
stage does, may begin with a formula that is not below zero. There it has to fall below zero first.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from exudyn_flexlink.arrays import BoolArray, FloatArray
from exudyn_flexlink.engines.exudyn.minimal.formulas import (
    DEGREE,
    FACTORIALS,
    TAYLOR_POWERS,
    TO_POWERS,
    AlongStep,
    along_step,
)
from exudyn_flexlink.engines.exudyn.minimal.kinematics import joined
from exudyn_flexlink.engines.exudyn.minimal.loads import Sensor, sensor_of
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.engines.exudyn.minimal.reactions import JointForces
from exudyn_flexlink.engines.exudyn.minimal.recording import TreeRecorder
from exudyn_flexlink.engines.recording import push_of
from exudyn_flexlink.expressions import Bounds
from exudyn_flexlink.integrate.events import EVENT_TIME, Crossing, Guard, zero
from exudyn_flexlink.integrate.problem import Evaluation, instant
from exudyn_flexlink.integrate.radau import Step
from exudyn_flexlink.mechanism import Held, Until, until_mistakes
from exudyn_flexlink.rounding import NEGLIGIBLE
from exudyn_flexlink.source import KeyPath, Mistake

FIRST_PARTS = np.linspace(0.0, 1.0, 9)  # of a step: ends of the parts that are bounded first
LITTLE = 1e-13  # of the formula's terms: a value above minus this counts as zero
FINEST = 2.0**-16  # of a step: two crossings that are nearer to each other may not be seen
ASIDE = 1e-4  # of a step: the rate at a crossing is a difference from so far before to after it


@dataclass(frozen=True)
class UntilGuard(Guard):
    """The formula comes to zero with this rate (1/s); None: it has jumped above zero."""

    watch: UntilWatch
    rate: float | None
    over: Callable[[], None]

    def late(self, step: Step) -> float:
        """How long (s) before a step's end the formula was zero; negative: after."""
        value, rounding = self.watch.at_end(step)
        rate = self.rate or 0.0
        near = abs(value) <= max(rounding, abs(rate) * instant(step.end, EVENT_TIME))
        return 0.0 if near or rate == 0 else value / rate

    def cross(self, time: float) -> None:
        """End the run; after a jump record the state, so that the result has it."""
        if self.rate is None:
            self.watch.keep(time)
        self.over()


class UntilWatch:
    """Finds in steps where the formula comes to zero; `over` is called then."""

    def __init__(
        self,
        model: MinimalModel,
        recorder: TreeRecorder,
        until: Until,
        over: Callable[[], None],
        *,
        goes_on: bool = False,
    ) -> None:
        self._model, self._recorder, self._until, self._over = model, recorder, until, over
        self._waits = goes_on  # until the formula has been below zero
        self.waited = False  # whether it was not below zero as the run began
        self._sensors: list[Sensor | Held] = [
            sense if isinstance(sense, Held) else sensor_of(model.layout, model.kinematics, sense)
            for sense in until.senses
        ]
        self._in_motion = [not isinstance(sensor, Held) for sensor in self._sensors]
        self._size = 0.0  # of the formula's terms, the largest so far

    def mistakes(self, path: KeyPath) -> list[Mistake]:
        """Mistakes of a formula, at a `path` of the scene, that ends the run as it begins.

        Raises:
            NoValueError: the formula has no value at time 0.

        """
        start = self._model.evaluate(0.0, *self._model.coordinates.independent())
        return until_mistakes(self._until, self._sensed(*_alone(start)), path)

    def first(self, step: Step) -> Crossing | None:
        """Where the formula comes to zero first in a step; at its start, if the formula jumped."""
        value, rounding = self._value(*_alone(step.begin))
        below = NEGLIGIBLE * self._size  # how far below zero it has to have been
        self._waits = self._waits and value >= -below
        self.waited |= self._waits
        if value >= -rounding and not self._waits:
            return Crossing(step.t, UntilGuard(self, None, self._over))
        rates, begin = self._rates(step), 0.0
        if self._waits:
            fallen = _Path(self._until, self._model, step, rates, below).first(falling=True)
            if fallen is None:
                return None
            begin = fallen
        path = _Path(self._until, self._model, step, rates, rounding)
        part = path.first(begin)
        if part is None:
            return None
        guard = UntilGuard(self, path.rate(part), self._over)
        return Crossing(step.t + part * step.h, guard)

    def at_end(self, step: Step) -> tuple[float, float]:
        """Value at the end of a step, and the rounding in it."""
        return self._value(*_alone(self._model.evaluate(step.end, step.finish.q, step.finish.v)))

    def keep(self, time: float) -> None:
        """Record the present state, at this time (s)."""
        self._recorder.keep(self._model.evaluate(time, *self._model.coordinates.independent()))

    # --- values -------------------------------------------------------------------------------

    def _value(self, evaluation: Evaluation, free: FloatArray) -> tuple[float, float]:
        """Value at one instant (1,), and the rounding in it; `free` are accelerations."""
        time, sensed = evaluation.kept.t, self._sensed(evaluation, free)
        self._size = max(self._size, self._until.size(time, sensed))
        return float(self._until.value.values(time, sensed)[0]), LITTLE * self._size

    def _sensed(self, evaluation: Evaluation, free: FloatArray) -> list[FloatArray]:
        """Values (n,) of all senses at instants; `free` (n, independent) are accelerations."""
        state = evaluation.kept.state
        now = self._model.loads.now(evaluation.kept.t, state.x, state.v)
        forces = self._forces(evaluation, free) if self._until.by_forces else None
        sensed = []
        for sensor in self._sensors:
            if not isinstance(sensor, Held):
                sensed.append(sensor.value(now))
            elif forces is not None:
                sensed.append(forces.sensed(sensor))
        return sensed

    def _forces(self, evaluation: Evaluation, free: FloatArray) -> _Forces:
        kept = self._recorder.known(evaluation, free)
        return _Forces(self._model, self._recorder.contacts, kept)

    def _rates(self, step: Step) -> FloatArray:
        """Time derivatives (orders, senses) of all senses at the begin of a step."""
        powers = np.zeros((DEGREE + 1, len(self._sensors)))
        now = along_step(self._model, step)
        for k, sensor in enumerate(self._sensors):
            if not isinstance(sensor, Held):
                powers[:, k] = TO_POWERS @ sensor.value(now)
        if self._until.by_forces:
            begin = step.begin.pick(None)
            nodes = joined([begin, step.stages])
            free = np.concatenate([begin.accelerations, step.accelerations])
            sensed = self._sensed(nodes, free)
            for k in np.flatnonzero(~np.array(self._in_motion)).tolist():
                at_nodes = step.method.powers @ sensed[k]
                powers[: len(at_nodes), k] = at_nodes
        return np.asarray((FACTORIALS / step.h**TAYLOR_POWERS)[:, None] * powers)


def _alone(evaluation: Evaluation) -> tuple[Evaluation, FloatArray]:
    """An evaluation at a single instant, in the form of several, and its accelerations."""
    return evaluation.pick(None), evaluation.accelerations[None]


class _Forces(JointForces):
    """Forces and torques in joints by name, at instants (n,)."""

    def sensed(self, sense: Held) -> FloatArray:
        """Magnitude of a force (n,), N, or a torque, N m."""
        if sense.is_torque:
            return self.torque(sense)
        return np.asarray(np.linalg.norm(self.force(sense.joint), axis=1))

    def force(self, joint: str) -> FloatArray:
        """Force (n, 2) of a joint, N; of a joint with clearance the force of its walls."""
        mechanism, poses, rates = self.mechanism, self.moved.poses, self.moved.rates
        numbers = {
            bearing.name: range(k, k + 1)
            for k, bearing in enumerate(mechanism.bearings, len(mechanism.contacts))
        }
        for first, groove in zip(mechanism.first_walls, mechanism.grooves, strict=True):
            numbers[groove.name] = range(first, first + len(groove.contacts))
        force = np.zeros((len(self.time), 2))
        for k in numbers.get(joint, ()):
            force += push_of(mechanism.touching[k], poses, rates, self.kept.press[:, k])
        if joint in numbers:
            return force
        of_slot = self.reactions.forces.get(joint)
        return self.in_joints([joint])[joint] if of_slot is None else of_slot

    def torque(self, sense: Held) -> FloatArray:
        """Torque (n,) of drives and of friction on a joint's second part, N m."""
        by_drives, friction = self.torques(), self.kept.of_engine.friction
        torques = [by_drives[name] for name in sense.drives]
        for k, joint in enumerate(self.mechanism.frictions):
            if joint.name == sense.joint:
                torques.append(friction[:, k])
        return np.asarray(np.sum(torques, axis=0))


class _Path:
    """The formula along a step, by time derivatives `rates` (powers, senses) of its senses."""

    def __init__(
        self, until: Until, model: MinimalModel, step: Step, rates: FloatArray, rounding: float
    ) -> None:
        formula = until.value
        self._formula, self._step, self._rounding = formula, step, rounding
        self._inside = model.window.all_inside
        self._rates = rates
        self._bounds = AlongStep(formula.clock + step.t, rates).bounds
        self._whole = formula.expression.whole

    def first(self, after: float = 0.0, *, falling: bool = False) -> float | None:
        """Part of the step, after `after`, at which the formula first rises through zero, or None.

        With `falling` it is the part at which the formula first falls through zero.
        """
        side = -1.0 if falling else 1.0

        def passed(part: float) -> float:
            return side * self._risen(part)

        begins, ends = np.maximum(FIRST_PARTS[:-1], after), FIRST_PARTS[1:]
        near = (ends > begins) & self._near(np.minimum(begins, ends), ends, falling)
        left: list[tuple[float, float]] = [
            (float(begins[k]), float(ends[k])) for k in np.flatnonzero(near)[::-1].tolist()
        ]
        while left:
            begin, end = left.pop()
            if not self._near(np.array([begin]), np.array([end]), falling)[0]:
                continue
            if end - begin > FINEST:
                middle = (begin + end) / 2
                left += [(middle, end), (begin, middle)]
            elif passed(begin) >= 0:
                return begin + FINEST * falling
            elif passed(end) >= 0:
                return float(zero(passed, begin, end)) + FINEST * falling
        return None

    def rate(self, part: float) -> float:
        """Rate (1/s) of the formula about a part of the step."""
        begin, end = max(0.0, part - ASIDE), min(1.0, part + ASIDE)
        return (self._risen(end) - self._risen(begin)) / ((end - begin) * self._step.h)

    def _near(self, begin: FloatArray, end: FloatArray, falling: bool) -> BoolArray:
        """Tell in which parts (n,) of the step the formula may be zero, or may have no value."""
        clock, t, h = self._formula.clock, self._step.t, self._step.h
        within = Bounds(*(clock + self._inside(t + h * part) for part in (begin, end)))
        bounds = self._whole.ranges(within, self._bounds(within))
        possible = bounds.low <= -self._rounding if falling else bounds.high >= -self._rounding
        return np.broadcast_to(possible, begin.shape)

    def _risen(self, part: float) -> float:
        """Value after a part of the step, plus its rounding."""
        time = self._inside(np.array([self._step.t + part * self._step.h]))
        ahead = part * self._step.h
        sensed: Sequence[FloatArray] = (ahead**TAYLOR_POWERS / FACTORIALS @ self._rates)[:, None]
        return float(self._formula.values(time, list(sensed))[0]) + self._rounding
