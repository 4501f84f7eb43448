"""Values that vary: a number, an expression, or a table of values by time."""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
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
from exudyn_flexlink.scene.base import (
    NEEDS_QUOTES,
    TAG,
    Part,
    Text,
    is_cut,
    listed,
    refuse,
)
from exudyn_flexlink.units import Dimension

Row = Annotated[
    tuple[Annotated[float, Quantity(Dimension.TIME)], Annotated[float, Number()]],
    listed("time", "value"),
]


class Table(Part):
    """Values by time, given here or in a CSV file, and how they go on between its rows."""

    one_of = (("points", "file"),)
    points: tuple[Row, ...] | None = Field(
        None, description="[[time, value], ...] in SI units, by time"
    )
    file: Text | None = Field(
        None,
        description="CSV file of time, value, relative to the model's folder; a header may name "
        "units",
    )
    rule: Literal["linear", "cubic", "step"] = Field(
        description="between rows: linear: straight; cubic: a smooth spline; step: each value "
        "until the next"
    )

    @model_validator(mode="after")
    def _has_rows(self) -> Table:
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


class Measured(float):
    """A number whose unit told which of several dimensions is meant."""

    dimension: Dimension

    def __new__(cls, dimension: Dimension, value: float) -> Measured:
        """Keep the dimension with the value in SI."""
        found = super().__new__(cls, value)
        found.dimension = dimension
        return found

    def __getnewargs__(self) -> tuple[Dimension, float]:  # type: ignore[override]
        """Return what copies are made of."""
        return self.dimension, float(self)


class Varying:
    """Annotation of a value of a dimension that may be an expression or a table.

    An expression without t and state is a number.
    """

    def __init__(self, *dimensions: Dimension) -> None:
        """More than one where another part, such as a joint, tells which is meant."""
        self.dimensions = dimensions

    def read(self, value: object) -> float | Expression:
        """Return a number in SI or an expression; raise pydantic's error if it is neither."""
        if isinstance(value, Expression):
            return value
        if isinstance(value, str) and _is_meant_as_one(value):
            return self._expression(value)
        if isinstance(value, str):
            for other in self.dimensions[1:]:
                with suppress(PydanticCustomError):
                    return Measured(other, float(Quantity(other).read(value)))
        number = float(Quantity(self.dimensions[0]).read(value))
        if isinstance(value, str) and len(self.dimensions) > 1:
            return Measured(self.dimensions[0], number)
        return number

    def _expression(self, text: str) -> float | Expression:
        try:
            found = parse_expression(text)
        except ExpressionError as error:
            hint = error.hint or NEEDS_QUOTES * is_cut(text)
            refuse(f"'{text}': {error.message}", hint)
        wanted = self.dimensions[0]
        if found.powers is not None:
            fits = [one for one in self.dimensions if one.powers._replace(rad=0) == found.powers]
            if not fits:
                message = f"expected {wanted.words}, got {in_words(found.powers)}: '{text}'"
                refuse(message, wanted.hint)
            wanted = fits[0]
        if found.constant is None:
            return found
        number = float(Quantity(wanted).read(found.constant))
        several = found.powers is not None and len(self.dimensions) > 1
        return Measured(wanted, number) if several else number

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        choices = {
            TAG: core_schema.no_info_plain_validator_function(
                self.read, json_schema_input_schema=core_schema.str_schema()
            ),
            TAG + "table": handler.generate_schema(Table),
        }
        return core_schema.tagged_union_schema(choices, discriminator=_branch)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        text, table = handler(schema)["oneOf"]
        ways = [
            f"{own.words.split(' ', 1)[1]}; {own.si}, e.g. '{own.example}'"
            for own in self.dimensions
        ]
        unit = f"{' or '.join(ways)}, or an expression or a table"
        return {"anyOf": [{"type": "number"}, text, table], "$comment": unit}


def _branch(value: Any) -> str:
    return TAG + "table" if isinstance(value, (Mapping, Table)) else TAG


def _is_meant_as_one(text: str) -> bool:
    """Tell whether a text is an expression, or fails as one and not as a number with a unit."""
    if looks_like_expression(text):
        return True
    single = re.fullmatch(rf"\s*(?:{NUMBER}\s*(?:{UNIT})?)?\s*", text)
    return single is None or any(mark in text for mark in ("(", "**", " + ", " - "))
