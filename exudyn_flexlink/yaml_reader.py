"""YAML text to plain data, with the line and column of every value and key.

The scalars are those of YAML 1.2's core schema: `1e-6` is a number, `on` and `12:30` are texts.
Nothing in a text is executed; other tags than the core's, duplicate keys, cyclic and exploding
aliases are refused.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any, NoReturn

import yaml

KeyPath = tuple[str | int, ...]

DEEPEST = 100
MOST_VALUES = 200_000
_CORE = "tag:yaml.org,2002:"
_CONTROL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\ud800-\udfff]")
_LINE_END = re.compile("\r\n|[\r\n\x85\u2028\u2029]")  # what PyYAML counts as one
MINUS = "\N{MINUS SIGN}"  # of typeset texts, from which numbers are copied
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


# What to look for, by the beginning of PyYAML's messages: these speak of its parser's states.
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
    """What is wrong at a path of the data; `on_key` points at the key, not at its value.

    `place` is given only where the path does not lead to the spot, as with a duplicate key.
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
    """PyYAML's tree of nodes; everything it may raise becomes a `_Stop`."""
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
        # PyYAML passes on what Python says of escapes such as "\UFFFFFFFF".
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
        """Keys and values of a mapping, with those that '<<' takes from others and it has not."""
        own = [(key, value) for key, value in node.value if not _is_merge(key)]
        known = {_name(key) for key, _ in own}
        for key, value in node.value:
            if not _is_merge(key):
                continue
            for one in value.value if isinstance(value, yaml.SequenceNode) else [value]:
                if not isinstance(one, yaml.MappingNode) or id(one) in self.open_nodes:
                    self._problem(
                        value, path, "'<<' takes the keys of another section: '<<: *name'"
                    )
                    break
                self.open_nodes.add(id(one))
                more = [(k, v) for k, v in self._merged(one, path) if _name(k) not in known]
                self.open_nodes.discard(id(one))
                own += more
                known |= {_name(key) for key, _ in more}
        return own

    def _key(self, node: Any, path: KeyPath) -> str | None:
        if not isinstance(node, yaml.ScalarNode):
            self._problem(node, path, "a key must be a text")
        elif node.tag != _CORE + "str":
            hint = f"in quotes it is one: '{node.value}'"
            if node.tag in (_CORE + "int", _CORE + "float"):  # of 7,85 YAML takes the 85 for a key
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
    """What tells a key apart: its text, or what is no text itself."""
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
