"""Which files of a folder a run wrote: its manifest names them, each with its SHA-256.

A file is the program's own if the manifest of its folder names it and it still has the content that
was written. Everything else is the user's, also a file of ours that was changed since. Each folder
has a manifest of its own, which names the folders in it that belong to the same result.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
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

PREFIX = ".flexlink-"  # of folders that are there only while something is written
CHUNK = 1 << 20  # bytes read at once
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
    """What stands in a folder, and the SHA-256 of every file in it by its name."""

    what: str
    title: str
    completed: bool
    files: Mapping[str, str]
    folders: tuple[str, ...] = ()

    @property
    def told(self) -> str:
        """What stands in the folder, in words."""
        return f"{self.what} of '{self.title}'" if self.title else self.what


def read_manifest(folder: Path) -> Manifest | None:
    """Read the manifest of a folder; None if it has none, or one that is not this program's."""
    try:
        data = _json(folder / MANIFEST)
        files, folders = dict(data["files"]), tuple(data["folders"])
        if data["program"] != PROGRAM or not all(map(_plain, (*files, *folders))):
            return None
        return Manifest(
            str(data["what"]), str(data["title"]), data["completed"] is True, files, folders
        )
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None


def seal(folder: Path, earlier: Manifest | None = None) -> Manifest:
    """Write a manifest into a folder, and into those in it: of all files that are there.

    What stands in the folder is told by the summary in it. Files are added to an `earlier`
    manifest, if one is given.

    Raises:
        OSError: a file can't be read or written.

    """
    entries = sorted(folder.iterdir())
    folders = [entry for entry in entries if entry.is_dir()]
    for entry in folders:
        seal(entry)
    files = {e.name: digest(e) for e in entries if is_regular(e) and e.name != MANIFEST}
    before = earlier or Manifest(*_content(folder), {})
    manifest = replace(
        before,
        files={**before.files, **files},
        folders=tuple(dict.fromkeys((*before.folders, *(entry.name for entry in folders)))),
    )
    text = json.dumps({"program": PROGRAM, **vars(manifest)}, indent=2, ensure_ascii=False)
    (folder / MANIFEST).write_text(text + "\n", encoding="utf-8")
    return manifest


def own_files(folder: Path) -> dict[str, str]:
    """SHA-256 of all files that the manifests of a folder and of those in it name, by path.

    Paths are relative to `folder`, with "/". Those of a folder inside come before those around it,
    and a manifest comes after the files it names: as long as any of them is there, it is, too.
    """
    return dict(_own(folder, ""))


def _own(folder: Path, prefix: str) -> Iterator[tuple[str, str]]:
    manifest = read_manifest(folder)
    if manifest is None:
        return
    for name in manifest.folders:
        if is_folder(folder / name):
            yield from _own(folder / name, f"{prefix}{name}/")
    for name, content in manifest.files.items():
        yield prefix + name, content
    yield prefix + MANIFEST, digest(folder / MANIFEST)


def is_own(file: Path, content: str | None) -> bool:
    """Tell whether a file still is the regular file with the SHA-256 `content`."""
    return content is not None and is_regular(file) and digest(file) == content


def is_regular(file: Path) -> bool:
    """Tell whether there is a regular file: no link, folder, device or pipe."""
    try:
        return stat.S_ISREG(os.lstat(file).st_mode)
    except (OSError, ValueError):
        return False


def is_folder(folder: Path) -> bool:
    """Tell whether there is a folder, and no link to one."""
    return folder.is_dir() and not folder.is_symlink()


def digest_of(data: Mapping[str, Any]) -> str:
    """SHA-256 of plain data, the same before it is written as JSON and after it is read."""
    return hashlib.sha256(json.dumps(data).encode()).hexdigest()


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
    return "figures", "", False


def _json(file: Path) -> dict[str, Any]:
    if not is_regular(file):
        raise FileNotFoundError(file)
    data: dict[str, Any] = json.loads(file.read_bytes().decode("utf-8"))
    return data


def _plain(name: Any) -> bool:
    """Tell whether a name is one of a file in the very folder."""
    return isinstance(name, str) and name not in ("", ".", "..") and not set(name) & set("/\\\0")
