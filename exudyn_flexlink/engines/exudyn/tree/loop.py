"""The step loop of a tree: error-controlled Radau steps, each ending where something happens.

After every step it is looked whether a contact began or ended, or a slot's point came to the end of
its piece, within the step. If so the step is made anew, up to that instant, where the equations
change and the integration starts afresh: no force has a kink inside a step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from math import inf
from time import monotonic
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from exudyn_flexlink.engines.exudyn.contact_log import Entry
from exudyn_flexlink.engines.exudyn.faces import Touch
from exudyn_flexlink.engines.exudyn.reporting import (
    LOCKED_ADVICE,
    NO_SOLUTION,
    NO_SOLUTION_ADVICE,
)
from exudyn_flexlink.engines.exudyn.tree.contacts import Side, TreeContact
from exudyn_flexlink.engines.exudyn.tree.guided import DeadCentreError
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
EVENT_TIME = 1e-13  # s: to which events are found
LOOKS = 8  # within a step in which a contact may have begun or ended
SHORTEST = 1e-13  # of the run
LEAST_GROWTH, MOST_GROWTH = 0.1, 5.0
SAFETY = 0.9
KEEP = (0.9, 1.2)  # a step that may grow by a factor between these stays, with its matrices
AFTER_EVENT = 0.1  # of the step before: the first step after an event, unless it is a contact's
IN_CONTACT = 0.15  # of the contact's half period: the first step in it
NOTHING = 1e-14  # m: a gap this small is closed
MOST_AT_ONCE = 200
SEAM = 1e-12  # of a curve's parameter: this little beyond a piece is on it
LARGEST_TURN = 0.3  # rad per step of a guide: the search for the slot's point stays local


class Chooser(Protocol):
    """What error (m) a step may make; or the step itself (s), whatever its error."""

    @property
    def fixed(self) -> float | None:
        """Length of all steps, None if their error decides."""

    def allowed(self) -> float:
        """Error that one step may make, m."""


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


@dataclass(frozen=True)
class Found:
    """What happened first within a step: when (s), and to which contact or slot guide."""

    time: float
    contact: int = -1
    guide: int = -1
    way: int = 0
    goal: bool = False


@dataclass
class TreeLoop:
    """Integrates a tree model to `end` (s) over `stops`, where drives bend."""

    model: TreeModel
    chooser: Chooser
    observer: Observer
    end: float
    stops: list[float]
    half_periods: list[float]  # of the contacts, s
    goal: Callable[[FloatArray], float] | None = None  # angle still to turn, of all coordinates
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
    rejected: int = 0  # steps whose error was too large
    unsolved: int = 0  # steps whose equations were not solved
    _told: float = 0.0
    _at_once: int = 0
    _before: tuple[float, float] | None = None  # length and error ratio of the last step

    def interrupt(self) -> None:
        """End the run after the step that is under way."""
        self.interrupted = True

    def run(self) -> tuple[str, str]:
        """Integrate to the end; return what went wrong and what to try, empty if nothing."""
        model = self.model
        self.radau = Radau(model)
        x, v = model.start
        self._state = State(x[model.free], v[model.free], v[model.free])
        self._h = 1e-3 * self.end if self.chooser.fixed is None else self.chooser.fixed
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
            if self.radau.trouble:
                return self.radau.trouble, LOCKED_ADVICE
            return f"{NO_SOLUTION} ({error})", NO_SOLUTION_ADVICE
        finally:
            if self.time < self.end * (1 - 1e-9):
                self.observer.mark()  # stopped early: the last state is kept
        return "", ""

    def _over(self) -> bool:
        return bool(self.stop_reason) or self.reached or self.interrupted

    def _look_at_start(self, x: FloatArray, v: FloatArray) -> None:
        for contact in self.model.contacts:
            if contact.touch(x, v).gap < -NOTHING:
                contact.side = Side.BEHIND
        self._touches = [contact.touch(x, v) for contact in self.model.contacts]

    def _restart(self) -> None:
        """Begin anew from the present state: the equations have changed."""
        self.radau.restart()
        self.model.forget()
        self._before = None
        q, v, _ = self._state
        self._at = self.model.evaluate(self.time, q, v)
        self._state = State(q, v, self.model.accelerations(self._at))

    # --- steps --------------------------------------------------------------------------------

    def _advance(self, stop: float) -> None:
        """Make one step, no further than to `stop`."""
        step = self._try(stop)
        found = self._first(step)
        if found is not None and found.time < step.t + EVENT_TIME:
            self._at_once += 1
            if self._at_once > MOST_AT_ONCE:
                raise NoConvergenceError("events follow one another at one instant")
            self._cross(found)
            return
        self._at_once = 0
        if found is not None and found.time < step.end - EVENT_TIME:
            again = self._step(found.time - step.t)
            if again is None:  # rare: reach the event from nearer
                self._h = (found.time - step.t) / 3
                return
            step = again
        self._accept(step)
        if found is not None:
            self._cross(found)

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
                raise NoConvergenceError(f"{h:.3g} s")
            step = self._step(h)
            if step is None:
                self.unsolved += 1
                h, first = h / 4, False
                continue
            if self.chooser.fixed is not None:
                return step
            ratio = step.error / self.chooser.allowed()
            factor = self._factor(h, ratio)
            if ratio <= 1:
                self._before = (h, max(ratio, 1e-2))
                factor = factor if first else min(factor, 1.0)
                low, high = KEEP
                self._h = h if low <= factor <= high else h * factor
                return step
            self.rejected += 1
            h, first = h * min(factor, 0.9), False

    def _step(self, h: float) -> Step | None:
        allowed = self.chooser.allowed()
        return self.radau.step(self.time, h, self._at, self._state, allowed)

    def _factor(self, h: float, ratio: float) -> float:
        """By how much the next step may be longer (Hairer and Wanner, eq. IV.8.25)."""
        grow = float(SAFETY * max(ratio, 1e-12) ** -0.25)
        if self._before is not None and self._before[0] > 0:
            before, then = self._before
            grow = min(grow, SAFETY * h / before * (then / max(ratio, 1e-12) ** 2) ** 0.25)
        return max(LEAST_GROWTH, min(MOST_GROWTH, grow))

    def _longest(self) -> float:
        """Limit of a step, s: guides turn a little."""
        speeds = [abs(self._at.kept.v[guide.guided.turning]) for guide in self.model.guides]
        return min([LARGEST_TURN / speed for speed in speeds if speed > 0], default=inf)

    def _accept(self, step: Step) -> None:
        self.time = step.end
        self._state = step.finish
        self._at = step.stages[-1]
        self.steps += 1
        self.largest_step = max(self.largest_step, step.h)
        self.smallest_step = min(self.smallest_step, step.h)
        end = self.model.whole(step.end, step.finish.q, step.finish.v)
        for guide, place in zip(self.model.guides, end.places, strict=True):
            guide.settle(place)
        self.model.forget()
        self.model.look(end.x)
        self._touches = [contact.touch(end.x, end.v) for contact in self.model.contacts]
        for contact, touch in zip(self.model.contacts, self._touches, strict=True):
            if contact.acts:
                contact.peak = max(contact.peak, contact.force(touch))
        self.observer.take(step, end)
        if any(contact.acts for contact in self.model.contacts):
            self.observer.mark()  # even samples miss the peaks of a contact's force
        if self.progress is not None and monotonic() - self._told > SECONDS_BETWEEN_REPORTS:
            self._told = monotonic()
            self.progress(min(self.time / self.end, 1.0))

    # --- events -------------------------------------------------------------------------------

    def _first(self, step: Step) -> Found | None:
        """What happened first within the step."""
        found = [*self._ends_of_pieces(step), *self._changes_of_contacts(step)]
        if self.goal is not None and self.goal(step.stages[-1].kept.x) < 0:
            found.append(Found(self._fall(lambda t: self._left(step, t), step), goal=True))
        return min(found, key=lambda event: event.time, default=None)

    def _coordinates(self, step: Step, t: float) -> tuple[FloatArray, FloatArray]:
        q, v = step.at(np.array([t]))
        held = self.model.whole(t, q[0], v[0])
        return held.x, held.v

    def _left(self, step: Step, t: float) -> float:
        assert self.goal is not None
        return float(self.goal(self._coordinates(step, t)[0]))

    def _fall(self, value: Callable[[float], float], step: Step) -> float:
        """Instant within the step at which a value falls to zero."""
        if value(step.t) <= 0:
            return step.t
        return float(brentq(value, step.t, step.end, xtol=EVENT_TIME, rtol=1e-15))

    def _ends_of_pieces(self, step: Step) -> list[Found]:
        found = []
        for k, guide in enumerate(self.model.guides):
            ahead, behind = guide.left(step.stages[-1].kept.places[k])
            if min(ahead, behind) < -SEAM:
                way = 1 if ahead < behind else -1
                time = self._fall(partial(self._on_piece, step, k, way), step)
                found.append(Found(time, guide=k, way=way))
        return found

    def _on_piece(self, step: Step, k: int, way: int, t: float) -> float:
        """How far a slot's point is from the end of its piece (way 1) or from its start (-1)."""
        q, v = step.at(np.array([t]))
        left = self.model.guides[k].left(self.model.whole(t, q[0], v[0]).places[k])
        return left[0] if way == 1 else left[1]

    def _changes_of_contacts(self, step: Step) -> list[Found]:
        found = []
        for k, contact in enumerate(self.model.contacts):
            time = self._change(contact, k, step)
            if time is not None:
                found.append(Found(time, contact=k))
        return found

    def _change(self, contact: TreeContact, k: int, step: Step) -> float | None:
        """When within the step a contact's state changes; None if it does not."""
        kept = step.stages[-1].kept
        before, after = self._touches[k], contact.touch(kept.x, kept.v)
        if self._surely_unchanged(contact, before, after, step.h):
            return None
        t = step.t
        for end in np.linspace(step.t, step.end, LOOKS + 1)[1:].tolist():
            if self._guard(contact, step, end) < -NOTHING:
                if self._guard(contact, step, t) <= NOTHING:
                    return self._after_touching(contact, step, t, end)
                return float(
                    brentq(lambda at: self._guard(contact, step, at), t, end, xtol=EVENT_TIME)
                )
            t = end
        return None

    @staticmethod
    def _surely_unchanged(contact: TreeContact, before: Touch, after: Touch, h: float) -> bool:
        """Tell from both ends that nothing can have changed in between.

        Gap and place stay within a cubic's reach of their ends; twice its largest way is allowed.
        """
        way = 0.5 * h * max(abs(before.gap_rate), abs(after.gap_rate))
        if contact.side is not Side.PRESSED:
            return before.gap * after.gap > 0 and min(abs(before.gap), abs(after.gap)) > way
        slid = 0.5 * h * max(abs(before.place_rate), abs(after.place_rate))
        places = (before.place, after.place)
        on_face = min(places) > slid and max(places) < contact.length - slid
        return on_face and max(before.gap, after.gap) < -way

    def _after_touching(self, contact: TreeContact, step: Step, t: float, end: float) -> float:
        """A guard that starts at zero rises first, or the contact changes at once."""
        places = [t + (end - t) * 0.5**k for k in range(1, 40)]
        top = max(places, key=lambda at: self._guard(contact, step, at))
        if self._guard(contact, step, top) <= 0:
            return t
        return float(brentq(lambda at: self._guard(contact, step, at), top, end, xtol=EVENT_TIME))

    def _guard(self, contact: TreeContact, step: Step, t: float) -> float:
        """Value (m) that is positive as long as the contact stays as it is."""
        touch = contact.touch(*self._coordinates(step, t))
        if contact.side is Side.APART:
            return touch.gap
        if contact.side is Side.BEHIND:
            return -touch.gap
        return min(-touch.gap, touch.place, contact.length - touch.place)

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
        else:
            self._contact_event(found.contact)
            self.observer.mark()
            half = self.half_periods[found.contact]
            if self.model.contacts[found.contact].acts:
                before = min(before, IN_CONTACT * half)
        self._restart()
        if self.chooser.fixed is None:
            self._h = before

    def _contact_event(self, k: int) -> None:
        contact, touch = self.model.contacts[k], self._touches[k]
        if contact.side is Side.BEHIND:
            contact.side = Side.APART
        elif contact.side is Side.APART:
            if not 0 <= touch.place <= contact.length:
                contact.side = Side.BEHIND
                return
            contact.side, contact.peak = Side.PRESSED, 0.0
            self._tell(k, "contact begins", -touch.gap_rate)
        else:
            off = min(touch.place, contact.length - touch.place) < min(-touch.gap, 1e-9)
            contact.side = Side.BEHIND if off else Side.APART
            self._tell(k, "leaves the face" if off else "contact ends", -touch.gap_rate)

    def _tell(self, k: int, kind: str, speed: float) -> None:
        contact = self.model.contacts[k]
        self.entries.append(Entry(self.time, k, kind, self._touches[k], speed, contact.peak))
        self.observer.note()
