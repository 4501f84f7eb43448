"""Motion at many instants at once, in machine code."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.lagrangian.compiled import compiled
from exudyn_flexlink.engines.lagrangian.equations import (
    PENALTY,
    Drive,
    State,
)
from exudyn_flexlink.engines.lagrangian.event_functions import interpolate
from exudyn_flexlink.engines.lagrangian.mode import (
    Instant,
    Mode,
    coordinates_at,
    guide_at,
    torques_at,
)
from exudyn_flexlink.engines.lagrangian.walls import any_is


class Motions(NamedTuple):
    """Motion at m instants."""

    q: FloatArray  # (m, N)
    v: FloatArray  # (m, N)
    a: FloatArray  # (m, N)
    point: FloatArray  # (m, 6): P and its derivatives
    place: FloatArray  # (m,) of P on its piece
    motor: FloatArray  # (m,): torque of the speed drive
    forces: FloatArray  # (m, c) of the contacts
    pressed: FloatArray  # (m,): sum of the squares of how deep the link is in its walls, m^2


@compiled
def states_within(
    instants: FloatArray,
    times: FloatArray,
    states: FloatArray,
    changes: FloatArray,
    powers: FloatArray,
) -> FloatArray:
    """States (m, size) at increasing instants within steps."""
    found = np.empty((len(instants), states.shape[1]))
    step = 0
    for i in range(len(instants)):
        while step < len(changes) - 1 and instants[i] > times[step + 1]:
            step += 1
        sigma = (instants[i] - times[step]) / (times[step + 1] - times[step])
        interpolate(sigma, states[step], changes[step], powers, found[i])
    return found


@compiled
def motions_at(
    times: FloatArray, states: FloatArray, places: FloatArray, mode: Mode, with_forces: bool
) -> Motions:
    """Motion at instants, of which P was at `places` (m,) shortly before; forces if asked for."""
    c = mode.constants
    count, contacts, size = len(c.inertias), len(mode.acting), len(times)
    first = int(mode.drive[0])
    found = Motions(
        np.zeros((size, count)),
        np.zeros((size, count)),
        np.zeros((size, count)),
        np.zeros((size, 6)),
        np.zeros(size),
        np.zeros(size),
        np.zeros((size, contacts)),
        np.zeros(size),
    )
    for i in range(size):
        t, y = times[i], states[i]
        q, v, point, u, _ = coordinates_at(Instant(t, y, places[i]), mode)
        found.place[i] = u
        for j in range(count):
            found.q[i, j], found.v[i, j] = q[j], v[j]
        for k in range(6):
            found.point[i, k] = point[k]
        if any_is(mode.touching, 1):
            found.pressed[i] = mode.depths_squared(q, v, point, mode.touching, c)
        if with_forces:
            alpha = guide_at(t, y, count - first, mode)[2]
            drive = Drive(first, alpha, torques_at(t, count, mode))
            holding = (mode.acting, mode.touching, mode.add_wall_forces)
            a, motor, forces, _, _ = mode.accelerations(State(q, v, point), drive, holding, c)
            found.motor[i] = motor
            for j in range(count):
                found.a[i, j] = a[j]
            for k in range(contacts):
                penalty = mode.acting[k] == PENALTY
                found.forces[i, k] = max(forces[k], 0.0) if penalty else forces[k]
    return found
