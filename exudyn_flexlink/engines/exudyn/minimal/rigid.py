"""Rigid contacts of a tree that last: their reactions, and the friction that goes with them.

Pushing leaves no gap. With g the gaps and G their gradients by the independent coordinates, which
accelerate by z'',

    M z'' = f + (G - mu tanh(s/s_0) T)^T r,      G z'' + c = -2 BAUMGARTE g' - BAUMGARTE^2 g

for the reactions r (N); c is what gaps bend without z''. The right side lets die out what gaps
are off by (J. Baumgarte, Comput. Methods Appl. Mech. Eng. 1 (1972) 1). Friction is that of
`laws.Friction`, regularised, with s the slip and T its gradient.

Friction in the impact of one contact, by Coulomb: both impulses grow together until it is over.

With the inverse masses k_t, k_n and k_tn at the contact, slip u and rate w of the gap follow

    u = u_a + k_t P_t + k_tn P_n,      w = w_a + k_n P_n + k_tn P_t

as P_n grows (E. J. Routh, *Dynamics of a System of Rigid Bodies*, part 1, 1897; Y. Wang and
M. T. Mason, J. Appl. Mech. 59 (1992) 635). While it slides dP_t = -mu sgn(u) dP_n; where u comes to
zero it sticks if friction is enough, and else slides back. The gap closes until w = 0, at P_c, and
the touch is over at (1 + e) P_c: Poisson's restitution, out of which no energy can come. What is
round about the contact has k_tn = 0: there this is Newton's.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import copysign, inf
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.minimal.contacts import TreeContacts
from exudyn_flexlink.engines.exudyn.minimal.coordinates import TreeState
from exudyn_flexlink.engines.touching import Touches
from exudyn_flexlink.integrate.contact_share import RANK
from exudyn_flexlink.integrate.problem import Evaluation
from exudyn_flexlink.laws import Friction, Impulse
from exudyn_flexlink.raising import Sendable

ROUND = 1e-9  # of sqrt(k_t k_n): less of k_tn is rounding, and so is less of k_n in what it opens


class Meeting(NamedTuple):
    """Inverse masses k_t, k_n, k_tn (1/kg), slip u_a and rate w_a of the gap before (m/s).

    `contact` is its name.
    """

    along: float
    across: float
    both: float
    slip: float
    rate: float
    contact: str = ""

    @property
    def is_round(self) -> bool:
        """Tell whether neither impulse changes the speed that the other does."""
        return self.both**2 <= ROUND**2 * self.along * self.across


class JammedError(Sendable, ArithmeticError):
    """Friction presses a contact together by more than its force opens it: it has no answer."""

    advice = "a smaller 'friction', or a law with stiffness"

    def __init__(self, contact: str) -> None:
        """Take the name of the contact."""
        why = "its force would press the bodies together by more than it parts them"
        super().__init__(f"friction jams the contact '{contact}': {why}")


def impulses(at: Meeting, friction: float, restitution: float) -> tuple[float, float]:
    """Return P_n and P_t (N s) of an impact with a coefficient of friction and a restitution.

    Raises:
        JammedError: no impulse, however large, ends the approach.

    """
    both = 0.0 if at.is_round else at.both
    slides, then = _ways(at, both, friction)
    turning = both + at.along * slides
    stops = -at.slip / turning if at.slip * turning < 0 else 0.0 if at.slip == 0 else inf
    closing = at.across + both * slides
    squeezed = -at.rate / closing if closing > ROUND * at.across else inf
    if squeezed > stops:
        left, closing = at.rate + closing * stops, at.across + both * then
        squeezed = stops - left / closing if closing > ROUND * at.across else inf
    if squeezed == inf:
        raise JammedError(at.contact)
    pressed = (1 + restitution) * squeezed
    slid = min(pressed, stops)
    return pressed, slides * slid + then * (pressed - slid)


def _ways(at: Meeting, both: float, friction: float) -> tuple[float, float]:
    """Return dP_t/dP_n at first, and once the slip has come to zero."""
    sticks = at.along > 0 and abs(both) <= friction * at.along
    # What can't be moved along rubs without an effect; at rest it needs no force.
    then = -both / at.along if sticks else -copysign(friction, both) if both else 0.0
    return (-copysign(friction, at.slip) if at.slip else then), then


def turned_back(at: Meeting, friction: float, pressed: float, returns: float) -> float:
    """Return P_t (N s) of what is round, where the part `returns` of the slip comes back."""
    if at.along == 0:
        return 0.0
    bound = friction * pressed
    return max(-bound, min(bound, -(1 + returns) * at.slip / at.along))


# 1/s: rate at which errors of steps in a closed gap die out; reactions show it squared.
BAUMGARTE = 1e2


class Gaps(NamedTuple):
    """Gaps of some contacts at one instant, or at several: then with one axis more, the first.

    `rows` (c, links) are gradients by all coordinates, `free` (c, independent) by the independent
    ones; `bend` (c,), m/s^2, second derivatives where those do not accelerate. `touching` (c, 2)
    are gaps and rates, `slides` (c, links) gradients of the ways slid, 0 of what is smooth, and
    `slip` (c,) their rates (m/s).
    """

    rows: FloatArray
    free: FloatArray
    bend: FloatArray
    touching: FloatArray
    slides: FloatArray
    slip: FloatArray

    def pick(self, which: int) -> Gaps:
        """Return those of one of several instants."""
        return Gaps._make(column[which] for column in self)


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


class RigidContact(NamedTuple):
    """A contact by impulse: speeds jump as it closes, and pushing leaves no gap."""

    name: str
    restitution: float
    tangential: float
    friction: Friction | None


class RigidContacts:
    """Those of a model's contacts that are rigid, by their numbers."""

    def __init__(self, contacts: TreeContacts, touches: Touches) -> None:
        self._touches, self._contacts = touches, contacts
        self.all = {
            k: RigidContact(own.name, own.law.restitution, own.law.tangential, own.friction)
            for k, own in enumerate(contacts.all)
            if isinstance(own.law, Impulse)
        }

    def closed(self) -> list[int]:
        """Numbers of those that press."""
        return [k for k in self.all if self._touches.pressed[k]]

    def gaps(self, which: Sequence[int], state: TreeState) -> Gaps:
        """Gaps at instants (n,)."""
        contacts = self._contacts.some(tuple(which))
        moving = self._contacts.kinematics.moving(state.x, state.v)
        look, (rows, slides) = contacts.look(moving)
        bend = contacts.gap_bends(moving, look) + (rows @ state.b[:, :, None])[:, :, 0]
        touching = np.stack([look.gap, look.gap_rate], axis=-1)
        return Gaps(rows, rows @ state.transform.matrix, bend, touching, slides, look.slip)

    def rubbed(self, which: Sequence[int], slip: FloatArray) -> FloatArray:
        """Friction (..., c) of some contacts that press by 1 N, by their slip (..., c), m/s."""
        found = np.zeros(slip.shape)
        for c, k in enumerate(which):
            rub = self.all[k].friction
            if rub is not None:
                found[..., c] = rub.force(1.0, slip[..., c])
        return found

    def pushing(
        self, which: Sequence[int], gaps: Gaps, state: TreeState
    ) -> tuple[FloatArray, FloatArray]:
        """What each pushes that presses by 1 N: on all coordinates, on the independent ones."""
        if all(self.all[k].friction is None for k in which):
            return gaps.rows, gaps.free
        rows = gaps.rows + self.rubbed(which, gaps.slip)[..., None] * gaps.slides
        return rows, rows @ state.transform.matrix

    def with_reactions(self, at: Evaluation) -> Evaluation:
        """Return evaluations at instants (n,) with the reactions of those that last."""
        which, kept = self.closed(), at.kept
        gaps = self.gaps(which, kept.state)
        arms = mobility(gaps, at.mass)[0]
        pushed, pushed_free = self.pushing(which, gaps, kept.state)
        gap, rate = gaps.touching[..., 0], gaps.touching[..., 1]
        wanted = -gaps.bend - 2 * BAUMGARTE * rate - BAUMGARTE * BAUMGARTE * gap
        wanted -= (np.swapaxes(arms, -1, -2) @ at.force[..., None])[..., 0]
        inverse = self._inverse(which, gaps, arms, pushed_free)
        press = (inverse @ wanted[..., None])[..., 0]
        power = -press * rate - press * self.rubbed(which, gaps.slip) * gaps.slip
        kept.pushes[:, which] = np.stack([press, power], axis=-1)
        force = kept.force + (press[:, None] @ pushed)[:, 0]
        free = at.force + (press[:, None] @ pushed_free)[:, 0]
        return at._replace(force=free, kept=kept._replace(force=force))

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

    def _inverse(
        self, which: Sequence[int], gaps: Gaps, arms: FloatArray, pushed: FloatArray
    ) -> FloatArray:
        moved, smooth = self.opened(which, gaps, arms, pushed), pushed is gaps.free
        return np.asarray(np.linalg.pinv(moved, rcond=RANK, hermitian=smooth))

    def slopes(self, at: Evaluation) -> FloatArray | float:
        """Damping (independent, independent) by friction of those that last, at one state."""
        which = [k for k in self.closed() if self.all[k].friction is not None]
        if not which:
            return 0.0
        state: TreeState = at.kept.state
        gaps = self.gaps(which, state.pick(None)).pick(0)
        slid = state.transform.reduced_rows(gaps.slides)
        rubs = [(own.coefficient, own.slip_speed) for k in which if (own := self.all[k].friction)]
        coefficient, slip_speed = np.array(rubs).T
        steep = coefficient**2 - self.rubbed(which, gaps.slip) ** 2
        steep *= at.kept.pushes[which, 0] / (coefficient * slip_speed)
        return np.asarray((slid.T * steep) @ slid)

    def projector(self, at: Evaluation) -> Projector | None:
        """What those that last let through at one state; None if none does."""
        which = self.closed()
        if not which:
            return None
        state: TreeState = at.kept.state
        gaps = self.gaps(which, state.pick(None)).pick(0)
        arms = mobility(gaps, at.mass)[0]
        pushed = self.pushing(which, gaps, state)[1]
        back = pushed.T @ self._inverse(which, gaps, arms, pushed)
        return Projector(np.eye(len(at.mass)) - back @ arms.T, back @ gaps.free)
