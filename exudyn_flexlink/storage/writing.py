"""A Result to the files of a run."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, fields, is_dataclass
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from exudyn_flexlink.observables import (
    ContactTotals,
    State,
    Strike,
    contact_totals,
    lever_response,
    sleeves_with_play,
    strikes,
    struck_bodies,
)
from exudyn_flexlink.result import Event, Extremes, Result
from exudyn_flexlink.storage.errors import (
    ARRAYS,
    FORMAT,
    HISTORIES,
    PROGRAM,
    RECORDS,
    SUMMARY,
    StorageError,
    cannot_write,
)
from exudyn_flexlink.storage.replacing import check_regular
from exudyn_flexlink.storage.tables import tables_of, write_csv

_UNITS = {
    "begin": "_s",
    "end": "_s",
    "crank_angle": "_rad",
    "approach_speed": "_m_per_s",
    "place": "_m",
    "impulse": "_N_s",
    "energy_lost": "_J",
    "peak_force": "_N",
}


def save(result: Result, folder: Path) -> None:
    """Write a result into `folder`, which is made if it is missing.

    ``result.npz`` (arrays), ``summary.json``, ``trajectory_<point>.csv`` of the watched point, and
    ``lever_<body>.csv`` of every body that a contact strikes, ``touches_<sleeve>.csv`` of every
    sleeve with clearance. The column crank_angle_rad is left out where the scene has no revolute
    joint. Files of the same names are written over; inside a `staged_folder`, all is written whole
    or not at all, and no file of the user is replaced.

    Raises:
        StorageError: the folder can't be written, or a link or a device is in the way.

    """
    folder = Path(folder)
    tables = tables_of(result)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        check_regular(folder, (ARRAYS, SUMMARY, *tables))
        np.savez(folder / ARRAYS, **_arrays(result))
        text = json.dumps(_summary(result), indent=2, ensure_ascii=False, allow_nan=False)
        (folder / SUMMARY).write_text(text + "\n", encoding="utf-8")
        for name, columns in tables.items():
            write_csv(folder / name, columns)
    except OSError as error:
        raise StorageError(cannot_write(folder, error)) from error


def _arrays(result: Result) -> dict[str, Any]:
    found = {"time": result.time, "poses": result.poses, "rates": result.rates}
    for kind in HISTORIES:
        histories = getattr(result, kind).values()
        found |= {f"{kind}_{i}": series for i, series in enumerate(histories)}
    for kind in RECORDS:
        for i, record in enumerate(getattr(result, kind).values()):
            found |= _columns(f"{kind}_{i}", record)
    return found | _columns("energy", result.energy)


def _columns(prefix: str, record: Any) -> dict[str, Any]:
    """Arrays of a dataclass, and of those that it holds, by name."""
    found = {}
    for key, value in _fields(record).items():
        if isinstance(value, np.ndarray):
            found[f"{prefix}_{key}"] = value
        elif is_dataclass(value):
            found |= _columns(f"{prefix}_{key}", value)
    return found


def _fields(record: Any) -> dict[str, Any]:
    """Fields of a dataclass by name, not copied."""
    return {field.name: getattr(record, field.name) for field in fields(record)}


def _summary(result: Result) -> dict[str, Any]:
    scene = result.scene
    found = {
        "program": PROGRAM,
        "format": FORMAT,
        "title": scene.title,
        "source": scene.source,
        "engine": result.engine,
        "outcome": asdict(result.outcome),
        "warnings": list(result.warnings),
        "error": None if result.error is None else asdict(result.error),
        "checks": asdict(result.checks),
        "strikes": {name: _strikes(result, name) for name in scene.contacts},
        "levers": {body: _peaks(result, name) for body, name in struck_bodies(scene).items()},
        "extremes": {name: _extremes(own) for name, own in result.extremes.items()},
        "sleeves": {
            name: contact_data(contact_totals(result, name)) for name in sleeves_with_play(result)
        },
        "timings": dict(result.timings),
        "settings": dict(result.settings),
        "versions": dict(result.versions),
        "laps": _told(result.laps),
        "events": _told(result.events),
        "samples": len(result.time),
        "part_names": list(result.part_names),
        "names": {kind: list(getattr(result, kind)) for kind in (*HISTORIES, *RECORDS)},
        "pairs": {
            name: {
                "names": list(sleeve.pairs),
                "sides": list(sleeve.sides),
                "deepest_m": sleeve.deepest,
            }
            for name, sleeve in result.sleeves.items()
        },
        "scene": scene.to_data(),
    }
    data: dict[str, Any] = plain(found)
    return data


def _told(events: Iterable[Event]) -> list[dict[str, Any]]:
    return [{**_fields(event), "details": dict(event.details)} for event in events]


def _strikes(result: Result, contact: str) -> list[dict[str, Any]]:
    """Strikes for the reader of the summary: names with units (they are not read back)."""
    return [strike_data(strike) for strike in strikes(result, contact)]


def strike_data(strike: Strike) -> dict[str, Any]:
    """Fields of a strike by name and unit."""
    return {f"{key}{_UNITS.get(key, '')}": value for key, value in _fields(strike).items()}


def contact_data(totals: ContactTotals) -> dict[str, float]:
    """How much a link touched its guide, by name and unit."""
    return {
        **{f"part_of_time_{state.name.lower()}": totals.fractions[state] for state in State},
        "touches": totals.touches,
        "impacts": totals.impacts,
        "impulse_N_s": totals.impulse,
        "energy_lost_J": totals.energy_lost,
        "longest_touch_s": totals.longest,
    }


def _peaks(result: Result, contact: str) -> dict[str, float]:
    seen = lever_response(result, contact)
    (least, least_at), (greatest, greatest_at) = seen.least, seen.greatest
    return {
        "least_angle_rad": least,
        "least_angle_at_s": least_at,
        "greatest_angle_rad": greatest,
        "greatest_angle_at_s": greatest_at,
    }


def _extremes(own: Extremes) -> dict[str, float] | None:
    """The least and the greatest of a quantity; None of a contact that never was."""
    if not len(own.time):
        return None
    (least, least_at), (greatest, greatest_at) = own.least, own.greatest
    return {
        "least": least,
        "least_at_s": least_at,
        "greatest": greatest,
        "greatest_at_s": greatest_at,
    }


def plain(value: Any) -> Any:
    """Turn values into what JSON has: it knows neither numpy's numbers nor inf and nan."""
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not isfinite(value):
        return str(value)
    return value
