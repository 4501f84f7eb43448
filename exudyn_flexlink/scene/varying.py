"""Values that vary: a number, an expression, or a table of values by time."""

from __future__ import annotations

import re
from collections.abc import Mapping
from itertools import pairwise
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler, model_validator
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from exudyn_flexlink.expressions import (
    Expression,
    ExpressionError,
    in_words,
    looks_like_expression,
    parse_expression,
)
from exudyn_flexlink.quantities import NUMBER, UNIT, Number, Quantity
from exudyn_flexlink.scene.base import TAG, Part, Text, refuse, require_one
from exudyn_flexlink.units import Dimension

Row = tuple[Annotated[float, Quantity(Dimension.TIME)], Annotated[float, Number()]]


class Table(Part):
    """Values by time, given here or in a CSV file, and how they go on between its rows."""

    points: tuple[Row, ...] | None = Field(
        None, description="[[time, value], ...] in SI units, by time"
    )
    file: Text | None = Field(
        None, description="CSV file of time, value in SI units, relative to the model's folder"
    )
    rule: Literal["linear", "cubic", "step"] = Field(
        description="between rows: linear: straight; cubic: a smooth spline; step: each value "
        "until the next"
    )

    @model_validator(mode="after")
    def _has_rows(self) -> Table:
        require_one(self, "points", "file")
        if self.points is None:
            return self
        if len(self.points) < 2:
            refuse("a table needs at least 2 rows", at="points")
        for i, ((before, _), (after, _)) in enumerate(pairwise(self.points), start=1):
            if after <= before:
                refuse("times must increase from row to row", at=("points", i))
        if self.points[0][0] > 0:
            refuse("must begin at time 0 or before", at=("points", 0))
        return self


Value: TypeAlias = float | Expression | Table


class Varying:
    """Annotation of a value of a dimension that may be an expression or a table.

    An expression without t and state is a number.
    """

    def __init__(self, dimension: Dimension) -> None:
        self.dimension = dimension

    def read(self, value: object) -> float | Expression:
        """Return a number in SI or an expression; raise pydantic's error if it is neither."""
        if isinstance(value, Expression):
            return value
        if isinstance(value, str) and _is_meant_as_one(value):
            return self._expression(value)
        found = Quantity(self.dimension).read(value)
        assert not isinstance(found, str)  # there are no words to be read
        return found

    def _expression(self, text: str) -> float | Expression:
        try:
            found = parse_expression(text)
        except ExpressionError as error:
            raise _mistake(f"'{text}': {error.message}", error.hint) from None
        wanted = self.dimension
        if found.powers is not None and found.powers != wanted.powers._replace(rad=0):
            message = f"expected {wanted.words}, got {in_words(found.powers)}: '{text}'"
            raise _mistake(message, wanted.hint)
        if found.constant is None:
            return found
        return float(Quantity(self.dimension).read(found.constant))

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        choices = {
            TAG: core_schema.no_info_plain_validator_function(self.read),
            TAG + "table": handler.generate_schema(Table),
        }
        return core_schema.tagged_union_schema(choices, discriminator=_branch)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        table = handler(schema["choices"][TAG + "table"])
        own = self.dimension
        words = own.words.split(" ", 1)[1]
        unit = f"{words}; {own.si}, e.g. '{own.example}', or an expression or a table"
        return {"anyOf": [{"type": "number"}, {"type": "string"}, table], "$comment": unit}


def _branch(value: Any) -> str:
    return TAG + "table" if isinstance(value, (Mapping, Table)) else TAG


def _is_meant_as_one(text: str) -> bool:
    """Tell whether a text is an expression, or fails as one and not as a number with a unit."""
    if looks_like_expression(text):
        return True
    single = re.fullmatch(rf"\s*(?:{NUMBER}\s*(?:{UNIT})?)?\s*", text)
    return single is None or any(mark in text for mark in ("(", "**", " + ", " - "))


def _mistake(message: str, hint: str) -> PydanticCustomError:
    return PydanticCustomError("mistake", "{message}", {"message": message, "hint": hint, "at": ()})
