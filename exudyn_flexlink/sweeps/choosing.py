"""Which executor makes the runs: this process, processes of this machine, or a cluster."""

from __future__ import annotations

import os

from exudyn_flexlink.sweeps.cluster import DaskCluster
from exudyn_flexlink.sweeps.executors import Executor, InThisProcess
from exudyn_flexlink.sweeps.processes import LocalProcesses


def executor_of(workers: int | None = None, scheduler: str | None = None) -> Executor:
    """Return who makes the runs: `workers` processes, by default one for every core.

    One is this process itself. With the address of Dask's `scheduler`, its workers are.

    Raises:
        ValueError: both are given, or less than one worker.

    """
    if scheduler is not None:
        if workers is not None:
            raise ValueError("a scheduler has its own workers: give one of both")
        return DaskCluster(scheduler)
    count = cores() if workers is None else workers
    if count < 1:
        raise ValueError(f"needs at least one worker, got {count}")
    return InThisProcess() if count == 1 else LocalProcesses(count)


def cores() -> int:
    """How many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
