"""What each of several joints holds by dry friction that rest, where more do than have freedoms."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.optimize import linprog, lsq_linear
from scipy.sparse.csgraph import connected_components

from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.integrate.complementarity import RANK, least_inverse

SOLVED = 1e-15  # of a sum of squares: a search that gains less is over
COUPLED = 1e-9  # of joints that move each other: less is rounding
LEAST_BOUND = 1e-30  # N m or N: of what no force presses together


def within_bounds(mobility: FloatArray, free: FloatArray, bound: FloatArray) -> FloatArray:
    """T (k,) that make ``T W T/2 + free T`` least for a mobility W (k, k), none beyond its bound.

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
    most = np.maximum(bound, LEAST_BOUND) / scale
    wanted = -(free * scale) @ ways / root
    found = lsq_linear((ways * root).T, wanted, (-most, most), "bvls", tol=SOLVED)
    at_bounds = found.active_mask != 0
    return np.asarray(np.where(at_bounds, found.active_mask * bound, found.x * scale))


def scaled_inverse(mobility: FloatArray) -> FloatArray:
    """Inverse of mobilities (..., c, c), least where joints depend; zero where none can move."""
    own = np.diagonal(mobility, axis1=-2, axis2=-1)
    scale = np.divide(1.0, np.sqrt(own), where=own > 0, out=np.zeros(own.shape))
    both = scale[..., :, None] * scale[..., None, :]
    return np.asarray(least_inverse(mobility * both) * both)


def dependent(mobility: FloatArray, held: IndexArray) -> Iterator[IndexArray]:
    """Joints at rest that move each other, where more do than there are freedoms between them."""
    held = held[np.diag(mobility)[held] > 0]
    if len(held) < 2:
        return
    scale = 1 / np.sqrt(np.diag(mobility)[held])
    coupled = mobility[np.ix_(held, held)] * scale[:, None] * scale
    count, group_of = connected_components(np.abs(coupled) > COUPLED)
    for group in range(count):
        block = np.flatnonzero(group_of == group)
        own = coupled[np.ix_(block, block)]
        if np.linalg.matrix_rank(own, COUPLED, hermitian=True) < len(block):
            yield held[block]


def least_part(torque: FloatArray, bound: FloatArray, g: FloatArray) -> FloatArray:
    """T (n, block) that do the same as some, by the least largest part of their bounds.

    `g` (n, block, independent) is what each does. Where joints have one freedom between them all
    take the same part; else that is a linear programme.
    """
    bound = np.maximum(bound, LEAST_BOUND)
    arms = g * bound[..., None]
    ways, sizes, _ = np.linalg.svd(arms, full_matrices=False)
    if sizes.shape[1] < 2 or (sizes[:, 1] <= COUPLED * sizes[:, 0]).all():
        by_motion = sizes[:, :1] * ways[..., 0]
        done = (by_motion * torque / bound).sum(axis=1) / np.abs(by_motion).sum(axis=1)
        return np.asarray(np.sign(by_motion) * done[:, None] * bound)
    columns = zip(torque / bound, ways, sizes, strict=True)
    return np.array([_least_largest(*own) for own in columns]) * bound


def _least_largest(part: FloatArray, ways: FloatArray, sizes: FloatArray) -> FloatArray:
    """Parts (block,) of bounds that move as some do, `ways` (block, motions), by the least one."""
    arms = ways[:, sizes > COUPLED * sizes[0]].T
    count, whole = len(part), arms @ part
    within = np.hstack([np.vstack([np.eye(count), -np.eye(count)]), -np.ones((2 * count, 1))])
    held = np.hstack([arms, np.zeros((len(arms), 1))])
    cost = np.append(np.zeros(count), 1.0)
    found = linprog(cost, within, np.zeros(2 * count), held, whole, (None, None))
    least = part if found.x is None else found.x[:count]
    return np.asarray(least + arms.T @ (whole - arms @ least))
