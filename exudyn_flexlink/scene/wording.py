"""Pydantic's errors in the words of someone who writes a model file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from inspect import isclass
from typing import Any, get_args

from pydantic import ValidationError

from exudyn_flexlink.expressions import looks_like_expression
from exudyn_flexlink.quantities import in_words
from exudyn_flexlink.scene.base import TAG, Part, types_of
from exudyn_flexlink.scene.synonyms import did_you_mean_word
from exudyn_flexlink.source import KeyPath, Mistake

_NOWHERE: Mapping[str, str] = {}


def mistakes_of(
    error: ValidationError,
    annotation: Any,
    data: Any,
    at: KeyPath,
    elsewhere: Mapping[str, str] = _NOWHERE,
) -> list[Mistake]:
    """Return the mistakes in `data`, which stands at the path `at` and should be `annotation`.

    `elsewhere` are keys of other sections, and those sections: where an unknown key may belong.
    """
    found: list[Mistake] = []
    suggested: set[tuple[KeyPath, str]] = set()
    missing: list[Mistake] = []
    for item in error.errors(include_url=False):
        if item["type"] == "too_short" and len(item["input"]) >= item["ctx"]["min_length"]:
            continue  # pydantic counts good entries only, and the others are told already
        inner = _data_path(item["loc"])
        path = (*at, *inner)
        if item["type"] == "extra_forbidden":
            keys = known_keys(annotation, data, inner[:-1])
            mistake = unknown_key(path, keys, elsewhere if path[:-1] == at else _NOWHERE)
            found.append(mistake)
            suggested |= {(path[:-1], key) for key in keys if f"'{key}'?" in mistake.message}
        elif item["type"] == "missing":
            missing.append(Mistake(path[:-1], f"missing '{path[-1]}'", on_key=True))
        else:
            found.append(_reworded(path, dict(item)))
    # A misspelt key is one mistake, not also a missing one.
    misspelt = {(path, f"missing '{key}'") for path, key in suggested}
    return found + [item for item in missing if (item.path, item.message) not in misspelt]


def unknown_key(path: KeyPath, keys: list[str], elsewhere: Mapping[str, str] = _NOWHERE) -> Mistake:
    """Return the mistake of a key that is none of `keys`, but perhaps one of another section."""
    name = str(path[-1])
    near = f"; did you mean '{elsewhere[name]}.{name}'?" if name in elsewhere else ""
    message = f"unknown key '{name}'{near or did_you_mean_word(name, keys)}"
    return Mistake(path, message, "keys here: " + ", ".join(keys), on_key=True)


def known_keys(annotation: Any, data: Any, path: KeyPath) -> list[str]:
    """Return the keys that may stand in the mapping at `path` of `data`."""
    classes = part_classes(annotation)
    for step in path:
        if isinstance(data, Mapping) and classes:
            fields = _fields(_meant(classes, data))
            # What is no key is the name of a part, in a mapping of such parts.
            classes = part_classes(fields[str(step)]) if step in fields else classes
        data = data[step]
    return list(_fields(_meant(classes, data))) if classes else []


def _data_path(location: tuple[int | str, ...]) -> KeyPath:
    """Drop from pydantic's location the branches of unions, which are no part of the data."""
    return tuple(step for step in location if not str(step).startswith(TAG))


def part_classes(annotation: Any) -> list[type[Part]]:
    """Return the classes of parts in an annotation."""
    if isclass(annotation) and issubclass(annotation, Part):
        return [annotation]
    return [part for inner in get_args(annotation) for part in part_classes(inner)]


def _meant(classes: list[type[Part]], data: Any) -> type[Part]:
    kind = data.get("type") if isinstance(data, Mapping) else None
    return next((part for part in classes if kind in types_of(part)), classes[0])


def _fields(part: type[Part]) -> dict[str, Any]:
    """Return the keys of a part with their annotations."""
    return {field.alias or key: field.annotation for key, field in part.model_fields.items()}


def _reworded(path: KeyPath, error: dict[str, Any]) -> Mistake:
    kind, context, got = error["type"], error.get("ctx", {}), in_words(error["input"])
    if kind == "mistake":
        message = context["message"]
        on_key = not context["at"] and message.startswith(("missing", "needs '"))
        hint, value = context["hint"], error["input"]
        given = isinstance(value, str) and path[0] != "drives" and looks_like_expression(value)
        if given and message.startswith("expected"):
            message += ": an expression can't stand here"
            hint = "it can in the value of a drive"
        return Mistake((*path, *context["at"]), message, hint, on_key=on_key)
    if kind.startswith("union_tag"):
        return _wrong_type(path, error)
    if kind in _WORDS:
        of_file = path[-1:] == ("points",) and isinstance(error["input"], str)
        hint = f"those of a file: 'file: {error['input']}' in place of 'points'" if of_file else ""
        listed = ", ".join(_quoted(str(context.get("expected", ""))))
        entries = "entry" if context.get("min_length") == 1 else "entries"
        told = _WORDS[kind].format(got=got, listed=listed, entries=entries, **context)
        return Mistake(path, told, hint)
    return Mistake(path, error["msg"])


def _wrong_type(path: KeyPath, error: dict[str, Any]) -> Mistake:
    data, context = error["input"], error.get("ctx", {})
    types = [word for word in _quoted(context.get("expected_tags", "")) if word]
    listed = ", ".join(types)
    if not isinstance(data, Mapping):
        return Mistake(path, f"expected a mapping with a type, got {in_words(data)}")
    if "type" not in data:
        return Mistake(path, "missing 'type'", f"one of {listed}", on_key=True)
    kind = data["type"]
    near = did_you_mean_word(kind, types) if isinstance(kind, str) else ""
    message = f"type must be one of {listed}; got {in_words(kind)}{near}"
    return Mistake((*path, "type"), message)


def _quoted(text: str) -> list[str]:
    return [word.replace(r"\x00", "") for word in re.findall(r"'([^']*)'", text)]


_WORDS = {
    **dict.fromkeys(("tuple_type", "list_type"), "expected a list, got {got}"),
    **dict.fromkeys(
        ("dict_type", "mapping_type", "model_type", "model_attributes_type"),
        "expected a mapping, got {got}",
    ),
    **dict.fromkeys(
        ("int_type", "int_from_float", "int_parsing_size"), "expected a whole number, got {got}"
    ),
    "string_type": "expected a text, got {got}",
    "bool_type": "expected true or false, got {got}",
    "literal_error": "must be one of {listed}; got {got}",
    "greater_than_equal": "must be {ge} or greater",
    "less_than_equal": "must be {le} or less",
    "too_short": "needs at least {min_length} {entries}",
}
"""What is said of pydantic's other errors, from their context and the value."""
