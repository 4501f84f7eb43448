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

from exudyn_flexlink.engines.clock import instant
from exudyn_flexlink.engines.exudyn.contact_log import Entry
from exudyn_flexlink.engines.exudyn.faces import Touch
from exudyn_flexlink.engines.exudyn.minimal.contacts import Side
from exudyn_flexlink.engines.exudyn.minimal.control import ErrorControl
from exudyn_flexlink.engines.exudyn.minimal.coordinates import Held
from exudyn_flexlink.engines.exudyn.minimal.finding import EVENT_TIME, NOTHING, Finder, Found, Goal
from exudyn_flexlink.engines.exudyn.minimal.guided import DeadCentreError
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.engines.exudyn.minimal.radau import (
    Evaluation,
    NoConvergenceError,
    Step,
)
from exudyn_flexlink.engines.exudyn.minimal.stepper import IN_CONTACT, Stepper
from exudyn_flexlink.engines.exudyn.minimal.wall_events import WallWatch
from exudyn_flexlink.engines.exudyn.reporting import (
    LOCKED_ADVICE,
    NO_SOLUTION,
    no_solution_advice,
)
from exudyn_flexlink.engines.walls import BROKEN_WALL_ADVICE, broken_wall

FloatArray = NDArray[np.float64]

SECONDS_BETWEEN_REPORTS = 0.1
MOST_AT_ONCE = 200


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
class MinimalLoop:
    """Integrates a tree model to `end` (s) over `stops`, where drives bend."""

    model: MinimalModel
    control: ErrorControl
    observer: Observer
    end: float
    stops: list[float]
    half_periods: list[float]  # of the contacts, s
    goal: Goal | None = None
    progress: Callable[[float], None] | None = None
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
    _stepper: Stepper | None = None

    @property
    def time(self) -> float:
        """Where the run is, s."""
        return 0.0 if self._stepper is None else self._stepper.time

    @property
    def iterations(self) -> int:
        """Newton's iterations so far."""
        return 0 if self._stepper is None else self._stepper.radau.iterations

    @property
    def rounded(self) -> list[float]:
        """Instants (s) of steps on dead centres, where rounding decided on errors."""
        return [] if self._stepper is None else self._stepper.rounded

    def interrupt(self) -> None:
        """End the run after the step that is under way."""
        self.interrupted = True

    def run(self) -> tuple[str, str]:
        """Integrate to the end; return what went wrong and what to try, empty if nothing."""
        self._told = monotonic()
        try:
            self._stepper = stepper = self._started()
            self.observer.begin(stepper.at)
            for stop in [*self.stops, self.end]:
                while stop - self.time > instant(stop, EVENT_TIME) and not self._over():
                    self._advance(stepper, stop)
        except DeadCentreError as error:
            return str(error), LOCKED_ADVICE
        except NoConvergenceError as error:
            locked = "" if self._stepper is None else self._stepper.locked()
            if locked:
                return locked, LOCKED_ADVICE
            tolerance = self.control.tolerance if self.control.fixed is None else None
            shortest = instant(self.time, EVENT_TIME)
            advice = no_solution_advice(self.model.assembly, tolerance, shortest, self.time)
            return f"{NO_SOLUTION} ({error})", advice
        finally:
            if self.time < self.end * (1 - 1e-9):
                self.observer.mark()  # stopped early: the last state is kept
        return "", ""

    def _over(self) -> bool:
        return bool(self.stop_reason) or self.reached or self.interrupted

    def _started(self) -> Stepper:
        x, v = self.model.start
        for contact in self.model.contacts:
            if contact.touch(x, v).gap < -NOTHING:
                contact.side = Side.BEHIND
        finder = Finder(self.model, self.goal, x, v)
        if finder.walls is not None:
            self._wall_events(finder.walls)
        return Stepper(self.model, self.control, finder, self.half_periods, self.end)

    # --- steps --------------------------------------------------------------------------------

    def _advance(self, stepper: Stepper, stop: float) -> None:
        """Make one step, no further than to `stop`."""
        step = stepper.attempt(stop)
        found = stepper.finder.first(step)
        close = instant(step.end, EVENT_TIME)
        if found is not None and found.time < step.t + close:
            self._at_once += 1
            if self._at_once > MOST_AT_ONCE:
                raise NoConvergenceError("events follow one another at one instant")
            self._cross(stepper, found)
            return
        self._at_once = 0
        if found is not None and found.time < step.end - close:
            landed = stepper.landed(found)
            if landed is None:
                return
            step = landed
        self._accept(stepper, step)
        if found is not None:
            self._cross(stepper, found)

    def _accept(self, stepper: Stepper, step: Step) -> None:
        end = stepper.accept(step)
        self.steps += 1
        self.largest_step = max(self.largest_step, step.h)
        self.smallest_step = min(self.smallest_step, step.h)
        for contact, touch in stepper.finder.contacts():
            if contact.acts:
                contact.peak = max(contact.peak, contact.force(touch))
        self.observer.take(step, end)
        walls = stepper.finder.walls
        if walls is not None and (broken := walls.broken()) is not None:
            self.stop_reason, self.stop_advice = broken_wall(broken), BROKEN_WALL_ADVICE
        if any(contact.acts for contact in self.model.contacts):
            self.observer.mark()  # even samples miss the peaks of a contact's force
        if self.progress is not None and monotonic() - self._told > SECONDS_BETWEEN_REPORTS:
            self._told = monotonic()
            self.progress(min(self.time / self.end, 1.0))

    # --- events -------------------------------------------------------------------------------

    def _cross(self, stepper: Stepper, found: Found) -> None:
        """Work off an event at the present instant."""
        if found.goal:
            self.reached = True
            return
        before = stepper.h
        if found.guide >= 0:
            guide = self.model.coordinates.points[found.guide]
            if not guide.next_piece(found.way, self.time):
                self.stop_reason = f"the point of slot '{guide.slot.name}' reached the curve's end"
                self.stop_advice = "lengthen the curve, or end the run before"
                return
        elif found.turn:
            stepper.turn()
            return
        elif found.wall >= 0:
            assert stepper.finder.walls is not None
            self._wall_events(stepper.finder.walls, found.wall)
            stepper.bend()
            return
        else:
            self._contact_event(found.contact, stepper.finder.touches[found.contact])
            self.observer.mark()
            half = self.half_periods[found.contact]
            if self.model.contacts[found.contact].acts:
                before = min(before, IN_CONTACT * half)
        stepper.restart()
        if self.control.fixed is None:
            stepper.h = before

    def _contact_event(self, k: int, touch: Touch) -> None:
        contact = self.model.contacts[k]
        if not contact.acts and contact.beside(touch):
            contact.side = Side.BEHIND if touch.gap_rate < 0 else Side.APART
        elif contact.side is Side.BEHIND:
            contact.side = Side.APART
        elif contact.side is Side.APART:
            contact.side, contact.peak = Side.PRESSED, 0.0
            self._tell(k, "contact begins", touch)
        else:
            off = min(touch.place, contact.length - touch.place) < min(-touch.gap, 1e-9)
            contact.side = Side.BEHIND if off else Side.APART
            self._tell(k, "leaves the face" if off else "contact ends", touch)

    def _wall_events(self, walls: WallWatch, first: int = -1) -> None:
        """Let a pair of link and guide, if any, begin or cease to press, and others that do so."""
        before = len(self.model.contacts)
        others = [k for k in walls.changed().tolist() if k != first]
        for k in [first, *others] if first >= 0 else others:
            self.model.walls.change(k)
            kind = "contact begins" if self.model.walls.touching[k] else "contact ends"
            touch = walls.touch(k)
            self.entries.append(Entry(self.time, before + k, kind, touch, -touch.gap_rate, 0.0))
            self.observer.note()

    def _tell(self, k: int, kind: str, touch: Touch) -> None:
        peak = self.model.contacts[k].peak
        self.entries.append(Entry(self.time, k, kind, touch, -touch.gap_rate, peak))
        self.observer.note()
