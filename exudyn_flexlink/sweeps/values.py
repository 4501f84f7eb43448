"""Values that a sweep gives to one path of the scene: ranges and lists, with a unit or without."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import isfinite
from sys import float_info
from typing import Any

import numpy as np

from exudyn_flexlink.quantities import NUMBER, UNIT, in_words
from exudyn_flexlink.source import HintedError
from exudyn_flexlink.yaml_reader import MINUS, read_yaml

MOST_VALUES = 1_000_000  # of one range: far more than anybody runs, and quickly made
DIGITS = 12  # of a value within a range: 0.3 stays 0.3, without the rounding of a sum
HINT = "start:stop:count such as '2:40:20' or '0:5:11 mm', or a list such as '1, 2, 5 mm'"
RANGE_HINT = "lowest:highest such as '2:40' or '0:5 mm'"
_NUMBER = re.compile(rf"\s*({NUMBER})\s*({UNIT})?\s*")
_COUNT = re.compile(rf"\s*([0-9]+)\s*({UNIT})?\s*")

Value = float | str
"""A number, or a text as it stands in a model file, such as '5 mm' or 'beam'."""


class Written(str):
    """A list, a mapping or a truth value, written as JSON."""

    __slots__ = ()


class ValuesError(HintedError):
    """A text that gives no values; `hint` says how they are written, `entry` which is meant."""

    def __init__(self, message: str, hint: str = HINT, entry: int | None = None) -> None:
        super().__init__(message, hint)
        self.entry = entry


@dataclass(frozen=True)
class Range:
    """Numbers from `low` to `high`, both in `unit`; an empty one is that of the SI."""

    low: float
    high: float
    unit: str

    def at(self, part: float) -> Value:
        """Value at a part of the range, 0 to 1."""
        return self._written(self.low + part * (self.high - self.low))

    def spread(self, count: int) -> tuple[Value, ...]:
        """Values at equal distances, both ends among them."""
        return tuple(self._written(x) for x in np.linspace(self.low, self.high, count).tolist())

    def _written(self, value: float) -> Value:
        number = float(f"{value:.{DIGITS}g}")
        return f"{number_text(number)} {self.unit}" if self.unit else number


def number_text(number: float) -> str:
    """Return a number as a model file has it; a whole one without a point, as counts need."""
    return str(int(number)) if number.is_integer() and abs(number) < 1e15 else repr(number)


def values_of(given: Any) -> tuple[Value, ...]:
    """Read the values of a path: a text as on the command line, or a sequence of values.

    Raises:
        ValuesError: they are none.

    """
    if isinstance(given, str):
        return _of_text(given)
    if hasattr(given, "tolist"):  # of numpy
        given = given.tolist()
    if isinstance(given, bool | int | float):
        given = (given,)
    if not isinstance(given, Sequence) or isinstance(given, bytes | bytearray | memoryview):
        raise ValuesError(f"expected values, got {in_words(given)}")
    return _listed([value_of(one, i) for i, one in enumerate(given)])


def range_of(given: Any) -> Range:
    """Read the two ends of a range.

    Raises:
        ValuesError: they are none.

    """
    if isinstance(given, str):
        ends: Sequence[Any] = given.split(":")
    else:
        ends = given if isinstance(given, Sequence) else ()
    if len(ends) != 2:
        raise ValuesError(f"expected two ends, got {in_words(given)}", RANGE_HINT)
    found = _range(str(ends[0]), str(ends[1]), RANGE_HINT)
    if found.low > found.high:
        raise ValuesError(f"the range {in_words(given)} runs backwards", "give the lower end first")
    return found


def _listed(values: Sequence[Value]) -> tuple[Value, ...]:
    if not values:
        raise ValuesError("needs at least one value")
    seen: set[Value] = set()
    for i, value in enumerate(values):
        if value in seen:
            raise ValuesError(f"{in_words(value)} is there twice", "", i)
        seen.add(value)
    return tuple(values)


def _of_text(text: str) -> tuple[Value, ...]:
    if ":" in text:
        parts = text.split(":")
        if len(parts) != 3:
            raise ValuesError(f"expected start:stop:count, got '{text}'")
        last = _COUNT.fullmatch(parts[2])
        if last is None or not 2 <= int(last[1]) <= MOST_VALUES:
            raise ValuesError(
                f"expected a number of values, 2 to {MOST_VALUES}, after the second colon; "
                f"got '{parts[2].strip()}'"
            )
        return _range(parts[0], parts[1], HINT, last[2] or "").spread(int(last[1]))
    read = read_yaml(f"[{text}]")
    if read.problems or not isinstance(read.data, list):
        raise ValuesError(f"expected values, got '{text}'")
    return _listed(_with_last_unit([value_of(one, i) for i, one in enumerate(read.data)]))


def _with_last_unit(values: list[Value]) -> Sequence[Value]:
    """Give the unit of the last value to all, where no other has one: '1, 2, 5 mm'."""
    last = parts_of(values[-1]) if values else None
    if last is None or not all(isinstance(one, float) for one in values[:-1]):
        return values
    return [*(f"{number_text(float(one))} {last[1]}" for one in values[:-1]), values[-1]]


def _range(low: str, high: str, hint: str, unit: str = "") -> Range:
    ends = [_NUMBER.fullmatch(text) for text in (low, high)]
    if not (ends[0] and ends[1]):
        wrong = high if ends[0] else low
        raise ValuesError(f"expected a number, or one with a unit, got '{wrong.strip()}'", hint)
    units = {unit.strip(), *((end[2] or "").strip() for end in ends if end)} - {""}
    if len(units) > 1:
        told = " and ".join(f"'{one}'" for one in sorted(units))
        raise ValuesError(f"the range has the units {told}", "give one, which holds for all")
    numbers = [float(end[1].replace(MINUS, "-")) for end in ends if end]
    if not all(map(isfinite, numbers)):
        raise ValuesError(f"'{low}:{high}' is no finite range", hint)
    if numbers[0] == numbers[1]:
        raise ValuesError(f"the range '{low}:{high}' is one value", hint)
    return Range(numbers[0], numbers[1], units.pop() if units else "")


def value_of(given: Any, entry: int | None = None) -> Value:
    """Return a value as a number, or as the text that a model file would hold.

    Raises:
        ValuesError: no model file can hold it.

    """
    if hasattr(given, "tolist"):  # of numpy
        given = given.tolist()
    if isinstance(given, int | float) and not isinstance(given, bool):
        if not abs(given) <= float_info.max:  # nor a whole number beyond
            raise ValuesError(f"must be a finite number, got {in_words(given)}", entry=entry)
        return float(given)
    if isinstance(given, str):
        if given.strip():
            return given
    elif isinstance(given, bool | Mapping | Sequence):
        with suppress(TypeError, ValueError):
            return Written(json.dumps(given, ensure_ascii=False))
    raise ValuesError(f"expected a value, got {in_words(given)}", entry=entry)


def setting_of(path: str, value: Value) -> tuple[str, Any]:
    """Return the setting that puts a value into the scene; a text is not read as YAML again."""
    if isinstance(value, str):
        return path, json.loads(value) if isinstance(value, Written) else value
    return path, json.loads(number_text(value))


def unit_of(values: Sequence[Value]) -> str:
    """Return the unit in which all of some values are written; empty if there is no such one."""
    units = {parts[1] if (parts := parts_of(value)) else "" for value in values}
    return units.pop() if len(units) == 1 else ""


def parts_of(value: Value) -> tuple[float, str] | None:
    """Number and unit of a text that has both, the unit as it is written; None of all else."""
    found = _NUMBER.fullmatch(value) if isinstance(value, str) else None
    if found is None or found[2] is None:
        return None
    return float(found[1].replace(MINUS, "-")), found[2].strip()
