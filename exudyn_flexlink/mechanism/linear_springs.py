"""Forces and energies of linear springs at many instants; see `LinearSpring`."""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism.kinematics import (
    anchor_position,
    anchor_velocity,
    length_along,
    line_of,
    speed_along,
)
from exudyn_flexlink.mechanism.model import LinearSpring, Slide

MEETING = 1e-300  # m: where both ends meet, a spring with a length has no direction, and no force


def spring_force(spring: LinearSpring, q: FloatArray, v: FloatArray) -> FloatArray:
    """Force (..., 2) on the second anchor, N, at coordinates and velocities (..., parts, 3)."""
    if spring.slide is not None:
        tension = spring.stiffness * _stretched_along(spring, spring.slide, q)
        tension = tension + spring.damping * speed_along(spring.slide, q, v)
        return np.asarray(-tension[..., None] * line_of(spring.slide, q))
    between, moving = _between(spring, q, v)
    if spring.length == 0:
        return np.asarray(-spring.stiffness * between - spring.damping * moving)
    size, along = _along(between)
    rate = np.sum(along * moving, axis=-1)
    tension = spring.stiffness * (size - (spring.length or 0.0)) + spring.damping * rate
    return np.asarray(-tension[..., None] * along)


def stored_energy(spring: LinearSpring, q: FloatArray) -> FloatArray:
    """Energy (...,) of the spring, J, at coordinates (..., parts, 3)."""
    if spring.slide is not None:
        return np.asarray(0.5 * spring.stiffness * _stretched_along(spring, spring.slide, q) ** 2)
    size, _ = _along(_between(spring, q, q)[0])
    return np.asarray(0.5 * spring.stiffness * (size - (spring.length or 0.0)) ** 2)


def damping_power(spring: LinearSpring, q: FloatArray, v: FloatArray) -> FloatArray:
    """Power (...,) that the damper takes, W, at coordinates and velocities (..., parts, 3)."""
    if spring.slide is not None:
        return np.asarray(spring.damping * speed_along(spring.slide, q, v) ** 2)
    between, moving = _between(spring, q, v)
    if spring.length == 0:
        return np.asarray(spring.damping * np.sum(moving**2, axis=-1))
    _, along = _along(between)
    return np.asarray(spring.damping * np.sum(along * moving, axis=-1) ** 2)


def _stretched_along(spring: LinearSpring, slide: Slide, q: FloatArray) -> FloatArray:
    """How much longer (...,) a spring along a slide is than without force, m."""
    return length_along(slide, q) - (spring.length or 0.0)


def _between(spring: LinearSpring, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
    """From the first to the second anchor (..., 2), m, and the rate of that, m/s."""
    between = anchor_position(spring.second, q) - anchor_position(spring.first, q)
    moving = anchor_velocity(spring.second, q, v) - anchor_velocity(spring.first, q, v)
    return between, moving


def _along(between: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Lengths (...,) of vectors (..., 2), and their directions."""
    size = np.hypot(between[..., 0], between[..., 1])
    return size, between / np.maximum(size, MEETING)[..., None]
