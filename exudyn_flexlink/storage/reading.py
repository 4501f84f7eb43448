"""The files of a run to the Result they were made from."""

from __future__ import annotations

import json
import zipfile
import zlib
from collections.abc import Iterable
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.intervals import Intervals
from exudyn_flexlink.result import (
    Checks,
    ContactHistory,
    EnergyHistory,
    Event,
    Extremes,
    MeasuredError,
    Outcome,
    Result,
    SleeveHistory,
)
from exudyn_flexlink.scene import Scene, parse_scene
from exudyn_flexlink.source import SceneError, parse_document
from exudyn_flexlink.storage.checking import BEYOND, check_count, check_result
from exudyn_flexlink.storage.errors import ARRAYS, FORMAT, PROGRAM, SUMMARY, StorageError
from exudyn_flexlink.storage.replacing import kind_of, turn

FloatArray = NDArray[np.float64]


def load(folder: Path) -> Result:
    """Read a result back, exactly as it was saved.

    Raises:
        StorageError: the folder holds no run of this program, or a file of it is damaged.

    """
    folder = Path(folder)
    with turn(folder):
        return _load(folder)


def _load(folder: Path) -> Result:
    summary = read_summary(folder)
    file = folder / SUMMARY
    _check_format(summary, file)
    try:
        scene = _scene(summary["scene"], file)
        arrays = _read_arrays(folder / ARRAYS)
        result = _result(summary, scene, _Arrays(arrays, folder / ARRAYS, summary))
        check_result(result)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise StorageError(f"{file} is damaged: {_reason(error)}; run the model again") from error
    return result


def read_summary(folder: Path) -> dict[str, Any]:
    """Read the summary of a run, as plain data.

    Raises:
        StorageError: the folder holds no run of this program, or its summary is damaged.

    """
    file = Path(folder) / SUMMARY
    try:
        _check_regular(file)
        summary = json.loads(file.read_bytes().decode("utf-8"))
    except (FileNotFoundError, NotADirectoryError):
        found = "is no folder" if not Path(folder).is_dir() else f"has no {SUMMARY}"
        raise StorageError(f"{folder} {found}; give the folder of a finished run") from None
    except OSError as error:
        raise StorageError(f"can't read {file}: {error.strerror or error}") from error
    except (ValueError, RecursionError) as error:
        raise StorageError(f"{file} is damaged: {error}; run the model again") from error
    if not isinstance(summary, dict) or summary.get("program") != PROGRAM:
        raise StorageError(f"{file} was not written by {PROGRAM}; give the folder of a run")
    return summary


def _check_regular(file: Path) -> None:
    """Refuse a pipe or a device, for which reading might wait without an end."""
    if file.exists() and not file.is_file():
        raise StorageError(f"can't read {file}: it is {kind_of(file.resolve())}")


def _check_format(summary: dict[str, Any], file: Path) -> None:
    if summary.get("format") != FORMAT:
        raise StorageError(
            f"{file} has format {summary.get('format')!r}, this program reads {FORMAT}; "
            "run the model again"
        )


class _Arrays:
    """The arrays of a run, checked as they are taken: truncated or mixed up files show here."""

    def __init__(self, arrays: dict[str, FloatArray], file: Path, summary: dict[str, Any]) -> None:
        self.arrays = arrays
        self.file = file
        self.samples = check_count(summary["samples"])
        self.names: dict[str, list[str]] = summary["names"]

    def take(self, key: str, *shape: int) -> FloatArray:
        array = self.arrays.get(key)
        if array is None:
            raise StorageError(f"{self.file} is damaged: no '{key}' in it; run the model again")
        if array.shape != (self.samples, *shape) or array.dtype != np.float64:
            raise StorageError(f"{self.file} is damaged or of another run: '{key}' does not fit")
        return self._finite(key, array)

    def instants(self) -> FloatArray:
        """Instants of the samples: at least one, from 0 on, none before the one it follows."""
        time = self.take("time")
        if not len(time) or time[0] < 0 or np.any(np.diff(time) < 0) or _stands(time):
            raise StorageError(f"{self.file} is damaged: 'time' does not increase from 0 on")
        return time

    def column(self, key: str, unbounded: bool = False) -> NDArray[Any]:
        """An array of its own length; one that is `unbounded` may hold inf."""
        array = self.arrays.get(key)
        if array is None or array.ndim != 1 or array.dtype.kind not in "fib":
            raise StorageError(f"{self.file} is damaged: '{key}' misses; run the model again")
        self._finite(key, array[array != np.inf] if unbounded else array)
        return array

    def _finite(self, key: str, array: NDArray[Any]) -> NDArray[Any]:
        if not np.all(np.abs(array) < BEYOND):  # nan isn't, either
            what = f"'{key}' holds numbers that are not finite, or beyond {BEYOND:g}"
            raise StorageError(f"{self.file} is damaged: {what}; run the model again")
        return array

    def history(self, kind: str, *shape: int) -> dict[str, FloatArray]:
        return {n: self.take(f"{kind}_{i}", *shape) for i, n in enumerate(self.names[kind])}


def _stands(time: FloatArray) -> bool:
    return len(time) > 1 and bool(time[-1] <= time[0])


def _read_arrays(file: Path) -> dict[str, FloatArray]:
    try:
        _check_regular(file)
        # Opened here, since np.load leaves a file it can't read open.
        with file.open("rb") as stream, np.load(stream, allow_pickle=False) as arrays:
            return dict(arrays)
    except FileNotFoundError:
        raise StorageError(f"{file} is missing; run the model again") from None
    except (
        ValueError,
        KeyError,
        EOFError,
        TypeError,
        AttributeError,
        NotImplementedError,
    ) as error:
        raise StorageError(f"{file} is damaged; run the model again") from error
    except (zipfile.BadZipFile, zlib.error) as error:
        raise StorageError(f"{file} is damaged: {error}; run the model again") from error
    except MemoryError as error:  # an array is as large as its header says
        what = f"or too large for this machine: {error or 'not enough memory'}"
        raise StorageError(f"{file} is damaged, {what}; run the model again") from error
    except OSError as error:
        raise StorageError(f"can't read {file}: {error.strerror or error}") from error


def _scene(data: Any, file: Path) -> Scene:
    try:
        return parse_scene(parse_document(json.dumps(data, ensure_ascii=False), str(file)))
    except SceneError as error:
        raise StorageError(f"the scene in {file} is damaged:\n{error}") from error


def _result(summary: dict[str, Any], scene: Scene, arrays: _Arrays) -> Result:
    part_names = tuple(summary["part_names"])
    outcome, checks = summary["outcome"], summary["checks"]
    contacts = {
        name: _contact_history(arrays, f"contacts_{i}")
        for i, name in enumerate(arrays.names["contacts"])
    }
    return Result(
        scene=scene,
        engine=summary["engine"],
        settings={key: _number(value) for key, value in summary["settings"].items()},
        versions=summary["versions"],
        timings={key: _number(value) for key, value in summary["timings"].items()},
        part_names=part_names,
        time=arrays.instants(),
        poses=arrays.take("poses", len(part_names), 3),
        rates=arrays.take("rates", len(part_names), 3),
        drive_torques=arrays.history("drive_torques"),
        joint_forces=arrays.history("joint_forces", 2),
        slot_forces=arrays.history("slot_forces", 2),
        contacts=contacts,
        sleeves={
            name: _sleeve_history(arrays, f"sleeves_{i}", summary["pairs"][name])
            for i, name in enumerate(arrays.names["sleeves"])
        },
        energy=EnergyHistory(*_series(arrays, EnergyHistory, "energy")),
        extremes={
            name: _extremes(arrays, f"extremes_{i}")
            for i, name in enumerate(arrays.names["extremes"])
        },
        laps=tuple(_event(event) for event in summary["laps"]),
        checks=Checks(**{key: _number(value) for key, value in checks.items()}),
        warnings=tuple(summary["warnings"]),
        outcome=Outcome(**{**outcome, "time": _number(outcome["time"])}),
        error=_error(summary.get("error")),
    )


def _error(data: dict[str, Any] | None) -> MeasuredError | None:
    """What is known of a run's error; runs of before this was measured have none."""
    if data is None:
        return None
    numbers = {key: _number(value) for key, value in data.items()}
    neighbour = {key: _number(value) for key, value in data["neighbour"].items()}
    points = tuple(data["points"])
    return MeasuredError(**{**numbers, "points": points, "neighbour": neighbour})


def _sleeve_history(arrays: _Arrays, prefix: str, pairs: dict[str, Any]) -> SleeveHistory:
    names, sides = tuple(pairs["names"]), tuple(map(float, pairs["sides"]))
    force = arrays.take(f"{prefix}_force", len(names))
    touches = _intervals(arrays, f"{prefix}_touches", len(names))
    if len(sides) != len(names):
        raise ValueError(f"the pairs of '{prefix}' do not fit")
    return SleeveHistory(names, sides, force, touches, _number(pairs["deepest_m"]))


def _contact_history(arrays: _Arrays, prefix: str) -> ContactHistory:
    gap, place, force = (arrays.take(f"{prefix}_{key}") for key in ("gap", "place", "force"))
    return ContactHistory(gap, place, force, _intervals(arrays, f"{prefix}_touches", 1))


def _intervals(arrays: _Arrays, prefix: str, pairs: int) -> Intervals:
    """Contacts of a number of pairs; those that last have no end, impacts no bound of the force."""
    empty = Intervals.of()
    columns = {
        field.name: arrays.column(f"{prefix}_{field.name}", field.name in ("end", "peak_force"))
        for field in fields(Intervals)
    }
    found = Intervals(**columns)
    fit = (
        all(column.dtype == getattr(empty, key).dtype for key, column in columns.items())
        and len({len(column) for column in columns.values()}) == 1
        and np.all((found.pair >= 0) & (found.pair < pairs))
        and np.all(found.begin <= found.end)
        and np.all(np.diff(found.begin) >= 0)
    )
    if not fit:
        raise ValueError(f"'{prefix}' do not fit")
    return found


def _extremes(arrays: _Arrays, prefix: str) -> Extremes:
    time, value = (arrays.column(f"{prefix}_{field.name}") for field in fields(Extremes))
    fit = len(time) == len(value) and time.dtype == value.dtype == np.float64
    if not fit or np.any(np.diff(time) < 0):
        raise ValueError(f"the extremes of '{prefix}' do not fit")
    return Extremes(time, value)


def _series(arrays: _Arrays, record: type[Any], prefix: str) -> Iterable[FloatArray]:
    return [arrays.take(f"{prefix}_{field.name}") for field in fields(record)]


def _event(data: dict[str, Any]) -> Event:
    details = {key: _number(value) for key, value in data["details"].items()}
    return Event(_number(data["time"]), data["kind"], data["name"], details)


def _number(value: Any) -> Any:
    """Undo what `plain` did to numbers that are not finite; other text stays text."""
    return float(value) if value in ("inf", "-inf", "nan") else value


def _reason(error: Exception) -> str:
    return f"no {error} in it" if isinstance(error, KeyError) else str(error)
