"""The constraints of all joints at once, positions and velocities of anchors, and welded groups.

A constraint binds two parts; that of a gear binds the four ends of two joints. So it has few
slopes, however many parts the mechanism has. Coordinates ``q`` have shape (parts, 3): x, y (m),
angle (rad); velocities ``v`` likewise.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import cos, sin
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.mechanism.joints import GROUND, Anchor, Gear, Pin, Slide, Slot, SumStop, Weld
from exudyn_flexlink.mechanism.model import (
    Apart,
    Mechanism,
    Motor,
    PointForce,
    RigidPart,
    Sense,
    Size,
    Sliding,
    Turning,
)


def anchor_position(anchor: Anchor, q: FloatArray) -> FloatArray:
    """Position of an anchor, m; `q` (..., parts, 3) gives (..., 2)."""
    if anchor.part == GROUND:
        return np.broadcast_to(np.array([anchor.x, anchor.y]), (*q.shape[:-2], 2))
    return np.asarray(q[..., anchor.part, :2] + _arm(anchor, q))


def _arm(anchor: Anchor, q: FloatArray) -> FloatArray:
    """Vector (..., 2), m, from its part's origin to an anchor."""
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
    """Stroke (...) of a slide, m: distance of its second anchor from the first along its line."""
    between = anchor_position(slide.second, q) - anchor_position(slide.first, q)
    return np.asarray(np.sum(line_of(slide, q) * between, axis=-1))


def summed(stop: SumStop, q: FloatArray) -> FloatArray:
    """Sum (...,) of angles and lengths that a stop bounds, rad or m."""
    total = np.zeros(q.shape[:-2])
    for tie, weight in stop.terms:
        reached = turning(*tie.parts, q) if tie.slide is None else length_along(tie.slide, q)
        total = total + weight * reached
    return total


def speed_along(slide: Slide, q: FloatArray, v: FloatArray) -> FloatArray:
    """Rate (...) of `length_along`, m/s."""
    between = anchor_position(slide.second, q) - anchor_position(slide.first, q)
    moving = anchor_velocity(slide.second, q, v) - anchor_velocity(slide.first, q, v)
    along = line_of(slide, q)
    across = along[..., 0] * between[..., 1] - along[..., 1] * between[..., 0]
    turning = angle_of(slide.first.part, v)
    return np.asarray(np.sum(along * moving, axis=-1) + turning * across)


def joint_speed(joint: Pin | Slide, q: FloatArray, v: FloatArray) -> FloatArray:
    """Speed (...) of a joint, rad/s or m/s."""
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
    """Parameters (slots,) of the curves nearest to the slots' anchors, searched from `near`."""
    slots = zip(mechanism.slots, near.tolist(), strict=True)
    return np.array([s.curve.nearest(slot_point(s, q), near=u) for s, u in slots], dtype=float)


def sensed(sense: Sense, q: FloatArray, v: FloatArray) -> FloatArray:
    """Value (...,) of a sense in states (..., parts, 3)."""
    if isinstance(sense, Turning):
        x = v if sense.is_speed else q
        return turning(sense.first, sense.second, x)
    if isinstance(sense, Sliding):
        return speed_along(sense.slide, q, v) if sense.is_speed else length_along(sense.slide, q)
    if isinstance(sense, Apart):
        between = anchor_position(sense.second, q) - anchor_position(sense.first, q)
        assert not sense.is_speed  # only a spring's force needs its rate
        return np.asarray(np.hypot(between[..., 0], between[..., 1]))
    return np.asarray(anchor_position(sense.point, q)[..., sense.axis])


def motor_place(motor: Motor, q: FloatArray) -> FloatArray:
    """Angle (rad), or stroke of its slide (m), that a motor prescribes, in states (...,)."""
    return sensed(_sense_of(motor, is_speed=False), q, q)


def motor_speed(motor: Motor, q: FloatArray, v: FloatArray) -> FloatArray:
    """Rate of `motor_place`, rad/s or m/s."""
    return sensed(_sense_of(motor, is_speed=True), q, v)


def _sense_of(motor: Motor, is_speed: bool) -> Sense:
    if motor.slide:
        return Sliding(motor.slide, is_speed)
    return Turning(motor.first, motor.second, is_speed)


def size_at(size: Size, time: float, q: FloatArray, v: FloatArray) -> float:
    """Size (N m or N) in one state (parts, 3).

    Raises:
        ArithmeticError: it has no value there.

    """
    return size.value.at(time, [float(sensed(sense, q, v)) for sense in size.senses])


def sizes_at(size: Size, time: FloatArray, q: FloatArray, v: FloatArray) -> FloatArray:
    """As `size_at`, for instants (n,) and states (n, parts, 3)."""
    return size.value.values(time, [sensed(sense, q, v) for sense in size.senses])


def force_at(force: PointForce, time: FloatArray, q: FloatArray, v: FloatArray) -> FloatArray:
    """Force (n, 2) along the ground's axes at instants (n,) and states (n, parts, 3), N."""
    components = [sizes_at(size, time, q, v) for size in force.sizes]
    return turned(np.stack(components, axis=-1), angle_of(force.axes, q))


_ROWS = {"revolute": 2, "weld": 3, "slide": 2, "slot": 1, "gear": 1, "drive": 1, "slide drive": 1}
# Number of rows in m; they are the first rows of each joint.
LENGTHS = {"revolute": 2, "weld": 2, "slide": 1, "slot": 1, "gear": 0, "drive": 0, "slide drive": 1}
# Complex step: a power of two, so small that slopes are exact.
STEP = 2.0**-100


@dataclass(frozen=True)
class Constraints:
    """Constraints of every joint, in the mechanism's order.

    Joint j has the rows ``first_rows[j]`` to ``first_rows[j + 1]``. `residual` (rows,) is in m or
    rad; `parts` (rows, 2) are the joint's first and second part, GROUND without a part, and
    `slopes` (rows, 2, 3) are the derivatives of the residual by their coordinates. With gears both
    have four parts, perhaps the same part twice. `count` is the number of parts.
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

    @property
    def open_by(self) -> tuple[FloatArray, FloatArray]:
        """Openings of every joint, (joints,) each: in m, and in rad."""
        joints = np.repeat(np.arange(len(self.kinds)), np.diff(self.first_rows))
        within = np.arange(len(joints)) - self.first_rows[joints]
        in_metres = within < np.array([LENGTHS[kind] for kind in self.kinds], dtype=int)[joints]
        size, count = np.abs(self.residual[: len(joints)]), len(self.kinds)
        gaps = np.bincount(joints, np.where(in_metres, size, 0.0) ** 2, count)
        turns = np.bincount(joints, np.where(in_metres, 0.0, size), count)
        return np.sqrt(gaps), np.asarray(turns, dtype=float)

    def times(self, v: FloatArray) -> FloatArray:
        """Jacobian times velocities (parts, 3): (rows,)."""
        moved = np.vstack([v, np.zeros((1, 3))])  # GROUND (-1) is the last row; it does not move
        return np.asarray(np.einsum("rij,rij->r", self.slopes, moved[self.parts]))

    def holding(self, multipliers: FloatArray) -> FloatArray:
        """Generalised forces (parts, 3) of multipliers (rows,), by the transposed Jacobian."""
        held = np.zeros((self.count + 1, 3))  # GROUND (-1) is the last row
        np.add.at(held, self.parts, self.slopes * multipliers[:, None, None])
        return held[: self.count]

    def jacobian(self, rows: IndexArray | None = None) -> FloatArray:
        """Dense Jacobian (rows, 3 parts) by all coordinates, of all rows or of given ones.

        It grows with the number of parts, so ask for few rows at a time.
        """
        rows = np.arange(len(self)) if rows is None else rows
        dense = np.zeros((len(rows), self.count + 1, 3))
        for side in range(self.parts.shape[1]):
            dense[np.arange(len(rows)), self.parts[rows, side]] += self.slopes[rows, side]
        return dense[:, : self.count].reshape(len(rows), 3 * self.count)

    def with_fixed(
        self, fixed: Sequence[tuple[int, int]], residual: Sequence[float] | None = None
    ) -> Constraints:
        """Add a row without joint for each part and coordinate (0, 1, 2: x, y, angle)."""
        slopes = np.zeros((len(fixed), 2, 3))
        for row, (_, axis) in enumerate(fixed):
            slopes[row, 1, axis] = 1.0
        parts = np.array([(-1, part) for part, _ in fixed], dtype=int).reshape(-1, 2)
        given = np.zeros(len(fixed)) if residual is None else np.asarray(residual, dtype=float)
        return self.with_rows(given, parts, slopes)

    def with_rows(self, residual: FloatArray, parts: IndexArray, slopes: FloatArray) -> Constraints:
        """Add rows without joints."""
        _, parts, slopes = _widened((residual, parts, slopes), self.parts.shape[1])
        return replace(
            self,
            residual=np.append(self.residual, residual),
            parts=np.concatenate([self.parts, parts]),
            slopes=np.concatenate([self.slopes, slopes]),
        )


def constraint_rows(mechanism: Mechanism, q: FloatArray, places: FloatArray) -> Constraints:
    """Constraints of every joint and speed motor at `q`, in the mechanism's order.

    `places` are the slots' curve parameters, nearest to the anchors. A motor holds its starting
    value. A motor without one, and gears, start as assembled: then only the slopes count, since the
    residual contains the starting value.
    """
    motors, gears = mechanism.speed_motors, mechanism.gears
    starts = np.array([motor.start or 0.0 for motor in motors])
    pairs, lines = (
        [(motor.first, motor.second) for motor in motors],
        [motor.slide for motor in motors],
    )
    families = [*_families(mechanism, places), _moving(pairs, lines, starts)]
    joints: list[Pin | Weld | Slide | Slot | Gear | Motor]
    joints = [*mechanism.attachments, *mechanism.slides, *mechanism.slots, *gears, *motors]
    kinds = [kind for kind, rows in zip(_KINDS, families, strict=False) for _ in rows.parts]
    kinds += ["gear"] * len(gears)
    kinds += ["slide drive" if motor.slide else "drive" for motor in motors]
    blocks = [_rows_of(family, q) for family in families]
    if gears:
        blocks.insert(len(families) - 1, _geared(gears, q))
        blocks = [_widened(block, 4) for block in blocks]
    residual, parts, slopes = (np.concatenate(part) for part in zip(*blocks, strict=True))
    return Constraints(
        tuple(joint.name for joint in joints),
        tuple(kinds),
        np.cumsum([0, *(_ROWS[kind] for kind in kinds)]),
        residual,
        parts,
        slopes,
        len(q),
    )


def joint_residuals(mechanism: Mechanism, q: FloatArray, places: FloatArray) -> FloatArray:
    """Openings of every joint (m and rad) at many instants, (instants, joints).

    `q` is (instants, parts, 3), `places` (instants, slots) are the slots' curve parameters nearest
    to their anchors. Motors and gears are left out. A joint that can open in m and in rad has two
    columns.
    """
    residuals = []
    for kind, family in zip(_KINDS, _families(mechanism, places), strict=True):
        residual = family.residual(q)
        lengths = LENGTHS[kind]
        residuals += [
            np.linalg.norm(residual[..., :lengths], axis=-1),
            *np.abs(np.moveaxis(residual[..., lengths:], -1, 0)),
        ]
    return np.concatenate(residuals, axis=-1)


# --- joints of one kind -----------------------------------------------------------------------

_KINDS = ("revolute", "weld", "slide", "slot")
_Open = Callable[[FloatArray, FloatArray], FloatArray]


class _Family(NamedTuple):
    """Joints of one kind: their parts (joints, 2), and their openings.

    `open_at` returns openings (..., joints, rows), m or rad, for poses (..., joints, 3) of first
    and of second parts; poses may be complex.
    """

    parts: IndexArray
    open_at: _Open

    def poses(self, q: FloatArray) -> FloatArray:
        """Poses (..., joints, 2, 3) of both parts; the ground, -1, stands at 0."""
        ground = np.zeros((*q.shape[:-2], 1, 3))
        return np.concatenate([q, ground], axis=-2)[..., self.parts, :]

    def residual(self, q: FloatArray) -> FloatArray:
        """Openings of all joints at coordinates (..., parts, 3)."""
        poses = self.poses(q)
        return self.open_at(poses[..., 0, :], poses[..., 1, :])


_Block = tuple[FloatArray, IndexArray, FloatArray]  # residual, parts, slopes of some rows


def _rows_of(family: _Family, q: FloatArray) -> _Block:
    poses = family.poses(q)
    residual = family.open_at(poses[:, 0], poses[:, 1])
    moved = poses + 1j * STEP * np.eye(6).reshape(6, 1, 2, 3)
    slopes = family.open_at(moved[..., 0, :], moved[..., 1, :]).imag / STEP
    by_row = np.moveaxis(slopes, 0, -1).reshape(-1, 2, 3)
    return residual.ravel(), family.parts.repeat(residual.shape[1], axis=0), by_row


def _families(mechanism: Mechanism, places: FloatArray) -> list[_Family]:
    """Pins, welds, slides, and slots by the curves' normals at their `places` (..., slots)."""
    pins, welds, slides, slots = mechanism.pins, mechanism.welds, mechanism.slides, mechanism.slots
    return [
        _family([(pin.first.part, pin.second.part) for pin in pins], _gap(pins)),
        _family([(weld.first.part, weld.second.part) for weld in welds], _welded(welds)),
        _family([(slide.first.part, slide.second.part) for slide in slides], _slid(slides)),
        _slotted(slots, places, across=True),
    ]


def _family(parts: Sequence[tuple[int, int]], open_at: _Open) -> _Family:
    return _Family(np.array(parts, dtype=int).reshape(-1, 2), open_at)


def _points(anchors: Sequence[Anchor]) -> Callable[[FloatArray], FloatArray]:
    """Positions (..., anchors, 2) by poses (..., anchors, 3)."""
    places = np.array([(anchor.x, anchor.y) for anchor in anchors]).reshape(-1, 2)
    return lambda pose: pose[..., :2] + turned(places, pose[..., 2])


def _gap(joints: Sequence[Pin | Weld | Slide]) -> _Open:
    """Vector from the first to the second anchor."""
    starts = _points([joint.first for joint in joints])
    ends = _points([joint.second for joint in joints])
    return lambda first, second: ends(second) - starts(first)


def _turn(angles: Sequence[float]) -> _Open:
    """Angle of the second part against the first, minus the given angle."""
    return lambda first, second: (second[..., 2] - first[..., 2] - np.array(angles))[..., None]


def _welded(welds: Sequence[Weld]) -> _Open:
    gap, turn = _gap(welds), _turn([weld.angle for weld in welds])
    return lambda first, second: np.concatenate([gap(first, second), turn(first, second)], axis=-1)


def _on_line(slides: Sequence[Slide]) -> _Open:
    """Place of the second anchor relative to the first: along the line, and left of it."""
    gap, directions = _gap(slides), np.array([slide.direction for slide in slides])
    return lambda first, second: turned(gap(first, second), -(first[..., 2] + directions))


def _slid(slides: Sequence[Slide]) -> _Open:
    on_line, turn = _on_line(slides), _turn([slide.angle for slide in slides])
    return lambda first, second: np.concatenate(
        [on_line(first, second)[..., 1:], turn(first, second)], axis=-1
    )


def _slotted(slots: Sequence[Slot], places: FloatArray, across: bool) -> _Family:
    """Distances of anchors from `places` (..., slots) on their curves, across or along these."""
    shape = (*places.shape[:-1], len(slots), 2)
    ways, points = np.zeros(shape), np.zeros(shape)
    for k, slot in enumerate(slots):
        points[..., k, :], ways[..., k, :], _ = slot.curve.derivatives(places[..., k])
    ways /= np.linalg.norm(ways, axis=-1, keepdims=True)
    ways = left_of(ways) if across else ways
    anchored = _points([slot.anchor for slot in slots])

    def open_at(first: FloatArray, second: FloatArray) -> FloatArray:
        seen = turned(anchored(second) - first[..., :2], -first[..., 2])
        return np.asarray(np.sum(ways * (seen - points), axis=-1, keepdims=True))

    return _family([(slot.carrier, slot.anchor.part) for slot in slots], open_at)


def _moving(
    parts: Sequence[tuple[int, int]], slides: Sequence[Slide | None], starts: FloatArray
) -> _Family:
    """Angles of second parts against first ones, or strokes of slides, minus their starts."""
    turn = _turn(starts.tolist())
    ends = [(Anchor(first, 0.0, 0.0), Anchor(second, 0.0, 0.0)) for first, second in parts]
    lines = [slide or Slide("", *pair) for slide, pair in zip(slides, ends, strict=True)]
    on_line, along_line = _on_line(lines), np.array([slide is not None for slide in slides])

    def open_at(first: FloatArray, second: FloatArray) -> FloatArray:
        along = on_line(first, second)[..., :1] - starts[:, None]
        return np.where(along_line[:, None], along, turn(first, second))

    return _family(parts, open_at)


def _geared(gears: Sequence[Gear], q: FloatArray) -> _Block:
    """Rows of gears: sums of the motions of both joints, by the gears' weights."""
    ties = [tie for gear in gears for tie in gear.ties]
    moving = _moving([tie.parts for tie in ties], [tie.slide for tie in ties], np.zeros(len(ties)))
    residual, ends, slopes = _rows_of(moving, q)
    weights = np.array([gear.weights for gear in gears])
    shared = weights[:, :, None, None] * slopes.reshape(-1, 2, 2, 3)
    return (
        np.sum(weights * residual.reshape(-1, 2), axis=1) - [gear.start for gear in gears],
        ends.reshape(-1, 4),
        shared.reshape(-1, 4, 3),
    )


def _widened(block: _Block, width: int) -> _Block:
    """Widen rows to `width` parts; the added parts are the ground."""
    residual, parts, slopes = block
    more = width - parts.shape[1]
    if not more:
        return block
    parts = np.pad(parts, [(0, 0), (0, more)], constant_values=GROUND)
    return residual, parts, np.pad(slopes, [(0, 0), (0, more), (0, 0)])


# --- rows without joints------------------------------------------------------------------------


def along_slides(slides: Sequence[Slide], lengths: FloatArray, q: FloatArray) -> _Block:
    """Strokes of slides minus given `lengths` (m): residual, parts, slopes."""
    parts = [(slide.first.part, slide.second.part) for slide in slides]
    return _rows_of(_moving(parts, slides, lengths), q)


def along_slots(slots: Sequence[Slot], q: FloatArray, places: FloatArray) -> _Block:
    """Distance of each anchor from its place on the curve, along the curve's tangent."""
    return _rows_of(_slotted(slots, places, across=False), q)


@dataclass(frozen=True)
class Frame:
    """A frame at a place (m) in a link's axes, turned by `angle` (rad); GROUND is the ground."""

    link: int
    x: float = 0.0
    y: float = 0.0
    angle: float = 0.0

    def place(self, x: float, y: float) -> tuple[float, float]:
        """Return a point of the frame in the link's axes."""
        c, s = cos(self.angle), sin(self.angle)
        return self.x + c * x - s * y, self.y + s * x + c * y


def frame_about(point: tuple[float, float], link: int, angle: float) -> Frame:
    """A frame turned by `angle` against a link; its `point` (m) is the link's origin."""
    x, y = Frame(link, 0.0, 0.0, angle).place(*point)
    return Frame(link, -x, -y, angle)


def weld_groups(mechanism: Mechanism) -> list[dict[int, Frame]]:
    """Groups of welded parts, with frames in the axes of the first part; the ground's is first."""
    left = [GROUND, *range(len(mechanism.parts))]
    groups = []
    while left:
        groups.append(welded_to(left[0], mechanism.welds))
        left = [part for part in left if part not in groups[-1]]
    return groups


def welded_to(part: int, welds: Sequence[Weld]) -> dict[int, Frame]:
    """A part and all parts welded to it, with frames in its axes."""
    group = {part: Frame(GROUND)}
    while out := [
        weld for weld in welds if len({weld.first.part, weld.second.part} & group.keys()) == 1
    ]:
        weld = out[0]
        near = weld.first.part in group
        known, added = (weld.first, weld.second) if near else (weld.second, weld.first)
        angle = group[known.part].angle + (weld.angle if near else -weld.angle)
        x, y = group[known.part].place(known.x, known.y)
        back = frame_about((added.x, added.y), GROUND, angle)
        group[added.part] = Frame(GROUND, x + back.x, y + back.y, angle)
    return group


def inertia_with_welded(point: Anchor, parts: Sequence[RigidPart], welds: Sequence[Weld]) -> float:
    """Moment of inertia (kg m^2) about a point of a part, with all parts welded to it."""
    total = 0.0
    for part, frame in welded_to(point.part, welds).items():
        if part != GROUND:
            x, y = frame.place(*parts[part].centre)
            total += parts[part].inertia + parts[part].mass * (
                (x - point.x) ** 2 + (y - point.y) ** 2
            )
    return total
