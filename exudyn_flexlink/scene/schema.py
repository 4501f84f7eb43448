"""The JSON schema of a model file, with which editors help while one is written."""

from __future__ import annotations

import json
from typing import Any

from pydantic.json_schema import models_json_schema

from exudyn_flexlink.scene.model import Scene

TITLE = "A model of exudyn-flexlink"
DRAFT = "https://json-schema.org/draft/2020-12/schema"
_OPTIONAL_TYPE = ("ContactLaw", "RectangleSection")  # the type meant where none is given


def json_schema() -> dict[str, Any]:
    """Return the schema (draft 2020-12) of a model file, from the classes that check it."""
    _, whole = models_json_schema([(Scene, "validation")], by_alias=True)
    tidy = {name: _tidy(part) for name, part in whole["$defs"].items()}
    definitions = {
        name: {key: _with_references(value, tidy) for key, value in part.items()}
        for name, part in tidy.items()
    }
    for name, part in definitions.items():
        if "type" in part["properties"]:
            part["properties"]["type"]["description"] = part["description"]
            if name not in _OPTIONAL_TYPE:
                part["required"] = ["type", *part.get("required", [])]
    scene = definitions.pop("Scene")
    return {
        "$schema": DRAFT,
        "title": TITLE,
        **scene,
        "$defs": dict(sorted(definitions.items())),
    }


def _with_references(value: Any, definitions: dict[str, Any]) -> Any:
    """Refer to a definition where pydantic has written it out again."""
    if isinstance(value, list):
        return [_with_references(item, definitions) for item in value]
    if not isinstance(value, dict):
        return value
    name = next((name for name, part in definitions.items() if part == value), None)
    if name is not None:
        return {"$ref": f"#/$defs/{name}"}
    return {key: _with_references(item, definitions) for key, item in value.items()}


def is_schema(text: str) -> bool:
    """Tell whether a text is such a schema, perhaps of another version."""
    try:
        data = json.loads(text)
    except (ValueError, RecursionError):
        return False
    return isinstance(data, dict) and (data.get("$schema"), data.get("title")) == (DRAFT, TITLE)


def _tidy(value: Any, *, names: bool = False) -> Any:
    """Drop titles and nulls, which only say that a key may be left out; say units in words."""
    if isinstance(value, list):
        return [_tidy(item) for item in value]
    if not isinstance(value, dict):
        return value
    if names:  # the keys are those of a model file, not the schema's
        return {key: _tidy(item) for key, item in value.items()}
    value = _without_null(value)
    kept = {
        key: _tidy(item, names=key == "properties")
        for key, item in value.items()
        if key not in ("title", "$comment") and not (key == "default" and item is None)
    }
    unit = value.get("$comment")
    if unit and unit != kept.get("description"):
        kept["description"] = f"{kept['description']}: {unit}" if "description" in kept else unit
    return kept


def _without_null(value: dict[str, Any]) -> dict[str, Any]:
    forms = [form for form in value.get("anyOf", []) if form != {"type": "null"}]
    if "anyOf" not in value or len(forms) == len(value["anyOf"]):
        return value
    rest = {key: item for key, item in value.items() if key != "anyOf"}
    return {**forms[0], **rest} if len(forms) == 1 else {**rest, "anyOf": forms}
