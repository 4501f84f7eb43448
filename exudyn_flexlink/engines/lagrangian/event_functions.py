"""Event functions of `system` in machine code: whether an event can have happened in a step.

Contacts are those of penalty laws. A step in which an event function may have fallen below zero is
handed to the event loop, which evaluates them for itself.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IntArray
from exudyn_flexlink.engines.lagrangian.compiled import compiled, inlined, inner
from exudyn_flexlink.engines.lagrangian.faces import touches
from exudyn_flexlink.engines.lagrangian.mode import Instant, Mode, coordinates_at
from exudyn_flexlink.engines.lagrangian.track_point import END, START


class Side(IntEnum):
    """Where the point of a contact is."""

    APART = 0
    PRESSED = 1
    BEHIND = 2


APART, PRESSED, BEHIND = map(int, Side)
EVENT_SAMPLES = 8  # of the event functions, evenly over a step in which one may fall below zero
SEEN = 3  # of a row of `EventData.seen`: where gaps begin
NOTHING = 1e-13  # m: an event function this little below zero is there by rounding


class Step(NamedTuple):
    """A step of length h (s): its beginning, its changes (s, size), the method's powers."""

    begin: Instant
    h: float
    changes: FloatArray
    powers: FloatArray


class EventData(NamedTuple):
    """What the event functions need besides the equations."""

    sides: IntArray  # (c,) of the contacts; they change beyond the ends of faces
    idle: IntArray  # (c,) 1 where nothing can have happened to the contact in the last step
    lengths: FloatArray  # (c,) of their faces, m
    goal: FloatArray  # (4,) coordinates of the turning joint's parts (-1: ground), start, turns
    # (2, 3 + 4 c) at the two ends of the last step: time, rate of the track's coordinate, way to
    # the end of its piece; gap, place and their rates of each contact
    seen: FloatArray


@inner
def turns_left(q: FloatArray, goal: FloatArray) -> float:
    """Angle that is still to turn; 1 without a goal."""
    if goal[3] == 0.0:
        return 1.0
    done = -goal[2]
    if goal[1] >= 0.0:
        done += q[int(goal[1])]
    if goal[0] >= 0.0:
        done -= q[int(goal[0])]
    return float(goal[3] - abs(done))


@inner
def _look(at: Instant, mode: Mode, goal: FloatArray, row: FloatArray) -> float:
    """Fill in a row of `EventData.seen`; return the angle that is still to turn."""
    c = mode.constants
    q, v, point, u, _ = coordinates_at(at, mode)
    row[0], row[1] = at.t, v[int(c.track_coordinate)]
    row[2] = min(mode.piece[END] - u, u - mode.piece[START])
    if len(mode.acting) > 0:
        states, _, _ = touches(q, v, point, c)
        for k in range(len(states)):
            for m in range(4):
                row[SEEN + 4 * k + m] = states[k, m]
    return turns_left(q, goal)


@inlined
def _no_event_between(begin: Instant, end: Instant, mode: Mode, event_data: EventData) -> bool:
    """Tell from the two ends of a step that nothing can have happened in between.

    The cubic through gaps and rates at both ends strays from them by less than a sixth of the way
    that the larger speed covers; the margin is sixfold.
    """
    before, after = event_data.seen[0], event_data.seen[1]
    if after[0] == begin.t:  # the end of the step before
        for k in range(len(before)):
            before[k] = after[k]
    else:
        _look(begin, mode, event_data.goal, before)
    left = _look(end, mode, event_data.goal, after)
    quiet = not (before[1] * after[1] < 0 or after[2] < 0 or left < 0)
    done, sides = end.t - begin.t, event_data.sides
    for k in range(len(sides)):
        i = SEEN + 4 * k
        idle = sides[k] != PRESSED and (
            _beyond(before[i:], after[i:], done, event_data.lengths[k])
            or _far(before[i:], after[i:], done)
        )
        event_data.idle[k] = 1 if idle else 0
        quiet = quiet and idle
    if not quiet:
        return False
    for k in range(len(sides)):  # beyond its face a point may have changed sides
        if after[SEEN + 4 * k] != 0.0:
            sides[k] = APART if after[SEEN + 4 * k] > 0.0 else BEHIND
    return True


@inlined
def _beyond(before: FloatArray, after: FloatArray, done: float, length: float) -> bool:
    """Tell that a point was beyond the same end of its face all through a step of `done` (s)."""
    way = done * max(abs(before[3]), abs(after[3]))
    return bool(max(before[1], after[1]) < -way or min(before[1], after[1]) > length + way)


@inlined
def _far(before: FloatArray, after: FloatArray, done: float) -> bool:
    """Tell that a point was on one side of its face's line all through a step of `done` (s)."""
    way = done * max(abs(before[2]), abs(after[2]))
    return bool(min(abs(before[0]), abs(after[0])) > way and before[0] * after[0] > 0)


@inlined
def _fallen(before: FloatArray, now: FloatArray, event_data: EventData) -> bool:
    """Tell whether an event function of a piece or a contact has fallen at the second of two looks.

    A gap that closed at the first and opens now may have been closed in between.
    """
    fallen = now[2] < -NOTHING
    for k in range(len(event_data.sides)):
        i, side = SEEN + 4 * k, event_data.sides[k]
        gap, place = now[i], now[i + 1]
        if side == PRESSED:
            fallen = fallen or min(place, event_data.lengths[k] - place, -gap) < -NOTHING
        else:
            way = 1.0 if side == APART else -1.0
            fallen = fallen or way * gap < -NOTHING or way * before[i + 2] < 0.0 < way * now[i + 2]
    return bool(fallen)


@compiled
def interpolate(
    sigma: float, y: FloatArray, changes: FloatArray, powers: FloatArray, at: FloatArray
) -> None:
    """Fill in the state at the part sigma of a step from y, whose stages have the `changes`."""
    stages, size = changes.shape
    for j in range(size):
        at[j] = y[j]
    power = 1.0
    for k in range(stages):
        power *= sigma
        for m in range(stages):
            weight = power * powers[k, m]
            for j in range(size):
                at[j] += weight * changes[m, j]


@inlined
def within(sigma: float, step: Step) -> Instant:
    """Instant at the part sigma of a step."""
    begin, h, changes, powers = step
    y = np.empty(len(begin.y))
    interpolate(sigma, begin.y, changes, powers, y)
    return Instant(begin.t + sigma * h, y, begin.near)


def uneventful(step: Step, end: Instant, mode: Mode, event_data: EventData) -> bool:
    """Tell that no event function has fallen below zero in a step."""
    if _no_event_between(step.begin, end, mode, event_data):
        return True
    rows = event_data.seen.copy()  # the first is that of the start
    for k in range(1, EVENT_SAMPLES + 1):
        now = rows[k % 2]
        left = _look(within(k / EVENT_SAMPLES, step), mode, event_data.goal, now)
        if left < -NOTHING or _fallen(rows[(k + 1) % 2], now, event_data):
            return False
    return True
