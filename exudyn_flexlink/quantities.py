"""Numbers, and strings with a unit, to SI floats; pydantic types for every dimension of a scene.

Dimensions of a scene's numbers, and their units. A unit is a product of powers of symbols; some
symbols may have a prefix.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, replace
from enum import Enum
from functools import partial
from typing import Annotated, Any, NamedTuple, NoReturn

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from exudyn_flexlink.source import MINUS


class Powers(NamedTuple):
    """A dimension as powers of the base units; radians count, so that rad/s is not Hz."""

    m: float = 0
    kg: float = 0
    s: float = 0
    rad: float = 0


_DIGITS = 9  # of powers: 1 - 1.1 is -0.1


class Measure:
    """A measured quantity: its name, its SI unit in words, an example, its powers."""

    def __init__(self, words: str, si: str, example: str, powers: Powers) -> None:
        self.words = words
        self.si = si
        self.example = example
        self.powers = powers

    @staticmethod
    def stiffness(exponent: float) -> Measure:
        """Return the measure of K in a force K d^exponent."""
        si = f"N/m^{exponent:g}"
        powers = Powers(m=round(1 - exponent, _DIGITS), kg=1, s=-2)
        return Measure(f"a stiffness of exponent {exponent:g}", si, f"1e7 {si}", powers)

    @property
    def hint(self) -> str:
        """How to write such a value."""
        return f"a number in {self.si}, or {self.words} such as '{self.example}'" if self.si else ""

    def accepts(self, powers: Powers) -> bool:
        """Whether a unit of these powers fits; torsion may be given without its '/rad'."""
        without_rad = self.powers._replace(rad=0)
        return powers == self.powers or (self.powers.rad < 0 and powers == without_rad)


class Dimension(Measure, Enum):
    """Measures that do not depend on another number."""

    LENGTH = ("a length", "metres", "5 mm", Powers(m=1))
    ANGLE = ("an angle", "radians", "90 deg", Powers(rad=1))
    TIME = ("a time", "seconds", "2 ms", Powers(s=1))
    FREQUENCY = ("a frequency", "Hz", "40 Hz", Powers(s=-1))
    MASS = ("a mass", "kg", "20 g", Powers(kg=1))
    DENSITY = ("a density", "kg/m^3", "7.85 g/cm^3", Powers(kg=1, m=-3))
    PRESSURE = ("a pressure", "Pa", "200 GPa", Powers(kg=1, m=-1, s=-2))
    FORCE = ("a force", "N", "5 kN", Powers(kg=1, m=1, s=-2))
    TORQUE = ("a torque", "N m", "5 N mm", Powers(kg=1, m=2, s=-2))
    STIFFNESS = ("a stiffness", "N/m", "20 N/mm", Powers(kg=1, s=-2))
    DAMPING = ("a damping", "N s/m", "3 N s/m", Powers(kg=1, s=-1))
    TORSIONAL_STIFFNESS = (
        "a torsional stiffness",
        "N m/rad",
        "0.5 N m/rad",
        Powers(kg=1, m=2, s=-2, rad=-1),
    )
    TORSIONAL_DAMPING = (
        "a torsional damping",
        "N m s/rad",
        "2e-5 N m s/rad",
        Powers(kg=1, m=2, s=-1, rad=-1),
    )
    ANGULAR_SPEED = ("an angular speed", "rad/s", "95 rpm", Powers(rad=1, s=-1))
    SPEED = ("a speed", "m/s", "5 mm/s", Powers(m=1, s=-1))
    ACCELERATION = ("an acceleration", "m/s^2", "9.81 m/s^2", Powers(m=1, s=-2))
    INERTIA = ("a moment of inertia", "kg m^2", "12 g cm^2", Powers(kg=1, m=2))
    AREA = ("an area", "m^2", "5 mm^2", Powers(m=2))
    SECOND_MOMENT = ("a second moment of area", "m^4", "0.1 mm^4", Powers(m=4))
    NUMBER = ("a number", "", "", Powers())


class Unit(NamedTuple):
    """A unit in terms of the SI's."""

    factor: float
    powers: Powers


class Symbol(NamedTuple):
    """A unit with its own name: `factor` times 10^`tens` in SI.

    `prefixes` are those that engineers use with it; others are slips, such as 'Mm' for 'mm'.
    """

    powers: Powers
    factor: float = 1.0
    tens: float = 0
    prefixes: str = ""


PREFIXES = {"p": -12, "n": -9, "u": -6, "m": -3, "c": -2, "d": -1, "k": 3, "M": 6, "G": 9}

_LENGTH, _MASS, _TIME, _ANGLE = (Dimension[n].powers for n in ("LENGTH", "MASS", "TIME", "ANGLE"))
_FORCE, _PRESSURE = Dimension.FORCE.powers, Dimension.PRESSURE.powers
_POUND = 0.45359237  # kg, and below 9.80665 m/s^2 and 0.0254 m: by definition
SYMBOLS: dict[str, Symbol] = {
    "m": Symbol(_LENGTH, prefixes="pnumcdk"),
    "in": Symbol(_LENGTH, 0.0254),
    "inch": Symbol(_LENGTH, 0.0254),
    "ft": Symbol(_LENGTH, 0.3048),
    "g": Symbol(_MASS, tens=-3, prefixes="numkM"),
    "t": Symbol(_MASS, tens=3),
    "lb": Symbol(_MASS, _POUND),
    "s": Symbol(_TIME, prefixes="num"),
    "min": Symbol(_TIME, 60),
    "h": Symbol(_TIME, 3600),
    "rad": Symbol(_ANGLE, prefixes="um"),
    "deg": Symbol(_ANGLE, math.pi / 180),
    "turn": Symbol(_ANGLE, 2 * math.pi),
    "rpm": Symbol(Dimension.ANGULAR_SPEED.powers, 2 * math.pi / 60),
    "Hz": Symbol(Dimension.FREQUENCY.powers, prefixes="mkMG"),
    "N": Symbol(_FORCE, prefixes="numckMG"),
    "daN": Symbol(_FORCE, tens=1),
    "kgf": Symbol(_FORCE, 9.80665),
    "lbf": Symbol(_FORCE, _POUND * 9.80665),
    "J": Symbol(Dimension.TORQUE.powers, prefixes="numkM"),
    "Pa": Symbol(_PRESSURE, prefixes="kMG"),
    "bar": Symbol(_PRESSURE, tens=5, prefixes="mk"),
    "psi": Symbol(_PRESSURE, _POUND * 9.80665 / 0.0254**2),
}
"""Units are products of powers of these."""
UNITS = {
    prefix + name: symbol._replace(tens=symbol.tens + PREFIXES.get(prefix, 0))
    for name, symbol in SYMBOLS.items()
    for prefix in ("", *symbol.prefixes)
}
"""The same with their prefixes. A test compares each with pint."""

USUAL = (
    *("m", "cm", "mm", "um", "nm", "km", "inch", "ft"),
    *("rad", "mrad", "deg", "turn"),
    *("s", "ms", "us", "ns", "min", "h", "Hz", "kHz", "MHz", "1/s"),
    *("kg", "g", "mg", "t", "lb", "kg/m^3", "g/cm^3", "kg/dm^3"),
    *("Pa", "kPa", "MPa", "GPa", "bar", "psi", "N/m^2", "N/mm^2"),
    *("N", "mN", "kN", "lbf", "N m", "N mm", "mN m", "kN m"),
    *("N/m", "N/mm", "kN/m", "N/um", "N m/rad", "N mm/rad", "mN m/rad", "N m/deg"),
    *("N s/m", "N s/mm", "kN s/m", "N m s/rad", "N mm s/rad", "rad/s", "deg/s", "rpm", "turn/s"),
    *("m/s", "cm/s", "mm/s", "m/s^2", "mm/s^2"),
    *("kg m^2", "g m^2", "g cm^2", "kg mm^2", "m^2", "cm^2", "mm^2", "m^4", "cm^4", "mm^4"),
)
"""Units in the lists of the documentation and in hints."""

SPELLINGS = {
    r"RPM|[Uu]pm|UPM": "rpm",
    r"U(?=\s*/\s*s\b)|(?:[Uur]|tr)(?=\s*/\s*min\b)": "turn",  # German, IEC 60034, French
    r"min[-\N{MINUS SIGN}]1(?![0-9])": "min^-1",
    r"revs?|turns|revolutions?": "turn",
    r"Grad|degrees?": "deg",  # 'Grad' is German and Swedish
    r"radians?": "rad",
    r"met(?:re|er)s?": "m",
    r"microns?": "um",
    r"msec": "ms",
    r"seconds?|secs?": "s",
    r"lbs": "lb",
}
"""Other spellings of units that have one meaning, also in files of numbers."""
DOTS = "·\N{DOT OPERATOR}\N{MULTIPLICATION SIGN}"  # between factors of a product
RAISED = "⁻⁰¹²³⁴"  # in exponents
_SIGNS = str.maketrans(f"{DOTS}µμ\N{MINUS SIGN}{RAISED}", "***uu--01234")
# Written in one word by every engineer.
_NEWTON_METRES = re.compile(r"(?<![A-Za-z])((?:da|[kMmuc])?N)(m|cm|mm)(s?)(?![A-Za-z])")
_TOKEN = re.compile(r"[A-Za-z]+|\^[-+]?[0-9](?:\.[0-9]{1,3})?(?![0-9.])|[/()]|1(?![0-9])")
MOST_TENS = 300  # a float holds no power of ten beyond


class UnknownUnitError(ValueError):
    """There is no such unit; the message says so, and names one that resembles it."""


class AmbiguousUnitError(UnknownUnitError):
    """A unit may mean one thing or another; the message names both, and what to write."""


def usual_units(dimension: Measure) -> list[str]:
    """Units in which a quantity is usually given."""
    return [name for name in USUAL if dimension.accepts(_unit(name).powers)]


def find_unit(text: str, wanted: Measure) -> Unit:
    """Look a unit up: products may be written 'N m', 'N*m', 'N·m', and 'Nm' is one of them.

    The text is read from left to right, so 'N/m s' is 'N s/m'. The unit may have another dimension
    than `wanted`. '1/min' is 'rpm' if an angular speed is wanted.

    Raises:
        AmbiguousUnitError: the unit is 'grad', or '1/min' where any number is wanted.
        UnknownUnitError: there is no such unit; the message names a similar wanted one.

    """
    name = text
    for spelling, symbol in SPELLINGS.items():
        name = re.sub(rf"(?<![A-Za-z])({spelling})(?![A-Za-z])", symbol, name)
    name = re.sub(f"([{RAISED}]+)", r"^\1", name).translate(_SIGNS)
    name = re.sub(r"^\s*/", "1/", name.replace("**", "^").replace("°", "deg"))  # '3000/min'
    name = re.sub(r"[\s*]+", " ", re.sub(r"\s*([/^])\s*", r"\1", name)).strip()
    name = _NEWTON_METRES.sub(r"\1 \2 \3", name).replace(" /", "/").strip()
    per_minute = name in {"1/min", "min^-1"}  # turns, by DIN 1301, or a frequency
    if per_minute and wanted is Dimension.NUMBER:
        raise AmbiguousUnitError(f"'{name}' may be a speed or a frequency: write rpm or 1/s")
    if re.search(r"\bgrad\b", name.lower()):
        raise AmbiguousUnitError(f"'{name}' may be of degrees or of 400ths of a turn: write deg")
    try:
        return _unit("rpm" if per_minute and wanted is Dimension.ANGULAR_SPEED else name)
    except UnknownUnitError:
        usual = usual_units(wanted)
        near = [unit for unit in usual if unit.lower() == name.lower()]
        near += difflib.get_close_matches(name, usual, n=1, cutoff=0.5)
        suggestion = f"; did you mean '{near[0]}'?" if near else ""
        raise UnknownUnitError(f"unknown unit '{name}'{suggestion}") from None


def _unit(name: str) -> Unit:
    if re.sub(r"\s", "", _TOKEN.sub("", name)):
        raise UnknownUnitError
    tokens = _TOKEN.findall(name)[::-1]
    unit = _product(tokens)
    if tokens or abs(unit.tens) > MOST_TENS:
        raise UnknownUnitError
    # No power of ten below 1 is exactly a float, but its reciprocal is: so 1 mm is exactly 0.001.
    scale = 10.0 ** abs(unit.tens)
    factor = unit.factor / scale if unit.tens < 0 else unit.factor * scale
    if not 0 < factor < math.inf:
        raise UnknownUnitError
    return Unit(factor, unit.powers)


def _product(tokens: list[str]) -> Symbol:
    """Take a product off the end of reversed tokens, up to a closing parenthesis."""
    unit = _power(tokens)
    while tokens and tokens[-1] != ")":
        divided = tokens[-1] == "/"
        if divided:
            tokens.pop()
        unit = _times(unit, _power(tokens), -1 if divided else 1)
    return unit


def _power(tokens: list[str]) -> Symbol:
    """Take a symbol or a product in parentheses, with its exponent."""
    first = tokens.pop() if tokens else ""
    if first == "(":
        base = _product(tokens)
        if not tokens or tokens.pop() != ")":
            raise UnknownUnitError
    else:
        base = Symbol(Powers()) if first == "1" else _symbol(first)
    exponent = float(tokens.pop()[1:]) if tokens and tokens[-1].startswith("^") else 1
    return _times(Symbol(Powers()), base, exponent)


def _times(first: Symbol, second: Symbol, exponent: float) -> Symbol:
    pairs = zip(first.powers, second.powers, strict=True)
    powers = (round(a + exponent * b, _DIGITS) for a, b in pairs)
    try:
        factor = first.factor * second.factor**exponent
    except (OverflowError, ZeroDivisionError):
        raise UnknownUnitError from None
    return Symbol(Powers(*powers), factor, first.tens + exponent * second.tens)


def _symbol(name: str) -> Symbol:
    if name not in UNITS:
        raise UnknownUnitError
    return UNITS[name]


LONGEST_TEXT = 60
LARGEST, SMALLEST = 1e20, 1e-30
"""Limits of numbers, in SI: products of several of them (E b h^3 / l) must not overflow."""
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

    Messages also name the `words` that are allowed in its place.

    Raises:
        PydanticCustomError: the value is not a number, not finite, beyond all bounds, or has an
            unknown unit or another dimension.

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


class Measured(float):
    """A number with its dimension, which its unit chose among several."""

    dimension: Measure

    def __new__(cls, dimension: Measure, value: float) -> Measured:
        """Keep the dimension with the value in SI."""
        number = super().__new__(cls, value)
        number.dimension = dimension
        return number

    def __getnewargs__(self) -> tuple[Measure, float]:  # type: ignore[override]
        """Return the arguments of `__new__` for copies."""
        return self.dimension, float(self)


class OfGear(Quantity):
    """Annotation of a quantity of a wheel that a gear turns, or of a rack that it moves.

    Another part of the scene tells which it is; the unit must fit that.
    """

    def read(self, value: object) -> float | str:
        """Return a number in SI; if it has a unit, also with its dimension."""
        if not isinstance(value, str):
            return super().read(value)
        meant, of_rack = self.dimension, OF_RACK[self.dimension]
        try:
            number = to_si(value, of_rack)
            meant = of_rack
        except PydanticCustomError:
            number = to_si(value, meant, (of_rack.words,))
        return Measured(meant, float(super().read(number)))


OF_RACK: dict[Measure, Dimension] = {
    Dimension.ANGLE: Dimension.LENGTH,
    Dimension.TORSIONAL_STIFFNESS: Dimension.STIFFNESS,
    Dimension.TORSIONAL_DAMPING: Dimension.DAMPING,
    Dimension.ANGULAR_SPEED: Dimension.SPEED,
}
"""Dimensions at a slide, by the dimensions at a hinge."""


class StiffnessOfPower(Quantity):
    """Annotation of K in K d^n, in N/m^n; n is the key `exponent`, declared earlier in the part."""

    def beside(self, exponent: float | None) -> Quantity:
        """Return the quantity for a given exponent, or for none."""
        return replace(self, dimension=Measure.stiffness(exponent or HERTZ))

    def _read_beside(self, value: object, info: ValidationInfo) -> float | str:
        if "exponent" not in info.data:  # a mistake in the exponent is reported there
            return math.nan
        return self.beside(info.data["exponent"]).read(value)

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.with_info_plain_validator_function(self._read_beside)


HERTZ = 1.5
"""Exponent for spheres; also used if a law gives none."""
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
