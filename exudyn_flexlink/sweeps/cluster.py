"""Runs on the workers of a Dask cluster."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from importlib import import_module
from typing import Any

from exudyn_flexlink.sweeps.executors import CannotStartError, Pool
from exudyn_flexlink.sweeps.plan import Point, versions
from exudyn_flexlink.sweeps.rows import Row
from exudyn_flexlink.sweeps.work import Work

AHEAD = 2  # tasks for each worker: one it does, and the next
SECONDS_TO_CONNECT = 20
NEEDS = "this needs Dask: pip install 'exudyn-flexlink[cluster]'"


@contextmanager
def dask_cluster(address: str, work: Work) -> Iterator[Pool]:
    """Yield a pool of the workers of a scheduler at an address such as ``tcp://host:8786``.

    What was not begun is cancelled with the pool. Dask gives the tasks of a worker that ends to
    others, and gives them up after some times.

    Raises:
        CannotStartError: there is no such scheduler, no worker that fits, or no Dask.

    """
    try:
        distributed = import_module("distributed")
    except ImportError as error:
        raise CannotStartError(NEEDS) from error
    try:
        client = distributed.Client(address, timeout=SECONDS_TO_CONNECT)
    except (OSError, ValueError, TimeoutError) as error:
        raise CannotStartError(f"no scheduler answers at {address}: {error}") from error
    with client:
        _require_workers(client, address)
        pool, needed = client.get_executor(pure=False), versions()
        most = AHEAD * len(client.nthreads())
        try:
            yield Pool(partial(pool.submit, _row, work, needed), most, distributed.KilledWorker)
        finally:
            pool.shutdown(wait=False)


def _row(work: Work, needed: Mapping[str, str], point: Point) -> Row:
    """Make the run of a point, on a worker, which may have come after the others.

    Raises:
        RuntimeError: the worker has other versions of the packages on which numbers depend.

    """
    if versions() != needed:
        raise RuntimeError(f"this worker has {versions()}")
    return work.row(point)


def _require_workers(client: Any, address: str) -> None:
    """Look whether a cluster has workers that can run engines.

    Raises:
        CannotStartError: it has none, or one that runs several tasks in one process.

    """
    with suppress(TimeoutError):  # one that ended may be on its way back
        client.wait_for_workers(1, timeout=SECONDS_TO_CONNECT)
    workers = client.nthreads()
    if not workers:
        raise CannotStartError(f"the scheduler at {address} has no workers; start 'dask worker'")
    many = [name for name, threads in workers.items() if threads != 1]
    if many:
        raise CannotStartError(
            f"the worker at {many[0]} has more than one thread, which the engines do not share; "
            "start workers with '--nworkers auto --nthreads 1'"
        )
