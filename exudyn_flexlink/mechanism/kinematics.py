"""Positions of anchors, and the constraints of joints with their Jacobian.

Coordinates ``q`` have shape (parts, 3): x, y (m), angle (rad); velocities ``v`` likewise.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.mechanism.model import GROUND, Anchor, Mechanism, Pin, Slot, Weld

FloatArray = NDArray[np.float64]


def anchor_position(anchor: Anchor, q: FloatArray) -> FloatArray:
    """Position of an anchor, m; `q` (..., parts, 3) gives (..., 2)."""
    if anchor.part == GROUND:
        return np.broadcast_to(np.array([anchor.x, anchor.y]), (*q.shape[:-2], 2))
    part = q[..., anchor.part, :]
    c, s = np.cos(part[..., 2]), np.sin(part[..., 2])
    return np.stack(
        [
            part[..., 0] + c * anchor.x - s * anchor.y,
            part[..., 1] + s * anchor.x + c * anchor.y,
        ],
        axis=-1,
    )


def anchor_velocity(anchor: Anchor, q: FloatArray, v: FloatArray) -> FloatArray:
    """Velocity of an anchor, m/s; `q`, `v` (..., parts, 3) give (..., 2)."""
    if anchor.part == GROUND:
        return np.zeros((*q.shape[:-2], 2))
    angle, rate = q[..., anchor.part, 2], v[..., anchor.part, :]
    c, s = np.cos(angle), np.sin(angle)
    return np.stack(
        [
            rate[..., 0] - rate[..., 2] * (s * anchor.x + c * anchor.y),
            rate[..., 1] + rate[..., 2] * (c * anchor.x - s * anchor.y),
        ],
        axis=-1,
    )


def anchor_jacobian(anchor: Anchor, q: FloatArray) -> FloatArray:
    """Derivative of an anchor's position by all coordinates, (2, 3 parts)."""
    jacobian = np.zeros((2, 3 * len(q)))
    if anchor.part != GROUND:
        first = 3 * anchor.part
        c, s = cos(q[anchor.part, 2]), sin(q[anchor.part, 2])
        jacobian[0, first] = jacobian[1, first + 1] = 1.0
        jacobian[0, first + 2] = -s * anchor.x - c * anchor.y
        jacobian[1, first + 2] = c * anchor.x - s * anchor.y
    return jacobian


def angle_jacobian(part: int, count: int) -> FloatArray:
    """Derivative of a part's angle by all coordinates, (3 count,); zero for the ground."""
    row = np.zeros(3 * count)
    if part != GROUND:
        row[3 * part + 2] = 1.0
    return row


def angle_of(part: int, q: FloatArray) -> FloatArray:
    """Angle (or angular speed) of a part, shape of `q` without its last two axes."""
    if part == GROUND:
        return np.zeros(q.shape[:-2])
    return np.asarray(q[..., part, 2])


def slot_place(slot: Slot, q: FloatArray, near: float) -> float:
    """Parameter of the slot's curve next to its anchor, searched from `near`."""
    return float(slot.curve.nearest(anchor_position(slot.anchor, q), near=near))


@dataclass(frozen=True)
class Rows:
    """Residual (m or rad) and Jacobian (rows, 3 parts) of one joint's constraints."""

    name: str
    kind: str
    residual: FloatArray
    jacobian: FloatArray

    @property
    def lengths(self) -> FloatArray:
        """Those of the residuals that are in m."""
        return self.residual[: _LENGTHS[self.kind]]

    @property
    def angles(self) -> FloatArray:
        """Those of the residuals that are in rad; they follow the lengths."""
        return self.residual[_LENGTHS[self.kind] :]


_LENGTHS = {"revolute": 2, "weld": 2, "sleeve": 1, "slot": 1, "drive": 0}


def constraint_rows(
    mechanism: Mechanism,
    q: FloatArray,
    places: FloatArray,
    motor_angles: FloatArray | None = None,
) -> Iterator[Rows]:
    """Constraints of every joint at `q`, in the mechanism's order.

    `places` are the slots' curve parameters, next to the anchors. `motor_angles` (rad) are what the
    speed motors prescribe; None leaves the motors out.
    """
    count = len(mechanism.parts)
    for joint in mechanism.attachments:
        gap = anchor_position(joint.second, q) - anchor_position(joint.first, q)
        jacobian = anchor_jacobian(joint.second, q) - anchor_jacobian(joint.first, q)
        if isinstance(joint, Pin):
            yield Rows(joint.name, "revolute", gap, jacobian)
            continue
        first, second = joint.first.part, joint.second.part
        turned = angle_of(second, q) - angle_of(first, q) - joint.angle
        row = angle_jacobian(second, count) - angle_jacobian(first, count)
        yield Rows(joint.name, "weld", np.append(gap, turned), np.vstack([jacobian, row]))
    for slide in mechanism.slides:
        yield Rows(slide.name, "sleeve", *_slide(slide.guide, slide.rod, q))
    for slot, place in zip(mechanism.slots, places, strict=True):
        normal = slot.curve.normal(place)
        offset = normal @ (anchor_position(slot.anchor, q) - slot.curve.point(place))
        jacobian = normal @ anchor_jacobian(slot.anchor, q)
        yield Rows(slot.name, "slot", np.array([offset]), jacobian[None, :])
    if motor_angles is None:
        return
    for motor, angle in zip(mechanism.speed_motors, motor_angles, strict=True):
        turned = angle_of(motor.second, q) - angle_of(motor.first, q) - angle
        row = angle_jacobian(motor.second, count) - angle_jacobian(motor.first, count)
        yield Rows(motor.name, "drive", np.array([turned]), row[None, :])


def _slide(guide: Anchor, rod: Anchor, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Offset of the rod's anchor from the guide's axis, and angle between rod and guide."""
    angle = float(angle_of(guide.part, q))
    normal, along = np.array([-sin(angle), cos(angle)]), np.array([cos(angle), sin(angle)])
    between = anchor_position(rod, q) - anchor_position(guide, q)
    row = normal @ (anchor_jacobian(rod, q) - anchor_jacobian(guide, q))
    count = len(q)
    row = row - (along @ between) * angle_jacobian(guide.part, count)
    turned = float(angle_of(rod.part, q)) - angle
    turn_row = angle_jacobian(rod.part, count) - angle_jacobian(guide.part, count)
    return np.array([normal @ between, turned]), np.vstack([row, turn_row])


def stack(rows: list[Rows], count: int) -> tuple[FloatArray, FloatArray]:
    """Residual (rows,) and Jacobian (rows, 3 count) of all joints together."""
    if not rows:
        return np.zeros(0), np.zeros((0, 3 * count))
    return np.concatenate([r.residual for r in rows]), np.vstack([r.jacobian for r in rows])


def joint_residuals(mechanism: Mechanism, q: FloatArray, places: FloatArray) -> FloatArray:
    """Largest violation (m or rad) of each joint at many instants, (instants, joints).

    `q` is (instants, parts, 3), `places` (instants, slots) the slots' curve parameters next to
    their anchors. Motors are left out.
    """
    residuals = []
    for joint in mechanism.attachments:
        gap = anchor_position(joint.second, q) - anchor_position(joint.first, q)
        residuals.append(np.hypot(gap[..., 0], gap[..., 1]))
        if isinstance(joint, Weld):
            turned = angle_of(joint.second.part, q) - angle_of(joint.first.part, q)
            residuals.append(np.abs(turned - joint.angle))
    for slide in mechanism.slides:
        angle = angle_of(slide.guide.part, q)
        between = anchor_position(slide.rod, q) - anchor_position(slide.guide, q)
        across = np.cos(angle) * between[..., 1] - np.sin(angle) * between[..., 0]
        residuals += [np.abs(across), np.abs(angle_of(slide.rod.part, q) - angle)]
    for k, slot in enumerate(mechanism.slots):
        point, derivative, _ = slot.curve.derivatives(places[:, k])
        away = anchor_position(slot.anchor, q) - point
        across = derivative[:, 0] * away[:, 1] - derivative[:, 1] * away[:, 0]
        residuals.append(np.abs(across) / np.hypot(derivative[:, 0], derivative[:, 1]))
    return np.stack(residuals, axis=-1) if residuals else np.zeros((len(q), 0))


def rate_of_jacobian_times_velocity(
    jacobian_at: Callable[[FloatArray], FloatArray], q: FloatArray, v: FloatArray
) -> FloatArray:
    """``dJ/dt v`` by a central difference along the motion; exact to second order in 1e-6 s."""
    dt = 1e-6
    ahead, behind = jacobian_at(q + dt * v), jacobian_at(q - dt * v)
    return np.asarray((ahead - behind) @ v.ravel() / (2 * dt))
