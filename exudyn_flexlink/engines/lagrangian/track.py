"""The track of P, piece by piece, packed for machine code, and where searches for P start.

Places on a piece are computed in `track_point`.
"""

from __future__ import annotations

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.lagrangian.track_point import (
    FINE,
    MISSES,
    TOUCHES,
    packed_piece,
)
from exudyn_flexlink.engines.track_follower import DeadCentreError, TrackFollower
from exudyn_flexlink.mechanism import Slot
from exudyn_flexlink.result import Event

TROUBLES = {
    TOUCHES: "the guide's axis touches the track",
    MISSES: "the guide's axis misses the track",
}


class Track(TrackFollower):
    """The track of P, piece by piece; `u` is where P was last, on the current piece's parameter.

    Every search starts at `home`, where P was after the last accepted step: trial steps leave no
    trace.
    """

    def __init__(self, slot: Slot, place: float, lap: int, events: list[Event]) -> None:
        super().__init__(slot, place, lap, events)
        self.home = self.u
        self._pieces = [packed_piece(piece) for piece in self.curve.pieces]

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
    def shift(self) -> float:
        """By how much the parameter of the whole curve is more than that of the current piece."""
        return float(self.curve.breaks[self.piece] - self.present.start)

    def next_piece(self, way: int, time: float) -> bool:
        """Go on to the next piece (way 1) or the one before (-1); False at an open curve's end."""
        went = super().next_piece(way, time)
        if went:
            self.settle()
        return went
