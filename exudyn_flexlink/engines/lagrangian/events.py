"""The event loop: SciPy's DOP853 step by step, cut where a guard falls below zero.

DOP853 is the explicit Runge-Kutta method of order 8 by Dormand and Prince, error-controlled, with
dense output of order 7. Between two events the equations are smooth, so it keeps its order.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853
from scipy.optimize import brentq, minimize_scalar

from exudyn_flexlink.integrate.clock import instant

FloatArray = NDArray[np.float64]
Dense = Callable[[float], FloatArray]
Guards = Callable[[float, FloatArray], Sequence[float]]

EVENT_TIME = 1e-12  # s: to which events are located, where the clock tells that apart
LOOKS = 8  # guards are looked at so often within a step where something may happen
HALVINGS = 40
NOTHING = 1e-13  # m: a guard this little below zero is there by rounding
SLOPE = 1e-4  # of the time between two looks: over which slopes of guards are taken
MOST_AT_ONCE = 200  # events at one instant before the loop gives up


class StuckError(RuntimeError):
    """The loop can't go on: the step became too small, or events follow one another at once."""


class Hybrid(Protocol):
    """Equations that change at events; state y of any meaning.

    Guards are zero or positive while the present equations hold; `quiet` may save looking at them
    within the step that ended in (t, y). `cross` changes the equations when one guard, the `which`
    of `guards`, has fallen to zero, and returns the state to go on with.
    """

    def rate(self, t: float, y: FloatArray) -> FloatArray:
        """dy/dt."""

    def guards(self, t: float, y: FloatArray) -> Sequence[float]:
        """Values that must not fall below zero."""

    def quiet(self, done: float, t: float, y: FloatArray) -> bool:
        """Tell whether no guard can have fallen in the last step, of length `done`."""

    def cross(self, t: float, y: FloatArray, which: int) -> FloatArray:
        """Change the equations."""

    def longest_step(self, t: float, y: FloatArray) -> float:
        """Limit of the next step, s."""

    @property
    def over(self) -> bool:
        """Whether the run ends here."""


class Observer(Protocol):
    """Is told of every step before and after an event at its end is worked off."""

    def before(self, end: float, dense: Dense) -> None:
        """A step to `end` was made; `dense` gives the state within."""

    def after(self, t: float, y: FloatArray, crossed: bool) -> None:
        """The state at the end of the step, after an event if there was one."""


@dataclass
class Loop:
    """Integrates a hybrid system and counts its steps."""

    system: Hybrid
    observer: Observer
    relative: float
    absolute: float
    steps: int = 0
    smallest: float = inf
    largest: float = 0.0
    time: float = 0.0
    _at_once: int = 0

    def run(self, y: FloatArray, stops: Sequence[float]) -> FloatArray:
        """Integrate from time 0 over the `stops`, where the equations bend, to the last of them.

        Raises:
            StuckError: the loop can't go on.

        """
        self.state = y
        self.observer.after(self.time, y, False)
        for stop in stops:
            while stop - self.time > instant(stop, EVENT_TIME) and not self.system.over:
                y = self._until_event(y, stop)
        return y

    def _until_event(self, y: FloatArray, stop: float) -> FloatArray:
        """Integrate to the next event or to `stop`; return the state to go on with."""
        system = self.system
        began, longest = self.time, system.longest_step(self.time, y)
        if not np.isfinite(y).all():
            raise StuckError("the state is no number any more: tolerances are too loose")
        solver = DOP853(
            system.rate, began, y, stop, longest, rtol=self.relative, atol=self.absolute
        )
        while solver.status == "running":
            # A trial step far too long may overflow: it is not a number, hence rejected.
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                complaint = solver.step()
            if solver.status == "failed":
                raise StuckError(str(complaint))
            _require_numbers(solver.y)
            dense = _Lazy(solver)
            found = self._first_event(solver, dense)
            end = float(solver.t if found is None else found[0])
            self._count(float(end - solver.t_old))
            state = np.array(solver.y) if found is None else dense(end)
            _require_numbers(state)
            self.observer.before(end, dense)
            self.time, self.state = end, state
            if found is not None:
                return self._cross(self.state, found[1], began)
            self.observer.after(end, solver.y, False)
            if system.over:
                return np.array(solver.y)
            solver.max_step = system.longest_step(solver.t, solver.y)
        return np.array(solver.y)

    def _cross(self, y: FloatArray, which: int, began: float) -> FloatArray:
        at_once = self.time - began < instant(self.time, EVENT_TIME)
        self._at_once = self._at_once + 1 if at_once else 0
        if self._at_once > MOST_AT_ONCE:
            raise StuckError("events follow one another at one instant")
        y = self.system.cross(self.time, np.array(y), which)
        _require_numbers(y)
        self.observer.after(self.time, y, True)
        return y

    def _count(self, done: float) -> None:
        self.steps += 1
        self.largest = max(self.largest, done)
        if done > instant(self.time, EVENT_TIME):
            self.smallest = min(self.smallest, done)

    def _first_event(self, solver: Any, dense: Dense) -> tuple[float, int] | None:
        """Find instant and number of the guard that falls first in the last step."""
        if self.system.quiet(solver.t - solver.t_old, solver.t, solver.y):
            return None
        return first_event(self.system.guards, dense, solver.t_old, solver.t)


def _require_numbers(y: FloatArray) -> None:
    """Refuse a state that overflowed, which a tolerance may be loose enough to let pass."""
    if not np.isfinite(y).all():
        raise StuckError("the state is no number any more: the tolerance is too loose")


def first_event(guards: Guards, dense: Dense, begin: float, end: float) -> tuple[float, int] | None:
    """Find instant and number of the guard that falls first in a step."""
    t = begin
    for after in np.linspace(t, end, LOOKS + 1)[1:].tolist():
        found = [
            (_fall(guards, dense, which, (t, after)), which)
            for which, value in enumerate(guards(after, dense(after)))
            if value < -NOTHING
        ]
        found += _grazes(guards, dense, t, after)
        if found:
            return min(found)
        t = after
    return None


def _grazes(guards: Guards, dense: Dense, t: float, after: float) -> list[tuple[float, int]]:
    """Guards that fall below zero and are back between two looks: instant and number of each."""
    bit = SLOPE * (after - t)
    values = [np.array(guards(at, dense(at))) for at in (t, t + bit, after - bit, after)]
    turns = (values[1] < values[0]) & (values[2] < values[3]) & (values[3] >= -NOTHING)
    found = []
    for which in np.flatnonzero(turns & (values[0] > 0)).tolist():

        def guard(at: float, which: int = which) -> float:
            return guards(at, dense(at))[which]

        lowest = float(
            minimize_scalar(
                guard, bounds=(t, after), method="bounded", options={"xatol": 1e-8 * (after - t)}
            ).x
        )
        if guard(lowest) < -NOTHING:
            found.append((_fall(guards, dense, which, (t, lowest)), which))
    return found


def _fall(guards: Guards, dense: Dense, which: int, within: tuple[float, float]) -> float:
    """Instant at which a guard falls to zero."""
    t, after = within

    def guard(at: float) -> float:
        return guards(at, dense(at))[which]

    if guard(t) <= NOTHING:
        # Right after an event it starts at zero, and a bounce may be lower than any fixed
        # limit: it falls after the highest place, of those that close in on the start.
        places = [t + (after - t) * 0.5**k for k in range(1, HALVINGS)]
        t = max(places, key=guard)
        if guard(t) <= 0:
            return t
    return float(brentq(guard, t, after, xtol=EVENT_TIME, rtol=1e-15))


class _Lazy:
    """Dense output of the last step, which costs three evaluations, only where it is asked for."""

    def __init__(self, solver: Any) -> None:
        self._solver = solver
        self._dense: Any = None

    def __call__(self, t: float) -> FloatArray:
        if t == self._solver.t:
            return np.asarray(self._solver.y)
        if self._dense is None:
            self._dense = self._solver.dense_output()
        return np.asarray(self._dense(t))
