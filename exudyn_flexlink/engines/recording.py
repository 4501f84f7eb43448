"""The recorder of every run that controls its error: samples, touches, energies and checks.

A step is evaluated at its nodes (its start, and its stages or its end) and at the samples within
it. Energies dissipated and supplied, impulses and works of contacts are integrals of the
polynomials through the nodes, as accurate as the motion. An engine lets steps wait until they are
many, or until an event changes the equations; then it evaluates all their instants, and the rates
of the totals. `Histories` makes a Result of the record. It is the same for every engine, and has no
mechanics.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.arrays import BoolArray, FloatArray, IndexArray
from exudyn_flexlink.engines.touching import ExtremeSeeker, Touches
from exudyn_flexlink.integrate.problem import instant
from exudyn_flexlink.mechanism import (
    Channel,
    Contact,
    ContactShapes,
    EnergyMeter,
    Groove,
    Mechanism,
    approach,
    joint_residuals,
    poses_of,
    pressed_among,
    spring_force,
)
from exudyn_flexlink.result import (
    Checks,
    ContactHistory,
    EnergyHistory,
    Event,
    FrictionHistory,
    Intervals,
    Result,
    SleeveHistory,
)
from exudyn_flexlink.rounding import KNOT_TIME
from exudyn_flexlink.scene import Scene


class Counted(Protocol):
    """Number of steps that were made, their shortest and longest length (s), and iterations."""

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
        **more: Any,
    ) -> Result:
        """Return the Result without versions and timings; `more` are fields from the engine.

        Among these are `slot_forces` of slots without play. `gears` are multipliers (samples,) by
        name; `frictions` (samples, joints) tell whether a joint rests, and its torque. A lap that
        begins as the run ends does not count.
        """
        poses, rates, mechanism, recorder = self.poses, self.rates, self.mechanism, self.recorder
        energies = recorder.energies(self.kept, poses, rates)
        more["slot_forces"] = {**more["slot_forces"], **self._groove_forces()}
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
            gear_forces={gear.name: force for gear, force in toothed if gear.in_newtons},
            gear_torques={gear.name: torque for gear, torque in toothed if not gear.in_newtons},
            **more,
        )

    def _checks(self, steps_per_contact: float) -> Checks:
        """Checks of a run; the depth of a stop or rope is an angle or a stretch, no penetration."""
        recorder, made = self.recorder, self.made
        others = {*self.scene.stops, *self.scene.ropes}
        counted = [contact.name not in others for contact in recorder.contacts]
        return Checks(
            energy_residual=recorder.energy_residual,
            largest_kinetic_energy=recorder.largest_kinetic_energy,
            constraint_error=recorder.constraint_error,
            steps=made.steps,
            newton_iterations=made.iterations,
            smallest_step=made.smallest if isfinite(made.smallest) else 0.0,
            largest_step=made.largest,
            steps_per_contact=steps_per_contact,
            largest_penetration=float(recorder.seeker.deepest[counted].max(initial=0.0)),
        )

    def _of(self, contacts: Sequence[Contact], first: int) -> dict[str, ContactHistory]:
        poses = poses_of(self.poses, self.rates, self.kept.t)
        histories, seen = {}, ContactShapes(contacts).seen(poses)
        for i, contact in enumerate(contacts):
            k = first + i
            touches, force = self._touches(k, k + 1), self.kept.press[:, k]
            gap, place = (column[:, i].copy() for column in seen[:2])
            histories[contact.name] = ContactHistory(gap, place, force, touches)
        return histories

    def _touches(self, first: int, last: int) -> Intervals:
        """Touches of the contacts from `first` to before `last`, as pairs of one contact."""
        return self.recorder.intervals(first, self.places[first:last])

    def _sleeves(self) -> dict[str, SleeveHistory]:
        """Histories of channels, then of slots with play, by the names of their joints."""
        histories, first = {}, len(self.mechanism.touching)
        for channel in self.mechanism.channels:
            histories[channel.name] = self._of_walls(channel, first)
            first += len(channel.contacts)
        for first, groove in zip(self.mechanism.first_walls, self.mechanism.grooves, strict=True):
            histories[groove.name] = self._of_walls(groove, first)
        return histories

    def _of_walls(self, joint: Channel | Groove, first: int) -> SleeveHistory:
        """History of the walls of a joint; the first wall is contact number `first`."""
        names = tuple(contact.name for contact in joint.contacts)
        last = first + len(names)
        deepest = float(self.recorder.seeker.deepest[first:last].max())
        touches = self._touches(first, last) if joint.clearance > 0 else Intervals.of()
        force = self.kept.press[:, first:last]
        return SleeveHistory(names, joint.sides, force, touches, deepest)

    def _bearing_forces(self) -> dict[str, FloatArray]:
        """Force (samples, 2), N, of each joint with clearance on the body of its second point."""
        first = len(self.mechanism.contacts)
        return {
            bearing.name: -push_of(bearing, self.poses, self.rates, self.kept.press[:, k])
            for k, bearing in enumerate(self.mechanism.bearings, start=first)
        }

    def _groove_forces(self) -> dict[str, FloatArray]:
        """Force (samples, 2), N, of each slot with play on its pin."""
        forces, press = {}, self.kept.press
        for first, groove in zip(self.mechanism.first_walls, self.mechanism.grooves, strict=True):
            push = np.zeros((len(press), 2))
            for k, wall in enumerate(groove.contacts, start=first):
                push += push_of(wall, self.poses, self.rates, press[:, k])
            forces[groove.name] = push
        return forces

    def _frictions(self, *columns: FloatArray) -> dict[str, FrictionHistory]:
        """Histories of joints with friction, by name; rests begin and end at samples."""
        time, histories = self.kept.t, {}
        for k, friction in enumerate(self.mechanism.frictions):
            resting, torque, lost = (column[:, k] for column in (*columns, self.kept.totals[:, 2:]))
            edges = np.flatnonzero(np.diff(resting.astype(bool), prepend=False, append=False))
            begin, last = time[edges[::2]], edges[1::2] - 1
            end = np.where(last == len(time) - 1, inf, time[last])
            lasts = end > begin
            histories[friction.name] = FrictionHistory(torque, lost, begin[lasts], end[lasts])
        return histories


def push_of(contact: Contact, q: FloatArray, v: FloatArray, press: FloatArray) -> FloatArray:
    """Force (instants, 2), N, of a contact on its first part; `press` (instants,), N, is normal."""
    look = approach(contact, q, v, 0.0)  # its directions and slip are the same at any instant
    push = press[:, None] * look.normal
    if contact.friction is not None:
        push = push + (look.grip * contact.friction.force(press, look.slip))[:, None] * look.along
    return np.asarray(push)


AT_ONCE = 32  # steps that wait: more need more memory and save little time
BLOCK = 512  # steps, or instants in steps that wait, that are searched together


@dataclass(frozen=True)
class Totals:
    """Sums over a run, or their rates: views of one array (..., n), by name."""

    all: FloatArray
    contacts: int

    def of(self, totals: FloatArray) -> Totals:
        """Return views of another array (..., n)."""
        return Totals(totals, self.contacts)

    @property
    def damped(self) -> FloatArray:
        """Lost in dampers (...), J."""
        return np.asarray(self.all[..., 0])

    @property
    def supplied(self) -> FloatArray:
        """Supplied by drives (...), J."""
        return np.asarray(self.all[..., 1])

    @property
    def impulses(self) -> FloatArray:
        """Impulses of contacts (..., c), N s."""
        return np.asarray(self.all[..., 2 : 2 + self.contacts])

    @property
    def losses(self) -> FloatArray:
        """Energy that contacts take (..., c), J, with what they store until their touches end."""
        return np.asarray(self.all[..., 2 + self.contacts : 2 + 2 * self.contacts])

    @property
    def rubbed(self) -> FloatArray:
        """Lost by friction of joints (..., joints), J."""
        return np.asarray(self.all[..., 2 + 2 * self.contacts :])


class Kept(NamedTuple):
    """Rows of the record: instants (m,), s, and values at them.

    `places` (m, slots) are those on the whole curves, `press` (m, c) the contacts' forces (N),
    `pressed` (m, c) tells which of them press. `totals` (m, 2 + joints) are the energies lost, in
    dampers, contacts and friction, and supplied, then those lost by friction of joints (J);
    `of_engine` are the engine's arrays, with an axis of instants each.
    """

    t: FloatArray
    places: FloatArray
    press: FloatArray
    pressed: BoolArray
    totals: FloatArray
    of_engine: Any

    def pick(self, which: slice | IndexArray) -> Kept:
        """Return some of the instants."""
        of_engine = self.of_engine._make(column[which] for column in self.of_engine)
        return Kept._make((*(column[which] for column in self[:-1]), of_engine))


class Steps(NamedTuple):
    """Steps in a row, of lengths `h` (k,), s; contacts press through all of a step, or not at all.

    `nodes` (k, n) and `samples` (n,) are numbers of rows of the record: those of the steps' nodes,
    and those of the samples, in order. `of` (n,) are the numbers of the steps that have the
    samples.
    """

    t: FloatArray
    h: FloatArray
    nodes: IndexArray
    samples: IndexArray
    of: IndexArray


class BlockRecorder(ABC):
    """Takes every step; keeps samples at `grid` (s, increasing), at events and in contacts.

    The contacts are those of `seeker`. While a contact of the scene presses, the ends of steps are
    kept as samples, too, or every few of them, and a node in the middle of each step that has
    stages: an even grid misses the peaks of its force.
    """

    ends_kept = 1  # every so many ends of steps in contacts one is kept

    def __init__(
        self, mechanism: Mechanism, grid: FloatArray, seeker: ExtremeSeeker, touches: Touches
    ) -> None:
        self.mechanism, self.grid, self.seeker = mechanism, grid, seeker
        self.touches, self._marked = touches, len(mechanism.contacts)
        # From values at a step's nodes to coefficients of the polynomial through them.
        self._powers = np.linalg.inv(seeker.nodes[:, None] ** np.arange(len(seeker.nodes)))
        self.contacts, self.meter = seeker.contacts, EnergyMeter(mechanism)
        self.energy_residual = self.largest_kinetic_energy = self.constraint_error = 0.0
        self.frictions = len(mechanism.frictions)
        self._reached = self._totals()
        self._next = 1  # sample
        self._kept: list[Kept] = []
        self._last: Kept  # the end of the last step, before any event there
        self._ends: list[Kept] = []  # of the block
        self._steps: list[tuple[NDArray[Any], ...]] = []
        self._counted = 0
        self._start_energy: float | None = None

    # --- what an engine provides --------------------------------------------------------------

    @abstractmethod
    def record_waiting(self) -> None:
        """Record the steps that wait, see `_book`."""

    @abstractmethod
    def motion(self, rows: Kept) -> tuple[FloatArray, FloatArray]:
        """Poses and rates (m, parts, 3) at instants that are kept."""

    # --- samples ------------------------------------------------------------------------------

    def _until(self, end: float) -> int:
        """Return the number of samples up to an instant (s), included."""
        return int(np.searchsorted(self.grid, end * (1 + 1e-14), side="right"))

    def _due(self, end: float) -> FloatArray:
        """Samples (n,), s, of a step up to its end (s)."""
        return self.grid[self._next : max(self._next, self._until(end))]

    def _pass(self, end: float) -> None:
        self._next = max(self._next, self._until(end))

    def _start(self, known: Kept) -> None:
        """Keep the state (1,) at time 0.

        Energy that contacts store then counts as lost until their touches end.
        """
        q = self.motion(known)[0][0]
        for k in pressed_among(self.contacts, q):
            if known.pressed[0, k]:
                self._reached.losses[k] += self._stored(k, q, 0.0)
        self._keep_now(known)
        self._ends.append(self._last)

    def _stored(self, k: int, q: FloatArray, t: float) -> float:
        """Energy (J) that contact k stores at poses (parts, 3) and t (s); 0 by an impulse law."""
        contact = self.contacts[k]
        return float(contact.law.stored_energy(-approach(contact, q, np.zeros_like(q), t).gap))

    def _keep_now(self, known: Kept) -> None:
        """Keep the present state (1,), after an event."""
        known.totals[:] = self._energies(self._reached.all[None])
        self._last = known
        self._keep(known)

    def _keep(self, kept: Kept) -> None:
        """Keep instants; they replace a row that is kept at the first of them."""
        if self._kept and self._kept[-1].t[-1] >= kept.t[0]:
            self._drop_last()
        self._kept.append(kept)

    def _drop_last(self) -> None:
        last = self._kept.pop()
        if len(last.t) > 1:
            self._kept.append(last.pick(slice(-1)))

    def keep_last(self, *, before: bool = False) -> None:
        """Keep the end of the last step; if `before` an event, one rounding of time before it."""
        self.record_waiting()
        last = self._last
        if self._kept[-1].t[-1] < last.t[0]:
            self._kept.append(last)
        if before:
            self._drop_last()
            last = last._replace(t=np.nextafter(last.t, 0.0))
            if not self._kept or self._kept[-1].t[-1] < last.t[0]:
                self._kept.append(last)

    def keep_end(self, time: float) -> None:
        """Keep the last row as the end of the run (s), as the only row at that instant.

        A row before a leap at that instant is dropped.
        """
        self.record_waiting()
        while len(self._kept) > 1 and self._kept[-1].t[-1] > time - instant(time, KNOT_TIME):
            self._drop_last()
        self._kept.append(self._last._replace(t=np.array([time])))

    def all_kept(self) -> Kept:
        """All rows together; forces of contacts below zero, which are rounding, become zero."""
        kept = together(self._kept)
        return kept._replace(press=np.maximum(kept.press, 0.0))

    # --- steps --------------------------------------------------------------------------------

    def _with_middles(self, steps: Steps, known: Kept) -> Steps:
        """Count the middle node of each step in which a contact presses as a sample."""
        pressed = known.pressed[steps.nodes[:, 0], : self._marked].any(axis=1)
        pressing = np.flatnonzero(pressed & (steps.h > 0))
        if not len(pressing):
            return steps
        samples = np.append(steps.samples, steps.nodes[pressing, steps.nodes.shape[1] // 2])
        of = np.append(steps.of, pressing)
        _, order = np.unique(known.t[samples], return_index=True)
        return steps._replace(samples=samples[order], of=of[order])

    def _book(
        self,
        steps: Steps,
        known: Kept,
        rates_of_totals: Totals,
        ends: Kept,
        approach: FloatArray | None = None,
    ) -> Totals:
        """Take steps whose rows are `known` except for totals, of which the rates are (m, ...).

        `approach` (k, c) are the speeds (m/s) with which the touches began that last in each step;
        if left out, those of the present touches. The balance of energy is checked at the `ends`
        (k,) of steps. Returns totals (1 + k, ...) at the begin of the first step and at each end.
        """
        nodes, lengths = steps.nodes, steps.h[:, None]
        summed = rates_of_totals.all
        gained = np.cumsum(lengths * (self._shares(np.ones(1)) @ summed[nodes])[:, 0], axis=0)
        reached = self._reached.all + np.vstack([0 * self._reached.all, gained])
        known.totals[nodes[:, -1]] = ends.totals[:] = self._energies(reached[1:])
        if len(steps.samples):
            h = steps.h[steps.of]
            parts = np.divide(known.t[steps.samples] - steps.t[steps.of], h, where=h > 0,
                              out=np.zeros(len(h)))  # fmt: skip
            within = np.einsum("si,sij->sj", self._shares(parts), summed[nodes[steps.of]])
            known.totals[steps.samples] = self._energies(reached[steps.of] + h[:, None] * within)
        self._reached = self._reached.of(reached[-1])
        self.touches.note(known.press[nodes])
        self._keep_samples(steps, known)
        self._last = known.pick(nodes[-1, -1:])
        self._ends.append(ends)
        step_nodes = nodes[steps.h > 0]  # an explicit step may have no length, at an event
        motion = self.motion(known.pick(step_nodes.ravel()))
        poses, rates = (column.reshape(*step_nodes.shape, *column.shape[1:]) for column in motion)
        times = steps.t[steps.h > 0], steps.h[steps.h > 0]
        pressed = known.pressed[step_nodes[:, 0]]
        if approach is None:
            approach = np.broadcast_to(self.touches.approach, pressed.shape)
        else:
            approach = approach[steps.h > 0]
        self._steps.append((*times, poses, rates, pressed, approach))
        self._counted += len(step_nodes)
        if self._counted >= BLOCK:
            self._look_through()
        return self._reached.of(reached)

    def _shares(self, parts: FloatArray) -> FloatArray:
        """Weights (m, n) of values at a step's nodes in the integral up to parts (m,) of the step.

        They are exact for the polynomial through the nodes. In the integral over the whole step
        this is Radau's rule, in which the start has no weight.
        """
        powers = np.arange(1, len(self._powers) + 1)
        return np.asarray((parts[:, None] ** powers / powers) @ self._powers)

    def _totals(self, *instants: int) -> Totals:
        """Return totals, or rates of them, (...) or (m, ...), that are zero."""
        count = len(self.contacts)
        return Totals(np.zeros((*instants, 2 + 2 * count + self.frictions)), count)

    def _energies(self, totals: FloatArray) -> FloatArray:
        """Energies lost and supplied, and lost by friction (m, 2 + joints), of totals (m, ...)."""
        views = self._reached.of(totals)
        lost = views.damped + views.losses.sum(axis=1) + views.rubbed.sum(axis=1)
        return np.column_stack([lost, views.supplied, views.rubbed])

    def _keep_samples(self, steps: Steps, known: Kept) -> None:
        """Keep the samples, and in contacts the ends of steps that have no sample."""
        rows, ends = steps.samples, steps.nodes[:, -1]
        pressed = known.pressed[steps.nodes[:, 0], : self._marked].any(axis=1)
        if pressed.any():
            last = np.full(len(ends), -inf)
            last[steps.of] = known.t[rows]  # in order, so that the last sample of a step remains
            free = ends[pressed & (last < known.t[ends])]
            rows = np.concatenate([rows, free[:: self.ends_kept]])
            rows = rows[np.unique(known.t[rows], return_index=True)[1]]
        if len(rows):
            self._keep(known.pick(rows))

    # --- touches ------------------------------------------------------------------------------

    def leap(self, k: int, impulse: float, lost: float, supplied: float) -> None:
        """Take the impulse (N s) of a contact, its loss (J), and the work of drives (J)."""
        self.record_waiting()
        reached = self._reached = self._reached.of(self._reached.all.copy())
        reached.supplied[...] += supplied
        reached.impulses[k] += impulse
        reached.losses[k] += lost

    def leap_of_joints(self, lost: FloatArray, supplied: float) -> None:
        """Take losses (joints,) by friction in joints in an impact, and the work of drives (J)."""
        reached = self._reached = self._reached.of(self._reached.all.copy())
        reached.supplied[...] += supplied
        reached.rubbed[:] += lost

    def totals_of(self, k: int) -> tuple[float, float]:
        """Impulse (N s) and energy (J) that a contact has taken so far.

        Energy that it stores counts as lost until the touch ends.
        """
        self.record_waiting()
        return float(self._reached.impulses[k]), float(self._reached.losses[k])

    def intervals(self, first: int, places: FloatArray) -> Intervals:
        """Touches of the contacts from `first` on, which are at `places` (pairs,), m, now."""
        q, now = self.motion(self._last)[0][0], []
        for k, place in enumerate(places.tolist(), start=first):
            impulse, lost = self.totals_of(k)
            if self.touches.pressed[k]:
                lost -= self._stored(k, q, float(self._last.t[0]))
            now.append((place, (impulse, lost)))
        return self.touches.intervals(first, now, self.seeker)

    # --- blocks -------------------------------------------------------------------------------

    def flush(self) -> None:
        """Record all steps that wait."""
        self.record_waiting()
        self._look_through()

    def _look_through(self) -> None:
        """Look for extremes within steps, and check their ends."""
        if self._steps:
            columns = (np.concatenate(column) for column in zip(*self._steps, strict=True))
            t, h, poses, rates, pressed, approach = columns
            self.seeker.take(t, h, (poses, rates), pressed, approach)
        if self._ends:
            self._check(together(self._ends))
        self._steps, self._ends, self._counted = [], [], 0

    def _check(self, ends: Kept) -> None:
        poses, rates = self.motion(ends)
        energies = self.energies(ends, poses, rates)
        total = energies[:, 0] + energies[:, 1] + energies[:, 2] - energies[:, 3]
        if self._start_energy is None:
            self._start_energy = float(total[0])
        errors = self.residuals(ends, poses)
        residual = float(np.abs(total - self._start_energy).max())
        self.energy_residual = max(self.energy_residual, residual)
        self.largest_kinetic_energy = max(self.largest_kinetic_energy, float(energies[:, 0].max()))
        self.constraint_error = max(self.constraint_error, float(errors.max(initial=0.0)))

    def energies(self, kept: Kept, poses: FloatArray, rates: FloatArray) -> FloatArray:
        """Kinetic, stored, dissipated and supplied energy (instants, 4)."""
        kinetic, stored = self.meter.kinetic(poses, rates), self.meter.potential(poses)
        lost, supplied = kept.totals[:, :2].T.copy()
        touched = np.flatnonzero(kept.pressed.any(axis=0))
        rows = np.flatnonzero(kept.pressed[:, touched].any(axis=1))
        contacts = [self.contacts[k] for k in touched.tolist()]
        at_rows = poses_of(poses[rows], rates[rows], kept.t[rows])
        gaps = ContactShapes(contacts).seen(at_rows).gap
        for k, contact, gap in zip(touched.tolist(), contacts, gaps.T, strict=True):
            elastic = np.where(kept.pressed[rows, k], contact.law.stored_energy(-gap), 0.0)
            stored[rows] += elastic
            lost[rows] -= elastic
        return np.stack([kinetic, stored, lost, supplied], axis=1)

    def residuals(self, rows: Kept, poses: FloatArray) -> FloatArray:
        """How far joints are open, m."""
        return joint_residuals(self.mechanism, poses, rows.places)


def together(parts: list[Kept]) -> Kept:
    """Return instants one after the other."""
    *columns, engines = zip(*parts, strict=True)
    of_engine = engines[0]._make(np.concatenate(column) for column in zip(*engines, strict=True))
    return Kept._make((*map(np.concatenate, columns), of_engine))
