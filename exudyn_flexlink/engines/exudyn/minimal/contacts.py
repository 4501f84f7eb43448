"""Contacts of a tree: where each is, and forces of those that give way.

Sleeves' walls on a tree's coordinates: all pairs of link and guide, their forces and events.

A pair presses while its gap is negative and its point between the ends of its face. Which do is
given, and changes by events only (see `pair_events`); until then their law is continued, so that a
step sees smooth forces. Forces are worked out for the few pairs that press, at all stages of a step
together; how they give way goes into the matrices of the iteration.

With C a point, O the origin of the link that carries a face, w its angular velocity, and e the
face's direction (complex numbers, global axes), the point is in the face's axes at

    z = e* (C - O) - z_0,      z' = e* (C' - O') - i w (z + z_0),

along the face by Re z, to its left by Im z; z_0 is where the face starts. What moves the point
against the face are the links that carry the one but not the other: each as if it carried the
point, counted negative if it carries the face.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from math import inf, tanh
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import BoolArray, ComplexArray, FloatArray, IndexArray
from exudyn_flexlink.engines.exudyn.faces import Touch, Vector
from exudyn_flexlink.engines.exudyn.minimal.coordinates import TreeState
from exudyn_flexlink.engines.exudyn.minimal.kinematics import LinkKinematics, Moving, Places
from exudyn_flexlink.engines.exudyn.minimal.shapes import Look, OnCurve, add_force, shape_of
from exudyn_flexlink.engines.pair_events import Seen, calm, changed, first_of, late_by
from exudyn_flexlink.engines.touching import Laws, press_by, rubbing
from exudyn_flexlink.integrate.radau import Step
from exudyn_flexlink.laws import Impulse, Penalty, RestitutionPenalty, SpringDamper, SpringTable
from exudyn_flexlink.mechanism import Channel, Contact, FaceContact, deepest_allowed, pairs
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

    def look(self, moving: Moving) -> Seen:
        """Look at all pairs at coordinates and speeds (..., links)."""
        at, rates = moving.places, moving.rates
        links, bases = self._links, self._bases
        arms, back, moved = self._between(at)
        between = rates.origin.take(links, axis=-1) - rates.origin.take(bases, axis=-1)
        between += rates.spin.take(links, axis=-1) * arms
        rate = back * between - rates.spin.take(bases, axis=-1) * moved
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


MOBILE = 1e-10  # of the largest mobility: gaps that move less only drives move


class WallPush(NamedTuple):
    """Pairs that press at one instant (a,): forces (N), powers that they take (W).

    `force` (links,) is that on the coordinates. Of several instants all have one axis more, the
    first.
    """

    force: FloatArray
    press: FloatArray
    power: FloatArray
    seen: Seen
    by: Gradients


class Walls:
    """All pairs of all channels, in the order of `mechanism.pairs`."""

    def __init__(
        self, layout: TreeLayout, kinematics: LinkKinematics, channels: Sequence[Channel]
    ) -> None:
        both = [(channel, pair) for channel in channels for pair in pairs(channel)]
        self._channels, self.contacts = [one for one, _ in both], [pair for _, pair in both]
        self.faces = WallFaces(layout, kinematics, self.contacts)
        self._deepest = np.array([deepest_allowed(channel) for channel in self._channels])
        self._laws = Laws([channel.law for channel in self._channels])
        self._rubbing = rubbing(self._channels)
        self._any_friction = bool(self._rubbing[0].any())
        self.touched = np.zeros(len(self.contacts), dtype=bool)  # at any time so far
        self.choose(self.touched, np.zeros(len(self.contacts)))

    def choose(self, touching: BoolArray, approach: FloatArray) -> None:
        """Let these of the pairs (pairs,) press, whose touches began so fast (pairs,), m/s."""
        self.touching, self._approach = touching, approach
        self.touched = self.touched | touching
        self.which = np.flatnonzero(self.touching)
        self._acting = self.faces.some(self.which)
        self._rub_of_acting = self._rubbing[:, self.which]

    def broken(self, seen: Seen) -> Channel | None:
        """Channel whose wall the link has broken through, of pairs (pairs,) seen now."""
        through = np.flatnonzero(self.touching & (seen.gap < -self._deepest))
        return self._channels[through[0]] if len(through) else None

    def push(self, x: FloatArray, v: FloatArray) -> WallPush | None:
        """What those that press do at instants, of coordinates and speeds (n, links), if any do."""
        if not len(self.which):
            return None
        seen, by = self._acting.look_and_gradients(x, v)
        gap, _, gap_rate, slide = seen
        coefficient, slip = self._rub_of_acting
        press = self._laws.pressing(self.which, gap, gap_rate, self._approach).force
        force = (press[:, None, :] @ by.gap)[:, 0]
        power = -press * gap_rate
        if self._any_friction:
            rub = -coefficient * press * np.tanh(slide / slip)
            force += (rub[:, None, :] @ by.place)[:, 0]
            power -= rub * slide
        return WallPush(force, press, power, seen, by)

    def slopes(self, at: WallPush, reach: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Stiffness and damping (n, n) of pairs that press so; directions count as fixed.

        `reach` (links, n) are the derivatives of the coordinates by the independent ones.
        """
        coefficient, slip = self._rub_of_acting
        gap, _, gap_rate, slide = at.seen
        _, spring, damper = self._laws.pressing(self.which, gap, gap_rate, self._approach)
        normal = at.by.gap @ reach
        if not self._any_friction:
            return (normal.T * spring) @ normal, (normal.T * damper) @ normal
        along, rubbed = at.by.place @ reach, np.tanh(slide / slip)
        secant = spring / self._laws.exponents[self.which]
        drag = coefficient * np.maximum(-gap, 0.0) * secant * (1 - rubbed * rubbed) / slip
        pushed = (normal - (coefficient * rubbed)[:, None] * along).T
        damping = (pushed * damper) @ normal + (along.T * drag) @ along
        return (pushed * spring) @ normal, damping

    def catching(self, state: TreeState, mass: FloatArray, swing: float) -> FloatArray:
        """Stiffness (n, n) of springs across the gaps of the pairs that have touched so far.

        Each of them alone would let its gap swing with the angular frequency 1/`swing`, 1/s. `mass`
        (n, n) is that of the independent coordinates.
        """
        faces = self.faces.some(np.flatnonzero(self.touched))
        rows = faces.look_and_gradients(state.x, state.v)[1].gap @ state.transform.matrix
        mobility = np.sum(rows * np.linalg.solve(mass, rows.T).T, axis=1)
        free = mobility > MOBILE * mobility.max(initial=0.0)
        rows, mobility = rows[free], mobility[free]
        return np.asarray((rows.T / (mobility * swing**2)) @ rows)


class WallWatch:
    """Looks at steps; `seen` are all pairs at the end of the last one accepted."""

    def __init__(self, walls: Walls, kinematics: LinkKinematics, begin: Moving) -> None:
        self.walls, self._kinematics = walls, kinematics
        self._lengths, self._held = self.walls.faces.length, self.walls.faces.held
        self._any_held = bool(self._held.any())
        self.seen = self.walls.faces.look(begin)
        self._ahead: tuple[TreeState, Seen] | None = None  # at the end of the last step looked at

    def _with_held_pairs_closed(self, seen: Seen) -> Seen:
        return seen.closed(self._held) if self._any_held else seen

    def accept(self, end: TreeState) -> None:
        """Take the coordinates at the end of a step."""
        if self.walls.contacts:
            self.seen = self._at_end(end)

    def _at_end(self, end: TreeState) -> Seen:
        """All pairs at the end of a step, which is asked for again as it is accepted."""
        if self._ahead is None or self._ahead[0] is not end:
            self._ahead = end, self.walls.faces.look(self._kinematics.moving(end.x, end.v))
        return self._ahead[1]

    def touch(self, k: int) -> Touch:
        """Where pair k is."""
        return Touch(*(float(column[k]) for column in self.seen))

    def changed(self, time: float, there: int | None = None) -> IndexArray:
        """Pairs that now (s), at an event of pair `there`, begin or cease to press."""
        seen = self._with_held_pairs_closed(self.seen)
        return np.flatnonzero(changed(seen, self._lengths, self.walls.touching, time, there))

    def first(self, step: Step, nodes: Moving, end: TreeState) -> tuple[float, int] | None:
        """Instant (s) and pair of the first event within a step; None if there is none.

        The links move so at the step's `nodes`, the last of which is its `end`.
        """
        if not self.walls.contacts:
            return None
        seen = self.walls.faces.look(nodes)
        self._ahead = end, seen.pick(-1)
        path = self._with_held_pairs_closed(seen)
        pressing = self.walls.touching
        restless = np.flatnonzero(~calm(path, self._lengths, pressing, step.h))
        if not len(restless):
            return None
        at_once = self.changed(step.t)
        if len(at_once):
            return step.t, int(at_once[0])
        found = first_of(restless, path, self._lengths, pressing, step.h)
        return None if found is None else (step.t + found[0] * step.h, found[1])

    def late(self, k: int, end: TreeState, time: float) -> float:
        """How long (s) before a step's end at this time pair k's event was; negative: after."""
        seen = self._with_held_pairs_closed(self._at_end(end))
        return late_by(seen, self._lengths, k, time)


NEAR_END = 1e-4  # of the face: there the point is about to leave it


class TableFollower:
    """Follows the depth (m) of a contact whose force is a table, from row to row."""

    seam = 1e-12  # m: so far beyond a piece is on it

    def __init__(self, depth: Callable[[FloatArray], float], name: str, table: SpringTable) -> None:
        self._depth, self.name, self._table = depth, name, table
        self.number: int | None = None  # of the piece, while the contact presses

    def follow(self, x: FloatArray | None) -> None:
        """Follow the piece of the present depth from here on, if none is; None: nothing presses."""
        if x is None or self.number is None:
            self.number = None if x is None else self._table.number(self._depth(x))

    def law(self, depth: float) -> SpringDamper:
        """Law of the piece that is followed; while nothing presses, of that of a depth (m)."""
        own = self._table.number(depth) if self.number is None else self.number
        return self._table.piece(own)

    def left(self, x: FloatArray, _: FloatArray) -> tuple[float, float]:
        """How far (m) the depth is from the end and the start of the piece."""
        assert self.number is not None  # only what presses comes to a piece's end
        depth, depths = self._depth(x), self._table.depths
        behind = depth - depths[self.number] if self.number else inf
        return depths[self.number + 1] - depth, behind

    def next_piece(self, way: int, _: float) -> bool:
        """Go on along the next piece (way 1), or the one before (-1); False if there is none."""
        assert self.number is not None  # only what presses comes to a piece's end
        self.number += way
        return self.number < len(self._table.depths) - 1


class MinimalContact:
    """A contact of any shape; both parts may be anywhere in the tree, or on the ground.

    Where it `lets_go`, its force ends before its gap opens.
    """

    lets_go = False

    def __init__(self, layout: TreeLayout, contact: Contact) -> None:
        self.shape = shape_of(layout, contact)
        self.length = self.shape.length
        self._count = len(layout.links)
        # What is followed along pieces while it presses.
        self.followed: list[OnCurve | TableFollower] = []
        if isinstance(self.shape, OnCurve):
            self.followed.append(self.shape)

    def touch(self, x: FloatArray, v: FloatArray) -> Touch:
        """Gap, place and rates at coordinates and speeds of the tree."""
        return self._look(x, v).touch

    def _look(self, x: FloatArray, v: FloatArray) -> Look:
        return self.shape.look(x.tolist(), v.tolist())

    def follow(self, x: FloatArray, *, presses: bool) -> None:
        """Take up a state in which the contact goes on, begins or ends."""
        for own in self.followed:
            own.follow(x if presses else None)

    def pressed_by(self, touch: Touch) -> float:
        """How far (m) a contact that presses is from letting go: its depth."""
        return -touch.gap

    def left_since(self, touch: Touch) -> float:
        """Time (s) since a point that presses slid off the end of its face; negative: until then.

        0 if it is not about to.
        """
        if touch.slip == 0 or touch.inside == inf:
            return 0.0
        beyond = touch.place - self.length if touch.slip > 0 else touch.place
        return beyond / touch.slip if abs(beyond) <= NEAR_END * self.length else 0.0

    def _normal_row(self, look: Look) -> FloatArray:
        return self._row(look, look.normal, look.at, look.moment)

    def _slip_row(self, look: Look) -> FloatArray:
        part, arm = look.grip
        return self._row(look, part * look.along, look.at, arm)

    def _row(self, look: Look, way: complex, second: complex, arm: float = 0.0) -> FloatArray:
        """Derivatives (links,) of how far both move apart, or turn by an arm.

        The first part moves at its point, the other at the place `second`.
        """
        row = np.zeros(self._count)
        add_force(row, look.first.moves, look.at, way, arm)
        add_force(row, look.second.moves, second, -way, -arm)
        return row


class RigidContact(MinimalContact):
    """A contact by impulse: speeds jump as it closes, and pushing leaves no gap."""

    def __init__(self, layout: TreeLayout, contact: Contact, law: Impulse) -> None:
        super().__init__(layout, contact)
        self.name, self.restitution, self.tangential = contact.name, law.restitution, law.tangential
        self.friction = contact.friction

    def moving_gap(
        self, x: FloatArray, v: FloatArray
    ) -> tuple[Touch, FloatArray, float, FloatArray | float]:
        """Where it is, and the gradient (links,) of the gap and its second derivative (m/s^2).

        The latter is that where no coordinate of the tree accelerates. The last is the gradient
        (links,) of the way slid, 0 where nothing rubs.
        """
        look = self._look(x, v)
        slides = 0.0 if self.friction is None else self._slip_row(look)
        return look.touch, self._normal_row(look), self.shape.steady_bend(look), slides


class PenaltyContact(MinimalContact):
    """A contact with a penalty force, and friction if it has any."""

    def __init__(self, layout: TreeLayout, contact: Contact, law: Penalty) -> None:
        super().__init__(layout, contact)
        self.law, self.friction = law, contact.friction
        self.lets_go = law.lets_go
        self._softness = law.half_period(1.0) ** 2 if self.lets_go else 0.0  # m/N, but for pi^2
        self._table: TableFollower | None = None
        if isinstance(law, SpringTable):
            self._table = TableFollower(self.depth, contact.name, law)
            self.followed.append(self._table)

    def depth(self, x: FloatArray) -> float:
        """Penetration (m) at coordinates of the tree; negative while apart."""
        return -self.touch(x, np.zeros(len(x))).gap

    def acting(self, touch: Touch) -> Penalty:
        """The law, or that of the piece of a table that acts."""
        return self.law if self._table is None else self._table.law(-touch.gap)

    def gradient_and_law(self, x: FloatArray, v: FloatArray) -> tuple[FloatArray, Penalty]:
        """Gradient of the gap (links,), and the law that acts."""
        look = self._look(x, v)
        return self._normal_row(look), self.acting(look.touch)

    def force(self, touch: Touch, approach: float) -> float:
        """Pressing force, N, in a touch that began so fast (m/s); none while apart.

        One that lets go is followed smoothly beyond.
        """
        law = self.acting(touch)
        if isinstance(law, SpringDamper):
            return law.preload - law.stiffness * touch.gap - law.damping * touch.gap_rate
        if touch.gap >= 0:
            return 0.0
        if not isinstance(law, RestitutionPenalty):
            return float(law.force(-touch.gap, -touch.gap_rate, approach))
        rising = tanh(-touch.gap_rate / law.transition_speed)
        return -touch.gap * (law.elastic + law.lossy * rising)

    def pressed_by(self, touch: Touch) -> float:
        """Depth (m), or what of it the force still takes to let go if that is less.

        No force that lets go depends on how fast its touch began.
        """
        if not self.lets_go:
            return super().pressed_by(touch)
        return min(-touch.gap, self.force(touch, 0.0) * self._softness)

    def push(
        self, x: FloatArray, v: FloatArray, onto: FloatArray, approach: float
    ) -> tuple[Vector, Vector]:
        """Add the generalised forces in a touch that began so fast (m/s).

        Return the pressing force (N) and the power it takes (W), and the gap (m) and its rate.
        """
        look = self._look(x, v)
        touch = look.touch
        # As a contact ends a trial state may be just off the face: no force pulls.
        press = self.force(touch, approach)
        rub = self._rub(press, touch)
        part, arm = look.grip
        force = press * look.normal + part * rub * look.along
        turned = press * look.moment + arm * rub
        add_force(onto, look.first.moves, look.at, force, turned)
        add_force(onto, look.second.moves, look.at, -force, -turned)
        power = -press * touch.gap_rate - rub * touch.slip
        return (press, power), (touch.gap, touch.gap_rate)

    def _rub(self, press: float, touch: Touch) -> float:
        """Friction (N) along the slip."""
        return 0.0 if self.friction is None else float(self.friction.force(press, touch.slip))

    def slopes(
        self, x: FloatArray, v: FloatArray, approach: float
    ) -> tuple[FloatArray, FloatArray] | None:
        """Stiffness and damping (links, links) beside those along the gap; None without any.

        They come from friction, and from a normal that turns as what is round moves past.
        """
        look = self._look(x, v)
        if look.bend == 0 and self.friction is None:
            return None
        touch = look.touch
        press_of = press_by([self.acting(touch)], np.array([approach]))
        pressing = press_of(np.array([[touch.gap, touch.gap_rate]]))
        press, spring, damper = (float(part[0]) for part in pressing)
        past = self._row(look, look.along, look.centre)
        stiffness = -press * look.bend * np.outer(past, past)
        damping = np.zeros_like(stiffness)
        if self.friction is None:
            return stiffness, damping
        slid = self._slip_row(look)
        normal = self._normal_row(look)
        rubbed = self.friction.coefficient * tanh(touch.slip / self.friction.slip_speed)
        drag = self.friction.coefficient**2 - rubbed**2
        drag *= press / (self.friction.coefficient * self.friction.slip_speed)
        # The friction turns with the normal, away from it.
        turned = press * look.bend * np.outer(normal, past)
        stiffness -= rubbed * (spring * np.outer(slid, normal) + turned)
        damping += drag * np.outer(slid, slid) - rubbed * damper * np.outer(slid, normal)
        return stiffness, damping


def contact_of(layout: TreeLayout, contact: Contact) -> PenaltyContact | RigidContact:
    """Return a contact as its law asks."""
    law = contact.law
    if isinstance(law, Impulse):
        return RigidContact(layout, contact, law)
    return PenaltyContact(layout, contact, law)
