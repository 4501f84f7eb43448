"""Torques at joints and forces at points, on the coordinates of a tree.

With P the point of a force F, both complex, and m_k = dP/dx_k, the force on coordinate k is
``Re(conj(F) m_k)``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.minimal.kinematics import LinkKinematics, Places, Points
from exudyn_flexlink.engines.exudyn.minimal.springs import Stretches
from exudyn_flexlink.mechanism import (
    Apart,
    Mechanism,
    Placed,
    PointForce,
    Sense,
    Size,
    Sliding,
    Turning,
)
from exudyn_flexlink.mechanism.prescribed import Formula
from exudyn_flexlink.mechanism.spring_laws import PlaceTable
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

    def rows(self, now: Now) -> FloatArray:
        """Derivatives (n, links) by the coordinates."""
        return np.broadcast_to(self._row, now.x.shape)


class _Length:
    """How far apart two points are, or how far a slide that closes a loop is out, or its speed."""

    def __init__(
        self, layout: TreeLayout, kinematics: LinkKinematics, sense: Sliding | Apart
    ) -> None:
        ends, slide = (sense, None) if isinstance(sense, Apart) else (sense.slide, sense.slide)
        self._ends = Stretches(layout, kinematics, [(ends.first, ends.second, slide)])
        self._is_speed = isinstance(sense, Sliding) and sense.is_speed

    def value(self, now: Now) -> FloatArray:
        if self._is_speed:
            return np.asarray(np.sum(self.rows(now) * now.v, axis=1))
        return self._ends.look(now.places).size[:, 0]

    def rows(self, now: Now) -> FloatArray:
        """Derivatives (n, links) by the coordinates; where both points meet there are none."""
        found = self._ends.look(now.places)
        return np.asarray((found.along.conj() * found.moved[:, 0]).real)


class _Place:
    """A coordinate of a point."""

    def __init__(self, layout: TreeLayout, kinematics: LinkKinematics, sense: Placed) -> None:
        self._points = Points(layout, [sense.point])
        self._kinematics, self._axis = kinematics, sense.axis

    def value(self, now: Now) -> FloatArray:
        place = self._points.places(now.places)[:, 0]
        return place.imag if self._axis else place.real


def _sensor(
    layout: TreeLayout, kinematics: LinkKinematics, sense: Sense
) -> _Linear | _Length | _Place:
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
    """A torque, or a component of a force, by time and what it senses.

    Its formula is held on these `sides` of its kinks, once they are told.
    """

    def __init__(self, layout: TreeLayout, kinematics: LinkKinematics, size: Size) -> None:
        self._applied = size.value
        self.senses = [_sensor(layout, kinematics, sense) for sense in size.senses]
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
        found = [sense.value(now) for sense in self.senses]
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


class _Along:
    """A torque or force along what is sensed, or against it (`way` -1), as springs act."""

    def __init__(
        self, size: LoadSize, sensor: _Linear | _Length | _Place, way: float = 1.0
    ) -> None:
        assert not isinstance(sensor, _Place)  # a spring has a length or an angle
        self.sizes, self._sensor, self._way = [size], sensor, way

    def units(self, now: Now) -> list[tuple[LoadSize, FloatArray]]:
        """Size, and what a unit of it is on the coordinates (n, links)."""
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
        """Sizes, and what a unit of each is on the coordinates (n, links)."""
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
        self._drives: list[_Along | _Force] = []
        for motor in mechanism.torque_motors:
            angle = Turning(motor.first, motor.second, is_speed=False)
            size = LoadSize(layout, kinematics, motor.size)
            self._drives.append(_Along(size, _sensor(layout, kinematics, angle)))
        self._drives += [_Force(layout, kinematics, force) for force in mechanism.forces]
        self._springs = []
        for law, sense in mechanism.spring_laws:
            senses = (sense,) if law.senses else ()
            size = LoadSize(layout, kinematics, Size(law.applied, senses))
            self._springs.append(_Along(size, _sensor(layout, kinematics, sense), way=-1.0))
        self._all = [*self._drives, *self._springs]
        sizes = [size for load in self._all for size in load.sizes]
        self.any = bool(self._all)
        self.drives_by_formula = any(size.formula for load in self._drives for size in load.sizes)
        self.of_state = [size.formula for size in sizes if size.formula and size.senses]
        self.bent = [size for size in sizes if size.kinks]
        self.stiff = bool(mechanism.forces or self._springs) or any(one.senses for one in sizes)

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
        now = self.now(t, x, v)
        of_drives, of_springs = np.zeros((2, *x.shape))
        for onto, loads in ((of_drives, self._drives), (of_springs, self._springs)):
            for size, unit in (one for load in loads for one in load.units(now)):
                onto[:] += size.value(now)[:, None] * unit
        return of_drives + of_springs, (of_drives * v).sum(axis=1)

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
