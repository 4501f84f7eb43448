"""Where a term of a formula leaves a polynomial that was laid through some of its values.

Between those values the term may do anything, a short pulse for instance. Interval arithmetic
bounds it over parts of a stretch; where it may leave the polynomial, it is looked at, in ever
shorter parts, until it is found to do so or can't do so by enough to matter.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.expressions.ranges import Bounds

PARTS = 8  # of a stretch that are looked at first
MOST_PARTS = 32  # looked at together: what takes the same thing twice has wide bounds
HALVINGS = 40  # of these parts: then rounding of the time is near


class Term(Protocol):
    """What is looked at."""

    def values(self, time: FloatArray, state: Sequence[FloatArray]) -> FloatArray:
        """Values (n,) at instants (n,) s and values (n,) of what is sensed; NaN where none is."""

    def ranges(self, time: Bounds, state: Sequence[Bounds]) -> Bounds:
        """Between which bounds (n,) it stays where t (s) and what is sensed do so."""


class Inputs(Protocol):
    """What a term takes over a stretch, by the part of it, 0 to 1."""

    def time(self, part: FloatArray) -> FloatArray:
        """The t (n,) s of the formula."""

    def state(self, part: FloatArray) -> list[FloatArray]:
        """What is sensed, each (n,)."""

    def bounds(self, begin: FloatArray, width: float) -> tuple[Bounds, list[Bounds]]:
        """Bounds of both over parts of a stretch that begin so and are so wide."""


def strays(
    term: Term,
    inputs: Inputs,
    polynomial: Callable[[FloatArray], FloatArray],
    enough: Callable[[float], float],
) -> float | None:
    """Find a part of a stretch at which a term is not what a polynomial (by the part) tells.

    `enough` is by how much they must differ, by the width of the part that is looked at. None if
    they do so nowhere.
    """
    begin, width = np.arange(PARTS) / PARTS, 1.0 / PARTS
    for _ in range(HALVINGS):
        middle, least = begin + width / 2, enough(width)
        expected = np.array([polynomial(part) for part in (begin, middle, begin + width)])
        off = np.abs(term.values(inputs.time(middle), inputs.state(middle)) - expected[1])
        if (off > least).any():
            return float(middle[off > least].min())
        low, high = term.ranges(*inputs.bounds(begin, width))
        beyond = np.maximum(high - expected.max(0), expected.min(0) - low)
        left = np.flatnonzero(beyond > least)
        if not len(left):
            return None
        left = left[np.argsort(beyond[left])[-MOST_PARTS:]]
        begin, width = np.sort(np.concatenate([begin[left], middle[left]])), width / 2
    return None
