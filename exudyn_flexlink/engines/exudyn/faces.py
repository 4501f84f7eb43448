"""Where a point is against a face, and two circles, in plain floats.

The step loop asks for that after every step.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, hypot, inf, pi, sin

from exudyn_flexlink.mechanism import CircleContact, FaceContact, grip_of

Vector = tuple[float, float]


@dataclass(slots=True)
class Touch:
    """Gap and place (m), rate of the gap and slip (m/s), as in `mechanism.approach`.

    `inside` (m) is how far the place is from the nearer end of the face, negative beside it;
    circles have no ends. `gap_bend` and `slip_bend` (m/s^2) are rates of the rates, from the step
    before, for redundant coordinates; 0 unknown.
    """

    gap: float
    place: float
    gap_rate: float
    slip: float
    inside: float = inf
    gap_bend: float = 0.0
    slip_bend: float = 0.0

    def gap_after(self, step: float) -> float:
        """Gap (m) at the end of a step (s)."""
        return self.gap + step * (self.gap_rate + 0.5 * step * self.gap_bend)


def distance_from_ends(place: float, length: float) -> float:
    """How far (m) a place is from the nearer end of a face, negative beside it."""
    return min(place, length - place)


class Faces:
    """Gap, place and slip of a point against a face.

    `along` is the face's direction in the axes whose angle `touch` is told.
    """

    def __init__(self, contact: FaceContact, turned: float = 0.0) -> None:
        """`turned` (rad) is the angle of the face's part in those axes."""
        self.length = contact.length
        self._side = contact.side  # 0: the point is held on the line, from the side where it is
        dx, dy = contact.end.x - contact.start.x, contact.end.y - contact.start.y
        dx, dy, c, s = dx / self.length, dy / self.length, cos(turned), sin(turned)
        self.along = c * dx - s * dy, s * dx + c * dy

    def touch(
        self, place: Vector, velocity: Vector, angle: float, turning: float
    ) -> tuple[Touch, Vector, float]:
        """Return how they touch, the face's direction, and on which side of it: 1 left, -1 right.

        `place` (m) and `velocity` (m/s) are those of the point, from and against those of the
        face's start; `angle` (rad) and `turning` (rad/s) those of the axes that carry the face.
        """
        (dx, dy), (ux, uy), (ex, ey) = place, velocity, self.along
        c, s = cos(angle), sin(angle)
        tx, ty = c * ex - s * ey, s * ex + c * ey
        at, lateral = tx * dx + ty * dy, tx * dy - ty * dx
        side = self._side or (-1.0 if lateral > 0 else 1.0)
        touch = Touch(
            side * lateral,
            at,
            side * (tx * uy - ty * ux - turning * at),
            tx * ux + ty * uy + turning * lateral,
            distance_from_ends(at, self.length),
        )
        return touch, (tx, ty), side


class Circles:
    """Gap, place and slip of two circles, the first outside or inside the second."""

    def __init__(self, contact: CircleContact) -> None:
        self.distance, (self.radius, self.edge) = contact.distance, contact.radii
        self.way = -1.0 if contact.inside else 1.0

    def grip(self, gap: float) -> tuple[float, float]:
        """Return the grip and the friction's arm (m), by the gap (m)."""
        pressed = self.distance + self.way * min(gap, 0.0)
        return grip_of(-self.way * self.radius, self.distance, pressed)

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
        past, gap = nx * uy - ny * ux, self.way * (far - self.distance)
        part, arm = self.grip(gap)
        touch = Touch(
            gap,
            self.edge * ((atan2(ny, nx) - angle) % (2 * pi)),
            self.way * (nx * ux + ny * uy),
            part * (past - second * far) + arm * (first - second),
        )
        return touch, (nx, ny), far
