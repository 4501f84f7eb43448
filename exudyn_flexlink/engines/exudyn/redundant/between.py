"""Values at instants between the steps of a run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IndexArray


@dataclass(frozen=True)
class Between:
    """Instants between steps: the steps around each, their length and the part of it gone by."""

    before: IndexArray
    after: IndexArray
    span: FloatArray
    part: FloatArray

    @classmethod
    def of(cls, time: FloatArray, wanted: FloatArray) -> Between:
        """Find the steps around instants that lie within `time`."""
        last = len(time) - 1
        before = np.clip(np.searchsorted(time, wanted, side="left") - 1, 0, max(last - 1, 0))
        after = np.minimum(before + 1, last)
        span = time[after] - time[before]
        part = np.divide(wanted - time[before], span, out=np.zeros_like(wanted), where=span > 0)
        return cls(before, after, span, part)

    @property
    def nearer(self) -> IndexArray:
        """The nearer of both steps: for what may jump, such as a place on a closed curve."""
        return np.where(self.part < 0.5, self.before, self.after)

    def linear(self, values: FloatArray) -> FloatArray:
        """Values (steps, ...) on the straight line between both steps."""
        part = self.part.reshape(-1, *([1] * (values.ndim - 1)))
        return np.asarray(values[self.before] + part * (values[self.after] - values[self.before]))

    def cubic(self, values: FloatArray, rates: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values (steps, ...) and rates on the cubic through values and rates of both steps."""
        shape = (-1, *([1] * (values.ndim - 1)))
        h, x = self.span.reshape(shape), self.part.reshape(shape)
        y0, y1, v0, v1 = (a[i] for a in (values, rates) for i in (self.before, self.after))
        slope = np.divide(y1 - y0, h, out=np.array(v0), where=h > 0)
        b, c = 3 * slope - 2 * v0 - v1, v0 + v1 - 2 * slope
        return y0 + h * x * (v0 + x * (b + x * c)), v0 + x * (2 * b + 3 * x * c)
