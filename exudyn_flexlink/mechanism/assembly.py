"""The state at time 0: where the parts stand, how fast they move, what the springs rest at."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.curves import ray_crossings
from exudyn_flexlink.mechanism.dynamics import accelerations, constraint_jacobian
from exudyn_flexlink.mechanism.kinematics import (
    Rows,
    anchor_position,
    angle_of,
    constraint_rows,
    stack,
)
from exudyn_flexlink.mechanism.model import GROUND, Anchor, Mechanism, Slot

FloatArray = NDArray[np.float64]

CLOSED = 1e-10  # m or rad: residual of a joint that counts as closed
ITERATIONS = 60


@dataclass(frozen=True)
class Start:
    """What the scene says of time 0, by part: held and guessed angles, held speeds."""

    angles: Mapping[int, float]
    guesses: Mapping[int, float]
    speeds: Mapping[int, float]


@dataclass(frozen=True)
class State:
    """Coordinates (parts, 3), velocities, accelerations; the slots' curve parameters."""

    q: FloatArray
    v: FloatArray
    a: FloatArray
    places: FloatArray


@dataclass(frozen=True)
class Assembly:
    """A mechanism put together: its state at time 0, degrees of freedom, redundant constraints."""

    mechanism: Mechanism
    state: State
    degrees_of_freedom: int
    redundant: int


class CannotAssembleError(ValueError):
    """The joints can't all close: `joint` is the one that stays open most, by `gap` (m or rad)."""

    def __init__(self, joint: str, kind: str, gap: float) -> None:
        super().__init__(f"joint '{joint}' stays open by {gap:.3g}")
        self.joint = joint
        self.kind = kind
        self.gap = gap


class CannotMoveError(ValueError):
    """The given speeds contradict a joint: `joint` is the one most violated, by `rate`."""

    def __init__(self, joint: str, kind: str, rate: float) -> None:
        super().__init__(f"the speeds violate joint '{joint}' by {rate:.3g}")
        self.joint = joint
        self.kind = kind
        self.rate = rate


def assemble(mechanism: Mechanism, start: Start) -> Assembly:
    """Put the mechanism together at time 0.

    Angles in `start.angles` and those of motor-driven parts are held; everything else starts from
    `start.guesses` (0 where nothing is given) and moves as little as the joints demand. Parts of
    one flexible body start straight and at one angular speed.

    Raises:
        CannotAssembleError: a joint can't close.
        CannotMoveError: the speeds given contradict the joints.

    """
    q = _place(mechanism, start)
    q, places = _close(mechanism, q, _held_angles(mechanism, start))
    mechanism = mechanism.with_springs(
        tuple(
            spring
            if spring.rest_angle is not None
            else replace(
                spring, rest_angle=float(angle_of(spring.second, q) - angle_of(spring.first, q))
            )
            for spring in mechanism.springs
        )
    )
    v = _velocities(mechanism, q, places, start)
    a = accelerations(mechanism, q, v, places, 0.0)
    jacobian = constraint_jacobian(mechanism, q, places)
    rank = _rank(mechanism, jacobian)
    return Assembly(mechanism, State(q, v, a, places), q.size - rank, len(jacobian) - rank)


# --- positions ------------------------------------------------------------------------------


def _held_angles(mechanism: Mechanism, start: Start) -> set[int]:
    """Parts whose angle stays: given ones, and those that a motor drives from the ground."""
    held = set(start.angles)
    for motor in (*mechanism.speed_motors, *mechanism.torque_motors):
        ends = {motor.first, motor.second} - {GROUND}
        if len(ends) == 1 and not ends & set(start.guesses):
            held |= ends
    return held


def _place(mechanism: Mechanism, start: Start) -> FloatArray:
    """Lay the parts out joint by joint from the ground, as a start for closing the loops."""
    q = np.zeros((len(mechanism.parts), 3))
    turned = _known_angles(mechanism, start)
    q[:, 2] = [turned.get(i, 0.0) for i in range(len(q))]
    placed = {GROUND}
    joints: list[tuple[Anchor, Anchor]] = [
        (joint.first, joint.second) for joint in mechanism.attachments
    ]
    slides = [(slide.guide, slide.rod) for slide in mechanism.slides]
    while True:
        # Loose ends are pinned first: a slide or a slot leaves a freedom that a pin would fix.
        if any(_attach(q, placed, first, second) for first, second in joints):
            continue
        if _attach_slides(mechanism, q, placed, slides):
            continue
        if any(_attach_slot(q, placed, slot) for slot in mechanism.slots):
            continue
        return q


def _known_angles(mechanism: Mechanism, start: Start) -> dict[int, float]:
    """Angles of all parts that are given, passed on by slides and welds, and along a link."""
    known = {**start.guesses, **start.angles}
    for motor in (*mechanism.speed_motors, *mechanism.torque_motors):
        for part in (motor.first, motor.second):
            if part != GROUND:
                known.setdefault(part, 0.0)
    for _ in mechanism.parts:
        before = len(known)
        for weld in mechanism.welds:
            _pass_on(known, weld.first.part, weld.second.part, weld.angle)
        for slide in mechanism.slides:
            _pass_on(known, slide.guide.part, slide.rod.part, 0.0)
        for body in dict.fromkeys(part.body for part in mechanism.parts):
            chain = mechanism.parts_of(body)
            for first, second in pairwise(chain):
                _pass_on(known, first, second, 0.0)
        if len(known) == before:
            break
    return known


def _pass_on(known: dict[int, float], first: int, second: int, angle: float) -> None:
    """Give one of two parts its angle if that of the other is known."""
    of_first = 0.0 if first == GROUND else known.get(first)
    of_second = 0.0 if second == GROUND else known.get(second)
    if of_first is None and of_second is not None:
        known[first] = of_second - angle
    elif of_second is None and of_first is not None:
        known[second] = of_first + angle


def _attach(q: FloatArray, placed: set[int], first: Anchor, second: Anchor) -> bool:
    """Move the one of two anchored parts that is not placed yet onto the other."""
    if (first.part in placed) == (second.part in placed):
        return False
    fixed, loose = (first, second) if first.part in placed else (second, first)
    q[loose.part, :2] += anchor_position(fixed, q) - anchor_position(loose, q)
    placed.add(loose.part)
    return True


def _attach_slides(
    mechanism: Mechanism, q: FloatArray, placed: set[int], slides: list[tuple[Anchor, Anchor]]
) -> bool:
    """Put a rod into its guide; if it also runs in a slot, where the guide points to the curve."""
    for guide, rod in slides:
        if not _attach(q, placed, guide, rod):
            continue
        if guide.part == GROUND or rod.part not in placed:
            return True
        angle = q[guide.part, 2]
        along = np.array([np.cos(angle), np.sin(angle)])
        for slot in mechanism.slots:
            if slot.anchor == rod:
                ahead = _nearest_ahead(slot, anchor_position(guide, q), along)
                q[rod.part, :2] += along * ahead
        return True
    return False


def _nearest_ahead(slot: Slot, origin: FloatArray, along: FloatArray) -> float:
    """Distance from the origin to the slot's first lap in a direction; the nearest ahead, or 0."""
    crossings = ray_crossings(slot.curve, origin, along)
    distances = (slot.curve.point(crossings) - origin) @ along
    first_lap = crossings <= _end_of_first_lap(slot)
    ahead = distances[(distances >= -CLOSED) & first_lap]
    return float(ahead.min()) if len(ahead) else 0.0


def _end_of_first_lap(slot: Slot) -> float:
    laps = getattr(slot.curve, "lap_breaks", None)
    return float(slot.curve.end if laps is None else laps[1])


def _attach_slot(q: FloatArray, placed: set[int], slot: Slot) -> bool:
    """Put a part that nothing else holds at the start of its curve."""
    if slot.anchor.part in placed:
        return False
    start = slot.curve.point(slot.curve.start)
    q[slot.anchor.part, :2] += start - anchor_position(slot.anchor, q)
    placed.add(slot.anchor.part)
    return True


def _close(mechanism: Mechanism, q: FloatArray, held: set[int]) -> tuple[FloatArray, FloatArray]:
    """Gauss-Newton steps of least length until every joint is closed."""
    places = np.array([_first_place(slot, q) for slot in mechanism.slots])
    free = np.ones(q.size, dtype=bool)
    free[[3 * part + 2 for part in held]] = False
    rows: list[Rows] = []
    for _ in range(ITERATIONS):
        rows = list(constraint_rows(mechanism, q, places))
        residual, jacobian = stack(rows, len(q))
        if not len(residual) or np.abs(residual).max() < 1e-14:
            break
        scale = _scales(mechanism)[free]
        step = np.linalg.lstsq(jacobian[:, free] * scale, -residual, rcond=1e-12)[0] * scale
        # Far from closed a full step may overshoot: no part turns more than half a radian at once.
        turn = np.abs(step[np.flatnonzero(free) % 3 == 2]).max(initial=0.0)
        q = q.copy()
        q.ravel()[free] += step * min(1.0, 0.5 / max(turn, 1e-300))
        places = np.array(
            [
                slot.curve.nearest(anchor_position(slot.anchor, q), near=place)
                for slot, place in zip(mechanism.slots, places, strict=True)
            ]
        )
        if np.abs(step).max(initial=0.0) < 1e-15:
            break
    worst = max(rows, key=lambda row: float(np.abs(row.residual).max()), default=None)
    if worst is not None and np.abs(worst.residual).max() > CLOSED:
        raise CannotAssembleError(worst.name, worst.kind, float(np.linalg.norm(worst.residual)))
    return q, places


def _first_place(slot: Slot, q: FloatArray) -> float:
    """Place next to the anchor in the first lap of the curve."""
    point = anchor_position(slot.anchor, q)
    place = float(slot.curve.nearest(point))
    end = _end_of_first_lap(slot)
    if place < end:
        return place
    # Laps share their meeting point, and often more: the same point in the first lap is meant.
    grid = slot.curve.grid()
    grid = grid[grid <= end]
    away = np.linalg.norm(slot.curve.point(grid) - point, axis=1)
    return float(slot.curve.nearest(point, near=float(grid[np.argmin(away)])))


def _scales(mechanism: Mechanism) -> FloatArray:
    """Lengths for positions and 1 for angles, so that a least step weighs both alike."""
    return np.array([(p.reach, p.reach, 1.0) for p in mechanism.parts]).ravel()


def _rank(mechanism: Mechanism, jacobian: FloatArray) -> int:
    """Number of independent constraints, counted on rows of length 1 by scaled coordinates."""
    if not len(jacobian):
        return 0
    scaled = jacobian * _scales(mechanism)
    rows = scaled / np.linalg.norm(scaled, axis=1, keepdims=True)
    return int(np.linalg.matrix_rank(rows, tol=1e-9))


# --- velocities -----------------------------------------------------------------------------


def _velocities(
    mechanism: Mechanism, q: FloatArray, places: FloatArray, start: Start
) -> FloatArray:
    """Velocities of least size that satisfy joints, motors and the speeds given.

    A flexible body moves as if it were rigid.
    """
    count = len(q)
    jacobian = constraint_jacobian(mechanism, q, places)
    right = np.zeros(len(jacobian))
    motors = [motor.ramp.at(0.0) for motor in mechanism.speed_motors]
    if motors:
        right[-len(motors) :] = motors
    joints = constraint_rows(mechanism, q, places)
    names = [(row.name, row.kind) for row in joints for _ in row.residual]
    names += [(motor.name, "drive") for motor in mechanism.speed_motors]
    rigid, spread = _rigid_bodies(mechanism, q, jacobian)
    extra = np.zeros((len(start.speeds), 3 * count))
    for row, part in enumerate(start.speeds):
        extra[row, 3 * part + 2] = 1.0
    rows = np.vstack([rigid, extra @ spread])
    wanted = np.concatenate([right, list(start.speeds.values())])
    least = np.linalg.lstsq(rows, wanted, rcond=1e-11)[0]
    v = spread @ least
    violated = np.abs(rows @ least - wanted)
    worst = int(np.argmax(violated)) if len(violated) else 0
    if len(violated) and violated[worst] > 1e-9 * max(1.0, float(np.abs(wanted).max())):
        name, kind = names[worst] if worst < len(names) else ("initial.speeds", "speed")
        raise CannotMoveError(name, kind, float(violated[worst]))
    return np.asarray(v.reshape(count, 3))


def _rigid_bodies(
    mechanism: Mechanism, q: FloatArray, jacobian: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Jacobian by the velocities of whole bodies, and the matrix that spreads them to parts."""
    bodies = list(dict.fromkeys(part.body for part in mechanism.parts))
    spread = np.zeros((3 * len(q), 3 * len(bodies)))
    for i, part in enumerate(mechanism.parts):
        body = bodies.index(part.body)
        first = mechanism.parts_of(part.body)[0]
        arm = q[i, :2] - q[first, :2]
        block = np.eye(3)
        block[0, 2], block[1, 2] = -arm[1], arm[0]
        spread[3 * i : 3 * i + 3, 3 * body : 3 * body + 3] = block
    return jacobian @ spread, spread
