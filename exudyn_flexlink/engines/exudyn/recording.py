"""From the solver's steps to even samples, energies and checks, block by block.

Every step is copied into preallocated arrays; a full block is worked off at once with numpy, and
only samples and running sums are kept, so that memory does not grow with the number of steps.
Positions between steps follow the cubic through positions and velocities at both ends.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.exudyn.instant import Instant
from exudyn_flexlink.mechanism import EnergyMeter, Mechanism, approach, joint_residuals, turning

FloatArray = NDArray[np.float64]

BLOCK = 1024  # steps


@dataclass
class Samples:
    """What is kept of a run; lists of arrays, one for each block."""

    time: list[FloatArray] = field(default_factory=list)
    q: list[FloatArray] = field(default_factory=list)
    v: list[FloatArray] = field(default_factory=list)
    multipliers: list[FloatArray] = field(default_factory=list)
    places: list[FloatArray] = field(default_factory=list)
    forces: list[FloatArray] = field(default_factory=list)  # of contacts, (samples, contacts)
    energies: list[FloatArray] = field(default_factory=list)  # kinetic stored dissipated supplied
    impulses: list[FloatArray] = field(default_factory=list)  # of contacts, since time 0
    losses: list[FloatArray] = field(default_factory=list)  # of contacts, since time 0


@dataclass(frozen=True)
class _Block:
    """Steps worked off together; impulses and losses of contacts are since time 0."""

    time: FloatArray
    q: FloatArray
    v: FloatArray
    forces: FloatArray
    energies: FloatArray
    impulses: FloatArray
    losses: FloatArray


class Recorder:
    """Takes every step, keeps samples at `grid` (s, increasing) and at the times of events."""

    def __init__(
        self,
        mechanism: Mechanism,
        grid: FloatArray,
        motor_rows: list[int],
        multipliers: int,
        spectral_radius: float,
    ) -> None:
        self.mechanism = mechanism
        self.grid = grid
        self.motor_rows = motor_rows
        self.meter = EnergyMeter(mechanism)
        self.samples = Samples()
        self.energy_residual = 0.0
        self.largest_kinetic_energy = 0.0
        self.constraint_error = 0.0
        self.largest_penetration = 0.0
        self.steps = -1  # the state at time 0 is no step
        width = 3 * len(mechanism.parts)
        contacts, slots = len(mechanism.contacts), len(mechanism.slots)
        # Generalised-alpha balances forces not at the end of a step but at the weighted mean of
        # both ends. Multipliers averaged so are free of the alternating error that the integrator
        # leaves in them after every jump.
        self._alpha = spectral_radius / (1 + spectral_radius)
        self._last_multipliers: FloatArray | None = None
        self._time = np.empty(BLOCK)
        self._balanced_at = np.empty(BLOCK)
        self._q, self._v = np.empty((BLOCK, width)), np.empty((BLOCK, width))
        self._multipliers = np.empty((BLOCK, multipliers))
        self._pressed = np.zeros((BLOCK, contacts), dtype=bool)
        self._places = np.empty((BLOCK, slots))
        self._count = 0
        self._marks: list[float] = []
        self._sampled_to = -np.inf
        self._dissipated = self._supplied = 0.0
        self._impulse, self._work = np.zeros(contacts), np.zeros(contacts)
        self._start_energy: float | None = None

    def take(
        self, now: Instant, multipliers: FloatArray, pressed: list[bool], places: list[float]
    ) -> None:
        """Copy one step: which contacts press, and the slots' places, beside the state."""
        if self._count == BLOCK:
            self.flush()
        i = self._count
        self._time[i] = now.time
        self._q[i], self._v[i] = now.q, now.v
        before = multipliers if self._last_multipliers is None else self._last_multipliers
        self._multipliers[i] = (1 - self._alpha) * multipliers + self._alpha * before
        self._balanced_at[i] = now.time - self._alpha * now.done
        if pressed:
            self._pressed[i] = pressed
        if places:
            self._places[i] = places
        self._count += 1
        self.steps += 1
        # The solver knows no reactions at time 0: those of the first step stand in.
        self._last_multipliers = multipliers if self.steps > 0 else None
        if self.steps == 1:
            self._multipliers[0] = self._multipliers[i] = multipliers

    def mark(self, time: float) -> None:
        """Keep a sample at this time too; it must be that of a step not yet flushed."""
        self._marks.append(time)

    def last_positions(self) -> list[float]:
        """Coordinates of the last step."""
        return list(self._q[max(self._count - 1, 0)].tolist())

    def flush(self) -> None:
        """Work off the block; its last step stays as the first of the next."""
        n = self._count
        if n == 0 or (n == 1 and self._sampled_to == self._time[0]):
            return
        parts = len(self.mechanism.parts)
        time = self._time[:n]
        q, v = self._q[:n].reshape(n, parts, 3), self._v[:n].reshape(n, parts, 3)
        forces, stored, rates, penetration = self._contacts(q, v, self._pressed[:n])
        impulses = self._impulse + _running_integral(time, forces)
        work = self._work - _running_integral(time, forces * rates)
        energies = self._energies(time, q, v, stored, work)
        self._check(q, penetration, energies)
        self._sample(_Block(time, q, v, forces, energies, impulses, work - stored))
        self._impulse, self._work = impulses[-1], work[-1]
        self._dissipated = energies[-1, 2] - float(np.sum(work[-1] - stored[-1]))
        self._supplied = energies[-1, 3]
        for block in (self._time, self._q, self._v, self._multipliers, self._pressed,
                      self._places, self._balanced_at):  # fmt: skip
            block[0] = block[n - 1]
        self._count = 1
        self._marks.clear()

    def _contacts(
        self, q: FloatArray, v: FloatArray, pressed: NDArray[np.bool_]
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Forces, stored energies, gap rates and penetrations, each (steps, contacts)."""
        shape = (len(q), len(self.mechanism.contacts))
        forces, stored, rates, depth = (np.zeros(shape) for _ in range(4))
        for k, contact in enumerate(self.mechanism.contacts):
            at = approach(contact, q, v)
            depth[:, k] = np.where(pressed[:, k], np.maximum(-at.gap, 0.0), 0.0)
            forces[:, k] = contact.law.force(depth[:, k], -at.gap_rate)
            stored[:, k] = contact.law.stored_energy(depth[:, k])
            rates[:, k] = at.gap_rate
        return forces, stored, rates, depth

    def _energies(
        self, time: FloatArray, q: FloatArray, v: FloatArray, stored: FloatArray, work: FloatArray
    ) -> FloatArray:
        kinetic = self.meter.kinetic(q, v)
        potential = self.meter.potential(q) + stored.sum(axis=1)
        lost = self._dissipated + _running_integral(time, self.meter.damping_power(v))
        lost = lost + (work - stored).sum(axis=1)
        supplied = self._supplied + self._work_of_motors(time, q, v)
        return np.stack([kinetic, potential, lost, supplied], axis=1)

    def _work_of_motors(self, time: FloatArray, q: FloatArray, v: FloatArray) -> FloatArray:
        """Work of the drives since the block's first step, (steps,)."""
        work = np.zeros(len(time))
        rows = self._multipliers[: len(time)]
        middle = (time[1:] + time[:-1]) / 2
        for motor, row in zip(self.mechanism.speed_motors, self.motor_rows, strict=True):
            turned = np.diff(turning(motor.first, motor.second, q))
            torque = -np.interp(middle, self._balanced_at[: len(time)], rows[:, row])
            work[1:] += np.cumsum(torque * turned)
        for motor in self.mechanism.torque_motors:
            torque = np.array([motor.ramp.at(t) for t in time])
            power = torque * turning(motor.first, motor.second, v)
            work += _running_integral(time, power)
        return work

    def _check(self, q: FloatArray, penetration: FloatArray, energies: FloatArray) -> None:
        total = energies[:, 0] + energies[:, 1]
        if self._start_energy is None:
            self._start_energy = float(total[0])
        residual = total - self._start_energy + energies[:, 2] - energies[:, 3]
        errors = joint_residuals(self.mechanism, q, self._places[: len(q)])
        self.energy_residual = max(self.energy_residual, float(np.abs(residual).max()))
        self.largest_kinetic_energy = max(self.largest_kinetic_energy, float(energies[:, 0].max()))
        self.constraint_error = max(self.constraint_error, float(errors.max(initial=0.0)))
        self.largest_penetration = max(
            self.largest_penetration, float(penetration.max(initial=0.0))
        )

    def _sample(self, block: _Block) -> None:
        time, kept = block.time, self.samples
        wanted = np.union1d(self.grid, np.array(self._marks))
        wanted = wanted[(wanted > self._sampled_to) & (wanted <= time[-1])]
        if not len(wanted):
            return
        self._sampled_to = float(wanted[-1])
        before = np.clip(np.searchsorted(time, wanted, side="left") - 1, 0, max(len(time) - 2, 0))
        after = np.minimum(before + 1, len(time) - 1)
        span = time[after] - time[before]
        x = np.divide(wanted - time[before], span, out=np.zeros_like(wanted), where=span > 0)
        ends_q, ends_v = (block.q[before], block.q[after]), (block.v[before], block.v[after])
        position, velocity = _hermite(ends_q, ends_v, span, x)
        kept.time.append(wanted)
        kept.q.append(position)
        kept.v.append(velocity)
        kept.multipliers.append(self._balanced_multipliers(wanted, len(time)))
        for target, values in (
            (kept.forces, block.forces),
            (kept.energies, block.energies),
            (kept.impulses, block.impulses),
            (kept.losses, block.losses),
        ):
            target.append(values[before] + x[:, None] * (values[after] - values[before]))
        # A place may start again from the curve's beginning within a step: take the nearer end.
        nearer = np.where(x < 0.5, before, after)
        kept.places.append(self._places[: len(time)][nearer])

    def _balanced_multipliers(self, wanted: FloatArray, count: int) -> FloatArray:
        """Multipliers between the instants at which the integrator balances forces."""
        at, rows = self._balanced_at[:count], self._multipliers[:count]
        columns = [np.interp(wanted, at, rows[:, k]) for k in range(rows.shape[1])]
        return np.stack(columns, axis=1) if columns else np.zeros((len(wanted), 0))


def _running_integral(time: FloatArray, values: FloatArray) -> FloatArray:
    """Integral from the first instant to each, by trapezoids; shape of `values`."""
    total = np.zeros_like(values)
    steps = np.diff(time).reshape(-1, *([1] * (values.ndim - 1)))
    np.cumsum(0.5 * steps * (values[1:] + values[:-1]), axis=0, out=total[1:])
    return total


def _hermite(
    q: tuple[FloatArray, FloatArray],
    v: tuple[FloatArray, FloatArray],
    span: FloatArray,
    x: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Position and velocity at the part `x` of steps of length `span` between two states."""
    (q0, q1), (v0, v1) = q, v
    h, x = span[:, None, None], x[:, None, None]
    slope = np.divide(q1 - q0, h, out=np.array(v0), where=h > 0)
    b, c = 3 * slope - 2 * v0 - v1, v0 + v1 - 2 * slope
    return q0 + h * x * (v0 + x * (b + x * c)), v0 + x * (2 * b + 3 * x * c)
