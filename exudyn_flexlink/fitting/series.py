"""A measured series: instants, and a column for each quantity of a scene that was measured."""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.observables import Signal, own_columns, signals, unknown_signal
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.scene.columns import (
    BadFileError,
    Cells,
    bare_name,
    names_time,
    read_cells,
    unit_of,
)
from exudyn_flexlink.source import Document, Mistake, SceneError, did_you_mean
from exudyn_flexlink.sweeps import column_of
from exudyn_flexlink.units import Dimension
from exudyn_flexlink.yaml_reader import Place

_STAMP = re.compile(r"\d+[-/.:]\d+[-/.:]\d")  # a date, or a time of day
_SECONDS = "count them from any instant: '--shift', in Python shift=, is added to times"


@dataclass(frozen=True)
class Series:
    """What was measured: `values` (M,) by the names of their `signals`, at instants `time` (M,) s.

    SI units. `left_out` names columns of the source that are no quantities of the scene.
    """

    source: str
    time: FloatArray
    signals: Mapping[str, Signal]
    values: Mapping[str, FloatArray]
    left_out: tuple[str, ...]


def read_series(scene: Scene, given: Any, columns: Mapping[str, str] | None = None) -> Series:
    """Read a CSV file, or columns by name such as a data frame's.

    `columns` are names of quantities (see `observables.signals`) by those of columns. A column
    needs none that is named as a quantity, ``lever.angle`` or ``lever.angle_rad``, or as the tables
    of a run name it. A file without a header has the columns 1, 2, ..; the first is the time.

    Raises:
        SceneError: it can't be used; all mistakes that can be seen at once are in it.

    """
    if hasattr(given, "items"):
        document, table = Document("the table"), {str(name): own for name, own in given.items()}
        lengths = {len(own) for own in table.values()}
        if len(lengths) != 1 or 0 in lengths:
            raise SceneError(document, [Mistake((), "columns need one length, and a row or more")])
        rows = [[str(cell) for cell in row] for row in zip(*table.values(), strict=True)]
        cells = Cells(list(table), list(range(1, len(rows) + 1)), rows, False, "")
    else:
        document = Document(str(given))
        try:
            cells = read_cells(Path(given))
        except BadFileError as error:
            raise SceneError(document, [Mistake((), str(error))]) from None
        document = replace(document, text=cells.text)
    mistakes = list[Mistake]()
    found = _series(scene, Path(document.name).name, cells, columns or {}, mistakes)
    if mistakes:
        raise SceneError(document, mistakes)
    return found


def _series(
    scene: Scene, source: str, cells: Cells, columns: Mapping[str, str], mistakes: list[Mistake]
) -> Series:
    """Take a series out of cells."""
    known, bare = signals(scene), [bare_name(name) for name in cells.names]
    chosen = _given(scene, cells, columns, mistakes) if columns else _own(scene, cells)
    if not chosen and not mistakes:
        listed = ", ".join(f"'{name}'" for name in bare)
        told = f"no column is named as a quantity of the scene; there are: {listed}"
        hint = "say which quantity a column is, such as NAME=lever.angle"
        mistakes.append(Mistake((), told, hint))
    rest = [k for k in range(len(bare)) if k not in chosen.values()]
    headless = bare[0] == "1"
    instants = next((k for k in rest if headless or names_time(cells.names[k])), None)
    values = {
        name: _numbers(cells, k, known[name].dimension, mistakes) for name, k in chosen.items()
    }
    time = np.zeros(0)
    if instants is None:
        hint = "name one 't' or 'time', with its unit: 't (ms)'; without a unit it is s"
        hint += "" if cells.text else "; reset_index() makes a column of a data frame's index"
        mistakes.append(Mistake((), "no column of time", hint))
    else:
        time = _numbers(cells, instants, Dimension.TIME, mistakes)
    left = tuple(cells.names[k] for k in rest if k != instants)
    return Series(source, time, {name: known[name] for name in values}, values, left)


def _given(
    scene: Scene, cells: Cells, columns: Mapping[str, str], mistakes: list[Mistake]
) -> dict[str, int]:
    """Columns by the quantities that the user says they are."""
    known, bare, found = signals(scene), list(map(bare_name, cells.names)), dict[str, int]()
    for column, signal in columns.items():
        where = cells.names if column in cells.names else bare
        if where.count(column) != 1:
            near = did_you_mean(column, where) or f"; there are: {', '.join(bare)}"
            several = f"two columns are named '{column}'"
            told = several if column in where else f"no column '{column}'{near}"
            mistakes.append(Mistake((), told))
        if signal not in known:
            mistakes.append(Mistake((column,), unknown_signal(signal, known)))
        elif signal in found:
            mistakes.append(Mistake((column,), f"'{signal}' is another column already"))
        elif column in where:
            found[signal] = where.index(column)
    return found


def _own(scene: Scene, cells: Cells) -> dict[str, int]:
    """Columns by the quantities that their names say they are, with a unit or without."""
    known, found = signals(scene), dict[str, int]()
    names = {name: name for name in known} | own_columns(scene)
    for k, cell in enumerate(cells.names):
        bare = bare_name(cell)
        for name, own in names.items():
            if bare in (name, column_of(name, known[own].unit)):
                found.setdefault(own, k)
    return found


def _numbers(
    cells: Cells, column: int, dimension: Dimension, mistakes: list[Mistake]
) -> FloatArray:
    """Numbers (M,) of a column, in SI; those of the time must not fall."""
    name, last, factor = cells.names[column], -np.inf, 1.0
    found = np.full(len(cells.rows), np.nan)
    try:
        factor = unit_of(name.replace("_per_", "/"), (dimension,)) or 1.0
    except BadFileError as error:
        mistakes.append(Mistake((), f"column {error}"))
    first = cells.rows[0][column]
    if dimension is Dimension.TIME and _STAMP.match(first):
        stamp = f"'{name}': '{first[:40]}' is a date or a time of day, expected seconds"
        mistakes.append(_at(cells, 0, column, stamp, _SECONDS))
        return found
    for i, row in enumerate(cells.rows):
        cell = row[column].replace(",", ".") if cells.comma else row[column]
        with suppress(ValueError):
            found[i] = np.nan if "_" in cell else factor * float(cell)  # '1_0' is Python's ten
        told = hint = ""
        if not isfinite(found[i]):
            told = f"expected a finite number, got '{row[column][:40]}'"
            hint = "leave out rows that lack a number"
        elif dimension is Dimension.TIME and found[i] < last:
            told = "times must not fall"
        if told:
            mistakes.append(_at(cells, i, column, f"'{name}': {told}", hint))
        last = found[i]
    return found


def _at(cells: Cells, row: int, column: int, message: str, hint: str = "") -> Mistake:
    """A mistake of one cell, at its place in the file."""
    line, begin = cells.lines[row], 0
    if not cells.text:
        return Mistake((), f"row {line}, {message}", hint)
    text = cells.text.split("\n")[line - 1]
    for cell in cells.rows[row][: column + 1]:
        begin = text.index(cell, begin) + len(cell)
    own = len(cells.rows[row][column])
    return Mistake((), message, hint, place=Place(line, begin - own + 1, begin + 1))
