"""A run held against a measured series, and a fit, to files: a document and a table of each."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.fitting import Against, Fit
from exudyn_flexlink.storage.documents import write_document
from exudyn_flexlink.storage.errors import COMPARISON, FIT
from exudyn_flexlink.sweeps import column_of


def save_against(found: Against, folder: Path) -> None:
    """Write ``comparison.json`` and ``comparison.csv`` into a folder; may raise OSError."""
    data = _held(found) | {"completed": found.result.outcome.completed}
    write_document(folder, COMPARISON, data, {"comparison.csv": against_columns(found)})


def save_fit(found: Fit, folder: Path) -> None:
    """Write ``fit.json`` and ``residuals.csv`` into a folder; may raise OSError."""
    write_document(folder, FIT, fit_data(found), {"residuals.csv": against_columns(found.against)})


def against_columns(found: Against) -> dict[str, FloatArray]:
    """Instants of the run, and of each quantity what was measured, computed, and the difference."""
    columns = {"t_s": found.time}
    for name, apart in found.differences.items():
        column = column_of(name, found.series.signals[name].unit)
        columns[f"{column}_measured"] = found.measured[name]
        columns |= {f"{column}_computed": found.computed[name], f"{column}_difference": apart}
    return columns


def fit_data(found: Fit) -> dict[str, Any]:
    """Return a fit as plain data: SI numbers, units in the names."""
    accuracy = found.against.result.scene.accuracy
    return _held(found.against) | {
        "completed": True,
        "parameters": [vars(own) for own in found.parameters],
        "values": found.values,
        "standard_errors": found.standard_errors,
        "correlations": found.correlations,
        "moved_by_integrator": found.integrator,
        "tolerance_m": accuracy.tolerance,
        "step_s": accuracy.step,
        "runs": found.runs,
        "warnings": found.warnings,
        "scene": found.scene.to_data(),
    }


def _held(found: Against) -> dict[str, Any]:
    return {
        "title": found.result.scene.title,
        "engine": found.result.engine,
        "series": found.series.source,
        "shift_s": found.shift,
        "rows": len(found.time),
        "rows_outside_the_run": found.outside,
        "distances": [vars(own) for own in found.distances],
        "own_error_m": found.result.error.largest,
        "horizon_s": found.result.error.known_until,
    }
