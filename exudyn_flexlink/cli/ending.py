"""A request to end (`kill`, a batch system, a terminal that is closed) does what Ctrl-C does."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from threading import current_thread, main_thread
from types import FrameType

from exudyn_flexlink.cli.terminal import INTERRUPTED

REQUESTS = ("SIGTERM", "SIGHUP")  # Windows has no SIGHUP
ONE_REQUEST = 5.0  # s: a terminal that is closed, or a batch system, may ask more than once
SIGNALLED = 128  # plus the signal's number: what a shell gives as exit code


class Ending:
    """Handles requests to end: hands them to whatever handles Ctrl-C at that moment."""

    def __init__(self) -> None:
        self.asked: signal.Signals | None = None
        """The signal that asked for the end; None as long as none did."""
        self._since = -ONE_REQUEST

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Take a signal."""
        now = time.monotonic()
        if now - self._since < ONE_REQUEST:
            return
        self.asked, self._since = signal.Signals(number), now
        handler = signal.getsignal(signal.SIGINT)
        if not callable(handler):  # a shell's background jobs ignore Ctrl-C
            raise KeyboardInterrupt
        handler(number, frame)

    def code(self, code: int) -> int:
        """Exit code of a program that would end with `code` if Ctrl-C had ended it."""
        return SIGNALLED + self.asked if self.asked and code == INTERRUPTED else code


@contextmanager
def ended_by_signals() -> Iterator[Ending]:
    """Take requests to end, unless they are ignored (`nohup`) or handled by an embedding program.

    A second request within `ONE_REQUEST` is the same one. Only the main thread can take signals.
    """
    ending, taken = Ending(), []
    for name in REQUESTS if current_thread() is main_thread() else ():
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, ending)
            taken.append(number)
    try:
        yield ending
    finally:
        for number in taken:
            signal.signal(number, signal.SIG_DFL)
