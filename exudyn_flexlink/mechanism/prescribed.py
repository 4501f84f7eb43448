"""What a drive prescribes or applies, by time and state: one form for numbers, formulas, tables."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.expressions import Expression
from exudyn_flexlink.mechanism.antiderivative import Antiderivative


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
