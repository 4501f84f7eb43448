"""What a run tells between its samples: motions, forces on both sides of jumps, tables."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest
import results

from exudyn_flexlink.api.results import api_result
from exudyn_flexlink.observables import BodyMotion, PointPath
from exudyn_flexlink.result import ForceDeviation, ForceSpread, MeasuredError
from exudyn_flexlink.storage import all_columns, lever_columns, save

JUMP = 1.0  # s


def body(time):
    """A body whose angle is sin(7 t), with exact rates."""
    angle, rate, zeros = np.sin(7 * time), 7 * np.cos(7 * time), np.zeros((len(time), 2))
    return BodyMotion("body", time, zeros, zeros, angle, rate)


def with_a_jump(run):
    """The run with samples on both sides of 1 s, where the force of the crank leaps by 5 N."""
    before = int(np.searchsorted(run.time, JUMP))
    time = run.time.copy()
    time[before : before + 2] = np.nextafter(JUMP, 0), JUMP
    force = np.stack([time + 5 * (time >= JUMP), -time], axis=-1)
    return replace(run, time=time, joint_forces={**run.joint_forces, "crank": force})


@pytest.fixture(scope="module")
def run():
    spreads = [ForceSpread(largest, 0.1, 0.1, 1.0) for largest in (0.25, 0.5)]
    forces = {"joint force of crank": ForceDeviation("N", *spreads)}
    error = MeasuredError(points=("link.end",), largest=1e-7, horizon=2.0, forces=forces)
    return api_result(with_a_jump(replace(results.rigid_link(), error=error)))


def test_angles_between_samples_are_of_fourth_order():
    off, at = [], np.linspace(0, 1, 777)
    for count in (101, 201):
        seen = body(np.linspace(0, 1, count)).at(at)
        off.append(np.abs(seen.angle - np.sin(7 * at)).max())
        np.testing.assert_array_equal(seen.time, at)
    assert off[1] < 1e-6
    assert off[0] / off[1] == pytest.approx(16, rel=0.1)


def test_one_instant_has_no_axis_of_time():
    seen = body(np.linspace(0, 1, 51)).at(0.5)
    assert (seen.angle.shape, seen.position.shape) == ((), (2,))
    assert "at 0.5 s" in repr(seen)


def test_a_force_at_its_jump_is_the_later_one_and_goes_straight_beside_it(run):
    force = run.joint("crank").at([JUMP - 1e-3, JUMP - 1e-16, JUMP, JUMP + 1e-3]).force[:, 0]
    np.testing.assert_allclose(force, [JUMP - 1e-3, JUMP + 5, JUMP + 5, JUMP + 5 + 1e-3])
    assert run.force("joint force of crank").at(0.9999 * JUMP).values[0] < 1.0


def test_an_error_between_samples_is_the_larger_of_both(run):
    touch = run.touches("strike").begin[0]
    seen = run.force("joint force of crank").at([0.1, touch - 1e-6, touch + 1e-3, 2.4])
    np.testing.assert_array_equal(seen.error, [0.25, 0.5, 0.5, inf])


@pytest.mark.parametrize(
    "ask",
    [
        lambda run: run.at,
        lambda run: run.body("link 2").at,
        lambda run: run.path("link.end").at,
        lambda run: run.joint("pin").at,
        lambda run: run.force("drive torque of motor").at,
        lambda run: run.lever("lever").at,
        lambda run: run.link("link").at,
    ],
)
def test_nothing_is_told_outside_the_run(run, ask):
    for beyond in (-0.1, 2.6, [0.1, np.nan]):
        with pytest.raises(ValueError, match=r"the run goes from 0 to 2\.51327412 s"):
            ask(run)(beyond)


def test_what_counts_from_the_start_of_the_run_does_so_at_any_instants(run):
    """The lever's angle and the balance of energy, though the first row is at 1.6 s."""
    k, at = 1100, run.time[1100:1103]
    some = run.at(at)
    np.testing.assert_array_equal(some.lever("lever").value, run.lever("lever").value[k : k + 3])
    np.testing.assert_array_equal(some.energy.residual, run.energy.residual[k : k + 3])
    table = some.to_dataframe()
    for name, column in all_columns(run).items():
        np.testing.assert_allclose(table[name], column[k : k + 3], rtol=1e-12, atol=1e-15)


def test_even_rows_begin_with_the_run_and_end_within_it(run, tmp_path):
    even = run.resampled("50 ms")
    np.testing.assert_allclose(even.time, 0.05 * np.arange(51))
    assert list(lever_columns(run, "strike", even.time)["t_s"]) == list(even.time)
    save(run, tmp_path, every=0.05)
    rows = (tmp_path / "forces.csv").read_text().splitlines()
    assert [row.split(",")[0] for row in rows[1:4]] == ["0", "0.05", "0.1"]


def test_the_acceleration_of_a_vibration_is_minus_omega_squared_times_the_place():
    time = np.linspace(0, 1, 101)
    run = api_result(results.block(lambda t: 0.3 * np.sin(7 * t), lambda t: 2.1 * np.cos(7 * t)))
    path = run.path("block.nose")
    np.testing.assert_allclose(path.acceleration[:, 0], -14.7 * np.sin(7 * time), atol=3e-3)
    at = np.array([0.1234, 0.5])
    seen = run.at(at).path("block.nose").acceleration[:, 0]
    np.testing.assert_allclose(seen, -14.7 * np.sin(7 * at), atol=0.01)


def test_a_ball_that_bounces_has_the_acceleration_of_its_weight_on_both_sides():
    fall = np.linspace(0, 1, 21)
    time = np.concatenate([fall, 1 + fall])
    time[20] = np.nextafter(1.0, 0.0)
    speed = np.where(time < 1, -9.81 * time, 7.0 - 9.81 * (time - 1))
    velocity = np.stack([0 * time, speed], axis=-1)
    path = PointPath("ball", time, 0 * velocity, velocity)
    np.testing.assert_allclose(path.acceleration, np.tile([0, -9.81], (42, 1)), atol=1e-11)
