"""A result as arrays by name, with dimensions and units, and the rest of it; and back.

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
from pydantic import TypeAdapter

from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import PrismaticJoint, Scene
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
    return taken_apart(result)[0]


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


def taken_apart(result: Result) -> tuple[dict[str, Array], dict[str, Any]]:
    """Return the arrays of a result by name, and its fields with None in place of every array."""
    arrays: dict[str, Array] = {}

    def rest(value: Any, own: Variable | None, name: str) -> Any:
        if isinstance(value, Mapping):
            return {key: rest(item, own, f"{name}.{key}") for key, item in value.items()}
        if own is not None:
            arrays.update(_arrays(result.scene, value, own, name))
            return None
        return fields(value, type(value), name) if is_dataclass(value) else value

    def fields(record: Any, kind: type[Any], path: str) -> dict[str, Any]:
        return {
            member.name: rest(getattr(record, member.name), member.variable, _name(member, path))
            for member in members(kind)
        }

    return arrays, fields(result, Result, "")


def put_together(read: Read, fields: Mapping[str, Any], **given: Any) -> Result:
    """Return the result of arrays and `fields`, as `taken_apart` gives both; some are `given`.

    Raises:
        KeyError: a field is missing.
        TypeError: one is of another kind.
        ValueError: one can't be, or an array is missing.

    """

    def whole(rest: Any, kind: Any, own: Variable | None, name: str) -> Any:
        if get_origin(kind) is Mapping:
            inner = get_args(kind)[1]
            return {key: whole(rest[key], inner, own, f"{name}.{key}") for key in rest}
        if own is not None:
            return _value(read, kind, own, name)
        return record(rest, kind, name) if is_dataclass(kind) else _adapter(kind)(rest)

    def record(rest: Any, kind: Any, path: str, **given: Any) -> Any:
        own = (member for member in members(kind) if member.name not in given)
        return kind(
            **given,
            **{m.name: whole(rest[m.name], m.type, m.variable, _name(m, path)) for m in own},
        )

    result: Result = record(fields, Result, "", **given)
    return result


@cache
def _adapter(kind: Any) -> Any:
    """What turns a value that JSON tells into one of a type."""
    return TypeAdapter(kind).validate_python


def _name(member: Member, path: str) -> str:
    """Name of a field of the dataclass at `path`, which is empty at the top."""
    name = (member.variable.name if member.variable else "") or member.name
    return f"{path}.{name}" if path else name


def _dimensions(own: Variable, name: str) -> tuple[str, ...]:
    """Names of the dimensions of a variable, which may be those of the dataclass around it."""
    path = name.rpartition(".")[0]
    every = own.dimensions.split()
    return tuple(f"{path}{one}".rstrip(".") if one.startswith(".") else one for one in every)


def _arrays(scene: Scene, value: Any, own: Variable, name: str) -> Iterator[tuple[str, Array]]:
    """The array of a variable, or one for each of its components."""
    dimensions = _dimensions(own, name)
    for i, (component, units) in enumerate(own.components.items()):
        told = _told(units, f"{own.long_name}: {component}")
        yield f"{name}.{component}", Array(dimensions, value[..., i], told)
    if not own.components:
        units = label_of(name.rpartition(".")[0])[1] if own.units is None else own.units
        told = _told(_unit_of(scene, name, units), own.long_name)
        yield name, Array(dimensions, np.asarray(value, own.kind), told)


def _unit_of(scene: Scene, name: str, unit: str) -> str:
    """Unit of an array, by that of its field: hinges stop by torques, slides rub by forces."""
    section, _, rest = name.partition(".")
    if section == "contacts":
        contact = next((own for own in scene.stops if rest.startswith(f"{own}.")), "")
        return scene.unit_of(contact, unit)
    joint = scene.joints.get(rest.rpartition(".")[0]) if section == "frictions" else None
    return "N" if unit == "N m" and isinstance(joint, PrismaticJoint) else unit


def _told(units: str, long_name: str) -> dict[str, str]:
    return ({"units": units} if units else {}) | {"long_name": long_name}


def _value(read: Read, kind: Any, own: Variable, name: str) -> Any:
    """The value of a variable: an array, or a tuple, or a single number."""
    if own.components:
        return np.stack([_taken(read, own, f"{name}.{part}") for part in own.components], axis=-1)
    values = _taken(read, own, name)
    if get_origin(kind) is tuple:
        return tuple(values.tolist())
    return values if own.dimensions else values.item()


def _taken(read: Read, own: Variable, name: str) -> NDArray[Any]:
    """An array of the file, which has none of those without any element, nor a length 0."""
    if name in read.arrays:
        return read.arrays[name].astype(own.kind, copy=False)
    shape = [read.lengths.get(one, 0) for one in _dimensions(own, name)]
    if 0 not in shape:
        raise ValueError(f"no '{name}' in it")
    return np.empty(shape, own.kind)
