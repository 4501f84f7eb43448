"""Numbers and tables as plain text."""

from __future__ import annotations

from collections.abc import Sequence


def number(value: float) -> str:
    """Return a number with 4 digits; whole ones in full, since 20000 reads better than 2e+04."""
    whole = abs(value) < 1e7 and value == round(value)
    return f"{value:.0f}" if whole else f"{value:.4g}"


def table(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return indented lines in aligned columns."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  " + "  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
