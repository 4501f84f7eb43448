"""The benchmark's own arithmetic, and that its hand-written peers simulate the same mechanism."""

import numpy as np
import pytest
from benchmarks import (
    measuring,
    mujoco_chain,
    numpy_lagrangian,
    peer_loops,
    peer_mujoco,
    strike,
)
from benchmarks.measuring import Measured
from benchmarks.naive_exudyn import simulate_by_hand
from benchmarks.peers import against

from exudyn_flexlink import load_scene
from exudyn_flexlink.chain import discretise
from exudyn_flexlink.mechanism import beam_of


def power_law(*settings):
    """Error h^2, cost 3/h: cost is 3 error^-1/2."""
    return [Measured(h, h**2, 3 / h) for h in settings]


def test_cost_at_an_error_lies_on_the_power_law_within_and_beyond_the_points():
    points = power_law(1e-1, 1e-3, 1e-2)
    for error, beyond in ((1e-3, False), (1e-4, False), (1e-5, False), (1e-1, True), (1e-8, True)):
        cost, told = measuring.cost_at(points, error)
        assert cost == pytest.approx(3 * error**-0.5)
        assert told is beyond


def test_a_climb_ends_at_the_first_rung_that_is_good_enough():
    points = measuring.climb(lambda h: (h**2, 7), measuring.ladder(1e-1), 1e-5, budget=60)
    assert [point.setting for point in points] == [1e-1, 5e-2, 2e-2, 1e-2, 5e-3, 2e-3]
    assert measuring.loosest(points, 1e-10) is None


def test_the_fewest_steps_are_cheapest_whatever_one_time_says():
    points = [Measured(1, 1e-5, 3.0, 100), Measured(2, 1e-6, 2.0, 200)]
    assert measuring.loosest(points, 1e-4) == points[0]
    points = [Measured(1, 1e-3, 1.0), Measured(2, 1e-5, 3.0), Measured(3, 1e-6, 2.0)]
    assert measuring.loosest(points, 1e-4) == points[2]


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


def test_the_numpy_lagrangian_simulates_the_same_mechanism():
    time, position, _ = (column[:21] for column in strike.series())
    motion = numpy_lagrangian.strike(time, 1e-6)
    assert np.abs(motion.position - position).max() < 1e-9


def test_the_numpy_lagrangian_finds_its_way_round_the_double_track():
    """Ellipse in odd laps, half circle on the left of even ones; r' and r'' by differences."""
    assert [numpy_lagrangian.on_circle(x) for x in (3.0, 6.3, 9.4, 12.5)] == [0, 0, 1, 0]
    for circle, expected in ((False, 0.06), (True, 0.05)):
        assert numpy_lagrangian.root(np.pi, circle)[0] == pytest.approx(expected)
        h, r = 1e-4, [numpy_lagrangian.root(x, circle)[0] for x in (2.4999, 2.5, 2.5001)]
        _, first, second = numpy_lagrangian.root(2.5, circle)
        assert first == pytest.approx((r[2] - r[0]) / (2 * h), rel=1e-6)
        assert second == pytest.approx((r[2] - 2 * r[1] + r[0]) / h**2, rel=1e-5)


def test_the_ringing_chain_is_the_same_for_all():
    """The numpy Lagrangian against our engine; masses, springs and weight of the model file."""
    variant = next(v for v in peer_mujoco.VARIANTS if v.engine == "exudyn")
    error, _ = peer_mujoco.ours(variant, 3e-3, 1e-6)
    assert error < 1e-6
    scene = load_scene(peer_mujoco.MODEL)
    assert scene.gravity == (0, peer_mujoco.WEIGHT)


def test_mujoco_has_the_same_chain():
    """Its natural frequencies, and its motion under the weight by steps of 10 us."""
    pytest.importorskip("mujoco")
    link = numpy_lagrangian.Link()
    stiffness = link.stiffness * np.eye(link.rods - 1)
    squares = np.linalg.eigvals(np.linalg.solve(mujoco_chain.mass_matrix(link), stiffness))
    scene = load_scene(peer_mujoco.MODEL)
    chain = discretise(beam_of(scene, scene.bodies["link"]), 10, stiffness="beam")
    expected = chain.cantilever_frequencies(9)
    assert np.sort(np.sqrt(squares)) == pytest.approx(expected, rel=1e-9)
    error, _ = peer_mujoco.by_mujoco(mujoco_chain.integrators()["RK4"], 3e-3, 100)
    assert error < 1e-7
    assert peer_mujoco.by_mujoco(mujoco_chain.integrators()["RK4"], 3e-3, 5)[0] == np.inf


@pytest.mark.parametrize("body", ["crank", "slider"])
def test_mujoco_has_the_same_slider_crank(body):
    """Wherever the loop is cut; errors of RK4 and of the spring fall with the step."""
    pytest.importorskip("mujoco")
    rk4, closing = mujoco_chain.integrators()["RK4"], peer_loops.Closing(body, 0.3)
    coarse, fine = (peer_loops.by_mujoco(rk4, closing, 0.5, h)[0] for h in (1e-3, 1e-4))
    assert fine < 1e-7 < 100 * fine < coarse


def test_errors_that_the_peer_does_not_reach_are_told():
    found = {
        ("peer x", 1e-4): Measured(1, 1e-5, 2.0),
        ("us", 1e-4): Measured(1, 1e-5, 4.0),
        ("us", 1e-6): Measured(1, 1e-7, 8.0),
    }
    table = against("Peer", "", found, [1e-4, 1e-6], 3.0)
    assert [row[-1] for row in table.rows] == ["1.00", "0.50", ""]
    assert table.conclusion == (
        "Over 3.0 s, Peer's best time over our best: 0.5 at 1e-04 m (us). "
        "Peer does not reach 1e-06 m."
    )
