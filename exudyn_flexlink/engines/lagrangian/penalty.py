"""Force of a penalty law and its friction, and how both rise: in machine code.

`law` holds stiffness, restitution, transition speed, coefficient of friction and slip speed.
"""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.lagrangian.compiled import inner


@inner
def penalty_force(gap: float, gap_rate: float, law: FloatArray) -> float:
    """Force (N) of `laws.RestitutionPenalty` at a gap and its rate.

    It goes on smoothly where the gap has opened: there the contact ends, within the step.
    """
    e2 = law[1] * law[1]
    rising = np.tanh(-gap_rate / law[2])
    return float(-gap * law[0] * ((1 + e2) / 2 + (1 - e2) / 2 * rising))


@inner
def friction(force: float, slip: float, law: FloatArray) -> float:
    """Friction (N) against a slip (m/s), under a pressing force (N)."""
    return float(-law[3] * force * np.tanh(slip / law[4]))


@inner
def fill_slopes(gap: float, gap_rate: float, slip: float, law: FloatArray, row: FloatArray) -> None:
    """Fill in how the force rises with depth and speed, and friction with slip.

    N/m, N s/m and N s/m; all are positive.
    """
    depth, drag = max(-gap, 0.0), np.tanh(slip / law[4])
    e2, rising = law[1] * law[1], np.tanh(-gap_rate / law[2])
    row[0] = law[0] * ((1 + e2) / 2 + (1 - e2) / 2 * rising)
    row[1] = depth * law[0] * (1 - e2) / 2 * (1 - rising * rising) / law[2]
    row[2] = law[3] * depth * row[0] * (1 - drag * drag) / law[4]
