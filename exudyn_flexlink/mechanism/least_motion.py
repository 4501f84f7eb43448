"""The motion closest to a wanted one that all joints allow: Gauss's principle of least constraint.

One problem in many dresses: accelerations (the metric is the mass matrix), velocities of least
size, the least step that closes the joints, the mobility of a point, the number of independent
constraints. The parts of the spanning tree are eliminated one by one, from its ends to its roots,
as articulated bodies (R. Featherstone, Rigid Body Dynamics Algorithms, chapter 7), so that the work
grows with the number of parts, not with its cube. Its joints never contradict each other. Only the
joints that the tree leaves over, slots and drives are solved together, by least squares.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.mechanism.constraints import Constraints
from exudyn_flexlink.mechanism.joints import GROUND, NO_ITEM
from exudyn_flexlink.mechanism.model import Mechanism
from exudyn_flexlink.rounding import NEGLIGIBLE, ROUNDING, TINY

ANGLE_WEIGHT = 1e3  # of a given angle against joints that contradict it
TURN = np.array([0.0, 0.0, 1.0])


class LeastMotion:
    """Motions x (parts, 3) that satisfy ``J x = right`` and minimise ``(x - f) W (x - f) / 2``.

    Rows whose right is NaN are left out. Where rows contradict each other, a row that fixes the
    angle of a part comes first. With `rigid` the parts of a body stay in line.
    `roots` (parts, 3, 3) are those of W, part by part: ``W = roots roots^T``. A body that moves as
    one may have a metric for one of its parts and zeros for the others.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        constraints: Constraints,
        roots: FloatArray,
        right: FloatArray,
        rigid: bool = False,
    ) -> None:
        self._constraints = constraints
        self._tree = spanning_tree(mechanism)
        pairs = enumerate(self._tree.parents)
        self._within = [rigid and within_body(mechanism, *pair) for pair in pairs]
        self._given = _given(constraints, right)
        hung = self._hang(right)
        self._offset = hung.offset
        self._eliminate(roots @ roots.transpose(0, 2, 1), hung)
        self._rest, weights = self._left_over(right)
        self._slopes = weights[:, None] * constraints.jacobian(self._rest)
        self._right = weights * right[self._rest]
        as_forces = self._slopes.T.reshape(constraints.count, 3, len(self._slopes))
        self._allowed = self._swept(as_forces)
        weighted = np.einsum("pji,pjk->kpi", roots, self._allowed)
        self._weighted = weighted.reshape(self._slopes.shape)
        self._lengths = _lengths(mechanism, self._slopes / weights[:, None], roots)

    # --- the tree ---------------------------------------------------------------------------

    def _left_over(self, right: FloatArray) -> tuple[IndexArray, FloatArray]:
        """Rows with a right side that the tree does not satisfy by itself, and their weights.

        A part that hangs on nothing takes what is given of it as its joint in the tree. If a part
        moves as one with its parent, and the angles of both are given, only the parent's counts.
        """
        implied, weights = np.isnan(right), np.ones(len(right))
        rows_of_joints = np.diff(self._constraints.first_rows)
        joints = np.repeat(np.arange(len(rows_of_joints)), rows_of_joints)
        implied[: len(joints)] |= np.isin(joints, self._tree.joints)
        for (part, axis), row in self._given.items():
            parent = self._tree.parents[part], axis
            twice = axis == 2 and self._within[part] and parent in self._given
            implied[row] = twice or self._tree.joints[part] == NO_ITEM
            weights[row] = ANGLE_WEIGHT if axis == 2 else 1.0
        rest = np.flatnonzero(~implied)
        return rest, weights[rest]

    def _hang(self, demanded: FloatArray) -> _Hung:
        """Solve each joint of the tree for its part, and what is given of parts that have none."""
        constraints, count = self._constraints, self._constraints.count
        inertia, parents, right = (
            np.zeros((count, 3, 3)),
            np.zeros((count, 3, 3)),
            np.zeros((count, 3)),
        )
        for (part, axis), row in self._given.items():
            if self._tree.joints[part] == NO_ITEM:
                inertia[part, axis, axis], right[part, axis] = 1.0, demanded[row]
        for part, joint in enumerate(self._tree.joints):
            if joint == NO_ITEM:
                continue
            first, last = constraints.first_rows[joint : joint + 2].tolist()
            side = int(constraints.parts[first, 1] == part)
            inertia[part, : last - first] = constraints.slopes[first:last, side]
            parents[part, : last - first] = constraints.slopes[first:last, 1 - side]
            right[part, : last - first] = demanded[first:last]
            if self._within[part]:
                # The third row holds the motion that the joint leaves free: a turn, or a stretch
                # along the rod.
                inertia[part, 2], parents[part, 2] = TURN, -TURN
                if constraints.kinds[joint] == "slide":
                    for whole, slopes in ((inertia, side), (parents, 1 - side)):
                        x, y, _ = constraints.slopes[first, slopes]
                        whole[part, 2] = y, -x, 0.0
        left, sizes, directions = np.linalg.svd(inertia)
        held = np.any(inertia != 0, axis=2).sum(axis=1)[:, None] > np.arange(3)  # by singular value
        inverse = np.where(held, 1.0 / np.where(held, sizes, 1.0), 0.0)
        solved = directions.transpose(0, 2, 1) @ (inverse[:, :, None] * left.transpose(0, 2, 1))
        free = np.where(held[:, None, :], 0.0, directions.transpose(0, 2, 1))
        filling = held[:, :, None] * np.eye(3)
        return _Hung(-solved @ parents, (solved @ right[:, :, None])[:, :, 0], free, filling)

    def _eliminate(self, metric: FloatArray, hung: _Hung) -> None:
        """Let every part, from the ends of the tree, follow its parent with the least total cost.

        Part b follows with ``x_b = follow_b x_parent + settle_b offset_b + yield_b forces_b``.
        """
        weights = metric.copy()
        same = np.eye(3)
        self._follow = np.zeros_like(metric)
        self._settle = np.zeros_like(metric)
        self._yield = np.zeros_like(metric)
        self._beyond = np.zeros_like(metric)  # of all beyond a joint, for its near end's motion
        for part in reversed(self._tree.order):
            free = hung.free[part]
            pushed = weights[part] @ free
            gain = free @ np.linalg.inv(free.T @ pushed + hung.filling[part])
            self._yield[part] = gain @ free.T
            settle = self._settle[part] = same - gain @ pushed.T
            self._follow[part] = settle @ hung.carried[part]
            self._beyond[part] = settle.T @ weights[part]
            parent = self._tree.parents[part]
            if parent != GROUND:
                carried = hung.carried[part]
                weights[parent] += carried.T @ self._beyond[part] @ carried
        self._carried = hung.carried

    def _swept(self, forces: FloatArray, offset: FloatArray | None = None) -> FloatArray:
        """Motion that forces (parts, 3, columns) cause in the tree, the rest of joints left out.

        `offset` (parts, 3) is the motion that each joint of the tree demands; None: none.
        """
        forces = forces.copy()
        if offset is not None:
            back = np.einsum("pji,pjk,pk->pi", self._carried, self._beyond, offset)
        for part in reversed(self._tree.order):
            parent = self._tree.parents[part]
            if parent != GROUND:
                forces[parent] += self._follow[part].T @ forces[part]
                if offset is not None:
                    forces[parent] -= back[part, :, None]
        moved: FloatArray = self._yield @ forces
        if offset is not None:
            moved = moved + self._settle @ offset[:, :, None]
        for part in self._tree.order:
            parent = self._tree.parents[part]
            if parent != GROUND:
                moved[part] += self._follow[part] @ moved[parent]
        return moved

    # --- with the rest ----------------------------------------------------------------------

    def nearest(self, forces: FloatArray | None = None) -> FloatArray:
        """Motion (parts, 3) of least cost, with `forces` ``W f`` (3 parts,) towards the wanted one.

        Of forces (3 parts, columns) it is (parts, 3, columns). Where the rest of the joints
        contradict each other, they satisfy these in least squares.
        """
        count = self._constraints.count
        forces = np.zeros((count, 3)) if forces is None else forces
        moved = self._swept(forces.reshape(count, 3, -1), self._offset)
        if len(self._rest):
            lefts, sizes = self._singular
            missing = self._right[:, None] - self._slopes @ moved.reshape(3 * count, -1)
            moved = moved + self._allowed @ (lefts @ (lefts.T @ missing / sizes[:, None] ** 2))
        return moved[:, :, 0] if forces.size == 3 * count else moved

    def surplus(self) -> dict[int, int]:
        """Number of rows that earlier rows imply, by joint. For mechanisms with few loops only."""
        starts = self._constraints.first_rows
        joints = np.searchsorted(starts, self._rest, side="right") - 1
        rows = self._weighted / np.maximum(self._lengths[:, None], TINY)
        surplus: dict[int, int] = {}
        missing = len(rows) - _rank(rows)
        known = 0
        for joint in dict.fromkeys(joints.tolist()):
            if sum(surplus.values()) == missing:
                break
            upto = int(np.searchsorted(joints, joint, side="right"))
            count, rank = upto - int(np.searchsorted(joints, joint)), _rank(rows[:upto])
            if rank < known + count:
                surplus[joint] = known + count - rank
            known = rank
        return surplus

    @cached_property
    def _singular(self) -> tuple[FloatArray, FloatArray]:
        """Left singular vectors and values of what the tree leaves free of the rest."""
        left, sizes, _ = np.linalg.svd(self._weighted, full_matrices=False)
        kept = sizes > ROUNDING * self._lengths.max(initial=0.0)
        return left[:, kept], sizes[kept]


def _lengths(mechanism: Mechanism, rows: FloatArray, roots: FloatArray) -> FloatArray:
    """Lengths (rows,) of rows by the metric if there were no joints, to tell rounding from motion.

    A part without a metric moves as one with its body, and takes the metric of the body's first
    part that has one.
    """
    source = np.arange(len(roots))
    for parts in mechanism.bodies.values():
        first = next(i for i in parts if roots[i].any())
        source[list(parts)] = [i if roots[i].any() else first for i in parts]
    squares = np.einsum(
        "pij,kpj->kpi", np.linalg.inv(roots[source]), rows.reshape(len(rows), len(roots), 3)
    )
    lengths: FloatArray = np.linalg.norm(squares.reshape(rows.shape), axis=1)
    return lengths


def _rank(rows: FloatArray) -> int:
    return int(np.linalg.matrix_rank(rows, tol=NEGLIGIBLE)) if len(rows) else 0


def _given(constraints: Constraints, right: FloatArray) -> dict[tuple[int, int], int]:
    """Rows of no joint that fix a coordinate of a part, by the part and the coordinate."""
    fixed = (constraints.parts[:, 0] == GROUND) & ~np.isnan(right)
    fixed &= np.sum(constraints.slopes[:, 1] != 0, axis=1) == 1
    fixed &= constraints.slopes[:, 1].max(axis=1) == 1
    fixed[: constraints.first_rows[-1]] = False
    rows = np.flatnonzero(fixed)
    axes = np.argmax(constraints.slopes[rows, 1], axis=1)
    parts = constraints.parts[rows, 1]
    return dict(zip(zip(parts.tolist(), axes.tolist(), strict=True), rows.tolist(), strict=True))


@dataclass(frozen=True)
class _Hung:
    """How each part moves on its parent: ``x = carried x_parent + offset + free u``, any u.

    Arrays (parts, 3, 3) and (parts, 3); `filling` has ones where a column of `free` is empty.
    """

    carried: FloatArray
    offset: FloatArray
    free: FloatArray
    filling: FloatArray


def scale_roots(mechanism: Mechanism) -> FloatArray:
    """Metric, see `LeastMotion`, that weighs the reach of each part and a radian alike."""
    scales = np.array([(1 / part.reach, 1 / part.reach, 1.0) for part in mechanism.parts])
    return scales[:, :, None] * np.eye(3)


def whole_roots(mechanism: Mechanism, q: FloatArray) -> FloatArray:
    """As `scale_roots` for bodies that move as one: the first part of each counts for all of it."""
    roots = np.zeros((len(q), 3, 3))
    for parts in mechanism.bodies.values():
        first = parts[0]
        reaches = np.array([mechanism.parts[i].reach for i in parts])
        arms = np.hypot(*(q[list(parts), :2] - q[first, :2]).T) / reaches
        along, turning = np.sqrt(np.sum(reaches**-2.0)), np.sqrt(np.sum(arms**2 + 1.0))
        roots[first] = np.diag([along, along, turning])
    return roots


# --- the spanning tree ---------------------------------------------------------------------------


@dataclass(frozen=True)
class Spanning:
    """By part: its parent (GROUND, too, if it is free) and its joint (NO_ITEM if it is free).

    `order` has parents before their children. Joints are numbered as in `constraint_rows`.
    """

    order: tuple[int, ...]
    parents: tuple[int, ...]
    joints: tuple[int, ...]


def spanning_tree(mechanism: Mechanism) -> Spanning:
    """Find a spanning tree of pins, welds and slides.

    A body's own hinges come first: it is the joints of the scene that close its loops.
    """
    held = (*mechanism.attachments, *mechanism.slides)
    ends = [(joint.first.part, joint.second.part) for joint in held]
    neighbours = defaultdict[int, list[tuple[int, int]]](list)
    for joint in _without_loops(mechanism, ends):
        for part, other in (ends[joint], ends[joint][::-1]):
            neighbours[part].append((joint, other))
    count = len(mechanism.parts)
    parents, joints, order = [GROUND] * count, [NO_ITEM] * count, list[int]()
    seen = {GROUND}
    for start in (GROUND, *range(count)):
        waiting = [start] if start == GROUND or start not in seen else []
        while waiting:
            part = waiting.pop()
            if part != GROUND:
                order.append(part)
            seen.add(part)
            for joint, other in neighbours[part]:
                if other not in seen:
                    parents[other], joints[other] = part, joint
                    waiting.append(other)
    return Spanning(tuple(order), tuple(parents), tuple(joints))


def within_body(mechanism: Mechanism, first: int, second: int) -> bool:
    """Tell whether two parts are of one body."""
    parts = mechanism.parts
    return GROUND not in (first, second) and parts[first].body == parts[second].body


def _without_loops(mechanism: Mechanism, ends: Sequence[tuple[int, int]]) -> list[int]:
    """Joints that connect what is not connected yet, those within bodies first."""
    hinges = [joint for joint, pair in enumerate(ends) if within_body(mechanism, *pair)]
    leader = {part: part for part in range(GROUND, len(mechanism.parts))}

    def leader_of(part: int) -> int:
        while leader[part] != part:
            leader[part] = part = leader[leader[part]]
        return part

    kept = []
    for joint in dict.fromkeys((*hinges, *range(len(ends)))):
        first, second = (leader_of(part) for part in ends[joint])
        if first != second:
            leader[first] = second
            kept.append(joint)
    return kept
