"""The problem as the two methods ask for it: the implicit one, and an explicit one."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray
from exudyn_flexlink.engines.lagrangian.equations import moved_by
from exudyn_flexlink.engines.lagrangian.problem import Problem
from exudyn_flexlink.engines.lagrangian.system import Motion
from exudyn_flexlink.engines.pressing import press_by
from exudyn_flexlink.engines.track_follower import DeadCentreError
from exudyn_flexlink.integrate.collocation import WEIGHTS
from exudyn_flexlink.integrate.events import Event
from exudyn_flexlink.integrate.explicit import Dense
from exudyn_flexlink.integrate.problem import Evaluation, Press, State
from exudyn_flexlink.integrate.radau import Step
from exudyn_flexlink.integrate.slow_motions import slow_motions
from exudyn_flexlink.integrate.stepper import HybridProblem

LEAST_SINE = 1e-9  # of the angle between guide and track


class ImplicitProblem(Problem, HybridProblem):
    """The problem as `integrate.stepper` and `integrate.radau` ask for it."""

    _moves: ComplexArray

    # --- equations ----------------------------------------------------------------------------

    def evaluate(self, t: float, q: FloatArray, v: FloatArray) -> Evaluation:
        """Mass matrix and force at one instant (s)."""
        return self.evaluate_stages(np.array([t]), q[None], v[None]).pick(0)

    def evaluate_stages(self, t: FloatArray, q: FloatArray, v: FloatArray) -> Evaluation:
        """Likewise at several, of free coordinates."""
        try:
            at = self.system.motion(t, q, v)
        except DeadCentreError as error:
            self.trouble = str(error)
            raise
        first, faces = self.system.model.first, self.system.contacts.faces
        force, mass = at.force[:, first:], at.mass[:, first:, first:]
        if first:
            force = force - at.mass[:, first:, 0] * at.alpha[:, None]
        touching = np.zeros((len(t), 0, 2))
        if at.pushed is not None:
            own = at.pushed.which < faces
            touching = np.stack([at.pushed.gap[:, own], at.pushed.gap_rate[:, own]], axis=2)
        return Evaluation(mass, force, at, touching)

    def jacobians(self, at: Evaluation) -> tuple[FloatArray, FloatArray]:
        """Springs and dampers, walls and friction."""
        kept: Motion = at.kept.pick(None)
        first, numbers = self.system.model.first, self.system.model.numbers
        self._moves = moved_by(numbers, kept.frame)[:, first:].T.copy()
        stiffness, damping = numbers.stiffness, numbers.damping
        if kept.pushed is not None:
            more = self.system.contacts.slopes_of(kept.pushed)
            stiffness, damping = stiffness + more[0], damping + more[1]
        return stiffness[first:, first:], damping[first:, first:]

    def contacts_at(self, at: Evaluation) -> tuple[FloatArray, Press] | None:
        """Gradients (c, n) of the gaps of levers' contacts that press, and their forces."""
        pushed, first = at.kept.pushed, self.system.model.first
        if pushed is None or not (pushed.which < self.system.contacts.faces).any():
            return None
        own = pushed.which < self.system.contacts.faces
        laws = [self.system.contacts.all[k].law for k in pushed.which[own].tolist()]
        return pushed.rows[own][:, first:], press_by(laws)

    def size(self, change: FloatArray) -> float:
        """How far (m) changes (..., n) of the coordinates move anything, at most."""
        return float(np.abs(change @ self._moves).max(initial=0.0))

    def knots(self) -> list[tuple[FloatArray, FloatArray]]:
        """Of the track's present piece: where its third derivative jumps, and by how much."""
        values, jumps = self.system.track.present.knots
        return [(values, jumps)]

    def places(self, at: Evaluation) -> list[float]:
        """P's place on it."""
        return [float(at.kept.place)]

    def moved_by_point(self, k: int, at: Evaluation) -> float:  # noqa: ARG002
        """How much (m/s^2) things accelerate if the track pushes P aside by 1 m/s^2.

        Pushed aside, P slides along the guide by 1 / sine of the angle between the two, unless
        there is play between them.
        """
        if not len(at.force):
            return 0.0
        model, frame, place = self.system.model, at.kept.frame, np.array([float(at.kept.place)])
        along = self.system.track.at(place)[1][0]
        along /= abs(along)
        pushed = 1j * along
        if not model.layout.play:
            axis = frame.axes[0]
            pushed = axis / max(abs((axis.conjugate() * along).imag), LEAST_SINE)
        by = frame.by[model.numbers.centres, model.first :]
        pulled = ((by.conj() * pushed).real * model.numbers.masses[:, None]).sum(axis=0)
        return self.size(np.asarray(np.linalg.solve(at.mass, pulled)))

    # --- what the stepper asks for ------------------------------------------------------------

    def begin(self, at: Evaluation) -> None:
        """Record the state at time 0."""
        self.recorder.begin(at.kept.pick(None))

    def first_event(self, step: Step) -> Event | None:
        """Locate what happens first within a step."""
        return self.first_within(step)

    def accept(self, step: Step) -> None:
        """Go to the end of a step that is good, and record it."""
        self.go_on(step)

    def longest(self, at: Evaluation) -> float:  # noqa: ARG002
        """Limit of the next step, s."""
        return self.limit()

    def restart(self, time: float) -> tuple[Evaluation, State]:
        """Take up the present state."""
        self.time = time
        at = self.evaluate(time, self.q, self.v)
        self.jacobians(at)
        return at, State(self.q, self.v, at.accelerations)

    def position_per_speed_error(self, at: Evaluation) -> FloatArray:
        """Matrix (n, n), s: the position error that a speed error becomes through slow modes."""
        first = self.system.model.first
        stiffness = self.system.model.numbers.stiffness[first:, first:]
        return slow_motions(at.mass, stiffness, self._end, self._least)

    def slipped(self, step: Step) -> float:
        """How far (m) P, which follows the guide's angle, ended from where its speed takes it."""
        begin, stages = step.begin.kept.frame, step.stages.kept.frame
        moved = step.h * (WEIGHTS @ stages.going[:, 0])
        return float(abs(stages.points[-1, 0] - begin.points[0] - moved))


class ExplicitStep(NamedTuple):
    """A step of an explicit method, or its part up to an event, by its dense output."""

    t: float
    h: float
    dense: Dense
    free: int  # coordinates

    def at(self, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Free coordinates and speeds (m, n) at times (m,) within the step."""
        y = np.array([self.dense(t) for t in time.tolist()])
        return y[:, : self.free], y[:, self.free : 2 * self.free]


class ExplicitProblem(Problem):
    """The problem as `integrate.explicit` asks for it: of first order."""

    @property
    def state(self) -> FloatArray:
        """Free coordinates and speeds (2 n,); without any, two numbers that stand still."""
        return np.concatenate([self.q, self.v]) if len(self.q) else np.zeros(2)

    def begin(self) -> None:
        """Record the state at time 0."""
        self.recorder.begin(self.begin_motion())

    def rate(self, t: float, y: FloatArray) -> FloatArray:
        """dy/dt; not a number in a trial step too far."""
        count = len(self.q)
        q, v = y[None, :count], y[None, count : 2 * count]
        try:
            at = self.system.motion(np.array([t]), q, v)
        except DeadCentreError as error:
            self.trouble = str(error)
            return np.full_like(y, np.nan)
        if not count:
            return np.zeros(2)
        return np.concatenate([v[0], self.system.accelerations(at)[0][0, -count:]])

    def longest(self, t: float, y: FloatArray) -> float:  # noqa: ARG002
        """Limit of the next step, s."""
        return self.limit()

    def first_event(self, begin: float, end: float, dense: Dense) -> Event | None:  # noqa: ARG002
        """Locate what happens first in a step between two instants."""
        return self.first_within(self._step(end, dense))

    def accept(self, end: float, dense: Dense, event: Event | None) -> None:  # noqa: ARG002
        """Go to the end of a step, and record it."""
        self.go_on(self._step(end, dense))

    def _step(self, end: float, dense: Dense) -> ExplicitStep:
        """From here; the same once more where no event cuts it."""
        step = ExplicitStep(self.time, end - self.time, dense, len(self.q))
        known = self._ahead[0] if self._ahead else None
        return known if isinstance(known, ExplicitStep) and known == step else step
