"""Forces of penalty contacts by gaps and rates, with their slopes: `laws.RestitutionPenalty`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.integrate.problem import Press, Pressing
from exudyn_flexlink.laws import RestitutionPenalty, SpringDamper
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
        if isinstance(law, RestitutionPenalty):
            gives = law.elastic, law.lossy, law.transition_speed
        found.append((*gives, rub.coefficient if rub else 0.0, rub.slip_speed if rub else 1.0))
    return np.asarray(np.array(found).reshape(-1, 5).T, dtype=np.float64)


def press_by(laws: Sequence[RestitutionPenalty | SpringDamper]) -> Press:
    """Forces of contacts and their slopes, by gaps and rates (..., c, 2); none where they open.

    What lets go before it opens is followed beyond.
    """
    lets_go = np.array([isinstance(law, SpringDamper) for law in laws])
    numbers = np.array([_rising(law) for law in laws]).T
    preload, damping = np.array([_letting_go(law) for law in laws]).T

    def press(touching: FloatArray) -> Pressing:
        gap, rate = touching[..., 0], touching[..., 1]
        found, closed = pressing(numbers, gap, rate), (gap < 0) | lets_go
        force = found.force * closed
        if lets_go.any():
            force = force + preload - damping * rate
            found = found._replace(damping=found.damping + damping)
        return found._replace(force=force, stiffness=found.stiffness * closed)

    return press


def _rising(law: RestitutionPenalty | SpringDamper) -> tuple[float, float, float]:
    """Elastic and lossy part of a stiffness (N/m), and the transition speed (m/s)."""
    if isinstance(law, SpringDamper):
        return law.stiffness, 0.0, 1.0
    return law.elastic, law.lossy, law.transition_speed


def _letting_go(law: RestitutionPenalty | SpringDamper) -> tuple[float, float]:
    """Preload (N) and damping (N s/m) of a law that lets go."""
    return (law.preload, law.damping) if isinstance(law, SpringDamper) else (0.0, 0.0)
