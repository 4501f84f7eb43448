"""The table of a sweep: one row for every point, in their order."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from exudyn_flexlink.sweeps.plan import Sweep, Varied
from exudyn_flexlink.sweeps.rows import COLUMNS, Row, Scalar
from exudyn_flexlink.sweeps.values import Value


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


def table_of(sweep: Sweep, rows: Mapping[str, Row]) -> SweepTable:
    """Return the table of a sweep; `rows` are by the id of their points, and may not be all."""
    there = [point for point in sweep.points if point.id in rows]
    return SweepTable(
        sweep.scene.title,
        sweep.engine,
        sweep.varied,
        len(sweep),
        tuple(rows[point.id] for point in there),
        tuple(point.values for point in there),
    )
