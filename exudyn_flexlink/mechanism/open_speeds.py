"""Speeds at time 0 that neither joints nor drives nor the scene decide.

Bodies turn as little as the joints allow, the sum of the squares of their angular speeds being
least. What this leaves open are flights and slides: then the points by which bodies hang on others
move as little as they can. Neither depends on where a body's axes are put, nor on units.
"""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism.constraints import Constraints
from exudyn_flexlink.mechanism.least_motion import (
    NOTHING,
    LeastMotion,
    scale_roots,
    spanning_tree,
    within_body,
)
from exudyn_flexlink.mechanism.model import Mechanism
from exudyn_flexlink.mechanism.parts import Anchor

SECOND = 0.1  # rad/s: as much counts 1 m/s of a point, in a mechanism with 1 m from end to end
SETTLED = 1e-12  # of the largest speed: a change by less is rounding
MOST_ROUNDS = 50  # each leaves about SECOND^2 of what is missing, of many parts in a row more


def least_speeds(
    mechanism: Mechanism,
    rows: Constraints,
    right: FloatArray,
    q: FloatArray,
    rigid: bool = False,
) -> FloatArray:
    """Velocities (parts, 3) at `q` that satisfy rows, as far as they can, and are least.

    With `rigid` every body moves as one, and counts once.
    """
    roots = _roots(mechanism, q, rigid)
    motion = LeastMotion(mechanism, rows, roots, right, rigid)
    # What comes second weighs little, and that it weighs at all is mended in rounds: each asks for
    # the speeds of points that the one before found (the proximal point algorithm).
    points = roots[:, :, :2] @ roots[:, :, :2].transpose(0, 2, 1)
    v = motion.nearest()
    for _ in range(MOST_ROUNDS):
        before, v = v, motion.nearest(np.einsum("pij,pj->pi", points, v))
        if np.abs(v - before).max(initial=0.0) <= SETTLED * np.abs(v).max(initial=0.0):
            break
    # So little weight costs digits: the next speeds in an even metric have them all.
    even = scale_roots(mechanism)
    wanted = np.einsum("pij,pj->pi", even @ even.transpose(0, 2, 1), v)
    return LeastMotion(mechanism, rows, even, right, rigid).nearest(wanted)


def _roots(mechanism: Mechanism, q: FloatArray, rigid: bool) -> FloatArray:
    """Metric, see `LeastMotion`: of the points by which parts hang, and of their turning."""
    size = sum(part.reach for part in mechanism.parts)  # so many may hang one on another
    roots = np.zeros((len(mechanism.parts), 3, 3))
    for part, (x, y) in _hung_by(mechanism, rigid).items():
        cos, sin = np.cos(q[part, 2]), np.sin(q[part, 2])
        across, along = cos * x - sin * y, sin * x + cos * y
        roots[part, :, 0] = np.array([1.0, 0.0, -along]) * SECOND / size
        roots[part, :, 1] = np.array([0.0, 1.0, across]) * SECOND / size
        roots[part, 2, 2] = 1.0
    return roots


def _hung_by(mechanism: Mechanism, rigid: bool) -> dict[int, tuple[float, float]]:
    """Points (m, in their own axes) by which parts hang: in a joint, a slot, or at their centre.

    With `rigid` only of the part by which a whole body hangs.
    """
    tree = spanning_tree(mechanism)
    joints = [*mechanism.attachments, *mechanism.slides]
    in_slots = {slot.anchor.part: slot.anchor for slot in reversed(mechanism.slots)}
    found = {}
    for part in tree.order:
        parent, joint = tree.parents[part], tree.joints[part]
        if rigid and within_body(mechanism, part, parent):
            continue
        at = in_slots.get(part, Anchor(part, *mechanism.parts[part].centre))
        if joint != NOTHING:
            ends = joints[joint].first, joints[joint].second
            at = next(end for end in ends if end.part == part)
        found[part] = at.x, at.y
    return found
