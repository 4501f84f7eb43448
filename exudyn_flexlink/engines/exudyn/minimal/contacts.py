"""The penalty force of a contact on a tree's coordinates, and what the contact does."""

from __future__ import annotations

from enum import Enum
from math import cos, inf, sin, tanh

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.exudyn.faces import Touch
from exudyn_flexlink.integrate.problem import Press, Pressing
from exudyn_flexlink.laws import RestitutionPenalty
from exudyn_flexlink.mechanism import Anchor, FaceContact, face_length
from exudyn_flexlink.mechanism.tree import ALONG_X, HINGE, ROOT, Frame, TreeLayout

FloatArray = NDArray[np.float64]
Row = list[tuple[int, float, float]]


NEAR_END = 1e-4  # of the face: there the point is about to leave it
AT_REST = 0.1  # of the speed at which the force changes from loading to unloading


class Side(Enum):
    """Where the point is; behind the face it came beside it, and is not held."""

    APART = "apart"
    PRESSED = "pressed"
    BEHIND = "behind"


class MinimalContact:
    """A point against a face; both may be anywhere in the tree, or on the ground."""

    def __init__(self, layout: TreeLayout, face: FaceContact) -> None:
        assert isinstance(face.law, RestitutionPenalty)  # `run` refuses others
        self.face, self.law, self.friction = face, face.law, face.friction
        self.length = face_length(face)
        self.side = Side.APART
        self.peak = 0.0
        self._point = _Carrier(layout, face.point)
        self._start = _Carrier(layout, face.start)
        # The face's part may be turned in the axes of the link that carries it.
        along = Frame(ROOT, 0.0, 0.0, layout.frame(face.start.part).angle)
        dx, dy = face.end.x - face.start.x, face.end.y - face.start.y
        self._direction = along.place(dx / self.length, dy / self.length)
        self._count = len(layout.links)

    @property
    def acts(self) -> bool:
        """Whether it presses."""
        return self.side is Side.PRESSED

    def touch(self, x: FloatArray, v: FloatArray) -> Touch:
        """Gap, place and rates at coordinates and speeds of the tree."""
        return self._look(x.tolist(), v.tolist())[0]

    def _look(
        self, x: list[float], v: list[float]
    ) -> tuple[Touch, tuple[float, float], Row, Row, tuple[float, float]]:
        """Touch, direction of the face, motions of both sides, place of the point."""
        (px, py), (pu, pv), (_, _), moves = self._point.state(x, v)
        (sx, sy), (su, sv), (angle, turning), turns = self._start.state(x, v)
        c, s = cos(angle), sin(angle)
        ex, ey = self._direction
        tx, ty = c * ex - s * ey, s * ex + c * ey
        dx, dy, ux, uy = px - sx, py - sy, pu - su, pv - sv
        place, lateral, side = tx * dx + ty * dy, tx * dy - ty * dx, self.face.side
        touch = Touch(
            side * lateral,
            place,
            side * (tx * uy - ty * ux - turning * place),
            tx * ux + ty * uy + turning * lateral,
            side,
        )
        return touch, (tx, ty), moves, turns, (px, py)

    def beside(self, touch: Touch) -> bool:
        """Tell whether the point is beside the face, where it may pass the face's line."""
        return not 0 <= touch.place <= self.length

    def left_since(self, touch: Touch) -> float:
        """Time (s) since a point that presses slid off the end of its face; negative: until then.

        0 if it is not about to.
        """
        beyond = touch.place - self.length if touch.place_rate > 0 else touch.place
        if not self.acts or touch.place_rate == 0 or abs(beyond) > NEAR_END * self.length:
            return 0.0
        return beyond / touch.place_rate

    def turns(self, before: float, after: float) -> bool:
        """Tell whether the force leaps between two rates of the gap: the point was at rest."""
        if self.law.restitution == 1.0 or before * after >= 0:
            return False
        return abs(before) > AT_REST * self.law.transition_speed

    def rests_in(self, touch: Touch) -> float:
        """Time (s) after which the point comes to rest, as it goes now; infinite if it does not."""
        slow = abs(touch.gap_rate) < self.law.transition_speed
        if self.law.restitution == 1.0 or slow or touch.gap_rate * touch.gap_bend >= 0:
            return inf
        return -touch.gap_rate / touch.gap_bend

    def force(self, touch: Touch) -> float:
        """Pressing force, N; none while apart."""
        if touch.gap >= 0:
            return 0.0
        e2 = self.law.restitution**2
        rising = tanh(-touch.gap_rate / self.law.transition_speed)
        return -touch.gap * self.law.stiffness * ((1 + e2) / 2 + (1 - e2) / 2 * rising)

    def push(
        self, x: FloatArray, v: FloatArray, onto: FloatArray
    ) -> tuple[tuple[float, float], tuple[float, float]]:
        """Add the generalised forces.

        Return the pressing force (N) and the power it takes (W), and the gap (m) and its rate.
        """
        touch, (tx, ty), moves, turns, at = self._look(x.tolist(), v.tolist())
        # As a contact ends a trial state may be just off the face: no force pulls.
        press, rub = self.force(touch), 0.0
        if self.friction is not None:
            rub = float(self.friction.force(press, touch.place_rate))
        side = touch.side
        fx, fy = -side * press * ty + rub * tx, side * press * tx + rub * ty
        _add(onto, moves, at, (fx, fy))
        _add(onto, turns, at, (-fx, -fy))
        power = -press * touch.gap_rate - rub * touch.place_rate
        return (press, power), (touch.gap, touch.gap_rate)

    def gradient(self, x: FloatArray, v: FloatArray) -> FloatArray:
        """Gradient of the gap (links,)."""
        touch, (tx, ty), moves, turns, at = self._look(x.tolist(), v.tolist())
        row, normal = np.zeros(self._count), (-touch.side * ty, touch.side * tx)
        _add(row, moves, at, normal)
        _add(row, turns, at, (-normal[0], -normal[1]))
        return row


def press_by(laws: list[RestitutionPenalty]) -> Press:
    """Forces of contacts and their slopes, by gaps and rates (..., c, 2)."""
    k, e, vs = np.array([(law.stiffness, law.restitution, law.transition_speed) for law in laws]).T
    elastic, lossy = k * (1 + e**2) / 2, k * (1 - e**2) / 2

    def press(touching: FloatArray) -> Pressing:
        gap, rate = touching[..., 0], touching[..., 1]
        depth, rising = np.maximum(-gap, 0.0), np.tanh(-rate / vs)
        factor = elastic + lossy * rising
        bend = lossy / vs * (1 - rising * rising)
        return Pressing(depth * factor, factor * (depth > 0), depth * bend)

    return press


def _add(onto: FloatArray, moves: Row, at: tuple[float, float], force: tuple[float, float]) -> None:
    """Add a force at a place, by the links that move it: hinges at (a, b), slides along (a, b)."""
    for i, a, b in moves:
        if i >= 0:
            onto[i] += (at[0] - a) * force[1] - (at[1] - b) * force[0]
        else:
            onto[~i] += a * force[0] + b * force[1]


class _Carrier:
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
    ) -> tuple[tuple[float, float], tuple[float, float], tuple[float, float], Row]:
        """Place, velocity, angle with its rate, and the links with their hinges or axes.

        A slide is told from a hinge by its number's bitwise complement.
        """
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
