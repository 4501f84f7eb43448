"""A measured series: instants, and a column for each quantity of a scene that was measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
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
from exudyn_flexlink.units import Dimension
from exudyn_flexlink.yaml_reader import Place


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
        table = {str(name): np.ravel(values) for name, values in given.items()}
        if len({len(own) for own in table.values()}) != 1:
            raise SceneError(Document("the table"), [Mistake((), "columns need one length")])
        rows = [[str(cell) for cell in row] for row in zip(*table.values(), strict=True)]
        cells = Cells(list(table), list(range(1, len(rows) + 1)), rows, False, "")
        return _Reading(scene, Document("the table"), cells).series(columns or {})
    file = Path(given)
    try:
        cells = read_cells(file)
    except BadFileError as error:
        raise SceneError(Document(str(file)), [Mistake((), str(error))]) from None
    return _Reading(scene, Document(str(file), text=cells.text), cells).series(columns or {})


class _Reading:
    """Takes columns out of cells, and keeps the mistakes that it meets."""

    def __init__(self, scene: Scene, document: Document, cells: Cells) -> None:
        self._scene, self._document, self._cells = scene, document, cells
        self._known, self._mistakes = signals(scene), list[Mistake]()
        self._bare = [bare_name(name) for name in cells.names]

    def series(self, columns: Mapping[str, str]) -> Series:
        """Return the series, or raise what is wrong with it."""
        chosen = self._given(columns) if columns else self._own()
        if not chosen and not self._mistakes:
            told = f"no column is named as a quantity of the scene; there are: {self._listed}"
            hint = "say which quantity a column is, such as NAME=lever.angle"
            self._mistakes.append(Mistake((), told, hint))
        rest = [k for k in range(len(self._bare)) if k not in chosen.values()]
        headless = self._bare[0] == "1"
        instants = next((k for k in rest if headless or names_time(self._cells.names[k])), None)
        if instants is None:
            hint = "name one 't' or 'time', with its unit: 't (ms)'; without a unit it is s"
            self._mistakes.append(Mistake((), "no column of time", hint))
            raise SceneError(self._document, self._mistakes)
        values = {name: self._numbers(k, self._known[name].dimension) for name, k in chosen.items()}
        time = self._numbers(instants, Dimension.TIME)
        if self._mistakes:
            raise SceneError(self._document, self._mistakes)
        left = tuple(self._cells.names[k] for k in rest if k != instants)
        own = {name: self._known[name] for name in values}
        return Series(Path(self._document.name).name, time, own, values, left)

    @property
    def _listed(self) -> str:
        return ", ".join(f"'{name}'" for name in self._bare)

    def _given(self, columns: Mapping[str, str]) -> dict[str, int]:
        """Columns by the quantities that the user says they are."""
        found: dict[str, int] = {}
        for column, signal in columns.items():
            where = self._cells.names if column in self._cells.names else self._bare
            if column not in where:
                near = did_you_mean(column, where) or f"; there are: {self._listed}"
                self._mistakes.append(Mistake((), f"no column '{column}'{near}"))
            elif where.count(column) > 1:
                self._mistakes.append(Mistake((), f"two columns are named '{column}'"))
            if signal not in self._known:
                self._mistakes.append(Mistake((column,), unknown_signal(signal, self._known)))
            elif signal in found:
                self._mistakes.append(Mistake((column,), f"'{signal}' is another column already"))
            elif column in where:
                found[signal] = where.index(column)
        return found

    def _own(self) -> dict[str, int]:
        """Columns by the quantities that their names say they are, with a unit or without."""
        names = {name: name for name in self._known} | own_columns(self._scene)
        found: dict[str, int] = {}
        for k, (cell, bare) in enumerate(zip(self._cells.names, self._bare, strict=True)):
            for own in sorted(names, key=len, reverse=True):
                measured = self._known[names[own]].dimension
                if bare == own or (bare.startswith(f"{own}_") and _unit(cell, measured)):
                    found.setdefault(names[own], k)
                    break
        return found

    def _numbers(self, column: int, dimension: Dimension) -> FloatArray:
        """Numbers (M,) of a column, in SI; those of the time must not fall."""
        name, last = self._cells.names[column], -np.inf
        found = np.full(len(self._cells.rows), np.nan)
        factor = 1.0
        try:
            factor = unit_of(name.replace("_per_", "/"), (dimension,)) or 1.0
        except BadFileError as error:
            self._mistakes.append(Mistake((), f"column {error}"))
        for i, row in enumerate(self._cells.rows):
            found[i] = factor * self._number(row[column])
            if not isfinite(found[i]):
                told = f"'{name}': expected a finite number, got '{row[column][:40]}'"
                self._mistakes.append(self._at(i, column, told))
            elif dimension is Dimension.TIME and found[i] < last:
                self._mistakes.append(self._at(i, column, f"'{name}': times must not fall"))
            last = found[i]
        return found

    def _number(self, cell: str) -> float:
        try:
            value = float(cell.replace(",", ".") if self._cells.comma else cell)
        except ValueError:
            return np.nan
        return np.nan if "_" in cell else value  # which Python takes for nothing in a number

    def _at(self, row: int, column: int, message: str) -> Mistake:
        """A mistake of one cell, at its place in the file."""
        line, cells = self._cells.lines[row], self._cells.rows[row]
        if not self._cells.text:
            return Mistake((), f"row {line}, {message}")
        text, begin = self._cells.text.split("\n")[line - 1], 0
        for cell in cells[:column]:
            begin = text.index(cell, begin) + len(cell)
        begin += max(text[begin:].find(cells[column]), 0)
        place = Place(line, begin + 1, begin + 1 + len(cells[column]))
        return Mistake((), message, place=place)


def _unit(cell: str, dimension: Dimension) -> float | None:
    try:
        return unit_of(cell.replace("_per_", "/"), (dimension,))
    except BadFileError:
        return None
