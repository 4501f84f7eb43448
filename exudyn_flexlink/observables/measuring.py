"""How far a run is off, by its distance from another one of the same scene and engine."""

from __future__ import annotations

from math import inf

import numpy as np

from exudyn_flexlink.measured_error import MeasuredError
from exudyn_flexlink.observables.forces import force_deviations
from exudyn_flexlink.observables.parting import (
    STILL,
    common_times,
    farthest,
    first_beyond,
    parting_limit,
    separations,
)
from exudyn_flexlink.observables.points import judged_points, room, still_text
from exudyn_flexlink.result import Result

# What is told of a run over its distance from one that is less accurate. Both may miss the same
# vibration, or graze the same wall, and be nearer to each other than the better one is to the
# truth. Of 87 hard runs, those of the first 29 scenes of `scripts/told_errors.py`, 84 are off by no
# more than is told with this factor, the other three by up to 2.4 times that; none that is off by
# more than its tolerance is silent. Of 46 that keep it 27 warn.
FACTOR = 3.0
ROUNDING = 1e-14  # of a force: none is known better, however well two runs agree


def error_between(run: Result, other: Result, least: float, tolerance: float) -> MeasuredError:
    """Tell how far `run` is off, in the points that are judged and in forces, by another run.

    `least` (m) is the smaller tolerance of both, below which nothing is told; `tolerance` (m) is
    that of the other one. Once both have parted visibly nothing is told.
    """
    points = judged_points(run.scene)
    if max(room(each, points) for each in (run, other)) <= STILL:
        return MeasuredError(missing=still_text(points))
    asked = run.scene.accuracy.tolerance
    assert asked is not None  # runs of given steps are not measured
    time = common_times(run, other)
    each = separations(run, other, time, points)
    each = np.maximum.accumulate(np.where(np.isfinite(each), each, np.inf), axis=0)
    apart = each.max(axis=1)
    error = np.maximum(FACTOR * apart, least)
    horizon = first_beyond(time, apart, parting_limit(run))
    last = len(time) - 1 if horizon is None else max(int(np.searchsorted(time, horizon)) - 1, 0)
    forces = force_deviations(run, other, inf if horizon is None else horizon)
    exceeds = first_beyond(time[: last + 1], error[: last + 1], asked)
    return MeasuredError(
        points=points,
        worst=farthest(points, each[last]),
        limit=asked,
        largest=float(error[last]),
        exceeds_from=horizon if exceeds is None else exceeds,
        horizon=horizon,
        stopped=None if other.outcome.completed else float(other.time[-1]),
        other=tolerance,
        forces={name: own.times(FACTOR, ROUNDING) for name, own in forces.items()},
    )
