"""The text of a formula in pieces: numbers with their units, names, operators, what is sensed."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

from exudyn_flexlink.source import HintedError, did_you_mean
from exudyn_flexlink.units import (
    DOTS,
    PREFIXES,
    RAISED,
    SPELLINGS,
    SYMBOLS,
    Dimension,
    Powers,
    UnknownUnitError,
    find_unit,
)
from exudyn_flexlink.yaml_reader import MINUS

LONGEST = 500  # letters of a formula


class ExpressionError(HintedError):
    """What is wrong with a formula, in words, and a hint."""


@dataclass(frozen=True)
class Sensed:
    """What a formula takes of the state: `angle`, `speed` or `place` of a joint, or of a point.

    `of` is the joint, or the point 'body.point' of which `axis` is the coordinate 'x' or 'y'. The
    place of a joint is how far it is out.
    """

    kind: str
    of: str
    axis: str = ""


class Token(NamedTuple):
    """A piece: `kind` is number, sensed, name, operator or end; `text` as it was written."""

    kind: str
    text: str
    value: float = 0.0
    powers: Powers | None = None
    sensed: Sensed | None = None


# Words that units are made of: tonnes are none, since `2 t` is a slip for `2*t`.
_WORDS = {*SYMBOLS, "Nm", "Nmm", "mNm", "kNm"} - {"t"}
_WORDS |= {prefix + name for name, one in SYMBOLS.items() if one.prefixed for prefix in PREFIXES}
_SPELT = "|".join([*SPELLINGS, *sorted(_WORDS, key=len, reverse=True)])
_WORD = rf"(?:{_SPELT})(?:[{RAISED}]+(?![\w(])|(?![\w(])(?:\s*\^\s*[0-9])?)"
_NUMBER = re.compile(r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_AFTER_NUMBER = re.compile(
    rf"\s*(?P<unit>(?:1(?=/{_WORD})|{_WORD})(?:[ {DOTS}]+{_WORD})*(?:\s*/\s*{_WORD})*)"
    r"(?!\s*[*]{2})"
)
_SENSED = re.compile(r"(angle|speed|place)\s*\(([^()]*)\)")
_NAME = re.compile(r"[^\W\d]\w*")
_OPERATOR = re.compile(rf"\*\*|<=|>=|[-+*/(),<>{MINUS}]")
_SLIPS = {
    "^": "powers are written '**'",
    "=": "conditions compare by < or >, and the value is written alone",
    ".": "points stand in place(body.point, x)",
    "[": "there are no lists or keys",
    "'": "names are written without quotes",
    '"': "names are written without quotes",
}


def tokens_of(text: str) -> Iterator[Token]:
    """Cut a formula into its pieces, the last of kind end.

    Raises:
        ExpressionError: a piece is none.

    """
    if len(text) > LONGEST:
        raise ExpressionError(f"an expression of {len(text)} letters; at most {LONGEST}")
    text = text.replace("µ", "u").replace("μ", "u").replace("°", "deg")
    at = 0
    while at < len(text):
        if text[at].isspace():
            at += 1
            continue
        token, at = _token_at(text, at)
        yield token
    yield Token("end", "the end")


def _token_at(text: str, at: int) -> tuple[Token, int]:
    """Return the piece that starts at a place, and where it ends."""
    if found := _NUMBER.match(text, at):
        return _quantity(text, found)
    if found := _SENSED.match(text, at):
        return Token("sensed", found[0], sensed=_sensed(found)), found.end()
    for kind, pattern in (("name", _NAME), ("operator", _OPERATOR)):
        if found := pattern.match(text, at):
            return Token(kind, found[0].replace(MINUS, "-")), found.end()
    hint = _SLIPS.get(text[at], "")
    raise ExpressionError(f"'{text[at]}' can't stand in an expression", hint)


def _quantity(text: str, number: re.Match[str]) -> tuple[Token, int]:
    """Read a number with the unit that may follow it."""
    value, end = float(number[0]), number.end()
    if (found := _AFTER_NUMBER.match(text, end)) is None:
        return Token("number", number[0], value), end
    try:
        unit = find_unit(found["unit"], Dimension.NUMBER)
    except UnknownUnitError as error:
        raise ExpressionError(str(error)) from None
    whole = text[number.start() : found.end()]
    return Token("number", whole, value * unit.factor, unit.powers), found.end()


def _sensed(found: re.Match[str]) -> Sensed:
    """Read what stands in the brackets of angle, speed and place."""
    kind, names = found[1], [name.strip() for name in found[2].split(",")]
    if kind != "place" and len(names) == 1 and names[0]:
        return Sensed(kind, names[0])
    if kind == "place" and len(names) == 1 and names[0] and "." not in names[0]:
        return Sensed(kind, names[0])
    if kind == "place" and len(names) == 2 and names[1] in ("x", "y") and "." in names[0]:
        return Sensed(kind, *names)
    if kind != "place":
        raise ExpressionError(f"'{found[0]}': expected the name of a joint", f"e.g. {kind}(crank)")
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
