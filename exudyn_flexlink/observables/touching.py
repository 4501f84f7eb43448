"""What touches when: states of links in guides and of journals in bearings over time; strikes.

A journal in its bearing is free, or on one point. A link in its guide has the four cases of a
translational joint with clearance (Flores, Ambrosio, Claro and Lankarani, Kinematics and dynamics
of multibody systems with imperfect joints, 2008): no contact, one corner, two corners on the same
side, two on opposite sides. Here every pair of `SleeveHistory` that presses is a point of contact,
so that a node in the mouth and the corner beside it count as two. Strikes are bursts of contact.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from enum import IntEnum
from math import nan, pi

import numpy as np

from exudyn_flexlink.arrays import BoolArray, FloatArray, IntArray
from exudyn_flexlink.observables.points import (
    crank_angle,
    crank_joint,
    first_passes,
    lap_of,
    laps,
    turned_since_start,
    turns,
)
from exudyn_flexlink.result import Interval, Result, SleeveHistory


class State(IntEnum):
    """Case of Flores et al.: how the link touches its guide."""

    FREE = 0
    ONE_POINT = 1
    SAME_SIDE = 2
    OPPOSITE_SIDES = 3

    @property
    def label(self) -> str:
        """The state in words that fit the head of a column."""
        return ("free", "one point", "two, same side", "two, opposite")[self]


TWO_POINTS = (State.SAME_SIDE, State.OPPOSITE_SIDES)
"""States with two points of contact or more."""


@dataclass(frozen=True)
class ContactStates:
    """Instants `time` (K + 1,) s, and the `state` (K,) that holds from each to the next.

    A run of one instant has no time for any state: K = 0.
    """

    time: FloatArray
    state: IntArray

    def fractions(self, start: float = -np.inf, end: float = np.inf) -> dict[State, float]:
        """Part of the time from `start` to `end` (s) that each state holds; together 1.

        All 0 if that is no time at all.
        """
        spans = np.diff(np.clip(self.time, start, max(start, end)))
        whole = float(spans.sum()) or 1.0
        return {case: float(spans[self.state == case].sum()) / whole for case in State}

    def at(self, time: FloatArray) -> IntArray:
        """State at instants (N,), s."""
        if not len(self.state):
            return np.full(np.shape(time), State.FREE, dtype=np.int64)
        k = np.searchsorted(self.time, time, side="right") - 1
        return self.state[np.clip(k, 0, len(self.state) - 1)]

    def stretches(self, cases: Collection[State]) -> FloatArray:
        """Begin and end (K, 2) s of every time that is spent in any of the cases, in order."""
        inside = np.isin(self.state, list(cases)).astype(int)
        change = np.diff(inside, prepend=0, append=0)
        edges = (np.flatnonzero(change > 0), np.flatnonzero(change < 0))
        return np.stack([self.time[edge] for edge in edges], axis=1)

    def impacts(self, start: float = -np.inf, end: float = np.inf) -> int:
        """Number of times from `start` to before `end` (s) that the free link meets its guide."""
        met = np.flatnonzero((self.state[1:] > 0) & (self.state[:-1] == 0)) + 1
        return int(np.sum((self.time[met] >= start) & (self.time[met] < end)))


@dataclass(frozen=True)
class ContactTotals:
    """What happened in a stretch of time.

    `touches` counts every touch of a pair, `impacts` how often the free link met its guide;
    `longest` (s) is the longest touch of one pair.
    """

    fractions: dict[State, float]
    touches: int
    impacts: int
    impulse: float  # N s
    energy_lost: float  # J
    longest: float  # s


@dataclass(frozen=True)
class PairTotals:
    """Totals of one pair: number and time of its touches, impulse, energy lost, peak force."""

    pair: str
    touches: int
    time: float  # s
    impulse: float  # N s
    energy_lost: float  # J
    peak_force: float  # N


def contact_states(result: Result, joint: str) -> ContactStates:
    """States of a joint with clearance over the whole run."""
    history = _walls(result, joint)
    touches, side = history.touches, np.array(history.sides)[history.touches.pair]
    first, last = float(result.time[0]), float(result.time[-1])
    edges = np.unique(np.concatenate([[first, last], touches.begin, touches.end]))
    edges = edges[(edges >= first) & (edges <= last)]
    middles = (edges[1:] + edges[:-1]) / 2
    upper, lower = (touches.where(side == way).lasting(middles) for way in (1, -1))
    state = np.select(
        [(upper > 0) & (lower > 0), upper + lower >= 2, upper + lower == 1],
        [State.OPPOSITE_SIDES, State.SAME_SIDE, State.ONE_POINT],
        State.FREE,
    )
    return ContactStates(edges, state.astype(np.int64))


def contact_totals(
    result: Result, joint: str, start: float = -np.inf, end: float = np.inf
) -> ContactTotals:
    """Contacts of a joint from `start` to `end` (s), without those that begin at `end`."""
    states, touches = contact_states(result, joint), _walls(result, joint).touches
    selected = touches.where((touches.begin >= start) & (touches.begin < end))
    return ContactTotals(
        states.fractions(start, end),
        len(selected),
        states.impacts(start, end),
        float(selected.impulse.sum()),
        float(selected.energy_lost.sum()),
        float((selected.until(states.time[-1]) - selected.begin).max(initial=0.0)),
    )


def lap_contacts(result: Result, joint: str) -> list[ContactTotals]:
    """Contacts of a joint in every lap, the last perhaps cut short, in order.

    A touch belongs to the lap in which it begins.
    """
    starts = lap_starts(result)
    ends = [*starts[1:], np.inf]
    return [contact_totals(result, joint, *lap) for lap in zip(starts, ends, strict=True)]


def lap_starts(result: Result) -> list[float]:
    """Instants (s) at which laps begin: the crank has made 0, 1, .. turns for the first time."""
    made = turned_since_start(result) / (2 * np.pi)
    later = first_passes(result.time, made, np.arange(1, laps(result).max()))
    return [float(result.time[0]), *later.tolist()]


def pair_totals(result: Result, joint: str) -> list[PairTotals]:
    """Pairs of a joint that touched at all, those that touched longest first."""
    history = _walls(result, joint)
    totals = []
    for k in np.unique(history.touches.pair).tolist():
        selected = history.touches.where(history.touches.pair == k)
        totals.append(
            PairTotals(
                history.pairs[k],
                len(selected),
                float((selected.until(result.time[-1]) - selected.begin).sum()),
                float(selected.impulse.sum()),
                float(selected.energy_lost.sum()),
                float(selected.peak_force.max()),
            )
        )
    return sorted(totals, key=lambda pair: -pair.time)


def sleeves_with_play(result: Result) -> list[str]:
    """Names of the sleeves with clearance."""
    return [name for name, sleeve in result.sleeves.items() if any(sleeve.sides)]


def joints_with_play(result: Result) -> list[str]:
    """Names of the joints with clearance: revolute ones, then sleeves."""
    return [*result.bearings, *sleeves_with_play(result)]


def deepest(result: Result, joint: str) -> float:
    """Largest penetration (m) of a joint's contacts; 0 if it has none."""
    if joint in result.bearings:
        return float(result.bearings[joint].touches.penetration.max(initial=0.0))
    return result.sleeves[joint].deepest if joint in result.sleeves else 0.0


def flight_gaps(result: Result, name: str) -> FloatArray | None:
    """Largest gap (K,) m after each touch of a contact or bearing, until the next one begins.

    It is the top of the parabola through the sample with the largest gap and its neighbours. It is
    nan if no sample is free of the face, or none is in front of it, as after a point has slid off
    its end. None for sleeves: no gap of them is kept.
    """
    history = result.contacts.get(name) or result.bearings.get(name)
    if history is None:
        return None
    touches, time, largest = history.touches, result.time, []
    nexts = np.append(touches.begin[1:], np.inf)
    edges = zip(*(np.searchsorted(time, edge) for edge in (touches.end, nexts)), strict=True)
    for first, last in edges:
        gaps = history.gap[first:last]
        gap = float(gaps.max(initial=0.0))
        top = first + int(gaps.argmax()) if len(gaps) else 0
        if first < top < last - 1:
            around = slice(top - 1, top + 2)
            since = time[around] - time[top]
            scaled = since / since[2]
            bend, slope, _ = np.polyfit(scaled, history.gap[around], 2)
            if bend < 0:
                gap -= 0.25 * slope**2 / bend
        largest.append(gap if gap > 0 else nan)
    return np.array(largest)


def _walls(result: Result, joint: str) -> SleeveHistory:
    """Contacts of a joint by pairs; a journal in its bearing is one pair."""
    if joint in result.sleeves:
        return result.sleeves[joint]
    if joint not in result.bearings:
        raise ValueError(f"the result has no joint '{joint}' with walls")
    bearing = result.bearings[joint]
    pair = (f"{joint}: journal in its bearing",)
    return SleeveHistory(
        pair, (1.0,), bearing.force[:, None], bearing.touches, deepest(result, joint)
    )


SAME_STRIKE = pi / 2  # rad of crank angle; so much without contact ends a strike


@dataclass(frozen=True)
class Strike:
    """One strike: a burst of contacts and impacts, from the first touch to the last separation.

    `crank_angle` (rad, continuous) and `lap` (from 1) are those of the first touch; None without a
    joint that turns, and without one that goes round. `approach_speed` (m/s) and `place` (m along
    the face from its start) are those of the first touch, `impulse` (N s) and `energy_lost` (J)
    sums over its contacts, nan where the strike still lasts at the end of the run (`ended` is
    False). `peak_force` (N) is the largest, whatever is sampled; nan with an impact, an impulse
    without duration, whose force has no bound. `contacts` counts impacts too.
    """

    contact: str
    lap: int | None
    begin: float
    end: float
    crank_angle: float | None
    approach_speed: float
    place: float
    impulse: float
    energy_lost: float
    peak_force: float
    contacts: int
    ended: bool


def strikes(result: Result, contact: str) -> list[Strike]:
    """Strikes of a contact, in order.

    Where the crank goes round, contacts belong to one strike unless the crank turns by a quarter
    turn between them, to and fro: micro-impacts and the pushing that follows are one strike, those
    of two laps are not. Without such a crank there is no measure of what belongs together, and
    every contact or impact is a strike of its own.
    """
    if contact not in result.scene.all_contacts:
        known = ", ".join(result.scene.all_contacts) or "none"
        raise ValueError(f"the scene has no contact '{contact}'; there are: {known}")
    angle = crank_angle(result) if crank_joint(result.scene) is not None else None
    way = None if angle is None else np.append(0.0, np.cumsum(np.abs(np.diff(angle))))
    bursts: list[list[Interval]] = []
    goes_round, apart_since = turns(result), 0.0
    for interval in result.contacts[contact].touches:
        turned = np.inf
        if way is not None and goes_round and bursts:
            turned = np.ptp(np.interp([apart_since, interval.begin], result.time, way))
        if turned < SAME_STRIKE:
            bursts[-1].append(interval)
        else:
            bursts.append([interval])
        apart_since = max(apart_since, interval.end)
    return [_strike(result, contact, burst, angle, goes_round) for burst in bursts]


def _strike(
    result: Result, contact: str, burst: list[Interval], angle: FloatArray | None, goes_round: bool
) -> Strike:
    first, ended = burst[0], not any(interval.lasts for interval in burst)
    bounced = any(interval.impact for interval in burst)
    lap, angle_then = None, None
    if angle is not None:
        angle_then = float(np.interp(first.begin, result.time, angle))
        lap = int(lap_of(np.append(angle, angle_then))[-1]) if goes_round else None
    return Strike(
        contact=contact,
        lap=lap,
        begin=first.begin,
        end=min(max(interval.end for interval in burst), float(result.time[-1])),
        crank_angle=angle_then,
        approach_speed=first.approach_speed,
        place=first.place,
        impulse=sum(interval.impulse for interval in burst) if ended else nan,
        energy_lost=sum(interval.energy_lost for interval in burst) if ended else nan,
        peak_force=nan if bounced else max(interval.peak_force for interval in burst),
        contacts=len(burst),
        ended=ended,
    )


def touching(result: Result, time: FloatArray) -> BoolArray:
    """Whether anything touches, a contact or a wall, at instants (N,) s."""
    masks = touching_pairs(result, time).values()
    return np.asarray(np.any([np.zeros(len(time), dtype=bool), *masks], axis=0))


def touching_pairs(result: Result, time: FloatArray) -> dict[tuple[str, str], BoolArray]:
    """Whether each pair that can touch does, at instants (N,) s; by joint or contact, and pair."""
    masks = {}
    for name, touches in result.intervals.items():
        pairs = result.sleeves[name].pairs if name in result.sleeves else (name,)
        for k, pair in enumerate(pairs):
            masks[name, pair] = touches.where(touches.pair == k).lasting(time) > 0
    return masks
