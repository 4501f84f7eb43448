"""Two Results of one scene, side by side: deviations, strikes, and the horizon of both.

Times are in s, lengths in m, angles in rad; N is the number of instants compared.

Some motions are sensitive: runs of one engine with different tolerances part visibly after some
time, the horizon (see `Result.error`). Two runs are compared instant by instant up to the earlier
of their horizons. Beyond it only means, scatter and extremes are compared.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from exudyn_flexlink import observables
from exudyn_flexlink.arguments import number, takes
from exudyn_flexlink.arrays import BoolArray, FloatArray
from exudyn_flexlink.observables import Deviation, Measure, Strike, watched_point
from exudyn_flexlink.quantities import Dimension
from exudyn_flexlink.result import ForceDeviation, Result, later
from exudyn_flexlink.scene import Scene

_OF_A_SCENE = ("curves", "bodies", "joints", "springs", "drives", "contacts", "gravity")
_AT_REST = (".rest_angle", ".length")  # a run that continues another one takes them from it


@dataclass(frozen=True)
class Seen:
    """What is compared of one run.

    `name` tells the runs apart; `position` (N, 2) m is that of the watched point; `levers` are the
    struck bodies' responses at the run's own samples, `answers` (N,) their angles or displacements
    at the instants compared; `contact` is by joint with clearance, up to the last of them.
    """

    name: str
    result: Result
    position: FloatArray
    levers: Mapping[str, observables.LeverResponse]
    answers: Mapping[str, FloatArray]
    strikes: Mapping[str, tuple[Strike, ...]]
    contact: Mapping[str, observables.ContactTotals]

    @property
    def accuracy(self) -> str:
        """The accuracy and the impact model the run was made with, in words."""
        settings, words = self.result.settings, list[str]()
        if settings.integrator.tolerance is not None:
            words.append(f"tolerance {settings.integrator.tolerance:.3g} m")
        if settings.integrator.step is not None:
            words.append(f"step {settings.integrator.step:.3g} s")
        if settings.elements is not None:
            words.append(f"beam of {settings.elements} elements")
        return ", ".join([*words, *(f"{kind} impacts" for kind in self.impacts)])

    @property
    def impacts(self) -> tuple[str, ...]:
        """Kinds of the laws of contacts and stops: penalty, impulse, hertz."""
        struck = {**self.result.scene.contacts, **self.result.scene.stops}
        return tuple(dict.fromkeys(contact.law.type for contact in struck.values()))


@dataclass(frozen=True)
class StrikePair:
    """One strike in both runs; None in a run that has no such strike. `lap`: see `Strike`."""

    contact: str
    lap: int | None
    first: Strike | None
    second: Strike | None


@dataclass(frozen=True)
class Statistics:
    """A stretch of one run as a whole.

    `mean`, `rms`, `least` and `greatest` (2,) are of the watched point's coordinates, m, the last
    three relative to the mean; `levers` are the least and the greatest angle (rad) or displacement
    (m) of struck bodies.
    """

    mean: FloatArray
    rms: FloatArray
    least: FloatArray
    greatest: FloatArray
    levers: Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class Comparison:
    """Two runs of one scene at common instants `time` (N,), up to the end of the shorter run.

    `point` is the watched one, S; `judged_by` are the points by which runs are judged, and
    `distances` (N, points) m how far each is from itself in the other run.
    `horizon` (s) is that from which on they can't be compared instant by instant, None if they can
    throughout, or neither was measured.
    """

    point: str
    judged_by: tuple[str, ...]
    time: FloatArray
    distances: FloatArray
    first: Seen
    second: Seen
    horizon: float | None

    @property
    def both(self) -> tuple[Seen, Seen]:
        """What is compared of each run."""
        return self.first, self.second

    @cached_property
    def deviation(self) -> Deviation:
        """Distance of the point that is farthest, at every instant."""
        return Deviation(self.time, self.distances.max(axis=1))

    def farthest(self, time: float) -> str:
        """Name of the point that is farthest from itself in the other run at an instant (s)."""
        return observables.farthest(
            self.judged_by, self.distances[np.searchsorted(self.time, time)]
        )

    @property
    def worst(self) -> str:
        """Name of the point that is farthest from itself in the other run at any instant."""
        return observables.farthest(self.judged_by, self.distances.max(axis=0))

    @property
    def answer_differences(self) -> dict[str, FloatArray]:
        """First minus second angle or displacement (N,) of every struck body."""
        return {body: self.first.answers[body] - self.second.answers[body] for body in self.levers}

    @property
    def measures(self) -> dict[str, Measure]:
        """By what the motion of every struck body is told."""
        return {body: lever.measure for body, lever in self.first.levers.items()}

    @property
    def levers(self) -> tuple[str, ...]:
        """Names of the struck bodies."""
        return tuple(self.first.answers)

    @property
    def with_clearance(self) -> tuple[str, ...]:
        """Names of the joints with clearance in either run."""
        return tuple(dict.fromkeys([*self.first.contact, *self.second.contact]))

    @property
    def judged(self) -> Deviation:
        """The deviation up to the horizon: what the engines answer for. May be empty."""
        return self.deviation if self.horizon is None else self.deviation.until(self.horizon)

    @cached_property
    def forces(self) -> dict[str, ForceDeviation]:
        """How far forces are apart up to the horizon, by what they are called."""
        until = np.inf if self.horizon is None else self.horizon
        return observables.force_deviations(self.first.result, self.second.result, until)

    @property
    def first_strike(self) -> float | None:
        """Instant of the first touch in either run, s; None if nothing is struck."""
        series = (*self.first.strikes.values(), *self.second.strikes.values())
        return min((strike.begin for each in series for strike in each), default=None)

    @property
    def before_strike(self) -> Deviation | None:
        """The deviation before the first strike of either run; None without strike or instants."""
        strike = self.first_strike
        if strike is None or strike <= self.time[0]:
            return None
        return self.deviation.until(strike)

    @property
    def strikes(self) -> list[StrikePair]:
        """Strikes of both runs, those that belong together as pairs, by contact, in order."""
        other = self.second.strikes
        return [
            p
            for name, strikes in self.first.strikes.items()
            for p in _pairs(name, strikes, other[name])
        ]

    @property
    def beyond(self) -> tuple[Statistics, Statistics] | None:
        """Statistics of both runs from the horizon on; None without a horizon."""
        return None if self.horizon is None else self.statistics(self.horizon)

    def statistics(self, begin: float = 0.0) -> tuple[Statistics, Statistics]:
        """Statistics of both runs from an instant (s) on."""
        after = self.time >= begin
        first, second = (_statistics(seen, self.point, self.time, after) for seen in self.both)
        return first, second

    @takes(tolerance=number(Dimension.LENGTH, at_least=0.0))
    def exceeds(self, tolerance: float) -> bool:
        """Whether the deviation up to the horizon exceeds `tolerance` (m), or can't be told."""
        judged = self.judged
        return not len(judged.time) or not judged.largest <= tolerance


def compare(first: Result, second: Result, names: tuple[str, str] | None = None) -> Comparison:
    """Compare two runs of one scene, by different engines or at different settings.

    With `names` of both, two scenes in what both have, such as one and itself without some effect.
    The horizon is the earlier one up to which the errors of both are known.

    Raises:
        ValueError: the runs are not of one scene: other points, contacts or struck bodies; with
            `names`, their watched points differ.

    """
    if names is None:
        _check_one_scene(first, second)
        second = later(second, second.scene.initial.clock - first.scene.initial.clock)
        names = first.engine, second.engine
        if names[0] == names[1]:
            names = f"{names[0]} 1", f"{names[1]} 2"
    point, other_point = watched_point(first.scene), watched_point(second.scene)
    if point != other_point:
        raise ValueError(f"the scenes' watched points are {point} and {other_point}")
    if min(first.time[-1], second.time[-1]) < max(first.time[0], second.time[0]):
        spans = [f"{run.time[0]:.6g} to {run.time[-1]:.6g} s" for run in (first, second)]
        raise ValueError(f"the runs have no time in common: {' and '.join(spans)}")
    time, points = observables.common_times(first, second), observables.common_points(first, second)
    contacts = [name for name in first.scene.all_contacts if name in second.scene.all_contacts]
    ours, theirs = observables.measures(first.scene), observables.measures(second.scene)
    struck = [body for body, measure in ours.items() if measure == theirs.get(body)]
    known = min(run.error.known_until for run in (first, second))
    return Comparison(
        point,
        points,
        time,
        observables.separations(first, second, time, points),
        _seen(names[0], first, time, contacts, struck),
        _seen(names[1], second, time, contacts, struck),
        known if known <= time[-1] else None,
    )


def _check_one_scene(first: Result, second: Result) -> None:
    for what, of in (
        ("watched points", watched_point),
        ("contacts", lambda scene: list(scene.all_contacts)),
        ("struck bodies", observables.struck_bodies),
        (
            "struck bodies' motions",
            lambda scene: {b: m.word for b, m in observables.measures(scene).items()},
        ),
    ):
        values = of(first.scene), of(second.scene)
        if values[0] != values[1]:
            raise ValueError(
                f"the runs are not of one scene: their {what} are {values[0]} and {values[1]}"
            )
    ours, theirs = (_meant(run.scene) for run in (first, second))
    for path in sorted(ours.keys() | theirs.keys()):
        pair = ours.get(path), theirs.get(path)
        left_open = path.endswith(_AT_REST) and None in pair
        if pair[0] != pair[1] and not left_open:
            about = f"{path} is {pair[0]} and {pair[1]}"
            raise ValueError(
                f"the runs are not of one scene: {about}; give 'names' to compare both"
            )


def _meant(scene: Scene) -> dict[str, Any]:
    """Contents of a scene by path, without its solver, duration and start state."""
    data, meant = scene.to_data(), dict[str, Any]()

    def walk(value: Any, path: str) -> None:
        if isinstance(value, dict):
            for key, inner in value.items():
                walk(inner, f"{path}.{key}")
        else:
            meant[path] = value

    for section in _OF_A_SCENE:
        walk(data.get(section), section)
    return meant


def _seen(
    name: str, result: Result, time: FloatArray, contacts: Sequence[str], struck: Sequence[str]
) -> Seen:
    scene = result.scene
    by = observables.struck_bodies(scene)
    levers = {body: observables.lever_response(result, by[body]) for body in struck}
    return Seen(
        name=name,
        result=result,
        position=observables.positions(result, [watched_point(scene)], time)[:, 0],
        levers=levers,
        answers={body: lever.at(time).value for body, lever in levers.items()},
        strikes={contact: tuple(observables.strikes(result, contact)) for contact in contacts},
        contact={
            joint: observables.contact_totals(result, joint, end=float(time[-1]))
            for joint in observables.joints_with_play(result)
        },
    )


def _pairs(contact: str, first: Sequence[Strike], second: Sequence[Strike]) -> Iterator[StrikePair]:
    """Pair strikes in order; a strike that only one run has does not shift the later pairs."""
    while first or second:
        strike = first[0] if first and not _unmatched(second, first) else None
        other = second[0] if second and not _unmatched(first, second) else None
        either = strike or other
        assert either is not None  # of two strikes, at most the earlier one is unmatched
        yield StrikePair(contact, either.lap, strike, other)
        first, second = first[strike is not None :], second[other is not None :]


def _unmatched(earlier: Sequence[Strike], later: Sequence[Strike]) -> bool:
    """Whether the first strike of `earlier` has no partner in `later`; then `later` waits."""
    if not earlier or not later or earlier[0].begin >= later[0].begin:
        return False
    apart = later[0].begin - earlier[0].begin
    if len(earlier) > 1 and abs(later[0].begin - earlier[1].begin) < apart:
        return True
    angle, other = earlier[0].crank_angle, later[0].crank_angle
    return angle is not None and other is not None and abs(angle - other) > observables.SAME_STRIKE


def _statistics(seen: Seen, point: str, time: FloatArray, part: BoolArray) -> Statistics:
    """Statistics over a part of the instants; least and greatest are those of the run itself."""
    position, (begin, end) = seen.position[part], time[part][[0, -1]].tolist()
    mean = position.mean(axis=0)
    turns = (seen.result.extremes[f"{point}.{axis}_m"].between(begin, end) for axis in "xy")
    reached = [np.append(turn.value, x) for turn, x in zip(turns, position.T, strict=True)]
    levers = {
        body: lever.between(begin, np.nextafter(end, np.inf)) for body, lever in seen.levers.items()
    }
    return Statistics(
        mean=mean,
        rms=np.sqrt(np.mean((position - mean) ** 2, axis=0)),
        least=np.array([x.min() for x in reached]) - mean,
        greatest=np.array([x.max() for x in reached]) - mean,
        levers={
            body: (response.least[0], response.greatest[0]) for body, response in levers.items()
        },
    )
