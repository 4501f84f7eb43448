"""What the program says of forces: how large they are, and how far they are off, or apart."""

from __future__ import annotations

from collections.abc import Mapping

from exudyn_flexlink.measured_error import ForceDeviation, ForceSpread
from exudyn_flexlink.observables import force_peaks
from exudyn_flexlink.observables.forces import NEGLIGIBLE, NO_FORCE
from exudyn_flexlink.report.tables import Table, left_out
from exudyn_flexlink.result import Result

MOST_ROWS = 12  # more than that scroll the rest away


def peak_table(result: Result) -> Table:
    """Return the largest of every force and torque, when it is reached, and how far it may be off.

    That is left out where no second run tells it.
    """
    known = result.error.forces
    rows = []
    for name, peak in force_peaks(result).items():
        off = [_off_by(known.get(name))] if known else []
        rows.append(
            [name, f"{peak.value:.4g} {peak.unit}", f"{peak.at:.5f}" if peak.value else "", *off]
        )
    head, units = ["", "largest", "at"], ["", "", "s"]
    return Table(
        "Largest forces and torques",
        rows,
        [*head, "off by at most"] if known else head,
        [*units, ""] if known else units,
    )


def force_error_table(found: Mapping[str, ForceDeviation], caption: str = "") -> Table:
    """Return how far forces are off: the first of many."""
    rows = [row for name, own in found.items() for row in _rows(name, own)]
    head = ["", "largest", "of peak", "at", "rms"]
    return Table(caption, rows[:MOST_ROWS], head, [""] * 5, left_out(len(rows), MOST_ROWS))


def _off_by(own: ForceDeviation | None) -> str:
    parts = [] if own is None else [part for part in (own.free, own.touching) if part is not None]
    if own is None or not parts:
        return ""
    return f"{max(part.largest for part in parts):.2g} {own.unit}"


def _rows(name: str, own: ForceDeviation) -> list[list[str]]:
    """Return a row of a force, and one of it in contact; none where it is rounding."""
    free, touching = own.free, own.touching
    largest = max((part.size for part in (free, touching) if part is not None), default=0.0)
    rounding = max(NEGLIGIBLE * largest, NO_FORCE)
    rows = []
    if free is not None and free.size > rounding:
        rows.append([name, *_cells(free, own.unit)])
    if touching is not None and touching.size > rounding:
        rows.append(
            ["  in contact" if rows else f"{name}, in contact", *_cells(touching, own.unit)]
        )
    return rows


def _cells(part: ForceSpread, unit: str) -> list[str]:
    largest, rms = (f"{value:.2g} {unit}" for value in (part.largest, part.rms))
    percent = 100 * part.relative
    relative = f"{percent:.2g}" if percent < 99 else f"{percent:.0f}"
    return [largest, f"{relative} %", f"{part.at:.5f} s", rms]
