"""Where a contact of the tree is, in which directions it acts, and on which links.

A shape is a point against a face or a curve, a face on a curve, or two circles. It tells gap, place
and slip; laws, states and events are the same for all shapes (see `contacts`).

Links that carry a point of the tree: where that is, and how forces there act on them.

In plain numbers, for one point at one instant: see `kinematics` for many. Vectors in the plane are
complex numbers.
"""

from __future__ import annotations

from cmath import phase, rect
from collections.abc import Sequence
from functools import cached_property
from math import atan2, copysign, cos, hypot, inf, pi, sin, sqrt
from typing import NamedTuple, Protocol

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray
from exudyn_flexlink.curves import Closest, reach
from exudyn_flexlink.engines.exudyn.faces import Circles, Faces, Touch, Vector, distance_from_ends
from exudyn_flexlink.engines.exudyn.minimal.kinematics import Moving, Points
from exudyn_flexlink.engines.pair_events import Glimpse
from exudyn_flexlink.mechanism import (
    GROUND,
    Anchor,
    CircleContact,
    Contact,
    CurveContact,
    FaceContact,
    FlatContact,
    TurnStop,
    grip_of,
)
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


BESIDE = 1e-12  # m: so far beyond its end a point is beside a curve


class Look(NamedTuple):
    """A contact at one instant; vectors are complex numbers.

    `normal` is the direction in which it pushes the first part, `along` that of the slip; both act
    at the first part's point `at`, m, and friction by its `grip` and arm there (m). `first` and
    `second` are anchors of both parts. `bend` (1/m) is the second derivative of the gap as `at`
    moves past the second's `centre`, across the normal; 0 where nothing is round. What a stop
    presses by turns the first part with the `moment` 1, and pushes nowhere.
    """

    touch: Touch
    normal: complex
    along: complex
    at: complex
    first: Carried
    second: Carried
    centre: complex = 0j
    bend: float = 0.0
    grip: tuple[float, float] = (1.0, 0.0)
    moment: float = 0.0


class Between(NamedTuple):
    """What moves against what as a contact comes near, and in whose axes that is seen.

    The place of `first` from `second` counts along x of the axes of the part `axes`, turned by
    `turned` (rad). `turns` are two parts whose angle matters, too: of the second against the first.
    """

    first: Anchor
    second: Anchor
    axes: int = GROUND
    turned: float = 0.0
    turns: tuple[int, int] | None = None


class Shape(Protocol):
    """What meets what; both may be anywhere in the tree, or on the ground.

    Where it is `straight` its gap is the place across it.
    """

    length: float
    """Of the face or the curve, or around the second circle, m."""
    between: Between
    straight: bool = False

    @property
    def feature(self) -> float:
        """Smallest radius (m) of what the place can't cross."""
        return inf

    def look(self, x: list[float], v: list[float]) -> Look:
        """Look at coordinates and speeds of the tree."""

    def glance(self, place: complex, rate: complex) -> Glimpse:
        """How near it is, by the place (m) of what is `between` and its rate, with its angle."""

    def with_angle(self, place: ComplexArray, angle: FloatArray) -> ComplexArray:  # noqa: ARG002
        """Places (n,) m, or their rates, with the angle (n,) that matters, or its rate."""
        return place

    def steady_bend(self, look: Look) -> float:
        """Second derivative (m/s^2) of the gap where no coordinate of the tree accelerates.

        That are centripetal accelerations, and what the turning and the curvature of the second
        part make of them.
        """
        normal, (_, place, velocity, bend, _, turning) = look.normal, look.second
        arm = look.first.place - place
        # The speed of the point, not of a roller's edge, as the second part sees it.
        along = _dot(look.along, look.first.velocity - velocity - 1j * turning * arm)
        side = copysign(1.0, _cross(look.along, normal))
        turned = turning * turning * _dot(normal, arm) - 2 * side * turning * along
        return _dot(normal, look.first.bend - bend) + turned + look.bend * along * along


def _dot(one: complex, other: complex) -> float:
    return (one.conjugate() * other).real


def _cross(one: complex, other: complex) -> float:
    return (one.conjugate() * other).imag


def _pair(vector: complex) -> Vector:
    return vector.real, vector.imag


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


class RelativeMotion:
    """Places of the first parts of contacts from the second ones, as their shapes ask for them."""

    def __init__(self, layout: TreeLayout, shapes: Sequence[Shape]) -> None:
        between = [shape.between for shape in shapes]
        self._first = Points(layout, [pair.first for pair in between])
        self._second = Points(layout, [pair.second for pair in between])
        frames = [layout.frame(pair.axes) for pair in between]
        self._axes = np.array([frame.link for frame in frames], dtype=int)  # -1: the ground
        turned = [frame.angle + pair.turned for frame, pair in zip(frames, between, strict=True)]
        self._back = np.exp(-1j * np.array(turned))
        self._angles = [
            (k, shapes[k], layout.turning_row(*pair.turns), layout.turn(*pair.turns))
            for k, pair in enumerate(between)
            if pair.turns is not None
        ]

    def look(self, moving: Moving) -> tuple[ComplexArray, ComplexArray]:
        """Places (n, c), m, and their rates at coordinates and speeds (n, links)."""
        x, v, at, rates = moving
        back = at.axis.take(self._axes, axis=-1).conj() * self._back
        place = back * (self._first.places(at) - self._second.places(at))
        rate = back * (self._first.rates(at, rates) - self._second.rates(at, rates))
        rate -= rates.spin.take(self._axes, axis=-1) * place
        for k, shape, row, rest in self._angles:
            place[:, k] = shape.with_angle(place[:, k], x @ row + rest)
            rate[:, k] = shape.with_angle(rate[:, k], v @ row)
        return place, rate


class _Face(Shape):
    """A point against a face."""

    straight = True

    def __init__(self, layout: TreeLayout, contact: FaceContact) -> None:
        self.length = contact.length
        start, end, self._side = contact.start, contact.end, contact.side
        turned = atan2(end.y - start.y, end.x - start.x)
        self.between = Between(contact.point, start, start.part, turned)
        # The face's part may be turned in the axes of the link that carries it.
        self._faces = Faces(contact, layout.frame(contact.start.part).angle)
        self._point = Carrier(layout, contact.point)
        self._start = Carrier(layout, contact.start)

    def look(self, x: list[float], v: list[float]) -> Look:
        """Look at coordinates and speeds of the tree."""
        first, second = self._point.state(x, v), self._start.state(x, v)
        arm, velocity = first.place - second.place, first.velocity - second.velocity
        touch, way, side = self._faces.touch(
            _pair(arm), _pair(velocity), second.angle, second.turning
        )
        along = complex(*way)
        return Look(touch, side * 1j * along, along, first.place, first, second)

    def glance(self, place: complex, rate: complex) -> Glimpse:
        """How near it is."""
        beside = -distance_from_ends(place.real, self.length)
        return Glimpse(self._side * place.imag, self._side * rate.imag, beside)


class _Stop(Shape):
    """A hinge at its stop: hinges on the way between both parts turn it."""

    length = inf
    straight = True

    def __init__(self, layout: TreeLayout, contact: TurnStop) -> None:
        first, second = contact.first.part, contact.second.part
        self.between = Between(contact.second, contact.second, turns=(first, second))
        self._bound = contact.bound
        row = layout.turning_row(first, second).tolist()
        self._row = [(i, share) for i, share in enumerate(row) if share]
        self._rest, self._way = layout.turn(first, second) - contact.bound, contact.way
        self._first, self._second = (
            Carried([(i, 0j) for i, share in self._row if share * way > 0])
            for way in (self._way, -self._way)
        )

    def look(self, x: list[float], v: list[float]) -> Look:
        """Look at coordinates and speeds of the tree."""
        angle, rate = (sum(share * own[i] for i, share in self._row) for own in (x, v))
        touch = Touch(self._way * (angle + self._rest), 0.0, self._way * rate, 0.0, inf)
        return Look(touch, 0j, 0j, 0j, self._first, self._second, moment=1.0)

    def with_angle(self, place: ComplexArray, angle: FloatArray) -> ComplexArray:  # noqa: ARG002
        """Return the angle as if it were a place."""
        return np.asarray(1j * angle)

    def glance(self, place: complex, rate: complex) -> Glimpse:
        """How near it is, by its angle."""
        return Glimpse(self._way * (place.imag - self._bound), self._way * rate.imag)


class _Circles(Shape):
    """Two circles, which touch on the line through their centres."""

    def __init__(self, layout: TreeLayout, contact: CircleContact) -> None:
        self._circles = Circles(contact)
        self.length = 2 * pi * self._circles.edge
        self.between = Between(contact.first, contact.second)
        self._first = Carrier(layout, contact.first)
        self._second = Carrier(layout, contact.second)
        self._turned = layout.frame(contact.second.part).angle

    @property
    def feature(self) -> float:
        """Distance (m) of the centres at which they touch."""
        return self._circles.distance

    def look(self, x: list[float], v: list[float]) -> Look:
        """Look at coordinates and speeds of the tree."""
        first, second = self._first.state(x, v), self._second.state(x, v)
        arm, velocity = first.place - second.place, first.velocity - second.velocity
        spins, angle = (first.turning, second.turning), second.angle + self._turned
        touch, outward, far = self._circles.touch(_pair(arm), _pair(velocity), spins, angle)
        way, grip, normal = self._circles.way, self._circles.grip(touch.gap), complex(*outward)
        return Look(
            touch,
            way * normal,
            1j * normal,
            first.place,
            first,
            second._replace(turning=0.0),  # the gap does not depend on how a circle turns
            second.place,
            way / far if far > 0 else 0.0,
            grip,
        )

    def glance(self, place: complex, rate: complex) -> Glimpse:
        """How near they are, by the places of their centres."""
        far, way = abs(place), self._circles.way
        gap = way * (far - self._circles.distance)
        gap_rate = way * _dot(place, rate) / far if far > 0 else -abs(rate)
        return Glimpse(gap, gap_rate)


class OnCurve(Shape):
    """A point, or a roller around it, against a curve.

    Apart from the curve its closest place counts. What presses is followed along one smooth piece,
    which goes on beyond its ends until a step has ended there: so the equations stay smooth.
    """

    seam = 1e-9  # of its parameter: so far beyond a piece is on it, if pieces meet at an angle

    def __init__(self, layout: TreeLayout, contact: CurveContact | FlatContact) -> None:
        self._curve, self._closest = contact.curve, Closest(contact.curve)
        self.length = contact.curve.arc_length.whole
        self._side, self._radius = contact.side, contact.radius
        origin = Anchor(contact.carrier, 0.0, 0.0)
        self.between = Between(contact.point, origin, contact.carrier)
        self._point, self._origin = Carrier(layout, contact.point), Carrier(layout, origin)
        self._turned = layout.frame(contact.carrier).angle
        self._held: tuple[int, float] | None = None  # piece and place where the last step ended

    @cached_property
    def feature(self) -> float:
        """Smallest radius (m) of the line on which the roller's centre is as it touches."""
        return reach(self._curve, self._side, self._radius)

    def look(self, x: list[float], v: list[float]) -> Look:
        """Look at coordinates and speeds of the tree."""
        first, second = self._point.state(x, v), self._origin.state(x, v)
        arm, axis = first.place - second.place, rect(1.0, second.angle + self._turned)
        seen = axis.conjugate() * arm
        piece, u = self._place(seen)
        foot, tangent, second_derivative = self._at(piece, u)
        speed, side = hypot(*_pair(tangent)), self._side
        way = tangent / speed
        beyond, lateral = _dot(way, seen - foot), _cross(way, seen - foot)
        curvature = _cross(tangent, second_derivative) / speed**3
        near = 1 - curvature * lateral  # 0 at the centre of curvature, where nothing touches
        bend = -side * curvature / near if near > 0 else 0.0
        along = axis * way
        normal = side * 1j * along
        moving = first.velocity - second.velocity - 1j * second.turning * arm
        place, gap = self._along(piece, u) + beyond, side * lateral - self._radius
        touching = 1 - curvature * side * self._radius
        grip = part, lever = grip_of(side * self._radius, touching, near if gap < 0 else touching)
        touch = Touch(
            gap,
            place,
            _dot(normal, moving),
            part * _dot(along, moving) + lever * (first.turning - second.turning),
            inf if self._curve.closed else distance_from_ends(place, self.length),
        )
        return Look(touch, normal, along, first.place, first, second, first.place, bend, grip)

    def glance(self, place: complex, rate: complex) -> Glimpse:
        """How near the point is."""
        foot, tangent, _ = self._at(*self._closest.on_curve(place.real, place.imag))
        way, apart = tangent / abs(tangent), place - foot
        gap = self._side * _cross(way, apart) - self._radius
        beyond = not self._curve.closed and abs(_dot(way, apart)) > BESIDE
        beside = abs(apart) - self._radius if beyond else -inf
        return Glimpse(gap, self._side * _cross(way, rate), beside)

    def follow(self, x: FloatArray | None) -> None:
        """Follow the point from here on along the piece where it is; None: nothing presses."""
        self._held = None if x is None else self._place(self._seen(x.tolist()))

    def left(self, x: FloatArray, _: FloatArray) -> tuple[float, float]:
        """How far the point's place is from the end and the start of the piece; inf of the last."""
        number, u = self._place(self._seen(x.tolist()))
        piece, last = self._curve.pieces[number], len(self._curve.pieces) - 1
        closed = self._curve.closed and last > 0  # a piece that is closed by itself is smooth
        ahead = piece.end - u if closed or number < last else inf
        return ahead, (u - piece.start if closed or number > 0 else inf)

    def next_piece(self, way: int, _: float) -> bool:
        """Go on along the next piece (way 1), or the one before (-1): there is one."""
        assert self._held is not None  # only what presses comes to a piece's end
        number = (self._held[0] + way) % len(self._curve.pieces)
        piece = self._curve.pieces[number]
        self._held = number, piece.start if way > 0 else piece.end
        return True

    def _seen(self, x: list[float]) -> complex:
        """Where the point is in the curve's axes."""
        first, second = (own.state(x, [0.0] * len(x)) for own in (self._point, self._origin))
        axis = rect(1.0, second.angle + self._turned)
        return axis.conjugate() * (first.place - second.place)

    def _place(self, seen: complex) -> tuple[int, float]:
        """Piece of the curve, and place on it, for what is `seen` from the curve's axes."""
        if self._held is None:
            return self._closest.on_curve(seen.real, seen.imag)
        piece, near = self._held
        return piece, self._closest.on_piece(piece, seen.real, seen.imag, near)

    def _at(self, piece: int, u: float) -> tuple[complex, complex, complex]:
        """Point of the curve, and its first two derivatives, in its axes."""
        x, y, dx, dy, ddx, ddy = self._closest.at[piece](u)
        return complex(x, y), complex(dx, dy), complex(ddx, ddy)

    def _along(self, piece: int, u: float) -> float:
        """Length along the curve to a place."""
        length = self._closest.length_to(piece, u)
        return length % self.length if self._curve.closed else length


class _OnFlat(OnCurve):
    """A straight face on a convex curve: it touches where that reaches farthest towards it."""

    def __init__(self, layout: TreeLayout, contact: FlatContact) -> None:
        super().__init__(layout, contact)
        self.length, self._closest = inf, contact.search
        start, end = contact.start, contact.end
        way = complex(end.x - start.x, end.y - start.y) / contact.width
        self._way = rect(1.0, layout.frame(start.part).angle) * way
        self._face_turned = phase(way)
        turns, second = (start.part, contact.carrier), self.between.second
        self.between = Between(second, start, start.part, self._face_turned, turns)
        outline = contact.curve.samples[1] @ [1, 1j]
        self._farthest = float(np.abs(outline).max())

    @cached_property
    def feature(self) -> float:
        """As if the place went past a circle whose gap bends as much.

        By the curve's support function h the gap is s - h(angle): h' is at most the farthest place,
        and h'' at most that and the largest radius.
        """
        largest = float((1 / np.abs(self._curve.curvature(self._curve.samples[0]))).max())
        return 4 * self._farthest**2 / (largest + self._farthest)

    def look(self, x: list[float], v: list[float]) -> Look:
        """Look at coordinates and speeds of the tree."""
        first, second = self._point.state(x, v), self._origin.state(x, v)
        along = rect(1.0, first.angle) * self._way
        normal = -1j * self._side * along
        seen = self._seen(x)
        foot, tangent, second_derivative = self._at(*self._place(seen))
        arm = seen.conjugate() * normal * foot
        radius = hypot(*_pair(tangent)) ** 3 / abs(_cross(tangent, second_derivative))
        at = second.place + arm
        reach = at - first.place
        moving = first.velocity + 1j * first.turning * reach
        moving = moving - second.velocity - 1j * second.turning * arm
        touch = Touch(
            -_dot(normal, reach), _dot(along, reach), _dot(normal, moving), _dot(along, moving), inf
        )
        return Look(touch, normal, along, at, first, second, at - radius * normal)

    def with_angle(self, place: ComplexArray, angle: FloatArray) -> ComplexArray:
        """Places across the face, and what the farthest place turns, so that both may add up."""
        turned = angle * self._farthest
        return np.asarray(sqrt(2) * (self._side * place.imag + 1j * turned))

    def glance(self, place: complex, rate: complex) -> Glimpse:
        """How near the curve is, by its origin's place across the face, and its angle there."""
        scale = sqrt(2) * self._farthest
        axis = rect(1.0, place.imag / scale - self._face_turned)
        seen = -1j * self._side * axis.conjugate()
        arm = axis * self._at(*self._closest.on_curve(seen.real, seen.imag))[0]
        gap = place.real / sqrt(2) + self._side * arm.imag
        turning = self._side * arm.real * rate.imag / scale
        return Glimpse(gap, rate.real / sqrt(2) + turning)

    def steady_bend(self, look: Look) -> float:
        """As if the curve were the circle that fits it there: to the second order it is.

        Its centre is a point against the face.
        """
        second, arm = look.second, look.centre - look.second.place
        turning = second.turning
        centre = second._replace(
            place=look.centre,
            velocity=second.velocity + 1j * turning * arm,
            bend=second.bend - turning * turning * arm,
        )
        swapped = look._replace(normal=-look.normal, first=centre, second=look.first)
        return super().steady_bend(swapped)

    def _seen(self, x: list[float]) -> complex:
        """Direction towards the face, in the curve's axes."""
        first, second = (own.state(x, [0.0] * len(x)) for own in (self._point, self._origin))
        axis = rect(1.0, first.angle - second.angle - self._turned)
        return -1j * self._side * axis * self._way
