"""How a run is asked to end before its time: by whoever calls, never by signals taken here.

The command line gives means to ask (`stopped_by`), made of Ctrl-C. Else a run is made `aside`: in a
thread, while the main one waits. There Python raises KeyboardInterrupt, and never within a step.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from contextvars import ContextVar, copy_context
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from threading import Thread, current_thread, main_thread
from typing import Any

from exudyn_flexlink.raising import Sendable
from exudyn_flexlink.result import Result


class LateInterruptError(Sendable, KeyboardInterrupt):
    """The request came when a run was solved to its end, and only being put together: `result`."""

    def __init__(self, result: Result) -> None:
        super().__init__()
        self.result = result


@dataclass(frozen=True)
class Stopping:
    """Means to end a run: both are entered by the run itself.

    Inside `interrupts` the request calls a function, which ends the solve after the step under way;
    inside `deferrable_interrupts` and after that it is only taken note of: it is `pending`.
    """

    interrupts: Callable[[Callable[[], None]], AbstractContextManager[None]]
    deferrable_interrupts: Callable[[], AbstractContextManager[Any]]  # with `pending`, a bool


_given: ContextVar[Stopping | None] = ContextVar("stopping", default=None)


@contextmanager
def stopped_by(means: Stopping) -> Iterator[None]:
    """Give means to end the runs that are made inside."""
    token = _given.set(means)
    try:
        yield
    finally:
        _given.reset(token)


def interrupts(end: Callable[[], None]) -> AbstractContextManager[None]:
    """Let a request to end call `end`, where the caller gave means to ask."""
    means = _given.get()
    return nullcontext() if means is None else means.interrupts(end)


def deferrable_interrupts() -> AbstractContextManager[Any]:
    """Let a request to end be taken note of after the solve, where the caller gave means to ask."""
    means = _given.get()
    return nullcontext(_Request()) if means is None else means.deferrable_interrupts()


# --- from Python ------------------------------------------------------------------------------


LOOK = 0.1  # s: Windows tells a thread that waits of Ctrl-C only between two looks


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
        if self.pending:  # it came before the first step: there is nothing to keep
            raise KeyboardInterrupt
        try:
            yield
        finally:
            self._end = None


def aside(
    make: Callable[[Callable[[float], None] | None], Result],
    progress: Callable[[float], None] | None,
) -> Result:
    """Make a run in a thread of its own, and call `progress` from this one, at the end with 1.

    Ctrl-C, and whatever else is raised here meanwhile, ends the run after the step under way; what
    is no Ctrl-C is raised again. Where the caller gave other means, or in a thread, in which Python
    raises no KeyboardInterrupt, the run is made as it is.
    """
    if _given.get() is not None or current_thread() is not main_thread():
        return make(progress)
    request, made, told = _Request(), Future[Result](), SimpleQueue[float | None]()

    def work() -> None:
        try:
            with stopped_by(Stopping(request.interrupts, lambda: nullcontext(request))):
                made.set_result(make(told.put if progress is not None else None))
        except BaseException as error:
            made.set_exception(error)
        finally:
            told.put(None)

    try:
        Thread(target=copy_context().run, args=(work,), daemon=True).start()
        _follow(told, progress)
    except BaseException as error:
        request.ask()
        _follow(told)  # one more Ctrl-C does not wait
        if not isinstance(error, KeyboardInterrupt):
            raise
    return made.result()


def _follow(
    told: SimpleQueue[float | None], progress: Callable[[float], None] | None = None
) -> None:
    """Hand on what a thread tells, until it ends and tells None."""
    while True:
        with suppress(Empty):
            done = told.get(timeout=LOOK)
            if done is None:
                return
            if progress is not None:
                progress(done)
