"""Which bodies can move, what drives leave to forces, and other ways to close the joints."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism.assembly import Assembly, State, without_play
from exudyn_flexlink.mechanism.closing import CannotAssembleError, shuffled, straight_positions
from exudyn_flexlink.mechanism.constraints import constraint_rows
from exudyn_flexlink.mechanism.laying_out import Start
from exudyn_flexlink.mechanism.model import Mechanism
from exudyn_flexlink.mechanism.parts import GROUND

DEPENDENT = 1e-9  # of a motion's size: less than this of a coordinate is rounding
STARTS = 24  # searches, each from other guesses: four-bars and sliders show both ways by the third
SAME = 1e-6  # rad: by so little or less the angles of one way differ


def moved_by_forces(assembly: Assembly) -> list[str]:
    """Names of the bodies that can move while every speed drive stands still.

    A flexible body counts as straight here: that it bends is no motion of the others.
    """
    bodies = list(assembly.mechanism.bodies)
    motions = free_motions(assembly.mechanism, assembly.state)
    sizes = np.linalg.norm(motions.reshape(len(bodies), -1), axis=1)
    return [name for name, size in zip(bodies, sizes, strict=True) if size > DEPENDENT]


def free_motions(mechanism: Mechanism, state: State) -> FloatArray:
    """All motions (3 bodies, freedoms) that joints and drives allow.

    Bodies move as one with their first part.
    """
    bodies = list(mechanism.bodies.values())
    first = np.repeat([parts[0] for parts in bodies], [len(parts) for parts in bodies])
    body_of = np.append(np.repeat(np.arange(len(bodies)), list(map(len, bodies))), GROUND)
    carried = np.tile(np.eye(3), (len(body_of), 1, 1))
    arms = state.q[:, :2] - state.q[first, :2]
    carried[:-1, 0, 2], carried[:-1, 1, 2] = -arms[:, 1], arms[:, 0]
    joints = constraint_rows(mechanism, state.q, state.places)
    ends, slopes = body_of[joints.parts], joints.slopes[:, :, None] @ carried[joints.parts]
    rows = np.zeros((len(joints), len(bodies) + 1, 3))  # the ground, -1, is the last
    for side in (0, 1):
        np.add.at(rows, (np.arange(len(joints)), ends[:, side]), slopes[:, side, 0])
    between = ends[:, 0] != ends[:, 1]
    return _null_space(rows[between, :-1].reshape(-1, 3 * len(bodies)))


def _null_space(rows: FloatArray) -> FloatArray:
    """Motions (coordinates, freedoms) that all rows allow, perpendicular and of length 1."""
    _, sizes, directions = np.linalg.svd(rows)
    rank = int((sizes > DEPENDENT * sizes.max(initial=0.0)).sum())
    return np.asarray(directions[rank:].T)


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
    # What a drive moves is free here, and then held where it stands.
    without = replace(without_play(assembly.mechanism, set()), speed_motors=())
    motions, found = free_motions(without, assembly.state), []
    for axis in (2, 0, 1):
        for body in range(len(without.bodies)):
            left = motions[3 * body + axis]
            size = float(np.linalg.norm(left))
            if size > DEPENDENT:
                found.append((body, axis))
                motions = motions - np.outer(motions @ left, left) / size**2
    return found
