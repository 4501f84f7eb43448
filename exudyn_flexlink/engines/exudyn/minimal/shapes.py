"""Where a contact of the tree is, in which directions it acts, and on which links.

A shape is a point against a face or a curve, a face on a curve, or two circles. It tells gap, place
and slip; laws, states and events are the same for all shapes (see `contacts`).
"""

from __future__ import annotations

from math import cos, hypot, inf, pi, sin
from typing import NamedTuple, Protocol

from exudyn_flexlink.curves import Closest
from exudyn_flexlink.engines.exudyn.faces import Circles, Faces, Touch, Vector, distance_from_ends
from exudyn_flexlink.engines.exudyn.minimal.carriers import Carrier, Row
from exudyn_flexlink.mechanism import (
    Anchor,
    CircleContact,
    Contact,
    CurveContact,
    FaceContact,
    FlatContact,
    TurnStop,
    grip_of,
)
from exudyn_flexlink.mechanism.tree import TreeLayout


class Look(NamedTuple):
    """A contact at one instant.

    `normal` is the direction in which it pushes the first part, `along` that of the slip; both act
    at the first part's point `at`, m, and friction by its `grip` and arm there (m). `first` and
    `second` are the links that carry both parts. `bend` (1/m) is the second derivative of the gap
    as `at` moves past the second's `centre`, across the normal; 0 where nothing is round. What a
    stop presses by turns the first part with the `moment` 1, and pushes nowhere.
    """

    touch: Touch
    normal: Vector
    along: Vector
    at: Vector
    first: Row
    second: Row
    centre: Vector = (0.0, 0.0)
    bend: float = 0.0
    grip: tuple[float, float] = (1.0, 0.0)
    moment: float = 0.0


class Shape(Protocol):
    """What meets what; both may be anywhere in the tree, or on the ground."""

    length: float
    """Of the face or the curve, or around the second circle, m."""

    def look(self, x: list[float], v: list[float]) -> Look:
        """Look at coordinates and speeds of the tree."""

    def steady_bend(self, look: Look, x: list[float], v: list[float]) -> float:
        """Second derivative (m/s^2) of the gap where no coordinate of the tree accelerates.

        It is that at the coordinates and speeds of a `look`.
        """


def shape_of(layout: TreeLayout, contact: Contact) -> Shape:
    """Return the shape of a contact."""
    if isinstance(contact, CircleContact):
        return _Circles(layout, contact)
    if isinstance(contact, CurveContact):
        return OnCurve(layout, contact)
    if isinstance(contact, FlatContact):
        return _OnFlat(layout, contact)
    if isinstance(contact, TurnStop):
        return _Stop(layout, contact)
    return _Face(layout, contact)


class _Face:
    """A point against a face."""

    def __init__(self, layout: TreeLayout, contact: FaceContact) -> None:
        self.length, self._side = contact.length, contact.side
        # The face's part may be turned in the axes of the link that carries it.
        self._faces = Faces(contact, layout.frame(contact.start.part).angle)
        self._point = Carrier(layout, contact.point)
        self._start = Carrier(layout, contact.start)

    def look(self, x: list[float], v: list[float]) -> Look:
        """Look at coordinates and speeds of the tree."""
        (px, py), (pu, pv), _, first = self._point.state(x, v)
        (sx, sy), (su, sv), (angle, turning), second = self._start.state(x, v)
        touch, (tx, ty), side = self._faces.touch(
            (px - sx, py - sy), (pu - su, pv - sv), angle, turning
        )
        return Look(touch, (-side * ty, side * tx), (tx, ty), (px, py), first, second)

    def steady_bend(self, look: Look, x: list[float], v: list[float]) -> float:
        """Centripetal accelerations of point and face, and what the face's turning makes of it."""
        turning = self._start.state(x, v)[2][1]
        (ax, ay), (bx, by) = self._point.steady_bend(x, v), self._start.steady_bend(x, v)
        (nx, ny), touch = look.normal, look.touch
        # `slip` is the speed along the face as the face itself sees it.
        along = touch.slip - turning * self._side * touch.gap
        turned = -2 * self._side * turning * along - turning * turning * touch.gap
        return nx * (ax - bx) + ny * (ay - by) + turned


class _Stop:
    """A hinge at its stop: hinges on the way between both parts turn it."""

    length = inf

    def __init__(self, layout: TreeLayout, contact: TurnStop) -> None:
        first, second = contact.first.part, contact.second.part
        row = layout.turning_row(first, second).tolist()
        self._row = [(i, share) for i, share in enumerate(row) if share]
        self._rest, self._way = layout.turn(first, second) - contact.bound, contact.way
        self._moved: Row = [(i, 0.0, 0.0) for i, share in self._row if share * self._way > 0]
        self._back: Row = [(i, 0.0, 0.0) for i, share in self._row if share * self._way < 0]

    def look(self, x: list[float], v: list[float]) -> Look:
        """Look at coordinates and speeds of the tree."""
        angle, rate = (sum(share * own[i] for i, share in self._row) for own in (x, v))
        touch = Touch(self._way * (angle + self._rest), 0.0, self._way * rate, 0.0, inf)
        none = (0.0, 0.0)
        return Look(touch, none, none, none, self._moved, self._back, moment=1.0)

    def steady_bend(self, look: Look, x: list[float], v: list[float]) -> float:  # noqa: ARG002
        """Return 0: the angle is a sum of coordinates."""
        return 0.0


class _Circles:
    """Two circles, which touch on the line through their centres."""

    def __init__(self, layout: TreeLayout, contact: CircleContact) -> None:
        self._circles = Circles(contact)
        self.length = 2 * pi * self._circles.edge
        self._first = Carrier(layout, contact.first)
        self._second = Carrier(layout, contact.second)
        self._turned = layout.frame(contact.second.part).angle

    def look(self, x: list[float], v: list[float]) -> Look:
        """Look at coordinates and speeds of the tree."""
        (px, py), (pu, pv), (_, spin), first = self._first.state(x, v)
        (sx, sy), (su, sv), (angle, turning), second = self._second.state(x, v)
        touch, (nx, ny), far = self._circles.touch(
            (px - sx, py - sy), (pu - su, pv - sv), (spin, turning), angle + self._turned
        )
        way, grip = self._circles.way, self._circles.grip(touch.gap)
        bend = way / far if far > 0 else 0.0
        at, centre, normal = (px, py), (sx, sy), (way * nx, way * ny)
        return Look(touch, normal, (-ny, nx), at, first, second, centre, bend, grip)

    def steady_bend(self, look: Look, x: list[float], v: list[float]) -> float:
        """Centripetal accelerations of the centres, and how they pass each other."""
        _, (pu, pv), _, _ = self._first.state(x, v)
        _, (su, sv), _, _ = self._second.state(x, v)
        (ax, ay), (bx, by) = self._first.steady_bend(x, v), self._second.steady_bend(x, v)
        (nx, ny), (tx, ty) = look.normal, look.along
        past = tx * (pu - su) + ty * (pv - sv)
        return nx * (ax - bx) + ny * (ay - by) + look.bend * past * past


class OnCurve:
    """A point, or a roller around it, against a curve.

    Apart from the curve its closest place counts. What presses is followed along one smooth piece,
    which goes on beyond its ends until a step has ended there: so the equations stay smooth.
    """

    def __init__(self, layout: TreeLayout, contact: CurveContact | FlatContact) -> None:
        self._curve, self._closest = contact.curve, Closest(contact.curve)
        self.length = contact.curve.arc_length.whole
        self._side, self._radius = contact.side, contact.radius
        self._point = Carrier(layout, contact.point)
        self._origin = Carrier(layout, Anchor(contact.carrier, 0.0, 0.0))
        self._turned = layout.frame(contact.carrier).angle
        self._held: tuple[int, float] | None = None  # piece and place where the last step ended

    def look(self, x: list[float], v: list[float]) -> Look:
        """Look at coordinates and speeds of the tree."""
        (px, py), (pu, pv), (_, spin), first = self._point.state(x, v)
        (sx, sy), (su, sv), (angle, turning), second = self._origin.state(x, v)
        c, s = cos(angle + self._turned), sin(angle + self._turned)
        rx, ry = px - sx, py - sy
        ox, oy = c * rx + s * ry, c * ry - s * rx
        piece, u = self._place(ox, oy)
        fx, fy, dx, dy, ddx, ddy = self._closest.at[piece](u)
        speed = hypot(dx, dy)
        ex, ey = dx / speed, dy / speed
        lateral, beyond = ex * (oy - fy) - ey * (ox - fx), ex * (ox - fx) + ey * (oy - fy)
        side, curvature = self._side, (dx * ddy - dy * ddx) / speed**3
        way = 1 - curvature * lateral  # 0 at the centre of curvature, where nothing touches
        bend = -side * curvature / way if way > 0 else 0.0
        tx, ty = c * ex - s * ey, s * ex + c * ey
        nx, ny = -side * ty, side * tx
        ux, uy = pu - su + turning * ry, pv - sv - turning * rx
        place, gap = self._along(piece, u) + beyond, side * lateral - self._radius
        touching = 1 - curvature * side * self._radius
        grip = part, arm = grip_of(side * self._radius, touching, way if gap < 0 else touching)
        touch = Touch(
            gap,
            place,
            nx * ux + ny * uy,
            part * (tx * ux + ty * uy) + arm * (spin - turning),
            inf if self._curve.closed else distance_from_ends(place, self.length),
        )
        return Look(touch, (nx, ny), (tx, ty), (px, py), first, second, (px, py), bend, grip)

    def steady_bend(self, look: Look, x: list[float], v: list[float]) -> float:
        """Centripetal accelerations, what the curve's turning makes of them, and its curvature."""
        (pu, pv) = self._point.state(x, v)[1]
        (sx, sy), (su, sv), (_, turning), _ = self._origin.state(x, v)
        (ax, ay), (bx, by) = self._point.steady_bend(x, v), self._origin.steady_bend(x, v)
        (nx, ny), (tx, ty), (px, py) = look.normal, look.along, look.at
        # The speed of the point, not of the roller's edge, along the curve as the curve sees it.
        along = tx * (pu - su + turning * (py - sy)) + ty * (pv - sv - turning * (px - sx))
        turned = turning * turning * (nx * (px - sx) + ny * (py - sy))
        turned -= 2 * self._side * turning * along
        return nx * (ax - bx) + ny * (ay - by) + turned + look.bend * along * along

    def follow(self, x: list[float]) -> None:
        """Follow the point from here on along the piece where it is."""
        at = self._seen(x)
        if self._held is None:
            self._held = self._closest.on_curve(*at)
        else:
            self._held = self._held[0], self._closest.on_piece(self._held[0], *at, self._held[1])

    def free(self) -> None:
        """Let the closest place count again."""
        self._held = None

    def left(self, x: list[float]) -> tuple[float, float]:
        """How far the point's place is from the end and the start of the piece; inf of the last."""
        assert self._held is not None  # only what presses comes to a piece's end
        number = self._held[0]
        u = self._closest.on_piece(number, *self._seen(x), self._held[1])
        piece, last = self._curve.pieces[number], len(self._curve.pieces) - 1
        closed = self._curve.closed and last > 0  # a piece that is closed by itself is smooth
        ahead = piece.end - u if closed or number < last else inf
        return ahead, (u - piece.start if closed or number > 0 else inf)

    def next_piece(self, way: int) -> None:
        """Go on along the next piece (way 1), or the one before (-1)."""
        assert self._held is not None  # only what presses comes to a piece's end
        number = (self._held[0] + way) % len(self._curve.pieces)
        piece = self._curve.pieces[number]
        self._held = number, piece.start if way > 0 else piece.end

    def _seen(self, x: list[float]) -> Vector:
        """Where the point is in the curve's axes."""
        still = [0.0] * len(x)
        (px, py), _, _, _ = self._point.state(x, still)
        (sx, sy), _, (angle, _), _ = self._origin.state(x, still)
        c, s, rx, ry = cos(angle + self._turned), sin(angle + self._turned), px - sx, py - sy
        return c * rx + s * ry, c * ry - s * rx

    def _place(self, x: float, y: float) -> tuple[int, float]:
        if self._held is None:
            return self._closest.on_curve(x, y)
        piece, near = self._held
        return piece, self._closest.on_piece(piece, x, y, near)

    def _along(self, piece: int, u: float) -> float:
        """Length along the curve to a place."""
        length = self._closest.length_to(piece, u)
        return length % self.length if self._curve.closed else length


class _OnFlat(OnCurve):
    """A straight face on a convex curve: it touches where that reaches farthest towards it."""

    def __init__(self, layout: TreeLayout, contact: FlatContact) -> None:
        super().__init__(layout, contact)
        self.length, self._closest = inf, contact.search
        turned = layout.frame(contact.start.part).angle
        dx, dy = contact.end.x - contact.start.x, contact.end.y - contact.start.y
        dx, dy, c, s = dx / contact.width, dy / contact.width, cos(turned), sin(turned)
        self._way = c * dx - s * dy, s * dx + c * dy

    def look(self, x: list[float], v: list[float]) -> Look:
        """Look at coordinates and speeds of the tree."""
        (sx, sy), (su, sv), (angle, turning), first = self._point.state(x, v)
        (ox, oy), (ou, ov), (_, spin), second = self._origin.state(x, v)
        (nx, ny), (tx, ty), (rx, ry), _ = self._found(x, angle)
        px, py = ox + rx, oy + ry
        bx, by = px - sx, py - sy
        ux, uy = su - turning * by - ou + spin * ry, sv + turning * bx - ov - spin * rx
        touch = Touch(
            -nx * bx - ny * by, tx * bx + ty * by, nx * ux + ny * uy, tx * ux + ty * uy, inf
        )
        return Look(touch, (nx, ny), (tx, ty), (px, py), first, second)

    def steady_bend(self, look: Look, x: list[float], v: list[float]) -> float:
        """As if the curve were the circle that fits it there: to the second order it is."""
        (sx, sy), (su, sv), (angle, turning), _ = self._point.state(x, v)
        (ox, oy), (ou, ov), (_, spin), _ = self._origin.state(x, v)
        (ax, ay), (bx, by) = self._point.steady_bend(x, v), self._origin.steady_bend(x, v)
        (nx, ny), (px, py), radius = look.normal, look.at, self._found(x, angle)[-1]
        cx, cy = px - radius * nx, py - radius * ny  # the centre of curvature
        rx, ry = cx - ox, cy - oy
        bx, by, ou, ov = (
            bx - spin * spin * rx,
            by - spin * spin * ry,
            ou - spin * ry,
            ov + spin * rx,
        )
        past = nx * (sv - ov) - ny * (su - ou)
        far = nx * (sx - cx) + ny * (sy - cy)
        return nx * (ax - bx) + ny * (ay - by) + turning * (2 * past - turning * far)

    def _found(self, x: list[float], angle: float) -> tuple[Vector, Vector, Vector, float]:
        """Normal, direction of the face, place from the curve's origin, radius of curvature, m."""
        c, s = cos(angle), sin(angle)
        tx, ty = c * self._way[0] - s * self._way[1], s * self._way[0] + c * self._way[1]
        nx, ny = self._side * ty, -self._side * tx
        ex, ey = self._seen(x)
        c, s = nx * ex + ny * ey, ny * ex - nx * ey  # of the angle of the curve's axes
        piece, u = self._place(ex, ey)
        fx, fy, dx, dy, ddx, ddy = self._closest.at[piece](u)
        radius = hypot(dx, dy) ** 3 / abs(dx * ddy - dy * ddx)
        return (nx, ny), (tx, ty), (c * fx - s * fy, s * fx + c * fy), radius

    def _seen(self, x: list[float]) -> Vector:
        """Direction towards the face, in the curve's axes."""
        still = [0.0] * len(x)
        angle, turned = (own.state(x, still)[2][0] for own in (self._point, self._origin))
        c, s = cos(angle - turned - self._turned), sin(angle - turned - self._turned)
        tx, ty = c * self._way[0] - s * self._way[1], s * self._way[0] + c * self._way[1]
        return self._side * ty, -self._side * tx
