"""Points of splines, and tables by time, from CSV files: rows of two numbers in SI units."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from exudyn_flexlink.source import Document, KeyPath, Mistake
from exudyn_flexlink.units import Dimension, Powers, UnknownUnitError, find_unit

LARGEST_FILE = 20_000_000  # bytes
_PLACES = {"x": (Dimension.LENGTH,), "y": (Dimension.LENGTH,)}
_VALUES = {
    "speed": (Dimension.ANGULAR_SPEED, Dimension.SPEED),
    "motion": (Dimension.ANGLE, Dimension.LENGTH),
    "torque": (Dimension.TORQUE,),
    "force": (Dimension.FORCE,),
}
"""What tables of drives give, by their type."""
_BRACKETED = re.compile(r"[(\[]\s*([^()\[\]]*?)\s*[)\]]$")
OF_TIME = "t"  # in the header 'M(t)': no tonne
Columns = Mapping[str, Sequence[Dimension]]
"""What the columns of a file give: their names, and what each may measure; none: anything."""


class _BadFileError(Exception):
    """What is wrong with a file, in words."""


def read_point_files(
    document: Document, allow_outside: bool = False
) -> tuple[dict[str, Any], list[Mistake]]:
    """Return the sections with files in which the `points` of each stand in the `file`'s place.

    Those are curves, with splines, and drives, with tables. Files are looked for in the document's
    folder; outside it only with `allow_outside`. A file that can't be used stays a `file`, and is a
    mistake at its value.
    """
    mistakes: list[Mistake] = []

    def filled(value: Any, path: KeyPath) -> Any:
        if isinstance(value, list):
            return [filled(item, (*path, i)) for i, item in enumerate(value)]
        if not isinstance(value, dict):
            return value
        value = {key: filled(item, (*path, key)) for key, item in value.items()}
        file, spline = value.get("file"), value.get("type") == "spline"
        table = path[0] == "drives" and "value" in path
        columns = _columns_of_table(document, path) if table else _PLACES
        if (spline or table) and isinstance(file, str) and not value.get("points"):
            try:
                points = _points(_located(document, file, allow_outside), columns)
                if table:
                    _check_rising(points)
                else:
                    _check_distinct(points, closed=value.get("closed") is not False)
            except _BadFileError as error:
                mistakes.append(Mistake((*path, "file"), str(error)))
            else:
                value.pop("file")
                value["points"] = [point for _, point in points]
        return value

    sections = {key: document.data[key] for key in ("curves", "drives") if key in document.data}
    return {key: filled(value, (key,)) for key, value in sections.items()}, mistakes


def _located(document: Document, file: str, allow_outside: bool) -> Path:
    folder = (document.folder or Path()).resolve()
    try:
        path = (folder / file).resolve()
        if not allow_outside and (document.folder is None or not path.is_relative_to(folder)):
            raise _BadFileError("the file must be in the model's folder, or below it")
        if path.exists() and not path.is_file():
            kind = "a folder" if path.is_dir() else "a pipe or a device"
            raise _BadFileError(f"'{file}' is {kind}; points must be in a file")
        if not path.is_file():
            raise _BadFileError(f"no file '{file}' in the model's folder")
        if path.stat().st_size > LARGEST_FILE:
            raise _BadFileError(f"the file is larger than {LARGEST_FILE // 10**6} MB")
    except (OSError, ValueError, RuntimeError) as error:
        raise _BadFileError(f"can't read the file: {error}") from None
    return path


def _columns_of_table(document: Document, path: KeyPath) -> Columns:
    """Return the columns of a drive's table; what it gives is open where the drive has no type."""
    drives = document.data["drives"]
    drive = drives.get(path[1]) if isinstance(drives, dict) else None
    kind = drive.get("type") if isinstance(drive, dict) else None
    return {"time": (Dimension.TIME,), "value": _VALUES.get(str(kind), ())}


def _points(path: Path, columns: Columns) -> list[tuple[int, list[float]]]:
    """Return the rows of a file with the numbers of their lines."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            rows = csv.reader(stream, skipinitialspace=True)
            numbered = [(rows.line_num, [cell.strip() for cell in row]) for row in rows]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise _BadFileError(f"can't read the file: {error}") from None
    filled = [(line, row) for line, row in numbered if any(row) and not row[0].startswith("#")]
    if filled and not any(_is_number(cell) for cell in filled[0][1]):
        (line, header), *filled = filled
        _check_header(path.name, line, header, columns)
    return [(line, _point(path.name, line, row, ", ".join(columns))) for line, row in filled]


def _check_header(file: str, line: int, header: list[str], columns: Columns) -> None:
    """Refuse a unit in brackets that is not SI's; other words in brackets are no unit."""
    if len(header) != len(columns):
        return  # which the rows below are refused for
    for cell, wanted in zip(header, columns.values(), strict=True):
        found = _BRACKETED.search(cell)
        if found is None or found[1] == OF_TIME or not wanted:
            continue
        try:
            unit = find_unit(found[1], wanted[0])
        except UnknownUnitError:
            continue
        alike = any(_alike(unit.powers, one.powers) for one in wanted)
        if not alike or unit.factor != 1 or "Hz" in found[1]:  # 1 Hz is no rad/s
            units = " or ".join(one.si for one in wanted)
            message = f"{file} line {line}: '{cell[:40]}': numbers must be in {units}"
            raise _BadFileError(message)


def _alike(one: Powers, other: Powers) -> bool:
    """Tell whether two dimensions are the same, angles counting as numbers."""
    return one._replace(rad=0) == other._replace(rad=0)


def _is_number(cell: str) -> bool:
    if "_" in cell:  # which Python takes for nothing between digits
        return False
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _point(file: str, line: int, row: list[str], columns: str) -> list[float]:
    if len(row) != 2:
        got = f"{len(row)} columns" if len(row) > 1 else f"no comma in '{row[0][:40]}'"
        raise _BadFileError(f"{file} line {line}: expected {columns}; got {got}")
    for cell in row:
        if not _is_number(cell):
            raise _BadFileError(f"{file} line {line}: '{cell[:40]}' is no number")
        if not math.isfinite(float(cell)):
            raise _BadFileError(f"{file} line {line}: must be finite numbers, got '{cell[:40]}'")
    return [float(cell) for cell in row]


def _check_distinct(points: list[tuple[int, list[float]]], closed: bool) -> None:
    if len(points) < 4:
        raise _BadFileError(f"a spline needs at least 4 points, the file has {len(points)}")
    for (_, one), (line, other) in pairwise(points):
        if one == other:
            raise _BadFileError(f"line {line}: the same point twice in a row")
    if closed and points[0][1] == points[-1][1]:
        raise _BadFileError(f"line {points[-1][0]}: repeats the first point of a closed spline")


def _check_rising(points: list[tuple[int, list[float]]]) -> None:
    if len(points) < 2:
        raise _BadFileError(f"a table needs at least 2 rows, the file has {len(points)}")
    for (_, (before, _)), (line, (after, _)) in pairwise(points):
        if after <= before:
            raise _BadFileError(f"line {line}: times must increase from row to row")
    if points[0][1][0] > 0:
        raise _BadFileError(f"line {points[0][0]}: must begin at time 0 or before")
