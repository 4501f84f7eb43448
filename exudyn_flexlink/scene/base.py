"""What the parts of a scene share: frozen models, read-only mappings, unions by `type`, names.

The field of a key declares what the key refers to. The class declares which keys exclude each
other.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from inspect import isclass
from typing import Annotated, Any, ClassVar, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, Field, GetCoreSchemaHandler, Strict, model_validator
from pydantic.functional_serializers import PlainSerializer
from pydantic.functional_validators import AfterValidator, BeforeValidator
from pydantic_core import CoreSchema, core_schema

from exudyn_flexlink.expressions import Expression, ExpressionError, parse_expression
from exudyn_flexlink.quantities import Coordinate, in_words, refuse

GROUND = "ground"
TAG = "\0"  # marks a union's branch in pydantic's error location; no YAML text can contain it

Value = TypeVar("Value")


class Part(BaseModel):
    """A named or nested part of a scene: frozen; it refuses unknown keys.

    One key of each row of `one_of` must be given, and at most one of each row of `at_most_one`.
    `belonging` has the keys that are allowed only beside a certain key of `one_of`.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)
    one_of: ClassVar[tuple[tuple[str, ...], ...]] = ()
    at_most_one: ClassVar[tuple[tuple[str, ...], ...]] = ()
    belonging: ClassVar[Mapping[str, tuple[str, ...]]] = {}

    @classmethod
    def excluded_by(cls, key: str) -> tuple[str, ...]:
        """Return the keys that can't stand beside this one."""
        rows = [row for row in (*cls.one_of, *cls.at_most_one) if key in row]
        others = [other for row in rows for other in row if other != key]
        return tuple(name for other in others for name in (other, *cls.belonging.get(other, ())))

    @model_validator(mode="before")
    @classmethod
    def _without_nothing(cls, data: Any) -> Any:
        """Drop optional keys without a value, such as empty sections."""
        if not isinstance(data, Mapping):
            return data
        optional = {
            name
            for key, field in cls.model_fields.items()
            if not field.is_required()
            for name in (key, field.alias)
        }
        return {
            key: value for key, value in data.items() if value is not None or key not in optional
        }

    @model_validator(mode="after")
    def _keys_that_exclude_each_other(self) -> Part:
        for row in (*self.one_of, *self.at_most_one):
            given = [key for key in row if getattr(self, key) is not None]
            if len(given) > 1:
                message = f"'{given[0]}' and '{given[1]}' exclude each other; give one of them"
                refuse(message, at=given[1])
            if row in self.one_of and not given:
                refuse("needs " + " or ".join(f"'{key}'" for key in row))
            for key in self.excluded_by(given[0]) if given else ():
                if getattr(self, key) is not None:
                    owner = next(other for other in row if key in self.belonging.get(other, ()))
                    refuse(f"'{key}' belongs to '{owner}', not to '{given[0]}'", at=key)
        return self


class FrozenMapping(Mapping[str, Value]):
    """A read-only mapping in the order of the file; unlike `MappingProxyType` it can be pickled."""

    __slots__ = ("_items",)

    def __init__(self, items: Mapping[str, Value] | None = None) -> None:
        self._items = dict(items or {})

    def __getitem__(self, name: str) -> Value:
        return self._items[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)

    def __hash__(self) -> int:
        return hash(frozenset(self._items.items()))

    def __repr__(self) -> str:
        return repr(self._items)


Named = Annotated[Mapping[str, Value], AfterValidator(FrozenMapping), PlainSerializer(dict)]
"""A read-only mapping from names to parts."""


def by_name(description: str) -> Any:
    """Return the field of an optional mapping from names, which is empty by default."""
    return Field(default_factory=FrozenMapping, description=description)


class ByType:
    """Annotation of a union of parts: the key `type` picks the class, a string may be a name.

    `default` is the type if the key is left out.
    """

    def __init__(self, default: str = "") -> None:
        self.default = default

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        choices: dict[str, CoreSchema] = {}
        for branch in get_args(source) or (source,):
            named = not (isclass(branch) and issubclass(branch, Part))  # an annotated text
            schema = handler.generate_schema(branch)
            choices |= {TAG + tag: schema for tag in ([""] if named else types_of(branch))}
        return core_schema.tagged_union_schema(choices, discriminator=self._tag)

    def _tag(self, value: Any) -> str | None:
        if isinstance(value, str):
            return TAG
        if isinstance(value, Part):
            return TAG + str(getattr(value, "type", ""))
        if isinstance(value, Mapping):
            given = value.get("type")
            return TAG + str((self.default or TAG) if given is None else given)
        return None


def types_of(part: type[Part]) -> tuple[str, ...]:
    """Return the values of the key `type` that mean this class; `""` if it has no such key."""
    field = part.model_fields.get("type")
    return get_args(field.annotation) if field else ("",)


def refuse_place(what: str, points: tuple[str, str], at: tuple[float, float] | None) -> None:
    """Refuse a joint or spring whose place on the ground is missing, or is given needlessly."""
    if points == (GROUND, GROUND):
        refuse("joins the ground to itself", at="points")
    if GROUND in points and at is None:
        refuse("missing 'at'", f"where the {what} sits on the ground, e.g. at: [0.02, 0]")
    if GROUND not in points and at is not None:
        refuse(f"only a {what} with the ground has a fixed place", at="at")


def split_point(text: str) -> tuple[str, str]:
    """`"link.end"` -> `("link", "end")`; `"ground"` -> `("ground", "")`.

    Raises:
        ValueError: the text is neither.

    """
    if text == GROUND:
        return GROUND, ""
    body, dot, point = text.partition(".")
    if not (body and dot and point) or "." in point or body == GROUND:
        raise ValueError(f"expected a point such as 'link.end', or 'ground'; got '{text}'")
    return body, point


def _is_point(text: str) -> str:
    try:
        split_point(text)
    except ValueError as error:
        refuse(str(error))
    return text


def _is_moving_point(text: str) -> str:
    if text == GROUND or _is_point(text) != text:
        refuse("must be a point of a body, not 'ground'", "written as 'body.point'")
    return text


def listed(*entries: str) -> BeforeValidator:
    """Refuse a value that is no list of these entries; the message shows the list's form."""

    def check(value: Any) -> Any:
        if not isinstance(value, list | tuple) or len(value) != len(entries):
            pieces = value if isinstance(value, list) else []
            hint = NEEDS_QUOTES if any(map(is_cut, pieces)) else ""
            refuse(f"expected [{', '.join(entries)}], got {in_words(value)}", hint)
        return value

    return BeforeValidator(check)


NEEDS_QUOTES = 'YAML ends a value at a comma: an expression with commas needs quotes, "min(a, b)"'


def is_cut(text: Any) -> bool:
    """Whether this is the first piece of an expression that YAML split at its commas."""
    return isinstance(text, str) and text.count("(") > text.count(")")


@dataclass(frozen=True)
class Refers:
    """Annotation of a text, or of a mapping's names: they name parts of a `section`.

    The section may also be ``points``, or ``frames``: bodies and the ground. `kinds` are the types
    of joints that are allowed, and `words` name these types in messages. A sleeve may have a
    clearance only if `play` is true. `to_slides` is the hint if the named joint slides.
    """

    section: str
    words: str = ""
    kinds: tuple[str, ...] = ()
    play: bool = False
    to_slides: str = ""


Flag = Annotated[bool, Strict()]
Text = Annotated[str, Strict()]
Name = Annotated[str, Strict()]
"""The name of another part of the scene."""
MaterialName = Annotated[str, Strict(), Refers("materials")]
CurveName = Annotated[str, Strict(), Refers("curves")]
BodyName = Annotated[str, Strict(), Refers("bodies")]
REVOLUTE = Refers("joints", "a revolute joint", ("revolute",))
SLIDING = Refers("joints", "a prismatic joint, or a sleeve", ("prismatic", "sleeve"))
DRIVEN = Refers(
    "joints", "a revolute or prismatic joint, or a sleeve", ("revolute", *SLIDING.kinds)
)
HOLDING = Refers(
    "joints", "a joint of two points, or a slot", ("revolute", "prismatic", "weld", "slot")
)
PointName = Annotated[
    str,
    Strict(),
    AfterValidator(_is_point),
    Refers("points"),
    Field(description="'body.point', or 'ground'"),
]
MovingPointName = Annotated[
    str,
    Strict(),
    AfterValidator(_is_moving_point),
    Refers("points"),
    Field(description="'body.point'"),
]
XY = listed("x", "y")
TwoPoints = Annotated[tuple[PointName, PointName], listed("body.point", "body.point")]
Point = Annotated[tuple[Coordinate, Coordinate], XY, Field(description="[x, y], metres")]


class ByForm:
    """Annotation of a union of a name and a list: the form of the value tells which it is."""

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        name, place = map(handler.generate_schema, get_args(source))
        choices = {TAG: name, TAG + "list": place}
        return core_schema.tagged_union_schema(choices, discriminator=_form)


def _form(value: Any) -> str:
    return TAG + "list" if isinstance(value, (list, tuple)) else TAG


OverPoint = Annotated[MovingPointName | Point, ByForm()]
"""A point of a body, or a place on the ground."""


class Condition:
    """Annotation of a formula of time, state and forces in joints, of any dimension."""

    def read(self, value: object) -> Expression:
        """Read a formula; raise pydantic's error if it is none."""
        if isinstance(value, Expression):
            return value
        if not isinstance(value, str):
            refuse(f"expected a formula, got {in_words(value)}", "e.g. 'angle(crank) - 90 deg'")
        try:
            formula = parse_expression(value, with_forces=True)
        except ExpressionError as error:
            refuse(f"'{value}': {error.message}", error.hint or NEEDS_QUOTES * is_cut(value))
        if formula.constant is not None:
            refuse(f"'{value}' never changes", "a formula of time and state that rises through 0")
        return formula

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(
            self.read, json_schema_input_schema=core_schema.str_schema()
        )
