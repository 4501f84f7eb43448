"""Tables of a report, apart from who shows them: a terminal, or a page."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Table:
    """Rows of cells, as text, under a caption.

    `head` names the columns, and `units` their units, "" of a column without one; a cell has no
    unit that its column tells. Both are empty where every row is a name and what is told of it.
    `note` says what is left out, or how to read the table.
    """

    caption: str
    rows: Sequence[Sequence[str]]
    head: Sequence[str] = ()
    units: Sequence[str] = ()
    note: str = ""

    def without(self, columns: Collection[str]) -> Table:
        """Return the table without the columns of these names."""
        kept = [i for i, name in enumerate(self.head) if name not in columns]
        return replace(
            self,
            rows=[[row[i] for i in kept] for row in self.rows],
            head=[self.head[i] for i in kept],
            units=[self.units[i] for i in kept],
        )


def left_out(count: int, most: int) -> str:
    """Say how many of `count` rows are not among the first `most`; empty if all are."""
    return f"and {count - most} more" if count > most else ""
