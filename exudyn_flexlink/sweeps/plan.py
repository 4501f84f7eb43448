"""The plan of a sweep: a scene, values that vary, and points in an order that never changes.

Each varied path of the scene has values: a range or a list, with a unit or without. A design
combines values of all paths into points. Tables have numbers in the SI unit of their path.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import product
from math import isfinite, prod
from sys import float_info
from typing import Any, get_args

import numpy as np

from exudyn_flexlink.loading import document_of
from exudyn_flexlink.quantities import (
    NUMBER,
    UNIT,
    Dimension,
    Measure,
    Quantity,
    StiffnessOfPower,
    UnknownUnitError,
    find_unit,
    in_words,
)
from exudyn_flexlink.scene import Part, Scene, apply_settings, check_document
from exudyn_flexlink.scene.forces import Measured, Varying
from exudyn_flexlink.shipped import EXUDYN, THIS, version_of
from exudyn_flexlink.source import (
    MINUS,
    Document,
    HintedError,
    KeyPath,
    Mistake,
    SceneError,
    Setting,
    dotted,
    read_yaml,
)

MOST_POINTS = 1_000_000  # or values of a range: a plan of this size takes about a gigabyte
DIGITS = 12  # of a value within a range: 0.3 stays 0.3 in spite of rounding
HINT = "start:stop:count such as '2:40:20' or '0:5:11 mm', or a list such as '1, 2, 5 mm'"
RANGE_HINT = "lowest:highest such as '2:40' or '0:5 mm'"
_NUMBER = re.compile(rf"\s*({NUMBER})\s*({UNIT})?\s*")
_COUNT = re.compile(rf"\s*([0-9]+)\s*({UNIT})?\s*")

Value = float | str
"""A number, or a text as it stands in a model file, such as '5 mm' or 'beam'."""


class Written(str):
    """A list, a mapping or a truth value, written as JSON."""

    __slots__ = ()


class ValuesError(HintedError):
    """A text that gives no values; `hint` shows how to write them, `entry` is the wrong entry."""

    def __init__(self, message: str, hint: str = HINT, entry: int | None = None) -> None:
        super().__init__(message, hint)
        self.entry = entry


@dataclass(frozen=True)
class Range:
    """Numbers from `low` to `high`, both in `unit`; an empty unit is the SI unit."""

    low: float
    high: float
    unit: str

    def at(self, part: float) -> Value:
        """Value at a part of the range, 0 to 1."""
        return self._written(self.low + part * (self.high - self.low))

    def spread(self, count: int) -> tuple[Value, ...]:
        """Values at equal distances, both ends among them."""
        return tuple(self._written(x) for x in np.linspace(self.low, self.high, count).tolist())

    def _written(self, value: float) -> Value:
        number = float(f"{value:.{DIGITS}g}")
        return f"{number_text(number)} {self.unit}" if self.unit else number


def number_text(number: float) -> str:
    """Return a number as text of a model file; a whole number has no point, as counts need."""
    return str(int(number)) if number.is_integer() and abs(number) < 1e15 else repr(number)


def values_of(given: Any) -> tuple[Value, ...]:
    """Read the values of a path: a text as on the command line, or a sequence of values.

    Raises:
        ValuesError: `given` can't be read as values.

    """
    if isinstance(given, str):
        return _of_text(given)
    if hasattr(given, "tolist"):  # of numpy
        given = given.tolist()
    if isinstance(given, bool | int | float):
        given = (given,)
    if not isinstance(given, Sequence) or isinstance(given, bytes | bytearray | memoryview):
        raise ValuesError(f"expected values, got {in_words(given)}")
    return _listed([value_of(item, i) for i, item in enumerate(given)])


def range_of(given: Any) -> Range:
    """Read the two ends of a range.

    Raises:
        ValuesError: `given` can't be read as a range.

    """
    if isinstance(given, str):
        ends: Sequence[Any] = given.split(":")
    else:
        ends = given if isinstance(given, Sequence) else ()
    if len(ends) != 2:
        raise ValuesError(f"expected two ends, got {in_words(given)}", RANGE_HINT)
    chosen = _range(str(ends[0]), str(ends[1]), RANGE_HINT)
    if chosen.low > chosen.high:
        raise ValuesError(f"the range {in_words(given)} runs backwards", "give the lower end first")
    return chosen


def _listed(values: Sequence[Value]) -> tuple[Value, ...]:
    if not values:
        raise ValuesError("needs at least one value")
    seen: set[Value] = set()
    for i, value in enumerate(values):
        if value in seen:
            raise ValuesError(f"{in_words(value)} is there twice", "", i)
        seen.add(value)
    return tuple(values)


def _of_text(text: str) -> tuple[Value, ...]:
    if ":" in text:
        parts = text.split(":")
        if len(parts) != 3:
            raise ValuesError(f"expected start:stop:count, got '{text}'")
        last = _COUNT.fullmatch(parts[2])
        if last is None or not 2 <= int(last[1]) <= MOST_POINTS:
            raise ValuesError(
                f"expected a number of values, 2 to {MOST_POINTS}, after the second colon; "
                f"got '{parts[2].strip()}'"
            )
        return _range(parts[0], parts[1], HINT, last[2] or "").spread(int(last[1]))
    read = read_yaml(f"[{text}]")
    if read.problems or not isinstance(read.data, list):
        raise ValuesError(f"expected values, got '{text}'")
    return _listed(_with_last_unit([value_of(item, i) for i, item in enumerate(read.data)]))


def _with_last_unit(values: list[Value]) -> Sequence[Value]:
    """Give all values the unit of the last one if no other has a unit: '1, 2, 5 mm'."""
    last = parts_of(values[-1]) if values else None
    if last is None or not all(isinstance(value, float) for value in values[:-1]):
        return values
    return [*(f"{number_text(float(value))} {last[1]}" for value in values[:-1]), values[-1]]


def _range(low: str, high: str, hint: str, unit: str = "") -> Range:
    ends = [_NUMBER.fullmatch(text) for text in (low, high)]
    if not (ends[0] and ends[1]):
        wrong = high if ends[0] else low
        raise ValuesError(f"expected a number, or one with a unit, got '{wrong.strip()}'", hint)
    units = {unit.strip(), *((end[2] or "").strip() for end in ends if end)} - {""}
    if len(units) > 1:
        units_given = " and ".join(f"'{unit}'" for unit in sorted(units))
        raise ValuesError(f"the range has the units {units_given}", "give one, which holds for all")
    numbers = [float(end[1].replace(MINUS, "-")) for end in ends if end]
    if not all(map(isfinite, numbers)):
        raise ValuesError(f"'{low}:{high}' is no finite range", hint)
    if numbers[0] == numbers[1]:
        raise ValuesError(f"the range '{low}:{high}' is one value", hint)
    return Range(numbers[0], numbers[1], units.pop() if units else "")


def value_of(given: Any, entry: int | None = None) -> Value:
    """Return a value as a number, or as a text for a model file.

    Raises:
        ValuesError: no model file can hold it.

    """
    if hasattr(given, "tolist"):  # of numpy
        given = given.tolist()
    if isinstance(given, int | float) and not isinstance(given, bool):
        if not abs(given) <= float_info.max:  # nan, inf, or an int too large for a float
            raise ValuesError(f"must be a finite number, got {in_words(given)}", entry=entry)
        return float(given)
    if isinstance(given, str):
        if given.strip():
            return given
    elif isinstance(given, bool | Mapping | Sequence):
        with suppress(TypeError, ValueError):
            return Written(json.dumps(given, ensure_ascii=False))
    raise ValuesError(f"expected a value, got {in_words(given)}", entry=entry)


def setting_of(path: str, value: Value) -> tuple[str, Any]:
    """Return the setting that puts a value into the scene; YAML does not read a text again."""
    if isinstance(value, str):
        return path, json.loads(value) if isinstance(value, Written) else value
    return path, json.loads(number_text(value))


def unit_of(values: Sequence[Value]) -> str:
    """Return the common unit of all values, as written; empty if they have different ones."""
    units = {parts[1] if (parts := parts_of(value)) else "" for value in values}
    return units.pop() if len(units) == 1 else ""


def parts_of(value: Value) -> tuple[float, str] | None:
    """Number and unit of a text with both, the unit as it is written; None for other values."""
    match = _NUMBER.fullmatch(value) if isinstance(value, str) else None
    if match is None or match[2] is None:
        return None
    return float(match[1].replace(MINUS, "-")), match[2].strip()


_SYMBOLS = {"metres": "m", "radians": "rad", "seconds": "s"}
_ALL = {_SYMBOLS.get(each.si, each.si) for each in Dimension} - {""}
_UNITS = sorted(_ALL | {"J", "W", "N s", "1/s"}, key=len, reverse=True)
"""Units that end the names of columns, the longest first: rad/s is not s."""


def si_unit(scene: Scene, path: str) -> str:
    """Return the SI unit of the number at a path, such as 'rad/s'; empty where it has none."""
    measured = quantity_at(scene, path)
    return "" if measured is None else symbol_of(measured.dimension)


def symbol_of(dimension: Measure) -> str:
    """Return the SI unit of a dimension as text behind a number."""
    return _SYMBOLS.get(dimension.si, dimension.si)


def column_of(path: str, unit: str) -> str:
    """Return the name of a path's column, which ends in the unit: 'run.sample_s'."""
    text = unit.replace("/", "_per_").replace(" ", "_").replace("^", "")
    return f"{path}_{text}" if text else path


def column_of_contact(scene: Scene, contact: str, name: str, unit: str) -> str:
    """Return the name of a contact's column; a hinge's stop has torques in place of forces."""
    unit = scene.unit_of(contact, unit)
    return column_of(name.replace("force", "torque") if unit == "N m" else name, unit)


def in_si(value: Value, unit: str) -> Value:
    """Return a number in the SI `unit`; a text that is not a quantity stays as it is."""
    parts = parts_of(value)
    measures = (measure for measure in Dimension if symbol_of(measure) == unit)
    wanted = next(measures, Dimension.NUMBER)
    try:
        return value if parts is None else parts[0] * find_unit(parts[1], wanted).factor
    except UnknownUnitError:
        return value


def quantity_at(scene: Scene, path: str) -> Quantity | None:
    """Return dimension and limits of the number at a path; None if they are not known."""
    value: Any = scene
    owner: Any = None
    hints: tuple[Any, ...] = ()
    for step in path.split("."):
        if isinstance(value, Part):
            fields = type(value).model_fields.items()
            key = next((key for key, field in fields if step in (key, field.alias)), None)
            if key is None:
                return None
            field = type(value).model_fields[key]
            owner, hints, value = value, (field.annotation, *field.metadata), getattr(value, key)
        elif isinstance(value, Mapping):  # of a missing name the annotations tell the quantity
            value = value.get(step)
        elif isinstance(value, tuple):
            value = value[int(step)] if step.isdecimal() and int(step) < len(value) else None
        else:
            return None
    if isinstance(value, Measured):
        return Quantity(value.dimension)
    quantity = next((quantity_read for hint in hints for quantity_read in _quantities(hint)), None)
    return quantity.beside(owner.exponent) if isinstance(quantity, StiffnessOfPower) else quantity


def _quantities(hint: Any) -> Iterator[Quantity]:
    """Quantities in the annotations of a type, if these leave no choice."""
    if isinstance(hint, Quantity):
        yield hint
    elif isinstance(hint, Varying):
        yield from map(Quantity, hint.dimensions if len(hint.dimensions) == 1 else ())
    else:
        for inner in (*get_args(hint), *getattr(hint, "__metadata__", ())):
            yield from _quantities(inner)


def label_of(column: str) -> tuple[str, str]:
    """Return a column's name without its unit, and the unit as it is written; empty if it has none.

    >>> label_of("lever.swing_rad")
    ('lever.swing', 'rad')
    """
    for unit in _UNITS:
        ending = column_of("", unit)
        if column.endswith(ending):
            return column.removesuffix(ending), unit
    return column, ""


Read = Callable[[Any], Any]


@dataclass(frozen=True)
class Design:
    """Points, each with a value for every path; `places` are those of the values in the input."""

    paths: tuple[str, ...]
    points: tuple[tuple[Value, ...], ...]
    places: tuple[Mapping[Value, KeyPath], ...]


def grid(varied: Mapping[str, Any], section: KeyPath, mistakes: list[Mistake]) -> Design | None:
    """Return all combinations of the values of all paths; the last path varies fastest.

    `section` is the path of `varied` in the document, for mistakes. Paths without values are left
    out; None if no path is left.
    """
    read = _read_all(values_of, varied, section, mistakes)
    if not read or not _allowed_count(prod(map(len, read.values())), section, mistakes):
        return None
    places = tuple(
        {value: _entry((*section, path), varied[path], k) for k, value in enumerate(values)}
        for path, values in read.items()
    )
    return Design(tuple(read), tuple(product(*read.values())), places)


def listed(points: Sequence[Any], section: KeyPath, mistakes: list[Mistake]) -> Design | None:
    """Return points as they are listed, each a mapping of paths to values."""
    numbers: dict[tuple[Value, ...], int] = {}  # each point and its number
    paths: tuple[str, ...] = ()
    before = len(mistakes)
    for i, point in enumerate(points):
        if not isinstance(point, Mapping) or not point:
            got = "an empty one" if point == {} else in_words(point)
            message = f"expected a mapping of paths to values, got {got}"
            mistakes.append(Mistake((*section, i), message))
            continue
        if not paths:
            paths = tuple(point)
            _refuse_twice(paths, (*section, i), mistakes)
        if set(point) != set(paths):
            message = f"gives {', '.join(point)}, the first point {', '.join(paths)}"
            mistakes.append(Mistake((*section, i), message, "all points give the same paths"))
            continue
        values = tuple(
            _read(value_of, point[path], (*section, i, path), mistakes) for path in paths
        )
        if values in numbers:
            mistakes.append(Mistake((*section, i), f"is the point {numbers[values] + 1} again"))
        numbers.setdefault(values, i)
    if not points:
        mistakes.append(Mistake(section, "needs at least one point"))
    if len(mistakes) > before or not _allowed_count(len(numbers), section, mistakes):
        return None
    places = tuple(
        {point[i]: (*section, k, path) for point, k in reversed(numbers.items())}
        for i, path in enumerate(paths)
    )
    return Design(paths, tuple(numbers), places)


def drawn(  # noqa: PLR0913  (all of these make other points)
    kind: str,
    ranges: Mapping[str, Any],
    count: int,
    section: KeyPath,
    mistakes: list[Mistake],
    *,
    seed: int,
) -> Design | None:
    """Return `count` points within the ranges: independent and uniform if the kind is "random".

    With "latin_hypercube" each range is cut into `count` equal parts; each part has one point.
    """
    read = _read_all(range_of, ranges, section, mistakes)
    if not read or not _allowed_count(count, section, mistakes):
        return None
    # The import of scipy takes a second; commands without a sweep should not wait for it.
    from scipy.stats.qmc import LatinHypercube  # noqa: PLC0415

    generator, size = np.random.default_rng(seed), len(read)
    if kind == "random":
        parts = generator.random((count, size))
    else:
        parts = LatinHypercube(size, rng=generator).random(count)
    columns = {
        path: [distribution.at(part) for part in column]
        for (path, distribution), column in zip(read.items(), parts.T.tolist(), strict=True)
    }
    places = tuple(dict.fromkeys(column, (*section, path)) for path, column in columns.items())
    return Design(tuple(columns), tuple(zip(*columns.values(), strict=True)), places)


def _read_all(
    read: Read, varied: Mapping[str, Any], section: KeyPath, mistakes: list[Mistake]
) -> dict[str, Any]:
    """Return the values of each path that was read without mistakes."""
    if not varied:
        mistakes.append(
            Mistake(section, "nothing is varied", "a path of the model, and its values")
        )
    _refuse_twice(varied, section, mistakes)
    values = {
        path: _read(read, given, (*section, path), mistakes) for path, given in varied.items()
    }
    return {path: value for path, value in values.items() if value is not None}


def _refuse_twice(paths: Iterable[str], section: KeyPath, mistakes: list[Mistake]) -> None:
    """Refuse a path that equals an earlier one except for blanks, or contains it, or is in it."""
    seen: list[str] = []
    for path in paths:
        meant = ".".join(step.strip() for step in path.split("."))
        inside = (p for p in seen if f"{meant}.".startswith(f"{p}.") or p.startswith(f"{meant}."))
        if (other := next(inside, None)) is not None:
            both = "" if other == meant else f" with '{other}'"
            mistakes.append(Mistake((*section, path), f"'{meant}' is varied twice{both}"))
        seen.append(meant)


def _read(read: Read, given: Any, place: KeyPath, mistakes: list[Mistake]) -> Any:
    """Return the values, or None after noting a mistake."""
    try:
        return read(given)
    except ValuesError as error:
        where = place if error.entry is None else _entry(place, given, error.entry)
        mistakes.append(Mistake(where, error.message, error.hint))
        return None


def _entry(place: KeyPath, given: Any, k: int) -> KeyPath:
    """Place of a value: its entry, if the values are a list."""
    return place if isinstance(given, str) else (*place, k)


def _allowed_count(count: int, section: KeyPath, mistakes: list[Mistake]) -> bool:
    """Tell whether a design may have so many points; note the mistake if not."""
    if not 1 <= count <= MOST_POINTS:
        mistakes.append(Mistake(section, f"makes {count} points; there may be 1 to {MOST_POINTS}"))
    return 1 <= count <= MOST_POINTS


HASH_DIGITS = 16  # hex digits of a SHA-256: no two of a million points share one
MOST_CHECKED = 1000  # values of a path that are checked before the first run; takes some seconds
PACKAGES = (THIS, "exudyn", "numpy", "scipy")  # numbers depend on their versions


@dataclass(frozen=True)
class Varied:
    """A path of the scene whose values vary; `unit` is the SI unit, `given` the user's unit.

    Either is empty if there is none; `given` is empty, too, if the user gave values in SI.
    """

    path: str
    unit: str
    given: str

    @property
    def column(self) -> str:
        """Name of its column, with the unit of the SI."""
        return column_of(self.path, self.unit)


@dataclass(frozen=True)
class Point:
    """One point of a sweep: its number from 1, settings of the scene, values in SI.

    `id` depends on the scene, the settings and the solver only: it is the same in every process and
    in every later plan of the sweep.
    """

    number: int
    id: str
    settings: tuple[Setting, ...]
    values: tuple[Value, ...]


@dataclass(frozen=True)
class Sweep:
    """A plan: the runs of a scene, and the observables of each.

    `observed` names the kind of observables, so that no table mixes rows of two kinds.
    """

    scene: Scene
    engine: str
    varied: tuple[Varied, ...]
    points: tuple[Point, ...]
    measure: bool = True
    observed: str = ""
    allow_outside: bool = False

    def __len__(self) -> int:
        return len(self.points)


def planned(  # noqa: PLR0913  (all of these make other numbers)
    scene: Scene,
    design: Design | None,
    document: Document,
    *,
    engine: str = EXUDYN,
    measure: bool = True,
    observed: str = "",
    allow_outside: bool = False,
    mistakes: Iterable[Mistake] = (),
) -> Sweep:
    """Make a sweep of a scene; `document` has the design.

    `mistakes` were found while the design was read; the design lacks the paths with mistakes.

    Raises:
        SceneError: a path leads nowhere, or a value is not allowed; the error has all these
            mistakes. Values that are allowed only without certain others raise no error: the row
            of their point says so, as for a failed run.

    """
    all_mistakes = list(mistakes)
    if design is None:
        raise SceneError(document, all_mistakes)
    settings = [
        tuple(setting_of(path, value) for path, value in zip(design.paths, point, strict=True))
        for point in design.points
    ]
    all_mistakes += _mistakes(scene, design, settings, allow_outside)
    if all_mistakes:
        raise SceneError(document, all_mistakes)
    how = json.dumps([scene.to_data(), engine, measure], sort_keys=True)
    base = hashlib.sha256(how.encode()).hexdigest()
    units = [si_unit(scene, path) for path in design.paths]
    points = tuple(
        Point(number, _id(base, setting), setting, tuple(map(in_si, values, units)))
        for number, (setting, values) in enumerate(zip(settings, design.points, strict=True), 1)
    )
    given = zip(*design.points, strict=True)
    values = zip(*(point.values for point in points), strict=True)
    varied = tuple(
        _varied(path, unit, column, unit_of(as_given))
        for path, unit, column, as_given in zip(design.paths, units, values, given, strict=True)
    )
    return Sweep(scene, engine, varied, points, measure, observed, allow_outside)


def versions() -> dict[str, str]:
    """Versions of the packages that influence numbers."""
    return {name: version_of(name) for name in PACKAGES}


def _id(base: str, settings: Sequence[Setting]) -> str:
    text = "\n".join([base, *sorted(map(json.dumps, settings))])
    return hashlib.sha256(text.encode()).hexdigest()[:HASH_DIGITS]


def _varied(path: str, unit: str, values: Sequence[Value], given: str) -> Varied:
    """Describe a varied path; values that are texts, such as 'beam', have no unit."""
    numbers = any(isinstance(value, float) for value in values)
    return Varied(path, unit if numbers else "", given if numbers else "")


def _mistakes(
    scene: Scene, design: Design, settings: Sequence[Sequence[Setting]], allow_outside: bool
) -> Iterator[Mistake]:
    """Mistakes of single values, at their places in the input."""
    document = document_of(scene)
    nowhere: set[str] = set()  # paths that lead nowhere for any value
    for path, point_setting, places in zip(design.paths, settings[0], design.places, strict=True):
        try:
            apply_settings(document, [point_setting])
        except SceneError as error:
            nowhere.add(path)
            place = next(iter(places.values()))
            entry = place[:-1] if isinstance(place[-1], int) else place
            yield from (Mistake(entry, mistake.message, mistake.hint) for mistake in error.mistakes)
    for i, (path, places) in enumerate(zip(design.paths, design.places, strict=True)):
        if path in nowhere:
            continue
        first: dict[Value, Sequence[Setting]] = {}  # the point with which a value is checked
        for point, given in zip(design.points, settings, strict=True):
            first.setdefault(point[i], given)
        wrong: set[KeyPath] = set()  # places of mistakes: a range counts once, by its first value
        steps, values = tuple(path.split(".")), tuple(places)
        for value in (*values[:: -(-len(values) // MOST_CHECKED)], values[-1]):
            place = places[value]
            if place in wrong:
                continue
            together = [setting for setting in first[value] if setting[0] not in nowhere]
            for mistake in check_document(
                apply_settings(document, together), allow_outside
            ).mistakes:
                if _is_of(mistake, steps):
                    wrong.add(place)
                    yield _moved(mistake, place, len(steps))


def _is_of(mistake: Mistake, path: KeyPath) -> bool:
    """Tell whether a mistake is at a path, below it, or where the path ends early."""
    texts, words = [str(step) for step in mistake.path], [str(step) for step in path]
    shorter = min(len(texts), len(words))
    return texts[:shorter] == words[:shorter]


def _moved(mistake: Mistake, place: KeyPath, length: int) -> Mistake:
    """Return a mistake of the scene as a mistake of the study, at the place of the value."""
    inner = dotted(mistake.path[length:])
    message = f"{inner}: {mistake.message}" if inner else mistake.message
    return Mistake(place, message, mistake.hint)
