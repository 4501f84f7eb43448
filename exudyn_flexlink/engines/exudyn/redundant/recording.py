"""The recorder of redundant coordinates: of many steps of Exudyn's solver at once.

Each step is a cubic between its two ends. Neighbouring steps share no end, since the value of a
drive or the force of a contact may leap between them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import BoolArray, FloatArray, IndexArray
from exudyn_flexlink.engines.exudyn.redundant.slots import StepEnd
from exudyn_flexlink.engines.exudyn.redundant.system import System
from exudyn_flexlink.engines.recording import BLOCK, BlockRecorder, Kept, Steps, Totals, together
from exudyn_flexlink.engines.touching import Change, ExtremeSeeker, Moment, Touches
from exudyn_flexlink.laws import Impulse
from exudyn_flexlink.mechanism import (
    anchor_velocity,
    approach,
    force_at,
    joint_residuals,
    joint_speed,
    motor_place,
    sizes_at,
    turning,
)
from exudyn_flexlink.rounding import KNOT_TIME

BESIDE = 2 * KNOT_TIME  # s: twice the time within which steps end on the knots of a drive


class Changed(NamedTuple):
    """Event of a contact at the end of a step; its force `leaps`, or starts from zero."""

    contact: int
    what: Change
    now: Moment
    leaps: bool


_Balanced = tuple[FloatArray, FloatArray]  # instants (m,), s, and their multipliers (m, rows)


class SolverKept(NamedTuple):
    """The solver's coordinates, velocities and Lagrange multipliers (m, ...) at instants."""

    q: FloatArray
    v: FloatArray
    multipliers: FloatArray
    elastic: FloatArray  # energy that contacts store, J


class _States(NamedTuple):
    """States of the solver at instants (m,), with the slots' places."""

    t: FloatArray
    q: FloatArray
    v: FloatArray
    multipliers: FloatArray
    places: FloatArray


class StepRecorder(BlockRecorder):
    """Records the steps of a system.

    `motor_rows` are the rows of multipliers that are torques or forces of speed motors.
    """

    ends_kept = 4  # steps are short

    def __init__(
        self,
        system: System,
        grid: FloatArray,
        spectral_radius: float,
        seeker: ExtremeSeeker,
        touches: Touches,
    ) -> None:
        super().__init__(system.mechanism, grid, seeker, touches)
        self.coordinates = system.coordinates
        self.motor_rows = [system.multipliers(item)[0] for item in system.motors]
        # Generalised-alpha balances forces at the weighted mean of both ends of a step, not at its
        # end. Multipliers with this mean are free of the alternating error that follows a jump.
        self._alpha = spectral_radius / (1 + spectral_radius)
        self._balanced: tuple[float, FloatArray] | None = None  # the last of the block before
        # Instants, coordinates, velocities, multipliers and slots' places at the ends of steps.
        self._rows: list[tuple[float, FloatArray, FloatArray, FloatArray, list[float]]] = []
        self._changes: list[tuple[int, Changed]] = []  # with the row of each
        self._events: list[float] = []  # instants (s) at which contacts of the scene changed

    def note(self, changed: Changed) -> None:
        """Note an event of a contact at the end of the step that is recorded next."""
        self._changes.append((len(self._rows), changed))
        if changed.contact < self._marked:
            time = changed.now.time
            self._events += [np.nextafter(time, 0.0), time] if changed.leaps else [time]

    def take(self, now: StepEnd, multipliers: FloatArray, places: list[float]) -> None:
        """Record the end of a step, with places in slots; the first call records the start."""
        self._rows.append((now.time, now.q, now.v, multipliers, places))
        if len(self._rows) > BLOCK:
            self.record_waiting()

    def record_waiting(self) -> None:
        """Record the steps that wait; the next ones start at the end of the last."""
        first, count = self._balanced is None, len(self._rows)
        if count == 0 or (count == 1 and not first):
            return
        ends = _States(*(np.array(column) for column in zip(*self._rows, strict=True)))
        balanced, pressing = self._balance(ends.t, ends.multipliers), self._pressing(count)
        if first:
            begun, _, speeds = pressing
            at_start = _States(*(column[:1] for column in ends))
            self._start(self._known(at_start, balanced, begun[:1], speeds[:1])[0])
        reached = self._reached.of(self._reached.all[None])
        if count > 1:
            reached = self._take_steps(ends, balanced, pressing)
        if first:
            reached.all[0] = 0.0  # totals begin at 0
        for row, changed in self._changes:
            impulse, lost = (
                float(column[row, changed.contact]) for column in (reached.impulses, reached.losses)
            )
            now = changed.now._replace(totals=(impulse, lost))
            self.touches.change(changed.contact, changed.what, now)
        self._changes.clear()
        self._rows = self._rows[-1:]

    def _take_steps(
        self, ends: _States, balanced: _Balanced, pressing: tuple[BoolArray, BoolArray, FloatArray]
    ) -> Totals:
        """Record the steps between `ends`; return the totals at the ends."""
        count, (begun, ended, speeds) = len(ends.t) - 1, pressing
        samples = np.union1d(self._due(ends.t[-1]), self._events)
        self._pass(ends.t[-1])
        self._events.clear()
        # An instant at which a step begins belongs to this step, after any leap.
        of = np.clip(np.searchsorted(ends.t, samples, side="right") - 1, 0, count - 1)
        nodes = _States(*(np.concatenate([column[:-1], column[1:]]) for column in ends))
        pressed, of_touches = (
            np.concatenate([begun_then[:-1], then[1:]])
            for begun_then, then in ((begun, ended), (speeds, speeds))
        )
        at_nodes, power = self._known(nodes, balanced, pressed, of_touches)
        known = together([at_nodes, _within(at_nodes, of, samples, balanced)])
        numbers = np.arange(2 * count).reshape(2, count).T
        inner = np.arange(2 * count, len(known.t))
        steps = Steps(ends.t[:-1], np.diff(ends.t), numbers, inner, of)
        rates = self._rates(at_nodes, power, balanced)
        return self._book(steps, known, rates, known.pick(numbers[:, 1]), speeds[:-1])

    def _pressing(self, count: int) -> tuple[BoolArray, BoolArray, FloatArray]:
        """Whether contacts press (rows, c) when steps begin, and when steps end, at these rows.

        Also the speeds (m/s) at which their last touches began.
        """
        begun = np.tile(self.touches.pressed, (count, 1))
        speeds = np.tile(self.touches.approach, (count, 1))
        for row, changed in self._changes:
            begun[row:, changed.contact] = changed.what is Change.CLOSES
            if changed.what is Change.CLOSES:
                speeds[row:, changed.contact] = -changed.now.gap_rate
        ended = begun.copy()
        for row, changed in self._changes:
            if changed.leaps:
                ended[row, changed.contact] ^= True
        return begun, ended, speeds

    def _balance(self, t: FloatArray, raw: FloatArray) -> _Balanced:
        """Mean multipliers of steps, with the instants at which they balance forces."""
        mean = (1 - self._alpha) * raw[1:] + self._alpha * raw[:-1]
        before = self._balanced
        if (
            before is None
        ):  # the solver has no reactions at time 0: those of the first step are used
            mean[:1] = raw[1:2]
            before = t[0], raw[:2][-1]
        times = np.append(before[0], t[1:] - self._alpha * np.diff(t))
        rows = np.vstack([before[1], mean])
        self._balanced = times[-1], rows[-1]
        return times, rows

    # --- kept quantities ----------------------------------------------------------------------

    def _known(
        self, states: _States, balanced: _Balanced, pressed: BoolArray, approach_speed: FloatArray
    ) -> tuple[Kept, FloatArray]:
        """Kept quantities at instants, with totals still 0, and powers of contacts (m, c), W.

        `pressed` (m, c) are contacts that press; touches began at `approach_speed` (m, c), m/s.
        """
        press, power = np.zeros(pressed.shape), np.zeros(pressed.shape)
        elastic = np.zeros(len(states.t))
        poses, rates = self.coordinates.at_joints(states.q, states.v)
        for k in np.flatnonzero(pressed.any(axis=0)).tolist():
            contact, rows = self.contacts[k], pressed[:, k]
            seen = approach(contact, poses[rows], rates[rows], states.t[rows])
            assert not isinstance(contact.law, Impulse)  # `prepare` refuses it
            deep = np.maximum(-seen.gap, 0.0)
            force = contact.law.force(deep, -seen.gap_rate, approach_speed[rows, k])
            elastic[rows] += contact.law.stored_energy(deep)
            press[rows, k], power[rows, k] = force, -force * seen.gap_rate
            if contact.friction is not None:
                power[rows, k] -= contact.friction.force(force, seen.slip) * seen.slip
        kept = SolverKept(states.q, states.v, _at(balanced, states.t), elastic)
        totals = np.zeros((len(states.t), 2 + self.frictions))
        return Kept(states.t, states.places, press, pressed, totals, kept), power

    def _rates(self, known: Kept, power: FloatArray, balanced: _Balanced) -> Totals:
        """Rates (2 k, ...) of the totals at the begins of steps, then at their ends."""
        nodes = len(known.t)
        q, v = self.coordinates.at_joints(known.of_engine.q, known.of_engine.v)
        rates = self._totals(nodes)
        for k, friction in enumerate(self.mechanism.frictions):
            speed = joint_speed(friction.joint, q, v)
            rates.rubbed[:, k] = -friction.regularised(speed) * speed
        rates.damped[:] = self.meter.damping_power(q, v)
        rates.damped[:] += self.coordinates.of_beams(known.of_engine.q, known.of_engine.v).lost
        rates.impulses[:], rates.losses[:] = known.press, power[:nodes]
        begin, end = known.t.reshape(2, -1)
        middle = _at(balanced, 0.5 * (begin + end))
        for motor, row in zip(self.mechanism.speed_motors, self.motor_rows, strict=True):
            # Forces balance best in the middle of a step; the step's path is more exact than
            # speeds.
            way = np.diff(motor_place(motor, q).reshape(2, -1), axis=0)[0]
            rates.supplied[:] -= np.tile(middle[:, row] * way / (end - begin), 2)
        # At a leap of a drive, a step ends with the value before, and the next begins with that
        # after.
        beside = np.repeat([BESIDE, -BESIDE], nodes // 2)
        rates.supplied[:] += self._load_power(np.clip(known.t + beside, 0, self.grid[-1]), q, v)
        return rates

    def _load_power(self, time: FloatArray, q: FloatArray, v: FloatArray) -> FloatArray:
        """Power of torques and forces (instants,), W."""
        power = np.zeros(len(time))
        for torque in self.mechanism.torque_motors:
            power += sizes_at(torque.size, time, q, v) * turning(torque.first, torque.second, v)
        for force in self.mechanism.forces:
            pushed = force_at(force, time, q, v) * anchor_velocity(force.point, q, v)
            power += pushed.sum(axis=1)
        return power

    def motion(self, rows: Kept) -> tuple[FloatArray, FloatArray]:
        """Poses and rates (m, parts, 3) at kept instants."""
        return self.coordinates.shown(rows.of_engine.q, rows.of_engine.v)

    def energies(self, rows: Kept, poses: FloatArray, rates: FloatArray) -> FloatArray:
        """Kinetic, stored, dissipated and supplied energy (instants, 4)."""
        beams, elastic = (
            self.coordinates.of_beams(rows.of_engine.q, rows.of_engine.v),
            rows.of_engine.elastic,
        )
        kinetic = self.meter.kinetic(poses, rates) + beams.kinetic
        stored = self.meter.potential(poses) + beams.stored + elastic
        return np.column_stack([kinetic, stored, rows.totals[:, 0] - elastic, rows.totals[:, 1]])

    def residuals(self, rows: Kept, poses: FloatArray) -> FloatArray:  # noqa: ARG002
        """Openings of joints, m."""
        held, _ = self.coordinates.at_joints(rows.of_engine.q, rows.of_engine.v)
        return joint_residuals(self.mechanism, held, rows.places)


def _within(nodes: Kept, of: IndexArray, time: FloatArray, balanced: _Balanced) -> Kept:
    """Kept quantities at instants (n,) in the steps `of`; nodes are all starts, then all ends.

    Motions are cubics. Their error may exceed the depth of a stiff contact, so its force and energy
    are linear. A place is that of the nearer end, since it may leap at the seam of a closed curve.
    """
    then = of + len(nodes.t) // 2
    h = (nodes.t[then] - nodes.t[of])[:, None]
    x = (time - nodes.t[of])[:, None] / h
    (q0, v0, _, e0), (q1, v1, _, e1) = nodes.pick(of).of_engine, nodes.pick(then).of_engine
    slope = (q1 - q0) / h
    b, c = 3 * slope - 2 * v0 - v1, v0 + v1 - 2 * slope
    kept = SolverKept(
        q0 + h * x * (v0 + x * (b + x * c)),
        v0 + x * (2 * b + 3 * x * c),
        _at(balanced, time),
        e0 + x[:, 0] * (e1 - e0),
    )
    places = nodes.places[np.where(x[:, 0] < 0.5, of, then)]
    press = nodes.press[of] + x * (nodes.press[then] - nodes.press[of])
    return Kept(
        time, places, press, nodes.pressed[of], np.zeros((len(time), nodes.totals.shape[1])), kept
    )


def _at(balanced: _Balanced, time: FloatArray) -> FloatArray:
    """Multipliers (m, rows) at instants (m,), linear between instants of balance."""
    times, rows = balanced
    of = np.clip(np.searchsorted(times, time) - 1, 0, len(times) - 1)
    then = np.minimum(of + 1, len(times) - 1)
    span = np.where(then > of, times[then] - times[of], 1.0)
    part = np.clip((time - times[of]) / span, 0.0, 1.0)[:, None]
    return np.asarray(rows[of] + part * (rows[then] - rows[of]))
