"""From steps to samples, touches, energies and checks.

A step is known at its nodes, its start and its stages, and at the samples within it. Energies
dissipated and supplied, impulses and works of contacts are integrals over the stages, as accurate
as the motion. Steps wait until they are many, or until an event changes the equations.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf
from typing import NamedTuple, Protocol

import numpy as np

from exudyn_flexlink.arrays import BoolArray, ComplexArray, FloatArray, IndexArray
from exudyn_flexlink.engines.extremes import ExtremeSeeker
from exudyn_flexlink.engines.lagrangian.equations import momentum_rate
from exudyn_flexlink.engines.lagrangian.system import Motion, System, joined
from exudyn_flexlink.engines.pair_events import NODES as PARTS
from exudyn_flexlink.engines.pair_events import Seen
from exudyn_flexlink.integrate.collocation import NODES as POWERS
from exudyn_flexlink.integrate.collocation import WEIGHTS
from exudyn_flexlink.intervals import Interval, Intervals
from exudyn_flexlink.laws import Impulse
from exudyn_flexlink.mechanism import EnergyMeter, approach, joint_residuals

AT_ONCE = 32  # steps that wait: more take memory, and little less time
BLOCK = 512  # steps that are looked through for extremes together
NODE = np.arange(len(PARTS))
# Where the largest force in a step is looked for, on the polynomial through its nodes.
TO_LOOKS = np.vander(np.linspace(0.0, 1.0, 33), len(PARTS), increasing=True) @ POWERS


class Path(Protocol):
    """A step: from `t` over `h` (s), and what it is in between."""

    @property
    def t(self) -> float:
        """Its start, s."""

    @property
    def h(self) -> float:
        """Its length, s."""

    def at(self, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Free coordinates and speeds (m, n) at times (m,) within the step."""


class Kept(NamedTuple):
    """Instants (m,) that are kept, s."""

    t: FloatArray
    place: FloatArray  # (m,): P's on the whole track
    poses: FloatArray  # (m, parts, 3)
    rates: FloatArray
    accelerations: FloatArray  # (m, N)
    momentum_rate: ComplexArray  # (m,) of the link, N
    press: FloatArray  # (m, c): contacts' forces, N
    motor: FloatArray  # (m,): torque of the speed drive, N m
    # (m, 2 + 2 c): energies dissipated in dampers and supplied, J; of each contact impulse, N s,
    # and work done on it, J
    totals: FloatArray
    pressed: BoolArray  # (m, c)

    def pick(self, which: slice | IndexArray) -> Kept:
        """Return some of the instants."""
        return Kept._make(own[which] for own in self)


class _Waiting(NamedTuple):
    t: float
    h: float
    motion: Motion  # at the nodes, then at samples


class Recorder:
    """Takes every step; keeps samples at `grid` (s, increasing), at events and in contacts."""

    def __init__(self, system: System, grid: FloatArray, seeker: ExtremeSeeker) -> None:
        self.system, self.seeker, self.grid = system, seeker, grid
        self.meter = EnergyMeter(system.model.mechanism)
        self.kept: list[Kept] = []
        self.intervals: dict[int, list[Interval]] = {}
        self.energy_residual = self.largest_kinetic_energy = self.constraint_error = 0.0
        self._open: dict[int, Interval] = {}  # with the totals as it began
        self._reached = np.zeros(2 + 2 * len(system.contacts.all))
        self._next = 1
        self._waiting: list[_Waiting] = []
        self._last: Kept  # where the last step ended, as it was before an event there
        self._ends: list[Kept] = []  # of the block
        self._steps: list[tuple[FloatArray, FloatArray, FloatArray, FloatArray, BoolArray]] = []
        self._counted = 0
        self._start_energy: float | None = None

    # --- steps --------------------------------------------------------------------------------

    def due(self, step: Path) -> FloatArray:
        """Samples (n,), s, within a step."""
        return self.grid[self._next : max(self._next, self._until(step))]

    def _until(self, step: Path) -> int:
        return int(np.searchsorted(self.grid, (step.t + step.h) * (1 + 1e-14), side="right"))

    def begin(self, at: Motion) -> None:
        """Take the state (1,) at time 0."""
        self.keep(at)
        self._ends.append(self._last)

    def take(self, step: Path, motion: Motion) -> None:
        """Take a step, known at its nodes and then at the samples that are `due` in it."""
        self._next = max(self._next, self._until(step))
        self._waiting.append(_Waiting(step.t, step.h, motion))
        if len(self._waiting) >= AT_ONCE:
            self.work_off()

    def work_off(self) -> None:
        """Work off the steps that wait: the same contacts press in all of them."""
        if not self._waiting:
            return
        t, h, motions = (list(own) for own in zip(*self._waiting, strict=True))
        self._waiting.clear()
        whole, begins, lengths = joined(motions), np.array(t), np.array(h)
        counts = np.array([len(own.t) for own in motions])
        nodes = (np.cumsum(counts) - counts)[:, None] + NODE
        known = self._known(whole)
        rates = self._rates(whole, known)
        gained = np.cumsum(lengths[:, None] * (WEIGHTS @ rates[nodes[:, 1:]]), axis=0)
        # Totals at the nodes are those of no use but for the end, where they are exact.
        steps = np.repeat(np.arange(len(h)), counts)
        parts = np.divide(whole.t - begins[steps], lengths[steps], where=lengths[steps] > 0,
                          out=np.zeros(len(steps)))  # fmt: skip
        within = (_shares(parts)[:, None, :] @ rates[nodes[steps]])[:, 0] * lengths[steps, None]
        before = np.vstack([np.zeros_like(self._reached), gained])
        known.totals[:] = self._reached + before[steps] + within
        known.totals[nodes[:, -1]] = self._reached + gained
        self._reached = self._reached + gained[-1]
        self._note_reactions(known.press[nodes])
        keep = np.ones(len(steps), dtype=bool)
        keep[nodes] = False
        if self.system.touching[: self.system.contacts.faces].any():
            # Even samples miss the peaks of a contact's force.
            ends = nodes[:, -1]
            after = np.append(whole.t, inf)
            keep[ends] = True
            sampled = counts > len(NODE)
            last = np.cumsum(counts) - 1
            keep[ends[sampled & (after[last] >= whole.t[ends])]] = False
        order = np.flatnonzero(keep)
        order = order[np.argsort(whole.t[order], kind="stable")]
        if len(order):
            self._keep(known.pick(order))
        own = lengths > 0  # an explicit one may end where it began, at an event
        self._last = known.pick(nodes[-1, -1:])
        self._ends.append(known.pick(nodes[:, -1]))
        poses, rates = known.poses[nodes[own]], known.rates[nodes[own]]
        self._steps.append((begins[own], lengths[own], poses, rates, known.pressed[nodes[own, 0]]))
        self._counted += len(h)
        if self._counted >= BLOCK:
            self.flush()

    def _note_reactions(self, press: FloatArray) -> None:
        """Keep the largest forces of contacts that are held closed, in steps (m, nodes, c)."""
        for k in self.system.held.tolist():
            largest = max(self._open[k].peak_force, float((TO_LOOKS @ press[:, :, k].T).max()))
            self._open[k] = replace(self._open[k], peak_force=largest)

    def _keep(self, found: Kept) -> None:
        """Keep instants, in place of what is kept already at the first of them."""
        if self.kept and self.kept[-1].t[-1] >= found.t[0]:
            self._drop_last()
        self.kept.append(found)

    def _drop_last(self) -> None:
        last = self.kept.pop()
        if len(last.t) > 1:
            self.kept.append(last.pick(slice(-1)))

    def keep_last(self, *, before: bool = False) -> None:
        """Keep the end of the last step; `before` an event there, by the least time there is."""
        self.work_off()
        last = self._last
        if self.kept[-1].t[-1] < last.t[0]:
            self.kept.append(last)
        if before:
            self._drop_last()
            t = np.nextafter(last.t, 0.0)
            if not self.kept or self.kept[-1].t[-1] < t[0]:
                self.kept.append(last._replace(t=t))

    def keep(self, at: Motion) -> None:
        """Keep a state (1,) as it is now, after what happened there."""
        self.work_off()
        self._last = self._known(at)._replace(totals=self._reached[None])
        self._keep(self._last)

    def _known(self, at: Motion) -> Kept:
        """What is known at instants, but for the totals."""
        model, contacts = self.system.model, self.system.contacts
        a, held = self.system.accelerations(at)
        press = np.zeros((len(at.t), len(contacts.all)))
        if at.pushed is not None:
            press[:, at.pushed.which] = at.pushed.press
        press[:, self.system.held] = held
        motor = self.system.motor_torque(at, a, held)
        pressed = np.broadcast_to(self.system.touching.copy(), press.shape)
        place, totals = (
            at.place + self.system.track.shift,
            np.zeros((len(at.t), len(self._reached))),
        )
        poses, rates = model.poses(at.frame)
        momentum = momentum_rate(model.numbers, at.frame, a)
        return Kept(at.t, place, poses, rates, a, momentum, press, motor, totals, pressed)

    def _rates(self, at: Motion, known: Kept) -> FloatArray:
        """Rates (m, ...) of the totals at instants."""
        count, v = len(self.system.contacts.all), at.frame.v
        rates = np.zeros((len(at.t), 2 + 2 * count))
        rates[:, 0] = ((v @ self.system.model.numbers.damping) * v).sum(axis=1)
        rates[:, 1] = known.motor * v[:, 0] + (at.motors * v).sum(axis=1)
        rates[:, 2 : 2 + count] = known.press
        if at.pushed is not None:
            rates[:, 2 + count + at.pushed.which] = at.pushed.power
        return rates

    # --- touches ------------------------------------------------------------------------------

    def opened(self, time: float, k: int, seen: Seen, totals: tuple[float, float]) -> None:
        """Contact k begins to press, where it is `seen`; it stores nothing as it does."""
        place, speed = float(seen.place[k]), -float(seen.gap_rate[k])
        self._open[k] = Interval(
            time, place=place, approach_speed=speed, impulse=totals[0], energy_lost=totals[1]
        )

    def closed(self, time: float, k: int, seen: Seen, *, slides_off: bool) -> None:
        """It ends: it opens, or its point slides off an end of the face."""
        last = self._until_now(k, float(seen.place[k]))
        rate = float(seen.gap_rate[k])
        ended = replace(last, end=time, separation_speed=rate, slides_off=slides_off)
        self.intervals.setdefault(k, []).append(ended)
        del self._open[k]

    def hit(self, k: int, impact: Interval) -> None:
        """It strikes and bounces, in no time."""
        self.intervals.setdefault(k, []).append(impact)

    def leap(self, k: int, impulse: float, lost: float, supplied: float) -> None:
        """Take the impulse (N s) of a contact, what it loses (J), and what a drive does (J)."""
        self.work_off()
        count = len(self.system.contacts.all)
        self._reached = self._reached.copy()
        self._reached[[1, 2 + k, 2 + count + k]] += supplied, impulse, lost

    def totals_of(self, k: int) -> tuple[float, float]:
        """Impulse (N s) and energy (J) that a contact has taken so far."""
        count = len(self.system.contacts.all)
        return float(self._reached[2 + k]), float(self._reached[2 + count + k])

    def _until_now(self, k: int, place: float) -> Interval:
        begun, (impulse, lost) = self._open[k], self.totals_of(k)
        return replace(
            begun,
            end_place=place,
            impulse=impulse - begun.impulse,
            energy_lost=lost - begun.energy_lost,
        )

    def touches(self, first: int, count: int, seen: Seen) -> Intervals:
        """Intervals of the contacts from `first` on; what still presses is `seen` there."""
        found = []
        for k in range(first, first + count):
            lasting = [self._until_now(k, float(seen.place[k]))] if k in self._open else []
            for own in (*self.intervals.get(k, ()), *lasting):
                force, depth = self.seeker.peaks(k, own.begin, own.end)
                peak = inf if own.impact else max(own.peak_force, force)
                pair = k - first
                found.append(replace(own, peak_force=peak, penetration=depth, pair=pair))
        return Intervals.of(found)

    # --- blocks -------------------------------------------------------------------------------

    def flush(self) -> None:
        """Work off all that waits: extremes within steps, and checks of their ends."""
        self.work_off()
        if self._steps:
            t, h, poses, rates, pressed = (
                np.concatenate(x) for x in zip(*self._steps, strict=True)
            )
            self.seeker.take(t, h, (poses, rates), pressed)
        if self._ends:
            self._check(_together(self._ends))
        self._steps, self._ends, self._counted = [], [], 0

    def _check(self, ends: Kept) -> None:
        energies = self.energies(ends)
        total = energies[:, 0] + energies[:, 1] + energies[:, 2] - energies[:, 3]
        if self._start_energy is None:
            self._start_energy = float(total[0])
        errors = joint_residuals(self.system.model.mechanism, ends.poses, ends.place[:, None])
        residual = float(np.abs(total - self._start_energy).max())
        self.energy_residual = max(self.energy_residual, residual)
        self.largest_kinetic_energy = max(self.largest_kinetic_energy, float(energies[:, 0].max()))
        self.constraint_error = max(self.constraint_error, float(errors.max(initial=0.0)))

    def energies(self, at: Kept) -> FloatArray:
        """Kinetic, stored, dissipated and supplied energy (instants, 4)."""
        poses, rates = at.poses, at.rates
        kinetic, stored = self.meter.kinetic(poses, rates), self.meter.potential(poses)
        contacts = self.system.contacts.all
        lost = at.totals[:, 0] + at.totals[:, 2 + len(contacts) :].sum(axis=1)
        for k in np.flatnonzero(at.pressed.any(axis=0)).tolist():
            law, rows = contacts[k].law, at.pressed[:, k]
            if not isinstance(law, Impulse):
                elastic = law.stored_energy(-approach(contacts[k], poses[rows], rates[rows]).gap)
                stored[rows] += elastic
                lost[rows] -= elastic
        return np.stack([kinetic, stored, lost, at.totals[:, 1]], axis=1)

    def all_kept(self) -> Kept:
        """All that is kept in one; no force pulls."""
        found = _together(self.kept)
        return found._replace(press=np.maximum(found.press, 0.0))


def _together(parts: list[Kept]) -> Kept:
    return Kept._make(np.concatenate(own) for own in zip(*parts, strict=True))


def _shares(parts: FloatArray) -> FloatArray:
    """Weights (m, 1 + stages) of an integral up to parts of a step: its start, its stages."""
    powers = np.arange(1, len(PARTS) + 1)
    return np.asarray((parts[:, None] ** powers / powers) @ POWERS)
