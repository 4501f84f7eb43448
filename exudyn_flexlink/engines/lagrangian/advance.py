"""Many steps at once: what to do with one that failed, how long the next is, when to stop."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.lagrangian.collocation import Collocation as Method
from exudyn_flexlink.engines.lagrangian.compiled import compiled
from exudyn_flexlink.engines.lagrangian.course import Course, guide_at, rate_at
from exudyn_flexlink.engines.lagrangian.equations import Constants, unpacked
from exudyn_flexlink.engines.lagrangian.radau import (
    DIVERGED,
    ITERATIONS,
    SOLVED,
    estimate,
    factor,
    finish,
    guess,
    iterate,
    scale_at,
    work_for,
)
from exudyn_flexlink.engines.lagrangian.rail import FINE
from exudyn_flexlink.engines.lagrangian.stiffness import slopes
from exudyn_flexlink.engines.lagrangian.watch import Watched, uneventful

FloatArray = NDArray[np.float64]

FULL, THERE, LOOK, STUCK = 0, 1, 2, 3  # why `advance` ended

SAFETY = 0.9
LEAST, MOST = 0.2, 5.0  # times the last step
SHORTEST = 1e-14  # s
STEP, OLD_STEP, OLD_ERROR, STEPS, ITERATED, REJECTED, TROUBLE = range(7)  # of `Buffer.memory`


class Control(NamedTuple):
    """How accurate, and how far a step may go."""

    tolerance: float  # m: error of one step
    tau: float  # s: turns errors of speeds into lengths
    longest: float  # s
    turn: float  # rad: that the guide may turn in a step
    reaches: FloatArray  # (N,) of guide and levers, m


class Buffer(NamedTuple):
    """Room for m steps: states at their ends and changes at their stages."""

    times: FloatArray  # (m + 1,)
    states: FloatArray  # (m + 1, size)
    changes: FloatArray  # (m, s, size)
    places: FloatArray  # (m + 1,) of P on the piece
    memory: FloatArray  # (7,) what the next call goes on with


@compiled
def _longest(t: float, y: FloatArray, free: int, course: Course, control: Control) -> float:
    speed = abs(guide_at(t, y, free, course)[1])
    if course.drive[0] != 0.0:
        speed = abs(course.drive[1])
    if speed > 0.0:
        return min(control.longest, control.turn / speed)
    return control.longest


@compiled
def _factor_of_step(error: float, stages: int, iterations: int) -> float:
    """How much longer the next step may be, by the error in parts of the tolerance."""
    safety = SAFETY * (2 * ITERATIONS + 1) / (2 * ITERATIONS + iterations)
    return min(MOST, max(LEAST, safety * max(error, 1e-12) ** (-1.0 / (stages + 1))))


@compiled
def advance(
    stop: float,
    course: Course,
    method: Method,
    control: Control,
    watched: Watched,
    buffer: Buffer,
) -> tuple[int, int]:
    """Integrate from the buffer's first state; return the number of steps, and why it ended.

    It ends where the buffer is full, at `stop`, after a step that must be looked at, or where no
    step is short enough.
    """
    c = unpacked(course.data)
    memory, stages = buffer.memory, len(method.nodes)
    size = len(buffer.states[0])
    free = len(c.inertias) - int(course.drive[0])
    work = work_for(stages, size, free)
    room, done = len(buffer.changes), 0
    t, h = buffer.times[0], memory[STEP]
    fresh, rejected = True, False
    while done < room:
        if stop - t <= SHORTEST:
            memory[STEP] = h
            return done, THERE
        y, near = buffer.states[done], buffer.places[done]
        h = min(h, _longest(t, y, free, course, control))
        ahead = stop - t
        lands = h >= ahead * (1 - 1e-9)
        if not lands and 2 * h > ahead:
            h = ahead / 2
        wanted = h
        h = ahead if lands else h
        near, _ = rate_at(t, y, near, course, c, work.begin)
        by_q, by_v = slopes(t, y, near, course, c)
        scale = scale_at(t, y, near, course, c, control.reaches)
        plain = fresh
        while True:
            if h < SHORTEST or h < 1e-15 * t:
                memory[STEP] = h
                return done, STUCK
            factor(h, by_q, by_v, method, work)
            if plain:
                for i in range(stages):
                    for j in range(free):
                        work.speeds[i, j] = method.nodes[i] * h * work.begin[free + j]
            else:
                guess(h / memory[OLD_STEP], buffer.changes[done - 1], method, work)
            how, iterations = iterate(
                t, y, h, near, (control.tolerance, control.tau), course, c, method, scale, work
            )
            memory[ITERATED] += iterations
            if how != SOLVED:
                h, rejected, lands, plain = h / 2, True, False, True
                memory[REJECTED] += 1
                memory[TROUBLE] = how if how != DIVERGED else memory[TROUBLE]
                continue
            error = (
                estimate(h, by_q, work.begin[free : 2 * free], control.tau, method, scale, work)
                / control.tolerance
            )
            change = _factor_of_step(error, stages, iterations)
            if error < 1.0:
                break
            h, rejected, lands = h * min(change, SAFETY), True, False
            memory[REJECTED] += 1
        memory[TROUBLE] = FINE
        changes = buffer.changes[done]
        finish(y, h, method, work, changes)
        end = buffer.states[done + 1]
        for j in range(size):
            end[j] = y[j] + changes[stages - 1, j]
        after = stop if lands else t + h
        buffer.times[done + 1] = after
        buffer.places[done + 1] = work.near[stages - 1]
        done += 1
        memory[STEPS] += 1
        if not fresh and memory[OLD_ERROR] > 0:
            # Gustafsson: the trend of the last two steps goes on.
            trend = (
                h
                / memory[OLD_STEP]
                * (memory[OLD_ERROR] / max(error, 1e-12)) ** (1.0 / (stages + 1))
            )
            change = max(LEAST, min(change, change * trend))
        memory[OLD_STEP], memory[OLD_ERROR] = h, max(error, 1e-2)
        pair = (t, after)
        calm = uneventful(
            pair, (y, end), (near, buffer.places[done]), (changes, method.powers),
            course, c, watched,
        )  # fmt: skip
        h = max(h * min(change, 1.0 if rejected else MOST), wanted if lands else 0.0)
        fresh, rejected, t = False, False, after
        if not calm:
            memory[STEP] = h
            return done, LOOK
    memory[STEP] = h
    return done, FULL
