"""The force of a contact as Exudyn items: native, with symbolic laws, asleep while out of reach.

The gap is the translation of a point relative to a body along an axis of that body, for which
Exudyn has a marker; a coordinate spring with a symbolic law presses on it. The marker's force acts
on the body at a fixed place, whereas the point of contact travels: before every step that place is
put where the contact will be at the step's end. What is missed in the moment is then of third order
in the step.

Friction is a second such spring, along the face. It must be told the normal force, which follows in
the same way from the gap expected at the step's end.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from math import atan2, cos, inf, sin, sqrt
from typing import Any, NamedTuple

from exudyn_flexlink.engines.exudyn.engine import Engine, items, utilities
from exudyn_flexlink.engines.exudyn.faces import Circles, Faces, Touch, Vector
from exudyn_flexlink.engines.exudyn.redundant.system import System
from exudyn_flexlink.laws import Friction, Impulse, PowerPenalty, PressingLaw, RestitutionPenalty
from exudyn_flexlink.mechanism import (
    GROUND,
    Anchor,
    CircleContact,
    Contact,
    FaceContact,
    JointFriction,
    Slide,
)

Law = Callable[..., Any]

COORDINATE_SPRING, SPRING = "ObjectConnectorCoordinateSpringDamper", "ObjectConnectorSpringDamper"


class Aim(NamedTuple):
    """Where friction acts on the second part and on the first, along what, and by which grip."""

    struck: Vector
    striking: Vector
    along: Vector
    grip: float = 1.0


class Pressing(ABC):
    """Connector of one contact's normal force, and of its friction if there is any.

    Whoever inherits tells where the contact is and where it will be, by its shape.
    """

    length: float  # m, of the face; circles have no ends
    numbers: list[int]  # of its connectors

    def __init__(self, system: System, contact: Contact, normal: int) -> None:
        assert not isinstance(contact.law, Impulse)  # `run` refuses it
        self._mbs, self._law = system.mbs, contact.law
        self.numbers = [normal]
        self._approach = 0.0  # m/s: with which the touch began, or would begin now
        self._friction = contact.friction
        if contact.friction is not None:
            law = _law(system, contact.friction, 0.0, COORDINATE_SPRING)
            anchors = contact.anchors[1][0], contact.anchors[0][0]
            self._slip_marker, self._slip = _across(system, anchors, (1.0, 0.0), law)
            self.numbers.append(self._slip)
        self.awake = False

    @abstractmethod
    def touch(self, q: Sequence[float], v: Sequence[float]) -> Touch:
        """Evaluate at the coordinates and velocities of all parts, one after the other."""

    @abstractmethod
    def meeting(self, touch: Touch, gap: float) -> float:
        """Time (s) until the gap (m) closes as it does now; inf if it does not."""

    @abstractmethod
    def _aim(self, touch: Touch, step: float) -> Aim:
        """Where they touch at the end of a step (s) that begins at `touch`."""

    def begin(self, approach: float) -> None:
        """Begin a touch, or expect one, with this approach speed (m/s)."""
        self._approach = approach
        law = self._law
        if isinstance(law, PowerPenalty) and law.factor > 0:
            damping = law.factor / max(approach, law.transition_speed)
            self._mbs.SetObjectParameter(self.numbers[0], "damping", damping)

    def wake(self, awake: bool) -> None:
        """Let the contact act in the next step, or cost nothing."""
        if awake == self.awake:
            return
        self.awake = awake
        for item in self.numbers:
            self._mbs.SetObjectParameter(item, "activeConnector", awake)

    def aim(self, touch: Touch, step: float) -> None:
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
        self._faces = Faces(contact)
        self.length = contact.length
        self._point, self._start = _Place(contact.point), _Place(contact.start)
        (ex, ey), side = self._faces.along, contact.side or 1.0
        law = _law(system, contact.law, 1.0 if contact.side else 0.0, COORDINATE_SPRING)
        anchors = contact.start, contact.point
        self._marker, item = _across(system, anchors, (-side * ey, side * ex), law)
        super().__init__(system, contact, item)

    def aim(self, touch: Touch, step: float) -> None:
        """Prepare for a step of a length (s) that begins at `touch`."""
        x, y = self._ahead(touch, step)
        self._mbs.SetMarkerParameter(self._marker, "localPosition0", [x, y, 0.0])
        super().aim(touch, step)

    def touch(self, q: Sequence[float], v: Sequence[float]) -> Touch:
        """Evaluate at the coordinates and velocities of all parts, one after the other."""
        (px, py), (pu, pv), _, _ = self._point.state(q, v)
        (sx, sy), (su, sv), angle, turning = self._start.state(q, v)
        touch, _, self._side = self._faces.touch(
            (px - sx, py - sy), (pu - su, pv - sv), angle, turning
        )
        return touch

    def _ahead(self, touch: Touch, step: float) -> Vector:
        """Where they touch at the end of a step (s), on the face, in the axes of its part."""
        place = touch.place + step * (touch.slip + 0.5 * step * touch.slip_bend)
        (bx, by), (ex, ey) = self._start.own, self._faces.along
        return bx + place * ex, by + place * ey

    def meeting(self, touch: Touch, gap: float) -> float:
        """Time (s) until the gap closes as it does now; inf if it does not."""
        return -gap / touch.gap_rate if touch.gap_rate < 0 else inf

    def _aim(self, touch: Touch, step: float) -> Aim:
        """Where they touch at the end of a step (s) that begins at `touch`."""
        (x, y), (ex, ey) = self._ahead(touch, step), self._faces.along
        lateral = self._side * touch.gap_after(step)
        return Aim((x - lateral * ey, y + lateral * ex), self._point.own, (ex, ey))


class PressingCircles(Pressing):
    """The force of two circles: that of a spring between their centres."""

    length = inf

    def __init__(self, system: System, contact: CircleContact) -> None:
        self._circles = Circles(contact)
        self._first, self._second = _Place(contact.first), _Place(contact.second)
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

    def touch(self, q: Sequence[float], v: Sequence[float]) -> Touch:
        """Evaluate at the coordinates and velocities of all parts, one after the other."""
        (px, py), (pu, pv), first, spin = self._first.state(q, v)
        (sx, sy), (su, sv), second, turning = self._second.state(q, v)
        touch, (nx, ny), far = self._circles.touch(
            (px - sx, py - sy), (pu - su, pv - sv), (spin, turning), second
        )
        # For `meeting` and `_aim`: how the centres move past each other, and directions with rates.
        self._past = nx * (pv - sv) - ny * (pu - su)
        around = self._past / far if far > 0 else 0.0
        way = atan2(ny, nx)
        self._in_first, self._in_second = (
            (way - first, around - spin),
            (way - second, around - turning),
        )
        return touch

    def meeting(self, touch: Touch, gap: float) -> float:
        """Time (s) until they touch if their centres go straight on; inf if they don't."""
        circles = self._circles
        far = circles.distance + circles.way * gap
        rate = far * circles.way * touch.gap_rate
        square = touch.gap_rate**2 + self._past**2
        left = far * far - circles.distance**2
        under = rate * rate - square * left
        if square == 0 or under < 0 or (left >= 0 and rate >= 0):
            return inf
        return (-rate - sqrt(under) if left > 0 else -rate + sqrt(under)) / square

    def _aim(self, touch: Touch, step: float) -> Aim:
        """Where they touch at the end of a step (s) that begins at `touch`."""
        ahead = self._in_second[0] + step * self._in_second[1]
        behind = self._in_first[0] + step * self._in_first[1]
        gap = touch.gap_after(step)
        part, arm = self._circles.grip(gap)
        arm /= part
        edge = self._circles.distance + self._circles.way * gap + arm
        (ax, ay), (bx, by) = self._first.own, self._second.own
        c, s = cos(ahead), sin(ahead)
        return Aim(
            (bx + edge * c, by + edge * s),
            (ax + arm * cos(behind), ay + arm * sin(behind)),
            (-s, c),
            part,
        )


class _Place:
    """A place on a part, or on the ground."""

    def __init__(self, anchor: Anchor) -> None:
        self._row = None if anchor.part == GROUND else 3 * anchor.part
        self.own = anchor.x, anchor.y

    def state(self, q: Sequence[float], v: Sequence[float]) -> tuple[Vector, Vector, float, float]:
        """Place, velocity, angle of the part and its rate."""
        if self._row is None:
            return self.own, (0.0, 0.0), 0.0, 0.0
        x, y, angle = q[self._row : self._row + 3]
        u, w, spin = v[self._row : self._row + 3]
        c, s = cos(angle), sin(angle)
        rx, ry = c * self.own[0] - s * self.own[1], s * self.own[0] + c * self.own[1]
        return (x + rx, y + ry), (u - spin * ry, w + spin * rx), angle, spin


def _law(system: System, law: PressingLaw | Friction, free: float, kind: str) -> Any:
    """Return a symbolic function for items of a kind, one for all contacts of the same law."""
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
    """Brake a joint: by a torque, or along a slide by a force, that grows with slow speeds."""
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
    """Add a spring on how far the second anchor is from the first, along an axis of the first.

    Return its marker and its connector.
    """
    (struck, at), (striking, place) = (system.place(anchor) for anchor in anchors)
    marker = system.mbs.AddMarker(
        items.MarkerBodiesRelativeTranslationCoordinate(
            bodyNumbers=[struck, striking],
            localPosition0=at,
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

    `free` is the sign of u where nothing presses; 0: on either side the point is pulled back.
    """
    elastic, lossy = law.elastic, law.lossy
    symbolic = Engine.symbolic

    def press(_mbs: Any, _t: Any, _i: Any, u: Any, v: Any, _k: Any, _d: Any, _o: Any) -> Any:
        outward = free or -symbolic.sign(u)
        pressed = u * (elastic - lossy * symbolic.tanh(outward * v / law.transition_speed))
        return symbolic.IfThenElse(free * u < 0, pressed, 0.0 * u) if free else pressed

    return press


def _pressing_by_power(law: PowerPenalty, free: float) -> Law:
    """Likewise of `laws.PowerPenalty`; the damping is the factor over the approach speed, s/m."""
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
