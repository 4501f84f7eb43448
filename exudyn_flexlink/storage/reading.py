"""The files of a run to the Result they were made from."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene, parse_scene
from exudyn_flexlink.source import SceneError, parse_document
from exudyn_flexlink.storage.arrays import told_fields
from exudyn_flexlink.storage.checking import check_count, check_names, check_result
from exudyn_flexlink.storage.documents import AGAIN, check_readable, read_document
from exudyn_flexlink.storage.errors import ARRAYS, SUMMARY, SWEEP, StorageError
from exudyn_flexlink.storage.manifest import digest
from exudyn_flexlink.storage.netcdf import Read, read_netcdf
from exudyn_flexlink.storage.plain import from_plain
from exudyn_flexlink.storage.records import Records
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
        scene, told = _scene(summary["scene"], file), _told(summary)
        samples = check_count(summary["samples"])
        names = _entry("names", dict[str, tuple[str, ...]], summary)
        check_names(scene, names)
        arrays = _read_arrays(folder / ARRAYS, summary["sha256"][ARRAYS])
        records = Records(arrays, folder / ARRAYS, names)
        result: Result = records.record(Result, scene=scene, **told)
        if len(result.time) != samples:
            raise records.damaged("'time' does not fit")
        records.check(result)
        check_result(result)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise StorageError(f"{file} is damaged: {_reason(error)}; {AGAIN}") from error
    return result


def _read_summary(folder: Path) -> dict[str, Any]:
    """Read the summary of a run, as plain data.

    Raises:
        StorageError: the folder holds no run, or its summary is damaged.

    """
    try:
        return read_document(folder / SUMMARY)
    except FileNotFoundError:
        found = f"has no {SUMMARY}" if folder.is_dir() else "is no folder"
        if (folder / SWEEP).is_file():
            found = "holds a sweep, no run"
        raise StorageError(f"{folder} {found}; give the folder of a finished run") from None


def _read_arrays(file: Path, written: Any) -> Read:
    """Read the arrays of a run, if they are still those that were `written`, a SHA-256."""
    try:
        check_readable(file)
        if digest(file) != written:
            what = f"it is not what was written, or not the one that belongs to {SUMMARY}"
            raise StorageError(f"{file} is damaged: {what}; {AGAIN}")
        return read_netcdf(file)
    except FileNotFoundError:
        raise StorageError(f"{file} is missing; {AGAIN}") from None
    except MemoryError as error:  # an array is as large as its header says
        what = f"or too large for this machine: {error or 'not enough memory'}"
        raise StorageError(f"{file} is damaged, {what}; {AGAIN}") from error
    except OSError as error:
        raise StorageError(f"can't read {file}: {error.strerror or error}") from error


def _scene(data: Any, file: Path) -> Scene:
    try:
        return parse_scene(parse_document(json.dumps(data, ensure_ascii=False), str(file)))
    except SceneError as error:
        raise StorageError(f"the scene in {file} is damaged:\n{error}") from error


def _told(summary: dict[str, Any]) -> dict[str, Any]:
    """Fields of a result that the summary holds."""
    return {name: _entry(name, kind, summary) for name, kind in told_fields().items()}


def _entry(name: str, kind: Any, summary: dict[str, Any]) -> Any:
    """Return an entry of the summary.

    Raises:
        KeyError: there is none.
        ValueError: it is not of its kind; the message names it.

    """
    value = summary[name]
    try:
        return from_plain(kind, value)
    except (KeyError, ValueError) as error:
        raise ValueError(f"'{name}' holds what can't be: {_reason(error)}") from error


def _reason(error: Exception) -> str:
    return f"no {error} in it" if isinstance(error, KeyError) else str(error)
