"""Where a contact is and where it will be, from the coordinates of its two parts."""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, cos, inf, sin, sqrt
from typing import NamedTuple

from exudyn_flexlink.engines.exudyn.circles import Circles
from exudyn_flexlink.engines.exudyn.faces import Faces, Touch, Vector
from exudyn_flexlink.mechanism import GROUND, Anchor, CircleContact, FaceContact


class Aim(NamedTuple):
    """Where friction acts on the second part and on the first, along what, and by which grip."""

    struck: Vector
    striking: Vector
    along: Vector
    grip: float = 1.0


class FaceGeometry:
    """Gap and place of a contact's point from the coordinates of its two parts."""

    def __init__(self, contact: FaceContact) -> None:
        self._faces = Faces(contact)
        self.length, self.along = contact.length, self._faces.along
        self._point, self._start = _Place(contact.point), _Place(contact.start)

    def touch(self, q: Sequence[float], v: Sequence[float]) -> Touch:
        """Evaluate at the coordinates and velocities of all parts, one after the other."""
        (px, py), (pu, pv), _, _ = self._point.state(q, v)
        (sx, sy), (su, sv), angle, turning = self._start.state(q, v)
        touch, _, self._side = self._faces.touch(
            (px - sx, py - sy), (pu - su, pv - sv), angle, turning
        )
        return touch

    def on_face(self, place: float) -> Vector:
        """Point of the face at a place, in the axes of its part."""
        (bx, by), (ex, ey) = self._start.own, self.along
        return bx + place * ex, by + place * ey

    def ahead(self, touch: Touch, step: float) -> float:
        """Place at the end of a step (s) that begins at `touch`."""
        return touch.place + step * (touch.slip + 0.5 * step * touch.slip_bend)

    def meeting(self, touch: Touch, gap: float) -> float:
        """Time (s) until the gap closes as it does now; inf if it does not."""
        return -gap / touch.gap_rate if touch.gap_rate < 0 else inf

    def aim(self, touch: Touch, step: float) -> Aim:
        """Where they touch at the end of a step (s) that begins at `touch`."""
        (x, y), (ex, ey) = self.on_face(self.ahead(touch, step)), self.along
        gap = touch.gap + step * (touch.gap_rate + 0.5 * step * touch.gap_bend)
        lateral = self._side * gap
        return Aim((x - lateral * ey, y + lateral * ex), self._point.own, (ex, ey))


class CircleGeometry:
    """Gap and place of two circles from the coordinates of their two parts."""

    length = inf

    def __init__(self, contact: CircleContact) -> None:
        self._circles = Circles(contact)
        self._first, self._second = _Place(contact.first), _Place(contact.second)

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
        ahead = self._in_second[0] + step * self._in_second[1]
        behind = self._in_first[0] + step * self._in_first[1]
        gap = touch.gap + step * (touch.gap_rate + 0.5 * step * touch.gap_bend)
        part, arm = self._circles.grip(gap)
        arm /= part
        edge = self._circles.distance + self._circles.way * gap + arm
        (ax, ay), (bx, by) = self._first.own, self._second.own
        c, s = cos(ahead), sin(ahead)
        return Aim(
            (bx + edge * c, by + edge * s),
            (ax + arm * cos(behind), ay + arm * sin(behind)),
            (-s, c),
            part,
        )


class _Place:
    """A place on a part, or on the ground."""

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
