"""Designs: which values a sweep puts together in each of its points, in a fixed order."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod
from typing import Any

import numpy as np

from exudyn_flexlink.quantities import in_words
from exudyn_flexlink.source import KeyPath, Mistake
from exudyn_flexlink.sweeps.values import Value, ValuesError, range_of, value_of, values_of

MOST_POINTS = 1_000_000  # the plan of so many takes about a gigabyte
Read = Callable[[Any], Any]


@dataclass(frozen=True)
class Design:
    """Points, each a value for every path; `places` tells where each value of a path is given."""

    paths: tuple[str, ...]
    points: tuple[tuple[Value, ...], ...]
    places: tuple[Mapping[Value, KeyPath], ...]


def grid(varied: Mapping[str, Any], at: KeyPath, mistakes: list[Mistake]) -> Design | None:
    """Return every value of each path with every value of the others; the last varies fastest.

    `at` is the path of `varied` in the document that mistakes belong to. Paths without values are
    left out; None if nothing is left.
    """
    read = _read_all(values_of, varied, at, mistakes)
    if not read or not _few(prod(map(len, read.values())), at, mistakes):
        return None
    places = tuple(
        {value: _entry((*at, path), varied[path], k) for k, value in enumerate(values)}
        for path, values in read.items()
    )
    return Design(tuple(read), tuple(product(*read.values())), places)


def listed(points: Sequence[Any], at: KeyPath, mistakes: list[Mistake]) -> Design | None:
    """Return points as they are listed, each a mapping of paths to values."""
    found: dict[tuple[Value, ...], int] = {}  # each point and its number
    paths: tuple[str, ...] = ()
    before = len(mistakes)
    for i, point in enumerate(points):
        if not isinstance(point, Mapping) or not point:
            got = "an empty one" if point == {} else in_words(point)
            message = f"expected a mapping of paths to values, got {got}"
            mistakes.append(Mistake((*at, i), message))
            continue
        if not paths:
            paths = tuple(point)
            _refuse_twice(paths, (*at, i), mistakes)
        if set(point) != set(paths):
            message = f"gives {', '.join(point)}, the first point {', '.join(paths)}"
            mistakes.append(Mistake((*at, i), message, "all points give the same paths"))
            continue
        values = tuple(_read(value_of, point[path], (*at, i, path), mistakes) for path in paths)
        if values in found:
            mistakes.append(Mistake((*at, i), f"is the point {found[values] + 1} again"))
        found.setdefault(values, i)
    if not points:
        mistakes.append(Mistake(at, "needs at least one point"))
    if len(mistakes) > before or not _few(len(found), at, mistakes):
        return None
    places = tuple(
        {point[i]: (*at, k, path) for point, k in reversed(found.items())}
        for i, path in enumerate(paths)
    )
    return Design(paths, tuple(found), places)


def drawn(  # noqa: PLR0913  (all of these make other points)
    kind: str,
    ranges: Mapping[str, Any],
    count: int,
    at: KeyPath,
    mistakes: list[Mistake],
    *,
    seed: int,
) -> Design | None:
    """Return `count` points within their ranges: evenly and independently if the kind is "random".

    A "latin_hypercube" fills them: of each range, cut into `count` equal parts, each holds one.
    """
    read = _read_all(range_of, ranges, at, mistakes)
    if not read or not _few(count, at, mistakes):
        return None
    # scipy takes a second to import, which commands that sweep nothing should not wait for
    from scipy.stats.qmc import LatinHypercube  # noqa: PLC0415

    generator, size = np.random.default_rng(seed), len(read)
    if kind == "random":
        parts = generator.random((count, size))
    else:
        parts = LatinHypercube(size, rng=generator).random(count)
    columns = {
        path: [own.at(part) for part in column]
        for (path, own), column in zip(read.items(), parts.T.tolist(), strict=True)
    }
    places = tuple(dict.fromkeys(own, (*at, path)) for path, own in columns.items())
    return Design(tuple(columns), tuple(zip(*columns.values(), strict=True)), places)


def _read_all(
    read: Read, varied: Mapping[str, Any], at: KeyPath, mistakes: list[Mistake]
) -> dict[str, Any]:
    """Return what was read of each path, without those that have mistakes."""
    if not varied:
        mistakes.append(Mistake(at, "nothing is varied", "a path of the model, and its values"))
    _refuse_twice(varied, at, mistakes)
    found = {path: _read(read, given, (*at, path), mistakes) for path, given in varied.items()}
    return {path: one for path, one in found.items() if one is not None}


def _refuse_twice(paths: Iterable[str], at: KeyPath, mistakes: list[Mistake]) -> None:
    """Refuse a path that is another but for blanks, or in it: one is varied, and both are told."""
    seen: list[str] = []
    for path in paths:
        meant = ".".join(step.strip() for step in path.split("."))
        inside = (p for p in seen if f"{meant}.".startswith(f"{p}.") or p.startswith(f"{meant}."))
        if (other := next(inside, None)) is not None:
            both = "" if other == meant else f" with '{other}'"
            mistakes.append(Mistake((*at, path), f"'{meant}' is varied twice{both}"))
        seen.append(meant)


def _read(read: Read, given: Any, place: KeyPath, mistakes: list[Mistake]) -> Any:
    """Return what was read, or None after noting the mistake."""
    try:
        return read(given)
    except ValuesError as error:
        where = place if error.entry is None else _entry(place, given, error.entry)
        mistakes.append(Mistake(where, error.message, error.hint))
        return None


def _entry(place: KeyPath, given: Any, k: int) -> KeyPath:
    """Place of a value: its entry, if the values are a list."""
    return place if isinstance(given, str) else (*place, k)


def _few(count: int, at: KeyPath, mistakes: list[Mistake]) -> bool:
    if not 1 <= count <= MOST_POINTS:
        mistakes.append(Mistake(at, f"makes {count} points; there may be 1 to {MOST_POINTS}"))
    return 1 <= count <= MOST_POINTS
