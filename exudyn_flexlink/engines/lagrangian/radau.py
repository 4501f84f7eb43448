r"""One implicit step of a Radau IIA method, for equations of second order.

Of ``q' = v, v' = a(t, q, v)`` the unknowns are the changes W_i of the speeds at the stages alone:
``Q_i = q_0 + h c_i v_0 + h sum_j A_ij W_j``. Newton's method for ``A^-1 W / h = a`` falls, with the
eigenvectors of A^-1 and one Jacobian for all stages, into systems of the size of q,

    (mu I - da/dv - da/dq / mu) dU = -(T^-1 residual),    mu = lambda / h,

one real and (s - 1)/2 complex (Hairer & Wanner II, IV.8). The rest of the state, energies and
impulses, is integrated by the same collocation once the stages are known. The estimate of the error
is theirs too: that of an embedded formula, filtered by the real matrix, so that what is stiff does
not count.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.lagrangian.compiled import inlined, inner
from exudyn_flexlink.engines.lagrangian.dense import decompose, solve
from exudyn_flexlink.engines.lagrangian.lengths import Scale, length_of
from exudyn_flexlink.engines.lagrangian.mode import Instant, Mode
from exudyn_flexlink.engines.lagrangian.step_arrays import Method, Work
from exudyn_flexlink.engines.lagrangian.track_point import FINE

ITERATIONS = 8
SMALL = 0.03  # of the local tolerance: what the iteration may leave
NEGLIGIBLE = 1e-3  # of that: a first correction so small is the last, whatever the rate
SLOWEST = 0.99  # part of an error that an iteration leaves: more, and it does not converge

SOLVED, DIVERGED = FINE, 10  # else: how the search for P ended


class Aim(NamedTuple):
    """How far to iterate."""

    tolerance: float  # m: of one step
    lasting: float  # s: turns errors of speeds into lengths
    slowness: float  # 1/s: part of an error that an iteration left in a step before, by its length


def factor(h: float, by_q: FloatArray, by_v: FloatArray, method: Method, work: Work) -> None:
    """Factors of the real and of the complex matrices of a step h."""
    factor_real(h, by_q, by_v, method, work)
    free = len(by_q)
    pairs, factors = method.pairs, work.pairs
    for p in range(len(pairs)):
        turning = pairs[p] / h
        inverse = 1.0 / turning
        for i in range(free):
            for j in range(free):
                factors[p, i, j] = -by_v[i, j] - by_q[i, j] * inverse
            factors[p, i, i] += turning
        decompose(factors[p], work.rows[1 + p])


@inner
def factor_real(h: float, by_q: FloatArray, by_v: FloatArray, method: Method, work: Work) -> None:
    """Factors of the real matrix alone, which filters the estimated error."""
    free, factors = len(by_q), work.real
    mu = method.real / h
    for i in range(free):
        for j in range(free):
            factors[i, j] = -by_v[i, j] - by_q[i, j] / mu
        factors[i, i] += mu
    decompose(factors, work.rows[0])


@inlined
def guess(ahead: float, last: FloatArray, method: Method, work: Work) -> None:
    """Speeds at the stages from the polynomial of the last step's changes, `ahead` = h / its h."""
    speeds, nodes, powers = work.speeds, method.nodes, method.powers
    stages, free = speeds.shape
    for i in range(stages):
        sigma = 1.0 + ahead * nodes[i]
        for j in range(free):
            speeds[i, j] = 0.0
        power = 1.0
        for k in range(stages):
            power *= sigma
            for m in range(stages):
                weight = (power - 1.0) * powers[k, m]
                for j in range(free):
                    speeds[i, j] += weight * last[m, free + j]


@inlined
def _stages(
    at: Instant,
    h: float,
    mode: Mode,
    rate_at: Callable[..., Any],
    means: tuple[Method, Work],
) -> int:
    """States and rates at the stages from their speeds; return how the search for P ended."""
    method, work = means
    speeds, states, places = work.speeds, work.states, work.near
    nodes, matrix = method.nodes, method.matrix
    stages, free = speeds.shape
    y, near = at.y, at.near
    for i in range(stages):
        state = states[i]
        for j in range(free):
            moved = nodes[i] * y[free + j]
            for m in range(stages):
                moved += matrix[i, m] * speeds[m, j]
            state[j] = y[j] + h * moved
            state[free + j] = y[free + j] + speeds[i, j]
        stage = Instant(at.t + nodes[i] * h, state, near)
        near, ended = rate_at(stage, mode, work.rates[i], work.way[1 + i])
        if ended != FINE:
            return int(ended)
        places[i] = near
    return FINE


@inlined
def _residual(h: float, method: Method, work: Work) -> FloatArray:
    """What the speeds W lack of ``a - A^-1 W / h`` being zero, (s, f)."""
    speeds, rates, inverse = work.speeds, work.rates, method.inverse
    stages, free = speeds.shape
    residual = np.empty((stages, free))
    for i in range(stages):
        for j in range(free):
            value = rates[i, free + j]
            for m in range(stages):
                value -= inverse[i, m] * speeds[m, j] / h
            residual[i, j] = value
    return residual


@inlined
def _add_pair(p: int, residual: FloatArray, change: FloatArray, method: Method, work: Work) -> None:
    """Add what the pair p of complex eigenvalues gives to the `change` of `_solve_transformed`."""
    rows, columns = method.rows, method.columns
    stages, free = residual.shape
    part = np.zeros(free, dtype=np.complex128)
    for i in range(stages):
        for j in range(free):
            part[j] += rows[p, i] * residual[i, j]
    solve(work.pairs[p], work.rows[1 + p], part)
    for i in range(stages):
        for j in range(free):
            change[i, j] += 2.0 * (columns[i, p] * part[j]).real


@inlined
def _solve_transformed(
    residual: FloatArray, change: FloatArray, method: Method, work: Work
) -> None:
    """Fill in the `change` (s, f) of the speeds that removes a residual (s, f)."""
    row, column = method.row, method.column
    stages, free = residual.shape
    part = np.zeros(free)
    for i in range(stages):
        for j in range(free):
            part[j] += row[i] * residual[i, j]
    solve(work.real, work.rows[0], part)
    for i in range(stages):
        for j in range(free):
            change[i, j] = column[i] * part[j]
    for p in range(len(method.pairs)):
        _add_pair(p, residual, change, method, work)


@inlined
def _correct(h: float, change: FloatArray, method: Method, work: Work) -> None:
    """One step of Newton's method: `change` (s, f) of the speeds, which are changed by it."""
    speeds = work.speeds
    stages, free = speeds.shape
    _solve_transformed(_residual(h, method, work), change, method, work)
    for i in range(stages):
        for j in range(free):
            speeds[i, j] += change[i, j]


@inlined
def _size_of(h: float, tau: float, change: FloatArray, scale: Scale, method: Method) -> float:
    """Length that a change (s, f) of the stages' speeds means."""
    matrix = method.matrix
    stages, free = change.shape
    largest = 0.0
    moved = np.empty(free)
    for i in range(stages):
        for j in range(free):
            way = 0.0
            for m in range(stages):
                way += matrix[i, m] * change[m, j]
            moved[j] = h * way
        size = max(length_of(moved, scale), tau * length_of(change[i], scale))
        if not size <= largest:
            largest = size
    return largest


def iterate(  # noqa: C901, PLR0911 - every way in which an iteration ends
    at: Instant,
    h: float,
    aim: Aim,
    mode: Mode,
    means: tuple[Method, Scale, Work, Callable[..., Any]],
) -> tuple[int, int, float]:
    """Newton's method for the stages, to a part of the local tolerance.

    Return how it ended, the number of iterations, and `Aim.slowness` for the next step. The first
    correction mends at once what the guess missed of smooth motion, and so hides what goes slowly,
    as where the face of a stiff contact turns within the step. From the second on that shows; where
    those are spared, the last step that had them tells how slowly errors fall.
    """
    tolerance, lasting, slowness = aim
    method, scale, work, rate_at = means
    change = np.empty(work.speeds.shape)
    before, slowest, solved = 0.0, 0.0, False
    for k in range(ITERATIONS + 1):
        ended = _stages(at, h, mode, rate_at, (method, work))
        if ended != FINE or solved:
            return ended, k, slowness
        if k == ITERATIONS:
            break
        _correct(h, change, method, work)
        size = _size_of(h, lasting, change, scale, method)
        if not np.isfinite(size):
            return DIVERGED, k, slowness
        if size == 0.0:
            return SOLVED, k + 1, slowness
        if k > 0:
            rate = size / before
            ahead = size * rate ** (ITERATIONS - 1 - k)
            if rate >= SLOWEST or ahead > SMALL * tolerance * (1.0 - rate):
                return DIVERGED, k, slowness
            slowest = max(slowest, rate)
            if k > 1:
                slowness = slowest / h
            left = min(max(slowest, slowness * h), SLOWEST)
            if size * left <= SMALL * tolerance * (1.0 - left):
                if size <= SMALL * tolerance:
                    return SOLVED, k + 1, slowness
                solved = True  # energies are made of the rates: these are evaluated once more
        elif size <= NEGLIGIBLE * SMALL * tolerance:
            return SOLVED, 1, slowness
        before = size
    return DIVERGED, ITERATIONS, slowness


@inner
def finish(y: FloatArray, h: float, method: Method, work: Work, changes: FloatArray) -> None:
    """Changes (s, size) of the whole state at the stages, from the speeds and the last rates."""
    nodes, matrix, speeds, rates = method.nodes, method.matrix, work.speeds, work.rates
    stages, free = speeds.shape
    for i in range(stages):
        for j in range(free):
            moved = nodes[i] * y[free + j]
            for m in range(stages):
                moved += matrix[i, m] * speeds[m, j]
            changes[i, j] = h * moved
            changes[i, free + j] = speeds[i, j]
        for j in range(2 * free, len(y)):
            value = 0.0
            for m in range(stages):
                value += matrix[i, m] * rates[m, j]
            changes[i, j] = h * value


@inlined
def estimate(
    h: float,
    by_q: FloatArray,
    begin: FloatArray,
    tau: float,
    means: tuple[Method, Scale, Work],
) -> float:
    """Estimate the error of the step, m; `begin` are the accelerations (f,) at its start."""
    method, scale, work = means
    speeds, differences, inverse = work.speeds, method.differences, method.inverse
    stages, free = speeds.shape
    mu = method.real / h
    moved, sped = np.zeros(free), np.zeros(free)
    for j in range(free):
        sped[j] = begin[j] / mu
    for i in range(stages):
        weight = 0.0
        for m in range(stages):
            weight += differences[m] * inverse[m, i]
        for j in range(free):
            moved[j] += h * differences[i] * speeds[i, j]
            sped[j] += weight * speeds[i, j]
    right = np.empty(free)
    for j in range(free):
        right[j] = mu * sped[j]
        for m in range(free):
            right[j] += by_q[j, m] * moved[m]
    solve(work.real, work.rows[0], right)
    for j in range(free):
        moved[j] += right[j] / mu
    return max(length_of(moved, scale), tau * length_of(right, scale))
