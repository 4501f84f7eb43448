"""What a notebook needs, thin: scenes and results with methods, over the rooms below.

`Scene` and `Result` here are those of the rooms below, which everything takes; they only add what
those can't know: values by path, observables, figures, tables, files. `exudyn_flexlink` itself
names them all.
"""

from __future__ import annotations

from dataclasses import fields
from typing import Any, TypeVar

Own = TypeVar("Own")


def with_methods(kind: type[Own], plain: Any, **instead: Any) -> Own:
    """Return a dataclass of a room below as that of this room, `kind`, which adds methods alone.

    `instead` are fields that get other values.
    """
    given = {field.name: getattr(plain, field.name) for field in fields(plain)}
    return kind(**(given | instead))
