"""The event loop of the implicit method: blocks of steps in machine code, cut at events.

Only a step in which a guard may have fallen is looked at here; what an event changes is the
system's own, as under the explicit method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import inf

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.lagrangian.advance import (
    FULL,
    ITERATED,
    LOOK,
    PAIR,
    STEP,
    STUCK,
    TROUBLE,
    Buffer,
    Control,
    advance,
)
from exudyn_flexlink.engines.lagrangian.compiled import numba
from exudyn_flexlink.engines.lagrangian.course import Course
from exudyn_flexlink.engines.lagrangian.events import (
    EVENT_TIME,
    MOST_AT_ONCE,
    StuckError,
    first_event,
)
from exudyn_flexlink.engines.lagrangian.recording import Recorder
from exudyn_flexlink.engines.lagrangian.sampling import Block
from exudyn_flexlink.engines.lagrangian.system import System
from exudyn_flexlink.engines.lagrangian.track import TROUBLES
from exudyn_flexlink.engines.lagrangian.wall_events import NONE
from exudyn_flexlink.engines.lagrangian.watch import interpolate
from exudyn_flexlink.integrate.clock import instant
from exudyn_flexlink.integrate.collocation import Collocation

FloatArray = NDArray[np.float64]

FIRST_STEP = 1e-6  # s
JUST_AHEAD = 1e-9  # s


@dataclass
class March:
    """Integrates a system to an error per step, and counts its steps."""

    system: System
    recorder: Recorder
    method: Collocation
    control: Control
    first_step: float = FIRST_STEP
    room: int = 256 if numba is not None else 16  # steps between looks at the user's patience
    steps: int = 0
    iterations: int = 0
    smallest: float = inf
    largest: float = 0.0
    time: float = 0.0
    state: FloatArray = field(default_factory=lambda: np.zeros(0))
    _at_once: int = 0

    def run(self, y: FloatArray, stops: Sequence[float]) -> FloatArray:
        """Integrate from time 0 over the `stops`, where the equations bend, to the last of them.

        Raises:
            StuckError: the loop can't go on.

        """
        self.state = y
        self._buffer = Buffer(
            np.zeros(self.room + 1),
            np.zeros((self.room + 1, len(y))),
            np.zeros((self.room, len(self.method.nodes), len(y))),
            np.zeros(self.room + 1),
            np.zeros(10),
        )
        self._buffer.memory[STEP] = self.first_step
        self.recorder.after(self.time, y, False)
        for stop in stops:
            while stop - self.time > instant(stop, EVENT_TIME) and not self.system.over:
                self._until_event(stop)
        return self.state

    def _until_event(self, stop: float) -> None:
        """Integrate to the next event or to `stop`."""
        system, buffer, began = self.system, self._buffer, self.time
        course, watched = system.course(), system.watched()
        how, ended = (self.method, self.control), FULL
        while ended in {FULL, LOOK} and not system.over:
            buffer.times[0], buffer.states[0] = self.time, self.state
            buffer.places[0] = system.track.u
            buffer.memory[PAIR] = NONE
            # An iteration that goes astray may overflow: it is not a number, hence rejected.
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                done, ended = advance(stop, course, how, watched, buffer)
            for contact, peak in zip(system.contacts, watched.peaks, strict=True):
                contact.peak = max(contact.peak, float(peak))
            calm = done - 1 if ended == LOOK else done
            self._take(0, calm, course)
            if ended == STUCK:
                self._give_up()
            if ended == LOOK and self._look(calm, began, course):
                return
            if buffer.memory[PAIR] >= 0 and not system.over:
                self._touch(int(buffer.memory[PAIR]), began)
                return

    def _take(self, first: int, last: int, course: Course) -> None:
        """Record steps in which nothing happened."""
        if last == first:
            return
        b = self._buffer
        block = Block(
            b.times[first : last + 1],
            b.states[first : last + 1],
            b.changes[first:last],
            b.places[first : last + 1],
            course,
            self.method,
        )
        lengths = np.diff(block.times)
        self.largest = max(self.largest, float(lengths.max()))
        self.smallest = min(self.smallest, float(lengths.min()))
        self.steps += last - first
        self.iterations = int(b.memory[ITERATED])
        self.time, self.state = float(block.times[-1]), block.states[-1].copy()
        self.system.track.at_rest(float(block.places[-1]))
        self.recorder.take(block)

    def _look(self, last: int, began: float, course: Course) -> bool:
        """Look for an event in the step with number `last`; work it off if there is one."""
        b = self._buffer
        begin, end = float(b.times[last]), float(b.times[last + 1])
        dense = Dense(begin, end, b.states[last].copy(), b.changes[last].copy(), self.method)
        found = first_event(self.system.point_guards, dense, begin, end)
        if found is None:
            self._take(last, last + 1, course)
            return False
        at, which = found
        self.steps += 1
        self.largest = max(self.largest, at - begin)
        if at - begin > instant(at, EVENT_TIME):
            self.smallest = min(self.smallest, at - begin)
        self.recorder.before(at, dense)
        self.time, y = at, dense(at)
        self._count_event(began)
        self.state = self.system.cross(at, y, which)
        self.system.track.settle()
        self.recorder.after(at, self.state, True)
        return True

    def _touch(self, pair: int, began: float) -> None:
        """Work off the event of a pair of link and guide, at the end of the last step."""
        self._count_event(began)
        self.system.touch(self.time, self.state, pair)

    def _count_event(self, began: float) -> None:
        at_once = self.time - began < instant(self.time, EVENT_TIME)
        self._at_once = self._at_once + 1 if at_once else 0
        if self._at_once > MOST_AT_ONCE:
            raise StuckError("events follow one another at one instant")

    def _give_up(self) -> None:
        """Say why no step is short enough: where P can't be found next, that is what is wrong."""
        self.system.trouble = TROUBLES.get(int(self._buffer.memory[TROUBLE]), "")
        if not self.system.trouble:
            self.system.rate(self.time + JUST_AHEAD, self.state)
        raise StuckError("required step size is less than spacing between numbers")


class Dense:
    """The collocation polynomial of one step."""

    def __init__(
        self, begin: float, end: float, y: FloatArray, changes: FloatArray, method: Collocation
    ) -> None:
        self._begin, self._length = begin, end - begin
        self._y, self._changes, self._powers = y, changes, method.powers

    def __call__(self, t: float) -> FloatArray:
        """State at t."""
        at = np.empty(len(self._y))
        interpolate((t - self._begin) / self._length, self._y, self._changes, self._powers, at)
        return at
