"""What contacts did as the Result shows it, by name: samples, touches, forces on bodies."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import inf

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.intervals import Intervals
from exudyn_flexlink.mechanism import Contact, Mechanism, approach, pair_sides, pairs
from exudyn_flexlink.result import ContactHistory, FrictionHistory, SleeveHistory


@dataclass(frozen=True)
class Histories:
    """Those of a run's contacts, bearings and channels, at samples.

    `poses` and `rates` are (samples, parts, 3), `forces` (samples, contacts), N, press in contacts
    in the order of the run's numbers, which go `deepest` (contacts,), m. `touches` of so many
    contacts are told from a number on, as pairs of one.
    """

    mechanism: Mechanism
    poses: FloatArray
    rates: FloatArray
    forces: FloatArray
    deepest: FloatArray
    touches: Callable[[int, int], Intervals]

    def contacts(self) -> dict[str, ContactHistory]:
        """Of the scene's contacts."""
        return self._of(self.mechanism.contacts, 0)

    def bearings(self) -> dict[str, ContactHistory]:
        """Of the revolute joints with clearance."""
        return self._of(self.mechanism.bearings, len(self.mechanism.contacts))

    def _of(self, contacts: Sequence[Contact], first: int) -> dict[str, ContactHistory]:
        found = {}
        for k, contact in enumerate(contacts, start=first):
            at, force = approach(contact, self.poses, self.rates), self.forces[:, k]
            touches = self.touches(k, 1)
            found[contact.name] = ContactHistory(at.gap, at.place, force, touches)
        return found

    def sleeves(self) -> dict[str, SleeveHistory]:
        """Of the channels, by the names of their joints."""
        found = {}
        first = len(self.mechanism.touching)
        for channel in self.mechanism.channels:
            names = tuple(contact.name for contact in pairs(channel))
            count, last = len(names), first + len(names)
            deepest = float(self.deepest[first:last].max())
            free = channel.clearance > 0
            touches = self.touches(first, count) if free else Intervals.of()
            found[channel.name] = SleeveHistory(
                names, pair_sides(channel), self.forces[:, first:last], touches, deepest
            )
            first = last
        return found

    def bearing_forces(self) -> dict[str, FloatArray]:
        """Force (samples, 2), N, of each joint with clearance on the body of its second point."""
        first = len(self.mechanism.contacts)
        return {
            own.name: -push_of(own, self.poses, self.rates, self.forces[:, first + k])
            for k, own in enumerate(self.mechanism.bearings)
        }


def friction_histories(
    mechanism: Mechanism, time: FloatArray, *columns: FloatArray
) -> dict[str, FrictionHistory]:
    """Of joints with friction, by name; `columns` (samples, joints): whether it rests, T, losses.

    Where one begins or ends to rest is a sample.
    """
    found = {}
    for k, friction in enumerate(mechanism.frictions):
        resting, torque, lost = (column[:, k] for column in columns)
        edges = np.flatnonzero(np.diff(resting.astype(bool), prepend=False, append=False))
        begin, last = time[edges[::2]], edges[1::2] - 1
        end = np.where(last == len(time) - 1, inf, time[last])
        lasts = end > begin
        found[friction.name] = FrictionHistory(torque, lost, begin[lasts], end[lasts])
    return found


def gear_forces(
    mechanism: Mechanism, multipliers: Mapping[str, FloatArray], *, in_newtons: bool
) -> dict[str, FloatArray]:
    """Tangential forces (samples,), N, or torques, N m, of the gears that have them, by name."""
    gears = [gear.name for gear in mechanism.gears if gear.in_newtons == in_newtons]
    return {name: multipliers[name] for name in gears}


def push_of(contact: Contact, q: FloatArray, v: FloatArray, press: FloatArray) -> FloatArray:
    """Force (instants, 2), N, on the first part where it presses by `press` (instants,), N."""
    at = approach(contact, q, v)
    push = press[:, None] * at.normal
    if contact.friction is not None:
        push = push + (at.grip * contact.friction.force(press, at.slip))[:, None] * at.along
    return np.asarray(push)
