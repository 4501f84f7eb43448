"""Carries a sweep out: every point once, each row kept as soon as it is there.

This process makes the runs, or processes of this machine, or a cluster.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextlib import closing, suppress
from dataclasses import replace
from functools import partial
from multiprocessing import current_process

from exudyn_flexlink.loading import document_of_data
from exudyn_flexlink.sweeps.cluster import dask_cluster
from exudyn_flexlink.sweeps.executors import Executor, in_this_process, rows_of
from exudyn_flexlink.sweeps.plan import Sweep
from exudyn_flexlink.sweeps.processes import local_processes
from exudyn_flexlink.sweeps.rows import Observe, Row, Simulate
from exudyn_flexlink.sweeps.table import SweepTable, table_of
from exudyn_flexlink.sweeps.work import Keep, Work

Told = Callable[[Row, int], None]
"""Called with each row, and the number of rows that are there."""


def executor_of(workers: int | None = None, scheduler: str | None = None) -> Executor:
    """Return who makes the runs: `workers` processes, by default one for every core.

    One is this process itself; so are any in a worker of a pool, which may start none (daemonic
    processes have no children). With the address of Dask's `scheduler`, its workers are.

    Raises:
        ValueError: both are given, or less than one worker.

    """
    if scheduler is not None:
        if workers is not None:
            raise ValueError("a scheduler has its own workers: give one of both")
        return partial(dask_cluster, scheduler)
    cores = (
        os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else range(os.cpu_count() or 1)
    )
    count = len(cores) if workers is None else workers
    if count < 1:
        raise ValueError(f"needs at least one worker, got {count}")
    here = count == 1 or current_process().daemon
    return in_this_process if here else partial(local_processes, count)


def work_of(sweep: Sweep, simulate: Simulate, observe: Observe, keep: Keep | None = None) -> Work:
    """Return what the processes of a sweep do at each point; see `Work`."""
    data = document_of_data(sweep.scene.to_data(), "the scene")
    document = replace(data, folder=sweep.scene.document.folder)  # of files that are varied
    return Work(document, simulate, observe, keep, sweep.allow_outside)


def carried_out(
    sweep: Sweep,
    work: Work,
    executor: Executor,
    known: Mapping[str, Row],
    told: Told,
) -> SweepTable:
    """Make the runs of all points that have no row yet.

    `known` are rows of an earlier part of the sweep, by the id of their points. Ctrl-C ends the
    sweep: what is missing then stays missing.

    Raises:
        CannotStartError: no process can do the work.

    """
    rows = {point.id: known[point.id] for point in sweep.points if point.id in known}
    missing = [point for point in sweep.points if point.id not in rows]
    coming = rows_of(executor, work, missing)
    with suppress(KeyboardInterrupt), closing(coming):
        for row in coming:
            rows[row.id] = row
            told(row, len(rows))
    return table_of(sweep, rows)
