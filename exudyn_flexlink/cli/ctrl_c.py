"""Ctrl-C ends a run after the step that is under way, and never loses what was computed.

Signals are taken here and in `ending` alone: whoever uses the package from Python keeps theirs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from signal import SIG_DFL, SIGINT, getsignal, signal
from types import FrameType
from typing import Any


class Patience:
    """A handler of Ctrl-C that hands it on to the one `before`, until it has to hold it back."""

    def __init__(self, before: Any) -> None:
        self._before = before
        self._holds = False
        self.pressed = False
        """Whether Ctrl-C was held back."""

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Take a Ctrl-C."""
        if self._holds:
            self.pressed = True
        elif callable(self._before):
            self._before(number, frame)
        elif number != SIGINT:  # handed on by who handles other signals: only Ctrl-C is ignored
            raise KeyboardInterrupt

    def hold(self) -> None:
        """From now on, only take note."""
        self._holds = True


@contextmanager
def patience() -> Iterator[Patience]:
    """Let Ctrl-C do what it did before until `hold` is called; then it is only taken note of."""
    before = getsignal(SIGINT)
    patient = Patience(before)
    try:
        signal(SIGINT, patient)
    except ValueError:  # not the main thread: Ctrl-C is not ours
        yield patient
        return
    try:
        yield patient
    finally:
        signal(SIGINT, SIG_DFL if before is None else before)


@contextmanager
def interrupts(end: Callable[[], None]) -> Iterator[None]:
    """Let Ctrl-C call `end` instead of breaking in somewhere inside a solver.

    What follows in `simulate` puts the result together: there Ctrl-C is held back.
    """
    try:
        before = signal(SIGINT, lambda *_: end())
    except ValueError:  # not the main thread: Ctrl-C is not ours
        yield
        return
    try:
        yield
    finally:
        if isinstance(before, Patience):
            before.hold()
        signal(SIGINT, before)


@contextmanager
def ends_runs() -> Iterator[None]:
    """Let Ctrl-C end the runs that are made inside, as `interrupts` and `patience` say."""
    from exudyn_flexlink.engines.interrupts import Stopping, stopped_by

    with stopped_by(Stopping(interrupts, patience)):
        yield
