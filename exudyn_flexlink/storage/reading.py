"""The file of a run to the Result it was made from."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError, create_model

from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene, parse_scene
from exudyn_flexlink.source import SceneError, parse_document
from exudyn_flexlink.storage.arrays import Records, told_fields
from exudyn_flexlink.storage.documents import AGAIN, check_readable, damage, other_version
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
        run = json.loads(read.attributes[RUN])
        if other := other_version(run):
            raise StorageError(f"{file} was written by {other}; {AGAIN}")
        told = vars(_told().model_validate(run))
        scene = _scene(told.pop("scene"), file)
        result: Result = Records(read, told.pop("names")).record(Result, scene=scene, **told)
    except (FileNotFoundError, NotADirectoryError):
        raise StorageError(_missing(file)) from None
    except MemoryError as error:
        why = str(error) or "not enough memory"
        raise StorageError(f"{file} is too large for this machine: {why}") from error
    except OSError as error:
        raise StorageError(f"can't read {file}: {error.strerror or error}") from error
    except (ValueError, TypeError, KeyError) as error:
        raise _unreadable(file, error) from error
    return result


@cache
def _told() -> type[BaseModel]:
    """What the text in the file of a run tells: all of it that is no array."""
    fields: dict[str, Any] = {name: (kind, ...) for name, kind in told_fields().items()}
    names = dict[str, tuple[str, ...]]
    return create_model("Told", names=(names, ...), scene=(dict[str, Any], ...), **fields)


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


def _unreadable(file: Path, error: Exception) -> StorageError:
    """Say why a file is damaged."""
    why = damage(error, "run") if isinstance(error, ValidationError) else str(error)
    return StorageError(f"{file} is damaged: {why}; {AGAIN}")


def _scene(data: Any, file: Path) -> Scene:
    try:
        read = parse_document(json.dumps(data, ensure_ascii=False), str(file))
        return parse_scene(replace(read, data=data))
    except SceneError as error:
        raise StorageError(f"the scene in {file} is damaged:\n{error}") from error
