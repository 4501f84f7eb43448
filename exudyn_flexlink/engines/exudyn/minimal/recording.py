"""From the loop's steps to samples, energies and checks.

Samples lie on the polynomial between steps; accelerations and reactions there on that through the
stages, at which they follow from the equations of motion. Energies dissipated and supplied,
impulses and works of contacts are integrals over the stages of every step, as accurate as the
motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.extremes import ExtremeSeeker
from exudyn_flexlink.engines.exudyn.minimal.coordinates import Held
from exudyn_flexlink.engines.exudyn.minimal.kinematics import motions
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel, Whole
from exudyn_flexlink.integrate.collocation import STAGES, WEIGHTS, C
from exudyn_flexlink.integrate.problem import Evaluation
from exudyn_flexlink.integrate.radau import Step
from exudyn_flexlink.laws import RestitutionPenalty
from exudyn_flexlink.mechanism import EnergyMeter, approach, joint_residuals

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

BLOCK = 512  # steps that are worked off together


class Sample(NamedTuple):
    """One kept instant: coordinates, places on the slots' curves, which contacts press.

    Contacts are here and below those of the scene, then the pairs of its sleeves.
    """

    time: float
    x: FloatArray
    v: FloatArray
    places: tuple[float, ...]
    pressed: BoolArray


class Recorder:
    """Takes every step; keeps samples at `grid` (s, increasing) and where it is asked to.

    For each sample `accelerations` and `left` are those of all coordinates and the forces that
    motors and slots add to them; `totals` the energies dissipated in dampers and supplied by drives
    (J), then the impulse of each contact (N s), then the work done on each (J), since time 0.
    `at_notes` are the totals at the instants that were noted.
    """

    def __init__(self, model: MinimalModel, grid: FloatArray, seeker: ExtremeSeeker) -> None:
        self.model = model
        self.seeker = seeker
        self.grid = grid
        self.mechanism = model.assembly.mechanism
        self.meter = EnergyMeter(self.mechanism)
        self.contacts = [*self.mechanism.contacts, *model.walls.contacts]
        self.samples: list[Sample] = []
        self.accelerations: list[FloatArray] = []  # (samples, links) of each block
        self.left: list[FloatArray] = []
        self.totals: list[FloatArray] = []
        self.at_notes: list[FloatArray] = []
        self.energy_residual = 0.0
        self.largest_kinetic_energy = 0.0
        self.constraint_error = 0.0
        self._next = 1
        self._steps: list[Step] = []
        self._ends: list[Held] = []
        self._pressed: list[BoolArray] = []
        self._on_curves: list[tuple[float, ...]] = []  # places of the slots' points at their ends
        self._between: list[tuple[int, float]] = []  # of each new sample: step of the block, part
        self._kept: list[Evaluation] = []
        self._notes: list[int] = []  # steps of the block made before each note
        self._reached = np.zeros(2 + 2 * len(self.contacts))  # totals at the end of the last step
        self._start_energy: float | None = None

    def begin(self, at: Evaluation) -> None:
        """Take the state at time 0."""
        whole: Whole = at.kept
        self._on_curves = [self._places(whole.places)]
        held = Held(*whole[1:7])
        self._check([held], self._reached[None, :], self._acting()[None])
        self._on_curves = []
        self._keep(whole.t, at, (0, 0.0))

    def take(self, step: Step, end: Held) -> None:
        """Take a step to `end`: the samples within, and what its energies and checks need."""
        if len(self._steps) == BLOCK:
            self.flush()
        last = int(np.searchsorted(self.grid, step.end * (1 + 1e-14), side="right"))
        if last > self._next:
            wanted = self.grid[self._next : last]
            self._next = last
            # Forces come from the equations at the samples: derivatives of the step's polynomial
            # are of a lower order, which a force shows that is small beside those it balances.
            found = self.model.evaluate_all(wanted, *step.at(wanted))
            for t, at in zip(wanted.tolist(), found, strict=True):
                self._keep(t, at, (len(self._steps), (t - step.t) / step.h))
        self._steps.append(step)
        self._pressed.append(self._acting())
        self._ends.append(end)
        self._on_curves.append(self._places(end.places))

    def mark(self) -> None:
        """Keep a sample at the end of the last step, too."""
        if self._steps and self.samples[-1].time < self._steps[-1].end:
            last = self._steps[-1]
            self._keep(last.end, last.stages[-1], (len(self._steps) - 1, 1.0))

    def note(self) -> None:
        """Keep the totals at the end of the last step."""
        self._notes.append(len(self._steps))

    def totals_of(self, contact: int, at: FloatArray | None = None) -> tuple[float, float]:
        """Impulse (N s) and energy lost (J) of a contact so far, or `at` a note's totals.

        What a contact stores counts as lost: as it begins and ends it stores nothing, and what it
        stored as its point slid off the face is lost.
        """
        totals = self._reached if at is None else at
        count = len(self.contacts)
        return float(totals[2 + contact]), float(totals[2 + count + contact])

    def _acting(self) -> BoolArray:
        of_scene = np.array([contact.acts for contact in self.model.contacts], dtype=bool)
        return np.concatenate([of_scene, self.model.walls.touching])

    def _keep(self, t: float, at: Evaluation, between: tuple[int, float]) -> None:
        """Keep a sample."""
        whole: Whole = at.kept
        places = self._places(whole.places)
        self.samples.append(Sample(t, whole.x, whole.v, places, self._acting()))
        self._kept.append(at)
        self._between.append(between)

    def _places(self, on_pieces: tuple[float, ...]) -> tuple[float, ...]:
        """Places on the whole curves, in the order of the mechanism's slots."""
        points = zip(self.model.coordinates.points, on_pieces, strict=True)
        found = {point.slot.name: point.place(u) for point, u in points}
        return tuple(found[slot.name] for slot in self.mechanism.slots)

    # --- blocks -------------------------------------------------------------------------------

    def flush(self) -> None:
        """Work off the block: integrals over its steps, what its samples lack, checks."""
        steps = self._steps
        self._work_off_samples()
        if not steps:
            if not self.totals:  # not even a first step was made
                self.totals.append(np.repeat(self._reached[None, :], len(self._between), axis=0))
                self.at_notes += [self._reached for _ in self._notes]
            return
        shape = (len(steps), STAGES + 1, -1)
        nodes = [node for step in steps for node in (step.begin, *step.stages)]
        free = np.array([a for s in steps for a in (s.start.a, *s.accelerations)])
        left = self.model.left_over([node.kept for node in nodes], free)
        rates = self._rates_of([node.kept for node in nodes], left).reshape(shape)
        lengths = np.array([step.h for step in steps])
        gained = lengths[:, None] * np.einsum("i,kij->kj", WEIGHTS, rates[:, 1:])
        reached = self._reached + np.vstack([0 * self._reached, np.cumsum(gained, axis=0)])
        rows = np.array([row for row, _ in self._between], dtype=int)
        parts = np.array([part for _, part in self._between])
        gained = np.einsum("si,sij->sj", _shares(parts), rates[rows, 1:])
        self.totals.append(reached[rows] + lengths[rows, None] * gained)
        self.at_notes += [reached[row] for row in self._notes]
        pressed = np.array(self._pressed)
        self._check(self._ends, reached[1:], pressed)
        self._seek([node.kept for node in nodes], lengths, pressed)
        self._reached = reached[-1]
        self._steps, self._ends, self._pressed, self._on_curves = [], [], [], []
        self._between, self._notes = [], []

    def _work_off_samples(self) -> None:
        """Accelerations of all coordinates at the new samples, and forces that are left over."""
        if not self._kept:
            return
        instants: list[Whole] = [at.kept for at in self._kept]
        mass = np.array([at.mass for at in self._kept])
        force = np.array([at.force for at in self._kept])
        free = np.linalg.solve(mass, force[..., None])[..., 0]
        self.accelerations.append(self.model.whole_accelerations(instants, free))
        self.left.append(self.model.left_over(instants, free))
        self._kept = []

    def _seek(self, kept: Sequence[Whole], lengths: FloatArray, pressed: BoolArray) -> None:
        """Look for extremes within the block's steps, whose nodes are `kept`."""
        x, v = np.array([whole.x for whole in kept]), np.array([whole.v for whole in kept])
        found = motions(self.model.layout, self.model.kinematics, x, v, np.zeros_like(x))
        shape = (len(lengths), STAGES + 1, *found.poses.shape[1:])
        begins = np.array([step.t for step in self._steps])
        motion = found.poses.reshape(shape), found.rates.reshape(shape)
        self.seeker.take(begins, lengths, motion, pressed)

    def _rates_of(self, kept: Sequence[Whole], left: FloatArray) -> FloatArray:
        """Rates of the totals (instants, ...) where motors and slots add the forces `left`."""
        count, first = len(self.contacts), len(self.model.contacts)
        v = np.array([whole.v for whole in kept])
        rates = np.zeros((len(kept), 2 + 2 * count))
        rates[:, 0] = self.model.damped(v)
        rates[:, 1] = np.sum(left * v, axis=1)
        for motor, row in self.model.torques:
            rates[:, 1] += [motor.ramp.at(whole.t) for whole in kept] * (v @ row)
        forces, powers = rates[:, 2 : 2 + count], rates[:, 2 + count :]
        pushes = np.array([whole.pushes for whole in kept]).reshape(len(kept), first, 2)
        forces[:, :first], powers[:, :first] = pushes[..., 0], pushes[..., 1]
        for i, whole in enumerate(kept):
            if whole.wall is not None:
                forces[i, first + whole.wall.which] = whole.wall.press
                powers[i, first + whole.wall.which] = whole.wall.power
        return rates

    def _check(self, kept: list[Held], totals: FloatArray, pressed: BoolArray) -> None:
        x, v = np.array([whole.x for whole in kept]), np.array([whole.v for whole in kept])
        found = motions(self.model.layout, self.model.kinematics, x, v, np.zeros_like(x))
        energies = self.energies(found.poses, found.rates, totals, pressed)
        total = energies[:, 0] + energies[:, 1] + energies[:, 2] - energies[:, 3]
        if self._start_energy is None:
            self._start_energy = float(total[0])
        on_curves = np.array(self._on_curves).reshape(len(kept), -1)
        errors = joint_residuals(self.mechanism, found.poses, on_curves)
        residual = float(np.abs(total - self._start_energy).max())
        self.energy_residual = max(self.energy_residual, residual)
        self.largest_kinetic_energy = max(self.largest_kinetic_energy, float(energies[:, 0].max()))
        self.constraint_error = max(self.constraint_error, float(errors.max(initial=0.0)))

    def energies(
        self, poses: FloatArray, rates: FloatArray, totals: FloatArray, pressed: BoolArray
    ) -> FloatArray:
        """Kinetic, stored, dissipated and supplied energy (instants, 4)."""
        kinetic, stored = self.meter.kinetic(poses, rates), self.meter.potential(poses)
        lost = totals[:, 0] + totals[:, 2 + len(self.contacts) :].sum(axis=1)
        for k in np.flatnonzero(pressed.any(axis=0)).tolist():
            contact, rows = self.contacts[k], pressed[:, k]
            assert isinstance(contact.law, RestitutionPenalty)  # `run` refuses others
            elastic = contact.law.stored_energy(-approach(contact, poses[rows], rates[rows]).gap)
            stored[rows] += elastic
            lost[rows] -= elastic
        return np.stack([kinetic, stored, lost, totals[:, 1]], axis=1)


def _shares(parts: FloatArray) -> FloatArray:
    """Weights (instants, stages) with which an integral up to parts of a step takes its stages."""
    powers = np.arange(1, STAGES + 1)
    return np.asarray(
        (parts[:, None] ** powers / powers) @ np.linalg.inv(np.vander(C, increasing=True))
    )
