"""Dry friction in the joints of a tree.

It brakes a joint while that slides, and holds it while it rests. With z the
independent coordinates, v = g z' the speed at which a joint turns or slides, and b the bound of its
friction,

    M z'' = f + sum(g^T T),      v > 0: T = -b,   v < 0: T = b,   v = 0: -b <= T <= b.

A joint that rests is held like a closed contact: ``g z'' + c = 0``, and errors of steps die out
(see `rigid.BAUMGARTE`). It slides again when T reaches the bound, and a joint that slides may come
to rest where v is zero. There the T of all joints at rest are those that make the accelerations
least, in Gauss's sense, within the bounds (J. J. Moreau, in *Nonsmooth Mechanics and Applications*,
Springer 1988). In a loop more joints may rest than it has degrees of freedom. Then their T are
those that use the smallest part of their bounds: the joints slide when no other T would hold them.
A freewheel has no bound on one side: v never goes beyond zero there, and in an impact T has the
impulse that this takes (F. Pfeiffer and Ch. Glocker, *Multibody Dynamics with Unilateral Contacts*,
Wiley 1996).

The bound follows from the force R in the joint, ``b = constant + share |R|``, and R is affine in
all T: R = R0 + D T. There is exactly one T as long as the eigenvalues of share |D| are less than 1;
beyond that friction locks the joint.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import inf
from typing import NamedTuple

import numpy as np
from scipy.optimize import linprog, lsq_linear
from scipy.sparse.csgraph import connected_components

from exudyn_flexlink.arrays import BoolArray, FloatArray, IndexArray
from exudyn_flexlink.engines.exudyn.minimal.closures import ClosedCoordinates
from exudyn_flexlink.engines.exudyn.minimal.coordinates import TreeCoordinates, TreeState
from exudyn_flexlink.engines.exudyn.minimal.rigid import BAUMGARTE, RigidContacts, scaled_inverse
from exudyn_flexlink.integrate.problem import Evaluation
from exudyn_flexlink.mechanism import JointFriction, Pin
from exudyn_flexlink.mechanism.tree import TreeLayout
from exudyn_flexlink.raising import Sendable
from exudyn_flexlink.rounding import NEGLIGIBLE, ROUNDING, SOLVED, UNIT_ROUNDING

LEAST_BOUND = 1e-30  # N m or N: bound of a joint without any force in it


def within_bounds(
    mobility: FloatArray, free: FloatArray, bounds: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """T (k,) that make ``T W T/2 + free T`` least for a mobility W (k, k), none beyond its bounds.

    Either a joint rests, ``W T + free = 0``, or its T is the bound that acts against its
    acceleration. With a root
    of W, ``W = A^T A``, that is a least-squares problem with bounds (P. B. Stark and R. L. Parker,
    Comput. Stat. 10 (1995) 129).
    """
    if not len(free):
        return np.zeros(0)
    scale = 1 / np.sqrt(np.diag(mobility))
    values, ways = np.linalg.eigh(mobility * scale[:, None] * scale)
    moves = values > SOLVED * values.max()
    root, ways = np.sqrt(values[moves]), ways[:, moves]
    low, high = bounds
    within = np.minimum(low, -LEAST_BOUND) / scale, np.maximum(high, LEAST_BOUND) / scale
    wanted = -(free * scale) @ ways / root
    solved = lsq_linear((ways * root).T, wanted, within, "bvls", tol=UNIT_ROUNDING)
    choices = [solved.active_mask < 0, solved.active_mask > 0]
    return np.select(choices, [low, high], solved.x * scale)


def dependent(mobility: FloatArray, held: IndexArray) -> Iterator[IndexArray]:
    """Groups of coupled joints at rest in which there are more joints than degrees of freedom."""
    held = held[np.diag(mobility)[held] > 0]
    if len(held) < 2:
        return
    scale = 1 / np.sqrt(np.diag(mobility)[held])
    coupled = mobility[np.ix_(held, held)] * scale[:, None] * scale
    count, group_of = connected_components(np.abs(coupled) > NEGLIGIBLE)
    for group in range(count):
        block = np.flatnonzero(group_of == group)
        coupling = coupled[np.ix_(block, block)]
        if np.linalg.matrix_rank(coupling, NEGLIGIBLE, hermitian=True) < len(block):
            yield held[block]


def least_part(torque: FloatArray, bound: FloatArray, g: FloatArray) -> FloatArray:
    """T (n, block) with the same effect as `torque`, whose largest ratio to its bound is least.

    `g` (n, block, independent) is the effect of a unit of each. If the joints share one degree of
    freedom, all have the same ratio; else a linear programme gives the ratios.
    """
    bound = np.maximum(bound, LEAST_BOUND)
    arms = g * bound[..., None]
    ways, sizes, _ = np.linalg.svd(arms, full_matrices=False)
    if sizes.shape[1] < 2 or (sizes[:, 1] <= NEGLIGIBLE * sizes[:, 0]).all():
        by_motion = sizes[:, :1] * ways[..., 0]
        ratio = (by_motion * torque / bound).sum(axis=1) / np.abs(by_motion).sum(axis=1)
        return np.asarray(np.sign(by_motion) * ratio[:, None] * bound)
    columns = zip(torque / bound, ways, sizes, strict=True)
    return np.array([_least_largest(*column) for column in columns]) * bound


def _least_largest(part: FloatArray, ways: FloatArray, sizes: FloatArray) -> FloatArray:
    """Ratios (block,) to bounds with the same effect as `part`; the largest of them is least.

    `ways` (block, motions) and `sizes` are of the singular value decomposition.
    """
    arms = ways[:, sizes > NEGLIGIBLE * sizes[0]].T
    count, whole = len(part), arms @ part
    within = np.hstack([np.vstack([np.eye(count), -np.eye(count)]), -np.ones((2 * count, 1))])
    held = np.hstack([arms, np.zeros((len(arms), 1))])
    cost = np.append(np.zeros(count), 1.0)
    solved = linprog(cost, within, np.zeros(2 * count), held, whole, (None, None))
    least = part if solved.x is None else solved.x[:count]
    return np.asarray(least + arms.T @ (whole - arms @ least))


STILL = 1e-9  # rad/s or m/s: a slower joint rests, if the forces allow it
HELD_STILL = 1e-5  # the same for a joint that already rests: more than its error of steps
AT_BOUND = 1e-6  # of a bound: a joint so near its bound slides as soon as another joint slides
MOST_ROUNDS, SEARCH_ROUNDING = 100, 1e-13  # of the iteration for friction and forces in joints
FEW_ROUNDS = 8  # of an iteration in which each round adds some digits


class LockedError(Sendable, ArithmeticError):
    """Friction that grows with the force in its joint has no solution, or several."""

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
    """All joints at instants (n,), and the effect of their T.

    `free` (n, joints, independent) is g; `away` (n, joints) are accelerations without T, and
    `mobility` (n, joints, joints) accelerations by a unit of each T; `rate` and `place` (n, joints)
    are speeds and coordinates. The forces R are `felt` (n, joints, 2) without T, and `by` (n,
    joints with R, joints with T, 2) by a unit of each T.
    """

    free: FloatArray
    away: FloatArray
    mobility: FloatArray
    rate: FloatArray
    place: FloatArray
    felt: FloatArray
    by: FloatArray


class Answer(NamedTuple):
    """How joints react to contacts that begin to press, at one state.

    Of freewheels (w,) that may lock, `rows` (w, independent) are gradients of the speeds that they
    keep from falling below zero, `lock` are the torques by which they lock already, and `away` the
    accelerations. `held` (h, independent) are gradients of the other joints that rest.
    """

    rows: FloatArray
    lock: FloatArray
    away: FloatArray
    held: FloatArray

    def moved(self, rows: FloatArray, pushed: FloatArray, mass: FloatArray) -> FloatArray:
        """Accelerations (c + w, c + w) of gaps and freewheels by a unit force in each.

        Gaps have gradients `rows` (c, independent), and a unit in their contacts gives the forces
        `pushed`. Joints that rest stay at rest, unless that leaves a contact no motion.
        """
        rows, pushed = np.vstack([rows, self.rows]), np.vstack([pushed, self.rows])
        freely = rows @ np.linalg.solve(mass, pushed.T)
        if not len(self.held):
            return np.asarray(freely)
        back = np.linalg.solve(mass, self.held.T)
        carried = freely - rows @ back @ scaled_inverse(self.held @ back) @ (pushed @ back).T
        moves = np.diag(carried) > NEGLIGIBLE * np.diag(freely)
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
        self.since = np.zeros(count)  # speed with which each joint left its rest: an error of steps
        self.stopped: int | None = None  # number of the joint that has just come to rest

    @property
    def held(self) -> IndexArray:
        """Numbers of the joints that rest."""
        return np.flatnonzero(self.way == 0)

    @property
    def has_sides(self) -> IndexArray:
        """Numbers of slides whose friction grows with the force in them."""
        return np.flatnonzero(self._slides & (self.shares > 0))

    # --- what is known ------------------------------------------------------------------------

    def driven(self, state: TreeState) -> BoolArray:
        """Tell of which joints (joints,) a drive prescribes the speed, at one state."""
        return ~np.asarray(self._free(state).any(axis=-1))

    def _free(self, state: TreeState) -> FloatArray:
        """Return g (..., joints, independent), exactly 0 for joints that a drive prescribes."""
        free = self.rows @ state.transform.matrix
        largest = np.abs(self.rows).max(axis=1, initial=0.0)[:, None]
        return np.asarray(np.where(np.abs(free) > ROUNDING * largest, free, 0.0))

    def _look(self, evaluation: Evaluation) -> _Known:
        """Look at states (n,) without friction, but with contacts that hold closed gaps.

        Their reactions change with each T. A joint that contacts hold counts as without friction:
        how both would share the force is unknown.
        """
        kept, state = evaluation.kept, evaluation.kept.state
        count, joints = len(evaluation.force), len(self.all)
        free = np.broadcast_to(self._free(state), (count, joints, evaluation.force.shape[1]))
        push, rows = free, np.broadcast_to(self.rows, (count, *self.rows.shape))
        if self._rigid.closed():
            holding = self._rigid.holding(evaluation)
            answers = holding.reactions(free)
            evaluation = self._rigid.with_reactions(evaluation, holding)
            kept = evaluation.kept
            push, rows = free + answers @ holding.pushed_free, rows + answers @ holding.pushed
            moves = np.abs(push).max(axis=2) > NEGLIGIBLE * np.abs(free).max(axis=2)
            free, push, rows = (moves[..., None] * column for column in (free, push, rows))
        forces = np.concatenate([evaluation.force[:, None], push], axis=1)
        moved = np.swapaxes(np.linalg.solve(evaluation.mass, np.swapaxes(forces, 1, 2)), 1, 2)
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

    def act(self, evaluation: Evaluation) -> Evaluation:
        """Return evaluations at instants (n,) with friction, while all joints slide or rest as now.

        Raises:
            LockedError: friction by the forces in joints has no solution, or several.

        """
        held, moving, kept = self.held, np.flatnonzero(self.way), evaluation.kept
        if not len(held) and not self.shares.any():  # they brake by their bounds, whatever moves
            bound = np.broadcast_to(self._constant, (len(evaluation.force), len(self.all)))
            return self._braked(evaluation, -self.way * bound, bound, np.zeros(bound.shape))
        known = self._look(evaluation)
        torque = np.zeros(known.rate.shape)
        torque[:, moving] = -(self.way * self._constant)[moving]
        symmetric = not self._rigid.closed()
        inverse = scaled_inverse(known.mobility[:, held[:, None], held], symmetric=symmetric)
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
                continue  # a freewheel holds without a bound, so that there is no ratio
            for _ in range(FEW_ROUNDS if self.shares.any() else 1):
                columns = torque[:, block], bound[:, block], known.free[:, block]
                torque[:, block] = least_part(*columns)
                bound = self._bound(known, torque)
        felt = _felt(known, torque)[..., 0]
        acts = known.free
        # A joint that slides brakes, too, where contacts with driven parts carry it along.
        if not symmetric:
            acts = np.where((self.way != 0)[:, None], self._free(kept.state), acts)
        return self._braked(evaluation, torque, bound, felt, acts)

    def _braked(
        self,
        evaluation: Evaluation,
        torque: FloatArray,
        bound: FloatArray,
        felt: FloatArray,
        acts: FloatArray | None = None,
    ) -> Evaluation:
        """Return evaluations at instants (n,) with T, bounds and forces R (n, joints) in them.

        T act by `acts` (n, joints, independent) on the independent coordinates; left out, by g.
        """
        kept = evaluation.kept
        acts = self._free(kept.state) if acts is None else acts
        rests = np.broadcast_to(self.way == 0, torque.shape)
        friction = np.stack([torque, bound, felt, rests], axis=-1)
        whole = kept.force + torque @ self.rows
        free = evaluation.force + (torque[:, None] @ acts)[:, 0]
        return evaluation._replace(force=free, kept=kept._replace(force=whole, friction=friction))

    def _bound(self, known: _Known, torque: FloatArray) -> FloatArray:
        felt = np.linalg.norm(_felt(known, torque), axis=-1)
        return np.asarray(self._constant + self.shares * felt)

    def bounds(self, bound: FloatArray, which: IndexArray) -> tuple[FloatArray, FloatArray]:
        """Least and greatest T (k,) of some joints whose friction has this bound (k,)."""
        one_way = self.one_way[which]
        return np.where(one_way < 0, -inf, -bound), np.where(one_way > 0, inf, bound)

    def left_of_bound(self, k: int, friction: FloatArray) -> FloatArray:
        """How far (n,) the T of joint k at rest is within its bound; below 0 it is beyond.

        `friction` (n, 2 or more) has T and bounds. The answer is a part of the bound; of a
        freewheel it is a torque, N m.
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
        """Require that bounds grow more slowly than T, in any units: then T is unique."""
        grown = share[:, None] * np.linalg.norm(by, axis=-1)
        if not share.any() or np.abs(np.linalg.eigvals(grown)).max(initial=0.0) < 1:
            return
        worst = np.diagonal(grown, axis1=-2, axis2=-1).max(axis=0).argmax()
        raise LockedError(self.all[which[worst]].name)

    def held_rows(self, evaluation: Evaluation) -> FloatArray:
        """Return g (k, independent) of the joints that rest, at one state."""
        return (
            self._free(evaluation.kept.state)[self.held]
            if self.all
            else np.zeros((0, len(evaluation.mass)))
        )

    def answer(self, evaluation: Evaluation) -> Answer:
        """Return how joints react to contacts that begin to press, at one state with friction."""
        state: TreeState = evaluation.kept.state
        free, rate = self._free(state), self.rows @ state.v
        still = np.abs(rate) <= np.where(self.way == 0, HELD_STILL, STILL)
        rests = still & free.any(axis=1)
        wheels, held = rests & (self.one_way != 0), rests & (self.one_way == 0) & (self.way == 0)
        ways, (torque, bound) = self.one_way[wheels], evaluation.kept.friction[wheels, :2].T
        away = free[wheels] @ evaluation.accelerations + self.rows[wheels] @ state.b
        rows = ways[:, None] * free[wheels]
        return Answer(rows, ways * torque + bound, ways * away, free[held])

    # --- impacts ------------------------------------------------------------------------------

    def struck(self, evaluation: Evaluation) -> IndexArray:
        """Numbers of the joints that act in an impact: by friction, or as a freewheel.

        The impulse of friction is in proportion to the impulse in the joint; a freewheel locks.
        """
        driven = self.driven(evaluation.kept.state) if self.all else np.zeros(0, dtype=bool)
        return np.flatnonzero(((self.shares > 0) | (self.one_way != 0)) & ~driven)

    def impulses_by(self, evaluation: Evaluation, free: FloatArray, rows: FloatArray) -> FloatArray:
        """Impulses (k, joints, 2), N s, in joints by unit impulses (k,), at one state.

        A unit impulse acts by `free` (k, independent) on the independent coordinates, and by `rows`
        (k, links) on all.
        """
        state: TreeState = evaluation.kept.state
        jumps = np.linalg.solve(evaluation.mass, free.T).T @ state.transform.matrix.T
        felt = self._force(state.pick(None), (jumps @ evaluation.kept.mass - rows)[None])
        return np.asarray(felt[0])

    # --- which rest ---------------------------------------------------------------------------

    def settle(self, evaluation: Evaluation) -> None:
        """Decide which joints slide, and in which direction, at a state (1,) without friction.

        Raises:
            LockedError: friction by the forces in joints has no solution, or several; or a
                freewheel is turned in the direction in which it locks.

        """
        before, known, joints = self.way, self._look(evaluation), np.arange(len(self.all))
        self._require_unique(self.shares, known.by, joints)
        rate = known.rate[0]
        still = np.abs(rate) <= np.where(before == 0, HELD_STILL, STILL)
        still |= joints == self.stopped
        way = np.where(still, 0.0, np.sign(rate))
        driven = self.driven(evaluation.kept.state.pick(0))
        by_drives = evaluation.kept.state.b[0]
        given = self.rows @ by_drives
        pushed = np.abs(given) > NEGLIGIBLE * np.abs(by_drives).max()
        way = np.where(driven & (way == 0) & pushed, np.sign(given), way)
        if self._rigid.closed():
            carried = self._carried(evaluation) * ~known.free[0].any(axis=-1) * ~driven
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
        moves = np.abs(left) > NEGLIGIBLE * (np.abs(known.away[0]) + np.abs(parts).sum(axis=1))
        least, greatest = self.bounds(bound[0], joints)
        slide = moves & ((torque[0] <= least) | (torque[0] >= greatest))
        way[resting] = np.where(slide, np.sign(left), 0.0)[resting]
        self.side = np.where(_felt(known, torque)[0, :, 0] < 0, -1.0, 1.0)
        fresh = (way == 0) & ((before != 0) | np.isnan(self._place))
        self._place = np.where(fresh, known.place[0], self._place)
        self.way, self.since, self.stopped = way, np.where(still, rate, 0.0), None

    def _carried(self, evaluation: Evaluation) -> FloatArray:
        """Signs (joints,) of accelerations that contacts with driven parts cause, or 0."""
        moved = self._rigid.with_reactions(evaluation)
        state = evaluation.kept.state.pick(0)
        by_forces = state.transform.matrix @ np.linalg.solve(moved.mass[0], moved.force[0])
        given = self.rows @ (state.b + by_forces)
        sizes = np.abs(self.rows) @ (np.abs(state.b) + np.abs(by_forces))
        return np.where(np.abs(given) > NEGLIGIBLE * sizes, np.sign(given), 0.0)

    def slide(self, k: int, friction: FloatArray, v: FloatArray) -> None:
        """Let joint k slide, and all joints at their bounds; `v` (links,) are the present speeds.

        `friction` (joints, 2 or more) has T and bounds.
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
