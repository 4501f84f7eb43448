"""Ctrl-C ends a run after the step that is under way."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from signal import SIGINT, signal


@contextmanager
def interrupts(end: Callable[[], None]) -> Iterator[None]:
    """Let Ctrl-C call `end` instead of breaking in somewhere inside a solver."""
    try:
        before = signal(SIGINT, lambda *_: end())
    except ValueError:  # not the main thread: Ctrl-C is not ours
        yield
        return
    try:
        yield
    finally:
        signal(SIGINT, before)
