"""Whether anything can have happened in a step: the guards of `system`, in machine code.

Contacts are those of penalty laws. A step in which a guard may have fallen is handed to the event
loop, which looks for itself.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.lagrangian.compiled import compiled, inner
from exudyn_flexlink.engines.lagrangian.course import Equations, Instant, coordinates_at
from exudyn_flexlink.engines.lagrangian.faces import penalty_force, touches
from exudyn_flexlink.engines.lagrangian.rail import END, START

FloatArray = NDArray[np.float64]

APART, PRESSED, BEHIND = 0, 1, 2  # sides of a contact
LOOKS = 8  # guards are looked at so often within a step where something may happen
NOTHING = 1e-13  # m: a guard this little below zero is there by rounding


class Watched(NamedTuple):
    """What the guards need besides the equations."""

    sides: NDArray[np.int64]  # (c,) of the contacts
    lengths: FloatArray  # (c,) of their faces, m
    goal: FloatArray  # (4,) coordinates of the turning joint's parts (-1: ground), start, turns
    peaks: FloatArray  # (c,) largest force of each contact in steps that were let pass, N


@inner
def turns_left(q: FloatArray, goal: FloatArray) -> float:
    """Angle that is still to turn; 1 without a goal."""
    if goal[3] == 0.0:
        return 1.0
    done = -goal[2]
    if goal[1] >= 0.0:
        done += q[int(goal[1])]
    if goal[0] >= 0.0:
        done -= q[int(goal[0])]
    return float(abs(goal[3]) - (done if goal[3] > 0 else -done))


@inner
def _all_hold(at: Instant, equations: Equations, watched: Watched) -> bool:
    """Tell whether no guard has fallen at an instant; keep the largest forces."""
    course, c = equations
    q, v, root, u = coordinates_at(at, equations)
    if min(course.piece[END] - u, u - course.piece[START]) < -NOTHING:
        return False
    if turns_left(q, watched.goal) < -NOTHING:
        return False
    if len(course.acting) == 0:
        return True
    states, _, _ = touches(q, v, root, c)
    for k in range(len(course.acting)):
        gap, place, side = states[k, 0], states[k, 1], watched.sides[k]
        if side == PRESSED:
            if min(place, watched.lengths[k] - place, -gap) < -NOTHING:
                return False
            force = penalty_force(gap, states[k, 2], c.faces[k])
            watched.peaks[k] = max(watched.peaks[k], force)
        elif (gap if side == APART else -gap) < -NOTHING:
            return False
    return True


@inner
def _quiet(begin: Instant, end: Instant, equations: Equations, watched: Watched) -> bool:
    """Tell from the two ends of a step that nothing can have happened in between.

    The cubic through gaps and rates at both ends strays from them by less than a sixth of the way
    that the larger speed covers; the margin is sixfold.
    """
    course, c = equations
    q, v, root, _ = coordinates_at(begin, equations)
    q1, v1, root1, u1 = coordinates_at(end, equations)
    p = int(c.root)
    if v[p] * v1[p] < 0 or min(course.piece[END] - u1, u1 - course.piece[START]) < 0:
        return False
    if turns_left(q1, watched.goal) < 0:
        return False
    if len(course.acting) == 0:
        return True
    before, _, _ = touches(q, v, root, c)
    after, _, _ = touches(q1, v1, root1, c)
    for k in range(len(course.acting)):
        one, two = before[k, 0], after[k, 0]
        if watched.sides[k] == PRESSED or one * two <= 0:
            return False
        fastest = max(abs(before[k, 2]), abs(after[k, 2]))
        if min(abs(one), abs(two)) <= (end.t - begin.t) * fastest:
            return False
    return True


@inner
def _closing(at: Instant, equations: Equations, watched: Watched, rates: FloatArray) -> bool:
    """Tell whether a gap that closed at the last look opens now; keep the `rates` (c,), m/s.

    It may have been closed in between.
    """
    q, v, root, _ = coordinates_at(at, equations)
    states, _, _ = touches(q, v, root, equations.c)
    turned = False
    for k in range(len(rates)):
        rate = states[k, 2] if watched.sides[k] == APART else -states[k, 2]
        turned = turned or (watched.sides[k] != PRESSED and rates[k] < 0.0 < rate)
        rates[k] = rate
    return turned


@compiled
def interpolate(
    sigma: float, y: FloatArray, changes: FloatArray, powers: FloatArray, at: FloatArray
) -> None:
    """Fill in the state at the part sigma of a step from y, whose stages have the `changes`."""
    stages, size = changes.shape
    for j in range(size):
        at[j] = y[j]
    power = 1.0
    for k in range(stages):
        power *= sigma
        for m in range(stages):
            weight = power * powers[k, m]
            for j in range(size):
                at[j] += weight * changes[m, j]


@inner
def uneventful(
    begin: Instant,
    end: Instant,
    inside: tuple[FloatArray, FloatArray],
    equations: Equations,
    watched: Watched,
) -> bool:
    """Tell that no guard has fallen in a step; `inside` are its changes and the method's powers."""
    if _quiet(begin, end, equations, watched):
        return True
    y = np.empty(len(begin.y))
    rates = np.zeros(len(equations.course.acting))
    if len(rates) > 0:
        _closing(begin, equations, watched, rates)
    for k in range(1, LOOKS + 1):
        sigma = k / LOOKS
        interpolate(sigma, begin.y, inside[0], inside[1], y)
        at = Instant(begin.t + sigma * (end.t - begin.t), y, begin.near)
        if not _all_hold(at, equations, watched):
            return False
        if len(rates) > 0 and _closing(at, equations, watched, rates):
            return False
    return True
