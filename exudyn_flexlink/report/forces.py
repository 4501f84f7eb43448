"""What the program says of how far forces are off, or apart."""

from __future__ import annotations

from collections.abc import Mapping

from exudyn_flexlink.observables.forces import NEGLIGIBLE
from exudyn_flexlink.report.text import table
from exudyn_flexlink.result import ForceDeviation, ForceSpread

NOTHING = ForceSpread(0.0, 0.0, 0.0, 0.0)
MOST_ROWS = 12  # more than that scroll the rest away


def force_table(found: Mapping[str, ForceDeviation]) -> list[str]:
    """Return a table of forces; none if there are no forces."""
    rows = [row for name, own in found.items() for row in _rows(name, own)]
    more = len(rows) - MOST_ROWS
    head = ["", "largest", "of peak", "at", "rms"]
    lines = table([head, *rows[:MOST_ROWS]]) if rows else []
    return [*lines, *([f"  and {more} more"] if more > 0 else [])]


def _rows(name: str, own: ForceDeviation) -> list[list[str]]:
    """Return a row of a force, and one of it in contact; none where it is rounding."""
    free, touching = own.free, own.touching
    largest = max(part.size for part in (free, touching, NOTHING) if part is not None)
    rows = []
    if free is not None and free.size > NEGLIGIBLE * largest:
        rows.append([name, *_cells(free, own.unit)])
    if touching is not None and touching.size > NEGLIGIBLE * largest:
        rows.append(
            ["  in contact" if rows else f"{name}, in contact", *_cells(touching, own.unit)]
        )
    return rows


def _cells(part: ForceSpread, unit: str) -> list[str]:
    largest, rms = (f"{value:.2g} {unit}" for value in (part.largest, part.rms))
    percent = 100 * part.relative
    relative = f"{percent:.2g}" if percent < 99 else f"{percent:.0f}"
    return [largest, f"{relative} %", f"{part.at:.5f} s", rms]
