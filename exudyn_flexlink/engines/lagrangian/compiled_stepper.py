"""Blocks of steps in machine code, cut at events; see `integrate.solve.Stepper`.

Only a step in which an event function may have fallen below zero is looked at here; what an event
changes is the problem's own, as under the explicit method.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from math import inf

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.lagrangian.addresses import step_functions_for
from exudyn_flexlink.engines.lagrangian.advance import LOOK, STUCK, Means, advance, means_made
from exudyn_flexlink.engines.lagrangian.compiled import numba
from exudyn_flexlink.engines.lagrangian.event_functions import Side, interpolate
from exudyn_flexlink.engines.lagrangian.mode import Mode
from exudyn_flexlink.engines.lagrangian.problem import LagrangianProblem, Pair
from exudyn_flexlink.engines.lagrangian.sampling import states_within
from exudyn_flexlink.engines.lagrangian.step_arrays import Work, method_made, work_for, work_made
from exudyn_flexlink.engines.lagrangian.step_control import (
    ITERATED,
    PAIR,
    STEP,
    TROUBLE,
    Buffer,
    Control,
)
from exudyn_flexlink.engines.lagrangian.track import TROUBLES
from exudyn_flexlink.engines.lagrangian.wall_events import NONE
from exudyn_flexlink.engines.track_follower import DeadCentreError
from exudyn_flexlink.integrate.clock import instant
from exudyn_flexlink.integrate.collocation import RADAU
from exudyn_flexlink.integrate.events import EVENT_TIME, Event
from exudyn_flexlink.integrate.problem import NoConvergenceError

FIRST_STEP = 1e-6  # s
ROOM = 256 if numba is not None else 16  # steps between looks at the user's patience


@dataclass
class CompiledStepper:
    """Makes steps of one error each, many at once, and counts them."""

    problem: LagrangianProblem
    control: Control
    first_step: float = FIRST_STEP
    steps: int = 0
    smallest: float = inf
    largest: float = 0.0
    _memory: FloatArray = field(default_factory=lambda: np.zeros(8))

    @property
    def time(self) -> float:
        """Where the integration is, s."""
        return self.problem.time

    @property
    def iterations(self) -> int:
        """Newton's iterations so far."""
        return int(self._memory[ITERATED])

    def begin(self) -> None:
        """Take up the state at time 0."""
        self.problem.begin()
        self._buffer = self._room_for(ROOM)
        self._memory[STEP] = self.first_step

    def _room_for(self, steps: int) -> Buffer:
        size = len(self.problem.system.start)
        return Buffer(
            np.zeros(steps + 1),
            np.zeros((steps + 1, size)),
            np.zeros((steps, len(RADAU.nodes), size)),
            np.zeros(steps + 1),
        )

    def compile(self) -> None:
        """Have everything compiled that steps are made by: of no step, and none within."""
        system, b = self.problem.system, self._room_for(1)
        advance(0.0, system.mode(), self._means, system.event_data(), b)
        states_within(np.zeros(0), b.times, b.states, b.changes, RADAU.powers)

    @cached_property
    def _work(self) -> Work:
        """Arrays of a step."""
        system = self.problem.system
        return work_for(len(RADAU.nodes), len(system.start), system.free)

    @cached_property
    def _means(self) -> Means:
        """What steps are made by; they borrow its arrays."""
        method, work = method_made(*RADAU), work_made(*self._work)
        functions = step_functions_for(self.problem.system.kind)
        return means_made(method, self.control, work, self._memory, *functions)

    def restart(self, longest: float, event: Event | None = None) -> None:  # noqa: ARG002
        """Go on from the present state: every block starts afresh, and takes the equations anew."""
        self._memory[STEP] = min(self._memory[STEP], longest)

    def advance(self, stop: float) -> Event | None:
        """Make a block of steps, no further than to `stop` (s); return the event at its end.

        Raises:
            DeadCentreError: the guide's angle does not tell where P is next.
            NoConvergenceError: no step is short enough.

        """
        problem, system, buffer = self.problem, self.problem.system, self._buffer
        mode, event_data = system.mode(), system.event_data()
        buffer.times[0], buffer.states[0] = problem.time, problem.state
        buffer.places[0] = system.track.u
        self._memory[PAIR] = NONE
        # An iteration that goes astray may overflow: it is not a number, hence rejected.
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            done, ended = advance(stop, mode, self._means, event_data, buffer)
        for contact, side in zip(system.contacts, event_data.sides, strict=True):
            contact.side = Side(side)
        self._take(0, done - 1 if ended == LOOK else done, mode)
        if ended == STUCK:
            self._give_up()
        event = self._look(done - 1, mode, bool(event_data.idle.all())) if ended == LOOK else None
        if event is None and self._memory[PAIR] >= 0:
            event = Event(problem.time, Pair(int(self._memory[PAIR])))
        return event

    def _take(self, first: int, last: int, mode: Mode) -> None:
        """Record steps in which nothing happened."""
        if last == first:
            return
        b = self._buffer
        steps = Buffer(
            b.times[first : last + 1],
            b.states[first : last + 1],
            b.changes[first:last],
            b.places[first : last + 1],
        )
        lengths = np.diff(steps.times)
        self.largest = max(self.largest, float(lengths.max()))
        self.smallest = min(self.smallest, float(lengths.min()))
        self.steps += last - first
        self.problem.accept_block(steps, mode)

    def _look(self, last: int, mode: Mode, idle: bool) -> Event | None:
        """Look for an event in the step with number `last`, and go to it, or to the step's end.

        Where all contacts were `idle` in it, nothing is looked for there.
        """
        b, system = self._buffer, self.problem.system
        functions = system.way_event_functions if idle else system.point_event_functions
        begin, end = float(b.times[last]), float(b.times[last + 1])
        y, changes = b.states[last].copy(), b.changes[last].copy()

        def dense(t: float) -> FloatArray:
            state, part = np.empty(len(y)), (t - begin) / (end - begin)
            interpolate(part, y, changes, RADAU.powers, state)
            return state

        event = self.problem.locate(functions, begin, end, dense)
        if event is None:
            self._take(last, last + 1, mode)
        else:
            self.steps += 1
            self.largest = max(self.largest, event.time - begin)
            if event.time - begin > instant(event.time, EVENT_TIME):
                self.smallest = min(self.smallest, event.time - begin)
            self.problem.accept(event.time, dense, event)
        if idle:
            system.settle_contacts(self.time, self.problem.state)
        return event

    def _give_up(self) -> None:
        """Say why no step is short enough: where P can't be found, that is what is wrong."""
        trouble = int(self._memory[TROUBLE])
        if trouble in TROUBLES:
            raise DeadCentreError(TROUBLES[trouble])
        raise NoConvergenceError("required step size is less than spacing between numbers")
