"""The mass matrix of `equations`, and the cosines and sines of angles of which it is made."""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.lagrangian.compiled import compiled, inner
from exudyn_flexlink.engines.lagrangian.constants import Constants
from exudyn_flexlink.engines.lagrangian.track_point import TrackPoint

Turned = tuple[FloatArray, FloatArray]


@inner
def turned(q: FloatArray) -> Turned:
    """Cosines and sines of angles."""
    axes = np.empty(len(q)), np.empty(len(q))
    fill_axes(q, axes)
    return axes


@inner
def fill_axes(q: FloatArray, axes: Turned) -> None:
    """Fill in cosines and sines of angles."""
    cosines, sines = axes
    for j in range(len(q)):
        cosines[j], sines[j] = np.cos(q[j]), np.sin(q[j])


@compiled
def mass_matrix(q: FloatArray, point: TrackPoint, c: Constants) -> FloatArray:
    """Mass matrix M (N, N)."""
    mass = np.empty((len(q), len(q)))
    fill_mass(turned(q), point, c, mass)
    return mass


@inner
def fill_mass(axes: Turned, point: TrackPoint, c: Constants, mass: FloatArray) -> None:
    """Fill in `mass_matrix`, from cosines and sines of the coordinates."""
    n, p, count = len(c.firsts), int(c.track_coordinate), len(axes[0])
    begin = int(c.rods[0])  # the rods' coordinates follow one another
    cosines, sines = axes[0][begin : begin + n], axes[1][begin : begin + n]
    for i in range(count):
        for j in range(count):
            mass[i, j] = 0.0
    couplings, firsts, inertias = c.couplings, c.firsts, c.inertias
    for i in range(n):
        cosine, sine = cosines[i], sines[i]
        for h in range(n):
            mass[begin + i, begin + h] = couplings[i, h] * (cosine * cosines[h] + sine * sines[h])
    for i in range(n):
        slip = firsts[i] * (point[3] * cosines[i] - point[2] * sines[i])
        mass[p, begin + i] += slip
        mass[begin + i, p] += slip
    for j in range(count):
        mass[j, j] += inertias[j]
    mass[p, p] += c.mass * (point[2] * point[2] + point[3] * point[3])
