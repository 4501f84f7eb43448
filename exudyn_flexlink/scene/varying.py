"""Values that vary: a number, an expression, or a table; by time, or by a spring's own length."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from contextlib import suppress
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal, TypeAlias

from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler, model_validator
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from exudyn_flexlink import quantities as si
from exudyn_flexlink.expressions import (
    Expression,
    ExpressionError,
    in_words,
    looks_like_expression,
    parse_expression,
    tokens_of,
)
from exudyn_flexlink.quantities import Dimension
from exudyn_flexlink.scene.base import NEEDS_QUOTES, TAG, Part, Text, is_cut, listed, refuse


class _Rows(Part):
    """A table of rows that increase; those of a file are not there yet."""

    increasing: ClassVar[str] = "must increase from row to row"

    @model_validator(mode="after")
    def _has_rows(self) -> _Rows:
        rows: tuple[tuple[float, float], ...] | None = getattr(self, "points", None)
        if rows is None:
            return self
        if len(rows) < 2:
            refuse("a table needs at least 2 rows", at="points")
        for i, ((before, _), (after, _)) in enumerate(pairwise(rows), start=1):
            if after <= before:
                refuse(self.increasing, at=("points", i))
        return self


Row = Annotated[
    tuple[Annotated[float, si.Quantity(Dimension.TIME)], Annotated[float, si.Number()]],
    listed("time", "value"),
]


class Table(_Rows):
    """Values by time, given here or in a CSV file, and how they go on between its rows."""

    one_of = (("points", "file"),)
    increasing = "times must increase from row to row"
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
    def _has_the_start(self) -> Table:
        if self.points is not None and self.points[0][0] > 0:
            refuse("must begin at time 0 or before", at=("points", 0))
        return self


class _SpringTable(_Rows):
    one_of = (("points", "file"),)
    file: Text | None = Field(
        None, description="CSV file of the same, in the model's folder; a header may name units"
    )
    rule: Literal["linear", "cubic"] = Field(
        "linear", description="between rows: linear: straight; cubic: a smooth spline"
    )


class ForceTable(_SpringTable):
    """Forces of a spring by its length."""

    columns: ClassVar = {"length": (Dimension.LENGTH,), "force": (Dimension.FORCE,)}
    points: (
        tuple[Annotated[tuple[si.Coordinate, si.Force], listed("length", "force")], ...] | None
    ) = Field(
        None, description="[[length, force], ...], by length; the run ends where it leaves them"
    )


class TorqueTable(_SpringTable):
    """Torques of a spring by its angle."""

    columns: ClassVar = {"angle": (Dimension.ANGLE,), "torque": (Dimension.TORQUE,)}
    points: tuple[Annotated[tuple[si.Angle, si.Torque], listed("angle", "torque")], ...] | None = (
        Field(
            None, description="[[angle, torque], ...], by angle; the run ends where it leaves them"
        )
    )


Value: TypeAlias = float | Expression | Table
ForceLaw: TypeAlias = Expression | ForceTable
TorqueLaw: TypeAlias = Expression | TorqueTable
OF_SPRINGS = {"force": ForceTable.columns, "torque": TorqueTable.columns}
"""Columns of tables of springs, by the key at which they stand."""


OF_DRIVES = {
    "speed": (Dimension.ANGULAR_SPEED, Dimension.SPEED),
    "motion": (Dimension.ANGLE, Dimension.LENGTH),
    "torque": (Dimension.TORQUE,),
    "force": (Dimension.FORCE,),
}
"""What drives give, by their type; of two at a revolute joint, and at any other."""


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


class _OrTable(ABC):
    """Annotation of a number or a text, which it reads, or of a table; `told` is for editors."""

    def __init__(self, table: type[_Rows], told: str) -> None:
        self._table, self._told = table, told

    @abstractmethod
    def read(self, value: object) -> Any:
        """Return what a number or a text means; raise pydantic's error if it means nothing."""

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        text = core_schema.no_info_plain_validator_function(
            self.read, json_schema_input_schema=core_schema.str_schema()
        )
        choices = {TAG: text, TAG + "table": handler.generate_schema(self._table)}
        return core_schema.tagged_union_schema(choices, discriminator=_branch)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        text, table = handler(schema)["oneOf"]
        return {"anyOf": [{"type": "number"}, text, table], "$comment": self._told}


def _branch(value: Any) -> str:
    return TAG + "table" if isinstance(value, (Mapping, _Rows)) else TAG


def _parsed(
    text: str, dimensions: Sequence[Dimension], own: str = ""
) -> tuple[Expression, Dimension]:
    """Read an expression, and tell which of the dimensions it has: the first if it is a number."""
    try:
        found = parse_expression(text, own)
    except ExpressionError as error:
        refuse(f"'{text}': {error.message}", error.hint or NEEDS_QUOTES * is_cut(text))
    fits = [one for one in dimensions if found.powers in (None, one.powers._replace(rad=0))]
    if not fits:
        assert found.powers is not None
        wanted = dimensions[0]
        refuse(f"expected {wanted.words}, got {in_words(found.powers)}: '{text}'", wanted.hint)
    return found, fits[0]


class Varying(_OrTable):
    """Annotation of a value of a dimension that may be an expression or a table.

    An expression without t and state is a number.
    """

    def __init__(self, *dimensions: Dimension) -> None:
        """More than one where another part, such as a joint, tells which is meant."""
        ways = [
            f"{own.words.split(' ', 1)[1]}; {own.si}, e.g. '{own.example}'" for own in dimensions
        ]
        super().__init__(Table, f"{' or '.join(ways)}, or an expression or a table")
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
                    return Measured(other, float(si.Quantity(other).read(value)))
        number = float(si.Quantity(self.dimensions[0]).read(value))
        if isinstance(value, str) and len(self.dimensions) > 1:
            return Measured(self.dimensions[0], number)
        return number

    def _expression(self, text: str) -> float | Expression:
        found, wanted = _parsed(text, self.dimensions)
        if found.constant is None:
            return found
        number = float(si.Quantity(wanted).read(found.constant))
        several = found.powers is not None and len(self.dimensions) > 1
        return Measured(wanted, number) if several else number


class ByOwn(_OrTable):
    """Annotation of a table, or of a formula in which a spring's `own` length or angle stands."""

    def __init__(self, own: str, table: type[_SpringTable], dimension: Dimension) -> None:
        super().__init__(table, f"a table, or a formula of '{own}'")
        self._own, self._dimension = own, dimension

    def read(self, value: object) -> Expression:
        """Read a formula; raise pydantic's error if it is none."""
        if isinstance(value, Expression):
            return value
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            si.to_si(value, self._dimension)  # which refuses what is not finite
            value = repr(value)
        if not isinstance(value, str):
            refuse(f"expected a table or a formula of '{self._own}', got {si.in_words(value)}")
        found, _ = _parsed(value, [self._dimension], self._own)
        if any(one.of for one in found.sensed) or any(x.text == "t" for x in tokens_of(value)):
            hint = "a drive of type force or torque may be of time and state"
            refuse(f"'{value}': may be of '{self._own}' alone", hint)
        return found


def _is_meant_as_one(text: str) -> bool:
    """Tell whether a text is an expression, or fails as one and not as a number with a unit."""
    if looks_like_expression(text):
        return True
    single = re.fullmatch(rf"\s*(?:{si.NUMBER}\s*(?:{si.UNIT})?)?\s*", text)
    return single is None or any(mark in text for mark in ("(", "**", " + ", " - "))
