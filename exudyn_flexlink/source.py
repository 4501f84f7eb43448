"""A model file as a `Document`, and its mistakes shown where they stand."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from exudyn_flexlink.raising import Sendable
from exudyn_flexlink.shipped import model_file
from exudyn_flexlink.yaml_reader import KeyPath, Mistake, Place, read_yaml, split_lines

WIDEST_EXCERPT = 100
MOST_SHOWN = 50  # mistakes: more than anybody mends before the next check
LARGEST_FILE = 1_000_000  # bytes: some seconds of reading


@dataclass(frozen=True)
class Document:
    """A model file as plain data, with the place of every value and key.

    `settings` holds the texts 'path=value' that replaced values of the file, by their paths; empty
    ones where no text gave them, but Python.
    """

    name: str
    folder: Path | None = None
    text: str = ""
    data: dict[str, Any] = field(default_factory=dict)
    places: dict[KeyPath, Place] = field(default_factory=dict)
    key_places: dict[KeyPath, Place] = field(default_factory=dict)
    settings: dict[KeyPath, str] = field(default_factory=dict)

    def place_of(self, mistake: Mistake) -> Place | None:
        """Where a mistake stands: at its value or key, or else at what encloses them."""
        if mistake.place:
            return mistake.place
        first, second = self.places, self.key_places
        if mistake.on_key:
            first, second = second, first
        for length in range(len(mistake.path), -1, -1):
            path = mistake.path[:length]
            place = first.get(path) or second.get(path)
            if place:
                return place
            first, second = self.key_places, self.places  # what encloses it is known by its key
        return None

    def setting_of(self, path: KeyPath) -> str | None:
        """Return the text of the setting that put a value at this path, or above it."""
        for length in range(len(path), -1, -1):
            if path[:length] in self.settings:
                return self.settings[path[:length]]
        return None


class HintedError(Sendable, ValueError):
    """What is wrong with a value, before anybody knows its place; `hint` says what to write."""

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint


class SceneError(Sendable, Exception):
    """Every mistake found in one document, in the order of its lines."""

    def __init__(self, document: Document, mistakes: Iterable[Mistake]) -> None:
        self.document = document
        self.mistakes = tuple(sorted(dict.fromkeys(mistakes), key=self._position))
        super().__init__(document, self.mistakes)

    def _position(self, mistake: Mistake) -> tuple[int, int]:
        place = self.document.place_of(mistake)
        if place is None or self.document.setting_of(mistake.path) is not None:
            return (0, 0)
        return (place.line, place.column)

    def __str__(self) -> str:
        lines = split_lines(self.document.text)
        shown = self.mistakes[:MOST_SHOWN]
        blocks = [_show(self.document, lines, mistake) for mistake in shown]
        count = len(self.mistakes)
        if count > len(shown):
            blocks.append(f"{count} mistakes; the first {len(shown)} are shown")
        elif count > 1:
            blocks.append(f"{count} mistakes")
        return "\n".join(blocks)


def load_document(path: str | Path) -> Document:
    """Read a model file.

    Raises:
        SceneError: it can't be read, or is not one YAML mapping in UTF-8.

    """
    path = Path(path)
    empty = Document(str(path), path.parent)
    try:
        if path.exists() and not (path.is_file() or path.is_dir()):
            message = "not a file but a pipe or a device, which may never end"
            raise SceneError(empty, [Mistake((), message, "save the model in a file")])
        with path.open("rb") as stream:
            content = stream.read(LARGEST_FILE + 1)
        if len(content) > LARGEST_FILE:
            message = f"the file is larger than {LARGEST_FILE // 10**6} MB"
            raise SceneError(empty, [Mistake((), message, "points of splines may be in CSV files")])
        text = content.decode("utf-8")
    except (OSError, ValueError) as error:
        raise SceneError(empty, [_unreadable(path, error)]) from None
    return parse_document(text, str(path), path.parent)


def _unreadable(path: Path, error: OSError | ValueError) -> Mistake:
    if isinstance(error, UnicodeDecodeError):
        before = error.object[: error.start].split(b"\n")
        place = Place(len(before), 1, 1)
        message = f"not UTF-8 text: the byte {error.object[error.start]:#04x}"
        return Mistake((), message, "save the file as UTF-8", place=place)
    hint = _shipped_hint(path) if isinstance(error, FileNotFoundError) else ""
    return Mistake((), f"can't read the file: {getattr(error, 'strerror', None) or error}", hint)


def _shipped_hint(path: Path) -> str:
    """Say by which name a model comes with the program, if one has the name of this file."""
    with suppress(FileNotFoundError):  # a damaged installation has none
        if model_file(path.stem):
            return f"a model that comes with the program is called '{path.stem}', without '.yaml'"
    return ""


def parse_document(text: str, name: str, folder: Path | None = None) -> Document:
    """Read a model from text; `name` is shown in messages, `folder` is where its files are.

    Raises:
        SceneError: the text is not one YAML mapping with text keys.

    """
    bare = Document(name, folder, text)
    start = Place(1, 1, 2)
    if text.startswith("\ufeff"):
        hint = "save the file as UTF-8 without BOM"
        raise SceneError(bare, [Mistake((), "starts with a byte order mark", hint, place=start)])
    read = read_yaml(text)
    if read.problems:
        raise SceneError(bare, read.problems)
    if not isinstance(read.data, dict):
        message = "nothing in it" if read.data is None else "expected a mapping of sections"
        place = read.places.get((), start)
        raise SceneError(bare, [Mistake((), message, "such as 'title: ...'", place=place)])
    return replace(bare, data=read.data, places=read.places, key_places=read.key_places)


def did_you_mean(name: str, names: Iterable[str], before: str = "") -> str:
    """Return "; did you mean 'x'?" if one of the names resembles `name`, else nothing.

    `before` is written before the name, but is no part of what is compared.
    """
    near = difflib.get_close_matches(name, list(names), n=1)
    return f"; did you mean '{before}{near[0]}'?" if near else ""


def unknown(what: str, name: str, known: Iterable[str]) -> str:
    """Say that there is nothing of a name, what was meant perhaps, and what there is."""
    names = list(known)
    near, there = did_you_mean(name, names), ", ".join(names) or "none"
    return f"there is no {what} '{name}'{near}{' There' if near else '; there'} are: {there}"


def dotted(path: KeyPath) -> str:
    """Write a path as messages and settings do: 'joints.crank.points.1'."""
    return ".".join(str(step) for step in path)


# How a mistake is shown


def _show(document: Document, lines: Sequence[str], mistake: Mistake) -> str:
    setting = document.setting_of(mistake.path)
    place = None if setting is not None else document.place_of(mistake)
    where = document.name
    if setting is not None:
        where = f"--set {setting}" if setting else ""
    elif place:
        where = f"{document.name}:{place.line}:{place.column}"
    shown = [": ".join(part for part in (where, dotted(mistake.path), mistake.message) if part)]
    if place:
        shown += _excerpt(lines, place)
    if mistake.hint:
        shown.append(f"hint: {mistake.hint}")
    return "\n".join(shown)


def _excerpt(lines: Sequence[str], place: Place) -> list[str]:
    """Return the line of a place and the carets below it."""
    from rich.cells import cell_len  # noqa: PLC0415 - not before there is a mistake

    if not 0 < place.line <= len(lines):
        return []
    line = "".join(letter if letter.isprintable() else " " for letter in lines[place.line - 1])
    start, end = place.column - 1, place.end_column - 1
    if len(line) > WIDEST_EXCERPT:
        cut = max(0, min(start - WIDEST_EXCERPT // 2, len(line) - WIDEST_EXCERPT))
        before, after = "..." if cut else "", "..." if cut + WIDEST_EXCERPT < len(line) else ""
        line = before + line[cut : cut + WIDEST_EXCERPT] + after
        shift = len(before) - cut
        start, end = start + shift, min(end + shift, len(before) + WIDEST_EXCERPT)
    carets = "^" * max(cell_len(line[start:end]), 1)
    return [f"{place.line:6d} | {line}", " " * (9 + cell_len(line[:start])) + carets]
