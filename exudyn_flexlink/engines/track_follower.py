"""A slot's point on its curve: on which smooth piece it runs, which comes next, in which lap.

Bookkeeping that all formulations share. Where on its piece the point is, each finds for itself.
"""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.curves import Curve, next_piece
from exudyn_flexlink.mechanism import Slot
from exudyn_flexlink.result import Event

# Of the search for where an axis or a point meets a track:
NEWTON_STEPS = 60
QUADRATIC = 1e-8  # of the parameter: after so short a step the place is exact to rounding
LEAST_PART = 1e-6  # of the angle by which the guide turned: shorter parts are not tried


class DeadCentreError(ValueError):
    """The coordinates solved for tell no place: a guide's axis touches its track or misses it.

    Or a loop of joints can't stay closed.
    """


class TrackFollower:
    """Follows one slot's point from piece to piece; `u` is the present piece's own parameter."""

    seam = 1e-12  # of the parameter: this little beyond a piece is on it

    def __init__(self, slot: Slot, place: float, lap: int, events: list[Event]) -> None:
        """`place` is the parameter of the whole curve at time 0; `events` are told of new laps."""
        self.slot, self.curve, self.events = slot, slot.curve, events
        self.piece, self.u = self.curve.locate(place)
        self.lap = lap

    @property
    def present(self) -> Curve:
        """The present piece."""
        return self.curve.pieces[self.piece]

    def left(self, u: float) -> tuple[float, float]:
        """How far a place is from the end and from the start of the present piece."""
        piece = self.present
        return piece.end - u, u - piece.start

    @property
    def bounds(self) -> tuple[float, float]:
        """Parameters between which a place is on the present piece."""
        return self.present.start - self.seam, self.present.end + self.seam

    def place(self, u: float | FloatArray) -> FloatArray:
        """Parameters of the whole curve at the present piece's own."""
        piece = self.present
        if not self.curve.closed:  # the step that ends an open curve goes a hair beyond it
            u = np.minimum(np.maximum(u, piece.start), piece.end)
        return np.asarray(self.curve.breaks[self.piece] + u - piece.start)

    def next_piece(self, way: int, time: float) -> bool:
        """Go on to the next piece (way 1) or the one before (-1); False at an open curve's end."""
        after = next_piece(self.curve, self.piece, self.lap, way)
        if after is None:
            return False
        self.piece, lap = after
        if lap != self.lap:
            self.lap = lap
            self.events.append(Event(time, "lap", self.slot.name, {"lap": float(lap)}))
        self.u = float(self.present.start if way > 0 else self.present.end)
        return True
