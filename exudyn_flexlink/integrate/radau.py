r"""Steps of Radau IIA for ``M(q) q'' = f(t, q, q')``, with an estimate of their error.

E. Hairer and G. Wanner, *Solving Ordinary Differential Equations II*, IV.8: s stages,
collocation at c, L-stable, stiffly accurate. The unknowns are the stages' speeds ``V = v0 + W``:

    A = (1/h) B W,  B = (a_ij)^-1,     Q = q0 + h a V,     R = f(Q, V) - M(Q) A = 0

solved by simplified Newton, ``(M/h B + D + h a K) dW = R``, with springs K and dampers D, to which
contacts add their share. In the eigenvectors of B this is one real system and (s - 1)/2 complex
systems, each of the size of q:

    (M lambda/h + D + h/lambda K) w = (T^-1 R)_lambda.

The error is that of Hairer and Wanner's embedded formula, of order s. The real matrix filters it,
with contacts as soft as they become within the step. If contact forces leap, their impulses
along the step's polynomial and by the stages differ, and the difference is a second estimate (see
`contact_share`). Within a step speeds follow the polynomial through the start and the stages, and
places follow its integral.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial

from exudyn_flexlink.arrays import ComplexArray, FloatArray
from exudyn_flexlink.integrate.collocation import Collocation, collocation
from exudyn_flexlink.integrate.contact_share import ContactShare
from exudyn_flexlink.integrate.problem import Equations, Evaluation, State

FARTHEST = 8.0  # extrapolate the last step's polynomial to at most 8 lengths from its start
MOST_ITERATIONS = 8
NEWTON = (
    1e-4  # of the allowed error: the error of the iteration, the same in both runs that measure
)
# Share of the slow position error that counts: iteration errors have either sign and average out.
LASTING = 0.03
STAGNATED = 0.05  # of the allowed error: smaller changes that no longer shrink are rounding


class Step(NamedTuple):
    """A step from `t` to `t + h` (s), with the states at its ends.

    `begin` is the evaluation at its start, `stages` that of the iteration's last round, with
    `accelerations` (stages, n); `error` (m) is estimated. The iteration took so many `rounds`.
    """

    t: float
    h: float
    start: State
    finish: State
    begin: Evaluation
    stages: Evaluation
    speeds: FloatArray
    accelerations: FloatArray
    error: float
    rounds: int

    @property
    def end(self) -> float:
        """Time at its end, s."""
        return self.t + self.h

    @property
    def method(self) -> Collocation:
        """The method that made the step."""
        return collocation(len(self.accelerations))

    def at(self, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Coordinates and speeds (instants, n) at times within the step.

        By what is gained since its start. Of the whole speeds the powers, which are large and
        cancel each other, would leave rounding, and that adds up from event to event.
        """
        since = (time - self.t)[:, None]
        part, method, v = since / self.h, self.method, self.start.v
        powers = part**method.degrees
        gained = method.powers @ (self.speeds - v)
        moved = self.h * ((part * powers / (method.degrees + 1)) @ gained)
        return self.start.q + (since * v + moved), v + powers @ gained

    def slope(self, at_nodes: FloatArray) -> Callable[[float], float]:
        """Return the slope (per step) by time (s) of the polynomial through values at its nodes."""
        polynomial = Polynomial(self.method.powers @ at_nodes).deriv()
        return lambda time: float(polynomial((time - self.t) / self.h))

    def ending(self, end: float) -> Step:
        """Return the step with its end moved a little, to `end` (s), along its polynomial."""
        h = end - self.t
        method = self.method
        begins = method.nodes * (h / self.h)
        v = self.start.v
        speeds = v + begins[:, None] ** method.degrees @ (method.powers @ (self.speeds - v))
        q, v = self.at(np.array([end]))
        return self._replace(h=h, speeds=speeds, finish=State(q[0], v[0], self.finish.a))


class ErrorTimes(NamedTuple):
    """Times (s) that turn a speed error into a position error."""

    in_contact: float  # for steps in which a contact presses: its force may leap
    free: float


class Radau:
    """Makes steps of Radau IIA for given equations."""

    def __init__(
        self,
        equations: Equations,
        error_times: ErrorTimes,
        position_per_speed_error: FloatArray,
        method: Collocation,
    ) -> None:
        """Take equations, times that turn speed errors into position errors, and the method.

        `position_per_speed_error` (n, n), s, is the share of slow modes in these times.
        """
        self.equations, self.error_times, self.method = equations, error_times, method
        self._systems = method.eigenvalues[:, None, None]
        self.position_per_speed_error = position_per_speed_error
        self.iterations = 0
        # Begin, length and speeds of the last step solved.
        self._last: tuple[float, float, FloatArray] | None = None

    def restart(self) -> None:
        """Forget the last step: the equations have changed."""
        self._last = None

    def step(
        self, t: float, h: float, start: Evaluation, state: State, allowed: float
    ) -> Step | None:
        """Make a step of this length, whatever its error; None if the iteration fails.

        `start` is the evaluation at `state`; the iteration ends at a part of the error `allowed`
        (m).
        """
        times, method, before = t + self.method.c * h, self.method, self.iterations
        guess = self._guess(t, h, state.v)
        residual = self._residual(times, h, state, guess)
        if residual is None:
            return None
        # New matrices cost less than the rounds of the iteration that they save.
        try:
            matrices = self._factorised(h, start, self._stages.pick(method.stages // 2))
            w = self._solve(times, state, matrices, allowed, (guess, residual))
        except (
            np.linalg.LinAlgError
        ):  # a bad guess, or a contact so stiff that the rest is rounding
            return None
        if w is None:
            return None
        speeds, accelerations = state.v + w, (method.b @ w) / h
        moved = h * (method.a @ speeds)
        errors = self._errors(start, state, w, moved, matrices)
        in_contact = matrices.contacts is not None
        tau = self.error_times.in_contact if in_contact else self.error_times.free
        errors[1:] = tau * errors[1:] + errors[1:] @ self.position_per_speed_error.T
        error = self.equations.size(errors)
        known = np.concatenate([state.v[None], speeds])
        self._last = (t, h, known)
        end = State(state.q + moved[-1], speeds[-1], accelerations[-1])
        rounds = self.iterations - before
        return Step(t, h, state, end, start, self._stages, known, accelerations, error, rounds)

    def _factorised(self, h: float, start: Evaluation, middle: Evaluation) -> _Matrices:
        """Matrices at the step's middle, the nearest to all stages, with contacts at its start."""
        stiffness, damping = self.equations.jacobians(middle)
        systems = middle.mass * (self._systems / h) + damping + stiffness * (h / self._systems)
        inverses = np.asarray(np.linalg.inv(systems), dtype=np.complex128)
        acting = self.equations.contacts_at(start)
        contacts = (
            None
            if acting is None
            else ContactShare.of(*acting, inverses, start.touching, self.method)
        )
        return _Matrices(h, inverses, stiffness, contacts, self.method)

    def _guess(self, t: float, h: float, v: FloatArray) -> FloatArray:
        """Increments of the stages' speeds, from the polynomial of the last step solved.

        It is the step before, or a longer step from the same instant. The increments are zero if
        there was none, or only a much shorter one, such as a step that ended at an event.
        """
        if self._last is None or t - self._last[0] + h > FARTHEST * self._last[1]:
            return np.zeros((self.method.stages, len(v)))
        begin, before, speeds = self._last
        method = self.method
        ahead = ((t - begin + method.c * h) / before)[:, None] ** method.degrees
        return np.asarray(ahead @ (method.powers @ speeds) - v)

    def _solve(
        self,
        times: FloatArray,
        state: State,
        matrices: _Matrices,
        allowed: float,
        first: tuple[FloatArray, FloatArray],
    ) -> FloatArray | None:
        """Increments W of the stages' speeds; None if the iteration does not converge.

        `first` are a guess, which is overwritten, and its residual.
        """
        h = matrices.h
        (w, residual), before, rate = first, 0.0, 1.0
        enough = NEWTON * allowed
        for left in reversed(range(MOST_ITERATIONS)):
            change = matrices.change(residual)
            if matrices.contacts is not None:
                change += matrices.contacts.share(h, change, self._stages.touching)
            w += change
            size = h * self.equations.size(change)
            slow_error = self.position_per_speed_error @ change[-1]
            size += LASTING * self.equations.size(slow_error)
            if before > 0:
                rate = size / before
                if not rate < 1:
                    return w if size < STAGNATED * allowed else None
                # At this rate the remaining rounds are too few (Hairer and Wanner, IV.8).
                if rate**left / (1 - rate) * size > max(enough, STAGNATED * allowed):
                    return None
            # At the present rate the sum of all further changes is at most this.
            if size == 0 or (rate < 1 and rate / (1 - rate) * size < enough):
                return w
            before = size
            miss = self._residual(times, h, state, w)
            if miss is None:
                return None
            residual = miss
        return None

    def _residual(
        self, times: FloatArray, h: float, state: State, w: FloatArray
    ) -> FloatArray | None:
        """``f - M A`` at the stages; None if they can't be evaluated. Keeps the evaluations."""
        self.iterations += 1
        speeds, accelerations = state.v + w, (self.method.b @ w) / h
        places = state.q + h * (self.method.a @ speeds)
        try:
            stages = self.equations.evaluate_stages(times, places, speeds)
        except (ValueError, ArithmeticError):
            return None
        self._stages = stages
        return np.asarray(stages.force - (stages.mass @ accelerations[:, :, None])[:, :, 0])

    def _errors(
        self, start: Evaluation, state: State, w: FloatArray, moved: FloatArray, matrices: _Matrices
    ) -> FloatArray:
        """Estimated errors of coordinates, then of speeds by one or two estimates (2 or 3, n)."""
        h, inverse, contacts = matrices.h, matrices.inverses[0].real, matrices.contacts
        error, real = self.method.error, self.method.real
        of_place = state.v + error @ moved / h
        # The state's accelerations are used: the force at the start is older than the last round.
        inertia = start.mass @ (state.a + error @ w / h)
        spring = matrices.stiffness @ of_place
        if contacts is not None:
            spring += contacts.pull(of_place)
        of_speed = inverse @ (inertia - (h / real) * spring)
        of_speeds = of_speed[None]
        if contacts is not None:
            of_speeds = contacts.errors(h, of_speed, self._stages.touching)
        return np.concatenate([((h / real) * (of_place + of_speeds[0]))[None], of_speeds])


class _Matrices(NamedTuple):
    """Inverses of the iteration's systems for steps of length h, and the stiffness behind them."""

    h: float
    inverses: ComplexArray  # (systems, n, n), the real system first
    stiffness: FloatArray
    contacts: ContactShare | None
    method: Collocation

    def change(self, residual: FloatArray) -> FloatArray:
        """Change (stages, n) of the stages' speeds, without contacts."""
        turned = self.inverses @ (self.method.to_systems @ residual)[:, :, None]
        return np.asarray((self.method.from_systems @ turned[:, :, 0]).real)
