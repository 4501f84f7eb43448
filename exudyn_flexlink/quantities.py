"""Numbers, and strings with a unit, to SI floats; pydantic types for every dimension of a scene."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, replace
from functools import partial
from typing import Annotated, Any, NoReturn

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from exudyn_flexlink.units import DOTS, RAISED, Dimension, Measure, UnknownUnitError, find_unit
from exudyn_flexlink.yaml_reader import MINUS

LONGEST_TEXT = 60
LARGEST, SMALLEST = 1e20, 1e-30
"""Limits of what is read, in SI: products of some such numbers (E b h^3 / l) are still numbers."""
WEIGHTLESS = "what shall hardly weigh anything has a thousandth of what it moves"
NUMBER = rf"[-+{MINUS}]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+{MINUS}]?[0-9]+)?(?![0-9])"
UNIT = rf"(?:/ ?(?=[A-Za-z])|[A-Za-zµμΩ°1])[A-Za-z0-9µμΩ°*{DOTS}{RAISED}/^.+\-{MINUS} ()]*"
_QUANTITY = re.compile(rf"\s*({NUMBER})\s*({UNIT})")
_IS_NUMBER = re.compile(rf"\s*{NUMBER}\s*")


def refuse(message: str, hint: str = "", at: str | tuple[str | int, ...] = ()) -> NoReturn:
    """Raise, inside a validator, a mistake of the key `at` (default: of the part as a whole)."""
    path = (at,) if isinstance(at, str) else at
    context = {"message": message, "hint": hint, "at": path}
    raise PydanticCustomError("mistake", "{message}", context)


def to_si(value: object, dimension: Measure, words: tuple[str, ...] = ()) -> float:
    """Read `value`, a number in SI or a string such as '5 mm', as a float in SI.

    Messages name the `words` that may stand in its place, too.

    Raises:
        PydanticCustomError: it is no number, not finite, beyond all bounds, of an unknown unit or
            of another dimension.

    """
    expected = f"expected {', '.join(words)} or {dimension.words}" if words else ""
    expected = expected or f"expected {dimension.words}"
    if isinstance(value, str):
        number = _from_text(value, dimension, expected)
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        number = _as_float(value)
    else:
        refuse(f"{expected}, got {in_words(value)}", dimension.hint)
    if not math.isfinite(number):
        refuse(f"must be a finite number, got {in_words(value)}", dimension.hint)
    if abs(number) > LARGEST:
        refuse(f"must not exceed {LARGEST:g} in SI units, got {in_words(value)}")
    return number


def in_words(value: object) -> str:  # noqa: PLR0911  (one case a line)
    """Write a value as a message shows it: short, and in the words of YAML."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
    if isinstance(value, Mapping):
        return "a mapping"
    if isinstance(value, (list, tuple)):
        return f"a list of {len(value)}"
    if isinstance(value, int) and abs(value) > 10**20:
        return "a very large number"
    text = f"'{value}'" if isinstance(value, str) else str(value)
    return text if len(text) <= LONGEST_TEXT else text[: LONGEST_TEXT - 4] + "...'"


def _as_float(value: float) -> float:
    try:
        return float(value)
    except OverflowError:
        return math.inf


def _from_text(text: str, dimension: Measure, expected: str) -> float:
    if _IS_NUMBER.fullmatch(text):
        refuse(f"{expected}, got the text '{text.strip()}'", "a number without quotes")
    match = _QUANTITY.fullmatch(text) if len(text) <= LONGEST_TEXT else None
    wrong = f"{expected}, got {in_words(text)}"
    if not match or dimension is Dimension.NUMBER:
        refuse(wrong, dimension.hint)
    try:
        unit = find_unit(match[2], dimension)
    except UnknownUnitError as error:
        refuse(str(error))
    if not dimension.accepts(unit.powers):
        hint = dimension.hint
        if dimension is Dimension.ANGULAR_SPEED and unit.powers == Dimension.FREQUENCY.powers:
            hint = "say which angle a second turns: rad/s, deg/s, turn/s or rpm"
        refuse(wrong, hint)
    return float(match[1].replace(MINUS, "-")) * unit.factor


@dataclass(frozen=True)
class Quantity:
    """Annotation of a float in SI that may be written with a unit, with its limits.

    `words` are texts accepted as they are, beside the quantity.
    """

    dimension: Measure
    _: KW_ONLY
    above: float | None = None
    at_least: float | None = None
    at_most: float | None = None
    words: tuple[str, ...] = ()

    def read(self, value: object) -> float | str:
        """Return the value in SI; raise pydantic's error if it is not within the limits."""
        if isinstance(value, str) and value in self.words:
            return value
        number = to_si(value, self.dimension, self.words)
        if self.above is not None and number <= self.above:
            hint = WEIGHTLESS if self.dimension is Dimension.MASS and number == 0 else ""
            refuse(f"must be greater than {self.above:g}", hint)
        if self.above == 0 and number < SMALLEST:
            refuse(f"must be {SMALLEST:g} or greater in SI units")
        if self.at_least is not None and number < self.at_least:
            refuse(f"must be {self.at_least:g} or greater")
        if self.at_most is not None and number > self.at_most:
            refuse(f"must be {self.at_most:g} or less")
        return number

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        number: dict[str, Any] = {"type": "number"}
        limits = {"exclusiveMinimum": self.above, "minimum": self.at_least, "maximum": self.at_most}
        number.update({key: limit for key, limit in limits.items() if limit is not None})
        if self.dimension is Dimension.NUMBER:
            return number
        forms = [number, {"type": "string", "pattern": rf"^\s*{NUMBER}\s*{UNIT}$"}]
        if self.words:
            forms.append({"enum": list(self.words)})
        name = self.dimension.words.split(" ", 1)[1]
        unit = f"{name}; {self.dimension.si} or e.g. '{self.dimension.example}'"
        # A field's own description replaces this one, the comment stays.
        return {"anyOf": forms, "description": unit, "$comment": unit}


class StiffnessOfPower(Quantity):
    """Annotation of K in K d^n, in N/m^n; n is the key `exponent` of its part, declared before."""

    def beside(self, exponent: float | None) -> Quantity:
        """Return what it is beside an exponent, or beside none."""
        return replace(self, dimension=Measure.stiffness(exponent or HERTZ))

    def _read_beside(self, value: object, info: ValidationInfo) -> float | str:
        if "exponent" not in info.data:  # which has a mistake of its own
            return math.nan
        return self.beside(info.data["exponent"]).read(value)

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(self._read_beside)


HERTZ = 1.5
"""Exponent of spheres, and of a law that gives none."""
_ANY_POWER = Measure("a stiffness", "N/m^n", "1e7 N/m^1.5", Measure.stiffness(HERTZ).powers)
PowerStiffness = Annotated[float, StiffnessOfPower(_ANY_POWER, above=0.0)]
Number = partial(Quantity, Dimension.NUMBER)
"""Annotation of a number without a unit, with its limits."""
Coordinate = Annotated[float, Quantity(Dimension.LENGTH)]
PositiveLength = Annotated[float, Quantity(Dimension.LENGTH, above=0.0)]
NonNegativeLength = Annotated[float, Quantity(Dimension.LENGTH, at_least=0.0)]
Angle = Annotated[float, Quantity(Dimension.ANGLE)]
Ratio = Annotated[float, Quantity(Dimension.NUMBER)]
PositiveDuration = Annotated[float, Quantity(Dimension.TIME, above=0.0)]
NonNegativeDuration = Annotated[float, Quantity(Dimension.TIME, at_least=0.0)]
PositiveFrequency = Annotated[float, Quantity(Dimension.FREQUENCY, above=0.0)]
PositiveMass = Annotated[float, Quantity(Dimension.MASS, above=0.0)]
PositiveDensity = Annotated[float, Quantity(Dimension.DENSITY, above=0.0)]
PositivePressure = Annotated[float, Quantity(Dimension.PRESSURE, above=0.0)]
Force = Annotated[float, Quantity(Dimension.FORCE)]
Torque = Annotated[float, Quantity(Dimension.TORQUE)]
NonNegativeForce = Annotated[float, Quantity(Dimension.FORCE, at_least=0.0)]
NonNegativeTorque = Annotated[float, Quantity(Dimension.TORQUE, at_least=0.0)]
PositiveStiffness = Annotated[float, Quantity(Dimension.STIFFNESS, above=0.0)]
NonNegativeStiffness = Annotated[float, Quantity(Dimension.STIFFNESS, at_least=0.0)]
NonNegativeDamping = Annotated[float, Quantity(Dimension.DAMPING, at_least=0.0)]
NonNegativeTorsionalStiffness = Annotated[
    float, Quantity(Dimension.TORSIONAL_STIFFNESS, at_least=0.0)
]
PositiveTorsionalStiffness = Annotated[float, Quantity(Dimension.TORSIONAL_STIFFNESS, above=0.0)]
NonNegativeTorsionalDamping = Annotated[float, Quantity(Dimension.TORSIONAL_DAMPING, at_least=0.0)]
AngularSpeed = Annotated[float, Quantity(Dimension.ANGULAR_SPEED)]
PositiveAngularSpeed = Annotated[float, Quantity(Dimension.ANGULAR_SPEED, above=0.0)]
Speed = Annotated[float, Quantity(Dimension.SPEED)]
PositiveSpeed = Annotated[float, Quantity(Dimension.SPEED, above=0.0)]
Acceleration = Annotated[float, Quantity(Dimension.ACCELERATION)]
NonNegativeInertia = Annotated[float, Quantity(Dimension.INERTIA, at_least=0.0)]
PositiveArea = Annotated[float, Quantity(Dimension.AREA, above=0.0)]
PositiveSecondMoment = Annotated[float, Quantity(Dimension.SECOND_MOMENT, above=0.0)]
