"""What functions for Python take: each argument is checked as the call comes in.

`takes` names a kind for each argument. A kind converts the given value for the function, or refuses
it: by a ValueError if it has the right type, else by a TypeError.
"""

from __future__ import annotations

import inspect
import math
import os
from collections.abc import Callable, Iterable, Mapping
from functools import wraps
from numbers import Real
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numpy as np
from pydantic_core import PydanticCustomError

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.quantities import LONGEST_TEXT, Dimension, Quantity
from exudyn_flexlink.source import unknown

LONGEST_NAME = 255  # letters of a file's name that a file system takes
Given = ParamSpec("Given")
Made = TypeVar("Made")
Kind = Callable[[Any, Any], Any]
"""Checks a value. Its second argument is the call's first, such as the result of a method."""


def takes(**kinds: Kind) -> Callable[[Callable[Given, Made]], Callable[Given, Made]]:
    """Let a function refuse arguments that are not of their kinds; the error names all of them.

    Flags, texts, paths and functions need no kind: their annotations tell it. None is allowed if it
    is the default. Of ``*names`` each argument is checked.
    """

    def checked(function: Callable[Given, Made]) -> Callable[Given, Made]:
        known = inspect.signature(function)
        assert set(kinds) <= set(known.parameters)
        plain = {
            name: ANNOTATED.get(str(parameter.annotation).removesuffix(" | None"))
            for name, parameter in known.parameters.items()
        }
        all_kinds = {name: kind for name, kind in (plain | kinds).items() if kind is not None}

        @wraps(function)
        def call(*args: Given.args, **kwargs: Given.kwargs) -> Made:
            try:
                bound = known.bind(*args, **kwargs)
            except TypeError:
                return function(*args, **kwargs)  # one is missing, or too many: Python says so
            owner, wrong = next(iter(bound.arguments.values()), None), list[Exception]()
            for name, value in bound.arguments.items():
                parameter, kind = known.parameters[name], all_kinds.get(name)
                if kind is None or (value is None and parameter.default is None):
                    continue
                try:
                    many = parameter.kind is inspect.Parameter.VAR_POSITIONAL
                    made = (
                        tuple(kind(item, owner) for item in value) if many else kind(value, owner)
                    )
                    bound.arguments[name] = made
                except (TypeError, ValueError) as error:
                    wrong.append(type(error)(f"{name}: {error}"))
            if wrong:
                kind_of = TypeError if any(isinstance(e, TypeError) for e in wrong) else ValueError
                raise kind_of("\n".join(map(str, wrong)))
            return function(*bound.args, **bound.kwargs)

        return call

    return checked


def excerpt(value: object) -> str:
    """Write a given value for messages: short, and in Python's notation."""
    if isinstance(value, type):
        return f"the class {value.__name__}"
    if isinstance(value, int) and abs(value) > 10**LONGEST_TEXT:
        return f"an int of {int(value.bit_length() * math.log10(2)) + 1} digits"
    if value is None or isinstance(value, bool | Real | complex | str | bytes):
        text = repr(value)
        return text if len(text) <= LONGEST_TEXT else f"{text[:LONGEST_TEXT]}..."
    if hasattr(value, "shape"):
        return f"an array of shape {tuple(value.shape)}"
    if isinstance(value, list | tuple | set | dict):
        return f"a {type(value).__name__} of {len(value)}"
    return f"a {type(value).__name__}"


def plain(value: Any) -> Any:
    """Turn a quantity of Pint into text with a unit, and a number of numpy into Python's.

    An array with one entry is turned into that entry; all else is returned as it is.
    """
    if hasattr(value, "to_base_units"):
        base = value.to_base_units()
        number, unit = plain(base.magnitude), f"{base.units:~C}".replace("**", "^")
        known = not unit or not isinstance(number, Real)
        return number if known else f"{number!r} {unit}"
    if hasattr(value, "item") and getattr(value, "size", 0) == 1:
        return value.item()
    return value


def number(
    dimension: Dimension = Dimension.NUMBER, *, endless: bool = False, **bounds: Any
) -> Kind:
    """Take a number in SI, or a text such as '5 mm', or Pint's; see `Quantity`.

    It is finite, unless it may be `endless`.
    """
    quantity = Quantity(dimension, **bounds)

    def read(value: Any, _: Any = None) -> float | str:
        given = plain(value)
        wrong = f"expected {dimension.hint or dimension.words}, got {excerpt(value)}"
        if isinstance(given, bool) or not isinstance(given, Real | str):
            raise TypeError(wrong)
        try:
            given = given if isinstance(given, str) else float(given)
            if isinstance(given, float) and not math.isfinite(given):
                if endless and not math.isnan(given):
                    return given
                raise ValueError(wrong)
            return quantity.read(given)
        except OverflowError:
            raise ValueError(wrong) from None
        except PydanticCustomError as error:
            about = error.context or {}
            hint = f": {about['hint']}" if about.get("hint") else f", got {excerpt(value)}"
            raise ValueError(f"{about.get('message')}{hint}") from None

    return read


def instants(value: Any, _: Any = None) -> FloatArray:
    """Take an instant in s, or an array (N,) of instants; they may lie outside a run."""
    if isinstance(value, str):
        return np.array(number(Dimension.TIME)(value, None))
    wrong = f"expected instants in s, a number or an array (N,), got {excerpt(value)}"
    if hasattr(value, "to_base_units"):
        base = value.to_base_units()
        if f"{base.units:~C}" != "s":
            raise ValueError(wrong)
        value = base.magnitude
    try:
        times = np.asarray(value)
    except ValueError:  # lists of several lengths
        raise TypeError(wrong) from None
    if times.dtype.kind not in "iuf" and times.shape != (0,):
        raise TypeError(wrong)
    if times.ndim > 1:
        raise ValueError(wrong)
    return times.astype(float)


def whole(least: int, most: int = 10**9) -> Kind:
    """Take a whole number within bounds."""

    def read(value: Any, _: Any = None) -> int:
        given = plain(value)
        wrong = f"expected a whole number from {least:,} to {most:,}, got {excerpt(value)}"
        if isinstance(given, bool) or not isinstance(given, int | float):
            raise TypeError(wrong)
        if not least <= given <= most or given != int(given):
            raise ValueError(wrong)
        return int(given)

    return read


def text(value: Any, _: Any = None) -> str:
    """Take a text."""
    if not isinstance(value, str):
        raise TypeError(f"expected a text, got {excerpt(value)}")
    return str(value)


def among(known: Callable[[Any], Iterable[str]], what: str = "name") -> Kind:
    """Take one of the names that are `known` to the call's first argument."""

    def read(value: Any, owner: Any) -> str:
        name, names = text(value), list(known(owner))
        if name not in names:
            raise ValueError(unknown(what, name[:LONGEST_TEXT], names))
        return name

    return read


def place(value: Any, _: Any = None) -> Path:
    """Take the path of a file or folder."""
    given = os.fspath(value) if isinstance(value, os.PathLike) else value
    wrong = f"expected a path, got {excerpt(value)}"
    if not isinstance(given, str):
        raise TypeError(wrong)
    too_long = any(len(part) > LONGEST_NAME for part in Path(given).parts)
    if not given.strip() or "\0" in given or too_long:
        raise ValueError(wrong)
    return Path(given)


def flag(value: Any, _: Any = None) -> bool:
    """Take True or False."""
    given = plain(value)
    if not isinstance(given, bool):
        raise TypeError(f"expected True or False, got {excerpt(value)}")
    return given


def function(value: Any, _: Any = None) -> Any:
    """Take a function, or another callable."""
    if not callable(value) or isinstance(value, type):
        raise TypeError(f"expected a function, got {excerpt(value)}")
    return value


def instance_of(kind: type, how: str = "") -> Kind:
    """Take an object of a class; `how` says what makes one."""

    def read(value: Any, _: Any = None) -> Any:
        if not isinstance(value, kind):
            hint = f"; {how}" if how else ""
            raise TypeError(f"expected a {kind.__name__}, got {excerpt(value)}{hint}")
        return value

    return read


def two_texts(value: Any, _: Any = None) -> tuple[str, str]:
    """Take two texts."""
    pair = list(value) if isinstance(value, tuple | list) else []
    if len(pair) != 2 or not all(isinstance(text, str) for text in pair):
        raise TypeError(f"expected two texts, got {excerpt(value)}")
    return str(pair[0]), str(pair[1])


def texts_by_name(value: Any, _: Any = None) -> Mapping[str, str]:
    """Take a dict of texts."""
    pairs = list(value.items()) if isinstance(value, Mapping) else [(None, None)]
    if not all(isinstance(text, str) for pair in pairs for text in pair):
        raise TypeError(f"expected a dict such as {{'theta': 'lever.angle'}}, got {excerpt(value)}")
    return dict(pairs)


def measured(value: Any, _: Any = None) -> Any:
    """Take the path of a CSV file, or columns (N,) by name, as of a dict or a data frame.

    The unit of Pint's quantities is appended to the name of their column. In the dict that SciPy's
    `loadmat` returns, a matrix with one row or column is a column; notes on the file, such as
    ``__header__``, are left out.
    """
    if isinstance(value, str | os.PathLike):
        return place(value)
    wrong = f"expected a CSV file, or columns by name, got {excerpt(value)}"
    if isinstance(value, type) or not hasattr(value, "items") or not len(value):
        raise TypeError(wrong)
    columns = dict[str, Any]()
    items = ((name, column) for name, column in value.items() if not str(name).startswith("__"))
    for called, column in items:
        wrong = (
            f"expected columns (N,) by name, got {excerpt(column)} as {excerpt(called)}; of a "
            "matrix give one column, {'x': data['x'][:, 0], ..}"
        )
        name = called
        try:
            first: Any = next(iter(column), None)
            if hasattr(first, "to_base_units"):
                unit = first.to_base_units().units
                numbers = np.array([quantity.to(unit).magnitude for quantity in column])
                name = f"{called} ({unit:~C})".replace("**", "^").removesuffix(" ()")
            else:
                numbers = np.asarray(column)
                if np.ma.is_masked(column):
                    numbers = column.astype(float).filled(np.nan)  # refused with its row
                numbers = np.atleast_1d(numbers.squeeze()) if 1 in numbers.shape else numbers
        except (AttributeError, TypeError, ValueError):
            raise TypeError(wrong) from None
        if not isinstance(name, str) or name.count("(") > 1 or numbers.ndim != 1:
            raise TypeError(wrong)
        if name in columns:
            raise ValueError(f"two columns are named '{name}'")
        columns[name] = numbers
    return columns


def values(value: Any, _: Any = None) -> list[Any]:
    """Take some values: a sequence, an array, or an iterable."""
    if isinstance(value, str | bytes | bytearray | memoryview | Mapping) or not isinstance(
        value, Iterable
    ):
        raise TypeError(f"expected values, such as a list, got {excerpt(value)}")
    try:
        return list(value)
    except TypeError:  # an array without axes
        return [plain(value)]


ANNOTATED: dict[str, Kind] = {
    "bool": flag,
    "str": text,
    "str | PathLike[str]": place,
    "Callable[[float], None]": function,
}
"""Kinds of arguments by their annotations, also where these allow None."""
