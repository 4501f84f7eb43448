"""Where contacts are, in which directions they act, and how near they come: a class for each shape.

A shape is a point against a face or a curve, a straight face on a curve, two circles, joints at
their stop, or a rope over points. Each class looks at many contacts and many instants at once, by
the poses of parts. Laws, states and events are the same for all shapes.

Vectors in the plane are complex numbers. With C the point of the first part, S that of the second,
e the x-axis of the frame in which C is seen (the second part's, turned along a face), and w its
angular velocity, a gap follows from

    z = e* (C - S),      z' = e* (C' - S') - i w z.

Of a face, Re z is the place along it, and Im z the distance to its left.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from cmath import rect
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from math import atan2, inf, pi, sqrt
from typing import Any, ClassVar, Generic, NamedTuple, TypeVar

import numpy as np

from exudyn_flexlink.arrays import BoolArray, ComplexArray, FloatArray, IndexArray
from exudyn_flexlink.curves import Curve
from exudyn_flexlink.mechanism.constraints import Frame
from exudyn_flexlink.mechanism.joints import (
    Anchor,
    CircleContact,
    Contact,
    CurveContact,
    FaceContact,
    FlatContact,
    RopeContact,
    Slide,
    SumStop,
)
from exudyn_flexlink.rounding import PLACE_ROUNDING

ALWAYS_CLOSED = -1.0  # m: gap of a point that is held on its line from both sides
TINY = 1e-150  # m: distance of centres that coincide, so that it has a direction


class Poses(NamedTuple):
    """Poses and velocities of parts, or of the links that carry them: (..., n + 1) each.

    Origins (m), axes ``exp(i angle)``, angles (rad), velocities of origins (m/s), and angular
    speeds (rad/s): `turning` is i times `spin`. The last is the ground. `t` (...) are the instants,
    s, by which some contacts change.
    """

    origin: ComplexArray
    axis: ComplexArray
    angle: FloatArray
    velocity: ComplexArray
    spin: FloatArray
    turning: ComplexArray
    t: FloatArray | float


def poses_of(q: FloatArray, v: FloatArray, t: FloatArray | float) -> Poses:
    """Poses by coordinates and velocities, (..., parts, 3) that broadcast, at instants (...) s."""
    q, v = np.broadcast_arrays(q, v)
    shape = (*q.shape[:-2], q.shape[-2] + 1)
    origin, velocity = np.zeros(shape, dtype=complex), np.zeros(shape, dtype=complex)
    angle, spin = np.zeros(shape), np.zeros(shape)
    for place, turn, part in ((origin, angle, q), (velocity, spin, v)):
        place.real[..., :-1], place.imag[..., :-1] = part[..., 0], part[..., 1]
        turn[..., :-1] = part[..., 2]
    return Poses(origin, np.exp(1j * angle), angle, velocity, spin, 1j * spin, t)


class Seen(NamedTuple):
    """Gap and place (m), their rates (m/s), of contacts: at one instant (c,), or several (m, c).

    A gap is positive while apart. A place counts along the face or the curve from its start, or
    around the second circle from the x-axis of its part; its rate is the slip of the first part's
    material against that of the second. A stop's gap is an angle (rad).
    """

    gap: FloatArray
    place: FloatArray
    gap_rate: FloatArray
    slip: FloatArray

    def pick(self, which: int | slice) -> Seen:
        """Return some of the instants."""
        return Seen(*(column[which] for column in self))

    def of(self, contacts: int | slice | IndexArray | Sequence[int]) -> Seen:
        """Return some of the contacts."""
        return Seen(*(column[..., contacts] for column in self))

    def closed(self, which: BoolArray) -> Seen:
        """The same, with gaps that are always closed for contacts held from both sides."""
        gap = np.where(which, ALWAYS_CLOSED, self.gap)
        return self._replace(gap=gap, gap_rate=np.where(which, 0.0, self.gap_rate))


class Look(NamedTuple):
    """All of contacts (c,) that their forces need, (..., c) each; the first four are as `Seen`.

    `normal` is the direction in which a contact pushes its first part, `along` that of the slip;
    both act at the `point`, m. `bend` (1/m) is the second derivative of the gap as this point moves
    past the second part's `centre`, across the normal; it is 0 between straight shapes.

    Friction of round parts acts at the point that divides the distance of their centres as their
    radii do: parts that roll have one speed of their rims there, at any penetration. In a hollow
    this point is outside the rims. There `grip` is the part of mu F, and of slip, that counts, and
    `arm` (m) the lever about the first part's centre, so that no torque of friction is more than
    mu F times the radius.
    """

    gap: FloatArray
    place: FloatArray
    gap_rate: FloatArray
    slip: FloatArray
    normal: ComplexArray
    along: ComplexArray
    point: ComplexArray
    centre: ComplexArray
    bend: FloatArray
    grip: FloatArray
    arm: FloatArray

    @property
    def seen(self) -> Seen:
        """Gaps, places and their rates alone."""
        return Seen(*self[:4])

    def of(self, contacts: int | IndexArray) -> Look:
        """Return some of the contacts."""
        return Look._make(column[..., contacts] for column in self)


class Glimpse(NamedTuple):
    """Gap (m) of a contact and its rate (m/s); `beside` (m) is how far it lies beside its face."""

    gap: float
    gap_rate: float
    beside: float = -inf


Foot = tuple[Any, Any, Any, Any]
"""A place on a curve: length up to there (m), the place, and its first two derivatives."""
Search = Callable[[complex], Foot]
"""Finds the place of a curve that is nearest to a point, or to a face in a direction."""

AnyContact = TypeVar("AnyContact", bound=Contact)
OnCurve = TypeVar("OnCurve", bound=CurveContact | FlatContact)


class Relative(NamedTuple):
    """z (m) and its rate, e, and C of the module's formulas, (..., c) each."""

    place: ComplexArray
    rate: ComplexArray
    axes: ComplexArray
    point: ComplexArray


class Shape(ABC, Generic[AnyContact]):
    """Contacts (c,) of one shape.

    If the shape is `straight`, the gap is the place across. `links` (2, c) carry both parts.
    """

    straight: ClassVar[bool] = False

    def __init__(self, contacts: Sequence[AnyContact], frame: Callable[[int], Frame]) -> None:
        """`frame` returns the frame of a part: its link, and its axes there."""
        self.contacts = contacts
        firsts, seconds, turned = zip(*map(self.between, contacts), strict=True)
        self._links, self._arms, _ = _carried(firsts, frame)
        self._bases, self._start, angles = _carried(seconds, frame)
        self._turned = np.exp(1j * (angles + turned))
        self._behind = self._turned.conj() * self._start
        frames = [tuple(map(frame, contact.parts)) for contact in contacts]
        self.links = np.array([[carrier.link for carrier in pair] for pair in frames], dtype=int).T
        self._angles = np.array([[carrier.angle for carrier in pair] for pair in frames]).T
        self._rubs = any(contact.friction is not None for contact in contacts)

    @abstractmethod
    def between(self, contact: AnyContact) -> tuple[Anchor, Anchor, float]:
        """C, S, and the angle (rad) by which e is turned against the axes of S's part."""

    @abstractmethod
    def look(self, poses: Poses) -> Look:
        """Look at the contacts."""

    @abstractmethod
    def glimpse(self, c: int, place: complex, rate: complex) -> Glimpse:
        """Gap of contact number c and its rate, from the `place` and the `rate` of its `path`."""

    def seen(self, poses: Poses) -> Seen:
        """Gaps and places, and their rates, alone."""
        return self.look(poses).seen

    def path(self, poses: Poses) -> tuple[ComplexArray, ComplexArray]:
        """Places (..., c), m, from which `glimpse` computes the gap, and their rates, m/s."""
        return self._relative(poses)[:2]

    def gap_bends(self, look: Look, poses: Poses, bends: ComplexArray) -> FloatArray:
        """Second derivatives (..., c), m/s^2, of the gaps, by accelerations of the origins.

        `bends` (..., n + 1), m/s^2, are the accelerations of origins; angular speeds are constant.
        """
        return _gap_bends(look, self.links, poses, bends)

    def _relative(self, poses: Poses) -> Relative:
        links, bases = self._links, self._bases
        arms = poses.axis.take(links, axis=-1) * self._arms
        axes = poses.axis.take(bases, axis=-1) * self._turned
        point, back = poses.origin.take(links, axis=-1) + arms, axes.conj()
        apart = back * (point - poses.origin.take(bases, axis=-1))
        going = poses.velocity.take(links, axis=-1) - poses.velocity.take(bases, axis=-1)
        going += poses.turning.take(links, axis=-1) * arms
        rate = back * going - poses.turning.take(bases, axis=-1) * apart
        return Relative(apart - self._behind, rate, axes, point)

    def _grips(
        self, radius: FloatArray, touching: FloatArray, pressed: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """As `grips`; without friction in any contact, as of a touch without penetration."""
        if self._rubs:
            return grips(radius, touching, pressed)
        ones = np.ones(pressed.shape)
        return ones, radius * ones

    def _spins(self, poses: Poses) -> tuple[FloatArray, FloatArray]:
        """Angular speeds of both parts."""
        first, second = self.links
        return poses.spin.take(first, axis=-1), poses.spin.take(second, axis=-1)


def _carried(
    anchors: Sequence[Anchor], frame: Callable[[int], Frame]
) -> tuple[IndexArray, ComplexArray, FloatArray]:
    """Links of anchors (c,), their places (m) there, and angles (rad) of their parts' axes."""
    frames = [frame(anchor.part) for anchor in anchors]
    places = [
        carrier.place(anchor.x, anchor.y) for carrier, anchor in zip(frames, anchors, strict=True)
    ]
    links = np.array([carrier.link for carrier in frames], dtype=int)
    return (
        links,
        np.array(places) @ [1, 1j],
        np.array([carrier.angle for carrier in frames]),
    )


def _carried_rate(links: IndexArray, place: ComplexArray, poses: Poses) -> ComplexArray:
    """Velocities (..., c) of the material points of links at these places."""
    arms = place - poses.origin.take(links, axis=-1)
    return np.asarray(
        poses.velocity.take(links, axis=-1) + poses.turning.take(links, axis=-1) * arms
    )


def _carried_bend(
    links: IndexArray, place: ComplexArray, poses: Poses, bends: ComplexArray
) -> ComplexArray:
    """Accelerations (..., c) of the material points of links there, at constant angular speeds."""
    arms = place - poses.origin.take(links, axis=-1)
    return np.asarray(bends.take(links, axis=-1) - poses.spin.take(links, axis=-1) ** 2 * arms)


def _gap_bends(look: Look, links: IndexArray, poses: Poses, bends: ComplexArray) -> FloatArray:
    """Second derivatives of gaps: accelerations of points, with turning and bending of normals."""
    first, second = links
    moved = _carried_bend(first, look.point, poses, bends) - _carried_bend(
        second, look.point, poses, bends
    )
    rates = _carried_rate(first, look.point, poses) - _carried_rate(second, look.point, poses)
    past = _dot(look.along, rates)
    turned = 2 * np.sign(_cross(look.along, look.normal)) * poses.spin.take(second, axis=-1) * past
    return np.asarray(_dot(look.normal, moved) - turned + look.bend * past * past)


def _dot(a: Any, b: Any) -> Any:
    return (a.conjugate() * b).real


def _cross(a: Any, b: Any) -> Any:
    return (a.conjugate() * b).imag


class Faces(Shape[FaceContact]):
    """Points against faces. A point that is held on its line (side 0) always has a closed gap."""

    straight = True

    def __init__(self, contacts: Sequence[FaceContact], frame: Callable[[int], Frame]) -> None:
        super().__init__(contacts, frame)
        self._side = np.array([contact.side for contact in contacts])
        self._held = self._side == 0
        self._any_held = bool(self._held.any())

    def between(self, contact: FaceContact) -> tuple[Anchor, Anchor, float]:
        """C is the point; S is the start of the face, and e points along the face."""
        start, end = contact.start, contact.end
        return contact.point, start, atan2(end.y - start.y, end.x - start.x)

    def seen(self, poses: Poses) -> Seen:
        """Gaps and places, and their rates, alone."""
        return self._seen(*self.path(poses))[0]

    def _seen(self, place: ComplexArray, rate: ComplexArray) -> tuple[Seen, FloatArray]:
        side = self._side
        if self._any_held:
            side = np.where(self._held, np.where(place.imag > 0, -1.0, 1.0), side)
        return Seen(side * place.imag, place.real, side * rate.imag, rate.real), side

    def look(self, poses: Poses) -> Look:
        """Look at the contacts."""
        place, rate, along, point = self._relative(poses)
        seen, side = self._seen(place, rate)
        none = np.zeros_like(seen.gap)
        return Look(*seen, 1j * side * along, along, point, point, none, none + 1.0, none)

    def glimpse(self, c: int, place: complex, rate: complex) -> Glimpse:
        """Gap of a contact and its rate; 0 for one that is held, which always presses."""
        contact = self.contacts[c]
        beside = max(-place.real, place.real - contact.length)
        return Glimpse(contact.side * place.imag, contact.side * rate.imag, beside)


class _Lines:
    """Slides (s,): how far their second anchors are out along lines through the first."""

    def __init__(self, slides: Sequence[Slide], frame: Callable[[int], Frame]) -> None:
        self._firsts, self._starts, angles = _carried([slide.first for slide in slides], frame)
        self._seconds, self._arms, _ = _carried([slide.second for slide in slides], frame)
        directions = np.array([slide.direction for slide in slides])
        self._directions = np.exp(1j * (angles + directions))

    def out(self, poses: Poses) -> tuple[FloatArray, FloatArray]:
        """Lengths (..., s), m, and their rates, m/s."""
        base, end = (
            poses.origin.take(links, axis=-1) + poses.axis.take(links, axis=-1) * arms
            for links, arms in ((self._firsts, self._starts), (self._seconds, self._arms))
        )
        along = poses.axis.take(self._firsts, axis=-1) * self._directions
        moving = _carried_rate(self._seconds, end, poses) - _carried_rate(self._firsts, end, poses)
        return _dot(along, end - base), _dot(along, moving)


class Stops(Shape[SumStop]):
    """Joints at their stops: the gap is an angle or a length, and what presses acts along that."""

    straight = True

    def __init__(self, contacts: Sequence[SumStop], frame: Callable[[int], Frame]) -> None:
        super().__init__(contacts, frame)
        self._ways = np.array([contact.way for contact in contacts])
        self._bounds = np.array([contact.bound for contact in contacts])
        rows = [(c, *of) for c, contact in enumerate(contacts) for of in contact.terms]
        numbers, ties, weights = zip(*rows, strict=True)
        self._summed = np.zeros((len(ties), len(contacts)))  # weights in the sum of each contact
        self._summed[np.arange(len(ties)), numbers] = weights
        carriers = [[frame(part) for part in tie.parts] for tie in ties]
        self._ends = np.array([[carrier.link for carrier in pair] for pair in carriers]).T
        self._starts = np.array([[carrier.angle for carrier in pair] for pair in carriers]).T
        self._slid = [k for k, tie in enumerate(ties) if tie.slide is not None]
        slides = [tie.slide for tie in ties if tie.slide is not None]
        self._lines = _Lines(slides, frame) if slides else None

    def between(self, contact: SumStop) -> tuple[Anchor, Anchor, float]:
        """C and S are anchors of both parts; only angles and lengths count."""
        pushed, back = contact.anchors
        return pushed[0], back[0], 0.0

    def path(self, poses: Poses) -> tuple[ComplexArray, ComplexArray]:
        """Return the sums as places across: the imaginary part of a path."""
        first, second = self._ends
        place = poses.angle.take(second, axis=-1) - poses.angle.take(first, axis=-1)
        place = place + self._starts[1] - self._starts[0]
        rate = poses.spin.take(second, axis=-1) - poses.spin.take(first, axis=-1)
        if self._lines is not None:
            place[..., self._slid], rate[..., self._slid] = self._lines.out(poses)
        return 1j * (place @ self._summed), 1j * (rate @ self._summed)

    def look(self, poses: Poses) -> Look:
        """Look at the contacts; what presses has no direction, and no place."""
        place, rate = self.path(poses)
        none, zero = np.zeros(place.shape), np.zeros_like(place)
        gap, gap_rate = self._ways * (place.imag - self._bounds), self._ways * rate.imag
        return Look(gap, none, gap_rate, none, zero, zero, zero, zero, none, none + 1.0, none)

    def glimpse(self, c: int, place: complex, rate: complex) -> Glimpse:
        """Gap of a contact and its rate, by its sum."""
        contact = self.contacts[c]
        return Glimpse(contact.way * (place.imag - contact.bound), contact.way * rate.imag)


class Circles(Shape[CircleContact]):
    """Two circles, which touch on the line through their centres; the first may be inside."""

    def __init__(self, contacts: Sequence[CircleContact], frame: Callable[[int], Frame]) -> None:
        super().__init__(contacts, frame)
        self._distance = np.array([contact.distance for contact in contacts])
        self._way = np.array([-1.0 if contact.inside else 1.0 for contact in contacts])
        self._radius, self._edge = np.array([contact.radii for contact in contacts]).T

    def between(self, contact: CircleContact) -> tuple[Anchor, Anchor, float]:
        """C is the first centre, S the second."""
        return contact.first, contact.second, 0.0

    def path(self, poses: Poses) -> tuple[ComplexArray, ComplexArray]:
        """First centres from second ones in the ground's axes: the gap does not depend on turns."""
        place, rate, axes, _ = self._relative(poses)
        turning = poses.turning.take(self._bases, axis=-1)
        return axes * place, axes * (rate + turning * place)

    def look(self, poses: Poses) -> Look:
        """Look at the contacts. Concentric circles have the normal of their motion, or else x."""
        place, rate, axes, point = self._relative(poses)
        far, way = np.abs(place), self._way
        if not far.all():
            place = np.where(far > 0, place, TINY * np.where(rate == 0, 1.0, rate))
        outward = place / np.abs(place)
        moving, gap = outward.conj() * rate, way * (far - self._distance)
        pressed = self._distance + way * np.minimum(gap, 0.0)
        grip, arm = self._grips(-way * self._radius, self._distance, pressed)
        first, second = self._spins(poses)
        normal = axes * outward
        return Look(
            gap,
            self._edge * np.mod(np.angle(outward), 2 * pi),
            way * moving.real,
            grip * moving.imag + arm * (first - second),
            way * normal,
            1j * normal,
            point,
            point - axes * place,
            np.divide(way, far, out=np.zeros_like(far), where=far > 0),
            grip,
            arm,
        )

    def glimpse(self, c: int, place: complex, rate: complex) -> Glimpse:
        """Gap of a contact and its rate, by its centres."""
        contact, far = self.contacts[c], abs(place)
        way = -1.0 if contact.inside else 1.0
        gap_rate = way * _dot(place, rate) / far if far > 0 else -abs(rate)
        return Glimpse(way * (far - contact.distance), gap_rate)


class Ropes(Shape[RopeContact]):
    """Ropes over points. The gap is the free length less the lengths of all pieces.

    Directions are those of the last piece.
    """

    def __init__(self, contacts: Sequence[RopeContact], frame: Callable[[int], Frame]) -> None:
        super().__init__(contacts, frame)
        counts = [len(contact.pieces) for contact in contacts]
        self._pieces = Circles([piece for c in contacts for piece in c.pieces], frame)
        self._last = np.cumsum(counts, dtype=np.intp) - 1
        self._first = self._last + 1 - np.array(counts)

    def between(self, contact: RopeContact) -> tuple[Anchor, Anchor, float]:
        """C is the last point of the rope, S the point before it."""
        last = contact.pieces[-1]
        return last.first, last.second, 0.0

    def look(self, poses: Poses) -> Look:
        """Look at the contacts."""
        pieces, t = self._pieces.look(poses), np.asarray(poses.t)
        length, rate = (
            np.stack([c.free_length.of_order(t.ravel(), order) for c in self.contacts], axis=-1)
            for order in (0, 1)
        )
        gap, gap_rate = (
            free.reshape(*t.shape, -1) + np.add.reduceat(column, self._first, axis=-1)
            for free, column in ((length, pieces.gap), (rate, pieces.gap_rate))
        )
        none = np.zeros_like(gap)
        last = pieces.of(self._last)
        return last._replace(gap=gap, place=none, gap_rate=gap_rate, slip=none, bend=none)

    def path(self, poses: Poses) -> tuple[ComplexArray, ComplexArray]:
        """Paths of the last pieces. Those of all pieces are paths of `RopeContact.pieces`."""
        return self._relative(poses)[:2]

    def glimpse(self, c: int, place: complex, rate: complex) -> Glimpse:
        """How much longer a piece is than `RopeContact.shortest`, from the path of the piece."""
        far = abs(place)
        gap_rate = _dot(place, rate) / far if far > 0 else abs(rate)
        return Glimpse(far - self.contacts[c].shortest, gap_rate)


def grips(
    radius: FloatArray, touching: FloatArray, pressed: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return grips, and arms (m) of friction about first parts' centres, (..., c): see `Look`.

    `pressed` is in proportion to the distance of those centres from the second parts' centres of
    curvature; `touching` is the same without penetration.
    """
    pressed = np.maximum(pressed, 0.0)
    farthest = np.maximum(np.maximum(touching, 0.0), pressed)
    farthest = np.where(farthest > 0, farthest, 1.0)  # at the centre of curvature: no friction
    return np.maximum(touching, 0.0) / farthest, radius * pressed / farthest


class _Searched(Shape[OnCurve]):
    """Contacts on curves, where a search finds the place: by default the nearest of the curve."""

    def __init__(
        self,
        contacts: Sequence[OnCurve],
        frame: Callable[[int], Frame],
        searches: Sequence[Search],
    ) -> None:
        super().__init__(contacts, frame)
        self._searches = searches
        self._side = np.array([contact.side for contact in contacts])

    @abstractmethod
    def nearest(self, contact: OnCurve, seen: ComplexArray) -> FloatArray:
        """Parameters (...) of the curve for what is seen from its axes."""

    @abstractmethod
    def view(self, poses: Poses) -> ComplexArray:
        """Points or directions (..., c) in the axes of curves, which the search starts from."""

    def _feet(self, seen: ComplexArray) -> Foot:
        """Places on the curves (..., c) for what is seen from their axes: see `Foot`."""
        if self._searches:
            rows = seen.reshape(-1, len(self.contacts)).tolist()
            columns = [
                search(z) for row in rows for search, z in zip(self._searches, row, strict=True)
            ]
            length, *feet = np.moveaxis(np.array(columns).reshape(*seen.shape, 4), -1, 0)
            return length.real, *feet
        columns = []
        for c, contact in enumerate(self.contacts):
            curve: Curve = contact.curve
            u = self.nearest(contact, seen[..., c])
            columns.append((curve.arc_length.to(u), *curve.places(curve.wrap(u))))
        length, foot, tangent, second = (
            np.stack(part, axis=-1) for part in zip(*columns, strict=True)
        )
        return length, foot, tangent, second


class OnCurves(_Searched[CurveContact]):
    """Points, or rollers around them, against curves. Open curves go on straight at their ends."""

    def __init__(
        self,
        contacts: Sequence[CurveContact],
        frame: Callable[[int], Frame],
        searches: Sequence[Search],
    ) -> None:
        super().__init__(contacts, frame, searches)
        self._radius = np.array([contact.radius for contact in contacts])
        self._distance = np.array([contact.distance for contact in contacts])

    def between(self, contact: CurveContact) -> tuple[Anchor, Anchor, float]:
        """C is the point; S and e are the origin and the x-axis of the curve."""
        return contact.point, Anchor(contact.carrier, 0.0, 0.0), 0.0

    def view(self, poses: Poses) -> ComplexArray:
        """Points (..., c), m."""
        return self.path(poses)[0]

    def nearest(self, contact: CurveContact, seen: ComplexArray) -> FloatArray:
        """Parameters (...) of the curve next to points."""
        search, points = contact.search, vectors(seen)
        return search.parameters(points) if search.cornered else contact.curve.closest(points)

    def look(self, poses: Poses) -> Look:
        """Look at the contacts."""
        place, rate, axes, point = self._relative(poses)
        length, foot, tangent, second = self._feet(place)
        speed, side = np.abs(tangent), self._side
        way = tangent / speed
        off = way.conj() * (place - foot)
        curvature = _cross(tangent, second) / speed**3
        near = 1 - curvature * off.imag  # 0 at the centre of curvature, where nothing touches
        bend = np.divide(-side * curvature, near, out=np.zeros_like(near), where=near > 0)
        gap = side * off.imag - self._distance
        touching = 1 - curvature * side * self._distance
        grip, arm = self._grips(side * self._radius, touching, np.where(gap < 0, near, touching))
        moving, along = way.conj() * rate, axes * way
        spins = self._spins(poses)
        return Look(
            gap,
            length + off.real,
            side * moving.imag,
            grip * moving.real + arm * (spins[0] - spins[1]),
            1j * side * along,
            along,
            point,
            point,
            bend,
            grip,
            arm,
        )

    def glimpse(self, c: int, place: complex, rate: complex) -> Glimpse:
        """Gap of a contact and its rate."""
        contact = self.contacts[c]
        _, foot, tangent, _ = self._searches[c](place)
        way, apart = tangent / abs(tangent), place - foot
        gap = contact.side * _cross(way, apart) - contact.distance
        beyond = not contact.curve.closed and abs(_dot(way, apart)) > PLACE_ROUNDING
        beside = abs(apart) - abs(contact.distance) if beyond else -inf
        return Glimpse(gap, contact.side * _cross(way, rate), beside)


class OnFlats(_Searched[FlatContact]):
    """Straight faces on convex curves, at the curve's point that is farthest towards the face.

    The curve's origin is seen from the face's start, along the face.
    """

    def __init__(
        self,
        contacts: Sequence[FlatContact],
        frame: Callable[[int], Frame],
        searches: Sequence[Search],
    ) -> None:
        super().__init__(contacts, frame, searches)
        # The turn, times the farthest place, is a length, so that `path` may add both.
        self._farthest = np.array([contact.farthest for contact in contacts])

    def between(self, contact: FlatContact) -> tuple[Anchor, Anchor, float]:
        """C is the curve's origin; S is the start of the face, and e points along the face."""
        start, end = contact.start, contact.end
        turned = atan2(end.y - start.y, end.x - start.x)
        return Anchor(contact.carrier, 0.0, 0.0), start, turned

    def view(self, poses: Poses) -> ComplexArray:
        """Directions (..., c) towards the faces."""
        axes = poses.axis.take(self._bases, axis=-1) * self._turned
        return np.asarray(self._axis(poses).conj() * -1j * self._side * axes)

    def _axis(self, poses: Poses) -> ComplexArray:
        """Axes of the curves (..., c)."""
        return np.asarray(poses.axis.take(self.links[1], axis=-1) * np.exp(1j * self._angles[1]))

    def nearest(self, contact: FlatContact, seen: ComplexArray) -> FloatArray:
        """Parameters (...) of the curve, by directions towards the face."""
        return contact.search.parameters(vectors(seen))

    def path(self, poses: Poses) -> tuple[ComplexArray, ComplexArray]:
        """Places of origins across their faces, and turns times the farthest place, as lengths."""
        place, rate, *_ = self._relative(poses)
        face, carrier = self.links
        turned = poses.angle.take(carrier, axis=-1) - poses.angle.take(face, axis=-1)
        turned = turned + self._angles[1] - self._angles[0]
        turning = poses.turning.take(carrier, axis=-1) - poses.turning.take(face, axis=-1)
        return (
            np.asarray(sqrt(2) * (self._side * place.imag + 1j * self._farthest * turned)),
            np.asarray(sqrt(2) * (self._side * rate.imag + self._farthest * turning)),
        )

    def look(self, poses: Poses) -> Look:
        """Look at the contacts."""
        _, _, along, origin = self._relative(poses)
        normal = -1j * self._side * along
        _, foot, tangent, second = self._feet(self.view(poses))
        radius = np.abs(tangent) ** 3 / np.abs(_cross(tangent, second))
        arm = self._axis(poses) * foot
        touched = origin + arm
        start = poses.origin.take(self._bases, axis=-1)
        reach = touched - start - poses.axis.take(self._bases, axis=-1) * self._start
        of_face, of_curve = (_carried_rate(link, touched, poses) for link in self.links)
        moving, none = of_face - of_curve, np.zeros_like(radius)
        return Look(
            -_dot(normal, reach),
            _dot(along, reach),
            _dot(normal, moving),
            _dot(along, moving),
            normal,
            along,
            touched,
            touched - radius * normal,
            none,
            none + 1.0,
            none,
        )

    def gap_bends(self, look: Look, poses: Poses, bends: ComplexArray) -> FloatArray:
        """Second derivatives of the gaps: see `Shape.gap_bends`.

        They are those of the centre of the curve's circle of curvature, a point against the face:
        that circle is exact to the second order.
        """
        centre = look._replace(point=look.centre, normal=-look.normal)
        return _gap_bends(centre, self.links[::-1], poses, bends)

    def glimpse(self, c: int, place: complex, rate: complex) -> Glimpse:
        """Gap of a contact and its rate, by the curve's origin across the face and its angle."""
        contact = self.contacts[c]
        scale = sqrt(2) * contact.farthest
        dx, dy = contact.end.x - contact.start.x, contact.end.y - contact.start.y
        axis = rect(1.0, place.imag / scale - atan2(dy, dx))
        seen = -1j * contact.side * axis.conjugate()
        arm = axis * self._searches[c](seen)[1]
        gap = place.real / sqrt(2) + contact.side * arm.imag
        return Glimpse(gap, rate.real / sqrt(2) + contact.side * arm.real * rate.imag / scale)


class ContactShapes:
    """Contacts (c,) of any shapes, in their order; `searches` on curves are by contact number."""

    def __init__(
        self,
        contacts: Sequence[Contact],
        frame: Callable[[int], Frame] = Frame,
        searches: Mapping[int, Search] | None = None,
    ) -> None:
        """`frame` returns the frame of a part in its link; left out, each part is its own link."""
        self.contacts = contacts
        kinds: dict[type, list[int]] = {}
        for k, contact in enumerate(contacts):
            kinds.setdefault(type(contact), []).append(k)
        self._groups: list[tuple[IndexArray, Shape[Any]]] = []
        for kind, numbers in kinds.items():
            some = [contacts[k] for k in numbers]
            shape = SHAPES[kind]
            followed = [] if searches is None else [searches[k] for k in numbers if k in searches]
            more = (followed,) if issubclass(shape, _Searched) else ()
            self._groups.append((np.array(numbers), shape(some, frame, *more)))
        self._only = self._groups[0][1] if len(self._groups) == 1 else None
        self._places = {k: (g, c) for g, (numbers, _) in enumerate(self._groups)
                        for c, k in enumerate(numbers.tolist())}  # fmt: skip
        parts = [[frame(part).link for part in contact.parts] for contact in contacts]
        self.links = np.array(parts, dtype=int).reshape(-1, 2).T
        self.straight = np.array([SHAPES[type(c)].straight for c in contacts], dtype=bool)

    def look(self, poses: Poses) -> Look:
        """Look at the contacts, (..., c)."""
        if self._only is not None:
            return self._only.look(poses)
        return Look(*self._of_all(self._shape(poses), _LOOK_KINDS, lambda group: group.look(poses)))

    def seen(self, poses: Poses) -> Seen:
        """Gaps and places, and their rates, alone, (..., c)."""
        if self._only is not None:
            return self._only.seen(poses)
        return Seen(
            *self._of_all(self._shape(poses), _LOOK_KINDS[:4], lambda group: group.seen(poses))
        )

    def path(self, poses: Poses) -> tuple[ComplexArray, ComplexArray]:
        """Places of first parts seen from second ones, and their rates: see `Shape.path`."""
        if self._only is not None:
            return self._only.path(poses)
        place, rate = self._of_all(self._shape(poses), (1j, 1j), lambda group: group.path(poses))
        return place, rate

    def gap_bends(self, look: Look, poses: Poses, bends: ComplexArray) -> FloatArray:
        """Second derivatives of the gaps: see `Shape.gap_bends`."""
        bends_of_gaps = np.empty(look.gap.shape)
        for numbers, group in self._groups:
            bends_of_gaps[..., numbers] = group.gap_bends(look.of(numbers), poses, bends)
        return bends_of_gaps

    def view(self, poses: Poses) -> ComplexArray:
        """Points or directions in the axes of curves, if all contacts are on curves: see `Foot`."""
        assert isinstance(self._only, _Searched)
        return self._only.view(poses)

    def glimpse(self, k: int) -> Callable[[complex, complex], Glimpse]:
        """Function that returns contact k's gap and its rate, by its path and the rate of that."""
        return partial(self._group(k).glimpse, self._places[k][1])

    def _group(self, k: int) -> Shape[Any]:
        return self._groups[self._places[k][0]][1]

    def _shape(self, poses: Poses) -> tuple[int, ...]:
        return (*poses.angle.shape[:-1], len(self.contacts))

    def _of_all(
        self, shape: tuple[int, ...], kinds: tuple[complex, ...], ask: Callable[[Any], Any]
    ) -> list[Any]:
        """Columns of all contacts, real or complex, of what `ask` returns for each shape."""
        columns: list[Any] = [np.zeros(shape, dtype=type(kind)) for kind in kinds]
        for numbers, group in self._groups:
            for column, part in zip(columns, ask(group), strict=True):
                column[..., numbers] = part
        return columns


SHAPES: dict[type, type[Shape[Any]]] = {
    FaceContact: Faces,
    CircleContact: Circles,
    CurveContact: OnCurves,
    FlatContact: OnFlats,
    SumStop: Stops,
    RopeContact: Ropes,
}
_LOOK_KINDS = (1.0, 1.0, 1.0, 1.0, 1j, 1j, 1j, 1j, 1.0, 1.0, 1.0)


def vectors(numbers: ComplexArray) -> FloatArray:
    """Vectors (..., 2) of complex numbers (...)."""
    return np.stack([numbers.real, numbers.imag], axis=-1)
