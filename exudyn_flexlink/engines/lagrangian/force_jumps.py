"""Contacts whose force leaps within a step: what that means for the step's estimated error."""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.lagrangian.compiled import inlined
from exudyn_flexlink.engines.lagrangian.equations import PENALTY
from exudyn_flexlink.engines.lagrangian.faces import LAW, touches
from exudyn_flexlink.engines.lagrangian.mode import Instant, Mode, coordinates_at
from exudyn_flexlink.engines.lagrangian.penalty import penalty_force
from exudyn_flexlink.engines.lagrangian.step_arrays import Method, Work
from exudyn_flexlink.engines.lagrangian.stiffness import accelerated_by, pressing_at

STEADY = 0.5  # of a contact's damping: steps in which more is left are smooth enough for the stages
PLACES, WEIGHTS = np.polynomial.legendre.leggauss(12)
PLACES, WEIGHTS = (PLACES + 1) / 2, WEIGHTS / 2  # of Gauss's rule within a step


def force_jumps(
    at: Instant, h: float, pressing: FloatArray, mode: Mode, means: tuple[Method, Work]
) -> tuple[FloatArray, FloatArray]:
    """How contacts press where they do it least (c, 3), and errors (f,) of the free speeds.

    `pressing` is how they do at the step's start. A contact that creeps is a stiff damper: it wipes
    out errors, and the filter of the estimate must know that. But the damper fades while the point
    speeds up to lift off, and what it no longer wipes out counts. Where it fades like that, what
    forces do between the stages counts, too: the embedded formula does not see it.
    """
    method, work = means
    least, hardest = pressing.copy(), pressing[:, 1].copy()
    for i in range(len(work.states)):
        found = pressing_at(_stage(i, at, h, method, work), mode)
        for k in range(len(least)):
            hardest[k] = max(hardest[k], found[k, 1])
            for m in range(3):
                least[k, m] = min(least[k, m], found[k, m])
    steady = True  # where no contact damps, a leap may lie in between
    for k in range(len(least)):
        steady = steady and least[k, 1] > STEADY * hardest[k]
    if steady:
        return least, np.zeros(len(mode.constants.inertias) - int(mode.drive[0]))
    return least, _missed(at, h, mode, method, work)


@inlined
def _stage(i: int, at: Instant, h: float, method: Method, work: Work) -> Instant:
    return Instant(at.t + method.nodes[i] * h, work.states[i], work.near[i])


@inlined
def _missed(at: Instant, h: float, mode: Mode, method: Method, work: Work) -> FloatArray:
    """Errors of the free speeds: impulses along the step's polynomial less those by the stages."""
    c = mode.constants
    stages = len(work.states)
    rows = np.empty((stages + 1, len(mode.acting), 2))  # gaps and their rates
    q, v, point, _, _ = coordinates_at(at, mode)
    first, gradients, _ = touches(q, v, point, c)
    for k in range(len(first)):
        rows[0, k, 0], rows[0, k, 1] = first[k, 0], first[k, 2]
    for i in range(stages):
        q1, v1, point1, _, _ = coordinates_at(_stage(i, at, h, method, work), mode)
        later, _, _ = touches(q1, v1, point1, c)
        for k in range(len(later)):
            rows[i + 1, k, 0], rows[i + 1, k, 1] = later[k, 0], later[k, 2]
    impulses = np.zeros(len(q))
    for k in range(len(mode.acting)):
        if mode.acting[k] == PENALTY:
            impulse = _impulse(h, rows[:, k], c.faces[k, LAW:], method)
            for j in range(len(q)):
                impulses[j] += gradients[k, j] * impulse
    return accelerated_by(impulses, q, point, mode)


@inlined
def _impulse(h: float, rows: FloatArray, law: FloatArray, method: Method) -> float:
    """By how much a contact's impulse along the polynomial differs from that by the stages, N s.

    `rows` (1 + s, 2) are gap and rate at the step's start and at the stages; `law` as in `penalty`.
    """
    matrix, powers = method.matrix, method.powers
    stages = len(rows) - 1
    impulse = 0.0
    for i in range(stages):
        force = penalty_force(min(rows[i + 1, 0], 0.0), rows[i + 1, 1], law)
        impulse -= matrix[stages - 1, i] * force
    for j in range(len(PLACES)):
        gap, rate, power = rows[0, 0], rows[0, 1], 1.0
        for k in range(stages):
            power *= PLACES[j]
            for i in range(stages):
                weight = power * powers[k, i]
                gap += weight * (rows[i + 1, 0] - rows[0, 0])
                rate += weight * (rows[i + 1, 1] - rows[0, 1])
        impulse += WEIGHTS[j] * penalty_force(min(gap, 0.0), rate, law)
    return h * impulse
