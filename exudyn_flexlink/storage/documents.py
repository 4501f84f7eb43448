"""Documents of results: a JSON file, with tables as CSV beside it; and the journal of a sweep.

The journal has a line for each row. A line is added as soon as the runs of its row have ended.
A process that is killed leaves at most half a line at the end of the journal; readers omit it.
"""

from __future__ import annotations

import csv
import errno
import os
import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter, ValidationError
from pydantic_core import to_json

from exudyn_flexlink.loading import plain_data
from exudyn_flexlink.storage.replacing import (
    FORMAT,
    PROGRAM,
    StorageError,
    cannot_write,
    check_regular,
    kind_of,
)
from exudyn_flexlink.sweeps import Row

AGAIN = "run the model again"

Column = NDArray[Any] | Sequence[Any]


def write_document(
    folder: Path,
    name: str,
    data: Mapping[str, Any],
    tables: Mapping[str, Mapping[str, Column]],
) -> None:
    """Write a document and its tables, by the names of their files, into an existing folder.

    The `data` include a title and `completed`. JSON has no inf and no nan; null stands for these.
    OSError: the folder can't be written.
    """
    whole = {"program": PROGRAM, "format": FORMAT, **data}
    (folder / name).write_bytes(in_json(whole, indent=2))
    for table, columns in tables.items():
        write_csv(folder / table, columns)


def in_json(
    value: Any, indent: int | None = None, infinite: Literal["null", "constants"] = "null"
) -> bytes:
    """Write dataclasses, mappings and values of NumPy as JSON in lines.

    JSON has no inf and no nan: null stands for these, or, with `constants`, their JavaScript names.
    """
    return to_json(value, indent=indent, inf_nan_mode=infinite, fallback=plain_data) + b"\n"


def write_csv(file: Path, columns: Mapping[str, Column]) -> None:
    """Write columns (N,) under their names: numbers with 12 significant digits; None is empty.

    Raises:
        OSError: the file can't be written.

    """
    lists = [
        column.tolist() if isinstance(column, np.ndarray) else column for column in columns.values()
    ]
    with file.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(columns)
        for row in zip(*lists, strict=True):
            writer.writerow(f"{cell:.12g}" if isinstance(cell, float) else cell for cell in row)


def other_version(document: Mapping[str, Any]) -> str:
    """Return the version that wrote a document of this program; empty if it was this version."""
    written, versions = document.get("format", "unknown"), document.get("versions")
    name = versions.get(PROGRAM, "?") if isinstance(versions, Mapping) else "?"
    return "" if written == FORMAT else f"another version, {PROGRAM} {name} with format {written}"


def check_readable(file: Path) -> None:
    """Refuse a pipe or a device, because reading it might wait for ever.

    Raises:
        StorageError: the file is a pipe or a device.

    """
    if file.exists() and not file.is_file():
        raise StorageError(f"can't read {file}: it is {kind_of(file.resolve())}")


if sys.platform != "win32":
    import fcntl

JOURNAL = "journal.jsonl"
_ROW = TypeAdapter(Row)


class Journal:
    """A file without buffer for the rows of a sweep; `known` has the earlier rows by id."""

    def __init__(self, stream: IO[bytes], known: Mapping[str, Row]) -> None:
        self._stream = stream
        self.known = known

    def add(self, row: Row) -> None:
        """Write a row at once, so that it outlives this process.

        Raises:
            StorageError: the file can't be written.

        """
        line = in_json(row, infinite="constants")
        try:
            if self._stream.write(line) < len(line):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError as error:
            raise StorageError(cannot_write(Path(self._stream.name), error)) from error


@contextmanager
def journal_in(folder: Path, ids: Collection[str]) -> Iterator[Journal]:
    """Open the journal of a sweep to continue it; its known rows are those with these `ids`.

    Raises:
        StorageError: the file can't be written, or a line is damaged.

    """
    file = folder / JOURNAL
    check_regular(folder, JOURNAL)
    try:
        stream = file.open("a+b", buffering=0)
    except OSError as error:
        raise StorageError(cannot_write(file, error)) from error
    with stream:
        stream.seek(0)
        content = stream.read()
        known = {name: row for name, row in rows_of(content, file).items() if name in ids}
        stream.truncate(content.rfind(b"\n") + 1)
        yield Journal(stream, known)


def rows_of(content: bytes, file: Path) -> dict[str, Row]:
    """Return the rows of a journal's complete lines, by id; the later of two equal ids counts.

    Raises:
        StorageError: a line is damaged.

    """
    rows = {}
    for number, line in enumerate(content.split(b"\n")[:-1], start=1):
        try:
            row = _ROW.validate_json(line)
        except ValidationError as error:
            raise StorageError(
                f"{file}:{number}: this line is damaged: {_damage(error)}; delete it, and "
                "'--resume' makes its run again"
            ) from error
        rows[row.id] = row
    return rows


def _damage(error: ValidationError) -> str:
    """Describe the first error in a line."""
    first = error.errors()[0]
    if first["type"] == "json_invalid":
        return "it is no JSON"
    if not first["loc"]:
        return "it is no row of a sweep"
    where = ".".join(map(str, first["loc"][:2]))
    return f"'{where}' is missing" if first["type"] == "missing" else f"'{where}' can't be read"


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Lock the folder of a sweep against other processes; make the folder if it is missing.

    Windows and some network disks have no such lock; the program then continues without it.

    Raises:
        StorageError: another process has the lock, or the folder can't be made.

    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, RecursionError) as error:
        raise StorageError(cannot_write(folder, error)) from error
    if sys.platform == "win32":
        yield
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(handle)
        raise StorageError(f"another process sweeps in {folder}; wait for its end") from None
    except OSError:  # the system has no such lock
        pass
    try:
        yield
    finally:
        os.close(handle)
