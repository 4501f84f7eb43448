r"""Where the guide's angle puts P on its track: gamma(theta) and its derivatives.

P lies on the guide's axis, ``gamma - C = r e(theta)``, and on the current piece ``gamma(u)``, so
that ``e x (gamma - C) = 0`` (x the 2D cross product). Differentiated once and twice by theta:

    u'  = r / (e x gamma_u)
    u'' = (2 (e.gamma_u) u' - (e x gamma_uu) u'^2) / (e x gamma_u)
    gamma' = gamma_u u',   gamma'' = gamma_uu u'^2 + gamma_u u''
"""

from __future__ import annotations

from math import cos, hypot, nan, sin

from exudyn_flexlink.curves import Curve, Evaluator, evaluator, lap_number, pieces_of_laps
from exudyn_flexlink.engines.lagrangian.equations import Root

NEWTON_STEPS = 40
ROUNDING = 4e-16
LEAST_SLOPE = 1e-9  # sine of the angle between guide and track at a dead centre


class DeadCentreError(ValueError):
    """The guide's axis touches the track or misses it: the angle does not tell where P is."""


class Track:
    """The track of P, piece by piece; `u` is where P was last, on the current piece's parameter.

    Every search starts where P was after the last accepted step: trial steps leave no trace.
    """

    def __init__(self, curve: Curve, place: float, centre: tuple[float, float]) -> None:
        self.curve = curve
        self.centre = centre
        self.piece, self.u = curve.locate(place)
        self._home = self.u
        self._laps = pieces_of_laps(self.curve)
        self._lap = next(i for i, (_, last) in enumerate(self._laps) if self.piece <= last)
        self._winding = self._lap
        self._pieces: list[Evaluator] = [evaluator(piece) for piece in curve.pieces]
        self._at = self._pieces[self.piece]
        self._angle = nan
        self._root: Root = (0.0,) * 6

    def root(self, theta: float) -> Root:
        """Components of gamma, gamma', gamma'' at the guide's angle; that asked last is kept.

        Raises:
            DeadCentreError: the axis misses the track or touches it.

        """
        if theta != self._angle:
            self._root, self._angle = self._cross(theta), theta
        return self._root

    def _cross(self, theta: float) -> Root:
        """Newton's method to rounding, for where the guide's axis crosses the piece.

        The answer depends on where it starts only if the axis crosses the piece more than once.
        """
        c, s = cos(theta), sin(theta)
        cx, cy = self.centre
        u = self._home
        for _ in range(NEWTON_STEPS):
            x, y, dx, dy, ddx, ddy = self._at(u)
            slope = c * dy - s * dx
            if abs(slope) < LEAST_SLOPE * hypot(dx, dy):
                raise DeadCentreError("the guide's axis touches the track")
            step = (c * (y - cy) - s * (x - cx)) / slope
            u -= step
            if abs(step) <= ROUNDING * (1 + abs(u)):
                break
            if abs(step) <= 1e-9 * (1 + abs(u)):
                x, y, dx, dy, ddx, ddy = self._at(u)  # quadratic: this one is exact
                slope = c * dy - s * dx
                break
        else:
            raise DeadCentreError("the guide's axis misses the track")
        self.u = u
        r = c * (x - cx) + s * (y - cy)
        first = r / slope
        second = (2 * (c * dx + s * dy) * first - (c * ddy - s * ddx) * first * first) / slope
        square = first * first
        return (
            x,
            y,
            dx * first,
            dy * first,
            ddx * square + dx * second,
            ddy * square + dy * second,
        )

    def at(self, u: float) -> Root:
        """Components of gamma, gamma', gamma'' by the current piece's parameter, at its value u."""
        self.u = u
        return self._at(u)

    def settle(self) -> None:
        """Start from the last place from now on."""
        self._home = self.u

    @property
    def left(self) -> tuple[float, float]:
        """How far the last place is from the end and from the start of its piece."""
        piece = self.curve.pieces[self.piece]
        return piece.end - self.u, self.u - piece.start

    @property
    def place(self) -> float:
        """Parameter of the whole curve at the last place."""
        piece = self.curve.pieces[self.piece]
        return float(self.curve.breaks[self.piece] + self.u - piece.start)

    def next_piece(self, way: int) -> int | None:
        """Go on to the next piece (way 1) or the one before (-1); None at an open curve's end.

        Return the number of the lap if another one begins, else 0.
        """
        first, last = self._laps[self._lap]
        after, begun = self.piece + way, 0
        if not first <= after <= last:
            if not self.curve.closed:
                return None
            before = lap_number(self._winding)
            self._winding += way
            number = lap_number(self._winding)
            begun = number if number != before else 0
            self._lap = (number - 1) % len(self._laps)
            first, last = self._laps[self._lap]
            after = first if way > 0 else last
        self.piece = after
        piece = self.curve.pieces[self.piece]
        self.u = piece.start if way > 0 else piece.end
        self._home = self.u
        self._at, self._angle = self._pieces[self.piece], nan
        return begun
