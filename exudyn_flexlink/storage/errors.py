"""What the files of a run are called, and how to say that one can't be written or read."""

from __future__ import annotations

import errno
from pathlib import Path
from typing import Final

from exudyn_flexlink.raising import Sendable

PROGRAM: Final = "exudyn-flexlink"
FORMAT = 15
SUMMARY, ARRAYS = "summary.json", "result.nc"
COMPARISON, ACCURACY = "comparison.json", "accuracy.json"
STABILITY, SWEEP, FIT = "stability.json", "sweep.json", "fit.json"
MANIFEST = "manifest.json"


class StorageError(Sendable, Exception):
    """A run can't be written or read: a sentence that names the file and says what to do.

    `forcible` tells that it can be written all the same, with `force`.
    """

    def __init__(self, told: str, *, forcible: bool = False) -> None:
        super().__init__(told)
        self.forcible = forcible


def cannot_write(place: Path, error: OSError | RecursionError) -> str:
    """Say plainly why a place can't be written, and what to do."""
    if isinstance(error, RecursionError):  # of `Path.mkdir`, which calls itself for each folder
        return f"can't write {place}: too many folders in each other; choose another place"
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return f"can't write {place}: the disk is full; make room, or choose another place"
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        return f"can't write {place}: no permission to write there; choose another place"
    if error.errno in (errno.ENOENT, errno.ENOTDIR):
        return f"can't write {place}: no folder can be made there; choose another place"
    return f"can't write {place}: {error.strerror or error}; choose another place"
