"""What each of several joints holds by dry friction that rest, where more do than have freedoms."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.optimize import linprog
from scipy.sparse.csgraph import connected_components

from exudyn_flexlink.arrays import FloatArray, IndexArray

COUPLED = 1e-9  # of joints that move each other: less is rounding
LEAST_BOUND = 1e-30  # N m or N: of what no force presses together


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
    """T (n, block) that do the same as some, by the least largest part of their bounds."""
    found = np.empty_like(torque)
    bound = np.maximum(bound, LEAST_BOUND)
    for i, (own, most, rows) in enumerate(zip(torque, bound, g, strict=True)):
        arms = rows.T * most  # (independent, block)
        whole, count = arms @ (own / most), len(own)
        within = np.hstack([np.vstack([np.eye(count), -np.eye(count)]), -np.ones((2 * count, 1))])
        size = max(float(np.abs(arms).max()), LEAST_BOUND)
        answer = linprog(
            np.append(np.zeros(count), 1.0), within, np.zeros(2 * count),
            np.hstack([arms, np.zeros((len(arms), 1))]) / size, whole / size, (None, None),
        )  # fmt: skip
        part = own / most if answer.x is None else answer.x[:count]
        part = part + np.linalg.pinv(arms, rcond=COUPLED) @ (whole - arms @ part)
        found[i] = part * most
    return found
