"""Springs and drives, which act on joints and bodies, and their values that vary.

A value is a number, an expression, or a table. It varies with time, or with a spring's length and
the rate of that.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal, TypeAlias

from pydantic import (
    BeforeValidator,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    model_validator,
)
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from exudyn_flexlink import quantities as si
from exudyn_flexlink.expressions import (
    RATE,
    Expression,
    ExpressionError,
    in_words,
    looks_like_expression,
    parse_expression,
    tokens_of,
)
from exudyn_flexlink.quantities import Dimension, Measured
from exudyn_flexlink.scene.base import (
    DRIVEN,
    GROUND,
    NEEDS_QUOTES,
    REVOLUTE,
    TAG,
    XY,
    ByType,
    MovingPointName,
    Name,
    OverPoint,
    Part,
    Point,
    Refers,
    Text,
    TwoPoints,
    is_cut,
    listed,
    refuse,
    refuse_place,
)


class _Rows(Part):
    """A table of rows that increase; rows of a file are read later."""

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
SPRING_COLUMNS = {"force": ForceTable.columns, "torque": TorqueTable.columns}
"""Columns of tables of springs, by the key that has the table."""


DRIVE_DIMENSIONS = {
    "speed": (Dimension.ANGULAR_SPEED, Dimension.SPEED),
    "motion": (Dimension.ANGLE, Dimension.LENGTH),
    "torque": (Dimension.TORQUE,),
    "force": (Dimension.FORCE,),
}
"""Dimensions of a drive's value by its type. Of two, the first is for revolute joints."""


class _OrTable(ABC):
    """Annotation of a number or text, which it reads, or of a table; `comment` is for editors."""

    def __init__(self, table: type[_Rows], comment: str) -> None:
        self._table, self._comment = table, comment

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
        return {"anyOf": [{"type": "number"}, text, table], "$comment": self._comment}


def _branch(value: Any) -> str:
    return TAG + "table" if isinstance(value, (Mapping, _Rows)) else TAG


def _parsed(
    text: str, dimensions: Sequence[Dimension], words: Sequence[str] = ()
) -> tuple[Expression, Dimension]:
    """Read an expression and tell which dimension it has; a number has the first one."""
    try:
        formula = parse_expression(text, words)
    except ExpressionError as error:
        refuse(f"'{text}': {error.message}", error.hint or NEEDS_QUOTES * is_cut(text))
    fits = [
        dimension
        for dimension in dimensions
        if formula.powers in (None, dimension.powers._replace(rad=0))
    ]
    if not fits:
        assert formula.powers is not None
        wanted = dimensions[0]
        refuse(f"expected {wanted.words}, got {in_words(formula.powers)}: '{text}'", wanted.hint)
    return formula, fits[0]


def without_rate(formula: Expression) -> Expression:
    """Return a spring's formula with 0 in place of its rate; unchanged if it has no rate."""
    words = [sensed.kind for sensed in formula.sensed]
    return parse_expression(re.sub(rf"\b{RATE}\b", "0", formula.text), words)


class Varying(_OrTable):
    """Annotation of a value of a dimension that may be an expression or a table.

    An expression without t and state is a number.
    """

    def __init__(self, *dimensions: Dimension) -> None:
        """Take several dimensions if another part, such as a joint, decides between them."""
        ways = [
            f"{dimension.words.split(' ', 1)[1]}; {dimension.si}, e.g. '{dimension.example}'"
            for dimension in dimensions
        ]
        super().__init__(Table, f"{' or '.join(ways)}, or an expression or a table")
        self.dimensions = dimensions

    def read(self, value: object) -> float | Expression:
        """Return a number in SI or an expression; raise pydantic's error if it is neither."""
        if isinstance(value, Expression):
            return value
        if isinstance(value, str) and _is_meant_as_expression(value):
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
        formula, wanted = _parsed(text, self.dimensions)
        if formula.constant is None:
            return formula
        number = float(si.Quantity(wanted).read(formula.constant))
        several = formula.powers is not None and len(self.dimensions) > 1
        return Measured(wanted, number) if several else number


class TableOrFormula(_OrTable):
    """Annotation of a table, or of a formula of a spring's length or angle, and its rate."""

    def __init__(self, variable: str, table: type[_SpringTable], dimension: Dimension) -> None:
        self._words, self._dimension = (variable, RATE), dimension
        self._variables = f"'{variable}' and '{RATE}'"
        super().__init__(table, f"a table, or a formula of {self._variables}")

    def read(self, value: object) -> Expression:
        """Read a formula; raise pydantic's error if it is none."""
        if isinstance(value, Expression):
            return value
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            si.to_si(value, self._dimension)  # refuses a number that is not finite
            value = repr(value)
        if not isinstance(value, str):
            refuse(f"expected a table or a formula of {self._variables}, got {si.in_words(value)}")
        formula, _ = _parsed(value, [self._dimension], self._words)
        if any(sense.of for sense in formula.sensed) or any(
            x.text == "t" for x in tokens_of(value)
        ):
            hint = "a drive of type force or torque may be of time and state"
            refuse(f"'{value}': may be of {self._variables} alone", hint)
        return formula


def _is_meant_as_expression(text: str) -> bool:
    """Tell whether a text is an expression, or a wrong expression, not a wrong quantity."""
    if looks_like_expression(text):
        return True
    single = re.fullmatch(rf"\s*(?:{si.NUMBER}\s*(?:{si.UNIT})?)?\s*", text)
    return single is None or any(mark in text for mark in ("(", "**", " + ", " - "))


def _as_vector(value: Any) -> Any:
    """Turn a single value into a vector that points down, along -y."""
    return value if isinstance(value, (list, tuple, Mapping)) else (0.0, -float(_DOWN.read(value)))


_DOWN = si.Quantity(Dimension.ACCELERATION)
_Vector = tuple[si.Acceleration, si.Acceleration]
Gravity = Annotated[
    _Vector, XY, BeforeValidator(_as_vector, json_schema_input_type=si.Acceleration | _Vector)
]
"""Acceleration of weight, [x, y] in m/s^2."""


class TorsionalSpring(Part):
    """A spring, a damper or both, that act on the angle of a revolute joint."""

    at_most_one = (("stiffness", "frequency", "torque"), ("damping", "damping_ratio"))
    type: Literal["torsional"] = "torsional"
    joint: Annotated[Name, REVOLUTE] = Field(description="name of a revolute joint")
    stiffness: si.NonNegativeTorsionalStiffness | None = Field(
        None, description="torque per angle; or 'frequency'; neither: a damper alone"
    )
    frequency: si.PositiveFrequency | None = Field(
        None,
        description="undamped frequency of the body about its grounded joint, with what is welded "
        "to it; or 'stiffness'",
    )
    torque: Annotated[TorqueLaw, TableOrFormula("angle", TorqueTable, Dimension.TORQUE)] | None = (
        Field(
            None,
            description="in place of a stiffness: a table of torques by angle, or a formula of "
            "'angle' and 'rate', its speed; positive: it turns the second body back, clockwise",
        )
    )
    damping: si.NonNegativeTorsionalDamping | None = Field(
        None, description="torque per angular speed; or 'damping_ratio'"
    )
    damping_ratio: Annotated[float, si.Number(at_least=0.0)] | None = Field(
        None, description="part of critical damping; or 'damping'"
    )
    rest_angle: si.Angle | None = Field(
        None, description="angle of the joint at which it has no torque; left out: as assembled"
    )

    @model_validator(mode="after")
    def _has_a_spring_or_a_damper(self) -> TorsionalSpring:
        stiff = self.stiffness, self.frequency, self.torque
        if all(value is None for value in (*stiff, self.damping)):
            refuse("needs 'stiffness', 'frequency', 'torque' or 'damping'")
        if self.torque is not None and self.damping_ratio is not None:
            refuse("needs a spring of one stiffness", "give 'damping'", at="damping_ratio")
        if self.torque is not None and self.rest_angle is not None:
            refuse("a table or a formula tells where it has none", "leave it out", at="rest_angle")
        if self.damping_ratio is not None and self.stiffness == 0:
            refuse("needs a spring: the stiffness is 0", "give 'damping'", at="damping_ratio")
        return self


class LinearSpring(Part):
    """A spring, a damper or both, between two points, or along a prismatic joint."""

    one_of = (("points", "joint"),)
    type: Literal["linear"] = "linear"
    points: TwoPoints | None = Field(
        None, description="two points 'body.point', of which one may be 'ground'; or 'joint'"
    )
    at: Point | None = Field(
        None, description="where the spring is held on the ground, [x, y], metres"
    )
    joint: Annotated[Name, Refers("joints", "a prismatic joint", ("prismatic",))] | None = Field(
        None, description="name of a prismatic joint; or 'points'"
    )
    stiffness: si.NonNegativeStiffness = Field(
        0.0, description="force per change of length; left out: a damper alone"
    )
    damping: si.NonNegativeDamping = Field(0.0, description="force per rate of that change")
    acts: Literal["both", "tension", "compression"] = Field(
        "both",
        description="tension: only where it is longer than 'length', as a rope; compression: only "
        "where it is shorter, as a buffer; its damper neither pushes in a rope nor pulls in a "
        "buffer",
    )
    preload: si.NonNegativeForce = Field(
        0.0, description="with 'acts': force with which it begins; left out: 0"
    )
    force: Annotated[ForceLaw, TableOrFormula("length", ForceTable, Dimension.FORCE)] | None = (
        Field(
            None,
            description="in place of a stiffness: a table of forces by length, or a formula of "
            "'length' and 'rate', how fast that grows; positive: it pulls both ends together",
        )
    )
    length: si.Coordinate | None = Field(
        None,
        description="length without force; along a joint that from its first point to its second, "
        "with a sign; left out: as assembled. With length 0 between points it pulls them together, "
        "and its damper acts in every direction",
    )

    @model_validator(mode="after")
    def _acts_on_one_side(self) -> LinearSpring:
        if self.acts == "both":
            if self.preload:
                refuse("needs 'acts': tension or compression", at="preload")
            return self
        what = "a rope" if self.acts == "tension" else "a buffer"
        if isinstance(self.force, Expression):
            refuse("acts on both sides", "take a table of 'force', or min and max", at="acts")
        if self.force is None and not self.stiffness:
            refuse(f"{what} needs a 'stiffness'")
        if self.length is None:
            refuse("missing 'length'", f"at which {what} begins to act")
        if isinstance(self.force, ForceTable) and self.length is not None:
            self._fits(self.force, self.length)
        if self.points is not None and self.length == 0:
            refuse(f"must be greater than 0 of {what} between points", at="length")
        return self

    def _fits(self, table: ForceTable, length: float) -> None:
        """Refuse a table that does not begin at the length, or extends to the wrong side of it."""
        rope = self.acts == "tension"
        if table.points is None:  # its file could not be read, which is reported elsewhere
            return
        edge = table.points[0 if rope else -1][0]
        if edge != length:
            key = "first" if rope else "last"
            refuse(f"its {key} row must be at 'length', {length:g} m", at=("force", "points"))
        if table.rule != "linear":
            refuse("a force of one side is 'linear' between rows", at=("force", "rule"))
        way = 1.0 if rope else -1.0
        for i, (_, force) in enumerate(table.points):
            if way * force < 0:
                what = "a rope can't push" if rope else "a buffer can't pull: its forces are < 0"
                refuse(what, at=("force", "points", i, 1))
        if not any(force for _, force in table.points):
            refuse("has no force at all", at=("force", "points"))
        if self.preload:
            refuse("a table says itself with which force it begins", at="preload")

    @model_validator(mode="after")
    def _has_a_force_and_a_place(self) -> LinearSpring:
        if self.force is not None and self.stiffness:
            refuse("'stiffness' and 'force' exclude each other; give one of them", at="force")
        if self.force is not None and self.acts == "both" and self.length is not None:
            refuse("a table or a formula tells where it has no force", "leave it out", at="length")
        if not {"stiffness", "damping", "force"} & self.model_fields_set:
            refuse("needs 'stiffness', 'damping' or 'force'")
        if self.points is None and self.at is not None:
            refuse("only a spring with the ground has a fixed place", at="at")
        if self.points is not None:
            refuse_place("spring", self.points, self.at)
            if self.points[0] == self.points[1]:
                refuse("needs two different points", at="points")
            if self.length is not None and self.length < 0:
                refuse("must be 0 or greater between two points", at="length")
        return self


class RopeSpring(Part):
    """A rope over points, with one tension along it: it slides over those between without friction.

    It pulls only where it is longer than its length, as does its damper.
    """

    # Keys of other springs, which a rope over points does not have.
    joint: ClassVar[None] = None
    points: ClassVar[None] = None
    force: ClassVar[None] = None
    torque: ClassVar[None] = None
    acts: ClassVar[str] = "tension"
    preload: ClassVar[float] = 0.0
    type: Literal["rope"]
    over: tuple[OverPoint, ...] = Field(
        min_length=2,
        description="where it runs along: points 'body.point', and places [x, y] on the ground; "
        "its ends are the first and the last",
    )
    stiffness: si.PositiveStiffness = Field(description="tension per stretch of the whole rope")
    damping: si.NonNegativeDamping = Field(0.0, description="tension per rate of that stretch")
    length: Annotated[float | Expression, Varying(Dimension.LENGTH)] | None = Field(
        None,
        description="length without tension: a number, or a formula of time, as of a winch; left "
        "out: as assembled",
    )

    @model_validator(mode="after")
    def _spans(self) -> RopeSpring:
        for i, (before, after) in enumerate(pairwise(self.over), start=1):
            if before == after:
                refuse("the same as the one before: a piece needs a length", at=("over", i))
        if not any(isinstance(entry, str) for entry in self.over):
            refuse("needs a point of a body: all places are on the ground", at="over")
        if isinstance(self.length, float) and self.length <= 0:
            refuse("must be greater than 0", at="length")
        if isinstance(self.length, Table):
            refuse("no table: a number, or a formula of time", at="length")
        _refuse_state(self.length, "length", "length")
        return self


class _Ramped(Part):
    """A drive whose value, a number, may be reached along a ramp."""

    @model_validator(mode="after")
    def _ramp_of_a_number(self) -> _Ramped:
        if getattr(self, "ramp", 0.0) and not isinstance(getattr(self, "value", 0.0), float):
            why = "an expression or a table says itself how it rises"
            refuse(f"a ramp belongs to a number: {why}", "leave the ramp out", at="ramp")
        return self


DRIVEN_JOINT = "name of a revolute or prismatic joint, or of a sleeve without clearance"


class SpeedDrive(_Ramped):
    """Prescribes the speed at which a joint turns or slides: its second body against its first."""

    type: Literal["speed"] = "speed"
    joint: Annotated[Name, DRIVEN] = Field(description=DRIVEN_JOINT)
    value: Annotated[Value, Varying(*DRIVE_DIMENSIONS["speed"])] = Field(
        description="counter-clockwise speed of the second body, or its speed along the line; of "
        "time alone"
    )
    ramp: si.NonNegativeDuration = Field(0.0, description="time from rest to the full speed")

    @model_validator(mode="after")
    def _of_time_alone(self) -> SpeedDrive:
        _refuse_state(self.value, "speed")
        if isinstance(self.value, Table) and self.value.rule == "step":
            refuse("a speed can't jump", "rule: linear or cubic", at=("value", "rule"))
        return self


class MotionDrive(Part):
    """Prescribes the angle of a joint, or its length: its second body against its first."""

    type: Literal["motion"] = "motion"
    joint: Annotated[Name, DRIVEN] = Field(description=DRIVEN_JOINT)
    value: Annotated[Value, Varying(*DRIVE_DIMENSIONS["motion"])] = Field(
        description="angle of the second body, counter-clockwise, or how far its point is along "
        "the line from the first; of time alone"
    )

    @model_validator(mode="after")
    def _of_time_alone(self) -> MotionDrive:
        _refuse_state(self.value, "motion")
        if isinstance(self.value, Table) and self.value.rule != "cubic":
            refuse("a motion's speed can't jump", "rule: cubic", at=("value", "rule"))
        return self


class TorqueDrive(_Ramped):
    """Applies a torque at a revolute joint: on its second body, back on its first. Several add."""

    type: Literal["torque"] = "torque"
    joint: Annotated[
        Name, replace(REVOLUTE, to_slides="along it pushes a drive of type force, at a point")
    ] = Field(description="name of a revolute joint")
    value: Annotated[Value, Varying(*DRIVE_DIMENSIONS["torque"])] = Field(
        description="counter-clockwise torque on the second body; of time and state"
    )
    ramp: si.NonNegativeDuration = Field(0.0, description="time from zero to the full torque")


ForceValue = Annotated[Value, Varying(*DRIVE_DIMENSIONS["force"])]


class ForceDrive(Part):
    """Applies a force at a point of a body."""

    type: Literal["force"] = "force"
    point: MovingPointName = Field(description="point 'body.point' at which the force acts")
    value: Annotated[tuple[ForceValue, ForceValue], XY] = Field(
        description="[x, y] along the axes, each of time and state"
    )
    axes: Annotated[Name, Refers("frames")] = Field(
        GROUND,
        description="'ground', or the body with whose axes the force turns; of a flexible body's "
        "own point, those of the rod there",
    )


def _refuse_state(value: Value | None, what: str, at: str = "value") -> None:
    if isinstance(value, Expression) and value.sensed:
        sensed = value.sensed[0]
        message = f"a {what} is of t alone; '{sensed.kind}({sensed.of})' belongs to the state"
        refuse(message, "a drive of type torque or force may depend on the state", at=at)


Spring = Annotated[TorsionalSpring | LinearSpring | RopeSpring, ByType()]
Drive = Annotated[SpeedDrive | MotionDrive | TorqueDrive | ForceDrive, ByType()]
