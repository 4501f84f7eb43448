"""A result as arrays by name, with dimensions and units, and the rest of it; and back.

A name, in the file and in tables, is the path to the array in Python with dots:
``contacts.strike.touches.begin``. Names of a scene have no dots. Which fields are arrays stands at
the dataclasses.

Arrays with names, dimensions and attributes to a file of netCDF, and back.

The format is netCDF-3 with 64-bit offsets: SciPy writes it, and nearly everything reads it. What it
lacks is made up for: names are in UTF-8, as the format demands; truth values are bytes, marked as
xarray marks them; texts are rows of characters; arrays without any element are left out. The
SHA-256 of the file, in which 64 zeros stand in its place, tells whether it is as written.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, is_dataclass
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any, get_args, get_origin

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from exudyn_flexlink.arrays import Member, Variable, members
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import PrismaticJoint, Scene
from exudyn_flexlink.storage.manifest import PROGRAM, StorageError
from exudyn_flexlink.sweeps import label_of


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


LARGEST = 2**31 - 4  # bytes of one array in a file, as SciPy writes it
CHECKED = "sha256"  # the attribute, which comes first, and
BLANK = b"0" * 64  # what it is until the file is whole
CODES = {"f": "d", "i": "i", "b": "b", "S": "c"}  # of files, by kinds of numpy


def write_netcdf(file: Path, arrays: Mapping[str, Array], attributes: Mapping[str, str]) -> None:
    """Write arrays of floats, integers of 32 bits, truth values or texts.

    Raises:
        OSError: the file can't be written.
        StorageError: an array is too large for the format.

    """
    # scipy takes long to import, which those who only replace a file should not wait for
    from scipy.io import netcdf_file  # noqa: PLC0415

    stream = BytesIO()
    with netcdf_file(stream, "w", version=2) as written:
        _put(written, {CHECKED: BLANK.decode(), **attributes})
        for name, array in arrays.items():
            if array.values.nbytes > LARGEST:
                raise StorageError(
                    f"can't write {file}: '{name}' is larger than 2 GiB; set a larger 'run.sample'"
                )
            _write(written, name, array)
        written.flush()
        content = stream.getvalue()
    begin, found = _checked(content)
    file.write_bytes(content[:begin] + found + content[begin + len(found) :])


def _checked(content: bytes) -> tuple[int, bytes]:
    """Return where the SHA-256 of a file stands in it, and what it should be."""
    name = CHECKED.encode().ljust(8, b"\0")  # then come its type and length, of 4 bytes each
    begin = content.find(name) + len(name) + 8
    found = hashlib.sha256(content[:begin] + BLANK + content[begin + len(BLANK) :])
    return begin, found.hexdigest().encode()


def _write(written: Any, name: str, array: Array) -> None:
    values, told = array.values, dict(array.attributes)
    sizes = dict(zip(map(_encoded, array.dimensions), values.shape, strict=True))
    kind = values.dtype.kind
    if kind == "U":
        values = np.char.encode(values, "utf-8")
        letters = values.itemsize
        sizes[f"letters_{letters}"] = letters
        values = np.ascontiguousarray(values).view("S1").reshape(*values.shape, letters)
        kind, told = "S", told | {"_Encoding": "utf-8"}
    elif kind == "b":
        values, told = values.astype(np.int8), told | {"dtype": "bool"}
    for dimension, size in sizes.items():
        if size and dimension not in written.dimensions:
            written.createDimension(dimension, size)
    if values.size:
        made = written.createVariable(_encoded(name), CODES[kind], tuple(sizes))
        made[...] = values
        _put(made, told)


def _put(owner: Any, attributes: Mapping[str, str]) -> None:
    for name, text in attributes.items():
        if text:
            setattr(owner, name, text.encode("utf-8"))


def _encoded(name: str) -> str:
    """A name as SciPy, which writes Latin-1, has to be given it so that the file has UTF-8."""
    return name.encode("utf-8").decode("latin-1")


def _decoded(name: str) -> str:
    return name.encode("latin-1").decode("utf-8")


def read_netcdf(file: Path) -> Read:
    """Read a file that `write_netcdf` wrote: its attributes, and all arrays with any element.

    Raises:
        OSError: the file can't be read.
        MemoryError: it holds more than there is memory.
        ValueError: it is not as it was written.

    """
    content = file.read_bytes()
    begin, found = _checked(content)
    if content[begin : begin + len(found)] != found:
        raise ValueError("it is not what was written")
    from scipy.io import netcdf_file  # noqa: PLC0415 - see write_netcdf

    with netcdf_file(BytesIO(content)) as read:
        arrays = {_decoded(name): _values(own) for name, own in read.variables.items()}
        lengths = {_decoded(name): size for name, size in read.dimensions.items()}
        attributes = {name: text.decode("utf-8") for name, text in read._attributes.items()}
        return Read(arrays, lengths, attributes)


def _values(own: Any) -> NDArray[Any]:
    values = np.asarray(own.data)
    if values.dtype.kind != "S":
        return values.astype(values.dtype.newbyteorder("="))
    rows = np.ascontiguousarray(values).view(f"S{values.shape[-1]}")[..., 0]
    return np.char.decode(rows, "utf-8")
