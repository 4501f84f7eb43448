"""Which files of a folder a result wrote: its manifest names them, each with its SHA-256.

A file is the program's own if the manifest names it and it still has a content that was written.
Everything else is the user's, also a file of ours that was changed since. While a result takes the
place of an earlier one, a file may have the content of either.

What the files of a run are called, and how to say that one can't be written or read.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import stat
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Annotated, Final, Literal

from pydantic import AfterValidator, TypeAdapter
from pydantic_core import to_json

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


FIGURES = "figures"  # what a folder holds that has no document
KINDS = {
    SUMMARY: "run",
    COMPARISON: "comparison",
    ACCURACY: "study",
    SWEEP: "sweep",
    STABILITY: "stability",
    FIT: "fit",
}
"""What a folder holds, by the document that is in it."""


def _inside(name: str) -> str:
    """Return a path, with "/", that leads to a file in the folder or below; else ValueError."""
    if {"", ".", ".."} & set(name.split("/")) or set(name) & set("\\\0"):
        raise ValueError(f"'{name}' is no name of a file in the folder")
    return name


Name = Annotated[str, AfterValidator(_inside)]


@dataclass(frozen=True)
class Manifest:
    """What stands in a folder, and the SHA-256 that every file of it may have, by its path."""

    what: str
    title: str
    completed: bool
    files: dict[Name, tuple[str, ...]]
    program: Literal["exudyn-flexlink"] = PROGRAM

    @property
    def told(self) -> str:
        """What stands in the folder, in words."""
        return f"{self.what} of '{self.title}'" if self.title else self.what

    def content(self) -> bytes:
        """Return what stands in its file."""
        return to_json(self, indent=2) + b"\n"


_MANIFEST = TypeAdapter(Manifest)


def read_manifest(folder: Path) -> Manifest | None:
    """Read the manifest of a folder; None if it has none, or one that is not this program's."""
    file = folder / MANIFEST
    try:
        return _MANIFEST.validate_json(file.read_bytes()) if is_regular(file) else None
    except (OSError, ValueError):
        return None


def manifest_of(folder: Path) -> Manifest:
    """Return the manifest of a folder that holds nothing but a result, as it is now.

    Raises:
        OSError: a file can't be read.

    """
    files: dict[str, tuple[str, ...]] = {
        file.relative_to(folder).as_posix(): (digest(file),)
        for file in sorted(folder.rglob("*"))
        if is_regular(file)
    }
    document = next((name for name in KINDS if name in files), None)
    if document is None:
        return Manifest(FIGURES, "", False, files)
    told = json.loads((folder / document).read_bytes())
    return Manifest(KINDS[document], told["title"], told["completed"], files)


def own_files(folder: Path) -> tuple[str, ...]:
    """Paths of the files that the manifest of a folder names, with "/", and of that itself."""
    manifest = read_manifest(folder)
    return () if manifest is None else (MANIFEST, *manifest.files)


def folders_to(folder: Path, name: str) -> list[Path]:
    """Folders on the way from a folder to a file in it, the outermost first."""
    return [folder / above for above in PurePosixPath(name).parents][-2::-1]


def is_own(folder: Path, name: str, contents: tuple[str, ...]) -> bool:
    """Tell whether a file of a folder, reached without a link, has one of these SHA-256."""
    reached = all(is_folder(above) for above in folders_to(folder, name))
    return reached and is_regular(folder / name) and digest(folder / name) in contents


def is_regular(file: Path) -> bool:
    """Tell whether there is a regular file: no link, folder, device or pipe."""
    try:
        return stat.S_ISREG(os.lstat(file).st_mode)
    except (OSError, ValueError):
        return False


def is_folder(folder: Path) -> bool:
    """Tell whether there is a folder, and no link to one."""
    return folder.is_dir() and not folder.is_symlink()


def digest(file: Path) -> str:
    """SHA-256 of a file, or OSError if it can't be read."""
    return hashlib.sha256(file.read_bytes()).hexdigest()
