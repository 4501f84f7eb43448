"""Positions and velocities of anchors.

Coordinates ``q`` have shape (parts, 3): x, y (m), angle (rad); velocities ``v`` likewise.
"""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism.model import (
    Apart,
    Mechanism,
    Motor,
    Pin,
    PointForce,
    Sense,
    Size,
    Slide,
    Sliding,
    Slot,
    Turning,
)
from exudyn_flexlink.mechanism.parts import GROUND, Anchor


def anchor_position(anchor: Anchor, q: FloatArray) -> FloatArray:
    """Position of an anchor, m; `q` (..., parts, 3) gives (..., 2)."""
    if anchor.part == GROUND:
        return np.broadcast_to(np.array([anchor.x, anchor.y]), (*q.shape[:-2], 2))
    return np.asarray(q[..., anchor.part, :2] + _arm(anchor, q))


def _arm(anchor: Anchor, q: FloatArray) -> FloatArray:
    """From its part's origin to an anchor, (..., 2) m."""
    return turned(np.array([anchor.x, anchor.y]), q[..., anchor.part, 2])


def anchor_velocity(anchor: Anchor, q: FloatArray, v: FloatArray) -> FloatArray:
    """Velocity of an anchor, m/s; `q`, `v` (..., parts, 3) give (..., 2)."""
    if anchor.part == GROUND:
        return np.zeros((*q.shape[:-2], 2))
    rate = v[..., anchor.part, :]
    return np.asarray(rate[..., :2] + rate[..., 2:] * left_of(_arm(anchor, q)))


def anchor_jacobian(anchor: Anchor, q: FloatArray) -> FloatArray:
    """Derivative of an anchor's position by all coordinates, (2, 3 parts)."""
    jacobian = np.zeros((2, 3 * len(q)))
    if anchor.part != GROUND:
        first = 3 * anchor.part
        jacobian[0, first] = jacobian[1, first + 1] = 1.0
        jacobian[:, first + 2] = left_of(_arm(anchor, q))
    return jacobian


def angle_of(part: int, q: FloatArray) -> FloatArray:
    """Angle (or angular speed) of a part, shape of `q` without its last two axes."""
    if part == GROUND:
        return np.zeros(q.shape[:-2])
    return np.asarray(q[..., part, 2])


def turning(first: int, second: int, q: FloatArray) -> FloatArray:
    """Angle (or angular speed) of the second part relative to the first, (...,)."""
    return angle_of(second, q) - angle_of(first, q)


def line_of(slide: Slide, q: FloatArray) -> FloatArray:
    """Direction of a slide's line in the ground's axes; `q` (..., parts, 3) gives (..., 2)."""
    angle = angle_of(slide.first.part, q) + slide.direction
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def length_along(slide: Slide, q: FloatArray) -> FloatArray:
    """How far (...) a slide's second anchor is from its first along its line, m."""
    between = anchor_position(slide.second, q) - anchor_position(slide.first, q)
    return np.asarray(np.sum(line_of(slide, q) * between, axis=-1))


def speed_along(slide: Slide, q: FloatArray, v: FloatArray) -> FloatArray:
    """Rate (...) of `length_along`, m/s."""
    between = anchor_position(slide.second, q) - anchor_position(slide.first, q)
    moving = anchor_velocity(slide.second, q, v) - anchor_velocity(slide.first, q, v)
    along = line_of(slide, q)
    across = along[..., 0] * between[..., 1] - along[..., 1] * between[..., 0]
    turning = angle_of(slide.first.part, v)
    return np.asarray(np.sum(along * moving, axis=-1) + turning * across)


def joint_speed(joint: Pin | Slide, q: FloatArray, v: FloatArray) -> FloatArray:
    """How fast (...) a joint turns or slides, rad/s or m/s."""
    if isinstance(joint, Slide):
        return speed_along(joint, q, v)
    return turning(joint.first.part, joint.second.part, v)


def slot_point(slot: Slot, q: FloatArray) -> FloatArray:
    """Position of a slot's anchor in the axes of its curve, m; `q` (..., parts, 3): (..., 2)."""
    return seen_from(slot.carrier, anchor_position(slot.anchor, q), q)


def seen_from(part: int, point: FloatArray, q: FloatArray) -> FloatArray:
    """A point (..., 2) m of the ground in the axes of a part."""
    if part == GROUND:
        return point
    pose = q[..., part, :]
    return turned(point - pose[..., :2], -pose[..., 2])


def turned(vectors: FloatArray, angle: FloatArray) -> FloatArray:
    """Vectors (..., 2) turned by angles (...), rad."""
    c, s = np.cos(angle), np.sin(angle)
    x, y = vectors[..., 0], vectors[..., 1]
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


def left_of(vectors: FloatArray) -> FloatArray:
    """Vectors (..., 2) turned by a quarter, to the left."""
    return np.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)


def places_near(mechanism: Mechanism, q: FloatArray, near: FloatArray) -> FloatArray:
    """Parameters (slots,) of curves next to the slots' anchors, searched from those `near`."""
    slots = zip(mechanism.slots, near.tolist(), strict=True)
    return np.array([s.curve.nearest(slot_point(s, q), near=u) for s, u in slots], dtype=float)


def sensed(sense: Sense, q: FloatArray, v: FloatArray) -> FloatArray:
    """Value that is sensed at states (..., parts, 3): (...,)."""
    if isinstance(sense, Turning):
        x = v if sense.is_speed else q
        return turning(sense.first, sense.second, x)
    if isinstance(sense, Sliding):
        return speed_along(sense.slide, q, v) if sense.is_speed else length_along(sense.slide, q)
    if isinstance(sense, Apart):
        between = anchor_position(sense.second, q) - anchor_position(sense.first, q)
        return np.asarray(np.hypot(between[..., 0], between[..., 1]))
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
