"""When a contact acts, what its beginning and end are, and the steps it asks for.

A contact of the scene remembers on which side the point came: one that passed beside the face and
is behind it is not in contact until it is back on the free side. The pairs of a sleeve are walled:
whatever is behind the face, within its length, is pressed back.
"""

from __future__ import annotations

from math import inf, pi, sqrt, tanh

from exudyn_flexlink.engines.exudyn.contact_log import ContactLog
from exudyn_flexlink.engines.exudyn.faces import Geometry, Touch
from exudyn_flexlink.engines.exudyn.redundant.instant import Instant
from exudyn_flexlink.engines.exudyn.redundant.landing import THERE, first_root, land
from exudyn_flexlink.engines.exudyn.redundant.pressing import PressingItems
from exudyn_flexlink.engines.exudyn.redundant.system import System
from exudyn_flexlink.laws import RestitutionPenalty
from exudyn_flexlink.mechanism import FaceContact, Pace

CLOSE = 1e-15  # m: a gap this small counts as open
# Of a contact's step: generalised-alpha carries the accelerations of its last step, and what a far
# shorter one leaves in them disturbs the next. Without this models/hard/foil.yaml is thrown off the
# wall on which it has to lie.
SHORTEST = 0.1
CALM = 0.25  # part of the time in which a lasting force changes that a step may be


class ContactItem:
    """The state of one contact; `index` is its number among all contacts of the run."""

    def __init__(
        self,
        system: System,
        contact: FaceContact,
        index: int,
        pace: Pace,
        log: ContactLog,
    ) -> None:
        assert isinstance(contact.law, RestitutionPenalty)  # `run` refuses others
        self.index = index
        self.law = contact.law
        self.walled = contact.walled
        self.pace, self.contact_step = pace, pace.step
        self._shortest = SHORTEST * pace.step
        self.geometry = Geometry(contact)
        self.items = PressingItems(system, contact, self.geometry)
        self.log = log
        e2 = self.law.restitution**2
        self._elastic = self.law.stiffness * (1 + e2) / 2
        self._lossy = self.law.stiffness * (1 - e2) / 2
        self._two_sided = contact.side == 0
        self._frequency = pi / pace.half_period  # 1/s
        self._looked = -1.0  # time of the last look
        self._touch: Touch | None = None
        state = system.assembly.state
        start = self.geometry.touch(state.q.ravel().tolist(), state.v.ravel().tolist())
        self.behind = not self.walled and start.gap < 0
        self.pressed = False
        self._jumped = False
        self.peak = 0.0

    @property
    def watched(self) -> bool:
        """Whether the contact must be looked at after every step."""
        return self.pressed or self.items.awake

    @property
    def jumped(self) -> bool:
        """Whether the force jumped at the last step."""
        jumped, self._jumped = self._jumped, False
        return jumped

    @property
    def depth(self) -> float:
        """Penetration at the last look, m; 0 while apart."""
        return -self._touch.gap if self.pressed and self._touch is not None else 0.0

    def press(self, touch: Touch) -> float:
        """Force (N) of the law, in plain floats; the gap is negative."""
        rising = tanh(-touch.gap_rate / self.law.transition_speed)
        return -touch.gap * (self._elastic + self._lossy * rising)

    def after_step(self, now: Instant, step: float) -> float:
        """Note what began or ended in the last step; return the next step (s)."""
        touch = self.geometry.touch(now.q_list, now.v_list)
        began = now.time - now.done
        before = self._touch if abs(self._looked - began) <= 1e-3 * now.done else None
        self._note(touch, now, before)
        if before is not None and now.done > 0:
            touch.gap_bend = (touch.gap_rate - before.gap_rate) / now.done
            touch.place_bend = (touch.place_rate - before.place_rate) / now.done
        self._touch, self._looked = touch, now.time
        if self.behind:
            self.items.wake(False)
            return self._toward_free_side(touch, step)
        if self.pressed:
            self.peak = max(self.peak, self.press(touch))
            return self._while_pressed(touch, step)
        if touch.gap < 0 or self._two_sided:
            return self._toward_face(touch, step)
        return self._while_apart(touch, step)

    def aim(self, step: float) -> None:
        """Prepare the force for the next step, which is known now."""
        if self.items.awake and self._touch is not None:
            self.items.aim(self._touch, step)

    # --- what happened -------------------------------------------------------------------------

    def _note(self, touch: Touch, now: Instant, before: Touch | None) -> None:
        slid = THERE * now.done * touch.place_rate
        on_face = 0 <= touch.place + slid <= self.geometry.length
        beyond = touch.gap < 0 or self._two_sided
        if self.pressed and not beyond:
            self.pressed = False
            self._tell(now, "contact ends", touch, before)
        elif self.pressed and not on_face:
            self.pressed, self.behind = False, not self.walled
            self._tell(now, "leaves the face", touch, before)
            self._jumped = True
        elif not self.pressed and not self.behind and beyond:
            if on_face:
                self.pressed = True
                self._tell(now, "contact begins", touch, before)
                self._jumped = -touch.gap > abs(touch.gap_rate) * now.done + CLOSE
            else:
                self.behind = not self.walled
        elif self.behind and touch.gap >= 0:
            self.behind = False

    def _tell(self, now: Instant, kind: str, touch: Touch, before: Touch | None) -> None:
        speed = -touch.gap_rate
        if kind == "contact begins":
            self.peak = 0.0
            if before is not None:
                # The step that found the contact ended in it, already slowed down a little.
                speed = max(speed, -before.gap_rate)
        self.log.tell(now, self.index, kind, touch, (speed, self.peak))

    # --- steps ---------------------------------------------------------------------------------

    def _while_pressed(self, touch: Touch, step: float) -> float:
        self.items.wake(True)
        if not self._two_sided:  # what is held lastingly strikes nothing
            step = min(step, self.contact_step * self._calm(touch))
            step = self._toward_release(touch, step)
        left = self.geometry.length - touch.place
        until = inf
        if touch.place_rate > 0:
            until = left / touch.place_rate
        elif touch.place_rate < 0:
            until = touch.place / -touch.place_rate
        if until > 1.5 * self.contact_step:
            return land(step, until - self.contact_step)
        # Just before the end: beyond it the force would be gone for the whole of that step.
        return land(step, until - 0.5 * THERE * min(step, until))

    def _toward_release(self, touch: Touch, step: float) -> float:
        """End a step where the point leaves the face: one across it makes or takes energy."""
        until = first_root(-touch.gap, -touch.gap_rate, -touch.gap_bend)
        return land(step, max(until, self._shortest)) if until < inf else step

    def _calm(self, touch: Touch) -> float:
        """How much longer than an impact's steps may be those of a force that changes slowly.

        In an impact the penetration changes within the contact's own period; where a wall presses
        lastingly it follows the motion, and the period, damped out by the law, need not be
        resolved. Measured on the paper's clearance: a quarter of the steps, S the same to 3e-5 m
        after 0.42 s. A strike lasts too shortly to gain anything.
        """
        if not self.walled:
            return 1.0
        depth = abs(touch.gap)
        by_rate = depth / max(abs(touch.gap_rate), 1e-300)
        by_bend = sqrt(depth / max(abs(touch.gap_bend), 1e-300))
        return max(1.0, CALM * self._frequency * min(by_rate, by_bend))

    def _while_apart(self, touch: Touch, step: float) -> float:
        gap = max(touch.gap, CLOSE)
        until = first_root(gap, touch.gap_rate, 0.0)
        until = min(until, first_root(gap, touch.gap_rate, touch.gap_bend))
        at = touch.place + touch.place_rate * until if until < inf else inf
        if not self._can_meet(touch, at):
            self.items.wake(False)
            return step
        # The items press wherever the point is: a point that passes beside the face finds none.
        self.items.wake(until < 4 * step and 0 <= at <= self.geometry.length)
        # The integrator spreads the force at a step's end over the whole step: the step that
        # reaches into the face must be one of the contact's, not one of free flight. As no step
        # is shorter than a part of the one proposed, a face is neared by ever shorter ones.
        margin = max(self.contact_step, 2 * THERE * step)
        while until <= 1.5 * margin and margin > self.contact_step:
            step /= 4
            margin = max(self.contact_step, 2 * THERE * step)
        if until > 1.5 * margin:
            return land(step, until - margin)
        # A little into the face, so that the contact is seen; 2 % of a contact's step is not felt.
        return min(step, max(until + 0.005 * self.contact_step, self._shortest))

    def _can_meet(self, touch: Touch, at: float) -> bool:
        """Tell whether the point may be over the face as the gap closes at a place, with margin."""
        margin = 0.05 * self.geometry.length
        low, high = min(at, touch.place) - margin, max(at, touch.place) + margin
        return at < inf and high >= 0 and low <= self.geometry.length

    def _toward_free_side(self, touch: Touch, step: float) -> float:
        """Behind the face nothing acts; only the return to the free side must not be skipped."""
        if touch.gap_rate <= 0:
            return step
        return land(step, -touch.gap / touch.gap_rate + 0.02 * self.contact_step)

    def _toward_face(self, touch: Touch, step: float) -> float:
        """Beside a wall nothing acts; it must not be skipped that the point comes over it."""
        self.items.wake(False)
        if touch.place < 0 < touch.place_rate:
            return land(step, -touch.place / touch.place_rate)
        if touch.place > self.geometry.length and touch.place_rate < 0:
            return land(step, (self.geometry.length - touch.place) / touch.place_rate)
        return step
