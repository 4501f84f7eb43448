"""Dry friction in the joints of a tree: it brakes what slides, and holds what rests.

With z the independent coordinates, v = g z' the speed at which a joint turns or slides, and b the
bound of its friction,

    M z'' = f + sum(g^T T),      v > 0: T = -b,   v < 0: T = b,   v = 0: -b <= T <= b.

A joint that rests is held as a closed contact is: ``g z'' + c = 0``, with errors dying out (see
`contacts.BAUMGARTE`); it slides on where T reaches the bound, and what slides may rest where v is
zero. There the T of all joints at rest are those that make the accelerations least, in Gauss's
sense, within the bounds: a least-squares problem (J. J. Moreau, in *Nonsmooth Mechanics and
Applications*, Springer 1988; P. B. Stark and R. L. Parker, Comput. Stat. 10 (1995) 129).

By the force R in the joint, ``b = constant + share |R|``, and R is affine in all T: R = R0 + D T.
There is one T of every R as long as share |D| is less than 1; beyond, friction locks.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import lsq_linear

from exudyn_flexlink.arrays import BoolArray, FloatArray, IndexArray
from exudyn_flexlink.engines.exudyn.minimal.closed import ClosedCoordinates
from exudyn_flexlink.engines.exudyn.minimal.contacts import BAUMGARTE, Projector
from exudyn_flexlink.engines.exudyn.minimal.coordinates import Coordinates, TreeState
from exudyn_flexlink.integrate.complementarity import least_inverse
from exudyn_flexlink.integrate.problem import Evaluation
from exudyn_flexlink.mechanism import JointFriction, Pin
from exudyn_flexlink.mechanism.tree import TreeLayout

STILL = 1e-9  # rad/s or m/s: what is slower rests, if forces let it
NOT_PUSHED = 1e-12  # of the parts that a prescribed acceleration sums up: less is zero
DRIVEN = 1e-12  # of the row of a joint: what it moves of the independent coordinates, if prescribed
MOST_ROUNDS, ROUNDING = 100, 1e-13  # in search for friction by forces that depend on it
LEAST_BOUND = 1e-30  # N m or N: of what no force presses together
LOCKS = "friction in joint '{}' locks it: the force in the joint grows with it without end"
LOCKS_ADVICE = "less 'coefficient', or a smaller 'radius'"


class LockedError(ArithmeticError):
    """Friction by the force in a joint has no answer, or more than one."""


class _Answer(NamedTuple):
    """Accelerations (n, independent), T in held joints (n, held), forces R (n, joints, 2)."""

    accelerations: FloatArray
    holding: FloatArray
    felt: FloatArray


class _Rows(NamedTuple):
    """Of all joints at instants (n,): g (n, joints, independent), c and speeds (n, joints)."""

    free: FloatArray
    bend: FloatArray
    rate: FloatArray
    place: FloatArray


class JointFrictions:
    """Those of a layout: which way (joints,) each slides, +1 or -1; 0 where it rests.

    `rests` are the times at rest of each, beginnings and ends (s).
    """

    def __init__(
        self, layout: TreeLayout, frictions: tuple[JointFriction, ...], coordinates: Coordinates
    ) -> None:
        self.all, self._coordinates = frictions, coordinates
        count = len(frictions)
        self.rows = np.array([_row(layout, own) for own in frictions]).reshape(
            count, len(layout.links)
        )
        self._constant = np.array([own.constant for own in frictions])
        self._share = np.array([own.share for own in frictions])
        self._slides = np.array([not isinstance(own.joint, Pin) for own in frictions], dtype=bool)
        self._felt = {k: layout.felt[own.name] for k, own in enumerate(frictions)
                      if own.name in layout.felt}  # fmt: skip
        self._closing: dict[int, int] = {}
        if isinstance(coordinates, ClosedCoordinates):
            names = [joint.name for joint in coordinates.closures.joints]
            sharing = ((k, own.name) for k, own in enumerate(frictions) if own.share > 0)
            self._closing = {k: names.index(name) for k, name in sharing if name in names}
        self.way = np.zeros(count)
        self._side = np.ones(count)  # of a slide, on which its force presses
        self._place = np.full(count, np.nan)  # where joints rest
        self.rests: list[list[list[float]]] = [[] for _ in frictions]
        self.trouble: LockedError | None = None  # of the last evaluation that failed

    @property
    def held(self) -> IndexArray:
        """Numbers of the joints that rest."""
        return np.flatnonzero(self.way == 0)

    # --- rows ---------------------------------------------------------------------------------

    def _look(self, state: TreeState) -> _Rows:
        free = np.broadcast_to(
            self.rows @ state.transform.matrix,
            (len(state.x), len(self.all), state.transform.matrix.shape[-1]),
        )
        at = (own @ self.rows.T for own in (state.b, state.v, state.x))
        return _Rows(free, *at)

    def driven(self, state: TreeState) -> BoolArray:
        """Tell of which joints (joints,) a drive prescribes the speed, at one state."""
        moved = np.abs(self.rows @ state.transform.matrix).max(axis=-1, initial=0.0)
        return np.asarray(moved <= DRIVEN * np.abs(self.rows).max(axis=1))

    def _force(self, state: TreeState, excess: FloatArray) -> FloatArray:
        """Forces R (n, joints, 2) by what accelerations leave of the forces (n, links).

        Of a pin both components, in axes of its own; of a slide that across its line alone.
        """
        found = np.zeros((len(excess), len(self.all), 2))
        if not self._share.any():
            return found
        if isinstance(self._coordinates, ClosedCoordinates):
            excess, own = self._coordinates.held_by_loops(state, excess)
            for k, joint in self._closing.items():
                found[:, k] = own[:, joint]
        for k, links in self._felt.items():
            found[:, k, : len(links)] = excess[:, links]
        return found

    # --- equations ----------------------------------------------------------------------------

    def _answers(
        self, at: Evaluation, rows: _Rows, held: IndexArray, moving: IndexArray
    ) -> tuple[_Answer, _Answer, FloatArray]:
        """What the forces do without T in `moving` joints, and what a unit of each of those does.

        The second has an axis of these before that of instants. Some of the joints are `held`.
        Last are inverse mobilities (n, held, held).
        """
        g = rows.free[:, held]
        arms = np.linalg.solve(at.mass, np.swapaxes(g, 1, 2))
        inverse = least_inverse(g @ arms)
        off, kept = np.nan_to_num(rows.place - self._place)[:, held], at.kept
        wanted = -rows.bend[:, held] - 2 * BAUMGARTE * rows.rate[:, held] - BAUMGARTE**2 * off

        def answer(
            free: FloatArray, whole: FloatArray, asked: FloatArray | float, b: FloatArray | float
        ) -> _Answer:
            z = np.linalg.solve(at.mass, free[..., None])[..., 0]
            hold = (inverse @ (asked - (g @ z[..., None])[..., 0])[..., None])[..., 0]
            z = z + (arms @ hold[..., None])[..., 0]
            whole = whole + hold @ self.rows[held]
            excess = (kept.mass @ (b + kept.state.transform.expanded(z))[..., None])[..., 0] - whole
            return _Answer(z, hold, self._force(kept.state, excess))

        known = answer(at.force, kept.force, wanted, kept.state.b)
        units = [
            answer(rows.free[:, j], np.broadcast_to(self.rows[j], kept.force.shape), 0.0, 0.0)
            for j in moving.tolist()
        ]
        columns = [np.array(column) for column in zip(*units, strict=True)] if units else []
        shape = (0, len(at.force))
        none = _Answer(np.zeros((*shape, at.force.shape[1])), np.zeros((*shape, len(held))),
                       np.zeros((*shape, len(self.all), 2)))  # fmt: skip
        return known, _Answer(*columns) if units else none, inverse

    def act(self, at: Evaluation) -> Evaluation:
        """Return evaluations at instants (n,) with friction, as all joints slide or rest now."""
        held, moving, kept = self.held, np.flatnonzero(self.way), at.kept
        rows = self._look(kept.state)
        torque = np.zeros((len(at.force), len(self.all)))
        torque[:, moving] = -(self.way * self._constant)[moving]
        felt = np.zeros((*torque.shape, 2))
        if len(held) or self._share.any():
            known, units, _ = self._answers(at, rows, held, moving)
            if self._share[moving].any():
                torque[:, moving] = self._braking(known.felt, units.felt, moving)
            own = torque[:, moving].T[..., None]
            torque[:, held] = known.holding + (own * units.holding).sum(axis=0)
            felt = known.felt + (own[..., None] * units.felt).sum(axis=0)
        whole = kept.force + torque @ self.rows
        free = at.force + (torque[:, None] @ rows.free)[:, 0]
        bound = self._constant + self._share * np.linalg.norm(felt, axis=-1)
        told = np.stack([torque, bound, felt[..., 0]], axis=-1)
        return at._replace(force=free, kept=kept._replace(force=whole, friction=told))

    def _braking(self, known: FloatArray, units: FloatArray, moving: IndexArray) -> FloatArray:
        """T (n, moving) of joints that slide, by Newton's method: bounds and T follow each other.

        Raises:
            LockedError: there is none, or more than one.

        """
        share, way, slides = self._share[moving], self.way[moving], self._slides[moving]
        known, by = known[:, moving], np.moveaxis(units[:, :, moving], 0, 2)  # n, j, k, 2
        self._require_one(share, by, moving)
        braked = np.tile(-way * self._constant[moving], (len(known), 1))
        for _ in range(MOST_ROUNDS):
            felt = known + (by * braked[:, None, :, None]).sum(axis=2)
            size = np.linalg.norm(felt, axis=-1)
            along = felt / np.maximum(size, LEAST_BOUND)[..., None]
            signed = np.where(slides, self._side[moving] * felt[..., 0], size)
            along[:, slides] = np.stack([self._side[moving][slides], 0 * way[slides]], axis=-1)
            slope = (by * along[:, :, None]).sum(axis=-1)
            off = braked + way * (self._constant[moving] + share * signed)
            change = np.linalg.solve(
                np.eye(len(moving)) + (way * share)[:, None] * slope, off[..., None]
            )[..., 0]
            braked = braked - change
            if np.abs(change).max() <= ROUNDING * np.abs(braked).max():
                break
        return braked

    def _require_one(self, share: FloatArray, by: FloatArray, which: IndexArray) -> None:
        grown = share * np.linalg.norm(by, axis=-1).sum(axis=-1)  # n, j
        if grown.max(initial=0.0) >= 1:
            name = self.all[which[int(grown.max(axis=0).argmax())]].name
            self.trouble = LockedError(LOCKS.format(name))
            raise self.trouble
        self.trouble = None

    def projector(self, at: Evaluation) -> Projector | None:
        """What the joints that rest let through at one state; None if none does."""
        held = self.held
        if not len(held):
            return None
        g = self.rows[held] @ at.kept.state.transform.matrix
        arms = np.linalg.solve(at.mass, g.T)
        back = g.T @ least_inverse(g @ arms)
        return Projector(np.eye(len(at.mass)) - back @ arms.T, back @ g)

    # --- which rest ---------------------------------------------------------------------------

    def settle(self, time: float, at: Evaluation) -> None:
        """Tell which joints slide, and which way, at a state (1,) without friction.

        Raises:
            LockedError: friction by the forces in joints has no answer.

        """
        state, before = at.kept.state, self.way.copy()
        rows, every = self._look(state), np.arange(len(self.all))
        rate = rows.rate[0]
        way = np.where(np.abs(rate) > STILL, np.sign(rate), 0.0)
        known, units, _ = self._answers(at, rows, np.zeros(0, dtype=int), every)
        felt, by = known.felt[0], np.moveaxis(units.felt[:, 0], 0, 1)  # j, k, 2
        self._require_one(self._share, by[None], every)
        driven = self.driven(state.pick(0))
        pushed = rows.bend[0] * (np.abs(rows.bend[0]) > NOT_PUSHED * np.abs(state.b[0]).max())
        way = np.where(driven & (way == 0), np.sign(pushed), way)
        resting = np.flatnonzero((way == 0) & ~driven)
        torque = np.zeros(len(self.all))
        for _ in range(MOST_ROUNDS):
            force = felt + (by * torque[None, :, None]).sum(axis=1)
            bound = self._constant + self._share * np.linalg.norm(force, axis=-1)
            found = -way * bound
            found[resting] = _holding(at, rows, found, bound, resting)
            change, torque = np.abs(found - torque).max(), found
            if change <= ROUNDING * np.abs(torque).max():
                break
        at_bound = np.abs(torque[resting]) >= bound[resting]
        way[resting] = np.where(at_bound, -np.sign(torque[resting]), 0.0)
        self._side = np.where(force[:, 0] < 0, -1.0, 1.0)
        fresh = (way == 0) & ((before != 0) | np.isnan(self._place))
        self._place = np.where(fresh, rows.place[0], self._place)
        for k in every.tolist():
            self.turn(k, float(way[k]), time)

    def turn(self, k: int, way: float, time: float) -> None:
        """Let a joint slide this way from a time (s) on, or rest."""
        if way == 0 and not (self.rests[k] and len(self.rests[k][-1]) == 1):
            self.rests[k].append([time])
        elif way != 0 and self.rests[k] and len(self.rests[k][-1]) == 1:
            self.rests[k][-1].append(time)
        self.way = self.way.copy()
        self.way[k] = way

    def change_side(self, k: int) -> None:
        """The force of a slide presses from its other side."""
        self._side = self._side.copy()
        self._side[k] *= -1

    @property
    def side(self) -> FloatArray:
        """On which side (joints,) the force of a slide presses; of a pin without meaning."""
        return self._side

    @property
    def has_sides(self) -> IndexArray:
        """Numbers of slides that rub by their force."""
        return np.flatnonzero(self._slides & (self._share > 0))


def _row(layout: TreeLayout, friction: JointFriction) -> FloatArray:
    """Derivatives (links,) of the angle, or the length, of a joint."""
    joint = friction.joint
    if isinstance(joint, Pin):
        return layout.turning_row(joint.first.part, joint.second.part)
    link, sign = layout.joints[joint.name]
    return sign * np.eye(len(layout.links))[link]


def _holding(
    at: Evaluation, rows: _Rows, torque: FloatArray, bound: FloatArray, resting: IndexArray
) -> FloatArray:
    """T (resting,) of joints at rest, within their bounds, at one state; others have theirs."""
    if not len(resting):
        return np.zeros(0)
    g, root = rows.free[0, resting], np.linalg.cholesky(at.mass[0])
    others = torque.copy()
    others[resting] = 0.0
    z = np.linalg.solve(at.mass[0], at.force[0] + others @ rows.free[0])
    arms = np.linalg.solve(at.mass[0], g.T)
    z = z + arms @ (least_inverse(g @ arms) @ rows.bend[0, resting])
    most = np.maximum(bound[resting], LEAST_BOUND)
    found = lsq_linear(root.T @ arms * most, -root.T @ z, (-1.0, 1.0), "bvls", tol=1e-15)
    return np.asarray(np.where(found.active_mask, found.active_mask, found.x) * most)
