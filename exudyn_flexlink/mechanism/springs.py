"""Forces and energies of linear springs at many instants, and springs that start wound."""

from __future__ import annotations

from collections.abc import Iterator
from math import degrees, pi

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism.kinematics import (
    anchor_position,
    anchor_velocity,
    length_along,
    line_of,
    speed_along,
    turning,
)
from exudyn_flexlink.mechanism.model import LinearSpring, Mechanism

MEETING = 1e-300  # m: where both ends meet, a spring with a length has no direction, and no force
HALF_A_TURN = pi + 1e-6  # rad: what is assembled at half a turn is not beyond it by rounding


def spring_force(spring: LinearSpring, q: FloatArray, v: FloatArray) -> FloatArray:
    """Force (..., 2) on the second anchor, N, at coordinates and velocities (..., parts, 3)."""
    if _draws_to_a_point(spring):
        between, moving = _between(spring, q, v)
        return np.asarray(-spring.stiffness * between - spring.damping * moving)
    stretched, rate, along = _stretched(spring, q, v)
    tension = spring.stiffness * stretched + spring.damping * rate
    return np.asarray(-tension[..., None] * along)


def stored_energy(spring: LinearSpring, q: FloatArray) -> FloatArray:
    """Energy (...,) of the spring, J, at coordinates (..., parts, 3)."""
    stretched, _, _ = _stretched(spring, q, q)
    return np.asarray(0.5 * spring.stiffness * stretched**2)


def damping_power(spring: LinearSpring, q: FloatArray, v: FloatArray) -> FloatArray:
    """Power (...,) that the damper takes, W, at coordinates and velocities (..., parts, 3)."""
    if _draws_to_a_point(spring):
        _, moving = _between(spring, q, v)
        return np.asarray(spring.damping * np.sum(moving**2, axis=-1))
    _, rate, _ = _stretched(spring, q, v)
    return np.asarray(spring.damping * rate**2)


def _draws_to_a_point(spring: LinearSpring) -> bool:
    """Tell whether its force is that of its two anchors being apart, in whatever direction."""
    return spring.slide is None and spring.length == 0


def _stretched(
    spring: LinearSpring, q: FloatArray, v: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """How much longer (...,) it is than without force, m, the rate, and its direction (..., 2)."""
    rest = spring.length or 0.0
    if spring.slide is not None:
        slide = spring.slide
        return length_along(slide, q) - rest, speed_along(slide, q, v), line_of(slide, q)
    between, moving = _between(spring, q, v)
    size = np.hypot(between[..., 0], between[..., 1])
    along = between / np.maximum(size, MEETING)[..., None]
    return size - rest, np.sum(along * moving, axis=-1), along


def _between(spring: LinearSpring, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
    """From the first to the second anchor (..., 2), m, and the rate of that, m/s."""
    between = anchor_position(spring.second, q) - anchor_position(spring.first, q)
    moving = anchor_velocity(spring.second, q, v) - anchor_velocity(spring.first, q, v)
    return between, moving


def wound_at_start(mechanism: Mechanism, q: FloatArray) -> Iterator[str]:
    """Say which springs are wound by more than half a turn at coordinates (parts, 3) of time 0.

    That may be meant, as of the spring of a clock. But 170 deg and -190 deg are one place of a body
    and two of a spring.
    """
    for spring in mechanism.springs:
        wound = float(turning(spring.first, spring.second, q)) - (spring.rest_angle or 0.0)
        if spring.stiffness > 0 and abs(wound) > HALF_A_TURN:
            yield (
                f"'{spring.name}' starts wound by {degrees(wound):.4g} deg: whole turns count; "
                "where they are not meant, give an angle in 'initial' 360 deg more or less"
            )
