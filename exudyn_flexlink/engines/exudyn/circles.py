"""Where two circles are against each other, in plain floats."""

from __future__ import annotations

from math import atan2, hypot, pi

from exudyn_flexlink.engines.exudyn.faces import Touch, Vector
from exudyn_flexlink.mechanism import CircleContact, grip_of


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
