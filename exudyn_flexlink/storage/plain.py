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

    `kind` may be a dataclass, a tuple or a mapping by text of one kind, one of several numbers and
    texts, or one that may be None. A float is left as it is where an integer was written.

    Raises:
        KeyError: a field of a dataclass is missing.

    """
    origin, inner = get_origin(kind), get_args(kind)
    if origin in {Union, UnionType}:
        return None if value is None and type(None) in inner else from_plain(inner[0], value)
    if origin is tuple:
        return tuple(from_plain(inner[0], item) for item in value)
    if origin is not None:
        return {key: from_plain(inner[1], item) for key, item in value.items()}
    if isinstance(kind, type) and is_dataclass(kind):
        return kind(**{own.name: from_plain(own.type, value[own.name]) for own in members(kind)})
    return inf if kind is float and value is None else value
