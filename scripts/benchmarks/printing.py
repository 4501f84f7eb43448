"""Tables in the terminal, aligned, or as Markdown."""

from __future__ import annotations

from rich import box
from rich.console import Console
from rich.table import Table as RichTable

from benchmarks.measuring import Table


def markdown(table: Table) -> str:
    """Return a table as Markdown, its title and its conclusion in bold."""
    rows = (table.columns, ("---",) * len(table.columns), *table.rows)
    lines = [f"**{table.title}**", "", *(f"| {' | '.join(row)} |" for row in rows), ""]
    return "\n".join([*lines, f"**{table.conclusion}**", ""] if table.conclusion else lines)


def show(console: Console, table: Table) -> None:
    """Print a table, aligned, and its conclusion."""
    shown = RichTable(title=table.title, title_justify="left", box=box.SIMPLE, title_style="bold")
    for i, column in enumerate(table.columns):
        shown.add_column(column, justify="left" if i == 0 else "right", no_wrap=True)
    for row in table.rows:
        shown.add_row(*row)
    console.print(shown)
    if table.conclusion:
        console.print(table.conclusion + "\n", highlight=False, markup=False)
