"""A slot's point on its curve: the present piece's own point and derivatives."""

from __future__ import annotations

from functools import cached_property

from exudyn_flexlink.curves import Evaluator, Knots, TogetherEvaluator, evaluator, together
from exudyn_flexlink.engines.track_follower import TrackFollower
from exudyn_flexlink.mechanism import Slot
from exudyn_flexlink.result import Event


class TrackPoint(TrackFollower):
    """A slot's point with the geometry of its pieces.

    `changes` counts how often it went on to another piece, or to the same one's other end.
    """

    def __init__(self, slot: Slot, place: float, lap: int, events: list[Event]) -> None:
        super().__init__(slot, place, lap, events)
        self.changes = 0
        self._at: list[Evaluator] = [evaluator(piece) for piece in self.curve.pieces]
        self._knots = [piece.knots for piece in self.curve.pieces]

    @property
    def at(self) -> Evaluator:
        """Point and derivatives at a parameter of the present piece, also beyond its ends."""
        return self._at[self.piece]

    @property
    def together(self) -> TogetherEvaluator:
        """As `at`, at many parameters at once."""
        return self._all_together[self.piece]

    @cached_property
    def _all_together(self) -> list[TogetherEvaluator]:
        return [together(piece) for piece in self.curve.pieces]

    @property
    def knots(self) -> Knots:
        """Where on the present piece the third derivative jumps."""
        return self._knots[self.piece]

    def next_piece(self, way: int, time: float) -> bool:
        """Go on to the next piece (way 1) or the one before (-1); False at an open curve's end."""
        went = super().next_piece(way, time)
        self.changes += went
        return went
