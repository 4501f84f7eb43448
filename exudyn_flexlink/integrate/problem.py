"""What an implicit step asks of the equations that it solves."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

NO_CONTACT = np.zeros((0, 2))


class Evaluation(NamedTuple):
    """Mass matrix (n, n) and force (n,) at one state, and what the problem keeps of it.

    `touching` (c, 2) are the gaps of the contacts that act, and their rates.
    """

    mass: FloatArray
    force: FloatArray
    kept: Any = None
    touching: FloatArray = NO_CONTACT


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


class Problem(Protocol):
    """``mass q'' = force``; `jacobians` are -df/dq and -df/dq' near an evaluation.

    A contact is a force of one gap and its rate, along the gap's gradient; it may leap.
    """

    def evaluate_all(self, t: FloatArray, q: FloatArray, v: FloatArray) -> list[Evaluation]:
        """Mass matrix and force at instants (n,), coordinates and speeds (n, ...) together."""

    def jacobians(self, at: Evaluation) -> tuple[FloatArray, FloatArray]:
        """Stiffness and damping matrix without contacts that leap, near enough to converge."""

    def contacts_at(self, at: Evaluation) -> tuple[FloatArray, Press] | None:
        """Gradients (c, n) of the gaps of the contacts that act, and their forces; None without."""

    def size(self, change: FloatArray) -> float:
        """How far (m) changes (..., n) of the coordinates move anything, at most."""


class NoConvergenceError(RuntimeError):
    """No step is short enough, or events follow one another at one instant."""
