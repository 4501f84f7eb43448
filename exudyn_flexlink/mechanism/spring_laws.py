"""Forces of springs by length, or torques by angle: a table or a formula, and the energy stored."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.expressions import Expression, NoValueError, resolved
from exudyn_flexlink.mechanism.prescribed import Antiderivative, Applied, Formula, interpolant

ROUNDED = 1e-12  # of a table's range: so little beyond its end is its end
LITTLE = 1e-12  # J: less than this is rounding of an energy


class TableEndError(NoValueError):
    """A spring, `text`, has left its table at a time (s), for a place (m or rad) beyond it."""

    advice = "give the table more rows: no force is made up beyond them"

    def __init__(self, name: str, place: float, time: float) -> None:
        ArithmeticError.__init__(
            self, f"the table of '{name}' ends before {place:.6g}, where it is at t = {time:.6g} s"
        )
        self.text, self.time = name, time


class PlaceTable(Applied):
    """Values between rows, by a length or an angle that is sensed: `rule` linear or cubic.

    Sides of its inner rows may follow what is sensed, 1 where it is below the row: the table is
    held between them, also beyond a row, as formulas are beyond a kink.
    """

    def __init__(self, name: str, rows: Sequence[tuple[float, float]], rule: str) -> None:
        self._name, (places, values) = name, np.array(rows, dtype=float).T
        self._values = interpolant(places, values, rule)
        self.ends = float(places[0]), float(places[-1])
        self._rows = places[1:-1]
        self.kinks = len(self._rows)
        self.antiderivative = self._values.antiderivative()

    def values(self, time: FloatArray, sensed: Sequence[FloatArray] = ()) -> FloatArray:
        """Values (n,) where something is sensed (n,); TableEndError beyond the rows."""
        place, *sides = sensed
        low, high = self.ends
        beyond = np.maximum(low - place, place - high) > ROUNDED * (high - low)
        if beyond.any():
            k = int(np.argmax(beyond))
            raise TableEndError(self._name, float(place[k]), float(np.ravel(time)[k]))
        if not sides:
            return np.asarray(self._values(place))
        piece = (1 - np.array(sides)).sum(axis=0).astype(int)
        at, begin = self._values.c[:, piece], self._values.x[piece]
        return np.asarray(sum(c * (place - begin) ** k for k, c in enumerate(at[::-1])))

    def switches(self, _: FloatArray, sensed: Sequence[FloatArray]) -> FloatArray:
        """Values (kinks, n) that are zero at inner rows."""
        return np.asarray(sensed[0] - self._rows[:, None])

    def knots(self, end: float) -> list[float]:  # noqa: ARG002
        """Return none: no time is known before."""
        return []


@dataclass(frozen=True)
class SpringLaw:
    """A spring's force (N) by its length (m), or its torque (N m) by its angle (rad).

    Positive: it draws both ends together, or turns the second part back. It stores nothing at
    `start`.
    """

    applied: PlaceTable | Formula
    start: float = 0.0

    def at(self, place: FloatArray) -> FloatArray:
        """Forces at lengths, or torques at angles, of one shape."""
        flat = np.ravel(np.asarray(place, dtype=float))
        sensed = [flat] if self.senses else []
        return self.applied.values(np.zeros(len(flat)), sensed).reshape(np.shape(place))

    @property
    def senses(self) -> bool:
        """Whether it is of the length or the angle, and no number."""
        return isinstance(self.applied, PlaceTable) or bool(self.applied.expression.sensed)

    def energy(self, place: FloatArray) -> FloatArray:
        """Energy stored (J) at lengths or angles, of one shape: the integral of the force."""
        flat = np.ravel(np.asarray(place, dtype=float))
        if isinstance(self.applied, PlaceTable):
            inside = np.clip([*flat, self.start], *self.applied.ends)
            found = self.applied.antiderivative(inside)
            return np.asarray(found[:-1] - found[-1]).reshape(np.shape(place))
        ahead, back = self._integrals
        off = flat - self.start
        found = ahead(np.maximum(off, 0.0)) - back(np.maximum(-off, 0.0))
        return np.asarray(found).reshape(np.shape(place))

    @cached_property
    def _integrals(self) -> tuple[_Work, _Work]:
        """Integrals from the start on, and from there back."""
        assert isinstance(self.applied, Formula)
        expression = self.applied.expression
        return _Work(expression.along(self.start, 1.0)), _Work(expression.along(self.start, -1.0))


class _Work(Antiderivative):
    """Integral (J) of a `formula` of t, which is a way (m or rad), just as far as it is asked for.

    Bounds show all of it but `LITTLE`. Beyond, the formula may have no value.
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
        if end <= begin * (1 + ROUNDED):
            return super().__call__(np.minimum(time, begin))
        edges = np.array([begin, *self._formula.bends(begin, end), end])
        parts = [resolved(one, edges, lambda _: 1.0, LITTLE)[0] for one in self._formula.addends]
        inner = np.unique(np.concatenate([edges, *parts]))
        self._knots = [*inner[inner < end * (1 - ROUNDED)].tolist(), end]
        return super().__call__(time)
