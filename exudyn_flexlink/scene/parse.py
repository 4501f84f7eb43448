"""A document to a scene, with every mistake of the document at once."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, get_args, get_origin, get_type_hints

from pydantic import TypeAdapter, ValidationError

from exudyn_flexlink.quantities import in_words
from exudyn_flexlink.scene.curve_specs import CurveSpec
from exudyn_flexlink.scene.lookup import Parts
from exudyn_flexlink.scene.model import Scene
from exudyn_flexlink.scene.names import find_mistakes
from exudyn_flexlink.scene.point_files import PointFiles, read_point_files
from exudyn_flexlink.scene.wording import mistakes_of, part_classes, unknown_key
from exudyn_flexlink.settings import ExclusiveKeys, Setting, with_settings
from exudyn_flexlink.source import Document, KeyPath, Mistake, SceneError

_HINTS = get_type_hints(Scene, include_extras=True)
_SECTIONS = {key: _HINTS[key] for key in Scene.model_fields}
_NAMED = {
    key: get_args(field.annotation)[1]
    for key, field in Scene.model_fields.items()
    if get_origin(field.annotation) is Mapping
}
"""What stands in each section, and behind each name of those that have names."""
_IN_PARTS = ("initial", "outputs")  # of which no key is asked for, and to which none refers
SECTION_OF = {
    key: section for section, part in _SECTIONS.items() for key in getattr(part, "model_fields", ())
}
"""The section to which each key of accuracy, initial, run and solver belongs."""


def _exclusive_keys(
    annotation: Any, path: KeyPath = ()
) -> Iterator[tuple[KeyPath, tuple[str, ...]]]:
    """Find keys that exclude others beside them, by paths with '*' for any name or place."""
    for part in part_classes(annotation):
        for key, field in part.model_fields.items():
            if others := part.excluded_by(key):
                yield (*path, key), others
            of_many = ("*",) if get_origin(field.annotation) in (Mapping, tuple) else ()
            yield from _exclusive_keys(field.annotation, (*path, key, *of_many))


EXCLUSIVE_KEYS: ExclusiveKeys = tuple(_exclusive_keys(Scene))
"""Keys that exclude others beside them: a setting of the first removes the others of the file."""


def apply_settings(document: Document, settings: Iterable[Setting]) -> Document:
    """Return the document with settings such as 'run.turns=2' in place of its values.

    Raises:
        SceneError: a setting is malformed, or its path leads nowhere.

    """
    return with_settings(document, settings, EXCLUSIVE_KEYS, _NAMED)


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
    mistakes += files.mistakes
    sections: dict[str, Any] = {}
    for key, data in (document.data | files.sections).items():
        if key in _NAMED and data is not None:
            sections[key] = _named_parts(key, data, mistakes)
        elif key in _SECTIONS and data is not None:
            sections[key] = _checked(_SECTIONS[key], data, (key,), mistakes)
    # References into a section that was left out are mistakes; into a broken one they may be right.
    required = [key for key, field in Scene.model_fields.items() if field.is_required()]
    absent: dict[str, Any] = {key: {} for key in _NAMED if key not in (*required, *misspelt)}
    mistakes += find_mistakes(Parts(absent | sections))
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
    return TypeAdapter(_NAMED.get(section) or _SECTIONS[section])


def _checked(annotation: Any, data: Any, path: KeyPath, mistakes: list[Mistake]) -> Any:
    """Return the part that `data` describes, or None after noting its mistakes.

    Of some sections return what is right in them, so that names there are looked up, too.
    """
    adapter = _adapter(str(path[0]))
    try:
        return adapter.validate_python(data, by_name=False)
    except ValidationError as error:
        mistakes += mistakes_of(error, annotation, data, path, SECTION_OF)
        wrong = {found["loc"][0] for found in error.errors() if found["loc"]}
    if path[0] not in _IN_PARTS or not isinstance(data, Mapping):
        return None
    try:
        return adapter.validate_python({key: own for key, own in data.items() if key not in wrong})
    except ValidationError:
        return None
