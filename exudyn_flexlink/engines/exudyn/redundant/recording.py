"""From the solver's steps to even samples, energies and checks, block by block.

Every step is copied into preallocated arrays; a full block is worked off at once with numpy, and
only samples and running sums are kept, so that memory does not grow with the number of steps.
Positions between steps follow the cubic through positions and velocities at both ends.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial

import numpy as np

from exudyn_flexlink.arrays import BoolArray, FloatArray
from exudyn_flexlink.engines.extremes import ExtremeSeeker
from exudyn_flexlink.engines.exudyn.redundant.between import Between
from exudyn_flexlink.engines.exudyn.redundant.step_end import StepEnd
from exudyn_flexlink.engines.exudyn.redundant.system import System
from exudyn_flexlink.laws import RestitutionPenalty
from exudyn_flexlink.mechanism import (
    anchor_velocity,
    approach,
    force_at,
    joint_residuals,
    motor_place,
    motor_speed,
    sizes_at,
    turning,
)

BLOCK = 1024  # steps
BESIDE = (-2e-12, 2e-12)  # s: twice as near as steps end at the knots of a drive


def just_before(time: FloatArray) -> FloatArray:
    """Instants (s) at which drives are as they were within the step that ends there."""
    return np.maximum(time + BESIDE[0], 0.0)


@dataclass
class Samples:
    """What is kept of a run; lists of arrays, one for each block."""

    time: list[FloatArray] = field(default_factory=list)
    poses: list[FloatArray] = field(default_factory=list)  # of parts, (samples, parts, 3)
    rates: list[FloatArray] = field(default_factory=list)
    multipliers: list[FloatArray] = field(default_factory=list)
    places: list[FloatArray] = field(default_factory=list)
    forces: list[FloatArray] = field(default_factory=list)  # of contacts, (samples, contacts)
    energies: list[FloatArray] = field(default_factory=list)  # kinetic stored dissipated supplied


@dataclass(frozen=True)
class _Block:
    """Steps worked off together; `q`, `v` are the solver's coordinates.

    Energy (J, since time 0) and power (W) of dampers and drives are (steps,); forces (N) of
    contacts, what they store (J) and what they lost since time 0 (J) are (steps, contacts).
    """

    time: FloatArray
    q: FloatArray
    v: FloatArray
    damped: FloatArray
    damping: FloatArray
    supplied: FloatArray
    supply: FloatArray
    forces: FloatArray
    stored: FloatArray
    losses: FloatArray


class Recorder:
    """Takes every step, keeps samples at `grid` (s, increasing) and at the times of events.

    `motor_rows` are the multipliers that are torques, or forces, of speed motors. Of every contact
    `impulse` (N s) and `work` (J) are those so far, what it stores included, and `force` (N) is
    that at the last step, in which it may have begun: (contacts,).
    """

    def __init__(
        self,
        system: System,
        grid: FloatArray,
        spectral_radius: float,
        seeker: ExtremeSeeker,
    ) -> None:
        self.coordinates = system.coordinates
        self.mechanism = system.mechanism
        self.contacts = contacts = seeker.contacts  # of the scene, then its channels' pairs
        self.grid = grid
        self.seeker = seeker
        self.motor_rows = [system.multipliers(item)[0] for item in system.motors]
        self.samples = Samples()
        self.energy_residual = 0.0
        self.largest_kinetic_energy = 0.0
        self.constraint_error = 0.0
        self.steps = -1  # the state at time 0 is no step
        width = len(self.coordinates.weights)
        constraints = len(system.mbs.systemData.GetAECoordinates())
        count, slots = len(contacts), len(self.mechanism.slots)
        # Generalised-alpha balances forces not at the end of a step but at the weighted mean of
        # both ends. Multipliers averaged so are free of the alternating error that the integrator
        # leaves in them after every jump.
        self._alpha = spectral_radius / (1 + spectral_radius)
        self._balanced: tuple[FloatArray, float] | None = None  # last of the block before
        self._time = np.empty(BLOCK)
        self._balanced_at = np.empty(BLOCK)
        self._q, self._v = np.empty((BLOCK, width)), np.empty((BLOCK, width))
        self._raw = np.empty((BLOCK, constraints))
        self._multipliers = np.empty((BLOCK, constraints))
        self._pressed = np.zeros((BLOCK, count), dtype=bool)
        self._places = np.empty((BLOCK, slots))
        self._count = 0
        self._marks: list[float] = []
        self._notes: list[tuple[int, int]] = []  # row and contact, of this block
        self.totals: list[tuple[float, float]] = []  # impulse and loss at every note
        self._sampled_to = -np.inf
        self._damped = self._supplied = 0.0
        self.impulse, self.work, self.force = (np.zeros(count) for _ in range(3))
        self._start_energy: float | None = None

    def take(
        self,
        now: StepEnd,
        multipliers: FloatArray,
        pressed: BoolArray,
        places: list[float],
    ) -> None:
        """Copy one step: which contacts press, and the slots' places, beside the state."""
        if self._count == BLOCK:
            self.flush()
        i = self._count
        self._time[i] = now.time
        self._q[i], self._v[i] = now.q, now.v
        self._raw[i] = multipliers
        self._pressed[i] = pressed
        if places:
            self._places[i] = places
        self._count += 1
        self.steps += 1

    def mark(self, time: float) -> None:
        """Keep a sample at this time too; it must be that of a step not yet flushed."""
        self._marks.append(time)

    def mark_last(self) -> None:
        """Keep a sample at the last step that was taken."""
        if self._count:
            self._marks.append(float(self._time[self._count - 1]))

    def note(self, contact: int) -> None:
        """Keep impulse and loss of a contact at the step that is taken next."""
        if self._count == BLOCK:
            self.flush()
        self._notes.append((self._count, contact))

    def flush(self) -> None:
        """Work off the block; its last step stays as the first of the next."""
        # SciPy's integrals take 20 ms to import, which other formulations should not wait for.
        from scipy.integrate import cumulative_trapezoid  # noqa: PLC0415

        n = self._count
        if n == 0 or (n == 1 and self._sampled_to == self._time[0]):
            return
        time, q, v = self._time[:n], self._q[:n], self._v[:n]
        poses, rates = self.coordinates.at_joints(q, v)
        self._balance(n)
        self._seek(time, self.coordinates.shown(q, v))
        forces, stored, power = self._contacts(poses, rates, self._pressed[:n])
        reached = partial(cumulative_trapezoid, x=time, axis=0, initial=0)
        impulses, work = self.impulse + reached(forces), self.work + reached(power)
        damping = self.coordinates.damping_power(q, v)
        supplied, supply = self._motors(time, poses, rates)
        block = _Block(
            time,
            q,
            v,
            damped=self._damped + reached(damping),
            damping=damping,
            supplied=self._supplied + supplied,
            supply=supply,
            forces=forces,
            stored=stored,
            losses=work - stored,
        )
        self._check(block, poses)
        self._sample(block)
        self.totals += [
            (float(impulses[row, k]), float(block.losses[row, k])) for row, k in self._notes
        ]
        self._notes.clear()
        self.impulse, self.work, self.force = impulses[-1], work[-1], forces[-1]
        self._damped, self._supplied = block.damped[-1], block.supplied[-1]
        for rows in (self._time, self._q, self._v, self._raw, self._pressed, self._places):
            rows[0] = rows[n - 1]
        self._count = 1
        self._marks.clear()

    def _balance(self, n: int) -> None:
        """Average the multipliers over steps, and date them."""
        raw, time, alpha = self._raw[:n], self._time[:n], self._alpha
        self._multipliers[1:n] = (1 - alpha) * raw[1:] + alpha * raw[:-1]
        self._balanced_at[1:n] = time[1:] - alpha * np.diff(time)
        if self._balanced is not None:
            self._multipliers[0], self._balanced_at[0] = self._balanced
        else:
            # The solver knows no reactions at time 0: those of the first step stand in.
            self._multipliers[:2] = raw[min(1, n - 1)]
            self._balanced_at[0] = time[0]
        self._balanced = self._multipliers[n - 1].copy(), float(self._balanced_at[n - 1])

    def _seek(self, time: FloatArray, motion: tuple[FloatArray, FloatArray]) -> None:
        """Look for extremes between each step's ends, on the cubic there."""
        poses, rates = (np.stack([x[:-1], x[1:]], axis=1) for x in motion)
        pressed = self._pressed[: len(time) - 1]  # as a step begins, so through all of it
        self.seeker.take(time[:-1].copy(), np.diff(time), (poses, rates), pressed)

    def _contacts(
        self, q: FloatArray, v: FloatArray, pressed: BoolArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Forces, energies stored and powers taken, each (steps, contacts)."""
        forces, stored, power = (np.zeros(pressed.shape) for _ in range(3))
        for k in np.flatnonzero(pressed.any(axis=0)).tolist():
            contact = self.contacts[k]
            rows = pressed[:, k]
            at = approach(contact, q[rows], v[rows])
            assert isinstance(contact.law, RestitutionPenalty)  # `run` refuses others
            deep = np.maximum(-at.gap, 0.0)
            force = contact.law.force(deep, -at.gap_rate)
            forces[rows, k] = force
            stored[rows, k] = contact.law.stored_energy(deep)
            power[rows, k] = -force * at.gap_rate
            if contact.friction is not None:
                power[rows, k] -= contact.friction.force(force, at.slip) * at.slip
        return forces, stored, power

    def _motors(
        self, time: FloatArray, q: FloatArray, v: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Work of the drives since the block's first step, and their power, (steps,)."""
        work, supply = np.zeros(len(time)), np.zeros(len(time))
        rows, at = self._multipliers[: len(time)], self._balanced_at[: len(time)]
        middle = (time[1:] + time[:-1]) / 2
        for motor, row in zip(self.mechanism.speed_motors, self.motor_rows, strict=True):
            moved = np.diff(motor_place(motor, q))
            work[1:] += np.cumsum(-np.interp(middle, at, rows[:, row]) * moved)
            supply -= np.interp(time, at, rows[:, row]) * motor_speed(motor, q, v)
        # Where a drive jumps, one step ends with what was before, the next begins with what comes.
        ends, begins = (
            self._load_power(np.clip(time + away, 0, self.grid[-1]), q, v) for away in BESIDE
        )
        work[1:] += np.cumsum(0.5 * np.diff(time) * (begins[:-1] + ends[1:]))
        return work, supply + begins

    def _load_power(self, time: FloatArray, q: FloatArray, v: FloatArray) -> FloatArray:
        """Power of torques and forces (instants,), W."""
        power = np.zeros(len(time))
        for torque in self.mechanism.torque_motors:
            power += sizes_at(torque.size, time, q, v) * turning(torque.first, torque.second, v)
        for force in self.mechanism.forces:
            pushed = force_at(force, time, q, v) * anchor_velocity(force.point, q, v)
            power += pushed.sum(axis=1)
        return power

    def _check(self, block: _Block, poses: FloatArray) -> None:
        """Note the largest errors of energies and joints; `poses` are those at joints."""
        kinetic = self.coordinates.kinetic(block.q, block.v)
        total = kinetic + self.coordinates.potential(block.q) + block.stored.sum(axis=1)
        if self._start_energy is None:
            self._start_energy = float(total[0])
        lost = block.damped + block.losses.sum(axis=1)
        residual = total - self._start_energy + lost - block.supplied
        errors = joint_residuals(self.mechanism, poses, self._places[: len(block.q)])
        self.energy_residual = max(self.energy_residual, float(np.abs(residual).max()))
        self.largest_kinetic_energy = max(self.largest_kinetic_energy, float(kinetic.max()))
        self.constraint_error = max(self.constraint_error, float(errors.max(initial=0.0)))

    def _sample(self, block: _Block) -> None:
        time, kept = block.time, self.samples
        wanted = np.union1d(self.grid, np.array(self._marks))
        wanted = wanted[(wanted > self._sampled_to) & (wanted <= time[-1])]
        if not len(wanted):
            return
        self._sampled_to = float(wanted[-1])
        between = Between.of(time, wanted)
        position, velocity = between.cubic(block.q, block.v)
        poses, rates = self.coordinates.shown(position, velocity)
        kept.time.append(wanted)
        kept.poses.append(poses)
        kept.rates.append(rates)
        kept.multipliers.append(self._balanced_multipliers(wanted, len(time)))
        kept.energies.append(self._energies_at(between, block, position, velocity))
        kept.forces.append(between.linear(block.forces))
        kept.places.append(self._places[: len(time)][between.nearer])

    def _energies_at(
        self, between: Between, block: _Block, q: FloatArray, v: FloatArray
    ) -> FloatArray:
        """Energies of sampled states: as smooth between steps as the states themselves."""
        stored = self.coordinates.potential(q) + between.linear(block.stored).sum(axis=1)
        lost, _ = between.cubic(block.damped, block.damping)
        supplied, _ = between.cubic(block.supplied, block.supply)
        lost = lost + between.linear(block.losses).sum(axis=1)
        return np.stack([self.coordinates.kinetic(q, v), stored, lost, supplied], axis=1)

    def _balanced_multipliers(self, wanted: FloatArray, count: int) -> FloatArray:
        """Multipliers between the instants at which the integrator balances forces."""
        at, rows = self._balanced_at[:count], self._multipliers[:count]
        columns = [np.interp(wanted, at, rows[:, k]) for k in range(rows.shape[1])]
        return np.stack(columns, axis=1) if columns else np.zeros((len(wanted), 0))
