"""Many steps at once: what to do with one that failed, how long the next is, when to stop."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.lagrangian.compiled import (
    borrowed,
    by_reference,
    compiled,
    for_python,
    inlined,
    inner,
)
from exudyn_flexlink.engines.lagrangian.event_functions import EventData, Step, interpolate
from exudyn_flexlink.engines.lagrangian.lengths import Scale, length_of, scale_at
from exudyn_flexlink.engines.lagrangian.mode import (
    Instant,
    Mode,
    coordinates_at,
)
from exudyn_flexlink.engines.lagrangian.radau import (
    DIVERGED,
    SOLVED,
    Aim,
    estimate,
    factor_real,
    finish,
    guess,
)
from exudyn_flexlink.engines.lagrangian.step_arrays import Work
from exudyn_flexlink.engines.lagrangian.step_control import (
    ITERATED,
    OLD_ERROR,
    OLD_STEP,
    PAIR,
    SLOWNESS,
    STEP,
    TROUBLE,
    Buffer,
    Control,
    change_of_step,
    longest_step,
    shortest_step,
)
from exudyn_flexlink.engines.lagrangian.stiffness import presses, pressing_at
from exudyn_flexlink.engines.lagrangian.track_point import FINE
from exudyn_flexlink.engines.lagrangian.wall_events import NONE
from exudyn_flexlink.integrate.collocation import Collocation as Method
from exudyn_flexlink.integrate.control import SAFETY

FULL, THERE, LOOK, STUCK, TOUCH = range(5)  # why `advance` ended
LEAST_AFTER_TOUCH = 0.2  # of a step that was cut at a touch: the next one is no shorter


class Means(NamedTuple):
    """What steps are made by."""

    method: Method
    control: Control
    work: Work
    memory: FloatArray  # (8,) what the next call goes on with, see `step_control`
    # Functions that are called by address, see `addresses`: what takes long to compile comes first.
    change_within: Callable[..., Any]  # touches of link and guide
    factor: Callable[..., Any]
    iterate: Callable[..., Any]
    rate_at: Callable[..., Any]
    slopes: Callable[..., Any]
    force_jumps: Callable[..., Any]
    after_step: Callable[..., Any]  # knots
    uneventful: Callable[..., Any]


MeansByReference, means_of = by_reference(Means, "MeansByReference", __name__)


@compiled
def _means_given(fields: tuple[Any, ...]) -> Means:
    return means_of(*borrowed(fields))


means_made = for_python(_means_given)


@inlined
def _start(h: float, method: Method, work: Work) -> None:
    """Speeds to start the iteration with where no last step is known: of steady acceleration."""
    speeds, nodes, begin = work.speeds, method.nodes, work.begin
    stages, free = speeds.shape
    for i in range(stages):
        for j in range(free):
            speeds[i, j] = nodes[i] * h * begin[free + j]


@inlined
def _drift(h: float, method: Method, work: Work) -> float:
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
def _iterated(at: Instant, h: float, scale: Scale, mode: Mode, means: Means) -> tuple[int, int]:
    """Solve for the stages of a step; return how that ended, and the number of iterations."""
    control, memory = means.control, means.memory
    aim = Aim(control.tolerance, control.lasting, memory[SLOWNESS])
    how = (means.method, scale, means.work, means.rate_at)
    ended, iterations, memory[SLOWNESS] = means.iterate(at, h, aim, mode, how)
    memory[ITERATED] += iterations
    return ended, iterations


@inlined
def _attempt(
    at: Instant,
    h: float,
    past: tuple[FloatArray, bool],
    mode: Mode,
    means: Means,
) -> tuple[float, float, float]:
    """Make one step of at most h, whatever it takes.

    `past` are the changes of the last step, and whether there are any. Return the length of the
    step, 0 if none is short enough, its error in parts of the tolerance, and how much longer the
    next may be.
    """
    method, control, work, memory = means.method, means.control, means.work, means.memory
    stages, free = work.speeds.shape
    last, plain, end = past[0], not past[1], stages - 1
    pressing = pressing_at(at, mode)
    by_q, by_v = means.slopes(at, pressing, mode)
    scale = scale_at(at, mode, control.reaches)
    most = np.inf
    while h >= shortest_step(at.t):
        means.factor(h, by_q, by_v, method, work)
        if plain:
            _start(h, method, work)
        else:
            guess(h / memory[OLD_STEP], last, method, work)
        ended, iterations = _iterated(at, h, scale, mode, means)
        if ended == SOLVED:
            begin = work.begin[free : 2 * free]
            missed = 0.0
            if presses(pressing):
                slack, sped = means.force_jumps(at, h, pressing, mode, (method, work))
                slack_q, slack_v = means.slopes(at, slack, mode)
                factor_real(h, slack_q, slack_v, method, work)
                missed = control.tau * length_of(sped, scale)
            error = max(missed, estimate(h, by_q, begin, control.tau, (method, scale, work)))
            drifted = _drift(h, method, work) / control.tolerance
            error = max(error / control.tolerance, drifted ** ((stages + 1) / (2 * stages)), 1e-12)
            change = change_of_step(h, error, iterations, past[1], memory)
            after = Instant(at.t + h, work.states[end], work.near[end])
            bends = (work.rates[end], control.bend, memory)
            part = means.after_step((at, after), h, bends, (mode, scale), method)
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
    mode: Mode,
    means: Means,
) -> tuple[float, int]:
    """Cut a step where the first pair of link and guide begins or ceases to touch.

    The step is made anew to end there, since its end is known to a higher order than what is
    within, and then cut, or lengthened, by the little that is left. Return its length and the pair,
    or `NONE`; `changes` (s, size) are changed.
    """
    method, control, work = means.method, means.control, means.work
    stages, free = work.speeds.shape
    step = Step(at, whole, changes, method.powers)
    part, pair = means.change_within(NONE, step, mode)
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
    by_q, by_v = means.slopes(at, pressing_at(at, mode), mode)
    means.factor(h, by_q, by_v, method, work)
    scale = scale_at(at, mode, control.reaches)
    ended, _ = _iterated(at, h, scale, mode, means)
    if ended == SOLVED:
        finish(at.y, h, method, work, changes)
        step = Step(at, h, changes, method.powers)
        part, again = means.change_within(pair, step, mode)
        if again != NONE:
            _cut(part, at.y, changes, method, work.states)
            return part * h, again
    for i in range(stages):
        for j in range(len(at.y)):
            changes[i, j] = known[i, j]
    return h, pair


@inlined
def _beginning(at: Instant, going_on: bool, mode: Mode, means: Means) -> Instant:
    """Rates and P at the start of a step; of one that goes on from the last they are known."""
    work = means.work
    if going_on:  # a step's last stage is its end, where the iteration left its rates
        begin, rates, way, stages = work.begin, work.rates, work.way, len(work.near)
        for j in range(len(at.y)):
            begin[j] = rates[stages - 1, j]
        for j in range(4):
            way[0, j] = way[stages, j]
        return at
    near, _ = means.rate_at(at, mode, work.begin, work.way[0])
    return Instant(at.t, at.y, near)


@compiled
def advance(
    stop: float,
    mode: Mode,
    means: Means,
    event_data: EventData,
    buffer: Buffer,
) -> tuple[int, int]:
    """Integrate from the buffer's first state; return the number of steps, and why it ended.

    It ends where the buffer is full, at `stop`, after a step that must be looked at, or where no
    step is short enough.
    """
    method, control, work, memory = means.method, means.control, means.work, means.memory
    stages, size = len(method.nodes), len(buffer.states[0])
    free = len(mode.constants.inertias) - int(mode.drive[0])
    t, wanted = buffer.times[0], memory[STEP]
    memory[SLOWNESS] = np.inf  # an event may have changed the equations
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
        at = _beginning(Instant(t, y, buffer.places[done]), done > 0, mode, means)
        past = (buffer.changes[max(done - 1, 0)], done > 0)
        h, error, change = _attempt(at, planned, past, mode, means)
        if h == 0.0:
            ended = STUCK
            break
        changes, end = buffer.changes[done], buffer.states[done + 1]
        finish(y, h, method, work, changes)
        near, whole = work.near[stages - 1], h
        if len(mode.touching) > 0:
            h, pair = _end_at_touch(at, whole, changes, mode, means)
            if pair != NONE:
                memory[PAIR], ended = pair, TOUCH
                interpolate(1.0, y, changes, method.powers, end)
                near = coordinates_at(Instant(t + h, end, near), mode)[3]
        for j in range(size):
            end[j] = y[j] + changes[stages - 1, j]
        t = stop if h == ahead else t + h
        buffer.times[done + 1], buffer.places[done + 1] = t, near
        memory[OLD_STEP], memory[OLD_ERROR] = h, max(error, 1e-2)
        done += 1
        step = Step(at, h, changes, method.powers)
        if not means.uneventful(step, Instant(t, end, near), mode, event_data):
            ended = LOOK
        wanted = max(h * change, wanted if h == ahead else 0.0, LEAST_AFTER_TOUCH * whole)
    memory[STEP] = wanted
    return done, ended
