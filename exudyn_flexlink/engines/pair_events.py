"""When contacts of two parts begin or cease to press, within a step.

A contact with a face presses where its event function is negative, the largest of its gap, of how
far its point is from the face's start, backwards, and of how far beyond its end. Within a step the
motion of one part against the other is the polynomial through its places and rates at the step's
nodes. An event is located there, and the step made again to end at it. There the event function is
zero but for its `event_error`, and its rate tells on which side of the event the contact is.

No touch is stepped over, however short it is against the step. A gap is a distance: it changes by
no more than the way of one part against the other. The sum of the sizes of Chebyshev's coefficients
is a bound of that way, and of how fast its rate changes. These bounds show that in most parts of a
step nothing happens. The others are halved, the first half first, until a bound shows it of them,
too, or the value at the end of a part decides.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from exudyn_flexlink.arrays import BoolArray, ComplexArray, FloatArray, IndexArray
from exudyn_flexlink.integrate.events import (
    EVENT_TIME,
    GAP_ROUNDING,
    Guard,
    StepPolynomial,
    chebyshev_sum,
    first_fall,
)
from exudyn_flexlink.integrate.problem import instant
from exudyn_flexlink.integrate.radau import collocation
from exudyn_flexlink.mechanism import Glimpse, Seen
from exudyn_flexlink.rounding import PLACE_ROUNDING, TINY

SHORTEST = 1 / 64  # of the step: a part so short is searched by the zeros of the rate
LEAST_PART = 2.0**-20  # of the step: no part is shorter, however sharp a corner is


class EndsByTurns(Protocol):
    """A problem whose run ends as so many turns are made."""

    reached: bool


@dataclass(frozen=True)
class TurnsGuard(Guard):
    """The turns that end the run are made."""

    problem: EndsByTurns

    def cross(self, time: float) -> None:  # noqa: ARG002
        """End the run."""
        self.problem.reached = True


def event_functions(seen: Seen, lengths: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Event functions (c,), m, of contacts with faces so long, and their rates."""
    beyond = seen.place - lengths
    after = beyond > -seen.place
    value = np.where(after, beyond, -seen.place)
    rate = np.where(after, seen.slip, -seen.slip)
    of_gap = seen.gap > value
    return np.where(of_gap, seen.gap, value), np.where(of_gap, seen.gap_rate, rate)


def changed(
    now: Seen, lengths: FloatArray, pressing: BoolArray, time: float, contact: int | None
) -> BoolArray:
    """Tell which contacts (c,) begin or cease to press now (s), or already did within the step.

    At an event of this `contact` its event function is zero but for rounding, and about to change
    its sign. If it does not, the contact only came near: zero was crossed by a step's polynomial,
    not by the motion.
    """
    value, rate = event_functions(now, lengths)
    way = np.where(pressing, -1.0, 1.0)
    value, rate = way * value, way * rate
    crosses = (value < -PLACE_ROUNDING) | ((value < 0) & (rate < 0))
    if contact is not None:
        crosses[contact] |= value[contact] < event_error(rate[contact], time) and rate[contact] < 0
    return np.asarray(crosses)


def late_by(end: Seen, lengths: FloatArray, k: int, time: float) -> float:
    """How long (s) before a step's end at `time` contact k's event was; negative: after."""
    value, rate = event_functions(end, lengths)
    if abs(value[k]) < event_error(rate[k], time) or rate[k] == 0:
        return 0.0
    return float(value[k] / rate[k])


def calm(path: Seen, lengths: FloatArray, pressing: BoolArray, h: float) -> BoolArray:
    """Tell of which contacts (c,) it is sure that nothing happens in a step of length h (s).

    The `path` (m, c) is that of its nodes. Between two of them gap and place cover no more than the
    mean of their speeds there tells, and what the largest second derivative adds.
    """
    values = np.concatenate([path.gap, path.place], axis=1)
    rates = h * np.concatenate([path.gap_rate, path.slip], axis=1)
    method = collocation(len(values) - 1)
    seconds = method.polynomial.coefficients(values.T, rates.T, 2)
    bends = np.abs(seconds).sum(axis=1)
    speeds = np.abs(rates)
    mean = 0.5 * (speeds[:-1] + speeds[1:])
    parts = np.diff(method.nodes)[:, None]  # of the step, between its nodes
    ways = parts * (mean + 0.25 * parts * bends)
    deep, far = np.split(ways, 2, axis=1)
    gap = path.gap[:-1] + path.gap[1:]
    apart = gap > deep
    if apart.all():
        return ~pressing
    inside = np.minimum(path.place, lengths - path.place)
    inside = inside[:-1] + inside[1:]
    pressed = (gap < -deep) & (inside > far)
    return np.asarray(np.where(pressing, pressed, apart | (inside < -far)).all(axis=0))


def first_of(
    which: IndexArray, path: Seen, lengths: FloatArray, pressing: BoolArray, h: float
) -> tuple[float, int] | None:
    """Part of the step and contact of the first event of `which`; None if there is none."""
    polynomial = collocation(len(path.gap) - 1).polynomial
    gaps, places = (
        polynomial.coefficients(values[:, which].T, h * rates[:, which].T)
        for values, rates in ((path.gap, path.gap_rate), (path.place, path.slip))
    )
    crossings: list[tuple[float, int]] = []
    for k, gap, place in zip(which.tolist(), gaps, places, strict=True):
        search = _OfFace(gap, place, float(lengths[k]), -1.0 if pressing[k] else 1.0)
        part = first_part(search)
        if part is not None:
            crossings.append((part, k))
    return min(crossings, default=None)


def event_error(rate: float, time: float) -> float:
    """Error (m) of an event function that is zero now (s) and has this rate (m/s)."""
    return PLACE_ROUNDING + abs(rate) * instant(time, EVENT_TIME)


def first_part(search: _OfFace | Flight | RopeFlight) -> float | None:
    """Part of the step after which the search's value first falls below zero; None if it does not.

    Of any part of the step, `search.sure` is True if the value surely stays above zero, False if
    the value at the end of the part tells, and None if the part has to be halved.
    """
    left, since = [(0.0, 1.0)], 0.0  # the value is zero since then, but for rounding
    while left:
        begin, end = left.pop()
        sure = search.sure(begin, end)
        if sure is None and end - begin > search.shortest:
            middle = 0.5 * (begin + end)
            left += [(middle, end), (begin, middle)]
            continue
        if not sure:
            if begin > 0 and search.value(begin) < min(search.value(0.0), 0.0) - GAP_ROUNDING:
                return begin  # it came behind the line beside an end of its curve
            rate = search.rate if sure is None else None
            part = first_fall(search.value, rate, (since, end), 1)
            if part is not None:
                at_once = search.value(since) <= GAP_ROUNDING and search.rate(since) <= 0
                return since if at_once else part
        if search.value(end) > GAP_ROUNDING:
            since = end
    return None


class _OfFace:
    """Search of a contact with a face, by its gap and by how far it is beyond each end of the face.

    The contact presses as long as all three lengths are below zero, and is apart as long as any of
    them is above. The search's value is positive until that changes.
    """

    shortest = SHORTEST

    def __init__(self, gap: FloatArray, place: FloatArray, length: float, way: float) -> None:
        """Take coefficients (2 n,) of gap and place (m); `way` is -1 where it presses, else 1."""
        beyond = place.copy()
        beyond[0] -= length
        values = way * np.array([gap, -place, beyond])
        rates = StepPolynomial.derivative(values)
        self._values, self._rates = values.tolist(), rates.tolist()
        self._bends = np.abs(StepPolynomial.derivative(rates)).sum(axis=1).tolist()
        self._pressing = way < 0

    def _lengths(self, part: float) -> list[tuple[float, float]]:
        """All three lengths after a part of the step, and their rates."""
        pairs = zip(self._values, self._rates, strict=True)
        return [(chebyshev_sum(value, part), chebyshev_sum(rate, part)) for value, rate in pairs]

    def _deciding(self, part: float) -> tuple[float, float]:
        """The length that decides whether the contact presses, and its rate."""
        return min(self._lengths(part)) if self._pressing else max(self._lengths(part))

    def value(self, part: float) -> float:
        """The length that decides (m), plus the error of an event's instant, `PLACE_ROUNDING`."""
        return self._deciding(part)[0] + PLACE_ROUNDING

    def rate(self, part: float) -> float:
        """Slope (m per step) of the value; it jumps where another of the lengths decides."""
        return self._deciding(part)[1]

    def sure(self, begin: float, end: float) -> bool | None:
        """True if the contact surely stays apart, by one length, or pressed, by all three."""
        h = end - begin
        columns = zip(self._lengths(begin), self._lengths(end), self._bends, strict=True)
        sure = []
        for before, after, bend in columns:
            far = min(before[0], after[0]) > h * h * bend / 8
            leaves = before[0] > -PLACE_ROUNDING and before[1] > h * bend
            sure.append(far or leaves)
        return (all(sure) if self._pressing else any(sure)) or None


Path = tuple[ComplexArray, ComplexArray]
"""Places (..., n) at the nodes of a step, m, and their rates, m per step."""
RopePaths = tuple[Path, tuple[FloatArray, FloatArray]]
"""Paths (pieces, n) of the pieces of a rope; its free length (n,), m, and the rate, m per step."""


class Flight:
    """Search of a contact that is apart, by how its first part moves in the axes of the second.

    The value is the gap: positive until the contact closes.
    """

    def __init__(
        self,
        glance: Callable[[complex, complex], Glimpse],
        feature: float,
        path: Path,
        way: float,
    ) -> None:
        """Take a function `glance` that returns the gap for a place and its rate, and a `path`.

        `feature` is the smallest radius (m) of a shape that the place can't cross. The `path` has
        places (n,) at a step's nodes, m, and rates, m per step; `way` is -1 behind a face, else 1.
        """
        nodes = path[0][None], path[1][None]
        polynomial = collocation(len(path[0]) - 1).polynomial
        place, rate, bend = (polynomial.coefficients(*nodes, order)[0] for order in range(3))
        self._place, self._rate = place.tolist(), rate.tolist()
        self._bend = float(np.abs(bend).sum())
        self._glance, self._radius, self._way = glance, 0.5 * feature, way
        # A single place is nearest only where the way is short against the radius of what is round.
        speed = float(np.abs(rate).sum())
        self.shortest = SHORTEST
        if 0 < self._radius < SHORTEST * speed:
            self.shortest = max(self._radius / speed, LEAST_PART)
        # At the ends of the step the nodes are exact: right after a touch the polynomial's rounding
        # would hide whether the contact opens.
        places, rates = (nodes[[0, -1]].tolist() for nodes in path)
        ends = zip((0.0, 1.0), places, rates, strict=True)
        self._seen = {part: self._glimpse(place, rate) for part, place, rate in ends}

    def _glimpse(self, place: complex, rate: complex) -> Glimpse:
        seen = self._glance(place, rate)
        return seen._replace(gap=self._way * seen.gap, gap_rate=self._way * seen.gap_rate)

    def _look(self, part: float) -> Glimpse:
        if part not in self._seen:
            place, rate = chebyshev_sum(self._place, part), chebyshev_sum(self._rate, part)
            self._seen[part] = self._glimpse(place, rate)
        return self._seen[part]

    def value(self, part: float) -> float:
        """Gap (m) after a part of the step; behind a face that to its back."""
        return self._look(part).gap

    def rate(self, part: float) -> float:
        """Slope of the gap (m per step)."""
        return self._look(part).gap_rate

    def sure(self, begin: float, end: float) -> bool | None:
        """See `first_part`: sure where the way is short, or so straight that both ends tell."""
        h = end - begin
        before, after = self._look(begin), self._look(end)
        speed = abs(chebyshev_sum(self._rate, 0.5 * (begin + end)))
        faster = h * self._bend / 4
        way = h * (speed + faster)
        if max(before.gap, before.beside) + max(after.gap, after.beside) > way:
            return True
        if way > self._radius:
            return None
        # No distance bends more than on a circle with the smallest radius that can't be crossed.
        fastest = speed + h * self._bend / 2
        turn = h * (self._bend + fastest**2 / self._radius)
        return _sure_by_ends(before, after, h, turn)


def _sure_by_ends(
    before: Glimpse | _Rope, after: Glimpse | _Rope, h: float, turn: float
) -> bool | None:
    """As `Flight.sure`, by gaps at both ends of a part h; their rate changes by `turn` at most."""
    sag = h * turn / 8
    if min(before.gap, after.gap) > sag or (
        before.gap > -PLACE_ROUNDING and before.gap_rate > turn
    ):
        return True
    return False if after.gap_rate < -turn or sag < GAP_ROUNDING else None


class _Rope(NamedTuple):
    """A slack rope: lengths (m) of its pieces, its gap (m), and the rate of the gap (m per step).

    The gap of a rope is its free length less the lengths of its pieces.
    """

    lengths: FloatArray
    gap: float
    gap_rate: float


class RopeFlight:
    """Search of a slack rope over points, by how its pieces move; the value is the rope's gap.

    The gap changes by no more than the ways of all pieces together, and that of the free length.
    """

    shortest = LEAST_PART

    def __init__(self, pieces: Path, length: tuple[FloatArray, FloatArray]) -> None:
        """Take the paths of the pieces; the free length (n,), m, and its rate, m per step."""
        places, rates = (
            np.asarray(np.vstack(both), dtype=np.complex128)
            for both in zip(pieces, length, strict=True)
        )
        polynomial = collocation(places.shape[1] - 1).polynomial
        place, rate, bend = (polynomial.coefficients(places, rates, order) for order in range(3))
        self._rows = list(zip(place.tolist(), rate.tolist(), strict=True))
        self._bends = np.abs(bend).sum(axis=1)
        self._seen = {
            0.0: _rope(places[:, 0], rates[:, 0]),
            1.0: _rope(places[:, -1], rates[:, -1]),
        }

    def _look(self, part: float) -> _Rope:
        if part not in self._seen:
            rows = [(chebyshev_sum(z, part), chebyshev_sum(rate, part)) for z, rate in self._rows]
            places, rates = np.array(rows).T
            self._seen[part] = _rope(places, rates)
        return self._seen[part]

    def value(self, part: float) -> float:
        """Gap (m) after a part of the step."""
        return self._look(part).gap

    def rate(self, part: float) -> float:
        """Slope of the gap (m per step)."""
        return self._look(part).gap_rate

    def sure(self, begin: float, end: float) -> bool | None:
        """See `first_part`, and `Flight.sure`."""
        h, before, after = end - begin, self._look(begin), self._look(end)
        middle = 0.5 * (begin + end)
        speeds = np.abs([chebyshev_sum(rate, middle) for _, rate in self._rows])
        ways = h * (speeds + h * self._bends / 4)
        if before.gap + after.gap > ways.sum():
            return True
        # Within the part no piece is shorter than `least`: its length bends no more than on a
        # circle of that radius.
        least = 0.5 * (before.lengths + after.lengths - ways[:-1])
        if least.min() <= 0:
            return None
        fastest = speeds + h * self._bends / 2
        turn = h * float(self._bends.sum() + (fastest[:-1] ** 2 / least).sum())
        return _sure_by_ends(before, after, h, turn)


def _rope(places: ComplexArray, rates: ComplexArray) -> _Rope:
    """A rope by the places and rates of its pieces; the last entry is the free length."""
    lengths = np.abs(places[:-1])
    growing = (places[:-1].conj() * rates[:-1]).real / np.maximum(lengths, TINY)
    gap, gap_rate = places[-1].real - lengths.sum(), rates[-1].real - growing.sum()
    return _Rope(lengths, float(gap), float(gap_rate))
