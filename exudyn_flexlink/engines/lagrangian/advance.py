"""Many steps at once: what to do with one that failed, how long the next is, when to stop."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.clock import CLOCK
from exudyn_flexlink.engines.lagrangian.collocation import Collocation as Method
from exudyn_flexlink.engines.lagrangian.compiled import compiled
from exudyn_flexlink.engines.lagrangian.course import Course, Equations, Instant, guide_at, rate_at
from exudyn_flexlink.engines.lagrangian.equations import unpacked
from exudyn_flexlink.engines.lagrangian.leaps import leaps
from exudyn_flexlink.engines.lagrangian.radau import (
    DIVERGED,
    ITERATIONS,
    SOLVED,
    Work,
    estimate,
    factor,
    factor_real,
    finish,
    guess,
    iterate,
    length_of,
    scale_at,
    work_for,
)
from exudyn_flexlink.engines.lagrangian.rail import FINE
from exudyn_flexlink.engines.lagrangian.stiffness import pressing_at, slopes
from exudyn_flexlink.engines.lagrangian.watch import Watched, uneventful

FloatArray = NDArray[np.float64]

FULL, THERE, LOOK, STUCK = 0, 1, 2, 3  # why `advance` ended

SAFETY = 0.9
LEAST, MOST = 0.2, 5.0  # times the last step
SHORTEST = 1e-14  # s, where the clock tells that apart
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
def _shortest(t: float) -> float:
    """Least step at t, s."""
    return max(SHORTEST, CLOCK * t)


@compiled
def _longest(
    at: tuple[float, FloatArray, float], free: int, course: Course, control: Control
) -> float:
    """Limit of a step from t and the state y that shall be `wanted` long, s."""
    t, y, wanted = at
    speed = abs(guide_at(t, y, free, course)[1])
    if course.drive[0] != 0.0:  # fastest at the step's end, as a ramp only rises
        speed = abs(guide_at(t + wanted, y, free, course)[1])
    if speed > 0.0:
        return min(control.longest, control.turn / speed)
    return control.longest


@compiled
def _factor_of_step(error: float, stages: int, iterations: int) -> float:
    """How much longer the next step may be, by the error in parts of the tolerance."""
    safety = SAFETY * (2 * ITERATIONS + 1) / (2 * ITERATIONS + iterations)
    return float(min(MOST, max(LEAST, safety * max(error, 1e-12) ** (-1.0 / (stages + 1)))))


@compiled
def _trend(h: float, error: float, stages: int, memory: FloatArray) -> float:
    """Gustafsson: how much longer the next step may be if the trend of the last two goes on."""
    return float(h / memory[OLD_STEP] * (memory[OLD_ERROR] / error) ** (1.0 / (stages + 1)))


@compiled
def _start(h: float, method: Method, work: Work) -> None:
    """Speeds to start the iteration with where no last step is known: of steady acceleration."""
    stages, free = work.speeds.shape
    for i in range(stages):
        for j in range(free):
            work.speeds[i, j] = method.nodes[i] * h * work.begin[free + j]


@compiled
def _slip(h: float, method: Method, work: Work) -> float:
    """How far from P at the step's end the integral of its velocity takes it, m.

    P follows from the guide's angle: a bend of the track between two stages, or a jump of P, shows
    in no coordinate that is solved for.
    """
    stages = len(work.near)
    x, y = work.way[stages, 0] - work.way[0, 0], work.way[stages, 1] - work.way[0, 1]
    for m in range(stages):
        weight = h * method.matrix[stages - 1, m]
        x -= weight * work.way[1 + m, 2]
        y -= weight * work.way[1 + m, 3]
    return float(np.sqrt(x * x + y * y))


@compiled
def _attempt(
    at: Instant,
    h: float,
    known: tuple[FloatArray, bool],
    equations: Equations,
    means: tuple[Method, Control, Work, FloatArray],
) -> tuple[float, float, float]:
    """Make one step of at most h, whatever it takes.

    `known` are the changes of the last step, and whether there are any. Return the length of the
    step, 0 if none is short enough, its error in parts of the tolerance, and how much longer the
    next may be.
    """
    method, control, work, memory = means
    stages, free = work.speeds.shape
    last, plain = known[0], not known[1]
    pressing = pressing_at(at, equations)
    by_q, by_v = slopes(at, pressing, equations)
    scale = scale_at(at, equations, control.reaches)
    allowed = (control.tolerance, control.tau)
    most = MOST
    while h >= _shortest(at.t):
        factor(h, by_q, by_v, method, work)
        if plain:
            _start(h, method, work)
        else:
            guess(h / memory[OLD_STEP], last, method, work)
        ended, iterations = iterate(at, h, allowed, equations, (method, scale, work))
        memory[ITERATED] += iterations
        if ended == SOLVED:
            begin = work.begin[free : 2 * free]
            missed = 0.0
            if np.any(pressing):
                slack, sped = leaps(at, h, pressing, equations, (method, work))
                factor_real(h, *slopes(at, slack, equations), method, work)
                missed = control.tau * length_of(sped, scale)
            error = max(missed, estimate(h, by_q, begin, control.tau, (method, scale, work)))
            slipped = _slip(h, method, work) / control.tolerance
            error = max(error / control.tolerance, slipped ** ((stages + 1) / (2 * stages)), 1e-12)
            change = _factor_of_step(error, stages, iterations)
            if error < 1.0:
                memory[TROUBLE] = FINE
                return h, error, min(change, most)
            h *= min(change, SAFETY)
        else:
            h, plain = h / 2, True
            memory[TROUBLE] = ended if ended != DIVERGED else memory[TROUBLE]
        most = 1.0
        memory[REJECTED] += 1
    return 0.0, 0.0, 0.0


@compiled
def advance(
    stop: float,
    course: Course,
    how: tuple[Method, Control],
    watched: Watched,
    buffer: Buffer,
) -> tuple[int, int]:
    """Integrate from the buffer's first state; return the number of steps, and why it ended.

    It ends where the buffer is full, at `stop`, after a step that must be looked at, or where no
    step is short enough.
    """
    method, control = how
    equations = Equations(course, unpacked(course.data))
    memory, stages, size = buffer.memory, len(method.nodes), len(buffer.states[0])
    free = len(equations.c.inertias) - int(course.drive[0])
    work = work_for(stages, size, free)
    t, wanted = buffer.times[0], memory[STEP]
    done, ended = 0, FULL
    while done < len(buffer.changes) and ended == FULL:
        ahead = stop - t
        if ahead <= _shortest(t):
            ended = THERE
            break
        y = buffer.states[done]
        wanted = min(wanted, _longest((t, y, wanted), free, course, control))
        # The last step ends at the stop; the one before is no longer than what it leaves.
        planned = ahead
        if wanted < ahead * (1 - 1e-9):
            planned = min(wanted, max(ahead / 2, _shortest(t)))
        if done > 0:  # a step's last stage is its end, where the iteration left its rates
            work.begin[:] = work.rates[stages - 1]
            work.way[0] = work.way[stages]
            at = Instant(t, y, buffer.places[done])
        else:
            first = Instant(t, y, buffer.places[0])
            near, _ = rate_at(first, equations, work.begin, work.way[0])
            at = Instant(t, y, near)
        known = (buffer.changes[max(done - 1, 0)], done > 0)
        h, error, change = _attempt(at, planned, known, equations, (method, control, work, memory))
        if h == 0.0:
            ended = STUCK
            break
        changes, end = buffer.changes[done], buffer.states[done + 1]
        finish(y, h, method, work, changes)
        end[:] = y + changes[stages - 1]
        t = stop if h == ahead else t + h
        buffer.times[done + 1], buffer.places[done + 1] = t, work.near[stages - 1]
        if done > 0:
            change = max(LEAST, min(change, change * _trend(h, error, stages, memory)))
        memory[OLD_STEP], memory[OLD_ERROR] = h, max(error, 1e-2)
        memory[STEPS] += 1
        done += 1
        after = Instant(t, end, work.near[stages - 1])
        if not uneventful(at, after, (changes, method.powers), equations, watched):
            ended = LOOK
        wanted = max(h * change, wanted if h == ahead else 0.0)
    memory[STEP] = wanted
    return done, ended
