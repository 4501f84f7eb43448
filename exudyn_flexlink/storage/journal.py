"""The journal of a sweep: a line for each row, added as soon as its runs have ended.

A process that is killed leaves at most half a line at its end, which is left out.
"""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from pydantic import TypeAdapter, ValidationError

from exudyn_flexlink.storage.documents import damage, in_json
from exudyn_flexlink.storage.errors import StorageError, cannot_write
from exudyn_flexlink.sweeps import Row, Sweep

if sys.platform != "win32":
    import fcntl

JOURNAL = "journal.jsonl"
_ROW = TypeAdapter(Row)


class Journal:
    """Rows of a sweep in a file without a buffer; `known` are those before, by their ids."""

    def __init__(self, stream: IO[bytes], known: Mapping[str, Row]) -> None:
        self._stream = stream
        self.known = known

    def add(self, row: Row) -> None:
        """Keep a row: it outlives this process, however that ends.

        Raises:
            StorageError: the file can't be written.

        """
        line = in_json(row)
        try:
            if self._stream.write(line) < len(line):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError as error:
            raise StorageError(cannot_write(Path(self._stream.name), error)) from error


def rows_in(file: Path) -> Iterator[Row]:
    """Rows of a journal's whole lines.

    Raises:
        OSError: the file can't be read.
        StorageError: a line is damaged.

    """
    return _lines(file.read_bytes(), file)


def rows_kept(stream: IO[bytes], sweep: Sweep) -> dict[str, Row]:
    """Return the rows of a journal, and cut half a line off its end.

    Raises:
        StorageError: a line is damaged.

    """
    ids = {point.id for point in sweep.points}
    stream.seek(0)
    content = stream.read()
    stream.truncate(content.rfind(b"\n") + 1)
    return {row.id: row for row in _lines(content, Path(stream.name)) if row.id in ids}


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Keep other processes out of the folder of a sweep, which is made if it is missing.

    Windows and some network disks have no such lock: there all goes on without it.

    Raises:
        StorageError: another one is in, or the folder can't be made.

    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StorageError(cannot_write(folder, error)) from error
    if sys.platform == "win32":
        yield
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if isinstance(error, BlockingIOError):
            os.close(handle)
            raise StorageError(f"another process sweeps in {folder}; wait for its end") from None
    try:
        yield
    finally:
        os.close(handle)


def _lines(content: bytes, file: Path) -> Iterator[Row]:
    whole, _, _ = content.rpartition(b"\n")  # of the rest the writer was killed
    for number, line in enumerate(whole.split(b"\n") if whole else (), start=1):
        try:
            yield _ROW.validate_json(line)
        except ValidationError as error:
            why = damage(error, "row of a sweep")
            raise StorageError(
                f"{file}:{number}: this line is damaged: {why}; delete it, and '--resume' makes "
                "its run again"
            ) from error
