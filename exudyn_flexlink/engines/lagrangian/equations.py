r"""Equations of motion of guide, link and levers: the paper's eq. 1, ``M q'' + h = Q``.

Coordinates are angles: the guide's theta, which is also that of rod 1, the absolute angles of the
other rods, and those of the levers. With ``e`` the unit vector of an angle, a point of the link is
at

    r = gamma(theta) + sum_j a_j e(Theta_j)

``gamma`` is the place of P, which the guide's angle determines (see `track`); a_j is the length of
each rod before the point, and how far along its own rod it is. By the coordinates its place has the
derivatives ``r_k``, so that it moves with ``sum_k r_k q_k'``. Where no coordinate accelerates, it
does with ``b = gamma'' theta'^2 - sum_j a_j e(Theta_j) Theta_j'^2``. Lagrange's equations of the
kinetic energy then are, summed over the centres of the rods, of masses m,

    M_jk = sum m r_j . r_k + J_j delta_jk,    h_j = sum m r_j . b

J are moments of inertia: of rods about their centres, of guide and levers about their pivots.

With play between link and guide all rods have angles of their own, the guide has its angle, and P's
place u on its track is a coordinate: then it is ``gamma(u)``.

Vectors are complex numbers, x + i y; all arrays have instants, the stages of a step, first.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray
from exudyn_flexlink.curves import Places


@dataclass(frozen=True)
class Numbers:
    """What stands in the equations beside coordinates: N coordinates, n rods.

    Points of the link are the ends of its rods from P on, their centres, and those that may be
    struck.
    """

    arms: FloatArray  # (points, n): a_j of each point, m
    masses: FloatArray  # (n,) of rods, kg
    inertias: FloatArray  # (N,): of each coordinate, kg m^2
    stiffness: FloatArray  # (N, N) of hinges and springs, N m/rad
    damping: FloatArray  # (N, N), N m s/rad
    preload: FloatArray  # (N,): torques of springs at q = 0, N m
    moments: ComplexArray  # (N,): mass times centre from the pivot, of guide and levers, kg m
    gravity: complex  # m/s^2
    reaches: FloatArray  # (N,): of guide and levers from their pivots, m
    rods: slice  # the rods' coordinates
    track: int  # the coordinate that decides where P is

    @property
    def ends(self) -> slice:
        """Points that are ends of rods."""
        return slice(len(self.masses) + 1)

    @property
    def centres(self) -> slice:
        """Points that are centres of rods."""
        return slice(len(self.masses) + 1, 2 * len(self.masses) + 1)


class Frame(NamedTuple):
    """Where guide and link are at instants (m,).

    `axes` (m, N) are unit vectors of the coordinates' angles; `points` (m, points) of the link,
    which are `going` so fast, `by` (m, points, N) are derivatives by the coordinates, and `bends`
    (m, points) accelerations where no coordinate accelerates.
    """

    q: FloatArray
    v: FloatArray
    axes: ComplexArray
    points: ComplexArray
    going: ComplexArray
    by: ComplexArray
    bends: ComplexArray

    def pick(self, which: int | slice | None) -> Frame:
        """Return one of several instants, some, or (None) the only one as one of one."""
        return Frame._make(own[which] for own in self)


def frame_of(numbers: Numbers, q: FloatArray, v: FloatArray, track: Places) -> Frame:
    """Return the frame at all coordinates and speeds (m, N), where P's place is `track`."""
    own, p, (place, first, second) = numbers.rods, numbers.track, track
    axes = np.exp(1j * q)
    rods, to_points = axes[:, own], numbers.arms.T
    by = np.zeros((len(q), *numbers.arms.shape[:1], q.shape[1]), dtype=np.complex128)
    by[:, :, own] = numbers.arms * (1j * rods)[:, None, :]
    by[:, :, p] += first[:, None]
    points = place[:, None] + rods @ to_points
    bends = (second * v[:, p] ** 2)[:, None] - (rods * v[:, own] ** 2) @ to_points
    going = np.asarray((by @ v[:, :, None])[:, :, 0], dtype=np.complex128)
    return Frame(q, v, axes, points, going, by, bends)


def mass_and_force(numbers: Numbers, at: Frame) -> tuple[FloatArray, FloatArray]:
    """Mass matrices M (m, N, N) and forces ``Q - h`` (m, N), of springs, dampers and weight."""
    by, bends = at.by[:, numbers.centres], at.bends[:, numbers.centres] - numbers.gravity
    moved = np.concatenate([by, bends[:, :, None]], axis=2) * numbers.masses[:, None]
    summed = (by.conj().swapaxes(1, 2) @ moved).real
    force = numbers.preload - at.q @ numbers.stiffness - at.v @ numbers.damping - summed[:, :, -1]
    if numbers.gravity:
        force += ((numbers.moments * at.axes).conj() * numbers.gravity * -1j).real
    return summed[:, :, :-1] + np.diag(numbers.inertias), force


def momentum_rate(numbers: Numbers, at: Frame, a: FloatArray) -> ComplexArray:
    """Rate (m,) of the link's momentum at accelerations (m, N), N."""
    own = numbers.centres
    moving = (at.by[:, own] @ a[:, :, None])[:, :, 0] + at.bends[:, own]
    return np.asarray(moving @ numbers.masses)


def moved_by(numbers: Numbers, at: Frame) -> ComplexArray:
    """How far each coordinate moves ends of rods, the guide's end and levers' ends (points, N).

    At the first of the instants.
    """
    return np.concatenate([at.by[0, numbers.ends], np.diag(numbers.reaches)])
