"""Where two circles are against each other, in plain floats."""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, cos, hypot, inf, pi, sin, sqrt

from exudyn_flexlink.engines.exudyn.faces import Aim, Touch
from exudyn_flexlink.mechanism import GROUND, Anchor, CircleContact

Vector = tuple[float, float]


class Circles:
    """Gap, place and slip of two circles, the first outside or inside the second."""

    def __init__(self, contact: CircleContact) -> None:
        self.distance, self.edge = contact.distance, contact.radii[1]
        self.way = -1.0 if contact.inside else 1.0

    def touch(
        self, place: Vector, velocity: Vector, spins: Vector, angle: float
    ) -> tuple[Touch, Vector, float]:
        """Return how they touch, the direction from the second centre to the first, its length.

        `place` (m) and `velocity` (m/s) are those of the first centre, from and against those of
        the second, `spins` (rad/s) of both parts; `angle` (rad) is that of the second's axes.
        """
        (dx, dy), (ux, uy), (first, second) = place, velocity, spins
        far, speed = hypot(dx, dy), hypot(ux, uy)
        if far > 0:
            nx, ny = dx / far, dy / far
        else:  # concentric circles part the way they move, or along x
            nx, ny = (ux / speed, uy / speed) if speed > 0 else (1.0, 0.0)
        past = nx * uy - ny * ux
        touch = Touch(
            self.way * (far - self.distance),
            self.edge * ((atan2(ny, nx) - angle) % (2 * pi)),
            self.way * (nx * ux + ny * uy),
            past + first * (self.edge - far) - second * self.edge,
        )
        return touch, (nx, ny), far


class CircleGeometry:
    """Gap and place of two circles from the coordinates of their two parts."""

    length = inf

    def __init__(self, contact: CircleContact) -> None:
        self._circles = Circles(contact)
        self._first, self._second = _Centre(contact.first), _Centre(contact.second)

    def touch(self, q: Sequence[float], v: Sequence[float]) -> Touch:
        """Evaluate at the coordinates and velocities of all parts, one after the other."""
        (px, py), (pu, pv), first, spin = self._first.state(q, v)
        (sx, sy), (su, sv), second, turning = self._second.state(q, v)
        touch, (nx, ny), far = self._circles.touch(
            (px - sx, py - sy), (pu - su, pv - sv), (spin, turning), second
        )
        # For `meeting` and `aim`: how the centres move past each other, and directions with rates.
        self._past = nx * (pv - sv) - ny * (pu - su)
        around = self._past / far if far > 0 else 0.0
        way = atan2(ny, nx)
        self._in_first, self._in_second = (
            (way - first, around - spin),
            (way - second, around - turning),
        )
        return touch

    def meeting(self, touch: Touch, gap: float) -> float:
        """Time (s) until they touch if their centres go straight on; inf if they don't."""
        circles = self._circles
        far = circles.distance + circles.way * gap
        rate = far * circles.way * touch.gap_rate
        square = touch.gap_rate**2 + self._past**2
        left = far * far - circles.distance**2
        under = rate * rate - square * left
        if square == 0 or under < 0 or (left >= 0 and rate >= 0):
            return inf
        return (-rate - sqrt(under) if left > 0 else -rate + sqrt(under)) / square

    def aim(self, touch: Touch, step: float) -> Aim:
        """Where they touch at the end of a step (s) that begins at `touch`."""
        ahead, edge = self._in_second[0] + step * self._in_second[1], self._circles.edge
        behind = self._in_first[0] + step * self._in_first[1]
        gap = touch.gap + step * (touch.gap_rate + 0.5 * step * touch.gap_bend)
        arm = edge - self._circles.distance - self._circles.way * gap
        (ax, ay), (bx, by) = self._first.own, self._second.own
        c, s = cos(ahead), sin(ahead)
        return Aim(
            (bx + edge * c, by + edge * s),
            (ax + arm * cos(behind), ay + arm * sin(behind)),
            (-s, c),
        )


class _Centre:
    """The middle of a circle on a part, or on the ground."""

    def __init__(self, anchor: Anchor) -> None:
        self._row = None if anchor.part == GROUND else 3 * anchor.part
        self.own = anchor.x, anchor.y

    def state(self, q: Sequence[float], v: Sequence[float]) -> tuple[Vector, Vector, float, float]:
        """Place, velocity, angle of the part and its rate."""
        if self._row is None:
            return self.own, (0.0, 0.0), 0.0, 0.0
        x, y, angle = q[self._row : self._row + 3]
        u, w, spin = v[self._row : self._row + 3]
        c, s = cos(angle), sin(angle)
        rx, ry = c * self.own[0] - s * self.own[1], s * self.own[0] + c * self.own[1]
        return (x + rx, y + ry), (u - spin * ry, w + spin * rx), angle, spin
