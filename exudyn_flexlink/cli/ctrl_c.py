"""Ctrl-C ends a run after the step that is under way, and never loses what was computed.

Signals are taken here and in `ending` alone: whoever uses the package from Python keeps theirs.
"""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

from exudyn_flexlink.engines.interrupts import Stopping, stopped_by


class DeferrableInterrupt:
    """A handler of Ctrl-C that hands it on to the one `before`, until it is told to defer it."""

    def __init__(self, before: Any) -> None:
        self.before = before
        self._defers = False
        self.pending = False
        """Whether a Ctrl-C was deferred."""

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Take a Ctrl-C."""
        if self._defers:
            self.pending = True
        elif callable(self.before):
            self.before(number, frame)
        elif (
            number != signal.SIGINT
        ):  # handed on by who handles other signals: only Ctrl-C is ignored
            raise KeyboardInterrupt

    def defer(self) -> None:
        """From now on, only take note of Ctrl-C."""
        self._defers = True


@contextmanager
def _handled_by(handler: Callable[[int, FrameType | None], None]) -> Iterator[None]:
    """Let a handler take Ctrl-C inside."""
    before = signal.getsignal(signal.SIGINT)
    try:
        signal.signal(signal.SIGINT, handler)
    except ValueError:  # not the main thread: Ctrl-C is not ours
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)


@contextmanager
def deferrable_interrupts() -> Iterator[DeferrableInterrupt]:
    """Let Ctrl-C do what it did before, until `defer` is called on the handler."""
    handler = DeferrableInterrupt(signal.getsignal(signal.SIGINT))
    with _handled_by(handler):
        yield handler


@contextmanager
def interrupts(end: Callable[[], None]) -> Iterator[None]:
    """Let Ctrl-C call `end` instead of breaking in somewhere inside a solver.

    What follows in `simulate` puts the result together: there Ctrl-C is deferred. A Ctrl-C that is
    ignored stays so: only requests of other signals, which come this way too, then end the run.
    """
    before = signal.getsignal(signal.SIGINT)
    ignored = (
        before.before if isinstance(before, DeferrableInterrupt) else before
    ) is signal.SIG_IGN

    def handle(number: int, _frame: FrameType | None) -> None:
        if number != signal.SIGINT or not ignored:
            end()

    with _handled_by(handle):
        try:
            yield
        finally:
            if isinstance(before, DeferrableInterrupt):
                before.defer()


@contextmanager
def ends_runs() -> Iterator[None]:
    """Let Ctrl-C end the runs that are made inside, as the two above say."""
    with stopped_by(Stopping(interrupts, deferrable_interrupts)):
        yield
