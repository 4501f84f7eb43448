"""Where points are against faces carried by links, for many instants and pairs at once.

With C a point, O the origin of the link that carries a face, w its angular velocity, and e the
face's direction (complex numbers, global axes), the point is in the face's axes at

    z = e* (C - O) - z_0,      z' = e* (C' - O') - i w (z + z_0),

along the face by Re z, to its left by Im z; z_0 is where the face starts. What moves the point
against the face are the links that carry the one but not the other: each as if it carried the
point, counted negative if it carries the face.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray, IndexArray
from exudyn_flexlink.engines.exudyn.minimal.kinematics import LinkKinematics, Places
from exudyn_flexlink.engines.pair_events import Seen
from exudyn_flexlink.mechanism import FaceContact
from exudyn_flexlink.mechanism.tree import TreeLayout


class Gradients(NamedTuple):
    """Derivatives of gaps and of places by the coordinates, (..., pairs, links) each."""

    gap: FloatArray
    place: FloatArray


class WallFaces:
    """Pairs of a point and a face; both may be anywhere in the tree, or on the ground."""

    def __init__(
        self, layout: TreeLayout, kinematics: LinkKinematics, contacts: Sequence[FaceContact]
    ) -> None:
        self._kinematics = kinematics
        points = [layout.place(contact.point) for contact in contacts]
        starts = [layout.place(contact.start) for contact in contacts]
        self._links = np.array([link for link, _, _ in points], dtype=int)  # -1: the ground
        self._bases = np.array([link for link, _, _ in starts], dtype=int)
        self._own = np.array([complex(x, y) for _, x, y in points])
        along = [_direction(layout, contact) for contact in contacts]
        self._back = np.conj(np.array(along, dtype=complex))
        self._start = self._back * np.array([complex(x, y) for _, x, y in starts])
        self.length = np.array([contact.length for contact in contacts])
        self._side = np.array([contact.side for contact in contacts])
        self.held = self._side == 0
        self._any_held = bool(self.held.any())
        carried = kinematics.moved_by
        self._moved = carried[self._links].astype(float) - carried[self._bases]

    def some(self, which: IndexArray) -> WallFaces:
        """Return those of these numbers alone."""
        some = copy(self)
        some._links, some._bases = self._links[which], self._bases[which]
        some._own, some._start = self._own[which], self._start[which]
        some._back, some._moved = self._back[which], self._moved[which]
        some._side, some.held = self._side[which], self.held[which]
        some.length = self.length[which]
        some._any_held = bool(some.held.any())
        return some

    def look(self, x: FloatArray, v: FloatArray) -> Seen:
        """Look at all pairs at coordinates and speeds (..., links)."""
        at = self._kinematics.places(x)
        rates = self._kinematics.rates(at, x, v)
        links, bases = self._links, self._bases
        arms, back, moved = self._between(at)
        moving = rates.origin.take(links, axis=-1) - rates.origin.take(bases, axis=-1)
        moving += rates.spin.take(links, axis=-1) * arms
        rate = back * moving - rates.spin.take(bases, axis=-1) * moved
        return self._seen(moved - self._start, rate)[0]

    def look_and_gradients(self, x: FloatArray, v: FloatArray) -> tuple[Seen, Gradients]:
        """Look, with the gradients of gaps and places, from which the rates follow."""
        at = self._kinematics.places(x)
        arms, back, moved = self._between(at)
        points = at.origin.take(self._links, axis=-1) + arms
        rows = (back[..., None] * self._moved) * self._kinematics.carries(at, points)
        seen, side = self._seen(moved - self._start, (rows @ v[..., None])[..., 0])
        return seen, Gradients(side[..., None] * rows.imag, rows.real)

    def _between(self, at: Places) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Arms of the points, conjugate directions of the faces, and e* (C - O)."""
        links, bases = self._links, self._bases
        arms = at.axis.take(links, axis=-1) * self._own
        back = at.axis.take(bases, axis=-1).conj() * self._back
        apart = at.origin.take(links, axis=-1) - at.origin.take(bases, axis=-1)
        return arms, back, back * (apart + arms)

    def _seen(self, place: ComplexArray, rate: ComplexArray) -> tuple[Seen, FloatArray]:
        """From places in the faces' axes and their rates; and on which side the gaps are."""
        side = self._side
        if self._any_held:
            side = np.where(self.held, np.where(place.imag > 0, -1.0, 1.0), side)
        return Seen(side * place.imag, place.real, side * rate.imag, rate.real), side


def _direction(layout: TreeLayout, contact: FaceContact) -> complex:
    """Direction of a face in the axes of the link that carries it."""
    along = complex(contact.end.x - contact.start.x, contact.end.y - contact.start.y)
    turned = np.exp(1j * layout.frame(contact.start.part).angle)
    return complex(along / abs(along) * turned)
