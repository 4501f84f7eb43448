"""Time series from elsewhere, to compare a run with: a measurement, another program."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.storage.errors import StorageError

FloatArray = NDArray[np.float64]

COLUMNS = ("t_s", "S_x_m", "S_y_m", "lever_angle_rad")


@dataclass(frozen=True)
class Series:
    """Positions (N, 2) m of one point and the struck body's angle (N,) rad at instants (N,) s."""

    name: str
    note: str
    time: FloatArray
    position: FloatArray
    lever_angle: FloatArray


def read_series(file: Path) -> Series:
    """Read a CSV with the columns ``t_s,S_x_m,S_y_m,lever_angle_rad`` after comments (``#``).

    Raises:
        StorageError: the file can't be read, or is not such a table.

    """
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
        notes = [line.lstrip("# ") for line in lines if line.startswith("#")]
        rows = [line for line in lines if line.strip() and not line.startswith("#")]
        if tuple(rows[0].split(",")) != COLUMNS:
            raise ValueError(f"its columns are not {','.join(COLUMNS)}")
        table = _table(rows[1:])
    except (OSError, ValueError, IndexError) as error:
        raise StorageError(f"{file}: can't be read as a time series: {error}") from error
    return Series(file.stem, " ".join(notes), table[:, 0], table[:, 1:3], table[:, 3])


def _table(rows: list[str]) -> FloatArray:
    """Numbers (N, columns) of rows of text.

    Raises:
        ValueError: they are no time series.

    """
    if not rows:
        raise ValueError("it has no rows")
    cells = [row.split(",") for row in rows]
    for number, row in enumerate(cells, start=1):
        if len(row) != len(COLUMNS):
            raise ValueError(f"row {number} has {len(row)} numbers instead of {len(COLUMNS)}")
    table = np.array([[float(cell) for cell in row] for row in cells])
    if not np.all(np.isfinite(table)):
        raise ValueError("not all of its numbers are finite")
    if np.any(np.diff(table[:, 0]) < 0):
        raise ValueError("its time does not increase")
    return table
