"""Where a contact is, in plain floats: what the step loop asks after every step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, inf, sin
from typing import NamedTuple

from exudyn_flexlink.mechanism import FaceContact


@dataclass(slots=True)
class Touch:
    """Gap and place (m), rate of the gap and slip (m/s), as in `mechanism.approach`.

    `inside` (m) is how far the place is from the nearer end of the face, negative beside it, for
    minimal coordinates; circles have no ends. `gap_bend` and `slip_bend` (m/s^2) are rates of the
    rates, from the step before, for redundant ones; 0 unknown.
    """

    gap: float
    place: float
    gap_rate: float
    slip: float
    inside: float = inf
    gap_bend: float = 0.0
    slip_bend: float = 0.0


def distance_from_ends(place: float, length: float) -> float:
    """How far (m) a place is from the nearer end of a face, negative beside it."""
    return min(place, length - place)


class Aim(NamedTuple):
    """Where a contact acts on the second part and on the first, and along what, in their axes."""

    struck: tuple[float, float]
    striking: tuple[float, float]
    along: tuple[float, float]


class FaceGeometry:
    """Gap and place of a contact's point from the coordinates of its two parts."""

    def __init__(self, contact: FaceContact) -> None:
        self.first, self.second = 3 * contact.point.part, 3 * contact.start.part
        self.ax, self.ay = contact.point.x, contact.point.y
        self.bx, self.by = contact.start.x, contact.start.y
        self.length = contact.length
        self.ex = (contact.end.x - contact.start.x) / self.length
        self.ey = (contact.end.y - contact.start.y) / self.length
        self.side = contact.side  # 0: the point is held on the line, from the side where it is

    def touch(self, q: Sequence[float], v: Sequence[float]) -> Touch:
        """Evaluate at the coordinates and velocities of all parts, one after the other."""
        i, j = self.first, self.second
        angle, turning = q[j + 2], v[j + 2]
        c, s = cos(q[i + 2]), sin(q[i + 2])
        rx, ry = c * self.ax - s * self.ay, s * self.ax + c * self.ay
        c, s = cos(angle), sin(angle)
        bx, by = c * self.bx - s * self.by, s * self.bx + c * self.by
        tx, ty = c * self.ex - s * self.ey, s * self.ex + c * self.ey
        dx, dy = q[i] + rx - q[j] - bx, q[i + 1] + ry - q[j + 1] - by
        ux = v[i] - v[i + 2] * ry - v[j] + turning * by
        uy = v[i + 1] + v[i + 2] * rx - v[j + 1] - turning * bx
        place, lateral = tx * dx + ty * dy, tx * dy - ty * dx
        side = self._side = self.side or (-1.0 if lateral > 0 else 1.0)
        return Touch(
            side * lateral,
            place,
            side * (tx * uy - ty * ux - turning * place),
            tx * ux + ty * uy + turning * lateral,
        )

    def on_face(self, place: float) -> tuple[float, float]:
        """Point of the face at a place, in the axes of its part."""
        return self.bx + place * self.ex, self.by + place * self.ey

    def ahead(self, touch: Touch, step: float) -> float:
        """Place at the end of a step (s) that begins at `touch`."""
        return touch.place + step * (touch.slip + 0.5 * step * touch.slip_bend)

    def meeting(self, touch: Touch, gap: float) -> float:
        """Time (s) until the gap closes as it does now; inf if it does not."""
        return -gap / touch.gap_rate if touch.gap_rate < 0 else inf

    def aim(self, touch: Touch, step: float) -> Aim:
        """Where they touch at the end of a step (s) that begins at `touch`."""
        x, y = self.on_face(self.ahead(touch, step))
        gap = touch.gap + step * (touch.gap_rate + 0.5 * step * touch.gap_bend)
        lateral = self._side * gap
        struck = x - lateral * self.ey, y + lateral * self.ex
        return Aim(struck, (self.ax, self.ay), (self.ex, self.ey))
