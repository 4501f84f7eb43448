"""Makes one good step: solved, accurate, where everything was to go, and on events.

After every step it is looked whether an event function fell within it. If so the step is made anew,
up to that instant, where the equations change and the integration starts afresh: no force leaps
inside a step.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf
from typing import Protocol

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.integrate.clock import instant, later
from exudyn_flexlink.integrate.collocation import C
from exudyn_flexlink.integrate.control import ErrorControl
from exudyn_flexlink.integrate.events import EVENT_TIME, Event
from exudyn_flexlink.integrate.knots import KnotControl
from exudyn_flexlink.integrate.problem import Equations, Evaluation, NoConvergenceError, State
from exudyn_flexlink.integrate.radau import ErrorTimes, Radau, Step

# A stage fell on a singularity: try again with the last length times these, from the list's end.
RETRY_FACTORS = (1.5, 0.7, 1.7, 0.55, 1.6, 0.7, 1.25)
# Near a singularity an error up to this many times the allowed one counts as rounding.
ROUNDED = 10.0
CORRECTIONS = 3  # by Newton's method, of where a step's end is moved to an event
END_SHIFT = 1e-2  # of a step: its end is moved along its polynomial by no more than this


class HybridProblem(Protocol):
    """What changes the equations at events, and may choose other coordinates to be solved for.

    What a class that inherits says nothing of never happens in its equations.
    """

    def begin(self, at: Evaluation) -> None:
        """Record the state at time 0."""

    def restart(self, time: float) -> tuple[Evaluation, State]:
        """Take up the present state (s), choosing the coordinates to go on with."""

    def position_per_speed_error(self, at: Evaluation) -> FloatArray:
        """Matrix (n, n), s: the position error that a speed error becomes through slow modes."""

    def repartition_due(self) -> bool:
        """Tell whether other coordinates should be chosen."""
        return False

    def accept(self, step: Step) -> None:
        """Go to the end of a step that is good, and record it."""

    def longest(self, at: Evaluation) -> float:
        """Limit of the next step from here, s."""

    def slipped(self, step: Step) -> float:
        """How far (m) a coordinate that is not solved for ended from where its speed takes it."""

    def overlooked(self, step: Step, allowed: float) -> float:  # noqa: ARG002
        """Part of a step after which a force is not what its stages tell; 1 if nowhere.

        `allowed` is how far (m) that may have moved anything by the end of the run.
        """
        return 1.0

    def on_singularity(self, at_stop: bool = False) -> tuple[bool, bool, bool]:  # noqa: ARG002
        """Tell whether a stage, or the end, of the last step tried fell on one, or it passed one.

        There rounding decides on what follows from the coordinates solved for. A step that has to
        end where it does, `at_stop`, may end nearer to one.
        """
        return False, False, False

    def first_event(self, step: Step) -> Event | None:
        """Locate what happens first within a step."""

    def late(self, event: Event, step: Step) -> float:
        """How long (s) before a step's end the event was; negative: after. 0 if near enough."""

    def arrives(self, event: Event, step: Step) -> bool:  # noqa: ARG002
        """Tell that a step ends at its event, or near enough."""
        return True


class ImplicitStepper:
    """Where the integration is, and the steps from there; `h` (s) is the next one.

    `rounded` are the instants (s) of steps on singularities, where rounding decided on errors;
    `slips` those at which steps of the user's own length began that `slipped`, with their lengths
    (s) and how far that was (m).
    """

    def __init__(
        self,
        model: Equations,
        problem: HybridProblem,
        control: ErrorControl,
        error_times: ErrorTimes,
        end: float,
    ) -> None:
        """`end` (s) is that of the run."""
        self.model, self.problem, self.control = model, problem, control
        self.radau = Radau(model, error_times, np.zeros((0, 0)))
        self.time = 0.0
        self.h = 1e-3 * end if control.fixed is None else control.fixed
        self.rounded: list[float] = []
        self.slips: list[tuple[float, float, float]] = []
        self.steps, self.smallest, self.largest = 0, inf, 0.0
        self._end = end
        self.at: Evaluation
        self._state: State

    def begin(self) -> None:
        """Take up the state at time 0."""
        self.restart()
        # An error a of the acceleration moves what swings by a tau^2, what moves freely by a end^2.
        radau = self.radau
        lasts = self._end if radau.position_per_speed_error.any() else radau.error_times.free
        self.knots = KnotControl(self.model, self.control.allowed / lasts**2)
        self.problem.begin(self.at)

    @property
    def iterations(self) -> int:
        """Newton's iterations so far."""
        return self.radau.iterations

    def restart(self, event: Event | None = None) -> None:
        """Go on from the present state, after an event if any."""
        self.control.forget()
        bends = event is not None and event.bends
        if not bends:
            self.radau.restart()
        if bends:
            self.at = self.model.evaluate(self.time, self._state.q, self._state.v)
            self._state = self._state._replace(a=self.at.accelerations)
        else:
            self.at, self._state = self.problem.restart(self.time)
        self.radau.position_per_speed_error = self.problem.position_per_speed_error(self.at)

    def advance(self, stop: float) -> Event | None:
        """Make one step, no further than to `stop` (s); return the event at its end, if any.

        Raises:
            NoConvergenceError: no step is short enough.

        """
        step = self._attempt(stop)
        event = self.problem.first_event(step)
        close = instant(step.end, EVENT_TIME)
        if event is not None and event.time < step.t + close:
            return replace(event, time=self.time)
        if event is not None and event.time < step.end - close:
            landed = self._landed(event)
            if landed is None:
                return None
            step = landed
        self._note(step)
        self.time, self._state, self.at = step.end, step.finish, step.stages.pick(-1)
        self.steps += 1
        self.smallest, self.largest = min(self.smallest, step.h), max(self.largest, step.h)
        self.problem.accept(step)
        # The step that was made again tells the instant better than the one the event was found in.
        return event and replace(event, time=self.time)

    def _note(self, step: Step) -> None:
        """Take note of steps past a singularity, or inexact at one; of the user's that slipped."""
        near, _, passed = self.problem.on_singularity()
        if passed or (near and not self.control.fixed and not self.control.passes(step.error)):
            self.rounded.append(step.t)
        if self.control.fixed is not None:
            slip = self.problem.slipped(step)
            if not self.control.near(slip):
                self.slips.append((step.t, step.h, slip))

    # --- one step -----------------------------------------------------------------------------

    def _attempt(self, stop: float) -> Step:
        """Make a step to `stop` (s) at most, as short as its error asks; choose the next."""
        if self.problem.repartition_due():
            self.restart()
        longest = self.control.limits * self.problem.longest(self.at)
        h, first, factors = min(self.h, longest), True, [*RETRY_FACTORS]
        while True:
            h = self._fitted(h, stop - self.time)
            step = self._step(h)
            if step is not None and self.control.fixed is not None:
                self.h = self.control.fixed  # it was shorter if an event had to be met from nearer
                return step
            if factors and self._on_singularity(step, h == stop - self.time):
                # Rounding decides there, whatever the length: let the stages fall elsewhere.
                h *= factors.pop()
            elif step is None or self._slips(step):
                h, first = h / 4, False
            elif (part := self.knots.part(step)) < 1:
                h *= part
            else:
                factor = self.control.factor(h, step.error)
                good = self.control.passes(step.error) or self._rounded(step)
                part = self.problem.overlooked(step, self.control.allowed) if good else 1.0
                if part < 1:
                    h, first = h * part, False
                elif good:
                    self.control.note(h, step.error)
                    self.h = h * (factor if first else min(factor, 1.0))
                    return step
                else:
                    h, first = h * min(factor, 0.9), False

    def _fitted(self, h: float, left: float) -> float:
        """Length of a step so that what is `left` (s) ends with a step.

        Raises:
            NoConvergenceError: the clock does not tell it from none.

        """
        if h > 0.999999 * left:
            h = left
        elif h > 0.5 * left:
            h = left / 2
        if h < instant(self.time, EVENT_TIME) and h < left:
            raise NoConvergenceError(f"{h:.3g} s")
        return h

    def _step(self, h: float) -> Step | None:
        # An iteration that goes astray may overflow: it is not a number, hence rejected.
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            return self.radau.step(self.time, h, self.at, self._state, self.control.allowed)

    def _on_singularity(self, step: Step | None, at_stop: bool) -> bool:
        """Tell that a step ends on a singularity, or is no good since a stage of it is on one."""
        if self.control.fixed is not None:
            return False
        any_stage, end, _ = self.problem.on_singularity(at_stop)
        return end or (any_stage and not self._good(step))

    def _good(self, step: Step | None) -> bool:
        return step is not None and not self._slips(step) and self.control.passes(step.error)

    def _rounded(self, step: Step) -> bool:
        """Tell that an error too large may be one of rounding, at a singularity that is passed."""
        on_one = self.problem.on_singularity()[0]
        return on_one and step.error < ROUNDED * self.control.allowed

    def _slips(self, step: Step) -> bool:
        """Tell that a dependent coordinate did not go where its speed would have taken it."""
        return not self.control.near(self.problem.slipped(step))

    # --- up to an event -----------------------------------------------------------------------

    def _landed(self, event: Event) -> Step | None:
        """Make a step to an event; None, and a shorter one next, if it is not good enough.

        The polynomial in which the event was located is less accurate than a step's end. So that is
        moved a little, to where the event is.
        """
        h = later(event.time, self.control.late) - self.time
        step = self._step(h)
        step = None if step is None else self._ending(event, step)
        given = self.control.fixed is not None
        if step is None or not (given or self._arrives(event, step)):
            self.h = h / 3  # reach the event from nearer
            return None
        return step

    def _ending(self, event: Event, step: Step) -> Step | None:
        """Move a step's end a little along its polynomial, to its event."""
        solved, farthest = step, END_SHIFT * step.h
        for _ in range(CORRECTIONS):
            late = self.problem.late(event, step)
            if late == 0.0 or abs(late) > farthest:
                break
            step = step.ending(step.end - late)
        return step if step is solved else self._with_its_stages(step)

    def _with_its_stages(self, step: Step) -> Step | None:
        """Return a step whose end was moved with what its stages are now; None if they are none."""
        times = step.t + C * step.h
        try:
            stages = self.model.evaluate_stages(times, *step.at(times))
            accelerations = stages.accelerations
        except (ValueError, ArithmeticError):
            return None
        finish = step.finish._replace(a=accelerations[-1])
        return step._replace(finish=finish, stages=stages, accelerations=accelerations)

    def _arrives(self, event: Event, step: Step) -> bool:
        """Tell that a step ends at its event, and that nothing keeps it from being good."""
        return self.problem.arrives(event, step) and self.knots.part(step) >= 1
