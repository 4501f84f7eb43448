"""The whole scene: a model file that is checked, frozen and in SI units.

A document becomes a scene, or all its mistakes are shown at once. The JSON schema of model files
lets editors help while one is written.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, get_args, get_origin, get_type_hints

from pydantic import Field, PrivateAttr, TypeAdapter, ValidationError, model_validator
from pydantic.json_schema import GenerateJsonSchema
from pydantic_core.core_schema import NullableSchema

from exudyn_flexlink.expressions import Expression
from exudyn_flexlink.quantities import in_words
from exudyn_flexlink.scene.base import FrozenMapping, Named, Part, Text, by_name, refuse
from exudyn_flexlink.scene.bodies import Body, CurveSpec, Material
from exudyn_flexlink.scene.columns import PointFiles, read_point_files
from exudyn_flexlink.scene.contacts import (
    TURNED,
    Contact,
    Law,
    Rope,
    Stop,
    StopLaw,
    flanks_of,
    moving,
    stops_of,
)
from exudyn_flexlink.scene.forces import Drive, Gravity, LinearSpring, RopeSpring, Spring
from exudyn_flexlink.scene.joints import GearJoint, Joint, PrismaticJoint, RevoluteJoint, WeldJoint
from exudyn_flexlink.scene.names import Parts, find_mistakes
from exudyn_flexlink.scene.run import Accuracy, Initial, InitialOrRest, Outputs, Run, Solver
from exudyn_flexlink.scene.stages import Stage
from exudyn_flexlink.scene.wording import mistakes_of, part_classes, unknown_key
from exudyn_flexlink.source import (
    Document,
    ExclusiveKeys,
    KeyPath,
    Mistake,
    SceneError,
    Setting,
    dotted,
    with_settings,
)


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
    stages: tuple[Stage, ...] = Field(
        (),
        description="changes of the mechanism while it runs, one after the other; 'run: until' "
        "counts in the last stage alone",
    )
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
    def ending(self) -> tuple[KeyPath, Expression | None]:
        """Path and formula of the end of the run, or of its first stage; no formula: None."""
        if self.stages:
            return ("stages", 0, "until"), self.stages[0].until
        return ("run", "until"), self.run.until

    @property
    def stops(self) -> dict[str, Stop]:
        """Stops at joints' limits, and flanks of gears with play, by names such as 'hinge.to'."""
        stops: dict[str, Stop] = {}
        for name, joint in self.joints.items():
            if isinstance(joint, (RevoluteJoint, PrismaticJoint)) and joint.limits:
                stops.update(stops_of(name, joint.limits, joint.points))
            elif isinstance(joint, GearJoint) and joint.backlash > 0 and joint.law is not None:
                second = self.joints[joint.joints[1]]
                assert isinstance(second, (RevoluteJoint, PrismaticJoint))  # names are checked
                turns = isinstance(second, RevoluteJoint)
                stops.update(flanks_of(name, joint.backlash, joint.law, turns, second.points))
        return stops

    @property
    def ropes(self) -> dict[str, LinearSpring | RopeSpring]:
        """Springs that act on one side, ropes and buffers, by name."""
        kinds, springs = LinearSpring | RopeSpring, self.springs.items()
        return {n: s for n, s in springs if isinstance(s, kinds) and s.acts != "both"}

    @property
    def all_contacts(self) -> dict[str, Contact | Stop | Rope]:
        """Contacts of the scene, then stops of its joints, then ropes and buffers, by name."""
        ropes = {name: Rope(rope, moving(self._ends(rope))) for name, rope in self.ropes.items()}
        return {**self.contacts, **self.stops, **ropes}

    def _ends(self, spring: LinearSpring | RopeSpring) -> tuple[str, ...]:
        if isinstance(spring, RopeSpring):
            return tuple(entry for entry in spring.over if isinstance(entry, str))
        if spring.points is not None:
            return spring.points
        joint = self.joints[spring.joint or ""]
        assert isinstance(joint, PrismaticJoint)  # names are checked
        return joint.points

    @property
    def laws(self) -> dict[str, Law | StopLaw]:
        """Laws of walls and bearings, then contacts, then stops, by name; springs have no law."""
        walls = {name: getattr(joint, "acting", None) for name, joint in self.joints.items()}
        laws_of_joints = {name: law for name, law in walls.items() if law is not None}
        return laws_of_joints | {
            n: contact.law for n, contact in {**self.contacts, **self.stops}.items()
        }

    def law_path(self, name: str) -> KeyPath:
        """Path of the law that the scene gives for one of these names."""
        if name in self.stops:
            return self.stops[name].law_path
        return "contacts" if name in self.contacts else "joints", name, "law"

    def unit_of(self, contact: str, unit: str) -> str:
        """Unit of a contact's number, by the `unit` at points: at a hinge's stop N becomes N m."""
        stop = self.stops.get(contact)
        return TURNED.get(unit, unit) if stop is not None and stop.turns else unit

    def drives_of(self, joint: str) -> tuple[str, ...]:
        """Names of the drives of a joint; of a weld the name by which its torque is told."""
        if isinstance(self.joints[joint], WeldJoint):
            return (f"{joint} (weld)",)
        return tuple(n for n, drive in self.drives.items() if getattr(drive, "joint", "") == joint)

    @classmethod
    def from_parts(cls, sections: Mapping[str, Any], document: Document) -> Scene:
        """Build a scene from checked parts; it remembers their document."""
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
            refuse("\n".join(f"{dotted(mistake.path)}: {mistake.message}" for mistake in mistakes))
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
            if item is not None and not (isinstance(item, (FrozenMapping, tuple)) and not item)
        }
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return float(value)  # `Measured`, a float with a dimension
    return value.text if isinstance(value, Expression) else value


_HINTS = get_type_hints(Scene, include_extras=True)
_SECTIONS = {key: _HINTS[key] for key in Scene.model_fields}
_NAMED = {
    key: get_args(field.annotation)[1]
    for key, field in Scene.model_fields.items()
    if get_origin(field.annotation) is Mapping
}
"""Type of each section's content, or of each part if the section has named parts."""
_IN_PARTS = ("initial", "outputs")  # no key is required, and no name refers to them
SECTION_OF = {
    key: section for section, part in _SECTIONS.items() for key in getattr(part, "model_fields", ())
}
"""The section to which each key of accuracy, initial, run and solver belongs."""


def _exclusive_keys(
    annotation: Any, path: KeyPath = ()
) -> Iterator[tuple[KeyPath, tuple[str, ...]]]:
    """Find keys that exclude keys beside them; in their paths '*' is any name or index."""
    for part in part_classes(annotation):
        for key, field in part.model_fields.items():
            if others := part.excluded_by(key):
                yield (*path, key), others
            of_many = ("*",) if get_origin(field.annotation) in (Mapping, tuple) else ()
            yield from _exclusive_keys(field.annotation, (*path, key, *of_many))


EXCLUSIVE_KEYS: ExclusiveKeys = tuple(_exclusive_keys(Scene))
"""Keys that exclude keys beside them: a setting of a key removes these from the file's data."""


def apply_settings(document: Document, settings: Iterable[Setting]) -> Document:
    """Return the document with settings such as 'run.turns=2' in place of its values.

    Raises:
        SceneError: a setting is malformed, or its path leads nowhere.

    """
    return with_settings(document, settings, EXCLUSIVE_KEYS, _NAMED)


@dataclass(frozen=True)
class CheckedDocument:
    """The valid parts of a document, and the mistakes in the others."""

    document: Document
    sections: Mapping[str, Any]
    mistakes: tuple[Mistake, ...]
    files: PointFiles

    @property
    def curves(self) -> Mapping[str, CurveSpec | None]:
        """Curves by name; None stands for one whose description has a mistake."""
        return self.sections.get("curves") or {}

    def to_scene(self, others: Iterable[Mistake] = ()) -> Scene:
        """Make the scene, unless there are mistakes: those found here or `others`.

        Raises:
            SceneError: there are mistakes; it holds all of them.

        """
        mistakes = [self.files.placed(mistake) for mistake in (*self.mistakes, *others)]
        if mistakes:
            raise SceneError(self.document, mistakes)
        return Scene.from_parts(self.sections, self.document)


def parse_scene(document: Document, allow_outside: bool = False) -> Scene:
    """Turn a document into a scene; see `check_document`.

    Raises:
        SceneError: the document has mistakes; all of them are in it.

    """
    return check_document(document, allow_outside).to_scene()


def check_document(document: Document, allow_outside: bool = False) -> CheckedDocument:
    """Check every part of a document separately, so that no mistake hides another.

    `allow_outside` lets splines be read from files outside the document's folder.
    """
    known, given = list(Scene.model_fields), document.data
    unknown = [unknown_key((key,), known, SECTION_OF) for key in given if key not in known]
    misspelt = [key for key in Scene.model_fields if any(f"'{key}'?" in x.message for x in unknown)]
    mistakes = unknown + _missing_sections(document.data, misspelt)
    files = read_point_files(document, allow_outside)
    mistakes += files.mistakes
    sections: dict[str, Any] = {}
    for key, data in (document.data | files.sections).items():
        if key in _NAMED and data is not None:
            sections[key] = _named_parts(key, data, mistakes)
        elif key in _SECTIONS and data is not None:
            sections[key] = _checked(_SECTIONS[key], data, (key,), mistakes)
    # A reference into a missing section is a mistake. A reference into a broken one may be right.
    required = [key for key, field in Scene.model_fields.items() if field.is_required()]
    absent: dict[str, Any] = {key: {} for key in _NAMED if key not in (*required, *misspelt)}
    mistakes += find_mistakes(Parts(absent | sections))
    return CheckedDocument(document, sections, tuple(mistakes), files)


def _missing_sections(data: Mapping[str, Any], misspelt: list[str]) -> list[Mistake]:
    missing = []
    for key, field in Scene.model_fields.items():
        if field.is_required() and key not in (*data, *misspelt):
            missing.append(Mistake((), f"missing '{key}'"))
        elif field.is_required() and key in data and data[key] is None:
            missing.append(Mistake((key,), "expected something, got nothing", on_key=True))
    return missing


def _named_parts(section: str, data: Any, mistakes: list[Mistake]) -> dict[str, Any] | None:
    if not isinstance(data, Mapping):
        message = f"expected a mapping of names to {section}, got {in_words(data)}"
        mistakes.append(Mistake((section,), message))
        return None
    annotation = _NAMED[section]
    return {
        name: _checked(annotation, part, (section, name), mistakes) for name, part in data.items()
    }


@cache
def _adapter(section: str) -> TypeAdapter[Any]:
    return TypeAdapter(_NAMED.get(section) or _SECTIONS[section])


def _checked(annotation: Any, data: Any, path: KeyPath, mistakes: list[Mistake]) -> Any:
    """Return the part that `data` describes, or None after noting its mistakes.

    Return the correct keys of some sections even so: then the names in these are checked, too.
    """
    adapter = _adapter(str(path[0]))
    try:
        return adapter.validate_python(data, by_name=False)
    except ValidationError as error:
        mistakes += mistakes_of(error, annotation, data, path, SECTION_OF)
        wrong = {mistake["loc"][0] for mistake in error.errors() if mistake["loc"]}
    if path[0] not in _IN_PARTS or not isinstance(data, Mapping):
        return None
    try:
        return adapter.validate_python(
            {key: value for key, value in data.items() if key not in wrong}
        )
    except ValidationError:
        return None


TITLE = "A model of exudyn-flexlink"
DRAFT = "https://json-schema.org/draft/2020-12/schema"
_OPTIONAL_TYPE = ("ContactLaw", "RectangleSection")  # the type if the key `type` is left out


class _OfModelFiles(GenerateJsonSchema):
    """Pydantic's schema without nulls: these only say that a key may be left out."""

    def nullable_schema(self, schema: NullableSchema) -> dict[str, Any]:
        return self.generate_inner(schema["schema"])


def json_schema() -> dict[str, Any]:
    """Return the schema (draft 2020-12) of a model file, from the classes that check it."""
    scene = _tidy(Scene.model_json_schema(schema_generator=_OfModelFiles))
    definitions = scene.pop("$defs")
    for name, part in definitions.items():
        if "type" in part["properties"]:
            part["properties"]["type"]["description"] = part["description"]
            if name not in _OPTIONAL_TYPE:
                part["required"] = ["type", *part.get("required", [])]
    return {"$schema": DRAFT, "title": TITLE, **scene, "$defs": dict(sorted(definitions.items()))}


def is_schema(text: str) -> bool:
    """Tell whether a text is the schema of model files, perhaps of another version."""
    try:
        data = json.loads(text)
    except (ValueError, RecursionError):
        return False
    return isinstance(data, dict) and (data.get("$schema"), data.get("title")) == (DRAFT, TITLE)


def _tidy(value: Any) -> Any:
    """Drop titles of classes and defaults that are null; say units in words."""
    if isinstance(value, list):
        return [_tidy(item) for item in value]
    if not isinstance(value, dict):
        return value
    kept = {
        key: _tidy(item)
        for key, item in value.items()
        if key != "$comment"
        and not (key == "title" and isinstance(item, str))
        and not (key == "default" and item is None)
    }
    unit = value.get("$comment")
    if unit and unit != kept.get("description"):
        kept["description"] = f"{kept['description']}: {unit}" if "description" in kept else unit
    return kept
