"""Points of splines, and tables of drives and springs, from CSV files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from exudyn_flexlink.scene.columns import PLACES, BadFileError, Columns, read_columns
from exudyn_flexlink.scene.varying import OF_DRIVES, OF_SPRINGS
from exudyn_flexlink.source import Document, KeyPath, Mistake
from exudyn_flexlink.units import Dimension

LARGEST_FILE = 20_000_000  # bytes


class PointFiles(NamedTuple):
    """Sections in which `points` stand in the `file`'s place, and the mistakes of files.

    `lines` has the file and the lines of the points, by the path of the part that names it.
    """

    sections: dict[str, Any]
    lines: dict[KeyPath, tuple[str, list[int]]]
    mistakes: list[Mistake]

    def placed(self, mistake: Mistake) -> Mistake:
        """Return a mistake of points as one of the file's line."""
        for part, (file, lines) in self.lines.items():
            if mistake.path[: len(part) + 1] == (*part, "points"):
                row = [f" line {lines[int(i)]}" for i in mistake.path[len(part) + 1 :][:1]]
                message = f"{''.join([file, *row])}: {mistake.message}"
                return replace(mistake, path=(*part, "file"), message=message)
        return mistake


def read_point_files(document: Document, allow_outside: bool = False) -> PointFiles:
    """Read the files that a document names.

    They are looked for in its folder; outside it only with `allow_outside`. A file that can't be
    used stays a `file`, and is a mistake at its value.
    """
    mistakes, lines = list[Mistake](), dict[KeyPath, tuple[str, list[int]]]()

    def filled(value: Any, path: KeyPath) -> Any:
        if isinstance(value, list):
            return [filled(item, (*path, i)) for i, item in enumerate(value)]
        if not isinstance(value, dict):
            return value
        value = {key: filled(item, (*path, key)) for key, item in value.items()}
        file, spline = value.get("file"), value.get("type") == "spline"
        table = path[0] == "drives" and "value" in path
        columns = _columns_of_table(document, path) if table else PLACES
        if path[0] == "springs" and path[-1] in OF_SPRINGS:
            table, columns = True, OF_SPRINGS[str(path[-1])]
        if (spline or table) and isinstance(file, str) and not value.get("points"):
            try:
                located = _located(document, file, allow_outside)
                numbers, value["points"] = read_columns(located, columns)
            except BadFileError as error:
                mistakes.append(Mistake((*path, "file"), str(error)))
            else:
                lines[path] = (value.pop("file"), numbers)
        return value

    there = [key for key in ("curves", "springs", "drives") if key in document.data]
    sections: dict[str, Any] = {key: filled(document.data[key], (key,)) for key in there}
    return PointFiles(sections, lines, mistakes)


def _located(document: Document, file: str, allow_outside: bool) -> Path:
    folder = (document.folder or Path()).resolve()
    try:
        path = (folder / file.replace("\\", "/")).resolve()  # as Windows writes it
        if not allow_outside and (document.folder is None or not path.is_relative_to(folder)):
            raise BadFileError("the file must be in the model's folder, or below it")
        if path.exists() and not path.is_file():
            kind = "a folder" if path.is_dir() else "a pipe or a device"
            raise BadFileError(f"'{file}' is {kind}; points must be in a file")
        if not path.is_file():
            raise BadFileError(f"no file '{file}' in the model's folder")
        if path.stat().st_size > LARGEST_FILE:
            raise BadFileError(f"the file is larger than {LARGEST_FILE // 10**6} MB")
    except (OSError, ValueError, RuntimeError) as error:
        raise BadFileError(f"can't read the file: {error}") from None
    return path


def _columns_of_table(document: Document, path: KeyPath) -> Columns:
    """Return the columns of a drive's table; what it gives is open where nothing tells it."""
    drive = _part(document.data["drives"], path[1])
    measures = OF_DRIVES.get(str(drive.get("type")), ())
    joint = _part(document.data.get("joints"), drive.get("joint")).get("type")
    if len(measures) > 1 and joint is not None:
        measures = measures[:1] if joint == "revolute" else measures[1:]
    return {"time": (Dimension.TIME,), "value": measures}


def _part(section: Any, name: Any) -> dict[str, Any]:
    """Return a part as it was written; an empty one where there is none."""
    part = section.get(name) if isinstance(section, dict) and isinstance(name, str) else None
    return part if isinstance(part, dict) else {}
