"""How long steps are: by the error that one may make, or all alike; what errors of speeds do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.integrate.collocation import STAGES

SHARE = 0.07  # of the tolerance: the error estimated of one step
LEAST_GROWTH, MOST_GROWTH = 0.1, 5.0
SAFETY = 0.9
# RADAU5's factor (2 k + 1)/(2 k + n), of at most k = 8 rounds of which n = 2 were made.
TWO_ROUNDS = 17 / 18
ORDER = STAGES + 1  # of the estimated error
PART = 0.1  # of 1/omega: errors of steps fall on all phases of a swing
FREELY = 0.3  # of the run: what moves freely keeps an error of its speed for half of it on average


@dataclass
class ErrorControl:
    """The same error (m) for every step, by the `tolerance` of the run; or `fixed` steps (s).

    Other limits of steps are `limits` times as long as the problem states them. Steps to events are
    so much too long (s), `late`.

    Measured on the shipped scenes by `scripts/tolerance.py`: over two turns, the error of S and of
    the lever's tip is 0.01 to 0.5 of the tolerance, from 1e-3 to 1e-8 m, where that decides on the
    steps.
    """

    tolerance: float
    fixed: float | None = None
    limits: float = 1.0
    late: float = 0.0
    _before: tuple[float, float] | None = None  # length and error ratio of the last step

    @property
    def allowed(self) -> float:
        """Error that one step may make, m."""
        return SHARE * self.tolerance

    def passes(self, error: float) -> bool:
        """Tell whether a step of this error (m) is good enough."""
        return error <= self.allowed

    def near(self, distance: float) -> bool:
        """Tell whether a distance (m) is nothing beside what the whole run may be off by."""
        return not distance > self.tolerance

    def forget(self) -> None:
        """The equations have changed: the last step tells nothing."""
        self._before = None

    def note(self, h: float, error: float) -> None:
        """Take note of a step of length h (s) that was good enough."""
        self._before = (h, max(error / self.allowed, 1e-2))

    def factor(self, h: float, error: float) -> float:
        """By how much the next step may be longer, or this one is to be shorter.

        Hairer and Wanner, eq. IV.8.25: the trend from the step before goes on.
        """
        ratio = max(error / self.allowed, 1e-12)
        grow = TWO_ROUNDS * SAFETY * ratio ** (-1.0 / ORDER)
        if self._before is not None:
            before, then = self._before
            grow = min(grow, grow * h / before * (then / ratio) ** (1.0 / ORDER))
        return float(max(LEAST_GROWTH, min(MOST_GROWTH, grow)))


def slow_motions(mass: FloatArray, stiffness: FloatArray, end: float, least: float) -> FloatArray:
    """Matrix (n, n) from errors of speeds to those of places that slow motions make of them, s.

    A mode of angular frequency omega turns an error of its speed into one of place within 1/omega,
    a motion without springs until the end of the run (s). Of both a part counts, since errors of
    steps fall on all phases and all instants. Motions that do so in less than `least` (s) are none.
    """
    if not len(mass):
        return np.zeros((0, 0))
    squares, modes = eigh(stiffness, mass)
    free = squares <= end**-2
    times = np.where(free, FREELY * end, PART / np.sqrt(np.where(free, 1.0, squares)))
    return np.asarray((modes * np.where(times > least, times, 0.0)) @ modes.T @ mass)
