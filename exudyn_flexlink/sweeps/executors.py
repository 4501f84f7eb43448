"""Who makes the runs of a sweep: pools of `concurrent.futures`; rows come as they are finished."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass

from exudyn_flexlink.sweeps.plan import Point
from exudyn_flexlink.sweeps.rows import FAILED, Row
from exudyn_flexlink.sweeps.work import Work

ENDED = (
    "the process that ran it ended, as often as it was tried: killed, perhaps for want of memory, "
    "or a crash"
)


class CannotStartError(Exception):
    """No process of an executor can do the work at all; the text says why, and what to do."""


@dataclass(frozen=True)
class Pool:
    """Makes the run of a point in a task, and up to `most` tasks at once.

    A task raises `lost` if the process that made the run has ended.
    """

    submit: Callable[[Point], Future[Row]]
    most: int = 1
    lost: type[Exception] = BrokenExecutor


Executor = Callable[[Work], AbstractContextManager[Pool]]
"""Opens a pool for a work, or raises CannotStartError; leaving the pool ends all runs."""


@contextmanager
def in_this_process(work: Work) -> Iterator[Pool]:
    """Yield a pool that makes a run here, as it is given it."""

    def submit(point: Point) -> Future[Row]:
        made: Future[Row] = Future()
        made.set_result(work.row(point))
        return made

    yield Pool(submit)


def rows_of(executor: Executor, work: Work, points: Sequence[Point]) -> Generator[Row, None, None]:
    """Give a row for every point, each once, in whatever order they are finished.

    Where a process ends, any run under way may be to blame: each of these is tried once more when
    all others are done, alone. Closing the iterator ends all runs.

    Raises:
        CannotStartError: the executor can't do the work.

    """
    lost = yield from _tried(executor, work, points)
    lost = yield from _tried(executor, work, lost, alone=True)
    for point in lost:
        yield Row(point.number, point.id, FAILED, ENDED, 0, 0.0)


def _tried(
    executor: Executor, work: Work, points: Sequence[Point], *, alone: bool = False
) -> Generator[Row, None, list[Point]]:
    """Try points, one at a time if `alone`; returns those whose process ended.

    A pool that has lost a process gets no more points: what is left goes to a new one.
    """
    waiting, lost = deque(points), []
    while waiting:
        with executor(work) as pool:
            running: dict[Future[Row], Point] = {}
            most, whole = 1 if alone else pool.most, True
            while running or (waiting and whole):
                try:
                    while whole and waiting and len(running) < most:
                        task = pool.submit(waiting[0])  # which may raise
                        running[task] = waiting.popleft()
                except pool.lost:
                    whole = False
                for task in wait(running, return_when=FIRST_COMPLETED).done:
                    point = running.pop(task)
                    try:
                        row = task.result()
                    except pool.lost:
                        whole = False
                        lost.append(point)
                    except CannotStartError:
                        raise
                    except Exception as error:
                        raise CannotStartError(f"a process can't do the work: {error}") from error
                    else:
                        yield row
    return lost
