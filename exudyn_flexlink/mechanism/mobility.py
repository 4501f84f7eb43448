"""Which bodies can move, and what of that the drives leave to forces."""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism.assembly import Assembly, State
from exudyn_flexlink.mechanism.constraints import constraint_rows
from exudyn_flexlink.mechanism.model import Mechanism

DEPENDENT = 1e-9  # of a motion's size: less than this of a coordinate is rounding


def moved_by_forces(assembly: Assembly) -> list[str]:
    """Names of the bodies that can move while every speed drive stands still.

    A flexible body counts as straight here: that it bends is no motion of the others.
    """
    mechanism = assembly.mechanism
    rows = rigid_jacobian(mechanism, assembly.state)
    sizes = np.linalg.norm(null_space(rows).reshape(len(mechanism.bodies), -1), axis=1)
    return [body for body, size in zip(mechanism.bodies, sizes, strict=True) if size > DEPENDENT]


def rigid_jacobian(mechanism: Mechanism, state: State) -> FloatArray:
    """Jacobian of joints and drives (rows, 3 bodies); bodies move as one with their first part."""
    firsts = [parts[0] for parts in mechanism.bodies.values()]
    joints = constraint_rows(mechanism, state.q, state.places)
    rows = np.zeros((len(joints), 3 * len(firsts)))
    for body, parts in enumerate(mechanism.bodies.values()):
        for part in parts:
            arm = state.q[part, :2] - state.q[firsts[body], :2]
            carried = np.array([[1.0, 0.0, -arm[1]], [0.0, 1.0, arm[0]], [0.0, 0.0, 1.0]])
            for side in (0, 1):
                own = joints.parts[:, side] == part
                rows[own, 3 * body : 3 * body + 3] += joints.slopes[own, side] @ carried
    return rows


def null_space(rows: FloatArray) -> FloatArray:
    """Motions (coordinates, freedoms) that all rows allow, perpendicular and of length 1."""
    _, sizes, directions = np.linalg.svd(rows)
    rank = int((sizes > DEPENDENT * sizes.max(initial=0.0)).sum())
    return np.asarray(directions[rank:].T)
