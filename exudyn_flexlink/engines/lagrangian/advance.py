"""Many steps at once: what to do with one that failed, how long the next is, when to stop."""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.lagrangian.compiled import compiled, inlined, inner
from exudyn_flexlink.engines.lagrangian.event_functions import EventData, interpolate
from exudyn_flexlink.engines.lagrangian.lengths import length_of, scale_at
from exudyn_flexlink.engines.lagrangian.mode import (
    Equations,
    Instant,
    Mode,
    coordinates_at,
    equations_of,
)
from exudyn_flexlink.engines.lagrangian.radau import (
    DIVERGED,
    SOLVED,
    Aim,
    Work,
    estimate,
    factor,
    factor_real,
    finish,
    guess,
    iterate,
    method_of,
    work_of,
)
from exudyn_flexlink.engines.lagrangian.step_control import (
    ITERATED,
    OLD_ERROR,
    OLD_STEP,
    PAIR,
    REJECTED,
    SLOW,
    STEP,
    STEPS,
    TROUBLE,
    Buffer,
    Control,
    change_of_step,
    longest_step,
    shortest_step,
)
from exudyn_flexlink.engines.lagrangian.step_functions import StepFunctions
from exudyn_flexlink.engines.lagrangian.stiffness import presses, pressing_at
from exudyn_flexlink.engines.lagrangian.track_point import FINE
from exudyn_flexlink.engines.lagrangian.wall_events import NONE, Step
from exudyn_flexlink.integrate.collocation import Collocation as Method
from exudyn_flexlink.integrate.control import SAFETY

Means = tuple[Method, Control, Work, FloatArray, StepFunctions]  # the array is `Buffer.memory`

FULL, THERE, LOOK, STUCK, TOUCH = range(5)  # why `advance` ended
LEAST = 0.2  # of a step that was cut at a touch: the next one is no shorter


@inlined
def _start(h: float, method: Method, work: Work) -> None:
    """Speeds to start the iteration with where no last step is known: of steady acceleration."""
    speeds, nodes, begin = work.speeds, method.nodes, work.begin
    stages, free = speeds.shape
    for i in range(stages):
        for j in range(free):
            speeds[i, j] = nodes[i] * h * begin[free + j]


@inlined
def _slip(h: float, method: Method, work: Work) -> float:
    """How far from P at the step's end the integral of its velocity takes it, m.

    P follows from the guide's angle: a bend of the track between two stages, or a jump of P, shows
    in no coordinate that is solved for.
    """
    way, matrix = work.way, method.matrix
    stages = len(matrix)
    x, y = way[stages, 0] - way[0, 0], way[stages, 1] - way[0, 1]
    for m in range(stages):
        weight = h * matrix[stages - 1, m]
        x -= weight * way[1 + m, 2]
        y -= weight * way[1 + m, 3]
    return float(np.sqrt(x * x + y * y))


@inlined
def _attempt(
    at: Instant,
    h: float,
    past: tuple[FloatArray, bool],
    equations: Equations,
    means: Means,
) -> tuple[float, float, float]:
    """Make one step of at most h, whatever it takes.

    `past` are the changes of the last step, and whether there are any. Return the length of the
    step, 0 if none is short enough, its error in parts of the tolerance, and how much longer the
    next may be.
    """
    method, control, work, memory, functions = means
    stages, free = work.speeds.shape
    last, plain, end = past[0], not past[1], stages - 1
    pressing = pressing_at(at, equations)
    by_q, by_v = functions.slopes(at, pressing, equations)
    scale = scale_at(at, equations, control.reaches)
    known, tableau = (equations, scale), (method.nodes, method.matrix)
    most = np.inf
    h = functions.before_step(at, h, (work.begin, control.bend, memory), known, tableau)
    while h >= shortest_step(at.t):
        factor(h, by_q, by_v, method, work)
        if plain:
            _start(h, method, work)
        else:
            guess(h / memory[OLD_STEP], last, method, work)
        aim = Aim(control.tolerance, control.lasting, memory[SLOW])
        how = (method, scale, work, functions.rate_at)
        ended, iterations, memory[SLOW] = iterate(at, h, aim, equations, how)
        memory[ITERATED] += iterations
        if ended == SOLVED:
            begin = work.begin[free : 2 * free]
            missed = 0.0
            if presses(pressing):
                within = (work.states, work.near, method.nodes, method.matrix, method.powers)
                slack, sped = functions.force_jumps(at, h, pressing, equations, within)
                slack_q, slack_v = functions.slopes(at, slack, equations)
                factor_real(h, slack_q, slack_v, method, work)
                missed = control.tau * length_of(sped, scale)
            error = max(missed, estimate(h, by_q, begin, control.tau, (method, scale, work)))
            slipped = _slip(h, method, work) / control.tolerance
            error = max(error / control.tolerance, slipped ** ((stages + 1) / (2 * stages)), 1e-12)
            change = change_of_step(h, error, iterations, past[1], memory)
            after = Instant(at.t + h, work.states[end], work.near[end])
            bends = (work.rates[end], control.bend, memory)
            part = functions.after_step((at, after), h, bends, known, tableau)
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
        for j in range(len(y)):
            changes[i, j] = scratch[i, j] - y[j]


@inlined
def _end_at_touch(
    at: Instant,
    whole: float,
    changes: FloatArray,
    equations: Equations,
    means: Means,
) -> tuple[float, int]:
    """Cut a step where the first pair of link and guide begins or ceases to touch.

    The step is made anew to end there, since its end is known to a higher order than what is
    within, and then cut, or lengthened, by the little that is left. Return its length and the pair,
    or `NONE`; `changes` (s, size) are changed.
    """
    method, control, work, memory, functions = means
    stages, free = work.speeds.shape
    step = Step(at, whole, changes, method.powers)
    part, pair = functions.change_within(NONE, step, equations)
    if pair == NONE:
        return whole, NONE
    _cut(part, at.y, changes, method, work.states)
    h = part * whole
    if h < shortest_step(at.t):
        return h, pair
    known, speeds = changes.copy(), work.speeds
    for i in range(stages):
        for j in range(free):
            speeds[i, j] = changes[i, free + j]
    by_q, by_v = functions.slopes(at, pressing_at(at, equations), equations)
    factor(h, by_q, by_v, method, work)
    scale = scale_at(at, equations, control.reaches)
    aim = Aim(control.tolerance, control.lasting, memory[SLOW])
    how = (method, scale, work, functions.rate_at)
    ended, iterations, memory[SLOW] = iterate(at, h, aim, equations, how)
    memory[ITERATED] += iterations
    if ended == SOLVED:
        finish(at.y, h, method, work, changes)
        step = Step(at, h, changes, method.powers)
        part, again = functions.change_within(pair, step, equations)
        if again != NONE:
            _cut(part, at.y, changes, method, work.states)
            return part * h, again
    for i in range(stages):
        for j in range(len(at.y)):
            changes[i, j] = known[i, j]
    return h, pair


@inlined
def _beginning(at: Instant, going_on: bool, equations: Equations, means: Means) -> Instant:
    """Rates and P at the start of a step; of one that goes on from the last they are known."""
    work = means[2]
    if going_on:  # a step's last stage is its end, where the iteration left its rates
        begin, rates, way, stages = work.begin, work.rates, work.way, len(work.near)
        for j in range(len(at.y)):
            begin[j] = rates[stages - 1, j]
        for j in range(4):
            way[0, j] = way[stages, j]
        return at
    near, _ = means[4].rate_at(at, equations, work.begin, work.way[0])
    return Instant(at.t, at.y, near)


@compiled
def advance(  # noqa: PLR0913, PLR0917 - each of them another record
    stop: float,
    mode: Mode,
    how: tuple[Method, Control, Work],
    event_data: EventData,
    buffer: Buffer,
    functions: StepFunctions,
) -> tuple[int, int]:
    """Integrate from the buffer's first state; return the number of steps, and why it ended.

    It ends where the buffer is full, at `stop`, after a step that must be looked at, or where no
    step is short enough.
    """
    method, control, work = method_of(*how[0]), how[1], work_of(*how[2])
    equations = equations_of(mode)
    mode = equations.mode
    memory, stages, size = buffer.memory, len(method.nodes), len(buffer.states[0])
    free = len(equations.c.inertias) - int(mode.drive[0])
    means = (method, control, work, memory, functions)
    t, wanted = buffer.times[0], memory[STEP]
    memory[SLOW] = np.inf  # an event may have changed the equations
    done, ended = 0, FULL
    while done < len(buffer.changes) and ended == FULL:
        ahead = stop - t
        if ahead <= shortest_step(t):
            ended = THERE
            break
        y = buffer.states[done]
        wanted = min(wanted, longest_step((t, y, wanted), free, mode, control))
        # The last step ends at the stop; the one before is no longer than what it leaves.
        planned = ahead
        if wanted < ahead * (1 - 1e-9):
            planned = min(wanted, max(ahead / 2, shortest_step(t)))
        at = _beginning(Instant(t, y, buffer.places[done]), done > 0, equations, means)
        past = (buffer.changes[max(done - 1, 0)], done > 0)
        h, error, change = _attempt(at, planned, past, equations, means)
        if h == 0.0:
            ended = STUCK
            break
        changes, end = buffer.changes[done], buffer.states[done + 1]
        finish(y, h, method, work, changes)
        near, whole = work.near[stages - 1], h
        if len(mode.touching) > 0:
            h, pair = _end_at_touch(at, whole, changes, equations, means)
            if pair != NONE:
                memory[PAIR], ended = pair, TOUCH
                interpolate(1.0, y, changes, method.powers, end)
                near = coordinates_at(Instant(t + h, end, near), equations)[3]
        for j in range(size):
            end[j] = y[j] + changes[stages - 1, j]
        t = stop if h == ahead else t + h
        buffer.times[done + 1], buffer.places[done + 1] = t, near
        memory[OLD_STEP], memory[OLD_ERROR] = h, max(error, 1e-2)
        memory[STEPS] += 1
        done += 1
        after = Instant(t, end, near)
        if not functions.uneventful(at, after, (changes, method.powers), equations, event_data):
            ended = LOOK
        wanted = max(h * change, wanted if h == ahead else 0.0, LEAST * whole)
    memory[STEP] = wanted
    return done, ended
