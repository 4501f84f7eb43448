"""Numbers and tables, as plain text and independent of where they are shown.

Columns declare once what is reported on items of a kind. Tables of texts and pages, and JSON and
CSV files, are made of these columns.
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

WIDTH = 80  # usual columns of a terminal, and of a log file
MOST_ROWS = 12  # most rows of a table: more scroll the rest away
GAP = "  "  # space before each column
UNITS = "%|N m s/rad|N m/rad|N/m|N m|N s|m/s|rad/s|kg|Hz|deg|rad|[mNJsW]"
QUANTITY = re.compile(rf"(?<=\d) ({UNITS})(?![\w/])|(?<=<) (?=\d)")
JOINED = "\u00a0"  # stands for a space at which no line may break


@dataclass(frozen=True)
class Table:
    """Rows of cells, as text, under a caption.

    `head` has the names of the columns, and `units` their units, "" for a column without unit.
    Cells omit the unit of their column. Both are empty if every row is a name and its text. `note`
    tells which rows are omitted, or how to read the table.
    """

    caption: str
    rows: Sequence[Sequence[str]]
    head: Sequence[str] = ()
    units: Sequence[str] = ()
    note: str = ""

    def named(self, names: Iterable[str], head: str = "") -> Table:
        """Return the table with a name before each row; `head` is the head of this new column."""
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
    """A column of a table of items: in texts under a `head`, in files by a `key`.

    `value` is a function that takes the value out of an item, or the name of an attribute, which
    may have dots. `cell` writes a value; the cell of None is empty. `unit` is the unit of all
    cells; the key ends in the unit of the value. Texts omit a column without a head, files a column
    without a key.
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
    """Document of a study in JSON, and columns of its tables by the names of their files."""

    data: dict[str, Any]
    tables: Mapping[str, Mapping[str, NDArray[Any] | Sequence[Any]]]


def entries(columns: Sequence[Column[Item]], item: Item) -> dict[str, Any]:
    """Return the values of an item for files, by key."""
    return {column.key: column.of(item) for column in columns if column.key}


def table_of_items(
    caption: str, columns: Sequence[Column[Item]], items: Sequence[Item], count: int = 0
) -> Table:
    """Return a table with a row for each item; only the first `count` rows if there are more."""
    shown = [column for column in columns if column.head is not None]
    rows = [[column.text(item) for column in shown] for item in items]
    head, units = [column.head or "" for column in shown], [column.unit for column in shown]
    return Table(caption, rows, head, units, left_out(count, len(items)))


def left_out(count: int, most: int) -> str:
    """Say how many of `count` rows come after the first `most`; empty if none."""
    return f"and {count - most} more" if count > most else ""


def number(value: float) -> str:
    """Return a number with 4 digits; integers in full, because 20000 is clearer than 2e+04."""
    whole = abs(value) < 1e7 and value == round(value)
    return f"{value:.0f}" if whole else f"{value:.4g}"


def instant(time: float, run: float) -> str:
    """Return an instant (s) with five decimals, or more if the run (s) is short."""
    decimals = max(5, 4 - floor(log10(run or 1.0)))
    return f"{time:.{decimals}f}"


def in_blocks(blocks: Iterable[Sequence[str]]) -> str:
    """Return blocks of lines, separated by empty lines, without empty blocks."""
    return "\n\n".join("\n".join(block) for block in blocks if block)


def table(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return indented lines in aligned columns; a row of one cell is a heading over all columns.

    If the lines would be wider than `WIDTH`, cells break between words and stay in their columns. A
    number stays with its unit.
    """
    broken = iter(_broken([row for row in rows if len(row) > 1]))
    return [line for row in rows for line in (next(broken) if len(row) > 1 else [GAP + row[0]])]


def lines_of(shown: Table, *, units_above: bool = False) -> list[str]:
    """Return a table with its caption above and its note below; no lines if it has no rows.

    Units stand in the cells, or above them beside the names of the columns.
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
    """Return rows in columns under a heading; no lines without rows."""
    return lines_of(Table(heading, rows))


def _with_units(cells: Sequence[str], units: Sequence[str], between: str) -> list[str]:
    """Return cells with their units; an empty cell, or one without a unit, is unchanged."""
    return [
        f"{cell}{between}{unit}" if cell and unit else cell
        for cell, unit in zip(cells, units, strict=True)
    ]


def _broken(rows: Sequence[Sequence[str]]) -> list[list[str]]:
    """Return the lines of each row."""
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
    """Return the widths of columns that fit into `WIDTH`, if possible, with few extra lines."""
    widths = [max(map(len, column)) for column in columns]
    while sum(widths) + len(GAP) * len(widths) > WIDTH:
        narrower = []
        for i, (column, width) in enumerate(zip(columns, widths, strict=True)):
            cells = [_wrapped(cell, max(width - 1, 1)) for cell in column]
            least = max(len(line) for cell in cells for line in cell)
            if least < width:
                more = sum(map(len, cells)) - sum(len(_wrapped(cell, width)) for cell in column)
                narrower.append((more / (width - least), i, least))
        if not narrower:  # words never break
            break
        _, i, widths[i] = min(narrower)
    return widths


def _wrapped(cell: str, width: int) -> list[str]:
    """Return the lines of a cell: at least one line, which may be empty."""
    if len(cell) <= width:
        return [cell]
    joined = QUANTITY.sub(lambda gap: gap[0].replace(" ", JOINED), cell)
    indent = cell[: len(cell) - len(cell.lstrip())]
    lines = textwrap.wrap(
        joined, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    )
    return [line.replace(JOINED, " ") for line in lines] or [""]
