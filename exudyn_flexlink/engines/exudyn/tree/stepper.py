"""Makes one good step of a tree: solved, accurate, where its points were to go, and on events."""

from __future__ import annotations

from math import inf

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.clock import instant
from exudyn_flexlink.engines.coasting import coasting
from exudyn_flexlink.engines.exudyn.pace import too_long
from exudyn_flexlink.engines.exudyn.tree.collocation import WEIGHTS
from exudyn_flexlink.engines.exudyn.tree.control import ErrorControl
from exudyn_flexlink.engines.exudyn.tree.finding import EVENT_TIME, Finder, Found
from exudyn_flexlink.engines.exudyn.tree.guided import DeadCentreError
from exudyn_flexlink.engines.exudyn.tree.model import Held, TreeModel
from exudyn_flexlink.engines.exudyn.tree.radau import NoConvergenceError, Radau, State, Step

FloatArray = NDArray[np.float64]

IN_CONTACT = 0.15  # of the contact's half period: the first step in it
FARTHEST_OFF = 1e-3  # of its penetration: where a contact's end may be met
SHORTEST_LOOK = 1e-3  # of a contact's half period
LANDINGS = 4  # steps to the end of a face
LARGEST_TURN = 0.3  # rad per step of a guide: the search for the slot's point stays local


class Stepper:
    """Where the integration of a tree is, and the steps from there; `h` (s) is the next one.

    `half_periods` (s) are those of the contacts, `end` (s) is that of the run.
    """

    def __init__(
        self,
        model: TreeModel,
        control: ErrorControl,
        finder: Finder,
        half_periods: list[float],
        end: float,
    ) -> None:
        self.model, self.control, self.finder = model, control, finder
        self.half_periods = half_periods
        self.radau = Radau(model, coasting(model.assembly.mechanism, end))
        self.time = 0.0
        self.h = 1e-3 * end if control.fixed is None else control.fixed
        x, v = model.start
        self._state = State(x[model.free], v[model.free], v[model.free])
        self._dead: DeadCentreError | None = None
        self.restart()

    def restart(self) -> None:
        """Begin anew from the present state: the equations have changed."""
        self.turn()
        self.model.forget()
        q, v, _ = self._state
        self.at = self.model.evaluate(self.time, q, v)
        self._state = State(q, v, self.model.accelerations(self.at))

    def turn(self) -> None:
        """Go on from the present state, where a force leaps: the last step tells nothing."""
        self.radau.restart()
        self.control.forget()

    def locked(self) -> bool:
        """Tell whether a guide's axis all but touches its track."""
        x = self.at.kept.x
        return any(guide.grazes(x[guide.guided.turning]) for guide in self.model.guides)

    def attempt(self, stop: float) -> Step:
        """Make a step no further than to `stop` (s), as short as its error asks; choose the next.

        Raises:
            DeadCentreError: the guide can't turn further.
            NoConvergenceError: no step is short enough.

        """
        left = stop - self.time
        h = min(self.h, self._longest())
        first = True
        while True:
            if h > 0.999999 * left:
                h = left
            elif h > 0.5 * left:
                h = left / 2
            if h < instant(self.time, EVENT_TIME) and h < left:
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
                self.h = self.control.next(h, factor if first else min(factor, 1.0))
                return step
            h, first = h * min(factor, 0.9), False

    def landed(self, found: Found) -> Step | None:
        """Make a step to what was found; None, and a shorter one next, if it is not good enough."""
        h = found.time - self.time
        step = self._at_the_end(found, h)
        if step is None or self._misses(found, step):
            self.h = h / 3  # reach the event from nearer
            return None
        return step

    def _at_the_end(self, found: Found, h: float) -> Step | None:
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
            if abs(late) < instant(self.time, EVENT_TIME) or not 0.5 * h < h - late < 1.5 * h:
                return step
            h -= late
        return step

    def accept(self, step: Step) -> Held:
        """Go to the end of a step; return the coordinates there."""
        self.time, self._state, self.at = step.end, step.finish, step.stages[-1]
        end = self.model.whole(step.end, step.finish.q, step.finish.v)
        for guide, place in zip(self.model.guides, end.places, strict=True):
            guide.settle(place, float(end.x[guide.guided.turning]))
        self.model.forget()
        self.model.look(end.x)
        self.finder.look(end.x, end.v, step.h)
        return end

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
            gone = step.stages[-1].kept.x[k] - self.at.kept.x[k]
            if abs(gone - step.h * float(WEIGHTS @ speeds)) > self.control.tolerance:
                return True
        return False

    def _step(self, h: float) -> Step | None:
        self._dead = None
        try:
            # An iteration that goes astray may overflow: it is not a number, hence rejected.
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                return self.radau.step(self.time, h, self.at, self._state, self.control.allowed)
        except DeadCentreError as error:  # of a trial too long, or no step is short enough
            self._dead = error
            return None

    def _longest(self) -> float:
        """Limit of a step, s: guides turn a little, a point that presses comes to rest."""
        speeds = [abs(self.at.kept.v[guide.guided.turning]) for guide in self.model.guides]
        turns = [LARGEST_TURN / speed for speed in speeds if speed > 0]
        rests = [c.rests_in(touch) for c, touch in self.finder.contacts() if c.acts]
        return min([*turns, *rests, *self._paces()], default=inf)

    def _paces(self) -> list[float]:
        """Steps (s) of contacts that act, where the user's own is too long for them."""
        given = self.control.fixed
        acting = [h for c, h in zip(self.model.contacts, self.half_periods, strict=True) if c.acts]
        return [] if given is None else [IN_CONTACT * h for h in acting if too_long(given, h)]
