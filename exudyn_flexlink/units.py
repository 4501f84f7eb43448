"""Dimensions of what a scene gives, and the units in which they may be written.

A unit is a product of powers of symbols, some of which may have a prefix.
"""

from __future__ import annotations

import difflib
import math
import re
from enum import Enum
from typing import NamedTuple


class Powers(NamedTuple):
    """A dimension as powers of the base units; radians count, so that rad/s is not Hz."""

    m: float = 0
    kg: float = 0
    s: float = 0
    rad: float = 0


_DIGITS = 9  # of powers: 1 - 1.1 is -0.1


class Measure:
    """What a number measures: its name, its SI unit in words, an example, its powers."""

    def __init__(self, words: str, si: str, example: str, powers: Powers) -> None:
        self.words = words
        self.si = si
        self.example = example
        self.powers = powers

    @staticmethod
    def stiffness(exponent: float) -> Measure:
        """Return what K of a force K d^exponent measures."""
        si = f"N/m^{exponent:g}"
        powers = Powers(m=round(1 - exponent, _DIGITS), kg=1, s=-2)
        return Measure(f"a stiffness of exponent {exponent:g}", si, f"1e7 {si}", powers)

    @property
    def hint(self) -> str:
        """How to write such a value."""
        return f"a number in {self.si}, or {self.words} such as '{self.example}'" if self.si else ""

    def accepts(self, powers: Powers) -> bool:
        """Whether a unit of these powers measures this; torsion may be given without its '/rad'."""
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
    """A unit that has a name of its own: `factor` times 10^`tens` in SI.

    `prefixes` are those with which engineers write it: others are slips, such as 'Mm' for 'mm'.
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
"""Units as the documentation lists them, and hints suggest them."""

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
"""Units as people write them, where that means one thing; files of numbers have the same."""
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

    Read from left to right, so that 'N/m s' is 'N s/m'. It may be of another dimension than what
    is `wanted`. '1/min' is 'rpm' where an angular speed is.

    Raises:
        AmbiguousUnitError: it is 'grad', or '1/min' where any number is wanted.
        UnknownUnitError: there is no such unit; the message names one wanted that resembles it.

    """
    name = text
    for spelling, symbol in SPELLINGS.items():
        name = re.sub(rf"(?<![A-Za-z])({spelling})(?![A-Za-z])", symbol, name)
    name = re.sub(f"([{RAISED}]+)", r"^\1", name).translate(_SIGNS)
    name = re.sub(r"^\s*/", "1/", name.replace("**", "^").replace("°", "deg"))  # '3000/min'
    name = re.sub(r"[\s*]+", " ", re.sub(r"\s*([/^])\s*", r"\1", name)).strip()
    name = _NEWTON_METRES.sub(r"\1 \2 \3", name).replace(" /", "/").strip()
    per_minute = name in {"1/min", "min^-1"}  # turns, as DIN 1301 has it, or a frequency
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
    found = _product(tokens)
    if tokens or abs(found.tens) > MOST_TENS:
        raise UnknownUnitError
    # A power of ten below 1 is no float, its reciprocal is: so a millimetre is 0.001 to the bit.
    scale = 10.0 ** abs(found.tens)
    factor = found.factor / scale if found.tens < 0 else found.factor * scale
    if not 0 < factor < math.inf:
        raise UnknownUnitError
    return Unit(factor, found.powers)


def _product(tokens: list[str]) -> Symbol:
    """Take a product off the end of reversed tokens, up to a closing parenthesis."""
    found = _power(tokens)
    while tokens and tokens[-1] != ")":
        divided = tokens[-1] == "/"
        if divided:
            tokens.pop()
        found = _times(found, _power(tokens), -1 if divided else 1)
    return found


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


def _times(one: Symbol, other: Symbol, exponent: float) -> Symbol:
    pairs = zip(one.powers, other.powers, strict=True)
    powers = (round(a + exponent * b, _DIGITS) for a, b in pairs)
    try:
        factor = one.factor * other.factor**exponent
    except (OverflowError, ZeroDivisionError):
        raise UnknownUnitError from None
    return Symbol(Powers(*powers), factor, one.tens + exponent * other.tens)


def _symbol(name: str) -> Symbol:
    if name not in UNITS:
        raise UnknownUnitError
    return UNITS[name]
