r"""Where a slot holds the slide that carries its point: s as a function of the guide's angle.

With the pivot C, ``w = gamma(u) - C``, the guide's axes e, e^ and x the 2D cross product, the point
is on the track where ``e x w = b``, and then ``s = e.w - a`` (a ahead of, b beside the slide's own
zero). Differentiated by the angle, with ``sigma = e x gamma_u``:

    u'  = e.w / sigma
    s'  = b + (e.gamma_u) u'
    u'' = (s' - (-e.gamma_u + (e x gamma_uu) u') u') / sigma
    s'' = sigma u' + (e.gamma_uu) u'^2 + (e.gamma_u) u''
"""

from __future__ import annotations

from collections.abc import Callable
from math import cos, hypot, inf, sin

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.curves import Evaluator, Knots, Places as CurvePlaces, evaluator
from exudyn_flexlink.engines.track_follower import DeadCentreError, TrackFollower
from exudyn_flexlink.mechanism import Slot
from exudyn_flexlink.mechanism.tree import GuidedSlot
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
    def together(self) -> Callable[[FloatArray], CurvePlaces]:
        """As `at`, at many parameters at once."""
        return self.curve.pieces[self.piece].places

    @property
    def knots(self) -> Knots:
        """Where on the present piece the third derivative jumps."""
        return self._knots[self.piece]

    def next_piece(self, way: int, time: float) -> bool:
        """Go on to the next piece (way 1) or the one before (-1); False at an open curve's end."""
        went = super().next_piece(way, time)
        self.changes += went
        return went


NEWTON_STEPS = 40
NEAR = 1e-8  # of the parameter

Axis = tuple[float, float]  # cosine and sine of the guide's angle

AT_DEAD_CENTRE = "the guide's axis touches the track"
LEAST_PART = 1e-6  # of the way that the guide turned since the last step
GRAZING = 1e-3  # of that sine: where no step is short enough, this is why


class SlotGuide(TrackPoint):
    """A slot's point as the guide's angle decides it; `u` is where it was last."""

    def __init__(
        self, guided: GuidedSlot, place: float, lap: int, angle: float, events: list[Event]
    ) -> None:
        super().__init__(guided.slot, place, lap, events)
        self.guided = guided
        self._home = self.u  # after the last whole step: every search starts there
        self._turned, self._axis = angle, (cos(angle), sin(angle))  # of the guide, there
        self._from = guided.pivot, guided.ahead, guided.aside

    def slide(self, angle: float) -> tuple[float, float, float]:
        """Coordinate of the slide (m) and its first two derivatives by the guide's angle.

        The place is searched from where the last step ended.

        Raises:
            DeadCentreError: the axis misses the track or touches it.

        """
        axis = c, s = cos(angle), sin(angle)
        u = self._newton(axis, self._home, self._axis)
        self.u = self._walk(angle) if u is None else u
        (cx, cy), ahead, aside = self._from
        x, y, dx, dy, ddx, ddy = self.at(self.u)
        slope = c * dy - s * dx
        reach, along = c * (x - cx) + s * (y - cy), c * dx + s * dy
        first = reach / slope
        rate = aside + along * first
        turn = -along + (c * ddy - s * ddx) * first
        second = (rate - turn * first) / slope
        bend = slope * first + (c * ddx + s * ddy) * first * first + along * second
        return reach - ahead, rate, bend

    def _newton(self, axis: Axis, u: float, before: Axis) -> float | None:
        """Where the axis crosses the piece, from u, where it did with the direction `before`.

        None where it is not sure that the point comes there from u without a jump: the slope of
        the axis against the track has to keep its sign, and Kantorovich's condition to hold,
        2 |f'' step| <= |f'|, with f'' at both ends of a step, and f' at its start.
        """
        ((cx, cy), _, aside), at = self._from, self.at
        c, s = axis
        x, y, dx, dy, ddx, ddy = at(u)
        slope, was, last = c * dy - s * dx, before[0] * dy - before[1] * dx, inf
        if slope * was <= 0:
            return None
        least = min(abs(slope), abs(was))
        for _ in range(NEWTON_STEPS):
            step = (c * (y - cy) - s * (x - cx) - aside) / slope
            if abs(step) <= NEAR * (1 + abs(u)):  # quadratic: exact to rounding after this one
                return u - step
            bend, gone, u = abs(c * ddy - s * ddx), 2 * abs(step), u - step
            x, y, dx, dy, ddx, ddy = at(u)
            slope, last_bend = c * dy - s * dx, abs(c * ddy - s * ddx)
            if bend * gone > least or last_bend * gone > least or gone > last or slope * was <= 0:
                return None
            least, last = abs(slope), gone / 2
        return None

    def _walk(self, angle: float) -> float:
        """As `_newton`, in parts of the way from where the point was, as long as is sure.

        Raises:
            DeadCentreError: the axis misses the track or touches it.

        """
        u, done, part = self._home, 0.0, 0.5
        way = angle - self._turned
        while part > LEAST_PART:
            ahead = min(1.0, done + part)
            at, before = self._turned + ahead * way, self._turned + done * way
            found = self._newton((cos(at), sin(at)), u, (cos(before), sin(before)))
            if found is None:
                part /= 2
            elif ahead == 1.0:
                return found
            else:
                u, done, part = found, ahead, 2 * part
        if self.grazes(self._turned + done * way, u):
            raise DeadCentreError(AT_DEAD_CENTRE)
        raise DeadCentreError("the guide's axis misses the track")

    def sine(self, angle: float, u: float) -> float:
        """Of the angle between the guide's axis and the track at a place."""
        _, _, dx, dy, _, _ = self.at(u)
        return (cos(angle) * dy - sin(angle) * dx) / hypot(dx, dy)

    def grazes(self, angle: float, u: float) -> bool:
        """Tell whether the guide's axis all but touches the track at a place."""
        return abs(self.sine(angle, u)) < GRAZING

    def settle(self, u: float, angle: float) -> None:
        """Search from this place on, where the last step ended, and this angle of the guide."""
        self.u = self._home = u
        self._turned, self._axis = angle, (cos(angle), sin(angle))

    def next_piece(self, way: int, time: float) -> bool:
        """Go on to the next piece (way 1) or the one before (-1); False at an open curve's end."""
        went = super().next_piece(way, time)
        self._home = self.u
        return went
