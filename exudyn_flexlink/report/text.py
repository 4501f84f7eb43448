"""Numbers and tables: apart from who shows them, and as plain text.

What is told of many things of a kind is declared once, as columns: tables of a text and of a page,
documents in JSON and CSV files are made of these.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from math import floor, log10
from operator import attrgetter
from typing import Any, Generic, NamedTuple, TypeVar

from numpy.typing import NDArray

Item = TypeVar("Item")

WIDTH = 80  # columns of a terminal, and of a log file, as they usually are
MOST_ROWS = 12  # of a table: more than that scroll the rest away
GAP = "  "  # before each column
UNITS = "%|N m s/rad|N m/rad|N/m|N m|N s|m/s|rad/s|kg|Hz|deg|rad|[mNJsW]"
QUANTITY = re.compile(rf"(?<=\d) ({UNITS})(?![\w/])|(?<=<) (?=\d)")
JOINED = "\u00a0"  # stands for a space where no line is broken


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

    def named(self, names: Iterable[str], head: str = "") -> Table:
        """Return the table with a name before each row, under a head of its own."""
        rows = [[name, *row] for name, row in zip(names, self.rows, strict=True)]
        return replace(self, rows=rows, head=[head, *self.head], units=["", *self.units])

    def without(self, columns: Collection[str]) -> Table:
        """Return the table without the columns of these names."""
        kept = [i for i, name in enumerate(self.head) if name not in columns]
        return replace(
            self,
            rows=[[row[i] for i in kept] for row in self.rows],
            head=[self.head[i] for i in kept],
            units=[self.units[i] for i in kept],
        )


@dataclass(frozen=True)
class Column(Generic[Item]):
    """What is told of each item of a kind: in texts under a `head`, in files by a `key`.

    `value` is what takes it out of an item, or the name of an attribute, which may have dots.
    `cell` writes that; None leaves the cell empty. `unit` is that of all cells; the key ends in the
    unit of the value. Without a head it is in no text, without a key in no file.
    """

    head: str | None
    value: str | Callable[[Item], Any]
    cell: Callable[[Any], str] = str
    unit: str = ""
    key: str = ""

    def of(self, item: Item) -> Any:
        """Return the value of an item."""
        value = attrgetter(self.value) if isinstance(self.value, str) else self.value
        return value(item)

    def text(self, item: Item) -> str:
        """Return the cell of an item."""
        value = self.of(item)
        return "" if value is None else self.cell(value)


class Document(NamedTuple):
    """What files tell of a study: a document in JSON, and columns of tables by their files."""

    data: dict[str, Any]
    tables: Mapping[str, Mapping[str, NDArray[Any] | Sequence[Any]]]


def entries(columns: Sequence[Column[Item]], item: Item) -> dict[str, Any]:
    """Return what files tell of an item, by key."""
    return {column.key: column.of(item) for column in columns if column.key}


def table_of_items(
    caption: str, columns: Sequence[Column[Item]], items: Sequence[Item], count: int = 0
) -> Table:
    """Return a table with a row for each item, the first of `count` if these are more."""
    shown = [column for column in columns if column.head is not None]
    rows = [[column.text(item) for column in shown] for item in items]
    head, units = [column.head or "" for column in shown], [column.unit for column in shown]
    return Table(caption, rows, head, units, left_out(count, len(items)))


def left_out(count: int, most: int) -> str:
    """Say how many of `count` rows are not among the first `most`; empty if all are."""
    return f"and {count - most} more" if count > most else ""


def number(value: float) -> str:
    """Return a number with 4 digits; whole ones in full, since 20000 reads better than 2e+04."""
    whole = abs(value) < 1e7 and value == round(value)
    return f"{value:.0f}" if whole else f"{value:.4g}"


def instant(time: float, run: float) -> str:
    """Return an instant (s) of a run that is so long (s), with five decimals, or more digits."""
    decimals = max(5, 4 - floor(log10(run or 1.0)))
    return f"{time:.{decimals}f}"


def in_blocks(blocks: Iterable[Sequence[str]]) -> str:
    """Return blocks of lines with an empty line between them, without those that are empty."""
    return "\n\n".join("\n".join(block) for block in blocks if block)


def table(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return indented lines in aligned columns; a row of one cell is a heading across them.

    Where they would be wider than `WIDTH`, cells are broken between words, and stay in their
    columns; a number stays with its unit.
    """
    broken = iter(_broken([row for row in rows if len(row) > 1]))
    return [line for row in rows for line in (next(broken) if len(row) > 1 else [GAP + row[0]])]


def lines_of(shown: Table, *, units_above: bool = False) -> list[str]:
    """Return a table with its caption above and its note below; none without rows.

    Units stand in the cells, or above them with the names of the columns.
    """
    if not shown.rows:
        return []
    head, rows = [list(shown.head)] if shown.head else [], [list(row) for row in shown.rows]
    if shown.units and units_above:
        head = [_with_units(shown.head, shown.units, ", ")]
    elif shown.units:
        rows = [_with_units(row, shown.units, " ") for row in rows]
    caption, note = ([shown.caption] * bool(shown.caption), [GAP + shown.note] * bool(shown.note))
    return [*caption, *table([*head, *rows]), *note]


def section(heading: str, rows: Sequence[Sequence[str]]) -> list[str]:
    """Return rows in columns under a heading; none without rows."""
    return lines_of(Table(heading, rows))


def _with_units(cells: Sequence[str], units: Sequence[str], between: str) -> list[str]:
    """Cells with their units; what is empty, or has no unit, stays as it is."""
    return [
        f"{cell}{between}{unit}" if cell and unit else cell
        for cell, unit in zip(cells, units, strict=True)
    ]


def _broken(rows: Sequence[Sequence[str]]) -> list[list[str]]:
    """Lines of each row."""
    columns = [list(column) for column in zip(*rows, strict=True)]
    cells = [
        [_wrapped(cell, width) for cell in column]
        for column, width in zip(columns, _widths(columns), strict=True)
    ]
    widths = [max(len(line) for cell in column for line in cell) for column in cells]
    lines_of_rows = []
    for row in zip(*cells, strict=True):
        lines = zip_longest(*row, fillvalue="")
        padded = [map(str.ljust, parts, widths) for parts in lines]
        lines_of_rows.append([(GAP + GAP.join(parts)).rstrip() for parts in padded])
    return lines_of_rows


def _widths(columns: list[list[str]]) -> list[int]:
    """Widths of columns that fit into `WIDTH`, if they can, with as few lines more as can be."""
    widths = [max(map(len, column)) for column in columns]
    while sum(widths) + len(GAP) * len(widths) > WIDTH:
        narrower = []
        for i, (column, width) in enumerate(zip(columns, widths, strict=True)):
            cells = [_wrapped(cell, max(width - 1, 1)) for cell in column]
            least = max(len(line) for cell in cells for line in cell)
            if least < width:
                more = sum(map(len, cells)) - sum(len(_wrapped(cell, width)) for cell in column)
                narrower.append((more / (width - least), i, least))
        if not narrower:  # words are never broken
            break
        _, i, widths[i] = min(narrower)
    return widths


def _wrapped(cell: str, width: int) -> list[str]:
    """Lines of a cell; at least one, which may be empty."""
    if len(cell) <= width:
        return [cell]
    joined = QUANTITY.sub(lambda gap: gap[0].replace(" ", JOINED), cell)
    indent = cell[: len(cell) - len(cell.lstrip())]
    lines = textwrap.wrap(
        joined, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    )
    return [line.replace(JOINED, " ") for line in lines] or [""]
