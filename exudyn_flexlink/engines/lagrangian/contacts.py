r"""All that may touch: points of the link and faces of levers, the link and the walls of its guide.

Seen from the axes of the face that it may touch, a point C is at

    z = d* e* (C - O) - z_0,        z_k = d* e* (C_k - O_k) - i delta z

with e the unit vector of the angle of the face's part, O the place there that its axes turn about,
d the face's direction in them and z_0 where it starts; C_k and O_k are derivatives by the
coordinate k, and delta is 1 if that is the part's angle. The contact is a gap ``s Im z``, where s
is the side of the face that is free, and a place ``Re z`` along it. It acts as ``F G + R T``: F
presses along the gap's gradient G, R is friction along that of the place, T. Either the point
belongs to the link and the face to guide or lever, which turn about their pivots, or a corner of
the guide's mouth meets a rod, which turns about its start. Where the link is held on the guide's
axis from both sides, s is the side on which it is not.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray, IndexArray
from exudyn_flexlink.engines.lagrangian.model import Frame, Model, Pivot
from exudyn_flexlink.engines.touching import Laws, rubbing
from exudyn_flexlink.mechanism import Anchor, FaceContact, Seen


class Pushed(NamedTuple):
    """What acts (k,) of the contacts at instants (m, k): forces, slopes, powers, gradients."""

    which: IndexArray
    press: FloatArray  # N
    rub: FloatArray  # N: friction
    power: FloatArray  # W: what the contact takes
    gap: FloatArray
    gap_rate: FloatArray
    slip: FloatArray
    rows: FloatArray  # (m, k, N): gradients of the gaps
    slides: FloatArray  # (m, k, N): of the places
    by_gap: FloatArray  # N/m: how the force rises with depth
    by_rate: FloatArray  # N s/m: and with its speed

    @property
    def force(self) -> FloatArray:
        """Generalised forces (m, N)."""
        total = self.press[:, None, :] @ self.rows + self.rub[:, None, :] @ self.slides
        return np.asarray(total[:, 0])

    def pick(self, which: int | slice | None) -> Pushed:
        """Return some of the instants."""
        return Pushed(self.which, *(column[which] for column in self[1:]))


class Contacts:
    """The contacts of a model; the first `faces` of them are those of levers."""

    def __init__(self, model: Model) -> None:
        layout, self.all = model.layout, model.contacts
        self.faces = len(layout.faces)
        self.held = np.array([contact.side == 0 for contact in self.all], dtype=bool)
        self.length = np.array([contact.length for contact in self.all])
        self._side = np.array([contact.side for contact in self.all])
        self._laws, self._rubbing = Laws([contact.law for contact in self.all]), rubbing(self.all)
        pivots = {pivot.part: pivot for pivot in (layout.guide, *layout.levers)}
        of_link = [contact for contact in self.all if contact.point.part in layout.rods]
        corners = [contact for contact in self.all if contact.point.part not in layout.rods]
        assert self.all == (*of_link, *corners)
        self._first_corner = len(of_link)
        turned = [pivots[contact.start.part] for contact in of_link]
        starts = [
            *(_from(contact.start, pivot) for contact, pivot in zip(of_link, turned, strict=True)),
            *(complex(corner.start.x, corner.start.y) for corner in corners),
        ]
        along = np.array([_direction(contact) for contact in self.all], dtype=np.complex128)
        self._back, self._start = along.conj(), along.conj() * np.array(starts)
        self._angle = np.array(
            [layout.coordinate(contact.start.part) for contact in self.all], dtype=int
        )
        self._origin = np.array([complex(*pivot.at) for pivot in turned])
        # Of those of the link: which point; of corners: from which end of a rod they are seen.
        points = [model.struck[contact.point] for contact in of_link]
        self._point = np.array(
            [*points, *(layout.rods.index(corner.start.part) for corner in corners)], dtype=int
        )
        self._centre = complex(*layout.guide.at)
        self._corner = np.array([_from(corner.point, layout.guide) for corner in corners])

    # --- where they are -----------------------------------------------------------------------

    def look(self, at: Frame) -> Seen:
        """Return all contacts at instants."""
        if not self.all:
            return Seen(*np.zeros((4, len(at.q), 0)))
        back, arm, z = self._places(at, slice(None))
        going = at.going[:, self._point]
        if self._first_corner < len(self.all):
            corners = slice(self._first_corner, None)
            # A corner is where the guide turns it, seen from the end of a rod.
            turning = 1j * at.v[:, :1] * at.axes[:, :1] * self._corner
            going[:, corners] = turning - going[:, corners]
        rate = back * going - 1j * at.v[:, self._angle] * arm
        side = self._sides(z, slice(None))
        return Seen(side * z.imag, z.real, side * rate.imag, rate.real)

    def _places(
        self, at: Frame, which: IndexArray | slice
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """What turns into the faces' axes, and there points from the origins, and from starts."""
        back = self._back[which] * at.axes[:, self._angle[which]].conj()
        if isinstance(which, slice):
            which = np.arange(len(self.all))
        arms = at.points[:, self._point[which]]
        cut = int(np.searchsorted(which, self._first_corner))
        arms[:, :cut] -= self._origin[which[:cut]]
        if cut < len(which):
            corner = self._corner[which[cut:] - self._first_corner]
            arms[:, cut:] = self._centre + at.axes[:, :1] * corner - arms[:, cut:]
        arms *= back
        return back, arms, arms - self._start[which]

    def _sides(self, z: ComplexArray, which: IndexArray | slice) -> FloatArray:
        """Sides (m, k) of faces that are free."""
        side, held = self._side[which], self.held[which]
        if held.any():
            side = np.where(held, np.where(z.imag > 0, -1.0, 1.0), side)
        return np.broadcast_to(side, z.shape)

    def _rows(self, at: Frame, which: IndexArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Gaps (m, k) of contacts (k,), increasing; gradients (m, k, N) of gaps and places."""
        back, arm, z = self._places(at, which)
        by, k = at.by[:, self._point[which]], np.arange(len(which))
        cut = int(np.searchsorted(which, self._first_corner))
        if cut < len(which):
            corner = self._corner[which[cut:] - self._first_corner]
            by[:, cut:] *= -1
            by[:, cut:, 0] += 1j * at.axes[:, :1] * corner
        by *= back[:, :, None]
        by[:, k, self._angle[which]] -= 1j * arm
        side = self._sides(z, which)
        return side * z.imag, side[:, :, None] * by.imag, by.real

    def bend(self, at: Frame, which: IndexArray) -> FloatArray:
        """Second derivatives (m, k) of gaps of levers' contacts where no coordinate accelerates."""
        back, arm, z = self._places(at, which)
        turning, points = at.v[:, self._angle[which]], self._point[which]
        bent = back * at.bends[:, points] - 2j * turning * back * at.going[:, points]
        return np.asarray(self._sides(z, which) * (bent - turning**2 * arm).imag)

    # --- how they push ------------------------------------------------------------------------

    def push(self, at: Frame, which: IndexArray, approach: FloatArray) -> Pushed:
        """Forces of the contacts `which` (k,), as their laws have it; of rigid ones none.

        The touches of all contacts began with the speeds `approach` (c,), m/s. See `pressing`.
        """
        gap, rows, slides = self._rows(at, which)
        rate, slip = ((row @ at.v[:, :, None])[..., 0] for row in (rows, slides))
        friction, creep = self._rubbing[:, which]
        press, by_gap, by_rate = self._laws.pressing(which, gap, rate, approach)
        rub = -friction * press * np.tanh(slip / creep)
        power = -press * rate - rub * slip
        return Pushed(which, press, rub, power, gap, rate, slip, rows, slides, by_gap, by_rate)

    def slopes_of(self, pushed: Pushed) -> tuple[FloatArray, FloatArray]:
        """Stiffness and damping (N, N) of walls that press, and of friction, at the first instant.

        What a face does along its gap is left out: its force leaps, see `integrate.contact_share`.
        """
        friction, creep = self._rubbing[:, pushed.which]
        rubbing = np.tanh(pushed.slip[0] / creep)
        # Pressing walls push along their gaps, and drag along their faces, as faces do, too.
        wall = np.where(pushed.which < self.faces, 0.0, 1.0)
        pressed, slid = pushed.rows[0].T, pushed.slides[0].T
        across = wall * pressed - friction * rubbing * slid
        drag = friction * np.maximum(pushed.press[0], 0.0) * (1 - rubbing**2) / creep
        stiffness = (across * pushed.by_gap[0]) @ pressed.T
        return stiffness, (across * pushed.by_rate[0]) @ pressed.T + (slid * drag) @ slid.T


def _from(point: Anchor, pivot: Pivot) -> complex:
    """A part's point, from its pivot."""
    return complex(point.x, point.y) - complex(*pivot.pin)


def _direction(contact: FaceContact) -> complex:
    begin, end = (complex(anchor.x, anchor.y) for anchor in (contact.start, contact.end))
    return (end - begin) / abs(end - begin)
