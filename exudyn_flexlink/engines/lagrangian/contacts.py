r"""Contacts: points of the link on faces of levers, the link and the walls of its guide.

In the axes of the face that it may touch, a point C has the place z and its derivatives z_k:

    z = d* e* (C - O) - z_0,        z_k = d* e* (C_k - O_k) - i delta z

Here e is the unit vector of the angle of the face's part, and O the point about which the part
turns. In the part's axes, d is the face's direction and z_0 its start. C_k and O_k are derivatives
by the coordinate k; delta is 1 if k is the part's angle. The contact has the gap ``s Im z``, with s
the free side of the face, and the place ``Re z`` along the face. Its generalised force is ``F G + R
T``: the force F presses along the gradient G of the gap, and R is friction along the gradient T of
the place. Either a point of the link meets a face of guide or lever, which turn about their pivots,
or a corner of the guide's mouth meets a rod, which turns about its start. If both sides of the
guide hold the link on its axis, s is the side without the link.

A pin with play in its slot has the distance s = Im(t* (P - gamma)) to the left of gamma, the
nearest place of the curve; t is the unit tangent at gamma. Its gaps to the walls are c - s and c +
s, with c the clearance. With the speed v = Re(t* P') along the curve, and the curvature k,

    s_k = Im(t* P_k),      s'' = Im(t* P'') - k v^2 / (1 - k s)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray, IndexArray
from exudyn_flexlink.curves import Places, next_piece
from exudyn_flexlink.engines.lagrangian.model import Frame, Model, Pivot
from exudyn_flexlink.engines.touching import Laws, rubbing
from exudyn_flexlink.engines.track_follower import NEWTON_STEPS, TrackFollower
from exudyn_flexlink.mechanism import Anchor, FaceContact, Groove, Seen
from exudyn_flexlink.result import Event
from exudyn_flexlink.rounding import SUM_ROUNDING

AWAY = 1.0  # m: gap between a pin and walls of another lap, which it never touches


class Pushed(NamedTuple):
    """Contacts that act (k,), at instants (m, k): forces, slopes, powers, gradients."""

    which: IndexArray
    press: FloatArray  # N
    rub: FloatArray  # N: friction
    power: FloatArray  # W: power that the contact dissipates or stores
    gap: FloatArray
    gap_rate: FloatArray
    slip: FloatArray
    rows: FloatArray  # (m, k, N): gradients of the gaps
    slides: FloatArray  # (m, k, N): gradients of the places
    by_gap: FloatArray  # N/m: slope of the force by depth
    by_rate: FloatArray  # N s/m: slope by the speed of depth

    @property
    def force(self) -> FloatArray:
        """Generalised forces (m, N)."""
        total = self.press[:, None, :] @ self.rows + self.rub[:, None, :] @ self.slides
        return np.asarray(total[:, 0])

    def pick(self, which: int | slice | None) -> Pushed:
        """Return some of the instants."""
        return Pushed(self.which, *(column[which] for column in self[1:]))


class Contacts:
    """The contacts of a model; the first `faces` of them belong to levers and to P's slot."""

    def __init__(self, model: Model) -> None:
        layout, self.all = model.layout, model.contacts
        straight = tuple(contact for contact in self.all if isinstance(contact, FaceContact))
        self._count, walls = len(straight), len(self.all) - len(straight)
        self.faces = len(layout.faces) + walls
        self.held = np.array([contact.side == 0 for contact in self.all], dtype=bool)
        self.length = np.array([contact.length for contact in self.all])
        self._side = np.array([contact.side for contact in straight])
        self._is_held = np.array([contact.side == 0 for contact in straight], dtype=bool)
        self._laws, self._rubbing = Laws([contact.law for contact in self.all]), rubbing(self.all)
        pivots = {pivot.part: pivot for pivot in (layout.guide, *layout.levers)}
        of_link = [contact for contact in straight if contact.point.part in layout.rods]
        corners = [contact for contact in straight if contact.point.part not in layout.rods]
        assert straight == (*of_link, *corners)
        self._first_corner = len(of_link)
        turned = [pivots[contact.start.part] for contact in of_link]
        starts = [
            *(_from(contact.start, pivot) for contact, pivot in zip(of_link, turned, strict=True)),
            *(complex(corner.start.x, corner.start.y) for corner in corners),
        ]
        along = np.array([_direction(contact) for contact in straight], dtype=np.complex128)
        self._back, self._start = along.conj(), along.conj() * np.array(starts)
        self._angle = np.array(
            [layout.coordinate(contact.start.part) for contact in straight], dtype=int
        )
        self._origin = np.array([complex(*pivot.at) for pivot in turned])
        # Number of the link's point, or of the rod whose end a corner is seen from.
        points = [model.struck[contact.point] for contact in of_link]
        self._point = np.array(
            [*points, *(layout.rods.index(corner.start.part) for corner in corners)], dtype=int
        )
        self._centre = complex(*layout.guide.at)
        self._corner = np.array([_from(corner.point, layout.guide) for corner in corners])

    # --- gaps and places ----------------------------------------------------------------------

    def inside(self, seen: Seen) -> FloatArray:
        """Distance (m) of places from the nearer end of the face; infinite if it has no ends."""
        ends = np.minimum(seen.place, self.length - seen.place)
        return np.where(np.isinf(self.length), np.inf, ends)

    def look(self, frame: Frame) -> Seen:
        """Gaps, places and their rates of all contacts at the instants of a frame."""
        if not self._count:
            return Seen(*np.zeros((4, len(frame.q), 0)))
        back, arm, z = self._places(frame, slice(None))
        going = frame.going[:, self._point]
        if self._first_corner < self._count:
            corners = slice(self._first_corner, None)
            # The guide turns a corner; its place is seen from the end of a rod.
            turning = 1j * frame.v[:, :1] * frame.axes[:, :1] * self._corner
            going[:, corners] = turning - going[:, corners]
        rate = back * going - 1j * frame.v[:, self._angle] * arm
        side = self._sides(z, slice(None))
        return Seen(side * z.imag, z.real, side * rate.imag, rate.real)

    def _places(
        self, frame: Frame, which: IndexArray | slice
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Turns into the faces' axes; in these, points from the origins, and from the starts."""
        back = self._back[which] * frame.axes[:, self._angle[which]].conj()
        if isinstance(which, slice):
            which = np.arange(self._count)
        arms = frame.points[:, self._point[which]]
        cut = int(np.searchsorted(which, self._first_corner))
        arms[:, :cut] -= self._origin[which[:cut]]
        if cut < len(which):
            corner = self._corner[which[cut:] - self._first_corner]
            arms[:, cut:] = self._centre + frame.axes[:, :1] * corner - arms[:, cut:]
        arms *= back
        return back, arms, arms - self._start[which]

    def _sides(self, z: ComplexArray, which: IndexArray | slice) -> FloatArray:
        """Free sides (m, k) of faces: 1 or -1."""
        side, held = self._side[which], self._is_held[which]
        if held.any():
            side = np.where(held, np.where(z.imag > 0, -1.0, 1.0), side)
        return np.broadcast_to(side, z.shape)

    def _rows(self, frame: Frame, which: IndexArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Gaps (m, k) of contacts (k,), increasing; gradients (m, k, N) of gaps and places."""
        back, arm, z = self._places(frame, which)
        by, k = frame.by[:, self._point[which]], np.arange(len(which))
        cut = int(np.searchsorted(which, self._first_corner))
        if cut < len(which):
            corner = self._corner[which[cut:] - self._first_corner]
            by[:, cut:] *= -1
            by[:, cut:, 0] += 1j * frame.axes[:, :1] * corner
        by *= back[:, :, None]
        by[:, k, self._angle[which]] -= 1j * arm
        side = self._sides(z, which)
        return side * z.imag, side[:, :, None] * by.imag, by.real

    def bend(self, frame: Frame, which: IndexArray) -> FloatArray:
        """Second derivatives (m, k) of gaps of levers' contacts if no coordinate accelerates."""
        back, arm, z = self._places(frame, which)
        turning, points = frame.v[:, self._angle[which]], self._point[which]
        bent = back * frame.bends[:, points] - 2j * turning * back * frame.going[:, points]
        return np.asarray(self._sides(z, which) * (bent - turning**2 * arm).imag)

    # --- forces -------------------------------------------------------------------------------

    def push(self, frame: Frame, which: IndexArray, approach: FloatArray) -> Pushed:
        """Forces of the contacts `which` (k,) by their laws; rigid ones have none.

        The touches of all contacts began with the speeds `approach` (c,), m/s. See `pressing`.
        """
        gap, rows, slides = self._rows(frame, which)
        rate, slip = ((row @ frame.v[:, :, None])[..., 0] for row in (rows, slides))
        friction, creep = self._rubbing[:, which]
        press, by_gap, by_rate = self._laws.pressing(which, gap, rate, approach)
        rub = -friction * press * np.tanh(slip / creep)
        power = -press * rate - rub * slip
        return Pushed(which, press, rub, power, gap, rate, slip, rows, slides, by_gap, by_rate)

    def slopes_of(self, pushed: Pushed) -> tuple[FloatArray, FloatArray]:
        """Stiffness and damping (N, N) of walls that press, and of friction, at the first instant.

        Forces of faces along their gaps are left out: they leap, see `integrate.radau`.
        """
        friction, creep = self._rubbing[:, pushed.which]
        rubbing = np.tanh(pushed.slip[0] / creep)
        # Walls that press push along their gaps. Their friction, and that of faces, acts along
        # places.
        wall = np.where(pushed.which < self.faces, 0.0, 1.0)
        pressed, slid = pushed.rows[0].T, pushed.slides[0].T
        across = wall * pressed - friction * rubbing * slid
        drag = friction * np.maximum(pushed.press[0], 0.0) * (1 - rubbing**2) / creep
        stiffness = (across * pushed.by_gap[0]) @ pressed.T
        return stiffness, (across * pushed.by_rate[0]) @ pressed.T + (slid * drag) @ slid.T


class PinOnTrack(TrackFollower):
    """The place of a track nearest to a pin with play; `u` is the last accepted place.

    Beyond an open end the track goes on, but holds nothing.
    """

    def __init__(self, groove: Groove, place: float, events: list[Event]) -> None:
        super().__init__(groove.slot, place, groove.lap, events)
        self.groove = groove

    def left(self, u: float) -> tuple[float, float]:
        """Distance of a place from those ends of the present piece that another piece follows."""
        ahead, behind = super().left(u)
        if next_piece(self.curve, self.piece, self.lap, 1) is None:
            ahead = np.inf
        if next_piece(self.curve, self.piece, self.lap, -1) is None:
            behind = np.inf
        return ahead, behind

    @property
    def bounds(self) -> tuple[float, float]:
        """Limits of the parameter on the present piece."""
        low, high = super().bounds
        ahead, behind = self.left(self.u)
        if behind == np.inf:
            low = -np.inf
        if ahead == np.inf:
            high = np.inf
        return low, high

    @property
    def shift(self) -> float:
        """Difference between the parameter of the whole curve and that of the present piece."""
        return float(self.curve.breaks[self.piece] - self.present.start)

    def feet(self, points: ComplexArray) -> tuple[FloatArray, Places]:
        """Places (m,) of the present piece nearest to points (m,), searched from the last place."""
        places_of, piece = self.curve.pieces[self.piece].places, self.present
        u = np.full(len(points), self.u)
        for _ in range(NEWTON_STEPS):
            place, first, second = places = places_of(u)
            back, speed = (place - points).conj(), np.abs(first) ** 2
            growth = speed + (back * second).real
            step = (back * first).real / np.where(growth > LEAST_GROWTH * speed, growth, speed)
            if not np.abs(step).max(initial=0.0) > SUM_ROUNDING * (1 + abs(self.u)):
                break
            u = u - np.clip(step, -FARTHEST * piece.period, FARTHEST * piece.period)
        return u, places


LEAST_GROWTH = 0.1  # of the slope's growth on a straight track: less means near its centre
FARTHEST = 0.05  # of a piece: longest step of the search


class WallsSeen(NamedTuple):
    """Walls (k,) of a slot at instants (m,): gaps and rates (m, k), gradients (m, k, N).

    `slide` has the gradients of places, scaled for friction (see `shapes.Look`), and `bend` the
    second derivatives of gaps if no coordinate accelerates.
    """

    gap: FloatArray
    gap_rate: FloatArray
    slip: FloatArray
    row: FloatArray
    slide: FloatArray
    bend: FloatArray


class PinnedContacts(Contacts):
    """As `Contacts`, with the walls of the slot in which P has play.

    The walls come after the levers' contacts. Only those of the present lap can touch.
    """

    def __init__(self, model: Model, pin: PinOnTrack) -> None:
        super().__init__(model)
        self._pin, count = pin, len(pin.groove.contacts)
        first = len(model.layout.faces)
        self._walls = np.arange(first, first + count)
        # Numbers of all contacts among the straight ones; -1 for walls.
        self._straight = np.arange(len(self.all))
        self._straight[first:] -= count
        self._straight[self._walls] = -1
        self._turns = model.layout.coordinate(model.layout.rods[0])

    def look(self, frame: Frame) -> Seen:
        """Gaps, places and their rates of all contacts at the instants of a frame."""
        seen, walls = super().look(frame), self._look_at_walls(frame, self._walls)
        first, pin = int(self._walls[0]), self._pin
        u, _ = pin.feet(frame.points[:, 0])
        along = pin.curve.arc_length.to(u + pin.shift)
        places = np.repeat(along[:, None], len(self._walls), axis=1)
        whole = zip(seen, (walls.gap, places, walls.gap_rate, walls.slip), strict=True)
        return Seen(*(np.insert(part, [first], wall, axis=1) for part, wall in whole))

    def _rows(self, frame: Frame, which: IndexArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        straight = self._straight[which]
        of_walls = straight < 0
        if not of_walls.any():
            return super()._rows(frame, straight)
        shape = (len(frame.q), len(which))
        gap = np.empty(shape)
        rows = np.empty((*shape, frame.q.shape[1]))
        slides = np.empty_like(rows)
        others = ~of_walls
        if others.any():
            parts = super()._rows(frame, straight[others])
            gap[:, others], rows[:, others], slides[:, others] = parts
        walls = self._look_at_walls(frame, which[of_walls])
        gap[:, of_walls] = walls.gap
        rows[:, of_walls] = walls.row
        slides[:, of_walls] = walls.slide
        return gap, rows, slides

    def bend(self, frame: Frame, which: IndexArray) -> FloatArray:
        """Second derivatives (m, k) of gaps if no coordinate accelerates."""
        straight = self._straight[which]
        of_walls = straight < 0
        bends = np.empty((len(frame.q), len(which)))
        if not of_walls.all():
            bends[:, ~of_walls] = super().bend(frame, straight[~of_walls])
        if of_walls.any():
            bends[:, of_walls] = self._look_at_walls(frame, which[of_walls]).bend
        return bends

    def _look_at_walls(self, frame: Frame, which: IndexArray) -> WallsSeen:
        """Gaps of some walls (k,) and their derivatives."""
        groove, point = self._pin.groove, frame.points[:, 0]
        _, (place, first, second) = self._pin.feet(point)
        speed = np.abs(first)
        back = (first / speed).conj()
        off = (back * (point - place)).imag
        curvature = (first.conj() * second).imag / speed**3
        by = back[:, None] * frame.by[:, 0]
        passing = (back * frame.going[:, 0]).real
        near = 1 - curvature * off
        sides = np.array(groove.sides)[which - self._walls[0]]
        gap = groove.clearance - sides * off[:, None]
        # Friction acts where the radii divide the distance of the pin from the curve's centre.
        touching = 1 - curvature[:, None] * sides * groove.clearance
        pressed = np.where(gap < 0, near[:, None], touching)
        farthest = np.maximum(touching, pressed)
        arm = -sides * groove.radius * pressed / farthest
        slides = (touching / farthest)[:, :, None] * by.real[:, None, :]
        slides[:, :, self._turns] += arm
        rows = -sides[:, None] * by.imag[:, None, :]
        bent = (back * frame.bends[:, 0]).imag
        bent -= curvature * passing**2 / near
        speeds = frame.v[:, :, None]
        rate = (rows @ speeds)[:, :, 0]
        slip = (slides @ speeds)[:, :, 0]
        active = np.isin(which - self._walls[0], self._pin.groove.walls(self._pin.lap))
        gap = np.where(active, gap, AWAY)
        rate = np.where(active, rate, 0.0)
        return WallsSeen(gap, rate, slip, rows, slides, -sides * bent[:, None])


def _from(point: Anchor, pivot: Pivot) -> complex:
    """A part's point relative to its pivot."""
    return complex(point.x, point.y) - complex(*pivot.pin)


def _direction(contact: FaceContact) -> complex:
    begin, end = (complex(anchor.x, anchor.y) for anchor in (contact.start, contact.end))
    return (end - begin) / abs(end - begin)
