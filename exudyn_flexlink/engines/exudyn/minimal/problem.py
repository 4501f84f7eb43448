"""The mechanism as the integration sees it: equations in coordinates that may change, and events.

Places on the slots' curves are followed along with the coordinates; contacts begin and end.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.diagnostics.bouncing import LOSE_SPEED
from exudyn_flexlink.engines.diagnostics.walls import BROKEN_WALL_ADVICE, broken_wall
from exudyn_flexlink.engines.exudyn.faces import Touch
from exudyn_flexlink.engines.exudyn.intervals import Entry
from exudyn_flexlink.engines.exudyn.minimal.contacts import (
    OFF_THE_END,
    PenaltyContact,
    RigidContact,
    Side,
)
from exudyn_flexlink.engines.exudyn.minimal.coordinates import StepEnd, TreeState
from exudyn_flexlink.engines.exudyn.minimal.events import (
    ContactChange,
    EventFinder,
    Goal,
    PieceEnd,
    TurnsMade,
    WallChange,
)
from exudyn_flexlink.engines.exudyn.minimal.impacts import Impacts, meets
from exudyn_flexlink.engines.exudyn.minimal.kinks import KinkPassed
from exudyn_flexlink.engines.exudyn.minimal.lasting import LastingErrors
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel
from exudyn_flexlink.engines.exudyn.minimal.overlooked import Overlooked
from exudyn_flexlink.engines.exudyn.minimal.recording import Recorder
from exudyn_flexlink.engines.exudyn.minimal.shapes import OnCurve
from exudyn_flexlink.integrate.collocation import NODES, STAGES, WEIGHTS
from exudyn_flexlink.integrate.events import Event
from exudyn_flexlink.integrate.problem import Evaluation, State
from exudyn_flexlink.integrate.radau import Step
from exudyn_flexlink.intervals import ContactEvent
from exudyn_flexlink.mechanism import TOUCHING

IN_CONTACT = 0.15  # of the contact's half period: the first step in it
# Of the largest penetration: gap that may be open where a contact is ended.
FARTHEST_OFF = 1e-3
# Where the largest reaction in a step is looked for, on the polynomial through its nodes.
TO_LOOKS = np.vander(np.linspace(0.0, 1.0, 33), STAGES + 1, increasing=True) @ NODES
GIVE_WAY = "a drive by a torque in place of a speed, or a law with stiffness"
# Of a contact's half period: shorter steps are not checked for ending off the face.
SHORTEST_LOOK = 1e-3


class _Looked(NamedTuple):
    """A step, its end, and all coordinates at the samples `within` it, unless those wait."""

    step: Step
    end: StepEnd
    within: TreeState | None


@dataclass
class MinimalProblem:
    """A tree model with its events, in a run to `end` (s); see `stepper.HybridProblem`.

    `half_periods` (s) are those of the contacts, then of the pairs of link and guide; `given` (s)
    is the user's own step.
    """

    model: MinimalModel
    recorder: Recorder
    goal: Goal | None
    half_periods: list[float]
    end: float
    given: float | None
    reached: bool = False
    stop_reason: str = ""
    stop_advice: str = ""
    _looked: _Looked | None = None  # the last step looked at
    _near: Step | None = None  # the last one, if what was taken up is near its end only
    _jumped: bool = False  # a contact's force, or speeds, where the last step ended

    def __post_init__(self) -> None:
        x, v = self.model.start
        for contact in self.model.contacts:
            if contact.touch(x, v).gap < -TOUCHING:
                contact.side = Side.BEHIND
        self._lasting = LastingErrors(self.model, self.end)
        self._overlooked = Overlooked(self.model, self.end)
        self._of_scene = len(self.model.assembly.mechanism.contacts)
        self._finder = EventFinder(self.model, self.goal, x, v)
        self._change_walls(0.0)
        self.impacts = Impacts(self.model, self._finder, self.recorder)

    @property
    def over(self) -> bool:
        """Whether the run ends here."""
        return bool(self.stop_reason) or self.reached

    @property
    def left(self) -> float | None:
        """Angle still to turn, rad; None where time ends the run."""
        left = None if self.goal is None else self.goal(self._finder.x)
        return 0.0 if self.reached else left

    # --- steps --------------------------------------------------------------------------------

    def begin(self, at: Evaluation) -> None:
        """Record the state at time 0."""
        self.recorder.begin(at)

    def restart(self, time: float) -> tuple[Evaluation, State]:
        """Take up the present state, with the independent coordinates that are best there."""
        self._settle()
        self.model.coordinates.resume()
        q, v = self.model.coordinates.independent()
        self._finder.kinks.take_sides(time, q, v)
        at = self.model.evaluate(time, q, v)
        self.model.look(at.kept.state.x, at.kept.state.transform)
        if self._jumped:
            self._jumped = False
            self.recorder.keep_again(at)
        return at, State(q, v, at.accelerations)

    def position_per_speed_error(self, at: Evaluation) -> FloatArray:
        """Matrix (n, n), s: the position error that a speed error becomes through slow modes."""
        return self._lasting.at(at)

    def repartition_due(self) -> bool:
        """Tell whether other coordinates should be the independent ones."""
        return self.model.coordinates.repartition_due()

    def accept(self, step: Step) -> None:
        """Go to the end of a step, and record it."""
        (end, exact), within = self._look(step)[1:]
        self._near = None if exact else step
        self.model.coordinates.settle(step.end, end, step.finish.a)
        self.model.look(end.x, end.transform)
        self._finder.accept(step, end)
        for contact, touch in self._giving_way():
            contact.peak = max(contact.peak, contact.force(touch))
        self._note_reactions(step)
        if within is None:
            self.recorder.take_quiet(step, end, exact)
        else:
            self.recorder.take(step, within, end)
        if any(contact.acts for contact in self.model.contacts[: self._of_scene]):
            self.recorder.mark()  # even samples miss the peaks of a contact's force
        if (broken := self.model.walls.broken(self._finder.walls.seen)) is not None:
            self.stop_reason, self.stop_advice = broken_wall(broken), BROKEN_WALL_ADVICE

    def _note_reactions(self, step: Step) -> None:
        """Keep the largest reactions of rigid contacts in a step."""
        for k in self.model.rigid.closed():
            nodes = [step.begin.kept.pushes[k, 0], *step.stages.kept.pushes[:, k, 0]]
            contact = self.model.contacts[k]
            contact.peak = max(contact.peak, float((TO_LOOKS @ nodes).max()))

    def _settle(self) -> None:
        """Go to the very end of the last step, if it was near to it only."""
        self.recorder.work_off_waiting()
        if self._near is not None:
            step, self._near = self._near, None
            end = self.model.state(step.end, step.finish.q, step.finish.v)
            self.model.coordinates.settle(step.end, end, step.finish.a)

    def _end_of(self, step: Step) -> TreeState:
        """All coordinates at the end of a step."""
        return self._look(step).end.state

    def _look(self, step: Step) -> _Looked:
        """All coordinates at the end of a step and at the samples in it, found once."""
        if self._looked is None or self._looked.step is not step:
            end = self._told_end(step) if self.recorder.waits(step) else None
            self._looked = self._found(step) if end is None else _Looked(step, end, None)
        return self._looked

    def _told_end(self, step: Step) -> StepEnd | None:
        """The end of a step as its stages tell it; None if it has to be found."""
        end = self.model.coordinates.end_of(step)
        if end is None or end.exact or self._finder.nothing_happens(step, end.state):
            return end
        return None

    def _found(self, step: Step) -> _Looked:
        within = self.recorder.found_with_end(step)
        told = None if len(within) else self.model.coordinates.end_of(step)
        if told is not None and told.exact:
            return _Looked(step, told, step.stages.kept.state.pick(slice(0)))
        q, v = step.finish.q[None], step.finish.v[None]
        if len(within):
            inner = step.at(within)
            q, v = np.concatenate([inner[0], q]), np.concatenate([inner[1], v])
        found = self.model.states(np.append(within, step.end), q, v)
        return _Looked(step, StepEnd(found.pick(-1), True), found.pick(slice(-1)))

    def _giving_way(self) -> list[tuple[PenaltyContact, Touch]]:
        """Contacts with a penalty force that acts, with where they are."""
        return [(contact, self._finder.touches[k]) for k, contact in self.model.giving_way()]

    def longest(self, at: Evaluation) -> float:
        """Limit of a step, s: places stay near those searched from, a point comes to rest."""
        near = self.model.coordinates.longest(at.kept.state)
        rests = [contact.rests_in(touch) for contact, touch in self._giving_way()]
        limits = [near, *rests]
        if self.given is not None:  # no error is controlled then: contacts that act ask for steps
            acting = [*(one.acts for one in self.model.contacts), *self.model.walls.touching]
            limits += (IN_CONTACT * np.array(self.half_periods)[acting]).tolist()
        return min(limits)

    def slipped(self, step: Step) -> float:
        """How far (m) a dependent coordinate ended from where its speed would have taken it."""
        stages, begin = step.stages.kept.state, step.begin.kept.state
        return self.model.coordinates.slipped(step.h, WEIGHTS, stages, begin)

    def overlooked(self, step: Step, allowed: float) -> float:
        """Part of a step after which a formula is not what it is at the stages; 1 if nowhere."""
        return self._overlooked.part(step, allowed)

    def on_singularity(self, at_stop: bool = False) -> tuple[bool, bool, bool]:
        """Tell whether a stage, or the end, of the last step was on a dead centre, or passed it."""
        return self.model.coordinates.on_dead_centre(at_stop)

    # --- events -------------------------------------------------------------------------------

    def first_event(self, step: Step) -> Event | None:
        """Locate what happens first within a step."""
        end, exact = self._look(step).end
        return self._finder.first(step, end) if exact else None

    def late(self, event: Event, step: Step) -> float:
        """How long before the step's end a wall began or ceased to press, s, or a point slid off.

        There it matters: a force is gone from one instant to the next. Likewise a rigid contact
        closed: what gaps are off by would be as much as the smallest bounces.
        """
        if isinstance(event.what, WallChange):
            return self._finder.walls.late(event.what.pair, self._end_of(step), step.end)
        if isinstance(event.what, KinkPassed):
            return self._finder.kinks.late(event.what, self._end_of(step), step.end)
        if event.leaps or not isinstance(event.what, ContactChange):
            return 0.0
        end = self._end_of(step)
        contact = self.model.contacts[event.what.contact]
        touch = contact.touch(end.x, end.v)
        if isinstance(contact, RigidContact) and not contact.acts:
            return touch.gap / touch.gap_rate if touch.gap_rate != 0 else 0.0
        return contact.left_since(touch)

    def misses(self, event: Event, step: Step) -> bool:
        """Tell that a contact would end well off its face, or a rigid one close well off it.

        A tolerance may allow more than the contact is deep, but a force that pulls there, or is
        gone too early, changes speeds by no little.
        """
        if not isinstance(event.what, ContactChange):
            return False
        k = event.what.contact
        contact = self.model.contacts[k]
        end = self._end_of(step)
        touch = contact.touch(end.x, end.v)
        if isinstance(contact, RigidContact):
            return contact.side is Side.APART and touch.inside >= 0 and not meets(touch, step.end)
        if not contact.acts or step.h < SHORTEST_LOOK * self.half_periods[k]:
            return False
        return touch.inside >= 0 and touch.gap > FARTHEST_OFF * contact.peak / contact.law.stiffness

    def cross(self, event: Event) -> float:
        """Change the equations; return how long (s) the next step may be."""
        self.recorder.work_off_waiting()
        longest = inf
        if isinstance(event.what, TurnsMade):
            self.reached = True
        elif isinstance(event.what, PieceEnd):
            point, way = event.what
            if isinstance(point, OnCurve):
                point.next_piece(way)
            elif not point.next_piece(way, event.time):
                self.stop_reason = f"the point of slot '{point.slot.name}' reached the curve's end"
                self.stop_advice = "lengthen the curve, or end the run before"
        elif isinstance(event.what, KinkPassed):
            self._finder.kinks.cross(event.what)
        elif isinstance(event.what, WallChange):
            longest = self._change_walls(event.time, event.what.pair)
        elif isinstance(event.what, ContactChange):
            k = event.what.contact
            if k < self._of_scene:
                self.recorder.mark()
            if k in self.model.rigid.all:
                self._change_rigid(event.time, k)
                return longest
            longest = self._change_contact(event.time, k, self._finder.touches[k])
        return longest

    def _change_rigid(self, time: float, k: int) -> None:
        self._jumped = True
        try:
            self.impacts.change(time, k)
        except ArithmeticError as error:
            self.stop_reason, self.stop_advice = str(error), GIVE_WAY
        if self.impacts.endless:
            self.stop_reason, self.stop_advice = self.impacts.endless, LOSE_SPEED
        for contact in self.model.rigid.all.values():  # one impact may begin or end others
            contact.follow(self._finder.x)

    def _change_contact(self, time: float, k: int, touch: Touch) -> float:
        """Let a contact begin or end; as `cross`."""
        contact = self.model.contacts[k]
        if not contact.acts:
            if not contact.passes_line(touch):
                contact.side, contact.peak = Side.PRESSED, 0.0
                self._tell(time, k, "contact begins", touch)
        else:
            off = self._jumped = touch.inside < min(-touch.gap, OFF_THE_END)
            contact.side = Side.BEHIND if off else Side.APART
            self._tell(time, k, "leaves the face" if off else "contact ends", touch, contact.peak)
        contact.follow(self._finder.x)
        return IN_CONTACT * self.half_periods[k] if contact.acts else inf

    def _change_walls(self, time: float, there: int | None = None) -> float:
        """Let all pairs that do so at an event of `there` begin or cease to press; as `cross`."""
        longest, before, walls = inf, len(self.model.contacts), self._finder.walls
        for k in walls.changed(time, there).tolist():
            self.model.walls.change(k)
            begins = bool(self.model.walls.touching[k])
            kind: ContactEvent = "contact begins" if begins else "contact ends"
            self._tell(time, before + k, kind, walls.touch(k))
            if begins:
                longest = min(longest, IN_CONTACT * self.half_periods[before + k])
        self._lasting.touch(time)
        return longest

    def _tell(
        self, time: float, k: int, kind: ContactEvent, touch: Touch, peak: float = 0.0
    ) -> None:
        self.recorder.note(Entry(time, k, kind, touch, -touch.gap_rate, peak))
