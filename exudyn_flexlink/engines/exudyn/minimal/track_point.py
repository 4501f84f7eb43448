"""A slot's point on its curve: on which smooth piece it runs, and in which lap."""

from __future__ import annotations

from exudyn_flexlink.curves import Evaluator, Knots, evaluator, next_piece
from exudyn_flexlink.mechanism import Slot
from exudyn_flexlink.result import Event


class TrackPoint:
    """Follows one slot's point from piece to piece; `u` is the present piece's own parameter.

    `changes` counts how often it went on to another piece, or to the same one's other end.
    """

    def __init__(self, slot: Slot, place: float, lap: int, events: list[Event]) -> None:
        self.slot, self.curve = slot, slot.curve
        self.events = events
        self.piece, self.u = self.curve.locate(place)
        self.changes = 0
        self._lap = lap
        self._at: list[Evaluator] = [evaluator(piece) for piece in self.curve.pieces]
        self._knots = [piece.knots for piece in self.curve.pieces]

    @property
    def at(self) -> Evaluator:
        """Point and derivatives at a parameter of the present piece, also beyond its ends."""
        return self._at[self.piece]

    @property
    def knots(self) -> Knots:
        """Where on the present piece the third derivative jumps."""
        return self._knots[self.piece]

    def left(self, u: float) -> tuple[float, float]:
        """How far a place is from the end and from the start of the present piece."""
        piece = self.curve.pieces[self.piece]
        return piece.end - u, u - piece.start

    def place(self, u: float) -> float:
        """Parameter of the whole curve at the present piece's own."""
        piece = self.curve.pieces[self.piece]
        if not self.curve.closed:
            u = min(max(u, piece.start), piece.end)
        return float(self.curve.breaks[self.piece] + u - piece.start)

    def next_piece(self, way: int, time: float) -> bool:
        """Go on to the next piece (way 1) or the one before (-1); False at an open curve's end."""
        after = next_piece(self.curve, self.piece, self._lap, way)
        if after is None:
            return False
        self.piece, lap = after
        if lap != self._lap:
            self._lap = lap
            self.events.append(Event(time, "lap", self.slot.name, {"lap": float(lap)}))
        self.changes += 1
        piece = self.curve.pieces[self.piece]
        self.u = piece.start if way > 0 else piece.end
        return True
