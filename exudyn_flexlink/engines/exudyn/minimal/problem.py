"""The mechanism as the integration sees it: equations in coordinates that may change, and events.

Places on the slots' curves are followed along with the coordinates; contacts begin and end.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.diagnostics import (
    BROKEN_WALL_ADVICE,
    LOSE_SPEED,
    broken_wall,
)
from exudyn_flexlink.engines.exudyn.minimal.contacts import LapFollower, TableFollower, Touch
from exudyn_flexlink.engines.exudyn.minimal.coordinates import TreeState
from exudyn_flexlink.engines.exudyn.minimal.events import EventFinder, Followed, Goal
from exudyn_flexlink.engines.exudyn.minimal.formulas import PulseWatch, UntilWatch
from exudyn_flexlink.engines.exudyn.minimal.friction import LockedError
from exudyn_flexlink.engines.exudyn.minimal.impacts import WEAK_PUSH, Impacts, meets
from exudyn_flexlink.engines.exudyn.minimal.kinematics import TrackPoint
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.engines.exudyn.minimal.recording import TreeRecorder
from exudyn_flexlink.engines.exudyn.minimal.rigid import JammedError
from exudyn_flexlink.engines.interrupts import TOO_DEEP_ADVICE, DepthBounds
from exudyn_flexlink.engines.pair_events import TurnsGuard
from exudyn_flexlink.engines.touching import FIRST, SHORTEST_SWING, Change, Moment
from exudyn_flexlink.integrate.events import Crossing, Guard
from exudyn_flexlink.integrate.problem import Evaluation, State
from exudyn_flexlink.integrate.radau import Step
from exudyn_flexlink.integrate.stepper import FREELY, PART, OnSingularity, slow_motions
from exudyn_flexlink.mechanism import pressed_among

# rad, by which a link may turn in a step, also at constant speed: there no error limits a step, but
# the polynomials that give extremes would be off by more than 1e-12 of a radius.
LARGEST_TURN = 1.0
GIVE_WAY = "a law with stiffness"
NO_PIECE = "end the run before two neighbours of the rope meet, or keep them apart by a stop"
NO_HELD_SPEED = ", or a torque in place of a drive that holds a speed"


class _StepStates(NamedTuple):
    """A step, all coordinates at its end, and those at its `TreeRecorder.instants`."""

    step: Step
    end: TreeState
    at_instants: TreeState


@dataclass
class MinimalProblem:
    """A tree model with its events, in a run to `end` (s); see `stepper.HybridProblem`.

    `half_periods` (s) are those of the contacts, then of the pairs of link and guide; `given` (s)
    is a fixed step. In a run that `goes_on` from another one, `carried` has the speeds (m/s) at
    which contacts touched that press at the start, by their numbers.
    """

    model: MinimalModel
    recorder: TreeRecorder
    goal: Goal | None
    half_periods: list[float]
    end: float
    given: float | None
    carried: Mapping[int, float] = field(default_factory=dict)
    goes_on: bool = False
    reached: bool = False
    came: bool = False  # whether the formula that ends the run has come to zero
    stop_reason: str = ""
    stop_advice: str = ""
    _states: _StepStates | None = None  # of the last step looked at
    _first: float = inf  # s: limit of the first step after a contact has closed
    _jumped: bool = False  # whether a contact's force, or speeds, jumped where the last step ended
    _pushes: FloatArray | None = None  # of contacts at the stages of the last step

    def __post_init__(self) -> None:
        contacts, assembly = self.model.contacts, self.model.assembly
        if self.goes_on:
            touching = [k for k in self.carried if k < contacts.count]
        else:
            touching = pressed_among(assembly.mechanism.touching, assembly.state.q)
        pressed = [k for k in touching if k not in contacts.idle]
        self.finder = EventFinder(self.model, self.goal, self)
        springs = contacts.lets_go.copy()
        springs[pressed] = True
        self.model.touches.start(np.where(springs, 0.0, self.finder.seen.gap)[: contacts.count])
        self._begin_laps()
        self._lasting: FloatArray | None = None
        self._flight = 0.0  # s, the longest time in which no pair of link and guide pressed
        self._free_since: float | None = 0.0
        self._pulses = PulseWatch(self.model, self.end)
        self._walls = contacts.count  # number of the first pair of link and guide
        self.change_walls(0.0)
        self.bounds = DepthBounds(self.recorder.contacts)
        self._begin_pressed(pressed)
        self.finder.frictions.settle(0.0, *self.model.coordinates.independent())
        self.impacts = Impacts(self.model, self.finder, self.recorder)
        until = assembly.mechanism.until
        self.until: UntilWatch | None = None
        if until is not None:
            self.until = UntilWatch(
                self.model, self.recorder, until, self._come, goes_on=self.goes_on
            )

    def _begin_pressed(self, pressed: list[int]) -> None:
        """Begin the touches of time 0: contacts `pressed` at a rest, and stretched ropes."""
        contacts = self.model.contacts
        for k in range(contacts.count):
            touch = self.finder.touch(k)
            if k in contacts.rigid:
                continue
            if contacts.pressed_by(k, touch) > 0 if contacts.lets_go[k] else k in pressed:
                self.change(0.0, k, Change.CLOSES, touch)
                contacts.follow(k, self.model.start[0], presses=True)

    def _begin_laps(self) -> None:
        """Let pins of slots with play be in the laps in which they start."""
        contacts, x = self.model.contacts, self.model.start[0]
        for k in contacts.idle:
            self.model.touches.idle(k)
        for pin, view in contacts.lap_views():
            pin.begin(complex(view(x[None], x)[0]))

    @property
    def over(self) -> bool:
        """Whether the run ends here."""
        return bool(self.stop_reason) or self.reached

    @property
    def left(self) -> float | None:
        """Angle still to turn, rad; None where time ends the run."""
        left = None if self.goal is None else self.goal(self.finder.x)
        return 0.0 if self.reached else left

    # --- steps --------------------------------------------------------------------------------

    def begin(self, start: Evaluation) -> None:
        """Record the state at time 0."""
        self.recorder.begin(start)

    def restart(self, time: float) -> tuple[Evaluation, State]:
        """Start from the present state, with the independent coordinates that are best there."""
        self.recorder.record_waiting()
        self.model.coordinates.resume()
        q, v = self.model.coordinates.independent()
        self.finder.kinks.take_sides(time, q, v)
        ways = self.model.frictions.way
        self.finder.frictions.settle(time, q, v)
        self._jumped |= bool(np.any(self.model.frictions.way != ways))  # also as a drive stops
        evaluation = self.model.evaluate(time, q, v)
        pulled = self._pulled(evaluation)
        if pulled is not None:
            self.strike(time, pulled, pulled)
            return self.restart(time)
        self.model.look(evaluation.kept.state.x, evaluation.kept.state.transform)
        if self._jumped:
            self._jumped = False
            self.recorder.keep(evaluation)
        return evaluation, State(q, v, evaluation.accelerations)

    def _pulled(self, evaluation: Evaluation) -> int | None:
        """Rigid contact whose reaction jumped below zero, with a force or a curvature; or None."""
        closed = self.model.rigid.closed()
        if self._pushes is None or not closed:
            return None
        pressed = self._pushes[:, closed, 0].max(axis=0)
        pulls = np.where(pressed > 0, evaluation.kept.pushes[closed, 0] + WEAK_PUSH * pressed, 0.0)
        return closed[int(pulls.argmin())] if pulls.min() < 0 else None

    def position_per_speed_error(self, evaluation: Evaluation) -> FloatArray:
        """Matrix (n, n), s, from errors of speeds to those of places: see `slow_motions`.

        A link that flies between the walls of a sleeve keeps such errors until the next touch, not
        until the run ends. No step can tell what a touch makes of them; a second run does. So each
        pair of link and guide that has touched counts as a spring across its gap. The spring is so
        soft that errors last as long as the longest flight so far.
        """
        state = evaluation.kept.state
        caught = sorted(k for k in self.model.touches.ever if k >= self._walls)
        if self._lasting is None or state.transform.chosen is None or caught:
            stiffness = self.model.springs(evaluation)[0]
            if caught:
                flight = max(self._longest_flight(float(evaluation.kept.t)), SHORTEST_SWING)
                moving = self.model.kinematics.moving(state.x, state.v)
                stiffness = stiffness + self.model.contacts.catching(
                    caught, moving, state.transform, evaluation.mass, FREELY / PART * flight
                )
            self._lasting = slow_motions(evaluation.mass, stiffness, self.end, SHORTEST_SWING)
        return self._lasting

    def _longest_flight(self, time: float) -> float:
        return (
            self._flight if self._free_since is None else max(self._flight, time - self._free_since)
        )

    def repartition_due(self) -> bool:
        """Tell whether other coordinates should be the independent ones."""
        return self.model.coordinates.repartition_due()

    def accept(self, step: Step) -> None:
        """Go to the end of a step, and record it."""
        end, states = self._look(step)[1:]
        self._first = inf
        self.model.coordinates.settle(step.end, end, step.finish.a)
        self.model.look(end.x, end.transform)
        self.finder.accept(end)
        self.recorder.take(step, states)
        self._pushes = step.stages.kept.pushes
        gaps, pressed = self.finder.seen.gap, self.model.touches.pressed
        if (broken := self.model.contacts.broken(gaps, pressed)) is not None:
            self.stop_reason, self.stop_advice = broken_wall(broken), BROKEN_WALL_ADVICE
        elif self.bounds.any:
            self.stop_reason = self.bounds.passed(-gaps * pressed)
            self.stop_advice = TOO_DEEP_ADVICE

    def _look(self, step: Step) -> _StepStates:
        """All coordinates at the end of a step, and within it."""
        if self._states is None or self._states.step is not step:
            times = self.recorder.instants(step)
            q, v = step.at(times)
            q[-1], v[-1] = step.finish.q, step.finish.v
            states = self.model.states(times, q, v)
            self._states = _StepStates(step, states.pick(-1), states)
        return self._states

    def longest(self, evaluation: Evaluation) -> float:
        """Limit of a step, s: links turn by LARGEST_TURN at most."""
        turning = np.abs(evaluation.kept.state.v[self.model.kinematics.hinge])
        fastest = float(turning.max(initial=0.0))
        limits = [self._first, LARGEST_TURN / fastest if fastest > 0 else inf]
        if self.given is not None:  # without error control, contacts that act limit steps
            acting = np.array(self.half_periods)[self.model.touches.pressed]
            limits += (FIRST * acting).tolist()
        return min(limits)

    def slipped(self, step: Step) -> float:
        """How far (m) a dependent coordinate ended from where its speed takes it."""
        stages, begin = step.stages.kept.state, step.begin.kept.state
        return self.model.coordinates.slipped(step.h, step.method.weights, stages, begin)

    def overlooked(self, step: Step, allowed: float) -> float:
        """Part of a step up to which its stages tell every formula; 1 if they do all along it."""
        return self._pulses.part(step, allowed)

    def on_singularity(self, at_stop: bool = False) -> OnSingularity:
        """Tell where the last step tried was at a dead centre."""
        return self.model.coordinates.on_dead_centre(at_stop)

    # --- events -------------------------------------------------------------------------------

    def first_event(self, step: Step) -> Crossing | None:
        """Locate what happens first within a step."""
        first = self.finder.first(step, self._look(step).end)
        over = None if self.until is None else self.until.first(step)
        if first is None or over is None:
            return first or over
        return min(first, over, key=lambda crossing: crossing.time)

    def _come(self) -> None:
        """End the run, since its formula has come to zero."""
        self.reached = self.came = True

    def cross(self, event: Crossing) -> None:
        """Let the event's guard change the equations, once the steps that wait are recorded."""
        self.recorder.record_waiting()
        event.guard.cross(event.time)

    def end_of(self, step: Step) -> TreeState:
        """All coordinates at the end of a step."""
        return self._look(step).end

    def keep(self, *, leaps: bool) -> None:
        """Record the end of the last step; if something leaps there, also the state before it."""
        self._jumped = leaps
        self.recorder.keep_last(before=leaps)

    def turns_guard(self) -> Guard:
        """Guard of the turns that end the run."""
        return TurnsGuard(self)

    def piece_guard(self, point: Followed, way: int) -> Guard:
        """Guard of what comes to the end of its piece of a curve (way 1), or to its start (-1)."""
        return PieceGuard(self, point, way)

    def contact_guard(self, k: int) -> Guard:
        """Guard of contact k, which begins or ends; pairs of link and guide follow the scene's."""
        if k >= self._walls:
            return PairGuard(self, k)
        return RigidGuard(self, k) if k in self.model.rigid.all else ContactGuard(self, k)

    def short_guard(self, rope: str) -> Guard:
        """Guard of a rope over points; the run ends as a piece of it has no length left."""
        return ShortGuard(self, rope)

    def next_piece(self, point: Followed, way: int, time: float) -> None:
        """Go on along the next piece of a curve or a table; the run stops if there is none."""
        before = point.walls if isinstance(point, LapFollower) else []
        if point.next_piece(way, time):
            if isinstance(point, LapFollower) and point.walls != before:
                self._change_walls_of_lap(time, before, point.walls)
            return
        if isinstance(point, TableFollower):
            self.stop_reason = f"the table of forces of '{point.name}' ends there"
            self.stop_advice = "give it more rows: no force is made up beyond them"
        elif isinstance(point, TrackPoint):
            self.stop_reason = f"the point of slot '{point.slot.name}' reached the curve's end"
            self.stop_advice = "lengthen the curve, or end the run before"

    def _change_walls_of_lap(self, time: float, before: list[int], after: list[int]) -> None:
        """Replace the walls of a lap by those of another; a wall that presses goes on to."""
        contacts, touches = self.model.contacts, self.model.touches
        contacts.idle = contacts.idle - {*after} | {*before}
        for old, new in zip(before, after, strict=True):
            pressed, approach = self.finder.presses(old), float(touches.approach[old])
            if pressed:
                self.change(time, old, Change.OPENS, self.finder.touch(old))
                contacts.follow(old, self.finder.x, presses=False)
            touches.idle(old)
            touches.idle(new, idle=False)
            if pressed:
                touch = self.finder.touch(new)._replace(gap_rate=-approach)
                self.change(time, new, Change.CLOSES, touch)
                contacts.follow(new, self.finder.x, presses=True)

    def strike(self, time: float, k: int, pulled: int | None = None) -> None:
        """Let a contact by impulse bounce, begin or end, with all that follows at this instant.

        If its reaction has jumped below zero, it ends; then it is the contact `pulled`, too.
        """
        self.keep(leaps=True)
        try:
            self.impacts.change(time, k)
        except ArithmeticError as error:
            self.stop_reason = str(error)
            driven = self.model.assembly.mechanism.speed_motors
            advice = GIVE_WAY + NO_HELD_SPEED * bool(driven)
            self.stop_advice = advice
            if isinstance(error, JammedError | LockedError):
                self.stop_advice = error.advice
        if self.impacts.endless:
            self.stop_reason, self.stop_advice = self.impacts.endless, LOSE_SPEED
        for other in self.model.rigid.all:  # an impact may begin or end other contacts
            # A contact that ends where a curvature jumps stays on the next piece for one step.
            presses = self.finder.presses(other) or other == pulled
            self.model.contacts.follow(other, self.finder.x, presses=presses)

    def change(self, time: float, k: int, what: Change, touch: Touch) -> None:
        """Let a contact begin or end at its present place."""
        if what is Change.CLOSES:
            self._first = min(self._first, FIRST * self.half_periods[k])
        rate = -self.carried[k] if time == 0 and k in self.carried else touch.gap_rate
        now = Moment(time, touch.place, rate, self.recorder.totals_of(k))
        self.model.touches.change(k, what, now)

    def change_walls(self, time: float, contact: int | None = None) -> None:
        """Let pairs of link and guide begin or cease to press, at an event of this `contact`."""
        for k in self.finder.changed_pairs(time, contact):
            touch = self.finder.touch(k)
            what = self.model.touches.crossing(k, touch.gap, touch.gap_rate, touch.inside)
            self.change(time, k, what, touch)
        self._flight = self._longest_flight(time)
        any_presses = self.model.touches.pressed[self._walls :].any()
        self._free_since = None if any_presses else time

    @property
    def places(self) -> FloatArray:
        """Present places of all contacts on their faces (c,), m."""
        return self.finder.seen.place


# --- guards ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class PieceGuard(Guard):
    """What is followed on a curve comes to the end of its piece (way 1), or to its start (-1)."""

    problem: MinimalProblem
    point: Followed
    way: int

    def cross(self, time: float) -> None:
        """Go on along the next piece."""
        self.problem.next_piece(self.point, self.way, time)


@dataclass(frozen=True)
class ShortGuard(Guard):
    """A piece of a rope over points has no length left, and so no direction."""

    problem: MinimalProblem
    rope: str

    def cross(self, time: float) -> None:  # noqa: ARG002
        """End the run."""
        self.problem.stop_reason = f"a piece of the rope '{self.rope}' has shrunk to length 0"
        self.problem.stop_advice = NO_PIECE


@dataclass(frozen=True)
class PairGuard(Guard):
    """A pair of link and guide, of this number, begins or ceases to press."""

    problem: MinimalProblem
    contact: int
    bends = True

    def late(self, step: Step) -> float:
        """How long (s) before a step's end the gap was closed; negative: after."""
        problem = self.problem
        return problem.finder.late_pair(self.contact, problem.end_of(step), step.end)

    def cross(self, time: float) -> None:
        """Let pairs of link and guide begin or cease to press."""
        self.problem.change_walls(time, self.contact)


@dataclass(frozen=True)
class ContactGuard(Guard):
    """A contact of the scene, of this number, begins or ends."""

    problem: MinimalProblem
    contact: int

    def late(self, step: Step) -> float:
        """How long (s) before a step's end the contact began or ended; negative: after."""
        k, finder, contacts = self.contact, self.problem.finder, self.problem.model.contacts
        touch = finder.touch_at(k, self.problem.end_of(step))
        slid = contacts.left_since(k, touch) if finder.presses(k) else None
        if slid is not None:
            return slid
        beside = touch.inside < 0 or touch.gap_rate == 0
        if beside or self._force_decides() or meets(touch, step.end):
            return 0.0
        return touch.gap / touch.gap_rate

    def _force_decides(self) -> bool:
        """Tell whether a force decides on the instant, so that the gap there need not be zero.

        The force of a law begins at zero, so that a small error of the instant does not matter. A
        reaction that comes to zero decides on its end, and so does a force that lets go before its
        gap has opened.
        """
        k, finder, contacts = self.contact, self.problem.finder, self.problem.model.contacts
        if contacts.lets_go[k]:
            return finder.presses(k) or finder.let_go(k)
        return finder.presses(k) if k in contacts.rigid else not finder.presses(k)

    def cross(self, time: float) -> None:
        """Let the contact begin or end, unless its point has only passed beside the face."""
        touch = self.problem.finder.touch(self.contact)
        what = self.problem.model.touches.crossing(
            self.contact, touch.gap, touch.gap_rate, touch.inside
        )
        if what is not Change.PASSES or meets(touch, time):
            self.change(time, what, touch)

    def change(self, time: float, what: Change, touch: Touch) -> None:
        """Change the contact."""
        k, problem, contacts = self.contact, self.problem, self.problem.model.contacts
        if k < len(problem.model.assembly.mechanism.contacts):  # touches in bearings are too many
            problem.keep(leaps=what is Change.SLIDES_OFF or bool(contacts.lets_go[k]))
        problem.change(time, k, what, touch)
        contacts.follow(k, problem.finder.x, presses=what is Change.CLOSES)


class RigidGuard(ContactGuard):
    """A contact by impulse, of this number, closes or ends."""

    def change(self, time: float, what: Change, touch: Touch) -> None:  # noqa: ARG002
        """Let the contact bounce, begin or end."""
        self.problem.strike(time, self.contact)
