"""Forces of penalty contacts by gaps and rates, with their slopes: `laws.RestitutionPenalty`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.integrate.problem import Press, Pressing
from exudyn_flexlink.laws import Impulse, RestitutionPenalty
from exudyn_flexlink.mechanism import Channel, Contact


def pressing(numbers: Sequence[FloatArray], gap: FloatArray, rate: FloatArray) -> Pressing:
    """Forces of contacts, on smoothly where a gap has opened: there one ends, within the step.

    `numbers` are the elastic and lossy parts of stiffnesses (N/m) and transition speeds (m/s).
    """
    elastic, lossy, speed = numbers
    rising = np.tanh(-rate / speed)
    stiffness = elastic + lossy * rising
    damping = np.maximum(-gap, 0.0) * lossy / speed * (1 - rising * rising)
    return Pressing(-gap * stiffness, stiffness, damping)


def law_numbers(contacts: Sequence[Contact | Channel]) -> FloatArray:
    """Laws of contacts (5, c): both parts of stiffnesses (N/m), transition speeds (m/s), friction.

    That is its coefficient and its slip speed (m/s). Rigid ones have no stiffness.
    """
    found = []
    for own in contacts:
        law, rub = own.law, own.friction
        gives = (0.0, 0.0, 1.0)
        if not isinstance(law, Impulse):
            gives = law.elastic, law.lossy, law.transition_speed
        found.append((*gives, rub.coefficient if rub else 0.0, rub.slip_speed if rub else 1.0))
    return np.asarray(np.array(found).reshape(-1, 5).T, dtype=np.float64)


def press_by(laws: Sequence[RestitutionPenalty]) -> Press:
    """Forces of contacts and their slopes, by gaps and rates (..., c, 2); none where they open."""
    numbers = np.array([(law.elastic, law.lossy, law.transition_speed) for law in laws]).T

    def press(touching: FloatArray) -> Pressing:
        gap = touching[..., 0]
        found, closed = pressing(numbers, gap, touching[..., 1]), gap < 0
        return found._replace(force=found.force * closed, stiffness=found.stiffness * closed)

    return press
