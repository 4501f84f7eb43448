"""Radau IIA against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from exudyn_flexlink.engines.exudyn.tree.radau import WEIGHTS, A, C, Evaluation, Radau, State


class Oscillator:
    """``m q'' = -k q - d q'`` for several independent masses."""

    def __init__(self, mass, stiffness, damping):
        self.mass, self.stiffness, self.damping = map(np.diag, (mass, stiffness, damping))

    def evaluate(self, t, q, v):
        return Evaluation(self.mass, -self.stiffness @ q - self.damping @ v)

    def jacobians(self, at):
        return self.stiffness, self.damping

    def size(self, change):
        return float(np.abs(change).max())


def advance(problem, q, v, h, count):
    """State after `count` steps, and the steps."""
    radau = Radau(problem)
    at = problem.evaluate(0.0, q, v)
    state = State(q, v, np.linalg.solve(at.mass, at.force))
    steps = []
    for i in range(count):
        at = problem.evaluate(i * h, state.q, state.v)
        step = radau.step(i * h, h, at, state, 1e-12)
        assert step is not None
        steps.append(step)
        state = step.finish
    return state, steps


def exact(t, frequency, damping):
    """From q = 1 at rest."""
    decay, swing = damping / 2, np.sqrt(frequency**2 - damping**2 / 4)
    return np.exp(-decay * t) * (np.cos(swing * t) + decay / swing * np.sin(swing * t))


def test_the_method_is_radau_iia():
    """Collocation: exact for polynomials up to degree 2 at the stages, 4 at the end."""
    for degree in range(3):
        np.testing.assert_allclose(A @ C**degree, C ** (degree + 1) / (degree + 1), atol=1e-14)
    for degree in range(5):
        assert WEIGHTS @ C**degree == pytest.approx(1 / (degree + 1), abs=1e-14)


def test_order_five_on_a_damped_oscillation():
    errors = []
    for count in (20, 40, 80):
        problem = Oscillator([2.0], [2.0 * 9.0], [2.0 * 0.2])
        state, _ = advance(problem, np.array([1.0]), np.zeros(1), 2.0 / count, count)
        errors.append(abs(state.q[0] - exact(2.0, 3.0, 0.2)))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 5.0, atol=0.3)


def test_stiff_damping_dies_out_in_one_step():
    """L-stable: what decays within a thousandth of a step is gone at its end."""
    problem = Oscillator([1.0, 1.0], [1.0, 1e4], [0.0, 1e6])
    state, _ = advance(problem, np.array([1.0, 0.0]), np.array([0.0, 1.0]), 0.1, 1)
    assert abs(state.v[1]) < 1e-4
    assert state.q[0] == pytest.approx(np.cos(0.1), abs=1e-8)


def test_the_estimated_error_is_no_less_than_that_made():
    problem = Oscillator([1.0], [100.0], [0.0])
    for h in (0.05, 0.02, 0.01):
        state, steps = advance(problem, np.array([1.0]), np.zeros(1), h, 1)
        assert steps[0].error > abs(state.q[0] - np.cos(10 * h))


def test_between_steps_it_is_the_quintic_through_both_ends():
    """Which is exact for a motion of degree five."""
    place = Polynomial([0.3, -1.0, 0.5, 2.0, -1.5, 0.7])
    rate, bend = place.deriv(), place.deriv(2)
    ends = [State(*(np.array([f(t)]) for f in (place, rate, bend))) for t in (0.2, 0.7)]
    _, (step,) = advance(Oscillator([1.0], [1.0], [0.0]), np.ones(1), np.zeros(1), 0.1, 1)
    step = step._replace(t=0.2, h=0.5, start=ends[0], finish=ends[1])
    times = np.linspace(0.2, 0.7, 7)
    q, v = step.at(times)
    np.testing.assert_allclose(q[:, 0], place(times), atol=1e-13)
    np.testing.assert_allclose(v[:, 0], rate(times), atol=1e-12)
