"""Strikes: bursts of contact."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan, pi

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.intervals import Interval
from exudyn_flexlink.observables.crank import crank_angle, crank_joint, lap_of, turns
from exudyn_flexlink.result import Result

SAME_STRIKE = pi / 2  # rad of crank angle without contact that ends a strike


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
    lap, at = None, None
    if angle is not None:
        at = float(np.interp(first.begin, result.time, angle))
        lap = int(lap_of(np.append(angle, at))[-1]) if goes_round else None
    return Strike(
        contact=contact,
        lap=lap,
        begin=first.begin,
        end=min(max(interval.end for interval in burst), float(result.time[-1])),
        crank_angle=at,
        approach_speed=first.approach_speed,
        place=first.place,
        impulse=sum(interval.impulse for interval in burst) if ended else nan,
        energy_lost=sum(interval.energy_lost for interval in burst) if ended else nan,
        peak_force=nan if bounced else max(interval.peak_force for interval in burst),
        contacts=len(burst),
        ended=ended,
    )
