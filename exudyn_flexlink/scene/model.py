"""The whole scene: what a model file says, checked, frozen and in SI units."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import Field, PrivateAttr, model_validator

from exudyn_flexlink.expressions import Expression
from exudyn_flexlink.scene.base import FrozenMapping, Named, Part, Text, by_name, refuse
from exudyn_flexlink.scene.bodies import Body, Material
from exudyn_flexlink.scene.contact_laws import Law
from exudyn_flexlink.scene.contacts import Contact
from exudyn_flexlink.scene.curve_specs import CurveSpec
from exudyn_flexlink.scene.forces import Drive, Gravity, LinearSpring, Spring
from exudyn_flexlink.scene.joints import Joint, PrismaticJoint, RevoluteJoint
from exudyn_flexlink.scene.limits import TURNED, Rope, Stop, StopLaw, moving, stops_of
from exudyn_flexlink.scene.lookup import Parts
from exudyn_flexlink.scene.names import find_mistakes
from exudyn_flexlink.scene.run import Accuracy, Initial, InitialOrRest, Outputs, Run, Solver
from exudyn_flexlink.source import Document, KeyPath, SceneError, dotted


class Scene(Part):
    """A mechanism in the plane, what drives it and how long it is to be simulated."""

    title: Text = Field(description="what the model shows")
    source: Text = Field("", description="where its numbers come from")
    materials: Named[Material] = by_name("materials, by name")
    curves: Named[CurveSpec] = by_name("curves for slots, by name")
    bodies: Named[Body] = Field(description="the moving bodies, by name")
    joints: Named[Joint] = by_name(
        "joints between bodies and the ground, by name; a body without any is free"
    )
    springs: Named[Spring] = by_name("springs and dampers at joints, by name")
    drives: Named[Drive] = by_name("motors at joints and forces, by name")
    contacts: Named[Contact] = by_name("pairs that may strike each other, by name")
    gravity: Gravity = Field(
        (0.0, 0.0), description="downwards, or [x, y], m/s^2; left out: a horizontal plane"
    )
    initial: InitialOrRest = Field(
        default_factory=Initial, description="the state at time 0; at_rest: that key alone"
    )
    run: Run = Field(description="how long to simulate")
    accuracy: Accuracy = Field(description="the error allowed, or the time step")
    solver: Solver = Field(
        default_factory=Solver,
        description="how it is solved; left out: the program chooses",
    )
    outputs: Outputs = Field(default_factory=Outputs, description="which point is shown and judged")

    _document: Document = PrivateAttr(default_factory=lambda: Document("scene"))

    @property
    def document(self) -> Document:
        """The file this scene was read from; an empty one if it was built in Python."""
        return self._document

    @property
    def stops(self) -> dict[str, Stop]:
        """Stops of the joints' limits, by names such as 'hinge.to'."""
        return {
            name: stop
            for joint, own in self.joints.items()
            if isinstance(own, (RevoluteJoint, PrismaticJoint)) and own.limits
            for name, stop in stops_of(joint, own.limits, own.points)
        }

    @property
    def ropes(self) -> dict[str, LinearSpring]:
        """Springs that act on one side, ropes and buffers, by name."""
        springs = self.springs.items()
        return {n: s for n, s in springs if isinstance(s, LinearSpring) and s.acts != "both"}

    @property
    def all_contacts(self) -> dict[str, Contact | Stop | Rope]:
        """Contacts of the scene, then stops of its joints, then ropes and buffers, by name."""
        ropes = {name: Rope(own, moving(self._ends(own))) for name, own in self.ropes.items()}
        return {**self.contacts, **self.stops, **ropes}

    def _ends(self, spring: LinearSpring) -> tuple[str, str]:
        if spring.points is not None:
            return spring.points
        joint = self.joints[spring.joint or ""]
        assert isinstance(joint, PrismaticJoint)  # names are checked
        return joint.points

    @property
    def laws(self) -> dict[str, Law | StopLaw]:
        """Laws of walls and bearings, then contacts, then stops, by name; springs have none."""
        walls = {name: getattr(joint, "acting", None) for name, joint in self.joints.items()}
        found = {name: law for name, law in walls.items() if law is not None}
        return found | {n: own.law for n, own in {**self.contacts, **self.stops}.items()}

    def law_path(self, name: str) -> KeyPath:
        """Where the scene gives the law of one of these names."""
        if name in self.stops:
            return "joints", self.stops[name].joint, "limits", "law"
        return "contacts" if name in self.contacts else "joints", name, "law"

    def unit_of(self, contact: str, unit: str) -> str:
        """Unit of what is told of a contact, by that of points: a hinge's stop turns."""
        stop = self.stops.get(contact)
        return TURNED.get(unit, unit) if stop is not None and stop.turns else unit

    @classmethod
    def from_parts(cls, sections: Mapping[str, Any], document: Document) -> Scene:
        """Build a scene from checked parts, remembering the document they came from."""
        scene = cls(**sections)
        scene._document = document
        return scene

    def changed(self, **sections: Any) -> Scene:
        """Return a scene with other sections, checked anew; it keeps its document.

        Raises:
            SceneError: a name leads nowhere in the new scene.
            pydantic.ValidationError: a section is not of its type.

        """
        now = {key: getattr(self, key) for key in type(self).model_fields} | sections
        mistakes = find_mistakes(Parts(now))
        if mistakes:
            raise SceneError(self._document, mistakes)
        return self.from_parts(now, self._document)

    def to_data(self) -> dict[str, Any]:
        """Return plain data in SI, fit for YAML or JSON, that parses to an equal scene."""
        data: dict[str, Any] = _plain(self)
        return data

    @model_validator(mode="after")
    def _names_lead_somewhere(self) -> Scene:
        parts = Parts({key: getattr(self, key) for key in type(self).model_fields})
        mistakes = find_mistakes(parts)
        if mistakes:
            refuse("\n".join(f"{dotted(found.path)}: {found.message}" for found in mistakes))
        return self

    def __eq__(self, other: object) -> bool:
        """Compare the parts; the document does not count."""
        if not isinstance(other, Scene):
            return NotImplemented
        return all(getattr(self, key) == getattr(other, key) for key in type(self).model_fields)

    def __hash__(self) -> int:
        return hash(tuple(getattr(self, key) for key in type(self).model_fields))


def _plain(value: Any) -> Any:
    """Turn a part into plain data, leaving out what is not given."""
    if isinstance(value, Part):
        fields = type(value).model_fields
        given = {field.alias or key: getattr(value, key) for key, field in fields.items()}
        first = {"type": given["type"]} if "type" in given else {}
        return {
            key: _plain(item)
            for key, item in (first | given).items()
            if item is not None and not (isinstance(item, FrozenMapping) and not item)
        }
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return float(value)  # a number that knows its dimension is plain, too
    return value.text if isinstance(value, Expression) else value
