"""When a contact acts, what its beginning and end are, and the steps it asks for.

A contact of the scene remembers on which side the point came: one that passed beside the face and
is behind it is not in contact until it is back on the free side. The pairs of a sleeve are walled:
whatever is behind the face, within its length, is pressed back.
"""

from __future__ import annotations

from math import inf

from exudyn_flexlink.engines.exudyn.faces import Touch
from exudyn_flexlink.engines.exudyn.redundant.broad_phase import BESIDE
from exudyn_flexlink.engines.exudyn.redundant.events import REACHED, end_on, first_zero
from exudyn_flexlink.engines.exudyn.redundant.intervals import Entry
from exudyn_flexlink.engines.exudyn.redundant.pressing import PressingCircles, PressingFace
from exudyn_flexlink.engines.exudyn.redundant.step_end import StepEnd
from exudyn_flexlink.engines.exudyn.redundant.system import System
from exudyn_flexlink.intervals import ContactEvent
from exudyn_flexlink.mechanism import (
    TOUCHING,
    Channel,
    CircleContact,
    FaceContact,
    Resolution,
    deepest_allowed,
)

EDGE = 1e-13  # of a face's length: so near to an end, rounding decides on which side a place is
OPEN = 1e-15  # m: a gap this small counts as open, so that an event ahead is found
# Of a contact's step, the shortest one beside it: generalised-alpha carries accelerations from step
# to step, and what a far shorter step leaves in them disturbs the next.
SHORTEST = 0.1
OVERSHOOT = 0.005  # of a contact's step: the step that ends so far behind a face sees the contact
AHEAD = 4  # steps before a contact can begin, from which on its items act


class ContactItem:
    """The state of one contact; `index` is its number among all contacts of the run."""

    def __init__(
        self,
        system: System,
        contact: FaceContact | CircleContact,
        index: int,
        resolution: Resolution,
        channel: Channel | None = None,
    ) -> None:
        """`channel` is that whose link and guide it is a pair of."""
        self.index = index
        self.contact = contact
        # Circles are walls all around: nothing comes beside or behind them.
        self.walled = isinstance(contact, CircleContact) or channel is not None
        self.resolution, self.contact_step = resolution, resolution.step
        self._shortest = SHORTEST * resolution.step
        self.items: PressingCircles | PressingFace
        if isinstance(contact, CircleContact):
            self.items = PressingCircles(system, contact)
        else:
            self.items = PressingFace(system, contact)
        self.geometry = self.items.geometry
        self.channel = channel
        self._two_sided = isinstance(contact, FaceContact) and contact.side == 0
        self._touch: Touch | None = None
        state = system.assembly.state
        start = self.geometry.touch(state.q.ravel().tolist(), state.v.ravel().tolist())
        self.behind = not self.walled and start.gap < -TOUCHING
        self.pressed = False
        self.jumped = False  # its force, at the last step
        self.entry: Entry | None = None  # of what began or ended in the last step

    @property
    def broken(self) -> bool:
        """Whether the link is so deep in a wall that it can't come back."""
        if self.channel is None or self._touch is None or not self.pressed:
            return False
        return -self._touch.gap > deepest_allowed(self.channel)

    def after_step(self, now: StepEnd, step: float) -> float:
        """Note what began or ended in the last step; return the next step (s)."""
        touch, before = self.geometry.touch(now.q_list, now.v_list), self._touch
        self.jumped, self.entry = False, None
        self._note(touch, now, before)
        if before is not None and now.step > 0:
            touch.gap_bend = (touch.gap_rate - before.gap_rate) / now.step
            touch.slip_bend = (touch.slip - before.slip) / now.step
        self._touch = touch
        if self.behind:
            self.items.wake(False)
            return self._toward_free_side(touch, step)
        if self.pressed:
            return self._while_pressed(touch, step)
        if touch.gap < 0 or self._two_sided:
            return self._toward_face(touch, step)
        return self._while_apart(touch, step)

    def rest(self) -> None:
        """Cost nothing until the next look: it can't touch before that."""
        self.items.wake(False)
        self._touch, self.jumped, self.entry = None, False, None

    def aim(self, step: float) -> None:
        """Prepare the force for the next step, which is known now."""
        if self.items.awake and self._touch is not None:
            self.items.aim(self._touch, step)

    # --- what happened -------------------------------------------------------------------------

    def _note(self, touch: Touch, now: StepEnd, before: Touch | None) -> None:
        slid = REACHED * now.step * touch.slip
        on_face = self._on_face(touch.place + slid)
        beyond = touch.gap < 0 or self._two_sided
        if self.pressed and not beyond:
            self.pressed = False
            self._tell(now, "contact ends", touch, before)
        elif self.pressed and not on_face:
            self.pressed, self.behind = False, not self.walled
            self._tell(now, "leaves the face", touch, before)
            self.jumped = True
        elif not self.pressed and not self.behind and beyond:
            if on_face:
                self.pressed = True
                self._tell(now, "contact begins", touch, before)
                self.jumped = -touch.gap > abs(touch.gap_rate) * now.step + OPEN
            else:
                self.behind = not self.walled
        elif self.behind and touch.gap >= 0:
            self.behind = False

    def _tell(self, now: StepEnd, kind: ContactEvent, touch: Touch, before: Touch | None) -> None:
        speed = -touch.gap_rate
        if kind == "contact begins" and before is not None:
            # The step that found the contact ended in it, already slowed down a little.
            speed = max(speed, -before.gap_rate)
        self.entry = Entry(now.time, self.index, kind, touch, speed)

    # --- steps ---------------------------------------------------------------------------------

    def _while_pressed(self, touch: Touch, step: float) -> float:
        self.items.wake(True)
        if not self._two_sided:  # what is held on both sides strikes nothing
            step = self._toward_release(touch, min(step, self.contact_step))
        until = inf
        if abs(touch.slip) * step > EDGE * self.geometry.length:
            left = self.geometry.length - touch.place if touch.slip > 0 else touch.place
            until = left / abs(touch.slip)
        if until > 1.5 * self.contact_step:
            return end_on(step, until - self.contact_step)
        # Just before the end: a step beyond it would have no force at all.
        return end_on(step, until - 0.5 * REACHED * min(step, until))

    def _toward_release(self, touch: Touch, step: float) -> float:
        """End a step where the point leaves the face: a step across it changes the energy."""
        until = first_zero(-touch.gap, -touch.gap_rate, -touch.gap_bend)
        return end_on(step, max(until, self._shortest))

    def _while_apart(self, touch: Touch, step: float) -> float:
        gap = max(touch.gap, OPEN)
        until = self.geometry.meeting(touch, gap)
        until = min(until, first_zero(gap, touch.gap_rate, touch.gap_bend))
        at = touch.place + touch.slip * until if until < inf else inf
        if not self._can_meet(touch, at):
            self.items.wake(False)
            return step
        # Items that act press everywhere behind the face's line, also beyond the face's ends.
        self.items.wake(until < AHEAD * step and self._on_face(at))
        # The integrator spreads the force at a step's end over the whole step: the step that
        # reaches into the face must be one of the contact's, not one of free flight. `end_on`
        # leaves no step shorter than a part of the one before, so steps shrink one after the other.
        margin = max(self.contact_step, 2 * REACHED * step)
        while until <= 1.5 * margin and margin > self.contact_step:
            step /= 4
            margin = max(self.contact_step, 2 * REACHED * step)
        if until > 1.5 * margin:
            return end_on(step, until - margin)
        return min(step, max(until + OVERSHOOT * self.contact_step, self._shortest))

    def _on_face(self, at: float) -> bool:
        """Tell whether a place is on the face; circles, of infinite length, have no ends."""
        length = self.geometry.length
        return -EDGE * length <= at <= (1 + EDGE) * length

    def _can_meet(self, touch: Touch, at: float) -> bool:
        """Tell whether the point may be over the face, `at` a place, as the gap closes."""
        margin = BESIDE * self.geometry.length
        low, high = min(at, touch.place) - margin, max(at, touch.place) + margin
        return at < inf and high >= 0 and low <= self.geometry.length

    def _toward_free_side(self, touch: Touch, step: float) -> float:
        """Behind the face nothing acts; a step ends where the point is back on the free side."""
        if touch.gap_rate <= 0:
            return step
        return end_on(step, -touch.gap / touch.gap_rate + self._shortest)

    def _toward_face(self, touch: Touch, step: float) -> float:
        """Beside a wall nothing acts; a step ends where the point comes over it."""
        self.items.wake(False)
        if touch.place < 0 < touch.slip:
            return end_on(step, -touch.place / touch.slip)
        if touch.place > self.geometry.length and touch.slip < 0:
            return end_on(step, (self.geometry.length - touch.place) / touch.slip)
        return step
