"""When a pair of link and guide begins or ceases to press, within a step: see `pair_events`."""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray, IndexArray
from exudyn_flexlink.engines.exudyn.faces import Touch
from exudyn_flexlink.engines.exudyn.minimal.coordinates import TreeState
from exudyn_flexlink.engines.exudyn.minimal.walls import Walls
from exudyn_flexlink.engines.pair_events import Seen, calm, changed, first_of, late_by
from exudyn_flexlink.integrate.radau import Step


class WallWatch:
    """Looks at steps; `seen` are all pairs at the end of the last one accepted."""

    def __init__(self, walls: Walls, x: FloatArray, v: FloatArray) -> None:
        self.walls = walls
        self._lengths, self._held = self.walls.faces.length, self.walls.faces.held
        self._any_held = bool(self._held.any())
        self.seen = self.walls.faces.look(x, v)
        self._ahead: tuple[TreeState, Seen] | None = None  # at the end of the last step looked at

    def _with_held_pairs_closed(self, seen: Seen) -> Seen:
        return seen.closed(self._held) if self._any_held else seen

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
        return Touch(*(float(column[k]) for column in self.seen))

    def changed(self, time: float, there: int | None = None) -> IndexArray:
        """Pairs that now (s), at an event of pair `there`, begin or cease to press."""
        seen = self._with_held_pairs_closed(self.seen)
        return np.flatnonzero(changed(seen, self._lengths, self.walls.touching, time, there))

    def first(self, step: Step, end: TreeState) -> tuple[float, int] | None:
        """Instant (s) and pair of the first event within a step; None if there is none."""
        if not self.walls.contacts:
            return None
        x, v = step.stages.kept.state[:2]
        x, v = np.concatenate([x[:-1], end.x[None]]), np.concatenate([v[:-1], end.v[None]])
        stages = self.walls.faces.look(x, v)
        self._ahead = end, stages.pick(-1)
        path = self._with_held_pairs_closed(self.seen.then(stages))
        pressing = self.walls.touching
        restless = np.flatnonzero(~calm(path, self._lengths, pressing, step.h))
        if not len(restless):
            return None
        at_once = self.changed(step.t)
        if len(at_once):
            return step.t, int(at_once[0])
        found = first_of(restless, path, self._lengths, pressing, step.h)
        return None if found is None else (step.t + found[0] * step.h, found[1])

    def late(self, k: int, end: TreeState, time: float) -> float:
        """How long (s) before a step's end at this time pair k's event was; negative: after."""
        seen = self._with_held_pairs_closed(self._at_end(end))
        return late_by(seen, self._lengths, k, time)
