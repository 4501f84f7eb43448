"""Strikes: bursts of contact, and whether a struck body comes to rest between them."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan, pi

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.intervals import Interval
from exudyn_flexlink.observables.crank import crank_angle, crank_joint, lap_of, turns
from exudyn_flexlink.observables.levers import lever_response
from exudyn_flexlink.result import Result

SAME_STRIKE = pi / 2  # rad of crank angle without contact that ends a strike
LAST_PART = 0.05  # of the time between two strikes: the part in which the body should be at rest


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
    turn between them: micro-impacts and the pushing that follows are one strike, those of two laps
    are not. Without such a crank there is no measure of what belongs together, and every contact or
    impact is a strike of its own.
    """
    if contact not in result.scene.all_contacts:
        known = ", ".join(result.scene.all_contacts) or "none"
        raise ValueError(f"the scene has no contact '{contact}'; there are: {known}")
    angle = crank_angle(result) if crank_joint(result.scene) is not None else None
    bursts: list[list[Interval]] = []
    goes_round = turns(result)
    if angle is None or not goes_round:
        bursts = [[interval] for interval in result.contacts[contact].touches]
    else:
        apart_since = 0.0
        for interval in result.contacts[contact].touches:
            between = np.interp([apart_since, interval.begin], result.time, angle)
            if bursts and abs(float(between[1] - between[0])) < SAME_STRIKE:
                bursts[-1].append(interval)
                apart_since = max(apart_since, interval.end)
            else:
                bursts.append([interval])
                apart_since = interval.end
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


def settled(result: Result, contact: str, before: float) -> float:
    """How far the struck body is from rest again just before time `before` (the next strike), s.

    Its largest angle, or displacement, in the last 5 % of the time since the strike before, as a
    fraction of its largest in all of that time; nan if there was no strike before, or nothing
    moved.
    """
    earlier = [strike.begin for strike in strikes(result, contact) if strike.begin < before]
    if not earlier:
        return nan
    response = lever_response(result, contact)
    at_last = abs(float(np.interp(before, response.time, response.value)))
    peak, late = (
        max(at_last, abs(response.between(begin, before).farthest))
        for begin in (earlier[-1], before - LAST_PART * (before - earlier[-1]))
    )
    return late / peak if peak else nan
