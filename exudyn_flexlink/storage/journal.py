"""The journal of a sweep: a line for each row, added as soon as its runs have ended.

A process that is killed leaves at most half a line at its end, which is left out.
"""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from pydantic import TypeAdapter, ValidationError

from exudyn_flexlink.storage.documents import in_json
from exudyn_flexlink.storage.errors import StorageError, cannot_write
from exudyn_flexlink.storage.replacing import check_regular
from exudyn_flexlink.sweeps import Row

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
        line = in_json(row, infinite="constants")
        try:
            if self._stream.write(line) < len(line):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError as error:
            raise StorageError(cannot_write(Path(self._stream.name), error)) from error


@contextmanager
def journal_in(folder: Path, ids: Collection[str]) -> Iterator[Journal]:
    """Open the journal of a sweep to go on with it: what it knows are the rows with these `ids`.

    Raises:
        StorageError: it can't be written, or a line is damaged.

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
    """Rows of the whole lines of a journal, by their ids; a later one counts.

    Raises:
        StorageError: a line is damaged.

    """
    found = {}
    for number, line in enumerate(content.split(b"\n")[:-1], start=1):
        try:
            row = _ROW.validate_json(line)
        except ValidationError as error:
            raise StorageError(
                f"{file}:{number}: this line is damaged: {_damage(error)}; delete it, and "
                "'--resume' makes its run again"
            ) from error
        found[row.id] = row
    return found


def _damage(error: ValidationError) -> str:
    """Say in words what is wrong in a line, first of all."""
    told = error.errors()[0]
    if told["type"] == "json_invalid":
        return "it is no JSON"
    if not told["loc"]:
        return "it is no row of a sweep"
    where = ".".join(map(str, told["loc"][:2]))
    return f"'{where}' is missing" if told["type"] == "missing" else f"'{where}' can't be read"


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Keep other processes out of the folder of a sweep, which is made if it is missing.

    Windows and some network disks have no such lock: there all goes on without it.

    Raises:
        StorageError: another one is in, or the folder can't be made.

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
    except OSError:  # there is no such lock
        pass
    try:
        yield
    finally:
        os.close(handle)
