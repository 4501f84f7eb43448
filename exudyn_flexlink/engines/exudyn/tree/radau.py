r"""Radau IIA of order 5 for ``M(q) q'' = f(t, q, q')``, with error estimate and step control.

E. Hairer and G. Wanner, *Solving Ordinary Differential Equations II*, IV.8 (RADAU5): three stages,
collocation at c, L-stable, stiffly accurate. The unknowns are the stages' speeds ``V = v0 + W``:

    A = (1/h) B W,  B = (a_ij)^-1,     Q = q0 + h a V,     R = f(Q, V) - M(Q) A = 0

solved by simplified Newton, ``(M/h B + D + h a K) dW = R``, with springs K and dampers D. In the
eigenvectors of B that is one real system and one complex one of the size of q:

    (M lambda/h + D + h/lambda K) w = (T^-1 R)_lambda.

The error is that of Hairer and Wanner's embedded formula of order 3, filtered by the real matrix.
Between steps q follows the polynomial of degree 5 through place, speed and acceleration of both
ends.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def collocation(stages: int) -> tuple[FloatArray, FloatArray]:
    """Nodes c and coefficients a of the Radau IIA method; its order is 2 stages - 1."""
    legendre = np.polynomial.legendre
    last, before = np.zeros(stages + 1), np.zeros(stages + 1)
    last[stages], before[stages - 1] = 1.0, -1.0
    # c are the zeros of P_s(2 c - 1) - P_(s-1)(2 c - 1), of which 1 is one
    c = (np.sort(legendre.legroots(last + before).real) + 1) / 2
    c[-1] = 1.0
    powers = np.arange(1, stages + 1)
    a = (c[:, None] ** powers / powers) @ np.linalg.inv(np.vander(c, increasing=True))
    return c, a


STAGES = 3
C, A = collocation(STAGES)
WEIGHTS = A[-1]
B = np.linalg.inv(A)
NODES = np.linalg.inv(np.vander(np.array([0.0, *C]), increasing=True))


def _systems() -> tuple[list[complex], FloatArray, FloatArray]:
    """Eigenvalues of B, the real one first and one of each pair, with the matrices T and T^-1."""
    values, vectors = np.linalg.eig(B)
    back = np.linalg.inv(vectors)
    real = int(np.argmin(np.abs(values.imag)))
    chosen = [real, *np.flatnonzero(values.imag > 1e-6 * abs(values[real])).tolist()]
    # A pair counts twice its real part.
    factors = np.array([1.0, *[2.0] * (len(chosen) - 1)])
    return [complex(values[i]) for i in chosen], vectors[:, chosen] * factors, back[chosen]


EIGENVALUES, FROM, TO = _systems()
REAL = EIGENVALUES[0].real


def _error_weights() -> FloatArray:
    """Weights e of the embedded formula, which has the start as another node."""
    powers = np.arange(1, STAGES + 1)
    right = 1.0 / powers
    right[0] -= 1 / REAL
    embedded = np.linalg.solve(np.vander(C, increasing=True).T, right)
    return np.asarray(REAL * (embedded - WEIGHTS) @ B)


ERROR = _error_weights()

MOST_ITERATIONS = 8
NEWTON = 1e-3  # of the error allowed: what the iteration may leave
SLOW = 0.2  # slower convergence asks for new matrices
LEAST_RATE = 0.02  # none is taken to be faster, for the first round of the next step


class Evaluation(NamedTuple):
    """Mass matrix (n, n) and force (n,) at one state, and what the problem keeps of it."""

    mass: FloatArray
    force: FloatArray
    kept: Any = None


class Problem(Protocol):
    """``mass q'' = force``; `jacobians` are -df/dq and -df/dq' about the last evaluation."""

    def evaluate(self, t: float, q: FloatArray, v: FloatArray) -> Evaluation:
        """Mass matrix and force."""

    def jacobians(self, at: Evaluation) -> tuple[FloatArray, FloatArray]:
        """Stiffness and damping matrix, near enough for the iteration to converge."""

    def size(self, change: FloatArray) -> float:
        """How far (m) changes (..., n) of the coordinates move anything, at most."""


class State(NamedTuple):
    """Places, speeds and accelerations (n,)."""

    q: FloatArray
    v: FloatArray
    a: FloatArray


class Step(NamedTuple):
    """One step from `t` over `h`, both s, with the states at its ends.

    `begin` is the evaluation at its start, `stages` are those of the iteration's last round,
    `accelerations` (stages, n) go with them; `error` (m) is the one estimated.
    """

    t: float
    h: float
    start: State
    finish: State
    begin: Evaluation
    stages: list[Evaluation]
    accelerations: FloatArray
    error: float

    @property
    def end(self) -> float:
        """Time at its end, s."""
        return self.t + self.h

    def at(self, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Coordinates and speeds (instants, n) at times within the step."""
        h, s = self.h, ((time - self.t) / self.h)[:, None]
        one, two = self.start, self.finish
        b, c = h * one.v, h * h * one.a / 2
        # q0 + s (b + s (c + s (d + s (e + s f)))), with place, speed and acceleration at s = 1
        place, rate = two.q - one.q - b - c, h * two.v - b - 2 * c
        bend = h * h * two.a / 2 - c
        d, e, f = (
            10 * place - 4 * rate + bend,
            -15 * place + 7 * rate - 2 * bend,
            6 * place - 3 * rate + bend,
        )
        q = one.q + s * (b + s * (c + s * (d + s * (e + s * f))))
        v = b + s * (2 * c + s * (3 * d + s * (4 * e + s * 5 * f)))
        return q, v / h


class NoConvergenceError(RuntimeError):
    """No step is short enough."""


class Radau:
    """Steps of one problem."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.iterations = 0
        self.trouble = ""  # what the last evaluation that failed said
        self._matrices: _Matrices | None = None
        self._last: tuple[float, FloatArray] | None = None  # length and speeds of the last step
        self._rate = 1.0  # at which the last iteration converged

    def restart(self) -> None:
        """Forget the last step: the equations have changed."""
        self._last = self._matrices = None

    def step(
        self, t: float, h: float, start: Evaluation, state: State, allowed: float
    ) -> Step | None:
        """Make a step of this length, whatever its error; None if the iteration fails.

        `start` is the evaluation at `state`; `allowed` (m) is the error in whose parts the
        iteration counts.
        """
        fresh = self._matrices is None or self._matrices.h != h or self._rate > SLOW
        matrices = self._matrices = self._factorised(h, start) if fresh else self._matrices
        assert matrices is not None
        w = self._solve(t, state, matrices, allowed)
        if w is None and not fresh:
            matrices = self._matrices = self._factorised(h, start)
            w = self._solve(t, state, matrices, allowed)
        if w is None:
            self._matrices = None
            return None
        speeds, pushes = state.v + w, (B @ w) / h
        moved = h * (A @ speeds)
        error = self.problem.size(_error(start, state, w, moved, matrices))
        self._last = (h, np.vstack([state.v, speeds]))
        self.trouble = ""
        end = State(state.q + moved[-1], speeds[-1], pushes[-1])
        return Step(t, h, state, end, start, self._stages, pushes, error)

    def _factorised(self, h: float, start: Evaluation) -> _Matrices:
        stiffness, damping = self.problem.jacobians(start)
        inverses = [
            np.linalg.inv(start.mass * (value / h) + damping + stiffness * (h / value))
            for value in (REAL, *EIGENVALUES[1:])
        ]
        self._rate = 1.0
        return _Matrices(h, inverses, stiffness)

    def _guess(self, h: float, v: FloatArray) -> FloatArray:
        """Increments of the stages' speeds, from the polynomial of the last step."""
        if self._last is None:
            return np.zeros((STAGES, len(v)))
        before, speeds = self._last
        ahead = np.vander(1 + C * (h / before), STAGES + 1, increasing=True)
        return np.asarray(ahead @ (NODES @ speeds) - v)

    def _solve(
        self, t: float, state: State, matrices: _Matrices, allowed: float
    ) -> FloatArray | None:
        """Increments W of the stages' speeds; None if the iteration does not converge."""
        h = matrices.h
        w, before, rate = self._guess(h, state.v), 0.0, self._rate
        enough = NEWTON * allowed
        for _ in range(MOST_ITERATIONS):
            self.iterations += 1
            residual = self._residual(t, h, state, w)
            if residual is None:
                return None
            turned = zip(matrices.inverses, TO @ residual, strict=True)
            change = np.real(FROM @ np.array([inverse @ row for inverse, row in turned]))
            w += change
            size = h * self.problem.size(change)
            if before > 0:
                rate = size / before
                if not rate < 1:
                    return None
            # What is left is at most this, at the present rate, or after one round at the last.
            if size == 0 or (rate < 1 and rate / (1 - rate) * size < enough):
                self._rate = max(rate, LEAST_RATE)
                return w
            before = size
        return None

    def _residual(self, t: float, h: float, state: State, w: FloatArray) -> FloatArray | None:
        """``f - M A`` at the stages, whose evaluations are kept; None where there are none."""
        speeds = state.v + w
        places, pushes = state.q + h * (A @ speeds), (B @ w) / h
        evaluate = self.problem.evaluate
        try:
            stages = [evaluate(t + C[i] * h, places[i], speeds[i]) for i in range(STAGES)]
        except (ValueError, ArithmeticError) as error:
            self.trouble = str(error)
            return None
        self._stages = stages
        return np.array([at.force - at.mass @ pushes[i] for i, at in enumerate(stages)])


class _Matrices(NamedTuple):
    """Inverses of the iteration's systems for steps of length h, and the stiffness behind them."""

    h: float
    inverses: list[Any]
    stiffness: FloatArray


def _error(
    start: Evaluation, state: State, w: FloatArray, moved: FloatArray, matrices: _Matrices
) -> FloatArray:
    """Estimated error of the coordinates."""
    h, real = matrices.h, matrices.inverses[0]
    of_place = state.v + ERROR @ moved / h
    push = start.force + start.mass @ (ERROR @ w) / h
    of_speed = real @ (push - (h / REAL) * (matrices.stiffness @ of_place))
    return np.asarray((h / REAL) * (of_place + of_speed))
