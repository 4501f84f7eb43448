"""Many steps at once: what to do with one that failed, how long the next is, when to stop."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.lagrangian.compiled import compiled, inner
from exudyn_flexlink.engines.lagrangian.constants import unpacked
from exudyn_flexlink.engines.lagrangian.course import (
    Course,
    Equations,
    Instant,
    coordinates_at,
    guide_at,
    rate_at,
)
from exudyn_flexlink.engines.lagrangian.knots import moved_by_point, passes, reached, shortened
from exudyn_flexlink.engines.lagrangian.leaps import leaps
from exudyn_flexlink.engines.lagrangian.radau import (
    DIVERGED,
    ITERATIONS,
    SOLVED,
    Aim,
    Scale,
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
from exudyn_flexlink.engines.lagrangian.rail import FINE, SPLINE
from exudyn_flexlink.engines.lagrangian.stiffness import pressing_at, slopes
from exudyn_flexlink.engines.lagrangian.wall_events import NONE, Step, first_change, nearby
from exudyn_flexlink.engines.lagrangian.watch import Watched, interpolate, uneventful
from exudyn_flexlink.integrate.clock import CLOCK
from exudyn_flexlink.integrate.collocation import Collocation as Method
from exudyn_flexlink.integrate.control import SAFETY, growth

FloatArray = NDArray[np.float64]

FULL, THERE, LOOK, STUCK, TOUCH = range(5)  # why `advance` ended

LEAST = 0.2  # of a step that was cut at a touch: the next one is no shorter
step_growth = inner(growth)
SHORTEST = 1e-14  # s, where the clock tells that apart
# of `Buffer.memory`; MOVED: largest `moved_by_point` so far; PAIR: which began or ceased to touch;
# SLOW: see `Aim`
STEP, OLD_STEP, OLD_ERROR, STEPS, ITERATED, REJECTED, TROUBLE, MOVED, PAIR, SLOW = range(10)


class Control(NamedTuple):
    """How accurate, and how far a step may go."""

    tolerance: float  # m: error of one step
    tau: float  # s: turns errors of speeds into lengths
    lasting: float  # s: the same for what the iteration leaves
    longest: float  # s
    turn: float  # rad: that the guide may turn in a step
    reaches: FloatArray  # (N,) of guide and levers, m
    bend: float  # m/s^2: what knots of the track may cost in accelerations, over a step


class Buffer(NamedTuple):
    """Room for m steps: states at their ends and changes at their stages."""

    times: FloatArray  # (m + 1,)
    states: FloatArray  # (m + 1, size)
    changes: FloatArray  # (m, s, size)
    places: FloatArray  # (m + 1,) of P on the piece
    memory: FloatArray  # (10,) what the next call goes on with


@inner
def _shortest(t: float) -> float:
    """Least step at t, s."""
    return max(SHORTEST, CLOCK * t)


@inner
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


@inner
def _change(h: float, error: float, iterations: int, going_on: bool, memory: FloatArray) -> float:
    """How much longer the next step may be, by the error in parts of the tolerance.

    `going_on` tells that the step before was of the same equations.
    """
    safety = SAFETY * (2 * ITERATIONS + 1) / (2 * ITERATIONS + iterations)
    before = memory[OLD_STEP] if going_on else 0.0
    return float(step_growth(error, safety, h, (before, memory[OLD_ERROR])))


@inner
def _start(h: float, method: Method, work: Work) -> None:
    """Speeds to start the iteration with where no last step is known: of steady acceleration."""
    stages, free = work.speeds.shape
    for i in range(stages):
        for j in range(free):
            work.speeds[i, j] = method.nodes[i] * h * work.begin[free + j]


@inner
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


@inner
def _knots_allow(
    at: Instant,
    rate: FloatArray,
    equations: Equations,
    scale: Scale,
    given: tuple[float, FloatArray],
) -> float:
    """What a step may miss of P's acceleration, m/s^2, by the most that P's pushes moved so far."""
    bend, memory = given
    memory[MOVED] = max(memory[MOVED], moved_by_point(at, rate, equations, scale))
    return bend / memory[MOVED] if memory[MOVED] > 0.0 else np.inf


@inner
def _part(
    at: Instant,
    h: float,
    equations: Equations,
    scale: Scale,
    means: tuple[Method, Control, Work, FloatArray],
) -> float:
    """Part of the step just made after which it should have ended at a knot; 1 if it is good."""
    method, control, work, memory = means
    piece, last = equations.course.piece, len(work.near) - 1
    begin, end = at.near, work.near[last]
    if not passes(piece, begin, end):
        return 1.0
    after = Instant(at.t + h, work.states[last], end)
    given = (control.bend, memory)
    allowed = _knots_allow(after, work.rates[last], equations, scale, given)
    to = reached(piece, (begin, end), h, allowed, method)
    return 1.0 if to == end else float((to - begin) / (end - begin))


@inner
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
    most = np.inf
    if equations.course.piece[0] == SPLINE:
        bend = _knots_allow(at, work.begin, equations, scale, (control.bend, memory))
        h = shortened(at, h, (work.begin, bend), method, equations.course)
    while h >= _shortest(at.t):
        factor(h, by_q, by_v, method, work)
        if plain:
            _start(h, method, work)
        else:
            guess(h / memory[OLD_STEP], last, method, work)
        aim = Aim(control.tolerance, control.lasting, memory[SLOW])
        ended, iterations, memory[SLOW] = iterate(at, h, aim, equations, (method, scale, work))
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
            change = _change(h, error, iterations, known[1], memory)
            part = _part(at, h, equations, scale, means)
            if error < 1.0 and part == 1.0:
                memory[TROUBLE] = FINE
                return h, error, min(change, most)
            if error < 1.0:
                h *= part
                continue
            h *= min(change, SAFETY)
        else:
            h, plain = h / 2, True
            memory[TROUBLE] = ended if ended != DIVERGED else memory[TROUBLE]
        most = 1.0
        memory[REJECTED] += 1
    return 0.0, 0.0, 0.0


@inner
def _cut(
    part: float, y: FloatArray, changes: FloatArray, method: Method, scratch: FloatArray
) -> None:
    """Make of the `changes` (s, size) of a step from y those of a part of it: of its polynomial."""
    for i in range(len(scratch)):
        interpolate(part * method.nodes[i], y, changes, method.powers, scratch[i])
    for i in range(len(scratch)):
        changes[i] = scratch[i] - y


@inner
def _end_at_touch(
    at: Instant,
    whole: float,
    changes: FloatArray,
    equations: Equations,
    means: tuple[Method, Control, Work, FloatArray],
) -> tuple[float, int]:
    """Cut a step where the first pair of link and guide begins or ceases to touch.

    The step is made anew to end there, since its end is known to a higher order than what is
    within, and then cut, or lengthened, by the little that is left. Return its length and the pair,
    or `NONE`; `changes` (s, size) are changed.
    """
    method, control, work, memory = means
    stages, free = work.speeds.shape
    part, pair = first_change(Step(at, whole, changes, method.powers), equations)
    if pair == NONE:
        return whole, NONE
    _cut(part, at.y, changes, method, work.states)
    h = part * whole
    if h < _shortest(at.t):
        return h, pair
    known = changes.copy()
    for i in range(stages):
        for j in range(free):
            work.speeds[i, j] = changes[i, free + j]
    by_q, by_v = slopes(at, pressing_at(at, equations), equations)
    factor(h, by_q, by_v, method, work)
    scale = scale_at(at, equations, control.reaches)
    aim = Aim(control.tolerance, control.lasting, memory[SLOW])
    ended, iterations, memory[SLOW] = iterate(at, h, aim, equations, (method, scale, work))
    memory[ITERATED] += iterations
    if ended == SOLVED:
        finish(at.y, h, method, work, changes)
        part, again = nearby(pair, Step(at, h, changes, method.powers), equations)
        if again != NONE:
            _cut(part, at.y, changes, method, work.states)
            return part * h, again
    changes[:] = known
    return h, pair


@inner
def _beginning(at: Instant, going_on: bool, equations: Equations, work: Work) -> Instant:
    """Rates and P at the start of a step; of one that goes on from the last they are known."""
    if going_on:  # a step's last stage is its end, where the iteration left its rates
        stages = len(work.near)
        work.begin[:] = work.rates[stages - 1]
        work.way[0] = work.way[stages]
        return at
    near, _ = rate_at(at, equations, work.begin, work.way[0])
    return Instant(at.t, at.y, near)


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
    memory[SLOW] = np.inf  # an event may have changed the equations
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
        at = _beginning(Instant(t, y, buffer.places[done]), done > 0, equations, work)
        known = (buffer.changes[max(done - 1, 0)], done > 0)
        h, error, change = _attempt(at, planned, known, equations, (method, control, work, memory))
        if h == 0.0:
            ended = STUCK
            break
        changes, end = buffer.changes[done], buffer.states[done + 1]
        finish(y, h, method, work, changes)
        near, whole = work.near[stages - 1], h
        if len(course.touching) > 0:
            means = (method, control, work, memory)
            h, pair = _end_at_touch(at, whole, changes, equations, means)
            if pair != NONE:
                memory[PAIR], ended = pair, TOUCH
                near = coordinates_at(Instant(t + h, y + changes[stages - 1], near), equations)[3]
        end[:] = y + changes[stages - 1]
        t = stop if h == ahead else t + h
        buffer.times[done + 1], buffer.places[done + 1] = t, near
        memory[OLD_STEP], memory[OLD_ERROR] = h, max(error, 1e-2)
        memory[STEPS] += 1
        done += 1
        after = Instant(t, end, near)
        if not uneventful(at, after, (changes, method.powers), equations, watched):
            ended = LOOK
        wanted = max(h * change, wanted if h == ahead else 0.0, LEAST * whole)
    memory[STEP] = wanted
    return done, ended
