"""Runs in processes of this machine, each of which gets the scene once and then points.

Each process has a pipe of its own. So it is known which run it was making when it ended, and that
one alone is lost: a pool that shares its queue loses all that were under way.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
import threading
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from multiprocessing import connection, get_context, parent_process
from multiprocessing.connection import Connection
from typing import Any

from threadpoolctl import threadpool_limits

from exudyn_flexlink.sweeps.executors import CannotStartError, ended_row
from exudyn_flexlink.sweeps.plan import Point
from exudyn_flexlink.sweeps.rows import Row
from exudyn_flexlink.sweeps.work import Work

AHEAD = 2  # points that a process has: one it runs, and the next, so that it never waits
READY = "ready"
MOST_TRIES = 2  # of a point whose process ends: once more, then it is a failed row
MOST_UNBORN = 2
SECONDS_TO_END = 5.0


@dataclass(frozen=True)
class LocalProcesses:
    """Runs points in `count` processes of this machine."""

    count: int

    def rows(self, work: Work, points: Sequence[Point]) -> Generator[Row, None, None]:
        """Give a row for every point, as they are finished.

        A process that ends costs the run it was making, which is tried once more.

        Raises:
            CannotStartError: the work can't be sent to other processes.

        """
        try:
            sent = pickle.dumps(work)
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise CannotStartError(_not_sent(error)) from error
        waiting = deque(points)
        team = _Team(sent, min(self.count, len(points)))
        try:
            while waiting or team.busy:
                yield from team.rows(waiting)
        finally:
            team.end()


class _Team:
    """Processes that work on one sweep."""

    def __init__(self, sent: bytes, count: int) -> None:
        self._sent = sent
        self._workers = [_Worker(sent) for _ in range(count)]
        self._unborn = 0  # processes that ended before they could begin, one after the other
        self._tries: dict[int, int] = {}

    @property
    def busy(self) -> bool:
        return any(worker.points for worker in self._workers)

    def rows(self, waiting: deque[Point]) -> Iterator[Row]:
        """Hand out points, wait until processes have something to tell, and give the rows."""
        for worker in self._workers:
            worker.give(waiting)
        heard = connection.wait([worker.pipe for worker in self._workers])
        for worker in [worker for worker in self._workers if worker.pipe in heard]:
            row = worker.take()
            if row is not None:
                yield row
            if worker.ended:
                yield from self._replace(worker, waiting)
            elif worker.ready:
                self._unborn = 0

    def end(self) -> None:
        """End all processes, whatever they do."""
        for worker in self._workers:
            worker.end()
        for worker in self._workers:
            worker.join()

    def _replace(self, worker: _Worker, waiting: deque[Point]) -> Iterator[Row]:
        """Put a new process in the place of one that has ended; what it had not begun waits."""
        self._workers.remove(worker)
        self._unborn += not worker.ready
        if self._unborn > MOST_UNBORN:
            raise CannotStartError(NOT_BEGUN)
        yield from self._given_up(worker)
        waiting.extendleft(reversed(worker.points))
        if waiting:
            self._workers.append(_Worker(self._sent))

    def _given_up(self, worker: _Worker) -> Iterator[Row]:
        """Give the row of the point that a process was running, unless it is tried again."""
        if not worker.points:
            return
        number = worker.points[0].number
        self._tries[number] = self._tries.get(number, 0) + 1
        if self._tries[number] >= MOST_TRIES:
            yield ended_row(worker.points.popleft())


@dataclass(eq=False)
class _Worker:
    """A process, and the points that it has: the first is the one it runs."""

    sent: bytes
    points: deque[Point] = field(default_factory=deque)
    ended: bool = False

    def __post_init__(self) -> None:
        context = get_context("spawn")  # a fork would share threads and locks of the engines
        self.pipe, theirs = context.Pipe()
        self.ready = False
        with _without_interrupts(), _without_absent_main():
            self._process = context.Process(target=_serve, args=(theirs, self.sent), daemon=True)
            self._process.start()
        theirs.close()

    def give(self, waiting: deque[Point]) -> None:
        """Send it points, as many as it should have."""
        while waiting and self.ready and not self.ended and len(self.points) < AHEAD:
            point = waiting.popleft()
            self.points.append(point)
            try:
                self.pipe.send(point)
            except OSError:  # it has ended, which is found when it is listened to
                return

    def take(self) -> Row | None:
        """Return the row that it sent; None if it told something else.

        Raises:
            CannotStartError: it can't do the work.

        """
        try:
            told: Any = self.pipe.recv()
        except (EOFError, OSError, pickle.UnpicklingError):
            self.ended = True
            self.join()
            return None
        if isinstance(told, Row):
            self.points.popleft()
            return told
        if told != READY:
            raise CannotStartError(str(told))
        self.ready = True
        return None

    def end(self) -> None:
        """Tell it to end, whatever it does."""
        self._process.terminate()

    def join(self) -> None:
        """Wait for its end."""
        self._process.join(SECONDS_TO_END)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        self.pipe.close()


NOT_BEGUN = (
    "a process ended before it could begin. A script that sweeps must do so below "
    "\"if __name__ == '__main__':\", since each process reads it again; or give 'workers=1'"
)


def _not_sent(error: Exception) -> str:
    return (
        f"what is observed can't be sent to other processes: {error}. Put the function into a "
        "module, at its top level, or give 'workers=1'"
    )


@contextmanager
def _without_interrupts() -> Iterator[None]:
    """Let a process that is started inside never see Ctrl-C, which ends the sweep as a whole."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _without_absent_main() -> Iterator[None]:
    """Let a process that is started inside not read again what was no file, such as '<stdin>'."""
    main = sys.modules["__main__"]
    file = getattr(main, "__file__", None)
    if file is None or os.path.exists(file):
        yield
        return
    del main.__file__
    try:
        yield
    finally:
        main.__file__ = file


def _serve(pipe: Connection, sent: bytes) -> None:
    """Run points as they come, in a process of its own."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        work: Work = pickle.loads(sent)
    except Exception as error:  # what it names is not to be found from here
        pipe.send(_not_sent(error))
        return
    with suppress(EOFError, OSError), threadpool_limits(limits=1):
        pipe.send(READY)
        while True:
            pipe.send(work.row(pipe.recv()))


def _end_with_parent() -> None:
    """End when the process that started this one does, however that ends."""
    parent = parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(1)
