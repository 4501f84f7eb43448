"""A sweep's table, and how it comes about: a row for every point, kept as soon as it is there."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import closing, suppress
from dataclasses import dataclass

from exudyn_flexlink.sweeps.executors import Executor, rows_of
from exudyn_flexlink.sweeps.plan import Sweep, Varied
from exudyn_flexlink.sweeps.rows import COLUMNS, Row, Scalar
from exudyn_flexlink.sweeps.values import Value
from exudyn_flexlink.sweeps.work import Work

Told = Callable[[Row, int], None]
"""Called with each row, and the number of rows that are there."""


@dataclass(frozen=True)
class SweepTable:
    """What a sweep has given: its rows in the order of their points, and the `values` of these.

    `points` is the number of points of the plan: more than there are rows, if the sweep was
    interrupted. Numbers are in SI.
    """

    title: str
    engine: str
    varied: tuple[Varied, ...]
    points: int
    rows: tuple[Row, ...]
    values: tuple[tuple[Value, ...], ...]

    @property
    def whole(self) -> bool:
        """Whether every point has its row."""
        return len(self.rows) == self.points

    @property
    def observables(self) -> tuple[str, ...]:
        """Names of all observables, in the order in which rows first tell them."""
        return tuple(dict.fromkeys(name for row in self.rows for name in row.numbers))

    def count(self, status: str) -> int:
        """How many rows are done, doubtful or failed."""
        return sum(row.status == status for row in self.rows)

    def columns(self) -> dict[str, list[Scalar]]:
        """Return all columns by name: the run, its values, how it ended, its observables.

        None stands for a number that there is not.
        """
        told: dict[str, list[Scalar]] = {
            column: [getattr(row, name) for row in self.rows] for column, name in COLUMNS.items()
        }
        first = {column: told.pop(column) for column in ("run", "id")}
        varied: dict[str, list[Scalar]] = {
            one.column: [values[i] for values in self.values] for i, one in enumerate(self.varied)
        }
        seen = {name: [row.numbers.get(name) for row in self.rows] for name in self.observables}
        return first | varied | told | seen


def table_of(
    title: str,
    engine: str,
    varied: Iterable[Varied],
    points: Iterable[tuple[str, Iterable[Value]]],
    rows: Mapping[str, Row],
) -> SweepTable:
    """Return the table of points, each an id and values; `rows` are by ids, and may not be all."""
    every = [(one, tuple(values)) for one, values in points]
    there = [(rows[one], values) for one, values in every if one in rows]
    return SweepTable(
        title,
        engine,
        tuple(varied),
        len(every),
        tuple(row for row, _ in there),
        tuple(values for _, values in there),
    )


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
    points = ((point.id, point.values) for point in sweep.points)
    return table_of(sweep.scene.title, sweep.engine, sweep.varied, points, rows)
