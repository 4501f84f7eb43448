"""Write a Result to the files of a run, and read it: arrays by name, tables with units, the rest.

The name of an array, in the file and in tables, is its path in Python with dots:
``contacts.strike.touches.begin``. Names of a scene have no dots. The dataclasses declare which
fields are arrays.

The format is netCDF-3 with 64-bit offsets: SciPy writes it, and nearly every program reads it. It
lacks some types. So names are in UTF-8, as the format demands; truth values are bytes, with the
marks of xarray; texts are rows of characters; arrays without elements are omitted. The SHA-256 of
the file, with 64 zeros in its own place, tells whether the file is as written.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, is_dataclass
from functools import cache, partial
from io import BytesIO
from pathlib import Path
from typing import Any, TypeVar, get_args, get_origin

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter
from pydantic_core import to_json

from exudyn_flexlink.arrays import FloatArray, Member, Variable, members
from exudyn_flexlink.loading import plain_data
from exudyn_flexlink.observables import (
    BENDING,
    Energies,
    LeverResponse,
    Strike,
    at_instants,
    bending,
    bent_links,
    between_samples,
    body_motion,
    contact_totals,
    crank_angle,
    crank_column,
    crank_joint,
    energies,
    even_instants,
    flight_gaps,
    forces_of,
    friction_unit,
    happenings,
    joint_turning,
    joints_with_play,
    lever_response,
    momentary_forces,
    path,
    point_names,
    strikes,
    struck_bodies,
    watched_point,
)
from exudyn_flexlink.report import TOTALS, bending_peak_columns, entries, friction_columns
from exudyn_flexlink.result import Extremes, Intervals, Result
from exudyn_flexlink.scene import Scene, parse_scene
from exudyn_flexlink.source import Document, SceneError, parse_document
from exudyn_flexlink.storage.documents import (
    AGAIN,
    Column,
    check_readable,
    other_version,
    write_document,
)
from exudyn_flexlink.storage.replacing import ARRAYS, FORMAT, PROGRAM, SUMMARY, SWEEP, StorageError
from exudyn_flexlink.sweeps import column_of, column_of_contact, label_of


@dataclass(frozen=True)
class Array:
    """Values, the names of their dimensions, and attributes: units and long_name."""

    dimensions: tuple[str, ...]
    values: NDArray[Any]
    attributes: Mapping[str, str]


@dataclass(frozen=True)
class Read:
    """Contents of a file: arrays with elements, `lengths` of dimensions, texts by name."""

    arrays: Mapping[str, NDArray[Any]]
    lengths: Mapping[str, int]
    attributes: Mapping[str, str]


def arrays_of(result: Result) -> dict[str, Array]:
    """Return all arrays of a result by name."""
    return taken_apart(result)[0]


def attributes_of(result: Result) -> dict[str, str]:
    """Return attributes that tell readers where the arrays come from."""
    outcome = result.outcome
    end = "completed" if outcome.completed else f"stopped: {outcome.reason}"
    return {
        "title": result.scene.title,
        "source": f"{PROGRAM}, engine {result.engine}",
        "outcome": f"{end}, at {outcome.time:.12g} s",
        "comment": "SI units; names are paths: joint_forces.crank.x is that of the joint 'crank'",
    }


def taken_apart(result: Result) -> tuple[dict[str, Array], dict[str, Any]]:
    """Return the arrays of a result by name, and its fields, in which None replaces every array."""
    arrays: dict[str, Array] = {}

    def rest(value: Any, variable: Variable | None, name: str) -> Any:
        if isinstance(value, Mapping):
            return {key: rest(item, variable, f"{name}.{key}") for key, item in value.items()}
        if variable is not None:
            arrays.update(_arrays(result.scene, value, variable, name))
            return None
        return fields(value, type(value), name) if is_dataclass(value) else value

    def fields(record: Any, kind: type[Any], path: str) -> dict[str, Any]:
        return {
            member.name: rest(getattr(record, member.name), member.variable, _name(member, path))
            for member in members(kind)
        }

    return arrays, fields(result, Result, "")


def put_together(read: Read, fields: Mapping[str, Any], **given: Any) -> Result:
    """Return the result of arrays and `fields`, as from `taken_apart`; some fields are `given`.

    Raises:
        KeyError: a field is missing.
        TypeError: a field has the wrong type.
        ValueError: a field has an impossible value, or an array is missing.

    """

    def whole(rest: Any, kind: Any, variable: Variable | None, name: str) -> Any:
        if get_origin(kind) is Mapping:
            inner = get_args(kind)[1]
            return {key: whole(rest[key], inner, variable, f"{name}.{key}") for key in rest}
        if variable is not None:
            return _value(read, kind, variable, name)
        return record(rest, kind, name) if is_dataclass(kind) else _adapter(kind)(rest)

    def record(rest: Any, kind: Any, path: str, **given: Any) -> Any:
        kept = (member for member in members(kind) if member.name not in given)
        return kind(
            **given,
            **{m.name: whole(rest[m.name], m.type, m.variable, _name(m, path)) for m in kept},
        )

    result: Result = record(fields, Result, "", **given)
    return result


@cache
def _adapter(kind: Any) -> Any:
    """Return the converter of a JSON value to a type."""
    return TypeAdapter(kind).validate_python


def _name(member: Member, path: str) -> str:
    """Return the name of a field of the dataclass at `path`; the path is empty at the top."""
    name = (member.variable.name if member.variable else "") or member.name
    return f"{path}.{name}" if path else name


def _dimensions(variable: Variable, name: str) -> tuple[str, ...]:
    """Return the dimensions of a variable; they may be those of the dataclass around it."""
    path = name.rpartition(".")[0]
    every = variable.dimensions.split()
    return tuple(f"{path}{axis}".rstrip(".") if axis.startswith(".") else axis for axis in every)


def _arrays(scene: Scene, value: Any, variable: Variable, name: str) -> Iterator[tuple[str, Array]]:
    """Yield the array of a variable, or one array for each of its components."""
    dimensions = _dimensions(variable, name)
    for i, (component, units) in enumerate(variable.components.items()):
        about = _attributes(units, f"{variable.long_name}: {component}")
        yield f"{name}.{component}", Array(dimensions, value[..., i], about)
    if not variable.components:
        units = label_of(name.rpartition(".")[0])[1] if variable.units is None else variable.units
        about = _attributes(_unit_of(scene, name, units), variable.long_name)
        yield name, Array(dimensions, np.asarray(value, variable.kind), about)


def _unit_of(scene: Scene, name: str, unit: str) -> str:
    """Return the unit of an array: its field's unit, with two exceptions.

    The stop of a hinge acts by a torque, the friction of a slide by a force.
    """
    section, _, rest = name.partition(".")
    if section == "contacts":
        contact = next((stop for stop in scene.stops if rest.startswith(f"{stop}.")), "")
        return scene.unit_of(contact, unit)
    joint = rest.rpartition(".")[0] if section == "frictions" else None
    return friction_unit(scene, joint) if joint and unit == "N m" else unit


def _attributes(units: str, long_name: str) -> dict[str, str]:
    return ({"units": units} if units else {}) | {"long_name": long_name}


def _value(read: Read, kind: Any, variable: Variable, name: str) -> Any:
    """Return the value of a variable: an array, a tuple, or a single number."""
    if variable.components:
        return np.stack(
            [_taken(read, variable, f"{name}.{part}") for part in variable.components], axis=-1
        )
    values = _taken(read, variable, name)
    if get_origin(kind) is tuple:
        return tuple(values.tolist())
    return values if variable.dimensions else values.item()


def _taken(read: Read, variable: Variable, name: str) -> NDArray[Any]:
    """Return an array of the file; the file has no array without elements, and no length 0."""
    if name in read.arrays:
        return read.arrays[name].astype(variable.kind, copy=False)
    shape = [read.lengths.get(axis, 0) for axis in _dimensions(variable, name)]
    if 0 not in shape:
        raise ValueError(f"no '{name}' in it")
    return np.empty(shape, variable.kind)


LARGEST = 2**31 - 4  # bytes: largest array in a file that SciPy writes
CHECKED = "sha256"  # the first attribute of the file
BLANK = b"0" * 64  # its value until the file is complete
CODES = {"f": "d", "i": "i", "b": "b", "S": "c"}  # types in files, by kinds of NumPy


def write_netcdf(file: Path, arrays: Mapping[str, Array], attributes: Mapping[str, str]) -> None:
    """Write arrays of floats, integers of 32 bits, truth values or texts.

    Raises:
        OSError: the file can't be written.
        StorageError: an array is too large for the format.

    """
    # SciPy takes long to import, and replacing a file does not need it
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
    begin, digest = _checked(content)
    file.write_bytes(content[:begin] + digest + content[begin + len(digest) :])


def _checked(content: bytes) -> tuple[int, bytes]:
    """Return the place of the SHA-256 in a file, and the value that it should have."""
    name = CHECKED.encode().ljust(8, b"\0")  # its type and its length follow, of 4 bytes each
    begin = content.find(name) + len(name) + 8
    digest = hashlib.sha256(content[:begin] + BLANK + content[begin + len(BLANK) :])
    return begin, digest.hexdigest().encode()


def _write(written: Any, name: str, array: Array) -> None:
    values, attributes = array.values, dict(array.attributes)
    sizes = dict(zip(map(_encoded, array.dimensions), values.shape, strict=True))
    kind = values.dtype.kind
    if kind == "U":
        values = np.char.encode(values, "utf-8")
        letters = values.itemsize
        sizes[f"letters_{letters}"] = letters
        values = np.ascontiguousarray(values).view("S1").reshape(*values.shape, letters)
        kind, attributes = "S", attributes | {"_Encoding": "utf-8"}
    elif kind == "b":
        values, attributes = values.astype(np.int8), attributes | {"dtype": "bool"}
    for dimension, size in sizes.items():
        if size and dimension not in written.dimensions:
            written.createDimension(dimension, size)
    if values.size:
        made = written.createVariable(_encoded(name), CODES[kind], tuple(sizes))
        made[...] = values
        _put(made, attributes)


def _put(owner: Any, attributes: Mapping[str, str]) -> None:
    for name, text in attributes.items():
        if text:
            setattr(owner, name, text.encode("utf-8"))


def _encoded(name: str) -> str:
    """Return a name that SciPy, which writes Latin-1, turns into UTF-8 in the file."""
    return name.encode("utf-8").decode("latin-1")


def _decoded(name: str) -> str:
    return name.encode("latin-1").decode("utf-8")


def read_netcdf(file: Path) -> Read:
    """Read a file that `write_netcdf` wrote: its attributes, and all arrays with elements.

    Raises:
        OSError: the file can't be read.
        MemoryError: it has more data than the memory can hold.
        ValueError: it is not as written.

    """
    content = file.read_bytes()
    begin, digest = _checked(content)
    if content[begin : begin + len(digest)] != digest:
        raise ValueError("it is not what was written")
    from scipy.io import netcdf_file  # noqa: PLC0415 - see write_netcdf

    with netcdf_file(BytesIO(content)) as read:
        arrays = {_decoded(name): _values(variable) for name, variable in read.variables.items()}
        lengths = {_decoded(name): size for name, size in read.dimensions.items()}
        attributes = {name: text.decode("utf-8") for name, text in read._attributes.items()}
        return Read(arrays, lengths, attributes)


def _values(variable: Any) -> NDArray[Any]:
    values = np.asarray(variable.data)
    if values.dtype.kind != "S":
        return values.astype(values.dtype.newbyteorder("="))
    rows = np.ascontiguousarray(values).view(f"S{values.shape[-1]}")[..., 0]
    return np.char.decode(rows, "utf-8")


UNITS = {
    member.name: member.variable.units or "" for member in members(Intervals) if member.variable
}
"""Units of values on touches, and on strikes, which consist of touches."""


Record = TypeVar("Record")
Times = FloatArray | None
"""Instants (N,) s of the rows of a table; None: the instants of the samples."""


def _seen(record: Record, time: Times) -> Record:
    """Return the record of a run at the instants of a table."""
    return record if time is None else at_instants(record, time)


def trajectory_columns(result: Result, point: str, time: Times = None) -> dict[str, FloatArray]:
    """Return the motion of 'body.point' as columns (N,) by name and unit.

    Raises:
        ValueError: the scene has no such point.

    """
    seen = _seen(path(result, point), time)
    (x, y), (vx, vy) = seen.position.T, seen.velocity.T
    return _instants(result, time) | {"x_m": x, "y_m": y, "vx_m_per_s": vx, "vy_m_per_s": vy}


def lever_columns(result: Result, contact: str, time: Times = None) -> dict[str, FloatArray]:
    """Return the motion of the body that a contact strikes, as columns (N,) by name and unit.

    Raises:
        ValueError: the scene has no such contact.

    """
    seen = _seen(lever_response(result, contact), time)
    return _instants(result, time) | {
        seen.measure.name: seen.value,
        seen.measure.rate_name: seen.rate,
        "tip_displacement_m": seen.tip_displacement,
    }


def bending_columns(result: Result, link: str, time: Times = None) -> dict[str, FloatArray]:
    """Return the moments of a link's hinges as columns (N,) like ``moment_at_0.007_m_N_m``.

    Raises:
        ValueError: the link has no hinges.

    """
    bent = _seen(bending(result, link), time)
    columns = zip(bent.place.tolist(), bent.moment.T, strict=True)
    return _instants(result, time) | {
        f"moment_at_{place:.6g}_m_N_m": values for place, values in columns
    }


def touch_columns(result: Result, name: str) -> dict[str, FloatArray]:
    """Return every touch of a joint's pairs or of a contact, as columns (touches,).

    Names end in the unit. `pair` counts from 1, in the order of the sleeve's `pairs` in the
    summary. A touch that continues at the end of the run has `ended` 0, and `end_s` is that end.
    Contacts and bearings also have the largest gap of the flight that follows, see `flight_gaps`.
    """
    touches, last = result.intervals[name], float(result.time[-1])
    columns: dict[str, FloatArray] = {"begin_s": touches.begin, "end_s": touches.until(last)}
    angle = crank_column(result.scene)
    if angle is not None:
        columns[f"{angle}_rad"] = np.interp(touches.begin, result.time, crank_angle(result))
    names = ("impulse", "energy_lost", "peak_force", "approach_speed", "place", "penetration",
             "tangential_impulse")  # fmt: skip
    columns["pair"] = np.asarray(touches.pair + 1, dtype=np.float64)
    column_name = partial(column_of_contact, result.scene, name)
    columns |= {column_name(key, UNITS[key]): getattr(touches, key) for key in names}
    if (gaps := flight_gaps(result, name)) is not None:
        columns[column_name("next_flight_gap", "m")] = gaps
    return columns | {"ended": np.isfinite(touches.end).astype(np.float64)}


def strike_columns(result: Result, contact: str) -> dict[str, Column]:
    """Return the strikes of a contact as columns (strikes,) of the fields of `Strike`.

    Names end in the unit. Laps and angle are omitted if nothing turns.
    """
    every_strike, columns = strikes(result, contact), dict[str, Column]()
    units = UNITS | {"crank_angle": "rad"}
    for key in (member.name for member in members(Strike)):
        values = [getattr(strike, key) for strike in every_strike]
        name = crank_column(result.scene) if key == "crank_angle" else key
        if name is not None and None not in values:
            columns[column_of_contact(result.scene, contact, name, units.get(key, ""))] = values
    return columns


def happening_columns(result: Result) -> dict[str, Column]:
    """Return the happenings of a run as columns: instant, kind and place."""
    items = happenings(result)
    names = {"t_s": "time", "what": "what", "where": "where"}
    return {column: [getattr(item, key) for item in items] for column, key in names.items()}


def force_columns(result: Result, time: Times = None) -> dict[str, FloatArray]:
    """Return all forces and torques as columns (N,), such as ``crank.joint_force_x_N``.

    A contact with impulses has no force; its impulses are in `touch_columns`.
    """
    columns, left_out = _instants(result, time), momentary_forces(result)
    for called, known in forces_of(result).items():
        force = _seen(known, time)
        name, quantity, values = force.name, force.quantity.replace(" ", "_"), force.values
        if quantity == "wall_force":  # the name is, for instance, 'sleeve, upper wall'
            name, _, wall = name.rpartition(", ")
            quantity = f"{wall.replace(' ', '_')}_force"
        if force.quantity == BENDING:  # the largest moment along the link
            values = force.size
        parts = {"": values} if values.ndim == 1 else {"_x": values[:, 0], "_y": values[:, 1]}
        if called not in left_out:
            for axis, numbers in parts.items():
                columns[column_of(f"{name}.{quantity}{axis}", force.unit)] = numbers
    return columns


def impulse_columns(result: Result) -> dict[str, FloatArray]:
    """Return impulses in joints during impacts, ``hinge.impulse_x_N_s`` (K,), and their instants.

    A joint that did not exist at that instant has the value nan.
    """
    instants = np.unique(np.concatenate([x.time for x in result.joint_impulses.values()]))
    columns: dict[str, FloatArray] = {"t_s": instants}
    for name, jumps in result.joint_impulses.items():
        parts = {"_x": jumps.impulse[:, 0], "_y": jumps.impulse[:, 1], "": jumps.size}
        rows = np.searchsorted(instants, jumps.time)
        for axis, values in parts.items():
            column = np.full(len(instants), np.nan)
            column[rows] = values
            columns[column_of(f"{name}.impulse{axis}", "N s")] = column
    return columns


def all_columns(result: Result, time: Times = None) -> dict[str, FloatArray]:
    """Return values at every sample, as columns (N,): ``link.angle_rad``, ``link.end.x_m``.

    They are bodies and points, responses of struck bodies (``lever.response.angle_rad``), forces
    (see `force_columns`) and energies (``energy.kinetic_J``).
    """
    struck, energy = struck_bodies(result.scene), _seen(energies(result), time)
    columns = _instants(result, time)
    instants = tuple(columns)
    for body in result.scene.bodies:
        seen = _seen(body_motion(result, body), time)
        columns |= {f"{body}.angle_rad": seen.angle, f"{body}.rate_rad_per_s": seen.rate}
    tables = {point: trajectory_columns(result, point, time) for point in point_names(result.scene)}
    tables |= {
        f"{body}.response": lever_columns(result, contact, time) for body, contact in struck.items()
    }
    for name, table in tables.items():
        columns |= {f"{name}.{key}": column for key, column in table.items() if key not in instants}
    columns |= force_columns(result, time)
    names = (m.name for m in members(Energies) if m.variable)
    return columns | {f"energy.{name}_J": getattr(energy, name) for name in names}


def _instants(result: Result, time: Times = None) -> dict[str, FloatArray]:
    columns = {"t_s": result.time if time is None else time}
    angle, name = crank_column(result.scene), crank_joint(result.scene)
    if angle is not None and name is not None:
        turned, rate = joint_turning(result, name)
        columns[f"{angle}_rad"] = (
            turned if time is None else between_samples(result.time, turned, rate, time)
        )
    return columns


def tables_of(result: Result, time: Times = None) -> dict[str, Mapping[str, Column]]:
    """Return the tables of a run by file name; file names may differ from names of the scene."""
    point = watched_point(result.scene)
    tables: dict[str, Mapping[str, Column]] = {
        f"trajectory_{_fit(point)}.csv": trajectory_columns(result, point, time)
    }
    forces = force_columns(result, time)
    if len(forces) > len(_instants(result)):
        tables["forces.csv"] = forces
    for link in bent_links(result.scene):
        tables[_free_name(f"bending_{_fit(link)}", tables)] = bending_columns(result, link, time)
    for body, contact in struck_bodies(result.scene).items():
        tables[_free_name(f"lever_{_fit(body)}", tables)] = lever_columns(result, contact, time)
    for name in (name for name, touches in result.intervals.items() if len(touches)):
        tables[_free_name(f"touches_{_fit(name)}", tables)] = touch_columns(result, name)
        if name in result.contacts:
            tables[_free_name(f"strikes_{_fit(name)}", tables)] = strike_columns(result, name)
    if result.joint_impulses:
        tables["joint_impulses.csv"] = impulse_columns(result)
    happened = happening_columns(result)
    return tables | ({"happenings.csv": happened} if happened["t_s"] else {})


def _fit(name: str) -> str:
    return re.sub(r"[^\w.-]", "_", name)[:60]


def _free_name(stem: str, taken: Iterable[str]) -> str:
    """Return a file name that is not taken; two names of a scene may give the same file name."""
    while f"{stem}.csv".lower() in map(str.lower, taken):  # some file systems ignore case
        stem += "_"
    return f"{stem}.csv"


RUN = "run"
"""Attribute of ``result.nc`` with the fields of a result that are no arrays, as JSON."""


def save(result: Result, folder: Path, every: float | None = None) -> None:
    """Write a result into `folder`, which is made if it is missing.

    With `every` (s), tables have rows at this constant interval instead of rows at the samples;
    ``result.nc`` still has the samples.

    ``result.nc`` is the whole result. The other files are for readers: ``summary.json``,
    ``trajectory_<point>.csv`` of the watched point, ``forces.csv`` of all forces and torques,
    ``bending_<link>.csv`` of the hinges of every flexible link, ``lever_<body>.csv`` of every body
    that a contact strikes, ``touches_<name>.csv`` of every contact and joint with clearance that
    touched, ``strikes_<contact>.csv``, ``joint_impulses.csv`` of impulses in joints during impacts
    without duration, and ``happenings.csv`` of all happenings.

    The column crank_angle_rad has the name of its joint if that is no crank, see `crank_column`. It
    is omitted if the scene has no revolute joint. Files with the same names are overwritten. Inside
    a `staged_folder`, all files are written or none, and no file of the user is replaced.

    Raises:
        OSError: the folder can't be written.
        StorageError: an array is too large for the file.

    """
    time = None if every is None else even_instants(result.time, every)
    tables = tables_of(result, time)
    folder.mkdir(parents=True, exist_ok=True)
    arrays, fields = taken_apart(result)
    fields |= {"scene": result.scene.to_data(), "format": FORMAT}
    run = to_json(fields, fallback=plain_data).decode()
    write_netcdf(folder / ARRAYS, arrays, attributes_of(result) | {RUN: run})
    write_document(folder, SUMMARY, _summary(result), tables)


def _summary(result: Result) -> dict[str, Any]:
    """Return the summary of a run; the most important values come first."""
    scene, end = result.scene, float(result.time[-1])
    first, last = (
        {name: getattr(result, name) for name in names}
        for names in (
            ("engine", "outcome", "warnings", "error", "checks"),
            ("settings", "versions", "timings"),
        )
    )
    return {
        "title": scene.title,
        "completed": result.outcome.completed,
        "source": scene.source,
        **first,
        "strikes": {name: _rows(strike_columns(result, name)) for name in scene.all_contacts},
        "levers": {
            body: _peaks(lever_response(result, name))
            for body, name in struck_bodies(scene).items()
        },
        "bending": {
            link: entries(bending_peak_columns(end), bending(result, link).largest)
            for link in bent_links(scene)
        },
        "extremes": {
            # a contact that never existed has no extremes
            name: _ends(extremes) if len(extremes.time) else None
            for name, extremes in result.extremes.items()
        },
        "clearances": {
            name: entries(TOTALS, contact_totals(result, name)) for name in joints_with_play(result)
        },
        "frictions": {
            name: entries(friction_columns(end), friction)
            for name, friction in result.frictions.items()
        },
        "joint_impulses": {
            name: {"greatest_N_s": jumps.size.max(), "at_s": jumps.time[jumps.size.argmax()]}
            for name, jumps in result.joint_impulses.items()
        },
        **last,
        "events": result.events,
        "samples": len(result.time),
        "pairs": {name: sleeve.pairs for name, sleeve in result.sleeves.items()},
        "scene": scene.to_data(),
    }


def _rows(columns: Mapping[str, Column]) -> list[dict[str, Any]]:
    """Return the rows of a table, each by the names of its columns."""
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def _peaks(seen: LeverResponse) -> dict[str, float]:
    """Return the extremes of a struck body's motion and their instants, by name and unit."""
    return _ends(seen, f"_{seen.measure.name}", f"_{seen.measure.word}")


def _ends(seen: Extremes | LeverResponse, name: str = "", word: str = "") -> dict[str, float]:
    """Return the least and the greatest value, and their instants (s), by name."""
    extremes: dict[str, float] = {}
    for end, (value, instant) in (("least", seen.least), ("greatest", seen.greatest)):
        extremes |= {f"{end}{name}": value, f"{end}{word}_at_s": instant}
    return extremes


def load(place: Path) -> Result:
    """Read a result, exactly as it was saved, from its folder or from its file ``result.nc``.

    Raises:
        StorageError: the place holds no run of this program, or the file is damaged.

    """
    place = Path(place)
    file = place if place.suffix == Path(ARRAYS).suffix else place / ARRAYS
    try:
        check_readable(file)
        read = read_netcdf(file)
        fields = json.loads(read.attributes[RUN])
        if other := other_version(fields):
            raise StorageError(f"{file} was written by {other}; {AGAIN}")
        return put_together(read, fields, scene=_scene(fields["scene"], file))
    except (FileNotFoundError, NotADirectoryError):
        raise StorageError(_missing(file)) from None
    except MemoryError as error:
        why = str(error) or "not enough memory"
        raise StorageError(f"{file} is too large for this machine: {why}") from error
    except OSError as error:
        raise StorageError(f"can't read {file}: {error.strerror or error}") from error
    except (ValueError, TypeError, KeyError) as error:
        why = f"no {error} in it" if isinstance(error, KeyError) else str(error)
        raise StorageError(f"{file} is damaged: {why}; {AGAIN}") from error


def _missing(file: Path) -> str:
    """Say what the place holds instead of a run."""
    folder = file.parent
    if not folder.is_dir() or file.name != ARRAYS:
        return (
            f"{folder if file.name == ARRAYS else file} is no folder; give that of a finished run"
        )
    if (folder / SWEEP).is_file():
        return f"{folder} holds a sweep, no run; give the folder of a finished run"
    return f"{folder} has no {ARRAYS}; give the folder of a finished run"


def _scene(data: Any, file: Path) -> Scene:
    try:
        read = parse_document(json.dumps(data, ensure_ascii=False), str(file))
        # No reader needs the text, or the lines of its values.
        return parse_scene(Document(read.name, read.folder, data=data))
    except SceneError as error:
        raise StorageError(f"the scene in {file} is damaged:\n{error}") from error
