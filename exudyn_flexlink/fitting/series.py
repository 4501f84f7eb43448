"""A measured series: instants, and a column for each measured quantity of a scene.

A run is compared with a series at the instants of the series; its clock may be shifted.

Times are in s, other numbers in SI. The series has M rows; N of them lie within the run.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from exudyn_flexlink.arrays import BoolArray, FloatArray
from exudyn_flexlink.observables import Signal, signals, table_columns, unknown_signal
from exudyn_flexlink.quantities import Dimension
from exudyn_flexlink.result import Result
from exudyn_flexlink.rounding import NEGLIGIBLE
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.scene.columns import (
    BadFileError,
    Cells,
    bare_name,
    names_time,
    read_cells,
    unit_of,
)
from exudyn_flexlink.source import Document, Mistake, Place, SceneError, did_you_mean
from exudyn_flexlink.sweeps import column_of

_STAMP = re.compile(r"\d+[-/.:]\d+[-/.:]\d")  # a date, or a time of day
_SECONDS = "count them from any instant: '--shift', in Python shift=, is added to times"


@dataclass(frozen=True)
class Series:
    """Measured `values` (M,), in SI, by the names of their `signals`, at instants `time` (M,) s.

    `left_out` names columns of the source that are not quantities of the scene.
    """

    source: str
    time: FloatArray
    signals: Mapping[str, Signal]
    values: Mapping[str, FloatArray]
    left_out: tuple[str, ...]


def read_series(scene: Scene, given: Any, columns: Mapping[str, str] | None = None) -> Series:
    """Read a CSV file, or columns by name such as a data frame's.

    `columns` maps names of columns to names of quantities (see `observables.signals`). A column
    needs no entry if its name is that of a quantity, such as ``lever.angle`` or
    ``lever.angle_rad``, or its name in the tables of a run. Without a header the columns are 1, 2,
    ..; the first is the time.

    Raises:
        SceneError: the series can't be used; the error has all mistakes that show at once.

    """
    if hasattr(given, "items"):
        document, table = (
            Document("the table"),
            {str(name): column for name, column in given.items()},
        )
        named = {len(table[name]) for name in columns or () if name in table}
        if named:  # a program's file may have other variables, too
            table = {name: column for name, column in table.items() if len(column) in named}
        lengths = {len(column) for column in table.values()}
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
    series = _series(scene, Path(document.name).name, cells, columns or {}, mistakes)
    if mistakes:
        raise SceneError(document, mistakes)
    return series


def _series(
    scene: Scene, source: str, cells: Cells, columns: Mapping[str, str], mistakes: list[Mistake]
) -> Series:
    """Make a series of a table's cells."""
    known, bare = signals(scene), [bare_name(name) for name in cells.names]
    chosen = _given(scene, cells, columns, mistakes) if columns else _named(scene, cells)
    if not chosen and not mistakes:
        listed = ", ".join(f"'{name}'" for name in bare)
        where_known = f"no column is named as a quantity of the scene; there are: {listed}"
        hint = "say which quantity a column is, such as NAME=lever.angle"
        mistakes.append(Mistake((), where_known, hint))
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
    """Columns by quantity, as the user assigns them."""
    known, bare, signals_given = signals(scene), list(map(bare_name, cells.names)), dict[str, int]()
    for column, signal in columns.items():
        where = cells.names if column in cells.names else bare
        if where.count(column) != 1:
            near = did_you_mean(column, where) or f"; there are: {', '.join(bare)}"
            several = f"two columns are named '{column}'"
            about = several if column in where else f"no column '{column}'{near}"
            mistakes.append(Mistake((), about))
        if signal not in known:
            mistakes.append(Mistake((column,), unknown_signal(signal, known)))
        elif signal in signals_given:
            mistakes.append(Mistake((column,), f"'{signal}' is another column already"))
        elif column in where:
            signals_given[signal] = where.index(column)
    return signals_given


def _named(scene: Scene, cells: Cells) -> dict[str, int]:
    """Columns by quantity, as their own names tell, with a unit or without."""
    known, columns = signals(scene), dict[str, int]()
    names = {name: name for name in known} | table_columns(scene)
    for k, cell in enumerate(cells.names):
        bare = bare_name(cell)
        for name, number in names.items():
            if bare in (name, column_of(name, known[number].unit)):
                columns.setdefault(number, k)
    return columns


def _numbers(
    cells: Cells, column: int, dimension: Dimension, mistakes: list[Mistake]
) -> FloatArray:
    """Numbers (M,) of a column, in SI; times must not decrease."""
    name, last, factor = cells.names[column], -np.inf, 1.0
    numbers = np.full(len(cells.rows), np.nan)
    try:
        factor = unit_of(name.replace("_per_", "/"), (dimension,)) or 1.0
    except BadFileError as error:
        mistakes.append(Mistake((), f"column {error}"))
    first = cells.rows[0][column]
    if dimension is Dimension.TIME and _STAMP.match(first):
        stamp = f"'{name}': '{first[:40]}' is a date or a time of day, expected seconds"
        mistakes.append(_at(cells, 0, column, stamp, _SECONDS))
        return numbers
    for i, row in enumerate(cells.rows):
        cell = row[column].replace(",", ".") if cells.comma else row[column]
        with suppress(ValueError):
            numbers[i] = np.nan if "_" in cell else factor * float(cell)  # Python reads '1_0' as 10
        about = hint = ""
        if not isfinite(numbers[i]):
            about = f"expected a finite number, got '{row[column][:40]}'"
            hint = "leave out rows that lack a number"
        elif dimension is Dimension.TIME and numbers[i] < last:
            about = "times must not fall"
        if about:
            mistakes.append(_at(cells, i, column, f"'{name}': {about}", hint))
        last = numbers[i]
    return numbers


def _at(cells: Cells, row: int, column: int, message: str, hint: str = "") -> Mistake:
    """A mistake of one cell, at its place in the file."""
    line, begin = cells.lines[row], 0
    if not cells.text:
        return Mistake((), f"row {line}, {message}", hint)
    text = cells.text.split("\n")[line - 1]
    for cell in cells.rows[row][: column + 1]:
        begin = text.index(cell, begin) + len(cell)
    width = len(cells.rows[row][column])
    return Mistake((), message, hint, place=Place(line, begin - width + 1, begin + 1))


MOST_SHIFTS = 4000  # number of shifts tried before the best one is refined
FEWEST = 3  # rows within the run, if the series has them: fewer mean a wrong unit or clock
_HINT = (
    "hint: the header of the time may name its unit, such as 't (ms)'; '--shift', in Python "
    "shift=, is added to times"
)


class NoOverlapError(ValueError):
    """The run and the series have no time, or too little of it, in common."""


@dataclass(frozen=True)
class Distance:
    """How far a run is from a series in one quantity: `largest`, at `at` (s of the run), and rms.

    `span` is the greatest minus the least measured value.
    """

    signal: str
    unit: str
    largest: float
    at: float
    rms: float
    span: float


@dataclass(frozen=True)
class Against:
    """A run beside a series: `shift` (s) plus the time of a row is its instant in the run.

    `time` (N,) are instants of the run; `computed` and `measured` (N,) are by quantity. `outside`
    is the number of rows outside the run.
    """

    result: Result
    series: Series
    shift: float
    time: FloatArray
    computed: Mapping[str, FloatArray]
    measured: Mapping[str, FloatArray]
    outside: int

    @property
    def differences(self) -> dict[str, FloatArray]:
        """Computed minus measured values (N,) by quantity."""
        return {name: self.computed[name] - values for name, values in self.measured.items()}

    @property
    def distances(self) -> list[Distance]:
        """How far the run and the series are apart, by quantity.

        They are compared up to the run's horizon: beyond it the run is not known instant by
        instant. The list is empty if no row lies before the horizon.
        """
        judged = self.time < self.result.error.known_until
        by_signal = []
        for name, apart in self.differences.items() if judged.any() else ():
            size, unit = np.abs(apart[judged]), self.series.signals[name].unit
            worst, rms = int(size.argmax()), float(np.sqrt(np.mean(size**2)))
            instant, span = float(self.time[judged][worst]), float(np.ptp(self.measured[name]))
            by_signal.append(Distance(name, unit, float(size[worst]), instant, rms, span))
        return by_signal


def against(result: Result, series: Series, shift: float | str = 0.0) -> Against:
    """Compare a run with a series whose times are shifted (s); 'find' searches for the shift.

    The best shift has the least mean of squared differences, where each quantity is divided by its
    own spread. At least half the rows must lie within the run.

    Raises:
        NoOverlapError: too few rows lie within the run.

    """
    shift = _best_shift(result, series) if isinstance(shift, str) else shift
    rows = _within(result, series.time + shift)
    count = int(rows.sum())
    if count < min(FEWEST, len(rows)):
        (begin, end), (first, last) = result.time[[0, -1]], series.time[[0, -1]] + shift
        few = f"only {count} of {len(rows)} rows of {series.source} lie"
        few = few if count else f"no row of {series.source} lies"
        raise NoOverlapError(
            f"{few} within the run: it goes from {begin:.6g} to {end:.6g} s, the rows from "
            f"{first:.6g} to {last:.6g} s\n{_HINT}"
        )
    time = series.time[rows] + shift
    computed = {name: signal.at(result, time) for name, signal in series.signals.items()}
    measured = {name: values[rows] for name, values in series.values.items()}
    return Against(result, series, shift, time, computed, measured, len(rows) - count)


def _within(result: Result, time: FloatArray) -> BoolArray:
    """Which instants lie within a run, its ends included."""
    begin, end = result.time[[0, -1]]
    near = NEGLIGIBLE * (end - begin)
    return np.asarray((time >= begin - near) & (time <= end + near))


def _best_shift(result: Result, series: Series) -> float:
    """Return the shift (s) that fits best; the smallest one if several fit equally."""
    from scipy.optimize import minimize_scalar  # noqa: PLC0415 - a second that `check` saves

    time, (begin, end) = series.time, result.time[[0, -1]].tolist()
    needed = max(len(time) // 2, 2)
    if time[-1] <= time[0] or end <= begin:
        raise NoOverlapError("a shift needs a series and a run that last")

    def mean_square(shift: float) -> float:
        rows = _within(result, time + shift)
        if rows.sum() < needed:
            return np.inf
        return sum(
            float(
                np.mean((series.signals[name].at(result, time[rows] + shift) - values[rows]) ** 2)
            )
            / (np.var(values) or 1.0)
            for name, values in series.values.items()
        )

    # Between these shifts the run has enough rows: at the lower the last ones, at the upper the
    # first.
    low, high = begin - float(time[-needed]), end - float(time[needed - 1])
    step = max(float(np.median(np.diff(np.unique(time)))) / 2, (high - low) / MOST_SHIFTS)
    tried = np.arange(np.floor(low / step), np.ceil(high / step) + 1) * step  # 0 among them
    best = float(min(sorted(tried.tolist(), key=abs), key=mean_square))
    if not np.isfinite(mean_square(best)):
        raise NoOverlapError(f"no shift leaves half the rows within the run\n{_HINT}")
    around = (best - step, best + step)
    minimum = minimize_scalar(
        mean_square, bounds=around, method="bounded", options={"xatol": 1e-9 * step}
    )
    return float(minimum.x) if minimum.fun <= mean_square(best) else best
