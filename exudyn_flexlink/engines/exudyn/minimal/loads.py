"""Torques at joints and forces at points, on the coordinates of a tree, with exact derivatives.

With P the point of a force F, both complex, and m_k = dP/dx_k, the force on coordinate k is
``Re(conj(F) m_k)``. Where j is the one of two coordinates of P's path that is nearer to the ground,
``dm_k/dx_j = i m_k`` if j is a hinge, and 0 if it is a slide.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray
from exudyn_flexlink.engines.exudyn.minimal.kinematics import LinkKinematics, Places, Points
from exudyn_flexlink.mechanism import (
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
from exudyn_flexlink.mechanism.tree import TreeLayout


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

    def slopes(self, now: Now) -> tuple[FloatArray, FloatArray]:  # noqa: ARG002
        """Derivatives (links,) by coordinates and by speeds, at one instant."""
        none = np.zeros_like(self._row)
        return (none, self._row) if self._is_speed else (self._row, none)


class _Length:
    """How far a slide that closes a loop is out, or its speed.

    With d from its first to its second end (complex) and e^(i a) along it, that is
    ``Re(e^(-i a) d)``. Of its speed the slopes by the coordinates are how its derivatives by them
    change with time.
    """

    def __init__(self, layout: TreeLayout, kinematics: LinkKinematics, sense: Sliding) -> None:
        slide = sense.slide
        self._points = Points(layout, [slide.first, slide.second])
        self._kinematics, self._is_speed = kinematics, sense.is_speed
        frame = layout.frame(slide.first.part)
        self._base, self._turn = frame.link, complex(np.exp(1j * (frame.angle + slide.direction)))

    def value(self, now: Now) -> FloatArray:
        if self._is_speed:
            return np.asarray(np.sum(self._rows(now) * now.v, axis=1))
        first, second = self._points.places(now.places).T
        return np.asarray((self._back(now) * (second - first)).real)

    def slopes(self, now: Now) -> tuple[FloatArray, FloatArray]:
        """Derivatives (links,) by coordinates and by speeds, at one instant."""
        row = self._rows(now)[0]
        return (self._row_rates(now)[0], row) if self._is_speed else (row, np.zeros(len(row)))

    def _back(self, now: Now) -> ComplexArray:
        return np.asarray((now.places.axis[:, self._base] * self._turn).conj())

    def _spun(self, points: ComplexArray, moves: ComplexArray) -> ComplexArray:
        """Derivatives (n, links) of the second point against the first, seen from the line."""
        turning = self._kinematics.turning[:, self._base]
        between = (points[:, 1] - points[:, 0])[:, None]
        return np.asarray(moves[:, 1] - moves[:, 0] - 1j * between * turning)

    def _rows(self, now: Now) -> FloatArray:
        """Derivatives (n, links) of the length."""
        points = self._points.places(now.places)
        moves = self._kinematics.moves(now.places, self._points.links, points)
        return np.asarray((self._back(now)[:, None] * self._spun(points, moves)).real)

    def _row_rates(self, now: Now) -> FloatArray:
        """Time derivatives of those."""
        at, links = now.places, self._points.links
        rates = self._kinematics.rates(at, now.x, now.v)
        points, moving = self._points.places(at), self._points.rates(at, rates)
        spun = self._spun(points, self._kinematics.moves(at, links, points))
        changing = self._spun(moving, self._kinematics.move_rates(at, rates, links, moving))
        spin = rates.angle[:, self._base, None]
        return np.asarray((self._back(now)[:, None] * (changing - 1j * spin * spun)).real)


class _Place:
    """A coordinate of a point."""

    def __init__(self, layout: TreeLayout, kinematics: LinkKinematics, sense: Placed) -> None:
        self._points = Points(layout, [sense.point])
        self._kinematics, self._axis = kinematics, sense.axis

    def value(self, now: Now) -> FloatArray:
        place = self._points.places(now.places)[:, 0]
        return place.imag if self._axis else place.real

    def slopes(self, now: Now) -> tuple[FloatArray, FloatArray]:
        """Derivatives (links,) by coordinates and by speeds, at one instant."""
        points = self._points.places(now.places)
        moved = self._kinematics.moves(now.places, self._points.links, points)[0, 0]
        return np.asarray(moved.imag if self._axis else moved.real), np.zeros(len(moved))


def _sensor(
    layout: TreeLayout, kinematics: LinkKinematics, sense: Sense
) -> _Linear | _Length | _Place:
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

    def switches(self, now: Now) -> FloatArray:
        """Values (kinks, n) that are zero at its kinks."""
        assert self.formula is not None
        return self.formula.expression.switches(now.t + self.formula.clock, self.sensed(now))

    def slopes(self, now: Now) -> tuple[FloatArray, FloatArray]:
        """Derivatives (links,) by coordinates and by speeds, at one instant."""
        by_place, by_speed = np.zeros((2, now.x.shape[1]))
        seen = [float(one[0]) for one in self.sensed(now)]
        slopes = self._applied.slopes(float(now.t[0]), seen) if seen else []
        for sense, slope in zip(self._senses, slopes, strict=True):
            place, speed = sense.slopes(now)
            by_place += slope * place
            by_speed += slope * speed
        return by_place, by_speed


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

    def slopes(self, now: Now) -> tuple[FloatArray, FloatArray]:
        by_place, by_speed = self._size.slopes(now)
        return np.outer(self._row, by_place), np.outer(self._row, by_speed)


class _Force:
    """A force at a point, in the axes of the ground or of a part."""

    def __init__(self, layout: TreeLayout, kinematics: LinkKinematics, force: PointForce) -> None:
        self._kinematics = kinematics
        self._points = Points(layout, [force.point])
        self._path = np.array(layout.path(int(self._points.links[0])), dtype=int)
        frame = layout.frame(force.axes)
        self._axes, self._turn = frame.link, complex(np.exp(1j * frame.angle))
        self._turned_by = np.zeros(len(layout.links))
        self._turned_by[layout.hinges(force.axes)] = 1.0
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

    def slopes(self, now: Now) -> tuple[FloatArray, FloatArray]:
        (x_by_place, x_by_speed), (y_by_place, y_by_speed) = (
            size.slopes(now) for size in self.sizes
        )
        direction, moved = self._direction(now)[0], self._moved(now)[0]
        force = complex(self._force(now)[0])
        by_place = direction * (x_by_place + 1j * y_by_place) + 1j * force * self._turned_by
        by_speed = direction * (x_by_speed + 1j * y_by_speed)
        of_place = np.outer(moved, np.conj(by_place)).real + self._bent(force, moved)
        return of_place, np.outer(moved, np.conj(by_speed)).real

    def _bent(self, force: complex, moved: ComplexArray) -> FloatArray:
        """Share (links, links) of a force that stays, at a point that moves on a bend."""
        found = np.zeros((len(moved), len(moved)))
        path = self._path  # from the ground outwards, as links are numbered
        near, far = np.minimum.outer(path, path), np.maximum.outer(path, path)
        bends = np.where(self._kinematics.hinge[near], 1j * moved[far], 0.0)
        found[np.ix_(path, path)] = (np.conj(force) * bends).real
        return found


class Loads:
    """All torques and forces that drives apply to a tree."""

    def __init__(
        self, layout: TreeLayout, kinematics: LinkKinematics, mechanism: Mechanism
    ) -> None:
        self._kinematics = kinematics
        self._all: Sequence[_Torque | _Force] = [
            *(_Torque(layout, kinematics, motor) for motor in mechanism.torque_motors),
            *(_Force(layout, kinematics, force) for force in mechanism.forces),
        ]
        sizes = [
            *(motor.size for motor in mechanism.torque_motors),
            *(size for force in mechanism.forces for size in force.sizes),
        ]
        self.any = bool(self._all)
        self.by_formula = [size for size in sizes if isinstance(size.value, Formula)]
        every = [size for load in self._all for size in load.sizes]
        self.bent = [one for one in every if one.formula and one.formula.expression.kinks]
        self.stiff = bool(mechanism.forces) or any(size.senses for size in sizes)

    def push(self, t: FloatArray, x: FloatArray, v: FloatArray) -> FloatArray:
        """Generalised forces (n, links) at instants (n,), coordinates and speeds (n, links).

        Raises:
            ArithmeticError: one has no value there.

        """
        found = np.zeros(x.shape)
        now = self.now(t, x, v)
        for load in self._all:
            found += load.push(now)
        return found

    def slopes(self, t: float, x: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """How forces fall (links, links) with coordinates, and with speeds."""
        now = self.now(np.array([t]), x[None], v[None])
        stiffness, damping = np.zeros((2, len(x), len(x)))
        for load in self._all:
            by_place, by_speed = load.slopes(now)
            stiffness -= by_place
            damping -= by_speed
        return stiffness, damping

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
