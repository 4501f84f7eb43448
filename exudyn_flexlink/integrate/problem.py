"""What an implicit step asks of the equations that it solves, and which times count as one.

A clock that reads 3000 s goes on by 5e-13 s at least. A step that ends at an instant at which
forces leap, to rounding, still knows neither side: what counts there is the limit from within the
step, so that a `Window` keeps times between two such instants.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence, Sized
from math import inf, isfinite
from typing import Any, NamedTuple, Protocol

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IndexArray

CLOCK = 1e-15  # of the time: 4 to 9 times what it is rounded to


JUST = 2e-13  # s: twice as near as steps end at an instant


def instant(t: float, least: float) -> float:
    """How near (s) times are that count as one at t (s): `least`, or what the clock tells apart."""
    return max(least, CLOCK * abs(t))


def later(t: float, by: float) -> float:
    """Return the instant that is later than t (s) by so much (s), if at all, or as clocks tell."""
    return t + instant(t, by) if by else t


FEW, MANY = 5, 7  # stages of a step
ACCURATE = 2e-6  # m: a tolerance up to which more stages pay beside contacts, too, as measured


def stages_for(contacts: Sized, tolerance: float | None) -> int:
    """Return the number of stages of a mechanism's steps, by the tolerance (m) of the run, if any.

    More stages pay where the error decides how long steps are. Beside `contacts` and with a loose
    tolerance it does not: there steps end at touches.
    """
    accurate = tolerance is not None and tolerance <= ACCURATE
    return MANY if accurate or not len(contacts) else FEW


def order_of(stages: int) -> int:
    """Order of Radau IIA with so many stages."""
    return 2 * stages - 1


class Window:
    """Times from one such instant to the next."""

    def __init__(self) -> None:
        self._after, self._before = 0.0, inf

    def go_on(self, begin: float, end: float) -> None:
        """Go on to the time between two instants (s); the run's start and end are none."""
        self._after = begin + instant(begin, JUST) if begin > 0 else 0.0
        self._before = end - instant(end, JUST) if isfinite(end) else inf

    def inside(self, time: float) -> float:
        """Return a time (s), or the nearest one within."""
        return min(max(time, self._after), self._before)

    def all_inside(self, times: FloatArray) -> FloatArray:
        """As `inside`, of times (n,) in order; the same array where they are."""
        if not len(times) or (self._after <= times[0] and times[-1] <= self._before):
            return times
        return np.minimum(np.maximum(times, self._after), self._before)


NO_CONTACT = np.zeros((0, 2))


class Evaluation(NamedTuple):
    """Mass matrix (n, n) and force (n,) at one state, and what the equations keep of it.

    That has a method `pick` like this one, if it is anything. `touching` (c, 2) are the gaps of the
    contacts that act, and their rates. Of several states together all have one axis more, the
    first.
    """

    mass: FloatArray
    force: FloatArray
    kept: Any = None
    touching: FloatArray = NO_CONTACT

    @property
    def accelerations(self) -> FloatArray:
        """Accelerations (n,), or (states, n)."""
        return np.asarray(np.linalg.solve(self.mass, self.force[..., None])[..., 0])

    def pick(self, which: int | slice | IndexArray | None) -> Evaluation:
        """Return one of several states, some of them, or (None) the only one as one of one."""
        kept = None if self.kept is None else self.kept.pick(which)
        return Evaluation(self.mass[which], self.force[which], kept, self.touching[which])


class State(NamedTuple):
    """Places, speeds and accelerations (n,)."""

    q: FloatArray
    v: FloatArray
    a: FloatArray


class Pressing(NamedTuple):
    """Forces of contacts, and how they fall with the gap and with its rate, all of one shape."""

    force: FloatArray
    stiffness: FloatArray
    damping: FloatArray


Press = Callable[[FloatArray], Pressing]
"""Forces by gaps and their rates (..., c, 2)."""


class Equations(Protocol):
    """``mass q'' = force``; `jacobians` are -df/dq and -df/dq' near an evaluation.

    A contact is a force of one gap and its rate, along the gap's gradient; it may leap. Coordinates
    may follow curves.
    """

    def evaluate(self, t: float, q: FloatArray, v: FloatArray) -> Evaluation:
        """Mass matrix and force at one instant (s)."""

    def evaluate_stages(self, t: FloatArray, q: FloatArray, v: FloatArray) -> Evaluation:
        """Mass matrices and forces at a step's stages (n,) s, of coordinates and speeds (n, ...).

        The step is tried only.
        """

    def jacobians(self, at: Evaluation) -> tuple[FloatArray, FloatArray]:
        """Stiffness and damping matrix without contacts that leap, near enough to converge."""

    def contacts_at(self, at: Evaluation) -> tuple[FloatArray, Press] | None:
        """Gradients (c, n) of the gaps of the contacts that act, and their forces; None without."""

    def size(self, change: FloatArray) -> float:
        """How far (m) changes (..., n) of the coordinates move anything, at most."""

    def knots(self) -> Sequence[tuple[FloatArray, FloatArray]]:
        """Of each curve the knots' places (k,), in order, and the jumps there (k, 2)."""

    def places(self, at: Evaluation) -> Sequence[float]:
        """Places on the curves at an evaluation."""

    def moved_by_point(self, k: int, at: Evaluation) -> float:
        """How much (m/s^2) things accelerate if curve k pushes its point by 1 m/s^2."""


DIVERGED = "the state went beyond all bounds: the tolerance is too loose"


class NoConvergenceError(RuntimeError):
    """No step is short enough, or events follow one another at one instant."""
