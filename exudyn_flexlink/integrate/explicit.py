"""Steps of SciPy's DOP853: a second method, so that every run of the first has a judge.

DOP853 is the explicit Runge-Kutta method of order 8 by Dormand and Prince, with dense output of
order 7. Between two events the equations are smooth, so it keeps its order. Its tolerances are
those of one step, of every number of the state.
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

# Tolerances of one step, per metre that the run may be off. By `scripts/tolerance.py --integrator
# dop853`, from 1e-3 to 1e-8 m, the run is off by less than 1e-4 of that: a judge has to be far
# better than what it judges, and touches of walls multiply what it leaves. It costs little: stiff
# hinges alone keep explicit steps short, so that at a hundred times of both a strike takes two
# thirds of the steps at 1e-6 m, and errors with clearance exceed the tolerance earlier.
RELATIVE, ABSOLUTE = 1e-3, 1e-5
LEAST = 3e-14  # of each: what is less is rounding
# m, rad, or per second: a number so large is known to no metre and to no turn. A state that grows
# on fails where steps get too short, or where it overflows, whichever rounding lets come first.
BEYOND = 1.0 / np.finfo(float).eps
STILL = np.zeros(2)


@dataclass(frozen=True)
class DenseStep:
    """A step from `t` over `h`, both s, or its part up to an event, by the dense output."""

    t: float
    h: float
    free: int  # coordinates
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
        """Accelerations (n,); ValueError or ArithmeticError where there are none."""

    def longest(self) -> float:
        """Limit of the next step, s."""

    def first_event(self, step: DenseStep) -> Crossing | None:
        """Locate what happens first within a step."""

    def accept(self, step: DenseStep) -> None:
        """Go to the end of a step, where something may happen, and record it."""


class ExplicitStepper:
    """Makes steps so that the run is off by no more than its tolerance (m)."""

    iterations = 0

    def __init__(
        self, problem: SmoothProblem, tolerance: float, limits: float = 1.0, late: float = 0.0
    ) -> None:
        """Other limits of steps than that by their error are `limits` times as long.

        Steps to events are so much too long (s), `late`.
        """
        self.problem, self._limits, self._late = problem, limits, late
        self.relative = max(LEAST, RELATIVE * tolerance)
        self.absolute = max(LEAST, ABSOLUTE * tolerance)
        self.time = 0.0
        self.steps, self.smallest, self.largest = 0, inf, 0.0
        self._solver: Any = None

    def begin(self) -> None:
        """Take up the state at time 0."""
        self.problem.begin()

    def restart(self, event: Crossing | None = None) -> None:  # noqa: ARG002
        """Go on from the present state: the method finds its first step by itself."""
        self._solver = None

    def advance(self, stop: float) -> Crossing | None:
        """Make one step, no further than to `stop` (s); return the event at its end, if any.

        Raises:
            NoConvergenceError: no step is short enough.

        """
        solver = self._solver = self._solver_to(stop)
        # A trial step far too long may overflow: it is not a number, hence rejected.
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            complaint = solver.step()
        if solver.status == "failed":
            raise NoConvergenceError(str(complaint))
        _require_bounds(solver.y)
        t, y, count = float(solver.t), solver.y, len(self.problem.q)
        dense = cache(solver.dense_output)  # which costs three evaluations: only if asked for
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
        """dy/dt; not a number in a trial step too far."""
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
    """Refuse a state that diverges, which a tolerance may be loose enough to let pass."""
    if not np.abs(y).max(initial=0.0) < BEYOND:
        raise NoConvergenceError(DIVERGED)
