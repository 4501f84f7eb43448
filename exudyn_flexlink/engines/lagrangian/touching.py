"""Which pairs of link and guide touch now, and what was made of every touch: a table.

Touches begin and end by events of the system; between them impulses and energies are integrals
over steps in which all forces are smooth.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from math import inf
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.lagrangian.constants import Constants
from exudyn_flexlink.engines.lagrangian.track_point import TrackPoint
from exudyn_flexlink.engines.lagrangian.wall_events import (
    EXACT,
    NONE,
    calm,
    first_changed,
)
from exudyn_flexlink.engines.lagrangian.walls import (
    GAP,
    INSIDE,
    look,
    wall_forces,
    wall_work,
)
from exudyn_flexlink.intervals import Interval, Intervals
from exudyn_flexlink.mechanism import Channel, approach, pair_sides, pairs
from exudyn_flexlink.result import SleeveHistory

At = tuple[FloatArray, FloatArray, TrackPoint]  # coordinates, speeds, and P
Poses = Callable[[FloatArray, FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
FORCE_SAMPLES = 32  # even parts of a step, at whose ends the largest force is looked for


class Rule(NamedTuple):
    """How values at n nodes of a step become integrals, and values in between."""

    weights: FloatArray  # (n,) of the step's length
    between: FloatArray  # (p, n): values at even parts of the step
    slopes: FloatArray  # (p, n): slopes there, by the part of the step

    @classmethod
    def of(cls, nodes: FloatArray, weights: FloatArray) -> Rule:
        """Return the rule of nodes (n,), parts of the step, by the polynomial through them."""
        powers, parts = np.arange(len(nodes)), np.linspace(0.0, 1.0, FORCE_SAMPLES + 1)[:, None]
        of_values = np.linalg.inv(nodes[:, None] ** powers)
        slopes = powers * parts ** np.maximum(powers - 1, 0)
        return cls(weights, parts**powers @ of_values, slopes @ of_values)


@dataclass
class Walls:
    """The pairs of one channel; `deepest` is the largest penetration so far, m.

    `poses` gives poses and rates (n, parts, 3) of all parts at q, v (n, N) and P (n, 6).
    """

    channel: Channel
    constants: Constants
    poses: Poses
    deepest: float = 0.0
    intervals: list[Interval] = field(default_factory=list)  # those that ended
    _open: dict[int, Interval] = field(default_factory=dict)  # by pair, as far as they went

    def __post_init__(self) -> None:
        self._faces = pairs(self.channel)
        self.touching = np.zeros(len(self._faces), dtype=np.int64)
        self._two_sided = self.channel.clearance == 0
        self._seen: FloatArray | None = None

    def compile(self, q: FloatArray, v: FloatArray, point: TrackPoint) -> None:
        """Have everything compiled that says who touches, and what is made of touches."""
        seen = look(q, v, point, self.constants).pairs
        first_changed(seen, self.touching, self._two_sided)
        calm(seen, seen, self.touching, self._two_sided, 0.0)
        motion = q[None], v[None], np.array([point])
        wall_work(*motion, self.touching, self.constants)
        wall_forces(*motion, self.constants)

    def event_functions(self, q: FloatArray, v: FloatArray, point: TrackPoint) -> list[float]:
        """Values at whose fall below zero a pair begins or ceases to touch, m."""
        seen = look(q, v, point, self.constants).pairs
        gap, inside = seen[:, GAP], seen[:, INSIDE]
        if self._two_sided:
            gap = np.full(len(seen), -inf)
        until = np.where(self.touching != 0, np.minimum(-gap, inside), np.maximum(gap, -inside))
        return [float(value) for value in until]

    def quiet(self, done: float, q: FloatArray, v: FloatArray, point: TrackPoint) -> bool:
        """Tell whether no pair can have changed in the last step, of length `done` (s)."""
        before, self._seen = self._seen, look(q, v, point, self.constants).pairs
        if before is None:
            return False
        return bool(calm(before, self._seen, self.touching, self._two_sided, done))

    def forget(self) -> None:
        """What was seen last is no end of a step any more."""
        self._seen = None

    def settle(self, t: float, at: At) -> None:
        """Take in which pairs begin to touch at t (s), or cease to."""
        seen = look(*at, self.constants).pairs
        for _ in seen:
            k = first_changed(seen, self.touching, self._two_sided)
            if k == NONE:
                return
            self.change(t, int(k), at)

    def change(self, t: float, k: int, at: At) -> None:
        """Pair k begins to touch, or ceases to."""
        self.touching[k] = 1 - self.touching[k]
        q, v, point = at
        poses, rates = self.poses(q[None], v[None], np.array([point]))
        seen = approach(self._faces[k], poses[0], rates[0])
        place, rate = float(seen.place), float(seen.gap_rate)
        if self.touching[k]:
            self._open[k] = Interval(t, inf, place, place, approach_speed=-rate, pair=k)
        else:
            ended = replace(
                self._open.pop(k),
                end=t,
                end_place=place,
                separation_speed=rate,
                slides_off=bool(seen.gap < -EXACT),
            )
            self.intervals.append(ended)

    def take(
        self,
        lengths: FloatArray,
        rule: Rule,
        motion: tuple[FloatArray, FloatArray, FloatArray],
    ) -> None:
        """Take steps in a row in which nothing changes, of some lengths (m,), s.

        The motion at the n nodes of each is q, v (m n, N) and P (m n, 6).
        """
        if not self._open:
            return
        work = wall_work(*motion, self.touching, self.constants)
        work = work.reshape(len(lengths), len(rule.weights), -1, 3)[lengths > 0]
        lengths = lengths[lengths > 0]
        if not len(lengths):
            return
        for k, touch in self._open.items():
            press, power, depth = (work[:, :, k, column] for column in range(3))
            # A force that falls at once as the gap opens peaks between two nodes.
            depths, rates = depth @ rule.between.T, depth @ rule.slopes.T / lengths[:, None]
            hardest = float(self.channel.law.force(depths, rates).max())
            so_far = self._open[k] = replace(
                touch,
                impulse=touch.impulse + float(lengths @ press @ rule.weights),
                energy_lost=touch.energy_lost + float(lengths @ power @ rule.weights),
                peak_force=max(touch.peak_force, hardest),
                penetration=max(touch.penetration, float(depths.max())),
            )
            self.deepest = max(self.deepest, so_far.penetration)

    def stored(self, pressed: FloatArray) -> FloatArray:
        """Energy in all pairs, J, by the sums of their squared depths, m^2."""
        return np.asarray(self.channel.law.stored_energy(np.sqrt(pressed)))

    def history(self, force: FloatArray) -> SleeveHistory:
        """Every touch, and samples of the forces (samples, pairs)."""
        found = [*self.intervals, *self._open.values()] if self.channel.clearance > 0 else []
        names = tuple(contact.name for contact in self._faces)
        touches = Intervals.of(found)
        return SleeveHistory(names, pair_sides(self.channel), force, touches, self.deepest)
