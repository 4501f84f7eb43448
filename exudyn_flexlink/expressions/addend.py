"""One term of a formula: its values, its derivatives by time, and bounds of both."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from types import MappingProxyType

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.expressions.ranges import Bounds, ranges
from exudyn_flexlink.expressions.tape import TIME, Operation, Program, Tape

NOTHING: Mapping[int, Bounds] = MappingProxyType({})


class Addend:
    """One of the terms, numbers left out, whose sum a formula is; it may enter with a minus."""

    def __init__(
        self, tape: Tape, result: int, held: Mapping[int, Operation] | None = None
    ) -> None:
        self._tape, self._result, self._held = tape, result, held
        self._value, self._own = Program(tape, [result], held), Program(tape, [result])

    @property
    def of_time(self) -> bool:
        """Whether it takes nothing of the state."""
        return self._tape.variables(self._result) == {TIME}

    def derivative(self, order: int) -> Addend:
        """The term's derivative by time, of any order."""
        return self if order == 0 else self._rate.derivative(order - 1)

    @cached_property
    def _rate(self) -> Addend:
        return Addend(self._tape, self._tape.slope(self._result, TIME), self._held)

    def values(self, time: FloatArray, state: Sequence[FloatArray]) -> FloatArray:
        """Values (n,) at instants (n,) s and values (n,) of what is sensed; NaN where none is."""
        return np.broadcast_to(np.asarray(self._value.run(time, state)[0], float), np.shape(time))

    def ranges(self, time: Bounds, state: Mapping[int, Bounds] = NOTHING) -> Bounds:
        """Between which bounds (n,) it stays where t (s) and what is sensed do so.

        A derivative takes derivatives of what is sensed, too: see `tape.RATES`.
        """
        found = ranges(self._value.plan, time, state)
        if (np.isfinite(found.low) & np.isfinite(found.high)).all():
            return found
        own = ranges(self._own.plan, time, state)  # see `Expression._found`
        return Bounds(*(np.where(np.isfinite(x), x, y) for x, y in zip(found, own, strict=True)))
