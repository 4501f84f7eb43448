"""The linear complementarity problem of a few contacts, by looking through which of them act.

``w = W p + c >= 0``, ``p >= 0``, ``p w = 0`` for a symmetric W (c, c) without negative eigenvalues:
what contacts that close at one instant do to each other, be p impulses or forces (F. Pfeiffer and
Ch. Glocker, *Multibody Dynamics with Unilateral Contacts*, Wiley 1996, ch. 5 and 8). The work
doubles with every contact, of which few close at once.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from exudyn_flexlink.arrays import FloatArray

ROUNDING = 1e-10  # of the largest of c, or of p: values this little below zero are zero
RANK = 1e-10  # of the largest eigenvalue of W: contacts that depend on others share the load


def complementary(mobility: FloatArray, free: FloatArray) -> FloatArray:
    """Return p (c,) of W and c; where several solve it, the one in which most contacts act.

    Raises:
        ArithmeticError: there is none: the contacts hold what can't be held.

    """
    count = len(free)
    enough = ROUNDING * float(np.abs(free).max(initial=0.0))
    for acting in range(count, -1, -1):
        for chosen in combinations(range(count), acting):
            push = np.zeros(count)
            own = list(chosen)
            if own:
                push[own] = -least_inverse(mobility[np.ix_(own, own)]) @ free[own]
            left = mobility @ push + free
            if push.min(initial=0.0) < -ROUNDING * float(np.abs(push).max(initial=0.0)):
                continue
            if left.min(initial=0.0) >= -enough and np.abs(left[own]).max(initial=0.0) <= enough:
                return np.maximum(push, 0.0)
    if count == 1:
        raise ArithmeticError("the contact that closes can't hold what drives it")
    raise ArithmeticError("contacts that close at one instant can't hold what drives them")


def least_inverse(mobility: FloatArray) -> FloatArray:
    """Inverse of mobilities (..., c, c); where contacts depend on others, for the least forces."""
    return np.asarray(np.linalg.pinv(mobility, rcond=RANK, hermitian=True))
