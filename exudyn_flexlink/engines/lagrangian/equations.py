r"""Equations of motion of guide, link and levers: the paper's eq. 1, written out by hand.

Coordinates ``q = (theta, Theta_2 .. Theta_n, psi_1 ..)``: the guide's angle, which is also that of
rod 1, the absolute angles of the other rods, the angles of the levers. With ``e = (cos, sin)`` and
``e^ = (-sin, cos)`` of an angle, the centre of rod i is at

    r_i = gamma(theta) + sum_{j <= i} a_ij e(Theta_j),    a_ij = l_j (j < i), l_i/2 (j = i)

where ``gamma`` is the place of P, which the guide's angle determines (see `track`). Lagrange's
equations (1) then are ``M q'' + h = Q`` with, summed over the rods,

    A_jk = sum_i m_i a_ij a_ik,   B_j = sum_i m_i a_ij,   m = sum_i m_i,
    M_jk = A_jk cos(Theta_j - Theta_k) + J_j delta_jk
           + (k = theta) B_j gamma'.e^_j + (j = theta) B_k gamma'.e^_k + (both) m gamma'^2
    h_j  = sum_k A_jk sin(Theta_j - Theta_k) Theta_k'^2 + B_j e^_j.gamma'' theta'^2
           + (j = theta) [m gamma'.gamma'' theta'^2 - sum_k B_k gamma'.e_k Theta_k'^2]

The guide adds its moment of inertia about C to ``M_theta,theta``; a lever stands alone, with its
moment of inertia about its pivot. ``gamma' = d gamma/d theta``; ``point`` holds the six components
of gamma, gamma', gamma''.

With play between link and guide all rods have angles of their own, the guide has its angle, and P's
place u on its track is a coordinate: then ``gamma(u)``, and ``theta`` above stands for u where it
is the argument of gamma (`Constants.track_coordinate`); the guide's moment of inertia stays with
its angle. The forces of the walls are in `walls`.

A contact has the gap ``g(q)`` and the gradient ``G = dg/dq``: a pressing force F acts as ``F G``.
A lasting contact has ``g'' = G q'' + b = 0`` with F as multiplier.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IntArray
from exudyn_flexlink.engines.lagrangian.compiled import borrowed, inlined
from exudyn_flexlink.engines.lagrangian.constants import Constants
from exudyn_flexlink.engines.lagrangian.dense import eliminate, factorise, substitute
from exudyn_flexlink.engines.lagrangian.faces import LAW, touches
from exudyn_flexlink.engines.lagrangian.mass import Turned, fill_axes, fill_mass
from exudyn_flexlink.engines.lagrangian.penalty import friction, penalty_force
from exudyn_flexlink.engines.lagrangian.track_point import TrackPoint

# How each contact acts, which pairs of a sleeve touch, and what adds the forces of these pairs.
Acting = tuple[IntArray, IntArray, Callable[..., float]]

NOT_ACTING, PENALTY, LASTING = 0, 1, 2  # how a contact acts
BAUMGARTE_RATE = 1e3  # 1/s: decay of the rounding in the gap of a lasting contact (Baumgarte 1972)


class State(NamedTuple):
    """Coordinates, speeds and P."""

    q: FloatArray
    v: FloatArray
    point: TrackPoint


class Drive(NamedTuple):
    """First free coordinate: 1 if theta'' = `alpha` is prescribed, else 0; motors' torques (N,)."""

    first: int
    alpha: float
    torques: FloatArray


@inlined
def take_quadratic_terms(
    axes: Turned, v: FloatArray, point: TrackPoint, c: Constants, right: FloatArray
) -> None:
    """Take the terms of the squares of the speeds from the right side (N,)."""
    firsts, couplings = c.firsts, c.couplings
    n, p, begin = len(firsts), int(c.track_coordinate), int(c.rods[0])
    cosines, sines = axes[0][begin : begin + n], axes[1][begin : begin + n]
    moved = v[p] * v[p]
    turning = np.empty((2, n))
    for h in range(n):
        square = v[begin + h] * v[begin + h]
        along, across = cosines[h] * square, sines[h] * square
        right[p] += firsts[h] * (point[2] * along + point[3] * across)
        turning[0, h], turning[1, h] = along, across
    for i in range(n):
        pulled, pushed = 0.0, 0.0
        for h in range(n):
            pulled += couplings[i, h] * turning[0, h]
            pushed += couplings[i, h] * turning[1, h]
        right[begin + i] -= sines[i] * pulled - cosines[i] * pushed
        right[begin + i] -= firsts[i] * (point[5] * cosines[i] - point[4] * sines[i]) * moved
    right[p] -= c.mass * (point[2] * point[4] + point[3] * point[5]) * moved


@inlined
def _fill_torques(state: State, axes: Turned, c: Constants, torques: FloatArray) -> None:
    """Fill in generalised forces Q (N,) of springs, dampers and weight."""
    q, v, point = state
    cosines, sines = axes
    stiffness, damping, preload = c.stiffness, c.damping, c.preload
    count, gx, gy = len(q), c.gravity[0], c.gravity[1]
    for j in range(count):
        torque = preload[j]
        for k in range(count):
            torque -= stiffness[j, k] * q[k] + damping[j, k] * v[k]
        torques[j] = torque
    if gx != 0.0 or gy != 0.0:
        firsts, moments, rods = c.firsts, c.moments, c.rods
        torques[int(c.track_coordinate)] += c.mass * (gx * point[2] + gy * point[3])
        for j in range(count):
            x, y = moments[j, 0], moments[j, 1]
            torques[j] += cosines[j] * (gy * x - gx * y) - sines[j] * (gx * x + gy * y)
        for i in range(len(firsts)):
            j = int(rods[i])
            torques[j] += firsts[i] * (gy * cosines[j] - gx * sines[j])


@inlined
def _solve_free(
    mass: FloatArray, right: FloatArray, first: int, result: FloatArray, scratch: FloatArray
) -> None:
    """Fill in accelerations from the first free one on, where no contact lasts."""
    for j in range(first, len(right)):
        result[j] = right[j]
        if first == 1:
            result[j] -= mass[j, 0] * result[0]
    factorise(mass, first, scratch)
    substitute(mass, first, result)


@inlined
def _solve(
    mass: FloatArray,
    right: FloatArray,
    touching: tuple[FloatArray, FloatArray],
    rows: IntArray,
    found: tuple[FloatArray, FloatArray, int],
) -> None:
    """Fill in `found`: accelerations from its first free one on, forces of the lasting `rows`."""
    states, gradients = touching
    result, forces, first = found
    free, count = len(right) - first, len(right)
    matrix = np.zeros((free + len(rows), free + len(rows)))
    vector = np.zeros(free + len(rows))
    for i in range(free):
        vector[i] = right[first + i]
        if first == 1:
            vector[i] -= mass[first + i, 0] * result[0]
        for j in range(free):
            matrix[i, j] = mass[first + i, first + j]
    for i in range(len(rows)):
        k = rows[i]
        vector[free + i] = (
            -states[k, 4]
            - 2 * BAUMGARTE_RATE * states[k, 2]
            - BAUMGARTE_RATE * BAUMGARTE_RATE * states[k, 0]
        )
        if first == 1:
            vector[free + i] -= gradients[k, 0] * result[0]
        for j in range(free):
            matrix[free + i, j] = gradients[k, first + j]
            matrix[j, free + i] = -gradients[k, first + j]
    eliminate(matrix, vector)
    for j in range(first, count):
        result[j] = vector[j - first]
    for i in range(len(rows)):
        forces[rows[i]] = vector[free + i]


@inlined
def _push(
    state: State,
    acting: IntArray,
    c: Constants,
    found: tuple[FloatArray, FloatArray],
    right: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Add penalty forces and friction to the right side, and fill in what is `found` of them.

    Return contacts and gradients as of `touches`; none where no contact acts.
    """
    forces, drags = found
    acts = False
    for k in range(len(acting)):
        acts = acts or acting[k] != NOT_ACTING
    if not acts:
        return np.zeros((0, 5)), np.zeros((0, 0))
    states, gradients, slides = touches(state.q, state.v, state.point, c)
    for k in range(len(acting)):
        if acting[k] == PENALTY:
            law = c.faces[k, LAW:]
            force = penalty_force(states[k, 0], states[k, 2], law)
            drag = friction(force, states[k, 3], law)
            forces[k], drags[k] = force, drag
            for j in range(len(right)):
                right[j] += force * gradients[k, j] + drag * slides[k, j]
    return states, gradients


@inlined
def _lasting(acting: IntArray) -> IntArray:
    """Numbers of the contacts that last."""
    rows = np.empty(len(acting), dtype=np.int64)
    count = 0
    for k in range(len(acting)):
        if acting[k] == LASTING:
            rows[count] = k
            count += 1
    return rows[:count]


def accelerations(
    state: State, drive: Drive, holding: Acting, c: Constants
) -> tuple[FloatArray, float, FloatArray, FloatArray, float]:
    """Accelerations (N,), torque of the speed drive, contact forces, the powers that they take.

    The last is the power that the walls take. Solved is

        M q'' - sum F G^T = Q - h,     G q'' = -b - 2 r g' - r^2 g   for lasting contacts

    with Baumgarte's rate r, without the row of theta where theta'' is known; that row gives the
    drive's torque.
    """
    acting, touching, add_wall_forces = holding
    count, contacts = len(state.q), len(acting)
    # Two arrays are made, not ten; what is returned of both keeps them to the end.
    kept, pushes = np.empty((count + 5, count)), np.zeros((3, contacts))
    room = borrowed(kept)
    axes, right, result, mass = (room[0], room[1]), room[2], room[3], room[5:]
    forces, drags, powers = borrowed(pushes[0]), borrowed(pushes[1]), borrowed(pushes[2])
    fill_axes(state.q, axes)
    fill_mass(axes, state.point, c, mass)
    _fill_torques(state, axes, c, right)
    take_quadratic_terms(axes, state.v, state.point, c, right)
    for j in range(len(right)):
        right[j] += drive.torques[j]
    states, gradients = _push(state, acting, c, (forces, drags), right)
    walled = 0.0
    if len(touching) > 0:
        walled = add_wall_forces((state.q, state.v, state.point), touching, c, right)
    if drive.first == 1:
        result[0] = drive.alpha
    rows = _lasting(acting)
    if len(rows) == 0:
        _solve_free(mass, right, drive.first, result, room[4])
    else:
        _solve(mass, right, (states, gradients), rows, (result, forces, drive.first))
    motor = 0.0
    if drive.first == 1:
        motor = -right[0]
        for j in range(len(right)):
            motor += mass[0, j] * result[j]
        for k in range(contacts):
            if acting[k] == LASTING:
                motor -= forces[k] * gradients[k, 0]
    for k in range(len(states)):
        powers[k] = -forces[k] * states[k, 2] - drags[k] * states[k, 3]
    return kept[3], motor, pushes[0], pushes[2], walled
