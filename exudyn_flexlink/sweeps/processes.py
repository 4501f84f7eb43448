"""Runs in processes of this machine."""

from __future__ import annotations

import os
import pickle
import signal
import sys
import threading
from collections.abc import Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import connection, get_context, parent_process

from threadpoolctl import threadpool_limits

from exudyn_flexlink.sweeps.executors import CannotStartError, Pool
from exudyn_flexlink.sweeps.plan import Point
from exudyn_flexlink.sweeps.rows import Row
from exudyn_flexlink.sweeps.work import Work

MOST = 61  # processes of a pool, which can have no more on Windows


NOT_BEGUN = (
    "a process ended before it could begin. A script that sweeps must do so below "
    "\"if __name__ == '__main__':\", since each process reads it again; or give 'workers=1'"
)


@contextmanager
def local_processes(count: int, work: Work) -> Iterator[Pool]:
    """Yield a pool of `count` processes of this machine, which end with it.

    Raises:
        CannotStartError: the work can't be sent to other processes, or they can't begin.

    """
    try:
        sent = pickle.dumps(work)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise CannotStartError(_not_sent(error)) from error
    count = min(count, MOST)
    context = get_context("spawn")  # a fork would share threads and locks of the engines
    pool = ProcessPoolExecutor(count, context, _begin, (sent,))

    def submit(point: Point) -> Future[Row]:
        with _starting():
            return pool.submit(_row, point)

    try:
        with _starting():
            first = pool.submit(int)
        yield Pool(submit, count, BrokenProcessPool)
        if isinstance(first.exception(), BrokenProcessPool):
            raise CannotStartError(NOT_BEGUN)
    finally:
        for process in [*(pool._processes or {}).values()]:
            process.terminate()  # what is under way is not wanted any more
        pool.shutdown(cancel_futures=True)


def _not_sent(error: Exception) -> str:
    return (
        f"what is observed can't be sent to other processes: {error}. Put the function into a "
        "module, at its top level, or give 'workers=1'"
    )


@contextmanager
def _starting() -> Iterator[None]:
    """Let a process that is started inside begin as it should.

    It never sees Ctrl-C, which ends the sweep as a whole, and does not read again what was no file,
    such as '<stdin>'.
    """
    main, masks = sys.modules["__main__"], hasattr(signal, "pthread_sigmask")  # not on Windows
    file = getattr(main, "__file__", None)
    absent = file is not None and not os.path.exists(file)
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if masks else set()
    if absent:
        del main.__file__
    try:
        yield
    finally:
        if absent:
            main.__file__ = file
        if masks:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


_sent: list[bytes] = []  # the work, in a process of the pool


def _begin(sent: bytes) -> None:
    """Begin a process of the pool."""
    _sent.append(sent)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    threadpool_limits(limits=1)


def _row(point: Point) -> Row:
    """Make the run of a point, in a process of the pool."""
    try:
        work: Work = pickle.loads(_sent[0])
    except Exception as error:  # what it names is not to be found from here
        raise CannotStartError(_not_sent(error)) from error
    return work.row(point)


def _end_with_parent() -> None:
    """End when the process that started this one does, however that ends."""
    parent = parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(1)
