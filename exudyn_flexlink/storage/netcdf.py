"""Arrays with names, dimensions and attributes to a file of netCDF, and back.

The format is netCDF-3 with 64-bit offsets: SciPy writes it, and nearly everything reads it. What it
lacks is made up for: names are in UTF-8, as the format demands; truth values are bytes, marked as
xarray marks them; texts are rows of characters; arrays without any element are only named. The
SHA-256 of the file, in which that of 64 zeros stands in its place, tells whether it is as written.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from exudyn_flexlink.storage.arrays import Array, Read
from exudyn_flexlink.storage.errors import StorageError

LARGEST = 2**31 - 4  # bytes of one array in a file, as SciPy writes it
EMPTY = "dimensions_of_length_0"
CHECKED = "sha256"  # the attribute, which comes first, and
BLANK = "0" * 64  # what it is until the file is whole
HEAD = 1 << 20  # bytes of a file in which it stands: names of dimensions come before
CODES = {"f": "d", "i": "i", "b": "b", "S": "c"}  # of files, by kinds of numpy


def write_netcdf(file: Path, arrays: Mapping[str, Array], attributes: Mapping[str, str]) -> None:
    """Write arrays of floats, integers of 32 bits, truth values or texts.

    Raises:
        OSError: the file can't be written.
        StorageError: an array is too large for the format.

    """
    # scipy takes long to import, which those who only replace a file should not wait for
    from scipy.io import netcdf_file  # noqa: PLC0415

    sizes = _sizes(arrays)
    empty = [dimension for dimension, size in sizes.items() if not size]
    for name, array in arrays.items():
        if array.values.nbytes > LARGEST:
            raise StorageError(
                f"can't write {file}: '{name}' is larger than 2 GiB; set a larger 'run.sample'"
            )
    with file.open("wb") as stream, netcdf_file(stream, "w", version=2) as written:
        told = {CHECKED: BLANK, **attributes}
        _put(written, told | ({EMPTY: json.dumps(empty)} if empty else {}))
        for dimension, size in sizes.items():
            if size:
                written.createDimension(_encoded(dimension), size)
        for name, array in arrays.items():
            if array.values.size:
                _write(written, name, array)
    place, _, digest = _check(file)
    with file.open("r+b") as blank:
        blank.seek(place)
        blank.write(digest)


def _check(file: Path) -> tuple[int, bytes, bytes]:
    """Return where the SHA-256 of a file stands in it, what it says, and what it should say."""
    name = CHECKED.encode().ljust(8, b"\0")  # then come its type and length, of 4 bytes each
    with file.open("rb") as stream:
        head = stream.read(HEAD)
        begin = head.find(name) + len(name) + 8
        end = begin + len(BLANK)
        found = hashlib.sha256(head[:begin] + BLANK.encode() + head[end:])
        while chunk := stream.read(HEAD):
            found.update(chunk)
    return begin, head[begin:end], found.hexdigest().encode()


def _sizes(arrays: Mapping[str, Array]) -> dict[str, int]:
    """Lengths of all dimensions."""
    found: dict[str, int] = {}
    for array in arrays.values():
        found |= zip(array.dimensions, array.values.shape, strict=True)
    return found


def _write(written: Any, name: str, array: Array) -> None:
    values, told = array.values, dict(array.attributes)
    dimensions = [_encoded(dimension) for dimension in array.dimensions]
    if values.dtype.kind == "U":
        values = np.char.encode(values, "utf-8")
        letters = f"letters_{values.itemsize}"
        if letters not in written.dimensions:
            written.createDimension(letters, values.itemsize)
        dimensions.append(letters)
        values = np.ascontiguousarray(values).view("S1").reshape(*values.shape, -1)
        told["_Encoding"] = "utf-8"
    elif values.dtype.kind == "b":
        values = values.astype(np.int8)
        told["dtype"] = "bool"
    code = "b" if values.dtype == np.int8 else CODES[values.dtype.kind]
    made = written.createVariable(_encoded(name), code, dimensions)
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
    _, told, found = _check(file)
    if told != found:
        raise ValueError("it is not what was written")
    from scipy.io import netcdf_file  # noqa: PLC0415 - see write_netcdf

    with file.open("rb") as stream, netcdf_file(stream, "r", mmap=False) as read:
        arrays = {_decoded(name): _read(own) for name, own in read.variables.items()}
        lengths = {_decoded(name): size or 0 for name, size in read.dimensions.items()}
        attributes = {name: text.decode("utf-8") for name, text in read._attributes.items()}
        empty = json.loads(attributes.get(EMPTY, "[]"))
        return Read(arrays, lengths | dict.fromkeys(empty, 0), attributes)


def _read(own: Any) -> Array:
    dimensions, values = tuple(map(_decoded, own.dimensions)), np.asarray(own.data)
    if values.dtype.kind == "S":
        rows = np.ascontiguousarray(values).view(f"S{values.shape[-1]}")[..., 0]
        return Array(dimensions[:-1], np.char.decode(rows, "utf-8"), {})
    values = values.astype(values.dtype.newbyteorder("="))
    if values.dtype == np.int8 and np.all((values == 0) | (values == 1)):
        values = values.astype(np.bool_)
    return Array(dimensions, values, {})
