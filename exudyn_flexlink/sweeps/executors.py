"""Who makes the runs of a sweep: this process, or others; rows come as they are finished."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import Protocol

from exudyn_flexlink.sweeps.plan import Point
from exudyn_flexlink.sweeps.rows import FAILED, Row
from exudyn_flexlink.sweeps.work import Work


class CannotStartError(Exception):
    """No process of an executor can do the work at all; the text says why, and what to do."""


class Executor(Protocol):
    """Makes the runs of points."""

    def rows(self, work: Work, points: Sequence[Point]) -> Generator[Row, None, None]:
        """Give a row for every point, each once, in whatever order they are finished.

        Closing the iterator ends all runs.

        Raises:
            CannotStartError: it can't do the work.

        """
        ...


@dataclass(frozen=True)
class InThisProcess:
    """Makes one run after another, here."""

    def rows(self, work: Work, points: Sequence[Point]) -> Generator[Row, None, None]:
        """Give a row for every point, in order."""
        yield from map(work.row, points)


def ended_row(point: Point) -> Row:
    """Return the row of a point whose process ended each time that it was tried."""
    why = (
        "the process that ran it ended, as often as it was tried: killed, perhaps for want of "
        "memory, or a crash"
    )
    return Row(point.number, point.id, FAILED, why, 0, 0.0)
