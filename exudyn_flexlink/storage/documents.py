"""What a result says of itself: a JSON file, with tables as CSV beside it."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic_core import to_json

from exudyn_flexlink.loading import plain_data
from exudyn_flexlink.storage.errors import FORMAT, PROGRAM, StorageError
from exudyn_flexlink.storage.replacing import kind_of

AGAIN = "run the model again"

Column = NDArray[Any] | Sequence[Any]


def write_document(
    folder: Path,
    name: str,
    data: Mapping[str, Any],
    tables: Mapping[str, Mapping[str, Column]],
) -> None:
    """Write a document and its tables, by the names of their files, into an existing folder.

    The `data` have a title, and tell whether the result is `completed`. JSON knows neither inf nor
    nan: null stands for these. OSError: the folder can't be written.
    """
    whole = {"program": PROGRAM, "format": FORMAT, **data}
    (folder / name).write_bytes(in_json(whole, indent=2))
    for table, columns in tables.items():
        write_csv(folder / table, columns)


def in_json(
    value: Any, indent: int | None = None, infinite: Literal["null", "constants"] = "null"
) -> bytes:
    """Write dataclasses, mappings and values of NumPy as JSON in lines.

    For inf and nan stands null, or what JavaScript calls them, `constants`, which JSON has not.
    """
    return to_json(value, indent=indent, inf_nan_mode=infinite, fallback=plain_data) + b"\n"


def write_csv(file: Path, columns: Mapping[str, Column]) -> None:
    """Write columns (N,) under their names: numbers with 12 significant digits, nothing for None.

    Raises:
        OSError: the file can't be written.

    """
    lists = [own.tolist() if isinstance(own, np.ndarray) else own for own in columns.values()]
    with file.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(columns)
        for row in zip(*lists, strict=True):
            writer.writerow(f"{own:.12g}" if isinstance(own, float) else own for own in row)


def other_version(document: Mapping[str, Any]) -> str:
    """Name the version that wrote a document of this program; empty if it was this one."""
    there, versions = document.get("format", "unknown"), document.get("versions")
    name = versions.get(PROGRAM, "?") if isinstance(versions, Mapping) else "?"
    return "" if there == FORMAT else f"another version, {PROGRAM} {name} with format {there}"


def check_readable(file: Path) -> None:
    """Refuse a pipe or a device, for which reading might wait without an end.

    Raises:
        StorageError: it is one.

    """
    if file.exists() and not file.is_file():
        raise StorageError(f"can't read {file}: it is {kind_of(file.resolve())}")
