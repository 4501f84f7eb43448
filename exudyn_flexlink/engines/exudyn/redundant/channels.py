"""The pairs of a sleeve: after every step only those are looked at that may touch in the next.

Where the nodes are in the guide, and how fast, costs a microsecond each; a pair's own look, its
forces and its steps come only for the few that are near.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import cos, sin

from exudyn_flexlink.engines.exudyn.contact_log import ContactLog
from exudyn_flexlink.engines.exudyn.redundant.contacts import ContactItem
from exudyn_flexlink.engines.exudyn.redundant.instant import Instant
from exudyn_flexlink.engines.exudyn.redundant.system import System
from exudyn_flexlink.mechanism import Channel, Pace, deepest_allowed, node_anchor, pairs

AHEAD = 4  # steps that a pair is looked at before it can touch
NEAR = 0.05  # of the clearance, or of the shortest rod: nearer than this a pair is always looked at


class ChannelItems:
    """All pairs of one channel; `first` is the number of the first among the run's contacts."""

    def __init__(
        self, system: System, channel: Channel, first: int, pace: Pace, log: ContactLog
    ) -> None:
        self.channel, self.pace = channel, pace
        self.contacts = [
            ContactItem(system, contact, first + k, pace, log)
            for k, contact in enumerate(pairs(channel))
        ]
        self.deepest_allowed = deepest_allowed(channel)
        self._sides = 2 if channel.clearance > 0 else 1
        self._guide = 3 * channel.guide.part
        anchors = [node_anchor(channel, i) for i in range(len(channel.rods) + 1)]
        self._anchors = [(3 * anchor.part, anchor.x) for anchor in anchors]
        self._near = NEAR * (channel.clearance or min(channel.lengths))
        self._watched: list[int] = list(range(len(self.contacts)))

    def looked_at(self, now: Instant, step: float) -> list[ContactItem]:
        """Contacts that act, or may begin to within a few steps."""
        chosen = dict.fromkeys(k for k in self._watched if self.contacts[k].watched)
        ahead = AHEAD * max(step, now.done)
        places = self._places(now.q_list, now.v_list)
        for i, (x, y, u, v) in enumerate(places):
            margin = abs(u) * ahead + self._near
            if -margin <= x <= self.channel.length + margin:
                chosen.update(dict.fromkeys(self._walls(i, y, v, ahead)))
        for i, ((x0, y0, u0, v0), (x1, y1, u1, v1)) in enumerate(pairwise(places)):
            margin = max(abs(u0), abs(u1)) * ahead + self._near
            low, high = min(x0, x1) - margin, max(x0, x1) + margin
            speed = max(abs(v0), abs(v1))  # across
            for mouth, x in enumerate((0.0, self.channel.length)):
                if low <= x <= high:
                    span = (min(y0, y1) - speed * ahead, max(y0, y1) + speed * ahead)
                    chosen.update(dict.fromkeys(self._corners(i, mouth, span)))
        self._watched = list(chosen)
        return [self.contacts[k] for k in self._watched]

    def _places(
        self, q: Sequence[float], v: Sequence[float]
    ) -> list[tuple[float, float, float, float]]:
        """Place of every node along and across the guide, and the rates of both."""
        j = self._guide
        x0, y0, u0, v0, turning = q[j], q[j + 1], v[j], v[j + 1], v[j + 2]
        c, s = cos(q[j + 2]), sin(q[j + 2])
        x_at, y_at = self.channel.guide.x, self.channel.guide.y
        found = []
        for i, arm in self._anchors:
            rx, ry = arm * cos(q[i + 2]), arm * sin(q[i + 2])
            dx, dy = q[i] + rx - x0, q[i + 1] + ry - y0
            ux, uy = v[i] - v[i + 2] * ry - u0, v[i + 1] + v[i + 2] * rx - v0
            x, y = c * dx + s * dy, c * dy - s * dx
            along, across = c * ux + s * uy + turning * y, c * uy - s * ux - turning * x
            found.append((x - x_at, y - y_at, along, across))
        return found

    def _walls(self, node: int, y: float, rate: float, ahead: float) -> list[int]:
        if self._sides == 1:
            return [node]
        room = self.channel.clearance - self._near
        if y + max(rate, 0.0) * ahead > room:
            return [2 * node]
        if y + min(rate, 0.0) * ahead < -room:
            return [2 * node + 1]
        return []

    def _corners(self, rod: int, mouth: int, span: tuple[float, float]) -> list[int]:
        """Contacts of a rod in a mouth, which will stay within `span` across the guide, m."""
        first = self._sides * len(self._anchors) + 2 * self._sides * rod + self._sides * mouth
        if self._sides == 1:
            return [first]
        low, high = span
        room = self.channel.clearance - self._near
        return [first] * (high > room) + [first + 1] * (low < -room)
