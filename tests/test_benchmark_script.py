"""The benchmark's own arithmetic, and that the script by hand simulates the same mechanism."""

import numpy as np
import pytest
from benchmarks import measuring, strike
from benchmarks.measuring import Measured
from benchmarks.naive_exudyn import simulate_by_hand


def power_law(*settings):
    """Error h^2, cost 3/h: cost is 3 error^-1/2."""
    return [Measured(h, h**2, 3 / h) for h in settings]


def test_cost_at_an_error_lies_on_the_power_law_within_and_beyond_the_points():
    points = power_law(1e-1, 1e-3, 1e-2)
    for error, beyond in ((1e-3, False), (1e-4, False), (1e-5, False), (1e-1, True), (1e-8, True)):
        cost, told = measuring.cost_at(points, error)
        assert cost == pytest.approx(3 * error**-0.5)
        assert told is beyond


def test_the_script_by_hand_simulates_the_same_mechanism():
    """Before the strike it differs from the independent integration by its steps' errors."""
    motion = simulate_by_hand(1e-3, end=0.05)
    _, position, _ = strike.series()
    off = np.linalg.norm(motion.position - position[: len(motion.time)], axis=1)
    assert off.max() < 1e-5
    assert not motion.lever_angle.any()
    finer = simulate_by_hand(2.5e-4, end=0.05)
    better = np.linalg.norm(finer.position - position[: len(finer.time)], axis=1)
    assert better.max() < off.max() / 8  # second order: 16 times
