"""The text of a formula in pieces: numbers with their units, names, operators, what is sensed."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

from exudyn_flexlink.expressions.tape import Sensed
from exudyn_flexlink.source import HintedError, did_you_mean
from exudyn_flexlink.units import (
    DOTS,
    RAISED,
    SPELLINGS,
    UNITS,
    Dimension,
    Powers,
    UnknownUnitError,
    find_unit,
)
from exudyn_flexlink.yaml_reader import MINUS

LONGEST = 500  # letters of a formula


class ExpressionError(HintedError):
    """What is wrong with a formula, in words, and a hint."""


class Token(NamedTuple):
    """A piece: `kind` is number, sensed, name, operator or end; `text` as it was written."""

    kind: str
    text: str
    value: float = 0.0
    powers: Powers | None = None
    sensed: Sensed | None = None

    @property
    def shown(self) -> str:
        """The piece as messages name it."""
        return "the end" if self.kind == "end" else f"'{self.text}'"


# Words that units are made of: tonnes are none, since `2 t` is a slip for `2*t`; 'grad'
# is refused with a hint.
_WORDS = {*UNITS, "Nm", "Nmm", "mNm", "kNm", "grad"} - {"t"}
_SPELT = "|".join([*SPELLINGS, *sorted(_WORDS, key=len, reverse=True)])
_WORD = rf"(?:{_SPELT})(?:[{RAISED}]+(?![\w(])|(?![\w(])(?:\s*\^\s*[0-9])?)"
_NUMBER = r"(?P<value>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)"
_UNIT = (
    rf"\s*(?P<unit>(?:1(?=/{_WORD})|{_WORD})(?:[ {DOTS}]+{_WORD})*(?:\s*/\s*{_WORD})*)"
    r"(?!\s*[*]{2})"
)
_PIECE = re.compile(
    rf"(?P<number>{_NUMBER}(?:{_UNIT})?)"
    r"|(?P<sensed>(?P<kind>angle|speed|place)\s*\((?P<of>[^()]*)\))"
    r"|(?P<name>[^\W\d]\w*)"
    rf"|(?P<operator>\*\*|<=|>=|[-+*/(),<>{MINUS}])"
    r"|(?P<other>\S)"
)
_SLIPS = {
    "^": "powers are written '**'",
    "=": "conditions compare by < or >, and the value is written alone",
    ".": "points stand in place(body.point, x)",
    "[": "there are no lists or keys",
    "'": "names are written without quotes",
    '"': "names are written without quotes",
}


def tokens_of(text: str, own: str = "") -> Iterator[Token]:
    """Cut a formula into its pieces, the last of kind end; the word `own` is sensed.

    Raises:
        ExpressionError: a piece is none.

    """
    if len(text) > LONGEST:
        raise ExpressionError(f"an expression of {len(text)} letters; at most {LONGEST}")
    text = text.replace("µ", "u").replace("μ", "u").replace("°", "deg")
    for found in _PIECE.finditer(text):
        if found["number"]:
            yield _quantity(found)
        elif found["sensed"]:
            yield Token("sensed", found[0], sensed=_sensed(found))
        elif own and found["name"] == own:
            yield Token("sensed", own, sensed=Sensed(own, ""))
        elif found["other"]:
            hint = _SLIPS.get(found[0], "")
            raise ExpressionError(f"'{found[0]}' can't stand in an expression", hint)
        else:
            kind = "name" if found["name"] else "operator"
            yield Token(kind, found[0].replace(MINUS, "-"))
    yield Token("end", "the end")


def _quantity(found: re.Match[str]) -> Token:
    """Read a number with the unit that may follow it."""
    if found["unit"] is None:
        return Token("number", found[0], float(found["value"]))
    try:
        unit = find_unit(found["unit"], Dimension.NUMBER)
    except UnknownUnitError as error:
        raise ExpressionError(str(error)) from None
    return Token("number", found[0], float(found["value"]) * unit.factor, unit.powers)


def _sensed(found: re.Match[str]) -> Sensed:
    """Read what stands in the brackets of angle, speed and place."""
    kind, names = found["kind"], [name.strip() for name in found["of"].split(",")]
    if len(names) == 1 and names[0] and not (kind == "place" and "." in names[0]):
        return Sensed(kind, names[0])
    if kind != "place":
        raise ExpressionError(f"'{found[0]}': expected the name of a joint", f"e.g. {kind}(crank)")
    if len(names) == 2 and names[1] in ("x", "y") and "." in names[0]:
        return Sensed(kind, *names)
    raise ExpressionError(
        f"'{found[0]}': expected a point and its coordinate, or a joint that slides",
        "e.g. place(rod.end, x) or place(way)",
    )


def unknown_name(name: str, known: list[str]) -> ExpressionError:
    """Return the error of a name that an expression does not have."""
    near = did_you_mean(name, known)
    if name in _WORDS:
        return ExpressionError(
            f"the unit '{name}' follows no number",
            "units stand after numbers, with powers as in '5 m/s^2'",
        )
    return ExpressionError(f"unknown name '{name}'{near}", "there are: " + ", ".join(known))
