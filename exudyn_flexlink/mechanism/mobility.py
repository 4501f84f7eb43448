"""Which bodies can move, what drives leave to forces, and other ways to close the joints."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.mechanism.assembly import Assembly, State, without_play
from exudyn_flexlink.mechanism.closing import (
    CannotAssembleError,
    Start,
    shuffled,
    straight_positions,
)
from exudyn_flexlink.mechanism.constraints import constraint_rows
from exudyn_flexlink.mechanism.model import GROUND, Mechanism

DEPENDENT = 1e-9  # of a motion's size: less than this of a coordinate is rounding
STARTS = 24  # searches, each from other guesses: four-bars and sliders show both ways by the third
SAME = 1e-6  # rad: by so little or less the angles of one way differ


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
    # What is the ground counts as one of the parts that the same row moves.
    moved = joints.parts.max(axis=1, keepdims=True)
    ends = body_of[np.where(moving, joints.parts, moved)]
    group_of = _connected(len(firsts), ends)
    by_group = np.argsort(group_of, kind="stable")
    for bodies in np.split(by_group, np.flatnonzero(np.diff(group_of[by_group])) + 1):
        own = np.flatnonzero(group_of[ends[:, 0]] == group_of[bodies[0]])
        rows = np.zeros((len(own), len(bodies), 3))
        for side in range(ends.shape[1]):
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


def shared_forces(assembly: Assembly) -> set[str]:
    """Names of the joints whose forces the motion does not tell, for others hold the same."""
    if not assembly.surplus:
        return set()
    joints = constraint_rows(assembly.mechanism, assembly.state.q, assembly.state.places)
    idle = np.abs(_null_space(joints.jacobian().T)).max(axis=1, initial=0.0) > DEPENDENT
    starts = joints.first_rows[:-1]
    return {name for name, any_idle in zip(joints.names, np.logical_or.reduceat(idle, starts),
                                           strict=True) if any_idle}  # fmt: skip


def other_branches(assembly: Assembly, start: Start) -> list[FloatArray]:
    """Angles (parts,) in rad of every other way to close the joints that a few searches find.

    What is free to move stays where the assembly has it, and so does what `start` holds. Flexible
    bodies are straight in all of them.
    """
    mechanism = assembly.mechanism
    bodies = list(mechanism.bodies.values())
    firsts = [parts[0] for parts in bodies]
    held = _independent(assembly)
    at = assembly.state.q
    angles = dict(start.angles)
    for body, axis in held:
        if axis == 2:
            angles |= {part: float(at[part, 2]) for part in bodies[body]}
    places = {firsts[body]: (float(x), float(y)) for body, axis in held if axis < 2
              for x, y in [at[firsts[body], :2]]}  # fmt: skip
    fixed = replace(start, angles=angles, positions={**start.positions, **places})
    loose = [parts for parts in bodies if parts[0] not in angles]
    return _searched(assembly, fixed, loose) if loose else []


def _searched(assembly: Assembly, fixed: Start, loose: list[tuple[int, ...]]) -> list[FloatArray]:
    mechanism = without_play(assembly.mechanism, set(fixed.angles))
    known = [assembly.state.q[:, 2]]
    for start in shuffled(fixed, loose, STARTS):
        try:
            q, _ = straight_positions(mechanism, start)
        except CannotAssembleError:
            continue
        if all(_apart(q[:, 2], angles) > SAME for angles in known):
            known.append(q[:, 2])
    return known[1:]


def _apart(one: FloatArray, other: FloatArray) -> float:
    """Largest difference of two sets of angles, whole turns left out."""
    return float(np.abs(np.angle(np.exp(1j * (one - other)))).max(initial=0.0))


def _independent(assembly: Assembly) -> list[tuple[int, int]]:
    """Coordinates (body, axis) that decide where all bodies stand; angles are preferred."""
    # What a drive, or a gear, moves is free here, and then held where it stands.
    without = replace(without_play(assembly.mechanism, set()), speed_motors=(), gears=())
    found = []
    for bodies, free in free_motions(without, assembly.state):
        motions = free
        for axis in (2, 0, 1):
            for k, body in enumerate(bodies.tolist()):
                left = motions[3 * k + axis]
                size = float(np.linalg.norm(left))
                if size > DEPENDENT:
                    found.append((body, axis))
                    motions = motions - np.outer(motions @ left, left) / size**2
    return found
