"""The arrays of a result by name, with dimensions and units, and the result of such arrays.

A name, in the file and in tables, is the path to the array in Python with dots:
``contacts.strike.touches.begin``. Names of a scene have no dots. Which fields are arrays stands at
the dataclasses.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, is_dataclass
from functools import cache
from typing import Any, get_args, get_origin

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.result import Result
from exudyn_flexlink.storage.errors import PROGRAM
from exudyn_flexlink.sweeps import label_of
from exudyn_flexlink.variables import Member, Variable, members


@dataclass(frozen=True)
class Array:
    """Values, the names of their dimensions, and what they are: units and long_name."""

    dimensions: tuple[str, ...]
    values: NDArray[Any]
    attributes: Mapping[str, str]


@dataclass(frozen=True)
class Read:
    """What a file holds: arrays with any element, `lengths` of dimensions, texts by name."""

    arrays: Mapping[str, NDArray[Any]]
    lengths: Mapping[str, int]
    attributes: Mapping[str, str]


def arrays_of(result: Result) -> dict[str, Array]:
    """Return all arrays of a result by name."""
    return dict(_arrays(result, Result, ""))


def attributes_of(result: Result) -> dict[str, str]:
    """Return what tells a reader where the arrays come from."""
    outcome = result.outcome
    end = "completed" if outcome.completed else f"stopped: {outcome.reason}"
    return {
        "title": result.scene.title,
        "source": f"{PROGRAM}, engine {result.engine}",
        "outcome": f"{end}, at {outcome.time:.12g} s",
        "comment": "SI units; names are paths: joint_forces.crank.x is that of the joint 'crank'",
    }


@cache
def told_fields() -> dict[str, Any]:
    """Fields of a result that hold no arrays, with their types; the scene is not among them."""
    own = (member for member in members(Result) if member.name != "scene")
    return {member.name: member.type for member in own if not _holds_arrays(member)}


def names_in(result: Result) -> dict[str, tuple[str, ...]]:
    """Names of the scene by which a field of a result holds arrays, by the name of the field."""
    return {
        member.name: tuple(getattr(result, member.name))
        for member in members(Result)
        if get_origin(member.type) is Mapping and _holds_arrays(member)
    }


def _holds_arrays(member: Member) -> bool:
    kinds = filter(is_dataclass, (member.type, *get_args(member.type)))
    return member.variable is not None or any(
        own.variable is not None for kind in kinds for own in members(kind)
    )


def _name_of(member: Member, path: str) -> str:
    """Name of a field of the dataclass at `path`."""
    own = member.variable.name if member.variable else ""
    return _join(path, own or member.name)


def _join(path: str, name: str) -> str:
    """Return the path to what has a name at `path`, which is empty at the top."""
    return f"{path}.{name}" if path else name


def _dimensions_of(own: Variable, path: str) -> tuple[str, ...]:
    """Names of the dimensions of a variable that belongs to the dataclass at `path`."""
    names = own.dimensions.split()
    return tuple(f"{path}{name}".rstrip(".") if name.startswith(".") else name for name in names)


def _arrays(record: Any, kind: type[Any], path: str) -> Iterator[tuple[str, Array]]:
    """Those of a dataclass, and of all dataclasses in it."""
    for member in members(kind):
        value, name = getattr(record, member.name), _name_of(member, path)
        named = {name: value}
        if isinstance(value, Mapping):
            named = {_join(name, key): item for key, item in value.items()}
        for where, item in named.items():
            if member.variable is not None:
                yield from _array(item, member.variable, where, path)
            elif is_dataclass(item):
                yield from _arrays(item, type(item), where)


def _array(value: Any, own: Variable, name: str, path: str) -> Iterator[tuple[str, Array]]:
    """The array of a variable, or one for each of its components."""
    dimensions = _dimensions_of(own, path)
    for i, (component, units) in enumerate(own.components.items()):
        told = _told(units, f"{own.long_name}: {component}")
        yield _join(name, component), Array(dimensions, value[..., i], told)
    if not own.components:
        units = label_of(path)[1] if own.units is None else own.units
        yield name, Array(dimensions, np.asarray(value, own.kind), _told(units, own.long_name))


def _told(units: str, long_name: str) -> dict[str, str]:
    return ({"units": units} if units else {}) | {"long_name": long_name}


@dataclass(frozen=True)
class Records:
    """What was `read`; `names` are those of the fields that are by the scene's names."""

    read: Read
    names: Mapping[str, tuple[str, ...]]

    def record(self, kind: type[Any], path: str = "", **given: Any) -> Any:
        """Return a dataclass with its arrays, and the dataclasses in it; other fields are given.

        Raises:
            KeyError: `names` lack a field.
            ValueError: there is no such array.

        """
        own = (member for member in members(kind) if member.name not in given)
        return kind(**given, **{member.name: self._member(member, path) for member in own})

    def _member(self, member: Member, path: str) -> Any:
        name = _name_of(member, path)
        if get_origin(member.type) is not Mapping:
            return self._value(member.variable, member.type, name, path)
        kind = get_args(member.type)[1]
        keys = self.names[member.name]
        return {key: self._value(member.variable, kind, _join(name, key), path) for key in keys}

    def _value(self, own: Variable | None, kind: Any, name: str, path: str) -> Any:
        if own is None:
            return self.record(kind, name)
        if own.components:
            parts = [self._taken(own, _join(name, part), path) for part in own.components]
            return np.stack(parts, axis=-1)
        values = self._taken(own, name, path)
        if get_origin(kind) is tuple:
            return tuple(values.tolist())
        return values if own.dimensions else values.item()

    def _taken(self, own: Variable, name: str, path: str) -> NDArray[Any]:
        """An array of the file, which has none of those without any element, nor a length 0."""
        if name in self.read.arrays:
            return self.read.arrays[name].astype(own.kind, copy=False)
        shape = [self.read.lengths.get(name, 0) for name in _dimensions_of(own, path)]
        if 0 not in shape:
            raise ValueError(f"no '{name}' in it")
        return np.empty(shape, own.kind)
