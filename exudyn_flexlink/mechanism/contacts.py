"""Geometry of a point near a face: gap, place along the face, rates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.mechanism.kinematics import anchor_position, anchor_velocity
from exudyn_flexlink.mechanism.model import GROUND, Anchor, FaceContact, Mechanism

FloatArray = NDArray[np.float64]

HEAVY = 1e3  # times all the rest: a lever that stands still as it is struck


@dataclass(frozen=True)
class Approach:
    """Where the point stands against the face; arrays of one shape.

    `gap` (m) is positive on the free side, `place` (m) counts along the face from its start,
    `gap_rate` and `place_rate` (m/s) are their time derivatives, `normal` (..., 2) points to the
    free side.
    """

    gap: FloatArray
    place: FloatArray
    gap_rate: FloatArray
    place_rate: FloatArray
    normal: FloatArray


def face_length(contact: FaceContact) -> float:
    """Length of the face, m."""
    return float(np.hypot(contact.end.x - contact.start.x, contact.end.y - contact.start.y))


def swing_times(mechanism: Mechanism) -> dict[str, float]:
    """How long (s), by contact, a struck lever turns an error of its speed into one of its angle.

    That is 1/omega of the lever on its springs, infinite without a spring. A contact with what has
    no pivot of its own, or is so heavy that a strike hardly moves it, has none.
    """
    times, all_mass = {}, sum(part.mass for part in mechanism.parts)
    for contact in mechanism.contacts:
        lever = contact.start.part
        pivot = _pivot(mechanism, lever)
        if pivot is None:
            continue
        part = mechanism.parts[lever]
        arm = float(np.hypot(part.centre[0] - pivot.x, part.centre[1] - pivot.y))
        inertia = part.inertia + part.mass * arm**2
        if inertia > HEAVY * (all_mass - part.mass) * part.reach**2:
            continue
        held = {lever, GROUND}
        stiffness = sum(s.stiffness for s in mechanism.springs if {s.first, s.second} == held)
        times[contact.name] = float(np.sqrt(inertia / stiffness)) if stiffness > 0 else np.inf
    return times


def _pivot(mechanism: Mechanism, part: int) -> Anchor | None:
    """Point of a part that is pinned to the ground."""
    for pin in mechanism.pins:
        for mine, other in ((pin.first, pin.second), (pin.second, pin.first)):
            if part == mine.part != GROUND == other.part:
                return mine
    return None


def approach(contact: FaceContact, q: FloatArray, v: FloatArray) -> Approach:
    """Gap and place of the contact's point at coordinates and velocities (..., parts, 3).

    Where the point is held on the line, the gap is minus its distance from it.
    """
    start, end = anchor_position(contact.start, q), anchor_position(contact.end, q)
    along = (end - start) / face_length(contact)
    left = np.stack([-along[..., 1], along[..., 0]], axis=-1)
    between = anchor_position(contact.point, q) - start
    side = _side(contact, np.sum(left * between, axis=-1))
    normal = side[..., None] * left
    relative = anchor_velocity(contact.point, q, v) - anchor_velocity(contact.start, q, v)
    gap, place = np.sum(normal * between, axis=-1), np.sum(along * between, axis=-1)
    turning = v[..., contact.start.part, 2]
    # The face turns under the point: what is along it becomes normal to it and the reverse.
    gap_rate = np.sum(normal * relative, axis=-1) - side * turning * place
    place_rate = np.sum(along * relative, axis=-1) + side * turning * gap
    return Approach(gap, place, gap_rate, place_rate, normal)


def _side(contact: FaceContact, lateral: FloatArray) -> FloatArray:
    """Side to which the contact pushes: the free one, or from where the point is to the line."""
    if contact.side != 0:
        return np.full_like(lateral, contact.side)
    return np.where(lateral > 0, -1.0, 1.0)
