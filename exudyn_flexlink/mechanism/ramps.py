"""How a drive comes up to its value: at once, or along a smooth step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism.prescribed import OfTime

Part = TypeVar("Part", float, FloatArray)


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
