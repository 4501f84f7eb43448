"""How a link stands in its guide over time: free, on one point, on two; and lap by lap.

The four cases of a translational joint with clearance (Flores, Ambrosio, Claro and Lankarani,
Kinematics and dynamics of multibody systems with imperfect joints, 2008): no contact, one corner,
two corners on the same side, two on opposite sides. Here every pair of `SleeveHistory` that presses
is a point of contact.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from math import ceil, pi

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.observables.crank import crank_angle
from exudyn_flexlink.result import Result, SleeveHistory

FloatArray = NDArray[np.float64]


class State(IntEnum):
    """Case of Flores et al.: how the link touches its guide."""

    FREE = 0
    ONE_POINT = 1
    SAME_SIDE = 2
    OPPOSITE_SIDES = 3


@dataclass(frozen=True)
class ContactStates:
    """The state `state` (K,) holds from `time[k]` to `time[k + 1]` (K + 1,), s."""

    time: FloatArray
    state: NDArray[np.int64]

    def fractions(self, start: float = -np.inf, end: float = np.inf) -> dict[State, float]:
        """Part of the time from `start` to `end` (s) that each state holds; together 1."""
        edges = np.clip(self.time, max(start, self.time[0]), min(end, self.time[-1]))
        spans = np.diff(edges)
        whole = max(float(spans.sum()), 1e-300)
        return {case: float(spans[self.state == case].sum()) / whole for case in State}

    def at(self, time: FloatArray) -> NDArray[np.int64]:
        """State at instants (N,), s."""
        k = np.searchsorted(self.time, time, side="right") - 1
        return self.state[np.clip(k, 0, len(self.state) - 1)]

    def longest(self, cases: set[State]) -> tuple[float, float] | None:
        """Begin and end (s) of the longest time in one of the cases; None if there is none."""
        inside = np.isin(self.state, list(cases))
        spans = np.where(inside, np.diff(self.time), 0.0)
        k = int(np.argmax(spans)) if len(spans) else 0
        return (float(self.time[k]), float(self.time[k + 1])) if spans[k] > 0 else None


@dataclass(frozen=True)
class LapContacts:
    """What happened in one lap of the crank, or the part of it that was run."""

    lap: int
    fractions: dict[State, float]
    touches: int
    impulse: float  # N s
    energy_lost: float  # J
    longest: float  # s


def contact_states(result: Result, joint: str) -> ContactStates:
    """States of a sleeve over the whole run.

    Raises:
        ValueError: the result has no sleeve `joint`.

    """
    history = _sleeve(result, joint)
    touches, side = history.touches, np.array(history.sides)[history.touches.pair]
    first, last = float(result.time[0]), float(result.time[-1])
    edges = np.unique(np.concatenate([[first, last], touches.begin, touches.end]))
    edges = edges[(edges >= first) & (edges <= last)]
    upper, lower = (
        _pressing(edges, touches.begin[side == way], touches.end[side == way]) for way in (1, -1)
    )
    state = np.select(
        [(upper > 0) & (lower > 0), upper + lower >= 2, upper + lower == 1],
        [State.OPPOSITE_SIDES, State.SAME_SIDE, State.ONE_POINT],
        State.FREE,
    )
    return ContactStates(edges, state.astype(np.int64))


def lap_contacts(result: Result, joint: str) -> list[LapContacts]:
    """Contacts of a sleeve, lap by lap; a touch belongs to the lap in which it begins.

    Raises:
        ValueError: the result has no sleeve `joint`, or no crank.

    """
    states, touches = contact_states(result, joint), _sleeve(result, joint).touches
    turned = np.abs(crank_angle(result) - crank_angle(result)[0]) / (2 * pi)
    count = max(1, ceil(float(turned.max()) - 1e-9))
    grown = np.maximum.accumulate(turned)
    found = []
    for lap in range(1, count + 1):
        start, end = (float(np.interp(n, grown, result.time)) for n in (lap - 1, lap))
        mine = (touches.begin >= start) & ((touches.begin < end) | (lap == count))
        found.append(
            LapContacts(
                lap,
                states.fractions(start, end),
                int(mine.sum()),
                float(touches.impulse[mine].sum()),
                float(touches.energy_lost[mine].sum()),
                float((touches.end - touches.begin)[mine].max(initial=0.0)),
            )
        )
    return found


def sleeves_with_play(result: Result) -> list[str]:
    """Names of the sleeves whose link may touch or not."""
    return [name for name, sleeve in result.sleeves.items() if any(sleeve.sides)]


def _pressing(edges: FloatArray, begin: FloatArray, end: FloatArray) -> NDArray[np.int64]:
    """Number of touches that last over each interval between edges."""
    middle = (edges[1:] + edges[:-1]) / 2
    begun = np.searchsorted(np.sort(begin), middle)
    return np.asarray(begun - np.searchsorted(np.sort(end), middle))


def _sleeve(result: Result, joint: str) -> SleeveHistory:
    if joint not in result.sleeves:
        raise ValueError(f"the result has no sleeve '{joint}' with walls")
    return result.sleeves[joint]
