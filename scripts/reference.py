"""Write the parts of the documentation that the program itself knows, and models that pages show.

Usage:
  .venv/bin/python scripts/reference.py            into the pages of docs/, between their markers
  .venv/bin/python scripts/reference.py --check    write nothing; exit code 1 if a page is stale

`model_file` has every key of a model file with meaning, unit, default and example, by the JSON
schema and the models of `docs/reference/examples`; `commands` the help of every command; `python`
what the package exports; `items` what `make_docs.py` makes; `tutorial_N` what step N of the
tutorial changes; `study` the file of `docs/study.yaml`.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import redirect_stdout
from dataclasses import dataclass
from difflib import unified_diff
from functools import cache
from io import StringIO
from itertools import pairwise
from pathlib import Path
from typing import Any
from unittest.mock import patch

from make_docs import ITEMS
from written import DOCS, parts_of, with_parts
from written.python_text import lines as python

from exudyn_flexlink.cli import main as program
from exudyn_flexlink.quantities import SYMBOLS, Dimension, usual_units
from exudyn_flexlink.scene import json_schema
from exudyn_flexlink.source import Document, KeyPath, load_document

Schema = dict[str, Any]
INTRODUCTION = """A model file is YAML. A section with named parts may have any number of them.

The ground has an x and a y axis; angles count counter-clockwise from x. Each body has axes of its
own. Those of a rod and of a flexible link have their origin at `start`, and x leads to `end`. Those
of a rigid body are the axes in which its `points` and its `centre_of_mass` are given. The angle of
a body is that of its x axis.

A point is written `body.point`, such as `crank.end`. A rod always has the points `start`, `end` and
`centre`, a flexible link `start` and `end`, a rigid body `centre`, which is its centre of mass. The
key `points` adds others.

A model does not say where each body stands: the joints place all bodies at time 0. `initial` gives
what the joints leave open, in most models the angle of one crank. Where the joints close in two
ways it also gives approximate angles of other bodies. `check` prints the start. An angle without a
unit is in rad: a right angle is `90 deg`, while `90` is 90 rad.

A short model has bodies, joints and something that moves it:

{model}"""
COMMANDS = (
    *("simulate", "compare", "fit", "accuracy", "stability", "sweep", "verify", "check"),
    *("plot", "animate", "report", "new", "schema", "completion"),
)
VARYING = ", or an expression or a table"  # what a drive's value may be beside a number
UNIT = re.compile(rf"(?:^|: )[a-z ]+; (?P<unit>[^;]+?)(?:,| or) e\.g\. '[^']+'(?:{VARYING})?$")
WIDTH = "100"  # columns of a help text
EXAMPLES = sorted((DOCS / "reference" / "examples").glob("*.yaml"))
LONGEST_VALUE = 50  # characters of an example in a table


def texts() -> dict[str, str]:
    """All parts, by name."""
    steps = sorted((DOCS / "tutorial").glob("*.yaml"))
    found = {"tutorial_1": file(steps[0]), "study": file(DOCS / "study.yaml")}
    for before, after in pairwise(steps):
        found[f"tutorial_{after.stem[0]}"] = f"```diff\n{''.join(changes(before, after))}```"
    pages: dict[str, Callable[[], Iterator[str]]] = {
        "model_file": model_file,
        "commands": commands,
        "python": python,
        "items": items,
    }
    return found | {name: "\n".join(lines()) for name, lines in pages.items()}


def stale() -> dict[Path, str]:
    """Pages of which a part is not what it has to be, and what they have to be."""
    known = texts()
    missing = set(known)
    found = {}
    for page in sorted(DOCS.rglob("*.md")):
        missing -= set(parts_of(page))
        text = with_parts(page, known)
        # By words alone: each version of Python breaks the lines of a usage in its own way.
        if text.split() != page.read_text(encoding="utf-8").split():
            found[page] = text
    if missing:
        raise LookupError(f"no page has markers of: {', '.join(sorted(missing))}")
    return found


def file(path: Path) -> str:
    """A model file, shown whole."""
    return f"```yaml\n{path.read_text(encoding='utf-8')}```\n"


def changes(before: Path, after: Path) -> Iterator[str]:
    """Lines that a model gained or lost, with two around them; its title and source left out."""
    first, second = (
        [
            line
            for line in path.read_text(encoding="utf-8").splitlines(keepends=True)
            if not line.startswith(("#", "title:", "source:"))
        ]
        for path in (before, after)
    )
    for line in list(unified_diff(first, second, n=2))[3:]:
        yield "@@\n" if line.startswith("@@") else line


def model_file() -> Iterator[str]:
    """Lines that tell every key of a model file, section by section."""
    whole = json_schema()
    parts = whole["$defs"]
    yield INTRODUCTION.format(model=file(DOCS / "reference" / "examples" / "four_bar.yaml"))
    yield from table(whole, parts)
    told: set[str] = set()
    for section, value in whole["properties"].items():
        names = [name for name in reached(value, parts) if name not in told]
        told.update(names)
        if names:
            yield f"\n## `{section}`\n\n{sentence(value['description'])}"
        for name in names:
            if title(name, parts).lower() != section:
                yield f"\n### {title(name, parts)}"
            yield f"\n{parts[name]['description']}\n"
            yield from table(parts[name], parts, name)
            yield from snippet(name)
    yield "\n## Units\n\nA number without a unit is in SI units. A text may carry one of these, or"
    yield f"any product of powers, such as `N/(m s)`, of {', '.join(SYMBOLS)}."
    prefixed = [
        f"{name} ({', '.join(own.prefixes)})" for name, own in SYMBOLS.items() if own.prefixes
    ]
    yield f"Prefixes are those that are usual: of {', '.join(prefixed)}."
    yield "Radians count: a speed in Hz is refused where rad/s is meant; `95 U/min`, `95 min-1` and"
    yield "`95 1/min` are 95 rpm there. `Grad` is a degree; `grad` may be a gon, and is refused.\n"
    yield "| quantity | SI unit | such as |\n|---|---|---|"
    for dimension in Dimension:
        if dimension.si:
            yield f"| {dimension.words} | {dimension.si} | {', '.join(usual_units(dimension))} |"


def reached(value: Schema, parts: Schema) -> list[str]:
    """Names of the definitions that a key refers to, and those that they refer to, in order."""
    found: list[str] = []
    left = references(value)
    while left:
        name = left.pop(0)
        if name not in found:
            found.append(name)
            left = [*references(parts[name]["properties"]), *left]
    return found


def references(value: Any) -> list[str]:
    """Names of the definitions that a piece of the schema refers to, in order."""
    if isinstance(value, list):
        return [name for item in value for name in references(item)]
    if not isinstance(value, dict):
        return []
    own = [value["$ref"].rpartition("/")[2]] if "$ref" in value else []
    return own + [name for key, item in value.items() if key != "$ref" for name in references(item)]


def anchor(name: str, parts: Schema) -> str:
    """Target of links to a definition: what GitHub and MyST make of its heading."""
    return re.sub(r"[^\w -]", "", title(name, parts).lower()).replace(" ", "-")


def types(name: str, parts: Schema) -> list[str]:
    """Words that `type` may say of a definition; none if it has none."""
    kind = parts[name]["properties"].get("type", {})
    return [kind["const"]] if "const" in kind else list(kind.get("enum", ()))


def title(name: str, parts: Schema) -> str:
    """What a definition is called: by its `type`, or by its class."""
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name.removesuffix("Spec")).lower()
    kinds = ", ".join(f"`type: {kind}`" for kind in types(name, parts))
    return f"{kinds}, {words}" if kinds else words.capitalize()


def word(name: str, parts: Schema) -> str:
    """What a link to a definition says: its `type`, or its title."""
    kinds = ", ".join(f"`{kind}`" for kind in types(name, parts))
    return kinds or title(name, parts)


def table(part: Schema, parts: Schema, name: str = "") -> Iterator[str]:
    """Lines of the table of a definition's keys; without a name, of the whole file's."""
    required = part.get("required", [])
    last = ("| example ", "|---") if name else ("", "")
    yield f"| key | meaning | value | default {last[0]}|\n|---|---|---|---{last[1]}|"
    for key, value in sorted(part["properties"].items(), key=lambda one: one[0] != "type"):
        # A cell ends where its line does, so that a class says only its first sentence there.
        first = value.get("description", "").partition("\n\n")[0]
        meaning = UNIT.sub("", first) or "-"
        meaning = meaning.rstrip(".")  # of a type: its class's sentence
        default = "required" if key in required else default_of(value)
        row = f"| `{key}` | {escaped(meaning)} | {kind_of(value, parts)} | {default} |"
        yield row + (f" {example_of(name, key)} |" if name else "")


@dataclass(frozen=True)
class Shown:
    """A part in a model of the examples: where it stands, and what it says."""

    document: Document
    path: KeyPath
    data: Schema


@cache
def shown() -> dict[str, list[Shown]]:
    """Parts in the models of the examples, by the name of their definition."""
    whole = json_schema()
    found: dict[str, list[Shown]] = {name: [] for name in whole["$defs"]}
    for path in EXAMPLES:
        document = load_document(path)
        for section, value in whole["properties"].items():
            if section in document.data:
                data = document.data[section]
                for name, at, part in meant(value, whole["$defs"], data, (section,)):
                    found[name].append(Shown(document, at, part))
    return found


def meant(
    value: Schema, parts: Schema, data: Any, path: KeyPath
) -> Iterator[tuple[str, KeyPath, Schema]]:
    """Definition, place and data of every part in `data`, which a piece of the schema describes."""
    if isinstance(data, list):
        entries = value.get("prefixItems") or [value.get("items", {})] * len(data)
        for i, (entry, item) in enumerate(zip(entries, data, strict=True)):
            yield from meant(entry, parts, item, (*path, i))
    elif isinstance(data, dict) and "additionalProperties" in value:
        for key, item in data.items():
            yield from meant(value["additionalProperties"], parts, item, (*path, key))
    elif isinstance(data, dict) and (names := references(value)):
        kinds = {name: parts[name]["properties"].get("type", {}) for name in names}
        word = data.get("type", next((own["default"] for own in kinds.values() if own), None))
        name = next((name for name in names if word in types(name, parts)), names[0])
        yield name, path, data
        for key, item in parts[name]["properties"].items():
            if key in data:
                yield from meant(item, parts, data[key], (*path, key))


def example_of(name: str, key: str) -> str:
    """How the examples write a key of a definition; longer ones are shown below the table."""
    texts = [flow(part.data[key]) for part in shown()[name] if key in part.data]
    if not texts:
        return "none"
    text = min(texts, key=len) if len(texts[0]) > LONGEST_VALUE else texts[0]
    return f"`{escaped(text)}`" if len(text) <= LONGEST_VALUE else "below"


def flow(value: Any) -> str:
    """A value as YAML in one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {flow(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(flow, value)) + "]"
    return str(value).lower() if isinstance(value, bool) else f"{value}"


def snippet(name: str) -> Iterator[str]:
    """Lines of the example that shows most keys of a definition, under its section."""
    if not shown()[name]:
        return
    best = max(shown()[name], key=lambda part: len(part.data))
    places = best.document.key_places
    top = best.path[:2] if best.path[:2] in places and len(best.path) > 1 else best.path[:1]
    inside = [*best.document.places.items(), *places.items()]
    last = max(place.line for at, place in inside if at[: len(top)] == top)
    lines = best.document.text.splitlines()[places[top].line - 1 : last]
    head = [f"{top[0]}:"] if len(top) > 1 else []
    model = Path(best.document.name).name
    yield f"\nIn `docs/reference/examples/{model}`:\n\n```yaml"
    yield from [*head, *lines]
    yield "```"


def default_of(value: Schema) -> str:
    """What holds where a key is left out."""
    if "default" not in value or value["default"] == "":
        return "none"
    text = str(value["default"]).lower() if isinstance(value["default"], bool) else value["default"]
    return f"`{text}`"


def kind_of(value: Schema, parts: Schema) -> str:
    """Unit, words to choose from, or parts that a key takes."""
    told = [
        f"[{word(name, parts)}](#{anchor(name, parts)})"
        for name in dict.fromkeys(references(value))
    ]
    named = "by name: " if "additionalProperties" in value else ""
    description = value.get("description", "")
    if unit := UNIT.search(description) if VARYING in description else None:
        told = [unit["unit"], "an expression", *told]
    if told:
        return escaped(named + ", ".join(told))
    inner = value.get("additionalProperties", value)
    forms = inner.get("anyOf", [inner])
    if any(form.get("type") == "array" for form in forms) and len(forms) > 1:  # gravity
        units = [UNIT.search(form.get("description", "")) for form in forms]
        return " or ".join(unit["unit"] if unit else "pair" for unit in units)
    words = [f"`{word}`" for form in forms for word in form.get("enum", [])]
    if "const" in value:
        words = [f"`{value['const']}`"]
    if unit := UNIT.search(inner.get("description", "")):
        words.append(unit["unit"])
    return escaped(named + (", ".join(words) or plain(inner)))


def plain(value: Schema) -> str:
    """A kind of value that has neither unit nor choice."""
    kind = value.get("type")
    if isinstance(kind, list):
        return "as of that key"
    if kind == "array":
        return "pair" if value.get("maxItems") == 2 else "list"
    words = {"string": "text", "boolean": "true, false", "number": "number", "object": "by name"}
    text = words.get(str(kind), "whole number")
    least = value.get("minimum", value.get("exclusiveMinimum"))
    if least is not None:
        text += f" {'from' if 'minimum' in value else 'above'} {least:g}"
    return text + (f" to {value['maximum']:g}" if "maximum" in value else "")


def sentence(text: str) -> str:
    """A description as a sentence."""
    return text[0].upper() + text[1:] + "."


def escaped(text: str) -> str:
    """Text for a cell of a table."""
    return text.replace("|", "\\|")


def commands() -> Iterator[str]:
    """Lines with the help of every command."""
    for command in COMMANDS:
        yield f"## `{command}`\n\n```text\n{help_of(command)}```\n"


def help_of(command: str) -> str:
    """What `--help` of a command prints."""
    text = StringIO()
    with redirect_stdout(text), patch.dict("os.environ", COLUMNS=WIDTH, NO_COLOR="1"):
        try:
            program([command, "--help"])
        except SystemExit as ended:
            if ended.code:
                raise
    return text.getvalue()


def items() -> Iterator[str]:
    """Lines of the table of what `make_docs.py` makes, and by what."""
    yield "| name | files in `docs/` | made by | takes about |\n|---|---|---|---|"
    for item in ITEMS:
        files = ", ".join(f"`{file}`" for file in item.files)
        made = "<br>".join(f"`{command}`" for command in item.shown)
        yield f"| {item.name} | {files} | {escaped(made)} | {item.takes} |"


def main() -> int:
    """Write the pages, or tell which are stale."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--check", action="store_true", help="write nothing")
    check = parser.parse_args().check
    found = stale()
    for page, text in found.items():
        if not check:
            page.write_text(text, encoding="utf-8")
        print(f"{page.name}: {'stale; run: python scripts/reference.py' if check else 'written'}")
    return 1 if check and found else 0


if __name__ == "__main__":
    sys.exit(main())
