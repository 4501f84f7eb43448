"""The file of a run to the Result it was made from."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene, parse_scene
from exudyn_flexlink.source import SceneError, parse_document
from exudyn_flexlink.storage.arrays import put_together
from exudyn_flexlink.storage.documents import AGAIN, check_readable, other_version
from exudyn_flexlink.storage.errors import ARRAYS, SWEEP, StorageError
from exudyn_flexlink.storage.netcdf import read_netcdf
from exudyn_flexlink.storage.writing import RUN


def load(place: Path) -> Result:
    """Read a result back, exactly as it was saved, from its folder or from ``result.nc`` itself.

    Raises:
        StorageError: there is no run of this program, or its file is damaged.

    """
    place = Path(place)
    file = place if place.suffix == Path(ARRAYS).suffix else place / ARRAYS
    try:
        check_readable(file)
        read = read_netcdf(file)
        fields = json.loads(read.attributes[RUN])
        if other := other_version(fields):
            raise StorageError(f"{file} was written by {other}; {AGAIN}")
        return put_together(read, fields, scene=_scene(fields["scene"], file))
    except (FileNotFoundError, NotADirectoryError):
        raise StorageError(_missing(file)) from None
    except MemoryError as error:
        why = str(error) or "not enough memory"
        raise StorageError(f"{file} is too large for this machine: {why}") from error
    except OSError as error:
        raise StorageError(f"can't read {file}: {error.strerror or error}") from error
    except (ValueError, TypeError, KeyError) as error:
        why = f"no {error} in it" if isinstance(error, KeyError) else str(error)
        raise StorageError(f"{file} is damaged: {why}; {AGAIN}") from error


def _missing(file: Path) -> str:
    """Say what there is in place of a run."""
    folder = file.parent
    if not folder.is_dir() or file.name != ARRAYS:
        return (
            f"{folder if file.name == ARRAYS else file} is no folder; give that of a finished run"
        )
    if (folder / SWEEP).is_file():
        return f"{folder} holds a sweep, no run; give the folder of a finished run"
    return f"{folder} has no {ARRAYS}; give the folder of a finished run"


def _scene(data: Any, file: Path) -> Scene:
    try:
        read = parse_document(json.dumps(data, ensure_ascii=False), str(file))
        return parse_scene(replace(read, data=data))
    except SceneError as error:
        raise StorageError(f"the scene in {file} is damaged:\n{error}") from error
