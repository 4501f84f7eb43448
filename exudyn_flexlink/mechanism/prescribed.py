"""What a drive prescribes or applies, by time and state: one form for numbers, formulas, tables."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.polynomial import chebyshev

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.expressions import Expression

DEGREE = 16
NODES = chebyshev.chebpts1(DEGREE + 1)
FROM_VALUES = np.linalg.inv(chebyshev.chebvander(NODES, DEGREE))
TAIL = 3  # coefficients that must be rounding
RESOLVED = 1e-15  # of the largest coefficient so far
FIRST = 1.0  # s, length of the first piece tried
SHORTEST = 1e-6  # of the time, or of the first piece: what bends there adds no error worth a word
Part = TypeVar("Part", float, FloatArray)


class Applied(Protocol):
    """A torque or force (N m or N) of time and of values that are sensed."""

    def at(self, time: float, sensed: Sequence[float] = ()) -> float:
        """Value at a time (s) and values sensed; ArithmeticError where there is none."""

    def values(self, time: FloatArray, sensed: Sequence[FloatArray] = ()) -> FloatArray:
        """As `at`, at instants (n,) and with values (n,) of each of what is sensed."""

    def slopes(self, time: float, sensed: Sequence[float]) -> list[float]:
        """Derivatives by the values sensed."""

    def knots(self, end: float) -> list[float]:
        """Instants before `end` (s) at which the value, or a derivative of it, jumps; in order."""


class Prescribed(Applied, Protocol):
    """A speed (rad/s or m/s) of time alone."""

    def integral(self, time: float) -> float:
        """Integral of the value from 0 to `time` (s)."""

    def rates(self, time: FloatArray) -> FloatArray:
        """Time derivatives (n,) of the value at instants (n,) s."""

    def integrals(self, time: FloatArray) -> FloatArray:
        """As `integral`, to instants (n,) s."""


class OfTime(Applied, Protocol):
    """What takes nothing of the state."""

    def slopes(self, time: float, sensed: Sequence[float]) -> list[float]:  # noqa: ARG002
        """Return nothing: there is nothing that it senses."""
        return []


class SpeedOf(OfTime):
    """The speed of a motion: its integral is known without integrating."""

    def __init__(self, motion: Formula | Tabled) -> None:
        self.motion = motion
        self._start = motion.at(0.0)

    def at(self, time: float, sensed: Sequence[float] = ()) -> float:  # noqa: ARG002
        """Value at a time (s)."""
        return self.motion.rate(time)

    def integral(self, time: float) -> float:
        """Integral of the value from 0 to `time` (s)."""
        return self.motion.at(time) - self._start

    def values(self, time: FloatArray, sensed: Sequence[FloatArray] = ()) -> FloatArray:  # noqa: ARG002
        """Values (n,) at instants (n,) s."""
        return self.motion.rates(time)

    def rates(self, time: FloatArray) -> FloatArray:
        """Time derivatives (n,) of the value."""
        return self.motion.second_rates(time)

    def integrals(self, time: FloatArray) -> FloatArray:
        """Integrals (n,) of the value from 0 to instants (n,) s."""
        return self.motion.values(time) - self._start

    def knots(self, end: float) -> list[float]:
        """Instants before `end` (s) at which a derivative jumps."""
        return self.motion.knots(end)


class Formula:
    """An `expression` of the scene, whose t is `clock` (s) as the run begins.

    Its integral is summed up over parts that end at `edges`, of t (s) too.
    """

    def __init__(
        self, expression: Expression, clock: float = 0.0, edges: Sequence[float] = ()
    ) -> None:
        self.expression, self.clock, self._edges = expression, clock, edges

    def at(self, time: float, sensed: Sequence[float] = ()) -> float:
        """Value at a time (s) and values sensed."""
        return self.expression.at(time + self.clock, sensed)

    def values(self, time: FloatArray, sensed: Sequence[FloatArray] = ()) -> FloatArray:
        """Values (n,) at instants (n,) s and values sensed."""
        return self.expression.values(time + self.clock, sensed)

    def rates(self, time: FloatArray) -> FloatArray:
        """First time derivatives (n,) at instants (n,) s."""
        return self.expression.rates(time + self.clock)

    def second_rates(self, time: FloatArray) -> FloatArray:
        """Second time derivatives (n,) at instants (n,) s."""
        return self.expression.second_rates(time + self.clock)

    def integrals(self, time: FloatArray) -> FloatArray:
        """Integrals (n,) of the value from 0 to instants (n,) s."""
        return np.array([self.integral(t) for t in time.tolist()])

    def rate(self, time: float) -> float:
        """First time derivative of the value."""
        return self.expression.rate(time + self.clock)

    def slopes(self, time: float, sensed: Sequence[float]) -> list[float]:
        """Derivatives by the values sensed."""
        return self.expression.slopes(time + self.clock, sensed)

    def integral(self, time: float) -> float:
        """Integral of the value from 0 to `time` (s)."""
        return self._integral(time + self.clock) - self._before

    @cached_property
    def _integral(self) -> Antiderivative:
        knots = {*self.expression.linear_bends, *self._edges}
        return Antiderivative(self.expression.at, knots)

    @cached_property
    def _before(self) -> float:
        return self._integral(self.clock)

    def knots(self, end: float) -> list[float]:
        """Instants before `end` (s) at which the value, or a derivative, jumps."""
        found = self.expression.bends(self.clock, self.clock + end)
        return [time - self.clock for time in found]


class Tabled(OfTime):
    """Values by time, from a table of the scene: `rule` linear, cubic or step.

    The table's time is `clock` (s) as the run begins.
    """

    def __init__(self, rows: Sequence[tuple[float, float]], rule: str, clock: float = 0.0) -> None:
        times, values = np.array(rows, dtype=float).T
        times = times - clock
        self.times: list[float] = times.tolist()
        # Only who has a table waits for SciPy.
        from scipy.interpolate import CubicSpline, PPoly  # noqa: PLC0415

        self._values: Any
        if rule == "cubic":
            self._values = CubicSpline(times, values)
        elif rule == "linear":
            slopes = np.diff(values) / np.diff(times)
            self._values = PPoly(np.array([slopes, values[:-1]]), times)
        else:
            self._values = PPoly(values[None, :-1], times)
        self._integrals = self._values.antiderivative()
        self._before = float(self._integrals(0.0))

    def at(self, time: float, sensed: Sequence[float] = ()) -> float:  # noqa: ARG002
        """Value at a time (s)."""
        return float(self._values(time))

    def rate(self, time: float) -> float:
        """First time derivative of the value."""
        return float(self._values(time, 1))

    def integral(self, time: float) -> float:
        """Integral of the value from 0 to `time` (s)."""
        return float(self._integrals(time)) - self._before

    def values(self, time: FloatArray, sensed: Sequence[FloatArray] = ()) -> FloatArray:  # noqa: ARG002
        """Values (n,) at instants (n,) s."""
        return np.asarray(self._values(time))

    def rates(self, time: FloatArray) -> FloatArray:
        """First time derivatives (n,) at instants (n,) s."""
        return np.asarray(self._values(time, 1))

    def second_rates(self, time: FloatArray) -> FloatArray:
        """Second time derivatives (n,) at instants (n,) s."""
        return np.asarray(self._values(time, 2))

    def integrals(self, time: FloatArray) -> FloatArray:
        """Integrals (n,) of the value from 0 to instants (n,) s."""
        return np.asarray(self._integrals(time)) - self._before

    def knots(self, end: float) -> list[float]:
        """Instants of rows before `end` (s): a derivative jumps at each."""
        return [time for time in self.times if 0 < time < end]


class Antiderivative:
    """Integral of `function` from 0 on; it may bend at `knots` (s) without being halved there."""

    def __init__(self, function: Callable[[float], float], knots: Iterable[float] = ()) -> None:
        self._function = function
        self._knots = sorted(time for time in knots if time > 0)
        self._ends = [0.0]
        self._sums = [0.0]
        self._pieces: list[list[float]] = []
        self._length = FIRST
        self._largest = 0.0

    def __call__(self, time: float) -> float:
        """Integral from 0 to `time` (s), which is not negative."""
        if time <= 0:
            return time * self._function(0.0)
        while self._ends[-1] < time:
            self._add_piece()
        k = bisect_left(self._ends, time) - 1
        begin, end = self._ends[k], self._ends[k + 1]
        return self._sums[k] + _clenshaw(self._pieces[k], (2 * time - begin - end) / (end - begin))

    def _add_piece(self) -> None:
        begin = self._ends[-1]
        k = bisect_right(self._knots, begin * (1 + 1e-15))
        next_knot = self._knots[k] if k < len(self._knots) else np.inf
        end = begin + self._length
        while True:
            end = min(end, next_knot)
            coefficients = self._interpolated(begin, end)
            self._largest = max(self._largest, float(np.abs(coefficients).max()))
            tail = float(np.abs(coefficients[-TAIL:]).max())
            short = end - begin <= SHORTEST * max(begin, FIRST)
            rounding = RESOLVED * (self._largest + self._blur(coefficients, begin, end))
            if short or tail <= rounding:
                break
            end = begin + (end - begin) / 2
        self._length = 2 * (end - begin)
        whole = chebyshev.chebint(coefficients, lbnd=-1) * ((end - begin) / 2)
        self._pieces.append(whole.tolist())
        self._ends.append(end)
        self._sums.append(self._sums[-1] + _clenshaw(self._pieces[-1], 1.0))

    def _blur(self, coefficients: FloatArray, begin: float, end: float) -> float:
        """How much the function changes with a time that is rounded, over that rounding."""
        steepest = float(np.abs(chebyshev.chebder(coefficients)).sum()) * 2 / (end - begin)
        return steepest * end

    def _interpolated(self, begin: float, end: float) -> FloatArray:
        """Coefficients of the polynomial through the function's values within a piece."""
        places = (begin + end) / 2 + (end - begin) / 2 * NODES
        return np.asarray(FROM_VALUES @ [self._function(time) for time in places.tolist()])


def _clenshaw(coefficients: Sequence[float], x: float) -> float:
    """Sum of Chebyshev polynomials at x."""
    one = other = 0.0
    for c in coefficients[:0:-1]:
        one, other = 2 * x * one - other + c, one
    return x * one - other + coefficients[0]


@dataclass(frozen=True)
class Ramp(OfTime):
    """A value (rad/s or N m) reached after `duration` (s) along the quintic smooth step.

    ``s(x) = 10 x^3 - 15 x^4 + 6 x^5`` has no first and no second derivative at either end, so that
    a speed raised along it starts and ends without a jump of acceleration or jerk.
    """

    value: float
    duration: float = 0.0

    def at(self, time: float, sensed: Sequence[float] = ()) -> float:  # noqa: ARG002
        """Value at `time`, whatever the state."""
        if time >= self.duration:
            return self.value
        return self.value * _rise(max(time, 0.0) / self.duration)

    def integral(self, time: float) -> float:
        """Integral of the value from 0 to `time`."""
        if time >= self.duration:
            return self.value * (time - self.duration / 2)
        return self.value * self.duration * _area(max(time, 0.0) / self.duration)

    def values(self, time: FloatArray, sensed: Sequence[FloatArray] = ()) -> FloatArray:  # noqa: ARG002
        """Values (n,) at instants (n,) s."""
        if self.duration == 0:
            return np.full(len(time), self.value)
        return self.value * _rise(self._parts(time))

    def rates(self, time: FloatArray) -> FloatArray:
        """Time derivatives (n,) of the value at instants (n,) s."""
        if self.duration == 0:
            return np.zeros(len(time))
        return self.value * _steepness(self._parts(time)) / self.duration

    def integrals(self, time: FloatArray) -> FloatArray:
        """Integrals (n,) of the value from 0 to instants (n,) s."""
        if self.duration == 0:
            return self.value * time
        rising = self.duration * _area(self._parts(time))
        return np.asarray(self.value * (rising + np.maximum(time - self.duration, 0.0)))

    def _parts(self, time: FloatArray) -> FloatArray:
        """How much of the ramp is over (n,), 0 to 1, at instants (n,) s."""
        return np.clip(time / self.duration, 0.0, 1.0)

    def knots(self, end: float) -> list[float]:
        """Instants before `end` (s) at which derivatives jump: where the ramp ends."""
        return [self.duration] if 0 < self.duration < end else []

    def time_of(self, integral: float) -> float:
        """Time at which the integral reaches a value of the ramp's own sign, s."""
        time = integral / self.value + self.duration / 2
        if time >= self.duration:
            return time
        low, high = 0.0, self.duration
        for _ in range(200):
            middle = (low + high) / 2
            low, high = (middle, high) if self.integral(middle) / integral < 1 else (low, middle)
        return high


def _rise(x: Part) -> Part:
    """Part of the value that is reached after a part of the ramp, 0 to 1 both."""
    return x**3 * (10 - 15 * x + 6 * x * x)


def _steepness(x: FloatArray) -> FloatArray:
    """Derivative of `_rise`."""
    return 30 * x * x * (1 - x) ** 2


def _area(x: Part) -> Part:
    """Integral of `_rise` from 0."""
    return x**4 * (2.5 - 3 * x + x * x)
