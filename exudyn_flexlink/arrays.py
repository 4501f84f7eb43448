"""Arrays of NumPy by what they hold. Docstrings tell their shapes and units.

What an array is: its dimensions, its unit, what it tells; stands at the fields of dataclasses.

Files and tables of a run are made of these, so that a new field needs no code there.
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

    `dimensions`, parted by spaces, are those of the whole result (``time``, ``part``), or, with a
    dot before them, of the dataclass that has the field; a mere dot is its own length. `units` are
    SI, empty of text, ``1`` of counts and signs, and None where they stand at the end of the name
    (``angle_rad``) or with the components. `kind` is float, int, bool or str. `components` tell
    names and units along a last axis that is not among the dimensions. `name` stands in place of
    that of the field, if given. `rate` names the field of the time derivative, if there is one, and
    a `bound` is what an error is no larger than: both tell what holds between samples.
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
    """A field of a dataclass: its name, its type, and what it is if it is a variable."""

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
