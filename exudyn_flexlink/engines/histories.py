"""What a run recorded as its Result: what every engine tells alike, and no mechanics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite
from typing import Any, Protocol

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.recording import BlockRecorder, Kept
from exudyn_flexlink.intervals import Intervals
from exudyn_flexlink.mechanism import Contact, Mechanism, approach, pair_sides, pairs, spring_force
from exudyn_flexlink.result import (
    Checks,
    ContactHistory,
    EnergyHistory,
    Event,
    FrictionHistory,
    Result,
    SleeveHistory,
)
from exudyn_flexlink.scene import Scene


class Counted(Protocol):
    """Steps that were made: how many, the shortest and the longest (s), iterations in them."""

    steps: int
    smallest: float
    largest: float

    @property
    def iterations(self) -> int:
        """Newton's iterations; 0 of an explicit method."""


@dataclass(frozen=True)
class Histories:
    """A run at its samples, with the contacts at `places` (contacts,), m, as it ends.

    `poses` and `rates` are (samples, parts, 3).
    """

    scene: Scene
    made: Counted
    recorder: BlockRecorder
    kept: Kept
    poses: FloatArray
    rates: FloatArray
    places: FloatArray

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism that was recorded."""
        return self.recorder.mechanism

    def result(
        self,
        laps: Sequence[Event],
        joint_forces: Mapping[str, FloatArray],
        *,
        gears: Mapping[str, FloatArray] | None = None,
        frictions: tuple[FloatArray, FloatArray] | None = None,
        steps_per_contact: float = inf,
        **own: Any,
    ) -> Result:
        """Return the Result, but for versions and timings; `own` are fields that an engine knows.

        `gears` are multipliers (samples,) by name, `frictions` (samples, joints) whether a joint
        rests and its torque. A lap that begins as the run ends is none.
        """
        poses, rates, mechanism, recorder = self.poses, self.rates, self.mechanism, self.recorder
        energies = recorder.energies(self.kept, poses, rates)
        toothed = [(gear, gears[gear.name]) for gear in mechanism.gears] if gears else []
        return Result(
            scene=self.scene,
            versions={},
            timings={},
            part_names=tuple(part.name for part in mechanism.parts),
            time=self.kept.t,
            poses=poses,
            rates=rates,
            joint_forces={**joint_forces, **self._bearing_forces()},
            spring_forces={
                spring.name: spring_force(spring, poses, rates)
                for spring in mechanism.linear_springs
                if spring.name in self.scene.springs
            },
            contacts=self._of(mechanism.contacts, 0),
            bearings=self._of(mechanism.bearings, len(mechanism.contacts)),
            sleeves=self._sleeves(),
            energy=EnergyHistory(*energies.T),
            extremes=recorder.seeker.extremes(),
            laps=tuple(lap for lap in laps if lap.time < recorder.grid[-1]),
            checks=self._checks(steps_per_contact),
            frictions={} if frictions is None else self._frictions(*frictions),
            gear_forces={gear.name: own for gear, own in toothed if gear.in_newtons},
            gear_torques={gear.name: own for gear, own in toothed if not gear.in_newtons},
            **own,
        )

    def _checks(self, steps_per_contact: float) -> Checks:
        """Checks of a run; what stops and ropes do is a stretch, or an angle, no penetration."""
        recorder, made = self.recorder, self.made
        others = {*self.scene.stops, *self.scene.ropes}
        own = [contact.name not in others for contact in recorder.contacts]
        return Checks(
            energy_residual=recorder.energy_residual,
            largest_kinetic_energy=recorder.largest_kinetic_energy,
            constraint_error=recorder.constraint_error,
            steps=made.steps,
            newton_iterations=made.iterations,
            smallest_step=made.smallest if isfinite(made.smallest) else 0.0,
            largest_step=made.largest,
            steps_per_contact=steps_per_contact,
            largest_penetration=float(recorder.seeker.deepest[own].max(initial=0.0)),
        )

    def _of(self, contacts: Sequence[Contact], first: int) -> dict[str, ContactHistory]:
        found = {}
        for k, contact in enumerate(contacts, start=first):
            at, force = approach(contact, self.poses, self.rates), self.kept.press[:, k]
            found[contact.name] = ContactHistory(at.gap, at.place, force, self._touches(k, k + 1))
        return found

    def _touches(self, first: int, last: int) -> Intervals:
        """Touches of the contacts from `first` to before `last`, as pairs of one."""
        return self.recorder.intervals(first, self.places[first:last])

    def _sleeves(self) -> dict[str, SleeveHistory]:
        """Of the channels, by the names of their joints."""
        found, first = {}, len(self.mechanism.touching)
        for channel in self.mechanism.channels:
            names = tuple(contact.name for contact in pairs(channel))
            last = first + len(names)
            deepest = float(self.recorder.seeker.deepest[first:last].max())
            touches = self._touches(first, last) if channel.clearance > 0 else Intervals.of()
            found[channel.name] = SleeveHistory(
                names, pair_sides(channel), self.kept.press[:, first:last], touches, deepest
            )
            first = last
        return found

    def _bearing_forces(self) -> dict[str, FloatArray]:
        """Force (samples, 2), N, of each joint with clearance on the body of its second point."""
        first = len(self.mechanism.contacts)
        return {
            own.name: -push_of(own, self.poses, self.rates, self.kept.press[:, k])
            for k, own in enumerate(self.mechanism.bearings, start=first)
        }

    def _frictions(self, *columns: FloatArray) -> dict[str, FrictionHistory]:
        """Of joints with friction, by name; where one begins or ends to rest is a sample."""
        time, found = self.kept.t, {}
        for k, friction in enumerate(self.mechanism.frictions):
            resting, torque, lost = (own[:, k] for own in (*columns, self.kept.totals[:, 2:]))
            edges = np.flatnonzero(np.diff(resting.astype(bool), prepend=False, append=False))
            begin, last = time[edges[::2]], edges[1::2] - 1
            end = np.where(last == len(time) - 1, inf, time[last])
            lasts = end > begin
            found[friction.name] = FrictionHistory(torque, lost, begin[lasts], end[lasts])
        return found


def push_of(contact: Contact, q: FloatArray, v: FloatArray, press: FloatArray) -> FloatArray:
    """Force (instants, 2), N, on the first part where it presses by `press` (instants,), N."""
    at = approach(contact, q, v)
    push = press[:, None] * at.normal
    if contact.friction is not None:
        push = push + (at.grip * contact.friction.force(press, at.slip))[:, None] * at.along
    return np.asarray(push)
