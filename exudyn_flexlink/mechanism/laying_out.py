"""Where the parts stand before their joints are closed: laid out joint by joint from the ground."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.curves import ends_of_lap, ray_crossings
from exudyn_flexlink.mechanism.kinematics import anchor_position, angle_of
from exudyn_flexlink.mechanism.least_motion import within_body
from exudyn_flexlink.mechanism.model import Mechanism, Pin, Slide, Slot, Weld
from exudyn_flexlink.mechanism.parts import GROUND, Anchor

BEHIND = 1e-10  # m: so little behind its start a point counts as on it


@dataclass(frozen=True)
class Start:
    """What the scene says of time 0, by part: held and guessed angles, held speeds.

    `velocities` (m/s) and `positions` (m) are those of the origins of parts. `along` (m) is how
    far slides are out, by their names, and `speeds_along` (m/s) the rate of that, or how fast
    anchors run along the curves of slots. `states` (parts, 6) are coordinates and velocities of all
    parts, in place of all others; `laps` those of slots, 1 where left out.
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


def lay_out(mechanism: Mechanism, start: Start, more: Sequence[Pin] = ()) -> FloatArray:
    """Lay the parts out joint by joint from the ground, as a start for closing the loops."""
    q = np.zeros((len(mechanism.parts), 3))
    turned = known_angles(mechanism, start)
    q[:, 2] = [turned.get(i, 0.0) for i in range(len(q))]
    placed = {GROUND, *start.positions}
    for part, place in start.positions.items():
        q[part, :2] = place
    joints = (*inner_joints(mechanism), *mechanism.attachments, *more)
    pinned = [(joint.first, joint.second) for joint in joints]
    slides, lengths = slides_of(mechanism), known_lengths(mechanism, start)
    while True:
        # Loose ends are pinned first: a slide or a slot leaves a freedom that a pin would fix.
        _attach_all(q, placed, pinned)
        if _attach_slides(mechanism, q, placed, slides, lengths):
            continue
        if any(_attach_slot(q, placed, slot) for slot in mechanism.slots):
            continue
        return q


def slides_of(mechanism: Mechanism) -> list[Slide]:
    """Prismatic joints and sleeves; those with clearance as if there were none."""
    in_channels = (Slide(c.name, c.guide, c.nodes[0]) for c in mechanism.channels)
    return [*mechanism.slides, *in_channels]


def slides_named(mechanism: Mechanism, names: Iterable[str]) -> list[Slide]:
    """Those of `slides_of` that have these names, in the order of the names."""
    known = {slide.name: slide for slide in slides_of(mechanism)}
    return [known[name] for name in names]


def known_lengths(mechanism: Mechanism, start: Start) -> dict[str, float]:
    """By slide, how far it is out at time 0, m, where that is given or driven."""
    motors = mechanism.speed_motors
    driven = {m.slide.name: m.start for m in motors if m.slide and m.start is not None}
    return {**driven, **start.along}


def _attach_all(q: FloatArray, placed: set[int], pairs: Sequence[tuple[Anchor, Anchor]]) -> None:
    """Place every part that pairs of anchors lead to from those placed; the first pair is next."""
    left = list(pairs)
    while True:
        attached = next((pair for pair in left if _attach(q, placed, *pair)), None)
        if attached is None:
            return
        left.remove(attached)


def known_angles(mechanism: Mechanism, start: Start) -> dict[int, float]:
    """Angles of all parts that are given, passed on by slides and welds, and along a link."""
    held: tuple[Weld | Slide, ...] = (*mechanism.welds, *mechanism.slides)
    ties = [(joint.first.part, joint.second.part, joint.angle) for joint in held]
    motors = (motor for motor in mechanism.speed_motors if not motor.slide)
    ties += [(one.first, one.second, one.start) for one in motors if one.start is not None]
    ties += [(*pair, 0.0) for chain in mechanism.bodies.values() for pair in pairwise(chain)]
    known = {**start.guesses, **start.angles, GROUND: 0.0}
    _pass_on(ties, known)
    known = {**{part: 0.0 for ends in mechanism.turned_by_drives for part in ends}, **known}
    _pass_on(ties, known)
    del known[GROUND]
    return known


def _pass_on(ties: Sequence[tuple[int, int, float]], known: dict[int, float]) -> None:
    """Give parts their angles from those of others; a tie has two, and the angle from the first."""
    before = 0
    while len(known) > before:
        before = len(known)
        for first, second, angle in ties:
            if first in known:
                known.setdefault(second, known[first] + angle)
            elif second in known:
                known[first] = known[second] - angle


def _attach(q: FloatArray, placed: set[int], first: Anchor, second: Anchor) -> bool:
    """Move the one of two anchored parts that is not placed yet onto the other."""
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
    """Put a part into its guide, as far out as is known (m), else on the slot it points to."""
    for slide in slides:
        first, second = slide.first, slide.second
        led = second.part in placed  # then it stays where it is
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
    """Distance from the origin to the slot's first lap in a direction; the nearest ahead, or 0."""
    crossings = ray_crossings(slot.curve, origin, along)
    distances = (slot.curve.point(crossings) - origin) @ along
    first_lap = crossings <= ends_of_lap(slot.curve, 1)[1]
    ahead = distances[(distances >= -BEHIND) & first_lap]
    return float(ahead.min()) if len(ahead) else 0.0


def _attach_slot(q: FloatArray, placed: set[int], slot: Slot) -> bool:
    """Put a part that nothing else holds at the start of its curve, or the curve's part there."""
    start = Anchor(slot.carrier, *slot.curve.point(slot.curve.start).tolist())
    return _attach(q, placed, start, slot.anchor)


def inner_joints(mechanism: Mechanism) -> list[Pin | Slide]:
    """Hinges of flexible bodies, and what lets their rods stretch."""
    joints: tuple[Pin | Slide, ...] = (*mechanism.pins, *mechanism.slides)
    return [j for j in joints if within_body(mechanism, j.first.part, j.second.part)]
