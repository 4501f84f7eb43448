"""How accelerations change with coordinates and speeds: the Jacobian of the implicit steps.

Springs, dampers and contacts make the equations stiff; what else depends on the motion changes
little within a step, and only slows the iteration down a little: it is left out.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.lagrangian.compiled import compiled
from exudyn_flexlink.engines.lagrangian.course import Equations, Instant, coordinates_at
from exudyn_flexlink.engines.lagrangian.dense import factorise, substitute
from exudyn_flexlink.engines.lagrangian.equations import (
    PENALTY,
    Root,
    mass_matrix,
    touches,
)

FloatArray = NDArray[np.float64]


@compiled
def slopes(at: Instant, equations: Equations) -> tuple[FloatArray, FloatArray]:
    """Return da/dq and da/dv, (f, f) each, of the f free coordinates, at the state y."""
    course, c = equations
    first = int(course.drive[0])
    q, v, root, _ = coordinates_at(at, equations)
    springs, dampers = -c.stiffness, -c.damping
    _add_contacts((q, v, root), equations, (springs, dampers))
    mass = mass_matrix(q, root, c)
    factorise(mass, first)
    return _accelerated(springs, mass, first), _accelerated(dampers, mass, first)


@compiled
def _accelerated(forces: FloatArray, factors: FloatArray, first: int) -> FloatArray:
    """Return M^-1 times the columns of a matrix (N, N) of forces, of the free coordinates."""
    count = len(forces)
    free = count - first
    found = np.zeros((free, free))
    column = np.empty(count)
    for j in range(free):
        acts = False
        for i in range(first, count):
            column[i] = forces[i, first + j]
            acts = acts or column[i] != 0.0
        if not acts:
            continue
        substitute(factors, first, column)
        for i in range(free):
            found[i, j] = column[first + i]
    return found


@compiled
def _add_contacts(
    state: tuple[FloatArray, FloatArray, Root],
    equations: Equations,
    into: tuple[FloatArray, FloatArray],
) -> None:
    """Add what penalty forces and friction give, along their present directions."""
    q, v, root = state
    course, c = equations
    springs, dampers = into
    pressed = False
    for k in range(len(course.acting)):
        pressed = pressed or course.acting[k] == PENALTY
    if not pressed:
        return
    states, gradients, slides = touches(q, v, root, c)
    for k in range(len(course.acting)):
        if course.acting[k] != PENALTY:
            continue
        face = c.faces[k]
        e2, rising = face[8] * face[8], np.tanh(-states[k, 2] / face[9])
        spring = -face[7] * ((1 + e2) / 2 + (1 - e2) / 2 * rising)
        damper = states[k, 0] * face[7] * (1 - e2) / 2 * (1 - rising * rising) / face[9]
        slip = np.tanh(states[k, 3] / face[11])
        drag = face[10] * states[k, 0] * -spring * (1 - slip * slip) / face[11]
        for i in range(len(q)):
            for j in range(len(q)):
                springs[i, j] += spring * gradients[k, i] * gradients[k, j]
                dampers[i, j] += damper * gradients[k, i] * gradients[k, j]
                dampers[i, j] += drag * slides[k, i] * slides[k, j]
