"""Makes one good step of a tree: solved, accurate, where its points were to go, and on events."""

from __future__ import annotations

from math import inf

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.clock import instant
from exudyn_flexlink.engines.coasting import coasting
from exudyn_flexlink.engines.exudyn.minimal.collocation import WEIGHTS
from exudyn_flexlink.engines.exudyn.minimal.control import ErrorControl
from exudyn_flexlink.engines.exudyn.minimal.coordinates import Held
from exudyn_flexlink.engines.exudyn.minimal.finding import EVENT_TIME, Finder, Found
from exudyn_flexlink.engines.exudyn.minimal.guided import DeadCentreError
from exudyn_flexlink.engines.exudyn.minimal.knots import KnotControl
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.engines.exudyn.minimal.radau import (
    FREE,
    NoConvergenceError,
    Radau,
    State,
    Step,
)
from exudyn_flexlink.engines.exudyn.minimal.slow_motions import slow_motions

FloatArray = NDArray[np.float64]

IN_CONTACT = 0.15  # of the contact's half period: the first step in it
FARTHEST_OFF = 1e-3  # of its penetration: where a contact's end may be met
SHORTEST_LOOK = 1e-3  # of a contact's half period
LENGTHS = (1.5, 0.7, 1.7, 0.55, 1.6, 0.8, 1.25)  # of a step on a dead centre, each of the last
ROUNDED = 10.0  # times the error allowed: what rounding may make of it there
LANDINGS = 4  # steps to the end of a face


class Stepper:
    """Where the integration of a tree is, and the steps from there; `h` (s) is the next one.

    `half_periods` (s) are those of the contacts, `end` (s) is that of the run.
    """

    def __init__(
        self,
        model: MinimalModel,
        control: ErrorControl,
        finder: Finder,
        half_periods: list[float],
        end: float,
    ) -> None:
        self.model, self.control, self.finder = model, control, finder
        self.half_periods, self.end = half_periods, end
        tau = coasting(model.assembly.mechanism, end)
        self.radau = Radau(model, tau, np.zeros((0, 0)))
        self.time = 0.0
        self.h = 1e-3 * end if control.fixed is None else control.fixed
        q, v = model.coordinates.state()
        self._state = State(q, v, v)
        self._dead: DeadCentreError | None = None
        self.rounded: list[float] = []  # s: steps on dead centres
        self.restart()
        # An error a of the acceleration moves what swings by a tau^2, what turns freely by a end^2.
        lasts = end if self.radau.slow.any() else FREE * tau
        self.knots = KnotControl(model, control.allowed / lasts**2)

    def restart(self) -> None:
        """Begin anew from the present state: the equations have changed."""
        self.turn()
        coordinates = self.model.coordinates
        coordinates.resume()
        q, v = coordinates.state()
        self.at = self.model.evaluate(self.time, q, v)
        self.model.look(self.at.kept.x, self.at.kept.reach)
        self._state = State(q, v, self.model.accelerations(self.at))
        if len(self.radau.slow) != len(q) or self.at.kept.reach is not None:
            # Once for an open chain; what follows others may do so otherwise, or by other ones.
            stiffness = self.model.jacobians(self.at)[0]
            self.radau.slow = slow_motions(self.at.mass, stiffness, self.end)

    def turn(self) -> None:
        """Go on from the present state, where a force leaps: the last step tells nothing."""
        self.radau.restart()
        self.control.forget()

    def locked(self) -> str:
        """Say at which dead centre the mechanism all but is; empty if at none."""
        return self.model.coordinates.locked(self.at.kept)

    def attempt(self, stop: float) -> Step:
        """Make a step no further than to `stop` (s), as short as its error asks; choose the next.

        Raises:
            DeadCentreError: the guide can't turn further.
            NoConvergenceError: no step is short enough.

        """
        if self.model.coordinates.worn():
            self.restart()
        h, first, lengths = min(self.h, self._longest()), True, [*LENGTHS]
        while True:
            h = self._fitted(h, stop - self.time)
            step = self._step(h)
            if lengths and self._on_dead_centre(step):
                # Rounding decides there, whatever the length: let the stages fall elsewhere.
                h *= lengths.pop()
            elif step is None or self._slips(step):
                h, first = h / 4, False
            elif self.control.fixed is not None:
                return step
            elif self._over_knots(step):
                h *= self.knots.part(step)
            else:
                factor = self.control.factor(h, step.error)
                if self.control.passes(step.error) or self._rounded(step):
                    self._note_dead_centre()
                    self.control.note(h, step.error)
                    self.h = self.control.next(h, factor if first else min(factor, 1.0))
                    return step
                h, first = h * min(factor, 0.9), False

    def _fitted(self, h: float, left: float) -> float:
        """Length of a step so that what is `left` (s) ends with a step, and knots end steps, too.

        Raises:
            DeadCentreError: the guide can't turn further.
            NoConvergenceError: the clock does not tell it from none.

        """
        if h > 0.999999 * left:
            h = left
        elif h > 0.5 * left:
            h = left / 2
        if h < instant(self.time, EVENT_TIME) and h < left:
            raise self._dead or NoConvergenceError(f"{h:.3g} s")
        if self.control.fixed is not None:
            return h
        return self.knots.shortened(self.time, h, self._state, self.at)

    def _on_dead_centre(self, step: Step | None) -> bool:
        """Tell that a step ends on a dead centre, or is no good since a stage of it is on one."""
        if self.control.fixed is not None:
            return False
        any_stage, end = self.model.coordinates.on_dead_centre()
        return end or (any_stage and not self._good(step))

    def _good(self, step: Step | None) -> bool:
        return step is not None and not self._slips(step) and self.control.passes(step.error)

    def _note_dead_centre(self) -> None:
        if self.model.coordinates.on_dead_centre()[0]:
            self.rounded.append(self.time)

    def _rounded(self, step: Step) -> bool:
        """Tell that an error too large may be one of rounding, at a dead centre that is passed."""
        on_one = self.model.coordinates.on_dead_centre()[0]
        return on_one and step.error < ROUNDED * self.control.allowed

    def landed(self, found: Found) -> Step | None:
        """Make a step to what was found; None, and a shorter one next, if it is not good enough."""
        h = found.time - self.time
        step = self._at_the_end(found, h)
        if step is None or self._misses(found, step) or self._over_knots(step):
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
        self.model.coordinates.settle(step.end, end, step.finish.a)
        self.model.look(end.x, end.reach)
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

    def _over_knots(self, step: Step) -> bool:
        """Tell that a step goes over knots that cost too much."""
        return self.control.fixed is None and self.knots.part(step) < 1

    def _slips(self, step: Step) -> bool:
        """Tell that a dependent coordinate did not go where its speed would have taken it."""
        if self.control.fixed is not None:
            return False
        stages = [at.kept for at in step.stages]
        off = self.model.coordinates.slipped(step.h, WEIGHTS, stages, self.at.kept)
        return off > self.control.tolerance

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
        """Limit of a step, s: places stay near those searched from, a point comes to rest."""
        near = self.model.coordinates.longest(self.at.kept)
        rests = [c.rests_in(touch) for c, touch in self.finder.contacts() if c.acts]
        return min([near, *rests, *self._paces()], default=inf)

    def _paces(self) -> list[float]:
        """Longest steps (s) of contacts that act, which no error control shortens."""
        if self.control.fixed is None:
            return []
        both = zip(self.model.contacts, self.half_periods, strict=True)
        return [IN_CONTACT * half for contact, half in both if contact.acts]
