"""How long a run can be trusted instant by instant, and what holds of it afterwards.

Two neighbouring runs, of one scene and engine but other tolerances or a slightly other start, part
exponentially where impacts are sensitive. Up to the horizon points are known instant by instant;
beyond it what both runs share is the statistics: how far S strays from its ideal path and how fast
it vibrates there, extremes, parts of the time in contact.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.comparison import Comparison, compare
from exudyn_flexlink.measured_error import MeasuredError
from exudyn_flexlink.observables import (
    STILL,
    Vibration,
    common_times,
    farthest,
    first_beyond,
    force_deviations,
    judged_points,
    parting_limit,
    room,
    separations,
    still_text,
    vibration,
)
from exudyn_flexlink.result import Result

# Errors of neighbours are as those of their steps, but for such a factor in what that tells of the
# run's error; `scripts/told_errors.py` measures what it is good for.
SCATTER = 1.5
# Likewise where touches of walls have multiplied errors: both runs may miss the same vibration, or
# graze the same wall, and be nearer to each other than to the truth. In the scenes of that script
# nine runs of ten are off by at most 0.6 of what is told with this factor, the worst by twice it.
TOUCHED_SCATTER = 2.5
ROUNDING = 1e-14  # of a force: none is known better, however well two runs agree
FIT_DECADES = 4  # below the limit: where the parting is fitted


@dataclass(frozen=True)
class Sensitivity:
    """Two neighbouring runs, `compared` up to the end of the shorter one.

    Its horizon is where a point differs by more than `limit` (m) first; where one run stopped
    before, its end; None if they never part. `growth` (1/s) is the rate of the exponential parting
    before it, None if there is nothing to fit; `room` (m) is 0 if no point moves, so that none
    tells anything.
    """

    compared: Comparison
    limit: float
    growth: float | None
    room: float

    @cached_property
    def vibrations(self) -> tuple[Vibration, Vibration]:
        """Vibrations of both runs, up to the end of the shorter one."""
        end = self.compared.time[-1]
        one, other = (vibration(seen.result, end=end) for seen in self.compared.both)
        return one, other


def sensitivity(first: Result, second: Result, limit: float | None = None) -> Sensitivity:
    """Compare neighbouring runs; `limit` (m) left out: see `parting_limit`."""
    limit = parting_limit(first) if limit is None else limit
    compared = compare(first, second, names=("this run", "the other"))
    time, apart = compared.time, compared.distances.max(axis=1)
    found = first_beyond(time, apart, limit)
    if found is None and not all(run.outcome.completed for run in (first, second)):
        found = float(time[-1])
    return Sensitivity(
        replace(compared, horizon=found),
        limit,
        growth_rate(time, apart, limit),
        max(room(run, compared.judged_by) for run in (first, second)),
    )


def measured_error(
    run: Result,
    neighbour: Result,
    factor: float,
    of_forces: float | None = None,
    scatter: float = SCATTER,
) -> MeasuredError:
    """Tell how far a run is off in the points that are judged, and in forces, from a neighbour.

    The neighbour's steps make errors `factor` times those of the run's steps, and so will it at
    the end, but for a factor `scatter`: the distance of both tells the error of either. Once they
    have parted visibly, the error is no less than the distance, and nothing is told of forces.
    `of_forces` is as `factor` for forces, where that is another.
    """
    points = judged_points(run.scene)
    if max(room(each, points) for each in (run, neighbour)) <= STILL:
        return MeasuredError(points, missing=still_text(points))
    time = common_times(run, neighbour)
    each = separations(run, neighbour, time, points)
    each = np.maximum.accumulate(np.where(np.isfinite(each), each, np.inf), axis=0)
    apart = each.max(axis=1)
    visible = parting_limit(run)
    most = scatter / abs(factor - 1) * apart
    until = first_beyond(time, apart, visible)
    share = scatter / abs((of_forces or factor) - 1)
    told = force_deviations(run, neighbour, np.inf if until is None else until)
    error = np.where(apart > visible, np.maximum(most, apart), most)
    limit = run.scene.accuracy.tolerance or visible
    return MeasuredError(
        points,
        farthest(points, each[-1]),
        limit,
        float(error[-1]),
        first_beyond(time, error, limit),
        None if neighbour.outcome.completed else float(neighbour.time[-1]),
        neighbour.settings,
        {name: own.times(share, ROUNDING) for name, own in told.items()},
        until,
    )


def growth_rate(time: FloatArray, apart: FloatArray, limit: float) -> float | None:
    """Rate (1/s) at which a separation (N,) m grows until it first exceeds the limit.

    A straight line through the logarithm of its running maximum over the last decades before; None
    if it does not grow by one decade there.
    """
    largest = np.maximum.accumulate(apart)
    inside = (largest > limit * 10.0**-FIT_DECADES) & (largest <= limit)
    if inside.sum() < 3 or largest[inside][-1] < 10 * largest[inside][0]:
        return None
    return float(np.polyfit(time[inside], np.log(largest[inside]), 1)[0])
