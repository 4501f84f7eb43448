"""Runs on the workers of a Dask cluster: the same work, several short runs in one task.

Each worker gets the work once, as a plugin, also one that joins later.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Generator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from importlib import import_module
from secrets import token_hex
from typing import Any

from exudyn_flexlink.sweeps.executors import CannotStartError, ended_row
from exudyn_flexlink.sweeps.plan import Point, versions
from exudyn_flexlink.sweeps.rows import Row
from exudyn_flexlink.sweeps.work import Work

BATCH = 1.0  # s of runs in one task: a thousand times what Dask takes for it
LARGEST_BATCH = 100
AHEAD = 2  # tasks for each worker: one it does, and the next
SECONDS_TO_CONNECT = 20
NEEDS = "this needs Dask: pip install 'exudyn-flexlink[cluster]'"


@dataclass(frozen=True)
class DaskCluster:
    """Runs points on the workers of a scheduler, given its address such as ``tcp://host:8786``."""

    address: str

    def rows(self, work: Work, points: Sequence[Point]) -> Generator[Row, None, None]:
        """Give a row for every point, as they are finished.

        A worker that ends costs the tasks it had, which Dask gives to others. Where Dask gives up a
        task, any point of any task that the worker had may be to blame: these points are tried once
        more when all others are done, each alone.

        Raises:
            CannotStartError: there is no such scheduler, no worker that fits, or no Dask.

        """
        distributed = _distributed()
        try:
            client = distributed.Client(self.address, timeout=SECONDS_TO_CONNECT)
        except (OSError, ValueError, TimeoutError) as error:
            raise CannotStartError(f"no scheduler answers at {self.address}: {error}") from error
        with client:
            _require_workers(client, self.address)
            name = f"flexlink-{token_hex(8)}"  # other programs sweep on this cluster, too
            client.register_plugin(_plugin(distributed)(work), name=name)
            try:
                yield from _Tasks(distributed, client, name, deque(points)).rows()
            finally:
                with suppress(Exception):  # the cluster may be gone
                    client.unregister_worker_plugin(name)


@dataclass
class _Tasks:
    """The tasks of a sweep, and how long its runs take."""

    distributed: Any
    client: Any
    name: str
    waiting: deque[Point]
    running: dict[Any, list[Point]] = field(default_factory=dict)
    suspects: deque[Point] = field(default_factory=deque)
    alone: bool = False  # whether all that runs is one suspect
    taken: float = 0.0  # s
    made: int = 0

    def rows(self) -> Generator[Row, None, None]:
        coming = self.distributed.as_completed([])
        try:
            self._fill(coming)
            for task in coming:
                points = self.running.pop(task)
                yield from self._rows_of(task, points)
                self._fill(coming)
        finally:
            self.client.cancel(list(self.running), force=True)

    def _rows_of(self, task: Any, points: list[Point]) -> Generator[Row, None, None]:
        if task.status == "finished":
            for row in task.result():
                self.taken += row.wall
                self.made += 1
                yield row
            return
        error = task.exception()
        if not isinstance(error, self.distributed.KilledWorker):
            raise CannotStartError(f"a worker can't do the work: {error}")
        if self.alone:
            yield from map(ended_row, points)
        else:
            self.suspects.extend(points)

    def _fill(self, coming: Any) -> None:
        """Give the workers tasks, as many as they should have."""
        most = AHEAD * max(1, len(self.client.nthreads()))
        while self.waiting and len(self.running) < most:
            count = min(self._batch(), len(self.waiting))
            self._submit([self.waiting.popleft() for _ in range(count)], coming)
        self.alone = not self.running and bool(self.suspects)
        if self.alone:
            self._submit([self.suspects.popleft()], coming)

    def _batch(self) -> int:
        """How many points fit into a task."""
        if not self.made:
            return 1
        return int(min(max(BATCH * self.made / max(self.taken, 1e-9), 1), LARGEST_BATCH))

    def _submit(self, points: list[Point], coming: Any) -> None:
        task = self.client.submit(_rows, self.name, points, pure=False)
        self.running[task] = points
        coming.add(task)


def _rows(name: str, points: Sequence[Point]) -> list[Row]:
    """Make the runs of some points, on a worker."""
    work: Work = _distributed().get_worker().plugins[name].work
    return [work.row(point) for point in points]


def _plugin(distributed: Any) -> Any:
    """Return the class of plugins that hold a work on a worker."""

    class Holder(distributed.WorkerPlugin):  # type: ignore[misc]
        def __init__(self, work: Work) -> None:
            self.work = work
            self.versions = versions()

        def setup(self, worker: Any) -> None:
            if versions() != self.versions:
                raise RuntimeError(f"worker {worker.address} has {versions()}")

    return Holder


def _require_workers(client: Any, address: str) -> None:
    """Look whether a cluster has workers that can run engines.

    Raises:
        CannotStartError: it has none, or one that runs several tasks in one process.

    """
    workers = client.nthreads()
    if not workers:
        raise CannotStartError(f"the scheduler at {address} has no workers; start 'dask worker'")
    many = [name for name, threads in workers.items() if threads != 1]
    if many:
        raise CannotStartError(
            f"the worker at {many[0]} has more than one thread, which the engines do not share; "
            "start workers with '--nworkers auto --nthreads 1'"
        )


def _distributed() -> Any:
    try:
        return import_module("distributed")
    except ImportError as error:
        raise CannotStartError(NEEDS) from error
