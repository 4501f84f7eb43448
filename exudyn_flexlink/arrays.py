"""Types of NumPy's arrays, and annotations that say what an array is.

Docstrings tell shapes and units. Fields of dataclasses have a `Variable`, with dimensions, unit and
name. Files and tables of a run follow from these, so that a new field needs no code there.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cache
from typing import Annotated, Any, NamedTuple, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]
IndexArray = NDArray[np.intp]  # of places in another array


@dataclass(frozen=True)
class Variable:
    """Annotation of a field that is an array, or one array of each name of a mapping.

    `dimensions`, separated by spaces, belong to the whole result (``time``, ``part``), or, with a
    dot before them, to the dataclass that has the field; a dot alone is the length of the array.
    `units` are SI: empty for text, ``1`` for counts and signs, and None where the unit stands at
    the end of the name (``angle_rad``) or with the components. `kind` is float, int, bool or str.
    `components` are names and units along a last axis that is not among the dimensions. `name`
    replaces the field's name, if given. Two settings say how to interpolate between samples: `rate`
    names the field of the time derivative, if any; of a `bound` of errors the larger sample counts.
    """

    dimensions: str
    units: str | None
    long_name: str
    kind: type = float
    components: Mapping[str, str] = field(default_factory=dict)
    name: str = ""
    rate: str = ""
    bound: bool = False


class Member(NamedTuple):
    """A field of a dataclass: its name, its type, and its `Variable`, if it has one."""

    name: str
    type: Any
    variable: Variable | None


def members(kind: Any) -> tuple[Member, ...]:
    """Return the fields of a dataclass, in order."""
    return _members(kind)


@cache
def _members(kind: Any) -> tuple[Member, ...]:
    hints = get_type_hints(kind, include_extras=True)
    return tuple(_member(field.name, hints[field.name]) for field in fields(kind))


def _member(name: str, hint: Any) -> Member:
    if get_origin(hint) is not Annotated:
        return Member(name, hint, None)
    plain, *annotations = get_args(hint)
    return Member(
        name, plain, next((each for each in annotations if isinstance(each, Variable)), None)
    )
