"""The mechanism as the integration sees it: where it is, what happens within a step and at events.

`system` knows the equations and the event functions; what a step did goes to the recorder.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from math import inf
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.lagrangian.instability import Instability
from exudyn_flexlink.engines.lagrangian.mode import Mode
from exudyn_flexlink.engines.lagrangian.recording import Recorder
from exudyn_flexlink.engines.lagrangian.step_control import Buffer
from exudyn_flexlink.engines.lagrangian.system import System
from exudyn_flexlink.integrate.events import Event, first_fall
from exudyn_flexlink.integrate.explicit import Dense

EventFunctions = Callable[[float, FloatArray], Sequence[float]]

SLOPE = 1e-4  # of a step: over which the rates of event functions are taken


class Pair(NamedTuple):
    """A pair of link and guide, of this number, begins or ceases to touch."""

    pair: int


@dataclass
class LagrangianProblem:
    """A system with its recorder, at a time (s) and in a state."""

    system: System
    recorder: Recorder
    instability: Instability
    time: float = 0.0
    state: FloatArray = field(default_factory=lambda: np.zeros(0))

    @property
    def over(self) -> bool:
        """Whether the run ends here."""
        return self.system.over

    def begin(self) -> None:
        """Take up the state at time 0."""
        self.system.begin()
        self.state = self.system.start
        self.recorder.after(0.0, self.state, False)

    def cross(self, event: Event) -> float:
        """Change the equations; the next step may be as long as the last."""
        if isinstance(event.what, Pair):
            self.system.touch(event.time, self.state, event.what.pair)
            return inf
        k, off_an_end = divmod(event.what - 3, 3)
        contacts = self.system.contacts
        if 0 <= k < len(contacts) and (off_an_end or contacts[k].rigid):  # its force jumps
            self.recorder.keep_last(float(np.nextafter(event.time, 0.0)), self.state)
        self.state = self.system.cross(event.time, np.array(self.state), event.what)
        self.system.track.settle()
        self.recorder.after(event.time, self.state, True)
        return inf

    def locate(
        self, event_functions: EventFunctions, begin: float, end: float, dense: Dense
    ) -> Event | None:
        """Locate the first fall of an event function in a step between two instants."""
        looks: dict[float, Sequence[float]] = {}
        bit = SLOPE * (end - begin)

        def value(which: int, t: float) -> float:
            if t not in looks:
                looks[t] = event_functions(t, dense(t))
            return looks[t][which]

        def rate(which: int, t: float) -> float:
            return value(which, min(t + bit, end)) - value(which, max(t - bit, begin))

        value(0, end)
        falls = [
            (first_fall(partial(value, which), partial(rate, which), (begin, end)), which)
            for which in range(len(looks[end]))
        ]
        return min(
            (Event(time, which) for time, which in falls if time is not None),
            key=lambda event: event.time,
            default=None,
        )

    def accept_block(self, steps: Buffer, mode: Mode) -> None:
        """Go to the end of steps in which nothing happened, and record them."""
        self.instability.follow(steps.times, steps.states, steps.places)
        self.time, self.state = float(steps.times[-1]), steps.states[-1].copy()
        self.system.track.at_rest(float(steps.places[-1]))
        self.recorder.take(steps, mode)

    # --- of the explicit method ---------------------------------------------------------------

    def rate(self, t: float, y: FloatArray) -> FloatArray:
        """dy/dt."""
        return self.system.rate(t, y)

    def longest(self, t: float, y: FloatArray) -> float:  # noqa: ARG002
        """Limit of the next step, s."""
        return self.system.longest_step(y)

    def first_event(self, begin: float, end: float, dense: Dense) -> Event | None:
        """Locate what happens first in a step between two instants."""
        if self.system.quiet(end - begin, end, dense(end)):
            return None
        return self.locate(self.system.event_functions, begin, end, dense)

    def accept(self, end: float, dense: Dense, event: Event | None) -> None:
        """Go to the end of a step, where something may happen, and record it."""
        self._follow(end)
        self.recorder.before(end, dense)
        self.time, self.state = end, np.array(dense(end))
        if event is None:
            self.recorder.after(end, self.state, False)

    def _follow(self, end: float) -> None:
        """Hand a single step on, which an event may have left no length."""
        if end <= self.time:
            return
        times, place = np.array([self.time, end]), np.array([self.system.track.u])
        self.instability.follow(times, self.state[None], place)
