"""A run held against a measured series, and a fit, to files: a document and a table of each."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.fitting import Against, Fit
from exudyn_flexlink.storage.documents import write_document
from exudyn_flexlink.storage.errors import COMPARISON, FIT
from exudyn_flexlink.sweeps import column_of


def save_against(found: Against, folder: Path) -> None:
    """Write ``comparison.json`` and ``comparison.csv`` into an existing folder.

    Raises:
        OSError: the folder can't be written.

    """
    data = _held(found) | {"completed": found.result.outcome.completed}
    write_document(folder, COMPARISON, data, {"comparison.csv": against_columns(found)})


def save_fit(found: Fit, folder: Path) -> None:
    """Write ``fit.json`` and ``residuals.csv`` into an existing folder.

    Raises:
        OSError: the folder can't be written.

    """
    write_document(folder, FIT, fit_data(found), {"residuals.csv": against_columns(found.against)})


def against_columns(found: Against) -> dict[str, FloatArray]:
    """Instants of the run, and of each quantity what was measured, computed, and the difference."""
    columns = {"t_s": found.time}
    for name, apart in found.differences.items():
        three = {"measured": found.measured[name], "computed": found.computed[name]}
        for what, values in (three | {"difference": apart}).items():
            columns[f"{column_of(name, found.series.signals[name].unit)}_{what}"] = values
    return columns


def fit_data(found: Fit) -> dict[str, Any]:
    """Return a fit as plain data: SI numbers, units in the names."""
    return _held(found.against) | {
        "completed": True,
        "parameters": [
            {
                "path": p.path,
                "unit": p.unit,
                "value": found.values[p.path],
                "standard_error": found.standard_errors[p.path],
                "moved_by_integrator": found.integrator[p.path],
                "start": p.start,
                "bounds": [p.low, p.high],
            }
            for p in found.parameters
        ],
        "correlations": found.correlations.tolist(),
        "tolerance_m": found.against.result.scene.accuracy.tolerance,
        "step_s": found.against.result.scene.accuracy.step,
        "runs": found.runs,
        "warnings": list(found.warnings),
        "scene": found.scene.to_data(),
    }


def _held(found: Against) -> dict[str, Any]:
    error = found.result.error
    return {
        "title": found.result.scene.title,
        "engine": found.result.engine,
        "series": found.series.source,
        "shift_s": found.shift,
        "shift_was_found": found.found,
        "rows": len(found.time),
        "rows_outside_the_run": found.outside,
        "sum_of_squares": {n: np.sum(own**2) for n, own in found.differences.items()},
        "distances": [vars(own) for own in found.distances],
        "horizon_s": error.known_until,
        "own_error_m": error.largest,
    }
