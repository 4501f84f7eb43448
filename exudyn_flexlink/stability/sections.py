"""Poincare sections: a point once a lap, and how its places branch as a value is varied."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.observables import (
    crank_angle,
    first_passes,
    path,
    straight_between,
    watched_point,
)
from exudyn_flexlink.result import Result

COLUMNS = ("time_s", "x_m", "y_m", "vx_m_per_s", "vy_m_per_s")
"""What tables tell of each point of a section."""


@dataclass(frozen=True)
class Section:
    """The point once a lap: `time` (N,) s, `position` (N, 2) m and `velocity` (N, 2) m/s.

    `phase` is the crank angle (rad), or the part of a lap of its own length (0 to 1), at which it
    is looked at; `by_crank` tells which.
    """

    point: str
    phase: float
    by_crank: bool
    time: FloatArray
    position: FloatArray
    velocity: FloatArray

    def distinct(self, limit: float) -> int:
        """Number of places that are more than `limit` (m) apart from each other.

        Of a motion that repeats itself every n laps they are n, or less where it passes one place
        twice.
        """
        kept: list[FloatArray] = []
        for place in self.position:
            if all(np.linalg.norm(place - other) > limit for other in kept):
                kept.append(place)
        return len(kept)


def section_by_crank(
    result: Result, angle: float = 0.0, point: str | None = None, after: float = 0.0
) -> Section:
    """Look at a point whenever the crank passes an angle (rad), from `after` (s) on.

    The point is the watched one if left out.
    """
    turned = crank_angle(result)
    low, high = sorted((float(turned[0]), float(turned[-1])))
    wanted = angle + 2 * pi * np.arange(
        np.ceil((low - angle) / (2 * pi)), (high - angle) / (2 * pi) + 1e-12
    )
    times = np.sort(first_passes(result.time, turned, wanted))
    return _at(result, times[times >= after], angle, point, by_crank=True)


def section_by_time(result: Result, lap: float, phase: float = 0.0, after: float = 0.0) -> Section:
    """Look at the watched point once in every lap of its own length (s), from `after` (s) on.

    `phase` (0 to 1) is the part of a lap that is over. For what no crank drives, such as a force
    with a period.
    """
    clock = result.scene.initial.clock
    times = np.arange(phase, (float(result.time[-1]) + clock) / lap + 1e-12) * lap - clock
    return _at(result, times[(times >= after) & (times >= 0)], phase, None, by_crank=False)


def _at(
    result: Result, times: FloatArray, phase: float, point: str | None, *, by_crank: bool
) -> Section:
    seen = path(result, watched_point(result.scene) if point is None else point)
    speed = straight_between(seen.time, seen.velocity, times)
    return Section(seen.point, phase, by_crank, times, seen.at(times), speed)


def section_columns(section: Section) -> dict[str, FloatArray]:
    """Return a section as columns (N,) by name and unit, of a table with a row for each point."""
    columns = section.time, *section.position.T, *section.velocity.T
    return dict(zip(COLUMNS, columns, strict=True))


def section_row(section: Section) -> dict[str, float | int]:
    """Return a section as numbers by name, for one row of a table; units end the names."""
    found: dict[str, float | int] = {"section.points": len(section.time)}
    for name, column in section_columns(section).items():
        numbered = enumerate(column.tolist(), start=1)
        found |= {f"section.{number}.{name}": value for number, value in numbered}
    return found


def section_of_row(row: Mapping[str, Any], point: str, phase: float, *, by_crank: bool) -> Section:
    """Return the section that a row of a table tells; see `section_row`."""
    numbers = range(1, int(row["section.points"]) + 1)
    found = [[float(row[f"section.{number}.{name}"]) for name in COLUMNS] for number in numbers]
    time, x, y, vx, vy = np.array(found, dtype=float).reshape(-1, len(COLUMNS)).T
    place, speed = np.stack([x, y], axis=1), np.stack([vx, vy], axis=1)
    return Section(point, phase, by_crank, time, place, speed)


@dataclass(frozen=True)
class Branches:
    """Sections of runs of one scene in which one value is varied: a bifurcation diagram.

    `values` (K,) in SI and a section of each; `path` is that of the value in the model file.
    `failed` are values without a section, and `doubtful` those whose run warned, with the reason.
    """

    path: str
    values: FloatArray
    sections: Sequence[Section]
    failed: Mapping[float, str]
    doubtful: Mapping[float, str]

    @property
    def points(self) -> tuple[FloatArray, FloatArray]:
        """Value (P,) and place (P, 2) m of every point of the diagram."""
        counts = [len(own.time) for own in self.sections]
        places = [own.position for own in self.sections]
        return np.repeat(self.values, counts), np.concatenate([np.zeros((0, 2)), *places])
