"""Forces of a tree that follow from its equations: friction in joints, rigid contacts, impacts.

Dry friction in a joint brakes it while it slides, and holds it while it rests. With z the
independent coordinates, v = g z' the speed at which a joint turns or slides, and b the bound of its
friction,

    M z'' = f + sum(g^T T),      v > 0: T = -b,   v < 0: T = b,   v = 0: -b <= T <= b.

A joint that rests is held as a closed contact is: ``g z'' + c = 0``, with errors dying out (see
`BAUMGARTE`); it slides on where T reaches the bound, and what slides may rest where v is
zero. There the T of all joints at rest are those that make the accelerations least, in Gauss's
sense, within the bounds (J. J. Moreau, in *Nonsmooth Mechanics and Applications*, Springer 1988).
Where more joints rest than there are freedoms between them, as in a loop, their T are those that
use the least part of their bounds: they slide when none other would hold. A freewheel has no bound
on one side: there v is never beyond zero, and in an impact T has the impulse that it takes (F.
Pfeiffer and Ch. Glocker, *Multibody Dynamics with Unilateral Contacts*, Wiley 1996).

By the force R in the joint, ``b = constant + share |R|``, and R is affine in all T: R = R0 + D T.
There is one T as long as the eigenvalues of share |D| are less than 1; beyond, friction locks.

Rigid contacts that last have reactions, and friction in proportion to these. With g the gaps and G
their gradients by the independent coordinates, which accelerate by z'',

    M z'' = f + (G - mu tanh(s/s_0) T)^T r,      G z'' + c = -2 BAUMGARTE g' - BAUMGARTE^2 g

for the reactions r (N); c is the part of g'' that does not depend on z''. The right side lets
errors of gaps die out (J. Baumgarte, Comput. Methods Appl. Mech. Eng. 1 (1972) 1). Friction is that
of `laws.Friction`, regularised, with s the slip and T its gradient.

In the impact of one contact with Coulomb's friction both impulses grow together until it is over.
With the inverse masses k_t, k_n and k_tn at the contact, slip u and rate w of the gap follow

    u = u_a + k_t P_t + k_tn P_n,      w = w_a + k_n P_n + k_tn P_t

as P_n grows (E. J. Routh, *Dynamics of a System of Rigid Bodies*, part 1, 1897; Y. Wang and
M. T. Mason, J. Appl. Mech. 59 (1992) 635). While it slides dP_t = -mu sgn(u) dP_n; where u comes to
zero it sticks if friction is enough, and else slides back. The gap closes until w = 0, at P_c, and
the touch is over at (1 + e) P_c: this is Poisson's restitution, which never adds energy. With
k_tn = 0, as of a round body, it is the same as Newton's.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import copysign, inf
from typing import NamedTuple

import numpy as np
from scipy.optimize import linprog, lsq_linear
from scipy.sparse.csgraph import connected_components

from exudyn_flexlink.arrays import BoolArray, FloatArray, IndexArray
from exudyn_flexlink.engines.exudyn.minimal.closures import ClosedCoordinates
from exudyn_flexlink.engines.exudyn.minimal.contacts import TreeContacts
from exudyn_flexlink.engines.exudyn.minimal.coordinates import TreeCoordinates, TreeState
from exudyn_flexlink.engines.touching import Touches
from exudyn_flexlink.integrate.complementarity import RANK, least_inverse
from exudyn_flexlink.integrate.problem import Evaluation
from exudyn_flexlink.laws import Friction, Impulse
from exudyn_flexlink.mechanism import JointFriction, Pin
from exudyn_flexlink.mechanism.tree import TreeLayout
from exudyn_flexlink.raising import Sendable

# Of sqrt(k_t k_n): a smaller k_tn is rounding. Of k_n: so is a smaller change of the gap's rate.
OPENED_BY_ROUNDING = 1e-9


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
        return self.both**2 <= OPENED_BY_ROUNDING**2 * self.along * self.across


class JammedError(Sendable, ArithmeticError):
    """Friction presses a contact together by more than its force opens it: no solution exists."""

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
    squeezed = -at.rate / closing if closing > OPENED_BY_ROUNDING * at.across else inf
    if squeezed > stops:
        left, closing = at.rate + closing * stops, at.across + both * then
        squeezed = stops - left / closing if closing > OPENED_BY_ROUNDING * at.across else inf
    if squeezed == inf:
        raise JammedError(at.contact)
    pressed = (1 + restitution) * squeezed
    slid = min(pressed, stops)
    return pressed, slides * slid + then * (pressed - slid)


def _ways(at: Meeting, both: float, friction: float) -> tuple[float, float]:
    """Return dP_t/dP_n at first, and once the slip has come to zero."""
    sticks = at.along > 0 and abs(both) <= friction * at.along
    # Where nothing can move along the face friction has no effect; at rest it needs no force.
    then = -both / at.along if sticks else -copysign(friction, both) if both else 0.0
    return (-copysign(friction, at.slip) if at.slip else then), then


def turned_back(at: Meeting, friction: float, pressed: float, returns: float) -> float:
    """Return P_t (N s) of a round body, where the part `returns` of the slip comes back."""
    if at.along == 0:
        return 0.0
    bound = friction * pressed
    return max(-bound, min(bound, -(1 + returns) * at.slip / at.along))


# 1/s: rate at which errors of steps in a closed gap die out; reactions show it squared.
BAUMGARTE = 1e2


class Gaps(NamedTuple):
    """Gaps of some contacts at one instant, or at several: then with one axis more, the first.

    `rows` (c, links) are gradients by all coordinates, `free` (c, independent) by the independent
    ones; `bend` (c,), m/s^2, are second derivatives where those do not accelerate. `touching`
    (c, 2) are gaps and rates; `slides` (c, links) are gradients of the sliding distances, 0 without
    friction, and `slip` (c,) their rates (m/s).
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
        back = pushed.T @ scaled_inverse((pushed @ arms).T, even=pushed is rows)
        return cls(np.eye(len(mass)) - back @ arms.T, back @ rows)

    def slopes(self, stiffness: FloatArray, damping: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Stiffness and damping matrix with the reactions in them."""
        of_gaps, of_rates = BAUMGARTE * BAUMGARTE * self.closed, 2 * BAUMGARTE * self.closed
        return self.free @ stiffness + of_gaps, self.free @ damping + of_rates


class Holding(NamedTuple):
    """Closed gaps at instants (n,), and how contacts (c,) hold them against forces.

    By 1 N contacts push all coordinates by `pushed` (n, c, links), independent ones by
    `pushed_free`. The reactions to forces (n, independent) are ``-inverse moved f``.
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
    """A contact by impulse: speeds jump as it closes, and pushing leaves no gap."""

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

    def holding(self, at: Evaluation) -> Holding:
        """Return what the contacts that last do, at instants (n,)."""
        which, state = self.closed(), at.kept.state
        gaps = self.gaps(which, state)
        arms = mobility(gaps, at.mass)[0]
        pushed, pushed_free = self.pushing(which, gaps, state)
        inverse = self._inverse(which, gaps, arms, pushed_free)
        return Holding(gaps, pushed, pushed_free, inverse, np.swapaxes(arms, -1, -2))

    def with_reactions(self, at: Evaluation, holding: Holding | None = None) -> Evaluation:
        """Return evaluations at instants (n,) with the reactions of the contacts that last."""
        which, kept = self.closed(), at.kept
        gaps, pushed, pushed_free, inverse, moved = holding or self.holding(at)
        gap, rate = gaps.touching[..., 0], gaps.touching[..., 1]
        wanted = -gaps.bend - 2 * BAUMGARTE * rate - BAUMGARTE * BAUMGARTE * gap
        wanted -= (moved @ at.force[..., None])[..., 0]
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
        return least_inverse(moved, even=smooth)

    def slopes(self, at: Evaluation) -> FloatArray | float:
        """Damping (independent, independent) by friction of contacts that last, at one state."""
        which = [k for k in self.closed() if self.all[k].friction is not None]
        if not which:
            return 0.0
        state: TreeState = at.kept.state
        gaps = self.gaps(which, state.pick(None)).pick(0)
        slid = state.transform.reduced_rows(gaps.slides)
        rubs = [
            (friction.coefficient, friction.slip_speed)
            for k in which
            if (friction := self.all[k].friction)
        ]
        coefficient, slip_speed = np.array(rubs).T
        steep = coefficient**2 - self.rubbed(which, gaps.slip) ** 2
        steep *= at.kept.pushes[which, 0] / (coefficient * slip_speed)
        return np.asarray((slid.T * steep) @ slid)

    def held(self, at: Evaluation) -> tuple[FloatArray, FloatArray]:
        """Gradients (c, independent) of the gaps that stay closed, and what presses there."""
        which, state = self.closed(), at.kept.state
        gaps = self.gaps(which, state.pick(None)).pick(0)
        return gaps.free, self.pushing(which, gaps, state)[1]


SOLVED = 1e-15  # of a sum of squares: a search that gains less is over
COUPLED = 1e-9  # of joints that move each other: less is rounding
LEAST_BOUND = 1e-30  # N m or N: bound of a joint without any force in it


def within_bounds(
    mobility: FloatArray, free: FloatArray, bounds: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """T (k,) that make ``T W T/2 + free T`` least for a mobility W (k, k), none beyond its bounds.

    So a joint rests, ``W T + free = 0``, or T is at the bound against its acceleration. With a root
    of W, ``W = A^T A``, that is a least-squares problem with bounds (P. B. Stark and R. L. Parker,
    Comput. Stat. 10 (1995) 129).
    """
    if not len(free):
        return np.zeros(0)
    scale = 1 / np.sqrt(np.diag(mobility))
    values, ways = np.linalg.eigh(mobility * scale[:, None] * scale)
    moves = values > RANK * values.max()
    root, ways = np.sqrt(values[moves]), ways[:, moves]
    low, high = bounds
    within = np.minimum(low, -LEAST_BOUND) / scale, np.maximum(high, LEAST_BOUND) / scale
    wanted = -(free * scale) @ ways / root
    solved = lsq_linear((ways * root).T, wanted, within, "bvls", tol=SOLVED)
    choices = [solved.active_mask < 0, solved.active_mask > 0]
    return np.select(choices, [low, high], solved.x * scale)


def scaled_inverse(mobility: FloatArray, *, even: bool = True) -> FloatArray:
    """Inverse of mobilities (..., c, c), the least one if joints depend; 0 for what can't move.

    `even` tells that they are symmetric.
    """
    diagonals = np.diagonal(mobility, axis1=-2, axis2=-1)
    moves = diagonals > 0
    scale = np.divide(1.0, np.sqrt(np.abs(diagonals)), where=moves, out=np.zeros(diagonals.shape))
    both = scale[..., :, None] * scale[..., None, :]
    return np.asarray(least_inverse(mobility * both, even=even) * both)


def dependent(mobility: FloatArray, held: IndexArray) -> Iterator[IndexArray]:
    """Groups of coupled joints at rest in which there are more joints than degrees of freedom."""
    held = held[np.diag(mobility)[held] > 0]
    if len(held) < 2:
        return
    scale = 1 / np.sqrt(np.diag(mobility)[held])
    coupled = mobility[np.ix_(held, held)] * scale[:, None] * scale
    count, group_of = connected_components(np.abs(coupled) > COUPLED)
    for group in range(count):
        block = np.flatnonzero(group_of == group)
        coupling = coupled[np.ix_(block, block)]
        if np.linalg.matrix_rank(coupling, COUPLED, hermitian=True) < len(block):
            yield held[block]


def least_part(torque: FloatArray, bound: FloatArray, g: FloatArray) -> FloatArray:
    """T (n, block) with the effect of `torque` whose largest part of a bound is least.

    `g` (n, block, independent) is the effect of a unit of each. If the joints share one degree of
    freedom all take the same part of their bounds; else a linear programme tells the parts.
    """
    bound = np.maximum(bound, LEAST_BOUND)
    arms = g * bound[..., None]
    ways, sizes, _ = np.linalg.svd(arms, full_matrices=False)
    if sizes.shape[1] < 2 or (sizes[:, 1] <= COUPLED * sizes[:, 0]).all():
        by_motion = sizes[:, :1] * ways[..., 0]
        done = (by_motion * torque / bound).sum(axis=1) / np.abs(by_motion).sum(axis=1)
        return np.asarray(np.sign(by_motion) * done[:, None] * bound)
    columns = zip(torque / bound, ways, sizes, strict=True)
    return np.array([_least_largest(*column) for column in columns]) * bound


def _least_largest(part: FloatArray, ways: FloatArray, sizes: FloatArray) -> FloatArray:
    """Parts (block,) of bounds with the effect of `part`, the largest of which is least.

    `ways` (block, motions) and `sizes` are of the singular value decomposition.
    """
    arms = ways[:, sizes > COUPLED * sizes[0]].T
    count, whole = len(part), arms @ part
    within = np.hstack([np.vstack([np.eye(count), -np.eye(count)]), -np.ones((2 * count, 1))])
    held = np.hstack([arms, np.zeros((len(arms), 1))])
    cost = np.append(np.zeros(count), 1.0)
    solved = linprog(cost, within, np.zeros(2 * count), held, whole, (None, None))
    least = part if solved.x is None else solved.x[:count]
    return np.asarray(least + arms.T @ (whole - arms @ least))


STILL = 1e-9  # rad/s or m/s: what is slower rests, if forces let it
HELD_STILL = 1e-5  # likewise, of a joint that is held: more than the error of steps there
NO_ACCELERATION = 1e-9  # of the sizes of the parts that an acceleration sums up: less is zero
AT_BOUND = 1e-6  # of a bound: a joint so near to it slides as soon as another reaches its own
DRIVEN = 1e-12  # of the largest entry of a joint's row: smaller entries are rounding
MOST_ROUNDS, SEARCH_ROUNDING = 100, 1e-13  # of the iteration for friction and forces in joints
FEW_ROUNDS = 8  # likewise, where each round adds some digits


class LockedError(Sendable, ArithmeticError):
    """Friction by the force in a joint has no answer, or more than one."""

    advice = "a smaller 'coefficient' or 'radius'"
    key = "friction"

    def __init__(self, joint: str) -> None:
        """Take the name of the joint."""
        self.joint = joint
        super().__init__(f"friction locks joint '{joint}': the force in it grows with its friction")


class BackwardError(LockedError):
    """A freewheel turns the way in which it locks."""

    advice = (
        "turn it the other way, or the freewheel around; where a drive moves one of both bodies as "
        "the run starts, a 'ramp', or 'speeds' in 'initial', let them turn alike"
    )
    key = "freewheel"

    def __init__(self, joint: str) -> None:
        """Take the name of the joint."""
        self.joint = joint
        ArithmeticError.__init__(self, f"freewheel '{joint}' is turned the way in which it locks")


class _Known(NamedTuple):
    """All joints at instants (n,), with what T does.

    `free` (n, joints, independent) is g; `away` (n, joints) are accelerations without T, and
    `mobility` (n, joints, joints) those by a unit of each T; `rate` and `place` are of joints. The
    forces R are `felt` (n, joints, 2) without T, and `by` (n, joints, joints, 2) by a unit of each
    T, which the last axis but one counts.
    """

    free: FloatArray
    away: FloatArray
    mobility: FloatArray
    rate: FloatArray
    place: FloatArray
    felt: FloatArray
    by: FloatArray


class Answer(NamedTuple):
    """How joints answer what begins to press, at one state.

    Freewheels (w,) that may lock: `rows` (w, independent) of the speeds that they bar from falling
    below zero, with which they already `lock`, and how these accelerate, `away`. `held` (h,
    independent) are rows of the other joints that rest.
    """

    rows: FloatArray
    lock: FloatArray
    away: FloatArray
    held: FloatArray

    def moved(self, rows: FloatArray, pushed: FloatArray, mass: FloatArray) -> FloatArray:
        """Accelerations (c + w, c + w) of gaps and freewheels by units of what acts in each.

        Gaps have `rows` (c, independent), their contacts push by `pushed`. Joints that rest are
        carried along, but where contacts hold all that these do.
        """
        rows, pushed = np.vstack([rows, self.rows]), np.vstack([pushed, self.rows])
        freely = rows @ np.linalg.solve(mass, pushed.T)
        if not len(self.held):
            return np.asarray(freely)
        back = np.linalg.solve(mass, self.held.T)
        carried = freely - rows @ back @ scaled_inverse(self.held @ back) @ (pushed @ back).T
        moves = np.diag(carried) > COUPLED * np.diag(freely)
        return np.asarray(carried if moves.all() else freely)


class JointFrictions:
    """Friction in a layout's joints: `way` (joints,) is 0 of a joint at rest, else 1 or -1."""

    def __init__(
        self,
        layout: TreeLayout,
        frictions: tuple[JointFriction, ...],
        coordinates: TreeCoordinates,
        rigid: RigidContacts,
    ) -> None:
        self.all, self._coordinates, self._rigid = frictions, coordinates, rigid
        count, links = len(frictions), len(layout.links)
        self.rows = np.array([_row(layout, friction) for friction in frictions]).reshape(
            count, links
        )
        self._constant = np.array([friction.constant for friction in frictions])
        self.shares = np.array([friction.share for friction in frictions])
        self.one_way = np.array([friction.one_way for friction in frictions], dtype=float)
        self._slides = np.array(
            [not isinstance(friction.joint, Pin) for friction in frictions], dtype=bool
        )
        sharing = {friction.name: k for k, friction in enumerate(frictions) if friction.share > 0}
        self._felt = {k: layout.felt[name] for name, k in sharing.items() if name in layout.felt}
        closing = [joint.name for joint in layout.closures]
        self._closing = {k: closing.index(name) for name, k in sharing.items() if name in closing}
        self.way = np.zeros(count)
        self.side = np.ones(count)  # sign of a slide's force across its line
        self._place = np.full(count, np.nan)  # where joints rest
        self.since = np.zeros(count)  # speed with which each left its rest: the error of steps
        self.stopped: int | None = None  # number of the joint that has just come to rest

    @property
    def held(self) -> IndexArray:
        """Numbers of the joints that rest."""
        return np.flatnonzero(self.way == 0)

    @property
    def has_sides(self) -> IndexArray:
        """Numbers of slides that rub by their force."""
        return np.flatnonzero(self._slides & (self.shares > 0))

    # --- what is known ------------------------------------------------------------------------

    def driven(self, state: TreeState) -> BoolArray:
        """Tell of which joints (joints,) a drive prescribes the speed, at one state."""
        return ~np.asarray(self._free(state).any(axis=-1))

    def _free(self, state: TreeState) -> FloatArray:
        """Return g (..., joints, independent), exactly 0 for joints that a drive prescribes."""
        free = self.rows @ state.transform.matrix
        largest = np.abs(self.rows).max(axis=1, initial=0.0)[:, None]
        return np.asarray(np.where(np.abs(free) > DRIVEN * largest, free, 0.0))

    def _look(self, at: Evaluation) -> _Known:
        """Look at states (n,) without friction, but with contacts that hold closed gaps.

        These answer each T. What they hold no friction holds, which would share it with them in an
        unknown way.
        """
        kept, state = at.kept, at.kept.state
        count, joints = len(at.force), len(self.all)
        free = np.broadcast_to(self._free(state), (count, joints, at.force.shape[1]))
        push, rows = free, np.broadcast_to(self.rows, (count, *self.rows.shape))
        if self._rigid.closed():
            holding = self._rigid.holding(at)
            answers = holding.reactions(free)
            at = self._rigid.with_reactions(at, holding)
            kept = at.kept
            push, rows = free + answers @ holding.pushed_free, rows + answers @ holding.pushed
            moves = np.abs(push).max(axis=2) > COUPLED * np.abs(free).max(axis=2)
            free, push, rows = (moves[..., None] * column for column in (free, push, rows))
        forces = np.concatenate([at.force[:, None], push], axis=1)
        moved = np.swapaxes(np.linalg.solve(at.mass, np.swapaxes(forces, 1, 2)), 1, 2)
        mobility = moved[:, 1:] @ np.swapaxes(free, 1, 2)
        away = state.b @ self.rows.T + (free @ moved[:, 0, :, None])[..., 0]
        felt = np.zeros((count, 1 + joints, joints, 2))
        if self.shares.any():
            bends = moved @ np.swapaxes(state.transform.matrix, -1, -2)
            bends[:, 0] += state.b
            excess = bends @ kept.mass
            excess[:, 0] -= kept.force
            excess[:, 1:] -= rows
            felt = self._force(state, excess)
        places = state.v @ self.rows.T, state.x @ self.rows.T
        by = np.swapaxes(felt[:, 1:], 1, 2)
        return _Known(free, away, mobility, *places, felt[:, 0], by)

    def _force(self, state: TreeState, excess: FloatArray) -> FloatArray:
        """Forces R (n, k, joints, 2) by the constraint forces `excess` (n, k, links).

        A pin has both components, in its axes; a slide only the one across its line.
        """
        total = np.zeros((*excess.shape[:2], len(self.all), 2))
        if isinstance(self._coordinates, ClosedCoordinates):
            excess, held = self._coordinates.held_by_loops(state, excess)
            for k, joint in self._closing.items():
                total[:, :, k] = held[:, :, joint]
        for k, links in self._felt.items():
            total[:, :, k, : len(links)] = excess[:, :, links]
        return total

    # --- equations ----------------------------------------------------------------------------

    def act(self, at: Evaluation) -> Evaluation:
        """Return evaluations at instants (n,) with friction, as all joints slide or rest now.

        Raises:
            LockedError: friction by the forces in joints has no answer, or more than one.

        """
        held, moving, kept = self.held, np.flatnonzero(self.way), at.kept
        if not len(held) and not self.shares.any():  # they brake by their bounds, whatever moves
            bound = np.broadcast_to(self._constant, (len(at.force), len(self.all)))
            return self._braked(at, -self.way * bound, bound, np.zeros(bound.shape))
        known = self._look(at)
        torque = np.zeros(known.rate.shape)
        torque[:, moving] = -(self.way * self._constant)[moving]
        even = not self._rigid.closed()
        inverse = scaled_inverse(known.mobility[:, held[:, None], held], even=even)
        off = np.nan_to_num(known.place - self._place)
        wanted = (-known.away - 2 * BAUMGARTE * known.rate - BAUMGARTE**2 * off)[:, held]
        by_moving = -inverse @ known.mobility[:, held[:, None], moving]
        alone = (inverse @ wanted[..., None])[..., 0]
        if self.shares[moving].any():
            of_moving, of_held = known.by[:, moving][:, :, moving], known.by[:, moving][:, :, held]
            felt = known.felt[:, moving] + np.einsum("njhi,nh->nji", of_held, alone)
            by = of_moving + np.einsum("njhi,nhm->njmi", of_held, by_moving)
            torque[:, moving] = self._braking(felt, by, moving)
        torque[:, held] = alone + (by_moving @ torque[:, moving, None])[..., 0]
        bound = self._bound(known, torque)
        for block in dependent(known.mobility[0], held):
            if self.one_way[block].any():
                continue  # what holds without bound has no part of one
            for _ in range(FEW_ROUNDS if self.shares.any() else 1):
                columns = torque[:, block], bound[:, block], known.free[:, block]
                torque[:, block] = least_part(*columns)
                bound = self._bound(known, torque)
        felt = _felt(known, torque)[..., 0]
        acts = known.free
        if not even:  # what slides brakes, also where contacts with what drives move carry it along
            acts = np.where((self.way != 0)[:, None], self._free(kept.state), acts)
        return self._braked(at, torque, bound, felt, acts)

    def _braked(
        self,
        at: Evaluation,
        torque: FloatArray,
        bound: FloatArray,
        felt: FloatArray,
        acts: FloatArray | None = None,
    ) -> Evaluation:
        """Return evaluations at instants (n,) with T, bounds and forces R (n, joints) in them.

        T act by `acts` (n, joints, independent) on the independent coordinates; left out, by g.
        """
        acts = self._free(at.kept.state) if acts is None else acts
        rests = np.broadcast_to(self.way == 0, torque.shape)
        friction = np.stack([torque, bound, felt, rests], axis=-1)
        whole = at.kept.force + torque @ self.rows
        free = at.force + (torque[:, None] @ acts)[:, 0]
        return at._replace(force=free, kept=at.kept._replace(force=whole, friction=friction))

    def _bound(self, known: _Known, torque: FloatArray) -> FloatArray:
        felt = np.linalg.norm(_felt(known, torque), axis=-1)
        return np.asarray(self._constant + self.shares * felt)

    def bounds(self, bound: FloatArray, which: IndexArray) -> tuple[FloatArray, FloatArray]:
        """Least and greatest T (k,) of some joints whose friction has this bound (k,)."""
        one_way = self.one_way[which]
        return np.where(one_way < 0, -inf, -bound), np.where(one_way > 0, inf, bound)

    def left_of_bound(self, k: int, friction: FloatArray) -> FloatArray:
        """What is left (n,) to joint k at rest, by its T and bounds (n, 2 or more); below 0 none.

        A part of the bound; of a freewheel all, N m.
        """
        torque, bound = friction[:, 0], friction[:, 1]
        if self.one_way[k]:
            return np.asarray(self.one_way[k] * torque + bound)
        return np.asarray(1.0 - np.abs(torque) / np.maximum(bound, LEAST_BOUND))

    def _braking(self, known: FloatArray, by: FloatArray, which: IndexArray) -> FloatArray:
        """T (n, moving) of joints that slide, by Newton's method, since bounds depend on T.

        R are `known` (n, moving, 2) without T, and `by` (n, moving, moving, 2) by a unit of each.
        """
        share, way, side = self.shares[which], self.way[which], self.side[which]
        self._require_unique(share, by, which)
        of_slide = np.stack([side, np.zeros(len(side))], axis=-1)
        braked = np.tile(-way * self._constant[which], (len(known), 1))
        for _ in range(MOST_ROUNDS):
            felt = known + np.einsum("njki,nk->nji", by, braked)
            along = felt / np.maximum(np.linalg.norm(felt, axis=-1), LEAST_BOUND)[..., None]
            along = np.where(self._slides[which, None], of_slide, along)
            off = braked + way * (self._constant[which] + share * (felt * along).sum(axis=-1))
            slope = (way * share)[:, None] * np.einsum("njki,nji->njk", by, along)
            change = np.linalg.solve(np.eye(len(way)) + slope, off[..., None])[..., 0]
            braked = braked - change
            if np.abs(change).max() <= SEARCH_ROUNDING * np.abs(braked).max():
                return braked
        raise LockedError(self.all[which[np.abs(change).max(axis=0).argmax()]].name)

    def _require_unique(self, share: FloatArray, by: FloatArray, which: IndexArray) -> None:
        """Require that bounds grow more slowly than T, in whatever units: then T is unique."""
        grown = share[:, None] * np.linalg.norm(by, axis=-1)
        if not share.any() or np.abs(np.linalg.eigvals(grown)).max(initial=0.0) < 1:
            return
        worst = np.diagonal(grown, axis1=-2, axis2=-1).max(axis=0).argmax()
        raise LockedError(self.all[which[worst]].name)

    def held_rows(self, at: Evaluation) -> FloatArray:
        """Return g (k, independent) of the joints that rest, at one state."""
        return self._free(at.kept.state)[self.held] if self.all else np.zeros((0, len(at.mass)))

    def answer(self, at: Evaluation) -> Answer:
        """Return how joints answer what begins to press, at one state with their friction."""
        state: TreeState = at.kept.state
        free, rate = self._free(state), self.rows @ state.v
        still = np.abs(rate) <= np.where(self.way == 0, HELD_STILL, STILL)
        rests = still & free.any(axis=1)
        wheels, held = rests & (self.one_way != 0), rests & (self.one_way == 0) & (self.way == 0)
        ways, (torque, bound) = self.one_way[wheels], at.kept.friction[wheels, :2].T
        away = free[wheels] @ at.accelerations + self.rows[wheels] @ state.b
        rows = ways[:, None] * free[wheels]
        return Answer(rows, ways * torque + bound, ways * away, free[held])

    # --- impacts ------------------------------------------------------------------------------

    def struck(self, at: Evaluation) -> IndexArray:
        """Numbers of the joints that take an impulse.

        That of friction is in proportion to the joint's; a freewheel locks.
        """
        driven = self.driven(at.kept.state) if self.all else np.zeros(0, dtype=bool)
        return np.flatnonzero(((self.shares > 0) | (self.one_way != 0)) & ~driven)

    def impulses_by(self, at: Evaluation, free: FloatArray, rows: FloatArray) -> FloatArray:
        """Impulses (k, joints, 2), N s, in joints by units of some impulses, at one state.

        These act by `free` (k, independent) on the independent coordinates, and by `rows` on all.
        """
        state: TreeState = at.kept.state
        jumps = np.linalg.solve(at.mass, free.T).T @ state.transform.matrix.T
        felt = self._force(state.pick(None), (jumps @ at.kept.mass - rows)[None])
        return np.asarray(felt[0])

    # --- which rest ---------------------------------------------------------------------------

    def settle(self, at: Evaluation) -> None:
        """Tell which joints slide, and which way, at a state (1,) without friction.

        Raises:
            LockedError: friction by the forces in joints has no answer, or more than one; or a
                freewheel is turned the way in which it locks.

        """
        before, known, joints = self.way, self._look(at), np.arange(len(self.all))
        self._require_unique(self.shares, known.by, joints)
        rate = known.rate[0]
        still = np.abs(rate) <= np.where(before == 0, HELD_STILL, STILL)
        still |= joints == self.stopped
        way = np.where(still, 0.0, np.sign(rate))
        driven = self.driven(at.kept.state.pick(0))
        by_drives = at.kept.state.b[0]
        given = self.rows @ by_drives
        pushed = np.abs(given) > NO_ACCELERATION * np.abs(by_drives).max()
        way = np.where(driven & (way == 0) & pushed, np.sign(given), way)
        if self._rigid.closed():
            carried = self._carried(at) * ~known.free[0].any(axis=-1) * ~driven
            way = np.where(way == 0, carried, way)
        backward = way * self.one_way < 0
        if backward.any():
            raise BackwardError(self.all[int(backward.argmax())].name)
        free = known.free[0].any(axis=-1)  # neither driven nor held by contacts
        resting, torque = np.flatnonzero((way == 0) & free), np.zeros((1, len(joints)))
        for _ in range(MOST_ROUNDS):
            bound = self._bound(known, torque)
            limits = -way * bound
            limits[0, resting] = 0.0
            left = known.away[0] + known.mobility[0] @ limits[0]
            within = known.mobility[0][np.ix_(resting, resting)], left[resting]
            of_resting = self.bounds(bound[0, resting], resting)
            limits[0, resting] = within_bounds(*within, of_resting)
            change, torque = np.abs(limits - torque).max(), limits
            if change <= SEARCH_ROUNDING * np.abs(torque).max():
                break
        parts = known.mobility[0] * torque[0]
        left = known.away[0] + parts.sum(axis=1)
        moves = np.abs(left) > NO_ACCELERATION * (np.abs(known.away[0]) + np.abs(parts).sum(axis=1))
        least, greatest = self.bounds(bound[0], joints)
        slide = moves & ((torque[0] <= least) | (torque[0] >= greatest))
        way[resting] = np.where(slide, np.sign(left), 0.0)[resting]
        self.side = np.where(_felt(known, torque)[0, :, 0] < 0, -1.0, 1.0)
        fresh = (way == 0) & ((before != 0) | np.isnan(self._place))
        self._place = np.where(fresh, known.place[0], self._place)
        self.way, self.since, self.stopped = way, np.where(still, rate, 0.0), None

    def _carried(self, at: Evaluation) -> FloatArray:
        """Ways (joints,) in which contacts with what drives move accelerate joints; 0 of none."""
        moved = self._rigid.with_reactions(at)
        state = at.kept.state.pick(0)
        by_forces = state.transform.matrix @ np.linalg.solve(moved.mass[0], moved.force[0])
        given = self.rows @ (state.b + by_forces)
        sizes = np.abs(self.rows) @ (np.abs(state.b) + np.abs(by_forces))
        return np.where(np.abs(given) > NO_ACCELERATION * sizes, np.sign(given), 0.0)

    def slide(self, k: int, friction: FloatArray, v: FloatArray) -> None:
        """Let joint k slide, and all that are at their bounds, by T and bounds (joints, 2 or more).

        `v` (links,) are the speeds then.
        """
        torque, bound = friction[:, 0], friction[:, 1]
        starts = (self.way == 0) & (np.abs(torque) >= (1 - AT_BOUND) * bound) & (bound > 0)
        starts &= self.one_way * torque <= 0
        starts[k] = True
        way = np.where(self.one_way == 0, -np.sign(torque), self.one_way)
        self.way = np.where(starts, way, self.way)
        self.since = np.where(starts, self.rows @ v, self.since)


def _row(layout: TreeLayout, friction: JointFriction) -> FloatArray:
    """Derivatives (links,) of the angle, or the length, of a joint."""
    joint = friction.joint
    if isinstance(joint, Pin):
        return layout.turning_row(joint.first.part, joint.second.part)
    row = layout.sliding_row(joint)
    assert row is not None  # the loader refuses friction of a slide that closes a loop
    return row


def _felt(known: _Known, torque: FloatArray) -> FloatArray:
    """Forces R (n, joints, 2) with all T (n, joints)."""
    return np.asarray(known.felt + np.einsum("njki,nk->nji", known.by, torque))
