"""Which files of a folder a result wrote: its manifest names them, each with its SHA-256.

A file is the program's own if the manifest of its folder names it and it still has a content that
was written. Everything else is the user's, also a file of ours that was changed since. Each folder
has a manifest of its own, which names the folders in it that belong to the same result. While a
result takes the place of an earlier one, a file may have the content of either.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, TypeAdapter
from pydantic_core import to_json

from exudyn_flexlink.storage.errors import (
    ACCURACY,
    COMPARISON,
    MANIFEST,
    PROGRAM,
    STABILITY,
    SUMMARY,
    SWEEP,
)

PREFIX = ".flexlink-"  # of what is there only while something is written
FIGURES = "figures"  # what a folder holds that has no document
KINDS = {
    SUMMARY: "run",
    COMPARISON: "comparison",
    ACCURACY: "study",
    SWEEP: "sweep",
    STABILITY: "stability",
}
"""What a folder holds, by the document that is in it."""


def _inside(name: str) -> str:
    """Return a name that is one of a file in the very folder.

    Raises:
        ValueError: it leads elsewhere.

    """
    if name in ("", ".", "..") or set(name) & set("/\\\0"):
        raise ValueError(f"'{name}' is no name of a file")
    return name


Name = Annotated[str, AfterValidator(_inside)]


@dataclass(frozen=True)
class Manifest:
    """What stands in a folder, and the SHA-256 that every file in it may have, by its name."""

    what: str
    title: str
    completed: bool
    files: dict[Name, tuple[str, ...]]
    folders: tuple[Name, ...] = ()
    program: Literal["exudyn-flexlink"] = PROGRAM

    @property
    def told(self) -> str:
        """What stands in the folder, in words."""
        return f"{self.what} of '{self.title}'" if self.title else self.what

    def write(self, folder: Path) -> None:
        """Write it into a folder, in one move.

        Raises:
            OSError: it can't be written.

        """
        beside = folder / f"{PREFIX}{MANIFEST}"
        beside.write_bytes(to_json(self, indent=2) + b"\n")
        os.replace(beside, folder / MANIFEST)


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
    entries = sorted(folder.iterdir())
    files: dict[str, tuple[str, ...]] = {
        entry.name: (digest(entry),) for entry in entries if is_regular(entry)
    }
    folders = tuple(entry.name for entry in entries if entry.is_dir())
    for document, what in KINDS.items():
        if document in files:
            told = json.loads((folder / document).read_bytes())
            return Manifest(what, told["title"], told["completed"], files, folders)
    return Manifest(FIGURES, "", False, files, folders)


def own_files(folder: Path) -> dict[str, tuple[str, ...]]:
    """SHA-256 of all files that the manifests of a folder and of those in it name, by path.

    Paths are relative to `folder`, with "/".
    """
    manifest = read_manifest(folder)
    if manifest is None:
        return {}
    found = {MANIFEST: (digest(folder / MANIFEST),), **manifest.files}
    for name in filter(lambda name: is_folder(folder / name), manifest.folders):
        found |= {f"{name}/{file}": own for file, own in own_files(folder / name).items()}
    return found


def is_own(file: Path, contents: tuple[str, ...]) -> bool:
    """Tell whether a file still is a regular file with one of these SHA-256."""
    return is_regular(file) and digest(file) in contents


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
    """SHA-256 of a file.

    Raises:
        OSError: it can't be read.

    """
    return hashlib.sha256(file.read_bytes()).hexdigest()
