"""Where the parts stand at time 0: laid out, then closed by Gauss-Newton steps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Set
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.curves import ends_of_lap
from exudyn_flexlink.mechanism.constraints import Constraints, along_slides, constraint_rows
from exudyn_flexlink.mechanism.kinematics import (
    anchor_position,
    length_along,
    places_near,
    slot_point,
)
from exudyn_flexlink.mechanism.laying_out import (
    Start,
    inner_joints,
    known_angles,
    lay_out,
    slides_named,
)
from exudyn_flexlink.mechanism.least_motion import LeastMotion, scale_roots, whole_roots
from exudyn_flexlink.mechanism.model import Mechanism, Pin, Slide, Slot
from exudyn_flexlink.mechanism.parts import GROUND
from exudyn_flexlink.raising import Sendable

CLOSED = 1e-10  # m or rad: residual of a joint that counts as closed
ITERATIONS = 60
AWAY = 0.01  # of the reach, or rad: far enough from a dead centre to tell it from others
KICKS = (0.5, -0.5, 1.2, -1.2)  # rad, other starts of the search
TYPED = 2e-6  # of a part's reach: 7 decimals of a metre leave so much open for one of 5 cm
SHUFFLES = 12  # last starts, from random angles: these close six-bars that the others leave open


class CannotAssembleError(Sendable, ValueError):
    """The joints can't all close: `joint` is the one that stays open most.

    Its `kind` is "position" where they close, but not with this body at the place it is given, and
    "along" where they do not with this joint as far out as it is given.
    `gap` (m) and `turn` (rad) are what is missing in all joints together. A loop opens at the
    joint that closes it, once the others have put its parts one to another. `near` (m) is where
    joints allow a body next to the place that it is given.
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
    mechanism: Mechanism, start: Start, laid_out_by: Sequence[Pin] = ()
) -> tuple[FloatArray, FloatArray]:
    """Coordinates and slot places that close all joints: bodies straight, or else bent.

    Each is searched from the start given and, since parts in one line are a dead end of the search,
    from a few where those parts are turned whose angle nothing tells, last by random angles. Parts
    are laid out by more pins than need close, if there are any in `laid_out_by`. A drive's part
    stands at 0 if the joints can have that; where they can't, its angle is searched, too.
    """
    held = _held(mechanism, start)
    freed = replace(held, turns=set(start.angles))
    # Bodies bend before they stretch, which would take forces that no start should have. Straight
    # ones move as one: there nothing stretches anyway.
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
            found = _close_on_curves(mechanism, lay_out(mechanism, start), freely, straight=True)
            away = {p: float(np.hypot(*(found[0][p, :2] - at))) for p, at in held.places.items()}
            if all(far <= TYPED * mechanism.parts[part].reach for part, far in away.items()):
                return found
            farthest = max(away, key=lambda part: away[part])
            near = (float(found[0][farthest, 0]), float(found[0][farthest, 1]))
    raise CannotAssembleError(*blamed, least.gap, least.turn, near)


def _contradicting(mechanism: Mechanism, start: Start) -> tuple[str, str] | None:
    """Name and kind of what is given or driven without which the joints would close, if any."""
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
    """As `positions`, from the start given alone and with bodies straight.

    Raises:
        CannotAssembleError: this search closes no joints.

    """
    q = lay_out(mechanism, start)
    return _close_on_curves(mechanism, q, _held(mechanism, start), straight=True)


def closest(
    mechanism: Mechanism, q: FloatArray, laps: Mapping[str, int]
) -> tuple[FloatArray, FloatArray]:
    """Coordinates and slot places that close all joints, next to those given (parts, 3).

    Angles that a motor drives from the ground stay, but where it tells them itself. `laps` are
    those of slots.

    Raises:
        CannotAssembleError: there are none near.

    """
    free = tuple(motor for motor in mechanism.speed_motors if motor.start is None)
    held = _held(replace(mechanism, speed_motors=free), Start({}, {}, {}))
    return _close(mechanism, q, replace(held, laps=laps), straight=False)


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
    """Parts whose angle stays while the joints close, and places (m) at which parts are held.

    `angles` (rad) are those of the first, where the search began. Also slides, and how far (m) they
    are out, and the slides within `rods` that can stretch, which stay as long as they are. Slots
    are in their first lap, but for `laps`.
    """

    turns: Set[int] = frozenset()
    places: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    slides: Sequence[Slide] = ()
    lengths: Sequence[float] = ()
    rods: Sequence[Slide] = ()
    laps: Mapping[str, int] = field(default_factory=dict)
    angles: Mapping[int, float] = field(default_factory=dict)

    def of(self, mechanism: Mechanism, q: FloatArray, slot_places: FloatArray) -> Constraints:
        """Rows of all joints, of drives that prescribe where they start, and of what is held."""
        motions = tuple(motor for motor in mechanism.speed_motors if motor.start is not None)
        closing = replace(mechanism, speed_motors=motions, gears=())  # these mesh at any angle
        joints = constraint_rows(closing, q, slot_places)
        given = {(part, axis): at[axis] for part, at in self.places.items() for axis in (0, 1)}
        given |= {(part, 2): angle for part, angle in self.angles.items()}
        joints = joints.with_fixed(list(given), [q[at] - place for at, place in given.items()])
        lengths = np.append(self.lengths, np.zeros(len(self.rods)))
        return joints.with_rows(*along_slides([*self.slides, *self.rods], lengths, q))


def _kicked(mechanism: Mechanism, start: Start, turned: float, straight: bool) -> Start:
    """Guess the angles that nothing tells: in turn to either side; bent links as a half wave."""
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
    """Guess at random the angles that nothing but a drive tells, if there are two or more."""
    told = tuple(motor for motor in mechanism.speed_motors if motor.start is not None)
    known = known_angles(replace(mechanism, speed_motors=told, torque_motors=()), start)
    loose = [chain for chain in mechanism.bodies.values() if chain[0] not in known]
    return list(shuffled(start, loose, SHUFFLES)) if len(loose) > 1 else []


def shuffled(start: Start, loose: Sequence[tuple[int, ...]], count: int) -> Iterator[Start]:
    """Guess angles of bodies, of which each is its parts, at random, so many times."""
    random = np.random.default_rng(0)
    for _ in range(count):
        angles = random.uniform(-np.pi, np.pi, len(loose)).tolist()
        guesses = dict(start.guesses)
        for parts, angle in zip(loose, angles, strict=True):
            guesses |= dict.fromkeys(parts, angle)
        yield replace(start, guesses=guesses)


def _held(mechanism: Mechanism, start: Start) -> _Held:
    """What stays: what is given, and the angles that a motor drives from the ground."""
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
    """As `_close`, with no point beyond an end of its curve: there its row is zero, too."""
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
    places = np.array([_place_in(slot, lap, q) for slot, lap in slots])
    held = replace(held, angles={part: q[part, 2] for part in held.turns})
    joints = first = held.of(mechanism, q, places)
    for _ in range(ITERATIONS):
        if np.abs(joints.residual).max(initial=0.0) < 1e-14:
            break
        roots = whole_roots(mechanism, q) if straight else scale_roots(mechanism)
        motion = LeastMotion(mechanism, joints, roots, -joints.residual, straight)
        step = motion.nearest()
        # Far from closed a full step may overshoot: no part turns more than half a radian at once.
        step = step * min(1.0, 0.5 / max(float(np.abs(step[:, 2]).max()), 1e-300))
        q = q + step
        q = _straightened(mechanism, q) if straight else q
        places = places_near(mechanism, q, places)
        joints = held.of(mechanism, q, places)
        if np.abs(step).max(initial=0.0) < 1e-15:
            break
    if any(abs(q[part, 2] - angle) > CLOSED for part, angle in held.angles.items()):
        _refuse_open(first)  # joints have turned what is held: without that they stay open
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
    held = joints.residual[joints.first_rows[-1] :]  # these gave way, too
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
    """Return the place, or that of the same point in the slot's lap: on the seam its start."""
    start, end = ends_of_lap(slot.curve, lap)
    if np.hypot(*(slot_point(slot, q) - slot.curve.point(start))) <= CLOSED:
        return start
    return place if start <= place < end else _place_in(slot, lap, q)


def _place_in(slot: Slot, lap: int, q: FloatArray) -> float:
    """Place next to the anchor in a lap of the curve.

    Laps share their meeting point, and often more: there the same point in this lap is meant.
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
