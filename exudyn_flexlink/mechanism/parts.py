"""Rigid parts, and points of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import hypot

GROUND = -1


@dataclass(frozen=True)
class RigidPart:
    """A rigid part: mass in kg, inertia about the centre of mass in kg m^2, lengths in m.

    `points` (x, y) are those that anything refers to, beside the origin.
    """

    name: str
    body: str
    mass: float
    inertia: float
    centre: tuple[float, float]
    points: tuple[tuple[float, float], ...]

    @cached_property
    def reach(self) -> float:
        """How far the farthest of its points is from its origin, m."""
        return max(hypot(x, y) for x, y in self.points)

    @property
    def inertia_about_origin(self) -> float:
        """Moment of inertia about the part's origin, kg m^2 (Steiner)."""
        return self.inertia + self.mass * (self.centre[0] ** 2 + self.centre[1] ** 2)


@dataclass(frozen=True)
class Anchor:
    """A point of a part in its own axes, or of the ground (part = GROUND), in m."""

    part: int
    x: float
    y: float
