"""Values read from texts of the command line; mistakes raise argparse's errors."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from contextlib import suppress
from math import inf, isfinite, radians
from pathlib import Path
from typing import Any, TypeVar

from exudyn_flexlink.cli.terminal import complain, how_called
from exudyn_flexlink.shipped import FIGURE_FORMATS

MOST = 1_000_000  # of laps, retries, pixels or processes: more is a slip

Number = TypeVar("Number", int, float)


def _number(
    what: str, read: Callable[[str], Number], fits: Callable[[Number], bool]
) -> Callable[[str], Number]:
    """Return a reader of numbers that `fits` accepts; `what` tells in messages what is expected."""

    def value_of(text: str) -> Number:
        with suppress(ValueError):
            value = read(text)
            if fits(value):
                return value
        raise argparse.ArgumentTypeError(f"expected {what}, got '{text}'")

    return value_of


def _positive(value: float) -> bool:
    return 0 < value < inf


def _size(dimension: str, bare: Callable[[float], float] = float) -> Callable[[str], float]:
    """Return a reader of texts with a unit, as in model files; `bare` converts one without."""

    def read(text: str) -> float:
        with suppress(ValueError):
            return bare(float(text))
        from exudyn_flexlink.quantities import Dimension, to_si

        return to_si(text, Dimension[dimension])

    return read


duration = _number("a time of more than 0, such as 2 (s) or '20 ms'", _size("TIME"), _positive)
length = _number("a length of more than 0, such as 1e-6 (m) or '1 um'", _size("LENGTH"), _positive)
rate = _number("a number of more than 0", float, _positive)
instant = _number("a time, such as 1.5 (s) or '20 ms'", _size("TIME"), isfinite)
degrees = _number("an angle, such as 90 (deg) or '1 rad'", _size("ANGLE", radians), isfinite)
"""Read an angle in degrees, or with a unit; return it in rad."""
count = _number(f"a whole number from 0 to {MOST}", int, lambda value: 0 <= value <= MOST)
at_least_one = _number(f"a whole number from 1 to {MOST}", int, lambda value: 1 <= value <= MOST)


def shift(text: str) -> float | str:
    """Read the shift of times: a time, or 'find'."""
    return text if text == "find" else instant(text)


def names(text: str) -> list[str]:
    """Read names, separated by commas."""
    return [name.strip() for name in text.split(",")]


def names_of(known: tuple[str, ...], what: str) -> Callable[[str], list[str]]:
    """Return a reader of names separated by commas; they must be `known`."""

    def read(text: str) -> list[str]:
        columns = names(text)
        for name in columns:
            if name not in known:
                from exudyn_flexlink.source import unknown

                raise argparse.ArgumentTypeError(unknown(what, name, known))
        return columns

    return read


def _file(*endings: str) -> Callable[[str], Path]:
    """Return a reader of file names with one of these endings."""

    def read(text: str) -> Path:
        if Path(text).suffix[1:].lower() not in endings:
            known = ", ".join(f".{ending}" for ending in endings)
            raise argparse.ArgumentTypeError(f"'{text}' does not end in one of {known}")
        return Path(text)

    return read


figure_file = _file(*FIGURE_FORMATS)
page_file = _file("html", "htm")
"""A browser recognises the page by this ending."""


def slow(text: str) -> Any:
    """Read where a film is slow: the name of a contact, or one of its strikes."""
    from exudyn_flexlink.animation.film import Slow

    try:
        return Slow.of(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def model_path(text: str) -> Path:
    """Return the file of this path; if there is none, the file of the model with this name.

    A folder does not count as a file: a model's name means the model even beside such a folder.
    """
    if not text:
        raise argparse.ArgumentTypeError("expected a file, or the name of a model; got nothing")
    from exudyn_flexlink.shipped import model_file

    path = Path(text)
    if path.suffix or (path.exists() and not (path.is_dir() and model_file(text))):
        return path
    yaml = path.with_name(f"{path.name}.yaml")
    meant = str(yaml) if yaml.is_file() else ""
    shipped = shipped_model(text, "no file '{}', and no model of that name", meant)
    if meant:
        complain(f"hint: '{text}' is the model that comes with the program, not your '{yaml}'")
    return shipped


def shipped_model(name: str, what: str = "no model '{}'", meant: str = "") -> Path:
    """Return the file of a model that comes with the program; `what` is the message without one.

    The message suggests `meant`, by default the model with the nearest name.
    """
    from exudyn_flexlink.shipped import known_names, model_file
    from exudyn_flexlink.source import did_you_mean

    file = model_file(name)
    if file is not None:
        return file
    near = f"; did you mean '{meant}'?" if meant else did_you_mean(name, known_names())
    about = f"{what.format(name)} comes with the program{near}"
    raise argparse.ArgumentTypeError(f"{about}\nhint: '{how_called()} new --list' names all")


def published_file(text: str) -> Path:
    """Return a file of published numbers, given by its path or by the name of a benchmark."""
    from exudyn_flexlink.shipped import PUBLISHED, benchmark_files
    from exudyn_flexlink.source import unknown

    if text.endswith(PUBLISHED):
        return Path(text)
    files = benchmark_files()
    if text not in files:
        raise argparse.ArgumentTypeError(unknown("benchmark", text, files))
    return files[text]


def pairs(option: str, texts: list[str]) -> dict[str, str]:
    """Read NAME=TEXT of an option that may be repeated; '--vary' may leave the text out."""
    paths: dict[str, str] = {}
    for text in texts:
        name, _, value = (part.strip() for part in text.partition("="))
        if option == "--column" and not (name and value):
            about = f"{option}: expected NAME=QUANTITY such as 'theta=lever.angle', got '{text}'"
            raise argparse.ArgumentTypeError(about)
        if name in paths:
            raise argparse.ArgumentTypeError(f"{option}: '{name}' is given twice")
        paths[name] = value
    return paths
