"""Dimensions of what a scene gives, and the units in which they may be written.

Common units come from a small table. Pint knows the others; it is imported only for those,
since importing it takes longer than reading a whole model.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Mapping
from enum import Enum
from functools import cache
from typing import Any, NamedTuple


class Powers(NamedTuple):
    """A dimension as powers of the base units; radians count, so that rad/s is not Hz."""

    m: int = 0
    kg: int = 0
    s: int = 0
    rad: int = 0


class Dimension(Enum):
    """What a number measures: its name, its SI unit in words, an example, its powers."""

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

    def __init__(self, words: str, si: str, example: str, powers: Powers) -> None:
        self.words = words
        self.si = si
        self.example = example
        self.powers = powers

    @property
    def hint(self) -> str:
        """How to write such a value."""
        if self is Dimension.NUMBER:
            return ""
        return f"a number in {self.si}, or {self.words} such as '{self.example}'"

    def accepts(self, powers: Powers) -> bool:
        """Whether a unit of these powers measures this; torsion may be given without its '/rad'."""
        without_rad = self.powers._replace(rad=0)
        return powers == self.powers or (self.powers.rad < 0 and powers == without_rad)


class Unit(NamedTuple):
    """A unit in terms of the SI's."""

    factor: float
    powers: Powers


def _units(dimension: Dimension, factors: Mapping[str, float]) -> dict[str, Unit]:
    return {name: Unit(factor, dimension.powers) for name, factor in factors.items()}


_DEG = math.pi / 180
_TURN = 2 * math.pi
UNITS: dict[str, Unit] = {
    **_units(Dimension.LENGTH, {"m": 1, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "km": 1e3}),
    **_units(Dimension.ANGLE, {"rad": 1, "mrad": 1e-3, "deg": _DEG, "turn": _TURN}),
    **_units(Dimension.TIME, {"s": 1, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60, "h": 3600}),
    **_units(Dimension.FREQUENCY, {"Hz": 1, "kHz": 1e3, "MHz": 1e6, "1/s": 1}),
    **_units(Dimension.MASS, {"kg": 1, "g": 1e-3, "mg": 1e-6, "t": 1e3}),
    **_units(Dimension.DENSITY, {"kg/m^3": 1, "g/cm^3": 1e3, "kg/dm^3": 1e3}),
    **_units(
        Dimension.PRESSURE, {"Pa": 1, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "N/m^2": 1, "N/mm^2": 1e6}
    ),
    **_units(Dimension.FORCE, {"N": 1, "mN": 1e-3, "kN": 1e3}),
    **_units(Dimension.TORQUE, {"N m": 1, "N mm": 1e-3, "mN m": 1e-3, "kN m": 1e3}),
    **_units(Dimension.STIFFNESS, {"N/m": 1, "N/mm": 1e3, "kN/m": 1e3, "N/um": 1e6}),
    **_units(
        Dimension.TORSIONAL_STIFFNESS,
        {"N m/rad": 1, "N mm/rad": 1e-3, "mN m/rad": 1e-3, "N m/deg": 1 / _DEG},
    ),
    **_units(Dimension.TORSIONAL_DAMPING, {"N m s/rad": 1, "N mm s/rad": 1e-3}),
    **_units(
        Dimension.ANGULAR_SPEED, {"rad/s": 1, "deg/s": _DEG, "rpm": _TURN / 60, "turn/s": _TURN}
    ),
    **_units(Dimension.SPEED, {"m/s": 1, "cm/s": 1e-2, "mm/s": 1e-3}),
    **_units(Dimension.ACCELERATION, {"m/s^2": 1, "mm/s^2": 1e-3}),
    **_units(Dimension.INERTIA, {"kg m^2": 1, "g m^2": 1e-3, "g cm^2": 1e-7, "kg mm^2": 1e-6}),
    **_units(Dimension.AREA, {"m^2": 1, "cm^2": 1e-4, "mm^2": 1e-6}),
    **_units(Dimension.SECOND_MOMENT, {"m^4": 1, "cm^4": 1e-8, "mm^4": 1e-12}),
}
"""The units known without pint. A test compares each with pint."""

# Written in one word by every engineer: newton metres, not pint's Nm (length per mass of a yarn).
_NEWTON_METRES = re.compile(r"(?<![A-Za-z])([kMmu]?N)(m|cm|mm)(s?)(?![A-Za-z])")


class UnknownUnitError(ValueError):
    """There is no such unit; the message says so, and names one that resembles it."""


def find_unit(text: str) -> Unit:
    """Look a unit up: products may be written 'N m', 'N*m', 'N·m', and 'Nm' is one of them.

    Raises:
        UnknownUnitError: there is no such unit; the message names one that resembles it.

    """
    name = re.sub(r"\s*([/^])\s*", r"\1", text.replace("**", "^").replace("°", "deg"))
    name = re.sub(r"[\s*·]+", " ", name.replace("µ", "u").replace("μ", "u")).strip()
    name = _NEWTON_METRES.sub(r"\1 \2 \3", name).replace(" /", "/").strip()
    unit = UNITS.get(name) or _unit_from_pint(name)
    if unit is None:
        near = difflib.get_close_matches(name, UNITS, n=1, cutoff=0.5)
        same = [known for known in UNITS if known.replace(" ", "").lower() == name.lower()]
        suggestion = f"; did you mean '{(same or near)[0]}'?" if same or near else ""
        raise UnknownUnitError(f"unknown unit '{name}'{suggestion}")
    return unit


@cache
def _registry() -> Any:
    import pint  # noqa: PLC0415  (slow to import, seldom needed)

    return pint.UnitRegistry()


@cache
def _unit_from_pint(name: str) -> Unit | None:
    # A number in an exponent is all the arithmetic a unit needs; large ones would only cost time.
    if re.search(r"\^\s*[^0-9+\-]|\^\s*[+\-]?[0-9]{2}|\^[^^]*\^|[0-9]{3}|[0-9]\s+[0-9]", name):
        return None
    try:
        base = _registry().Quantity(1.0, _registry().parse_units(name)).to_base_units()
        powers = {str(unit): float(power) for unit, power in base.units._units.items()}
        factor = float(base.magnitude)
    except Exception:  # pint raises its own, tokenize's and Python's errors for what is no unit
        return None
    bases = zip(Powers._fields, ("meter", "kilogram", "second", "radian"), strict=True)
    broken = any(power != int(power) for power in powers.values())
    whole = {short: int(powers.pop(base, 0.0)) for short, base in bases}
    if any(powers.values()) or broken or not math.isfinite(factor):
        whole = {"m": 99}  # amperes, kelvins, roots: a unit, and none that a scene asks for
    return Unit(factor, Powers(**whole))
