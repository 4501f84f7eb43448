"""How accelerations change with coordinates and speeds: the Jacobian of the implicit steps.

Springs, dampers and contacts make the equations stiff; what else depends on the motion changes
little within a step, and only slows the iteration down a little: it is left out.
"""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.lagrangian.compiled import inlined, inner
from exudyn_flexlink.engines.lagrangian.dense import factorise, substitute
from exudyn_flexlink.engines.lagrangian.equations import PENALTY
from exudyn_flexlink.engines.lagrangian.faces import LAW, touches
from exudyn_flexlink.engines.lagrangian.mass import mass_matrix
from exudyn_flexlink.engines.lagrangian.mode import Instant, Mode, coordinates_at
from exudyn_flexlink.engines.lagrangian.penalty import fill_slopes
from exudyn_flexlink.engines.lagrangian.track_point import TrackPoint
from exudyn_flexlink.engines.lagrangian.walls import any_is


def slopes(at: Instant, pressing: FloatArray, mode: Mode) -> tuple[FloatArray, FloatArray]:
    """Return da/dq and da/dv, (f, f) each, of the f free coordinates, at the state y.

    Contacts and walls give way and damp as `pressing` says, see `pressing_at`.
    """
    c = mode.constants
    first = int(mode.drive[0])
    q, v, point, _, _ = coordinates_at(at, mode)
    count, contacts = len(q), len(mode.acting)
    springs, dampers = np.empty((count, count)), np.empty((count, count))
    stiffness, damping = c.stiffness, c.damping
    for i in range(count):
        for j in range(count):
            springs[i, j], dampers[i, j] = -stiffness[i, j], -damping[i, j]
    if presses(pressing[:contacts]):
        _add_contacts((q, v, point), pressing[:contacts], mode, (springs, dampers))
    if presses(pressing[contacts:]):
        mode.add_wall_slopes((q, v, point), pressing[contacts:], c, (springs, dampers))
    mass = mass_matrix(q, point, c)
    factorise(mass, first, np.empty(count))
    return _accelerated(springs, mass, first), _accelerated(dampers, mass, first)


@inner
def presses(pressing: FloatArray) -> bool:
    """Tell whether any of some contacts presses, by what `pressing_at` found of them."""
    for k in range(len(pressing)):
        if pressing[k, 0] != 0.0 or pressing[k, 1] != 0.0 or pressing[k, 2] != 0.0:
            return True
    return False


@inner
def pressing_at(at: Instant, mode: Mode) -> FloatArray:
    """How the force of each contact rises with depth and speed, its friction with slip.

    (c + pairs, 3), contacts first, then pairs of link and guide. All are positive, in N/m, N s/m
    and N s/m; zero while a contact does not press.
    """
    c = mode.constants
    contacts = len(mode.acting)
    found = np.zeros((contacts + len(mode.touching), 3))
    struck, walled = any_is(mode.acting, PENALTY), any_is(mode.touching, 1)
    if not struck and not walled:
        return found
    q, v, point, _, _ = coordinates_at(at, mode)
    if walled:
        mode.take_wall_slopes((q, v, point), mode.touching, c, found[contacts:])
    if not struck:
        return found
    states, _, _ = touches(q, v, point, c)
    for k in range(len(mode.acting)):
        if mode.acting[k] == PENALTY:
            law = c.faces[k, LAW:]
            fill_slopes(states[k, 0], states[k, 2], states[k, 3], law, found[k])
    return found


@inner
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


@inlined
def accelerated_by(forces: FloatArray, q: FloatArray, point: TrackPoint, mode: Mode) -> FloatArray:
    """Return M^-1 times generalised forces (N,), of the free coordinates (f,)."""
    c = mode.constants
    first = int(mode.drive[0])
    mass = mass_matrix(q, point, c)
    factorise(mass, first, np.empty(len(q)))
    found: FloatArray = forces.copy()
    substitute(mass, first, found)
    return found[first:]


@inlined
def _add_contacts(
    state: tuple[FloatArray, FloatArray, TrackPoint],
    pressing: FloatArray,
    mode: Mode,
    into: tuple[FloatArray, FloatArray],
) -> None:
    """Add what penalty forces and friction give, along their present directions."""
    q, v, point = state
    springs, dampers = into
    _, gradients, slides = touches(q, v, point, mode.constants)
    for k in range(len(pressing)):
        spring, damper, drag = pressing[k, 0], pressing[k, 1], pressing[k, 2]
        for i in range(len(q)):
            for j in range(len(q)):
                springs[i, j] -= spring * gradients[k, i] * gradients[k, j]
                dampers[i, j] -= damper * gradients[k, i] * gradients[k, j]
                dampers[i, j] -= drag * slides[k, i] * slides[k, j]
