"""Where a term of a formula of time grows without bound: by a zero of a denominator, say.

Interval arithmetic leaves ever shorter parts of a time in which a term may have no bounds. A point
that is left at last may still be none where it grows: `where` chooses another formula there, or a
numerator is zero, too, as that of sin(t)/t. So its values near the point decide.
"""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.expressions.addend import Addend
from exudyn_flexlink.expressions.ranges import Bounds

PARTS = 64  # of the time that are looked at first
MOST_PARTS = 32  # looked at together, the first ones: more poles than these are not needed
HALVINGS = 34  # of these parts: then they are 1e-12 of the time
NEAR, FAR = 1e-8, 1e-5  # of the time: how far from the point values are looked at
GROWS = 10.0  # from far to near: a pole of order 1 grows by a thousand, a logarithm hardly


def pole(term: Addend, begin: float, end: float) -> float | None:
    """Instant (s), of two between which a term of time grows without bound; None if it does not."""
    edges = np.linspace(begin, end, PARTS + 1)
    low, high = edges[:-1], edges[1:]
    for _ in range(HALVINGS):
        bounds = term.ranges(Bounds(low, high))
        left = np.flatnonzero(~np.isfinite(bounds).all(axis=0))[:MOST_PARTS]
        if not len(left):
            return None
        low, high = low[left], high[left]
        middle = (low + high) / 2
        low, high = np.stack([low, middle], -1).ravel(), np.stack([middle, high], -1).ravel()
    for time in ((low + high) / 2).tolist():
        if _grows(term, time, begin, end):
            return begin if time - begin < NEAR * (end - begin) else time
    return None


def _grows(term: Addend, time: float, begin: float, end: float) -> bool:
    """Tell whether values grow towards an instant, from one side at least."""

    def sizes(part: float) -> FloatArray:
        away = part * (end - begin) * np.array([-1.0, 1.0])
        return np.abs(term.values((time + away).clip(begin, end), []))

    near = sizes(NEAR)
    return bool((np.isinf(near) | (near / GROWS > sizes(FAR))).any())
