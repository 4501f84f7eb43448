"""Motion at many instants at once, in machine code."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.lagrangian.compiled import compiled
from exudyn_flexlink.engines.lagrangian.constants import unpacked
from exudyn_flexlink.engines.lagrangian.course import (
    Course,
    Equations,
    Instant,
    coordinates_at,
    guide_at,
    torques_at,
)
from exudyn_flexlink.engines.lagrangian.equations import (
    PENALTY,
    Drive,
    State,
    accelerations,
    chain_of,
)
from exudyn_flexlink.engines.lagrangian.walls import depths_squared
from exudyn_flexlink.engines.lagrangian.watch import interpolate
from exudyn_flexlink.integrate.collocation import Collocation

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Block:
    """Steps in a row, between two events: see `advance.Buffer`; course and method they are of."""

    times: FloatArray  # (m + 1,)
    states: FloatArray  # (m + 1, size)
    changes: FloatArray  # (m, s, size)
    places: FloatArray  # (m + 1,)
    course: Course
    method: Collocation

    def before(self, instants: FloatArray) -> FloatArray:
        """Places of P (m,) at the starts of the steps that instants (m,) are in."""
        steps = np.searchsorted(self.times, instants, side="left") - 1
        return self.places[np.clip(steps, 0, len(self.changes) - 1)]


class Motions(NamedTuple):
    """The fields of `system.Motion`, of m instants; `u` is P's place on its piece."""

    q: FloatArray  # (m, N)
    v: FloatArray  # (m, N)
    a: FloatArray  # (m, N)
    root: FloatArray  # (m, 6)
    u: FloatArray  # (m,)
    motor: FloatArray  # (m,)
    forces: FloatArray  # (m, c)
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
    times: FloatArray, states: FloatArray, places: FloatArray, course: Course, with_forces: bool
) -> Motions:
    """Motion at instants, of which P was at `places` (m,) shortly before; forces if asked for."""
    c = unpacked(course.data)
    equations = Equations(course, c)
    count, contacts, size = len(c.inertias), len(course.acting), len(times)
    first = int(course.drive[0])
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
        q, v, root, u = coordinates_at(Instant(t, y, places[i]), equations)
        found.q[i], found.v[i], found.u[i] = q, v, u
        for k in range(6):
            found.root[i, k] = root[k]
        if np.any(course.touching):
            found.pressed[i] = depths_squared(q, v, root, course.touching, chain_of(c))
        if with_forces:
            alpha = guide_at(t, y, count - first, course)[2]
            drive = Drive(first, alpha, torques_at(t, count, course))
            holding = (course.acting, course.touching)
            a, motor, forces, _, _ = accelerations(State(q, v, root), drive, holding, c)
            found.a[i], found.motor[i] = a, motor
            for k in range(contacts):
                penalty = course.acting[k] == PENALTY
                found.forces[i, k] = max(forces[k], 0.0) if penalty else forces[k]
    return found
