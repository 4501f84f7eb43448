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

from collections.abc import Callable
from typing import Any

from exudyn_flexlink.engines.exudyn.engine import Engine, items, utilities
from exudyn_flexlink.engines.exudyn.faces import Touch
from exudyn_flexlink.engines.exudyn.redundant.geometry import CircleGeometry, FaceGeometry
from exudyn_flexlink.engines.exudyn.redundant.system import System
from exudyn_flexlink.laws import Friction, Impulse, RestitutionPenalty
from exudyn_flexlink.mechanism import GROUND, Anchor, CircleContact, Contact, FaceContact

Law = Callable[..., Any]

COORDINATE_SPRING, SPRING = "ObjectConnectorCoordinateSpringDamper", "ObjectConnectorSpringDamper"


class Pressing:
    """Connector of one contact's normal force, and of its friction if there is any.

    `geometry` tells where the contact is; whoever inherits has one for its shape.
    """

    geometry: FaceGeometry | CircleGeometry

    def __init__(self, system: System, contact: Contact, normal: int) -> None:
        assert isinstance(contact.law, RestitutionPenalty)  # `run` refuses others
        self._mbs, self._law = system.mbs, contact.law
        self._items = [normal]
        self._friction = contact.friction
        if contact.friction is not None:
            law = _law(system, contact.friction, 0.0, COORDINATE_SPRING)
            anchors = contact.anchors[1][0], contact.anchors[0][0]
            self._slip_marker, self._slip = _across(system, anchors, (1.0, 0.0), law)
            self._items.append(self._slip)
        self.awake = False

    def wake(self, awake: bool) -> None:
        """Let the contact act in the next step, or cost nothing."""
        if awake == self.awake:
            return
        self.awake = awake
        for item in self._items:
            self._mbs.SetObjectParameter(item, "activeConnector", awake)

    def aim(self, touch: Touch, step: float) -> None:
        """Prepare for a step of a length (s) that begins at `touch`."""
        if self._friction is None:
            return
        aim = self.geometry.aim(touch, step)
        places = ("localPosition0", aim.struck), ("localPosition1", aim.striking)
        for name, (x, y) in (*places, ("axis0", aim.along)):
            self._mbs.SetMarkerParameter(self._slip_marker, name, [x, y, 0.0])
        gap = touch.gap + step * (touch.gap_rate + 0.5 * step * touch.gap_bend)
        pressing = float(self._law.force(-gap, -touch.gap_rate - step * touch.gap_bend))
        self._mbs.SetObjectParameter(self._slip, "stiffness", aim.grip * pressing)
        self._mbs.SetObjectParameter(self._slip, "damping", aim.grip)


class PressingFace(Pressing):
    """The force of a point against a face."""

    geometry: FaceGeometry

    def __init__(self, system: System, contact: FaceContact) -> None:
        self.geometry = FaceGeometry(contact)
        (ex, ey), side = self.geometry.along, contact.side or 1.0
        law = _law(system, contact.law, 1.0 if contact.side else 0.0, COORDINATE_SPRING)
        anchors = contact.start, contact.point
        self._marker, item = _across(system, anchors, (-side * ey, side * ex), law)
        super().__init__(system, contact, item)

    def aim(self, touch: Touch, step: float) -> None:
        """Prepare for a step of a length (s) that begins at `touch`."""
        x, y = self.geometry.on_face(self.geometry.ahead(touch, step))
        self._mbs.SetMarkerParameter(self._marker, "localPosition0", [x, y, 0.0])
        super().aim(touch, step)


class PressingCircles(Pressing):
    """The force of two circles: that of a spring between their centres."""

    def __init__(self, system: System, contact: CircleContact) -> None:
        self.geometry = CircleGeometry(contact)
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


def _law(
    system: System, law: RestitutionPenalty | Impulse | Friction, free: float, kind: str
) -> Any:
    """Return a symbolic function for items of a kind, one for all contacts of the same law."""
    assert not isinstance(law, Impulse)  # `run` refuses it
    key = law, free, kind
    if key not in system.laws:
        force = _sliding(law) if isinstance(law, Friction) else _pressing(law, free)
        system.laws[key] = utilities.CreateSymbolicUserFunction(
            system.mbs, force, "springForceUserFunction", itemTypeName=kind
        )
    return system.laws[key]


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

    def one_side(_mbs: Any, _t: Any, _i: Any, u: Any, v: Any, _k: Any, _d: Any, _o: Any) -> Any:
        pressed = u * (elastic - lossy * symbolic.tanh(free * v / law.transition_speed))
        return symbolic.IfThenElse(free * u < 0, pressed, 0.0 * u)

    def both_sides(_mbs: Any, _t: Any, _i: Any, u: Any, v: Any, _k: Any, _d: Any, _o: Any) -> Any:
        deeper = symbolic.sign(u) * v / law.transition_speed
        return u * (elastic + lossy * symbolic.tanh(deeper))

    return one_side if free else both_sides


def _sliding(friction: Friction) -> Law:
    """Restoring force over the slip v; the stiffness is the normal force with the `grip`."""

    def slide(_mbs: Any, _t: Any, _i: Any, _u: Any, v: Any, k: Any, grip: Any, _o: Any) -> Any:
        return friction.coefficient * k * Engine.symbolic.tanh(grip * v / friction.slip_speed)

    return slide
