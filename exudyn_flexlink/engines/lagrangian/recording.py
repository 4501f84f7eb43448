"""From the loop's steps to even samples, energies and checks.

Energies dissipated and supplied, impulses and works of contacts are part of the integrated state:
their errors are controlled like those of the motion. Samples come from the dense output.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import groupby
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import BoolArray, FloatArray
from exudyn_flexlink.engines.diagnostics.walls import BROKEN_WALL_ADVICE, broken_wall
from exudyn_flexlink.engines.extremes import ExtremeSeeker
from exudyn_flexlink.engines.lagrangian.equations import PENALTY
from exudyn_flexlink.engines.lagrangian.event_functions import Side
from exudyn_flexlink.engines.lagrangian.mode import Mode
from exudyn_flexlink.engines.lagrangian.sampling import Motions, motions_at, states_within
from exudyn_flexlink.engines.lagrangian.step_control import Buffer
from exudyn_flexlink.engines.lagrangian.system import System
from exudyn_flexlink.engines.lagrangian.touching import Rule
from exudyn_flexlink.engines.lagrangian.track_point import TrackPoint
from exudyn_flexlink.integrate.collocation import RADAU
from exudyn_flexlink.integrate.explicit import Dense
from exudyn_flexlink.laws import RestitutionPenalty
from exudyn_flexlink.mechanism import EnergyMeter, approach, deepest_allowed, joint_residuals

_Motion = tuple[FloatArray, FloatArray, TrackPoint]

BLOCK = 1024
_PLACES, _WEIGHTS = np.polynomial.legendre.leggauss(4)  # on -1 .. 1
GAUSS_NODES = (1 + _PLACES) / 2
GAUSS = Rule.of(GAUSS_NODES, _WEIGHTS / 2)


@dataclass
class Samples:
    """Kept instants."""

    time: list[float] = field(default_factory=list)
    motion: list[Motions] = field(default_factory=list)  # of some instants each
    totals: list[FloatArray] = field(default_factory=list)  # see Recorder._rows

    def drop_last(self) -> None:
        """Forget the last instant."""
        self.time.pop()
        self.totals.pop()
        self.motion[-1] = Motions(*(part[:-1] for part in self.motion[-1]))


class _Steps(NamedTuple):
    """Steps, their motion at the nodes of each, and which contacts press in them."""

    begins: FloatArray  # (m,) s
    lengths: FloatArray  # (m,) s
    q: FloatArray  # (m n, N)
    v: FloatArray  # (m n, N)
    points: FloatArray  # (m n, 6)
    pressed: BoolArray  # (m, c)


class Recorder:
    """Takes every step; keeps samples at `grid` (s, increasing) and at the instants of events."""

    def __init__(
        self,
        system: System,
        grid: FloatArray,
        seeker: ExtremeSeeker,
        explicit: bool,
    ) -> None:
        self.system = system
        self.seeker = seeker
        self._explicit = explicit
        layout = system.model.layout
        self._levers = [layout.coordinate(lever.part) for lever in layout.levers]
        self.grid = grid
        self.samples = Samples()
        self.meter = EnergyMeter(system.model.mechanism)
        self.energy_residual = 0.0
        self.largest_kinetic_energy = 0.0
        self.constraint_error = 0.0
        self.largest_penetration = 0.0
        self._next = 0
        self._events = 0
        self._checked: list[tuple[FloatArray, FloatArray, FloatArray, FloatArray]] = []
        self._waiting = 0
        self._steps: list[_Steps] = []  # of the block
        self._start: tuple[float, _Motion | None] = (0.0, None)  # of the next step
        self._start_energy: float | None = None

    def before(self, end: float, dense: Dense) -> None:
        """Keep the samples within a step, and follow the walls through it."""
        self._follow_walls(end, dense)
        self._steps.append(self._step(end, dense))
        while self._next < len(self.grid) and self.grid[self._next] < end:
            at = float(self.grid[self._next])
            self._keep(at, dense(at))

    def after(self, t: float, y: FloatArray, crossed: bool) -> None:
        """Keep the sample at a step's end if one is due, and check the state."""
        due = self._next < len(self.grid) and self.grid[self._next] <= t
        if due or (crossed and len(self.system.events) > self._events):
            self._keep(t, y)
        self._events = len(self.system.events)
        # P is searched as within the steps: right at a dead centre another search ends elsewhere.
        self._start = t, self.system.coordinates(t, y)
        now = self.system.motion(t, y)
        places = np.column_stack([now.point, now.place])
        self._checked.append((now.q, now.v, places, self._rows(y[None], now.pressed)))
        self._waiting += 1
        if self._waiting >= BLOCK:
            self.flush()

    def _follow_walls(self, end: float, dense: Dense) -> None:
        """Integrate over a step to `end`, by Gauss's rule."""
        if self.system.walls:
            begin, length = self._start[0], end - self._start[0]
            instants = (begin + length * GAUSS_NODES).tolist()
            motion = [self.system.coordinates(t, dense(t)) for t in instants]
            q, v, points = (np.array(part) for part in zip(*motion, strict=True))
            self._take_walls(np.array([length]), GAUSS, (q, v, points))

    def _take_walls(
        self,
        lengths: FloatArray,
        rule: Rule,
        motion: tuple[FloatArray, FloatArray, FloatArray],
    ) -> None:
        """Hand steps on to the walls, and stop where the link broke through one."""
        for walls in self.system.walls:
            walls.take(lengths, rule, motion)
            if walls.deepest > deepest_allowed(walls.channel):
                self.system.stop(broken_wall(walls.channel), BROKEN_WALL_ADVICE)

    def take(self, steps: Buffer, mode: Mode) -> None:
        """Keep the samples within steps in which nothing happened, and check their ends."""
        end = float(steps.times[-1])
        last = int(np.searchsorted(self.grid, end, side="right"))
        if last > self._next:
            self._keep_all(self.grid[self._next : last], steps, mode)
            self._next = last
        found, shift = self._nodes_of(steps, mode), self.system.track.shift
        if self.system.walls:
            rule = Rule.of(self.seeker.nodes, np.array([0.0, *RADAU.matrix[-1]]))
            lengths = np.diff(steps.times)
            self._take_walls(lengths, rule, (found.q, found.v, found.point))
        ends = slice(len(self.seeker.nodes) - 1, None, len(self.seeker.nodes))
        q, v, points, u = (part[ends] for part in (found.q, found.v, found.point, found.place))
        rows = self._rows(steps.states[1:], found.pressed[ends])
        self._checked.append((q, v, np.column_stack([points, u + shift]), rows))
        self._waiting += len(rows)
        self._start = end, None
        if self._waiting >= BLOCK:
            self.flush()

    def _step(self, end: float, dense: Dense) -> _Steps:
        """Motion at the nodes of a step to `end` (s), whose states `dense` gives.

        Of an explicit step, to look inside which costs evaluations of its own, the ends are enough
        where no lever turns and no contact presses.
        """
        begin, first = self._start
        first = first or self.system.coordinates(begin, dense(begin))
        last = self.system.coordinates(end, dense(end))
        pressed, inner, levers = self._pressed(1), list[_Motion](), self._levers
        turned = np.any(np.sign(first[1][levers]) != np.sign(last[1][levers]))
        if not self._explicit or turned or pressed.any():
            parts = self.seeker.nodes[1:-1] * (end - begin)
            inner = [self.system.coordinates(t, dense(t)) for t in (begin + parts).tolist()]
        q, v, points = (np.array(part) for part in zip(first, *inner, last, strict=True))
        return _Steps(np.array([begin]), np.array([end - begin]), q, v, points, pressed)

    def _nodes_of(self, steps: Buffer, mode: Mode) -> Motions:
        """Motion at the nodes of steps in a row, which is noted, too."""
        # Their times are the method's own, which it writes over.
        nodes, begins, starts = self.seeker.nodes, steps.times[:-1].copy(), steps.states[:-1, None]
        lengths = np.diff(steps.times)
        states = np.concatenate([starts, starts + steps.changes], axis=1)
        instants = (begins[:, None] + lengths[:, None] * nodes).ravel()
        near = np.repeat(steps.places[:-1], len(nodes))
        found = motions_at(instants, states.reshape(len(instants), -1), near, mode, False)
        pressed = self._pressed(len(begins))
        self._steps.append(_Steps(begins, lengths, found.q, found.v, found.point, pressed))
        return found

    def _pressed(self, steps: int) -> BoolArray:
        """Contacts whose penalty acts, in so many steps, (steps, contacts)."""
        acts = [contact.acting == PENALTY for contact in self.system.contacts]
        return np.tile(np.array(acts, dtype=bool), (steps, 1))

    def _seek(self) -> None:
        """Look for extremes within the steps of the block."""
        steps = [step for step in self._steps if step.lengths[0] > 0]
        self._steps.clear()
        for _, alike in groupby(steps, key=lambda step: len(step.q) // len(step.begins)):
            begins, lengths, q, v, points, pressed = map(np.concatenate, zip(*alike, strict=True))
            poses, rates = self.system.model.poses(q, v, points)
            shape = (len(begins), len(q) // len(begins), *poses.shape[1:])
            motion = poses.reshape(shape), rates.reshape(shape)
            self.seeker.take(begins, lengths, motion, pressed)

    def _keep_all(self, instants: FloatArray, steps: Buffer, mode: Mode) -> None:
        """Keep the samples at instants within steps in a row."""
        states = states_within(instants, steps.times, steps.states, steps.changes, RADAU.powers)
        within = np.searchsorted(steps.times, instants, side="left") - 1
        near = steps.places[np.clip(within, 0, len(steps.changes) - 1)]
        found = motions_at(instants, states, near, mode, True)
        kept, shift = self.samples, self.system.track.shift
        if kept.time and kept.time[-1] >= instants[0]:
            kept.drop_last()
        kept.time += instants.tolist()
        kept.motion.append(found._replace(place=found.place + shift))
        kept.totals += list(self._rows(states, found.pressed))

    def _rows(self, states: FloatArray, pressed: FloatArray) -> FloatArray:
        """Values of states (m, size) between two events, of each contact where it says so, (m, ..).

        Energies dissipated and supplied; of each contact its work, whether it acts, whether it may
        touch; the energy in the walls, of which `pressed` (m,) is as in `Motions`.
        """
        contacts = self.system.contacts
        at, count = 2 * self.system.free, len(contacts)
        acts = [contact.side is Side.PRESSED for contact in contacts]
        free = [contact.side is not Side.BEHIND for contact in contacts]
        rows = np.zeros((len(states), 3 + 3 * count))
        rows[:, :2] = states[:, at : at + 2]
        rows[:, 2 : 2 + count] = states[:, at + 2 + count :]
        rows[:, 2 + count : 2 + 3 * count] = [*acts, *free]
        for walls in self.system.walls:
            rows[:, -1] = walls.stored(pressed)
        return rows

    def keep_last(self, t: float, y: FloatArray) -> None:
        """Keep the state in which a run ends before its time, or that before an event."""
        if not self.samples.time or self.samples.time[-1] < t:
            self._keep(t, y)

    def _keep(self, t: float, y: FloatArray) -> None:
        kept = self.samples
        if kept.time and kept.time[-1] >= t:
            kept.drop_last()  # several events at one instant: the state after the last
        now = self.system.motion(t, y)
        kept.time.append(t)
        kept.motion.append(now)
        kept.totals += list(self._rows(y[None], now.pressed))
        while self._next < len(self.grid) and self.grid[self._next] <= t:
            self._next += 1

    def flush(self) -> None:
        """Work off the block: extremes within its steps, and checks of their ends."""
        self._seek()
        if not self._checked:
            return
        q, v, points, rows = (np.concatenate(parts) for parts in zip(*self._checked, strict=True))
        self._checked.clear()
        self._waiting = 0
        poses, rates = self.system.model.poses(q, v, points[:, :6])
        energies = self.energies(poses, rates, rows)
        total = energies[:, 0] + energies[:, 1]
        if self._start_energy is None:
            self._start_energy = float(total[0])
        residual = total - self._start_energy + energies[:, 2] - energies[:, 3]
        errors = joint_residuals(self.system.model.mechanism, poses, points[:, 6:])
        depth = self._penetrations(poses, rates, rows)
        walls = max((walls.deepest for walls in self.system.walls), default=0.0)
        self.energy_residual = max(self.energy_residual, float(np.abs(residual).max()))
        self.largest_kinetic_energy = max(self.largest_kinetic_energy, float(energies[:, 0].max()))
        self.constraint_error = max(self.constraint_error, float(errors.max(initial=0.0)))
        self.largest_penetration = max(
            self.largest_penetration, float(depth.max(initial=0.0)), walls
        )

    def energies(self, poses: FloatArray, rates: FloatArray, rows: FloatArray) -> FloatArray:
        """Kinetic, stored, dissipated and supplied energy, (instants, 4)."""
        kinetic, stored = self.meter.kinetic(poses, rates), self.meter.potential(poses)
        count = len(self.system.contacts)
        in_walls = rows[:, -1]
        lost = rows[:, 0] + rows[:, 2 : 2 + count].sum(axis=1) - in_walls
        stored = stored + in_walls
        for k, contact in enumerate(self.system.contacts):
            law = contact.face.law
            if isinstance(law, RestitutionPenalty):
                gap = approach(contact.face, poses, rates).gap
                elastic = rows[:, 2 + count + k] * law.stored_energy(-gap)
                stored, lost = stored + elastic, lost - elastic
        return np.stack([kinetic, stored, lost, rows[:, 1]], axis=1)

    def _penetrations(self, poses: FloatArray, rates: FloatArray, rows: FloatArray) -> FloatArray:
        depths = np.zeros((len(poses), len(self.system.contacts)))
        for k, contact in enumerate(self.system.contacts):
            at = approach(contact.face, poses, rates)
            over = (at.place >= 0) & (at.place <= contact.length)
            open_ = rows[:, 2 + 2 * len(self.system.contacts) + k] > 0
            depths[:, k] = np.where(over & open_, np.maximum(-at.gap, 0.0), 0.0)
        return depths
