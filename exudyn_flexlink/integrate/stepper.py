"""Makes a step that converges, is accurate and ends on events, and chooses the lengths of steps.

After every step the event functions are searched for a zero within it. If there is one, the step is
made again, up to that instant, where the equations change and the integration starts afresh: no
force leaps inside a step. The length of steps follows from the error allowed, or is fixed.

A step may go over some knots of a curve that a coordinate follows. At a knot the curve's third
derivative jumps by J. With the speed u' of the place on the curve the acceleration of the point
there bends: from there on it has ``J u'^3 (t - t_k)`` more. The method takes smooth functions to
order 9 or 13, a bend only to order 2. If a step of length h passes the knots after its parts
sigma_k, the speed at its stage i misses

    h^2 u'^3 sum_k kappa_i(sigma_k) J_k,
    kappa_i(s) = (c_i - s)_+^2 / 2 - sum_j a_ij (c_j - s)_+    (Peano's kernel).

A single knot counts in full; many close knots of a smooth curve cancel each other, as their jumps
change slowly. A step goes over as many knots as this error allows; otherwise it ends at a knot.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import NamedTuple, Protocol

import numpy as np
from scipy.linalg import eigh

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.integrate.events import EVENT_TIME, Crossing
from exudyn_flexlink.integrate.problem import (
    Equations,
    Evaluation,
    NoConvergenceError,
    State,
    instant,
    later,
)
from exudyn_flexlink.integrate.radau import (
    MOST_ITERATIONS,
    Collocation,
    ErrorTimes,
    Radau,
    Step,
    collocation,
)

SHARE = 0.07  # of the tolerance: the error estimated of one step
LEAST_GROWTH, MOST_GROWTH = 0.1, 5.0
SAFETY = 0.9  # of RADAU5: a step is this part of the length that has the allowed error
PART = 0.1  # of 1/omega: errors of steps fall on all phases of a swing
FREELY = 0.3  # of the run: a free motion keeps an error of its speed, on average for half the run


@dataclass
class ErrorControl:
    """Allows the same error (m) in every step, by the `tolerance` of the run; or `fixed` steps (s).

    `stages` is the number of stages of the method. `limits` scales the other limits of steps. Steps
    to events are too long by `late` (s), on purpose: see `engines.finer`.

    Measured on the shipped scenes by `scripts/tolerance.py`: over two turns, the error of S and of
    the lever's tip is 0.001 to 0.25 of the tolerance, for tolerances from 1e-3 to 1e-8 m that
    decide on the steps.
    """

    tolerance: float
    stages: int
    fixed: float | None = None
    limits: float = 1.0
    late: float = 0.0
    _last: float = inf  # s: the length with which the last step would have had the allowed error

    @property
    def method(self) -> Collocation:
        """The method that makes the steps."""
        return collocation(self.stages)

    @property
    def allowed(self) -> float:
        """Error that one step may make, m."""
        return SHARE * self.tolerance

    def passes(self, error: float) -> bool:
        """Tell whether a step of this error (m) is good enough."""
        return error <= self.allowed

    def near(self, distance: float) -> bool:
        """Tell whether a distance (m) is within the tolerance of the run."""
        return not distance > self.tolerance

    def forget(self) -> None:
        """Forget the last step, since the equations have changed."""
        self._last = inf

    def note(self, step: Step) -> None:
        """Take note of a step that was good enough."""
        self._last = self._possible(step)

    def factor(self, step: Step) -> float:
        """Factor by which the next step may be longer, or by which this one has to be shorter.

        Hairer and Wanner, IV.8: the more rounds the iteration takes, the shorter. Both this step
        and the last one limit the length: errors of a vibration depend on its phase, and a step
        that is chosen at a good phase would be too long at the next one.
        """
        possible = min(self._possible(step), self._last)
        safety = SAFETY * (2 * MOST_ITERATIONS + 1) / (2 * MOST_ITERATIONS + step.rounds)
        return float(max(LEAST_GROWTH, min(MOST_GROWTH, safety * possible / step.h)))

    def _possible(self, step: Step) -> float:
        """Length (s) with which a step would have had the allowed error."""
        ratio = max(step.error / self.allowed, 1e-12)
        return float(step.h * ratio ** (-1 / (self.method.stages + 1)))  # its estimate's order


def slow_motions(mass: FloatArray, stiffness: FloatArray, end: float, least: float) -> FloatArray:
    """Matrix (n, n), s: errors of speeds become errors of places by slow motions.

    A mode of angular frequency omega turns an error of its speed into one of place within 1/omega,
    a motion without springs until the end of the run (s). A part of either time counts, since
    errors of steps fall on all phases and all instants. Motions faster than `least` (s) are left
    out.
    """
    if not len(mass):
        return np.zeros((0, 0))
    squares, modes = eigh(stiffness, mass)
    free = squares <= end**-2
    times = np.where(free, FREELY * end, PART / np.sqrt(np.where(free, 1.0, squares)))
    return np.asarray((modes * np.where(times > least, times, 0.0)) @ modes.T @ mass)


AT_KNOT = 1e-7  # of the step: a knot so close to its start counts as at the start


class KnotControl:
    """Keeps the error of accelerations that knots cause below a limit, m/s^2, in every part."""

    def __init__(self, followed: Equations, allowed: float) -> None:
        """`allowed` (m/s^2) is that error, on average over a step."""
        self.followed, self.allowed = followed, allowed
        self._moved: dict[int, float] = {}  # largest acceleration so far by a push of each point

    def part(self, step: Step) -> float:
        """Part of a step at which it has to end; 1 if the whole step is good."""
        part = 1.0
        for k, (knots, _) in enumerate(self.followed.knots()):
            if not len(knots):
                continue
            ends = step.begin, step.stages.pick(-1)
            begin, end = (self.followed.places(evaluation)[k] for evaluation in ends)
            to = self._allowed_end(k, begin, end, step)
            if to != end:
                part = min(part, (to - begin) / (end - begin))
        return part

    def _allowed_end(self, k: int, begin: float, end: float, step: Step) -> float:
        """Place up to which a step from `begin` to `end` may go: `end`, or a knot before it."""
        places, jumps = self.followed.knots()[k]
        low, high = np.searchsorted(places, [min(begin, end), max(begin, end)])
        if low == high:
            return end
        places, jumps, speed = places[low:high], jumps[low:high], abs(end - begin) / step.h
        if end < begin:
            places, jumps = places[::-1], jumps[::-1]
        for evaluation in (step.begin, step.stages.pick(-1)):
            moved = self.followed.moved_by_point(k, evaluation)
            self._moved[k] = max(self._moved.get(k, 0.0), moved)
        scale = speed**2 * self._moved[k]
        while len(places):
            parts = (places - begin) / (end - begin)
            since = np.maximum(step.method.c[:, None] - parts, 0.0)
            missed = ((since * since / 2 - step.method.a @ since) * (parts > AT_KNOT)) @ jumps
            if scale * abs(end - begin) * np.hypot(*missed.T).max() <= self.allowed:
                break
            half = np.count_nonzero(parts <= AT_KNOT)
            half += (len(places) - half) // 2
            end, places, jumps = float(places[half]), places[:half], jumps[:half]
        return end


# Where a stage falls on a singularity, the step is tried again, each time with another of these
# factors of its length.
RETRY_FACTORS = (1.25, 0.7, 1.6, 0.55, 1.7, 0.7, 1.5)
# Near a singularity an error up to this many times the allowed one counts as rounding.
ROUNDED = 10.0
CORRECTIONS = 3  # by Newton's method, of where a step's end is moved to an event
END_SHIFT = 1e-2  # of a step: its end is moved along its polynomial by no more than this


class OnSingularity(NamedTuple):
    """Whether a stage of a step fell on a singularity, or its end, and whether it passed one."""

    stage: bool = False
    end: bool = False
    passed: bool = False


class HybridProblem(Protocol):
    """Changes the equations at events, and may choose other independent coordinates.

    The default of a method means that the equations never need it.
    """

    def begin(self, start: Evaluation) -> None:
        """Record the state at time 0."""

    def restart(self, time: float) -> tuple[Evaluation, State]:
        """Evaluate the present state at `time` (s), and choose the coordinates for what follows."""

    def position_per_speed_error(self, evaluation: Evaluation) -> FloatArray:
        """Matrix (n, n), s: the position error that a speed error becomes through slow modes."""

    def repartition_due(self) -> bool:
        """Tell whether other coordinates should be chosen."""
        return False

    def accept(self, step: Step) -> None:
        """Go to the end of a good step, and record it."""

    def longest(self, evaluation: Evaluation) -> float:
        """Limit of the next step from here, s."""

    def slipped(self, step: Step) -> float:
        """How far (m) a dependent coordinate ended from where its speed takes it."""

    def overlooked(self, step: Step, allowed: float) -> float:  # noqa: ARG002
        """Part of a step up to which its stages tell every force; 1 if they do all along it.

        `allowed` (m) is how far a hidden pulse may move anything by the end of the run.
        """
        return 1.0

    def on_singularity(self, at_stop: bool = False) -> OnSingularity:  # noqa: ARG002
        """Tell where the last step tried was on a singularity.

        There rounding decides on the dependent coordinates. A step whose end is prescribed,
        `at_stop`, may end nearer to a singularity.
        """
        return OnSingularity()

    def first_event(self, step: Step) -> Crossing | None:
        """Locate what happens first within a step."""


class ImplicitStepper:
    """Integrates step by step; `time` and `at` are the present state, `h` (s) is the next step.

    `rounded` are the instants (s) of steps on singularities, where rounding decided on errors.
    `slips` are steps of a fixed length in which dependent coordinates `slipped`: their begin and
    length (s), and how far they slipped (m).
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
        self.radau = Radau(model, error_times, np.zeros((0, 0)), control.method)
        self.time = 0.0
        self.h = 1e-3 * end if control.fixed is None else control.fixed
        self.rounded: list[float] = []
        self.slips: list[tuple[float, float, float]] = []
        self.steps, self.smallest, self.largest = 0, inf, 0.0
        self._end = end
        self._nearer = False  # whether an event was missed, so that a shorter step comes first
        self.at: Evaluation
        self._state: State

    def begin(self) -> None:
        """Start from the state at time 0."""
        self.restart()
        # An error a of accelerations moves a swinging part by a tau^2, a free one by a end^2.
        radau = self.radau
        lasts = self._end if radau.position_per_speed_error.any() else radau.error_times.free
        self.knots = KnotControl(self.model, self.control.allowed / lasts**2)
        self.problem.begin(self.at)

    @property
    def iterations(self) -> int:
        """Newton's iterations so far."""
        return self.radau.iterations

    def restart(self, event: Crossing | None = None) -> None:
        """Go on from the present state, after an event if any."""
        self.control.forget()
        self._nearer = False
        bends = event is not None and event.guard.bends
        if not bends:
            self.radau.restart()
        if bends:
            self.at = self.model.evaluate(self.time, self._state.q, self._state.v)
            self._state = self._state._replace(a=self.at.accelerations)
        else:
            self.at, self._state = self.problem.restart(self.time)
        self.radau.position_per_speed_error = self.problem.position_per_speed_error(self.at)

    def advance(self, stop: float) -> Crossing | None:
        """Make one step, at most up to `stop` (s); return the event at its end, if any.

        Raises:
            NoConvergenceError: no step is short enough.

        """
        step = self._attempt(stop)
        event = self.problem.first_event(step)
        close = instant(step.end, EVENT_TIME)
        if event is not None and event.time < step.t + close:
            return event._replace(time=self.time)
        if event is not None and event.time < step.end - close:
            to_event = self._step_to(event)
            if to_event is None:
                return None
            step = to_event
        self._note(step)
        self.time, self._state, self.at = step.end, step.finish, step.stages.pick(-1)
        self.steps += 1
        self.smallest, self.largest = min(self.smallest, step.h), max(self.largest, step.h)
        self.problem.accept(step)
        # The step that ends at the event gives its instant better than the step in which it was
        # found.
        return event and event._replace(time=self.time)

    def _note(self, step: Step) -> None:
        """Note steps past a singularity, or inexact at one, and fixed steps that slipped."""
        singularity = self.problem.on_singularity()
        missed = not self.control.fixed and not self.control.passes(step.error)
        if singularity.passed or (singularity.stage and missed):
            self.rounded.append(step.t)
        if self.control.fixed is not None:
            slip = self.problem.slipped(step)
            if not self.control.near(slip):
                self.slips.append((step.t, step.h, slip))

    # --- one step -----------------------------------------------------------------------------

    def _attempt(self, stop: float) -> Step:
        """Make a step up to `stop` (s), shorter if its error requires; choose the next length."""
        if self.problem.repartition_due():
            self.restart()
        longest = self.control.limits * self.problem.longest(self.at)
        h, first, retries = min(self.h, longest), True, 0
        while True:
            h = self._fitted(h, stop - self.time)
            step = self._step(h)
            if step is not None and self.control.fixed is not None:
                self.h = self.control.fixed  # it was shorter if an event had to be met from nearer
                return step
            again = retries < len(RETRY_FACTORS)
            if again and self._on_singularity(step, h == stop - self.time):
                # Rounding decides there at any length: with another length the stages lie
                # elsewhere.
                h *= RETRY_FACTORS[retries]
                retries += 1
            elif step is None or self._slips(step):
                h, first = h / 4, False
            elif (part := self.knots.part(step)) < 1:
                h *= part
            else:
                factor = self.control.factor(step)
                good = self.control.passes(step.error) or self._rounded(step)
                part = self.problem.overlooked(step, self.control.allowed) if good else 1.0
                if part < 1:
                    h, first = h * part, False
                elif good:
                    self.control.note(step)
                    self.h = h * (factor if first else min(factor, 1.0))
                    return step
                else:
                    h, first = h * min(factor, 0.9), False

    def _fitted(self, h: float, left: float) -> float:
        """Length of a step such that a step ends after the time `left` (s).

        Raises:
            NoConvergenceError: the length is below the rounding of time.

        """
        if h > 0.999999 * left:
            h = left
        elif h > 0.5 * left:
            h = left / 2
        if h < instant(self.time, EVENT_TIME) and h < left:
            raise NoConvergenceError(f"{h:.3g} s")
        return h

    def _step(self, h: float) -> Step | None:
        # An iteration that diverges may overflow: then it gives no number, and is rejected.
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            return self.radau.step(self.time, h, self.at, self._state, self.control.allowed)

    def _on_singularity(self, step: Step | None, at_stop: bool) -> bool:
        """Tell whether a step ends on a singularity, or is not good since a stage is on one."""
        if self.control.fixed is not None:
            return False
        singularity = self.problem.on_singularity(at_stop)
        return singularity.end or (singularity.stage and not self._good(step))

    def _good(self, step: Step | None) -> bool:
        return step is not None and not self._slips(step) and self.control.passes(step.error)

    def _rounded(self, step: Step) -> bool:
        """Tell whether an error that is too large may be rounding, near a singularity."""
        near = self.problem.on_singularity().stage
        return near and step.error < ROUNDED * self.control.allowed

    def _slips(self, step: Step) -> bool:
        """Tell whether a dependent coordinate did not go where its speed takes it."""
        return not self.control.near(self.problem.slipped(step))

    # --- up to an event -----------------------------------------------------------------------

    def _step_to(self, event: Crossing) -> Step | None:
        """Make a step to an event; None, with a shorter next step, if it is not good enough.

        The event was located in a polynomial, which is less accurate than the end of a step. So the
        end is moved a little, to the event.
        """
        h = later(event.time, self.control.late) - self.time
        step = self._step(h)
        step = None if step is None else self._ending(event, step)
        given = self.control.fixed is not None
        if step is None or not (given or self.knots.part(step) >= 1):
            self.h = h / 3  # reach the event from nearer
            return None
        return step

    def _ending(self, event: Crossing, step: Step) -> Step | None:
        """Move a step's end along its polynomial to its event; None if the event is too far away.

        Then only the polynomial of a longer step may have reached zero, not the motion. A shorter
        step shows it better; it is tried once.
        """
        solved, farthest = step, END_SHIFT * step.h
        for _ in range(CORRECTIONS):
            late = event.guard.late(step)
            if late == 0.0:
                break
            if abs(late) > farthest:
                if self._nearer:
                    break
                self._nearer = True
                return None
            step = step.ending(step.end - late)
        return step if step is solved else self._with_its_stages(step)

    def _with_its_stages(self, step: Step) -> Step | None:
        """Return a step with the stages that belong to its moved end; None if they can't be."""
        times = step.t + step.method.c * step.h
        try:
            stages = self.model.evaluate_stages(times, *step.at(times))
            accelerations = stages.accelerations
        except (ValueError, ArithmeticError):
            return None
        finish = step.finish._replace(a=accelerations[-1])
        return step._replace(finish=finish, stages=stages, accelerations=accelerations)
