"""What the terminal sees besides results: exit codes, complaints, progress.

Ctrl-C ends a run after the step that is under way, and never loses what was computed.

Signals are taken here and in `ending` alone: whoever uses the package from Python keeps theirs.

A request to end (`kill`, a batch system, a terminal that is closed) does what Ctrl-C does.
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
LONG, BETWEEN_LINES = 10.0, 5.0  # s: a run shorter than `LONG` stays quiet where nobody watches


def prepare_streams() -> None:
    """Make sure that whatever is said can be: to streams that were closed, or know few letters."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def release_streams() -> None:
    """Write what stdout and stderr still hold, and drop what can't be written.

    Python would try again as it ends, and end with code 120.
    """
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            _drop(stream)


def _drop(stream: TextIO) -> None:
    """Send what a stream holds, and all that is still written to it, nowhere."""
    with suppress(io.UnsupportedOperation):  # a stream of an embedding program, without a file
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def how_called() -> str:
    """Return how this program was called, for commands that are printed to be typed."""
    called = Path(sys.argv[0])
    if called.name == "__main__.py" and called.parent.name == PACKAGE:
        return f"{sys.orig_argv[0]} -m {PACKAGE}"
    if called.stem != PROGRAM or shutil.which(PROGRAM) == str(called):
        return PROGRAM
    return str(called)


def tell(text: str) -> None:
    """Print results at once: what is said on stderr afterwards stands below them.

    A reader who has seen enough, such as `head`, costs neither warnings nor the exit code.
    """
    if sys.stdout.isatty():
        text = folded(text, shutil.get_terminal_size().columns)
    try:
        print(text, flush=True)
    except BrokenPipeError:
        _drop(sys.stdout)


def complain(text: str, code: int = DONE) -> int:
    """Say something on stderr, and hand on the exit code that goes with it.

    A terminal that is gone keeps nothing from being written or ended.
    """
    with suppress(OSError):
        print(text, file=sys.stderr)
    return code


def refuse(error: Exception, code: int = BAD_INPUT) -> int:
    """Say why something can't be done, and the option that would do it; returns the exit code."""
    complain(str(error))
    if getattr(error, "forcible", False):  # of storage, which is not asked by commands alone
        complain("hint: '--force' forces it")
    return code


def folded(text: str, width: int) -> str:
    """Break rows of tables, which are indented, between words where they are longer than `width`.

    Sentences are left to the terminal: a command or a path in them can then be copied.
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
    """Give a bar where somebody sees it, a terminal; else lines, of long runs; none if `quiet`."""
    bar = (Quiet if quiet else Bar if sys.stderr.isatty() else Lines)(what)
    try:
        yield bar
    finally:
        bar.close()


class Quiet:
    """Progress that nobody is shown."""

    def __init__(self, what: str) -> None:
        self._what, self._began = what, time.monotonic()

    def __call__(self, done: float) -> None:
        """Show the part that is done, 0 to 1."""

    def say(self, what: str) -> None:
        """Say from now on that `what` is going on."""
        self._what = what

    def close(self) -> None:
        """Take away what is shown."""


class Lines(Quiet):
    """Now and then a line on stderr, for a log file, that appears only in runs over `LONG`."""

    _next = LONG
    _first: tuple[float, float] | None = None

    def __call__(self, done: float) -> None:
        """Tell the part that is done, 0 to 1, if it is time to."""
        now = time.monotonic() - self._began
        # The rest takes as long as it would, as fast as it went since the first part that was told.
        since, before = self._first = self._first or (now, done)
        if now < self._next:
            return
        self._next = now + BETWEEN_LINES
        left = (1 - done) * (now - since) / (done - before) if done > before else None
        left_text = "" if left is None else f", about {left:.0f} s left"
        complain(f"{self._what}: {100 * done:.0f} % after {now:.0f} s{left_text}")


class Bar(Quiet):
    """A progress bar with the time left, on stderr, that appears only in runs over a second."""

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
