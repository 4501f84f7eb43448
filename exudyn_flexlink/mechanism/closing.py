"""Where the parts stand at time 0: laid out joint by joint, then closed by Gauss-Newton steps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.curves import ray_crossings
from exudyn_flexlink.mechanism.channels import node_anchor
from exudyn_flexlink.mechanism.kinematics import (
    Rows,
    anchor_position,
    constraint_rows,
    stack,
)
from exudyn_flexlink.mechanism.model import GROUND, Anchor, Mechanism, Slot

FloatArray = NDArray[np.float64]

CLOSED = 1e-10  # m or rad: residual of a joint that counts as closed
ITERATIONS = 60
KICKS = (0.5, -0.5, 1.2, -1.2)  # rad, other starts of the search


@dataclass(frozen=True)
class Start:
    """What the scene says of time 0, by part: held and guessed angles, held speeds.

    `velocities` are those of the origins of parts.
    """

    angles: Mapping[int, float]
    guesses: Mapping[int, float]
    speeds: Mapping[int, float]
    velocities: Mapping[int, tuple[float, float]] = field(default_factory=dict)


class CannotAssembleError(ValueError):
    """The joints can't all close: `joint` is the one that stays open most.

    `gap` (m) and `turn` (rad) are what is missing in all joints together: least squares spreads
    the opening of a loop over all of its joints.
    """

    def __init__(self, joint: str, kind: str, gap: float, turn: float) -> None:
        super().__init__(f"joint '{joint}' stays open; {gap:.3g} m and {turn:.3g} rad are missing")
        self.joint = joint
        self.kind = kind
        self.gap = gap
        self.turn = turn


def positions(mechanism: Mechanism, start: Start) -> tuple[FloatArray, FloatArray]:
    """Coordinates and slot places that close all joints: bodies straight, or else bent.

    Each is searched from the start given and, since parts in one line are a dead end of the search,
    from a few where those parts are turned whose angle nothing tells.
    """
    held = _held_angles(mechanism, start)
    flexible = len({part.body for part in mechanism.parts}) < len(mechanism.parts)
    errors: list[CannotAssembleError] = []
    for straight in (True, False) if flexible else (True,):
        for turned in (0.0, *KICKS):
            q = _place(mechanism, _kicked(mechanism, start, turned, straight))
            try:
                return _close(mechanism, q, held, straight)
            except CannotAssembleError as error:
                errors.append(error)
    raise min(errors, key=lambda error: error.gap)


def _kicked(mechanism: Mechanism, start: Start, turned: float, straight: bool) -> Start:
    """Guess the angles that nothing tells: in turn to either side; bent links as a half wave."""
    if turned == 0:
        return start
    known = _known_angles(mechanism, start)
    guesses = dict(start.guesses)
    for i, body in enumerate(dict.fromkeys(part.body for part in mechanism.parts)):
        chain = mechanism.parts_of(body)
        waves = np.cos(np.linspace(0, np.pi, len(chain))) if not straight else np.ones(len(chain))
        if len(chain) > 1 and not straight:
            base = known.get(chain[0], 0.0)
            guesses |= {k: base + turned * w for k, w in zip(chain, waves, strict=True)}
        elif chain[0] not in known:
            guesses |= dict.fromkeys(chain, turned * (-1) ** i)
    return replace(start, guesses={k: x for k, x in guesses.items() if k not in start.angles})


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
    slides += [(channel.guide, node_anchor(channel, 0)) for channel in mechanism.channels]
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
    _pass_on_all(mechanism, known)
    for motor in (*mechanism.speed_motors, *mechanism.torque_motors):
        for part in (motor.first, motor.second):
            if part != GROUND:
                known.setdefault(part, 0.0)
    _pass_on_all(mechanism, known)
    return known


def _pass_on_all(mechanism: Mechanism, known: dict[int, float]) -> None:
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
            return


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


def _close(
    mechanism: Mechanism, q: FloatArray, held: set[int], straight: bool
) -> tuple[FloatArray, FloatArray]:
    """Gauss-Newton steps of least length until every joint is closed.

    With `straight` the parts of a body move as one; `held` are parts that do not turn.
    """
    q = _straightened(mechanism, q) if straight else q
    places = np.array([_first_place(slot, q) for slot in mechanism.slots])
    rows: list[Rows] = []
    for _ in range(ITERATIONS):
        rows = list(constraint_rows(mechanism, q, places))
        if max((np.abs(row.residual).max() for row in rows), default=0.0) < 1e-14:
            break
        step = _step(mechanism, q, rows, held, straight)
        q = q + step
        q = _straightened(mechanism, q) if straight else q
        places = np.array(
            [
                slot.curve.nearest(anchor_position(slot.anchor, q), near=place)
                for slot, place in zip(mechanism.slots, places, strict=True)
            ]
        )
        if np.abs(step).max(initial=0.0) < 1e-15:
            break
    _refuse_open(rows)
    return q, np.array(
        [_in_first_lap(s, q, p) for s, p in zip(mechanism.slots, places, strict=True)]
    )


def _step(
    mechanism: Mechanism, q: FloatArray, rows: list[Rows], held: set[int], straight: bool
) -> FloatArray:
    """Least change of coordinates that closes the linearised joints, (parts, 3)."""
    residual, jacobian = stack(rows, len(q))
    free = spread(mechanism, q) if straight else np.eye(q.size)
    free = free * (np.abs(free[[3 * part + 2 for part in held]]).sum(axis=0) == 0)
    scale = scales(mechanism)
    weight = np.sqrt(np.sum((free / scale[:, None]) ** 2, axis=0))
    by = free / np.where(weight > 0, weight, 1.0)
    step = (by @ np.linalg.lstsq(jacobian @ by, -residual, rcond=1e-12)[0]).reshape(q.shape)
    # Far from closed a full step may overshoot: no part turns more than half a radian at once.
    return np.asarray(step * min(1.0, 0.5 / max(np.abs(step[:, 2]).max(), 1e-300)))


def _straightened(mechanism: Mechanism, q: FloatArray) -> FloatArray:
    """Lay the parts of each flexible body end to end along its first, hinges closed."""
    q = q.copy()
    for pin in mechanism.pins:
        first, second = pin.first.part, pin.second.part
        if GROUND in (first, second):
            continue
        if mechanism.parts[first].body == mechanism.parts[second].body:
            q[second, 2] = q[first, 2]
            q[second, :2] += anchor_position(pin.first, q) - anchor_position(pin.second, q)
    return q


def _refuse_open(rows: list[Rows]) -> None:
    worst = max(rows, key=lambda row: float(np.abs(row.residual).max()), default=None)
    if worst is not None and np.abs(worst.residual).max() > CLOSED:
        gap = sum(float(np.linalg.norm(row.lengths)) for row in rows)
        turn = sum(float(np.abs(row.angles).sum()) for row in rows)
        raise CannotAssembleError(worst.name, worst.kind, gap, turn)


def _in_first_lap(slot: Slot, q: FloatArray, place: float) -> float:
    """Return the place, or that of the same point in the first lap."""
    return place if slot.curve.start <= place < _end_of_first_lap(slot) else _first_place(slot, q)


def _first_place(slot: Slot, q: FloatArray) -> float:
    """Place next to the anchor in the first lap of the curve.

    Laps share their meeting point, and often more: there the same point in the first lap is meant.
    """
    point = anchor_position(slot.anchor, q)
    start, end = slot.curve.start, _end_of_first_lap(slot)
    place = float(slot.curve.nearest(point))
    if place >= end:
        grid = slot.curve.grid()
        grid = grid[grid <= end]
        away = np.linalg.norm(slot.curve.point(grid) - point, axis=1)
        place = float(slot.curve.nearest(point, near=float(grid[np.argmin(away)])))
    if abs(place - start) < CLOSED:
        return start
    return place if place > start else float(slot.curve.nearest(point, near=end))


def scales(mechanism: Mechanism) -> FloatArray:
    """Lengths for positions and 1 for angles, so that a least step weighs both alike."""
    return np.array([(p.reach, p.reach, 1.0) for p in mechanism.parts]).ravel()


def spread(mechanism: Mechanism, q: FloatArray) -> FloatArray:
    """Matrix from velocities of whole bodies, rigid, to those of parts, (3 parts, 3 bodies)."""
    bodies = list(dict.fromkeys(part.body for part in mechanism.parts))
    matrix = np.zeros((q.size, 3 * len(bodies)))
    for i, part in enumerate(mechanism.parts):
        body = bodies.index(part.body)
        first = mechanism.parts_of(part.body)[0]
        arm = q[i, :2] - q[first, :2]
        block = np.eye(3)
        block[0, 2], block[1, 2] = -arm[1], arm[0]
        matrix[3 * i : 3 * i + 3, 3 * body : 3 * body + 3] = block
    return matrix
