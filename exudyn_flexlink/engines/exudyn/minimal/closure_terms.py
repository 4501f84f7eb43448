"""Rows of closures as sums of terms; derivatives of terms are terms, too.

The gap of a joint is the vector from its first point to its second, in axes of its first part. It
is a sum of arms. The length of an arm is constant, or the coordinate s of a slide; its angle is a
sum phi of hinges' angles. So gaps, and all other rows r of closures, are sums of terms f with
constant weights W:

    r = W f,      f = (y, 1, cos phi, s cos phi, sin phi, s sin phi, gamma, gamma_u, gamma_uu)

with y the coordinates and gamma(u) the places on the curves of slots. Terms are functions of
arguments phi, s, u and y, which are sums of coordinates. The derivative of a term by an argument is
plus or minus another term. So a product of f and a constant table gives the rows and their
Jacobian. At speeds y', second derivatives without accelerations are sums of products of a term and
the rates of two arguments, for example

    (s cos phi)'' = -(s cos phi) phi' phi' - (sin phi) phi' s' - (sin phi) s' phi'
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from scipy.sparse import csr_array, issparse

from exudyn_flexlink.arrays import ComplexArray, FloatArray, IndexArray
from exudyn_flexlink.curves import Places
from exudyn_flexlink.mechanism import GROUND, Anchor
from exudyn_flexlink.mechanism.tree import ALONG_Y, HINGE, TreeLayout

# The slots' curves: points and two derivatives (n,) at parameters (n,).
Curves = Sequence[Callable[[FloatArray], Places]]
# Derivatives of an arm's angle by the coordinates of the tree, and the slide of its length.
Turn = tuple[tuple[float, ...], int | None]

DENSE = 30_000  # numbers: larger tables have mostly zeros and are multiplied as sparse matrices


class Terms:
    """Terms of gaps, their derivatives, and the gaps as sums of terms.

    Coordinates y are those of the tree, then the slots' places, then the motions of drives that
    move no coordinate of the tree. `gaps` (gaps, terms) are complex weights. `angles` (coordinates,
    arms) are derivatives of the arms' angles by y. `cosines`, `sines` and `curves` are the numbers
    of the first terms of each kind. Terms `slid` are multiplied by the coordinates `slides`.

    `slopes` (terms, (coordinates + 1) * terms) are the weights of derivatives by each coordinate,
    then of the terms themselves. Second derivatives are sums, with the weights `bends` (terms,
    products), of products of terms `bent` (products,) and two `rates` (coordinates, 2 * products).
    """

    def __init__(
        self,
        layout: TreeLayout,
        ends: Sequence[tuple[Anchor, Anchor, float]],
        slots: Sequence[int],
        drives: int,
    ) -> None:
        """`ends` are both points of each gap, and the angle of its axes against the first part.

        `slots` are the numbers of gaps between a point and a curve.
        """
        weights: dict[Turn, ComplexArray] = defaultdict(lambda: np.zeros(len(ends), dtype=complex))
        for gap, (first, second, angle) in enumerate(ends):
            for anchor, side in ((first, -1.0), (second, 1.0)):
                for turn, arm in _arms(layout, anchor, first.part, angle):
                    weights[turn][gap] += side * arm
        # Arms of both points cancel. Each arm along a slide needs its derivative, of constant
        # length.
        used = [turn for turn, weight in weights.items() if weight.any()]
        arms = list(dict.fromkeys(arm for turn in used for arm in (turn, (turn[0], None))))
        links, count = len(layout.links), len(arms)
        # After the coordinates comes the term 1.
        self.coordinates = unit = links + len(slots) + drives
        self.places = links + np.arange(len(slots))
        self.cosines, self.sines, self.curves = unit + 1 + np.arange(3) * count
        self.count = int(self.curves) + 6 * len(slots)
        self.angles = np.zeros((unit, count))
        self.angles[:links] = np.reshape([angle for angle, _ in arms], (-1, links)).T
        self.gaps = np.zeros((len(ends), self.count), dtype=complex)
        self.gaps[:, self.cosines : self.sines] = np.transpose([weights[arm] for arm in arms])
        self.gaps[:, self.sines : self.curves] = 1j * self.gaps[:, self.cosines : self.sines]
        curves = np.arange(self.curves, self.count).reshape(-1, 6)  # both parts of gamma, ...
        self.gaps[slots, curves[:, 0]], self.gaps[slots, curves[:, 1]] = -1.0, -1j

        cosine, coordinate = self.cosines + np.arange(count), np.arange(unit)
        slid = [
            (k, slide, arms.index((angle, None)))
            for k, (angle, slide) in enumerate(arms)
            if slide is not None
        ]
        along, slides, constant = np.reshape(slid, (-1, 3)).astype(int).T
        self.slid = np.append(self.cosines + along, self.sines + along)
        self.slides = np.tile(slides, 2)
        derivatives: list[tuple[Any, ...]] = [
            # Terms, the terms of their derivatives, the arguments, and the signs.
            (coordinate, unit, coordinate, 1),
            (cosine, cosine + count, unit + np.arange(count), -1),
            (cosine + count, cosine, unit + np.arange(count), 1),
            (self.slid, np.append(self.cosines + constant, self.sines + constant), self.slides, 1),
            (curves[:, :4], curves[:, 2:], self.places[:, None], 1),
        ]
        columns = [
            np.reshape(np.broadcast_arrays(*derivative), (4, -1)) for derivative in derivatives
        ]
        term, by, argument, sign = np.hstack(columns)
        arguments = np.hstack([np.eye(unit), self.angles])
        terms, k = np.nonzero(arguments[:, argument])
        numbers = np.arange(self.count)
        self.slopes = _matrix(
            np.append(sign[k] * arguments[terms, argument[k]], np.ones(self.count)),
            (
                np.append(term[k], numbers),
                np.append(terms * self.count + by[k], unit * self.count + numbers),
            ),
            (self.count, (unit + 1) * self.count),
        )
        once, twice = np.nonzero(by[:, None] == term)
        products = np.arange(len(once))
        self.bends = _matrix(
            sign[once] * sign[twice], (term[once], products), (self.count, len(products))
        )
        self.bent, self.rates = by[twice], arguments[:, argument[np.append(once, twice)]]


def _arms(
    layout: TreeLayout, anchor: Anchor, part: int, along: float
) -> Iterator[tuple[Turn, complex]]:
    """Arms (m; without unit along slides) from the ground to an anchor.

    They are in axes turned by `along` (rad) against a part.
    """
    axis = np.exp(-1j * (layout.turn(GROUND, part) + along))
    angle = -layout.turning_row(GROUND, part)
    link, x, y = layout.place(anchor)
    for i in layout.path(link):
        joint = layout.links[i]
        yield (tuple(angle), None), axis * complex(*joint.offset)
        axis *= np.exp(1j * joint.turn)
        if joint.kind == HINGE:
            angle[i] += 1.0
        else:
            yield (tuple(angle), i), axis * (1j if joint.kind == ALONG_Y else 1.0)
    yield (tuple(angle), None), axis * complex(x, y)


class Table:
    """Rows (rows, terms) of closures and their derivatives by coordinates in a given `order`."""

    def __init__(self, terms: Terms, rows: FloatArray, order: IndexArray) -> None:
        self._terms, unit = terms, terms.coordinates
        self._shape = len(rows), unit + 1
        in_order, place = np.append(order, np.arange(unit, terms.count)), np.argsort(order)
        self._angles = terms.angles[order]
        self._slides, self._places = place[terms.slides], place[terms.places]
        matrix = csr_array if issparse(terms.slopes) else np.asarray
        weights = matrix(rows)
        slopes = matrix((weights @ terms.slopes).reshape((len(rows) * (unit + 1), terms.count)))
        columns = np.arange(len(rows))[:, None] * (unit + 1) + in_order[: unit + 1]
        self._slopes = _packed(slopes[columns.ravel()][:, in_order])
        self._rates = _packed(terms.rates[order].T)
        self._bends = _packed(weights @ terms.bends)

    def values(self, y: FloatArray, curves: Curves) -> FloatArray:
        """Terms (n, terms) at coordinates (n, coordinates)."""
        terms, unit = self._terms, self._terms.coordinates
        f = np.empty((len(y), terms.count))
        f[:, :unit], f[:, unit] = y, 1.0
        angles = y @ self._angles
        np.cos(angles, out=f[:, terms.cosines : terms.sines])
        np.sin(angles, out=f[:, terms.sines : terms.curves])
        if len(self._slides):
            f[:, terms.slid] *= y[:, self._slides]
        for k, curve in enumerate(curves):
            places = f[:, terms.curves + 6 * k :][:, :6].view(complex)
            places.T[:] = curve(y[:, self._places[k]])
        return f

    def slopes(self, f: FloatArray) -> FloatArray:
        """Derivatives (n, rows, coordinates + 1) of the rows; the last column has the rows."""
        return np.ascontiguousarray(f @ self._slopes).reshape(len(f), *self._shape)

    def bends(self, f: FloatArray, v: FloatArray) -> FloatArray:
        """Second derivatives (n, rows) of the rows at speeds (n, coordinates)."""
        rates, count = v @ self._rates, len(self._terms.bent)
        products = f.take(self._terms.bent, axis=1) * rates[:, :count] * rates[:, count:]
        return np.asarray(products @ self._bends)


def _matrix(
    values: FloatArray, entries: tuple[IndexArray, IndexArray], shape: tuple[int, int]
) -> Any:
    """Matrix of few entries, sparse if it is large."""
    if np.prod(shape) > 10 * DENSE:  # it is multiplied only a few times
        return csr_array((values, entries), shape=shape)
    matrix = np.zeros(shape)
    matrix[entries] = values
    return matrix


def _packed(matrix: Any) -> Any:
    """Transpose of a matrix, dense if it is small, else sparse."""
    if np.prod(matrix.shape) > DENSE:
        return csr_array(matrix).T
    return (matrix.toarray() if issparse(matrix) else matrix).T.copy()
