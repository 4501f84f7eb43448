"""Forces of springs by their length, and torques by their angle: tables and formulas."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler, model_validator
from pydantic_core import CoreSchema, core_schema

from exudyn_flexlink.expressions import (
    Expression,
    ExpressionError,
    in_words,
    parse_expression,
    tokens_of,
)
from exudyn_flexlink.quantities import Angle, Coordinate, Force, Torque
from exudyn_flexlink.scene.base import NEEDS_QUOTES, TAG, Part, is_cut, listed, refuse
from exudyn_flexlink.units import Dimension


class _SpringTable(Part):
    """Rows that increase, and how it goes on between them."""

    rule: Literal["linear", "cubic"] = Field(
        "linear", description="between rows: linear: straight; cubic: a smooth spline"
    )

    @model_validator(mode="after")
    def _has_rows(self) -> _SpringTable:
        rows: tuple[tuple[float, float], ...] = getattr(self, "points", ())
        if len(rows) < 2:
            refuse("a table needs at least 2 rows", at="points")
        for i, ((before, _), (after, _)) in enumerate(pairwise(rows), start=1):
            if after <= before:
                refuse("must increase from row to row", at=("points", i))
        return self


class ForceTable(_SpringTable):
    """Forces of a spring by its length."""

    points: tuple[Annotated[tuple[Coordinate, Force], listed("length", "force")], ...] = Field(
        description="[[length, force], ...], by length; the run ends where it leaves them"
    )


class TorqueTable(_SpringTable):
    """Torques of a spring by its angle."""

    points: tuple[Annotated[tuple[Angle, Torque], listed("angle", "torque")], ...] = Field(
        description="[[angle, torque], ...], by angle; the run ends where it leaves them"
    )


ForceLaw: TypeAlias = Expression | ForceTable
TorqueLaw: TypeAlias = Expression | TorqueTable


class ByOwn:
    """Annotation of a table, or of a formula in which a spring's `own` length or angle stands."""

    def __init__(self, own: str, table: type[_SpringTable], dimension: Dimension) -> None:
        self._own, self._table, self._dimension = own, table, dimension

    def read(self, value: object) -> Expression:
        """Read a formula; raise pydantic's error if it is none."""
        if isinstance(value, Expression):
            return value
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            value = repr(value)
        if not isinstance(value, str):
            refuse(f"expected a table or a formula of '{self._own}', got {value!r}")
        try:
            found = parse_expression(value, self._own)
        except ExpressionError as error:
            refuse(f"'{value}': {error.message}", error.hint or NEEDS_QUOTES * is_cut(value))
        if any(one.of for one in found.sensed) or any(x.text == "t" for x in tokens_of(value)):
            hint = "a drive of type force or torque may be of time and state"
            refuse(f"'{value}': may be of '{self._own}' alone", hint)
        if found.powers not in (None, self._dimension.powers._replace(rad=0)):
            wanted = self._dimension
            refuse(f"expected {wanted.words}, got {in_words(found.powers)}: '{value}'", wanted.hint)
        return found

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        formula = core_schema.no_info_plain_validator_function(
            self.read, json_schema_input_schema=core_schema.str_schema()
        )
        choices = {TAG: formula, TAG + "table": handler.generate_schema(self._table)}
        return core_schema.tagged_union_schema(choices, discriminator=_branch)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        text, table = handler(schema)["oneOf"]
        return {"anyOf": [text, table], "$comment": f"a table, or a formula of '{self._own}'"}


def _branch(value: Any) -> str:
    return TAG + "table" if isinstance(value, (dict, _SpringTable)) else TAG
