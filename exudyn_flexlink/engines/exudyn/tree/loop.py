"""The step loop of a tree: error-controlled Radau steps, each ending where something happens.

After every step it is looked whether a contact began or ended, or its point turned back, or a
slot's point came to the end of its piece, within the step. If so the step is made anew, up to that
instant, where the equations change and the integration starts afresh: no force leaps inside a step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf
from time import monotonic
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.exudyn.contact_log import Entry
from exudyn_flexlink.engines.exudyn.pace import too_long
from exudyn_flexlink.engines.exudyn.reporting import (
    LOCKED_ADVICE,
    NO_SOLUTION,
    NO_SOLUTION_ADVICE,
)
from exudyn_flexlink.engines.exudyn.tree.collocation import WEIGHTS
from exudyn_flexlink.engines.exudyn.tree.contacts import Side
from exudyn_flexlink.engines.exudyn.tree.control import ErrorControl
from exudyn_flexlink.engines.exudyn.tree.finding import EVENT_TIME, NOTHING, Finder, Found, Goal
from exudyn_flexlink.engines.exudyn.tree.guided import AT_DEAD_CENTRE, DeadCentreError
from exudyn_flexlink.engines.exudyn.tree.model import Held, TreeModel
from exudyn_flexlink.engines.exudyn.tree.radau import (
    Evaluation,
    NoConvergenceError,
    Radau,
    State,
    Step,
)

FloatArray = NDArray[np.float64]

SECONDS_BETWEEN_REPORTS = 0.1
SHORTEST = 1e-13  # of the run
IN_CONTACT = 0.15  # of the contact's half period: the first step in it
FARTHEST_OFF = 1e-3  # of its penetration: where a contact's end may be met
SHORTEST_LOOK = 1e-3  # of a contact's half period
MOST_AT_ONCE = 200
LANDINGS = 4  # steps to the end of a face
LARGEST_TURN = 0.3  # rad per step of a guide: the search for the slot's point stays local


class Observer(Protocol):
    """Takes every step, and keeps the states it is asked to."""

    def begin(self, at: Evaluation) -> None:
        """The state at time 0."""

    def take(self, step: Step, end: Held) -> None:
        """A step was made, with these coordinates at its end."""

    def mark(self) -> None:
        """Keep the state at the end of the last step."""

    def note(self) -> None:
        """A contact began or ended there."""


@dataclass
class TreeLoop:
    """Integrates a tree model to `end` (s) over `stops`, where drives bend."""

    model: TreeModel
    control: ErrorControl
    observer: Observer
    end: float
    stops: list[float]
    half_periods: list[float]  # of the contacts, s
    goal: Goal | None = None
    progress: Callable[[float], None] | None = None
    time: float = 0.0
    steps: int = 0
    largest_step: float = 0.0
    smallest_step: float = inf
    entries: list[Entry] = field(default_factory=list)
    reached: bool = False
    interrupted: bool = False
    stop_reason: str = ""
    stop_advice: str = ""
    _told: float = 0.0
    _at_once: int = 0
    _dead: DeadCentreError | None = None

    def interrupt(self) -> None:
        """End the run after the step that is under way."""
        self.interrupted = True

    def run(self) -> tuple[str, str]:
        """Integrate to the end; return what went wrong and what to try, empty if nothing."""
        model = self.model
        self.radau = Radau(model)
        x, v = model.start
        self._state = State(x[model.free], v[model.free], v[model.free])
        self._h = 1e-3 * self.end if self.control.fixed is None else self.control.fixed
        self._told = monotonic()
        self._look_at_start(x, v)
        try:
            self._restart()
            self.observer.begin(self._at)
            for stop in [*self.stops, self.end]:
                while stop - self.time > SHORTEST * self.end and not self._over():
                    self._advance(stop)
        except DeadCentreError as error:
            return str(error), LOCKED_ADVICE
        except NoConvergenceError as error:
            if self._locked():
                return AT_DEAD_CENTRE, LOCKED_ADVICE
            return f"{NO_SOLUTION} ({error})", NO_SOLUTION_ADVICE
        finally:
            if self.time < self.end * (1 - 1e-9):
                self.observer.mark()  # stopped early: the last state is kept
        return "", ""

    def _locked(self) -> bool:
        x = self._at.kept.x
        return any(guide.grazes(x[guide.guided.turning]) for guide in self.model.guides)

    def _over(self) -> bool:
        return bool(self.stop_reason) or self.reached or self.interrupted

    def _look_at_start(self, x: FloatArray, v: FloatArray) -> None:
        for contact in self.model.contacts:
            if contact.touch(x, v).gap < -NOTHING:
                contact.side = Side.BEHIND
        self._finder = Finder(self.model, self.goal, x, v)

    def _restart(self) -> None:
        """Begin anew from the present state: the equations have changed."""
        self.radau.restart()
        self.model.forget()
        self.control.forget()
        q, v, _ = self._state
        self._at = self.model.evaluate(self.time, q, v)
        self._state = State(q, v, self.model.accelerations(self._at))

    # --- steps --------------------------------------------------------------------------------

    def _advance(self, stop: float) -> None:
        """Make one step, no further than to `stop`."""
        step = self._try(stop)
        found = self._finder.first(step)
        if found is not None and found.time < step.t + EVENT_TIME:
            self._at_once += 1
            if self._at_once > MOST_AT_ONCE:
                raise NoConvergenceError("events follow one another at one instant")
            self._cross(found)
            return
        self._at_once = 0
        if found is not None and found.time < step.end - EVENT_TIME:
            again = self._landed(found, found.time - step.t)
            if again is None or self._misses(found, again):
                self._h = (found.time - step.t) / 3  # reach the event from nearer
                return
            step = again
        self._accept(step)
        if found is not None:
            self._cross(found)

    def _landed(self, found: Found, h: float) -> Step | None:
        """Make a step of length h (s) to what was found, and so that it ends right there.

        The polynomial in which it was found is less accurate than a step's end. Off the end of a
        face that matters: a force is gone from one instant to the next.
        """
        for _ in range(LANDINGS):
            step = self._step(h)
            if step is None or found.contact < 0 or found.turn:
                return step
            contact, last = self.model.contacts[found.contact], step.stages[-1].kept
            late = contact.left_since(contact.touch(last.x, last.v))
            if abs(late) < EVENT_TIME or not 0.5 * h < h - late < 1.5 * h:
                return step
            h -= late
        return step

    def _misses(self, found: Found, step: Step) -> bool:
        """Tell that a step made anew, up to what was found, is not good enough.

        Where a force leaps its error counts anew. And a contact's end must not be met well off the
        face: a tolerance may allow more than the contact is deep, but a force that pulls there, or
        is gone too early, changes speeds by no little.
        """
        if self.control.fixed is not None or found.contact < 0:
            return False
        if found.turn:
            return not self.control.passes(step.error)
        contact = self.model.contacts[found.contact]
        if not contact.acts or step.h < SHORTEST_LOOK * self.half_periods[found.contact]:
            return False
        last = step.stages[-1].kept
        touch = contact.touch(last.x, last.v)
        off = FARTHEST_OFF * contact.peak / contact.law.stiffness
        return not contact.beside(touch) and touch.gap > off

    def _try(self, stop: float) -> Step:
        """Shorten the step until its error is allowed, and choose the next one."""
        left = stop - self.time
        h = min(self._h, self._longest())
        first = True
        while True:
            if h > 0.999999 * left:
                h = left
            elif h > 0.5 * left:
                h = left / 2
            if h < SHORTEST * self.end and h < left:
                raise self._dead or NoConvergenceError(f"{h:.3g} s")
            step = self._step(h)
            if step is None or self._slips(step):
                h, first = h / 4, False
                continue
            if self.control.fixed is not None:
                return step
            factor = self.control.factor(h, step.error)
            if self.control.passes(step.error):
                self.control.note(h, step.error)
                self._h = self.control.next(h, factor if first else min(factor, 1.0))
                return step
            h, first = h * min(factor, 0.9), False

    def _slips(self, step: Step) -> bool:
        """Tell that a slot's point did not go where its speed would have taken it.

        It jumped to another place where the guide's axis crosses the track, or went round a bend
        that the step does not resolve: neither shows in the error of the coordinates solved for.
        """
        if self.control.fixed is not None:
            return False
        for guide in self.model.guides:
            k = guide.guided.sliding
            speeds = [at.kept.v[k] for at in step.stages]
            gone = step.stages[-1].kept.x[k] - self._at.kept.x[k]
            if abs(gone - step.h * float(WEIGHTS @ speeds)) > self.control.tolerance:
                return True
        return False

    def _step(self, h: float) -> Step | None:
        self._dead = None
        try:
            return self.radau.step(self.time, h, self._at, self._state, self.control.allowed)
        except DeadCentreError as error:  # of a trial too long, or no step is short enough
            self._dead = error
            return None

    def _longest(self) -> float:
        """Limit of a step, s: guides turn a little, a point that presses comes to rest."""
        speeds = [abs(self._at.kept.v[guide.guided.turning]) for guide in self.model.guides]
        turns = [LARGEST_TURN / speed for speed in speeds if speed > 0]
        rests = [c.rests_in(touch) for c, touch in self._finder.contacts() if c.acts]
        return min([*turns, *rests, *self._paces()], default=inf)

    def _paces(self) -> list[float]:
        """Steps (s) of contacts that act, where the user's own is too long for them."""
        given = self.control.fixed
        acting = [h for c, h in zip(self.model.contacts, self.half_periods, strict=True) if c.acts]
        return [] if given is None else [IN_CONTACT * h for h in acting if too_long(given, h)]

    def _accept(self, step: Step) -> None:
        self.time = step.end
        self._state = step.finish
        self._at = step.stages[-1]
        self.steps += 1
        self.largest_step = max(self.largest_step, step.h)
        self.smallest_step = min(self.smallest_step, step.h)
        end = self.model.whole(step.end, step.finish.q, step.finish.v)
        for guide, place in zip(self.model.guides, end.places, strict=True):
            guide.settle(place, float(end.x[guide.guided.turning]))
        self.model.forget()
        self.model.look(end.x)
        self._finder.look(end.x, end.v, step.h)
        for contact, touch in self._finder.contacts():
            if contact.acts:
                contact.peak = max(contact.peak, contact.force(touch))
        self.observer.take(step, end)
        if any(contact.acts for contact in self.model.contacts):
            self.observer.mark()  # even samples miss the peaks of a contact's force
        if self.progress is not None and monotonic() - self._told > SECONDS_BETWEEN_REPORTS:
            self._told = monotonic()
            self.progress(min(self.time / self.end, 1.0))

    # --- events -------------------------------------------------------------------------------

    def _cross(self, found: Found) -> None:
        """Work off an event at the present instant."""
        if found.goal:
            self.reached = True
            return
        before = self._h
        if found.guide >= 0:
            guide = self.model.guides[found.guide]
            if not guide.next_piece(found.way, self.time):
                self.stop_reason = (
                    f"the point of slot '{guide.guided.slot.name}' reached the curve's end"
                )
                self.stop_advice = "lengthen the curve, or end the run before"
                return
        elif found.turn:
            self.radau.restart()
            self.control.forget()
            return
        else:
            self._contact_event(found.contact)
            self.observer.mark()
            half = self.half_periods[found.contact]
            if self.model.contacts[found.contact].acts:
                before = min(before, IN_CONTACT * half)
        self._restart()
        if self.control.fixed is None:
            self._h = before

    def _contact_event(self, k: int) -> None:
        contact, touch = self.model.contacts[k], self._finder.touches[k]
        if not contact.acts and contact.beside(touch):
            contact.side = Side.BEHIND if touch.gap_rate < 0 else Side.APART
        elif contact.side is Side.BEHIND:
            contact.side = Side.APART
        elif contact.side is Side.APART:
            contact.side, contact.peak = Side.PRESSED, 0.0
            self._tell(k, "contact begins", -touch.gap_rate)
        else:
            off = min(touch.place, contact.length - touch.place) < min(-touch.gap, 1e-9)
            contact.side = Side.BEHIND if off else Side.APART
            self._tell(k, "leaves the face" if off else "contact ends", -touch.gap_rate)

    def _tell(self, k: int, kind: str, speed: float) -> None:
        contact = self.model.contacts[k]
        self.entries.append(Entry(self.time, k, kind, self._finder.touches[k], speed, contact.peak))
        self.observer.note()
