"""Forces of penalty contacts by gaps and rates, with their slopes: those of `exudyn_flexlink.laws`.

A force goes on smoothly where a gap has opened: there a touch ends, within the step.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.integrate.problem import Press, Pressing
from exudyn_flexlink.laws import Impulse, Penalty, RestitutionPenalty
from exudyn_flexlink.mechanism import Channel, Contact


def pressing(numbers: Sequence[FloatArray], gap: FloatArray, rate: FloatArray) -> Pressing:
    """Forces by `laws.RestitutionPenalty`.

    `numbers` are the elastic and lossy parts of stiffnesses (N/m) and transition speeds (m/s).
    """
    elastic, lossy, speed = numbers
    rising = np.tanh(-rate / speed)
    stiffness = elastic + lossy * rising
    damping = np.maximum(-gap, 0.0) * lossy / speed * (1 - rising * rising)
    return Pressing(-gap * stiffness, stiffness, damping)


class Laws:
    """Laws of contacts (c,); rigid ones have no force."""

    def __init__(self, laws: Sequence[Penalty | Impulse]) -> None:
        numbers = [
            (law.elastic, law.lossy, law.transition_speed)
            if isinstance(law, RestitutionPenalty)
            else (0.0, 0.0, 1.0)
            for law in laws
        ]
        self._numbers = np.array(numbers, dtype=np.float64).reshape(-1, 3).T
        self.exponents = np.array([getattr(law, "exponent", 1.0) for law in laws])
        others = [law for law in laws if not isinstance(law, RestitutionPenalty | Impulse)]
        self._others = [
            (law, np.array([one == law for one in laws])) for law in dict.fromkeys(others)
        ]

    def pressing(
        self, which: IndexArray, gap: FloatArray, rate: FloatArray, approach: FloatArray
    ) -> Pressing:
        """Forces of some (k,) by their gaps and rates (..., k).

        `approach` (c,) are the speeds (m/s) with which the touches of all began.
        """
        found = pressing(self._numbers[:, which], gap, rate)
        for law, members in self._others:
            own = members[which]
            if own.any():
                parts = law.pressing(-gap[..., own], -rate[..., own], approach[which[own]])
                for column, part in zip(found, parts, strict=True):
                    column[..., own] = part
        return found


def rubbing(contacts: Sequence[Contact | Channel]) -> FloatArray:
    """Friction of contacts (2, c): coefficients, 0 if smooth, and slip speeds (m/s)."""
    rubs = [own.friction for own in contacts]
    found = [(rub.coefficient, rub.slip_speed) if rub else (0.0, 1.0) for rub in rubs]
    return np.asarray(np.array(found).reshape(-1, 2).T, dtype=np.float64)


def press_by(laws: Sequence[Penalty | Impulse], approach: FloatArray) -> Press:
    """Forces of contacts and their slopes, by gaps and rates (..., c, 2); none where they open.

    Their touches began with the speeds `approach` (c,), m/s.
    """
    own, every = Laws(laws), np.arange(len(laws))

    def press(touching: FloatArray) -> Pressing:
        gap = touching[..., 0]
        found, closed = own.pressing(every, gap, touching[..., 1], approach), gap < 0
        return found._replace(force=found.force * closed, stiffness=found.stiffness * closed)

    return press
