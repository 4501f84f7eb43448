"""How long a lap takes, and how far a point is from where it was laps before: what repeats."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, lcm, pi

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.observables import path, steady_speeds, watched_point
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import LapsSpec, Scene, SlotJoint

PHASES = 256  # of a lap, at which it is compared
MOST = 8  # laps: a motion that takes more to repeat itself counts as none that does
ALIKE = 3.0  # times the run's own error: two laps differ by both their errors
FALLS = 0.9  # from a distance to the next, where laps settle to a period
LEAST_FALLS = 2  # in a row


class NoRhythmError(ValueError):
    """Nothing in the scene tells how long a lap takes; the text says what may be given."""


class ImpossibleLapsError(ValueError):
    """Laps so short, so long or so many that they can't be run; the text says which."""


@dataclass(frozen=True)
class Rhythm:
    """A `lap` takes so many s; after `laps` the mechanism is driven the same way again."""

    lap: float
    laps: int = 1

    @property
    def cycle(self) -> float:
        """Time (s) after which the mechanism is driven the same way again."""
        return self.laps * self.lap


def rhythm_of(scene: Scene, lap: float | None = None) -> Rhythm:
    """Return the rhythm of the first joint that a drive turns at one speed, or of a `lap` (s).

    Curves with laps tell how many laps make a cycle.
    """
    turned = list(steady_speeds(scene).values())
    if lap is None and not turned:
        raise NoRhythmError(
            "no drive turns a joint at one speed, so that nothing tells what a lap is: say how "
            "long it takes, such as the period of a force"
        )
    return Rhythm(2 * pi / abs(turned[0]) if lap is None else lap, laps_of_cycle(scene))


def laps_of_cycle(scene: Scene) -> int:
    """Laps after which the mechanism is driven the same way again: those of curves with laps."""
    slots = (joint for joint in scene.joints.values() if isinstance(joint, SlotJoint))
    curves = [scene.curves[slot.curve] for slot in slots]
    return lcm(*(len(own.curves) for own in curves if isinstance(own, LapsSpec)))


@dataclass(frozen=True)
class LapDistances:
    """How far `point` is in each lap from where it was `before` laps before.

    `laps` (N,) number whole laps from 1, `end` (N,) s are their ends, `before` (M,) the shifts and
    `largest` (M, N) m the largest distance at the same phases; nan where there is no such lap.
    """

    point: str
    laps: IndexArray
    end: FloatArray
    before: IndexArray
    largest: FloatArray


@dataclass(frozen=True)
class Repeating:
    """What laps tell of a motion, up to `until` (s), to where they are known.

    `laps` is the number after which it repeats itself within `error` (m), the run's own; None
    where it does not. `settles` is the factor by which the distance of laps so many apart falls
    from one to the next where it is still on its way to such a period, else None. `least` (m) is
    the smallest distance of the last laps from earlier ones, that of `nearest` laps before.
    """

    laps: int | None
    settles: float | None
    least: float
    nearest: int
    error: float
    until: float

    @property
    def told(self) -> str:
        """In words."""
        if self.laps is not None:
            return f"repeats itself every {_count(self.laps)}"
        if self.settles is not None:
            return f"settles to a period of {_count(self.nearest)}"
        return f"does not repeat itself within {_count(MOST)}"


def lap_distances(
    result: Result, lap: float, point: str | None = None, after: float = 0.0
) -> LapDistances:
    """Compare each whole lap of `lap` (s), from `after` (s) on, with up to `MOST` laps before.

    With a crank of constant speed that is at the same crank angles. The point is the watched one
    if left out. Between samples it is interpolated, which may differ from lap to lap; nothing is
    where a lap is a multiple of `PHASES` samples.
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


def repeating(found: LapDistances, error: float, until: float = inf) -> Repeating | None:
    """Judge laps that end up to `until` (s) against the error (m) of the run; None if too few."""
    known = found.end <= until * (1 + 1e-9)
    rows = {
        int(shift): row[known & np.isfinite(row)]
        for shift, row in zip(found.before, found.largest, strict=True)
    }
    rows = {shift: row for shift, row in rows.items() if len(row) >= shift}
    if not rows:
        return None
    last = {shift: float(row[-shift:].max()) for shift, row in rows.items()}
    end = float(found.end[known][-1])
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
    """Factor by which distances fall from one block of `shift` laps to the next, if they do.

    At least from one to the next two, and in each step.
    """
    count = len(row) // shift
    if count < LEAST_FALLS + 1:
        return None
    blocks = row[len(row) - count * shift :].reshape(count, shift).max(axis=1)
    falls = blocks[-LEAST_FALLS:] / blocks[-LEAST_FALLS - 1 : -1]
    return float(falls.prod() ** (1 / LEAST_FALLS)) if falls.max() < FALLS else None


def _count(laps: int) -> str:
    return "lap" if laps == 1 else f"{laps} laps"
