"""When each pair of link and guide touched, from the integrator's steps.

The walls' forces are part of the equations all the time, so that no event must stop the integration
for them: the error control shortens its steps where they set in, and a step is never longer than a
part of a contact. Beginnings and ends are then found by bisection in the dense output.
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
            self._integrate(end, dense, states)
            for k in np.flatnonzero(acting != acted).tolist():
                self._change(k, end, dense, bool(acting[k]))
            for k, touch in self._open.items():
                touch.peak = max(touch.peak, float(states[k, PRESS]))
            self.deepest = max(self.deepest, float(-states[:, GAP].min()))
        self._time, self._states = end, states

    def jump(self, t: float, y: FloatArray) -> None:
        """Speeds jumped at the end of the step."""
        self._states = self.system.wall_states(t, y)

    def history(self, force: FloatArray) -> SleeveHistory:
        """All touches; what still touches ends now. `force` is (samples, pairs)."""
        rows = [*self.rows, *(self._row(k, touch, self._time) for k, touch in self._open.items())]
        rows = sorted(rows, key=lambda row: (row[1], row[0])) if self.channel.clearance > 0 else []
        columns = np.array(rows, dtype=float).reshape(-1, 7).T
        names = tuple(contact.name for contact in pairs(self.channel))
        touches = Touches(columns[0].astype(np.int64), *columns[1:])
        return SleeveHistory(names, pair_sides(self.channel), force, touches, self.deepest)

    def _integrate(self, end: float, dense: Dense, states: FloatArray) -> None:
        """Simpson's rule over the step, for impulses and the work done on each pair."""
        middle = self.system.wall_states((self._time + end) / 2, dense((self._time + end) / 2))
        weight = (end - self._time) / 6
        for part, times in ((self._states, 1), (middle, 4), (states, 1)):
            self._impulse += weight * times * part[:, PRESS]
            power = part[:, PRESS] * part[:, GAP_RATE] + part[:, RUB] * part[:, SLIP]
            self._work -= weight * times * power

    def _change(self, k: int, end: float, dense: Dense, begins: bool) -> None:
        """A pair began or ended to touch within the step."""
        before, after = self._time, end
        for _ in range(HALVINGS):
            middle = (before + after) / 2
            acts = self.system.wall_states(middle, dense(middle))[k, GAP] < 0
            before, after = (before, middle) if acts == begins else (middle, after)
        if begins:
            speed = -self.system.wall_states(after, dense(after))[k, GAP_RATE]
            self._open[k] = _Open(after, float(speed), self._impulse[k], self._work[k])
        elif k in self._open:
            self.rows.append(self._row(k, self._open.pop(k), after))

    def _row(self, k: int, touch: _Open, end: float) -> Row:
        impulse, lost = self._impulse[k] - touch.impulse, self._work[k] - touch.work
        return (k, touch.begin, end, float(impulse), float(lost), touch.peak, touch.speed)
