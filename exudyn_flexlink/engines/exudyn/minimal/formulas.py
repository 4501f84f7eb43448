"""Torques and forces by formulas within a step: their kinks, and pulses between its stages.

Torques and forces by formulas of the state bend where max, min and abs compare equal. Within a step
a formula is held on one side of each kink, and goes on smoothly beyond it: the step's error is that
of smooth equations. The difference of the compared values is an event function. The step is made
again to end at its zero, and from there the formula is held on the other side.

A step evaluates such formulas only at its stages, and the estimate of its error uses these alone: a
pulse between two of them is in neither. So each term of a formula that senses the state is looked
at over the whole step, by bounds: see `expressions.resolved`. Of a formula of one place, such as
those of springs, bounds are known by place, and are kept. Kinks and pulses of time alone are found
before the run: see `mechanism.pulses`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from math import ceil, factorial, floor, log2
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.minimal.coordinates import TreeState
from exudyn_flexlink.engines.exudyn.minimal.loads import LoadSize, Now
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.expressions import RATES, SHORTER, Bounds, Expression, remainders, resolved
from exudyn_flexlink.integrate.events import (
    EVENT_TIME,
    Crossing,
    Guard,
    StepPolynomial,
    chebyshev_sum,
    first_fall,
)
from exudyn_flexlink.integrate.problem import instant
from exudyn_flexlink.integrate.radau import Step
from exudyn_flexlink.rounding import NEGLIGIBLE, PLACE_ROUNDING

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
