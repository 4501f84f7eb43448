"""The benchmark's own arithmetic, and that the script by hand simulates the same mechanism."""

from dataclasses import replace
from itertools import islice
from types import SimpleNamespace

import numpy as np
import pytest
from benchmarks import measuring, stepping, strike
from benchmarks.measuring import Measured
from benchmarks.naive_exudyn import simulate_by_hand

from exudyn_flexlink import load_scene


def power_law(*settings):
    """Error h^2, cost 3/h: cost is 3 error^-1/2."""
    return [Measured(h, h**2, 3 / h) for h in settings]


def test_cost_at_an_error_lies_on_the_power_law_within_and_beyond_the_points():
    points = power_law(1e-1, 1e-3, 1e-2)
    for error, beyond in ((1e-3, False), (1e-4, False), (1e-5, False), (1e-1, True), (1e-8, True)):
        cost, told = measuring.cost_at(points, error)
        assert cost == pytest.approx(3 * error**-0.5)
        assert told is beyond


def test_cost_at_an_error_needs_two_points():
    with pytest.raises(ValueError, match="two points"):
        measuring.cost_at(power_law(1e-2), 1e-4)


def test_a_ladder_has_three_rungs_a_decade():
    assert list(islice(measuring.ladder(1e-3), 5)) == [1e-3, 5e-4, 2e-4, 1e-4, 5e-5]
    assert list(measuring.ladder(5e-2, 1e-2)) == [5e-2, 2e-2, 1e-2]


def test_a_climb_ends_at_the_first_rung_that_is_good_enough():
    points = measuring.climb(lambda h: (h**2, 7), measuring.ladder(1e-1), 1e-5, budget=60)
    assert [point.setting for point in points] == [1e-1, 5e-2, 2e-2, 1e-2, 5e-3, 2e-3]
    assert measuring.loosest(points, 1e-10) is None


def test_the_cheapest_run_counts_that_is_good_enough():
    points = [Measured(1, 1e-3, 1.0), Measured(2, 1e-5, 3.0), Measured(3, 1e-6, 2.0)]
    assert measuring.loosest(points, 1e-4) == points[2]


def test_the_fewest_steps_are_cheapest_whatever_one_time_says():
    points = [Measured(1, 1e-5, 3.0, 100), Measured(2, 1e-6, 2.0, 200)]
    assert measuring.loosest(points, 1e-4) == points[0]


def test_interleaved_runs_take_turns_and_long_ones_are_not_repeated():
    order = []
    runs = {name: lambda name=name: order.append(name) for name in "abc"}
    best = measuring.interleaved(runs, 2, {"c": 2 * measuring.LONG})
    assert order == ["a", "b", "a", "b"]
    assert best["c"] == 2 * measuring.LONG
    assert 0 <= best["a"] < 1


def test_each_error_has_the_cheapest_run_of_each_ladder_that_reaches_it():
    runs = {"square": lambda h: (h**2, round(1 / h)), "line": lambda h: (h, 7)}
    rungs = {name: [1e-1, 1e-2, 1e-3] for name in runs}
    found = measuring.cheapest(runs, rungs, [1e-2, 1e-4], budget=60)
    assert found["line", 1e-2].error <= 1e-2
    assert ("line", 1e-4) not in found
    assert found["square", 1e-4].setting == 1e-2  # where the climb ends
    assert found["square", 1e-4].steps == 100


def test_a_setting_that_counts_twice_is_repeated_once_a_turn():
    order = []
    point = Measured(0.5, 1e-3, 60.0)
    points = {("a", 1e-2): replace(point, cost=1.0), ("a", 1e-1): replace(point, cost=1.0)}
    again = measuring.repeated({"a": order.append}, points, 2)
    assert order == [0.5, 0.5]
    assert all(0 <= own.cost < 1 for own in again.values())
    assert [own.error for own in again.values()] == [1e-3, 1e-3]
    long = measuring.repeated({"a": order.append}, {("a", 1e-2): point}, 2)
    assert len(order) == 2
    assert long["a", 1e-2].cost == 60.0


def test_exponent_of_a_power_law():
    assert measuring.exponent([10, 20, 50], [2 * n**1.3 for n in (10, 20, 50)]) == pytest.approx(
        1.3
    )


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


def test_the_quickest_run_decides_on_the_rounds_of_all(monkeypatch):
    made, scene = [], load_scene("smooth")
    costs = {"quick": (0.25, 0.05), "slow": (4.0, 0.5)}  # s, of long and short runs

    def fake(run, engine, **_):
        made.append((engine, run.run.duration))
        checks = SimpleNamespace(steps=round(100 * run.run.duration))
        return SimpleNamespace(outcome=SimpleNamespace(completed=True), checks=checks)

    def timed(run):
        result = run()
        engine, duration = made[-1]
        return result, costs[engine][0 if duration == 1.0 else 1]

    monkeypatch.setattr(stepping, "simulate", fake)
    monkeypatch.setattr(stepping, "timed", timed)
    cases = {name: (name, scene) for name in costs}
    found = stepping.cost_per_step(cases, dict.fromkeys(cases, 1.0), repeat=3)
    rounds = int(stepping.ENOUGH / 0.25) + 1
    assert made == [("quick", 1.0), ("quick", 0.1), ("slow", 1.0), ("slow", 0.1)] * rounds
    assert found["quick"].cost == pytest.approx(0.2 / 90)
    assert found["slow"].cost == pytest.approx(3.5 / 90)
