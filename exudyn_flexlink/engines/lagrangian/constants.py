"""The numbers of a mechanism in the equations of motion, as arrays that machine code takes."""

from __future__ import annotations

from typing import Any, NamedTuple

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.lagrangian.compiled import (
    borrowed,
    by_reference,
    compiled,
    for_python,
)


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


@compiled
def _constants_given(fields: tuple[Any, ...]) -> Constants:
    return constants_of(*borrowed(fields))


constants_made = for_python(_constants_given)
