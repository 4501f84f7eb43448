"""The constraints of all joints at once: residuals, and slopes by the two parts of each.

No constraint binds more than two parts, so that its slopes are six numbers however many parts the
mechanism has. Coordinates ``q`` have shape (parts, 3), see `kinematics`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.mechanism.kinematics import (
    anchor_position,
    left_of,
    line_of,
    slot_point,
    turned,
    turning,
)
from exudyn_flexlink.mechanism.model import Mechanism, Motor, Pin, Slide, Slot, Weld
from exudyn_flexlink.mechanism.parts import Anchor

_ROWS = {"revolute": 2, "weld": 3, "slide": 2, "slot": 1, "drive": 1, "slide drive": 1}
# Rows that are in m, the first of each joint.
LENGTHS = {"revolute": 2, "weld": 2, "slide": 1, "slot": 1, "drive": 0, "slide drive": 1}


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
        return self.residual[: LENGTHS[self.kind]]

    @property
    def angles(self) -> FloatArray:
        """Those of the residuals that are in rad; they follow the lengths."""
        return self.residual[LENGTHS[self.kind] :]


@dataclass(frozen=True)
class Constraints:
    """Constraints of every joint, in the mechanism's order.

    Joint j has the rows ``first_rows[j]`` to ``first_rows[j + 1]``. `residual` (rows,) is in m or
    rad; `parts` (rows, 2) are the joint's first and second part, GROUND for none, and `slopes`
    (rows, 2, 3) the derivatives of the residual by their coordinates. `count` is the number of
    parts.
    """

    names: tuple[str, ...]
    kinds: tuple[str, ...]
    first_rows: IndexArray
    residual: FloatArray
    parts: IndexArray
    slopes: FloatArray
    count: int

    def __len__(self) -> int:
        return len(self.residual)

    def __iter__(self) -> Iterator[Rows]:
        """Joint by joint, each with its own part of the Jacobian."""
        for j, (name, kind) in enumerate(zip(self.names, self.kinds, strict=True)):
            rows = np.arange(self.first_rows[j], self.first_rows[j + 1])
            yield Rows(name, kind, self.residual[rows], self.jacobian(rows))

    def times(self, v: FloatArray) -> FloatArray:
        """Jacobian times velocities (parts, 3): (rows,)."""
        moved = np.vstack([v, np.zeros((1, 3))])  # GROUND, -1, is the last: it does not move
        return np.asarray(np.einsum("rij,rij->r", self.slopes, moved[self.parts]))

    def jacobian(self, rows: IndexArray | None = None) -> FloatArray:
        """Jacobian by the coordinates of all parts, (rows, 3 parts), of all rows or of those given.

        It is as wide as the mechanism has parts: for a few rows at a time.
        """
        rows = np.arange(len(self)) if rows is None else rows
        dense = np.zeros((len(rows), self.count + 1, 3))
        for side in (0, 1):
            dense[np.arange(len(rows)), self.parts[rows, side]] += self.slopes[rows, side]
        return dense[:, : self.count].reshape(len(rows), 3 * self.count)

    def with_fixed(
        self, fixed: Sequence[tuple[int, int]], residual: Sequence[float] | None = None
    ) -> Constraints:
        """Add a row of no joint for each part and coordinate (0, 1, 2: x, y, angle)."""
        slopes = np.zeros((len(fixed), 2, 3))
        for row, (_, axis) in enumerate(fixed):
            slopes[row, 1, axis] = 1.0
        parts = np.array([(-1, part) for part, _ in fixed], dtype=int).reshape(-1, 2)
        given = np.zeros(len(fixed)) if residual is None else np.asarray(residual, dtype=float)
        return self.with_rows(given, parts, slopes)

    def with_rows(self, residual: FloatArray, parts: IndexArray, slopes: FloatArray) -> Constraints:
        """Add rows of no joint."""
        return replace(
            self,
            residual=np.append(self.residual, residual),
            parts=np.concatenate([self.parts, parts]),
            slopes=np.concatenate([self.slopes, slopes]),
        )


def constraint_rows(mechanism: Mechanism, q: FloatArray, places: FloatArray) -> Constraints:
    """Constraints of every joint and speed motor at `q`, in the mechanism's order.

    `places` are the slots' curve parameters, next to the anchors. A motor holds what it starts
    with; of one that starts as assembled only the slopes count, its residual is off by that.
    """
    pins, welds, slides, slots = mechanism.pins, mechanism.welds, mechanism.slides, mechanism.slots
    motors = mechanism.speed_motors
    kinds = ("revolute",) * len(pins) + ("weld",) * len(welds) + ("slide",) * len(slides)
    kinds += ("slot",) * len(slots)
    kinds += tuple("slide drive" if motor.slide else "drive" for motor in motors)
    joints: tuple[Pin | Weld | Slide | Slot | Motor, ...]
    joints = (*pins, *welds, *slides, *slots, *motors)
    names = tuple(joint.name for joint in joints)
    blocks = [
        _attached(pins, q),
        *([_welded(welds, q)] if welds else []),
        *([_slid(slides, q)] if slides else []),
        *([_slotted(slots, q, places)] if slots else []),
        *([_driven(motors, q)] if motors else []),
    ]
    residual, parts, slopes = (np.concatenate(part) for part in zip(*blocks, strict=True))
    return Constraints(
        names,
        kinds,
        np.cumsum([0, *(_ROWS[kind] for kind in kinds)]),
        residual,
        parts,
        slopes,
        len(q),
    )


# --- rows of one kind -------------------------------------------------------------------------

_Block = tuple[FloatArray, IndexArray, FloatArray]  # residual, parts, slopes of some rows


@dataclass(frozen=True)
class _Anchored:
    """Anchors at one place: their parts, positions, and arms (m) from the parts' origins."""

    parts: IndexArray
    at: FloatArray
    arms: FloatArray

    @staticmethod
    def of(anchors: Sequence[Anchor], q: FloatArray) -> _Anchored:
        parts = np.array([anchor.part for anchor in anchors], dtype=int)
        own = np.array([(anchor.x, anchor.y) for anchor in anchors]).reshape(-1, 2)
        pose = np.vstack([q, np.zeros((1, 3))])[parts]  # GROUND, -1, stands at 0
        arms = turned(own, pose[:, 2])
        return _Anchored(parts, pose[:, :2] + arms, arms)

    def slopes(self, directions: FloatArray) -> FloatArray:
        """Derivatives of the positions along directions (anchors, 2): (anchors, 3)."""
        turning = np.sum(directions * left_of(self.arms), axis=1, keepdims=True)
        return np.concatenate([directions, turning], axis=1)


def _attached(joints: Sequence[Pin | Weld], q: FloatArray) -> _Block:
    """Gap of each joint's two anchors, along x and y."""
    first = _Anchored.of([joint.first for joint in joints], q)
    second = _Anchored.of([joint.second for joint in joints], q)
    slopes = np.empty((len(joints), 2, 2, 3))
    for axis in (0, 1):
        along = np.zeros((len(joints), 2))
        along[:, axis] = 1.0
        slopes[:, axis, 0], slopes[:, axis, 1] = -first.slopes(along), second.slopes(along)
    parts = np.stack([first.parts, second.parts], axis=1)
    return (second.at - first.at).ravel(), parts.repeat(2, axis=0), slopes.reshape(-1, 2, 3)


def _turned(pairs: Sequence[tuple[int, int]], angles: FloatArray, q: FloatArray) -> _Block:
    """Angle of the second part of each pair relative to the first, less what it should be."""
    parts = np.array(pairs, dtype=int).reshape(-1, 2)
    turned = np.append(q[:, 2], 0.0)[parts]
    slopes = np.zeros((len(parts), 2, 3))
    slopes[:, 0, 2], slopes[:, 1, 2] = -1.0, 1.0
    return turned[:, 1] - turned[:, 0] - angles, parts, slopes


class _Line(NamedTuple):
    """Slides' anchors, directions (slides, 2) along and across, and from anchor to anchor, m."""

    first: _Anchored
    second: _Anchored
    along: FloatArray
    normal: FloatArray
    between: FloatArray

    @staticmethod
    def of(slides: Sequence[Slide], q: FloatArray) -> _Line:
        first = _Anchored.of([slide.first for slide in slides], q)
        second = _Anchored.of([slide.second for slide in slides], q)
        angle = np.append(q[:, 2], 0.0)[first.parts] + [slide.direction for slide in slides]
        along = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        return _Line(first, second, along, left_of(along), second.at - first.at)

    @property
    def parts(self) -> IndexArray:
        return np.stack([self.first.parts, self.second.parts], axis=1)

    def slopes(self, directions: FloatArray) -> FloatArray:
        """Derivatives (slides, 2, 3) of the distance along directions that do not turn."""
        return np.stack([-self.first.slopes(directions), self.second.slopes(directions)], axis=1)


def along_slides(
    slides: Sequence[Slide], lengths: FloatArray, q: FloatArray
) -> tuple[FloatArray, IndexArray, FloatArray]:
    """How far slides are out, less the `lengths` (m) they should be: residual, parts, slopes."""
    line = _Line.of(slides, q)
    slopes = line.slopes(line.along)
    slopes[:, 0, 2] += np.sum(line.normal * line.between, axis=1)
    return np.sum(line.along * line.between, axis=1) - lengths, line.parts, slopes


def _driven(motors: Sequence[Motor], q: FloatArray) -> _Block:
    """How far each motor is from its start: an angle, or a length along a slide."""
    values = np.array([motor.start or 0.0 for motor in motors])
    residual, parts, slopes = _turned([(m.first, m.second) for m in motors], values, q)
    slides = [motor.slide for motor in motors if motor.slide]
    if slides:
        along = [i for i, motor in enumerate(motors) if motor.slide]
        residual[along], parts[along], slopes[along] = along_slides(slides, values[along], q)
    return residual, parts, slopes


def _welded(welds: Sequence[Weld], q: FloatArray) -> _Block:
    angles = np.array([weld.angle for weld in welds])
    pairs = [(weld.first.part, weld.second.part) for weld in welds]
    return _joined(_attached(welds, q), _turned(pairs, angles, q))


def _slid(slides: Sequence[Slide], q: FloatArray) -> _Block:
    """Offset of each second anchor from the line through the first, and the angle to be held."""
    line = _Line.of(slides, q)
    slopes = line.slopes(line.normal)
    slopes[:, 0, 2] -= np.sum(line.along * line.between, axis=1)
    pairs = [(slide.first.part, slide.second.part) for slide in slides]
    offset = (np.sum(line.normal * line.between, axis=1), line.parts, slopes)
    return _joined(offset, _turned(pairs, np.array([slide.angle for slide in slides]), q))


def _joined(lengths: _Block, angles: _Block) -> _Block:
    """Rows of joints that have some in m and then one in rad, joint by joint."""
    residual, parts, slopes = (
        np.concatenate(
            [a.reshape(len(b), -1, *a.shape[1:]), b.reshape(len(b), 1, *b.shape[1:])], axis=1
        ).reshape(-1, *a.shape[1:])
        for a, b in zip(lengths, angles, strict=True)
    )
    return residual, parts.astype(int), slopes


def _slotted(slots: Sequence[Slot], q: FloatArray, places: FloatArray) -> _Block:
    """Distance of each anchor from its curve, along the curve's normal."""
    normals = np.array([s.curve.normal(u) for s, u in zip(slots, places, strict=True)])
    return _from_place(slots, q, places, normals.reshape(-1, 2))


def along_slots(slots: Sequence[Slot], q: FloatArray, places: FloatArray) -> _Block:
    """How far each anchor is from its place on the curve, along the curve's tangent."""
    ways = [s.curve.derivatives(np.array([u]))[1][0] for s, u in zip(slots, places, strict=True)]
    tangents = np.array(ways).reshape(-1, 2)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    return _from_place(slots, q, places, tangents)


def _from_place(
    slots: Sequence[Slot], q: FloatArray, places: FloatArray, directions: FloatArray
) -> _Block:
    """Distance of each anchor from its place, along directions in the axes of the curves."""
    points = np.array([s.curve.point(u) for s, u in zip(slots, places, strict=True)])
    points = points.reshape(-1, 2)
    anchored = _Anchored.of([slot.anchor for slot in slots], q)
    carriers = _Anchored.of([Anchor(slot.carrier, 0.0, 0.0) for slot in slots], q)
    angle = np.append(q[:, 2], 0.0)[carriers.parts]
    from_carrier = anchored.at - carriers.at
    directions, points = turned(directions, angle), turned(points, angle)
    slopes = np.stack([-carriers.slopes(directions), anchored.slopes(directions)], axis=1)
    # Where the carrier turns, the direction turns with it against the point.
    slopes[:, 0, 2] = directions[:, 0] * from_carrier[:, 1] - directions[:, 1] * from_carrier[:, 0]
    parts = np.stack([carriers.parts, anchored.parts], axis=1)
    return np.sum(directions * (from_carrier - points), axis=1), parts, slopes


# --- many instants ----------------------------------------------------------------------------


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
            residuals.append(np.abs(turning(joint.first.part, joint.second.part, q) - joint.angle))
    for slide in mechanism.slides:
        between = anchor_position(slide.second, q) - anchor_position(slide.first, q)
        residuals.append(np.abs(np.sum(left_of(line_of(slide, q)) * between, axis=-1)))
        residuals.append(np.abs(turning(slide.first.part, slide.second.part, q) - slide.angle))
    for k, slot in enumerate(mechanism.slots):
        point, derivative, _ = slot.curve.derivatives(places[:, k])
        away = slot_point(slot, q) - point
        across = derivative[:, 0] * away[:, 1] - derivative[:, 1] * away[:, 0]
        residuals.append(np.abs(across) / np.hypot(derivative[:, 0], derivative[:, 1]))
    return np.stack(residuals, axis=-1) if residuals else np.zeros((len(q), 0))
