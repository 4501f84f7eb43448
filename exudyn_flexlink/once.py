"""Results of functions of a frozen object, computed once and kept as long as the object lives."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar, cast
from weakref import finalize

Owner = TypeVar("Owner")
Value = TypeVar("Value")

_KEPT: dict[int, dict[Callable[..., Any], Any]] = {}  # what functions returned, by owner's identity


def once_for_each(function: Callable[[Owner], Value]) -> Callable[[Owner], Value]:
    """Let a function run once for each object, by its identity; errors are not kept.

    What the function returns must not refer to the object: that would keep the object alive.
    """

    @wraps(function)
    def kept_or_computed(owner: Owner) -> Value:
        kept = _kept_of(owner)
        if function not in kept:
            kept[function] = function(owner)
        return cast(Value, kept[function])

    return kept_or_computed


def hand_on(known: Owner, equal: Owner) -> None:
    """Let results that were computed for an object hold for an equal object."""
    _kept_of(equal).update(_kept_of(known))


def _kept_of(owner: object) -> dict[Callable[..., Any], Any]:
    key = id(owner)
    if key not in _KEPT:
        _KEPT[key] = {}
        finalize(owner, _KEPT.pop, key, None).atexit = False
    return _KEPT[key]
