"""Steps of SciPy's DOP853: a second method, which can check every run of the first.

DOP853 is the explicit Runge-Kutta method of order 8 by Dormand and Prince, with dense output of
order 7. Between two events the equations are smooth, so the method keeps its order. Its tolerances
hold for one step and for every number of the state.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from math import inf
from typing import Any, Protocol

import numpy as np
from scipy.integrate import DOP853

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.integrate.events import EVENT_TIME, Crossing
from exudyn_flexlink.integrate.problem import DIVERGED, NoConvergenceError, instant, later

# Tolerances of one step, per metre of the run's tolerance. `scripts/tolerance.py --integrator
# dop853` shows errors below 1e-4 of the tolerance from 1e-3 to 1e-8 m. The check of another method
# has to be much better than that method, and touches of walls multiply its errors. It costs little,
# since stiff hinges keep explicit steps short in any case: with both numbers a hundred times as
# large, a strike at 1e-6 m still takes two thirds of the steps, and errors with clearance exceed
# the tolerance.
RELATIVE, ABSOLUTE = 1e-3, 1e-5
LEAST = 3e-14  # of each: smaller tolerances are rounding
# m, rad, or per second: of so large a number not even the metre or the turn is known. If a state
# grows further, steps get too short or it overflows; rounding decides which comes first.
BEYOND = 1.0 / np.finfo(float).eps
STILL = np.zeros(2)


@dataclass(frozen=True)
class DenseStep:
    """A step from `t` over `h`, both s, or its part up to an event, by the dense output."""

    t: float
    h: float
    free: int  # number of coordinates
    end: float
    finish: FloatArray  # the state at the solver's `end` (s)
    dense: Callable[[], Any]

    def at(self, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Coordinates and speeds (m, n) at times (m,) within the step."""
        y = np.array([self.finish if t == self.end else self.dense()(t) for t in time.tolist()])
        return y[:, : self.free], y[:, self.free : 2 * self.free]


class SmoothProblem(Protocol):
    """``q'' = a(t, q, q')``, which changes at events."""

    @property
    def q(self) -> FloatArray:
        """Coordinates (n,) now."""

    @property
    def v(self) -> FloatArray:
        """Speeds (n,) now."""

    def begin(self) -> None:
        """Record the state at time 0."""

    def accelerate(self, t: float, q: FloatArray, v: FloatArray) -> FloatArray:
        """Accelerations (n,); ValueError or ArithmeticError if they can't be computed."""

    def longest(self) -> float:
        """Limit of the next step, s."""

    def first_event(self, step: DenseStep) -> Crossing | None:
        """Locate the first event within a step."""

    def accept(self, step: DenseStep) -> None:
        """Go to the end of a step, perhaps an event, and record the step."""


class ExplicitStepper:
    """Makes steps so that the run is off by no more than its tolerance (m)."""

    iterations = 0

    def __init__(
        self, problem: SmoothProblem, tolerance: float, limits: float = 1.0, late: float = 0.0
    ) -> None:
        """Limits of steps, except that by their error, are `limits` times as long as usual.

        Steps to events are made `late` (s) too long.
        """
        self.problem, self._limits, self._late = problem, limits, late
        self.relative = max(LEAST, RELATIVE * tolerance)
        self.absolute = max(LEAST, ABSOLUTE * tolerance)
        self.time = 0.0
        self.steps, self.smallest, self.largest = 0, inf, 0.0
        self._solver: Any = None

    def begin(self) -> None:
        """Record the state at time 0."""
        self.problem.begin()

    def restart(self, event: Crossing | None = None) -> None:  # noqa: ARG002
        """Go on from the present state; the method chooses its first step itself."""
        self._solver = None

    def advance(self, stop: float) -> Crossing | None:
        """Make one step, no further than to `stop` (s); return the event at its end, if any.

        Raises:
            NoConvergenceError: no step is short enough.

        """
        solver = self._solver = self._solver_to(stop)
        # A trial step that is far too long may overflow; then it is not a number and is rejected.
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            complaint = solver.step()
        if solver.status == "failed":
            raise NoConvergenceError(str(complaint))
        _require_bounds(solver.y)
        t, y, count = float(solver.t), solver.y, len(self.problem.q)
        dense = cache(solver.dense_output)  # costs three evaluations: only on demand
        step = DenseStep(self.time, t - self.time, count, t, y, dense)
        event = self.problem.first_event(step)
        self.time = t
        if event is not None:
            self.time = later(event.time, self._late)
            step = replace(step, h=self.time - step.t)
        self.steps, self.largest = self.steps + 1, max(self.largest, step.h)
        if step.h > instant(self.time, EVENT_TIME):
            self.smallest = min(self.smallest, step.h)
        self.problem.accept(step)
        _require_bounds(self._state)
        solver.max_step = self._limits * self.problem.longest()
        return event

    @property
    def _state(self) -> FloatArray:
        """Coordinates and speeds; without any, two numbers that stand still."""
        return np.concatenate([self.problem.q, self.problem.v]) if len(self.problem.q) else STILL

    def _rate(self, t: float, y: FloatArray) -> FloatArray:
        """dy/dt; not a number in a trial step that goes too far."""
        count = len(self.problem.q)
        v = y[count : 2 * count]
        try:
            a = self.problem.accelerate(t, y[:count], v)
        except (ValueError, ArithmeticError):
            return np.full_like(y, np.nan)
        return np.concatenate([v, a]) if count else STILL

    def _solver_to(self, stop: float) -> Any:
        if self._solver is not None and self._solver.t_bound == stop:
            return self._solver
        y = self._state
        _require_bounds(y)
        return DOP853(
            self._rate, self.time, y, stop, self._limits * self.problem.longest(),
            rtol=self.relative, atol=self.absolute,
        )  # fmt: skip


def _require_bounds(y: FloatArray) -> None:
    """Refuse a state that diverges: a loose tolerance may accept it."""
    if not np.abs(y).max(initial=0.0) < BEYOND:
        raise NoConvergenceError(DIVERGED)
