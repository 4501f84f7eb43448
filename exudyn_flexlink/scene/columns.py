"""Columns of numbers in CSV files: points of splines, and tables of drives and springs.

Separators, decimal commas and units are found in the file and its header.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple

from exudyn_flexlink.quantities import (
    AmbiguousUnitError,
    Dimension,
    Unit,
    UnknownUnitError,
    find_unit,
)
from exudyn_flexlink.scene.forces import DRIVE_DIMENSIONS, SPRING_COLUMNS
from exudyn_flexlink.source import Document, KeyPath, Mistake

Columns = Mapping[str, Sequence[Dimension]]
"""Two columns by name, with the dimensions of each; no dimensions if they are not known."""
PLACES: Columns = {"x": (Dimension.LENGTH,), "y": (Dimension.LENGTH,)}
_CALLED = {"x": {"x"}, "y": {"y"}, "time": {"t", "time", "zeit", "temps"}}
_POLAR = {"r", "radius", "rho", "angle", "theta", "phi", "θ", "φ"}
_SEPARATORS = (";", "\t", ",", " ")  # in this order; a ',' that separates nothing is a decimal mark
_CELL = re.compile(r"[^\s()\[\]]*\s*[(\[][^()\[\]]*[)\]]|\S+")  # 'n [rpm]', if blanks separate
_BRACKETED = re.compile(r"[(\[]\s*([^()\[\]]*?)\s*[)\]]$")
_COMMENTED = re.compile(r"(?!\d)[^\s()\[\]]*\s*(?:in )?(?:[(\[][^()\[\]]*[)\]]|[^\s()\[\]]*)")
_SAVE = "save it as 'CSV UTF-8'"
_KINDS = {
    b"PK": f"a workbook of Excel, or another zip file: {_SAVE}",
    b"\xd0\xcf\x11\xe0": f"a workbook of Excel: {_SAVE}",
    b"\x1f\x8b": "packed by gzip: unpack it first",
    b"\xff\xfe": f"text in UTF-16: {_SAVE}",
    b"\xfe\xff": f"text in UTF-16: {_SAVE}",
    b"MATLAB": "in a format of MATLAB: save columns as CSV, or give them from Python",
}
"""Kinds of files that are not text in UTF-8, by their first bytes."""
_OF_TIME = "t"  # in the header 'M(t)' it is the time, not a tonne


class BadFileError(Exception):
    """A file can't be used; the text says why."""


def read_columns(path: Path, columns: Columns) -> tuple[list[int], list[list[float]]]:
    """Return the numbers of lines and their rows, in SI units and in the order of `columns`.

    The first row tells whether ';', tabs, ',' or blanks separate cells. Numbers may have a decimal
    comma, unless ',' separates cells. Lines above the first row may name columns and units, also
    behind a '#'.

    Raises:
        BadFileError: a line can't be read, or its unit is unknown or does not fit.

    """
    _, above, separator, numbered, commas = _split(path, lambda which: which == [True, True])
    swapped, (first_unit, second_unit) = _header(path.name, above, separator, columns)
    rows, by = list[list[float]](), None if separator == " " else separator
    for i, line in numbered:
        try:
            first, second = map(float, (line.replace(",", ".") if commas else line).split(by))
        except ValueError:
            first = second = float("nan")
        if not isfinite(first + second) or "_" in line:  # Python ignores a '_' in a number
            names = ", ".join(columns)
            raise BadFileError(
                f"{path.name} line {i}: expected {names}, finite numbers; got '{line[:40]}'"
            )
        rows.append(
            [second * first_unit, first * second_unit]
            if swapped
            else [first * first_unit, second * second_unit]
        )
    return [i for i, _ in numbered], rows


class Cells(NamedTuple):
    """A table as text: names of columns (or numbers from 1), numbers of lines, and their cells.

    `comma` is true if a ',' in a cell is a decimal mark; `text` is the text of the whole file.
    """

    names: list[str]
    lines: list[int]
    rows: list[list[str]]
    comma: bool
    text: str


def read_cells(path: Path) -> Cells:
    """Read a table of any number of columns, with the separators of `read_columns`.

    A line above the rows is part of the header if it has as many cells as a row. The texts of
    several header lines are joined with blanks, column by column.

    Raises:
        BadFileError: the file can't be read, has no rows, or a row has more or fewer cells.

    """
    text, above, separator, numbered, commas = _split(path, all)
    rows = [_cells(line, separator) for _, line in numbered]
    for (i, _), row in zip(numbered[::-1], rows[::-1], strict=True):
        if all(row) and not any(_is_number(cell, separator) for cell in row):
            raise BadFileError(
                f"line {i}: '{', '.join(row)[:40]}' names columns below line {numbered[0][0]}, "
                f"the first with a number; delete what a device wrote above line {i}"
            )
    if not rows:
        raise BadFileError("no rows of two numbers or more, separated by ';', tabs, ',' or blanks")
    count = len(rows[0])
    wrong = [(i, row) for (i, _), row in zip(numbered, rows, strict=True) if len(row) != count]
    if wrong:
        i, row = wrong[0]
        raise BadFileError(f"line {i}: {len(row)} cells, where the first row has {count}")
    header = [line for _, line in above if line[0] != "#"]
    heads = [
        _cells(line.lstrip("# \t"), separator) for line in header or [line for _, line in above]
    ]
    fitting = [cells for cells in heads if len(cells) == count]
    if header and not fitting:
        line = f"line {above[-1][0]}"
        wanted = f"expected {count} names of columns, separated as numbers are"
        raise BadFileError(f"{line}: {wanted}; got {len(heads[-1])}")
    joined = [" ".join(filter(None, cells)) for cells in zip(*fitting, strict=True)]
    names = joined or [str(k + 1) for k in range(count)]
    return Cells(names, [i for i, _ in numbered], rows, bool(commas), text)


Lines = list[tuple[int, str]]


def _split(
    path: Path, fits: Callable[[list[bool]], bool]
) -> tuple[str, Lines, str, Lines, list[int]]:
    """Return the text, lines above the first row, the separator, rows, and lines with a ','.

    `fits` gets a flag for each cell of a line: is it a number? The first line that fits is the
    first row.
    """
    try:
        text = path.read_text(encoding="utf-8-sig").replace('"', "")
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        other = f"text in another encoding than UTF-8, such as Latin-1 (line {line}): {_SAVE}"
        kinds = (kind for begin, kind in _KINDS.items() if error.object.startswith(begin))
        raise BadFileError(f"the file is {next(kinds, other)}") from None
    except OSError as error:
        raise BadFileError(f"can't read the file: {error.strerror or error}") from None
    lines = [(i, line.strip()) for i, line in enumerate(text.split("\n"), 1) if line.strip()]
    separators = (
        (k, _separator(line, fits)) for k, (_, line) in enumerate(lines) if line[0] != "#"
    )
    begin, separator = next(((k, by) for k, by in separators if by), (len(lines), ","))
    numbered = [(i, line) for i, line in lines[begin:] if line[0] != "#"]
    commas = [i for i, line in numbered if "," in line] if separator != "," else []
    if commas and any("." in line for _, line in numbered):
        raise BadFileError(f"{path.name} line {commas[0]}: numbers with ',', others with '.'")
    return text, lines[:begin], separator, numbered, commas


def _separator(line: str, fits: Callable[[list[bool]], bool]) -> str:
    """Return what separates numbers, or else cells of which one is a number; '' if nothing does."""
    by = {
        separator: [_is_number(cell, separator) for cell in _cells(line, separator)]
        for separator in _SEPARATORS
    }
    several = [separator for separator in by if len(by[separator]) > 1]
    some = [separator for separator in several if any(by[separator]) and separator != " "]
    return next(iter([separator for separator in several if fits(by[separator])] + some), "")


def _cells(line: str, separator: str) -> list[str]:
    if separator == " ":
        return _CELL.findall(line)
    return [cell.strip() for cell in line.split(separator)]


def _is_number(cell: str, separator: str) -> bool:
    try:
        float(cell if separator == "," else cell.replace(",", "."))
    except ValueError:
        return False
    return True


def _header(
    file: str, above: Sequence[tuple[int, str]], separator: str, columns: Columns
) -> tuple[bool, list[float]]:
    """Tell whether the columns are swapped, and return each column's unit in SI.

    A line behind a '#' is a header if it has exactly two names, with units or without.
    """
    swapped, units = False, [1.0, 1.0]
    for i, line in above:
        content = line.lstrip("# \t")
        ways = [_cells(content, by) for by in (separator, *_SEPARATORS)]
        cells = next((way for way in ways if len(way) == 2), [])
        if content != line and not (cells and all(map(_COMMENTED.fullmatch, cells))):
            continue  # a comment
        try:
            if not cells:
                raise BadFileError(f"expected names of {', '.join(columns)}; got '{content[:40]}'")
            turned, named = _named(cells, columns)
        except BadFileError as error:
            raise BadFileError(f"{file} line {i}: {error}") from None
        swapped = swapped or turned
        units = [new or old for new, old in zip(named, units, strict=True)]
    return swapped, units


def _named(cells: list[str], columns: Columns) -> tuple[bool, list[float | None]]:
    """Tell whether cells name the columns in swapped order; also return the columns' units."""
    words = [_words(cell) for cell in cells]
    first, second = (_CALLED.get(name, set[str]()) for name in columns)
    swapped = bool(first & words[1]) and not (first & words[0] or second & words[1])
    if columns is PLACES and _POLAR & words[0] and not (first | second) & (words[0] | words[1]):
        raise BadFileError(f"'{cells[0]}' and '{cells[1]}' are polar: give x and y")
    units = [
        unit_of(*both)
        for both in zip(cells[:: -1 if swapped else 1], columns.values(), strict=True)
    ]
    if columns is PLACES and units.count(None) == 1 and 1.0 not in units:
        raise BadFileError(f"'{cells[0]}' and '{cells[1]}': only one of them has a unit")
    return swapped, units


def names_time(cell: str) -> bool:
    """Tell whether a header's cell names a column of time."""
    return bool(_CALLED["time"] & _words(cell))


def bare_name(cell: str) -> str:
    """Return a header's cell without a unit in brackets."""
    return _BRACKETED.sub("", cell).strip()


def _words(cell: str) -> set[str]:
    return set(re.findall(r"[^\W\d_]+", _BRACKETED.sub("", cell).lower()))


def unit_of(cell: str, dimensions: Sequence[Dimension]) -> float | None:
    """Return the unit, in SI, in a header's cell: in brackets, behind a name, or alone."""
    bracketed = _BRACKETED.search(cell)
    if not dimensions or (bracketed and bracketed[1] == _OF_TIME):
        return None
    begins = [0, *(gap.end() for gap in re.finditer(r"[_\s/]+", cell))]
    named = dict[str, Unit]()
    for text in [bracketed[1]] if bracketed else [cell[begin:] for begin in begins]:
        try:
            named[text] = _find(text, dimensions[0])
        except UnknownUnitError as error:
            if bracketed or isinstance(error, AmbiguousUnitError):
                raise BadFileError(f"'{cell[:40]}': {error}") from None
    fitting = [unit for unit in named.values() if any(x.accepts(unit.powers) for x in dimensions)]
    if fitting and (bracketed or "in" not in named):  # 'in' may be a word, not inches
        return fitting[0].factor
    if not named or len(cell) == 1:  # 't' is the time, not a tonne
        return None
    what = " or ".join(f"{dimension.words} ({dimension.si})" for dimension in dimensions)
    alone = "" if bracketed else "; a unit in brackets counts alone"
    raise BadFileError(f"'{cell[:40]}': '{next(iter(named))}' is no unit of {what}{alone}")


def _find(text: str, wanted: Dimension) -> Unit:
    """Find a unit as headers spell it: 'rad s-1', 'm/s2', 'lb-ft', also in capitals."""
    name = re.sub(r"(?<=[A-Za-z])(-?[0-9])", r"^\1", text.replace("\N{MINUS SIGN}", "-"))
    name = re.sub(r"(?<=[A-Za-z])-(?=[A-Za-z])", " ", name)
    if wanted in {Dimension.FORCE, Dimension.TORQUE}:
        name = re.sub(r"\b(lbs?)\b", "lbf", name, flags=re.IGNORECASE)
    with suppress(UnknownUnitError):
        return find_unit(name, wanted)
    return find_unit(name.lower() if len(name) > 1 else name, wanted)


LARGEST_FILE = 20_000_000  # bytes


class PointFiles(NamedTuple):
    """Sections in which the `points` of each `file` replace its name, and mistakes in files.

    `lines` has, by the path of the part that names a file, the file and the line number of each
    point.
    """

    sections: dict[str, Any]
    lines: dict[KeyPath, tuple[str, list[int]]]
    mistakes: list[Mistake]

    def placed(self, mistake: Mistake) -> Mistake:
        """Return a mistake in a point as a mistake at its line of the file."""
        for part, (file, lines) in self.lines.items():
            if mistake.path[: len(part) + 1] == (*part, "points"):
                row = [f" line {lines[int(i)]}" for i in mistake.path[len(part) + 1 :][:1]]
                message = f"{''.join([file, *row])}: {mistake.message}"
                return replace(mistake, path=(*part, "file"), message=message)
        return mistake


def read_point_files(document: Document, allow_outside: bool = False) -> PointFiles:
    """Read the files that a document names.

    They must be in its folder, unless `allow_outside`. If a file can't be used, its name stays in
    the section, and there is a mistake at the key `file`.
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
        if path[0] == "springs" and path[-1] in SPRING_COLUMNS:
            table, columns = True, SPRING_COLUMNS[str(path[-1])]
        if (spline or table) and isinstance(file, str) and not value.get("points"):
            try:
                located = _located(document, file, allow_outside)
                numbers, value["points"] = read_columns(located, columns)
            except BadFileError as error:
                mistakes.append(Mistake((*path, "file"), str(error)))
            else:
                lines[path] = (value.pop("file"), numbers)
        return value

    keys = [key for key in ("curves", "springs", "drives") if key in document.data]
    sections: dict[str, Any] = {key: filled(document.data[key], (key,)) for key in keys}
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
    """Return the columns of a drive's table; its value may have several dimensions."""
    drive = _part(document.data["drives"], path[1])
    dimensions = DRIVE_DIMENSIONS.get(str(drive.get("type")), ())
    joint = _part(document.data.get("joints"), drive.get("joint")).get("type")
    if len(dimensions) > 1 and joint is not None:
        dimensions = dimensions[:1] if joint == "revolute" else dimensions[1:]
    return {"time": (Dimension.TIME,), "value": dimensions}


def _part(section: Any, name: Any) -> dict[str, Any]:
    """Return a part as it was written; an empty one if it is missing."""
    part = section.get(name) if isinstance(section, dict) and isinstance(name, str) else None
    return part if isinstance(part, dict) else {}
