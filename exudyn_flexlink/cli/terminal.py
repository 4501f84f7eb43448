"""What the terminal shows besides results: exit codes, complaints, progress.

Ctrl-C ends a run after the present step; computed numbers are never lost.

Only the command line handles signals: programs that import the package keep their own handlers.

A request to end (`kill`, a batch system, a closed terminal) does the same as Ctrl-C.
"""

from __future__ import annotations

import io
import os
import shutil
import signal
import sys
import textwrap
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import current_thread, main_thread
from types import FrameType
from typing import Any, TextIO

PACKAGE, PROGRAM = "exudyn_flexlink", "exudyn-flexlink"
DONE, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
SOON = 1.0  # s: a run shorter than this needs no progress bar
LONG, BETWEEN_LINES = 10.0, 5.0  # s: without a terminal a run shorter than `LONG` is quiet


def prepare_streams() -> None:
    """Let every text be printed, also if a stream is closed or lacks some letters."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def release_streams() -> None:
    """Write the buffers of stdout and stderr, and drop text that can't be written.

    Otherwise Python would try to write it again at its end, and exit with code 120.
    """
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            _drop(stream)


def _drop(stream: TextIO) -> None:
    """Discard the buffer of a stream, and all later output to it."""
    with suppress(io.UnsupportedOperation):  # a stream of an embedding program, without a file
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def how_called() -> str:
    """Return how the user called this program, for commands in messages."""
    called = Path(sys.argv[0])
    if called.name == "__main__.py" and called.parent.name == PACKAGE:
        return f"{sys.orig_argv[0]} -m {PACKAGE}"
    if called.stem != PROGRAM or shutil.which(PROGRAM) == str(called):
        return PROGRAM
    return str(called)


def tell(text: str) -> None:
    """Print results at once, so that later messages on stderr stand below them.

    If the reader, such as `head`, closes the pipe, warnings and exit code stay as they are.
    """
    if sys.stdout.isatty():
        text = folded(text, shutil.get_terminal_size().columns)
    try:
        print(text, flush=True)
    except BrokenPipeError:
        _drop(sys.stdout)


def complain(text: str, code: int = DONE) -> int:
    """Print a message on stderr, and return the exit code `code`.

    A closed terminal does not keep the program from writing files or ending.
    """
    with suppress(OSError):
        print(text, file=sys.stderr)
    return code


def refuse(error: Exception, code: int = BAD_INPUT) -> int:
    """Say why something can't be done, and which option allows it; returns the exit code."""
    complain(str(error))
    if getattr(error, "forcible", False):  # an error of storage, which does not know options
        complain("hint: '--force' forces it")
    return code


def folded(text: str, width: int) -> str:
    """Break indented rows, those of tables, between words if they are longer than `width`.

    The terminal breaks sentences itself: so a command or path in them can be copied.
    """
    lines = []
    for line in text.split("\n"):
        indent = len(line) - len(line.lstrip(" "))
        if not indent or len(line) <= width:
            lines.append(line)
            continue
        lines += textwrap.wrap(
            line, width, subsequent_indent=" " * (indent + 4), replace_whitespace=False,
            break_long_words=False, break_on_hyphens=False,
        )  # fmt: skip
    return "\n".join(lines)


@contextmanager
def progress_bar(quiet: bool, what: str = "simulating") -> Iterator[Quiet]:
    """Give a progress bar in a terminal, else lines for long runs; nothing if `quiet`."""
    bar = (Quiet if quiet else Bar if sys.stderr.isatty() else Lines)(what)
    try:
        yield bar
    finally:
        bar.close()


class Quiet:
    """Progress that is not shown."""

    def __init__(self, what: str) -> None:
        self._what, self._began = what, time.monotonic()

    def __call__(self, done: float) -> None:
        """Show the part that is done, 0 to 1."""

    def say(self, what: str) -> None:
        """Say from now on that `what` is going on."""
        self._what = what

    def close(self) -> None:
        """Remove the display."""


class Lines(Quiet):
    """Prints a line on stderr now and then, for a log file, in runs longer than `LONG`."""

    _next = LONG
    _first: tuple[float, float] | None = None

    def __call__(self, done: float) -> None:
        """Print the part that is done, 0 to 1, if a line is due."""
        now = time.monotonic() - self._began
        # The time left, at the mean speed since the first call.
        since, before = self._first = self._first or (now, done)
        if now < self._next:
            return
        self._next = now + BETWEEN_LINES
        left = (1 - done) * (now - since) / (done - before) if done > before else None
        left_text = "" if left is None else f", about {left:.0f} s left"
        complain(f"{self._what}: {100 * done:.0f} % after {now:.0f} s{left_text}")


class Bar(Quiet):
    """A progress bar with the time left, on stderr, in runs longer than a second."""

    _done = 0.0
    _bar: Any = None

    def __call__(self, done: float) -> None:
        """Show the part that is done, 0 to 1."""
        self._done = done
        if self._bar is None:
            if time.monotonic() - self._began < SOON:
                return
            self._open(self._what)
        with suppress(OSError):  # the terminal is gone
            (task,) = self._bar.task_ids
            self._bar.update(task, completed=done, description=self._what)

    def say(self, what: str) -> None:
        """Say from now on that `what` is going on."""
        self._what = what
        self(self._done)

    def close(self) -> None:
        """Take the bar away."""
        if self._bar is not None:
            with suppress(OSError):
                self._bar.stop()

    def _open(self, what: str) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn
        from rich.progress import TimeRemainingColumn as TimeLeft

        columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeLeft())
        self._bar = Progress(*columns, TextColumn("left"), console=Console(stderr=True),
                             transient=True)  # fmt: skip
        self._bar.add_task(what, total=1.0)
        with suppress(OSError):
            self._bar.start()


REQUESTS = ("SIGTERM", "SIGHUP")  # Windows has no SIGHUP
ONE_REQUEST = 5.0  # s: a closed terminal, or a batch system, may ask several times
SIGNALLED = 128  # plus the signal's number: what a shell gives as exit code


class Ending:
    """Handles requests to end: passes them to the present handler of Ctrl-C."""

    def __init__(self) -> None:
        self.asked: signal.Signals | None = None
        """The signal that asked for the end; None before any did."""
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
        """Exit code for the shell: of the signal that interrupted, if any, else `code`."""
        return SIGNALLED + self.asked if self.asked and code == INTERRUPTED else code


@contextmanager
def ended_by_signals() -> Iterator[Ending]:
    """Take requests to end, unless they are ignored (`nohup`) or handled by an embedding program.

    Requests within `ONE_REQUEST` of each other count as one. Only the main thread takes signals.
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
