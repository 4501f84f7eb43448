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
from exudyn_flexlink.engines.exudyn.faces import Geometry, Touch
from exudyn_flexlink.engines.exudyn.redundant.system import System
from exudyn_flexlink.laws import Friction, RestitutionPenalty
from exudyn_flexlink.mechanism import GROUND, FaceContact

Law = Callable[..., Any]


class PressingItems:
    """Connector of one contact's normal force, and of its friction if there is any."""

    def __init__(self, system: System, contact: FaceContact, geometry: Geometry) -> None:
        assert isinstance(contact.law, RestitutionPenalty)  # `run` refuses others
        self._mbs, self._geometry, self._law = system.mbs, geometry, contact.law
        ex, ey = geometry.ex, geometry.ey
        side = contact.side or 1.0
        self._marker, self._normal = self._add(
            system,
            contact,
            [-side * ey, side * ex, 0.0],
            (contact.law, contact.side == 0),
            _pressing(contact.law, contact.side == 0),
        )
        self._items = [self._normal]
        self._friction = contact.friction
        if contact.friction is not None:
            self._slip_marker, self._slip = self._add(
                system, contact, [ex, ey, 0.0], contact.friction, _sliding(contact.friction)
            )
            self._items.append(self._slip)
        self.awake = False

    def _add(
        self, system: System, contact: FaceContact, axis: list[float], key: Any, law: Law
    ) -> tuple[int, int]:
        struck, _ = system.place(contact.start)
        striking, place = system.place(contact.point)
        marker = system.mbs.AddMarker(
            items.MarkerBodiesRelativeTranslationCoordinate(
                bodyNumbers=[struck, striking],
                localPosition0=list(self._geometry.on_face(0.0)),
                localPosition1=place,
                axis0=axis,
            )
        )
        if key not in system.laws:
            system.laws[key] = utilities.CreateSymbolicUserFunction(
                system.mbs,
                law,
                "springForceUserFunction",
                itemTypeName="ObjectConnectorCoordinateSpringDamper",
            )
        item = system.mbs.AddObject(
            items.ObjectConnectorCoordinateSpringDamper(
                markerNumbers=[system.angle_marker(GROUND), marker],
                springForceUserFunction=system.laws[key],
                activeConnector=False,
            )
        )
        return int(marker), int(item)

    def wake(self, awake: bool) -> None:
        """Let the contact act in the next step, or cost nothing."""
        if awake == self.awake:
            return
        self.awake = awake
        for item in self._items:
            self._mbs.SetObjectParameter(item, "activeConnector", awake)

    def aim(self, touch: Touch, step: float) -> None:
        """Prepare for a step of a length (s) that begins at `touch`."""
        place = touch.place + step * (touch.place_rate + 0.5 * step * touch.place_bend)
        x, y, _ = self._geometry.on_face(place)
        self._mbs.SetMarkerParameter(self._marker, "localPosition0", [x, y, 0.0])
        if self._friction is None:
            return
        gap = touch.gap + step * (touch.gap_rate + 0.5 * step * touch.gap_bend)
        lateral = touch.side * gap
        x, y = x - lateral * self._geometry.ey, y + lateral * self._geometry.ex
        self._mbs.SetMarkerParameter(self._slip_marker, "localPosition0", [x, y, 0.0])
        pressing = float(self._law.force(-gap, -touch.gap_rate - step * touch.gap_bend))
        self._mbs.SetObjectParameter(self._slip, "stiffness", pressing)


def _pressing(law: RestitutionPenalty, two_sided: bool) -> Law:
    """Restoring force over the gap u and its rate v: minus that of `laws.RestitutionPenalty`.

    Two-sided, u is the distance to the left of the line, and whatever its sign pulled back.
    """
    e2 = law.restitution**2
    elastic, lossy = law.stiffness * (1 + e2) / 2, law.stiffness * (1 - e2) / 2
    symbolic = Engine.symbolic

    def one_side(_mbs: Any, _t: Any, _i: Any, u: Any, v: Any, _k: Any, _d: Any, _o: Any) -> Any:
        pressed = u * (elastic - lossy * symbolic.tanh(v / law.transition_speed))
        return symbolic.IfThenElse(u < 0, pressed, 0.0 * u)

    def both_sides(_mbs: Any, _t: Any, _i: Any, u: Any, v: Any, _k: Any, _d: Any, _o: Any) -> Any:
        deeper = symbolic.sign(u) * v / law.transition_speed
        return u * (elastic + lossy * symbolic.tanh(deeper))

    return both_sides if two_sided else one_side


def _sliding(friction: Friction) -> Law:
    """Restoring force over the slip v; the spring's stiffness is the normal force."""

    def slide(_mbs: Any, _t: Any, _i: Any, _u: Any, v: Any, k: Any, _d: Any, _o: Any) -> Any:
        return friction.coefficient * k * Engine.symbolic.tanh(v / friction.slip_speed)

    return slide
