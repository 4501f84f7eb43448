"""The JSON schema of a model file, with which editors help while one is written."""

from __future__ import annotations

import json
from typing import Any

from pydantic.json_schema import GenerateJsonSchema
from pydantic_core.core_schema import NullableSchema

from exudyn_flexlink.scene.model import Scene

TITLE = "A model of exudyn-flexlink"
DRAFT = "https://json-schema.org/draft/2020-12/schema"
_OPTIONAL_TYPE = ("ContactLaw", "RectangleSection")  # the type meant where none is given


class _OfModelFiles(GenerateJsonSchema):
    """Pydantic's schema without nulls, which only say that a key may be left out."""

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
    """Tell whether a text is such a schema, perhaps of another version."""
    try:
        data = json.loads(text)
    except (ValueError, RecursionError):
        return False
    return isinstance(data, dict) and (data.get("$schema"), data.get("title")) == (DRAFT, TITLE)


def _tidy(value: Any) -> Any:
    """Drop titles of classes and defaults of nothing; say units in words."""
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
