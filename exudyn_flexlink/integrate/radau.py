r"""Steps of Radau IIA for ``M(q) q'' = f(t, q, q')``: the method, its error, forces that leap.

E. Hairer and G. Wanner, *Solving Ordinary Differential Equations II*, IV.8: s stages, of order
2 s - 1. The stages collocate ``y' = f`` at the nodes c, the roots of a Jacobi polynomial and 1. So
the method is L-stable, and the last stage is the end of the step. With ``a_ij`` the integral of
Lagrange's polynomial l_j from 0 to c_i, the inverse B of a has one real eigenvalue and conjugate
pairs: ``B = T diag(lambda) T^-1``. One of each pair is kept. The unknowns are the stages' speeds
``V = v0 + W``:

    A = (1/h) B W,     Q = q0 + h a V,     R = f(Q, V) - M(Q) A = 0

solved by simplified Newton, ``(M/h B + D + h a K) dW = R``, with springs K and dampers D, to which
contacts add their share. In the eigenvectors of B this is one real system and (s - 1)/2 complex
systems, each of the size of q:

    (M lambda/h + D + h/lambda K) w = (T^-1 R)_lambda.

The error is that of Hairer and Wanner's embedded formula, ``h (gamma f(y_0) + sum_i d_i f_i)``, of
order s; gamma is the inverse of the real eigenvalue. The real matrix filters it, with contacts as
soft as they become within the step. Within a step speeds follow the polynomial through the start
and the stages, and places follow its integral.

A contact's force changes from loading to unloading within a small part of a step, so its slopes at
one instant mislead the iteration. Each round therefore solves for the gaps at all stages, which are
few numbers, with the forces themselves. The matrices only carry their effect on the other
coordinates. If contact forces leap, their impulses along the step's polynomial and by the stages
differ, and the difference is a second estimate of the error.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial, chebyshev
from scipy.special import roots_jacobi

from exudyn_flexlink.arrays import ComplexArray, FloatArray
from exudyn_flexlink.integrate.events import StepPolynomial
from exudyn_flexlink.integrate.problem import (
    Equations,
    Evaluation,
    Press,
    Pressing,
    State,
    order_of,
)

FARTHEST = 8.0  # extrapolate the last step's polynomial to at most 8 lengths from its start
MOST_ITERATIONS = 8
NEWTON = (
    1e-4  # of the allowed error: the error of the iteration, the same in both runs that measure
)
# Share of the slow position error that counts: iteration errors have either sign and average out.
LASTING = 0.03
STAGNATED = 0.05  # of the allowed error: smaller changes that no longer shrink are rounding
ROUNDS = 40  # of the iteration for the gaps
CLOSE = 1e-3  # of the change: allowed residual of the gaps' equations
SHORTEST_PART = 1e-3  # of a full Newton step
LOOKS, LOOK_WEIGHTS = np.polynomial.legendre.leggauss(12)  # a finer rule than that of the stages
LOOKS, LOOK_WEIGHTS = (1 + LOOKS) / 2, LOOK_WEIGHTS / 2
STEADY = 0.5  # if a contact keeps this share of its largest damping, the stages resolve the step


class Collocation:
    """One method; `nodes` (1 + s,) are its start and stages, as parts of a step."""

    def __init__(self, stages: int) -> None:
        self.stages, self.order = stages, order_of(stages)
        self.degrees = np.arange(stages + 1)
        self.c = np.append((1 + roots_jacobi(stages - 1, 1, 0)[0]) / 2, 1.0)
        self.nodes = np.append(0.0, self.c)
        powers, of_integral = self.c[:, None] ** np.arange(stages), np.arange(1, stages + 1)
        # Chebyshev's polynomials lose less by rounding than powers.
        x, basis = 2 * self.c - 1, np.eye(stages)
        integrals = chebyshev.chebval(x, chebyshev.chebint(basis, lbnd=-1, scl=0.5)).T
        self.a = integrals @ np.linalg.inv(chebyshev.chebvander(x, stages - 1))
        self.b = np.linalg.inv(self.a)
        self.weights = self.a[-1]
        values, columns = np.linalg.eig(self.b)
        kept = np.argsort(values.imag)[stages // 2 :]  # the real eigenvalue, then one of each pair
        self.eigenvalues = values[kept]
        self.real = float(self.eigenvalues[0].real)
        twice = np.where(np.arange(len(kept)) > 0, 2, 1)  # a pair counts twice its real part
        self.from_systems = columns[:, kept] * twice
        self.to_systems = np.linalg.inv(columns)[kept]
        exact = 1.0 / of_integral - np.eye(stages)[0] / self.real
        self.error = self.real * (np.linalg.solve(powers.T, exact) - self.weights) @ self.b
        # Coefficients, by powers of the part of a step, of the polynomials through all nodes, and
        # of those through the stages only.
        self.powers = np.linalg.inv(self.nodes[:, None] ** self.degrees)
        self.by_stages = np.linalg.inv(powers)
        self.polynomial = StepPolynomial(self.nodes)

    def to_parts(self, parts: FloatArray) -> FloatArray:
        """Weights (k, 1 + s) of values at the nodes, for values at parts (k,) of a step."""
        return np.asarray(np.vander(parts, self.stages + 1, increasing=True) @ self.powers)


@cache
def collocation(stages: int) -> Collocation:
    """Return the method with this number of stages."""
    return Collocation(stages)


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


class ContactShare(NamedTuple):
    """Contacts that Woodbury's formula adds to the iteration's systems."""

    rows: FloatArray  # (c, n): gradients of the gaps
    inverse_times_rows: ComplexArray  # (systems, n, c)
    # (stages c, stages c): changes of the gaps' rates by forces at the stages, m/s per N.
    rate_per_force: FloatArray
    press: Press
    touching: FloatArray  # (c, 2): gaps and rates at the start of the step
    start: Pressing  # (c,) each: forces at the start of the step
    method: Collocation

    @classmethod
    def of(
        cls,
        rows: FloatArray,
        press: Press,
        inverses: ComplexArray,
        touching: FloatArray,
        method: Collocation,
    ) -> ContactShare:
        """The share of contacts with the gaps and rates `touching` (c, 2) at the step's start."""
        stages = method.stages
        inverse_times_rows = inverses @ rows.T
        by_system = rows @ inverse_times_rows  # (systems, c, c)
        count = len(rows)
        pairs = (_both(stages) @ by_system.reshape(len(by_system), -1)).real  # (stages stages, c c)
        blocks = pairs.reshape(stages, stages, count, count).transpose(0, 2, 1, 3)
        rate_per_force = blocks.reshape(stages * count, stages * count)
        start = press(touching)
        return cls(rows, inverse_times_rows, rate_per_force, press, touching, start, method)

    def share(self, h: float, change: FloatArray, touching: FloatArray) -> FloatArray:
        """Part (stages, n) by which contacts correct a change of the speeds computed without them.

        `touching` (stages, c, 2) are gaps and rates before the change.
        """
        free = change @ self.rows.T
        before = self.press(touching)
        pushes = self._pushes(h, free, touching, before) - before.force
        of_systems = self.method.to_systems @ pushes  # (systems, c)
        moved = (self.inverse_times_rows @ of_systems[:, :, None])[:, :, 0]
        return np.asarray((self.method.from_systems @ moved).real)

    def _pushes(
        self, h: float, free: FloatArray, touching: FloatArray, start: Pressing
    ) -> FloatArray:
        """Forces (stages, c) after `free` and these forces have changed the rates of the gaps.

        Newton's method, with steps shortened until they help. Forces fall with gap and rate, so
        there is one solution; but they hardly change on either side of a leap.
        """
        shape, size = free.shape, free.size
        spread, same = h * _spread(*shape), np.eye(size)
        flat = free.ravel()
        enough = CLOSE * float(np.abs(flat).max())
        pressing, rates, off = start, np.zeros(size), flat
        left = float(np.abs(off).max())
        for _ in range(ROUNDS):
            if left <= enough:
                break
            slopes = pressing.stiffness.reshape(size, 1) * spread
            slopes.flat[:: size + 1] += pressing.damping.ravel()
            way = np.linalg.solve(same + self.rate_per_force @ slopes, off)
            part, before = 1.0, left
            while True:
                trial = rates + part * way
                moved = np.stack([(spread @ trial).reshape(shape), trial.reshape(shape)], axis=-1)
                pressing = self.press(touching + moved)
                off = flat + self.rate_per_force @ (pressing.force - start.force).ravel() - trial
                left = float(np.abs(off).max())
                if left < before or part < SHORTEST_PART:
                    break
                part /= 2
            rates = trial
        return np.asarray(pressing.force)

    def pull(self, change: FloatArray) -> FloatArray:
        """Forces (n,) against a change of the coordinates, at the start of the step."""
        return np.asarray(self.rows.T @ (self.start.stiffness * (self.rows @ change)))

    def errors(self, h: float, change: FloatArray, touching: FloatArray) -> FloatArray:
        """Errors of the speeds (1 or 2, n); `change` (n,) is the error computed without contacts.

        `touching` (stages, c, 2) are gaps and rates at the stages. A contact that creeps is a stiff
        damper and removes errors. The damper fades when the point speeds up to lift off; then
        errors remain. So the least damping within the step is used. If the damping changes much,
        the forces between the stages are checked as well.
        """
        stages = self.press(touching)
        stiffness = np.minimum(self.start.stiffness, stages.stiffness.min(axis=0))
        damping = np.minimum(self.start.damping, stages.damping.min(axis=0))
        filtered = self._filtered(stiffness * h / self.method.real + damping, change)
        most = np.maximum(self.start.damping, stages.damping.max(axis=0))
        if np.all(damping > STEADY * most):  # if all are zero, a leap may lie between the stages
            return filtered[None]
        return np.stack([filtered, self._missed(h, touching, stages)])

    def _filtered(self, of_rates: FloatArray, change: FloatArray) -> FloatArray:
        """A change (n,) by the real system without contacts, corrected by slopes (c,) of theirs."""
        inverse = self.inverse_times_rows[0].real
        system = np.eye(len(self.rows)) + (self.rows @ inverse) * of_rates
        return np.asarray(
            change - inverse @ (of_rates * np.linalg.solve(system, self.rows @ change)), float
        )

    def _missed(self, h: float, touching: FloatArray, stages: Pressing) -> FloatArray:
        """Errors (n,) of the speeds by changes of the forces between the stages.

        The embedded formula only knows the stages. If a force leaps between two of them, its
        impulse by a finer rule, along the step's polynomial, differs from that by the stages.
        """
        nodes, method = np.concatenate([self.touching[None], touching]), self.method
        between = self.press(
            (_to_looks(method.stages) @ nodes.reshape(len(nodes), -1)).reshape(-1, *nodes.shape[1:])
        )
        impulses = h * (LOOK_WEIGHTS @ between.force - method.weights @ stages.force)
        return np.asarray((method.real / h) * (self.inverse_times_rows[0].real @ impulses))


@cache
def _spread(stages: int, count: int) -> FloatArray:
    """Coefficients a of the method, for each of `count` contacts."""
    return np.asarray(np.kron(collocation(stages).a, np.eye(count)), dtype=np.float64)


@cache
def _to_looks(stages: int) -> FloatArray:
    """Weights of values at the nodes, for values at `LOOKS`."""
    return collocation(stages).to_parts(LOOKS)


@cache
def _both(stages: int) -> ComplexArray:
    """Coefficients (stages stages, systems) from forces at stages to changes at stages."""
    method = collocation(stages)
    both = method.from_systems[:, None, :] * method.to_systems.T[None, :, :]
    return np.asarray(both.reshape(stages * stages, -1))
