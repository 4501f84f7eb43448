"""A document to a scene, with every mistake of the document at once."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from pydantic import TypeAdapter, ValidationError

from exudyn_flexlink.quantities import in_words
from exudyn_flexlink.scene.base import Text
from exudyn_flexlink.scene.bodies import Body, Material
from exudyn_flexlink.scene.contacts import Contact
from exudyn_flexlink.scene.curve_specs import CurveSpec
from exudyn_flexlink.scene.forces import Drive, Gravity, Spring
from exudyn_flexlink.scene.joints import Joint
from exudyn_flexlink.scene.lookup import Parts
from exudyn_flexlink.scene.model import Scene
from exudyn_flexlink.scene.names import find_mistakes
from exudyn_flexlink.scene.outputs import Outputs
from exudyn_flexlink.scene.point_files import PointFiles, read_point_files
from exudyn_flexlink.scene.run import Accuracy, Initial, Run, Solver
from exudyn_flexlink.scene.wording import mistakes_of, unknown_key
from exudyn_flexlink.settings import ExclusiveKeys, Setting, with_settings
from exudyn_flexlink.source import Document, KeyPath, Mistake, SceneError

EXCLUSIVE_KEYS: ExclusiveKeys = (
    (("accuracy", "tolerance"), ("step",)),
    (("accuracy", "step"), ("tolerance",)),
    (("run", "duration"), ("turns", "of", "at_most")),
    (("run", "turns"), ("duration",)),
    (("springs", "*", "stiffness"), ("frequency",)),
    (("springs", "*", "frequency"), ("stiffness",)),
    (("springs", "*", "damping"), ("damping_ratio",)),
    (("springs", "*", "damping_ratio"), ("damping",)),
    (("curves", "*", "points"), ("file",)),
    (("curves", "*", "file"), ("points",)),
    (("drives", "*", "value", "points"), ("file",)),
    (("drives", "*", "value", "file"), ("points",)),
)
"""Keys that exclude others beside them: a setting of the first removes the others of the file."""

_NAMED: dict[str, Any] = {
    "materials": Material,
    "curves": CurveSpec,
    "bodies": Body,
    "joints": Joint,
    "springs": Spring,
    "drives": Drive,
    "contacts": Contact,
}
_SINGLE: dict[str, Any] = {
    "title": Text,
    "source": Text,
    "gravity": Gravity,
    "initial": Initial,
    "run": Run,
    "accuracy": Accuracy,
    "solver": Solver,
    "outputs": Outputs,
}
_IN_PARTS = ("initial", "outputs")  # of which no key is asked for, and to which none refers
SECTION_OF = {
    key: section for section, part in _SINGLE.items() for key in getattr(part, "model_fields", ())
}
"""The section to which each key of accuracy, initial, run and solver belongs."""


def apply_settings(document: Document, settings: Iterable[Setting]) -> Document:
    """Return the document with settings such as 'run.turns=2' in place of its values.

    Raises:
        SceneError: a setting is malformed, or its path leads nowhere.

    """
    return with_settings(document, settings, EXCLUSIVE_KEYS)


@dataclass(frozen=True)
class CheckedDocument:
    """A document's parts as far as they are valid, and what is wrong with the others."""

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
            SceneError: there are; it holds all of them.

        """
        mistakes = [self.files.placed(one) for one in (*self.mistakes, *others)]
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
    """Check every part of a document by itself, so that no mistake hides another.

    `allow_outside` lets splines be read from files outside the document's folder.
    """
    unknown = _unknown_sections(document.data)
    misspelt = [key for key in Scene.model_fields if any(f"'{key}'?" in x.message for x in unknown)]
    mistakes = unknown + _missing_sections(document.data, misspelt)
    files = read_point_files(document, allow_outside)
    mistakes += files.mistakes + _python_names(files.sections.get("curves"), ("curves",))
    data = document.data | files.sections
    sections: dict[str, Any] = {}
    for key, annotation in _SINGLE.items():
        if data.get(key) is not None:
            sections[key] = _checked(annotation, data[key], (key,), mistakes, key in _IN_PARTS)
    for key in _NAMED:
        if data.get(key) is not None:
            sections[key] = _named_parts(key, data[key], mistakes)
    # References into a section that was left out are mistakes; into a broken one they may be right.
    required = [key for key, field in Scene.model_fields.items() if field.is_required()]
    absent: dict[str, Any] = {key: {} for key in _NAMED if key not in (*required, *misspelt)}
    mistakes += find_mistakes(Parts.of(absent | sections))
    return CheckedDocument(document, sections, tuple(mistakes), files)


def _unknown_sections(data: Mapping[str, Any]) -> list[Mistake]:
    known = list(Scene.model_fields)
    return [unknown_key((key,), known, SECTION_OF) for key in data if key not in known]


def _missing_sections(data: Mapping[str, Any], misspelt: list[str]) -> list[Mistake]:
    found = []
    for key, field in Scene.model_fields.items():
        if field.is_required() and key not in (*data, *misspelt):
            found.append(Mistake((), f"missing '{key}'"))
        elif field.is_required() and key in data and data[key] is None:
            found.append(Mistake((key,), "expected something, got nothing", on_key=True))
    return found


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
    return TypeAdapter(_NAMED.get(section) or _SINGLE[section])


def _checked(
    annotation: Any, data: Any, path: KeyPath, mistakes: list[Mistake], in_parts: bool = False
) -> Any:
    """Return the part that `data` describes, or None after noting its mistakes.

    With `in_parts` return what is right of it, so that names there are looked up, too.
    """
    adapter = _adapter(str(path[0]))
    try:
        return adapter.validate_python(data)
    except ValidationError as error:
        mistakes += mistakes_of(error, annotation, data, path, SECTION_OF)
        wrong = {found["loc"][0] for found in error.errors() if found["loc"]}
    if not in_parts or not isinstance(data, Mapping):
        return None
    try:
        return adapter.validate_python({key: own for key, own in data.items() if key not in wrong})
    except ValidationError:
        return None


def _python_names(data: Any, path: KeyPath) -> list[Mistake]:
    """Refuse `from_`, which stands for `from` in Python and nowhere else."""
    if isinstance(data, list):
        return [found for i, item in enumerate(data) for found in _python_names(item, (*path, i))]
    if not isinstance(data, Mapping):
        return []
    found = [unknown_key((*path, "from_"), ["from"])] if "from_" in data and len(path) > 1 else []
    return found + [
        inner for key, item in data.items() for inner in _python_names(item, (*path, key))
    ]
