"""Links that carry a point of the tree: where that is, and how forces there act on them.

In plain numbers, for one point at one instant: see `kinematics` for many. Vectors in the plane are
complex numbers.
"""

from __future__ import annotations

from math import cos, sin
from typing import NamedTuple

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import Anchor
from exudyn_flexlink.mechanism.tree import ALONG_X, HINGE, TreeLayout

Moves = list[tuple[int, complex]]
"""Links that move a point: hinges at a place, slides, by the complement of their number, along."""


class Carried(NamedTuple):
    """An anchor at one instant: place (m), velocity (m/s), angle (rad) and its rate (rad/s).

    `bend` (m/s^2) is its acceleration where no coordinate of the tree accelerates.
    """

    moves: Moves
    place: complex = 0j
    velocity: complex = 0j
    bend: complex = 0j
    angle: float = 0.0
    turning: float = 0.0


def add_force(
    onto: FloatArray, moves: Moves, at: complex, force: complex, moment: float = 0.0
) -> None:
    """Add a force at a place, and a moment, to those (links,) of the links that move it."""
    for i, place in moves:
        if i >= 0:
            onto[i] += ((at - place).conjugate() * force).imag + moment
        else:
            onto[~i] += (place.conjugate() * force).real


class Carrier:
    """The links that carry an anchor, from the ground on."""

    def __init__(self, layout: TreeLayout, anchor: Anchor) -> None:
        last, *end = layout.place(anchor)
        self._end = complex(*end)
        links = [(i, layout.links[i]) for i in layout.path(last)]
        along = {HINGE: 0j, ALONG_X: 1 + 0j}
        self._links = [
            (i, along.get(link.kind, 1j), link.turn, complex(*link.offset)) for i, link in links
        ]

    def state(self, x: list[float], v: list[float]) -> Carried:
        """Look at coordinates and speeds of the tree."""
        place = velocity = bend = 0j
        angle = turning = 0.0
        axis, moves = 1 + 0j, []
        for i, along, turn, offset in self._links:
            arm, inward = axis * offset, -turning * turning
            place, velocity = place + arm, velocity + 1j * turning * arm
            bend += inward * arm
            angle += turn
            if along == 0:
                angle, turning = angle + x[i], turning + v[i]
                axis = complex(cos(angle), sin(angle))
                moves.append((i, place))
                continue
            axis = complex(cos(angle), sin(angle))
            way = axis * along
            arm = x[i] * way
            place, velocity = place + arm, velocity + v[i] * way + 1j * turning * arm
            # Centripetal, and Coriolis'.
            bend = bend + inward * x[i] * way + 2j * turning * v[i] * way
            moves.append((~i, way))
        arm = axis * self._end
        place, velocity = place + arm, velocity + 1j * turning * arm
        return Carried(moves, place, velocity, bend - turning * turning * arm, angle, turning)
