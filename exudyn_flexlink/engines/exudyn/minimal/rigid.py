"""Contacts by impulse that last: what holds their gaps closed.

They have reactions, and friction in proportion to these. With g the gaps and G their gradients by
the independent coordinates, which accelerate by z'',

    M z'' = f + (G - mu tanh(s/s_0) T)^T r,      G z'' + c = -2 BAUMGARTE g' - BAUMGARTE^2 g

for the reactions r (N); c is the part of g'' that does not depend on z''. The right side lets
errors of gaps die out (J. Baumgarte, Comput. Methods Appl. Mech. Eng. 1 (1972) 1). Friction is that
of `laws.Friction`, regularised, with s the slip and T its gradient.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.minimal.contacts import TreeContacts
from exudyn_flexlink.engines.exudyn.minimal.coordinates import TreeState
from exudyn_flexlink.engines.touching import Touches
from exudyn_flexlink.integrate.complementarity import least_inverse
from exudyn_flexlink.integrate.problem import Evaluation
from exudyn_flexlink.laws import Friction, Impulse
from exudyn_flexlink.raising import Sendable


class JammedError(Sendable, ArithmeticError):
    """Friction presses a contact together by more than its force opens it: no solution exists."""

    advice = "a smaller 'friction', or a law with stiffness"

    def __init__(self, contact: str) -> None:
        """Take the name of the contact."""
        why = "its force would press the bodies together by more than it parts them"
        super().__init__(f"friction jams the contact '{contact}': {why}")


# 1/s: rate at which errors of steps in a closed gap die out. Its square times such an error is an
# error of reactions.
BAUMGARTE = 1e2


class Gaps(NamedTuple):
    """Gaps of some contacts at one instant; for several instants arrays have one more, first axis.

    `rows` (c, links) are gradients by all coordinates, `free` (c, independent) by the independent
    ones; `bend` (c,), m/s^2, are second derivatives if the independent coordinates do not
    accelerate. `touching` (c, 2) are gaps and rates; `slides` (c, links) are gradients of the
    sliding distances, 0 without friction, and `slip` (c,) their rates (m/s).
    """

    rows: FloatArray
    free: FloatArray
    bend: FloatArray
    touching: FloatArray
    slides: FloatArray
    slip: FloatArray

    @property
    def speeds(self) -> FloatArray:
        """Rates of the gaps, then of the sliding distances (2c,), m/s, at one instant."""
        return np.concatenate([self.touching[:, 1], self.slip])

    def pick(self, which: int) -> Gaps:
        """Return the gaps at one of several instants."""
        return Gaps._make(column[which] for column in self)


def mobility(gaps: Gaps, mass: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Accelerations (..., independent, c), and of gaps (..., c, c), by 1 N in each contact."""
    arms = np.asarray(np.linalg.solve(mass, np.swapaxes(gaps.free, -1, -2)), dtype=np.float64)
    return arms, gaps.free @ arms


class Projector(NamedTuple):
    """``1 - G^T W G M^-1`` of forces past closed gaps, and ``G^T W G``, ``W = (G M^-1 G^T)^-1``."""

    free: FloatArray  # (independent, independent)
    closed: FloatArray

    @classmethod
    def past(cls, mass: FloatArray, rows: FloatArray, pushed: FloatArray) -> Projector:
        """Projector past ``rows z'' = 0``, which forces `pushed` hold (both k, independent)."""
        arms = np.linalg.solve(mass, rows.T)
        back = pushed.T @ scaled_inverse((pushed @ arms).T, symmetric=pushed is rows)
        return cls(np.eye(len(mass)) - back @ arms.T, back @ rows)

    def slopes(self, stiffness: FloatArray, damping: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Stiffness and damping matrix with the reactions in them."""
        of_gaps, of_rates = BAUMGARTE * BAUMGARTE * self.closed, 2 * BAUMGARTE * self.closed
        return self.free @ stiffness + of_gaps, self.free @ damping + of_rates


class Holding(NamedTuple):
    """Closed gaps at instants (n,), and how contacts (c,) hold them against forces.

    A contact that presses by 1 N puts forces `pushed` (n, c, links) on all coordinates, and
    `pushed_free` on the independent ones. Reactions to forces f (n, independent) are
    ``-inverse moved f``.
    """

    gaps: Gaps
    pushed: FloatArray
    pushed_free: FloatArray
    inverse: FloatArray
    moved: FloatArray

    def reactions(self, forces: FloatArray) -> FloatArray:
        """Reactions (n, k, c), N, to some forces (n, k, independent)."""
        return np.asarray(-forces @ np.swapaxes(self.inverse @ self.moved, -1, -2))


class RigidContact(NamedTuple):
    """A contact by impulse: speeds jump as it closes; while it presses, its gap stays zero."""

    name: str
    restitution: float
    tangential: float
    friction: Friction | None


class RigidContacts:
    """The rigid contacts of a model, by their numbers."""

    def __init__(self, contacts: TreeContacts, touches: Touches) -> None:
        self._touches, self._contacts = touches, contacts
        self.all = {
            k: RigidContact(
                contact.name, contact.law.restitution, contact.law.tangential, contact.friction
            )
            for k, contact in enumerate(contacts.all)
            if isinstance(contact.law, Impulse)
        }

    def closed(self) -> list[int]:
        """Numbers of the rigid contacts that press."""
        return [k for k in self.all if self._touches.pressed[k]]

    def gaps(self, which: Sequence[int], state: TreeState) -> Gaps:
        """Gaps at instants (n,)."""
        contacts = self._contacts.group(tuple(which))
        moving = self._contacts.kinematics.moving(state.x, state.v)
        look, (rows, slides) = contacts.look(moving)
        bend = contacts.gap_bends(moving, look) + (rows @ state.b[:, :, None])[:, :, 0]
        touching = np.stack([look.gap, look.gap_rate], axis=-1)
        return Gaps(rows, rows @ state.transform.matrix, bend, touching, slides, look.slip)

    def rubbed(self, which: Sequence[int], slip: FloatArray) -> FloatArray:
        """Friction (..., c) of some contacts that press by 1 N, by their slip (..., c), m/s."""
        rubbing = np.zeros(slip.shape)
        for c, k in enumerate(which):
            rub = self.all[k].friction
            if rub is not None:
                rubbing[..., c] = rub.force(1.0, slip[..., c])
        return rubbing

    def pushing(
        self, which: Sequence[int], gaps: Gaps, state: TreeState
    ) -> tuple[FloatArray, FloatArray]:
        """Forces of contacts that press by 1 N: on all coordinates, and on the independent ones."""
        if all(self.all[k].friction is None for k in which):
            return gaps.rows, gaps.free
        rows = gaps.rows + self.rubbed(which, gaps.slip)[..., None] * gaps.slides
        return rows, rows @ state.transform.matrix

    def holding(self, evaluation: Evaluation) -> Holding:
        """Return how the contacts that last hold their gaps, at instants (n,)."""
        which, state = self.closed(), evaluation.kept.state
        gaps = self.gaps(which, state)
        arms = mobility(gaps, evaluation.mass)[0]
        pushed, pushed_free = self.pushing(which, gaps, state)
        opened = self.opened(which, gaps, arms, pushed_free)
        inverse = least_inverse(opened, symmetric=pushed_free is gaps.free)
        return Holding(gaps, pushed, pushed_free, inverse, np.swapaxes(arms, -1, -2))

    def with_reactions(self, evaluation: Evaluation, holding: Holding | None = None) -> Evaluation:
        """Return evaluations at instants (n,) with the reactions of the contacts that last."""
        which, kept = self.closed(), evaluation.kept
        gaps, pushed, pushed_free, inverse, moved = holding or self.holding(evaluation)
        gap, rate = gaps.touching[..., 0], gaps.touching[..., 1]
        wanted = -gaps.bend - 2 * BAUMGARTE * rate - BAUMGARTE * BAUMGARTE * gap
        wanted -= (moved @ evaluation.force[..., None])[..., 0]
        press = (inverse @ wanted[..., None])[..., 0]
        power = -press * rate - press * self.rubbed(which, gaps.slip) * gaps.slip
        kept.pushes[:, which] = np.stack([press, power], axis=-1)
        force = kept.force + (press[:, None] @ pushed)[:, 0]
        free = evaluation.force + (press[:, None] @ pushed_free)[:, 0]
        return evaluation._replace(force=free, kept=kept._replace(force=force))

    def opened(
        self, which: Sequence[int], gaps: Gaps, arms: FloatArray, pushed: FloatArray
    ) -> FloatArray:
        """Accelerations (..., c, c) of gaps by 1 N in each contact: see `pushing`.

        Raises:
            JammedError: friction presses a contact together by more than its force opens it.

        """
        if pushed is gaps.free:
            return np.asarray(gaps.free @ arms)
        moved = np.asarray(np.swapaxes(pushed @ arms, -1, -2))
        for c, k in enumerate(which):
            if moved[..., c, c].min() <= 0:
                raise JammedError(self.all[k].name)
        return moved

    def slopes(self, evaluation: Evaluation) -> FloatArray | float:
        """Damping (independent, independent) by friction of contacts that last, at one state."""
        which = [k for k in self.closed() if self.all[k].friction is not None]
        if not which:
            return 0.0
        state: TreeState = evaluation.kept.state
        gaps = self.gaps(which, state.pick(None)).pick(0)
        slid = state.transform.reduced_rows(gaps.slides)
        rubs = [
            (friction.coefficient, friction.slip_speed)
            for k in which
            if (friction := self.all[k].friction)
        ]
        coefficient, slip_speed = np.array(rubs).T
        steep = coefficient**2 - self.rubbed(which, gaps.slip) ** 2
        steep *= evaluation.kept.pushes[which, 0] / (coefficient * slip_speed)
        return np.asarray((slid.T * steep) @ slid)

    def held(self, evaluation: Evaluation) -> tuple[FloatArray, FloatArray]:
        """Gradients (c, independent) of gaps that stay closed; forces by 1 N in their contacts."""
        which, state = self.closed(), evaluation.kept.state
        gaps = self.gaps(which, state.pick(None)).pick(0)
        return gaps.free, self.pushing(which, gaps, state)[1]


def scaled_inverse(mobility: FloatArray, *, symmetric: bool = True) -> FloatArray:
    """Inverse of mobilities (..., c, c), which may be `symmetric`; 0 for joints that can't move.

    It is the pseudo-inverse if joints depend on each other.
    """
    diagonals = np.diagonal(mobility, axis1=-2, axis2=-1)
    moves = diagonals > 0
    scale = np.divide(1.0, np.sqrt(np.abs(diagonals)), where=moves, out=np.zeros(diagonals.shape))
    both = scale[..., :, None] * scale[..., None, :]
    return np.asarray(least_inverse(mobility * both, symmetric=symmetric) * both)
