"""The forces of sleeves' walls on a tree's coordinates: all pairs of link and guide.

A pair presses while its gap is negative and its point between the ends of its face. Which do is
given, and changes by events only (see `wall_events`); until then their law is continued, so that a
step sees smooth forces. Forces are worked out for the few pairs that press, at all stages of a step
together; how they give way goes into the matrices of the iteration.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import BoolArray, FloatArray, IndexArray
from exudyn_flexlink.engines.exudyn.minimal.coordinates import TreeState
from exudyn_flexlink.engines.exudyn.minimal.kinematics import LinkKinematics
from exudyn_flexlink.engines.exudyn.minimal.wall_faces import WallFaces
from exudyn_flexlink.engines.pair_events import Seen
from exudyn_flexlink.mechanism import Channel, deepest_allowed, pairs
from exudyn_flexlink.mechanism.tree import TreeLayout

MOBILE = 1e-10  # of the largest mobility: gaps that move less only drives move


class WallPush(NamedTuple):
    """Pairs that press at one instant (a,): numbers, forces (N), powers that they take (W).

    `gap`, `gap_rate` and `slip` are their gaps, the rates of those and of places; `normal` and
    `along` (a, links) are the gradients of gaps and of places; `force` (links,) is that on the
    coordinates. Of several instants all but the numbers have one axis more, the first.
    """

    which: IndexArray
    force: FloatArray
    press: FloatArray
    power: FloatArray
    gap: FloatArray
    gap_rate: FloatArray
    slip: FloatArray
    normal: FloatArray
    along: FloatArray

    def pick(self, which: int | slice | IndexArray | None) -> WallPush:
        """Return one of several instants, or some of them: see `coordinates.TreeState`."""
        return WallPush(self.which, *(own[which] for own in self[1:]))


class Walls:
    """All pairs of all channels, in the order of `mechanism.pairs`."""

    def __init__(
        self, layout: TreeLayout, kinematics: LinkKinematics, channels: Sequence[Channel]
    ) -> None:
        both = [(channel, pair) for channel in channels for pair in pairs(channel)]
        self._channels, self.contacts = [one for one, _ in both], [pair for _, pair in both]
        self.faces = WallFaces(layout, kinematics, self.contacts)
        self._deepest = np.array([deepest_allowed(channel) for channel in self._channels])
        self._laws = np.array([_numbers(channel) for channel in self._channels]).reshape(-1, 5).T
        self._any_friction = bool(self._laws[3].any())
        self.touched = np.zeros(len(self.contacts), dtype=bool)  # at any time so far
        self.choose(self.touched)

    def choose(self, touching: BoolArray) -> None:
        """Let these of the pairs (pairs,) press."""
        self.touching = touching
        self.touched = self.touched | touching
        self.which = np.flatnonzero(self.touching)
        self._acting = self.faces.some(self.which)
        self._of_acting = self._laws[:, self.which]

    def broken(self, seen: Seen) -> Channel | None:
        """Channel whose wall the link has broken through, of pairs (pairs,) seen now."""
        through = np.flatnonzero(self.touching & (seen.gap < -self._deepest))
        return self._channels[through[0]] if len(through) else None

    def push(self, x: FloatArray, v: FloatArray) -> WallPush | None:
        """What those that press do at instants, of coordinates and speeds (n, links), if any do."""
        if not len(self.which):
            return None
        (gap, _, gap_rate, slide), (normal, along) = self._acting.look_and_gradients(x, v)
        elastic, lossy, transition, coefficient, slip = self._of_acting
        press = -gap * (elastic + lossy * np.tanh(-gap_rate / transition))
        force = (press[:, None, :] @ normal)[:, 0]
        power = -press * gap_rate
        if self._any_friction:
            rub = -coefficient * press * np.tanh(slide / slip)
            force += (rub[:, None, :] @ along)[:, 0]
            power -= rub * slide
        return WallPush(self.which, force, press, power, gap, gap_rate, slide, normal, along)

    def slopes(self, at: WallPush, reach: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Stiffness and damping (n, n) of pairs that press so; directions count as fixed.

        `reach` (links, n) are the derivatives of the coordinates by the independent ones.
        """
        elastic, lossy, transition, coefficient, slip = self._of_acting
        depth, rising = np.maximum(-at.gap, 0.0), np.tanh(-at.gap_rate / transition)
        spring = elastic + lossy * rising
        damper = depth * lossy * (1 - rising * rising) / transition
        normal = at.normal @ reach
        if not self._any_friction:
            return (normal.T * spring) @ normal, (normal.T * damper) @ normal
        along, rubbed = at.along @ reach, np.tanh(at.slip / slip)
        drag = coefficient * depth * spring * (1 - rubbed * rubbed) / slip
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


def _numbers(channel: Channel) -> tuple[float, float, float, float, float]:
    """Law of a channel: both parts of its stiffness, transition speed, friction, slip speed."""
    law, friction = channel.law, channel.friction
    return (
        law.elastic,
        law.lossy,
        law.transition_speed,
        0.0 if friction is None else friction.coefficient,
        1.0 if friction is None else friction.slip_speed,
    )
