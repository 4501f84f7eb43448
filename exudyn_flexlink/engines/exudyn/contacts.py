"""A point of one part against a face of another, as an Exudyn force between the two nodes.

The force and its Jacobian are Python functions: with the Jacobian in closed form they cost a fifth
of a symbolic force that Exudyn differentiates numerically. While the point is out of reach the item
has no function at all and costs nothing.

The contact remembers on which side the point came: one that passed beside the face and is behind it
is not in contact until it is back on the free side.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, inf, sin, tanh
from typing import Any

import numpy as np

from exudyn_flexlink.engines.exudyn.engine import items
from exudyn_flexlink.engines.exudyn.instant import Instant
from exudyn_flexlink.engines.exudyn.landing import THERE, first_root, land
from exudyn_flexlink.engines.exudyn.system import System
from exudyn_flexlink.laws import RestitutionPenalty
from exudyn_flexlink.mechanism import FaceContact, face_length
from exudyn_flexlink.result import Event

NOTHING = [0.0] * 6


@dataclass
class Touch:
    """Gap, place along the face, their rates, and the gap's gradient by the six coordinates."""

    gap: float
    place: float
    gap_rate: float
    place_rate: float
    gradient: tuple[float, float, float, float, float, float]


class Geometry:
    """Gap and place of the point from the coordinates of the two parts, in plain floats."""

    def __init__(self, contact: FaceContact) -> None:
        self.ax, self.ay = contact.point.x, contact.point.y
        self.bx, self.by = contact.start.x, contact.start.y
        self.length = face_length(contact)
        self.ex = (contact.end.x - contact.start.x) / self.length
        self.ey = (contact.end.y - contact.start.y) / self.length
        self.side = contact.side

    def touch(self, q: Sequence[float], v: Sequence[float]) -> Touch:
        """Evaluate at x, y, angle of the point's part, then of the face's part."""
        x0, y0, angle0, x1, y1, angle1 = q
        u0, v0, w0, u1, v1, w1 = v
        c, s = cos(angle0), sin(angle0)
        rx, ry = c * self.ax - s * self.ay, s * self.ax + c * self.ay
        c, s = cos(angle1), sin(angle1)
        bx, by = c * self.bx - s * self.by, s * self.bx + c * self.by
        tx, ty = c * self.ex - s * self.ey, s * self.ex + c * self.ey
        nx, ny = -self.side * ty, self.side * tx
        dx, dy = x0 + rx - x1 - bx, y0 + ry - y1 - by
        gap, place = nx * dx + ny * dy, tx * dx + ty * dy
        turn0 = ny * rx - nx * ry
        turn1 = nx * by - ny * bx - self.side * place
        gap_rate = nx * (u0 - u1) + ny * (v0 - v1) + turn0 * w0 + turn1 * w1
        place_rate = (
            tx * (u0 - ry * w0 - u1 + by * w1)
            + ty * (v0 + rx * w0 - v1 - bx * w1)
            + self.side * gap * w1
        )
        return Touch(gap, place, gap_rate, place_rate, (nx, ny, turn0, -nx, -ny, turn1))


class ContactItem:
    """The item of one contact, whether it can touch now, and the steps it asks for."""

    def __init__(
        self, system: System, index: int, contact_step: float, events: list[Event]
    ) -> None:
        self.events = events
        contact = system.mechanism.contacts[index]
        self.name = contact.name
        assert isinstance(contact.law, RestitutionPenalty)  # `run` refuses others
        self.law = contact.law
        self.geometry = Geometry(contact)
        self.contact_step = contact_step
        self.first, self.second = 3 * contact.point.part, 3 * contact.start.part
        self.mbs = system.mbs
        self.item = system.mbs.AddObject(
            items.ObjectGenericODE2(
                nodeNumbers=[system.nodes[contact.point.part], system.nodes[contact.start.part]],
                massMatrix=np.zeros((6, 6)),
            )
        )
        e2 = self.law.restitution**2
        self._elastic = self.law.stiffness * (1 + e2) / 2
        self._lossy = self.law.stiffness * (1 - e2) / 2
        self._still = np.zeros((6, 6))
        self._gap_rate_before = 0.0
        self.awake = False
        touch = self._touch(system.assembly.state.q.ravel().tolist(),
                            system.assembly.state.v.ravel().tolist())  # fmt: skip
        self.behind = touch.gap < 0
        self.pressed = False
        self._jumped = False
        self._peak = 0.0

    def _touch(self, q: Sequence[float], v: Sequence[float]) -> Touch:
        i, j = self.first, self.second
        return self.geometry.touch((*q[i : i + 3], *q[j : j + 3]), (*v[i : i + 3], *v[j : j + 3]))

    # --- force -------------------------------------------------------------------------------

    def _acts(self, touch: Touch) -> bool:
        return touch.gap < 0 and 0 <= touch.place <= self.geometry.length

    def _force(
        self, _mbs: Any, _t: float, _i: int, q: Sequence[float], v: Sequence[float]
    ) -> list[float]:
        touch = self.geometry.touch(q, v)
        if not self._acts(touch):
            return NOTHING
        force = self._press(touch)
        return [force * part for part in touch.gradient]

    def _press(self, touch: Touch) -> float:
        """Force (N) of the law, in plain floats; the gap is negative."""
        rising = tanh(-touch.gap_rate / self.law.transition_speed)
        return -touch.gap * (self._elastic + self._lossy * rising)

    def _jacobian(
        self,
        _mbs: Any,
        _t: float,
        _i: int,
        q: Sequence[float],
        v: Sequence[float],
        of_positions: float,
        of_velocities: float,
    ) -> Any:
        """Derivative of minus the force; without the turning of the normal, which is small."""
        touch = self.geometry.touch(q, v)
        if not self._acts(touch):
            return self._still
        rising = tanh(-touch.gap_rate / self.law.transition_speed)
        stiffness = self._elastic + self._lossy * rising
        damping = -touch.gap * self._lossy * (1 - rising**2) / self.law.transition_speed
        gradient = np.array(touch.gradient)
        return np.outer(gradient, gradient) * (of_positions * stiffness + of_velocities * damping)

    # --- stepping ----------------------------------------------------------------------------

    def after_step(self, now: Instant, step: float) -> float:
        """Note what began or ended in the last step; return the next step (s)."""
        touch = self._touch(now.q_list, now.v_list)
        self._note(touch, now)
        bend = touch.gap_rate - self._gap_rate_before
        curvature = bend / now.done if now.done > 0 else 0.0
        self._gap_rate_before = touch.gap_rate
        if self.behind:
            self._wake(False)
            return self._toward_free_side(touch, step)
        if self.pressed:
            self._peak = max(self._peak, self._press(touch))
            return self._while_pressed(touch, step)
        return self._while_apart(touch, step, curvature)

    @property
    def jumped(self) -> bool:
        """Whether the force broke off at the last step."""
        jumped, self._jumped = self._jumped, False
        return jumped

    def _note(self, touch: Touch, now: Instant) -> None:
        slid = THERE * now.done * touch.place_rate
        on_face = 0 <= touch.place + slid <= self.geometry.length
        if self.pressed and touch.gap >= 0:
            self.pressed = False
            self._tell(now, "contact ends", touch)
        elif self.pressed and not on_face:
            self.pressed, self.behind = False, True
            self._tell(now, "leaves the face", touch)
            self._jumped = True
        elif not self.pressed and not self.behind and touch.gap < 0:
            if on_face:
                self.pressed = True
                self._tell(now, "contact begins", touch)
            else:
                self.behind = True
        elif self.behind and touch.gap >= 0:
            self.behind = False

    def _tell(self, now: Instant, kind: str, touch: Touch) -> None:
        details = {"approach_speed": -touch.gap_rate, "place": touch.place, "gap": touch.gap}
        if kind == "contact begins":
            self._peak = 0.0
            # The step that found the contact ended in it, already slowed down a little.
            details["approach_speed"] = max(-touch.gap_rate, -self._gap_rate_before)
        else:
            details["peak_force"] = self._peak
        self.events.append(Event(now.time, kind, self.name, details))

    def _while_pressed(self, touch: Touch, step: float) -> float:
        self._wake(True)
        step = min(step, self.contact_step)
        left = self.geometry.length - touch.place
        until = inf
        if touch.place_rate > 0:
            until = left / touch.place_rate
        elif touch.place_rate < 0:
            until = touch.place / -touch.place_rate
        # Just before the end: beyond it the force would be gone for the whole of that step.
        return land(step, until - 0.5 * THERE * min(step, until))

    def _while_apart(self, touch: Touch, step: float, curvature: float) -> float:
        until = first_root(max(touch.gap, 1e-15), touch.gap_rate, 0.0)
        bent = first_root(max(touch.gap, 1e-15), touch.gap_rate, curvature)
        until = min(until, bent)
        if not self._can_meet(touch, until):
            self._wake(False)
            return step
        self._wake(until < 4 * step)
        if until > 1.5 * self.contact_step:
            # The integrator spreads the force at a step's end over the whole step: the step that
            # reaches into the face must be one of the contact's, not one of free flight.
            return land(step, until - self.contact_step)
        # A little into the face, so that the contact is seen; 2 % of a contact's step is not felt.
        return min(step, until + 0.02 * self.contact_step)

    def _can_meet(self, touch: Touch, until: float) -> bool:
        """Tell whether the point may be over the face when the gap closes, with a margin."""
        if until == inf:
            return False
        margin = 0.05 * self.geometry.length
        at = touch.place + touch.place_rate * until
        low, high = min(at, touch.place) - margin, max(at, touch.place) + margin
        return high >= 0 and low <= self.geometry.length

    def _toward_free_side(self, touch: Touch, step: float) -> float:
        """Behind the face nothing acts; only the return to the free side must not be skipped."""
        if touch.gap_rate <= 0:
            return step
        return land(step, -touch.gap / touch.gap_rate + 0.02 * self.contact_step)

    def _wake(self, awake: bool) -> None:
        if awake == self.awake:
            return
        self.awake = awake
        force, jacobian = (self._force, self._jacobian) if awake else (0, 0)
        self.mbs.SetObjectParameter(self.item, "forceUserFunction", force)
        self.mbs.SetObjectParameter(self.item, "jacobianUserFunction", jacobian)
