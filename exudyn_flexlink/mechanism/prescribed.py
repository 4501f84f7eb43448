"""Values of drives by time and state, with the same interface for numbers, formulas and tables.

The force of a spring by its length, or the torque by its angle, is a table or a formula, and has an
energy. A formula may also depend on the rate of the length or angle.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.polynomial import Chebyshev, chebyshev

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.expressions import RATE, Expression, NoValueError, resolved
from exudyn_flexlink.rounding import NO_ENERGY, ROUNDING, UNIT_ROUNDING

DEGREE = 16  # of the polynomials of an integral
NODES = chebyshev.chebpts1(DEGREE + 1)
# Interpolation by numpy leaves more rounding than `UNIT_ROUNDING` in the last coefficients.
FROM_VALUES = np.linalg.inv(chebyshev.chebvander(NODES, DEGREE))
TAIL = 3  # coefficients that must be rounding
FIRST = 1.0  # s: first trial length of a piece
SHORTEST = 1e-6  # of the time, or of the first piece: shorter pieces are not halved


class Applied(Protocol):
    """A torque or force (N m or N) as a function of time and of sensed values."""

    def at(self, time: float, sensed: Sequence[float] = ()) -> float:
        """Value at a time (s) and sensed values; ArithmeticError if it has none."""
        return float(self.values(np.array([time]), [np.array([number]) for number in sensed])[0])

    def values(self, time: FloatArray, sensed: Sequence[FloatArray] = ()) -> FloatArray:
        """As `at`, for instants (n,) and sensed values (n,) each."""
        raise NotImplementedError

    def knots(self, end: float) -> list[float]:
        """Instants before `end` (s) at which the value, or a derivative of it, jumps; in order."""
        raise NotImplementedError


class Prescribed(Applied, Protocol):
    """A function of time alone, such as a speed (rad/s or m/s)."""

    def of_order(self, time: FloatArray, order: int) -> FloatArray:
        """Time derivatives (n,) of this order at instants (n,) s; -1: the integrals from 0 on."""
        raise NotImplementedError

    def values(self, time: FloatArray, sensed: Sequence[FloatArray] = ()) -> FloatArray:  # noqa: ARG002
        """Values (n,) at instants (n,) s."""
        return self.of_order(time, 0)

    def rates(self, time: FloatArray) -> FloatArray:
        """Time derivatives (n,) of the value at instants (n,) s."""
        return self.of_order(time, 1)

    def integrals(self, time: FloatArray) -> FloatArray:
        """Integrals (n,) of the value from 0 to instants (n,) s."""
        return self.of_order(time, -1)

    def integral(self, time: float) -> float:
        """As `integrals`, for one instant."""
        return float(self.integrals(np.array([time]))[0])


@dataclass(frozen=True)
class Ramp(Prescribed):
    """A value (rad/s or N m) reached after `duration` (s) along the quintic smooth step.

    The first and second derivatives of ``s(x) = 10 x^3 - 15 x^4 + 6 x^5`` are zero at both ends. So
    a speed that rises along it has no jump of acceleration or jerk.
    """

    value: float
    duration: float = 0.0

    def of_order(self, time: FloatArray, order: int) -> FloatArray:
        """Derivatives up to order 1."""
        if self.duration == 0:  # orders 0, 1, -1
            return (np.full(len(time), self.value), np.zeros(len(time)), self.value * time)[order]
        x = np.clip(time / self.duration, 0.0, 1.0)
        if order == 1:
            return self.value * 30 * x * x * (1 - x) ** 2 / self.duration
        if order == 0:
            return self.value * x**3 * (10 - 15 * x + 6 * x * x)
        rising = self.duration * x**4 * (2.5 - 3 * x + x * x)
        return np.asarray(self.value * (rising + np.maximum(time - self.duration, 0.0)))

    def knots(self, end: float) -> list[float]:
        """Instants before `end` (s) at which derivatives jump: the end of the ramp."""
        return [self.duration] if 0 < self.duration < end else []

    def time_of(self, integral: float) -> float:
        """Time (s) at which the integral reaches a value; it has the sign of the ramp."""
        time = integral / self.value + self.duration / 2
        if time >= self.duration:
            return time
        low, high = 0.0, self.duration
        while low < (middle := (low + high) / 2) < high:
            low, high = (middle, high) if self.integral(middle) / integral < 1 else (low, middle)
        return high


class SpeedOf(Prescribed):
    """The speed of a prescribed motion; its integral is the motion itself."""

    def __init__(self, motion: Formula | Tabled) -> None:
        self.motion, self._start = motion, motion.at(0.0)

    def of_order(self, time: FloatArray, order: int) -> FloatArray:
        """Derivatives of the speed: those of the motion, of one order more."""
        value = self.motion.of_order(time, order + 1)
        return value - self._start if order < 0 else value

    def knots(self, end: float) -> list[float]:
        """The knots of the motion."""
        return self.motion.knots(end)


class Formula(Prescribed):
    """An `expression` of the scene; its t is `clock` (s) at the begin of the run.

    Its integral is the sum over parts that end at `edges`, values of t (s).
    """

    def __init__(
        self, expression: Expression, clock: float = 0.0, edges: Sequence[float] = ()
    ) -> None:
        self.expression, self.clock, self._edges = expression, clock, edges

    def values(self, time: FloatArray, sensed: Sequence[FloatArray] = ()) -> FloatArray:
        """Values (n,) at instants (n,), s, and sensed values."""
        return self.expression.values(time + self.clock, sensed)

    def of_order(self, time: FloatArray, order: int) -> FloatArray:
        """Derivatives up to order 2 of a formula without senses."""
        if order < 0:
            return self._integral(time + self.clock) - self._before
        return self.expression.derivatives(time + self.clock, order)

    @cached_property
    def _integral(self) -> Antiderivative:
        knots = {*self.expression.linear_bends, *self._edges}
        return Antiderivative(lambda time: self.expression.values(time, ()), knots)

    @cached_property
    def _before(self) -> float:
        return float(self._integral(np.array([self.clock]))[0])

    def knots(self, end: float) -> list[float]:
        """Instants before `end` (s) at which the value, or a derivative, jumps."""
        instants = self.expression.bends(self.clock, self.clock + end)
        return [time - self.clock for time in instants]


class Tabled(Prescribed):
    """Values by time, from a table of the scene: `rule` linear, cubic or step.

    The table's time is `clock` (s) at the begin of the run.
    """

    def __init__(self, rows: Sequence[tuple[float, float]], rule: str, clock: float = 0.0) -> None:
        times, values = np.array(rows, dtype=float).T
        times = times - clock
        self.times: list[float] = times.tolist()
        self._values = interpolant(times, values, rule)
        self._integrals = self._values.antiderivative()
        self._before = float(self._integrals(0.0))

    def of_order(self, time: FloatArray, order: int) -> FloatArray:
        """Derivatives of the polynomials between rows."""
        if order < 0:
            return np.asarray(self._integrals(time)) - self._before
        return np.asarray(self._values(time, order))

    def knots(self, end: float) -> list[float]:
        """Instants of rows before `end` (s): a derivative jumps at each."""
        return [time for time in self.times if 0 < time < end]


def interpolant(places: FloatArray, values: FloatArray, rule: str) -> Any:
    """Piecewise polynomials through the rows of a table: `rule` linear, cubic or step."""
    # Only scenes with a table wait for the import of SciPy.
    from scipy.interpolate import CubicSpline, PPoly  # noqa: PLC0415

    if rule == "cubic":
        return CubicSpline(places, values)
    if rule == "linear":
        slopes = np.diff(values) / np.diff(places)
        return PPoly(np.array([slopes, values[:-1]]), places)
    return PPoly(values[None, :-1], places)


class Antiderivative:
    """Integral of `function` from 0 on; pieces end at `knots` (s), where it may have kinks.

    It is exact to rounding. On each piece the function is a Chebyshev polynomial; pieces are halved
    until the last coefficients are rounding, as in Chebfun (Z. Battles and L. N. Trefethen, SIAM J.
    Sci. Comput. 25 (2004) 1743). Pieces are made on demand and kept. A pulse between the values of
    a piece would be overlooked, so pulses need knots.
    """

    def __init__(
        self, function: Callable[[FloatArray], FloatArray], knots: Iterable[float] = ()
    ) -> None:
        self._function = function
        self._knots = sorted(time for time in knots if time > 0)
        self._ends = [0.0]
        self._pieces: list[Chebyshev] = []
        self._length = FIRST
        self._largest = 0.0

    def __call__(self, time: FloatArray) -> FloatArray:
        """Integrals (n,) from 0 to instants (n,) s; before 0 the function counts as constant."""
        while self._ends[-1] < time.max(initial=0.0):
            self._add_piece()
        which = np.array([bisect_left(self._ends, t) - 1 for t in time.tolist()])
        values = np.empty(len(time))
        for k in set(which.tolist()):
            inside = time[which == k]
            values[which == k] = (
                self._pieces[k](inside) if k >= 0 else inside * self._function(0 * inside)
            )
        return values

    def _add_piece(self) -> None:
        begin = self._ends[-1]
        k = bisect_right(self._knots, begin * (1 + 1e-15))
        next_knot = self._knots[k] if k < len(self._knots) else np.inf
        end = begin + self._length
        while True:
            end = min(end, next_knot)
            places = (begin + end) / 2 + (end - begin) / 2 * NODES
            piece = Chebyshev(FROM_VALUES @ self._function(places), [begin, end])
            self._largest = max(self._largest, float(np.abs(piece.coef).max()))
            tail = float(np.abs(piece.coef[-TAIL:]).max())
            short = end - begin <= SHORTEST * max(begin, FIRST)
            # The rounding of time changes the function, too.
            blur = float(np.abs(piece.deriv().coef).sum()) * end
            if short or tail <= UNIT_ROUNDING * (self._largest + blur):
                break
            end = begin + (end - begin) / 2
        self._length = 2 * (end - begin)
        before = float(self._pieces[-1](begin)) if self._pieces else 0.0
        self._pieces.append(piece.integ(k=before, lbnd=begin))
        self._ends.append(end)


class TableEndError(NoValueError):
    """A spring, `text`, has left its table at a time (s), for a place (m or rad) beyond it."""

    advice = "give the table more rows: no force is made up beyond them"

    def __init__(self, name: str, place: float, time: float) -> None:
        ArithmeticError.__init__(
            self, f"the table of '{name}' ends before {place:.6g}, where it is at t = {time:.6g} s"
        )
        self.text, self.time = name, time


class PlaceTable(Applied):
    """Values between rows, by a sensed length or angle: `rule` linear or cubic.

    Sides of the inner rows may follow the sensed value: 1 if the value is below the row. Then the
    table stays on the piece between its sides, also beyond a row, as formulas do beyond a kink.
    """

    def __init__(self, name: str, rows: Sequence[tuple[float, float]], rule: str) -> None:
        self._name, (places, values) = name, np.array(rows, dtype=float).T
        self._values = interpolant(places, values, rule)
        self.ends = float(places[0]), float(places[-1])
        self._rows = places[1:-1]
        self.kinks = len(self._rows)
        self.antiderivative = self._values.antiderivative()

    def values(self, time: FloatArray, sensed: Sequence[FloatArray] = ()) -> FloatArray:
        """Values (n,) for sensed places (n,); TableEndError beyond the rows."""
        place, *sides = sensed
        low, high = self.ends
        beyond = np.maximum(low - place, place - high) > ROUNDING * (high - low)
        if beyond.any():
            k = int(np.argmax(beyond))
            raise TableEndError(self._name, float(place[k]), float(np.ravel(time)[k]))
        if not sides:
            return np.asarray(self._values(place))
        piece = (1 - np.array(sides)).sum(axis=0).astype(int)
        coefficients, begin = self._values.c[:, piece], self._values.x[piece]
        return np.asarray(sum(c * (place - begin) ** k for k, c in enumerate(coefficients[::-1])))

    def switches(self, _: FloatArray, sensed: Sequence[FloatArray]) -> FloatArray:
        """Values (kinks, n) that are zero at inner rows."""
        return np.asarray(sensed[0] - self._rows[:, None])

    def knots(self, end: float) -> list[float]:  # noqa: ARG002
        """Return no instants: they are not known before the run."""
        return []


@dataclass(frozen=True)
class SpringLaw:
    """A spring's force (N) by its length (m), or its torque (N m) by its angle (rad).

    A positive force draws both ends together; a positive torque turns the second part back. If a
    formula also depends on the `rate` (m/s or rad/s), no energy is stored. Otherwise the energy is
    0 at `start`.
    """

    applied: PlaceTable | Formula
    start: float = 0.0

    def at(self, place: FloatArray, rate: FloatArray) -> FloatArray:
        """Forces at lengths, or torques at angles, and their rates, all of one shape."""
        both = [np.ravel(np.asarray(x, dtype=float)) for x in (place, rate)]
        sensed = [both[by_rate] for by_rate in self.by_rate]
        return self.applied.values(np.zeros(len(both[0])), sensed).reshape(np.shape(place))

    @property
    def by_rate(self) -> tuple[bool, ...]:
        """For each sense, in order: whether it is the rate, not the length or angle."""
        if isinstance(self.applied, PlaceTable):
            return (False,)
        return tuple(sensed.kind == RATE for sensed in self.applied.expression.sensed)

    @property
    def stores(self) -> bool:
        """Whether the force depends on length or angle only, so that its work is stored."""
        return not any(self.by_rate)

    def energy(self, place: FloatArray) -> FloatArray:
        """Stored energy (J) at lengths or angles: the integral of the force; same shape."""
        flat = np.ravel(np.asarray(place, dtype=float))
        if isinstance(self.applied, PlaceTable):
            inside = np.clip([*flat, self.start], *self.applied.ends)
            work = self.applied.antiderivative(inside)
            return np.asarray(work[:-1] - work[-1]).reshape(np.shape(place))
        ahead, back = self._integrals
        off = flat - self.start
        work = ahead(np.maximum(off, 0.0)) - back(np.maximum(-off, 0.0))
        return np.asarray(work).reshape(np.shape(place))

    @cached_property
    def _integrals(self) -> tuple[_Work, _Work]:
        """Integrals from the start on, and from there back."""
        assert isinstance(self.applied, Formula)
        expression = self.applied.expression
        return _Work(expression.along(self.start, 1.0)), _Work(expression.along(self.start, -1.0))


class _Work(Antiderivative):
    """Integral (J) of a `formula` of t, which is a way (m or rad), just as far as it is asked for.

    Bounds show all of it but `NO_ENERGY`. Beyond, the formula may have no value.
    """

    def __init__(self, formula: Expression) -> None:
        super().__init__(self._force)
        self._formula = formula

    def _force(self, way: FloatArray) -> FloatArray:
        """Force (n,) on ways (n,); none where it has no value, over which a long step went."""
        try:
            return self._formula.values(way, ())
        except NoValueError:
            return np.zeros(way.shape)

    def __call__(self, time: FloatArray) -> FloatArray:
        """Integrals (n,) from 0 to ways (n,), none of them negative."""
        begin, end = self._ends[-1], float(time.max(initial=0.0))
        if end <= begin * (1 + ROUNDING):
            return super().__call__(np.minimum(time, begin))
        edges = np.array([begin, *self._formula.bends(begin, end), end])
        terms = self._formula.addends
        parts = [resolved(term, edges, lambda _: 1.0, NO_ENERGY)[0] for term in terms]
        inner = np.unique(np.concatenate([edges, *parts]))
        self._knots = [*inner[inner < end * (1 - ROUNDING)].tolist(), end]
        return super().__call__(time)
