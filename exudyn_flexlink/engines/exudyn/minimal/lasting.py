"""For how long motions of the tree keep errors of their speeds: slow ones, and those that fly free.

What flies between the walls of a sleeve keeps such errors until the next touch, not until the run
ends. What a touch makes of them no step foresees: a second run tells it. So each pair of link
and guide that has touched counts as a soft spring across its gap; motions along the walls are free.
"""

from __future__ import annotations

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.coasting import SHORTEST_SWING
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.integrate.problem import Evaluation
from exudyn_flexlink.integrate.slow_motions import FREELY, PART, slow_motions


class Flight:
    """How long (s) no pair of link and guide pressed, at most, in a run that begins so."""

    def __init__(self) -> None:
        self._since: float | None = 0.0  # when the last pair ceased to press; None while one does
        self._longest = 0.0

    def turn(self, time: float, touching: bool) -> None:
        """From this time (s) on pairs press, or none does."""
        self._longest = self.longest(time)
        if touching:
            self._since = None
        elif self._since is None:
            self._since = time

    def longest(self, time: float) -> float:
        """Return the longest up to a time (s), the present one included."""
        return self._longest if self._since is None else max(self._longest, time - self._since)


class LastingErrors:
    """What errors of speeds of a model become in a run to `end` (s)."""

    def __init__(self, model: MinimalModel, end: float) -> None:
        self._model, self._end = model, end
        self._flight = Flight()
        self._known: FloatArray | None = None

    def touch(self, time: float) -> None:
        """Pairs of link and guide have begun or ceased to press."""
        self._flight.turn(time, bool(self._model.walls.touching.any()))

    def at(self, now: Evaluation) -> FloatArray:
        """Matrix (n, n), s, from errors of speeds to those of places: see `slow_motions`."""
        walls, state = self._model.walls, now.kept.state
        caught, known = bool(walls.touched.any()), self._known
        if known is not None and state.transform.chosen is not None and not caught:
            # Once for an open chain; what follows others may do so otherwise, or by other ones.
            return known
        stiffness = self._model.springs(now)[0]
        if caught:
            flight = max(self._flight.longest(float(now.kept.t)), SHORTEST_SWING)
            swing = FREELY / PART * flight  # so slow that errors last as they do in free flight
            stiffness = stiffness + walls.catching(state, now.mass, swing)
        self._known = slow_motions(now.mass, stiffness, self._end, SHORTEST_SWING)
        return self._known
