"""Contacts of a tree, and pairs of link and guide: their gaps, and the forces of those that press.

Gaps follow from the poses of parts (see `mechanism.shapes`), for all contacts and instants
together. A gap changes by the links that carry one of its two parts but not the other. Each of
these links moves the place of the contact; the motion counts as negative if the link carries the
second part.

Which contacts press is known, and changes only by events (see `events`). Until then their laws are
continued, so that a step sees smooth forces. Slopes of the forces go into the matrices of the
iteration.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from math import inf
from typing import Any, NamedTuple

import numpy as np

from exudyn_flexlink.arrays import BoolArray, ComplexArray, FloatArray
from exudyn_flexlink.curves import Curve, next_lap
from exudyn_flexlink.engines.exudyn.minimal.kinematics import (
    LinkKinematics,
    Moving,
    Transform,
    poses,
)
from exudyn_flexlink.engines.touching import Laws, rubbing
from exudyn_flexlink.integrate.problem import Pressing
from exudyn_flexlink.laws import Impulse, PressingLaw, SpringDamper, SpringTable
from exudyn_flexlink.mechanism import (
    Channel,
    Contact,
    ContactShapes,
    CurveContact,
    FlatContact,
    Foot,
    Groove,
    Look,
    Mechanism,
    Poses,
    RopeContact,
    Seen,
    SumStop,
    deepest_allowed,
)
from exudyn_flexlink.mechanism.tree import TreeLayout
from exudyn_flexlink.result import Event
from exudyn_flexlink.rounding import NEGLIGIBLE, SOLVED

NEAR_END = 1e-4  # of the face: a point so near an end is about to leave it


class Touch(NamedTuple):
    """Where one contact is: see `mechanism.Seen`.

    `inside` (m) is the distance of the place from the nearer end of the face: negative beside the
    face, infinite if it has no ends.
    """

    gap: float
    place: float
    gap_rate: float
    slip: float
    inside: float


class CurveFollower:
    """Follows what presses on a curve along one smooth piece of it.

    The piece goes on beyond its ends until a step has ended there, so that the equations stay
    smooth. While nothing presses, the nearest place of the whole curve counts.
    """

    seam = 1e-9  # of the parameter: a place beyond a piece by less than this is still on the piece

    def __init__(self, contact: CurveContact | FlatContact) -> None:
        self._curve, self._closest = contact.curve, contact.search
        self._length = contact.curve.arc_length.whole
        self._held: tuple[int, float] | None = None  # piece and place at the end of the last step

    @property
    def is_one_piece(self) -> bool:
        """Whether the curve is one piece: nothing comes to another one."""
        return len(self._curve.pieces) == 1

    def foot(self, seen: complex) -> Foot:
        """Place of the curve for a point or direction `seen` in the curve's axes."""
        piece, u = self._place(seen)
        length = self._closest.length_to(piece, u)
        if self._curve.closed:
            length %= self._length
        return length, *self._at(piece, u)

    def foot_alone(self, seen: complex) -> Foot:
        """As `foot`, without the length of a closed curve, which takes the most time."""
        if not self._curve.closed:
            return self.foot(seen)
        return 0.0, *self._at(*self._place(seen))

    def _at(self, piece: int, u: float) -> tuple[complex, complex, complex]:
        x, y, dx, dy, ddx, ddy = self._closest.at[piece](u)
        return complex(x, y), complex(dx, dy), complex(ddx, ddy)

    def follow(self, seen: complex | None) -> None:
        """Follow a point or direction along its present piece from now on (None: none presses)."""
        self._held = None if seen is None else self._place(seen)

    def left(self, seen: complex) -> tuple[float, float]:
        """Distances of a place from the end and the start of its piece; inf if no piece follows."""
        number, u = self._place(seen)
        piece, last = self._curve.pieces[number], len(self._curve.pieces) - 1
        ahead = piece.end - u if self._curve.closed or number < last else inf
        return ahead, (u - piece.start if self._curve.closed or number > 0 else inf)

    def next_piece(self, way: int, _: float) -> bool:
        """Go on along the next piece (way 1), or the piece before (-1); returns True."""
        assert self._held is not None  # only contacts that press come to ends of pieces
        number = (self._held[0] + way) % len(self._curve.pieces)
        piece = self._curve.pieces[number]
        self._held = number, piece.start if way > 0 else piece.end
        return True

    def _place(self, seen: complex) -> tuple[int, float]:
        """Piece of the curve, and place on it."""
        if self._held is None:
            return self._closest.on_curve(seen.real, seen.imag)
        piece, near = self._held
        return piece, self._closest.on_piece(piece, seen.real, seen.imag, near)


class LapFollower:
    """Follows the pin of a slot with play along a closed curve, from lap to lap.

    Only the walls of the present lap hold the pin. The numbers of walls among all contacts begin at
    `first`.
    """

    seam = 1e-12  # of the parameter: a place beyond a lap by less than this is still in the lap

    def __init__(self, groove: Groove, first: int, events: list[Event]) -> None:
        self.groove, self._first, self._events, self.lap = groove, first, events, groove.lap
        self._searches = [wall.search for wall in groove.contacts[::2]]
        self._u = 0.0  # parameter at the end of the last step

    @property
    def walls(self) -> list[int]:
        """Numbers of the walls that hold the pin now."""
        return [self._first + k for k in self.groove.walls(self.lap)]

    def begin(self, seen: complex) -> None:
        """Take the place of the pin at time 0; a pin near the seam has just passed it."""
        curve = self._curve
        self._u = 0.5 * (curve.start + curve.end)
        u = self._place(seen)
        if curve.end - u <= NEGLIGIBLE * curve.period:
            u -= curve.period
        self._u = u

    def follow(self, seen: complex) -> None:
        """Take the place of the pin at the end of a step."""
        self._u = self._place(seen)

    def left(self, seen: complex) -> tuple[float, float]:
        """Distances of a pin, `seen` in the curve's axes, from the end and the start of a lap."""
        u = self._place(seen)
        return self._curve.end - u, u - self._curve.start

    def next_piece(self, way: int, time: float) -> bool:
        """Go on into the next lap (way 1), or the one before (-1)."""
        self.lap = next_lap(self.lap, way)
        self._u = self._curve.start if way > 0 else self._curve.end
        self._events.append(Event(time, "lap", self.groove.name, {"lap": float(self.lap)}))
        return True

    @property
    def _number(self) -> int:
        return self.groove.walls(self.lap).start // 2

    @property
    def _curve(self) -> Curve:
        return self.groove.curves[self._number]

    def _place(self, seen: complex) -> float:
        """Parameter of the lap's curve; it goes on counting beyond the seam."""
        curve = self._curve
        piece, u = self._searches[self._number].on_curve(seen.real, seen.imag)
        u += float(curve.breaks[piece]) - curve.pieces[piece].start
        return u + curve.period * round((self._u - u) / curve.period)


class TableFollower:
    """Follows the depth (m) of a contact whose force is a table, from row to row."""

    seam = 1e-12  # m: a depth beyond a piece by less than this is still on the piece

    def __init__(self, name: str, table: SpringTable) -> None:
        self.name, self._table = name, table
        self.number: int | None = None  # of the piece, while the contact presses

    @property
    def follows(self) -> bool:
        """Whether it follows a piece."""
        return self.number is not None

    def follow(self, depth: float | None) -> None:
        """Follow the piece of a depth (m) from here on (None: none presses)."""
        self.number = None if depth is None else self._table.number(depth)

    def law(self, depth: float) -> SpringDamper:
        """Law of the piece that is followed; while nothing presses, of the piece at a depth (m)."""
        number = self._table.number(depth) if self.number is None else self.number
        return self._table.piece(number)

    def left(self, depth: float) -> tuple[float, float]:
        """Distances (m) of a depth from the end and the start of the piece."""
        assert self.number is not None  # only contacts that press come to ends of pieces
        depths = self._table.depths
        behind = depth - depths[self.number] if self.number else inf
        return depths[self.number + 1] - depth, behind

    def next_piece(self, way: int, _: float) -> bool:
        """Go on along the next piece (way 1), or the one before (-1); False if there is none."""
        assert self.number is not None  # only contacts that press come to ends of pieces
        self.number += way
        return self.number < len(self._table.depths) - 1


class Rows(NamedTuple):
    """Derivatives of gaps, and of sliding distances, by the coordinates, (..., c, links) each."""

    across: FloatArray
    along: FloatArray


class ContactGroup:
    """Some of the contacts of a tree (c,), by their numbers."""

    def __init__(self, tree: TreeContacts, which: Sequence[int], *, places: bool = False) -> None:
        """`places` along closed curves, which have no ends, are computed only if asked."""
        self.contacts = [tree.all[k] for k in which]
        curves = {i: tree.curves[k] for i, k in enumerate(which) if k in tree.curves}
        feet = {
            i: follower.foot if places else follower.foot_alone for i, follower in curves.items()
        }
        self.shapes = ContactShapes(self.contacts, tree.layout.frame, feet)
        self._kinematics = tree.kinematics
        first, second = tree.kinematics.moved_by[self.shapes.links].astype(float)
        self._moved, self._second = first - second, second
        self._turns = self._moved * tree.kinematics.hinge
        stops = [tree.stop_row(contact) for contact in self.contacts]
        self._stopped = np.array(stops).reshape(len(stops), len(tree.layout.links))
        self._friction, self._slip_speed = rubbing(self.contacts)
        self._rubs = np.array(
            [contact.friction is not None for contact in self.contacts], dtype=bool
        )
        self._any_rubs = bool(self._rubs.any())
        self._ropes = [(i, tree.pieces[k]) for i, k in enumerate(which) if k in tree.pieces]

    def seen(self, poses: Poses) -> Seen:
        """Gaps and places of the contacts, and their rates."""
        return self.shapes.seen(poses)

    def path(self, poses: Poses) -> tuple[ComplexArray, ComplexArray]:
        """Motion of first parts relative to second ones: see `mechanism.shapes`."""
        return self.shapes.path(poses)

    def look(self, moving: Moving) -> tuple[Look, Rows]:
        """Look at the contacts, with the gradients by which forces act on coordinates."""
        look = self.shapes.look(poses(moving))
        carried = self._kinematics.carries(moving.places, look.point) * self._moved
        across = (look.normal.conj()[..., None] * carried).real + self._stopped
        for i, pieces in self._ropes:
            across[..., i, :] = self._pulls(moving, pieces).sum(axis=-2)
        if not self._any_rubs:
            return look, Rows(across, np.zeros(across.shape))
        slid = look.grip[..., None] * (look.along.conj()[..., None] * carried).real
        slid = (slid + look.arm[..., None] * self._turns) * self._rubs[:, None]
        return look, Rows(across, slid)

    def _pulls(self, moving: Moving, pieces: ContactShapes) -> FloatArray:
        """Derivatives (..., pieces, links) of the shortening of a rope's pieces."""
        look = pieces.look(poses(moving))
        first, second = self._kinematics.moved_by[pieces.links].astype(float)
        carried = self._kinematics.carries(moving.places, look.point) * (first - second)
        return np.asarray((look.normal.conj()[..., None] * carried).real)

    def gap_bends(self, moving: Moving, look: Look) -> FloatArray:
        """Second derivatives (..., c), m/s^2, of gaps if no coordinate accelerates."""
        x, v, places, rates, _ = moving
        bends = self._kinematics.bends(places, rates, x, v, np.zeros_like(x))
        return self.shapes.gap_bends(look, poses(moving), bends.origin)

    def view(self, poses: Poses) -> ComplexArray:
        """Points or directions (..., c) in the axes of curves; only for contacts with curves."""
        return self.shapes.view(poses)


class ContactPush(NamedTuple):
    """Contacts that press at one instant (a,): forces (N), and powers (W) that they take.

    `force` (links,) acts on the coordinates; `supply` is the power (W) of winches, which change the
    lengths of ropes. For several instants all arrays have one more, first axis.
    """

    force: FloatArray
    press: FloatArray
    power: FloatArray
    supply: FloatArray
    look: Look
    rows: Rows


class ActingContacts(ContactGroup):
    """Contacts that press, by laws with a force.

    A contact of the scene has no force where its gap is open: as it ends, a trial state may be just
    off the face. Forces of walls go on smoothly there. `slopes` has the stiffness along the gaps of
    walls only; that of the scene's contacts is handled apart, see `MinimalModel.contacts_at`.
    """

    def __init__(
        self,
        tree: TreeContacts,
        which: Sequence[int],
        laws: Sequence[PressingLaw],
    ) -> None:
        super().__init__(tree, which)
        self.which = np.array(which, dtype=int)
        self.scene_count = int(np.count_nonzero(self.which < tree.count))  # these come first
        self.laws, self._by_laws, self._numbers = laws, Laws(laws), np.arange(len(which))
        lets_go = np.array([not isinstance(law, Impulse) and law.lets_go for law in laws])
        walls = self.which >= tree.count
        self._always = lets_go | walls
        self._any_ends = not self._always.all()
        self._walls = walls[:, None].astype(float)
        self._stiff = bool(walls.any()) or self._any_rubs
        ropes = enumerate(self.contacts)
        self._lengths = [(i, c.free_length) for i, c in ropes if isinstance(c, RopeContact)]

    def pressing(self, gap: FloatArray, rate: FloatArray, approach: FloatArray) -> Pressing:
        """Forces and slopes for gaps and rates (..., a); touches began with speeds `approach`."""
        pushes = self._by_laws.pressing(self._numbers, gap, rate, approach)
        if not self._any_ends:
            return pushes
        acts = (gap < 0) | self._always
        return pushes._replace(force=pushes.force * acts, stiffness=pushes.stiffness * acts)

    def push(self, moving: Moving, approach: FloatArray) -> ContactPush:
        """Forces and powers of the contacts at instants."""
        look, rows = self.look(moving)
        press = self.pressing(look.gap, look.gap_rate, approach).force
        force = (press[..., None, :] @ rows.across)[..., 0, :]
        power = -press * look.gap_rate
        if self._any_rubs:
            rub = -self._friction * press * np.tanh(look.slip / self._slip_speed)
            force = force + (rub[..., None, :] @ rows.along)[..., 0, :]
            power = power - rub * look.slip
        supply = np.zeros(press.shape[:-1])
        for i, length in self._lengths:
            supply = supply - press[..., i] * length.rates(np.atleast_1d(moving.t))
        return ContactPush(force, press, power, supply, look, rows)

    def slopes(
        self, push: ContactPush, moving: Moving, approach: FloatArray
    ) -> tuple[FloatArray, FloatArray] | None:
        """Stiffness and damping (links, links) at one instant; None without any.

        They come from walls, from friction, and from normals that turn as round parts move past
        each other, with their friction.
        """
        look, (across, along) = push.look, push.rows
        bends = bool(look.bend.any())
        if not self._stiff and not bends:
            return None
        _, spring, damper = self.pressing(look.gap, look.gap_rate, approach)
        rubbed = np.tanh(look.slip / self._slip_speed)
        slid = self._walls * across - (self._friction * rubbed)[:, None] * along
        drag = self._friction * np.maximum(push.press, 0.0) * (1 - rubbed**2) / self._slip_speed
        stiffness = (slid.T * spring) @ across
        damping = (slid.T * damper) @ across + (along.T * drag) @ along
        if bends:
            past = self._past(moving, look)
            turned = past + (self._friction * rubbed)[:, None] * across
            stiffness -= (turned.T * (push.press * look.bend)) @ past
        return stiffness, damping

    def _past(self, moving: Moving, look: Look) -> FloatArray:
        """Derivatives (a, links) of the motion of `point` past `centre`, across the normal."""
        carries = self._kinematics.carries
        first, second = (carries(moving.places, place) for place in (look.point, look.centre))
        moved = first * (self._moved + self._second) - second * self._second
        return np.asarray((look.along.conj()[:, None] * moved).real)


class TreeContacts:
    """All contacts of a tree: the scene's, its bearings, stops and ropes, then pairs of channels.

    If a contact `lets_go`, its force ends before its gap opens.
    """

    def __init__(
        self,
        layout: TreeLayout,
        kinematics: LinkKinematics,
        mechanism: Mechanism,
        events: list[Event],
    ) -> None:
        """New laps of slots with play are appended to `events`."""
        self.all = mechanism.contacts_and_pairs
        self.count = len(mechanism.touching)
        self.layout, self.kinematics = layout, kinematics
        self.curves: dict[int, CurveFollower] = {}
        self.tables: dict[int, TableFollower] = {}
        self.pieces: dict[int, ContactShapes] = {}  # of ropes over points
        self.group = lru_cache(lambda which: ContactGroup(self, which))
        self._acting = lru_cache(self._acting_by)
        for k, contact in enumerate(self.all):
            if isinstance(contact, CurveContact | FlatContact):
                self.curves[k] = CurveFollower(contact)
            if isinstance(contact, RopeContact):
                self.pieces[k] = ContactShapes(contact.pieces, layout.frame)
            if isinstance(contact.law, SpringTable):
                self.tables[k] = TableFollower(contact.name, contact.law)
        self.rigid = frozenset(
            k for k, contact in enumerate(self.all) if isinstance(contact.law, Impulse)
        )
        self.lets_go = np.array(
            [not isinstance(contact.law, Impulse) and contact.law.lets_go for contact in self.all],
            dtype=bool,
        )
        self.length = np.array([contact.length for contact in self.all])
        self._channels = [channel for channel in mechanism.channels for _ in channel.contacts]
        self._deepest = np.array([deepest_allowed(channel) for channel in self._channels])
        self.whole_group = ContactGroup(self, range(len(self.all)), places=True)
        self.scene_group = self.group(tuple(range(self.count)))
        self.laps: list[LapFollower] = []
        for first, groove in zip(mechanism.first_walls, mechanism.grooves, strict=True):
            if groove.slot.curve.closed:
                self.laps.append(LapFollower(groove, first, events))
        self.idle = mechanism.idle_walls  # walls of laps without the pin

    def stop_row(self, contact: Contact) -> FloatArray:
        """Gradient (links,) of the gap of a joint's stop; 0 of other contacts."""
        if not isinstance(contact, SumStop):
            return np.zeros(len(self.layout.links))
        return contact.way * self.layout.summed_row(contact.ties, contact.weights)

    # --- gaps and places ----------------------------------------------------------------------

    def poses(self, x: FloatArray, v: FloatArray, t: FloatArray | float = 0.0) -> Poses:
        """Poses of links at coordinates and speeds (..., links) of the tree and instants (...)."""
        return poses(self.kinematics.moving(x, v, t))

    def touch(self, k: int, x: FloatArray, v: FloatArray, t: FloatArray | float = 0.0) -> Touch:
        """Where contact k is at coordinates and speeds of the tree at an instant (s)."""
        return self.touch_of(k, self.group((k,)).seen(self.poses(x, v, t)).of(0))

    def touch_of(self, k: int, seen: Seen) -> Touch:
        """Where contact k is; `seen` has it alone."""
        gap, place, gap_rate, slip = map(float, seen)
        length = float(self.length[k])
        inside = inf if length == inf else min(place, length - place)
        return Touch(gap, place, gap_rate, slip, inside)

    def _view(self, k: int, x: FloatArray, _: FloatArray) -> ComplexArray:
        """Point or direction in the axes of contact k's curve, at coordinates (n, links)."""
        return self.group((k,)).view(self.poses(x, np.zeros_like(x)))[:, 0]

    def _depth(self, k: int, x: FloatArray, _: FloatArray) -> FloatArray:
        return -self.group((k,)).seen(self.poses(x, np.zeros_like(x))).gap[:, 0]

    def broken(self, gap: FloatArray, pressed: BoolArray) -> Channel | None:
        """Channel whose wall the link has broken through, from all gaps and which of them press."""
        pairs_of_channels = slice(self.count, None)
        through = pressed[pairs_of_channels] & (gap[pairs_of_channels] < -self._deepest)
        numbers = np.flatnonzero(through)
        return self._channels[numbers[0]] if len(numbers) else None

    def left_since(self, k: int, touch: Touch) -> float | None:
        """Time (s) since a pressed point slid off the end of its face; negative: until it does.

        None if the point is not near an end.
        """
        if touch.slip == 0 or touch.inside == inf:
            return None
        length = float(self.length[k])
        beyond = touch.place - length if touch.slip > 0 else touch.place
        return beyond / touch.slip if abs(beyond) <= NEAR_END * length else None

    def follow(self, k: int, x: FloatArray, *, presses: bool) -> None:
        """Follow contact k from the present state on, in which it goes on, begins or ends."""
        if k in self.curves:
            self.curves[k].follow(complex(self._view(k, x[None], x)[0]) if presses else None)
        if k in self.tables and presses != self.tables[k].follows:
            self.tables[k].follow(float(self._depth(k, x[None], x)[0]) if presses else None)

    def lap_views(self) -> list[tuple[LapFollower, Callable[..., ComplexArray]]]:
        """Pins followed from lap to lap, and functions that return them in the curves' axes."""
        return [(pin, partial(self._view, pin.walls[0])) for pin in self.laps]

    def followed(self, k: int) -> list[tuple[CurveFollower | TableFollower, Callable[..., Any]]]:
        """Followers of contact k while it presses, and functions that return what they follow."""
        followers: list[tuple[CurveFollower | TableFollower, Callable[..., Any]]] = []
        if k in self.curves and not self.curves[k].is_one_piece:
            followers.append((self.curves[k], partial(self._view, k)))
        if k in self.tables:
            followers.append((self.tables[k], partial(self._depth, k)))
        return followers

    # --- forces -------------------------------------------------------------------------------

    def pressed_by(self, k: int, touch: Touch) -> float:
        """How far (m) a contact that presses is from its end: its depth, or less.

        If its law lets go, the force as a length counts where that is less than the depth. No force
        that lets go depends on how fast its touch began.
        """
        if not self.lets_go[k]:
            return -touch.gap
        law, acts = self.all[k].law, self._law(k, -touch.gap)
        assert isinstance(law, SpringDamper | SpringTable)  # only those let go
        assert isinstance(acts, SpringDamper)  # a table's pieces are, too
        force = acts.preload - acts.stiffness * touch.gap - acts.damping * touch.gap_rate
        return min(-touch.gap, force * law.half_period(1.0) ** 2)

    def _law(self, k: int, depth: float) -> PressingLaw:
        return self.tables[k].law(depth) if k in self.tables else self.all[k].law

    def acting(self, pressing: Sequence[int]) -> ActingContacts | None:
        """Contacts with a force among those that are `pressing`; None if there are none."""
        if not pressing:
            return None
        which = tuple(k for k in pressing if k not in self.rigid)
        pieces = tuple(table.number for k, table in self.tables.items() if k in which)
        return self._acting(which, pieces) if which else None

    def _acting_by(self, which: tuple[int, ...], _: tuple[int | None, ...]) -> ActingContacts:
        """Make acting contacts; the second argument, pieces of tables, only tells them apart."""
        return ActingContacts(self, which, [self._law(k, 0.0) for k in which])

    def catching(
        self, touched: Sequence[int], moving: Moving, transform: Transform, mass: FloatArray,
        swing: float,
    ) -> FloatArray:  # fmt: skip
        """Stiffness (n, n) of springs across the gaps of the pairs that have touched so far.

        A single spring would let its gap swing with the angular frequency 1/`swing`, 1/s. `mass`
        (n, n) is the mass matrix of the independent coordinates.
        """
        rows = self.group(tuple(touched)).look(moving)[1].across @ transform.matrix
        mobility = np.sum(rows * np.linalg.solve(mass, rows.T).T, axis=1)
        # Gaps that move less only drives move.
        free = mobility > SOLVED * mobility.max(initial=0.0)
        rows, mobility = rows[free], mobility[free]
        return np.asarray((rows.T / (mobility * swing**2)) @ rows)
