"""Links that carry a point of the tree: where that is, and how forces there act on them."""

from __future__ import annotations

from math import cos, sin

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.faces import Vector
from exudyn_flexlink.mechanism import Anchor
from exudyn_flexlink.mechanism.tree import ALONG_X, HINGE, TreeLayout

Row = list[tuple[int, float, float]]
"""Links that move a point: hinges at (a, b), slides, by the complement of their number, along."""


def add_force(onto: FloatArray, moves: Row, at: Vector, force: Vector, moment: float = 0.0) -> None:
    """Add a force at a place, and a moment, to those (links,) of the links that move it."""
    for i, a, b in moves:
        if i >= 0:
            onto[i] += (at[0] - a) * force[1] - (at[1] - b) * force[0] + moment
        else:
            onto[~i] += a * force[0] + b * force[1]


class Carrier:
    """The links that carry an anchor, from the ground on, in plain floats."""

    def __init__(self, layout: TreeLayout, anchor: Anchor) -> None:
        self._links: list[tuple[int, int, float, float, float]] = []
        last, *self._end = layout.place(anchor)
        for i in layout.path(last):
            link = layout.links[i]
            kind = 0 if link.kind == HINGE else 1 if link.kind == ALONG_X else 2
            self._links.append((i, kind, link.turn, *link.offset))

    def state(
        self, x: list[float], v: list[float]
    ) -> tuple[Vector, Vector, tuple[float, float], Row]:
        """Place, velocity, angle with its rate, and the links with their hinges or axes."""
        px = py = ux = uy = angle = turning = 0.0
        c, s = 1.0, 0.0
        row: Row = []
        for i, kind, turn, ox, oy in self._links:
            ax, ay = c * ox - s * oy, s * ox + c * oy
            px, py, ux, uy = px + ax, py + ay, ux - turning * ay, uy + turning * ax
            if turn != 0:
                angle += turn
                c, s = cos(angle), sin(angle)
            if kind == 0:
                angle, turning = angle + x[i], turning + v[i]
                c, s = cos(angle), sin(angle)
                row.append((i, px, py))
                continue
            ex, ey = (c, s) if kind == 1 else (-s, c)
            ax, ay = x[i] * ex, x[i] * ey
            px, py = px + ax, py + ay
            ux, uy = ux + v[i] * ex - turning * ay, uy + v[i] * ey + turning * ax
            row.append((~i, ex, ey))
        ax, ay = c * self._end[0] - s * self._end[1], s * self._end[0] + c * self._end[1]
        place, velocity = (px + ax, py + ay), (ux - turning * ay, uy + turning * ax)
        return place, velocity, (angle, turning), row

    def steady_bend(self, x: list[float], v: list[float]) -> Vector:
        """Acceleration (m/s^2) of the anchor where no coordinate of the tree accelerates."""
        angle = turning = bx = by = 0.0
        c, s = 1.0, 0.0
        for i, kind, turn, ox, oy in self._links:
            inward = -turning * turning
            bx, by = bx + inward * (c * ox - s * oy), by + inward * (s * ox + c * oy)
            angle += turn
            c, s = cos(angle), sin(angle)
            if kind == 0:
                angle, turning = angle + x[i], turning + v[i]
                c, s = cos(angle), sin(angle)
                continue
            ex, ey = (c, s) if kind == 1 else (-s, c)
            inward, aside = inward * x[i], 2 * turning * v[i]  # centripetal, and Coriolis'
            bx, by = bx + inward * ex - aside * ey, by + inward * ey + aside * ex
        (ax, ay), inward = self._end, -turning * turning
        return bx + inward * (c * ax - s * ay), by + inward * (s * ax + c * ay)
