"""Reactions of contacts by impulse that last: pushing leaves no gap.

With g the gaps and G their gradients by the independent coordinates, which accelerate by z'',

    M z'' = f + G^T r,      G z'' + c = -2 BAUMGARTE g' - BAUMGARTE^2 g

for the reactions r (N); c is what gaps bend without z''. The right side lets die out what gaps
are off by (J. Baumgarte, Comput. Methods Appl. Mech. Eng. 1 (1972) 1).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.minimal.contacts import MinimalContact, RigidContact
from exudyn_flexlink.engines.exudyn.minimal.coordinates import TreeState
from exudyn_flexlink.engines.touching import Touches
from exudyn_flexlink.integrate.complementarity import least_inverse
from exudyn_flexlink.integrate.problem import Evaluation

# 1/s: rate at which errors of steps in a closed gap die out; reactions show it squared.
BAUMGARTE = 1e2


class Gaps(NamedTuple):
    """Gaps of some contacts at one instant, or at several: then with one axis more, the first.

    `rows` (c, links) are gradients by all coordinates, `free` (c, independent) by the independent
    ones; `bend` (c,), m/s^2, second derivatives where those do not accelerate. `touching` (c, 2)
    are gaps and rates.
    """

    rows: FloatArray
    free: FloatArray
    bend: FloatArray
    touching: FloatArray

    def pick(self, which: int) -> Gaps:
        """Return those of one of several instants."""
        return Gaps(*(column[which] for column in self))


def mobility(gaps: Gaps, mass: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Accelerations (..., independent, c) by 1 N in each contact, and those (..., c, c) of gaps."""
    arms = np.asarray(np.linalg.solve(mass, np.swapaxes(gaps.free, -1, -2)), dtype=np.float64)
    return arms, gaps.free @ arms


class Projector(NamedTuple):
    """``1 - G^T W G M^-1`` of forces past closed gaps, and ``G^T W G``, ``W = (G M^-1 G^T)^-1``."""

    free: FloatArray  # (independent, independent)
    closed: FloatArray

    def slopes(self, stiffness: FloatArray, damping: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Stiffness and damping matrix with the reactions in them."""
        of_gaps, of_rates = BAUMGARTE * BAUMGARTE * self.closed, 2 * BAUMGARTE * self.closed
        return self.free @ stiffness + of_gaps, self.free @ damping + of_rates


class RigidContacts:
    """Those of a model's contacts that are rigid, by their numbers."""

    def __init__(self, contacts: Sequence[MinimalContact], touches: Touches) -> None:
        self._touches = touches
        self.all = {k: c for k, c in enumerate(contacts) if isinstance(c, RigidContact)}

    def closed(self) -> list[int]:
        """Numbers of those that press."""
        return [k for k in self.all if self._touches.pressed[k]]

    def gaps(self, which: Sequence[int], state: TreeState) -> Gaps:
        """Gaps at instants (n,)."""
        shape = len(state.x), len(which)
        rows, touching = np.empty((*shape, state.x.shape[1])), np.empty((*shape, 2))
        bend = np.empty(shape)
        for i, (x, v) in enumerate(zip(state.x, state.v, strict=True)):
            for c, contact in enumerate(self.all[k] for k in which):
                touch, rows[i, c], bend[i, c] = contact.moving_gap(x, v)
                touching[i, c] = touch.gap, touch.gap_rate
        bend += (rows @ state.b[:, :, None])[:, :, 0]
        return Gaps(rows, rows @ state.transform.matrix, bend, touching)

    def with_reactions(self, at: Evaluation) -> Evaluation:
        """Return evaluations at instants (n,) with the reactions of those that last."""
        which, kept = self.closed(), at.kept
        gaps = self.gaps(which, kept.state)
        arms, moved = mobility(gaps, at.mass)
        gap, rate = gaps.touching[..., 0], gaps.touching[..., 1]
        wanted = -gaps.bend - 2 * BAUMGARTE * rate - BAUMGARTE * BAUMGARTE * gap
        wanted -= (np.swapaxes(arms, -1, -2) @ at.force[..., None])[..., 0]
        press = (least_inverse(moved) @ wanted[..., None])[..., 0]
        kept.pushes[:, which] = np.stack([press, -press * rate], axis=-1)
        force = kept.force + (press[:, None] @ gaps.rows)[:, 0]
        free = at.force + (press[:, None] @ gaps.free)[:, 0]
        return at._replace(force=free, kept=kept._replace(force=force))

    def projector(self, at: Evaluation) -> Projector | None:
        """What those that last let through at one state; None if none does."""
        which = self.closed()
        if not which:
            return None
        state: TreeState = at.kept.state
        gaps = self.gaps(which, state.pick(None)).pick(0)
        arms, moved = mobility(gaps, at.mass)
        back = gaps.free.T @ least_inverse(moved)
        return Projector(np.eye(len(at.mass)) - back @ arms.T, back @ gaps.free)
