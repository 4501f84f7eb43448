"""Samples within steps that wait for their forces, and where searches for places begin."""

import numpy as np
import pytest
from cli_runs import MODELS
from physics_tools import run
from scipy.interpolate import CubicSpline

from exudyn_flexlink import load_scene, simulate
from exudyn_flexlink.engines.exudyn.minimal import recording
from exudyn_flexlink.engines.exudyn.minimal.model import MinimalModel


def same_joint_forces(one, other):
    for name, force in other.joint_forces.items():
        largest = np.abs(force).max()
        np.testing.assert_allclose(one.joint_forces[name], force, rtol=0, atol=1e-9 * largest)


@pytest.mark.parametrize(
    ("model", "lasts"),
    [("no_clearance", 0.34), ("clearance", 0.1), ("textbook/free_slider_crank", 0.3)],
)
def test_forces_found_together_are_those_found_at_every_step(model, lasts, monkeypatch):
    """Strikes and touches fall between them, of which no sample may know too early or too late."""
    scene = load_scene(MODELS / f"{model}.yaml", [f"run={{duration: {lasts}, sample: 1 ms}}"])
    together = simulate(scene, measure=False)
    monkeypatch.setattr(recording, "AT_ONCE", 1)
    one_by_one = simulate(scene, measure=False)
    np.testing.assert_array_equal(together.time, one_by_one.time)
    # Places on slots and in loops are searched from elsewhere then, and found but for rounding.
    np.testing.assert_allclose(together.poses, one_by_one.poses, rtol=0, atol=1e-12)
    same_joint_forces(together, one_by_one)
    for name, history in one_by_one.contacts.items():
        force, most = together.contacts[name].force, history.force.max()
        np.testing.assert_array_equal(force > 0, history.force > 0)
        np.testing.assert_allclose(force, history.force, rtol=0, atol=1e-9 * most)


ARM = """
bodies:
  arm: {type: rigid, mass: 2, inertia: 0.3, centre_of_mass: [0.5, 0], points: {hook: [0, 0]}}
joints: {pivot: {type: revolute, points: [ground, arm.hook], at: [0, 0]}}
drives: {motor: {type: speed, joint: pivot, value: VALUE}}
gravity: [0, -9.81]
run: {duration: 3, sample: 0.15 ms}
accuracy: {tolerance: 1.0e-8}
"""


@pytest.mark.parametrize("value", ["7", "7 + 2*sin(5*t)"])
def test_a_step_of_many_samples_is_summed_up_by_some_of_them(value, monkeypatch):
    """Exudyn is not asked for five stages between any two; the drive's work is exact."""
    looks = []
    found = MinimalModel.forces_at

    def counted(model, t, *state):
        looks.append(len(t))
        return found(model, t, *state)

    monkeypatch.setattr(MinimalModel, "forces_at", counted)
    arm = run(ARM.replace("VALUE", value))
    assert len(arm.time) == 20_001
    assert sum(looks) < 4 * len(arm.time)
    t = arm.time
    angle = 7 * t + (0.4 * (1 - np.cos(5 * t)) if "sin" in value else 0)
    speed = 7 + (2 * np.sin(5 * t) if "sin" in value else 0)
    work = 2 * 9.81 * 0.5 * np.sin(angle) + 0.5 * 0.8 * (speed**2 - 49)
    np.testing.assert_allclose(arm.energy.supplied, work, atol=1e-10)


BALL = """
bodies: {ball: {type: rigid, mass: 2, inertia: 0, points: {c: [0, 0]}}}
contacts:
  floor: {type: circle_on_circle, circles: [{at: ball.c, radius: 0.1},
          {at: ground, place: [0, -1], radius: 0.9}], law: {stiffness: 1.0e4, restitution: 1}}
initial: {positions: {ball: [0, 0.0001]}, velocities: {ball: [0, -1]}}
run: {duration: 40 ms, sample: 0.1 ms}
accuracy: {tolerance: 1.0e-9}
"""


def test_what_a_contact_stores_is_energy_that_is_stored():
    """A ball turns where all of m v^2/2 is k d^2/2; nothing is lost on the way."""
    result = run(BALL)
    depth = np.maximum(-result.contacts["floor"].gap, 0)
    assert result.energy.stored == pytest.approx(0.5 * 1e4 * depth**2, abs=1e-9)
    assert result.energy.stored.max() == pytest.approx(1.0, rel=1e-4)
    allowed = result.scene.accuracy.tolerance * result.contacts["floor"].force.max()
    assert result.energy.dissipated == pytest.approx(0, abs=0.1 * allowed)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-9])
def test_a_touch_shorter_than_the_grid_has_samples_that_show_its_force(tolerance):
    """F = v sqrt(k m) sin(w t): cubics through the samples of its half wave are near it."""
    text = BALL.replace("sample: 0.1 ms", "sample: 100 ms").replace("40 ms", "60 ms")
    result = run(text.replace("1.0e-9", f"{tolerance:.1e}"))
    force, w = result.contacts["floor"].force, np.sqrt(1e4 / 2)
    begin, end = 1e-4, 1e-4 + np.pi / w
    inside = (result.time >= begin) & (result.time <= end)
    t = np.linspace(begin, end, 1001)
    between = CubicSpline(result.time[inside], force[inside])(t)
    largest = np.sqrt(1e4 * 2)
    np.testing.assert_allclose(between, largest * np.sin(w * (t - begin)), atol=0.005 * largest)
