"""What torques and forces sense of states, and how large they are there."""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism.kinematics import (
    anchor_position,
    angle_of,
    length_along,
    speed_along,
    turned,
    turning,
)
from exudyn_flexlink.mechanism.model import Motor, PointForce, Sense, Size, Sliding, Turning


def sensed(sense: Sense, q: FloatArray, v: FloatArray) -> FloatArray:
    """Value that is sensed at states (..., parts, 3): (...,)."""
    if isinstance(sense, Turning):
        x = v if sense.is_speed else q
        return turning(sense.first, sense.second, x)
    if isinstance(sense, Sliding):
        return speed_along(sense.slide, q, v) if sense.is_speed else length_along(sense.slide, q)
    return np.asarray(anchor_position(sense.point, q)[..., sense.axis])


def motor_place(motor: Motor, q: FloatArray) -> FloatArray:
    """Angle (rad), or length along its slide (m), that a motor prescribes, at states (...,)."""
    return sensed(_sense_of(motor, is_speed=False), q, q)


def motor_speed(motor: Motor, q: FloatArray, v: FloatArray) -> FloatArray:
    """Rate of `motor_place`, rad/s or m/s."""
    return sensed(_sense_of(motor, is_speed=True), q, v)


def _sense_of(motor: Motor, is_speed: bool) -> Sense:
    if motor.slide:
        return Sliding(motor.slide, is_speed)
    return Turning(motor.first, motor.second, is_speed)


def size_at(size: Size, time: float, q: FloatArray, v: FloatArray) -> float:
    """Size (N m or N) at one state (parts, 3).

    Raises:
        ArithmeticError: it has none there.

    """
    return size.value.at(time, [float(sensed(sense, q, v)) for sense in size.senses])


def sizes_at(size: Size, time: FloatArray, q: FloatArray, v: FloatArray) -> FloatArray:
    """As `size_at`, at instants (n,) and states (n, parts, 3)."""
    return size.value.values(time, [sensed(sense, q, v) for sense in size.senses])


def force_at(force: PointForce, time: FloatArray, q: FloatArray, v: FloatArray) -> FloatArray:
    """Force (n, 2) along the ground's axes at instants (n,) and states (n, parts, 3), N."""
    components = [sizes_at(size, time, q, v) for size in force.sizes]
    return turned(np.stack(components, axis=-1), angle_of(force.axes, q))
