"""Many places on one smooth piece together: for steps that ask for all their stages at once.

Points and derivatives are complex numbers. As those of `scalar` they continue beyond the ends.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray
from exudyn_flexlink.curves.base import Curve
from exudyn_flexlink.curves.pieces import Arc, LineSegment
from exudyn_flexlink.curves.scalar import by_kind
from exudyn_flexlink.curves.spline import Spline

Places = tuple[ComplexArray, ComplexArray, ComplexArray]
TogetherEvaluator = Callable[[FloatArray], Places]
"""u (...) -> P (m), dP/du, d2P/du2, as x + i y (...)."""


def together(piece: Curve) -> TogetherEvaluator:
    """Return the function that evaluates a smooth piece at many of its own parameters.

    Raises:
        TypeError: the curve is not a single smooth piece.

    """
    return by_kind(piece, _arc, _line, _spline)


def _arc(piece: Arc) -> TogetherEvaluator:
    centre, a, b = (complex(*vector.tolist()) for vector in piece.conic)

    def at(u: FloatArray) -> Places:
        c, s = np.cos(u), np.sin(u)
        arm = a * c + b * s
        return centre + arm, b * c - a * s, -arm

    return at


def _line(piece: LineSegment) -> TogetherEvaluator:
    start, end = complex(*piece.a), complex(*piece.b)
    along = (end - start) / piece.end

    def at(u: FloatArray) -> Places:
        straight = np.zeros(u.shape, dtype=np.complex128)
        return straight + (start + along * u), straight + along, straight

    return at


def _spline(spline: Spline) -> TogetherEvaluator:
    knots, spans = (np.array(own) for own in spline.cubics())
    cubics = (spans[..., 0] + 1j * spans[..., 1]).T  # (4, spans): coefficients of w^3, w^2, w, 1
    last, closed, period = len(spans) - 1, spline.closed, spline.period

    def at(u: FloatArray) -> Places:
        if closed:
            u = np.mod(u, period)
        index = np.clip(np.searchsorted(knots, u, side="right") - 1, 0, last)
        w, (c3, c2, c1, c0) = u - knots[index], cubics[:, index]
        return (
            ((c3 * w + c2) * w + c1) * w + c0,
            (3 * c3 * w + 2 * c2) * w + c1,
            6 * c3 * w + 2 * c2,
        )

    return at
