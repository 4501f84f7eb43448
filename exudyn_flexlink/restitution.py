"""Restitution of damped contact laws: which factor gives which, and the factors of some authors."""

from __future__ import annotations

from collections.abc import Callable
from math import log1p

ELASTIC = 1e-6  # of a factor: below it closed forms lose more digits than their series leaves out
BELOW_ONE = 1 - 1e-15


def restitution_of(factor: float) -> float:
    """Speed after an impact over speed before, by the factor a of `laws.PowerPenalty`.

    It solves ``a (1 + e) = ln[(1 + a)/(1 - a e)]``: the same penetration is reached from both
    speeds in the plane of depth and rate (D. W. Marhefka, D. E. Orin, IEEE Trans. Syst. Man Cybern.
    A 29 (1999) 566). Stiffness, exponent, mass and speed have no part in it.
    """
    if factor < ELASTIC:
        return 1 - 2 * factor / 3
    most = min(1.0, BELOW_ONE / factor)
    if _unbalanced(factor, most) <= 0:
        return most
    return _root(lambda e: _unbalanced(factor, e), 0.0, most)


def _unbalanced(factor: float, restitution: float) -> float:
    """Right side less left side of the equation that `restitution_of` solves."""
    back = factor * restitution
    return (log1p(factor) - factor) - (log1p(-back) + back)


def _exact(restitution: float) -> float:
    """Factor that returns the restitution asked."""
    low = 1.5 * (1 - restitution)  # returns more than asked
    high = BELOW_ONE / restitution
    if low < ELASTIC or _unbalanced(high, restitution) <= 0:
        return low if low < ELASTIC else high
    return _root(lambda a: _unbalanced(a, restitution), low, high)


def _root(of: Callable[[float], float], low: float, high: float) -> float:
    from scipy.optimize import brentq  # noqa: PLC0415 - takes a second, which `check` saves

    return float(brentq(of, low, high, xtol=1e-16))


FACTORS: dict[str, Callable[[float], float]] = {
    "hunt_crossley": lambda e: 1.5 * (1 - e),
    "lankarani_nikravesh": lambda e: 0.75 * (1 - e * e),
    "flores": lambda e: 1.6 * (1 - e) / e,
    "gonthier": lambda e: (1 - e * e) / e,
    "exact": _exact,
}
"""Factors a of `laws.PowerPenalty` by the restitution e that is asked (0 to 1; the last 3: not 0).

K. H. Hunt, F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440; H. M. Lankarani, P. E. Nikravesh,
J. Mech. Des. 112 (1990) 369; P. Flores et al., Multibody Syst. Dyn. 25 (2011) 357; Y. Gonthier et
al., Multibody Syst. Dyn. 11 (2004) 209.
"""
