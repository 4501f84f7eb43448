"""The arrays of a file to the dataclasses that they were taken from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, get_args, get_origin

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.storage.arrays import dimensions_of, join, name_of
from exudyn_flexlink.storage.netcdf import Read
from exudyn_flexlink.variables import Member, Variable, members

_TYPES = {float: np.float64, int: np.int64, bool: np.bool_, str: np.str_}


@dataclass(frozen=True)
class Records:
    """What was `read`; `names` are those of the fields that are by the scene's names."""

    read: Read
    names: Mapping[str, tuple[str, ...]]

    def record(self, kind: type[Any], path: str = "", **given: Any) -> Any:
        """Return a dataclass with its arrays, and the dataclasses in it; other fields are given.

        Raises:
            KeyError: `names` lack a field, or there is no such array.

        """
        own = (member for member in members(kind) if member.name not in given)
        return kind(**given, **{member.name: self._member(member, path) for member in own})

    def _member(self, member: Member, path: str) -> Any:
        name = name_of(member, path)
        if get_origin(member.type) is not Mapping:
            return self._value(member.variable, member.type, name, path)
        kind = get_args(member.type)[1]
        keys = self.names[member.name]
        return {key: self._value(member.variable, kind, join(name, key), path) for key in keys}

    def _value(self, own: Variable | None, kind: Any, name: str, path: str) -> Any:
        if own is None:
            return self.record(kind, name)
        if own.components:
            parts = [self._taken(own, join(name, part), path) for part in own.components]
            return np.stack(parts, axis=-1)
        values = self._taken(own, name, path)
        if get_origin(kind) is tuple:
            return tuple(values.tolist())
        return values if own.dimensions else values.item()

    def _taken(self, own: Variable, name: str, path: str) -> NDArray[Any]:
        """An array of the file, which has none of those without any element."""
        kind = _TYPES[own.kind]
        if name in self.read.arrays:
            return self.read.arrays[name].values.astype(kind, copy=False)
        shape = [self.read.lengths[dimension] for dimension in dimensions_of(own, path)]
        if 0 not in shape:
            raise KeyError(name)
        return np.empty(shape, kind)
