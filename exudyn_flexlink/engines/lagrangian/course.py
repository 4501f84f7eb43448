"""What holds between two events: everything the equations of motion need to be integrated."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.lagrangian.compiled import compiled, inner
from exudyn_flexlink.engines.lagrangian.constants import Constants, Root
from exudyn_flexlink.engines.lagrangian.equations import fill_rate
from exudyn_flexlink.engines.lagrangian.rail import FINE, crossing, place_on
from exudyn_flexlink.mechanism import Ramp

FloatArray = NDArray[np.float64]


class Course(NamedTuple):
    """Equations between two events, in arrays alone, for machine code."""

    data: FloatArray  # constants of the equations, packed
    piece: FloatArray  # of the track, packed as in `rail`
    centre: FloatArray  # (2,): the guide's pivot
    drive: FloatArray  # (6,): driven (0 or 1), value, duration, way, first angle; P is a coordinate
    motors: FloatArray  # (torque motors, 2 + N): value, duration, row of generalised forces
    acting: NDArray[np.int64]  # (c,): how each contact acts, as in `equations`
    touching: NDArray[np.int64]  # (pairs,): 1 where a pair of link and guide touches, else 0


class Equations(NamedTuple):
    """A course with its constants unpacked."""

    course: Course
    c: Constants


class Instant(NamedTuple):
    """A time, the state then, and where P was last on its piece."""

    t: float
    y: FloatArray
    near: float


def drive_numbers(ramp: Ramp | None, way: float, angle: float, play: bool) -> FloatArray:
    """`Course.drive` of a speed drive, or of none."""
    if ramp is None:
        return np.array([0.0, 0.0, 0.0, way, angle, play])
    return np.array([1.0, ramp.value, ramp.duration, way, angle, play])


def motor_numbers(motors: list[tuple[Ramp, FloatArray]], count: int) -> FloatArray:
    """`Course.motors` of torque motors and the rows (N,) of their torques."""
    rows = [[ramp.value, ramp.duration, *row] for ramp, row in motors]
    return np.array(rows, dtype=float).reshape(-1, 2 + count)


@compiled
def _ramp(t: float, value: float, duration: float) -> tuple[float, float, float]:
    """Integral, value and rate of a `mechanism.Ramp` at t."""
    if t >= duration:
        return value * (t - duration / 2), value, 0.0
    x = max(t, 0.0) / duration
    integral = value * duration * x**4 * (2.5 - 3 * x + x * x)
    now = value * x**3 * (10 - 15 * x + 6 * x * x)
    return integral, now, value * 30 * x * x * (1 - x) ** 2 / duration


@inner
def guide_at(t: float, y: FloatArray, free: int, course: Course) -> tuple[float, float, float]:
    """Angle, speed and prescribed acceleration of the guide."""
    drive = course.drive
    if drive[0] == 0.0:
        return y[0], y[free], 0.0
    turned, speed, rate = _ramp(t, drive[1], drive[2])
    return drive[4] + drive[3] * turned, drive[3] * speed, drive[3] * rate


@inner
def torques_at(t: float, count: int, course: Course) -> FloatArray:
    """Generalised forces (N,) of the torque motors."""
    torques = np.zeros(count)
    for i in range(len(course.motors)):
        now = _ramp(t, course.motors[i, 0], course.motors[i, 1])[1]
        for j in range(count):
            torques[j] += now * course.motors[i, 2 + j]
    return torques


@inner
def root_at(
    theta: float, y: FloatArray, free: int, near: float, course: Course
) -> tuple[float, Root, int]:
    """Find P from near its last place: its place on the piece, its `root`, how the search ended."""
    if course.drive[5] != 0.0:
        u = y[free - 1]
        return u, place_on(course.piece, u), FINE
    return crossing(course.piece, (course.centre[0], course.centre[1]), theta, near)


@inner
def rate_at(
    at: Instant, equations: Equations, rate: FloatArray, way: FloatArray
) -> tuple[float, int]:
    """Fill in dy/dt, and P and its velocity (4,); return P's place, how the search for it ended."""
    t, y, near = at
    course, c = equations
    count = len(c.inertias)
    free = count - int(course.drive[0])
    guide = guide_at(t, y, free, course)
    u, root, ended = root_at(guide[0], y, free, near, course)
    holding = (course.acting, course.touching)
    fill_rate(y, (guide, root, torques_at(t, count, course), holding), c, rate)
    moved = guide[1] if course.drive[5] == 0.0 else y[2 * free - 1]
    way[0], way[1], way[2], way[3] = root[0], root[1], root[2] * moved, root[3] * moved
    return u, ended


@inner
def coordinates_at(at: Instant, equations: Equations) -> tuple[FloatArray, FloatArray, Root, float]:
    """All coordinates and speeds (N,), P, and its place on the piece."""
    t, y, near = at
    course, c = equations
    count = len(c.inertias)
    first = int(course.drive[0])
    free = count - first
    guide = guide_at(t, y, free, course)
    q, v = np.empty(count), np.empty(count)
    q[0], v[0] = guide[0], guide[1]
    for j in range(free):
        q[first + j], v[first + j] = y[j], y[free + j]
    u, root, _ = root_at(guide[0], y, free, near, course)
    return q, v, root, u
