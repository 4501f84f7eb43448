"""Contacts of a tree: where each is, and forces of those that give way."""

from __future__ import annotations

from collections.abc import Callable
from math import inf, tanh

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.faces import Touch, Vector
from exudyn_flexlink.engines.exudyn.minimal.carriers import add_force
from exudyn_flexlink.engines.exudyn.minimal.shapes import Look, OnCurve, shape_of
from exudyn_flexlink.engines.pressing import press_by
from exudyn_flexlink.laws import Impulse, Penalty, RestitutionPenalty, SpringDamper, SpringTable
from exudyn_flexlink.mechanism import Contact
from exudyn_flexlink.mechanism.tree import TreeLayout

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
