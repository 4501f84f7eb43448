"""Contacts that close, or rest, at one instant: of each, the impulse or the speed is zero.

The linear complementarity problem of a few contacts is solved by trying which of them act:
``w = W p + c >= 0``, ``p >= 0``, ``p w = 0`` for a W (c, c) of no negative eigenvalues. In this way
contacts that close at one instant act on each other; p are impulses, or forces (F. Pfeiffer and
Ch. Glocker, *Multibody Dynamics with Unilateral Contacts*, Wiley 1996, ch. 5 and 8). The work
doubles with every contact, but few close at once.

Where contacts rub, each has one of four modes: it stays open, sticks, or slides either way. With W
(2c, 2c) the speeds across and along all contacts by impulses across and along, Newton's restitution
and Coulomb's friction,

    g = g_a + W_nn N + W_nt T,    s = s_a + W_tn N + W_tt T,
    0 <= N,  g + e g_a >= 0,  N (g + e g_a) = 0,
    s > 0: T = -mu N,   s < 0: T = mu N,   s = 0: |T| <= mu N

(J. J. Moreau, in *Nonsmooth Mechanics and Applications*, Springer 1988; Ch. Glocker and
F. Pfeiffer, Nonlinear Dyn. 7 (1995) 471). All 4^c modes are tried. With a restitution there may be
no answer, several, or one that gains energy: then the law tells nothing.
"""

from __future__ import annotations

from itertools import combinations, product
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.rounding import SOLVED

MOST_RUBBING = 6  # contacts: 4096 modes, half a second
# Of the largest speed, or impulse: two answers that differ by less count as the same.
SAME_ANSWER = 1e-8


def complementary(mobility: FloatArray, free: FloatArray, *, symmetric: bool = True) -> FloatArray:
    """Return p (c,) of W, the `mobility` (c, c), and c, the speeds or accelerations `free` (c,).

    Where several p solve the problem, it is the one with most contacts that act. W is `symmetric`
    without friction.

    Raises:
        ArithmeticError: there is no p: the contacts can't hold what drives them.

    """
    count = len(free)
    rounding = SOLVED * float(np.abs(free).max(initial=0.0))
    for acting in range(count, -1, -1):
        for chosen in combinations(range(count), acting):
            push = np.zeros(count)
            closed = list(chosen)
            if closed:
                within = mobility[np.ix_(closed, closed)]
                push[closed] = -least_inverse(within, symmetric=symmetric) @ free[closed]
            speed = mobility @ push + free
            if push.min(initial=0.0) < -SOLVED * float(np.abs(push).max(initial=0.0)):
                continue
            held = np.abs(speed[closed]).max(initial=0.0) <= rounding
            if held and speed.min(initial=0.0) >= -rounding:
                return np.maximum(push, 0.0)
    if count == 1:
        raise ArithmeticError("the contact that closes can't hold what drives it")
    raise ArithmeticError("contacts that close at one instant can't hold what drives them")


def least_inverse(mobility: FloatArray, *, symmetric: bool = True) -> FloatArray:
    """Inverse of mobilities (..., c, c); the pseudo-inverse where contacts depend on others."""
    return np.asarray(np.linalg.pinv(mobility, rcond=SOLVED, hermitian=symmetric))


class RubbingImpact(NamedTuple):
    """Impulses (c,) across and along contacts, N s, and speeds (c,) after them, m/s."""

    across: FloatArray
    along: FloatArray
    gap_rate: FloatArray
    slip: FloatArray


OPEN, STICKS, SLIDES, SLIDES_BACK = range(4)


def rubbing_impact(
    mobility: FloatArray,
    before: FloatArray,
    restitution: FloatArray,
    friction: FloatArray,
    moved: FloatArray | None = None,
) -> RubbingImpact:
    """Return what contacts (c,) do in an impact with Newton's restitution and Coulomb's friction.

    Args:
        mobility: Speeds (2c, 2c), first all across, then all along contacts, by impulses, 1/kg.
        before: Rates of the gaps, and speeds along the contacts, before (2c,), m/s.
        restitution: Coefficients (c,) of restitution.
        friction: Coefficients (c,) of friction; 0 of one that is smooth.
        moved: Speeds (2c,) that other impulses of the same instant add, m/s; left out, none.

    Raises:
        ArithmeticError: no impulses fit, several fit that lead to different speeds, those that fit
            gain energy, or there are more than `MOST_RUBBING` contacts.

    """
    count = len(restitution)
    if count > MOST_RUBBING:
        raise ArithmeticError(f"friction in impacts is known of {MOST_RUBBING} contacts at most")
    begin = before if moved is None else before + moved
    # Units are chosen so that an impulse of 1 in a contact alone changes its speed by 1.
    scale = np.sqrt(np.diag(mobility))
    scale = np.where(scale > 0, scale, scale.max(initial=0.0) or 1.0)
    system = mobility / scale[:, None] / scale
    start = begin / scale
    closing = (begin[:count] + restitution * before[:count]) / scale[:count]
    grips = friction * scale[count:] / scale[:count]
    choices = [(OPEN, STICKS, SLIDES, SLIDES_BACK) if mu > 0 else (OPEN, SLIDES) for mu in friction]
    modes = np.array(list(product(*choices)))
    equations, right = _equations(modes, system, closing, start[count:], grips)
    impulses = (np.linalg.pinv(equations, rcond=SOLVED) @ right[..., None])[..., 0]
    impulses[np.tile(modes == OPEN, 2)] = 0.0  # exactly
    residual = (equations @ impulses[..., None])[..., 0] - right
    off = np.abs(residual).max(axis=1, initial=0.0)
    after = start + impulses @ system.T
    largest = max(np.abs(start).max(initial=0.0), np.abs(closing).max(initial=0.0))
    rounding = SOLVED * largest
    across, along = impulses[:, :count], impulses[:, count:]
    opens = closing + after[:, :count] - start[:count]
    grip = grips * across - np.abs(along)
    ways = np.select([modes == SLIDES, modes == SLIDES_BACK], [1.0, -1.0], 0.0)
    slides = ways * after[:, count:] * (friction > 0)
    margins = np.concatenate([across, opens, grip, slides], axis=1)
    least = margins.min(axis=1, initial=0.0)
    fits = (least >= -rounding) & (off <= rounding)
    if not fits.any():
        raise ArithmeticError("no impulses fit restitution and friction of all of them")
    answers, ends = impulses[fits], after[fits]
    apart = np.abs(ends - ends[0]).max(initial=0.0)
    fastest = max(np.abs(ends).max(initial=0.0), np.abs(start).max(initial=0.0))
    if apart > SAME_ANSWER * fastest:
        raise ArithmeticError("friction leaves more than one answer for what they do")
    # Of answers with the same speeds, the one whose largest impulse is least.
    best = np.abs(answers).max(axis=1, initial=0.0).argmin()
    impulse = answers[best] / scale
    end = ends[best] * scale
    if gains_energy(impulse, begin, end):
        raise ArithmeticError("restitution with friction would gain energy there")
    return RubbingImpact(impulse[:count], impulse[count:], end[:count], end[count:])


def gains_energy(impulse: FloatArray, begin: FloatArray, end: FloatArray) -> bool:
    """Tell whether impulses (k,) supply energy, by speeds of their places before and after."""
    size = np.abs(impulse) @ (np.abs(begin) + np.abs(end))
    return bool(impulse @ (begin + end) > SAME_ANSWER * size)


def _equations(
    modes: FloatArray, system: FloatArray, closing: FloatArray, slip: FloatArray, grips: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Matrices (modes, 2c, 2c) and right sides (modes, 2c) of the impulses' equations in each mode.

    `closing` (c,) is g_a (1 + e), `slip` (c,) is s_a, and `grips` (c,) are mu, all scaled.
    """
    count = len(closing)
    identity = np.eye(2 * count)
    closed, sticks = (modes != OPEN)[..., None], (modes == STICKS)[..., None]
    way = np.select([modes == SLIDES, modes == SLIDES_BACK], [1.0, -1.0], 0.0)
    slides = identity[count:] + (way * grips)[..., None] * identity[:count]
    across = np.where(closed, system[:count], identity[:count])
    along = np.where(sticks, system[count:], slides)
    opened = np.where(closed[..., 0], -closing, 0.0)
    stopped = np.where(sticks[..., 0], -slip, 0.0)
    matrices = np.concatenate([across, along], axis=1)
    return matrices, np.concatenate([opened, stopped], axis=1)
