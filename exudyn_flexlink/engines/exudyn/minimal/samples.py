"""Samples of a run: which of them a step has, and what is kept of each.

They lie on the polynomial between steps; accelerations and reactions there follow from the
equations of motion, since derivatives of the polynomial are of a lower order, which a force shows
that is small beside those it balances.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import BoolArray, FloatArray, IndexArray
from exudyn_flexlink.engines.exudyn.minimal.coordinates import TreeState, joined
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel, TreeForces
from exudyn_flexlink.integrate.problem import Evaluation
from exudyn_flexlink.integrate.radau import Step


class Sample(NamedTuple):
    """One kept instant: coordinates, places on the slots' curves, which contacts press.

    Contacts are those of the scene and of its bearings, then the pairs of its sleeves; `forces` (N)
    are of all but the pairs.
    """

    time: float
    x: FloatArray
    v: FloatArray
    places: FloatArray
    pressed: BoolArray
    forces: FloatArray


class Samples:
    """Samples `kept` so far, of those of a `grid` (s, increasing) and others.

    For each `accelerations` are those of all coordinates, `constraint_forces` those of motors,
    slots and loops, in blocks (samples, links).
    """

    def __init__(self, model: MinimalModel, grid: FloatArray) -> None:
        self._model, self.grid = model, grid
        self.kept: list[Sample] = []
        self.accelerations: list[FloatArray] = []
        self.constraint_forces: list[FloatArray] = []
        self._next = 1
        self._new: list[Evaluation] = []
        self._between: list[tuple[int, float]] = []  # steps of the block of new ones, parts of them
        # Instants whose forces are still to be found, by the step that they are in.
        self._waiting: list[tuple[FloatArray, TreeState]] = []
        names = [point.slot.name for point in model.coordinates.points]
        slots = model.assembly.mechanism.slots
        self._points = [names.index(slot.name) for slot in slots]

    # --- which a step has ---------------------------------------------------------------------

    def due(self, step: Step) -> FloatArray:
        """Samples (n,), s, up to the end of the next step that is accepted.

        Those that it would have on a dead centre are left out, but for that of the run's end.
        """
        last = min(self._until(step.end), len(self.grid) - 1)
        wanted = self.grid[self._next : last]
        if len(wanted):
            near = self._model.coordinates.near_dead_centre(step, wanted)
            if near.any():
                self.grid = np.delete(self.grid, self._next + np.flatnonzero(near))
        return self.grid[self._next : self._until(step.end)]

    def pass_to(self, end: float) -> FloatArray:
        """Return the samples (n,), s, up to the end of a step or of a part of one (s)."""
        first, self._next = self._next, max(self._next, self._until(end))
        return self.grid[first : self._next]

    def to_come(self) -> FloatArray:
        """Return the samples (n,), s, after those passed."""
        return self.grid[self._next :]

    def _until(self, end: float) -> int:
        """Return how many there are up to an instant (s), that one too."""
        return int(np.searchsorted(self.grid, end * (1 + 1e-14), side="right"))

    # --- what is kept -------------------------------------------------------------------------

    def take(
        self, t: FloatArray, state: TreeState, steps: int | IndexArray, parts: FloatArray
    ) -> None:
        """Keep samples (n,), inside the window then, at parts of one step of the block or of more.

        Where nothing but those decides on forces, they wait: many are found together.
        """
        if self._model.left_to_itself:
            self._waiting.append((t, state))
            self._place(steps, parts)
        else:
            self.keep(self._model.forces_at(t, state), steps, parts)

    def keep(self, found: Evaluation, steps: int | IndexArray, parts: FloatArray) -> None:
        """As `take`, with the forces found."""
        self.work_off_waiting()
        self._add(found)
        self._place(steps, parts)

    def _place(self, steps: int | IndexArray, parts: FloatArray) -> None:
        rows = np.broadcast_to(steps, parts.shape).tolist()
        self._between += zip(rows, parts.tolist(), strict=True)

    def work_off_waiting(self) -> None:
        """Find the forces of the samples that wait: they are asked for, or what presses changes."""
        if self._waiting:
            times, states = zip(*self._waiting, strict=True)
            self._waiting = []
            self._add(self._model.forces_at(np.concatenate(times), joined(states)))

    def _add(self, found: Evaluation) -> None:
        whole: TreeForces = found.kept
        pressed = self._model.acting()
        state, forces = whole.state, whole.pushes[..., 0]
        on_curves = self.places(state.places)
        instants = zip(whole.t.tolist(), state.x, state.v, on_curves, forces, strict=True)
        for t, x, v, places, force in instants:
            self.kept.append(Sample(t, x, v, places, pressed, force))
        self._new.append(found)

    def drop_last(self) -> None:
        """Drop the last sample, which is new."""
        self.work_off_waiting()
        self.kept.pop()
        self._between.pop()
        last = self._new.pop()
        if len(last.kept.t) > 1:
            self._new.append(last.pick(slice(-1)))

    def put_before(self, time: float) -> None:
        """Let the last sample, which is new, be that just before an instant (s)."""
        before = float(np.nextafter(time, 0.0))
        if self.kept[-2].time < before:
            self.kept[-1] = self.kept[-1]._replace(time=before)
        else:
            self.drop_last()

    @property
    def last(self) -> float:
        """Time (s) of the last one."""
        return float(self._waiting[-1][0][-1]) if self._waiting else self.kept[-1].time

    def places(self, on_pieces: FloatArray) -> FloatArray:
        """Places (..., slots) on the whole curves, in the order of the mechanism's slots."""
        places = np.empty(on_pieces.shape)
        for slot, k in enumerate(self._points):
            places[..., slot] = self._model.coordinates.points[k].place(on_pieces[..., k])
        return places

    # --- blocks -------------------------------------------------------------------------------

    def work_off(self) -> tuple[IndexArray, FloatArray]:
        """Find what the new samples lack; return their steps in the block, and the parts of those.

        That are accelerations of all coordinates, and constraint forces.
        """
        self.work_off_waiting()
        if self._new:
            _, accelerations, forces = solved(self._model, self._new)
            self.accelerations.append(accelerations)
            self.constraint_forces.append(forces)
        rows, parts = (np.array([own[i] for own in self._between]) for i in (0, 1))
        self._new, self._between = [], []
        return rows.astype(int), parts


def solved(
    model: MinimalModel, found: Sequence[Evaluation]
) -> tuple[TreeState, FloatArray, FloatArray]:
    """Coordinates, accelerations of all, and constraint forces, all (n, ...)."""
    instants: list[TreeForces] = [at.kept for at in found]
    mass, force = (np.concatenate(own) for own in zip(*[at[:2] for at in found], strict=True))
    free = Evaluation(mass, force).accelerations
    state = joined([whole.state for whole in instants])
    accelerations = model.whole_accelerations(state, free)
    return state, accelerations, model.constraint_forces(instants, accelerations)
