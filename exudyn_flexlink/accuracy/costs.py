"""What a run will cost, told from those made so far."""

from __future__ import annotations

from collections.abc import Mapping
from math import log

SLOPES = {"tolerance": 0.5, "step": 1.0, "relative_tolerance": 0.2}
"""How cost grows as a knob is turned down, before two runs show it: a second-order method."""

STEEPEST = 1.0


def predict(costs: Mapping[float, float], value: float, knob: str = "tolerance") -> float:
    """Cost (s) at a knob's value from costs at other values: a power law through the last two.

    A coarser run costs no more than a finer one; the nearest is taken for it.

    Raises:
        ValueError: no costs are known.

    """
    if not costs:
        raise ValueError("no costs are known")
    finer = sorted(costs)
    nearest = min(finer, key=lambda known: abs(log(known / value)))
    if value >= nearest:
        return costs[nearest]
    return costs[nearest] * float((nearest / value) ** slope(costs, knob))


def slope(costs: Mapping[float, float], knob: str = "tolerance") -> float:
    """Exponent s of cost ~ value^-s, from the two finest values; a usual one before there are."""
    if len(costs) < 2:
        return SLOPES[knob]
    fine, coarse = sorted(costs)[:2]
    found = log(costs[fine] / costs[coarse]) / log(coarse / fine)
    return min(max(found, 0.0), STEEPEST)
