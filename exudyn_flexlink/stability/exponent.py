"""The largest Lyapunov exponent, by neighbours that are renormalised: any flow, any engine.

A neighbour starts at a small distance. After each stretch of time the logarithm of the growth of
the distance is kept, and the neighbour is moved back to the first distance, in its present
direction: G. Benettin, L. Galgani and J.-M. Strelcyn, Kolmogorov entropy and numerical experiments,
Physical Review A 14 (1976) 2338. The mean rate of growth tends to the largest exponent. In a system
driven by time, neighbours do not differ in time.

Laps and their durations, and the distance of a point from its place some laps before: does a motion
repeat itself?

Poincare sections: a point once a lap, and the branches of its places if a value is varied.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import inf, lcm, log, pi, sqrt
from typing import Any

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.observables import (
    crank_angle,
    first_passes,
    path,
    steady_speeds,
    straight_between,
    watched_point,
)
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import LapsSpec, Scene, SlotJoint

PHASES = 256  # phases of a lap at which laps are compared
MOST = 8  # laps: a motion with a longer period counts as not repeating itself
ALIKE = 3.0  # times the run's error: limit of the difference of equal laps
FALLS = 0.9  # ratio of successive distances of laps that settle to a period
LEAST_FALLS = 2  # such ratios in a row


class NoRhythmError(ValueError):
    """The scene does not determine the duration of a lap; the text says what to give."""


class ImpossibleLapsError(ValueError):
    """Laps so short, so long or so many that they can't be run; the text says which."""


@dataclass(frozen=True)
class Rhythm:
    """The duration of a `lap` (s), and the number of `laps` after which the drives repeat."""

    lap: float
    laps: int = 1

    @property
    def cycle(self) -> float:
        """Period (s) of the drives."""
        return self.laps * self.lap


def rhythm_of(scene: Scene, lap: float | None = None) -> Rhythm:
    """Return the rhythm of the first joint with a constant speed, or of a given `lap` (s).

    Curves with laps determine the number of laps of a cycle.
    """
    turned = list(steady_speeds(scene).values())
    if lap is None and not turned:
        raise NoRhythmError(
            "no drive turns a joint at one speed, so that nothing tells what a lap is: say how "
            "long it takes, such as the period of a force"
        )
    return Rhythm(2 * pi / abs(turned[0]) if lap is None else lap, laps_of_cycle(scene))


def laps_of_cycle(scene: Scene) -> int:
    """Number of laps of a period of the mechanism, by curves with laps."""
    slots = (joint for joint in scene.joints.values() if isinstance(joint, SlotJoint))
    curves = [scene.curves[slot.curve] for slot in slots]
    return lcm(*(len(curve.curves) for curve in curves if isinstance(curve, LapsSpec)))


@dataclass(frozen=True)
class LapDistances:
    """Distances of a `point` from its places `before` laps earlier, for each lap.

    `laps` (N,) number whole laps from 1, `end` (N,), s, are their ends, `before` (M,) the shifts,
    and `largest` (M, N), m, the largest distances at the same phases; nan without an earlier lap.
    """

    point: str
    laps: IndexArray
    end: FloatArray
    before: IndexArray
    largest: FloatArray


@dataclass(frozen=True)
class Repeating:
    """Whether a motion repeats itself, by laps that are known up to `until` (s).

    `laps` is the number of laps of the period, within the run's `error` (m); None without a period.
    If the motion still settles to a period of `nearest` laps, `settles` is the factor by which the
    distance falls from one period to the next, else None. `least` (m) is the smallest distance of
    the last laps from earlier ones: those `nearest` laps before.
    """

    laps: int | None
    settles: float | None
    least: float
    nearest: int
    error: float
    until: float

    @property
    def behaviour(self) -> str:
        """The behaviour in words."""
        if self.laps is not None:
            return f"repeats itself every {_count(self.laps)}"
        if self.settles is not None:
            return f"settles to a period of {_count(self.nearest)}"
        return f"does not repeat itself within {_count(MOST)}"


def lap_distances(
    result: Result, lap: float, point: str | None = None, after: float = 0.0
) -> LapDistances:
    """Compare each whole lap of `lap` (s), from `after` (s) on, with up to `MOST` laps before.

    With a crank of constant speed, phases are crank angles. The point is the watched one by
    default. Between samples it is interpolated, perhaps differently from lap to lap; a lap of a
    multiple of `PHASES` samples needs no interpolation.
    """
    seen = path(result, watched_point(result.scene) if point is None else point)
    count = max(0, int((float(seen.time[-1]) - after) / lap * (1 + 1e-9)))
    phases = np.arange(PHASES) / PHASES
    times = after + lap * (np.arange(count)[:, None] + phases)
    places = seen.at(times.ravel()).reshape(count, PHASES, 2)
    before = np.arange(1, min(MOST, max(count - 1, 0)) + 1)
    largest = np.full((len(before), count), np.nan)
    for row, shift in enumerate(before.tolist()):
        away = np.linalg.norm(places[shift:] - places[:-shift], axis=-1)
        largest[row, shift:] = away.max(axis=-1)
    numbers = np.arange(1, count + 1)
    return LapDistances(
        seen.point, numbers, np.asarray(after + lap * numbers, float), before, largest
    )


def repeating(laps: LapDistances, error: float, until: float = inf) -> Repeating | None:
    """Compare laps that end before `until` (s) with the error (m) of the run; None if too few."""
    known = laps.end <= until * (1 + 1e-9)
    rows = {
        int(shift): row[known & np.isfinite(row)]
        for shift, row in zip(laps.before, laps.largest, strict=True)
    }
    rows = {shift: row for shift, row in rows.items() if len(row) >= shift}
    if not rows:
        return None
    last = {shift: float(row[-shift:].max()) for shift, row in rows.items()}
    end = float(laps.end[known][-1])
    alike = [shift for shift, away in last.items() if away <= ALIKE * error]
    if alike:
        return Repeating(alike[0], None, last[alike[0]], alike[0], error, end)
    for shift, row in rows.items():
        rate = _settling(row, shift)
        if rate is not None:
            return Repeating(None, rate, last[shift], shift, error, end)
    nearest = min(last, key=lambda shift: last[shift])
    return Repeating(None, None, last[nearest], nearest, error, end)


def _settling(row: FloatArray, shift: int) -> float | None:
    """Factor by which distances fall from one block of `shift` laps to the next, if they fall.

    They must fall in each of the last `LEAST_FALLS` steps.
    """
    count = len(row) // shift
    if count < LEAST_FALLS + 1:
        return None
    blocks = row[len(row) - count * shift :].reshape(count, shift).max(axis=1)
    falls = blocks[-LEAST_FALLS:] / blocks[-LEAST_FALLS - 1 : -1]
    return float(falls.prod() ** (1 / LEAST_FALLS)) if falls.max() < FALLS else None


def _count(laps: int) -> str:
    return "lap" if laps == 1 else f"{laps} laps"


COLUMNS = ("time_s", "x_m", "y_m", "vx_m_per_s", "vy_m_per_s")
"""Columns of tables with a point of a section in each row."""


@dataclass(frozen=True)
class Section:
    """A point once a lap: `time` (N,), s, `position` (N, 2), m, and `velocity` (N, 2), m/s.

    `phase` is the crank angle (rad), if `by_crank`, else the part of a lap (0 to 1).
    """

    point: str
    phase: float
    by_crank: bool
    time: FloatArray
    position: FloatArray
    velocity: FloatArray

    def distinct(self, limit: float) -> int:
        """Number of places that are more than `limit` (m) apart from each other.

        For a motion with a period of n laps the number is n, or less if it passes a place twice.
        """
        kept: list[FloatArray] = []
        for place in self.position:
            if all(np.linalg.norm(place - other) > limit for other in kept):
                kept.append(place)
        return len(kept)


def section_by_crank(
    result: Result, angle: float = 0.0, point: str | None = None, after: float = 0.0
) -> Section:
    """Section of a point whenever the crank passes an angle (rad), from `after` (s) on.

    The point is the watched one by default.
    """
    turned = crank_angle(result)
    low, high = sorted((float(turned[0]), float(turned[-1])))
    wanted = angle + 2 * pi * np.arange(
        np.ceil((low - angle) / (2 * pi)), (high - angle) / (2 * pi) + 1e-12
    )
    times = np.sort(first_passes(result.time, turned, wanted))
    return _at(result, times[times >= after], angle, point, by_crank=True)


def section_by_time(result: Result, lap: float, phase: float = 0.0, after: float = 0.0) -> Section:
    """Section of the watched point once in every `lap` (s), from `after` (s) on.

    `phase` (0 to 1) is the part of a lap that has passed. This is for mechanisms without a crank,
    for example with a periodic force.
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
    columns: dict[str, float | int] = {"section.points": len(section.time)}
    for name, column in section_columns(section).items():
        numbered = enumerate(column.tolist(), start=1)
        columns |= {f"section.{number}.{name}": value for number, value in numbered}
    return columns


def section_of_row(row: Mapping[str, Any], point: str, phase: float, *, by_crank: bool) -> Section:
    """Return the section in a row of a table; see `section_row`."""
    numbers = range(1, int(row["section.points"]) + 1)
    rows = [[float(row[f"section.{number}.{name}"]) for name in COLUMNS] for number in numbers]
    time, x, y, vx, vy = np.array(rows, dtype=float).reshape(-1, len(COLUMNS)).T
    place, speed = np.stack([x, y], axis=1), np.stack([vx, vy], axis=1)
    return Section(point, phase, by_crank, time, place, speed)


@dataclass(frozen=True)
class Branches:
    """Sections of runs of a scene with one varied value: a bifurcation diagram.

    `values` (K,), in SI units, have a section each; `path` is the path of the value in the model
    file. `failed` are values without a section, and `doubtful` are values of runs with warnings,
    both with reasons.
    """

    path: str
    values: FloatArray
    sections: Sequence[Section]
    failed: Mapping[float, str]
    doubtful: Mapping[float, str]

    @property
    def points(self) -> tuple[FloatArray, FloatArray]:
        """Value (P,) and place (P, 2) m of every point of the diagram."""
        counts = [len(section.time) for section in self.sections]
        places = [section.position for section in self.sections]
        return np.repeat(self.values, counts), np.concatenate([np.zeros((0, 2)), *places])


Flow = Callable[[FloatArray, float, float], FloatArray]
"""State (n,) at a time, from a state (n,) at an earlier time (s)."""

SETTLE = 0.25  # of the time, for neighbours to reach the direction of largest growth
FEWEST = 4  # batches: with fewer their scatter is hardly known
SURE = 0.95  # probability that the exponent is within its uncertainty
MOST_CORRELATED = 0.95  # largest correlation of successive batches that is used


class TooShortError(ValueError):
    """The time is too short to measure an exponent and its uncertainty."""


@dataclass(frozen=True)
class Trajectory:
    """States (K + 1, n) of a motion at instants (K + 1,), s, the ends of stretches."""

    times: FloatArray
    states: FloatArray


@dataclass(frozen=True)
class Exponent:
    """The largest Lyapunov exponent `value` (1/s), 95 % sure to `uncertainty` (1/s).

    `times` (K + 1,), s, are the ends of stretches, and `rates` (K,), 1/s, the growth in each; the
    first `settled` stretches do not count. `means` (batches,), 1/s, are those of batches of
    stretches; the uncertainty follows from their scatter. `distance` is the first distance of
    neighbours, in the unit of the scales. `noise` (1/s) is the possible effect of the solver's
    error on the value: the error of each stretch over the distance of neighbours at its end. The
    uncertainty is that of the mean over other stretches of the same motion. It assumes that the
    motion is typical, and that neighbours at this distance behave as infinitely near ones.
    """

    value: float
    uncertainty: float
    times: FloatArray
    rates: FloatArray
    settled: int
    means: FloatArray
    distance: float
    noise: float

    @property
    def sign(self) -> int:
        """1 if neighbours part, -1 if they approach, 0 if it is uncertain."""
        sure = self.uncertainty + self.noise
        return 0 if abs(self.value) <= sure else (1 if self.value > 0 else -1)

    @property
    def by_solver(self) -> bool:
        """Whether the solver's error is larger than the scatter, so that the tolerance matters."""
        return self.noise > self.uncertainty

    @property
    def running(self) -> FloatArray:
        """Mean rates (K - settled,), 1/s, of the stretches that count, up to the end of each."""
        spans = np.diff(self.times)[self.settled :]
        return np.asarray(np.cumsum(spans * self.rates[self.settled :]) / np.cumsum(spans))

    def horizon(self, error: float, limit: float) -> float:
        """Mean time (s) in which an error grows to a limit; inf if neighbours approach.

        After it a motion is not known at single instants, whatever the solver.
        """
        if self.value <= 0 or error >= limit:
            return inf if error < limit else 0.0
        return log(limit / error) / self.value


def trajectory(flow: Flow, start: FloatArray, times: FloatArray) -> Trajectory:
    """Follow a flow from a state (n,) through instants (K + 1,) s."""
    states = [np.asarray(start, dtype=float)]
    for begin, end in zip(times[:-1].tolist(), times[1:].tolist(), strict=True):
        states.append(flow(states[-1], begin, end))
    return Trajectory(np.asarray(times, dtype=float), np.array(states))


@dataclass(frozen=True)
class Neighbours:
    """How neighbours are made, and how far they are apart.

    They are put back to `distance`, which is Euclidean in states divided by `scales` (n,), ones if
    None. The first is in a random direction. The uncertainty is told by means over a time
    `batch` (s), whole periods of what is periodic; see `half_width`.
    """

    distance: float
    batch: float
    scales: FloatArray | None = None


def largest_exponent(
    flow: Flow,
    motion: Trajectory,
    neighbours: Neighbours,
    progress: Callable[[float], None] | None = None,
) -> Exponent:
    """Measure the largest exponent along a motion.

    Every stretch is made twice: by the neighbour, and from the motion itself, so that the errors of
    restarts do not look like growth, and are measured.

    Raises:
        TooShortError: there are fewer than `FEWEST` batches, or a stretch is so long that nothing
            is left of the neighbours' distance.

    """
    count = len(motion.times) - 1
    settled, edges = batches(motion.times, neighbours.batch)
    distance, scales = neighbours.distance, neighbours.scales
    unit = np.ones(motion.states.shape[1]) if scales is None else scales
    # Any direction does; the same one in each study, so that its numbers can be found again.
    way = np.random.default_rng(0).standard_normal(len(unit))
    near = motion.states[0] + distance * unit * way / np.linalg.norm(way)
    rates, errors = np.zeros(count), np.zeros(count)
    for k in range(count):
        begin, end = float(motion.times[k]), float(motion.times[k + 1])
        before = float(np.linalg.norm((near - motion.states[k]) / unit))
        base = flow(motion.states[k], begin, end)
        apart = (flow(near, begin, end) - base) / unit
        away = float(np.linalg.norm(apart))
        if not 0 < away < inf:
            raise TooShortError(f"a stretch of {end - begin:.3g} s wipes neighbours' distance out")
        rates[k] = log(away / before) / (end - begin)
        missed = float(np.linalg.norm((base - motion.states[k + 1]) / unit))
        errors[k] = missed / away / (end - begin)
        near = motion.states[k + 1] + distance * unit * apart / away
        if progress is not None:
            progress((k + 1) / count)
    spans = np.diff(motion.times)
    value, noise = (
        float(spans[settled:] @ x[settled:] / spans[settled:].sum()) for x in (rates, errors)
    )
    grown = np.append(0.0, np.cumsum(spans * rates))
    means = np.diff(grown[edges]) / np.diff(motion.times[edges])
    return Exponent(value, half_width(means), motion.times, rates, settled, means, distance, noise)


def batches(times: FloatArray, batch: float) -> tuple[int, IndexArray]:
    """First stretch that counts, and the instants (batches + 1,) between which batches lie.

    The last end of batches is that of the times; from there they are counted back, so that what
    is left over belongs to what does not count. Each is a multiple of `batch` (s).
    """
    whole = float(times[-1] - times[0])
    count = int((1 - SETTLE) * whole / batch * (1 + 1e-9))
    if count < FEWEST:
        raise TooShortError(
            f"{whole:.4g} s tell no exponent with its uncertainty: it needs {FEWEST} batches of "
            f"{batch:.4g} s, and a third of that before, {FEWEST * batch / (1 - SETTLE):.4g} s"
        )
    longer = max(1, count // (2 * FEWEST))
    wanted = times[-1] - longer * batch * np.arange(count // longer, -1, -1)
    edges = np.abs(times[:, None] - wanted).argmin(axis=0)
    return int(edges[0]), edges


def half_width(means: FloatArray) -> float:
    """Half width of the interval that holds the mean of batches with probability `SURE`.

    Successive batches may still correlate, with a coefficient r. Its estimate from n means, taken
    about their mean, is too small by (1 + 4 r)/n: F. H. C. Marriott and J. A.
    Pope, Bias in the estimation of autocorrelations, Biometrika 41 (1954) 390. If it falls as r^k
    over k batches, n batches are worth n (1 - r)/(1 + r) independent ones.

    With eight batches the interval contains the mean in 97 % of the cases if r = 0, and in 87 % if
    r = 0.6, since so few batches do not give r well.
    """
    from scipy.special import stdtrit  # noqa: PLC0415 - takes a second, which `check` saves

    count = len(means)
    off = means - means.mean()
    whole = float(off @ off)
    if whole == 0:
        return 0.0
    share = float(off[1:] @ off[:-1]) / whole
    correlation = min(max(share + (1 + 4 * share) / count, 0.0), MOST_CORRELATED)
    independent = max(count * (1 - correlation) / (1 + correlation), 2.0)
    student = float(stdtrit(independent - 1, (1 + SURE) / 2))
    return student * sqrt(whole / (count - 1) / independent)
