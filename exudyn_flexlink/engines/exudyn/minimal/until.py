"""The formula that ends a run, of time, state and forces in joints, as it rises through zero.

Within a step what it senses are polynomials: through looks at the step's own motion, and through
forces at its nodes. Of parts of the step bounds of the formula are known then. A part in which it
may come to zero is halved, its first half first, so that of two crossings in one step the first is
found. The step is made again to end there, and moved to where the formula is zero at its end.

Where the formula is no longer below zero as a step begins, it has jumped: by an impact, as friction
changes sign, or at a knot of a force or of the formula. A run that goes on from another one, as in
a stage, may begin with a formula that is not below zero: it counts once it has been.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from exudyn_flexlink.arrays import BoolArray, FloatArray
from exudyn_flexlink.engines.exudyn.minimal.formulas import (
    COEFFICIENTS,
    DEGREE,
    FACTORIALS,
    TAYLOR_POWERS,
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

FIRST_PARTS = np.linspace(0.0, 1.0, 9)  # of a step: ends of those that are looked at together
LITTLE = 1e-13  # of its terms: nearer below zero the formula is zero
FINEST = 2.0**-16  # of a step: crossings nearer to each other are none, or one
ASIDE = 1e-4  # of a step, to either side of a crossing: there its rate is taken


@dataclass(frozen=True)
class UntilGuard(Guard):
    """The formula comes to zero with this rate (1/s); None: it has jumped past it."""

    watch: UntilWatch
    rate: float | None
    over: Callable[[], None]

    def late(self, step: Step) -> float:
        """How long (s) before a step's end the formula was zero; negative: after."""
        value, little = self.watch.at_end(step)
        rate = self.rate or 0.0
        near = abs(value) <= max(little, abs(rate) * instant(step.end, EVENT_TIME))
        return 0.0 if near or rate == 0 else value / rate

    def cross(self, time: float) -> None:
        """End the run; what has jumped is seen as it is then."""
        if self.rate is None:
            self.watch.keep(time)
        self.over()


class UntilWatch:
    """Looks at the steps of a model; `over` is called as the formula comes to zero."""

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
        self._waits = goes_on  # for the formula to be below zero
        self.waited = False  # as the run began
        self._sensors: list[Sensor | Held] = [
            sense if isinstance(sense, Held) else sensor_of(model.layout, model.kinematics, sense)
            for sense in until.senses
        ]
        self._in_motion = [not isinstance(sensor, Held) for sensor in self._sensors]
        self._size = 0.0  # of its terms so far

    def mistakes(self, path: KeyPath) -> list[Mistake]:
        """Refuse a run that is over as it begins, by its formula at this path of the scene.

        Raises:
            NoValueError: the formula has no value then.

        """
        at = self._model.evaluate(0.0, *self._model.coordinates.independent())
        return until_mistakes(self._until, self._sensed(*_alone(at)), path)

    def first(self, step: Step) -> Crossing | None:
        """When the formula comes to zero first within a step; at its start, if it has jumped."""
        value, little = self._value(*_alone(step.begin))
        below = NEGLIGIBLE * self._size  # so far it must have been
        self._waits = self._waits and value >= -below
        self.waited |= self._waits
        if value >= -little and not self._waits:
            return Crossing(step.t, UntilGuard(self, None, self._over))
        rates, begin = self._rates(step), 0.0
        if self._waits:
            fallen = _Path(self._until, self._model, step, rates, below).first(falling=True)
            if fallen is None:
                return None
            begin = fallen
        path = _Path(self._until, self._model, step, rates, little)
        part = path.first(begin)
        if part is None:
            return None
        guard = UntilGuard(self, path.rate(part), self._over)
        return Crossing(step.t + part * step.h, guard)

    def at_end(self, step: Step) -> tuple[float, float]:
        """Value at the end of a step, and what is rounding beside it."""
        at = self._model.evaluate(step.end, step.finish.q, step.finish.v)
        return self._value(*_alone(at))

    def keep(self, time: float) -> None:
        """Keep the present state, at this time (s)."""
        at = self._model.evaluate(time, *self._model.coordinates.independent())
        self._recorder.keep(at)

    # --- values -------------------------------------------------------------------------------

    def _value(self, at: Evaluation, free: FloatArray) -> tuple[float, float]:
        """Value at one instant (1,), and what is rounding beside it."""
        time, sensed = at.kept.t, self._sensed(at, free)
        self._size = max(self._size, self._until.size(time, sensed))
        return float(self._until.value.values(time, sensed)[0]), LITTLE * self._size

    def _sensed(self, at: Evaluation, free: FloatArray) -> list[FloatArray]:
        """What is sensed at instants (n,), by accelerations (n, independent)."""
        state = at.kept.state
        now = self._model.loads.now(at.kept.t, state.x, state.v)
        forces = self._forces(at, free) if self._until.by_forces else None
        sensed = []
        for sensor in self._sensors:
            if not isinstance(sensor, Held):
                sensed.append(sensor.value(now))
            elif forces is not None:
                sensed.append(forces.sensed(sensor))
        return sensed

    def _forces(self, at: Evaluation, free: FloatArray) -> _Forces:
        kept = self._recorder.known(at, free)
        return _Forces(self._model, self._recorder.contacts, kept)

    def _rates(self, step: Step) -> FloatArray:
        """Derivatives (powers, sensed) at a step's begin of what is sensed along it, by 1/s."""
        powers = np.zeros((DEGREE + 1, len(self._sensors)))
        now = along_step(self._model, step)
        for k, sensor in enumerate(self._sensors):
            if not isinstance(sensor, Held):
                powers[:, k] = COEFFICIENTS @ sensor.value(now)
        if self._until.by_forces:
            begin = step.begin.pick(None)
            nodes = joined([begin, step.stages])
            free = np.concatenate([begin.accelerations, step.accelerations])
            sensed = self._sensed(nodes, free)
            for k in np.flatnonzero(~np.array(self._in_motion)).tolist():
                at_nodes = step.method.powers @ sensed[k]
                powers[: len(at_nodes), k] = at_nodes
        return np.asarray((FACTORIALS / step.h**TAYLOR_POWERS)[:, None] * powers)


def _alone(at: Evaluation) -> tuple[Evaluation, FloatArray]:
    """An evaluation at one instant as that at several, and its accelerations."""
    return at.pick(None), at.accelerations[None]


class _Forces(JointForces):
    """Forces and torques in joints by name, at instants (n,)."""

    def sensed(self, sense: Held) -> FloatArray:
        """Magnitude of a force (n,), N, or a torque, N m."""
        if sense.is_torque:
            return self.torque(sense)
        return np.asarray(np.linalg.norm(self.force(sense.joint), axis=1))

    def force(self, joint: str) -> FloatArray:
        """Force (n, 2) of a joint, N; of one with clearance that of its walls on the other side."""
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
        slotted = self.reactions.forces.get(joint)
        return self.in_joints([joint])[joint] if slotted is None else slotted

    def torque(self, sense: Held) -> FloatArray:
        """Torque (n,) of drives and of friction on a joint's second part, N m."""
        of_drives, rubbed = self.torques(), self.kept.of_engine.friction
        torques = [of_drives[name] for name in sense.drives]
        for k, friction in enumerate(self.mechanism.frictions):
            if friction.name == sense.joint:
                torques.append(rubbed[:, k])
        return np.asarray(np.sum(torques, axis=0))


class _Path:
    """The formula along a step, by derivatives (powers, sensed) of what it senses."""

    def __init__(
        self, until: Until, model: MinimalModel, step: Step, rates: FloatArray, little: float
    ) -> None:
        formula = until.value
        self._formula, self._step, self._little = formula, step, little
        self._inside = model.window.all_inside
        self._rates = rates
        self._bounds = AlongStep(formula.clock + step.t, rates).bounds
        self._whole = formula.expression.whole

    def first(self, after: float = 0.0, *, falling: bool = False) -> float | None:
        """Part of the step, not before `after`, at which the formula is zero first.

        None if it stays below; if `falling`, above.
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
        """Parts (n,) of the step in which it may come to zero; also where it may have no value."""
        clock, t, h = self._formula.clock, self._step.t, self._step.h
        within = Bounds(*(clock + self._inside(t + h * part) for part in (begin, end)))
        bounds = self._whole.ranges(within, self._bounds(within))
        may = bounds.low <= -self._little if falling else bounds.high >= -self._little
        return np.broadcast_to(may, begin.shape)

    def _risen(self, part: float) -> float:
        """Value, above what is rounding."""
        time = self._inside(np.array([self._step.t + part * self._step.h]))
        ahead = part * self._step.h
        sensed: Sequence[FloatArray] = (ahead**TAYLOR_POWERS / FACTORIALS @ self._rates)[:, None]
        return float(self._formula.values(time, list(sensed))[0]) + self._little
