"""When a pair of link and guide begins or ceases to touch, within a step: in machine code.

A pair touches from where its gap closes, or its point comes over the face, until the one opens or
the other ends. An event is located in the step's polynomial, and the step made again to end there;
what is left of the gap then is below `EXACT`, and the rates tell on which side of the event the
pair is.
"""

from __future__ import annotations

from exudyn_flexlink.arrays import FloatArray, IntArray
from exudyn_flexlink.engines.lagrangian.compiled import compiled, inlined, inner
from exudyn_flexlink.engines.lagrangian.event_functions import Step, within
from exudyn_flexlink.engines.lagrangian.mode import Mode, coordinates_at
from exudyn_flexlink.engines.lagrangian.walls import (
    GAP,
    GAP_RATE,
    INSIDE,
    INSIDE_RATE,
    SLIP,
    look,
)

NONE = -1  # no pair
BEYOND, FAR_BEYOND = 8, 0.1  # looks for an event beyond a step's end, and parts of the step
# m, of a gap: what may be left of it where a touch begins or ends. A foil may rest 5e-12 m deep.
EXACT = 1e-12
TOUCH_SAMPLES = 8  # of all pairs, evenly over a step in which one may begin or cease to touch
HALVINGS = 45  # of the time between two samples: to rounding


@inner
def _over(value: float, rate: float) -> bool:
    """Tell whether a value is above zero, or on its way from zero, m and m/s."""
    return bool(value > EXACT or (value > -EXACT and rate > 0.0))


@inner
def _changed(pair: FloatArray, touches: bool, two_sided: bool) -> bool:
    """Tell whether a pair that touches no longer does, or one that does not now does."""
    if touches:
        gone = not two_sided and pair[GAP] > 0.0 and _over(pair[GAP], pair[GAP_RATE])
        off = pair[INSIDE] < 0.0 and _over(-pair[INSIDE], -pair[INSIDE_RATE])
        return bool(gone or off)
    pressed = two_sided or (pair[GAP] < 0.0 and _over(-pair[GAP], -pair[GAP_RATE]))
    over = pair[INSIDE] >= 0.0 and _over(pair[INSIDE], pair[INSIDE_RATE])
    return bool(pressed and over)


@compiled
def first_changed(pairs: FloatArray, touching: IntArray, two_sided: bool) -> int:
    """Return the first pair that begins or ceases to touch; `NONE` if none does."""
    for k in range(len(touching)):
        if _changed(pairs[k], touching[k] != 0, two_sided):
            return k
    return NONE


@compiled
def calm(
    before: FloatArray, after: FloatArray, touching: IntArray, two_sided: bool, done: float
) -> bool:
    """Tell from the two ends of a step, of length `done`, that no pair can have changed in it.

    The cubic through values and rates at both ends strays from them by less than a sixth of the way
    that the larger rate covers; the margin is sixfold.
    """
    for k in range(len(touching)):
        deep = done * max(abs(before[k, GAP_RATE]), abs(after[k, GAP_RATE]))
        far = done * max(abs(before[k, SLIP]), abs(after[k, SLIP]))
        if touching[k] != 0:
            pressed = two_sided or max(before[k, GAP], after[k, GAP]) < -deep
            if not (pressed and min(before[k, INSIDE], after[k, INSIDE]) > far):
                return False
        elif not (
            min(before[k, GAP], after[k, GAP]) > deep
            or max(before[k, INSIDE], after[k, INSIDE]) < -far
        ):
            return False
    return True


@inner
def _pairs_within(sigma: float, step: Step, mode: Mode) -> FloatArray:
    """All pairs at the part sigma of a step, (pairs, 5)."""
    q, v, point, _, _ = coordinates_at(within(sigma, step), mode)
    return look(q, v, point, mode.constants).pairs


@inlined
def _first_change(step: Step, mode: Mode) -> tuple[float, int]:
    """Find the first change in a step: its part of the step, and the pair or `NONE`."""
    touching, two_sided = mode.touching, mode.constants.channel[5] == 0.0
    before = _pairs_within(0.0, step, mode)
    after = _pairs_within(1.0, step, mode)
    if calm(before, after, touching, two_sided, step.h):
        return 1.0, NONE
    low, high, found = 0.0, 0.0, NONE
    for k in range(1, TOUCH_SAMPLES + 1):
        low, high = high, k / TOUCH_SAMPLES
        after = _pairs_within(high, step, mode)
        found = first_changed(after, touching, two_sided)
        if found == NONE and not two_sided:
            found, high = _grazed((low, high), (before, after), step, mode)
        if found != NONE:
            break
        before = after
    if found == NONE:
        return 1.0, NONE
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        pair = first_changed(_pairs_within(middle, step, mode), touching, two_sided)
        if pair == NONE:
            low = middle
        else:
            high, found = middle, pair
    return high, found


@inlined
def _grazed(
    between: tuple[float, float],
    looks: tuple[FloatArray, FloatArray],
    step: Step,
    mode: Mode,
) -> tuple[int, float]:
    """Find a pair that touched `between` two looks, and where its gap was smallest.

    Else return `NONE` and the later look.
    """
    touching = mode.touching
    before, after = looks
    for k in range(len(touching)):
        closed = before[k, GAP_RATE] < 0.0 < after[k, GAP_RATE]
        over = max(before[k, INSIDE], after[k, INSIDE]) > 0.0
        if touching[k] != 0 or not closed or not over:
            continue
        low, high = between
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            if _pairs_within(middle, step, mode)[k, GAP_RATE] < 0.0:
                low = middle
            else:
                high = middle
        if _changed(_pairs_within(low, step, mode)[k], False, False):
            return k, low
    return NONE, between[1]


def change_within(pair: int, step: Step, mode: Mode) -> tuple[float, int]:
    """Find the first change in a step, else that of a pair, if one is given, about its end.

    That one may be beyond, where the step's polynomial still holds. Return the part of the step,
    and the pair or `NONE`.
    """
    part, first = _first_change(step, mode)
    if first != NONE or pair == NONE:
        return part, first
    part = 1.0
    for _ in range(BEYOND):
        seen = _pairs_within(part, step, mode)[pair]
        left, rate = seen[INSIDE], seen[INSIDE_RATE]
        if mode.constants.channel[5] > 0.0 and abs(seen[GAP]) < abs(left):
            left, rate = seen[GAP], seen[GAP_RATE]
        if abs(left) < 0.1 * EXACT:
            return part, pair
        part -= left / (rate * step.h)
        if not 1.0 - FAR_BEYOND < part < 1.0 + FAR_BEYOND:
            break
    return 1.0, NONE
