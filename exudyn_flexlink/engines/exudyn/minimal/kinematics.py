"""Places, velocities and accelerations of a tree's links, for many instants at once.

Vectors in the plane are complex numbers. With theta the angle of a link (the sum of the hinges up
to it), theta' that of its parent, o its joint's offset, s the coordinate of a slide and e its
direction, the origin of link i is the sum over the links up to it of

    d = exp(i theta') o + s e,

and its velocity and acceleration are the sums of the derivatives of d.

If a slot guides the slide that carries its point, s is a function of the guide's angle. With the
pivot C, ``w = gamma(u) - C``, the guide's axes e, e^ and x the 2D cross product, the point is on
the track where ``e x w = b``, and then ``s = e.w - a``. Here (a, b) is the slide's zero in the axes
e, e^ from the pivot. Derivatives by the guide's angle, with ``sigma = e x gamma_u``:

    u'  = e.w / sigma
    s'  = b + (e.gamma_u) u'
    u'' = (s' - (-e.gamma_u + (e x gamma_uu) u') u') / sigma
    s'' = sigma u' + (e.gamma_uu) u'^2 + (e.gamma_u) u''
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import cos, hypot, inf, sin
from typing import Any, NamedTuple

import numpy as np

from exudyn_flexlink.arrays import BoolArray, ComplexArray, FloatArray, IndexArray
from exudyn_flexlink.curves import Evaluator, Knots, evaluator
from exudyn_flexlink.curves import Places as CurvePlaces
from exudyn_flexlink.engines.track_follower import (
    LEAST_PART,
    NEWTON_STEPS,
    QUADRATIC,
    DeadCentreError,
    TrackFollower,
)
from exudyn_flexlink.mechanism import GROUND, Anchor, Assembly, Poses, Slot
from exudyn_flexlink.mechanism.tree import ALONG_Y, HINGE, GuidedSlot, TreeLayout
from exudyn_flexlink.result import Event

Which = int | slice | IndexArray | BoolArray | None
"""One of several instants, or some of them; None puts an axis of length 1 before one state."""

# Step of a central difference (m, or m/s): it loses half the digits; Newton's method can spare
# them.
DIFFERENCE = 1e-8


@dataclass(frozen=True)
class Transform:
    """T of ``x'' = T z'' + b``, (links, independent); a first axis counts several instants.

    If the independent coordinates are some of the tree's (`chosen`), and no other coordinate
    follows them, T only picks these at all instants. Then nothing is multiplied.
    """

    matrix: FloatArray
    chosen: slice | IndexArray | None = None

    def __getitem__(self, which: Which) -> Transform:
        """One of several instants, or some of them: see `coordinates.TreeState`."""
        return self if self.chosen is not None else Transform(self.matrix[which])

    def reduced_rows(self, rows: FloatArray) -> FloatArray:
        """Rows (..., links) times T, such as forces: those of the independent coordinates."""
        if self.chosen is not None:
            return np.asarray(rows[..., self.chosen])
        return np.asarray((rows[..., None, :] @ self.matrix)[..., 0, :])

    def reduced(self, matrices: FloatArray) -> FloatArray:
        """``T^T M T`` of matrices (..., links, links)."""
        if self.chosen is not None:
            return np.asarray(matrices[..., self.chosen][..., self.chosen, :])
        return np.asarray(np.swapaxes(self.matrix, -1, -2) @ matrices @ self.matrix)

    def expanded(self, free: FloatArray) -> FloatArray:
        """T times values (..., independent): those of all coordinates."""
        if self.chosen is None:
            return np.asarray((self.matrix @ free[..., None])[..., 0])
        whole = np.zeros((*free.shape[:-1], len(self.matrix)))
        whole[..., self.chosen] = free
        return whole


def picked(value: Any, which: Which) -> Any:
    """Arrays, or tuples of them, at one or some of several instants (the first axis)."""
    if isinstance(value, tuple):
        return type(value)._make([picked(part, which) for part in value])  # type: ignore[attr-defined]
    return None if value is None else value[which]


def joined(parts: Sequence[Any]) -> Any:
    """Arrays, or tuples of them, of several instants each, joined along the first axis."""
    first = parts[0]
    if isinstance(first, tuple):
        columns = zip(*parts, strict=True)
        return type(first)._make(map(joined, columns))  # type: ignore[attr-defined]
    if isinstance(first, Transform):
        chosen = first.chosen is not None
        return first if chosen else Transform(np.concatenate([part.matrix for part in parts]))
    return None if first is None else np.concatenate(parts)


@dataclass(frozen=True)
class Motions:
    """Frames of parts at many instants, (instants, parts, 3): x, y (m), angle (rad)."""

    poses: FloatArray
    rates: FloatArray
    bends: FloatArray  # second derivatives


class Places(NamedTuple):
    """Poses of the links, (..., links + 1) each; the last is the ground."""

    angle: FloatArray
    axis: ComplexArray  # exp(i angle)
    origin: ComplexArray
    slide: ComplexArray  # (..., links): direction of a slide, 0 for a hinge


class Rates(NamedTuple):
    """Derivatives by time of the angles and the origins of links, (..., links + 1)."""

    angle: FloatArray
    origin: ComplexArray
    spin: ComplexArray  # i times the rate of the angle


class Moving(NamedTuple):
    """Coordinates and speeds (..., links), with the links' poses and their rates.

    `t` (...) are the instants (s).
    """

    x: FloatArray
    v: FloatArray
    places: Places
    rates: Rates
    t: FloatArray | float = 0.0


class LinkKinematics:
    """Kinematics of all links of a layout."""

    def __init__(self, layout: TreeLayout) -> None:
        links = layout.links
        count = len(links)
        above = np.zeros((count, count))
        for i in range(count):
            above[i, layout.path(i)] = 1.0
        above = np.vstack([above, np.zeros(count)])  # no link moves the ground, the last row
        self._above = above.T.astype(complex)
        self.hinge = np.array([link.kind == HINGE for link in links], dtype=bool)
        self.turning = (above * self.hinge).T  # (links, links + 1): 1 if a hinge turns a link
        self._turned = above @ np.array([link.turn for link in links])
        self._parent = np.array([link.parent for link in links], dtype=int)  # -1: the ground
        self._offset = np.array([complex(*link.offset) for link in links])
        across = np.array([link.kind == ALONG_Y for link in links], dtype=bool)
        self._along = np.where(self.hinge, 0.0, np.where(across, 1j, 1.0))
        self._spin = 1j * self.hinge
        self.moved_by = above.astype(bool)

    def places(self, x: FloatArray) -> Places:
        """Return angles, axes and origins at coordinates (..., links)."""
        angle = x @ self.turning + self._turned
        axis = np.empty(angle.shape, dtype=complex)
        axis.real, axis.imag = np.cos(angle), np.sin(angle)
        slide = axis[..., :-1] * self._along
        moved = axis.take(self._parent, axis=-1) * self._offset + slide * x
        return Places(angle, axis, moved @ self._above, slide)

    def rates(self, places: Places, x: FloatArray, v: FloatArray) -> Rates:
        """First derivatives at speeds (..., links)."""
        angle = v @ self.turning
        spin = 1j * angle
        turned = (spin * places.axis).take(self._parent, axis=-1) * self._offset
        slid = places.slide * (v + spin[..., :-1] * x)
        return Rates(angle, (turned + slid) @ self._above, spin)

    def moving(self, x: FloatArray, v: FloatArray, t: FloatArray | float = 0.0) -> Moving:
        """State of coordinates and speeds (..., links) at instants (...), s."""
        places = self.places(x)
        return Moving(x, v, places, self.rates(places, x, v), t)

    def bends(
        self, places: Places, rates: Rates, x: FloatArray, v: FloatArray, a: FloatArray
    ) -> Rates:
        """Second derivatives at accelerations (..., links)."""
        angle = a @ self.turning
        turning = 1j * angle
        spin = turning - rates.angle**2
        turned = (spin * places.axis).take(self._parent, axis=-1) * self._offset
        slid = places.slide * (a + 2j * v * rates.angle[..., :-1] + spin[..., :-1] * x)
        return Rates(angle, (turned + slid) @ self._above, turning)

    def moves(self, places: Places, points: Points) -> ComplexArray:
        """Derivatives (..., points, links) of points by the coordinates."""
        carried = self.carries(places, points.places(places))
        return np.asarray(np.where(self.moved_by[points.links], carried, 0.0))

    def carries(self, places: Places, points: ComplexArray) -> ComplexArray:
        """Derivatives (..., points, links) of points as if every link carried them."""
        by_hinges = self._spin * (points[..., None] - places.origin[..., None, :-1])
        return np.asarray(by_hinges + places.slide[..., None, :])


class Points:
    """Points that links carry: their places and derivatives."""

    def __init__(self, layout: TreeLayout, anchors: Sequence[Anchor]) -> None:
        places = [layout.place(anchor) for anchor in anchors]
        self.links = np.array([link for link, _, _ in places], dtype=int)  # -1: the ground
        self._arms = np.array([complex(x, y) for _, x, y in places])

    def places(self, links: Places) -> ComplexArray:
        """Return the points (..., points)."""
        arms = links.axis.take(self.links, axis=-1) * self._arms
        return np.asarray(links.origin.take(self.links, axis=-1) + arms)

    def rates(self, links: Places, rates: Rates) -> ComplexArray:
        """First derivatives (..., points)."""
        turned = (rates.spin * links.axis).take(self.links, axis=-1) * self._arms
        return np.asarray(rates.origin.take(self.links, axis=-1) + turned)

    def bends(self, links: Places, rates: Rates, bends: Rates) -> ComplexArray:
        """Second derivatives (..., points)."""
        turned = ((bends.spin - rates.angle**2) * links.axis).take(self.links, axis=-1)
        return np.asarray(bends.origin.take(self.links, axis=-1) + turned * self._arms)


def poses(moving: Moving) -> Poses:
    """Return the poses of the links in the form that contacts use."""
    _, _, places, rates, t = moving
    return Poses(places.origin, places.axis, places.angle, rates.origin, rates.angle, rates.spin, t)


def motions(
    layout: TreeLayout, kinematics: LinkKinematics, x: FloatArray, v: FloatArray, a: FloatArray
) -> Motions:
    """Poses of all parts at coordinates, speeds and accelerations (instants, links)."""
    frames = [layout.frames[part] for part in range(len(layout.frames))]
    origins = Points(layout, [Anchor(part, 0.0, 0.0) for part in range(len(frames))])
    places = kinematics.places(x)
    rates = kinematics.rates(places, x, v)
    bends = kinematics.bends(places, rates, x, v, a)
    angles = np.array([frame.angle for frame in frames])
    return Motions(
        _poses(origins.places(places), places.angle[..., origins.links] + angles),
        _poses(origins.rates(places, rates), rates.angle[..., origins.links]),
        _poses(origins.bends(places, rates, bends), bends.angle[..., origins.links]),
    )


def _poses(place: ComplexArray, angle: FloatArray) -> FloatArray:
    return np.stack([place.real, place.imag, angle], axis=-1)


def falls(
    push: Callable[[FloatArray, FloatArray], FloatArray],
    x: FloatArray,
    v: FloatArray,
    lengths: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Stiffness and damping (links, links) of forces, by central differences.

    `push` returns the forces (n, links) of n states. A unit of each coordinate moves a point by
    `lengths` (links,), m. All slopes are 0 if one of the states has no forces.
    """
    count, moved = len(x), np.diag(DIFFERENCE / lengths)
    ways, still = np.concatenate([moved, -moved]), np.zeros((2 * count, count))
    try:
        pushes = push(x + np.concatenate([ways, still]), v + np.concatenate([still, ways]))
    except ArithmeticError:
        return np.zeros((count, count)), np.zeros((count, count))
    ahead, behind, faster, slower = pushes.reshape(4, count, count)
    half = 0.5 * lengths / DIFFERENCE
    return (behind - ahead).T * half, (slower - faster).T * half


def start_coordinates(layout: TreeLayout, assembly: Assembly) -> tuple[FloatArray, FloatArray]:
    """Coordinates and speeds of the tree (links,) at time 0."""
    q, v = assembly.state.q, assembly.state.v
    count = len(layout.links)
    x, speed = np.zeros(count), np.zeros(count)
    pose, rate = np.zeros((count + 1, 2), dtype=complex), np.zeros((count + 1, 2), dtype=complex)
    for i, link in enumerate(layout.links):
        above = link.parent
        if link.held:  # the link above carries it
            arm = np.exp(1j * pose[above, 1].real) * complex(*link.offset)
            pose[i] = pose[above] + (arm, link.turn)
            rate[i] = rate[above] + (1j * rate[above, 1].real * arm, 0.0)
        if not link.parts:
            continue
        pose[i], rate[i] = _link_state(layout, link.parts[0], q, v)
        if above != GROUND and not (layout.links[above].parts or layout.links[above].held):
            # A free group: two slides give the place of its origin, and a hinge turns it there.
            for column, motion in ((x, pose[i]), (speed, rate[i])):
                column[i - 2 : i + 1] = motion[0].real, motion[0].imag, motion[1].real
            continue
        angle, turning = pose[above, 1].real + link.turn, rate[above, 1].real
        if link.kind == HINGE:
            x[i], speed[i] = pose[i, 1].real - angle, rate[i, 1].real - turning
            continue
        arm = np.exp(1j * pose[above, 1].real) * complex(*link.offset)
        along, between = np.exp(-1j * angle), pose[i, 0] - pose[above, 0] - arm
        moving = rate[i, 0] - rate[above, 0] - 1j * turning * (arm + between)
        x[i], speed[i] = (along * between).real, (along * moving).real
    return x, speed


def _link_state(
    layout: TreeLayout, part: int, q: FloatArray, v: FloatArray
) -> tuple[tuple[complex, complex], tuple[complex, complex]]:
    """Origin and angle of the link that carries a part, and their rates."""
    frame = layout.frames[part]
    angle, turning = q[part, 2] - frame.angle, v[part, 2]
    arm = np.exp(1j * angle) * complex(frame.x, frame.y)
    origin = complex(q[part, 0], q[part, 1]) - arm
    moving = complex(v[part, 0], v[part, 1]) - 1j * turning * arm
    return (origin, complex(angle)), (moving, complex(turning))


class TrackPoint(TrackFollower):
    """A slot's point with the geometry of its pieces.

    `changes` counts how often the point went on to another piece, or past the end of a closed one.
    """

    def __init__(self, slot: Slot, place: float, lap: int, events: list[Event]) -> None:
        super().__init__(slot, place, lap, events)
        self.changes = 0
        self._at: list[Evaluator] = [evaluator(piece) for piece in self.curve.pieces]
        self._knots = [piece.knots for piece in self.curve.pieces]

    @property
    def at(self) -> Evaluator:
        """Point and derivatives at a parameter of the present piece, also beyond its ends."""
        return self._at[self.piece]

    @property
    def together(self) -> Callable[[FloatArray], CurvePlaces]:
        """As `at`, for many parameters together."""
        return self.curve.pieces[self.piece].places

    @property
    def knots(self) -> Knots:
        """Parameters of the present piece at which the third derivative jumps."""
        return self._knots[self.piece]

    def next_piece(self, way: int, time: float) -> bool:
        """Go on to the next piece (way 1) or the one before (-1); False at an open curve's end."""
        went = super().next_piece(way, time)
        self.changes += went
        return went


Axis = tuple[float, float]  # cosine and sine of the guide's angle

AT_DEAD_CENTRE = "the guide's axis touches the track"
GRAZING = 1e-3  # sine of the angle between axis and track: below it they count as touching


class SlotGuide(TrackPoint):
    """A slot's point whose place follows from the guide's angle; `u` is its last place."""

    def __init__(
        self, guided: GuidedSlot, place: float, lap: int, angle: float, events: list[Event]
    ) -> None:
        super().__init__(guided.slot, place, lap, events)
        self.guided = guided
        self._home = self.u  # after the last accepted step: every search starts from it
        self._turned, self._axis = angle, (cos(angle), sin(angle))  # of the guide at `_home`
        self._from = guided.pivot, guided.ahead, guided.aside

    def slide(self, angle: float) -> tuple[float, float, float]:
        """Coordinate of the slide (m) and its first two derivatives by the guide's angle.

        The search of the place starts from that at the end of the last step.

        Raises:
            DeadCentreError: the axis misses the track or touches it.

        """
        axis = c, s = cos(angle), sin(angle)
        u = self._newton(axis, self._home, self._axis)
        self.u = self._walk(angle) if u is None else u
        (cx, cy), ahead, aside = self._from
        x, y, dx, dy, ddx, ddy = self.at(self.u)
        slope = c * dy - s * dx
        reach, along = c * (x - cx) + s * (y - cy), c * dx + s * dy
        first = reach / slope
        rate = aside + along * first
        turn = -along + (c * ddy - s * ddx) * first
        second = (rate - turn * first) / slope
        bend = slope * first + (c * ddx + s * ddy) * first * first + along * second
        return reach - ahead, rate, bend

    def _newton(self, axis: Axis, u: float, before: Axis) -> float | None:
        """Place where the axis crosses the piece; with the direction `before` it did so at u.

        None if the point might jump on its way from u. It does not jump if the slope of the axis
        against the track keeps its sign and Kantorovich's condition holds: 2 |f'' step| <= |f'|,
        with f'' at both ends of a step and f' at its start.
        """
        ((cx, cy), _, aside), evaluator = self._from, self.at
        c, s = axis
        x, y, dx, dy, ddx, ddy = evaluator(u)
        slope, was, last = c * dy - s * dx, before[0] * dy - before[1] * dx, inf
        if slope * was <= 0:
            return None
        least = min(abs(slope), abs(was))
        for _ in range(NEWTON_STEPS):
            step = (c * (y - cy) - s * (x - cx) - aside) / slope
            if abs(step) <= QUADRATIC * (1 + abs(u)):  # convergence is quadratic
                return u - step
            bend, gone, u = abs(c * ddy - s * ddx), 2 * abs(step), u - step
            x, y, dx, dy, ddx, ddy = evaluator(u)
            slope, last_bend = c * dy - s * dx, abs(c * ddy - s * ddx)
            if bend * gone > least or last_bend * gone > least or gone > last or slope * was <= 0:
                return None
            least, last = abs(slope), gone / 2
        return None

    def _walk(self, angle: float) -> float:
        """As `_newton`, but turn the guide from its last angle in parts, each short enough.

        Raises:
            DeadCentreError: the axis misses the track or touches it.

        """
        u, done, part = self._home, 0.0, 0.5
        way = angle - self._turned
        while part > LEAST_PART:
            ahead = min(1.0, done + part)
            target, before = self._turned + ahead * way, self._turned + done * way
            foot = self._newton((cos(target), sin(target)), u, (cos(before), sin(before)))
            if foot is None:
                part /= 2
            elif ahead == 1.0:
                return foot
            else:
                u, done, part = foot, ahead, 2 * part
        if self.grazes(self._turned + done * way, u):
            raise DeadCentreError(AT_DEAD_CENTRE)
        raise DeadCentreError("the guide's axis misses the track")

    def sine(self, angle: float, u: float) -> float:
        """Sine of the angle between the guide's axis and the track at a place."""
        _, _, dx, dy, _, _ = self.at(u)
        return (cos(angle) * dy - sin(angle) * dx) / hypot(dx, dy)

    def grazes(self, angle: float, u: float) -> bool:
        """Tell whether the guide's axis nearly touches the track at a place."""
        return abs(self.sine(angle, u)) < GRAZING

    def settle(self, u: float, angle: float) -> None:
        """Start later searches from this place and this angle of the guide: a step ended there."""
        self.u = self._home = u
        self._turned, self._axis = angle, (cos(angle), sin(angle))

    def next_piece(self, way: int, time: float) -> bool:
        """Go on to the next piece (way 1) or the one before (-1); False at an open curve's end."""
        went = super().next_piece(way, time)
        self._home = self.u
        return went
