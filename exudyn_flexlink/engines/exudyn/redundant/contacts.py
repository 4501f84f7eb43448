"""Contacts of a run as items of Exudyn: when each acts, its touches, and the steps it needs.

A contact of the scene remembers the side of its point. A point that passed beside the face and is
behind it does not touch until it is back on the free side. The pairs of a sleeve are walls: a point
behind the face, within its length, is pressed back. After a step only pairs that are near are
evaluated one by one.

The items are native, with symbolic laws, and inactive while a contact is out of reach. The gap is
the translation of a point relative to a body along an axis of the body. Exudyn has a marker for it,
and a coordinate spring with a symbolic law acts on the marker. Its force acts at a fixed place of
the body, but the point of contact moves. So before every step this place is set to the one expected
at the step's end. The error of the moment is then of third order in the step.

Friction is a second such spring, along the face. Its normal force follows likewise from the gap
expected at the step's end.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from cmath import phase
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import cos, inf, sin, sqrt
from typing import Any, NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.engines.exudyn.engine import Engine, items, utilities
from exudyn_flexlink.engines.exudyn.redundant.recording import Changed
from exudyn_flexlink.engines.exudyn.redundant.slots import REACHED, StepEnd, end_on, first_zero
from exudyn_flexlink.engines.exudyn.redundant.system import System
from exudyn_flexlink.engines.touching import BECOMES, Change, Moment, Side, Touches
from exudyn_flexlink.laws import Friction, Impulse, PowerPenalty, PressingLaw, RestitutionPenalty
from exudyn_flexlink.mechanism import (
    GROUND,
    Anchor,
    Channel,
    CircleContact,
    Contact,
    ContactShapes,
    FaceContact,
    JointFriction,
    Resolution,
    Seen,
    Slide,
    approach,
    deepest_allowed,
    grips,
    poses_of,
    pressed_among,
)
from exudyn_flexlink.rounding import LEAST_LENGTH, PLACE_ROUNDING, ROUNDING

# Shortest step next to a contact's step, as a part of it: generalised-alpha carries accelerations
# from step to step, and the errors of a much shorter step would disturb the next.
SHORTEST = 0.1
OVERSHOOT = 0.005  # of a contact's step: a step ends this far behind a face, to detect the contact
BESIDE = 0.05  # of the face's length: a point within this beyond an end may come over the face
AHEAD = 4  # its items act from this number of steps before a contact can begin
RESTART = 0.02  # of a contact's step: first step after a jump of force, for accelerations to settle
# Pairs of link and guide that may touch within this number of steps are evaluated one by one. The
# gap's acceleration needs two evaluations, and steps must be shortened in time.
LOOK_AHEAD = AHEAD + 2
# Likewise, times the pair's contact step: a step ends before a gap that closes within this time.
MARGIN = 1.5


Vector = tuple[float, float]


@dataclass(slots=True)
class ItemTouch:
    """Gap and place (m), rate of the gap and slip (m/s), as in `mechanism.Seen`.

    `path` (m) and its rate are those of `mechanism.ContactShapes`. `gap_bend` and `slip_bend`
    (m/s^2) are accelerations from the step before, or 0 if unknown.
    """

    gap: float
    place: float
    gap_rate: float
    slip: float
    path: complex
    path_rate: complex
    gap_bend: float = 0.0
    slip_bend: float = 0.0

    def gap_after(self, step: float) -> float:
        """Gap (m) at the end of a step (s)."""
        return self.gap + step * (self.gap_rate + 0.5 * step * self.gap_bend)


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
        """`channel` is the one whose link and guide are the pair, if any."""
        self.index = index
        self.contact = contact
        # Circles are walls all around: no point comes beside or behind them.
        self.walled = isinstance(contact, CircleContact) or channel is not None
        self.resolution, self.contact_step = resolution, resolution.step
        self._shortest = SHORTEST * resolution.step
        self.items: PressingCircles | PressingFace
        if isinstance(contact, CircleContact):
            self.items = PressingCircles(system, contact)
        else:
            self.items = PressingFace(system, contact)
        self.channel = channel
        self._two_sided = isinstance(contact, FaceContact) and contact.side == 0
        self.touch: ItemTouch | None = None  # at the last evaluation
        state = system.assembly.state
        gap = float(approach(contact, state.q, state.v, 0.0).gap)
        behind = not self.walled and gap < -PLACE_ROUNDING
        behind = behind and not pressed_among([contact], state.q)
        self.side = Side.BEHIND if behind else Side.APART
        self.changed: Changed | None = None  # its event at the end of the last step

    @property
    def broken(self) -> bool:
        """Whether the link is so deep in a wall that it can't come back."""
        if self.channel is None or self.touch is None or self.side is not Side.PRESSED:
            return False
        return -self.touch.gap > deepest_allowed(self.channel)

    def after_step(self, touch: ItemTouch, now: StepEnd, step: float) -> float:
        """Change the state by events of the last step; return the next step (s)."""
        before = self.touch
        self.items.see(touch, now)
        self.changed = self._change(touch, now, before)
        if self.changed is not None:
            self.side = BECOMES[self.side, self.changed.what]
            if self.side is Side.PRESSED:
                self.items.begin(-self.changed.now.gap_rate)
        if before is not None and now.step > 0:
            touch.gap_bend = (touch.gap_rate - before.gap_rate) / now.step
            touch.slip_bend = (touch.slip - before.slip) / now.step
        self.touch = touch
        if self.side is Side.BEHIND:
            self.items.wake(False)
            return self._toward_free_side(touch, step)
        if self.side is Side.PRESSED:
            return self._while_pressed(touch, step)
        if touch.gap < 0 or self._two_sided:
            return self._toward_face(touch, step)
        return self._while_apart(touch, step)

    def rest(self) -> None:
        """Switch the items off until the next evaluation: the contact can't touch before it."""
        self.items.wake(False)
        self.touch = self.changed = None

    def aim(self, step: float) -> None:
        """Prepare the force for the next step (s)."""
        if self.items.awake and self.touch is not None:
            self.items.aim(self.touch, step)

    # --- events --------------------------------------------------------------------------------

    def _change(self, touch: ItemTouch, now: StepEnd, before: ItemTouch | None) -> Changed | None:
        """Event at the end of a step, with the state `touch`; None if the state stays."""
        on_face = self._on_face(touch.place + REACHED * now.step * touch.slip)
        beyond, leaps, rate = touch.gap < 0 or self._two_sided, False, touch.gap_rate
        press = 0.0
        if self.side is Side.PRESSED:
            if beyond and on_face:
                return None
            leaps = beyond
            what = Change.SLIDES_OFF if leaps and not self.walled else Change.OPENS
        elif self.side is Side.APART and beyond and on_face:
            what = Change.CLOSES
            leaps = -touch.gap > abs(rate) * now.step + LEAST_LENGTH
            law = self.contact.law
            assert not isinstance(law, Impulse)  # refused: it has no force
            press = float(law.force(-touch.gap, -rate, -rate))
            if before is not None:
                # The step that detected the contact ends in it, with a speed already reduced a
                # little.
                rate = min(rate, before.gap_rate)
        elif not self.walled and beyond == (self.side is Side.APART):
            what = Change.PASSES
        else:
            return None
        moment = Moment(now.time, touch.place, rate, press=press)
        return Changed(self.index, what, moment, leaps)

    # --- steps ---------------------------------------------------------------------------------

    def _while_pressed(self, touch: ItemTouch, step: float) -> float:
        self.items.wake(True)
        if not self._two_sided:  # a point held on both sides does not strike
            # A step ends at the instant at which the point leaves the face, to keep the energy.
            until = first_zero(-touch.gap, -touch.gap_rate, -touch.gap_bend)
            step = end_on(min(step, self.contact_step), max(until, self._shortest))
        until = inf
        if abs(touch.slip) * step > ROUNDING * self.items.length:
            left = self.items.length - touch.place if touch.slip > 0 else touch.place
            until = left / abs(touch.slip)
        if until > 1.5 * self.contact_step:
            return end_on(step, until - self.contact_step)
        # Just before the end: a step beyond it would have no force at all.
        return end_on(step, until - 0.5 * REACHED * min(step, until))

    def _while_apart(self, touch: ItemTouch, step: float) -> float:
        gap = max(touch.gap, LEAST_LENGTH)  # open, so that an event ahead is found
        until = self.items.meeting(touch, gap)
        until = min(until, first_zero(gap, touch.gap_rate, touch.gap_bend))
        place = touch.place + touch.slip * until if until < inf else inf
        if not self._can_meet(touch, place):
            self.items.wake(False)
            return step
        self.items.begin(-touch.gap_rate)
        # Active items press everywhere behind the face's line, also beyond the ends of the face.
        self.items.wake(until < AHEAD * step and self._on_face(place))
        # The integrator applies the force at a step's end to the whole step. So the step that
        # enters the face must be as short as the contact's steps. `end_on` limits the ratio of
        # successive steps, so steps shrink gradually before the contact.
        margin = max(self.contact_step, 2 * REACHED * step)
        while until <= 1.5 * margin and margin > self.contact_step:
            step /= 4
            margin = max(self.contact_step, 2 * REACHED * step)
        if until > 1.5 * margin:
            return end_on(step, until - margin)
        return min(step, max(until + OVERSHOOT * self.contact_step, self._shortest))

    def _on_face(self, place: float) -> bool:
        """Tell whether a place is on the face; circles, of infinite length, have no ends."""
        length = self.items.length
        return -ROUNDING * length <= place <= (1 + ROUNDING) * length

    def _can_meet(self, touch: ItemTouch, place: float) -> bool:
        """Tell whether the point may be over the face when the gap closes, at a `place` (m)."""
        margin = BESIDE * self.items.length
        low, high = min(place, touch.place) - margin, max(place, touch.place) + margin
        return place < inf and high >= 0 and low <= self.items.length

    def _toward_free_side(self, touch: ItemTouch, step: float) -> float:
        """Step of a point behind the face, without force: it ends on the free side."""
        if touch.gap_rate <= 0:
            return step
        return end_on(step, -touch.gap / touch.gap_rate + self._shortest)

    def _toward_face(self, touch: ItemTouch, step: float) -> float:
        """Step of a point beside a wall, without force: it ends where the point comes over it."""
        self.items.wake(False)
        if touch.place < 0 < touch.slip:
            return end_on(step, -touch.place / touch.slip)
        if touch.place > self.items.length and touch.slip < 0:
            return end_on(step, (self.items.length - touch.place) / touch.slip)
        return step


class Contacts:
    """Contacts in the run's order: those of the scene, of bearings, then pairs of channels."""

    def __init__(self, contacts: Sequence[ContactItem]) -> None:
        self.all = contacts
        self._always = [contact for contact in contacts if contact.channel is None]
        self.touches = Touches([contact.contact for contact in contacts], len(self._always))
        for item in contacts:
            self.touches.sides[item.index] = item.side
        self._pairs = [contact for contact in contacts if contact.channel is not None]
        self._shapes = ContactShapes([contact.contact for contact in contacts])
        self._broad_phase = BroadPhase([pair.contact for pair in self._pairs])
        self._margin = MARGIN * max((pair.contact_step for pair in self._pairs), default=0.0)
        self._near: list[int] = []  # numbers of the pairs that are evaluated one by one
        self._looked_at = self._always

    def after_step(self, now: StepEnd, step: float) -> float:
        """Change states by events of the last step; return the next step (s)."""
        if not self.all:
            return step
        q, v = (np.reshape(column, (-1, 3)) for column in (now.q_list, now.v_list))
        poses = poses_of(q, v, now.time)
        seen = self._shapes.seen(poses)
        if self._pairs:
            self._choose(seen.of(slice(len(self._always), None)), now, step)
        columns = zip(
            *(column.tolist() for column in (*seen, *self._shapes.path(poses))), strict=True
        )
        touches = [ItemTouch(*touch) for touch in columns]
        for contact in self._looked_at:
            step = contact.after_step(touches[contact.index], now, step)
        return step

    def aim(self, step: float) -> None:
        """Prepare the forces for the next step (s)."""
        for contact in self._looked_at:
            contact.aim(step)

    @property
    def changes(self) -> list[Changed]:
        """Events at the end of the last step."""
        return [contact.changed for contact in self._looked_at if contact.changed is not None]

    @property
    def broken(self) -> Channel | None:
        """Channel whose wall the link has broken through."""
        return next((contact.channel for contact in self._looked_at if contact.broken), None)

    @property
    def restart_step(self) -> float:
        """Longest step (s) after a force that jumped in the last one; inf if none did."""
        leaping = [changed.contact for changed in self.changes if changed.leaps]
        return RESTART * min((self.all[k].contact_step for k in leaping), default=inf)

    def _choose(self, seen: Seen, now: StepEnd, step: float) -> None:
        """Evaluate pairs that may touch soon, and active ones; switch the others off."""
        near = set(
            self._broad_phase.near(seen, now.step, LOOK_AHEAD * step + self._margin).tolist()
        )
        near.update(k for k in self._near if self._pairs[k].items.awake)
        for k in self._near:
            if k not in near:
                self._pairs[k].rest()
        self._near = sorted(near)
        self._looked_at = [*self._always, *(self._pairs[k] for k in self._near)]


class BroadPhase:
    """Finds the pairs of link and guide that may touch soon, by one evaluation of all after a step.

    Nearly all pairs are far from touching; only the others are evaluated one by one.
    """

    def __init__(self, pairs: Sequence[Contact]) -> None:
        lengths = np.array([pair.length for pair in pairs])
        self._low, self._high = -BESIDE * lengths, (1 + BESIDE) * lengths
        self._held = np.array([getattr(pair, "side", 1.0) == 0 for pair in pairs], dtype=bool)
        self._gap_rate: FloatArray | None = None  # at the last evaluation

    def near(self, seen: Seen, made: float, ahead: float) -> IndexArray:
        """Numbers of the pairs that may touch within the time `ahead` (s), or touch now.

        They are `seen` after a step of the length `made` (s). Gaps are extrapolated by their rate
        and, if it closes them, by its change in the last step; places by the slip. A pair held on
        its line from both sides touches wherever its point is over the face.
        """
        gap = np.where(self._held, 0.0, seen.gap)
        gap_rate = np.where(self._held, 0.0, seen.gap_rate)
        closing = np.minimum(gap_rate, 0.0)
        if self._gap_rate is not None and made > 0:
            closing += (0.5 * ahead / made) * np.minimum(gap_rate - self._gap_rate, 0.0)
        self._gap_rate = gap_rate
        close = (gap + ahead * closing <= 0).nonzero()[0]
        if not len(close):
            return close
        place, slide = seen.place[close], ahead * seen.slip[close]
        over = (place + np.maximum(slide, 0.0) >= self._low[close]) & (
            place + np.minimum(slide, 0.0) <= self._high[close]
        )
        return close[over]


Law = Callable[..., Any]

COORDINATE_SPRING, SPRING = "ObjectConnectorCoordinateSpringDamper", "ObjectConnectorSpringDamper"


class Aim(NamedTuple):
    """Places of friction on the second and the first part, its direction, and its grip."""

    struck: Vector
    striking: Vector
    along: Vector
    grip: float = 1.0


class Pressing(ABC):
    """Connector of a contact's normal force, and of its friction, if any.

    Subclasses compute the place of the contact, now and at a step's end, from its shape.
    """

    length: float  # m: of the face; circles have no ends
    numbers: list[int]  # those of the connectors

    def __init__(self, system: System, contact: Contact, normal: int) -> None:
        assert not isinstance(contact.law, Impulse)  # `run` refuses it
        self._mbs, self._law = system.mbs, contact.law
        self.numbers = [normal]
        self._approach = 0.0  # m/s: speed at which the touch began, or would begin now
        self._friction = contact.friction
        if contact.friction is not None:
            law = _law(system, contact.friction, 0.0, COORDINATE_SPRING)
            anchors = contact.anchors[1][0], contact.anchors[0][0]
            self._slip_marker, self._slip = _across(system, anchors, (1.0, 0.0), law)
            self.numbers.append(self._slip)
        self.awake = False

    @abstractmethod
    def see(self, touch: ItemTouch, now: StepEnd) -> None:
        """Take the place of the contact at the end of a step."""

    @abstractmethod
    def meeting(self, touch: ItemTouch, gap: float) -> float:
        """Time (s) until the gap (m) closes at its present rate; inf if it does not close."""

    @abstractmethod
    def _aim(self, touch: ItemTouch, step: float) -> Aim:
        """Place of contact at the end of a step (s) that begins at `touch`."""

    def begin(self, approach: float) -> None:
        """Begin a touch, or expect one, with this approach speed (m/s)."""
        self._approach = approach
        law = self._law
        if isinstance(law, PowerPenalty) and law.factor > 0:
            damping = law.factor / max(approach, law.transition_speed)
            self._mbs.SetObjectParameter(self.numbers[0], "damping", damping)

    def wake(self, awake: bool) -> None:
        """Let the contact act in the next step, or switch it off."""
        if awake == self.awake:
            return
        self.awake = awake
        for item in self.numbers:
            self._mbs.SetObjectParameter(item, "activeConnector", awake)

    def aim(self, touch: ItemTouch, step: float) -> None:
        """Prepare for a step of a length (s) that begins at `touch`."""
        if self._friction is None:
            return
        aim = self._aim(touch, step)
        places = ("localPosition0", aim.struck), ("localPosition1", aim.striking)
        for name, (x, y) in (*places, ("axis0", aim.along)):
            self._mbs.SetMarkerParameter(self._slip_marker, name, [x, y, 0.0])
        rate = -touch.gap_rate - step * touch.gap_bend
        pressing = float(self._law.force(-touch.gap_after(step), rate, self._approach))
        self._mbs.SetObjectParameter(self._slip, "stiffness", aim.grip * pressing)
        self._mbs.SetObjectParameter(self._slip, "damping", aim.grip)


class PressingFace(Pressing):
    """The force of a point against a face."""

    def __init__(self, system: System, contact: FaceContact) -> None:
        self.length = contact.length
        self._point, self._start = (
            (anchor.x, anchor.y) for anchor in (contact.point, contact.start)
        )
        dx, dy = contact.end.x - contact.start.x, contact.end.y - contact.start.y
        ex, ey = self._along = dx / self.length, dy / self.length
        self._free, side = contact.side, contact.side or 1.0
        law = _law(system, contact.law, 1.0 if contact.side else 0.0, COORDINATE_SPRING)
        anchors = contact.start, contact.point
        self._marker, item = _across(system, anchors, (-side * ey, side * ex), law)
        super().__init__(system, contact, item)

    def aim(self, touch: ItemTouch, step: float) -> None:
        """Prepare for a step of a length (s) that begins at `touch`."""
        x, y = self._ahead(touch, step)
        self._mbs.SetMarkerParameter(self._marker, "localPosition0", [x, y, 0.0])
        super().aim(touch, step)

    def see(self, touch: ItemTouch, now: StepEnd) -> None:  # noqa: ARG002
        """Set the side of the gap; a point held on the line may be on either."""
        self._side = self._free or (-1.0 if touch.path.imag > 0 else 1.0)

    def _ahead(self, touch: ItemTouch, step: float) -> Vector:
        """Place of contact on the face at the end of a step (s), in the axes of its part."""
        place = touch.place + step * (touch.slip + 0.5 * step * touch.slip_bend)
        (bx, by), (ex, ey) = self._start, self._along
        return bx + place * ex, by + place * ey

    def meeting(self, touch: ItemTouch, gap: float) -> float:
        """Time (s) until the gap closes at its present rate; inf if it does not close."""
        return -gap / touch.gap_rate if touch.gap_rate < 0 else inf

    def _aim(self, touch: ItemTouch, step: float) -> Aim:
        """Place of contact at the end of a step (s) that begins at `touch`."""
        (x, y), (ex, ey) = self._ahead(touch, step), self._along
        lateral = self._side * touch.gap_after(step)
        return Aim((x - lateral * ey, y + lateral * ex), self._point, (ex, ey))


class PressingCircles(Pressing):
    """The force of two circles, as a spring between their centres."""

    length = inf

    def __init__(self, system: System, contact: CircleContact) -> None:
        self._contact, self._way = contact, -1.0 if contact.inside else 1.0
        law = _law(system, contact.law, -1.0 if contact.inside else 1.0, SPRING)
        markers = [system.point_marker(contact.second), system.point_marker(contact.first)]
        item = system.mbs.AddObject(
            items.ObjectConnectorSpringDamper(
                markerNumbers=markers,
                referenceLength=contact.distance,
                springForceUserFunction=law,
                activeConnector=False,
            )
        )
        super().__init__(system, contact, int(item))

    def see(self, touch: ItemTouch, now: StepEnd) -> None:
        """Take the relative motion of the centres, and its direction in both parts' axes."""
        outward = touch.path or touch.path_rate or 1.0
        outward /= abs(outward)
        self._past, far = (outward.conjugate() * touch.path_rate).imag, abs(touch.path)
        around, way = self._past / far if far > 0 else 0.0, phase(outward)
        self._in_first, self._in_second = (
            (way, around)
            if part == GROUND
            else (way - now.q_list[3 * part + 2], around - now.v_list[3 * part + 2])
            for part in self._contact.parts
        )

    def meeting(self, touch: ItemTouch, gap: float) -> float:
        """Time (s) until the circles touch if their centres move straight on; inf if they don't."""
        distance = self._contact.distance
        far = distance + self._way * gap
        rate = far * self._way * touch.gap_rate
        square = touch.gap_rate**2 + self._past**2
        left = far * far - distance**2
        under = rate * rate - square * left
        if square == 0 or under < 0 or (left >= 0 and rate >= 0):
            return inf
        return (-rate - sqrt(under) if left > 0 else -rate + sqrt(under)) / square

    def _aim(self, touch: ItemTouch, step: float) -> Aim:
        """Place of contact at the end of a step (s) that begins at `touch`."""
        ahead = self._in_second[0] + step * self._in_second[1]
        behind = self._in_first[0] + step * self._in_first[1]
        gap = touch.gap_after(step)
        contact, way = self._contact, self._way
        pressed = contact.distance + way * min(gap, 0.0)
        of_gap = np.array([-way * contact.radii[0], contact.distance, pressed])
        part, arm = map(float, grips(*of_gap))
        arm /= part
        edge = contact.distance + way * gap + arm
        (ax, ay), (bx, by) = (
            (contact.first.x, contact.first.y),
            (contact.second.x, contact.second.y),
        )
        c, s = cos(ahead), sin(ahead)
        return Aim(
            (bx + edge * c, by + edge * s),
            (ax + arm * cos(behind), ay + arm * sin(behind)),
            (-s, c),
            part,
        )


def _law(system: System, law: PressingLaw | Friction, free: float, kind: str) -> Any:
    """Return a symbolic function for items of a kind; contacts of the same law share it."""
    assert isinstance(law, RestitutionPenalty | PowerPenalty | Friction)  # `run` refuses others
    key = law, free, kind
    if key not in system.laws:
        if isinstance(law, Friction):
            force = _sliding(law)
        elif isinstance(law, PowerPenalty):
            force = _pressing_by_power(law, free)
        else:
            force = _pressing(law, free)
        system.laws[key] = utilities.CreateSymbolicUserFunction(
            system.mbs, force, "springForceUserFunction", itemTypeName=kind
        )
    return system.laws[key]


def add_joint_friction(system: System, friction: JointFriction) -> None:
    """Brake a joint by a torque, or a slide by a force, that is proportional to small speeds."""
    joint = friction.joint
    law = _law(system, Friction(1.0, friction.slip_speed), 0.0, COORDINATE_SPRING)
    if isinstance(joint, Slide):
        axis = cos(joint.direction), sin(joint.direction)
        _, item = _across(system, (joint.first, joint.second), axis, law)
    else:
        markers = [system.angle_marker(joint.first.part), system.angle_marker(joint.second.part)]
        brake = items.ObjectConnectorCoordinateSpringDamper(
            markerNumbers=markers, springForceUserFunction=law
        )
        item = int(system.mbs.AddObject(brake))
    for name, value in (("stiffness", friction.constant), ("damping", 1.0)):
        system.mbs.SetObjectParameter(item, name, value)
    system.mbs.SetObjectParameter(item, "activeConnector", True)


def _across(
    system: System, anchors: tuple[Anchor, Anchor], axis: tuple[float, float], law: Any
) -> tuple[int, int]:
    """Add a spring on the distance of two anchors along an axis of the first part.

    Return its marker and its connector.
    """
    (struck, origin), (striking, place) = (system.place(anchor) for anchor in anchors)
    marker = system.mbs.AddMarker(
        items.MarkerBodiesRelativeTranslationCoordinate(
            bodyNumbers=[struck, striking],
            localPosition0=origin,
            localPosition1=place,
            axis0=[*axis, 0.0],
        )
    )
    item = system.mbs.AddObject(
        items.ObjectConnectorCoordinateSpringDamper(
            markerNumbers=[system.angle_marker(GROUND), marker],
            springForceUserFunction=law,
            activeConnector=False,
        )
    )
    return int(marker), int(item)


def _pressing(law: RestitutionPenalty, free: float) -> Law:
    """Restoring force over the place u and its rate v: minus that of `laws.RestitutionPenalty`.

    `free` is the sign of u on the free side; with 0 the point is pulled back from both sides.
    """
    elastic, lossy = law.elastic, law.lossy
    symbolic = Engine.symbolic

    def press(_mbs: Any, _t: Any, _i: Any, u: Any, v: Any, _k: Any, _d: Any, _o: Any) -> Any:
        outward = free or -symbolic.sign(u)
        pressed = u * (elastic - lossy * symbolic.tanh(outward * v / law.transition_speed))
        return symbolic.IfThenElse(free * u < 0, pressed, 0.0 * u) if free else pressed

    return press


def _pressing_by_power(law: PowerPenalty, free: float) -> Law:
    """As `_pressing`, for `laws.PowerPenalty`; damping is the factor over approach speed, s/m."""
    symbolic = Engine.symbolic

    def press(_mbs: Any, _t: Any, _i: Any, u: Any, v: Any, _k: Any, by: Any, _o: Any) -> Any:
        damped = symbolic.max(0.0, 1.0 - free * by * v)
        pressed = -free * law.stiffness * symbolic.pow(symbolic.abs(u), law.exponent) * damped
        return symbolic.IfThenElse(free * u < 0, pressed, 0.0 * u)

    return press


def _sliding(friction: Friction) -> Law:
    """Restoring force over the slip v; the stiffness is the normal force with the `grip`."""

    def slide(_mbs: Any, _t: Any, _i: Any, _u: Any, v: Any, k: Any, grip: Any, _o: Any) -> Any:
        return friction.coefficient * k * Engine.symbolic.tanh(grip * v / friction.slip_speed)

    return slide
