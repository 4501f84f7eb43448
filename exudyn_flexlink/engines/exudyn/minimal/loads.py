"""Generalised forces on the coordinates of a tree: of drives, and of springs and dampers.

With P the point of a force F, both complex, and m_k = dP/dx_k, the force on coordinate k is
``Re(conj(F) m_k)``.

Springs and dampers act at joints, across several of them, and between points. Let d be the vector
from the first to the second end of a spring between points (complex, global axes), d' its rate, and
J its derivatives by the coordinates. With stiffness k, damping c and length L the spring pulls its
second end by

    F = -T n,  T = k (|d| - L) + c (n . d'),  n = d / |d|;      L = 0:  F = -k d - c d',

so that Q = J . F. Along a slide n is the direction of its line, which turns with the first part,
and |d| is n . d.
"""

from __future__ import annotations

from cmath import rect
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray
from exudyn_flexlink.engines.exudyn.minimal.kinematics import LinkKinematics, Places, Points, falls
from exudyn_flexlink.mechanism import (
    Anchor,
    Apart,
    LinearSpring,
    Mechanism,
    Placed,
    PointForce,
    RotarySpring,
    Sense,
    Size,
    Slide,
    Sliding,
    Turning,
)
from exudyn_flexlink.mechanism.prescribed import Formula, PlaceTable
from exudyn_flexlink.mechanism.tree import TreeLayout
from exudyn_flexlink.rounding import TINY


class Stretched(NamedTuple):
    """Pairs of points at some instants, (..., pairs) each; the vector `between` is in m.

    `size` (m) is the distance in the direction `along`; `moved` (..., pairs, links) are the
    derivatives J of `between`.
    """

    between: ComplexArray
    along: ComplexArray
    size: FloatArray
    moved: ComplexArray


class Stretches:
    """Pairs of points, and their distances; along a slide a distance has a sign."""

    def __init__(
        self,
        layout: TreeLayout,
        kinematics: LinkKinematics,
        pairs: Sequence[tuple[Anchor, Anchor, Slide | None]],
    ) -> None:
        self._kinematics = kinematics
        self.first = Points(layout, [first for first, _, _ in pairs])
        self.second = Points(layout, [second for _, second, _ in pairs])
        self._line = np.array([_line_of(layout, slide) for _, _, slide in pairs], dtype=complex)
        self.slides = self._line != 0

    def look(self, places: Places) -> Stretched:
        """Distances and their derivatives at poses of links (..., links + 1)."""
        between = self.second.places(places) - self.first.places(places)
        moved = self._kinematics.moves(places, self.second) - self._kinematics.moves(
            places, self.first
        )
        size = np.abs(between)
        along = between / np.maximum(size, TINY)
        if self.slides.any():
            line = places.axis.take(self.first.links, axis=-1) * self._line
            along = np.where(self.slides, line, along)
            size = np.where(self.slides, (line.conj() * between).real, size)
        return Stretched(between, along, size, moved)


def _line_of(layout: TreeLayout, slide: Slide | None) -> complex:
    """Direction of a slide in the axes of the link that carries its line; 0 without a slide."""
    if slide is None:
        return 0j
    return rect(1.0, slide.direction + layout.frame(slide.first.part).angle)


class LinearSprings:
    """Springs between points of links or of the ground."""

    def __init__(
        self, layout: TreeLayout, kinematics: LinkKinematics, springs: Sequence[LinearSpring]
    ) -> None:
        self._kinematics = kinematics
        pairs = [(spring.first, spring.second, spring.slide) for spring in springs]
        self._stretches = Stretches(layout, kinematics, pairs)
        self._stiffness = np.array([spring.stiffness for spring in springs])
        self._damping = np.array([spring.damping for spring in springs])
        self._length = np.array([spring.length for spring in springs], dtype=float)
        self._drawn = (self._length == 0) & ~self._stretches.slides

    def pull_and_lost(self, x: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Generalised forces (..., links) at coordinates and speeds (..., links); power lost, W."""
        places, ends = self._kinematics.places(x), self._stretches
        rates = self._kinematics.rates(places, x, v)
        between, along, size, moved = ends.look(places)
        moving = ends.second.rates(places, rates) - ends.first.rates(places, rates)
        rate = (along.conj() * moving).real
        pulled = (self._stiffness * (size - self._length) + self._damping * rate) * along
        drawn = self._stiffness * between + self._damping * moving
        force = -np.where(self._drawn, drawn, pulled)
        square = np.where(self._drawn, np.abs(moving) ** 2, rate**2)
        pull = (force.conj()[..., None] * moved).real.sum(-2)
        return np.asarray(pull), np.asarray((self._damping * square).sum(-1))


class Springs:
    """Springs of a mechanism, each computed in the cheapest way.

    Exudyn's tree has a spring on every coordinate, of `stiffness` and `damping` (links,), without
    force at `rest` (links,). `straight` tells that all forces are linear in the coordinates,
    `pulls` that the tree lacks some of the springs.
    """

    def __init__(
        self, layout: TreeLayout, kinematics: LinkKinematics, mechanism: Mechanism
    ) -> None:
        self.stiffness, self.damping, self.rest = np.zeros((3, len(layout.links)))
        # Springs across several coordinates: their matrices, and their forces if all coordinates
        # are 0.
        self._stiffness, self._damping = np.zeros((2, len(layout.links), len(layout.links)))
        self._preload = np.zeros(len(layout.links))
        self.pulls = False
        for spring in mechanism.springs:
            first, second = spring.first, spring.second
            rest = (spring.rest_angle or 0.0) - layout.turn(first, second)
            self._add(layout.turning_row(first, second), spring, rest)
        between = []
        for linear in mechanism.linear_springs:
            row = None if linear.slide is None else layout.sliding_row(linear.slide)
            if row is None:
                between.append(linear)
            else:
                self._add(row, linear, linear.length or 0.0)
        self._between = LinearSprings(layout, kinematics, between)
        self.straight = not between
        self.pulls = self.pulls or not self.straight
        self._slopes = (
            np.diag(self.stiffness) + self._stiffness,
            np.diag(self.damping) + self._damping,
        )

    def _add(self, row: FloatArray, spring: RotarySpring | LinearSpring, rest: float) -> None:
        """Add a spring whose angle or length is ``row @ x``, without force at `rest`."""
        moved = np.flatnonzero(row)
        if len(moved) == 1 and not (self.stiffness[moved] or self.damping[moved]):
            self.stiffness[moved], self.damping[moved] = spring.stiffness, spring.damping
            self.rest[moved] = row[moved] * rest
            return
        square = np.outer(row, row)
        self._stiffness += spring.stiffness * square
        self._damping += spring.damping * square
        self._preload += spring.stiffness * rest * row
        self.pulls = True

    def pull(self, x: FloatArray, v: FloatArray) -> FloatArray:
        """Generalised forces (instants, links) of the springs that Exudyn's tree lacks."""
        across = self._preload - x @ self._stiffness - v @ self._damping
        return across if self.straight else across + self._between.pull_and_lost(x, v)[0]

    def slopes(
        self, x: FloatArray, v: FloatArray, lengths: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Stiffness and damping matrix (links, links) of all springs at one state: see `falls`."""
        if self.straight:
            return self._slopes
        stiffness, damping = falls(lambda x, v: self._between.pull_and_lost(x, v)[0], x, v, lengths)
        return self._slopes[0] + stiffness, self._slopes[1] + damping

    def lost(self, x: FloatArray, v: FloatArray) -> FloatArray:
        """Power that dampers take (instants,), W, at coordinates and speeds (instants, links)."""
        lost = (v * v) @ self.damping + np.sum((v @ self._damping) * v, axis=1)
        return np.asarray(lost if self.straight else lost + self._between.pull_and_lost(x, v)[1])


class Now(NamedTuple):
    """Instants (n,), s, with coordinates and speeds (n, links) and the links' poses."""

    t: FloatArray
    x: FloatArray
    v: FloatArray
    places: Places


class Given(NamedTuple):
    """A formula, values of its senses (n,), and generalised forces (n, links) of a unit load."""

    formula: Formula
    sensed: list[FloatArray]
    unit: FloatArray


class _Linear:
    """A sum of coordinates, or its rate: an angle between two parts, or a slide of the tree."""

    def __init__(self, row: FloatArray, rest: float, is_speed: bool) -> None:
        self._row, self._rest, self._is_speed = row, rest, is_speed

    def value(self, now: Now) -> FloatArray:
        return np.asarray(now.v @ self._row if self._is_speed else now.x @ self._row + self._rest)

    def rows(self, now: Now) -> FloatArray:
        """Derivatives (n, links) by the coordinates."""
        return np.broadcast_to(self._row, now.x.shape)


class _Length:
    """The distance of two points, the stroke of a slide that closes a loop, or their rates."""

    def __init__(
        self, layout: TreeLayout, kinematics: LinkKinematics, sense: Sliding | Apart
    ) -> None:
        ends, slide = (sense, None) if isinstance(sense, Apart) else (sense.slide, sense.slide)
        self._ends = Stretches(layout, kinematics, [(ends.first, ends.second, slide)])
        self._is_speed = sense.is_speed

    def value(self, now: Now) -> FloatArray:
        if self._is_speed:
            return np.asarray(np.sum(self.rows(now) * now.v, axis=1))
        return self._ends.look(now.places).size[:, 0]

    def rows(self, now: Now) -> FloatArray:
        """Derivatives (n, links) by the coordinates; 0 while both points meet."""
        look = self._ends.look(now.places)
        return np.asarray((look.along.conj() * look.moved[:, 0]).real)


class _Place:
    """A coordinate of a point."""

    def __init__(self, layout: TreeLayout, kinematics: LinkKinematics, sense: Placed) -> None:
        self._points = Points(layout, [sense.point])
        self._kinematics, self._axis = kinematics, sense.axis

    def value(self, now: Now) -> FloatArray:
        place = self._points.places(now.places)[:, 0]
        return place.imag if self._axis else place.real


Sensor = _Linear | _Length | _Place


def sensor_of(layout: TreeLayout, kinematics: LinkKinematics, sense: Sense) -> Sensor:
    """The sensor that computes a sense from the coordinates of a tree."""
    if isinstance(sense, Apart):
        return _Length(layout, kinematics, sense)
    if isinstance(sense, Placed):
        return _Place(layout, kinematics, sense)
    if isinstance(sense, Turning):
        rest = layout.turn(sense.first, sense.second)
        return _Linear(layout.turning_row(sense.first, sense.second), rest, sense.is_speed)
    row = layout.sliding_row(sense.slide)
    if row is None:
        return _Length(layout, kinematics, sense)
    return _Linear(row, 0.0, sense.is_speed)


class LoadSize:
    """A torque, or a component of a force, as a function of time and its senses.

    If `sides` are set, its formula stays on these sides of its kinks.
    """

    def __init__(self, layout: TreeLayout, kinematics: LinkKinematics, size: Size) -> None:
        self._applied = size.value
        self.senses = [sensor_of(layout, kinematics, sense) for sense in size.senses]
        self.sides: list[float] = []

    def value(self, now: Now) -> FloatArray:
        """Sizes (n,), N m or N; ArithmeticError if one has no value."""
        return self._applied.values(now.t, self.sensed(now))

    @property
    def formula(self) -> Formula | None:
        """Its formula; None if it is a number or a table."""
        return self._applied if isinstance(self._applied, Formula) else None

    def sensed(self, now: Now) -> list[FloatArray]:
        """Values of its senses (n,), in order, then the sides (n,) of its kinks."""
        values = [sense.value(now) for sense in self.senses]
        return values + [np.full(now.t.shape, side) for side in self.sides]

    @property
    def kinks(self) -> int:
        """Number of its kinks; those of a table by a sense are its inner rows."""
        if isinstance(self._applied, PlaceTable):
            return self._applied.kinks
        return self.formula.expression.kinks if self.formula else 0

    def switches(self, now: Now) -> FloatArray:
        """Values (kinks, n) that are zero at its kinks."""
        if isinstance(self._applied, PlaceTable):
            return self._applied.switches(now.t, self.sensed(now))
        assert self.formula is not None
        return self.formula.expression.switches(now.t + self.formula.clock, self.sensed(now))


class _Along:
    """A torque or force that makes a sense grow, or (`way` -1, as springs) shrink."""

    def __init__(self, size: LoadSize, sensor: Sensor, way: float = 1.0) -> None:
        assert not isinstance(sensor, _Place)  # a spring has a length or an angle
        self.sizes, self._sensor, self._way = [size], sensor, way

    def units(self, now: Now) -> list[tuple[LoadSize, FloatArray]]:
        """The size, and the generalised forces (n, links) of a unit of it."""
        return [(self.sizes[0], self._way * self._sensor.rows(now))]


class _Force:
    """A force at a point, in the axes of the ground or of a part."""

    def __init__(self, layout: TreeLayout, kinematics: LinkKinematics, force: PointForce) -> None:
        self._kinematics = kinematics
        self._points = Points(layout, [force.point])
        frame = layout.frame(force.axes)
        self._axes, self._turn = frame.link, complex(np.exp(1j * frame.angle))
        self.sizes = [LoadSize(layout, kinematics, size) for size in force.sizes]

    def units(self, now: Now) -> list[tuple[LoadSize, FloatArray]]:
        """The sizes, and the generalised forces (n, links) of a unit of each."""
        direction = now.places.axis[:, self._axes] * self._turn  # of the x-axis
        moved = self._kinematics.moves(now.places, self._points)[:, 0]
        along = direction.conj()[:, None] * moved
        return list(zip(self.sizes, (along.real, along.imag), strict=True))


class Loads:
    """All torques and forces that drives apply to a tree, and springs that are not linear."""

    def __init__(
        self, layout: TreeLayout, kinematics: LinkKinematics, mechanism: Mechanism
    ) -> None:
        self._kinematics = kinematics
        # Springs store the work they take. A spring by a formula of a rate does not: it counts as a
        # drive.
        self._supplying, self._storing = list[_Along | _Force](), list[_Along | _Force]()
        for motor in mechanism.torque_motors:
            angle = Turning(motor.first, motor.second, is_speed=False)
            size = LoadSize(layout, kinematics, motor.size)
            self._supplying.append(_Along(size, sensor_of(layout, kinematics, angle)))
        self._supplying += [_Force(layout, kinematics, force) for force in mechanism.forces]
        for law, sense in mechanism.spring_laws:
            senses = tuple(replace(sense, is_speed=by_rate) for by_rate in law.by_rate)
            size = LoadSize(layout, kinematics, Size(law.applied, senses))
            spring = _Along(size, sensor_of(layout, kinematics, sense), way=-1.0)
            (self._storing if law.stores else self._supplying).append(spring)
        self._all = [*self._supplying, *self._storing]
        sizes = [size for load in self._all for size in load.sizes]
        self.any = bool(self._all)
        supplying = (size for load in self._supplying for size in load.sizes)
        self.supplied_by_formula = any(size.formula for size in supplying)
        self.of_state = [size.formula for size in sizes if size.formula and size.senses]
        self.bent = [size for size in sizes if size.kinks]
        self.stiff = bool(mechanism.forces or mechanism.spring_laws) or any(
            load_size.senses for load_size in sizes
        )

    def push(self, t: FloatArray, x: FloatArray, v: FloatArray) -> FloatArray:
        """Generalised forces (n, links) at instants (n,), coordinates and speeds (n, links).

        Raises:
            ArithmeticError: a load has no value at an instant.

        """
        return self.push_and_supply(t, x, v)[0]

    def push_and_supply(
        self, t: FloatArray, x: FloatArray, v: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """As `push`, with the power (n,), W, of all loads except springs that store their work."""
        now = self.now(t, x, v)
        supplying, storing = np.zeros((2, *x.shape))
        for onto, loads in ((supplying, self._supplying), (storing, self._storing)):
            for size, unit in (load_unit for load in loads for load_unit in load.units(now)):
                onto[:] += size.value(now)[:, None] * unit
        return supplying + storing, (supplying * v).sum(axis=1)

    def formulas(self, now: Now) -> list[Given]:
        """Every torque and component of a force with a formula."""
        return [
            Given(size.formula, size.sensed(now), unit)
            for load in self._all
            for size, unit in load.units(now)
            if size.formula is not None
        ]

    def now(self, t: FloatArray, x: FloatArray, v: FloatArray) -> Now:
        """Poses of links at instants (n,), s, from coordinates and speeds (n, links)."""
        return Now(t, x, v, self._kinematics.places(x))
