"""Carries a sweep out: every point once, each row kept as soon as it is there."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import closing, suppress
from dataclasses import replace

from exudyn_flexlink.loading import document_of_data
from exudyn_flexlink.sweeps.executors import Executor
from exudyn_flexlink.sweeps.plan import Sweep
from exudyn_flexlink.sweeps.rows import Observe, Row, Simulate
from exudyn_flexlink.sweeps.table import SweepTable, table_of
from exudyn_flexlink.sweeps.work import Keep, Work

Told = Callable[[Row, int], None]
"""Called with each row, and the number of rows that are there."""


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
    coming = executor.rows(work, missing)
    with suppress(KeyboardInterrupt), closing(coming):
        for row in coming:
            rows[row.id] = row
            told(row, len(rows))
    return table_of(sweep, rows)
