"""The numbers of a mechanism in the equations of motion, as arrays that machine code takes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.lagrangian.compiled import borrowed, by_reference, compiled, inner


class Constants(NamedTuple):
    """Numbers of a mechanism of n rods, c contacts and, levers included, N coordinates.

    A contact's row of `faces`: coordinate of its lever, pivot x, y, angle of the face in the lever,
    side, offset of the face from the pivot across and along it, stiffness, restitution, transition
    speed, coefficient of friction, slip speed.
    """

    couplings: FloatArray  # A, (n, n), kg m^2
    firsts: FloatArray  # B, (n,), kg m
    mass: float  # m, kg
    inertias: FloatArray  # J, (N,), kg m^2: of rods about their centres, of guide and levers
    stiffness: FloatArray  # (N, N), N m/rad
    damping: FloatArray  # (N, N), N m s/rad
    preload: FloatArray  # (N,), N m: torques of the springs at q = 0
    moments: FloatArray  # (N, 2), kg m: mass times centre from the pivot, of guide and levers
    gravity: FloatArray  # (2,), m/s^2
    faces: FloatArray  # (c, 12)
    arms: FloatArray  # (c, n): the point of contact k is at gamma + sum_j arms[k, j] e(Theta_j)
    rods: FloatArray  # (n,): coordinate of each rod
    track_coordinate: float  # coordinate of which gamma is a function
    lengths: FloatArray  # (n,) of the rods, m
    channel: FloatArray  # (11,) of a sleeve with walls, as in `walls`; (0,) without


ConstantsByReference, constants_of = by_reference(Constants, "ConstantsByReference", __name__)


def packed(c: Constants) -> FloatArray:
    """Put all constants in one array: handing over a single one costs the least."""
    sizes = (len(c.firsts), len(c.inertias), len(c.faces), len(c.channel))
    return np.concatenate([np.ravel(part) for part in (sizes, *c)]).astype(np.float64)


@inner
def unpacked(data: FloatArray) -> Constants:
    """Constants as views into the array of `packed`, which the caller must keep."""
    data = borrowed(data)
    n, count, contacts, walls = int(data[0]), int(data[1]), int(data[2]), int(data[3])
    squared = count * count
    sizes = (n * n, n, 1, count, squared, squared, count, 2 * count, 2, 12 * contacts,
             contacts * n, n, 1, n, walls)  # fmt: skip
    at = np.full(16, 4)
    for i in range(15):
        at[i + 1] = at[i] + sizes[i]
    return constants_of(
        data[4 : at[1]].reshape(n, n),
        data[at[1] : at[2]],
        data[at[2]],
        data[at[3] : at[4]],
        data[at[4] : at[5]].reshape(count, count),
        data[at[5] : at[6]].reshape(count, count),
        data[at[6] : at[7]],
        data[at[7] : at[8]].reshape(count, 2),
        data[at[8] : at[9]],
        data[at[9] : at[10]].reshape(contacts, 12),
        data[at[10] : at[11]].reshape(contacts, n),
        data[at[11] : at[12]],
        data[at[12]],
        data[at[13] : at[14]],
        data[at[14] :],
    )


@compiled
def chain_of(c: Constants) -> tuple[FloatArray, float, FloatArray, FloatArray]:
    """What `walls` needs: coordinates and lengths of rods, coordinate of P, numbers of walls."""
    return c.rods, c.track_coordinate, c.lengths, c.channel
