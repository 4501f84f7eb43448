"""Which files of a folder a result wrote: its manifest names them, each with its SHA-256.

A file is the program's own if the manifest of its folder names it and it still has the content that
was written. Everything else is the user's, also a file of ours that was changed since. Each folder
has a manifest of its own, which names the folders in it that belong to the same result. While a
result takes the place of an earlier one, the manifest names the files of both.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

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
CHUNK = 1 << 20  # bytes read at once
FIGURES = "figures"  # what a folder holds that has no document
KINDS = {
    SUMMARY: "run",
    COMPARISON: "comparison",
    ACCURACY: "study",
    SWEEP: "sweep",
    STABILITY: "stability",
}
"""What a folder holds, by the document that is in it."""


@dataclass(frozen=True)
class Manifest:
    """What stands in a folder, and the SHA-256 of every file in it by its name.

    `earlier` is likewise, of the result whose place this one takes; it is empty once that is done.
    """

    what: str
    title: str
    completed: bool
    files: Mapping[str, str] = field(default_factory=dict)
    folders: tuple[str, ...] = ()
    earlier: Mapping[str, str] = field(default_factory=dict)

    @property
    def told(self) -> str:
        """What stands in the folder, in words."""
        return f"{self.what} of '{self.title}'" if self.title else self.what

    def write(self, folder: Path) -> None:
        """Write it into a folder, in one move.

        Raises:
            OSError: it can't be written.

        """
        text = json.dumps({"program": PROGRAM, **vars(self)}, indent=2, ensure_ascii=False)
        beside = folder / f"{PREFIX}{MANIFEST}"
        beside.write_text(text + "\n", encoding="utf-8")
        os.replace(beside, folder / MANIFEST)


def read_manifest(folder: Path) -> Manifest | None:
    """Read the manifest of a folder; None if it has none, or one that is not this program's."""
    try:
        data = _json(folder / MANIFEST)
        files, folders = dict(data["files"]), tuple(data["folders"])
        earlier = dict(data.get("earlier", {}))
        if data["program"] != PROGRAM or not all(map(_plain, (*files, *earlier, *folders))):
            return None
        what, title = str(data["what"]), str(data["title"])
        return Manifest(what, title, data["completed"] is True, files, folders, earlier)
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None


def manifest_of(folder: Path) -> Manifest:
    """Return the manifest of a folder that holds nothing but a result, as it is now.

    What stands in the folder is told by the document in it.

    Raises:
        OSError: a file can't be read.

    """
    entries = sorted(folder.iterdir())
    files = {entry.name: digest(entry) for entry in entries if is_regular(entry)}
    folders = tuple(entry.name for entry in entries if entry.is_dir())
    return Manifest(*_content(folder), files, folders)


def own_files(folder: Path) -> dict[str, set[str]]:
    """SHA-256 of all files that the manifests of a folder and of those in it name, by path.

    Paths are relative to `folder`, with "/". A file has two while a result replaces another.
    """
    found: dict[str, set[str]] = {}
    for name, content in _own(folder, ""):
        found.setdefault(name, set()).add(content)
    return found


def _own(folder: Path, prefix: str) -> Iterator[tuple[str, str]]:
    manifest = read_manifest(folder)
    if manifest is None:
        return
    for name in manifest.folders:
        if is_folder(folder / name):
            yield from _own(folder / name, f"{prefix}{name}/")
    for name, content in (*manifest.files.items(), *manifest.earlier.items()):
        yield prefix + name, content
    yield prefix + MANIFEST, digest(folder / MANIFEST)


def is_own(file: Path, contents: set[str] | None) -> bool:
    """Tell whether a file still is a regular file with one of these SHA-256."""
    return bool(contents) and is_regular(file) and digest(file) in (contents or ())


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
    found = hashlib.sha256()
    with file.open("rb") as stream:
        while chunk := stream.read(CHUNK):
            found.update(chunk)
    return found.hexdigest()


def _content(folder: Path) -> tuple[str, str, bool]:
    """What stands in a folder, its title, and whether it is complete."""
    for name, what in KINDS.items():
        if is_regular(folder / name):
            data = _json(folder / name)
            return what, data["title"], data["completed"]
    return FIGURES, "", False


def _json(file: Path) -> dict[str, Any]:
    if not is_regular(file):
        raise FileNotFoundError(file)
    data: dict[str, Any] = json.loads(file.read_bytes().decode("utf-8"))
    return data


def _plain(name: Any) -> bool:
    """Tell whether a name is one of a file in the very folder."""
    return isinstance(name, str) and name not in ("", ".", "..") and not set(name) & set("/\\\0")
