"""Impact by impulse and momentum, the paper's eq. 2 to 4: ``-e v_a = v_s`` along the normal.

The configuration stays, the speeds jump by the generalised impulse ``P_k = G_k p``:

    M (v_s - v_a) = G p                         (eq. 2, M the mass matrix of the free coordinates)
    g'_a = G v_a + ..,  g'_s = -e g'_a          (eq. 3 and 4, g' the rate of the gap)
    p = -(1 + e) g'_a / (G M^-1 G^T)
    energy lost = (1 - e^2)/2 g'_a^2 / (G M^-1 G^T)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from exudyn_flexlink.arrays import FloatArray


@dataclass(frozen=True)
class Impact:
    """Jump of the free coordinates' speeds, impulse (N s), speeds along the normal, energy (J)."""

    jump: FloatArray
    impulse: float
    approach_speed: float
    separation_speed: float
    energy_lost: float


def strike(mass: FloatArray, gradient: FloatArray, gap_rate: float, restitution: float) -> Impact:
    """Impact at a gap that closes with `gap_rate` (m/s, negative), gradient by free coordinates."""
    answer: FloatArray = np.asarray(np.linalg.solve(mass, gradient), dtype=np.float64)
    mobility = float(gradient @ answer)
    impulse = -(1 + restitution) * gap_rate / mobility
    lost = 0.5 * (1 - restitution**2) * gap_rate**2 / mobility
    return Impact(answer * impulse, impulse, -gap_rate, -restitution * gap_rate, lost)
