"""A model file as a `Document`: YAML with line and column of every value, settings, and mistakes.

Scalars are those of YAML 1.2's core schema: `1e-6` is a number, `on` and `12:30` are texts. Nothing
in a text is executed; other tags than the core's, duplicate keys, cyclic and exploding aliases are
refused. Settings such as 'run.turns=2' replace values of a model file, or add keys. Mistakes are
shown with the line they are in.
"""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Collection, Iterable, Sequence
from contextlib import suppress
from copy import deepcopy
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NoReturn

import yaml

from exudyn_flexlink.raising import Sendable
from exudyn_flexlink.shipped import model_file

KeyPath = tuple[str | int, ...]

DEEPEST = 100
MOST_VALUES = 200_000
_CORE = "tag:yaml.org,2002:"
_CONTROL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\ud800-\udfff]")
_LINE_END = re.compile("\r\n|[\r\n\x85\u2028\u2029]")  # what PyYAML counts as one
MINUS = "\N{MINUS SIGN}"  # in numbers that were copied from typeset texts
_SCALARS = {
    "null": (r"~|null|Null|NULL|", ["~", "n", "N", ""]),
    "bool": (r"true|True|TRUE|false|False|FALSE", list("tTfF")),
    "int": (rf"[-+{MINUS}]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+", list(f"-+{MINUS}0123456789")),
    "float": (
        rf"[-+{MINUS}]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+{MINUS}]?[0-9]+)?"
        r"|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)",
        list(f"-+{MINUS}0123456789."),
    ),
}


# Hints by the beginning of PyYAML's messages, which name states of its parser.
_HINTS = (
    (
        "mapping values are not allowed",
        "a key needs ': ' after it, on this line and on the one before; keys of one section stand "
        "below one another; a text with ': ' in it needs quotes",
    ),
    ("could not find expected ':'", "a key needs ': ' after it, also on the line before"),
    ("expected <block end>, but found '<", "keys of one section stand below one another"),
    ("expected <block end>, but found '?'", "a section is a list or has keys, not both"),
    ("expected <block end>", "a bracket too many, or a key without ': ' before its bracket"),
    ("expected ',' or", "a comma or a closing bracket is missing before this"),
    ("found unexpected end of stream", "a quote is not closed"),
    (r"found character '\t'", "indent with spaces, not with tabs"),
    ("found character", "a text that begins with this needs quotes"),
    ("but found another document", "a model is one document, without '---' in it"),
)


@dataclass(frozen=True)
class Place:
    """Where a value or a key stands in the text: line and columns from 1, the end excluded."""

    line: int
    column: int
    end_column: int


@dataclass(frozen=True)
class Mistake:
    """A mistake at a path of the data; with `on_key` it is at the key, not at its value.

    `place` is given only if the path does not lead to the mistake, as with a duplicate key.
    """

    path: KeyPath
    message: str
    hint: str = ""
    on_key: bool = False
    place: Place | None = None


@dataclass
class YamlText:
    """A text's plain data, or the problems that kept it from being read."""

    data: Any = None
    places: dict[KeyPath, Place] = field(default_factory=dict)
    key_places: dict[KeyPath, Place] = field(default_factory=dict)
    problems: list[Mistake] = field(default_factory=list)


def read_yaml(text: str) -> YamlText:
    """Read one YAML document; an empty text is `None`. Never raises: see `problems`."""
    result = YamlText()
    try:
        node = _compose(text)
        if node is not None:
            result.data = _Builder(text, result).value(node, ())
    except _Stop as stop:
        result.problems.append(stop.problem)
    return result


def split_lines(text: str) -> list[str]:
    """Split a text into lines as `Place` counts them."""
    return _LINE_END.split(text)


class _Stop(Exception):  # noqa: N818  (never leaves this module)
    """A problem after which reading can't go on."""

    def __init__(self, problem: Mistake) -> None:
        super().__init__(problem)
        self.problem = problem


class _Loader(yaml.SafeLoader):
    """PyYAML's composer with YAML 1.2 scalars and a limit on nesting."""

    yaml_implicit_resolvers: dict[str, list[tuple[str, re.Pattern[str]]]] = {}  # noqa: RUF012
    depth = 0

    def compose_node(self, parent: Any, index: Any) -> Any:
        self.depth += 1
        if self.depth > DEEPEST:
            mark = self.peek_event().start_mark  # type: ignore[no-untyped-call]
            raise yaml.MarkedYAMLError(None, None, f"nested deeper than {DEEPEST} levels", mark)
        node = super().compose_node(parent, index)
        self.depth -= 1
        return node


for _kind, (_pattern, _first_letters) in _SCALARS.items():
    _Loader.add_implicit_resolver(_CORE + _kind, re.compile(rf"(?:{_pattern})\Z"), _first_letters)


def _compose(text: str) -> Any:
    """PyYAML's tree of nodes; all errors of PyYAML become a `_Stop`."""
    try:
        return _Loader(text).get_single_node()
    except yaml.MarkedYAMLError as error:
        _stop(error.problem or error.context or "not YAML", error.problem_mark)
    except yaml.reader.ReaderError as error:
        before = split_lines(text[: error.position])
        column = len(before[-1]) + 1
        problem = f"the character {error.character!r} is not allowed"
        place = Place(len(before), column, column + 1)
        raise _Stop(Mistake((), problem, place=place)) from None
    except (yaml.YAMLError, ValueError, OverflowError, RecursionError) as error:
        # PyYAML passes on Python's errors for escapes such as "\UFFFFFFFF".
        _stop(f"not YAML: {error}", None)


def _stop(message: str, mark: Any) -> NoReturn:
    place = Place(mark.line + 1, mark.column + 1, mark.column + 2) if mark else Place(1, 1, 2)
    hint = next((hint for said, hint in _HINTS if message.startswith(said)), "")
    raise _Stop(Mistake((), message, hint, place=place)) from None


class _Builder:
    """Turns PyYAML's nodes into plain data, noting places and problems in `result`."""

    def __init__(self, text: str, result: YamlText) -> None:
        self.lines = split_lines(text)
        self.result = result
        self.open_nodes: set[int] = set()
        self.count = 0

    def value(self, node: Any, path: KeyPath) -> Any:
        self._check_bounds(node, path)
        self.result.places[path] = self._place(node)
        self.open_nodes.add(id(node))
        value: Any = None
        if isinstance(node, yaml.ScalarNode):
            value = self._scalar(node, path)
        elif node.tag == _CORE + "map":
            value = self._mapping(node, path)
        elif node.tag == _CORE + "seq":
            value = [self.value(item, (*path, i)) for i, item in enumerate(node.value)]
        else:
            self._refuse_tag(node, path)
        self.open_nodes.discard(id(node))
        return value

    def _check_bounds(self, node: Any, path: KeyPath) -> None:
        self.count += 1
        if id(node) in self.open_nodes:
            _stop("an alias (*) of a value that contains it", node.start_mark)
        if len(path) > DEEPEST:
            _stop(f"nested deeper than {DEEPEST} levels", node.start_mark)
        if self.count > MOST_VALUES:
            _stop(f"aliases (*) make more than {MOST_VALUES} values of this", node.start_mark)

    def _mapping(self, node: Any, path: KeyPath) -> dict[str, Any]:
        result: dict[str, Any] = {}
        for key_node, value_node in self._merged(node, path):
            key = self._key(key_node, path)
            if key is None:
                continue
            inner = (*path, key)
            if key in result:
                line = self.result.key_places[inner].line
                self._problem(key_node, inner, f"'{key}' is already given in line {line}")
                continue
            self.result.key_places[inner] = self._place(key_node)
            result[key] = None
            result[key] = self.value(value_node, inner)
        return result

    def _merged(self, node: Any, path: KeyPath) -> list[tuple[Any, Any]]:
        """Keys and values of a mapping, and those that '<<' adds from others."""
        pairs = [(key, value) for key, value in node.value if not _is_merge(key)]
        known = {_name(key) for key, _ in pairs}
        for key, value in node.value:
            if not _is_merge(key):
                continue
            for item in value.value if isinstance(value, yaml.SequenceNode) else [value]:
                if not isinstance(item, yaml.MappingNode) or id(item) in self.open_nodes:
                    self._problem(
                        value, path, "'<<' takes the keys of another section: '<<: *name'"
                    )
                    break
                self.open_nodes.add(id(item))
                more = [(k, v) for k, v in self._merged(item, path) if _name(k) not in known]
                self.open_nodes.discard(id(item))
                pairs += more
                known |= {_name(key) for key, _ in more}
        return pairs

    def _key(self, node: Any, path: KeyPath) -> str | None:
        if not isinstance(node, yaml.ScalarNode):
            self._problem(node, path, "a key must be a text")
        elif node.tag != _CORE + "str":
            hint = f"in quotes it is one: '{node.value}'"
            if node.tag in (_CORE + "int", _CORE + "float"):  # for 7,85 YAML reads 85 as a key
                hint += "; decimals begin with a point, as in 7.85"
            self._problem(node, path, f"a key must be a text, got {node.value or 'nothing'}", hint)
        elif _CONTROL.search(node.value):
            self._problem(node, path, "a key with a control character")
        else:
            return str(node.value)
        return None

    def _scalar(self, node: Any, path: KeyPath) -> Any:
        kind, text = node.tag.removeprefix(_CORE), node.value
        if kind == "str":
            if _CONTROL.search(text):
                self._problem(node, path, "a text with a control character")
            return text
        if kind not in _SCALARS:
            self._refuse_tag(node, path)
        elif not re.fullmatch(_SCALARS[kind][0], text):
            self._problem(node, path, f"'{text}' is not a value of !!{kind}")
        else:
            try:
                return _number_or_word(kind, text)
            except ValueError:  # Python's limit of 4300 digits
                self._problem(node, path, "a number with too many digits")
        return None

    def _refuse_tag(self, node: Any, path: KeyPath) -> None:
        tag = node.tag.replace(_CORE, "!!")
        self._problem(node, path, f"the tag {tag} is not allowed", "a model is plain data")

    def _problem(self, node: Any, path: KeyPath, message: str, hint: str = "") -> None:
        self.result.problems.append(Mistake(path, message, hint, place=self._place(node)))

    def _place(self, node: Any) -> Place:
        start, end = node.start_mark, node.end_mark
        stop = end.column
        if end.line != start.line:  # underline what its first line holds
            stop = len(self.lines[start.line].rstrip()) if start.line < len(self.lines) else 0
        return Place(start.line + 1, start.column + 1, max(stop, start.column + 1) + 1)


def _is_merge(key: Any) -> bool:
    """Tell whether a key is YAML's '<<', unquoted."""
    return isinstance(key, yaml.ScalarNode) and key.value == "<<" and key.style is None


def _name(key: Any) -> Any:
    """Return what identifies a key: its text, or the key itself if it is not a text."""
    return key.value if isinstance(key, yaml.ScalarNode) else key


def _number_or_word(kind: str, text: str) -> bool | int | float | None:
    if kind == "null":
        return None
    if kind == "bool":
        return text.lower() == "true"
    text = text.replace(MINUS, "-")
    if kind == "int":
        base = {"0o": 8, "0x": 16}.get(text[:2], 10)
        return int(text[2:] if base != 10 else text, base)
    return float(text.lower().replace(".inf", "inf").replace(".nan", "nan"))


WIDEST_EXCERPT = 100
MOST_SHOWN = 50  # mistakes: more than a user corrects before the next check
LARGEST_FILE = 1_000_000  # bytes: some seconds of reading


@dataclass(frozen=True)
class Document:
    """A model file as plain data, with the place of every value and key.

    `settings` holds the texts 'path=value' that replaced values of the file, by their paths. A text
    is empty if the setting came from Python.
    """

    name: str
    folder: Path | None = None
    text: str = ""
    data: dict[str, Any] = field(default_factory=dict)
    places: dict[KeyPath, Place] = field(default_factory=dict)
    key_places: dict[KeyPath, Place] = field(default_factory=dict)
    settings: dict[KeyPath, str] = field(default_factory=dict)

    def place_of(self, mistake: Mistake) -> Place | None:
        """Place of a mistake: its value or key, or else the mapping or list around it."""
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
            first, second = self.key_places, self.places  # then the enclosing key
        return None

    def setting_of(self, path: KeyPath) -> str | None:
        """Return the text of the setting that put a value at this path, or above it."""
        for length in range(len(path), -1, -1):
            if path[:length] in self.settings:
                return self.settings[path[:length]]
        return None


class HintedError(Sendable, ValueError):
    """A mistake in a value whose place is not yet known; `hint` says what to write."""

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
        SceneError: the file can't be read, or is not one YAML mapping in UTF-8.

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
    """Return a hint at the model of the program that has the name of this file, if any."""
    with suppress(FileNotFoundError):  # a damaged installation has no models
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


MOST_LISTED = 12  # names that one line lists


def did_you_mean(name: str, names: Iterable[str], before: str = "") -> str:
    """Return "; did you mean 'x'?" if one of the names resembles `name`, else nothing.

    The text shows `before` in front of the name; it is not compared.
    """
    near = difflib.get_close_matches(name, list(names), n=1)
    return f"; did you mean '{before}{near[0]}'?" if near else ""


def listed(words: Sequence[str]) -> str:
    """Return words in one line; of many words only the first ones."""
    more = len(words) - MOST_LISTED
    return ", ".join(words[:MOST_LISTED]) + (f" and {more} more" if more > 0 else "")


def unknown(what: str, name: str, known: Iterable[str]) -> str:
    """Return a message that a name is unknown, with a similar name and the known names."""
    names = list(known)
    near, there = did_you_mean(name, names), ", ".join(names) or "none"
    return f"there is no {what} '{name}'{near}{' There' if near else '; there'} are: {there}"


def dotted(path: KeyPath) -> str:
    """Write a path as in messages and settings: 'joints.crank.points.1'."""
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


Setting = str | tuple[str, Any]
ExclusiveKeys = Sequence[tuple[KeyPath, tuple[str, ...]]]
"""Paths ("*" stands for any step) with the keys beside them that they exclude."""


def with_settings(
    document: Document,
    settings: Iterable[Setting],
    exclusive: ExclusiveKeys = (),
    named: Collection[str] = (),
) -> Document:
    """Return a copy of a document in which texts such as 'run.turns=2' replace values, or add keys.

    A setting may also be a path with its value, as plain data. 'null' removes a key of the file;
    for an unknown key, the scene's check says whether it is allowed. A setting also removes the
    keys that `exclusive` lists for its path, unless another setting gives them: otherwise the file
    would contradict itself. A missing mapping on the path is made; the scene's check says whether
    it is allowed. In a section of `named` parts the part must exist.

    Raises:
        SceneError: a setting is malformed, or its path leads nowhere.

    """
    given = [_parse_setting(document, text) for text in settings]
    document = replace(document, data=deepcopy(document.data)) if given else document
    for path, value, text in given:
        for key in _excluded(path, exclusive) if value is not None else ():
            sibling = (*path[:-1], key)
            if not any(other[: len(sibling)] == sibling for other, _, _ in given):
                document = _without(document, sibling)
        if len(path) > 2 and path[0] in named:
            _check_part(document, path, text)
        document = _with_value(document, path, value, text)
    return document


def _setting_error(document: Document, path: KeyPath, text: str, mistake: Mistake) -> SceneError:
    return SceneError(replace(document, settings={**document.settings, path: text}), [mistake])


def _parse_setting(document: Document, given: Setting) -> tuple[KeyPath, Any, str]:
    """Split 'run.turns=2' into its path, its value and the text itself."""
    text = given if isinstance(given, str) else f"{given[0]}={given[1]}"
    name, equals, value = text.partition("=")
    if not equals or not all(step.strip() for step in name.split(".")):
        mistake = Mistake((), "expected path=value", "for example run.turns=2")
        raise _setting_error(document, (), text, mistake)
    path: KeyPath = tuple(step.strip() for step in name.split("."))
    if not isinstance(given, str):  # YAML is used only to find values that no model file can hold
        value = json.dumps(given[1], ensure_ascii=False)
    read = read_yaml(value)
    if read.problems:
        mistake = Mistake(path, read.problems[0].message, read.problems[0].hint)
        raise _setting_error(document, path, text, mistake)
    return path, read.data if isinstance(given, str) else given[1], text


def _check_part(document: Document, path: KeyPath, text: str) -> None:
    """Raise an error if a section has parts, but none of the name in a path."""
    section, name, *_ = path
    parts = document.data.get(str(section))
    if isinstance(parts, dict) and parts and name not in parts:
        problem = f"no '{name}' in '{section}'{did_you_mean(str(name), parts)}"
        mistake = Mistake(path[:2], problem, "there are: " + ", ".join(parts))
        raise _setting_error(document, path[:2], text, mistake)


def _excluded(path: KeyPath, exclusive: ExclusiveKeys) -> list[str]:
    return [
        key
        for pattern, keys in exclusive
        if len(pattern) == len(path)
        and all(step in ("*", actual) for step, actual in zip(pattern, path, strict=True))
        for key in keys
    ]


def _with_value(document: Document, path: KeyPath, value: Any, text: str) -> Document:
    holder: Any = document.data
    real: KeyPath = ()
    made: dict[KeyPath, str] = {}  # sections that only this setting makes
    for step in path[:-1]:
        real = _step(document, holder, real, str(step), text)
        if isinstance(holder, dict) and real[-1] not in holder:
            holder[real[-1]], made[real] = {}, text
        holder = holder[real[-1]]
    real = _step(document, holder, real, str(path[-1]), text)
    if value is None and isinstance(holder, dict) and real[-1] in holder:
        del holder[real[-1]]
    else:
        holder[real[-1]] = deepcopy(value)
    kept = _without_places(document, real)
    return replace(kept, settings={**kept.settings, **made, real: text})


def _step(document: Document, holder: Any, above: KeyPath, step: str, text: str) -> KeyPath:
    """Return the path of `step` in `holder`; it may be missing in a mapping, but not in a list.

    Raises:
        SceneError: the step leads nowhere.

    """
    problem = ""
    real: KeyPath = (*above, step)
    if isinstance(holder, list):
        digits = step.lstrip("0") or "0"  # no more digits than the length has
        fits = step.isdecimal() and len(digits) <= len(str(len(holder)))
        if fits and int(digits) < len(holder):
            return (*above, int(digits))
        problem = f"'{dotted(above)}' has {len(holder)} entries, counted from 0"
    elif not isinstance(holder, dict):
        real, problem = above, f"'{dotted(above)}' is one value, nothing is below it"
    if problem:
        raise _setting_error(document, real, text, Mistake(real, problem))
    return real


def _without(document: Document, path: KeyPath) -> Document:
    """Remove a value and its places."""
    holder: Any = document.data
    for step in path[:-1]:
        holder = holder.get(step) if isinstance(holder, dict) else None
    if not isinstance(holder, dict):
        return document
    holder.pop(path[-1], None)
    return _without_places(document, path)


def _without_places(document: Document, path: KeyPath) -> Document:
    """Remove the places and settings of a value, and of all values below it."""

    def outside(table: dict[KeyPath, Any]) -> dict[KeyPath, Any]:
        return {key: value for key, value in table.items() if key[: len(path)] != path}

    return replace(
        document,
        places=outside(document.places),
        key_places=outside(document.key_places),
        settings=outside(document.settings),
    )
