"""How a run is asked to end before its time: by whoever calls, never by signals taken here.

The command line gives means to ask (`stopped_by`), made of Ctrl-C. From Python there are none:
Ctrl-C raises `KeyboardInterrupt` as everywhere.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from contextvars import ContextVar
from dataclasses import dataclass
from types import FrameType
from typing import Any, Protocol

from exudyn_flexlink.raising import Sendable
from exudyn_flexlink.result import Result


class LateInterruptError(Sendable, KeyboardInterrupt):
    """The request came when a run was solved to its end, and only being put together: `result`."""

    def __init__(self, result: Result) -> None:
        super().__init__()
        self.result = result


class Deferred(Protocol):
    """Tells whether the user asked for the end while the result was put together."""

    pending: bool


@dataclass
class _NeverAsked:
    pending: bool = False


@dataclass(frozen=True)
class Stopping:
    """Means to end a run: both are entered by the run itself.

    Inside `interrupts` the request calls a function, which ends the solve after the step under way;
    inside `deferrable_interrupts` and after that it is only taken note of.
    """

    interrupts: Callable[[Callable[[], None]], AbstractContextManager[None]]
    deferrable_interrupts: Callable[[], AbstractContextManager[Deferred]]


@contextmanager
def between_steps() -> Iterator[Callable[[], None]]:
    """Let signals of Python's wait inside, until the function given is called.

    A solver of another language swallows what a signal's handler raises while it calls Python. Here
    the handlers of whoever calls run between two steps, where what they raise is not lost.
    """
    waiting = list[tuple[int, FrameType | None]]()

    def note(number: int, frame: FrameType | None) -> None:
        waiting.append((number, frame))

    def let_them_run() -> None:
        while waiting:
            number, frame = waiting.pop(0)
            handlers[number](number, frame)

    handlers = _handlers()
    for number in handlers:
        signal.signal(number, note)
    try:
        yield let_them_run
    finally:
        for number, handler in handlers.items():
            if signal.getsignal(number) is note:  # a handler may have set another one
                signal.signal(number, handler)
        let_them_run()


def _handlers() -> dict[int, Callable[[int, FrameType | None], Any]]:
    """Python's handlers of signals: they run in the main thread, and can be set there alone."""
    if threading.current_thread() is not threading.main_thread():
        return {}
    known = {number: signal.getsignal(number) for number in signal.valid_signals()}
    return {number: handler for number, handler in known.items() if callable(handler)}


_given: ContextVar[Stopping | None] = ContextVar("stopping", default=None)


@contextmanager
def stopped_by(means: Stopping) -> Iterator[None]:
    """Give means to end the runs that are made inside."""
    token = _given.set(means)
    try:
        yield
    finally:
        _given.reset(token)


def interrupts(end: Callable[[], None]) -> AbstractContextManager[None]:
    """Let a request to end call `end`, where the caller gave means to ask."""
    means = _given.get()
    return nullcontext() if means is None else means.interrupts(end)


def deferrable_interrupts() -> AbstractContextManager[Deferred]:
    """Let a request to end be taken note of after the solve, where the caller gave means to ask."""
    means = _given.get()
    return nullcontext(_NeverAsked()) if means is None else means.deferrable_interrupts()
