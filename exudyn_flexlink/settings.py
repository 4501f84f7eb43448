"""Settings such as 'run.turns=2', which replace values of a model file, or add keys."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Sequence
from copy import deepcopy
from dataclasses import replace
from typing import Any

from exudyn_flexlink.source import Document, KeyPath, Mistake, SceneError, did_you_mean, dotted
from exudyn_flexlink.yaml_reader import read_yaml

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

    A setting may be a path and its value instead: plain data, which is taken as it is. 'null' takes
    a key away that is there; of one that is not, the scene says whether it may be. A setting also
    removes the keys that `exclusive` lists for its path, unless another setting gives them: else
    the file would say two contradicting things. A mapping that is missing on the way is made; the
    scene says whether it may be there. Of a section of `named` parts the part must be there.

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
    if not isinstance(given, str):  # then YAML only tells what no model file can hold
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
        and all(step in ("*", here) for step, here in zip(pattern, path, strict=True))
        for key in keys
    ]


def _with_value(document: Document, path: KeyPath, value: Any, text: str) -> Document:
    holder: Any = document.data
    real: KeyPath = ()
    made: dict[KeyPath, str] = {}  # sections that only this setting speaks of
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
    """Return the path of `step` in `holder`; a mapping may lack it, a list may not.

    Raises:
        SceneError: the step leads nowhere.

    """
    problem = ""
    real: KeyPath = (*above, step)
    if isinstance(holder, list):
        digits = step.lstrip("0") or "0"  # of which a number may have no more than the length has
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
    """Forget a value and its places."""
    holder: Any = document.data
    for step in path[:-1]:
        holder = holder.get(step) if isinstance(holder, dict) else None
    if not isinstance(holder, dict):
        return document
    holder.pop(path[-1], None)
    return _without_places(document, path)


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
