"""From the loop's steps to samples, energies and checks.

Energies dissipated and supplied, impulses and works of contacts are integrals over the stages of
every step, as accurate as the motion.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from exudyn_flexlink.arrays import BoolArray, FloatArray, IndexArray
from exudyn_flexlink.engines.extremes import ExtremeSeeker
from exudyn_flexlink.engines.exudyn.intervals import Entry
from exudyn_flexlink.engines.exudyn.minimal.coordinates import TreeState, joined
from exudyn_flexlink.engines.exudyn.minimal.driven import cut, shaken
from exudyn_flexlink.engines.exudyn.minimal.kinematics import motions
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel, TreeForces
from exudyn_flexlink.engines.exudyn.minimal.quiet import QuietSteps
from exudyn_flexlink.engines.exudyn.minimal.samples import Samples, solved
from exudyn_flexlink.integrate.collocation import NODES, STAGES, WEIGHTS
from exudyn_flexlink.integrate.problem import Evaluation
from exudyn_flexlink.integrate.radau import Step
from exudyn_flexlink.intervals import Interval
from exudyn_flexlink.laws import Impulse
from exudyn_flexlink.mechanism import EnergyMeter, approach, joint_residuals

BLOCK = 512  # steps that are worked off together


class Recorder:
    """Takes every step; keeps `samples` at `grid` (s, increasing) and where it is asked to.

    For each sample `totals` are the energies dissipated in dampers and supplied by drives (J), then
    the impulse of each contact (N s), then the work done on each (J), since time 0. `entries`
    are the contacts' beginnings and ends, `at_notes` the totals then, `impacts` what is without
    duration, by the number of the contact.
    """

    def __init__(self, model: MinimalModel, grid: FloatArray, seeker: ExtremeSeeker) -> None:
        self.model = model
        self.seeker = seeker
        self.mechanism = model.assembly.mechanism
        self.meter = EnergyMeter(self.mechanism)
        self.contacts = seeker.contacts
        self._shaken = shaken(model.layout)
        self.samples = Samples(model, grid)
        self._quiet = QuietSteps(model)
        self.totals: list[FloatArray] = []
        self.entries: list[Entry] = []
        self.at_notes: list[FloatArray] = []
        self.impacts: list[tuple[int, Interval]] = []
        self.energy_residual = 0.0
        self.largest_kinetic_energy = 0.0
        self.constraint_error = 0.0
        self._steps: list[Step] = []
        self._ends: list[TreeState] = []
        self._pressed: list[BoolArray] = []
        self._on_curves: list[FloatArray] = []  # places of the slots' points at their ends
        self._notes: list[tuple[int, int]] = []  # steps and leaps of the block before each note
        self._leaps: list[tuple[int, FloatArray]] = []  # of the totals, after so many steps
        self._reached = np.zeros(2 + 2 * len(self.contacts))  # totals at the end of the last step
        self._start_energy: float | None = None
        self._jumped = False  # since the last step

    def begin(self, at: Evaluation) -> None:
        """Take the state at time 0."""
        start: TreeState = at.kept.state
        self._on_curves = [self.samples.places(start.places)]
        self._check([start], self._reached[None, :], self.model.acting()[None])
        self._on_curves = []
        self.samples.keep(at.pick(None), 0, np.zeros(1))

    def found_with_end(self, step: Step) -> FloatArray:
        """Samples (n,), s, whose coordinates a step's end is found along with; see `take`."""
        due = self.samples.due(step)
        return due[:0] if self._cuts(step) else due

    def _cuts(self, step: Step) -> bool:
        return self._shaken or len(step.finish.q) == 0

    def waits(self, step: Step) -> bool:
        """Tell whether samples in a step may be found later; see `take_quiet`."""
        return self.model.left_to_itself and not self._cuts(step)

    def take_quiet(self, step: Step, end: TreeState, exact: bool) -> None:
        """Take a step in which samples may wait to its `end`, which waits too if not `exact`."""
        self._take(step, end)
        self._quiet.add(len(self._steps) - 1, step, self.samples.pass_to(step.end), not exact)
        if self._quiet.full:
            self._find_quiet()

    def _find_quiet(self) -> None:
        """Find what waits of quiet steps."""
        found = self._quiet.find()
        if found is None:
            return
        on_curves = self.samples.places(found.ends.places)
        for i, row in enumerate(found.steps.tolist()):
            self._ends[row], self._on_curves[row] = found.ends.pick(i), on_curves[i]
        if len(found.t):
            self.samples.take(found.t, found.within, found.rows, found.parts)

    def work_off_waiting(self) -> None:
        """Find what waits: it is asked for, or what decides on it changes."""
        self._find_quiet()
        self.samples.work_off_waiting()

    def take(self, step: Step, within: TreeState, end: TreeState) -> None:
        """Take a step to `end`, `within` it those samples that `found_with_end` told of."""
        self._find_quiet()
        if not self._cuts(step):
            self._take(step, end)
            wanted = self.samples.pass_to(step.end)
            if len(wanted):
                row, parts = len(self._steps) - 1, (wanted - step.t) / step.h
                self.samples.take(self.model.window.all_inside(wanted), within, row, parts)
            return
        for part in cut(self.model, step, self.samples.to_come()):
            last = part.end >= step.end
            self._take(part, end if last else part.stages.kept.state.pick(-1))
            wanted = self.samples.pass_to(part.end)
            if len(wanted):
                found = self._at_samples(step, part, wanted)
                row, parts = len(self._steps) - 1, (wanted - part.t) / part.h
                self.samples.keep(found, row, parts)

    def _take(self, step: Step, end: TreeState) -> None:
        if len(self._steps) == BLOCK:
            self.flush()
        self._steps.append(step)
        self._jumped = False
        self._pressed.append(self.model.acting())
        self._ends.append(end)
        self._on_curves.append(self.samples.places(end.places))

    def _at_samples(self, whole: Step, part: Step, wanted: FloatArray) -> Evaluation:
        """Mass matrix and forces at samples (s) within a part of the `whole` step."""
        if part is not whole and np.array_equal(wanted, part.stages.kept.t[-1:]):
            return part.stages.pick(slice(-1, None))  # cut there, and evaluated
        return self.model.evaluate_all(wanted, *whole.at(wanted))

    def mark(self) -> None:
        """Keep a sample at the end of the last step, too."""
        self._find_quiet()
        if self._steps and self.samples.last < self._steps[-1].end:
            last, row = self._steps[-1], len(self._steps) - 1
            end = last.stages.pick(slice(-1, None))
            self.samples.keep(end, row, np.ones(1))

    def note(self, entry: Entry) -> None:
        """Write down what a contact does at the end of the last step, with the totals then."""
        self.entries.append(entry)
        self._notes.append((len(self._steps), len(self._leaps)))

    def leap(
        self, contacts: Sequence[int], impulse: FloatArray, lost: FloatArray, supplied: float
    ) -> None:
        """Take an impact: impulses (N s) and losses (J) of contacts (c,), work (J) of drives."""
        totals, which = np.zeros_like(self._reached), np.asarray(contacts)
        totals[1] = supplied
        totals[2 + which], totals[2 + len(self.contacts) + which] = impulse, lost
        self._leaps.append((len(self._steps), totals))

    def keep_again(self, at: Evaluation) -> None:
        """Keep the state after all jumps at one instant, beside that before them."""
        self._find_quiet()
        if self._jumped or at.kept.t == 0:
            self.samples.drop_last()
        else:
            self.samples.put_before(at.kept.t)
        self._jumped = True
        self.samples.keep(at.pick(None), len(self._steps), np.zeros(1))

    def totals_of(self, contact: int, at: FloatArray | None = None) -> tuple[float, float]:
        """Impulse (N s) and energy lost (J) of a contact so far, or `at` a note's totals.

        What a contact stores counts as lost: as it begins and ends it stores nothing, and what it
        stored as its point slid off the face is lost.
        """
        totals = self._reached if at is None else at
        count = len(self.contacts)
        return float(totals[2 + contact]), float(totals[2 + count + contact])

    # --- blocks -------------------------------------------------------------------------------

    def flush(self) -> None:
        """Work off the block: integrals over its steps, what its samples lack, checks."""
        self._find_quiet()
        steps = self._steps
        rows, parts = self.samples.work_off()
        if not steps:
            if not self.totals:  # not even a first step was made
                self.totals.append(np.repeat(self._reached[None, :], len(rows), axis=0))
                self.at_notes += [self._reached for _ in self._notes]
            return
        stages: list[TreeForces] = [step.stages.kept for step in steps]
        free = np.concatenate([step.accelerations for step in steps])
        state = joined([whole.state for whole in stages])
        forces = self.model.constraint_forces(stages, self.model.whole_accelerations(state, free))
        rates = self._rates_of(stages, state, forces).reshape(len(steps), STAGES, -1)
        lengths = np.array([step.h for step in steps])
        gained = lengths[:, None] * (WEIGHTS @ rates)
        nothing = 0 * self._reached
        reached = self._reached + np.vstack([nothing, np.cumsum(gained, axis=0)])
        leapt = np.cumsum([nothing, *(leap for _, leap in self._leaps)], axis=0)
        leapt_after = [row for row, _ in self._leaps]
        leaps = np.searchsorted(leapt_after, rows, side="right")
        # A sample right after an impact that no step of the block follows is at none of its part.
        inner = np.minimum(rows, len(steps) - 1)
        nodes = np.concatenate([self._rates_at_starts(inner)[:, None], rates[inner]], axis=1)
        gained = np.einsum("si,sij->sj", _shares(parts), nodes)
        self.totals.append(reached[rows] + leapt[leaps] + lengths[inner, None] * gained)
        self.at_notes += [reached[row] + leapt[leap] for row, leap in self._notes]
        pressed = np.array(self._pressed)
        before = np.searchsorted(leapt_after, np.arange(1, len(steps) + 1))
        self._check(self._ends, reached[1:] + leapt[before], pressed)
        self._seek(state, lengths, pressed)
        self._reached = reached[-1] + leapt[-1]
        self._steps, self._ends, self._pressed, self._on_curves = [], [], [], []
        self._notes, self._leaps = [], []

    def _rates_at_starts(self, steps: IndexArray) -> FloatArray:
        """Rates of the totals (n, ...) as these steps of the block begin."""
        which, back = np.unique(steps, return_inverse=True)
        begins = [self._steps[k].begin.pick(None) for k in which.tolist()]
        if not begins:
            return np.zeros((0, len(self._reached)))
        state, _, forces = solved(self.model, begins)
        return self._rates_of([at.kept for at in begins], state, forces)[back]

    def _seek(self, state: TreeState, lengths: FloatArray, pressed: BoolArray) -> None:
        """Look for extremes within the block's steps, with the coordinates at their stages."""
        begins: list[TreeState] = [step.begin.kept.state for step in self._steps]
        x = _at_nodes([begin.x for begin in begins], state.x)
        v = _at_nodes([begin.v for begin in begins], state.v)
        found = motions(self.model.layout, self.model.kinematics, x, v, np.zeros_like(x))
        times = np.array([step.t for step in self._steps])
        self.seeker.take(times, lengths, (found.poses, found.rates), pressed)

    def _rates_of(
        self, stages: Sequence[TreeForces], state: TreeState, forces: FloatArray
    ) -> FloatArray:
        """Rates of the totals (n, ...) at coordinates (n, ...), with constraint forces (n, links).

        The instants (n,) are those of all stages in a row.
        """
        count, first = len(self.contacts), len(self.model.contacts)
        v = state.v
        rates = np.zeros((len(v), 2 + 2 * count))
        rates[:, 0] = self.model.all_springs.lost(state.x, v)
        rates[:, 1] = np.sum(forces * v, axis=1)
        rates[:, 1] += np.concatenate([whole.supply for whole in stages])
        forces, powers = rates[:, 2 : 2 + count], rates[:, 2 + count :]
        pushes = np.concatenate([whole.pushes for whole in stages])
        forces[:, :first], powers[:, :first] = pushes[..., 0], pushes[..., 1]
        done = 0
        for whole in stages:
            rows = slice(done, done + len(whole.t))
            if whole.wall is not None:
                forces[rows, first + whole.wall.which] = whole.wall.press
                powers[rows, first + whole.wall.which] = whole.wall.power
            done = rows.stop
        return rates

    def _check(self, kept: list[TreeState], totals: FloatArray, pressed: BoolArray) -> None:
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
            if isinstance(contact.law, Impulse):
                continue  # rigid: it stores nothing
            elastic = contact.law.stored_energy(-approach(contact, poses[rows], rates[rows]).gap)
            stored[rows] += elastic
            lost[rows] -= elastic
        return np.stack([kinetic, stored, lost, totals[:, 1]], axis=1)


def _at_nodes(starts: Sequence[FloatArray], stages: FloatArray) -> FloatArray:
    """Values (steps, nodes, links) at the starts of steps, (links,) each, and at all stages."""
    inner = stages.reshape(len(starts), STAGES, -1)
    return np.concatenate([np.array(starts)[:, None], inner], axis=1)


def _shares(parts: FloatArray) -> FloatArray:
    """Weights (instants, 1 + stages) of an integral up to parts of a step: its start, its stages.

    Of the polynomial through them, as places and speeds have it. Up to the end these are the
    weights of the method, of which the start has none, since that rule is exact for it.
    """
    powers = np.arange(1, STAGES + 2)
    return np.asarray((parts[:, None] ** powers / powers) @ NODES)
