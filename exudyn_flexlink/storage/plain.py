"""Values to what JSON has, and back by the types of dataclasses.

JSON knows neither numpy's numbers nor inf and nan: null stands for these. What is a number and is
read as null is without bound, inf.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from math import inf, isfinite
from types import UnionType
from typing import Any, Union, get_args, get_origin

import numpy as np

from exudyn_flexlink.variables import members


def plain(value: Any) -> Any:
    """Turn values into what JSON has; numbers that are not finite become None."""
    if is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not isfinite(value):
        return None
    return value


def from_plain(kind: Any, value: Any) -> Any:
    """Return a value of a type from what `plain` made of it.

    `kind` may be a dataclass, a tuple or a mapping by text of one kind, a union, float, int, bool
    or str. A float is left as it is where an integer was written.

    Raises:
        KeyError: a field of a dataclass is missing.
        ValueError: the value is of no such type.

    """
    origin, inner = get_origin(kind), get_args(kind)
    if isinstance(kind, type) and is_dataclass(kind) and isinstance(value, Mapping):
        return _record(kind, value)
    if origin is tuple and isinstance(value, list):
        return tuple(from_plain(inner[0], item) for item in value)
    if origin is not None and origin in {Mapping, dict} and isinstance(value, Mapping):
        return {key: from_plain(inner[1], item) for key, item in value.items()}
    if origin in {Union, UnionType}:
        return _one_of(inner, value)
    if kind is float and value is None:
        return inf
    if isinstance(value, _KINDS.get(kind, ())) and (kind is bool or not isinstance(value, bool)):
        return value
    raise ValueError(f"{str(value)[:40]!r} can't be there")


_KINDS: dict[Any, tuple[type, ...]] = {
    float: (float, int),
    int: (int,),
    bool: (bool,),
    str: (str,),
    type(None): (type(None),),
}


def _one_of(kinds: tuple[Any, ...], value: Any) -> Any:
    if value is None and type(None) in kinds:
        return None
    for kind in kinds:
        try:
            return from_plain(kind, value)
        except ValueError:
            continue
    raise ValueError(f"{str(value)[:40]!r} can't be there")


def _record(kind: type[Any], value: Mapping[str, Any]) -> Any:
    own = {member.name: member.type for member in members(kind)}
    if unknown := sorted(map(str, set(value) - set(own))):
        raise ValueError(f"{unknown[0]!r} can't be there")
    return kind(**{name: from_plain(inner, value[name]) for name, inner in own.items()})
