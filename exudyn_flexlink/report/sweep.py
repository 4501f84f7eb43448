"""What the program says after a sweep: how many rows there are, and why some have no numbers."""

from __future__ import annotations

from collections import Counter

from exudyn_flexlink.report.tables import Table
from exudyn_flexlink.report.text import in_blocks, lines_of, number, table
from exudyn_flexlink.sweeps import DOUBTFUL, FAILED, SweepTable, shortened

MOST_REASONS = 5
LONGEST = 100  # characters of a reason


def sweep_text(found: SweepTable) -> str:
    """Return the summary of a sweep: its rows, what varied, ranges of observables, reasons."""
    blocks = [_head(found), _ranges(found), *(_reasons(found, kind) for kind in (FAILED, DOUBTFUL))]
    return in_blocks(blocks)


def _head(found: SweepTable) -> list[str]:
    missing = found.points - len(found.rows)
    told = [f"{found.count(kind)} {kind}" for kind in (FAILED, DOUBTFUL) if found.count(kind)]
    told += [f"{missing} missing"] if missing else []
    wall = sum(row.wall for row in found.rows)
    rows = [["rows", ", ".join([f"{len(found.rows)} of {found.points}", *told])]]
    rows += [["runs took", f"{wall:.1f} s together"]]
    return [f"Sweep: {found.title}", *table(rows)]


def _ranges(found: SweepTable) -> list[str]:
    """Least and largest value of every number that is not printed alike in all rows."""
    columns = found.columns()
    varied = [one.column for one in found.varied]
    rows = [["", "from", "to"]]
    for name in (*varied, *found.observables):
        values = [float(value) for value in columns[name] if isinstance(value, float | int)]
        ends = [number(end(values)) for end in (min, max)] if values else ["", ""]
        if values and (name in varied or ends[0] != ends[1]):
            rows.append([name, *ends])
    return table(rows) if len(rows) > 1 else []


def _reasons(found: SweepTable, kind: str) -> list[str]:
    """Why rows are as they are, the most frequent reasons first."""
    reasons = Counter(row.reason for row in found.rows if row.status == kind)
    first = {row.reason: row.number for row in reversed(found.rows) if row.status == kind}
    rows = [
        [str(count), f"run {first[reason]}", shortened(reason, LONGEST)]
        for reason, count in reasons.most_common(MOST_REASONS)
    ]
    more = len(reasons) - MOST_REASONS
    note = f"and {more} reasons more" if more > 0 else ""
    return lines_of(Table(f"{kind.capitalize()}: rows, the first of them, why", rows, note=note))
