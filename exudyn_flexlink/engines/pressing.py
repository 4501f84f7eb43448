"""Forces of penalty contacts by gaps and rates, for steps in which they leap."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.integrate.problem import Press, Pressing
from exudyn_flexlink.laws import RestitutionPenalty


def press_by(laws: Sequence[RestitutionPenalty]) -> Press:
    """Forces of contacts and their slopes, by gaps and rates (..., c, 2)."""
    numbers = [(law.elastic, law.lossy, law.transition_speed) for law in laws]
    elastic, lossy, speed = np.array(numbers).T

    def press(touching: FloatArray) -> Pressing:
        gap, rate = touching[..., 0], touching[..., 1]
        depth, rising = np.maximum(-gap, 0.0), np.tanh(-rate / speed)
        factor = elastic + lossy * rising
        bend = lossy / speed * (1 - rising * rising)
        return Pressing(depth * factor, factor * (depth > 0), depth * bend)

    return press
