"""Arrays with names, dimensions and attributes to a file of netCDF, and back.

The format is netCDF-3 with 64-bit offsets: SciPy writes it, and nearly everything reads it. What it
lacks is made up for: names are in UTF-8, as the format demands; truth values are bytes, marked as
xarray marks them; texts are rows of characters; arrays without any element are left out. The
SHA-256 of the file, in which 64 zeros stand in its place, tells whether it is as written.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.storage.arrays import Array, Read
from exudyn_flexlink.storage.errors import StorageError

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
