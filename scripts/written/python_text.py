"""What the package exports as Markdown: signatures and docstrings, and of what they return."""

import inspect
import re
from collections.abc import Iterator
from functools import cached_property
from textwrap import wrap
from types import FunctionType
from typing import Any

import exudyn_flexlink as fl
from exudyn_flexlink.api.figures import Shown
from exudyn_flexlink.api.results import Tabled
from exudyn_flexlink.observables.instants import OverTime

WIDTH = 96  # columns of a signature
ADDED = (Shown, OverTime, Tabled)  # classes that give methods to others
LEFT_OUT = {"from_parts", "model_post_init", "seen_at", "lengths"}  # what only the program calls
MEMBERS = (FunctionType, classmethod, property, cached_property)


def lines() -> Iterator[str]:
    """Lines that tell the package, each name that it exports, and the classes that these return."""
    yield from markdown(fl.__doc__ or "")
    names = sorted(fl.__all__, key=str.lower)
    owned = {name: getattr(fl, name) for name in names if name != "__version__"}
    classes = {name: item for name, item in owned.items() if inspect.isclass(item)}
    functions = {name: item for name, item in owned.items() if inspect.isfunction(item)}
    yield "## Functions\n"
    for name, item in functions.items():
        yield from told(f"fl.{name}", item)
    returned = {
        item.__name__: item
        for function in [
            *functions.values(),
            *(m for c in classes.values() for m in members(c).values()),
        ]
        for item in results_of(function)
        if item not in classes.values()
    }
    for title, found in (("Classes", classes), ("Classes that these return", returned)):
        yield f"## {title}\n"
        for name, item in sorted(found.items(), key=lambda one: one[0].lower()):
            yield from told_class(name, item)


def told_class(name: str, item: type) -> Iterator[str]:
    """Lines that tell a class, what it holds and what it does."""
    yield f"### `{name}`\n"
    yield from markdown(inspect.getdoc(item) or "")
    held = [own for own in vars(item).get("__annotations__", {}) if not own.startswith("_")]
    if held and "__dataclass_fields__" in vars(item) and not hasattr(fl, name):
        yield f"Attributes: {', '.join(f'`{own}`' for own in held)}.\n"
    for own, member in members(item).items():
        yield from told(f"{name}.{own}", member)


def members(item: type) -> dict[str, Any]:
    """Methods and properties of a class that it has in the package, and public, in order."""
    own = [vars(base) for base in (*item.__bases__, item) if base in {*ADDED, item}]
    return {
        name: getattr(member, "__func__", member)
        for each in own
        for name, member in each.items()
        if isinstance(member, MEMBERS) and name[0] != "_" and name not in LEFT_OUT
    }


def results_of(function: Any) -> list[type]:
    """Classes of the package that a function or property says it returns."""
    function = getattr(function, "fget", None) or getattr(function, "func", None) or function
    function = inspect.unwrap(function)  # which knows the names of its annotations
    words = re.findall(r"\w+", str(inspect.signature(function).return_annotation))
    found = (getattr(function, "__globals__", {}).get(word) for word in words)
    return [
        item for item in found if inspect.isclass(item) and item.__module__.startswith(fl.__name__)
    ]


def told(name: str, item: Any) -> Iterator[str]:
    """Lines that tell a function, a method or a property."""
    yield f"{'###' if name.startswith('fl.') else '####'} `{name.removeprefix('fl.')}`\n"
    if inspect.isfunction(item):
        signature = re.sub(r"(: |-> )'([^']*)'", r"\1\2", str(inspect.signature(item)))
        signature = re.sub(r"\bPlain(Scene|Result)\b", r"\1", signature)  # they take both kinds
        text = name + re.sub(r"\((self|cls)(: Record)?(, )?", "(", signature, count=1)
        glued = re.sub(r"(?<!,) ", "~", text)  # a line may end after a comma alone
        shown = "\n".join(wrap(glued, WIDTH, subsequent_indent="    ", break_on_hyphens=False))
        yield f"```text\n{shown.replace('~', ' ')}\n```\n"
    yield from markdown(inspect.getdoc(item) or "")


def markdown(docstring: str) -> Iterator[str]:
    """Paragraphs of a docstring as Markdown: examples in blocks, errors raised as a list."""
    text = inspect.cleandoc(docstring).replace("``", "`")
    for paragraph in text.split("\n\n"):
        if paragraph.startswith(">>>"):
            yield f"```pycon\n{paragraph}\n```\n"
        elif paragraph.startswith("Raises:\n"):
            yield "Raises:\n"
            entries = inspect.cleandoc(paragraph.partition("\n")[2])
            yield re.sub(r"^(\w+): ", r"- `\1`: ", entries, flags=re.MULTILINE) + "\n"
        else:
            yield re.sub(r"::$", ":", paragraph) + "\n"
