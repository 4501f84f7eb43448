"""The largest Lyapunov exponent: of flows in closed form, of Lorenz, of mechanisms."""

from math import cos, log, pi, sin, sqrt

import numpy as np
import pytest
from physics_tools import scene
from published_exponents import GAMMA, LORENZ, OMEGA, E, G, ball_scene
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from exudyn_flexlink import engines
from exudyn_flexlink.stability import Asked, Neighbours, largest_exponent, study, trajectory
from exudyn_flexlink.stability.exponent import half_width


def exact(rates):
    """Flow of ``x' = rate x``, coordinate by coordinate, turned so that directions mix."""
    turn = np.linalg.qr(np.random.default_rng(1).standard_normal((len(rates), len(rates))))[0]
    return lambda x, a, b: turn @ (np.exp(np.array(rates) * (b - a)) * (turn.T @ x))


def exponent(flow, start, times, distance=1e-6, batch=None, **more):
    motion = trajectory(flow, np.array(start, float), times)
    whole = float(times[-1] - times[0])
    return largest_exponent(flow, motion, Neighbours(distance, batch or whole / 12, **more))


@pytest.mark.parametrize("rates", [(0.7, -0.2, -3.0), (-0.4, -3.0), (0.0, -2.5)])
def test_a_linear_flow_has_its_largest_rate(rates):
    """Other directions are gone by a factor exp(-2 * 10) or more when growth begins to count."""
    found = exponent(exact(rates), np.zeros(len(rates)), np.arange(0.0, 40.5, 0.5))
    assert found.value == pytest.approx(rates[0], abs=1e-6)
    assert found.uncertainty < 1e-6
    assert found.noise == 0


def test_lorenz_within_its_uncertainty():
    """`scripts/published_exponents.py` makes it within 5 %, of a longer motion."""

    def rate(_, x):
        return [10 * (x[1] - x[0]), x[0] * (28 - x[2]) - x[1], x[0] * x[1] - 8 / 3 * x[2]]

    def flow(x, a, b):
        return solve_ivp(rate, (a, b), x, method="DOP853", rtol=1e-8, atol=1e-8).y[:, -1]

    begin = flow(np.array([1.0, 1.0, 20.0]), 0.0, 20.0)
    found = exponent(flow, begin, np.arange(0.0, 80.5, 0.5))
    assert abs(found.value - LORENZ) < found.uncertainty
    assert found.sign == 1


def correlated(r, cases, count):
    """Means of variance 1 about 0, each r of the one before and else its own chance."""
    chance = np.random.default_rng(3).standard_normal((cases, count))
    means = chance.copy()
    for k in range(1, count):
        means[:, k] = r * means[:, k - 1] + sqrt(1 - r * r) * chance[:, k]
    return means


@pytest.mark.parametrize(
    ("r", "count", "least"), [(0.0, 8, 0.95), (0.3, 16, 0.92), (0.6, 32, 0.92)]
)
def test_the_interval_holds_the_mean_of_batches_that_correlate(r, count, least):
    """As if they were independent it would hold it in 95, 85 and 67 % of the cases."""
    held = [abs(one.mean()) < half_width(one) for one in correlated(r, 2000, count)]
    assert least < np.mean(held) < 0.98


def test_the_error_of_a_solver_shows_as_noise():
    """A solver off by 1e-9 in each stretch moves the rate by that over the neighbours' distance."""
    times, off = np.arange(0.0, 40.5, 0.5), np.random.default_rng(0)
    flow = exact((0.0, -1.0))

    def solved(x, a, b):
        return flow(x, a, b) + 1e-9 * np.array([off.uniform(), 0.0])

    found = exponent(solved, [0, 0], times, distance=1e-6)
    assert 0.1e-3 < found.noise < 2e-3
    assert abs(found.value) < found.noise
    coarse = exponent(solved, [0, 0], times, distance=1e-8)
    assert coarse.by_solver or coarse.noise > 20 * found.noise


# --- mechanisms -----------------------------------------------------------------------------


def studied(text, lap, laps, after=1.0):
    asked = Asked(laps, after, lap, tolerance=1e-9)
    return study(scene(text), lambda each: engines.simulate(each, measure=False), asked)


SADDLE = """
bodies: {mass: {type: rigid, mass: 1, inertia: 1, points: {p: [0, 0]}}}
joints: {rail: {type: prismatic, points: [ground, mass.p], at: [0, 0], axis: [1, 0]}}
drives: {push: {type: force, point: mass.p, value: [100*place(rail) - 1e8*place(rail)**3, 0]}}
run: {duration: 1}
accuracy: {tolerance: 1.0e-9}
"""


def test_neighbours_that_part_fast_are_put_back_before_they_are_far():
    """x'' = 100 x - 1e8 x^3 parts neighbours of x = 0 at 10/s until they are about 1 mm away.

    That is a thousand times their distance: they would be there in a quarter of a lap.
    """
    found = studied(SADDLE, 4.0, 8).exponent
    assert found.value == pytest.approx(10, rel=1e-3)
    assert found.uncertainty + found.noise < 0.1
    assert found.sign == 1


def table(t):
    return GAMMA * G / OMEGA**2 * sin(OMEGA * t)


def speed_of_table(t):
    return GAMMA * G / OMEGA * cos(OMEGA * t)


def bounce(t, up):
    """Next bounce after one at t (s) that sent the ball up: its instant, and the speed after it."""

    def gap(s):
        return table(t) + up * s - G * s * s / 2 - table(t + s)

    flight = brentq(gap, 0.5 * 2 * up / G, 1.5 * 2 * up / G, xtol=1e-15)
    at = t + flight
    return at, (1 + E) * speed_of_table(at) - E * (up - G * flight)


def test_a_bouncing_ball_settles_at_its_rate():
    """Bounces once a period of the table: areas shrink by e^2 at each, neighbours by e.

    The ball's map from bounce to bounce has a Jacobian of determinant e^2 (P. J. Holmes, Journal of
    Sound and Vibration 84 (1982) 173); where its eigenvalues are complex, each has the size e.
    """
    period = 2 * pi / OMEGA
    first = np.arccos((1 - E) / (1 + E) * pi / GAMMA) / OMEGA
    up = G * period / 2
    assert bounce(first, up) == pytest.approx((first + period, up), rel=1e-9)
    step = 1e-6
    ahead = [np.array(bounce(first + step, up)), np.array(bounce(first, up + step))]
    behind = [np.array(bounce(first - step, up)), np.array(bounce(first, up - step))]
    jacobian = np.array([(a - b) / (2 * step) for a, b in zip(ahead, behind, strict=True)]).T
    sizes = np.abs(np.linalg.eigvals(jacobian))
    assert sizes == pytest.approx([E, E], rel=1e-5)
    start = 0.4 * period  # between two bounces
    flown = start - first
    height = table(first) + up * flown - G * flown**2 / 2
    found = studied(ball_scene(start, height, up - G * flown), period, 8)
    assert len(found.run.intervals["bounce"]) == 8
    rate = log(E) / period
    assert abs(found.exponent.value - rate) < found.exponent.uncertainty
    assert found.exponent.value == pytest.approx(rate, rel=0.05)
    assert found.repeating.laps == 1


def test_an_error_grows_to_a_limit_in_the_time_that_the_exponent_tells():
    """From 1e-9 to 1e-3 it takes ln(1e6) times: e-folds of 1/rate."""
    rate = 0.7
    found = exponent(exact((rate, -0.2)), np.zeros(2), np.arange(0.0, 40.5, 0.5))
    assert found.horizon(1e-9, 1e-3) == pytest.approx(6 * log(10) / rate, rel=1e-3)
    assert found.horizon(1e-3, 1e-3) == 0
    settling = exponent(exact((-0.4, -3.0)), np.zeros(2), np.arange(0.0, 40.5, 0.5))
    assert settling.horizon(1e-9, 1e-3) == np.inf
