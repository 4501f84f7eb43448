"""The files of a run to the Result they were made from."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene, parse_scene
from exudyn_flexlink.source import SceneError, parse_document
from exudyn_flexlink.storage.arrays import Read, Records, told_fields
from exudyn_flexlink.storage.documents import AGAIN, check_readable, read_document
from exudyn_flexlink.storage.errors import ARRAYS, SUMMARY, SWEEP, StorageError
from exudyn_flexlink.storage.manifest import digest, digest_of
from exudyn_flexlink.storage.netcdf import read_netcdf
from exudyn_flexlink.storage.plain import from_plain
from exudyn_flexlink.storage.replacing import turn


def load(folder: Path) -> Result:
    """Read a result back, exactly as it was saved.

    Raises:
        StorageError: the folder holds no run of this program, or a file of it is damaged.

    """
    folder = Path(folder)
    with turn(folder):
        return _load(folder)


def _load(folder: Path) -> Result:
    summary, file = _read_summary(folder), folder / SUMMARY
    try:
        written = summary.pop("sha256")
        _require_written(file, digest_of(summary), written[SUMMARY])
        names = from_plain(dict[str, tuple[str, ...]], summary["names"])
        told = {name: from_plain(kind, summary[name]) for name, kind in told_fields().items()}
        records = Records(_read_arrays(folder / ARRAYS, written[ARRAYS]), names)
        result: Result = records.record(Result, scene=_scene(summary["scene"], file), **told)
    except (KeyError, TypeError) as error:
        why = f"no {error} in it" if isinstance(error, KeyError) else str(error)
        raise StorageError(f"{file} is damaged: {why}; {AGAIN}") from error
    return result


def _require_written(file: Path, found: str, written: str) -> None:
    """Compare the SHA-256 of what is in a file with that of what was written.

    Raises:
        StorageError: it was changed since.

    """
    if found != written:
        other = "" if file.name == SUMMARY else f", or not the one that belongs to {SUMMARY}"
        what = f"it is not what was written{other}"
        raise StorageError(f"{file} is damaged: {what}; {AGAIN}")


def _read_summary(folder: Path) -> dict[str, Any]:
    """Read the summary of a run, as plain data.

    Raises:
        StorageError: the folder holds no run, or its summary can't be read.

    """
    try:
        return read_document(folder / SUMMARY)
    except FileNotFoundError:
        found = f"has no {SUMMARY}" if folder.is_dir() else "is no folder"
        if (folder / SWEEP).is_file():
            found = "holds a sweep, no run"
        raise StorageError(f"{folder} {found}; give the folder of a finished run") from None


def _read_arrays(file: Path, written: str) -> Read:
    """Read the arrays of a run, if they are still those that were `written`, a SHA-256."""
    try:
        check_readable(file)
        _require_written(file, digest(file), written)
        return read_netcdf(file)
    except FileNotFoundError:
        raise StorageError(f"{file} is missing; {AGAIN}") from None
    except MemoryError as error:
        why = str(error) or "not enough memory"
        raise StorageError(f"{file} is too large for this machine: {why}") from error
    except OSError as error:
        raise StorageError(f"can't read {file}: {error.strerror or error}") from error


def _scene(data: Any, file: Path) -> Scene:
    try:
        return parse_scene(parse_document(json.dumps(data, ensure_ascii=False), str(file)))
    except SceneError as error:
        raise StorageError(f"the scene in {file} is damaged:\n{error}") from error
