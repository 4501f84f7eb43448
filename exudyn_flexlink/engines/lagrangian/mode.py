"""The mode of the hybrid system: all that the equations of motion between two events need."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IntArray
from exudyn_flexlink.engines.lagrangian.compiled import (
    borrowed,
    by_reference,
    compiled,
    for_python,
    inlined,
    inner,
)
from exudyn_flexlink.engines.lagrangian.constants import Constants
from exudyn_flexlink.engines.lagrangian.equations import Drive, State
from exudyn_flexlink.engines.lagrangian.track_point import FINE, TrackPoint, place_on
from exudyn_flexlink.mechanism import Ramp

Given = tuple[tuple[float, float, float], TrackPoint, FloatArray]


class Mode(NamedTuple):
    """Equations between two events, for machine code."""

    constants: Constants  # by reference
    piece: FloatArray  # of the track, packed as in `track_point`
    centre: FloatArray  # (2,): the guide's pivot
    drive: FloatArray  # (6,): driven (0 or 1), value, duration, way, first angle; P is a coordinate
    motors: FloatArray  # (torque motors, 2 + N): value, duration, row of generalised forces
    acting: IntArray  # (c,): how each contact acts, as in `equations`
    touching: IntArray  # (pairs,): 1 where a pair of link and guide touches, else 0
    # Functions of `track_point`, `equations`, `walls` that are called by address: see `addresses`.
    cross: Callable[..., tuple[float, TrackPoint, int]]
    accelerations: Callable[..., Any]
    add_wall_forces: Callable[..., Any]
    take_wall_slopes: Callable[..., Any]
    add_wall_slopes: Callable[..., Any]
    depths_squared: Callable[..., Any]


ModeByReference, mode_of = by_reference(Mode, "ModeByReference", __name__)


@compiled
def _mode_given(fields: tuple[Any, ...]) -> Mode:
    return mode_of(*borrowed(fields))


mode_made = for_python(_mode_given)


class Instant(NamedTuple):
    """A time, the state then, and where P was last on its piece."""

    t: float
    y: FloatArray
    near: float


def drive_numbers(ramp: Ramp | None, way: float, angle: float, play: bool) -> FloatArray:
    """`Mode.drive` of a speed drive, or of none."""
    if ramp is None:
        return np.array([0.0, 0.0, 0.0, way, angle, play])
    return np.array([1.0, ramp.value, ramp.duration, way, angle, play])


def motor_numbers(motors: list[tuple[Ramp, FloatArray]], count: int) -> FloatArray:
    """`Mode.motors` of torque motors and the rows (N,) of their torques."""
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
def guide_at(t: float, y: FloatArray, free: int, mode: Mode) -> tuple[float, float, float]:
    """Angle, speed and prescribed acceleration of the guide."""
    drive = mode.drive
    if drive[0] == 0.0:
        return y[0], y[free], 0.0
    turned, speed, rate = _ramp(t, drive[1], drive[2])
    return drive[4] + drive[3] * turned, drive[3] * speed, drive[3] * rate


@inner
def torques_at(t: float, count: int, mode: Mode) -> FloatArray:
    """Generalised forces (N,) of the torque motors."""
    torques, motors = np.zeros(count), mode.motors
    for i in range(len(motors)):
        now = _ramp(t, motors[i, 0], motors[i, 1])[1]
        for j in range(count):
            torques[j] += now * motors[i, 2 + j]
    return torques


@inner
def track_point_at(
    theta: float, y: FloatArray, free: int, near: float, mode: Mode
) -> tuple[float, TrackPoint, int]:
    """Find P from near its last place: place on the piece, track point, how the search ended."""
    if mode.drive[5] != 0.0:
        u = y[free - 1]
        return u, place_on(mode.piece, u), FINE
    return mode.cross(mode.piece, (mode.centre[0], mode.centre[1]), theta, near)


@inlined
def fill_rate(y: FloatArray, given: Given, mode: Mode, rate: FloatArray) -> None:
    """Fill in the time derivative of the integrator's state.

    The state holds the free coordinates, their rates, the energies dissipated in dampers (with the
    work done on the walls) and supplied by motors, and of each contact the impulse, then the work
    done on it. `given` are the guide's angle, speed and prescribed acceleration; P; the torques.
    """
    guide, point, torques = given
    c = mode.constants
    count, contacts = len(c.inertias), len(mode.acting)
    free = (len(y) - 2 - 2 * contacts) // 2
    first = count - free
    kept = np.empty((2, count))
    q, v = borrowed(kept[0]), borrowed(kept[1])
    q[0], v[0] = guide[0], guide[1]
    for j in range(free):
        q[first + j], v[first + j] = y[j], y[free + j]
    acting = (mode.acting, mode.touching, mode.add_wall_forces)
    found, motor, forces, powers, lost = mode.accelerations(
        State(q, v, point), Drive(first, guide[2], torques), acting, c
    )
    for j in range(free):
        rate[j], rate[free + j] = v[first + j], found[first + j]
    at = 2 * free
    for k in range(contacts):
        rate[at + 2 + k] = forces[k]
        rate[at + 2 + contacts + k] = powers[k]
    supplied, damping = motor * v[0], c.damping
    for j in range(count):
        supplied += torques[j] * v[j]
        for k in range(count):
            lost += kept[1, j] * damping[j, k] * kept[1, k]  # keeps q and v so long
    rate[at], rate[at + 1] = lost, supplied


@inlined
def _fill_at(at: Instant, mode: Mode, rate: FloatArray, way: FloatArray) -> tuple[float, int]:
    t, y, near = at
    c = mode.constants
    count = len(c.inertias)
    free = count - int(mode.drive[0])
    guide = guide_at(t, y, free, mode)
    u, point, ended = track_point_at(guide[0], y, free, near, mode)
    fill_rate(y, (guide, point, torques_at(t, count, mode)), mode, rate)
    moved = guide[1] if mode.drive[5] == 0.0 else y[2 * free - 1]
    way[0], way[1], way[2], way[3] = point[0], point[1], point[2] * moved, point[3] * moved
    return u, ended


def rate_at(at: Instant, mode: Mode, rate: FloatArray, way: FloatArray) -> tuple[float, int]:
    """Fill in dy/dt, and P and its velocity (4,); return P's place, how the search for it ended."""
    return _fill_at(at, mode, rate, way)


@compiled
def state_rate(at: Instant, mode: Mode) -> tuple[FloatArray, int]:
    """dy/dt, and how the search for P ended."""
    rate = np.empty(len(at.y))
    _, ended = _fill_at(at, mode, rate, np.empty(4))
    return rate, ended


@compiled
def coordinates_at(
    at: Instant, mode: Mode
) -> tuple[FloatArray, FloatArray, TrackPoint, float, int]:
    """All coordinates and speeds (N,), P, its place on the piece, how the search for it ended."""
    t, y, near = at
    c = mode.constants
    count = len(c.inertias)
    first = int(mode.drive[0])
    free = count - first
    guide = guide_at(t, y, free, mode)
    q, v = np.empty(count), np.empty(count)
    q[0], v[0] = guide[0], guide[1]
    for j in range(free):
        q[first + j], v[first + j] = y[j], y[free + j]
    u, point, ended = track_point_at(guide[0], y, free, near, mode)
    return q, v, point, u, ended
