"""Sleeves' walls on a tree's coordinates: all pairs of link and guide, their forces and events.

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

from collections.abc import Sequence
from copy import copy
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import BoolArray, ComplexArray, FloatArray, IndexArray
from exudyn_flexlink.engines.exudyn.faces import Touch
from exudyn_flexlink.engines.exudyn.minimal.coordinates import TreeState
from exudyn_flexlink.engines.exudyn.minimal.kinematics import LinkKinematics, Moving, Places
from exudyn_flexlink.engines.pair_events import Seen, calm, changed, first_of, late_by
from exudyn_flexlink.engines.pressing import Laws, rubbing
from exudyn_flexlink.integrate.radau import Step
from exudyn_flexlink.mechanism import Channel, FaceContact, deepest_allowed, pairs
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
