"""Which bodies can move, and what of that the drives leave to forces."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.mechanism.assembly import Assembly, State
from exudyn_flexlink.mechanism.constraints import constraint_rows
from exudyn_flexlink.mechanism.model import Mechanism
from exudyn_flexlink.mechanism.parts import GROUND

DEPENDENT = 1e-9  # of a motion's size: less than this of a coordinate is rounding


def moved_by_forces(assembly: Assembly) -> list[str]:
    """Names of the bodies that can move while every speed drive stands still.

    A flexible body counts as straight here: that it bends is no motion of the others.
    """
    mechanism = assembly.mechanism
    names, moved = list(mechanism.bodies), set[int]()
    for bodies, motions in free_motions(mechanism, assembly.state):
        sizes = np.linalg.norm(motions.reshape(len(bodies), -1), axis=1)
        moved |= set(bodies[sizes > DEPENDENT].tolist())
    return [name for body, name in enumerate(names) if body in moved]


def free_motions(mechanism: Mechanism, state: State) -> Iterator[tuple[IndexArray, FloatArray]]:
    """Give bodies (n,) that joints and drives connect, with all motions (3 n, freedoms) they allow.

    Bodies move as one with their first part. Those that nothing connects are solved apart, so that
    the work grows with the cube of a group, not of the mechanism.
    """
    firsts = np.array([parts[0] for parts in mechanism.bodies.values()], dtype=int)
    body_of = np.repeat(np.arange(len(firsts)), [len(p) for p in mechanism.bodies.values()])
    joints = constraint_rows(mechanism, state.q, state.places)
    carried = np.tile(np.eye(3), (len(body_of), 1, 1))
    arms = state.q[:, :2] - state.q[firsts[body_of], :2]
    carried[:, 0, 2], carried[:, 1, 2] = -arms[:, 1], arms[:, 0]
    moving = joints.parts != GROUND
    slopes = np.where(moving[:, :, None], joints.slopes, 0.0)[:, :, None] @ carried[joints.parts]
    ends = np.where(moving, body_of[joints.parts], body_of[joints.parts[:, ::-1]])
    group_of = _connected(len(firsts), ends)
    by_group = np.argsort(group_of, kind="stable")
    for bodies in np.split(by_group, np.flatnonzero(np.diff(group_of[by_group])) + 1):
        own = np.flatnonzero(group_of[ends[:, 0]] == group_of[bodies[0]])
        rows = np.zeros((len(own), len(bodies), 3))
        for side in (0, 1):
            np.add.at(rows, (np.arange(len(own)), np.searchsorted(bodies, ends[own, side])),
                      slopes[own, side, 0])  # fmt: skip
        yield bodies, _null_space(rows.reshape(len(own), 3 * len(bodies)))


def _connected(bodies: int, ends: IndexArray) -> IndexArray:
    """Give each body the number of its group: that of the first body in it."""
    # SciPy has this, too, but `check` would wait for its import.
    groups, before = np.arange(bodies), np.full(bodies, -1)
    while (groups != before).any():
        before = groups.copy()
        np.minimum.at(groups, ends, before[ends].min(axis=1)[:, None])
        groups = groups[groups]
    return groups


def _null_space(rows: FloatArray) -> FloatArray:
    """Motions (coordinates, freedoms) that all rows allow, perpendicular and of length 1."""
    _, sizes, directions = np.linalg.svd(rows)
    rank = int((sizes > DEPENDENT * sizes.max(initial=0.0)).sum())
    return np.asarray(directions[rank:].T)
