"""When each pair of link and guide touched, from the integrator's steps.

The walls' forces are part of the equations all the time, so that no event must stop the integration
for them: the error control shortens its steps where they set in, and a step is never longer than a
part of a contact. Beginnings and ends are then found by bisection in the dense output. They cut the
step into parts in which all forces are smooth; impulses and energies are integrals over these.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.lagrangian.events import Dense
from exudyn_flexlink.engines.lagrangian.system import System
from exudyn_flexlink.engines.lagrangian.walls import GAP, GAP_RATE, PRESS, RUB, SLIP
from exudyn_flexlink.mechanism import Channel, pair_sides, pairs
from exudyn_flexlink.result import SleeveHistory, Touches

FloatArray = NDArray[np.float64]
Row = tuple[int, float, float, float, float, float, float]

HALVINGS = 30  # of a step, to find when a touch begins or ends
PLACES, WEIGHTS = np.polynomial.legendre.leggauss(4)  # of Gauss's rule on -1 .. 1


@dataclass
class _Open:
    """A touch that lasts: since when, how fast it began, totals before, largest force."""

    begin: float
    speed: float
    impulse: float
    work: float
    peak: float = 0.0


@dataclass
class WallWatch:
    """Follows the pairs of one channel; `deepest` is the largest penetration so far, m."""

    system: System
    channel: Channel
    deepest: float = 0.0
    rows: list[Row] = field(default_factory=list)
    _open: dict[int, _Open] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._time = 0.0
        self._states = self.system.wall_states(0.0, self.system.start)
        count = len(self._states)
        self._impulse, self._work = np.zeros(count), np.zeros(count)

    def step(self, end: float, dense: Dense) -> None:
        """Follow a step to `end` (s), whose states `dense` gives."""
        states = self.system.wall_states(end, dense(end))
        acting, acted = states[:, GAP] < 0, self._states[:, GAP] < 0
        if acting.any() or acted.any():
            if self.channel.clearance > 0:
                self._follow(end, dense, acting, acted)
            self._see(states)
        self._time, self._states = end, states

    def jump(self, t: float, y: FloatArray) -> None:
        """Speeds jumped at the end of the step."""
        self._states = self.system.wall_states(t, y)

    def stored(self, t: float, y: FloatArray) -> float:
        """Energy in all pairs in the state y at time t, J."""
        states = self._states if t == self._time else self.system.wall_states(t, y)
        return float(self.channel.law.stored_energy(-states[:, GAP]).sum())

    def history(self, force: FloatArray) -> SleeveHistory:
        """All touches; what still touches ends now. `force` is (samples, pairs)."""
        rows = [*self.rows, *(self._row(k, touch, self._time) for k, touch in self._open.items())]
        rows = sorted(rows, key=lambda row: (row[1], row[0])) if self.channel.clearance > 0 else []
        columns = np.array(rows, dtype=float).reshape(-1, 7).T
        names = tuple(contact.name for contact in pairs(self.channel))
        touches = Touches(columns[0].astype(np.int64), *columns[1:])
        return SleeveHistory(names, pair_sides(self.channel), force, touches, self.deepest)

    def _see(self, states: FloatArray) -> None:
        """Keep the largest penetration, and the largest force of each touch."""
        self.deepest = max(self.deepest, float(-states[:, GAP].min()))
        for k, touch in self._open.items():
            touch.peak = max(touch.peak, float(states[k, PRESS]))

    def _follow(
        self, end: float, dense: Dense, acting: NDArray[np.bool_], acted: NDArray[np.bool_]
    ) -> None:
        """Work off what begins and ends within a step, and integrate in between."""
        changed = np.flatnonzero(acting != acted).tolist()
        now = self._time
        for at, k in sorted((self._change(k, end, dense, bool(acting[k])), k) for k in changed):
            self._integrate(now, at, dense)
            if acting[k]:
                speed = -self.system.wall_states(at, dense(at))[k, GAP_RATE]
                self._open[k] = _Open(at, float(speed), self._impulse[k], self._work[k])
            elif k in self._open:
                self.rows.append(self._row(k, self._open.pop(k), at))
            now = at
        self._integrate(now, end, dense)

    def _integrate(self, begin: float, end: float, dense: Dense) -> None:
        """Integrate impulses and the work done on each pair, where no touch begins or ends."""
        half = (end - begin) / 2
        if half <= 0 or not self._open:
            return
        for place, weight in zip(PLACES.tolist(), WEIGHTS.tolist(), strict=True):
            t = begin + half * (1 + place)
            states = self.system.wall_states(t, dense(t))
            self._see(states)
            self._impulse += half * weight * states[:, PRESS]
            power = states[:, PRESS] * states[:, GAP_RATE] + states[:, RUB] * states[:, SLIP]
            self._work -= half * weight * power

    def _change(self, k: int, end: float, dense: Dense, begins: bool) -> float:
        """Find when within the step a pair began or ended to touch."""
        before, after = self._time, end
        for _ in range(HALVINGS):
            middle = (before + after) / 2
            acts = self.system.wall_states(middle, dense(middle))[k, GAP] < 0
            before, after = (before, middle) if acts == begins else (middle, after)
        return after

    def _row(self, k: int, touch: _Open, end: float) -> Row:
        impulse, lost = self._impulse[k] - touch.impulse, self._work[k] - touch.work
        return (k, touch.begin, end, float(impulse), float(lost), touch.peak, touch.speed)
