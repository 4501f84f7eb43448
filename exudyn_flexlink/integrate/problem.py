"""The interface of equations that an implicit step solves, and the rounding of time.

Times of 3000 s differ by 5e-13 s at least. A step may end at an instant at which forces leap. By
its rounded time alone it is not clear on which side of the leap a force is evaluated. The limit
from within the step counts, so a `Window` keeps times between two such instants.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence, Sized
from math import inf, isfinite
from typing import Any, NamedTuple, Protocol

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.rounding import EVENT_TIME, UNIT_ROUNDING

JUST = 2 * EVENT_TIME  # s: twice the error with which a step ends at an instant


def instant(t: float, least: float) -> float:
    """Largest distance (s) of times that count as equal at t (s): `least`, or rounding of t."""
    return max(least, UNIT_ROUNDING * abs(t))


def later(t: float, by: float) -> float:
    """Return an instant later than t (s) by `by` (s), or by the rounding of t; t if `by` is 0."""
    return t + instant(t, by) if by else t


FEW, MANY = 5, 7  # stages of a step
ACCURATE = 2e-6  # m: a tolerance up to which more stages pay beside contacts, too, as measured


def stages_for(contacts: Sized, tolerance: float | None) -> int:
    """Return the number of stages of a mechanism's steps, by the tolerance (m) of the run, if any.

    More stages pay if the error decides how long steps are. With contacts and a loose tolerance it
    does not: then steps end at touches.
    """
    accurate = tolerance is not None and tolerance <= ACCURATE
    return MANY if accurate or not len(contacts) else FEW


def order_of(stages: int) -> int:
    """Order of Radau IIA with so many stages."""
    return 2 * stages - 1


class Window:
    """Times between two instants at which forces may leap."""

    def __init__(self) -> None:
        self._after, self._before = 0.0, inf

    def go_on(self, begin: float, end: float) -> None:
        """Go on to the times between two instants (s); 0 and infinity don't limit them."""
        self._after = begin + instant(begin, JUST) if begin > 0 else 0.0
        self._before = end - instant(end, JUST) if isfinite(end) else inf

    def inside(self, time: float) -> float:
        """Return a time (s), or the nearest time within the window."""
        return min(max(time, self._after), self._before)

    def all_inside(self, times: FloatArray) -> FloatArray:
        """As `inside`, for increasing times (n,); the same array if all of them are inside."""
        if not len(times) or (self._after <= times[0] and times[-1] <= self._before):
            return times
        return np.minimum(np.maximum(times, self._after), self._before)


NO_CONTACT = np.zeros((0, 2))


class Evaluation(NamedTuple):
    """Mass matrix (n, n) and force (n,) at one state, and what the equations keep of the state.

    `kept` is None, or has a method `pick` like this class. `touching` (c, 2) are the gaps of the
    contacts that act, and their rates. For several states all arrays have one more, first axis.
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
        """Return one of several states, or some; None puts a first axis of one before one state."""
        kept = None if self.kept is None else self.kept.pick(which)
        return Evaluation(self.mass[which], self.force[which], kept, self.touching[which])


class State(NamedTuple):
    """Places, speeds and accelerations (n,)."""

    q: FloatArray
    v: FloatArray
    a: FloatArray


class Pressing(NamedTuple):
    """Forces of contacts, and their slopes against the gap and its rate, all of one shape."""

    force: FloatArray
    stiffness: FloatArray
    damping: FloatArray


Press = Callable[[FloatArray], Pressing]
"""Returns forces for gaps and their rates (..., c, 2)."""


class Equations(Protocol):
    """``mass q'' = force``; `jacobians` are -df/dq and -df/dq' near an evaluation.

    The force of a contact depends on its gap and the gap's rate, acts along the gap's gradient, and
    may leap. Coordinates may follow curves.
    """

    def evaluate(self, t: float, q: FloatArray, v: FloatArray) -> Evaluation:
        """Mass matrix and force at one instant (s)."""

    def evaluate_stages(self, t: FloatArray, q: FloatArray, v: FloatArray) -> Evaluation:
        """Mass matrices and forces at a step's stages (n,) s, for coordinates and speeds (n, ...).

        The step is only tried: nothing may be recorded.
        """

    def jacobians(self, evaluation: Evaluation) -> tuple[FloatArray, FloatArray]:
        """Stiffness and damping matrix without contacts, as exact as Newton's method needs."""

    def contacts_at(self, evaluation: Evaluation) -> tuple[FloatArray, Press] | None:
        """Gradients (c, n) of the gaps of contacts that act, and their forces; None without any."""

    def size(self, change: FloatArray) -> float:
        """Largest distance (m) by which changes (..., n) of the coordinates move any part."""

    def knots(self) -> Sequence[tuple[FloatArray, FloatArray]]:
        """Places (k,) of the knots of each curve, in order, and jumps (k, 2) of its derivative."""

    def places(self, evaluation: Evaluation) -> Sequence[float]:
        """Places on the curves at an evaluation."""

    def moved_by_point(self, k: int, evaluation: Evaluation) -> float:
        """Largest acceleration (m/s^2) of any part if curve k pushes its point by 1 m/s^2."""


DIVERGED = "the state went beyond all bounds: the tolerance is too loose"


class NoConvergenceError(RuntimeError):
    """No step is short enough, or events follow one another at one instant."""
