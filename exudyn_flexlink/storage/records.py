"""The arrays of a file to the dataclasses that they were taken from, checked as they are taken."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args, get_origin

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.intervals import Intervals
from exudyn_flexlink.result import Result
from exudyn_flexlink.storage.arrays import dimensions_of, join, name_of
from exudyn_flexlink.storage.errors import StorageError
from exudyn_flexlink.storage.netcdf import Read
from exudyn_flexlink.storage.plain import LARGEST
from exudyn_flexlink.variables import Member, Variable, members

_TYPES = {float: np.float64, int: np.int64, bool: np.bool_, str: np.str_}


@dataclass(frozen=True)
class Records:
    """What was read of `file`; `names` are those of the fields that are by the scene's names."""

    read: Read
    file: Path
    names: Mapping[str, tuple[str, ...]]

    def record(self, kind: type[Any], path: str = "", **given: Any) -> Any:
        """Return a dataclass with its arrays, and the dataclasses in it; other fields are given.

        Raises:
            KeyError: `names` lack a field.
            StorageError: an array is missing, or of another kind.

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
        dimensions = dimensions_of(own, path)
        if name not in self.read.arrays:
            return self._without_elements(own, name, dimensions)
        found = self.read.arrays[name]
        values, kind = found.values, np.dtype(_TYPES[own.kind])
        stored = np.dtype(np.int32) if own.kind is int else kind
        fits = values.dtype.kind == "U" if own.kind is str else values.dtype == stored
        if found.dimensions != dimensions or not fits:
            raise self.damaged(f"'{name}' does not fit")
        if own.kind is float:
            self._check_finite(name, values[values != np.inf] if own.unbounded else values)
        return values if own.kind is str else values.astype(kind, copy=False)

    def _without_elements(
        self, own: Variable, name: str, dimensions: tuple[str, ...]
    ) -> NDArray[Any]:
        shape = [self.read.lengths.get(dimension, -1) for dimension in dimensions]
        if 0 not in shape or min(shape) < 0:
            raise self.damaged(f"no '{name}' in it")
        return np.empty(shape, _TYPES[own.kind])

    def _check_finite(self, name: str, values: NDArray[Any]) -> None:
        if not np.all(np.abs(values) < LARGEST):  # nan isn't, either
            raise self.damaged(f"'{name}' holds numbers that are not finite, or beyond {LARGEST:g}")

    def damaged(self, what: str) -> StorageError:
        """Return the error that says what is wrong with the file."""
        return StorageError(f"{self.file} is damaged: {what}; run the model again")

    def check(self, result: Result) -> None:
        """Look at what arrays mean: instants go on, intervals end after they begin.

        Raises:
            StorageError: that can't be.

        """
        time = result.time
        if not len(time) or time[0] < 0 or np.any(np.diff(time) < 0) or _stands(time):
            raise self.damaged("'time' does not increase from 0 on")
        for name, own in result.extremes.items():
            if np.any(np.diff(own.time) < 0):
                raise self.damaged(f"'extremes.{name}.time' falls")
        pairs = {name: len(sleeve.pairs) for name, sleeve in result.sleeves.items()}
        for name, touches in result.intervals.items():
            if not _possible(touches, pairs.get(name, 1)):
                raise self.damaged(f"the touches of '{name}' do not fit")


def _stands(time: FloatArray) -> bool:
    return len(time) > 1 and bool(time[-1] <= time[0])


def _possible(touches: Intervals, pairs: int) -> bool:
    return bool(
        np.all((touches.pair >= 0) & (touches.pair < pairs))
        and np.all(touches.begin <= touches.end)
        and np.all(np.diff(touches.begin) >= 0)
    )
