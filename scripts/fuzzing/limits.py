"""Limits to what a run may take: processor time, memory."""

from __future__ import annotations

import resource
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

MEMORY = 4 * 2**30  # bytes


class TooLongError(BaseException):
    """A run takes too long; no Exception, which the program might catch."""


@contextmanager
def limited(longest: float) -> Iterator[None]:
    """Raise TooLongError in what takes more processor time (s)."""

    def stop(_: int, __: FrameType | None) -> None:
        raise TooLongError(f"more than {longest:g} s of processor time")

    before = signal.signal(signal.SIGVTALRM, stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, longest)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)


def limit_memory() -> None:
    """Let this process have so much memory: what takes more is a MemoryError."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, resource.RLIM_INFINITY))
