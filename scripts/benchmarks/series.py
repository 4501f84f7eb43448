"""Reference series of the paper's mechanism, in `tests/data`, and how far a run is from one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.observables import (
    ANGLE,
    Deviation,
    lever_response,
    path,
    struck_bodies,
    watched_point,
)
from exudyn_flexlink.result import Result

SAME_INSTANT = 1e-9  # s


@dataclass(frozen=True)
class Series:
    """Positions (N, 2) m of one point and the struck body's angle (N,) rad at instants (N,) s."""

    time: FloatArray
    position: FloatArray
    lever_angle: FloatArray


def read_series(file: Path) -> Series:
    """Read a CSV with the columns ``t_s,S_x_m,S_y_m,lever_angle_rad`` after comments (``#``)."""
    lines = file.read_text(encoding="utf-8").splitlines()
    rows = [line for line in lines if not line.startswith("#")]
    table = np.loadtxt(rows[1:], delimiter=",")
    return Series(table[:, 0], table[:, 1:3], table[:, 3])


@dataclass(frozen=True)
class FromSeries(Deviation):
    """How far a run is from a series, also in the struck body's angle (N,) rad."""

    lever_angle: FloatArray

    @property
    def largest_angle(self) -> float:
        """Largest difference of that angle, rad."""
        return float(np.abs(self.lever_angle).max(initial=0.0))


def deviation(
    result: Result, time: FloatArray, position: FloatArray, lever_angle: FloatArray
) -> FromSeries:
    """Compare the watched point and the lever with values at instants the run has sampled.

    `time` (N,) s, `position` (N, 2) m, `lever_angle` (N,) rad; instants after the run's end are
    left out.

    Raises:
        ValueError: the run has no sample at one of the instants.

    """
    kept = time <= result.time[-1] + SAME_INSTANT
    time, position, lever_angle = time[kept], position[kept], lever_angle[kept]
    index = np.searchsorted(result.time, time - SAME_INSTANT)
    missing = np.abs(result.time[index] - time) > SAME_INSTANT
    if missing.any():
        raise ValueError(
            f"the run has no sample at t = {time[missing][0]:.9g} s: set 'run: sample' to match"
        )
    seen = path(result, watched_point(result.scene)).position[index]
    responses = (lever_response(result, own) for own in struck_bodies(result.scene).values())
    lever = next((own for own in responses if own.measure is ANGLE), None)
    angle = lever_angle if lever is None else lever.value[index]
    return FromSeries(time, np.linalg.norm(seen - position, axis=1), angle - lever_angle)
