"""How a run of any engine is made, interrupted and ended, and the second run in its own process.

The caller says when a run must end; nothing here handles signals. The command line uses Ctrl-C for
that (`stopped_by`). In Python a run is made `aside`: in a thread, while the main thread waits.
Python raises KeyboardInterrupt only in the main thread, so never within a step.

The second run of a scene is a process beside the first one. It is a command of this program, which
reads and writes files. So it works from scripts and notebooks, too, and gets Ctrl-C only from here.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from contextvars import ContextVar, copy_context
from dataclasses import dataclass, replace
from math import inf, pi
from multiprocessing import parent_process
from pathlib import Path
from queue import Empty, SimpleQueue
from shutil import rmtree
from tempfile import mkdtemp
from threading import Thread, current_thread, main_thread
from time import perf_counter
from typing import Any, TypeVar

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.laws import Impulse
from exudyn_flexlink.mechanism import Contact, Mechanism, cut_off
from exudyn_flexlink.raising import Sendable
from exudyn_flexlink.result import Integrator, Outcome, Result
from exudyn_flexlink.scene import Scene


class LateInterruptError(Sendable, KeyboardInterrupt):
    """The request to end came after a run was solved; its `result` is complete."""

    def __init__(self, result: Result) -> None:
        super().__init__()
        self.result = result


@dataclass(frozen=True)
class Stopping:
    """Two contexts that let a request end a run; the run enters both.

    Inside `interrupts` the request calls a function, which ends the run after the present step.
    Inside `deferrable_interrupts`, after the solve, the request only sets `pending`.
    """

    interrupts: Callable[[Callable[[], None]], AbstractContextManager[None]]
    deferrable_interrupts: Callable[[], AbstractContextManager[Any]]  # with `pending`, a bool


_stopping: ContextVar[Stopping | None] = ContextVar("stopping", default=None)


@contextmanager
def stopped_by(means: Stopping) -> Iterator[None]:
    """Let these means end the runs that are made inside."""
    token = _stopping.set(means)
    try:
        yield
    finally:
        _stopping.reset(token)


def interrupts(end: Callable[[], None]) -> AbstractContextManager[None]:
    """Let a request to end call `end`, if the caller gave means for it."""
    means = _stopping.get()
    return nullcontext() if means is None else means.interrupts(end)


def deferrable_interrupts() -> AbstractContextManager[Any]:
    """Let a request to end after the solve set `pending`, if the caller gave means for it."""
    means = _stopping.get()
    return nullcontext(_Request()) if means is None else means.deferrable_interrupts()


# --- from Python ------------------------------------------------------------------------------


LOOK = 0.1  # s: on Windows a thread that waits gets Ctrl-C only between two waits of this length


class _Request:
    """A request to end that another thread may make."""

    def __init__(self) -> None:
        self.pending = False
        self._end: Callable[[], None] | None = None

    def ask(self) -> None:
        self.pending = True
        if self._end is not None:
            self._end()

    @contextmanager
    def interrupts(self, end: Callable[[], None]) -> Iterator[None]:
        self._end = end
        if self.pending:  # it came before the first step, so that there is no result
            raise KeyboardInterrupt
        try:
            yield
        finally:
            self._end = None


def aside(
    make: Callable[[Callable[[float], None] | None], Result],
    progress: Callable[[float], None] | None,
) -> Result:
    """Make a run in a new thread, and call `progress` from this one, at the end with 1.

    Ctrl-C, or any other exception in this thread, ends the run after the present step; exceptions
    other than Ctrl-C are raised again. If the caller gave other means, or if this is not the main
    thread, where Python raises no KeyboardInterrupt, the run is made in this thread.
    """
    if _stopping.get() is not None or current_thread() is not main_thread():
        return make(progress)
    request, made, progress_queue = _Request(), Future[Result](), SimpleQueue[float | None]()

    def work() -> None:
        try:
            with stopped_by(Stopping(request.interrupts, lambda: nullcontext(request))):
                made.set_result(make(progress_queue.put if progress is not None else None))
        except BaseException as error:
            made.set_exception(error)
        finally:
            progress_queue.put(None)

    try:
        Thread(target=copy_context().run, args=(work,), daemon=True).start()
        _follow(progress_queue, progress)
    except BaseException as error:
        request.ask()
        _follow(progress_queue)  # a second Ctrl-C interrupts this wait
        if not isinstance(error, KeyboardInterrupt):
            raise
    return made.result()


def _follow(
    progress_queue: SimpleQueue[float | None], progress: Callable[[float], None] | None = None
) -> None:
    """Call `progress` with what a thread sends, until it sends None at its end."""
    while True:
        with suppress(Empty):
            done = progress_queue.get(timeout=LOOK)
            if done is None:
                return
            if progress is not None:
                progress(done)


def radau(order: int) -> Integrator:
    """Return name and order of the implicit method."""
    return Integrator("Radau IIA", order)


TOO_DEEP_ADVICE = "take a law without such a bound: 'formula: sphere', or one with a stiffness"


class DepthBounds:
    """Penetrations (m) of contacts (c,) beyond which their laws have no force."""

    def __init__(self, contacts: Sequence[Contact]) -> None:
        self._names = [contact.name for contact in contacts]
        laws = [contact.law for contact in contacts]
        bounds = [inf if isinstance(law, Impulse) else law.deepest for law in laws]
        self._bounds = np.array(bounds, dtype=np.float64)
        self.any = bool(np.isfinite(self._bounds).any())

    def passed(self, depths: FloatArray) -> str:
        """Say which contact is too deep, of depths (c,), m; empty if none is."""
        beyond = np.flatnonzero(depths > self._bounds)
        if not len(beyond):
            return ""
        k = int(beyond[0])
        bound = f"beyond {self._bounds[k]:.4g} m its law has no force"
        return f"'{self._names[k]}' was pressed {depths[k]:.4g} m deep: {bound}"


def outcome_of(
    scene: Scene,
    mechanism: Mechanism,
    time: float,
    left: float | None,
    reasons: Sequence[tuple[str, str]],
) -> Outcome:
    """Outcome of a run that ended at `time` (s).

    The run failed if one of `reasons` is not empty; the first of these counts, with its advice. It
    also failed if turns are still to be made: `left` is that angle (rad), None if the end of the
    run was known beforehand.
    """
    for reason, advice in reasons:
        if reason:
            return Outcome(False, time, reason, advice)
    missing = cut_off(scene, mechanism) if left is None else left
    if missing <= 0:
        return Outcome(True, time)
    run = scene.run
    turns = run.turns or 0.0
    return Outcome(
        False,
        time,
        f"'at_most' was reached when joint '{run.of}' had made {turns - missing / (2 * pi):.3g} "
        f"turns of {turns:g}",
        "raise 'at_most', or a drive's value" if scene.drives else "raise 'at_most'",
    )


Prepared = TypeVar("Prepared")
Complaint = TypeVar("Complaint")


def timed(
    prepare: Callable[[], Prepared],
    solve: Callable[[Prepared], Complaint],
    finish: Callable[[Prepared, Complaint], Result],
) -> Result:
    """Make a run, and measure the times of its three parts."""
    began = perf_counter()
    prepared = prepare()
    ready = perf_counter()
    complaint = solve(prepared)
    solved = perf_counter()
    result = finish(prepared, complaint)
    done = perf_counter()
    timings = {"prepare": ready - began, "solve": solved - ready, "process": done - solved}
    return replace(result, timings=timings)


COMMAND = "exudyn_flexlink.cli.second"
ASKED, DONE, MADE = "asked", "done", "made"
"""Files: scene and engine; part that is done; result, or an exception."""
SURE = 1.0  # s: after this time the length of the first run is estimated
WORTH = 3.0  # s: a longer run gets a second process, which takes a second to start
BETWEEN_LOOKS = 0.02  # s: between two looks at the process


class Beside:
    """The second run of a scene by an engine, in a process beside the first run.

    It begins when the first run, which `watch` follows, proves to be long; leaving the context ends
    it. If it did not begin, `made` returns None. It never begins on a single core, nor in a process
    that another one has started: that one decides what runs at the same time.
    """

    def __init__(self, scene: Scene, engine: str) -> None:
        self._asked = scene, engine
        self._began = time.monotonic()
        self._folder: Path | None = None
        self._process: subprocess.Popen[bytes] | None = None
        cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
        alone = parent_process() is None and bool(sys.executable) and cores != 1
        self._possible = alone and scene.accuracy.tolerance is not None

    def __enter__(self) -> Beside:
        return self

    def __exit__(self, *_: object) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait()
        if self._folder is not None:
            rmtree(self._folder, ignore_errors=True)

    def watch(self, progress: Callable[[float], None] | None) -> Callable[[float], None]:
        """Return a function to be called with the part of the first run that is done, 0 to 1."""

        def report(done: float) -> None:
            passed = time.monotonic() - self._began
            if self._possible and passed > max(SURE, WORTH * done):
                self._possible = False
                with suppress(
                    OSError
                ):  # no room for files or processes: the runs follow each other
                    self._start()
            if progress is not None:
                progress(done)

        return report

    def made(self, progress: Callable[[float], None] | None) -> Result | None:
        """Wait for the run; None if it never began, or if its process failed.

        Raises:
            LateInterruptError: the user ended it after the solve; it has the complete result.
            MemoryError: there was not enough memory for it.

        """
        if self._process is None or self._folder is None:
            return None
        done = 0.0
        with interrupts(self._interrupt):
            while self._process.poll() is None:
                if progress is not None:
                    done = max(done, _number(self._folder / DONE))
                    progress(done)
                time.sleep(BETWEEN_LOOKS)
        try:
            made = pickle.loads((self._folder / MADE).read_bytes())
        except OSError:
            return None
        if isinstance(made, BaseException):
            raise made
        assert isinstance(made, Result)
        return made

    def _start(self) -> None:
        self._folder = Path(mkdtemp(prefix="flexlink-second-"))
        (self._folder / ASKED).write_bytes(pickle.dumps(self._asked))
        root = str(Path(__file__).parents[2])
        before = os.environ.get("PYTHONPATH")
        path = root if before is None else f"{root}{os.pathsep}{before}"
        self._process = subprocess.Popen(
            [sys.executable, "-m", COMMAND, str(self._folder)], cwd=self._folder,
            env={**os.environ, "PYTHONPATH": path}, stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
        )  # fmt: skip

    def _interrupt(self) -> None:
        """End the run after the present step."""
        if self._process is not None:
            self._process.send_signal(signal.SIGINT if os.name == "posix" else signal.SIGTERM)


def _number(file: Path) -> float:
    """Part of the run that is done; 0 while the file is being written."""
    try:
        return float(file.read_text())
    except (OSError, ValueError):
        return 0.0
