"""What the program says of how far forces are off, or apart."""

from __future__ import annotations

from collections.abc import Mapping

from exudyn_flexlink.report.text import table
from exudyn_flexlink.result import ForceDeviation, ForceSpread

MOST_ROWS = 12  # more than that scroll the rest away


def force_table(found: Mapping[str, ForceDeviation]) -> list[str]:
    """Return a table of forces; none if there are no forces."""
    rows = [row for name, own in found.items() for row in _rows(name, own)]
    more = len(rows) - MOST_ROWS
    head = ["", "largest", "of peak", "at", "rms"]
    lines = table([head, *rows[:MOST_ROWS]]) if rows else []
    return [*lines, *([f"  and {more} more"] if more > 0 else [])]


def _rows(name: str, own: ForceDeviation) -> list[list[str]]:
    """Return the row of a force, and where it also acts in contact, one more."""
    parts = [part for part in (own.free, own.touching) if part is not None and part.size > 0]
    names = (name, "  in contact")
    return [[what, *_cells(part, own.unit)] for what, part in zip(names, parts, strict=False)]


def _cells(part: ForceSpread, unit: str) -> list[str]:
    largest, rms = (f"{value:.2g} {unit}" for value in (part.largest, part.rms))
    percent = 100 * part.relative
    relative = f"{percent:.2g}" if percent < 99 else f"{percent:.0f}"
    return [largest, f"{relative} %", f"{part.at:.5f} s", rms]
