"""The recorder of trees, which evaluates the nodes and samples of many steps together.

Samples lie on the step's polynomial. Accelerations and reactions there follow from the equations of
motion: derivatives of the polynomial have a lower order, and a small force, which is the difference
of large ones, would show that.

No error estimate limits a step where drives prescribe all motion, or give a motion by a formula. So
for sums and extremes such a step counts as several shorter ones, which end at its samples.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.minimal.coordinates import TreeState
from exudyn_flexlink.engines.exudyn.minimal.kinematics import joined, motions
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel, TreeForces
from exudyn_flexlink.engines.recording import AT_ONCE, BLOCK, BlockRecorder, Kept, Steps, Totals
from exudyn_flexlink.engines.touching import ExtremeSeeker
from exudyn_flexlink.integrate.events import EVENT_TIME
from exudyn_flexlink.integrate.problem import Evaluation, instant
from exudyn_flexlink.integrate.radau import Step
from exudyn_flexlink.mechanism import Ramp

MOST_PARTS = 128  # of a step that is cut at its samples


class TreeKept(NamedTuple):
    """Coordinates of the tree, speeds and accelerations, and constraint forces (m, links)."""

    x: FloatArray
    v: FloatArray
    a: FloatArray
    forces: FloatArray  # of motors, slots and loops
    friction: FloatArray  # (m, joints): torque or force on the second part, N m or N
    rests: FloatArray  # (m, joints): 1 where friction holds a joint


class Leaps(NamedTuple):
    """Jumps of speeds by impulses, at instants (K,), s; each is one row of these arrays.

    Coordinates (links,), places of slots, jumps of the speeds, constraint impulses of motors, slots
    and loops (links,), and impulses of all contacts across and along them (N s).
    """

    t: FloatArray
    x: FloatArray
    places: FloatArray
    rates: FloatArray
    held: FloatArray
    push: FloatArray
    rub: FloatArray


class _Waiting(NamedTuple):
    """A step that waits, with instants `t` (s): first its samples, then the stages of its parts.

    `samples` is the number of samples, `edges` (s) are the ends of its parts. `states` are all
    coordinates at the instants, and last at the end of the step.
    """

    step: Step
    t: FloatArray
    samples: int
    edges: FloatArray
    states: TreeState


class TreeRecorder(BlockRecorder):
    """Takes the steps of a tree."""

    def __init__(self, model: MinimalModel, grid: FloatArray, seeker: ExtremeSeeker) -> None:
        mechanism = model.assembly.mechanism
        super().__init__(mechanism, grid, seeker, model.touches)
        self.model = model
        # Steps in which anything is solved for are short enough for motors with constant speeds and
        # ramps: no motor turns far within a step. Other motions may be fast, with small amplitudes.
        self._shaken = any(not isinstance(m.speed, Ramp) for m, _ in model.layout.motors.values())
        self._waiting: list[_Waiting] = []
        self._leaps: list[Leaps] = []
        names = [point.slot.name for point in model.coordinates.points]
        self._points = [names.index(slot.name) for slot in mechanism.slots]

    def begin(self, start: Evaluation) -> None:
        """Take the state at time 0."""
        self._start(self.known(start.pick(None), start.accelerations[None]))

    def keep(self, state: Evaluation) -> None:
        """Record the present state, after an event."""
        self.record_waiting()
        self._keep_now(self.known(state.pick(None), state.accelerations[None]))

    # --- steps --------------------------------------------------------------------------------

    def instants(self, step: Step) -> FloatArray:
        """Instants (n,) in the last step tried, s, that are evaluated; the last one is its end.

        Samples on a dead centre are left out, except that of the run's end.
        """
        last = min(self._until(step.end), len(self.grid) - 1)
        wanted = self.grid[self._next : last]
        if len(wanted):
            near = self.model.coordinates.near_dead_centre(step, wanted)
            if near.any():
                self.grid = np.delete(self.grid, self._next + np.flatnonzero(near))
        samples = self._due(step.end)
        edges = self._edges(step, samples)
        stages = (
            edges[:-1, None] + np.diff(edges)[:, None] * step.method.c
            if len(edges) > 2
            else edges[:0]
        )
        return self.model.window.all_inside(np.concatenate([samples, stages.ravel(), edges[-1:]]))

    def _edges(self, step: Step, samples: FloatArray) -> FloatArray:
        """Where the parts of a step begin and end, s: at its samples, if it has parts."""
        ends = np.array([step.t, step.end])
        if not self._shaken and len(step.finish.q):
            return ends
        near = instant(step.end, EVENT_TIME)
        first, last = np.searchsorted(samples, [step.t + near, step.end - near])
        inner = samples[first:last]
        return np.concatenate([ends[:1], inner[:: 1 + len(inner) // MOST_PARTS], ends[1:]])

    def take(self, step: Step, states: TreeState) -> None:
        """Take a step with all coordinates at its `instants`."""
        samples, t = self._due(step.end), self.instants(step)
        # A formula of what supplies energy ends the run where it has no value.
        if self.model.loads.supplied_by_formula and len(t) > 1:
            self.model.loads.push(t[:-1], states.x[:-1], states.v[:-1])
        self._waiting.append(_Waiting(step, t, len(samples), self._edges(step, samples), states))
        self._pass(step.end)
        instants = sum(len(wait.t) for wait in self._waiting)
        if len(self._waiting) >= AT_ONCE or instants > BLOCK:
            self.record_waiting()

    def record_waiting(self) -> None:
        """Evaluate and record the steps that wait; the same contacts press in all of them."""
        waiting, self._waiting = self._waiting, []
        if not waiting:
            return
        evaluations, free = [], []
        for step in (wait.step for wait in waiting):
            begin = step.begin.pick(None)
            evaluations += [begin, step.stages]
            # At stages the accelerations of the polynomial count, so that energies balance like the
            # motion does.
            free += [begin.accelerations, step.accelerations]
        state = joined([wait.states for wait in waiting])
        t = np.concatenate([wait.t for wait in waiting])
        last = np.cumsum([len(wait.t) for wait in waiting]) - 1
        inner = np.delete(np.arange(len(t)), last)
        if len(inner):
            evaluations.append(self.model.forces_at(t[inner], state.pick(inner)))
            free.append(evaluations[-1].accelerations)
        whole: Evaluation = joined(evaluations)
        known = self.known(whole, np.concatenate(free))
        rates, ends = self._rates(whole, known), state.pick(last)
        steps = self._with_middles(_steps(waiting), known)
        # At ends of steps and at all samples accelerations and forces are those of the equations.
        nodes = len(waiting) * (1 + waiting[0].step.method.stages)
        rows = np.append(steps.nodes[:, -1], steps.samples[steps.samples < nodes])
        solved = whole.pick(rows)
        for column, values in zip(
            known.of_engine, self.known(solved, solved.accelerations).of_engine, strict=True
        ):
            column[rows] = values
        # The last round of a step's iteration moved its end away from the last stage.
        last_rows = known.pick(steps.nodes[:, -1])
        which = np.cumsum([len(wait.edges) - 1 for wait in waiting]) - 1
        last_rows.of_engine.x[which], last_rows.of_engine.v[which], last_rows.places[which] = (
            ends.x,
            ends.v,
            self._places(ends),
        )
        self._book(steps, known, rates, last_rows)

    def jump(
        self, t: float, state: TreeState, rates: FloatArray, held: FloatArray, impulses: FloatArray
    ) -> None:
        """Take a jump of all speeds (links,) at a state, by `impulses` (2, contacts): see Leaps."""
        places = self._places(state.pick(None))[0]
        self._leaps.append(Leaps(np.array(t), state.x, places, rates, held, *impulses))

    def leaps(self) -> Leaps | None:
        """Jumps so far, together; None: there was none."""
        return Leaps._make(map(np.stack, zip(*self._leaps, strict=True))) if self._leaps else None

    # --- what is known ------------------------------------------------------------------------

    def known(self, evaluation: Evaluation, free: FloatArray) -> Kept:
        """Rows of the record, without totals; `free` (m, independent) are accelerations."""
        whole: TreeForces = evaluation.kept
        state, count = whole.state, len(whole.t)
        a = state.b + state.transform.expanded(free)
        forces = (whole.mass @ a[:, :, None])[:, :, 0] - whole.force
        press = whole.pushes[..., 0]
        pressed = np.broadcast_to(self.touches.pressed, press.shape)
        kept = TreeKept(state.x, state.v, a, forces, *whole.friction[..., [0, 3]].T.swapaxes(1, 2))
        totals = np.zeros((count, 2 + self.frictions))
        return Kept(whole.t, self._places(state), press, pressed, totals, kept)

    def _places(self, state: TreeState) -> FloatArray:
        """Places (m, slots) on the whole curves, in the order of the mechanism's slots."""
        places = np.empty((len(state.x), len(self._points)))
        for slot, k in enumerate(self._points):
            places[:, slot] = self.model.coordinates.points[k].place(state.places[:, k])
        return places

    def _rates(self, evaluation: Evaluation, known: Kept) -> Totals:
        """Rates (m, ...) of the totals at instants."""
        whole: TreeForces = evaluation.kept
        kept, rates = known.of_engine, self._totals(len(known.t))
        if self.frictions:
            rates.rubbed[:] = -kept.friction * (kept.v @ self.model.frictions.rows.T)
        rates.damped[:] = self.model.all_springs.lost(kept.x, kept.v)
        rates.supplied[:] = (kept.forces * kept.v).sum(axis=1) + whole.supply
        rates.impulses[:], rates.losses[:] = known.press, whole.pushes[..., 1]
        return rates

    def motion(self, rows: Kept) -> tuple[FloatArray, FloatArray]:
        """Poses and rates (m, parts, 3) of rows of the record."""
        x, v = rows.of_engine.x, rows.of_engine.v
        moved = motions(self.model.layout, self.model.kinematics, x, v, np.zeros_like(x))
        return moved.poses, moved.rates


def _steps(waiting: list[_Waiting]) -> Steps:
    """Number the nodes and samples of steps; a step that is cut counts as several.

    Rows are first the starts and stages of all steps, then the instants within them, without ends.
    """
    begins, lengths, nodes, samples, steps_of = [], [], [], [], []
    stages_in = waiting[0].step.method.stages
    rows = np.arange(1 + stages_in)
    count, row = 0, len(waiting) * len(rows)
    for k, wait in enumerate(waiting):
        nodes_of, parts = len(rows) * k + rows[None], len(wait.edges) - 1
        inner = row + np.arange(wait.samples)
        if parts > 1:
            stages = row + wait.samples + np.arange(parts * stages_in).reshape(parts, stages_in)
            nodes_of = np.column_stack([[nodes_of[0, 0], *stages[:-1, -1]], stages])
        begins.append(wait.edges[:-1])
        lengths.append(np.diff(wait.edges) if parts > 1 else np.array([wait.step.h]))
        nodes.append(nodes_of)
        samples.append(inner)
        # A sample at the end of a part belongs to that part.
        part = np.searchsorted(wait.edges[1:-1], wait.t[: wait.samples])
        steps_of.append(count + part)
        count, row = count + parts, row + len(wait.t) - 1
    columns = begins, lengths, nodes, samples, steps_of
    return Steps._make(np.concatenate(column) for column in columns)
