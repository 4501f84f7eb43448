"""Tables of a report, apart from who shows them: a terminal, or a page."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

Item = TypeVar("Item")
Column = tuple[str, Callable[[Item], str]]


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


def table_of_items(
    caption: str, columns: Mapping[str, Column[Item]], items: Sequence[Item], count: int
) -> Table:
    """Return a table with a row for each item, the first of `count`.

    Columns are by name, each its unit and what tells the cell of an item.
    """
    rows = [[cell(item) for _, cell in columns.values()] for item in items]
    units = [unit for unit, _ in columns.values()]
    return Table(caption, rows, list(columns), units, left_out(count, len(items)))


def left_out(count: int, most: int) -> str:
    """Say how many of `count` rows are not among the first `most`; empty if all are."""
    return f"and {count - most} more" if count > most else ""
