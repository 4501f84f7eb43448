"""What the program says of a run beside a measured series, and of a fit."""

from __future__ import annotations

from math import isfinite

import numpy as np

from exudyn_flexlink.fitting import Against, Fit
from exudyn_flexlink.observables import name_of
from exudyn_flexlink.report.text import Table, in_blocks, lines_of, listed, table

DIGITS = 10  # of a fitted value


def against_text(found: Against) -> str:
    """Return the table of a run beside a series."""
    head = f"Comparison of {found.result.engine} and {found.series.source}"
    return in_blocks([[f"{head}: {found.result.scene.title}"], _distances(found), _how(found)])


def fit_text(found: Fit) -> str:
    """Return the table of a fit: values with their errors, correlations, residuals."""
    last = found.against
    rows = [
        [
            p.path,
            f"{found.values[p.path]:.{DIGITS}g}",
            f"{found.standard_errors[p.path]:.4g}",
            f"{found.integrator[p.path]:.1g}",
            f"{p.start:.4g}",
            p.unit,
        ]
        for p in found.parameters
    ]
    note = "standard error: of the data's scatter; integrator: how far its error moves the value"
    head = ["", "value", "standard error", "integrator", "start", "unit"]
    accuracy = last.result.scene.accuracy
    to = f"{accuracy.tolerance:.1g} m" if accuracy.step is None else f"steps of {accuracy.step:g} s"
    return in_blocks(
        [
            [f"Fit of {last.result.engine} to {last.series.source}: {last.result.scene.title}"],
            lines_of(Table("Fitted values", rows, head, note=note)),
            _correlations(found),
            _distances(last, "Residuals"),
            [f"Found in {found.runs} runs, the last to {to}"],
        ]
    )


def _correlations(found: Fit) -> list[str]:
    pairs = [
        [f"{p.path} and {q.path}", f"{found.correlations[i, j]:.6f}"]
        for i, p in enumerate(found.parameters)
        for j, q in enumerate(found.parameters)
        if i < j and isfinite(found.correlations[i, j])
    ]
    return lines_of(Table("Correlations", pairs))


def _distances(found: Against, caption: str = "Distances, run less series") -> list[str]:
    rows = [
        [
            own.signal,
            f"{own.largest:.3g} {own.unit}",
            f"{own.at:.5g} s",
            f"{own.rms:.3g} {own.unit}",
            f"{100 * own.rms / own.span:.2g} %" if own.span else "",
            f"{np.sum(found.differences[own.signal] ** 2):.{DIGITS}g}",
        ]
        for own in found.distances
    ]
    head = ["", "largest", "at", "rms", "of the span", "sum of squares, SI"]
    return lines_of(Table(caption, rows, head)) or [f"{caption}: none, the horizon is at the start"]


def _how(found: Against) -> list[str]:
    """Tell instants, the shift, what was left out, and how far the run itself is off."""
    begin, end = found.time[[0, -1]]
    rows = [["instants", f"{len(found.time)}, from {begin:.5g} to {end:.5g} s of the run"]]
    if found.shift:
        rows.append(["shift", f"{found.shift:.6g} s are added to times of the series"])
    if found.outside:
        rows.append(["outside the run", f"{found.outside} of {len(found.series.time)} rows"])
    if found.series.left_out:
        rows.append(["columns left out", listed(found.series.left_out)])
    error = found.result.error
    told = f"{name_of(error.points)} within {error.largest:.2g} m" if not error.missing else ""
    rows.append(["the run's own error", told or f"not known: {error.missing}"])
    if isfinite(error.known_until) and error.known_until < end:
        rows.append(["horizon", f"{error.known_until:.5g} s: distances are of instants before it"])
    return table(rows)
