"""How long a run can be trusted instant by instant, and what holds of it afterwards.

Two neighbouring runs, of one scene and engine but other tolerances or a slightly other start, part
exponentially where impacts are sensitive. Up to the horizon points are known instant by instant;
beyond it what both runs share is the statistics: how far S strays from its ideal path and how fast
it vibrates there, extremes, parts of the time in contact.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.observables import (
    STILL,
    ContactTotals,
    Measure,
    common_points,
    common_times,
    contact_totals,
    farthest,
    force_deviations,
    horizon,
    joints_with_play,
    judged_points,
    lever_response,
    measures,
    parting_limit,
    perturbation,
    room,
    separations,
    spectrum,
    still_text,
    struck_bodies,
    watched_point,
)
from exudyn_flexlink.result import MeasuredError, Result

# Errors of neighbours are as those of their steps, but for such a factor in what that tells of the
# run's error; `scripts/told_errors.py` measures what it is good for.
SCATTER = 1.5
ROUNDING = 1e-14  # of a force: none is known better, however well two runs agree
FIT_DECADES = 4  # below the limit: where the parting is fitted


@dataclass(frozen=True)
class Perturbed:
    """How S strays from its ideal path: see `observables.perturbation`.

    `rms` and `peak` (2,) m, largest absolute value, of x and y; `lines` are the frequencies (Hz) at
    which each vibrates most, strongest first, told to +- half of `resolution` (Hz).
    """

    rms: FloatArray
    peak: FloatArray
    lines: tuple[tuple[float, ...], tuple[float, ...]]
    resolution: float


@dataclass(frozen=True)
class RunStatistics:
    """A run as a whole: what neighbouring runs must share.

    `perturbed` is None where no ideal path is known; `levers` are the least and greatest angle
    (rad) or displacement (m) of struck bodies; `contact` is by joint with clearance.
    """

    perturbed: Perturbed | None
    levers: dict[str, tuple[float, float]]
    contact: dict[str, ContactTotals]


@dataclass(frozen=True)
class Sensitivity:
    """Two neighbouring runs: `horizon` (s) is where a point differs by more than `limit` (m) first.

    Where one stopped before, its end; None if they never part. `growth` (1/s) is the rate of the
    exponential parting before it, None if there is nothing to fit; `largest` (m) is the largest
    difference of the `points` that are judged, that of the point `worst`; `answers` are those of
    struck bodies, of which `measures` tell what they are; `end` (s) is the end of both. `point` is
    the watched one, S; `room` (m) is 0 if no point moves, so that none tells anything.
    """

    point: str
    points: tuple[str, ...]
    worst: str
    room: float
    limit: float
    end: float
    horizon: float | None
    growth: float | None
    largest: float
    answers: dict[str, float]
    measures: dict[str, Measure]
    first: RunStatistics
    second: RunStatistics


def sensitivity(first: Result, second: Result, limit: float | None = None) -> Sensitivity:
    """Compare neighbouring runs; `limit` (m) left out: see `compare.parting_limit`."""
    limit = parting_limit(first) if limit is None else limit
    time = common_times(first, second)
    points = common_points(first, second)
    each = separations(first, second, time, points)
    found = horizon(first, second, limit)
    if found is None and not all(run.outcome.completed for run in (first, second)):
        found = float(time[-1])
    one, other = (run_statistics(run, float(time[-1])) for run in (first, second))
    return Sensitivity(
        watched_point(first.scene),
        points,
        farthest(points, each.max(axis=0)),
        max(room(run, points) for run in (first, second)),
        limit,
        float(time[-1]),
        found,
        growth_rate(time, each.max(axis=1), limit),
        float(each.max()),
        _answers_apart(first, second, time),
        measures(first.scene),
        one,
        other,
    )


def measured_error(
    run: Result, neighbour: Result, factor: float, of_forces: float | None = None
) -> MeasuredError:
    """Tell how far a run is off in the points that are judged, and in forces, from a neighbour.

    The neighbour's steps make errors `factor` times those of the run's steps, and so will it at
    the end, but for `SCATTER`: the distance of both tells the error of either. Once they have
    parted visibly, the error is no less than the distance, and nothing is told of forces.
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
    most = SCATTER / abs(factor - 1) * apart
    parted = np.flatnonzero(~(apart <= visible))
    until = float(time[parted[0]]) if len(parted) else None
    share = SCATTER / abs((of_forces or factor) - 1)
    told = force_deviations(run, neighbour, np.inf if until is None else until)
    error = np.where(apart > visible, np.maximum(most, apart), most)
    limit = run.scene.accuracy.tolerance or visible
    above = np.flatnonzero(error > limit)
    return MeasuredError(
        points,
        farthest(points, each[-1]),
        limit,
        float(error[-1]),
        float(time[above[0]]) if len(above) else None,
        None if neighbour.outcome.completed else float(neighbour.time[-1]),
        neighbour.settings,
        {name: own.times(share, ROUNDING) for name, own in told.items()},
        until,
    )


def _answers_apart(first: Result, second: Result, time: FloatArray) -> dict[str, float]:
    """Largest differences of the angles (rad) or displacements (m) of struck bodies."""
    apart, both = {}, struck_bodies(second.scene)
    for body, contact in struck_bodies(first.scene).items():
        if both.get(body) != contact:
            continue
        one, other = (lever_response(run, contact).value_at(time) for run in (first, second))
        apart[body] = float(np.abs(one - other).max())
    return apart


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


def run_statistics(result: Result, end: float = np.inf) -> RunStatistics:
    """Statistics of a run up to `end` (s)."""
    scene = result.scene
    past = np.nextafter(min(end, float(result.time[-1])), np.inf)
    levers = {
        body: lever_response(result, contact).between(-np.inf, past)
        for body, contact in struck_bodies(scene).items()
    }
    return RunStatistics(
        _perturbed(result, end),
        {body: (seen.least[0], seen.greatest[0]) for body, seen in levers.items()},
        {joint: contact_totals(result, joint, end=end) for joint in joints_with_play(result)},
    )


def _perturbed(result: Result, end: float) -> Perturbed | None:
    time = common_times(result, result)
    time = time[time <= end]
    off = perturbation(result, watched_point(result.scene), time)
    if off is None:
        return None
    x, y = (spectrum(time, column) for column in off.T)
    rms, peak = np.sqrt(np.mean(off**2, axis=0)), np.abs(off).max(axis=0)
    return Perturbed(rms, peak, (x.lines, y.lines), x.resolution)
