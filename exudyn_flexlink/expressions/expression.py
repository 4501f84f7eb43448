"""A formula that was read: its values, its derivatives, and where it bends."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.expressions.resolving import Addend, zeros
from exudyn_flexlink.expressions.tape import TIME, Operation, Program, Sensed, Tape, Values
from exudyn_flexlink.quantities import Powers
from exudyn_flexlink.raising import Sendable

ORDERS = "value", "derivative", "second derivative"


class NoValueError(Sendable, ArithmeticError):
    """A formula, `text`, has no value at a time (s): a logarithm of a negative number, say.

    `what` it lacks may be a derivative.
    """

    advice = "mend the expression: min and max, or where(t < 1, one, other), keep it in bounds"

    def __init__(self, text: str, time: float, what: str = "value") -> None:
        super().__init__(f"'{text}' has no {what} at t = {time:.6g} s")
        self.text = text
        self.time = time


class Plan(NamedTuple):
    """The operations behind a `result`, and those at whose zeros it bends."""

    tape: Tape
    result: int
    switches: Sequence[int]


class Expression:
    """A formula of t (s) and of what it senses; equal if its text is.

    `powers` is its dimension as far as its units tell, angles counting as numbers; None if they
    don't. `sensed` is what the state has to supply, in this order. Sides of the `kinks` (so many)
    may follow, 1 where the switch is below zero: the formula is held on them, also beyond a kink.
    A formula `of_a_place` is of one thing that it senses, and not of time.
    """

    def __init__(
        self, text: str, plan: Plan, sensed: Sequence[Sensed], powers: Powers | None
    ) -> None:
        self.text = text
        self.sensed = tuple(sensed)
        self.of_a_place = plan.tape.variables(plan.result) == {0}
        self.powers = powers
        self._tape, self._result = plan.tape, plan.result
        self._switches = tuple(dict.fromkeys(plan.switches))
        # What compares states belongs to max, min or abs: `where` compares times alone.
        compared = [
            i
            for i in self._tape.needed([self._result])
            if self._tape.operations[i].name == "less" and self._tape.variables(i) - {TIME}
        ]
        self.kinks = len(compared)
        sides = (Operation("variable", (), len(sensed) + k) for k in range(self.kinks))
        self._held = dict(zip(compared, sides, strict=True))
        switches = [self._tape.operations[i].takes[0] for i in compared]
        self._at_kinks = Program(self._tape, switches, self._held)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Expression) and self.text == other.text

    def __hash__(self) -> int:
        return hash(self.text)

    def __repr__(self) -> str:
        return f"Expression({self.text!r})"

    def __str__(self) -> str:
        return self.text

    @property
    def constant(self) -> float | None:
        """Its value if it is a number; None if it depends on anything."""
        return self._tape.number_of(self._result)

    # --- values -------------------------------------------------------------------------------

    def at(self, time: float, state: Sequence[float] = ()) -> float:
        """Value at a time (s) and values of what is sensed.

        Raises:
            NoValueError: there is none.

        """
        return float(self.values(np.array([time]), [np.array([one]) for one in state])[0])

    def values(self, time: FloatArray, state: Sequence[FloatArray]) -> FloatArray:
        """Values (n,) at instants (n,) s and values (n,) of each of what is sensed.

        Raises:
            NoValueError: there is none at one of them.

        """
        return self._run_all(self._value, time, state)

    def derivatives(self, time: FloatArray, order: int) -> FloatArray:
        """Derivatives (n,) by time, up to the second, of one that senses nothing.

        Raises:
            NoValueError: there is none at one of the instants (n,) s.

        """
        return self._run_all(self._by_time[order], time, what=ORDERS[order])

    def _run_all(
        self,
        program: Program,
        time: FloatArray,
        state: Sequence[FloatArray] = (),
        what: str = "value",
    ) -> FloatArray:
        (found,) = self._found(program, time, state)
        whole = np.broadcast_to(np.asarray(found, dtype=float), np.shape(time))
        missing = np.flatnonzero(~np.isfinite(whole))
        if len(missing):
            raise NoValueError(self.text, float(np.ravel(time)[missing[0]]), what)
        return whole

    def _found(self, program: Program, time: Values, state: Sequence[Values]) -> list[Values]:
        found = program.run(time, state)
        if len(state) > len(self.sensed) and not np.isfinite(sum(found)).all():
            # Beyond its kink a formula that is held may have no value: a root has none.
            own = program.run(time, state[: len(self.sensed)])
            found = [np.where(np.isfinite(x), x, y) for x, y in zip(found, own, strict=True)]
        return found

    @cached_property
    def _value(self) -> Program:
        return Program(self._tape, [self._result], self._held)

    @cached_property
    def _by_time(self) -> list[Program]:
        first = self._tape.slope(self._result)
        second = self._tape.slope(first)
        return [self._value, *(Program(self._tape, [one]) for one in (first, second))]

    @cached_property
    def addends(self) -> list[Addend]:
        """The terms whose sum it is."""
        return self._addends_of(self._result)

    @cached_property
    def rate_addends(self) -> list[Addend]:
        """Those of its first derivative by time."""
        return self._addends_of(self._tape.slope(self._result))

    def _addends_of(self, result: int) -> list[Addend]:
        found, left = [], [result]
        while left:
            one = left.pop()
            name, takes, _ = self._tape.operations[one]
            if name in ("add", "sub", "neg"):
                left += takes
            elif self._tape.variables(one):
                found.append(Addend(self._tape, one, self._held))
        return found

    def along(self, start: float, way: float) -> Expression:
        """Return a formula of a place with ``start + way t`` for the place."""
        tape = Tape()
        moved = tape.add("mul", tape.number(way), tape.variable(TIME))
        of = {self._tape.variable(0): tape.add("add", tape.number(start), moved)}
        for i in self._tape.needed([self._result, *self._switches]):
            name, takes, value = self._tape.operations[i]
            if name == "number":
                of[i] = tape.number(value)
            elif name != "variable":
                of[i] = tape.add(name, *(of[k] for k in takes))
        plan = Plan(tape, of[self._result], [of[i] for i in self._switches])
        return Expression(self.text, plan, (), self.powers)

    # --- bends --------------------------------------------------------------------------------

    def switches(self, time: FloatArray, state: Sequence[FloatArray]) -> FloatArray:
        """Values (kinks, n) that are zero at the kinks, by time and state as `values`."""
        found = self._found(self._at_kinks, time, state)
        return np.array([np.broadcast_to(one, np.shape(time)) for one in found])

    @cached_property
    def linear_bends(self) -> list[float]:
        """Instants (s) at which a condition that is linear in t changes, in order."""
        found = []
        for switch in self._of_time:
            rate = self._tape.number_of(self._tape.slope(switch))
            if rate:
                found.append(-float(Program(self._tape, [switch]).run(0.0)[0]) / rate)
        return sorted(found)

    def bends(self, begin: float, end: float) -> list[float]:
        """Instants (s) between two at which a condition of time alone changes, in order."""
        found = set(self.linear_bends)
        for switch in self._of_time:
            if self._tape.number_of(self._tape.slope(switch)) is None:
                found.update(zeros(Addend(self._tape, switch), begin, end).tolist())
        return sorted(time for time in found if begin < time < end)

    @property
    def _of_time(self) -> list[int]:
        return [one for one in self._switches if self._tape.variables(one) == {TIME}]
