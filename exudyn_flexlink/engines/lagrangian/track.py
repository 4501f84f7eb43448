"""The track of P, piece by piece: on which piece P is, which comes next, and in which lap.

Places on a piece are computed in `track_point`.
"""

from __future__ import annotations

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.curves import Curve, next_piece
from exudyn_flexlink.engines.lagrangian.track_point import (
    FINE,
    MISSES,
    TOUCHES,
    packed_piece,
)

TROUBLES = {
    TOUCHES: "the guide's axis touches the track",
    MISSES: "the guide's axis misses the track",
}


class DeadCentreError(ValueError):
    """The guide's axis touches the track or misses it: the angle does not tell where P is."""


class Track:
    """The track of P, piece by piece; `u` is where P was last, on the current piece's parameter.

    Every search starts at `home`, where P was after the last accepted step: trial steps leave no
    trace.
    """

    def __init__(self, curve: Curve, place: float, lap: int) -> None:
        self.curve = curve
        self.piece, self.u = curve.locate(place)
        self.home = self.u
        self.lap = lap
        self._pieces = [packed_piece(piece) for piece in curve.pieces]

    def found(self, u: float, ended: int) -> None:
        """P is at u, as a search says that ended like this.

        Raises:
            DeadCentreError: the axis misses the track or touches it.

        """
        if ended != FINE:
            raise DeadCentreError(TROUBLES[ended])
        self.u = u

    @property
    def numbers(self) -> FloatArray:
        """The current piece, packed as in `track_point`."""
        return self._pieces[self.piece]

    def at_rest(self, u: float) -> None:
        """P is at u on its piece: searches start there from now on."""
        self.u = self.home = u

    def settle(self) -> None:
        """Start from the last place from now on."""
        self.home = self.u

    @property
    def left(self) -> tuple[float, float]:
        """How far the last place is from the end and from the start of its piece."""
        piece = self.curve.pieces[self.piece]
        return piece.end - self.u, self.u - piece.start

    @property
    def shift(self) -> float:
        """By how much the parameter of the whole curve is more than that of the current piece."""
        return float(self.curve.breaks[self.piece] - self.curve.pieces[self.piece].start)

    def next_piece(self, way: int) -> bool:
        """Go on to the next piece (way 1) or the one before (-1); False at an open curve's end."""
        after = next_piece(self.curve, self.piece, self.lap, way)
        if after is None:
            return False
        self.piece, self.lap = after
        piece = self.curve.pieces[self.piece]
        self.at_rest(float(piece.start if way > 0 else piece.end))
        return True
