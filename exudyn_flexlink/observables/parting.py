"""Distance of two runs, instant by instant: in judged points, and in forces.

Forces are less accurate than positions: if positions err by a vibration, forces err by that times
the square of its frequency. So forces have separate errors. Times are in s, lengths in m; N is the
number of instants.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import ceil, inf, isinf
from typing import Any

import numpy as np

from exudyn_flexlink.arrays import BoolArray, FloatArray, IndexArray
from exudyn_flexlink.mechanism import build_mechanism, end_of_run, sample_times
from exudyn_flexlink.observables.forces import NO_FORCE, WEAK_FORCE, forces_of
from exudyn_flexlink.observables.instants import straight_between
from exudyn_flexlink.observables.points import judged_points, paths, room, still_text
from exudyn_flexlink.observables.touching import touching, touching_pairs
from exudyn_flexlink.result import ForceDeviation, ForceSpread, MeasuredError, Result
from exudyn_flexlink.rounding import PLACE_ROUNDING, SUM_ROUNDING

ALIKE = 0.999  # of the largest distance: points within it are equal, and the first is named
VISIBLE = 1e-3  # of the box in which points move: runs that differ by more have parted
# A run's error bound over its distance from a run that is less accurate. Both may miss the same
# vibration, or graze the same wall, and be nearer to each other than the better one is to the
# truth. Of 87 hard runs, those of the first 29 scenes of `scripts/told_errors.py`, 84 are off by no
# more than this bound, the other three by up to 2.4 times the bound. Every run that is off by more
# than its tolerance warns; of 46 runs that keep their tolerance 27 warn, too.
FACTOR = 3.0
TIGHTER = 0.1  # of the tolerance or given step: for a run that shows errors common to both runs
# Part of the samples in touches that gives the error of a contact's force: those that differ least.
# The other samples lie where a force falls from loading to unloading in less than a step. There the
# error of the coarser run is a hundred times that of the finer one, elsewhere ten times. For the 40
# strikes of scripts/random_touches.py the median error bound is some ten times the true largest
# error, and no sample of the finer run has a larger error than its bound.
MOST_SAMPLES = 0.97


@dataclass(frozen=True)
class Deviation:
    """Distances (N,) m of two runs at instants (N,) s."""

    time: FloatArray
    distance: FloatArray

    @property
    def largest(self) -> float:
        """Largest distance, m."""
        return float(self.distance.max())

    @property
    def largest_at(self) -> float:
        """Instant (s) of the largest distance, the first one of several."""
        return float(self.time[int(self.distance.argmax())])

    @property
    def rms(self) -> float:
        """Root of the mean square of the distances, m."""
        return float(np.sqrt(np.mean(self.distance**2)))

    def until(self, time: float) -> Deviation:
        """Return the part before an instant (s)."""
        before = self.time < time
        return Deviation(self.time[before], self.distance[before])


def first_beyond(time: FloatArray, values: FloatArray, limit: float) -> float | None:
    """First of some instants (N,) s at which a value (N,) is above a limit, or is nan.

    For the distances of two runs of one engine at different settings it tells how long the motion
    is predictable. After it, differences at single instants say nothing about an engine.
    """
    beyond = np.flatnonzero(~(values <= limit))
    return float(time[beyond[0]]) if len(beyond) else None


def separation(
    first: Result, second: Result, time: FloatArray, points: Sequence[str] = ()
) -> FloatArray:
    """Largest distance (N,) m of some points, by default the judged ones, at instants (N,) s."""
    points = points or common_points(first, second)
    return np.asarray(separations(first, second, time, points).max(axis=1))


def separations(
    first: Result, second: Result, time: FloatArray, points: Sequence[str]
) -> FloatArray:
    """Distances (N, points) m of points in two runs at instants (N,) s."""
    first_places, second_places = (positions(result, points, time) for result in (first, second))
    return np.asarray(np.linalg.norm(first_places - second_places, axis=-1))


def farthest(points: Sequence[str], distances: FloatArray) -> str:
    """Name of the point with the largest distance (points,), the first one of equal points."""
    alike = distances >= ALIKE * distances.max()
    return points[int(alike.argmax())]


def common_points(first: Result, second: Result) -> tuple[str, ...]:
    """Names of the points by which both runs are judged."""
    other = judged_points(second.scene)
    return tuple(point for point in judged_points(first.scene) if point in other)


def parting_limit(result: Result) -> float:
    """Difference (m) that counts as parted: a part of the box in which judged points move."""
    return VISIBLE * room(result, judged_points(result.scene))


def common_times(first: Result, second: Result) -> FloatArray:
    """Even instants (N,) s of the first run's scene, up to the end of the shorter run.

    A run without a sample at an instant is interpolated: see `between_samples`.
    """
    scene = first.scene
    begin = float(max(first.time[0], second.time[0]))
    end = float(min(first.time[-1], second.time[-1]))
    if end <= begin:
        return np.array([begin])
    mechanism = build_mechanism(scene)
    grid = sample_times(scene, mechanism, end_of_run(scene, mechanism))
    kept = grid[(grid >= begin) & (grid < end * (1 - 1e-9))]
    return np.append(kept, end)


def positions(result: Result, points: Sequence[str], time: FloatArray) -> FloatArray:
    """Positions (N, points, 2) m at instants (N,) s, interpolated between samples."""
    return np.stack([seen.at(time) for seen in paths(result, points)], axis=1)


def force_deviations(
    first: Result, second: Result, until: float = inf, near: float = 0.0
) -> dict[str, ForceDeviation]:
    """How far forces of two runs are apart before `until` (s), by their names.

    They are compared at the instants of the first run's scene. An instant is left out if a pair
    touches in only one of the runs, or if an impulse is near. There a contact's force acts in one
    run and not yet in the other; the difference shows the time between the touches, not the error
    of a force. The force of a contact is compared touch by touch, see `_in_touches`; `near` (m) is
    the best accuracy of a place. Dry friction is left out where the two runs slip in different
    directions, or where one of them rests.
    """
    time = common_times(first, second)
    spacing = float(np.max(np.diff(time), initial=0.0))
    time = time[time < until]
    alike, in_touch = _touching(first, second, time)
    alike &= time > 0  # both begin with one state
    alike &= ~(_near_impulses(first, time, spacing) | _near_impulses(second, time, spacing))
    both = forces_of(first), forces_of(second)
    deviations = {}
    for name, force in both[0].items():
        if name not in both[1]:
            continue
        values = [forces[name].values for forces in both]
        if values[0].shape[1:] != values[1].shape[1:]:  # links with different numbers of rods
            values = [forces[name].size for forces in both]
        first_force, second_force = (
            straight_between(run.time, value, time)
            for run, value in zip((first, second), values, strict=True)
        )
        same = alike
        if first.stages:  # at some instants a joint may exist in only one run
            gone = np.isnan(first_force + second_force)
            same = alike & ~gone.any(axis=tuple(range(1, gone.ndim)))
        if force.quantity.startswith("friction"):
            ways = (_slip(run, force.name, time) for run in (first, second))
            same = same & np.equal(*ways)
        free, touched = (
            _spread(time[part], force.lengths, first_force[part], second_force[part])
            for part in (same & ~in_touch, same & in_touch)
        )
        instants = None
        if force.quantity.startswith("contact"):
            length = near if force.unit == "N" else 0.0  # a torque's approach is in rad/s
            touched, instants = _in_touches(first, second, force.name, until, length)
        deviations[name] = ForceDeviation(force.unit, free, touched, instants)
    return deviations


def _slip(result: Result, joint: str, time: FloatArray) -> FloatArray:
    """Sign of the friction in a slipping joint at instants (N,) s: 1 or -1; 0 at rest."""
    friction = result.frictions[joint]
    begun, ended = (np.searchsorted(edge, time, "right") for edge in (friction.begin, friction.end))
    way = np.sign(straight_between(result.time, friction.torque, time))
    return np.where(begun > ended, 0.0, way)


def _in_touches(
    first: Result, second: Result, name: str, until: float, near: float
) -> tuple[ForceSpread | None, float | None]:
    """How far a contact's touches in two runs differ before `until` (s): in force, and in time (s).

    Forces are compared at the samples of the second run, which has fewer. Each of its touches is
    aligned with the nearest touch of the first run: time counts from the begin of each touch, up to
    the end of the shorter one. Without alignment the difference would be mostly the shift of the
    begins, times a steep slope. The difference in time is the largest one of begins and ends; it is
    at least `near` (m) divided by the fastest approach.
    """
    both = [run.contacts[name].touches for run in (first, second)]
    touches = [list(intervals) for intervals in both]
    instants, parts, fastest = [0.0], [], 0.0
    for k, m in _matched(both[0].begin, both[1].begin):
        pair = touches[0][k], touches[1][m]
        begins = [touch.begin for touch in pair]
        ends = [touch.end for touch in pair]
        if max(begins) >= until or any(isinf(touch.peak_force) for touch in pair):
            continue
        fastest = max(fastest, pair[0].approach_speed)
        instants.append(abs(begins[0] - begins[1]))
        if max(ends) < until:
            instants.append(abs(ends[0] - ends[1]))
        after, first_force = _inside(first, name, begins[0], min(ends[0], until))
        time, second_force = _inside(second, name, begins[1], min(ends[1], until))
        if len(after) > 1:
            time = time[time <= after[-1]]
            between = _between(after, first_force)(time)
            parts.append((begins[0] + time, between, second_force[: len(time)]))
    if not parts:
        return None, None
    time, first_force, second_force = (
        np.concatenate(column) for column in zip(*parts, strict=True)
    )
    instants.append(near / fastest if fastest > 0 else 0.0)
    return _spread(time, np.abs, first_force, second_force, MOST_SAMPLES), max(instants)


def _between(time: FloatArray, values: FloatArray) -> Any:
    """Interpolate samples (n,) monotonically, without overshoot."""
    from scipy.interpolate import PchipInterpolator  # noqa: PLC0415 - who measures waits for SciPy

    return PchipInterpolator(time, values)


def _matched(first: FloatArray, second: FloatArray) -> Iterator[tuple[int, int]]:
    """Pairs of indices: instants (n,) and (m,), increasing, that are nearest to each other."""
    if len(first) and len(second):
        in_second, in_first = _nearest(second, first), _nearest(first, second)
        yield from ((k, m) for k, m in enumerate(in_second.tolist()) if in_first[m] == k)


def _nearest(instants: FloatArray, others: FloatArray) -> IndexArray:
    """For each of `others` (n,), index (n,) of the nearest of the increasing `instants` (m,)."""
    middles = 0.5 * (instants[1:] + instants[:-1])
    return np.searchsorted(middles, others)


def _inside(result: Result, name: str, begin: float, end: float) -> tuple[FloatArray, FloatArray]:
    """Samples of a touch: times (n,) since its begin, and forces.

    If the force jumps at the begin or the end, there are two samples; the one inside the touch
    counts. An event within the touch may have two samples that differ by rounding; the later one
    counts.
    """
    first, last = np.searchsorted(result.time, [begin, end])
    since, force = result.time[first:last] - begin, result.contacts[name].force[first:last]
    later = np.diff(since, append=inf) > 0
    return since[later], force[later]


def worst_force(deviations: Mapping[str, ForceDeviation]) -> tuple[str, float]:
    """Name of the force with the largest relative error, and this error over the largest force.

    Errors while nothing touches count. Errors in touches count only if something touches all the
    time, or if no force acts while nothing touches. Forces that are rounding, compared with the
    largest of their unit, are left out. If no force is left, the name is empty and the ratio 0.
    """
    acts = any(
        deviation.free and deviation.free.size > NO_FORCE for deviation in deviations.values()
    )
    parts = {
        n: deviation.free if acts and deviation.free else deviation.touching
        for n, deviation in deviations.items()
    }
    sizes: dict[str, float] = {}
    for name, part in parts.items():
        unit = deviations[name].unit
        sizes[unit] = max(sizes.get(unit, NO_FORCE), part.size if part else 0.0)
    relative = {
        name: part.relative
        for name, part in parts.items()
        if part and part.size > max(NO_FORCE, WEAK_FORCE * sizes[deviations[name].unit])
    }
    return max(relative.items(), key=lambda item: item[1], default=("", 0.0))


def _spread(
    time: FloatArray,
    lengths: Callable[[FloatArray], FloatArray],
    first: FloatArray,
    second: FloatArray,
    share: float = 1.0,
) -> ForceSpread | None:
    """How far forces (n,) or (n, k) are apart, in the `share` of samples that differ least.

    `lengths` returns sizes (n,) of forces.
    """
    if not len(time):
        return None
    apart = lengths(first - second)
    size = max(float(lengths(values).max()) for values in (first, second))
    count = ceil(share * len(apart))
    kept = np.argsort(apart)[:count]
    worst = int(kept[-1])
    rms = float(np.sqrt(np.mean(apart[kept] ** 2)))
    return ForceSpread(float(apart[worst]), float(time[worst]), rms, size)


def _touching(first: Result, second: Result, time: FloatArray) -> tuple[BoolArray, BoolArray]:
    """Whether the same pairs touch in both runs at instants (N,) s; whether anything touches.

    Only pairs that both runs have are compared.
    """
    both = touching_pairs(first, time), touching_pairs(second, time)
    same = [mask == both[1][pair] for pair, mask in both[0].items() if pair in both[1]]
    alike = np.all([np.ones(len(time), dtype=bool), *same], axis=0)
    return alike, touching(first, time) | touching(second, time)


def _near_impulses(result: Result, time: FloatArray, spacing: float) -> BoolArray:
    """Whether an impulse is within a spacing of instants (N,), s."""
    near = np.zeros(len(time), dtype=bool)
    for touches in result.intervals.values():
        hits = np.sort(touches.begin[np.isinf(touches.peak_force)])
        count = [np.searchsorted(hits, time + off) for off in (-spacing, spacing)]
        near |= count[1] > count[0]
    return near


def error_between(run: Result, other: Result, least: float, tolerance: float) -> MeasuredError:
    """Bound the error of `run`, in judged points and in forces, by comparison with another run.

    `least` (m) is the smaller tolerance of both: smaller errors are unknown. `tolerance` (m) is
    that of the other run. From the instant at which both have visibly parted, no error is known.
    """
    points = judged_points(run.scene)
    if max(room(result, points) for result in (run, other)) <= PLACE_ROUNDING:
        return MeasuredError(missing=still_text(points))
    asked = run.scene.accuracy.tolerance
    assert asked is not None  # runs with given steps are not measured
    time = common_times(run, other)
    distances = separations(run, other, time, points)
    distances = np.maximum.accumulate(np.where(np.isfinite(distances), distances, np.inf), axis=0)
    apart = distances.max(axis=1)
    error = np.maximum(FACTOR * apart, least)
    # If points hardly move, the limit of parting may be less than the tolerance.
    parted = max(parting_limit(run), asked)
    horizon = first_beyond(time, apart, parted)
    last = len(time) - 1 if horizon is None else max(int(np.searchsorted(time, horizon)) - 1, 0)
    until = inf if horizon is None else horizon
    forces = force_deviations(run, other, until, least / FACTOR)
    beyond = np.flatnonzero(~(error[: last + 1] <= asked))
    return MeasuredError(
        points=points,
        worst=farthest(points, distances[last]),
        limit=asked,
        largest=float(error[last]),
        exceeds_from=float(time[max(beyond[0] - 1, 0)]) if len(beyond) else horizon,
        horizon=horizon,
        stopped=None if other.outcome.completed else float(other.time[-1]),
        other=tolerance,
        forces={name: deviation.times(FACTOR, SUM_ROUNDING) for name, deviation in forces.items()},
    )
