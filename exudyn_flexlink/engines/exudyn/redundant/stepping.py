"""Step control: the length of the solver's next step.

Exudyn's implicit integrator keeps a fixed step, but a function called after each step may set the
next step. It sets the step that error control or the scene asks for, shortened so that steps end on
events (ends of pieces of a track, contacts, the end of the run) and resolve contacts.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, inf, log2
from typing import Any

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.diagnostics import (
    BROKEN_WALL_ADVICE,
    COARSE_WALL_ADVICE,
    broken_wall,
)
from exudyn_flexlink.engines.exudyn.engine import Engine
from exudyn_flexlink.engines.exudyn.redundant.contacts import Contacts
from exudyn_flexlink.engines.exudyn.redundant.recording import StepRecorder
from exudyn_flexlink.engines.exudyn.redundant.slots import (
    Kinks,
    SlotItems,
    StepEnd,
    end_on,
    first_zero,
)
from exudyn_flexlink.integrate.problem import Window, instant
from exudyn_flexlink.integrate.solve import ProgressMeter
from exudyn_flexlink.mechanism import TurnGoal
from exudyn_flexlink.result import Event
from exudyn_flexlink.rounding import INVISIBLE, KNOT_TIME, TINY
from exudyn_flexlink.scene import Accuracy

STEPS_TO_KNOT = 32  # least number of first steps in a part of a pulse, for a method of order 2


class StepChooser:
    """Chooses steps whose local errors add up to the tolerance, in smooth motion.

    The local error of a step is about ``C h^3 q'''``. The third derivative comes from divided
    differences of the last four positions. Differences of accelerations would be far too large with
    vibrations that no step resolves. Each step may make the same share of the tolerance; the number
    of steps is extrapolated from those made so far.

    Every change of the step disturbs accelerations and reactions, since generalised-alpha carries
    accelerations from step to step. So steps change by factors of `RATIO`, and rarely grow.

    Without a tolerance all steps are as long as the user's, except at events.
    """

    CONSTANT = 0.1  # C above, of generalised-alpha with a spectral radius of 0.9
    GROWTH = 1.2  # error of S over the sum of local errors, measured over two turns of the paper's
    FEWEST_STEPS = 200  # least number of steps that share the tolerance
    RATIO = 2**0.5  # of successive lengths of steps
    STEPS_BEFORE_GROWTH = 6  # steps since the last change
    # rad per step. Differences of angles do not limit the step of a part that turns evenly. But
    # extremes are searched on cubics, and with this limit they err by less than 1e-6 of a radius.
    LARGEST_TURN = 0.1

    def __init__(
        self, accuracy: Accuracy, duration: float, weights: FloatArray, limits: float = 1.0
    ) -> None:
        """`weights` turn coordinates into lengths: 1 for positions, a lever arm for angles.

        Limits of steps, except that by their error, are `limits` times as long as usual.
        """
        self.tolerance = accuracy.tolerance  # m
        self.duration = duration
        self.largest = accuracy.step or limits * duration / 50
        self.first = accuracy.step or limits * duration * 1e-5
        self._largest_turn = limits * self.LARGEST_TURN
        self._step, self._since_change = self.first, 0
        self._weights = weights
        self._steps = 0
        self._times = [0.0] * 4  # of the last four weighted positions, a row each
        self._positions = np.zeros((4, len(weights)))

    def propose(self, now: StepEnd) -> float:
        """Return the step whose error is its share of the tolerance."""
        if self.tolerance is None:
            return self.first
        row = self._steps % 4
        self._times[row] = now.time
        np.multiply(now.q, self._weights, out=self._positions[row])
        self._steps += 1
        self._since_change += 1
        if self._steps < 4:
            return self._step
        # Divided differences carry 1/6 of the derivative.
        error = 6 * self.CONSTANT * now.step**3 * self._third_difference()
        # Steps that share the tolerance, as many as are foreseen:
        ahead = self.duration / (now.time + 0.02 * self.duration)
        foreseen = max(self.FEWEST_STEPS, self._steps * ahead)
        share = self.tolerance / (self.GROWTH * foreseen)
        wanted = now.step * (share / max(error, TINY)) ** (1 / 3)
        turning = max(map(abs, now.v_list[2::3]))
        if turning * wanted > self._largest_turn:
            wanted = self._largest_turn / turning
        if wanted < self._step:
            down = ceil(2 * log2(self._step / wanted))
            self._change(self._step * self.RATIO ** -min(down, 6))
        elif wanted > self.RATIO * self._step and self._since_change >= self.STEPS_BEFORE_GROWTH:
            self._change(min(self._step * self.RATIO, self.largest))
        return self._step

    def restart_from(self, step: float) -> None:
        """Go on with steps up to `step` (s) after a jump of forces; they grow again."""
        self._change(min(step, self._step))

    def _change(self, step: float) -> None:
        self._step, self._since_change = step, 0

    def _third_difference(self) -> float:
        """Largest third divided difference of the last four weighted positions, m/s^3."""
        t0, t1, t2, t3 = self._times
        a, b, c, d, e, f = t0 - t1, t0 - t2, t0 - t3, t1 - t2, t1 - t3, t2 - t3
        factors = (1 / (a * b * c), -1 / (a * d * e), 1 / (b * d * f), -1 / (c * e * f))
        third = np.dot(factors, self._positions)
        return max(float(third.max()), -float(third.min()))


@dataclass
class Loop:
    """The loop after each step of the solver: find events, record, set the next step."""

    chooser: StepChooser
    slots: list[SlotItems]
    contacts: Contacts
    kinks: Kinks
    events: list[Event]  # of the slots
    recorder: StepRecorder
    end: float
    goal: TurnGoal | None
    knots: Sequence[float]  # instants (s) at which drives jump or bend: steps end there
    window: Window
    progress: ProgressMeter
    time: float = 0.0
    left: float | None = None  # angle still to turn, rad, if turns end the run
    steps: int = 0
    largest: float = 0.0  # of the steps so far, s
    smallest: float = inf
    stop_reason: str = ""
    stop_advice: str = ""
    interrupted: bool = False
    error: BaseException | None = None
    _first: float = 0.0
    _goal_rate: float = 0.0
    _jump: FloatArray | None = None  # of accelerations, at the knot at the end of the last step
    _solver: Any = None

    def start(self, q: FloatArray, v: FloatArray, multipliers: FloatArray) -> float:
        """Record the state at time 0; return the first step (s)."""
        now = self._step_end(0.0, 0.0, q, v)
        self.chooser.propose(now)
        self._first = self._cut(now, self.chooser.first)
        self._take(now, multipliers)
        self.contacts.aim(self._first)
        return self._first

    def after_step(self, mbs: Any, time: float) -> bool:
        """Called by the solver after each step; False ends the run.

        No exception may pass through the solver: it is kept in `error` for the caller.
        """
        try:
            return self._after_step(mbs, time) and not self.interrupted
        except BaseException as error:
            self.error = error
            return False

    @property
    def iterations(self) -> int:
        """Number of Newton iterations so far."""
        return 0 if self._solver is None else int(self._solver.newtonStepsCount)

    def interrupt(self) -> None:
        """End the run after the present step."""
        self.interrupted = True

    def _after_step(self, mbs: Any, time: float) -> bool:
        if self._solver is None:
            self._solver = mbs.sys["dynamicSolver"].it
        done = time - self.time
        if done <= 0:  # the solver's call at its start, which overrides its initial step
            self._solver.currentStepSize = self._first
            return True
        data = mbs.systemData
        q, v = data.GetODE2Coordinates(), data.GetODE2Coordinates_t()
        now = self._step_end(time, done, q, v)
        self._count(now)
        step = self._cut(now, self.chooser.propose(now))
        self._take(now, data.GetAECoordinates())
        if self._jump is not None:
            _start_anew(mbs, self._jump)
            self._jump = None
        self.contacts.aim(step)
        self._solver.currentStepSize = step
        return not self.stop_reason and self.left != 0

    def _step_end(self, time: float, done: float, q: FloatArray, v: FloatArray) -> StepEnd:
        return StepEnd(time, done, q, v, *self.recorder.coordinates.plain(q.tolist(), v.tolist()))

    def _take(self, now: StepEnd, multipliers: FloatArray) -> None:
        for changed in self.contacts.changes:
            self.recorder.note(changed)
        places = [float(slot.place(slot.u)) for slot in self.slots]
        self.recorder.take(now, multipliers, places)

    def _count(self, now: StepEnd) -> None:
        self.time = now.time
        self.steps += 1
        self.largest = max(self.largest, now.step)
        self.smallest = min(self.smallest, now.step)
        self.progress.update(now.time)

    def _cut(self, now: StepEnd, step: float) -> float:
        """Shorten a step so that the next event is at its end."""
        for slot in self.slots:
            step = slot.after_step(now, step)
            if slot.jumped:
                self.chooser.restart_from(step)
            if slot.at_end:
                self.stop_reason = f"the point of slot '{slot.slot.name}' reached the curve's end"
                self.stop_advice = "lengthen the curve, or end the run before"
        step = self._contacts(now, step)
        step, passed = self.kinks.after_step(now, step)
        if passed:
            step = min(step, self.chooser.first)
            self.chooser.restart_from(step)
        if self.goal is not None:
            left, rate = self.goal.left(now.q_list), self.goal.rate(now.q_list, now.v_list)
            bend = (rate - self._goal_rate) / now.step if now.step > 0 else 0.0
            self._goal_rate = rate
            step = end_on(step, first_zero(left, -rate, -bend)) if left > 0 else step
            self.left = left if left > INVISIBLE else 0.0
        step = self._to_knot(now, step)
        return end_on(step, max(self.end - now.time, 0.0))

    def _to_knot(self, now: StepEnd, step: float) -> float:
        """Shorten a step so that it ends on the next knot of a drive.

        Accelerations change at a knot, so the first steps after it are as short as at time 0.
        """
        time = now.time
        near = instant(time, KNOT_TIME)
        passed = bisect_right(self.knots, time + near)
        last = self.knots[passed - 1] if passed else 0.0
        ahead = self.knots[passed] if passed < len(self.knots) else inf
        before = self.window.inside(time)
        self.window.go_on(last, ahead)
        if last > 0 and time - last < near:
            step = min(step, self.chooser.first, (ahead - last) / STEPS_TO_KNOT)
            self.chooser.restart_from(step)
            places = np.array([slot.place(slot.u) for slot in self.slots])
            accelerations = self.recorder.coordinates.accelerations
            after = accelerations(now.q, now.v, places, self.window.inside(time))
            # The state and the forces of contacts do not change at a knot, so they cancel.
            self._jump = after - accelerations(now.q, now.v, places, before)
        return end_on(step, ahead - time)

    def _contacts(self, now: StepEnd, step: float) -> float:
        """Let contacts shorten the step; a broken wall ends the run."""
        step = self.contacts.after_step(now, step)
        if (channel := self.contacts.broken) is not None:
            self.stop_reason = broken_wall(channel)
            coarse = self.chooser.tolerance is None
            self.stop_advice = COARSE_WALL_ADVICE if coarse else BROKEN_WALL_ADVICE
        if self.contacts.restart_step < inf:
            step = min(step, self.contacts.restart_step)
            self.chooser.restart_from(step)
        return step


def _start_anew(mbs: Any, jump: FloatArray) -> None:
    """Let the solver go on, between two steps, with accelerations that jump by `jump`.

    Generalised-alpha carries accelerations of its own from step to step, besides those of the
    state. Across a jump of a force they would cause a lasting error of the velocities. Only the
    initialisation of a run sets these internal accelerations.
    """
    data, solver = mbs.systemData, mbs.sys["dynamicSolver"]
    initial = Engine.ConfigurationType.Initial
    data.SetODE2Coordinates(data.GetODE2Coordinates(), initial)
    data.SetODE2Coordinates_t(data.GetODE2Coordinates_t(), initial)
    data.SetODE2Coordinates_tt(data.GetODE2Coordinates_tt() + jump, initial)
    time = solver.it.currentTime
    solver.InitializeSolverInitialConditions(mbs, mbs.sys["simulationSettings"])
    solver.it.currentTime = time
