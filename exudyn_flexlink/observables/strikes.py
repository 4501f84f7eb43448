"""Strikes: bursts of contact, and whether a struck body comes to rest between them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import nan, pi

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.observables.crank import crank_angle, crank_joint, lap_of, turns
from exudyn_flexlink.observables.levers import lever_response
from exudyn_flexlink.observables.watched import Watched
from exudyn_flexlink.result import Event, Result

FloatArray = NDArray[np.float64]

IMPACT = "impact"  # kind of an event: contact without duration, of an engine with impulses
SAME_STRIKE = pi / 2  # rad of crank angle without contact that ends a strike
LAST_PART = 0.05  # of the time between two strikes: the part in which the body should be at rest


@dataclass(frozen=True)
class Strike:
    """One strike: a burst of contacts and impacts, from the first touch to the last separation.

    `crank_angle` (rad, continuous) and `lap` (from 1) are those of the first touch; None and 1
    without a crank. `approach_speed` (m/s) and `place` (m along the face from its start) are those
    of the first touch, `impulse` (N s) and `energy_lost` (J) sums over its contacts, nan where the
    engine does not say or the strike still lasts at the end of the run (`ended` is False).
    `peak_force` (N) is the largest, whatever is sampled; nan with an impact, an impulse without
    duration, whose force has no bound. `contacts` counts impacts too.
    """

    contact: str
    lap: int
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


@dataclass(frozen=True)
class _Touch:
    """One interval of contact, with the details of the events that begin and end it.

    An impact is an interval without duration, that its one event begins and ends.
    """

    first: Event
    last: Event | None
    end: float

    @property
    def instant(self) -> bool:
        return self.first is self.last

    def loss(self, key: str) -> float:
        return self.last.details.get(key, nan) if self.last else nan


def strikes(result: Result, contact: str) -> list[Strike]:
    """Strikes of a contact, in order.

    Where the crank goes round, contacts belong to one strike unless the crank turns by a quarter
    turn between them: micro-impacts and the pushing that follows are one strike, those of two laps
    are not. Without such a crank there is no measure of what belongs together, and every contact or
    impact is a strike of its own.

    Raises:
        ValueError: the scene has no such contact.

    """
    if contact not in result.scene.contacts:
        raise ValueError(f"the scene has no contact '{contact}'")
    touches = sorted(_touches(result, contact), key=lambda touch: touch.first.time)
    angle = crank_angle(result) if crank_joint(result.scene) is not None else None
    bursts: list[list[_Touch]] = []
    for touch in touches:
        if bursts and angle is not None and turns(result):
            apart_since = max(earlier.end for earlier in bursts[-1])
            between = np.interp([apart_since, touch.first.time], result.time, angle)
            if abs(float(between[1] - between[0])) < SAME_STRIKE:
                bursts[-1].append(touch)
                continue
        bursts.append([touch])
    return [_strike(result, contact, burst, angle) for burst in bursts]


def _touches(result: Result, contact: str) -> Iterator[_Touch]:
    """Intervals of contact. One that slides off the face may have no other end than that."""
    open_: _Touch | None = None
    for event in result.events:
        if event.name != contact:
            continue
        if event.kind == IMPACT:
            yield _Touch(event, event, event.time)
        elif event.kind == "contact begins":
            if open_ is not None:
                yield replace(open_, end=min(open_.end, event.time))
            open_ = _Touch(event, None, float(result.time[-1]))
        elif event.kind == "leaves the face" and open_ is not None:
            open_ = _Touch(open_.first, event, event.time)
        elif event.kind == "contact ends" and open_ is not None:
            yield _Touch(open_.first, event, event.time)
            open_ = None
    if open_ is not None:
        yield open_


def _strike(result: Result, contact: str, burst: list[_Touch], angle: FloatArray | None) -> Strike:
    first, history = burst[0].first, result.contacts[contact]
    begin, end = first.time, max(touch.end for touch in burst)
    place = float(np.interp(begin, result.time, history.place))
    lap = 1
    if angle is not None:
        index = int(np.searchsorted(result.time, begin))
        lap = int(lap_of(angle)[min(index, len(angle) - 1)])
    return Strike(
        contact=contact,
        lap=lap,
        begin=begin,
        end=end,
        crank_angle=None if angle is None else float(np.interp(begin, result.time, angle)),
        approach_speed=first.details.get("approach_speed", nan),
        place=first.details.get("place", place),
        impulse=sum(touch.loss("impulse") for touch in burst),
        energy_lost=sum(touch.loss("energy_lost") for touch in burst),
        peak_force=_peak_force(result, burst, (begin, end)),
        contacts=len(burst),
        ended=all(touch.last is not None for touch in burst),
    )


def _peak_force(result: Result, burst: list[_Touch], during: tuple[float, float]) -> float:
    if any(touch.instant for touch in burst):
        return nan
    contact = burst[0].first.name
    told = [touch.last.details.get("peak_force", 0.0) for touch in burst if touch.last]
    found = result.extremes[Watched.of_contact(contact)[0]].between(*during).value
    if not len(found) and not told:  # a point that lies on a rigid face as the run ends
        inside = (result.time >= during[0]) & (result.time <= during[1])
        found = result.contacts[contact].force[inside]
    return max(float(np.max(found, initial=0.0)), *told, 0.0)


def settled(result: Result, contact: str, before: float) -> float:
    """How far the struck body is from rest again just before time `before` (the next strike), s.

    Its largest angle in the last 5 % of the time since the strike before, as a fraction of its
    largest angle in all of that time; nan if there was no strike before, or nothing moved.

    Raises:
        ValueError: the scene has no such contact.

    """
    earlier = [strike.begin for strike in strikes(result, contact) if strike.begin < before]
    if not earlier:
        return nan
    response = lever_response(result, contact)
    at_last = abs(float(np.interp(before, response.time, response.angle)))
    peak, late = (
        max(at_last, abs(response.between(begin, before).farthest))
        for begin in (earlier[-1], before - LAST_PART * (before - earlier[-1]))
    )
    return late / peak if peak else nan
