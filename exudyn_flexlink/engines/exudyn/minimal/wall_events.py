"""When a pair of link and guide begins or ceases to press, within a step.

A pair presses where its event function is negative, the largest of its gap, of how far its point is
from the face's start, backwards, and of how far beyond its end. Within a step gaps and places are
the polynomials through their values and rates at the step's nodes. An event is located there, and
the step made again to end at it; little is left of the event function then (see `_little`), and its
rate tells on which side of the event the pair is.
"""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import BoolArray, FloatArray, IndexArray
from exudyn_flexlink.engines.exudyn.faces import Touch
from exudyn_flexlink.engines.exudyn.minimal.coordinates import TreeState
from exudyn_flexlink.engines.exudyn.minimal.wall_faces import Seen
from exudyn_flexlink.engines.exudyn.minimal.walls import Walls
from exudyn_flexlink.integrate.clock import instant
from exudyn_flexlink.integrate.collocation import C
from exudyn_flexlink.integrate.events import EVENT_TIME, first_fall
from exudyn_flexlink.integrate.radau import Step
from exudyn_flexlink.integrate.turning import StepPolynomial, chebyshev_sum

# m, of an event function: what may be left of it at the event. A foil may rest 5e-12 m deep.
EXACT = 1e-12
ALWAYS_CLOSED_GAP = -1.0  # m: gap of what is held on its axis from both sides, and never leaves it
NODES = np.array([0.0, *C])
PARTS = np.diff(NODES)[:, None]
POLYNOMIAL = StepPolynomial(NODES)


class WallWatch:
    """Looks at steps; `seen` are all pairs at the end of the last one accepted."""

    def __init__(self, walls: Walls, x: FloatArray, v: FloatArray) -> None:
        self.walls = walls
        self._lengths, self._held = self.walls.faces.length, self.walls.faces.held
        self._any_held = bool(self._held.any())
        self.seen = self.walls.faces.look(x, v)
        self._ahead: tuple[TreeState, Seen] | None = None  # at the end of the last step looked at

    def _with_held_pairs_closed(self, seen: Seen) -> Seen:
        """The same with what is held from both sides as if behind a face that never opens."""
        if not self._any_held:
            return seen
        gap = np.where(self._held, ALWAYS_CLOSED_GAP, seen.gap)
        return seen._replace(gap=gap, gap_rate=np.where(self._held, 0, seen.gap_rate))

    def accept(self, end: TreeState) -> None:
        """Take the coordinates at the end of a step."""
        if self.walls.contacts:
            self.seen = self._at_end(end)

    def _at_end(self, end: TreeState) -> Seen:
        """All pairs at the end of a step, which is asked for again as it is accepted."""
        if self._ahead is None or self._ahead[0] is not end:
            self._ahead = end, self.walls.faces.look(end.x, end.v)
        return self._ahead[1]

    def touch(self, k: int) -> Touch:
        """Where pair k is."""
        gap, place, gap_rate, place_rate = (float(column[k]) for column in self.seen)
        return Touch(gap, place, gap_rate, place_rate)

    def changed(self, time: float, there: int | None = None) -> IndexArray:
        """Pairs that now (s) begin or cease to press, or did so unseen.

        At an event of pair `there` its event function is zero but for rounding, and about to change
        its sign. If not, it only came near, and crossed zero in a step's polynomial.
        """
        value, rate = self._events(self.seen)
        way = np.where(self.walls.touching, -1.0, 1.0)
        value, rate = way * value, way * rate
        crosses = (value < -EXACT) | ((value < 0) & (rate < 0))
        if there is not None:
            crosses[there] |= value[there] < _little(rate[there], time) and rate[there] < 0
        return np.flatnonzero(crosses)

    def _events(self, seen: Seen) -> tuple[FloatArray, FloatArray]:
        """Event functions (pairs,), m, and their rates."""
        seen = self._with_held_pairs_closed(seen)
        beyond = seen.place - self._lengths
        after = beyond > -seen.place
        value = np.where(after, beyond, -seen.place)
        rate = np.where(after, seen.place_rate, -seen.place_rate)
        of_gap = seen.gap > value
        return np.where(of_gap, seen.gap, value), np.where(of_gap, seen.gap_rate, rate)

    # --- within a step ------------------------------------------------------------------------

    def first(self, step: Step, end: TreeState) -> tuple[float, int] | None:
        """Instant (s) and pair of the first event within a step; None if there is none."""
        if not self.walls.contacts:
            return None
        x, v = step.stages.kept.state[:2]
        x, v = np.concatenate([x[:-1], end.x[None]]), np.concatenate([v[:-1], end.v[None]])
        stages = self.walls.faces.look(x, v)
        self._ahead = end, stages.pick(-1)
        path = self._with_held_pairs_closed(self.seen.then(stages))
        restless = np.flatnonzero(~self._calm(path, step.h))
        if not len(restless):
            return None
        at_once = self.changed(step.t)
        if len(at_once):
            return step.t, int(at_once[0])
        found = self._first_of(restless, path, step.h)
        return None if found is None else (step.t + found[0] * step.h, found[1])

    def _calm(self, path: Seen, h: float) -> BoolArray:
        """Tell of which pairs (pairs,) it is sure that nothing happened.

        Between two nodes a cubic through values and rates strays from them by less than a sixth of
        the way that the larger rate covers; the margin is sixfold.
        """
        inside, parts = np.minimum(path.place, self._lengths - path.place), h * PARTS
        gap_rate, slip = np.abs(path.gap_rate), np.abs(path.place_rate)
        deep = parts * np.maximum(gap_rate[:-1], gap_rate[1:])
        far = parts * np.maximum(slip[:-1], slip[1:])
        before, after = path.gap[:-1], path.gap[1:]
        beside = np.maximum(inside[:-1], inside[1:]) < -far
        calm = np.asarray(((np.minimum(before, after) > deep) | beside).all(axis=0))
        which = self.walls.which
        if len(which):
            within = np.minimum(inside[:-1, which], inside[1:, which]) > far[:, which]
            pressed = np.maximum(before[:, which], after[:, which]) < -deep[:, which]
            calm[which] = (pressed & within).all(axis=0)
        return calm

    def _first_of(self, which: IndexArray, path: Seen, h: float) -> tuple[float, int] | None:
        """Part of the step and pair of the first event of `which`; None if there is none."""
        gaps, places = (
            POLYNOMIAL.coefficients(values[:, which].T, h * rates[:, which].T)
            for values, rates in ((path.gap, path.gap_rate), (path.place, path.place_rate))
        )
        found: list[tuple[float, int]] = []
        for k, gap, place in zip(which.tolist(), gaps, places, strict=True):
            way = -1.0 if self.walls.touching[k] else 1.0
            pair = _Event(gap, place, float(self._lengths[k]), way)
            part = first_fall(pair.value, pair.rate, (0.0, 1.0))
            if part is not None:
                found.append((part, k))
        return min(found, default=None)

    # --- at its end ---------------------------------------------------------------------------

    def late(self, k: int, end: TreeState, time: float) -> float:
        """How long (s) before a step's end at this time pair k's event was; negative: after.

        0 where it is there.
        """
        value, rate = self._events(self._at_end(end))
        if abs(value[k]) < _little(rate[k], time) or rate[k] == 0:
            return 0.0
        return float(value[k] / rate[k])


def _little(rate: float, time: float) -> float:
    """What (m) an event function of this rate (m/s) that is zero now (s) may be off by."""
    return EXACT + abs(rate) * instant(time, EVENT_TIME)


class _Event:
    """Event function of one pair by parts of a step, positive until something happens."""

    def __init__(self, gap: FloatArray, place: FloatArray, length: float, way: float) -> None:
        self._gap, self._place = gap.tolist(), place.tolist()
        self._gap_rate, self._slip = (
            POLYNOMIAL.derivative(own[None])[0].tolist() for own in (gap, place)
        )
        self._length, self._way = length, way

    def value(self, part: float) -> float:
        """Its value (m) and `EXACT`: as little below zero as an event may leave it is nothing."""
        place = chebyshev_sum(self._place, part)
        beyond = max(-place, place - self._length)
        return self._way * max(chebyshev_sum(self._gap, part), beyond) + EXACT

    def rate(self, part: float) -> float:
        """Its slope (m per step), which changes its sign where gap and end of the face swap."""
        place = chebyshev_sum(self._place, part)
        if chebyshev_sum(self._gap, part) >= max(-place, place - self._length):
            return self._way * chebyshev_sum(self._gap_rate, part)
        slip = chebyshev_sum(self._slip, part)
        return self._way * (slip if place - self._length > -place else -slip)
