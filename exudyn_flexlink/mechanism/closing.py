"""Where the parts stand at time 0: laid out joint by joint, then closed by Gauss-Newton steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from heapq import heapify, heappop, heappush
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.curves import ray_crossings
from exudyn_flexlink.mechanism.channels import node_anchor
from exudyn_flexlink.mechanism.constraints import Constraints, constraint_rows
from exudyn_flexlink.mechanism.kinematics import anchor_position, angle_of, slot_point
from exudyn_flexlink.mechanism.least_motion import Demand, LeastMotion
from exudyn_flexlink.mechanism.model import (
    GROUND,
    Anchor,
    Mechanism,
    Motor,
    Pin,
    Slide,
    Slot,
    TorqueMotor,
)
from exudyn_flexlink.mechanism.spanning import spanning_tree, within_body

FloatArray = NDArray[np.float64]

CLOSED = 1e-10  # m or rad: residual of a joint that counts as closed
ITERATIONS = 60
AWAY = 0.01  # of the reach, or rad: far enough from a dead centre to tell it from others
KICKS = (0.5, -0.5, 1.2, -1.2)  # rad, other starts of the search


@dataclass(frozen=True)
class Start:
    """What the scene says of time 0, by part: held and guessed angles, held speeds.

    `velocities` (m/s) and `positions` (m) are those of the origins of parts.
    """

    angles: Mapping[int, float]
    guesses: Mapping[int, float]
    speeds: Mapping[int, float]
    velocities: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    positions: Mapping[int, tuple[float, float]] = field(default_factory=dict)


class CannotAssembleError(ValueError):
    """The joints can't all close: `joint` is the one that stays open most.

    Its `kind` is "position" where they close, but not with this body at the place it is given.
    `gap` (m) and `turn` (rad) are what is missing in all joints together. A loop opens at the
    joint that closes it, once the others have put its parts one to another.
    """

    def __init__(self, joint: str, kind: str, gap: float, turn: float) -> None:
        super().__init__(f"joint '{joint}' stays open; {gap:.3g} m and {turn:.3g} rad are missing")
        self.joint = joint
        self.kind = kind
        self.gap = gap
        self.turn = turn


def positions(
    mechanism: Mechanism, start: Start, laid_out_by: Sequence[Pin] = ()
) -> tuple[FloatArray, FloatArray]:
    """Coordinates and slot places that close all joints: bodies straight, or else bent.

    Each is searched from the start given and, since parts in one line are a dead end of the search,
    from a few where those parts are turned whose angle nothing tells. Parts are laid out by more
    pins than need close, if there are any in `laid_out_by`.
    """
    held = _held(mechanism, start)
    flexible = len(mechanism.bodies) < len(mechanism.parts)
    errors: list[CannotAssembleError] = []
    for straight in (True, False) if flexible else (True,):
        for turned in (0.0, *KICKS):
            q = _place(mechanism, _kicked(mechanism, start, turned, straight), laid_out_by)
            try:
                return _close(mechanism, q, held, straight)
            except CannotAssembleError as error:
                errors.append(error)
    least = min(errors, key=lambda error: error.gap)
    for part in start.positions:
        others = {k: place for k, place in start.positions.items() if k != part}
        if _closes(mechanism, replace(start, positions=others)):
            body = mechanism.parts[part].body
            raise CannotAssembleError(body, "position", least.gap, least.turn)
    raise least


def _closes(mechanism: Mechanism, start: Start) -> bool:
    try:
        positions(mechanism, start)
    except CannotAssembleError:
        return False
    return True


def straight_positions(mechanism: Mechanism, start: Start) -> tuple[FloatArray, FloatArray]:
    """As `positions`, from the start given alone and with bodies straight.

    Raises:
        CannotAssembleError: this search closes no joints.

    """
    return _close(mechanism, _place(mechanism, start), _held(mechanism, start), straight=True)


def neighbouring(mechanism: Mechanism, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Coordinates and slot places that close all joints, a hundredth of its reach off every part.

    Raises:
        CannotAssembleError: there are none so near.

    """
    away = np.random.default_rng(0).uniform(-AWAY, AWAY, q.shape)
    scales = np.array([(part.reach, part.reach, 1.0) for part in mechanism.parts])
    return _close(mechanism, q + away * scales, _Held(), straight=False)


@dataclass(frozen=True)
class _Held:
    """Parts whose angle stays while the joints close, and places (m) at which parts are held."""

    turns: Set[int] = frozenset()
    places: Mapping[int, tuple[float, float]] = field(default_factory=dict)

    def of(self, mechanism: Mechanism, q: FloatArray, slot_places: FloatArray) -> Constraints:
        """Rows of all joints, of drives that prescribe an angle, and of what holds the places."""
        motions = tuple(motor for motor in mechanism.speed_motors if motor.start is not None)
        starts = np.array([motor.start for motor in motions], dtype=float)
        joints = constraint_rows(replace(mechanism, speed_motors=motions), q, slot_places, starts)
        rows = [(part, axis) for part in self.places for axis in (0, 1)]
        return joints.with_fixed(rows, [q[i, axis] - self.places[i][axis] for i, axis in rows])


def _kicked(mechanism: Mechanism, start: Start, turned: float, straight: bool) -> Start:
    """Guess the angles that nothing tells: in turn to either side; bent links as a half wave."""
    if turned == 0:
        return start
    known = _known_angles(mechanism, start)
    guesses = dict(start.guesses)
    for i, chain in enumerate(mechanism.bodies.values()):
        waves = np.cos(np.linspace(0, np.pi, len(chain))) if not straight else np.ones(len(chain))
        if len(chain) > 1 and not straight:
            base = known.get(chain[0], 0.0)
            guesses |= {k: base + turned * w for k, w in zip(chain, waves, strict=True)}
        elif chain[0] not in known:
            guesses |= dict.fromkeys(chain, turned * (-1) ** i)
    return replace(start, guesses={k: x for k, x in guesses.items() if k not in start.angles})


def _held(mechanism: Mechanism, start: Start) -> _Held:
    """Parts whose angle stays: given ones, and those that a motor drives from the ground."""
    held = set(start.angles)
    driven: tuple[Motor | TorqueMotor, ...] = (*mechanism.speed_motors, *mechanism.torque_motors)
    for motor in driven:
        ends = {motor.first, motor.second} - {GROUND}
        if len(ends) == 1 and not ends & set(start.guesses):
            held |= ends
    return _Held(held, start.positions)


def _place(mechanism: Mechanism, start: Start, more: Sequence[Pin] = ()) -> FloatArray:
    """Lay the parts out joint by joint from the ground, as a start for closing the loops."""
    q = np.zeros((len(mechanism.parts), 3))
    turned = _known_angles(mechanism, start)
    q[:, 2] = [turned.get(i, 0.0) for i in range(len(q))]
    placed = {GROUND, *start.positions}
    for part, place in start.positions.items():
        q[part, :2] = place
    joints = (*_inner(mechanism), *mechanism.attachments, *more)
    pinned = _Loose([(joint.first, joint.second) for joint in joints])
    in_channels = (Slide(c.name, c.guide, node_anchor(c, 0)) for c in mechanism.channels)
    slides = [*mechanism.slides, *in_channels]
    while True:
        # Loose ends are pinned first: a slide or a slot leaves a freedom that a pin would fix.
        pinned.attach(q, placed)
        if _attach_slides(mechanism, q, placed, slides):
            continue
        if any(_attach_slot(q, placed, slot) for slot in mechanism.slots):
            continue
        return q


class _Loose:
    """Pairs of anchors of which one part may have its place already: the other is put to it.

    Always the first such pair is next; the work grows with their number, not with its square.
    """

    def __init__(self, pairs: Sequence[tuple[Anchor, Anchor]]) -> None:
        self._pairs = pairs
        self._of_part: dict[int, list[int]] = {}
        for i, (first, second) in enumerate(pairs):
            for part in (first.part, second.part):
                self._of_part.setdefault(part, []).append(i)
        self._seen: set[int] = set()  # parts whose pairs are in the queue, or were

    def attach(self, q: FloatArray, placed: set[int]) -> None:
        """Place every part that pairs lead to from those in `placed`, and add it to them."""
        queue = self._next(placed - self._seen)
        heapify(queue)
        while queue:
            first, second = self._pairs[heappop(queue)]
            if _attach(q, placed, first, second):
                for i in self._next({first.part, second.part} - self._seen):
                    heappush(queue, i)

    def _next(self, parts: set[int]) -> list[int]:
        self._seen |= parts
        return [i for part in parts for i in self._of_part.get(part, ())]


def _known_angles(mechanism: Mechanism, start: Start) -> dict[int, float]:
    """Angles of all parts that are given, passed on by slides and welds, and along a link."""
    known = {**start.guesses, **start.angles}
    _pass_on_all(mechanism, known)
    driven: tuple[Motor | TorqueMotor, ...] = (*mechanism.speed_motors, *mechanism.torque_motors)
    for motor in driven:
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
            _pass_on(known, slide.first.part, slide.second.part, slide.angle)
        for motor in mechanism.speed_motors:
            if motor.start is not None:
                _pass_on(known, motor.first, motor.second, motor.start)
        for chain in mechanism.bodies.values():
            for first, second in (*pairwise(chain), *pairwise(chain[::-1])):
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
    mechanism: Mechanism, q: FloatArray, placed: set[int], slides: Sequence[Slide]
) -> bool:
    """Put a rod into its guide; if it also runs in a slot, where the guide points to the curve."""
    for slide in slides:
        first, second = slide.first, slide.second
        led = second.part in placed  # then it stays where it is
        if not _attach(q, placed, first, second):
            continue
        angle = angle_of(first.part, q) + slide.direction
        along = np.array([np.cos(angle), np.sin(angle)])
        for slot in mechanism.slots:
            if slot.anchor == second and slot.carrier == GROUND and not led:
                ahead = _nearest_ahead(slot, anchor_position(first, q), along)
                q[second.part, :2] += along * ahead
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
    """Put a part that nothing else holds at the start of its curve, or the curve's part there."""
    start = Anchor(slot.carrier, *slot.curve.point(slot.curve.start).tolist())
    return _attach(q, placed, start, slot.anchor)


def _close(
    mechanism: Mechanism, q: FloatArray, held: _Held, straight: bool
) -> tuple[FloatArray, FloatArray]:
    """Gauss-Newton steps of least length until every joint is closed.

    With `straight` the parts of a body move as one.
    """
    q = _straightened(mechanism, q) if straight else q
    places = np.array([_first_place(slot, q) for slot in mechanism.slots])
    tree = spanning_tree(mechanism)
    joints = held.of(mechanism, q, places)
    for _ in range(ITERATIONS):
        if np.abs(joints.residual).max(initial=0.0) < 1e-14:
            break
        roots = _whole_roots(mechanism, q) if straight else scale_roots(mechanism)
        demand = Demand(-joints.residual, dict.fromkeys(held.turns, 0.0), straight)
        step = _shortened(LeastMotion(mechanism, joints, tree, roots, demand).nearest())
        q = q + step
        q = _straightened(mechanism, q) if straight else q
        places = np.array(
            [
                slot.curve.nearest(slot_point(slot, q), near=place)
                for slot, place in zip(mechanism.slots, places, strict=True)
            ]
        )
        joints = held.of(mechanism, q, places)
        if np.abs(step).max(initial=0.0) < 1e-15:
            break
    _refuse_open(joints)
    _refuse_moved(mechanism, held, q)
    return q, np.array(
        [_in_first_lap(s, q, p) for s, p in zip(mechanism.slots, places, strict=True)]
    )


def _shortened(step: FloatArray) -> FloatArray:
    """Far from closed a full step may overshoot: no part turns more than half a radian at once."""
    return step * min(1.0, 0.5 / max(float(np.abs(step[:, 2]).max()), 1e-300))


def _straightened(mechanism: Mechanism, q: FloatArray) -> FloatArray:
    """Lay the parts of each flexible body end to end along its first, hinges closed."""
    q = q.copy()
    for joint in sorted(_inner(mechanism), key=lambda joint: joint.second.part):
        second = joint.second.part
        q[second, 2] = q[joint.first.part, 2]
        q[second, :2] += anchor_position(joint.first, q) - anchor_position(joint.second, q)
    return q


def _inner(mechanism: Mechanism) -> list[Pin | Slide]:
    """Hinges of flexible bodies, and what lets their rods stretch."""
    joints: tuple[Pin | Slide, ...] = (*mechanism.pins, *mechanism.slides)
    return [j for j in joints if within_body(mechanism, j.first.part, j.second.part)]


def _refuse_open(joints: Constraints) -> None:
    if np.abs(joints.residual[: joints.first_rows[-1]]).max(initial=0.0) <= CLOSED:
        return
    rows = list(joints)
    worst = max(rows, key=lambda row: float(np.abs(row.residual).max()))
    gap = sum(float(np.linalg.norm(row.lengths)) for row in rows)
    turn = sum(float(np.abs(row.angles).sum()) for row in rows)
    raise CannotAssembleError(worst.name, worst.kind, gap, turn)


def _refuse_moved(mechanism: Mechanism, held: _Held, q: FloatArray) -> None:
    for part, place in held.places.items():
        away = float(np.hypot(*(q[part, :2] - place)))
        if away > CLOSED:
            raise CannotAssembleError(mechanism.parts[part].body, "position", away, 0.0)


def _in_first_lap(slot: Slot, q: FloatArray, place: float) -> float:
    """Return the place, or that of the same point in the first lap."""
    return place if slot.curve.start <= place < _end_of_first_lap(slot) else _first_place(slot, q)


def _first_place(slot: Slot, q: FloatArray) -> float:
    """Place next to the anchor in the first lap of the curve.

    Laps share their meeting point, and often more: there the same point in the first lap is meant.
    """
    point = slot_point(slot, q)
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


def scale_roots(mechanism: Mechanism) -> FloatArray:
    """Metric, see `LeastMotion`, that weighs the reach of each part and a radian alike."""
    scales = np.array([(1 / part.reach, 1 / part.reach, 1.0) for part in mechanism.parts])
    return scales[:, :, None] * np.eye(3)


def _whole_roots(mechanism: Mechanism, q: FloatArray) -> FloatArray:
    """As `scale_roots` for bodies that move as one: the first part of each counts for all of it."""
    roots = np.zeros((len(q), 3, 3))
    for parts in mechanism.bodies.values():
        first = parts[0]
        reaches = np.array([mechanism.parts[i].reach for i in parts])
        arms = np.hypot(*(q[list(parts), :2] - q[first, :2]).T) / reaches
        along, turning = np.sqrt(np.sum(reaches**-2.0)), np.sqrt(np.sum(arms**2 + 1.0))
        roots[first] = np.diag([along, along, turning])
    return roots
