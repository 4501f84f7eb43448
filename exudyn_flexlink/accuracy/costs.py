"""What a run will cost, told from those made so far."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import inf, log

from exudyn_flexlink.accuracy.methods import Method
from exudyn_flexlink.accuracy.runs import Solved

SLOPES = {"tolerance": 0.5, "step": 1.0}
"""How cost grows as a knob is turned down, before two runs show it: a second-order method."""

STEEPEST = 1.0
SAME = 1e-6


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


class Costs:
    """Processor times of a study's runs, and what other runs will take."""

    def __init__(self, methods: Iterable[Method]) -> None:
        self._known: dict[str, dict[float, float]] = {method.name: {} for method in methods}
        self._guesses: dict[str, tuple[float, float]] = {}
        self._wall, self._processor = 0.0, 0.0  # s, of all runs

    @property
    def slowness(self) -> float:
        """Wall time over processor time so far: a machine may be shared."""
        return max(self._wall / self._processor, 1.0) if self._processor > 0 else 1.0

    def guess(self, method: Method, value: float, cost: float) -> None:
        """Take note of what a run is thought to cost (s) before there is one."""
        self._guesses[method.name] = value, cost

    def add(self, method: Method, value: float, solved: Solved) -> None:
        """Take note of a run."""
        self._known[method.name][value] = solved.processor
        self._wall += solved.wall
        self._processor += solved.processor

    def known(self, method: Method) -> Mapping[float, float]:
        """Processor times (s) of a method's runs, by the value of its knob."""
        return self._known[method.name]

    def has(self, method: Method, value: float) -> bool:
        """Whether a method was run at a value, or one equal to it but for rounding."""
        return any(abs(log(value / other)) < SAME for other in self._known[method.name])

    def guessed(self, method: Method) -> float:
        """What a run of the method was thought to cost, s; inf if nobody knows."""
        return self._guesses.get(method.name, (0.0, inf))[1]

    def expected(self, method: Method, value: float) -> float:
        """Expected wall time of a run, s."""
        if known := self._known[method.name]:
            return self.slowness * predict(known, value, method.knob)
        at, cost = self._guesses[method.name]
        return self.slowness * cost * float((at / value) ** SLOPES[method.knob])
