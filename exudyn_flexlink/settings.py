"""Settings such as 'run.turns=2', which replace values of a model file, or add keys."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from exudyn_flexlink.source import Document, KeyPath, Mistake, SceneError, did_you_mean, dotted
from exudyn_flexlink.yaml_reader import read_yaml

Setting = str | tuple[str, Any]
ExclusiveKeys = Sequence[tuple[KeyPath, tuple[str, ...]]]
"""Paths ("*" stands for any step) with the keys beside them that they exclude."""


def with_settings(
    document: Document, settings: Iterable[Setting], exclusive: ExclusiveKeys = ()
) -> Document:
    """Return a copy of a document in which texts such as 'run.turns=2' replace values, or add keys.

    A setting may be a path and its value instead: plain data, which is taken as it is.

    'null' takes a key away that is there; of one that is not, the scene says whether it may be.

    A setting also removes the keys that `exclusive` lists for its path, unless another
    setting gives them: else the file would say two contradicting things.

    Raises:
        SceneError: a setting is malformed, or its path leads nowhere.

    """
    given = [_parse_setting(document, text) for text in settings]
    for path, value, text in given:
        for key in _excluded(path, exclusive) if value is not None else ():
            sibling = (*path[:-1], key)
            if not any(other[: len(sibling)] == sibling for other, _, _ in given):
                document = _without(document, sibling)
        document = _with_value(document, path, value, text)
    return document


def _setting_error(document: Document, path: KeyPath, text: str, mistake: Mistake) -> SceneError:
    return SceneError(replace(document, settings={**document.settings, path: text}), [mistake])


def _parse_setting(document: Document, given: Setting) -> tuple[KeyPath, Any, str]:
    """Split 'run.turns=2' into its path, its value and the text itself."""
    text = given if isinstance(given, str) else f"{given[0]}={given[1]}"
    name, equals, value = text.partition("=")
    if not equals or not all(step.strip() for step in name.split(".")):
        mistake = Mistake((), "expected path=value", "for example --set run.turns=2")
        raise _setting_error(document, (), text, mistake)
    path: KeyPath = tuple(step.strip() for step in name.split("."))
    if not isinstance(given, str):  # then YAML only tells what no model file can hold
        value = json.dumps(given[1], ensure_ascii=False)
    read = read_yaml(value)
    if read.problems:
        mistake = Mistake(path, read.problems[0].message, read.problems[0].hint)
        raise _setting_error(document, path, text, mistake)
    return path, read.data if isinstance(given, str) else given[1], text


def _excluded(path: KeyPath, exclusive: ExclusiveKeys) -> list[str]:
    return [
        key
        for pattern, keys in exclusive
        if len(pattern) == len(path)
        and all(step in ("*", here) for step, here in zip(pattern, path, strict=True))
        for key in keys
    ]


def _with_value(document: Document, path: KeyPath, value: Any, text: str) -> Document:
    data: dict[str, Any] = dict(document.data)
    holder: Any = data
    real: KeyPath = ()
    made: dict[KeyPath, str] = {}  # sections that only this setting speaks of
    for step in path[:-1]:
        real = _step(document, holder, real, str(step), text)
        there = isinstance(real[-1], int) or real[-1] in holder
        inner = holder[real[-1]] if there else {}
        if not there:
            made[real] = text
        holder[real[-1]] = holder = list(inner) if isinstance(inner, list) else dict(inner)
    real = _step(document, holder, real, str(path[-1]), text, last=True)
    if value is None and isinstance(holder, dict) and real[-1] in holder:
        del holder[real[-1]]
    else:
        holder[real[-1]] = value
    kept = _without_places(replace(document, data=data), real)
    return replace(kept, settings={**kept.settings, **made, real: text})


def _step(  # noqa: PLR0913
    document: Document, holder: Any, above: KeyPath, step: str, text: str, *, last: bool = False
) -> KeyPath:
    """Return the path of `step` in `holder`; the error of a step that leads nowhere."""
    problem = ""
    real: KeyPath = (*above, step)
    inner: Any = None
    if isinstance(holder, list):
        at = _place_in(holder, step)
        if at is None:
            problem = f"'{dotted(above)}' has {len(holder)} entries, counted from 0"
        else:
            real, inner = (*above, at), holder[at]
    elif step in holder:
        inner = holder[step]
    elif above and not last and _is_of_file(document, above):
        problem = f"no '{step}' in '{dotted(above)}'{did_you_mean(step, holder)}"
    else:
        inner = {}
    if not (problem or last or isinstance(inner, (dict, list))):
        problem = f"'{dotted(real)}' is one value, nothing is below it"
    if problem:
        hint = "" if isinstance(holder, list) else "there are: " + ", ".join(holder)
        raise _setting_error(document, real, text, Mistake(real, problem, hint))
    return real


def _place_in(holder: Sequence[Any], step: str) -> int | None:
    """Place in a list that a step names, such as '1'; None if it names none."""
    digits = step.lstrip("0") or "0"  # of which a number may have no more than the length has
    if not step.isdecimal() or len(digits) > len(str(len(holder))) or int(digits) >= len(holder):
        return None
    return int(digits)


def _is_of_file(document: Document, path: KeyPath) -> bool:
    """Whether a section stood in the data before this setting; an absent one may be created."""
    return path[0] in document.data


def _without(document: Document, path: KeyPath) -> Document:
    """Forget a value and its places."""
    data = dict(document.data)
    holder: Any = data
    for step in path[:-1]:
        if not isinstance(holder, dict) or not isinstance(holder.get(str(step)), dict):
            return document
        holder[str(step)] = holder = dict(holder[str(step)])
    holder.pop(str(path[-1]), None)
    return _without_places(replace(document, data=data), path)


def _without_places(document: Document, path: KeyPath) -> Document:
    """Forget where the file has a value and all below it, and by which settings they were given."""

    def outside(table: dict[KeyPath, Any]) -> dict[KeyPath, Any]:
        return {key: value for key, value in table.items() if key[: len(path)] != path}

    return replace(
        document,
        places=outside(document.places),
        key_places=outside(document.key_places),
        settings=outside(document.settings),
    )
