"""Torques at joints and forces at points, on the coordinates of a tree.

With P the point of a force F, both complex, and m_k = dP/dx_k, the force on coordinate k is
``Re(conj(F) m_k)``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray
from exudyn_flexlink.engines.exudyn.minimal.kinematics import LinkKinematics, Places, Points
from exudyn_flexlink.mechanism import (
    Apart,
    Mechanism,
    Placed,
    PointForce,
    Sense,
    Size,
    Sliding,
    TorqueMotor,
    Turning,
)
from exudyn_flexlink.mechanism.prescribed import Formula
from exudyn_flexlink.mechanism.spring_laws import PlaceTable, SpringLaw
from exudyn_flexlink.mechanism.tree import TreeLayout

MEETING = 1e-300  # m: where both ends of a spring meet, it has no direction


class Now(NamedTuple):
    """Instants (n,) s: coordinates and speeds (n, links), where the links are."""

    t: FloatArray
    x: FloatArray
    v: FloatArray
    places: Places


class Given(NamedTuple):
    """A formula, what it senses (n,), and what a unit of it is on the coordinates (n, links)."""

    formula: Formula
    sensed: list[FloatArray]
    unit: FloatArray


class _Linear:
    """A sum of coordinates, or its speed: an angle between two parts, or a slide of the tree."""

    def __init__(self, row: FloatArray, rest: float, is_speed: bool) -> None:
        self._row, self._rest, self._is_speed = row, rest, is_speed

    def value(self, now: Now) -> FloatArray:
        return np.asarray(now.v @ self._row if self._is_speed else now.x @ self._row + self._rest)

    def rows(self, now: Now) -> FloatArray:
        """Derivatives (n, links) by the coordinates."""
        return np.broadcast_to(self._row, now.x.shape)


class _Length:
    """How far a slide that closes a loop is out, or its speed.

    With d from its first to its second end (complex) and e^(i a) along it, that is
    ``Re(e^(-i a) d)``.
    """

    def __init__(self, layout: TreeLayout, kinematics: LinkKinematics, sense: Sliding) -> None:
        slide = sense.slide
        self._points = Points(layout, [slide.first, slide.second])
        self._kinematics, self._is_speed = kinematics, sense.is_speed
        frame = layout.frame(slide.first.part)
        self._base, self._turn = frame.link, complex(np.exp(1j * (frame.angle + slide.direction)))

    def value(self, now: Now) -> FloatArray:
        if self._is_speed:
            return np.asarray(np.sum(self.rows(now) * now.v, axis=1))
        first, second = self._points.places(now.places).T
        return np.asarray((self._back(now) * (second - first)).real)

    def _back(self, now: Now) -> ComplexArray:
        return np.asarray((now.places.axis[:, self._base] * self._turn).conj())

    def _spun(self, points: ComplexArray, moves: ComplexArray) -> ComplexArray:
        """Derivatives (n, links) of the second point against the first, seen from the line."""
        turning = self._kinematics.turning[:, self._base]
        between = (points[:, 1] - points[:, 0])[:, None]
        return np.asarray(moves[:, 1] - moves[:, 0] - 1j * between * turning)

    def rows(self, now: Now) -> FloatArray:
        """Derivatives (n, links) of the length."""
        points = self._points.places(now.places)
        moves = self._kinematics.moves(now.places, self._points.links, points)
        return np.asarray((self._back(now)[:, None] * self._spun(points, moves)).real)


class _Place:
    """A coordinate of a point."""

    def __init__(self, layout: TreeLayout, kinematics: LinkKinematics, sense: Placed) -> None:
        self._points = Points(layout, [sense.point])
        self._kinematics, self._axis = kinematics, sense.axis

    def value(self, now: Now) -> FloatArray:
        place = self._points.places(now.places)[:, 0]
        return place.imag if self._axis else place.real


class _Apart:
    """How far apart two points are; where they meet no direction is known, and no derivative."""

    def __init__(self, layout: TreeLayout, kinematics: LinkKinematics, sense: Apart) -> None:
        self._points = Points(layout, [sense.first, sense.second])
        self._kinematics = kinematics

    def value(self, now: Now) -> FloatArray:
        first, second = self._points.places(now.places).T
        return np.asarray(np.abs(second - first))

    def rows(self, now: Now) -> FloatArray:
        """Derivatives (n, links) of the distance."""
        points = self._points.places(now.places)
        moves = self._kinematics.moves(now.places, self._points.links, points)
        between = points[:, 1] - points[:, 0]
        along = between / np.maximum(np.abs(between), MEETING)
        return np.asarray((along.conj()[:, None] * (moves[:, 1] - moves[:, 0])).real)


def _sensor(
    layout: TreeLayout, kinematics: LinkKinematics, sense: Sense
) -> _Linear | _Length | _Place | _Apart:
    if isinstance(sense, Apart):
        return _Apart(layout, kinematics, sense)
    if isinstance(sense, Placed):
        return _Place(layout, kinematics, sense)
    if isinstance(sense, Turning):
        rest = layout.turn(sense.first, sense.second)
        return _Linear(layout.turning_row(sense.first, sense.second), rest, sense.is_speed)
    found = layout.joints.get(sense.slide.name)
    if found is None:
        return _Length(layout, kinematics, sense)
    return _Linear(found[1] * np.eye(len(layout.links))[found[0]], 0.0, sense.is_speed)


class LoadSize:
    """A torque, or a component of a force, by time and what it senses.

    Its formula is held on these `sides` of its kinks, once they are told.
    """

    def __init__(self, layout: TreeLayout, kinematics: LinkKinematics, size: Size) -> None:
        self._applied = size.value
        self._senses = [_sensor(layout, kinematics, sense) for sense in size.senses]
        self.sides: list[float] = []

    def value(self, now: Now) -> FloatArray:
        """Sizes (n,), N m or N; ArithmeticError where there is none."""
        return self._applied.values(now.t, self.sensed(now))

    @property
    def formula(self) -> Formula | None:
        """The formula that gives it; None if it is a number or a table."""
        return self._applied if isinstance(self._applied, Formula) else None

    def sensed(self, now: Now) -> list[FloatArray]:
        """What it senses (n,), in order, and the sides (n,) of its kinks."""
        found = [sense.value(now) for sense in self._senses]
        return found + [np.full(now.t.shape, side) for side in self.sides]

    @property
    def kinks(self) -> int:
        """Number of its kinks: of a table by what is sensed they are its inner rows."""
        if isinstance(self._applied, PlaceTable):
            return self._applied.kinks
        return self.formula.expression.kinks if self.formula else 0

    def switches(self, now: Now) -> FloatArray:
        """Values (kinks, n) that are zero at its kinks."""
        if isinstance(self._applied, PlaceTable):
            return self._applied.switches(now.t, self.sensed(now))
        assert self.formula is not None
        return self.formula.expression.switches(now.t + self.formula.clock, self.sensed(now))


class _Torque:
    """A torque between two parts."""

    def __init__(self, layout: TreeLayout, kinematics: LinkKinematics, motor: TorqueMotor) -> None:
        self._row = layout.turning_row(motor.first, motor.second)
        self._size = LoadSize(layout, kinematics, motor.size)
        self.sizes = [self._size]

    def push(self, now: Now) -> FloatArray:
        return self._size.value(now)[:, None] * self._row

    def units(self, now: Now) -> list[tuple[LoadSize, FloatArray]]:
        """Size, and what a unit of it is on the coordinates (n, links)."""
        return [(self._size, np.broadcast_to(self._row, now.x.shape))]


class _Force:
    """A force at a point, in the axes of the ground or of a part."""

    def __init__(self, layout: TreeLayout, kinematics: LinkKinematics, force: PointForce) -> None:
        self._kinematics = kinematics
        self._points = Points(layout, [force.point])
        frame = layout.frame(force.axes)
        self._axes, self._turn = frame.link, complex(np.exp(1j * frame.angle))
        self.sizes = [LoadSize(layout, kinematics, size) for size in force.sizes]

    def _direction(self, now: Now) -> ComplexArray:
        """Where the x-axis of the force's axes points (n,)."""
        return np.asarray(now.places.axis[:, self._axes] * self._turn)

    def _moved(self, now: Now) -> ComplexArray:
        """Derivatives (n, links) of the point."""
        points = self._points.places(now.places)
        return np.asarray(self._kinematics.moves(now.places, self._points.links, points)[:, 0])

    def _force(self, now: Now) -> ComplexArray:
        x, y = (size.value(now) for size in self.sizes)
        return np.asarray(self._direction(now) * (x + 1j * y))

    def units(self, now: Now) -> list[tuple[LoadSize, FloatArray]]:
        """Sizes, and what a unit of each is on the coordinates (n, links)."""
        along = np.conj(self._direction(now))[:, None] * self._moved(now)
        return list(zip(self.sizes, (along.real, along.imag), strict=True))

    def push(self, now: Now) -> FloatArray:
        return np.asarray((np.conj(self._force(now))[:, None] * self._moved(now)).real)


class _Spring:
    """A spring by a table or a formula: it draws back what it senses."""

    def __init__(
        self, layout: TreeLayout, kinematics: LinkKinematics, law: SpringLaw, sense: Sense
    ) -> None:
        senses = (sense,) if law.senses else ()
        self._size = LoadSize(layout, kinematics, Size(law.applied, senses))
        sensor = _sensor(layout, kinematics, sense)
        assert not isinstance(sensor, _Place)  # a spring has a length or an angle
        self._sensor = sensor
        self.sizes = [self._size]

    def units(self, now: Now) -> list[tuple[LoadSize, FloatArray]]:
        """Size, and what a unit of it is on the coordinates (n, links)."""
        return [(self._size, -self._sensor.rows(now))]

    def push(self, now: Now) -> FloatArray:
        return -self._size.value(now)[:, None] * self._sensor.rows(now)


class Loads:
    """All torques and forces that drives apply to a tree, and springs that are not linear."""

    def __init__(
        self, layout: TreeLayout, kinematics: LinkKinematics, mechanism: Mechanism
    ) -> None:
        self._kinematics = kinematics
        laws = mechanism.spring_laws
        self._springs = [_Spring(layout, kinematics, law, sense) for law, sense in laws]
        self._drives: Sequence[_Torque | _Force] = [
            *(_Torque(layout, kinematics, motor) for motor in mechanism.torque_motors),
            *(_Force(layout, kinematics, force) for force in mechanism.forces),
        ]
        self._all = [*self._drives, *self._springs]
        sizes = [size for _, size in mechanism.sizes]
        self.any = bool(self._all)
        self.by_formula = [size for size in sizes if isinstance(size.value, Formula)]
        every = [size for load in self._all for size in load.sizes]
        self.bent = [one for one in every if one.kinks]
        self.stiff = bool(mechanism.forces or laws) or any(size.senses for size in sizes)

    def push(self, t: FloatArray, x: FloatArray, v: FloatArray) -> FloatArray:
        """Generalised forces (n, links) at instants (n,), coordinates and speeds (n, links).

        Raises:
            ArithmeticError: one has no value there.

        """
        return self.push_and_supply(t, x, v)[0]

    def push_and_supply(
        self, t: FloatArray, x: FloatArray, v: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """As `push`, and the power (n,), W, of all but springs, which store what they take."""
        found = np.zeros(x.shape)
        now = self.now(t, x, v)
        for load in self._drives:
            found += load.push(now)
        supply = (found * v).sum(axis=1)
        for spring in self._springs:
            found += spring.push(now)
        return found, supply

    def formulas(self, now: Now) -> list[Given]:
        """Every torque and component of a force that a formula gives."""
        return [
            Given(size.formula, size.sensed(now), unit)
            for load in self._all
            for size, unit in load.units(now)
            if size.formula is not None
        ]

    def now(self, t: FloatArray, x: FloatArray, v: FloatArray) -> Now:
        """Where links are at instants (n,) s, from coordinates and speeds (n, links)."""
        return Now(t, x, v, self._kinematics.places(x))
