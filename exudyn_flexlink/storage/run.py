"""A Result to the files of a run, and back."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from pydantic_core import to_json

from exudyn_flexlink.loading import plain_data
from exudyn_flexlink.observables import (
    ContactTotals,
    LeverResponse,
    State,
    Strike,
    contact_totals,
    crank_column,
    joints_with_play,
    lever_response,
    strikes,
    struck_bodies,
)
from exudyn_flexlink.result import Extremes, FrictionHistory, Result
from exudyn_flexlink.scene import Scene, parse_scene
from exudyn_flexlink.source import Document, SceneError, parse_document
from exudyn_flexlink.storage.arrays import attributes_of, put_together, taken_apart
from exudyn_flexlink.storage.documents import AGAIN, check_readable, other_version, write_document
from exudyn_flexlink.storage.errors import ARRAYS, FORMAT, SUMMARY, SWEEP, StorageError
from exudyn_flexlink.storage.netcdf import read_netcdf, write_netcdf
from exudyn_flexlink.storage.tables import UNITS, tables_of
from exudyn_flexlink.sweeps import column_of

RUN = "run"
"""The attribute of ``result.nc`` with the fields of a result that are no arrays, as JSON."""


def save(result: Result, folder: Path) -> None:
    """Write a result into `folder`, which is made if it is missing.

    ``result.nc`` is all of it. The rest is for readers: ``summary.json``,
    ``trajectory_<point>.csv`` of the watched point, ``forces.csv`` of all forces and torques,
    ``lever_<body>.csv`` of every body that a contact strikes, and ``touches_<joint>.csv`` of every
    joint with clearance that touched. The column crank_angle_rad has the name of its joint where
    that is no crank, see `crank_column`, and is left out where the scene has no revolute joint.
    Files of the same names are written over; inside a `staged_folder`, all is written whole or not
    at all, and no file of the user is replaced.

    Raises:
        OSError: the folder can't be written.
        StorageError: an array is too large for the file.

    """
    tables = tables_of(result)
    folder.mkdir(parents=True, exist_ok=True)
    arrays, fields = taken_apart(result)
    fields |= {"scene": result.scene.to_data(), "format": FORMAT}
    run = to_json(fields, fallback=plain_data).decode()
    write_netcdf(folder / ARRAYS, arrays, attributes_of(result) | {RUN: run})
    write_document(folder, SUMMARY, _summary(result), tables)


def _summary(result: Result) -> dict[str, Any]:
    """What is told of a run: first what most want to know."""
    scene = result.scene
    first, last = (
        {name: getattr(result, name) for name in names}
        for names in (
            ("engine", "outcome", "warnings", "error", "checks"),
            ("settings", "versions", "timings"),
        )
    )
    return {
        "title": scene.title,
        "completed": result.outcome.completed,
        "source": scene.source,
        **first,
        "strikes": {
            name: [_strike(strike, scene) for strike in strikes(result, name)]
            for name in scene.all_contacts
        },
        "levers": {
            body: _peaks(lever_response(result, name))
            for body, name in struck_bodies(scene).items()
        },
        "extremes": {
            # a contact that never was has none
            name: _ends(own) if len(own.time) else None
            for name, own in result.extremes.items()
        },
        "clearances": {
            name: _totals(contact_totals(result, name)) for name in joints_with_play(result)
        },
        "frictions": {
            name: _friction(own, float(result.time[-1])) for name, own in result.frictions.items()
        },
        **last,
        "events": result.events,
        "samples": len(result.time),
        "pairs": {name: sleeve.pairs for name, sleeve in result.sleeves.items()},
        "scene": scene.to_data(),
    }


def _strike(strike: Strike, scene: Scene) -> dict[str, Any]:
    """Fields of a strike by name and unit; without laps and angle where nothing turns."""
    absent = [key for key in ("lap", "crank_angle") if getattr(strike, key) is None]
    names, units = {"crank_angle": crank_column(scene)}, UNITS | {"crank_angle": "rad"}
    return {
        column_of(names.get(key) or key, scene.unit_of(strike.contact, units.get(key, ""))): value
        for key, value in vars(strike).items()
        if key not in absent
    }


def _totals(totals: ContactTotals) -> dict[str, float]:
    """How much a link touched its guide, by name and unit."""
    return {
        **{f"part_of_time_{state.name.lower()}": totals.fractions[state] for state in State},
        "touches": totals.touches,
        "impacts": totals.impacts,
        "impulse_N_s": totals.impulse,
        "energy_lost_J": totals.energy_lost,
        "longest_touch_s": totals.longest,
    }


def _friction(own: FrictionHistory, end: float) -> dict[str, Any]:
    """What friction in a joint did up to the end (s) of a run, by name and unit."""
    return {
        "energy_lost_J": float(own.lost[-1]),
        "time_at_rest_s": own.rest_until(end),
        "rests_begin_s": own.begin.tolist(),
        "rests_end_s": np.minimum(own.end, end).tolist(),
    }


def _peaks(seen: LeverResponse) -> dict[str, float]:
    """How far a struck body went, and when, by name and unit."""
    return _ends(seen, f"_{seen.measure.name}", f"_{seen.measure.word}")


def _ends(seen: Extremes | LeverResponse, name: str = "", word: str = "") -> dict[str, float]:
    """The least and the greatest of what has both, and when (s)."""
    found: dict[str, float] = {}
    for end, (value, at) in (("least", seen.least), ("greatest", seen.greatest)):
        found |= {f"{end}{name}": value, f"{end}{word}_at_s": at}
    return found


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
        # No reader sees the text, and what stands where in it.
        return parse_scene(Document(read.name, read.folder, data=data))
    except SceneError as error:
        raise StorageError(f"the scene in {file} is damaged:\n{error}") from error
