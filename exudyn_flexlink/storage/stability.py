"""A study of stability to files: everything as JSON, its series as tables."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from exudyn_flexlink.stability import Exponent, Stability, section_columns
from exudyn_flexlink.storage.documents import write_document
from exudyn_flexlink.storage.errors import STABILITY


def save_stability(found: Stability, sentence: str, folder: Path) -> None:
    """Write ``stability.json`` and tables of growth, laps, section and spectrum into a folder.

    `sentence` says in words what the motion does.

    Raises:
        StorageError: the folder can't be written.

    """
    tables = {
        "growth.csv": growth_columns(found.exponent),
        "laps.csv": _laps(found),
        "section.csv": section_columns(found.section),
    }
    for axis, own in (("x", found.vibration.x), ("y", found.vibration.y)):
        columns = {"frequency_Hz": own.frequency, "power_m2_per_Hz": own.power}
        tables[f"spectrum_{axis}.csv"] = columns
    write_document(folder, STABILITY, stability_data(found) | {"told": sentence}, tables)


def stability_data(found: Stability) -> dict[str, Any]:
    """Return a study as plain data: SI numbers, units in the names."""
    laps = found.repeating
    return {
        "title": found.run.scene.title,
        "completed": True,
        "engine": found.run.engine,
        "point": found.point,
        "lap_s": found.rhythm.lap,
        "laps_of_a_cycle": found.rhythm.laps,
        "after_s": found.after,
        "end_s": float(found.run.time[-1]),
        "tolerance_m": found.tolerance,
        "exponent": _exponent(found.exponent),
        "exponent_at_a_tenth_of_the_tolerance": found.tighter and _exponent(found.tighter),
        "horizon_s": found.horizon,
        "repeats_after_laps": laps and laps.laps,
        "settles_by_factor": laps and laps.settles,
        "laps_apart_m": laps and laps.least,
        "laps_before": laps and laps.nearest,
        "laps_known_until_s": laps and laps.until,
        "places_of_section": found.section.distinct(found.limit),
        "places_apart_by_m": found.limit,
        "lines_Hz": {"x": found.vibration.x.lines, "y": found.vibration.y.lines},
        "lines_off_ideal_place": found.vibration.off_ideal,
        "scene": found.run.scene.to_data(),
    }


def _exponent(own: Exponent) -> dict[str, Any]:
    return {
        "value_per_s": own.value,
        "uncertainty_per_s": own.uncertainty,
        "solver_per_s": own.noise,
        "sign": own.sign,
        "neighbours_apart_m": own.distance,
        "batch_means_per_s": own.means.tolist(),
    }


def growth_columns(own: Exponent) -> dict[str, Any]:
    """Growth of neighbours' distance in each stretch; `counts` is 0 while they settle."""
    counts = np.arange(len(own.rates)) >= own.settled
    return {
        "begin_s": own.times[:-1],
        "end_s": own.times[1:],
        "growth_per_s": own.rates,
        "counts": counts.astype(float),
    }


def _laps(found: Stability) -> dict[str, Any]:
    laps = found.laps
    rows = zip(laps.before.tolist(), laps.largest, strict=True)
    return {"lap": laps.laps.astype(float), "end_s": laps.end} | {
        f"from_{before}_before_m": row for before, row in rows
    }
