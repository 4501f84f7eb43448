"""Formulas within a step: kinks, pulses between its stages, and the zero that ends a run.

Torques and forces by formulas of the state bend where max, min and abs compare equal. Within a step
a formula is held on one side of each kink, and goes on smoothly beyond it: the step's error is that
of smooth equations. The difference of the compared values is an event function. The step is made
again to end at its zero, and from there the formula is held on the other side.

A step evaluates such formulas only at its stages, and the estimate of its error uses these alone: a
pulse between two of them is in neither. So each term of a formula that senses the state is looked
at over the whole step, by bounds: see `expressions.resolved`. Of a formula of one place, such as
those of springs, bounds are known by place, and are kept. Kinks and pulses of time alone are found
before the run: see `mechanism.pulses`.

A formula of time, state and forces in joints ends a run, or a stage, as it rises through zero. What
it senses is represented within a step by polynomials: through values of the motion at Chebyshev's
points, and through forces at the step's nodes. They give bounds of the formula in any part of the
step. A part in which it may come to zero is halved, the first half first, so that the first of
several crossings is located. The step is made again to end there.

If the formula is no longer below zero when a step begins, it has jumped: by an impact, as friction
changes sign, or at a knot of a force or of the formula. A run that goes on from another one, as a
stage does, may begin with a formula that is not below zero. There it has to fall below zero first.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from math import ceil, factorial, floor, log2
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from exudyn_flexlink.arrays import BoolArray, FloatArray
from exudyn_flexlink.engines.exudyn.minimal.coordinates import TreeState
from exudyn_flexlink.engines.exudyn.minimal.kinematics import joined
from exudyn_flexlink.engines.exudyn.minimal.loads import LoadSize, Now, Sensor, sensor_of
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.engines.exudyn.minimal.reactions import JointForces
from exudyn_flexlink.engines.exudyn.minimal.recording import TreeRecorder
from exudyn_flexlink.engines.recording import push_of
from exudyn_flexlink.expressions import RATES, SHORTER, Bounds, Expression, remainders, resolved
from exudyn_flexlink.integrate.events import (
    EVENT_TIME,
    Crossing,
    Guard,
    StepPolynomial,
    chebyshev_sum,
    first_fall,
    zero,
)
from exudyn_flexlink.integrate.problem import Evaluation, instant
from exudyn_flexlink.integrate.radau import Step
from exudyn_flexlink.mechanism import Held, Until, until_mistakes
from exudyn_flexlink.rounding import NEGLIGIBLE, PLACE_ROUNDING
from exudyn_flexlink.source import KeyPath, Mistake

# What formulas sense, and their switches, are followed within a step by polynomials through their
# values at Chebyshev's points.
DEGREE = 8  # of these polynomials
PARTS = (1 - np.cos(np.linspace(0.0, np.pi, DEGREE + 1))) / 2  # of a step: the points
TO_CHEBYSHEV = np.linalg.inv(chebyshev.chebvander(2 * PARTS - 1, DEGREE)).T  # from values there
TAYLOR_POWERS = np.arange(DEGREE + 1)
POWER_DIFFERENCES = np.maximum(TAYLOR_POWERS - TAYLOR_POWERS[:, None], 0)
FACTORIALS = np.array([float(factorial(power)) for power in TAYLOR_POWERS])
TO_POWERS = np.linalg.inv(PARTS[:, None] ** TAYLOR_POWERS)  # from values there to coefficients


def along_step(model: MinimalModel, step: Step) -> Now:
    """What loads sense at Chebyshev's points of a step, on the step's polynomial."""
    t = step.t + step.h * PARTS
    state = model.states(t, *step.at(t))
    return model.loads.now(model.window.all_inside(t), state.x, state.v)


@dataclass(frozen=True)
class KinkGuard(Guard):
    """A torque or force passes its kink number `kink`; the kink's switch has the `rate` (1/s)."""

    watch: KinkWatch
    load: LoadSize
    kink: int
    rate: float
    bends = True

    def late(self, step: Step) -> float:
        """How long (s) before a step's end the kink was; negative: after; 0: at the end."""
        value = float(self.watch.at_end(self.load, step)[self.kink])
        near = abs(value) <= abs(self.rate) * instant(step.end, EVENT_TIME)
        return 0.0 if near or self.rate == 0 else value / self.rate

    def cross(self, time: float) -> None:  # noqa: ARG002
        """Hold the formula on the other side of the kink."""
        self.load.sides[self.kink] = 1.0 - self.load.sides[self.kink]


class KinkWatch:
    """Finds kinks in steps; keeps the largest value of each switch, by which rounding is told."""

    def __init__(self, model: MinimalModel, end_of: Callable[[Step], TreeState]) -> None:
        """`end_of` tells all coordinates at the end of a step."""
        self._model, self._end_of = model, end_of
        self._largest: dict[LoadSize, FloatArray] = {}

    def take_sides(self, time: float, q: FloatArray, v: FloatArray) -> None:
        """Hold formulas on the sides that the present state tells: times or speeds may jump."""
        for load in self._model.loads.bent:
            load.sides = []
            switches = load.switches(self._now(time, self._model.state(time, q, v)))
            load.sides = (switches[:, 0] < 0).astype(float).tolist()

    def first(self, step: Step) -> Crossing | None:
        """First passage of a kink within a step; None if there is none."""
        if not self._model.loads.bent:
            return None
        now, passages = along_step(self._model, step), []
        for load in self._model.loads.bent:
            values = load.switches(now)
            largest = np.maximum(self._largest.get(load, 0.0), np.abs(values).max(axis=1))
            self._largest[load] = largest
            ways = np.where(load.sides, -1.0, 1.0) / np.maximum(largest, np.finfo(float).tiny)
            for k, falling in enumerate(ways[:, None] * values @ TO_CHEBYSHEV):
                if falling[0] > np.abs(falling[1:]).sum():  # it surely stays above zero
                    continue
                slopes = StepPolynomial.derivative(falling[None])[0].tolist()
                value = partial(chebyshev_sum, falling.tolist())
                part = first_fall(value, partial(chebyshev_sum, slopes), (0.0, 1.0))
                if part is not None:
                    rate = chebyshev_sum(slopes, part) / (ways[k] * step.h)
                    passages.append(
                        Crossing(step.t + part * step.h, KinkGuard(self, load, k, rate))
                    )
        return min(passages, key=lambda crossing: crossing.time, default=None)

    def at_end(self, load: LoadSize, step: Step) -> FloatArray:
        """Switches (kinks,) of a load at the end of a step."""
        return load.switches(self._now(step.end, self._end_of(step)))[:, 0]

    def _now(self, time: float, state: TreeState) -> Now:
        inside = self._model.window.inside(time)
        return self._model.loads.now(np.array([inside]), state.x[None], state.v[None])


class AlongStep(NamedTuple):
    """What formulas sense along a step: derivatives (powers, sensed) at its begin `t` (s)."""

    t: float
    rates: FloatArray

    def bounds(self, within: Bounds) -> dict[int, Bounds]:
        """Bounds of what is sensed, and of its time derivatives, over parts of the step."""
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
    return np.triu(ahead[:, None, None] ** POWER_DIFFERENCES / FACTORIALS[POWER_DIFFERENCES])


CELLS = 64  # half the number of cells whose bounds are computed together, as fast as those of one


class _Cells:
    """Cells (m or rad) that divide the place on which a formula depends.

    They tell how much of the formula may be hidden between the stages of a step, if the step stays
    within a cell. Cells of a size begin at its multiples. Bounds of a cell cost more time than a
    step, so they are kept; the largest cells that will do are taken, since these are few.
    """

    def __init__(self, formula: Expression) -> None:
        self._terms = formula.along(0.0, 1.0).addends
        self._size = 1.0  # m or rad, of the cells that are tried first
        self._hidden = lru_cache(self._hidden_in)

    def show(self, places: FloatArray, little: float) -> bool:
        """Tell whether a step with these places at its stages hides at most `little` (N or N m)."""
        low, high = min(places), max(places)
        # A step is cut at parts that are SHORTER than it; it is up to twice as fast as its mean.
        least = 2 * max(high - low, PLACE_ROUNDING) / SHORTER
        self._size = max(self._size, 2.0 ** ceil(log2(least)))
        while self._size >= least:
            begin = CELLS * (round(low / (CELLS * self._size)) - 1)
            first, last = (floor(place / self._size) - begin for place in (low, high))
            # The step turns between stages, too: by less than a cell beyond them.
            if self._hidden(self._size, begin)[first - 1 : last + 2].max() <= little:
                return True
            self._size /= 2
        return False

    def _hidden_in(self, size: float, begin: int) -> FloatArray:
        """How much (N or N m) cells (2 CELLS,) of a size hide; the first has the number `begin`."""
        low = size * np.arange(begin, begin + 2 * CELLS, dtype=float)
        cells = Bounds(low, low + size)
        rests = [[*remainders(term, cells)][-1][0] for term in self._terms]
        return np.asarray(np.sum(rests, axis=0))


class PulseWatch:
    """Finds pulses of formulas that lie between the stages of a step."""

    def __init__(self, model: MinimalModel, end: float) -> None:
        """`end` (s) is the end of the run."""
        self._model, self._end = model, end
        self._cells = {
            size: _Cells(size.expression) if size.expression.of_a_place else None
            for size in model.loads.of_state
        }

    def part(self, step: Step, allowed: float) -> float:
        """Part of a step up to which its stages tell every formula; 1 if they do all along it.

        `allowed` (m) is how far a hidden pulse may move anything by the end of the run.
        """
        earliest = 1.0
        if not self._cells or not len(step.start.q):
            return earliest
        loads, stages, along = self._model.loads, step.stages.kept, None
        now = loads.now(stages.t, stages.state.x, stages.state.v)
        for number, given in enumerate(loads.formulas(now)):
            # How much (m/s^2) anything accelerates by a unit of the torque or force.
            push = step.begin.kept.state.transform.reduced_rows(given.unit[0])
            moved = self._model.size(np.linalg.solve(step.begin.mass, push))
            if moved == 0 or not given.sensed:
                continue
            by_area = allowed / (moved * (self._end - step.t))
            cells = self._cells.get(given.formula)
            if cells and cells.show(given.sensed[0], by_area / 2 / step.h):
                continue
            try:
                along = along or loads.formulas(along_step(self._model, step))
            except (ValueError, ArithmeticError):  # a formula has no value between good stages
                return earliest
            clock = given.formula.clock
            scale = FACTORIALS / step.h**TAYLOR_POWERS
            rates = scale[:, None] * (TO_POWERS @ np.array(along[number].sensed).T)
            ends = clock + self._model.window.all_inside(step.t + step.h * PARTS[[0, -1]])
            bounds = AlongStep(clock + step.t, rates).bounds
            for addend in given.formula.expression.addends:
                if addend.of_time:
                    continue
                edges, _ = resolved(addend, ends, lambda _: 1.0, by_area, bounds)
                short = np.flatnonzero(np.diff(edges) < step.h / SHORTER)
                inner = np.union1d(edges[short], edges[short + 1]) - ends[0]
                # No step is short enough for a value that a formula has at a single instant.
                inner = inner[(inner > NEGLIGIBLE * self._end) & (inner < step.h)]
                earliest = min(earliest, *(inner[:1] / step.h), 1.0)
        return earliest


# Of a formula that ends a run:
FIRST_PARTS = np.linspace(0.0, 1.0, 9)  # of a step: ends of the parts that are bounded first
LITTLE = 1e-13  # of its terms: a value above minus this counts as zero
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
