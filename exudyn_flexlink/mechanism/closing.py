"""Poses of parts at time 0, and the speeds that joints, drives and the scene leave open.

Parts are laid out joint by joint from the ground; then Gauss-Newton steps close the joints.

Bodies turn as little as the joints allow: the sum of the squares of their angular speeds is least.
This leaves free bodies and slides undetermined. For these, the points by which bodies hang on
others move as little as possible. The result depends neither on the origins of bodies nor on units.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.curves import ends_of_lap, ray_crossings
from exudyn_flexlink.mechanism.constraints import (
    Constraints,
    along_slides,
    anchor_position,
    angle_of,
    constraint_rows,
    length_along,
    places_near,
    slot_point,
)
from exudyn_flexlink.mechanism.joints import GROUND, NO_ITEM, Anchor, Pin, Slide, Slot, Weld
from exudyn_flexlink.mechanism.least_motion import (
    LeastMotion,
    scale_roots,
    spanning_tree,
    whole_roots,
    within_body,
)
from exudyn_flexlink.mechanism.model import Mechanism
from exudyn_flexlink.raising import Sendable
from exudyn_flexlink.rounding import ROUNDING, TINY


@dataclass(frozen=True)
class Start:
    """What the scene gives for time 0, by part: held and guessed angles, held speeds.

    `velocities` (m/s) and `positions` (m) are those of the origins of parts. `along` (m) are
    strokes of slides, by name; `speeds_along` (m/s) are their rates, or speeds of anchors along the
    curves of slots. `states` (parts, 6) are coordinates and velocities of all parts and replace all
    others. `laps` are those of slots, 1 by default.
    """

    angles: Mapping[int, float]
    guesses: Mapping[int, float]
    speeds: Mapping[int, float]
    velocities: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    positions: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    along: Mapping[str, float] = field(default_factory=dict)
    speeds_along: Mapping[str, float] = field(default_factory=dict)
    states: FloatArray | None = None
    laps: Mapping[str, int] = field(default_factory=dict)


def lay_out(mechanism: Mechanism, start: Start, more: Sequence[Pin | Slot] = ()) -> FloatArray:
    """Lay the parts out joint by joint from the ground, as a start for closing the loops."""
    slots = tuple(joint for joint in more if isinstance(joint, Slot))
    mechanism = replace(mechanism, slots=mechanism.slots + slots)
    q = np.zeros((len(mechanism.parts), 3))
    turned = known_angles(mechanism, start)
    q[:, 2] = [turned.get(i, 0.0) for i in range(len(q))]
    placed = {GROUND, *start.positions}
    for part, place in start.positions.items():
        q[part, :2] = place
    pins = (joint for joint in more if isinstance(joint, Pin))
    joints = (*inner_joints(mechanism), *mechanism.attachments, *pins)
    pinned = [(joint.first, joint.second) for joint in joints]
    slides, lengths = slides_of(mechanism), known_lengths(mechanism, start)
    while True:
        # Pins come first: a slide or a slot leaves a freedom that a pin would remove.
        _attach_all(q, placed, pinned)
        if _attach_slides(mechanism, q, placed, slides, lengths):
            continue
        if any(_attach_slot(q, placed, slot) for slot in mechanism.slots):
            continue
        return q


def slides_of(mechanism: Mechanism) -> list[Slide]:
    """Prismatic joints and sleeves; clearance is left out."""
    in_channels = (Slide(c.name, c.guide, c.nodes[0]) for c in mechanism.channels)
    return [*mechanism.slides, *in_channels]


def slides_named(mechanism: Mechanism, names: Iterable[str]) -> list[Slide]:
    """The slides with these names, in the order of the names."""
    known = {slide.name: slide for slide in slides_of(mechanism)}
    return [known[name] for name in names]


def known_lengths(mechanism: Mechanism, start: Start) -> dict[str, float]:
    """Strokes of slides at time 0, m, by name, if they are given or driven."""
    motors = mechanism.speed_motors
    driven = {m.slide.name: m.start for m in motors if m.slide and m.start is not None}
    return {**driven, **start.along}


def _attach_all(q: FloatArray, placed: set[int], pairs: Sequence[tuple[Anchor, Anchor]]) -> None:
    """Place every part that pairs of anchors connect to placed parts; earlier pairs come first."""
    left = list(pairs)
    while True:
        attached = next((pair for pair in left if _attach(q, placed, *pair)), None)
        if attached is None:
            return
        left.remove(attached)


def known_angles(mechanism: Mechanism, start: Start) -> dict[int, float]:
    """Angles of parts that follow from given ones by slides, welds and flexible bodies."""
    held: tuple[Weld | Slide, ...] = (*mechanism.welds, *mechanism.slides)
    ties = [(joint.first.part, joint.second.part, joint.angle) for joint in held]
    motors = (motor for motor in mechanism.speed_motors if not motor.slide)
    ties += [
        (motor.first, motor.second, motor.start) for motor in motors if motor.start is not None
    ]
    ties += [(*pair, 0.0) for chain in mechanism.bodies.values() for pair in pairwise(chain)]
    known = {**start.guesses, **start.angles, GROUND: 0.0}
    _pass_on(ties, known)
    known = {**{part: 0.0 for ends in mechanism.turned_by_drives for part in ends}, **known}
    _pass_on(ties, known)
    del known[GROUND]
    return known


def _pass_on(ties: Sequence[tuple[int, int, float]], known: dict[int, float]) -> None:
    """Pass angles on from part to part; a tie is two parts and the angle from first to second."""
    before = 0
    while len(known) > before:
        before = len(known)
        for first, second, angle in ties:
            if first in known:
                known.setdefault(second, known[first] + angle)
            elif second in known:
                known[first] = known[second] - angle


def _attach(q: FloatArray, placed: set[int], first: Anchor, second: Anchor) -> bool:
    """Move that of two anchored parts which is not yet placed onto the other."""
    if (first.part in placed) == (second.part in placed):
        return False
    fixed, loose = (first, second) if first.part in placed else (second, first)
    q[loose.part, :2] += anchor_position(fixed, q) - anchor_position(loose, q)
    placed.add(loose.part)
    return True


def _attach_slides(
    mechanism: Mechanism,
    q: FloatArray,
    placed: set[int],
    slides: Sequence[Slide],
    lengths: Mapping[str, float],
) -> bool:
    """Put a part into its guide, at its known stroke (m), else on the slot in its direction."""
    for slide in slides:
        first, second = slide.first, slide.second
        led = second.part in placed  # then the second part stays
        if not _attach(q, placed, first, second):
            continue
        angle = angle_of(first.part, q) + slide.direction
        along = np.array([np.cos(angle), np.sin(angle)])
        if slide.name in lengths:
            moved, way = (first.part, -1.0) if led else (second.part, 1.0)
            q[moved, :2] += way * lengths[slide.name] * along
            return True
        for slot in mechanism.slots:
            if slot.anchor == second and slot.carrier == GROUND and not led:
                ahead = _nearest_ahead(slot, anchor_position(first, q), along)
                q[second.part, :2] += along * ahead
        return True
    return False


def _nearest_ahead(slot: Slot, origin: FloatArray, along: FloatArray) -> float:
    """Distance to the nearest crossing of a ray with the slot's first lap; 0 without one."""
    crossings = ray_crossings(slot.curve, origin, along)
    distances = (slot.curve.point(crossings) - origin) @ along
    first_lap = crossings <= ends_of_lap(slot.curve, 1)[1]
    ahead = distances[(distances >= -CLOSED) & first_lap]
    return float(ahead.min()) if len(ahead) else 0.0


def _attach_slot(q: FloatArray, placed: set[int], slot: Slot) -> bool:
    """Put a part at the start of its curve, or the curve's part there if the other is placed."""
    start = Anchor(slot.carrier, *slot.curve.point(slot.curve.start).tolist())
    return _attach(q, placed, start, slot.anchor)


def inner_joints(mechanism: Mechanism) -> list[Pin | Slide]:
    """Hinges of flexible bodies, and the slides in rods that stretch."""
    joints: tuple[Pin | Slide, ...] = (*mechanism.pins, *mechanism.slides)
    return [j for j in joints if within_body(mechanism, j.first.part, j.second.part)]


CLOSED = 1e-10  # m or rad: residual of a joint that counts as closed
ITERATIONS = 60
AWAY = 0.01  # of the reach, or rad: far enough from a dead centre to distinguish other poses
KICKS = (0.5, -0.5, 1.2, -1.2)  # rad: angles of further starts of the search
TYPED = 2e-6  # of a part's reach: the rounding of 7 decimals of a metre, for a part of 5 cm
SHUFFLES = 12  # last starts, from random angles: they close six-bars that the others do not


class CannotAssembleError(Sendable, ValueError):
    """The joints can't all close: `joint` has the largest opening.

    If they close without the given position of a body, `kind` is "position"; if they close without
    the given stroke of a slide, it is "along". `gap` (m) and `turn` (rad) are the openings of all
    joints together. A loop stays open at the joint laid out last. `near` (m) is the place nearest
    to the given one that joints allow a body.
    """

    def __init__(
        self,
        joint: str,
        kind: str,
        gap: float,
        turn: float,
        near: tuple[float, float] | None = None,
    ) -> None:
        super().__init__(f"joint '{joint}' stays open; {gap:.3g} m and {turn:.3g} rad are missing")
        self.near = near
        self.joint = joint
        self.kind = kind
        self.gap = gap
        self.turn = turn


def positions(
    mechanism: Mechanism, start: Start, laid_out_by: Sequence[Pin | Slot] = ()
) -> tuple[FloatArray, FloatArray]:
    """Coordinates and slot places that close all joints: bodies straight, or else bent.

    The first search begins at the given start. Parts in one line are a dead end of it. So further
    searches turn the parts of unknown angle, in the end by random angles. The joints in
    `laid_out_by` are used to lay out parts, but need not close. A drive's part stands at 0 if the
    joints allow it; otherwise its angle is searched, too.
    """
    held = _held(mechanism, start)
    freed = replace(held, turns=set(start.angles))
    # Bodies bend but do not stretch, since stretching would need large forces at the start. The
    # parts of straight ones move as one, so nothing stretches.
    rods = [joint for joint in inner_joints(mechanism) if isinstance(joint, Slide)]
    tries = [(held, True, [_kicked(mechanism, start, x, True) for x in (0.0, *KICKS)])]
    if len(mechanism.bodies) < len(mechanism.parts):
        bent = replace(held, rods=rods)
        tries += [(bent, False, [_kicked(mechanism, start, x, False) for x in (0.0, *KICKS)])]
    tries += [(freed, True, _shuffled(mechanism, start))]
    errors: list[CannotAssembleError] = []
    for kept, straight, starts in tries:
        for tried in starts:
            q = lay_out(mechanism, tried, laid_out_by)
            try:
                return _close_on_curves(mechanism, q, kept, straight)
            except CannotAssembleError as error:
                errors.append(error)
    least = min(errors, key=lambda error: error.gap)
    blamed = _contradicting(mechanism, start)
    if blamed is None:
        raise least
    near = None
    if blamed[1] == "position":
        with suppress(CannotAssembleError):
            freely = replace(held, places={})
            closed = _close_on_curves(mechanism, lay_out(mechanism, start), freely, straight=True)
            away = {
                p: float(np.hypot(*(closed[0][p, :2] - anchor)))
                for p, anchor in held.places.items()
            }
            if all(far <= TYPED * mechanism.parts[part].reach for part, far in away.items()):
                return closed
            farthest = max(away, key=lambda part: away[part])
            near = (float(closed[0][farthest, 0]), float(closed[0][farthest, 1]))
    raise CannotAssembleError(*blamed, least.gap, least.turn, near)


def _contradicting(mechanism: Mechanism, start: Start) -> tuple[str, str] | None:
    """Name and kind of the first given or driven value without which the joints close, if any."""
    for part in start.positions:
        others = {k: place for k, place in start.positions.items() if k != part}
        if _closes(mechanism, replace(start, positions=others)):
            return mechanism.parts[part].body, "position"
    for name in start.along:
        lengths = {k: length for k, length in start.along.items() if k != name}
        if _closes(mechanism, replace(start, along=lengths)):
            return name, "along"
    motors = mechanism.speed_motors
    for i, motor in enumerate(motors):
        freed = (*motors[:i], replace(motor, start=None), *motors[i + 1 :])
        if motor.start is not None and _closes(replace(mechanism, speed_motors=freed), start):
            return motor.name, "slide drive" if motor.slide else "drive"
    return None


def _closes(mechanism: Mechanism, start: Start) -> bool:
    with suppress(CannotAssembleError):
        positions(mechanism, start)
        return True
    return False


def straight_positions(mechanism: Mechanism, start: Start) -> tuple[FloatArray, FloatArray]:
    """As `positions`, but only from the given start, with bodies straight.

    Raises:
        CannotAssembleError: this search does not close the joints.

    """
    q = lay_out(mechanism, start)
    return _close_on_curves(mechanism, q, _held(mechanism, start), straight=True)


def closest(
    mechanism: Mechanism, q: FloatArray, laps: Mapping[str, int]
) -> tuple[FloatArray, FloatArray]:
    """Coordinates and slot places that close all joints, next to those given (parts, 3).

    Angles that a motor drives from the ground stay, unless the motor prescribes them. `laps` are
    those of slots.

    Raises:
        CannotAssembleError: no solution is near.

    """
    free = tuple(motor for motor in mechanism.speed_motors if motor.start is None)
    held = _held(replace(mechanism, speed_motors=free), Start({}, {}, {}))
    return _close(mechanism, q, replace(held, laps=laps), straight=False)


def neighbouring(mechanism: Mechanism, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Coordinates and slot places that close all joints, each part moved by 1 % of its reach.

    Raises:
        CannotAssembleError: no solution is so near.

    """
    away = np.random.default_rng(0).uniform(-AWAY, AWAY, q.shape)
    scales = np.array([(part.reach, part.reach, 1.0) for part in mechanism.parts])
    return _close(mechanism, q + away * scales, _Held(), straight=False)


@dataclass(frozen=True)
class _Held:
    """Values that stay while the joints close.

    Parts in `turns` keep their `angles` (rad) from the start of the search; parts in `places` (m)
    keep their place, `slides` their `lengths` (m), and stretching `rods` their length. Slots are in
    their first lap unless `laps` has another.
    """

    turns: Set[int] = frozenset()
    places: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    slides: Sequence[Slide] = ()
    lengths: Sequence[float] = ()
    rods: Sequence[Slide] = ()
    laps: Mapping[str, int] = field(default_factory=dict)
    angles: Mapping[int, float] = field(default_factory=dict)

    def of(self, mechanism: Mechanism, q: FloatArray, slot_places: FloatArray) -> Constraints:
        """Rows of all joints, of drives that prescribe a starting pose, and of held values."""
        motions = tuple(motor for motor in mechanism.speed_motors if motor.start is not None)
        closing = replace(mechanism, speed_motors=motions, gears=())  # gears mesh at any angle
        joints = constraint_rows(closing, q, slot_places)
        given = {
            (part, axis): anchor[axis] for part, anchor in self.places.items() for axis in (0, 1)
        }
        given |= {(part, 2): angle for part, angle in self.angles.items()}
        joints = joints.with_fixed(
            list(given), [q[anchor] - place for anchor, place in given.items()]
        )
        lengths = np.append(self.lengths, np.zeros(len(self.rods)))
        return joints.with_rows(*along_slides([*self.slides, *self.rods], lengths, q))


def _kicked(mechanism: Mechanism, start: Start, turned: float, straight: bool) -> Start:
    """Guess unknown angles: in turn to either side, bent links as half a wave."""
    if turned == 0:
        return start
    known = known_angles(mechanism, start)
    guesses = dict(start.guesses)
    for i, chain in enumerate(mechanism.bodies.values()):
        if len(chain) > 1 and not straight:
            base, waves = known.get(chain[0], 0.0), np.cos(np.linspace(0, np.pi, len(chain)))
            guesses |= {k: base + turned * w for k, w in zip(chain, waves, strict=True)}
        elif chain[0] not in known:
            guesses |= dict.fromkeys(chain, turned * (-1) ** i)
    return replace(start, guesses={k: x for k, x in guesses.items() if k not in start.angles})


def _shuffled(mechanism: Mechanism, start: Start) -> list[Start]:
    """Guess angles at random that are unknown or follow from drives, if there are two or more."""
    motors = tuple(motor for motor in mechanism.speed_motors if motor.start is not None)
    known = known_angles(replace(mechanism, speed_motors=motors, torque_motors=()), start)
    loose = [chain for chain in mechanism.bodies.values() if chain[0] not in known]
    return list(shuffled(start, loose, SHUFFLES)) if len(loose) > 1 else []


def shuffled(start: Start, loose: Sequence[tuple[int, ...]], count: int) -> Iterator[Start]:
    """Guess angles of bodies (tuples of their parts) at random, `count` times."""
    random = np.random.default_rng(0)
    for _ in range(count):
        angles = random.uniform(-np.pi, np.pi, len(loose)).tolist()
        guesses = dict(start.guesses)
        for parts, angle in zip(loose, angles, strict=True):
            guesses |= dict.fromkeys(parts, angle)
        yield replace(start, guesses=guesses)


def _held(mechanism: Mechanism, start: Start) -> _Held:
    """Values that stay: given ones, and angles that a motor drives from the ground."""
    held = set(start.angles)
    for first, second in mechanism.turned_by_drives:
        ends = {first, second} - {GROUND}
        if len(ends) == 1 and not ends & set(start.guesses):
            held |= ends
    slides = slides_named(mechanism, start.along)
    return _Held(held, start.positions, slides, list(start.along.values()))


def _close_on_curves(
    mechanism: Mechanism, q: FloatArray, held: _Held, straight: bool
) -> tuple[FloatArray, FloatArray]:
    """As `_close`, but refuse points beyond an end of a curve, where their row is zero, too."""
    q, places = _close(mechanism, q, held, straight)
    for slot, place in zip(mechanism.slots, places, strict=True):
        away = float(np.hypot(*(slot_point(slot, q) - slot.curve.point(place))))
        if away > CLOSED:
            raise CannotAssembleError(slot.name, "slot", away, 0.0)
    return q, places


def _close(
    mechanism: Mechanism, q: FloatArray, held: _Held, straight: bool
) -> tuple[FloatArray, FloatArray]:
    """Gauss-Newton steps of least length until every joint is closed.

    With `straight` the parts of a body move as one.
    """
    q = _straightened(mechanism, q) if straight else q.copy()
    slots = [(slot, held.laps.get(slot.name, 1)) for slot in mechanism.slots]
    places = np.array([place_in(slot, lap, q) for slot, lap in slots])
    held = replace(held, angles={part: q[part, 2] for part in held.turns})
    joints = first = held.of(mechanism, q, places)
    for _ in range(ITERATIONS):
        if np.abs(joints.residual).max(initial=0.0) < 1e-14:
            break
        roots = whole_roots(mechanism, q) if straight else scale_roots(mechanism)
        motion = LeastMotion(mechanism, joints, roots, -joints.residual, straight)
        step = motion.nearest()
        # A full step may overshoot: no part turns by more than half a radian in a step.
        step = step * min(1.0, 0.5 / max(float(np.abs(step[:, 2]).max()), TINY))
        q = q + step
        q = _straightened(mechanism, q) if straight else q
        places = places_near(mechanism, q, places)
        joints = held.of(mechanism, q, places)
        if np.abs(step).max(initial=0.0) < 1e-15:
            break
    if any(abs(q[part, 2] - angle) > CLOSED for part, angle in held.angles.items()):
        _refuse_open(first)  # joints close only by turning parts that must stay
    _refuse_open(joints)
    _refuse_moved(mechanism, held, q)
    kept = [kept_in(*slot, q, place) for slot, place in zip(slots, places, strict=True)]
    return q, np.array(kept)


def _straightened(mechanism: Mechanism, q: FloatArray) -> FloatArray:
    """Lay the parts of each flexible body end to end along its first, hinges closed."""
    q = q.copy()
    for joint in sorted(inner_joints(mechanism), key=lambda joint: joint.second.part):
        second = joint.second.part
        q[second, 2] = q[joint.first.part, 2]
        q[second, :2] += anchor_position(joint.first, q) - anchor_position(joint.second, q)
    return q


def _refuse_open(joints: Constraints) -> None:
    if np.abs(joints.residual[: joints.first_rows[-1]]).max(initial=0.0) <= CLOSED:
        return
    gaps, turns = joints.open_by
    worst = int(np.argmax(np.maximum(gaps, turns)))
    held = joints.residual[joints.first_rows[-1] :]  # held values moved, too
    gap, turn = float(gaps.sum() + np.abs(held).sum()), float(turns.sum())
    raise CannotAssembleError(joints.names[worst], joints.kinds[worst], gap, turn)


def _refuse_moved(mechanism: Mechanism, held: _Held, q: FloatArray) -> None:
    for part, place in held.places.items():
        away = float(np.hypot(*(q[part, :2] - place)))
        if away > CLOSED:
            raise CannotAssembleError(mechanism.parts[part].body, "position", away, 0.0)
    for slide, length in zip(held.slides, held.lengths, strict=True):
        away = abs(float(length_along(slide, q)) - length)
        if away > CLOSED:
            raise CannotAssembleError(slide.name, "along", away, 0.0)


def kept_in(slot: Slot, lap: int, q: FloatArray, place: float) -> float:
    """Return the place, moved into the slot's lap; on the seam of laps the start of the lap."""
    start, end = ends_of_lap(slot.curve, lap)
    if np.hypot(*(slot_point(slot, q) - slot.curve.point(start))) <= CLOSED:
        return start
    return place if start <= place < end else place_in(slot, lap, q)


def place_in(slot: Slot, lap: int, q: FloatArray) -> float:
    """Place nearest to the anchor in a lap of the curve.

    Laps share points at their seam, and often more; the place in this lap is returned.
    """
    point = slot_point(slot, q)
    start, end = ends_of_lap(slot.curve, lap)
    place = float(slot.curve.nearest(point))
    if not start <= place < end:
        grid = slot.curve.grid()
        grid = grid[(grid >= start) & (grid <= end)]
        away = np.linalg.norm(slot.curve.point(grid) - point, axis=1)
        place = float(slot.curve.nearest(point, near=float(grid[np.argmin(away)])))
    if abs(place - start) < CLOSED:
        return start
    return place if place > start else float(slot.curve.nearest(point, near=end))


SECOND = 0.1  # rad/s: weight of 1 m/s of a point in a mechanism of 1 m
MOST_ROUNDS = 50  # each leaves about SECOND^2 of the error; more in long chains of parts


def least_speeds(
    mechanism: Mechanism,
    rows: Constraints,
    right: FloatArray,
    q: FloatArray,
    rigid: bool = False,
) -> FloatArray:
    """Least velocities (parts, 3) at `q` that satisfy rows, as far as possible.

    With `rigid` the parts of a body move as one and count once.
    """
    roots = _roots(mechanism, q, rigid)
    motion = LeastMotion(mechanism, rows, roots, right, rigid)
    # The speeds of points have a small weight, but disturb the angular speeds all the same. Rounds
    # remove this error: each is nearest to the points' speeds of the round before (the proximal
    # point algorithm).
    points = roots[:, :, :2] @ roots[:, :, :2].transpose(0, 2, 1)
    v = motion.nearest()
    for _ in range(MOST_ROUNDS):
        before, v = v, motion.nearest(np.einsum("pij,pj->pi", points, v))
        if np.abs(v - before).max(initial=0.0) <= ROUNDING * np.abs(v).max(initial=0.0):
            break
    # A small weight costs digits. The nearest speeds by an even metric are exact to rounding.
    even = scale_roots(mechanism)
    wanted = np.einsum("pij,pj->pi", even @ even.transpose(0, 2, 1), v)
    return LeastMotion(mechanism, rows, even, right, rigid).nearest(wanted)


def _roots(mechanism: Mechanism, q: FloatArray, rigid: bool) -> FloatArray:
    """Metric (see `LeastMotion`) of the points by which parts hang, and of angular speeds."""
    size = sum(part.reach for part in mechanism.parts)  # length of a chain of all parts
    roots = np.zeros((len(mechanism.parts), 3, 3))
    for part, (x, y) in _hung_by(mechanism, rigid).items():
        cos, sin = np.cos(q[part, 2]), np.sin(q[part, 2])
        across, along = cos * x - sin * y, sin * x + cos * y
        roots[part, :, 0] = np.array([1.0, 0.0, -along]) * SECOND / size
        roots[part, :, 1] = np.array([0.0, 1.0, across]) * SECOND / size
        roots[part, 2, 2] = 1.0
    return roots


def _hung_by(mechanism: Mechanism, rigid: bool) -> dict[int, tuple[float, float]]:
    """Points (m, in the parts' axes) by which parts hang: a joint, a slot, or the centre.

    With `rigid`, only the part counts by which a whole body hangs.
    """
    tree = spanning_tree(mechanism)
    joints = [*mechanism.attachments, *mechanism.slides]
    in_slots = {slot.anchor.part: slot.anchor for slot in reversed(mechanism.slots)}
    hung = {}
    for part in tree.order:
        parent, joint = tree.parents[part], tree.joints[part]
        if rigid and within_body(mechanism, part, parent):
            continue
        anchor = in_slots.get(part, Anchor(part, *mechanism.parts[part].centre))
        if joint != NO_ITEM:
            ends = joints[joint].first, joints[joint].second
            anchor = next(end for end in ends if end.part == part)
        hung[part] = anchor.x, anchor.y
    return hung
