"""Laws of nature: what drives alone move, or no force at all: no error keeps steps short."""

from math import pi

import numpy as np
import pytest
from physics_tools import alone, run, run_model

BOB = """
bodies:
  bob: {type: rigid, mass: 2, inertia: 0.3, centre_of_mass: [0.5, 0],
        points: {hook: [0, 0], end: [1, 0]}}
joints: {pivot: {type: revolute, points: [ground, bob.hook], at: [0, 0]}}
drives: {motor: {type: speed, joint: pivot, value: 7}}
gravity: [0, -9.81]
run: {duration: 3}
accuracy: {tolerance: 1.0e-8}
outputs: {watch: bob.end}
"""


@pytest.mark.parametrize("sample", ["10 ms", "1.5 s"])
def test_what_a_drive_supplies_to_a_bob_that_it_alone_moves(sample):
    """It lifts the bob, and gets that back. The bob's highest place is found between samples."""
    bob = run(BOB, f"run.sample={sample}")
    lifted = 2 * 9.81 * 0.5 * np.sin(7 * bob.time)
    np.testing.assert_allclose(bob.energy.supplied, lifted, atol=1e-11)
    assert bob.checks.energy_residual < 1e-11
    turns = bob.extremes["bob.end.y_m"]
    np.testing.assert_allclose(turns.time, [0, *(np.arange(0.5, 7) * pi / 7), 3], atol=1e-7)
    np.testing.assert_allclose(np.abs(turns.value[1:-1]), 1, atol=1e-12)


SWUNG = """
bodies:
  bob: {type: rigid, mass: 2, inertia: 0.3, points: {hook: [0, 0]}}
joints: {pivot: {type: revolute, points: [ground, bob.hook], at: [0, 0]}}
drives: {motor: {type: torque, joint: pivot, value: '6*cos(40*t)'}}
run: {duration: 1, sample: 1.3 ms}
accuracy: {tolerance: 1.0e-8}
"""


@pytest.mark.parametrize("tolerance", [1e-6, 1e-8])
def test_within_steps_energies_are_read_as_accurately_as_the_tolerance_asks(tolerance):
    """J w' = M cos(40 t) gives w = M sin(40 t) / (40 J); what is supplied is J w^2 / 2.

    Samples fall anywhere into steps that are more than ten times as long.
    """
    bob = run(SWUNG, f"accuracy.tolerance={tolerance}")
    exact = 0.5 * (6 * np.sin(40 * bob.time) / 40) ** 2 / 0.3
    supplied, kinetic = (
        np.abs(found - exact).max() for found in (bob.energy.supplied, bob.energy.kinetic)
    )
    assert 1e-12 < kinetic < 10 * tolerance * exact.max()
    assert supplied < 10 * tolerance * exact.max()


def test_what_a_drive_supplies_to_a_loop_that_it_alone_moves():
    trammel = run_model("textbook/driven_trammel.yaml", "accuracy.tolerance=1e-4")
    energy = trammel.energy
    off = energy.kinetic + energy.stored + energy.dissipated - energy.supplied
    assert np.abs(off - off[0]).max() < 1e-9 * energy.kinetic.max()


PLATE = """
bodies: {plate: {type: rigid, mass: 2, inertia: 0.01, points: {corner: [0.3, 0]}}}
initial: {positions: {plate: [0, 0]}, speeds: {plate: 20}}
run: {duration: 3}
accuracy: {tolerance: 1.0e-5}
outputs: {watch: plate.corner}
"""


@pytest.mark.parametrize(("formulation", "off"), [("minimal", 1e-12), ("redundant", 3e-7)])
def test_every_turn_of_what_turns_evenly_is_found(formulation, off):
    """No force, hence no error: steps might be as long as the run."""
    plate = run(PLATE, f"solver.formulation={formulation}", "run.sample=1.5")
    for name, first in (("x", 0.0), ("y", pi / 2)):
        turns = plate.extremes[f"plate.corner.{name}_m"]
        expected = np.arange(first, 60, pi)
        expected = expected[expected > 0] / 20
        np.testing.assert_allclose(turns.time, [0, *expected, 3], atol=1e-5)
        np.testing.assert_allclose(np.abs(turns.value[1:-1]), 0.3, atol=off)


def test_the_work_of_a_motion_that_shakes_beside_a_slow_pendulum():
    """The pendulum allows long steps, in which the wheel swings by A sin(b t): J (A b cos b t)^2/2.

    Nothing couples the two, so that all that the motor supplies is the kinetic energy of the wheel.
    """
    moment, swing, pace = 0.01, 0.3, 40.0
    result = alone(f"""
bodies:
  wheel: {{type: rigid, mass: 1, inertia: {moment}, points: {{hub: [0, 0], rim: [50 mm, 0]}}}}
  pendulum: {{type: rigid, mass: 1, inertia: 1.0e-3, centre_of_mass: [0.2, 0],
             points: {{a: [0, 0]}}}}
joints:
  shaft: {{type: revolute, points: [ground, wheel.hub], at: [0, 0]}}
  pivot: {{type: revolute, points: [ground, pendulum.a], at: [1, 0]}}
drives: {{motor: {{type: motion, joint: shaft, value: {swing} * sin({pace} * t)}}}}
gravity: [0, -9.81]
initial: {{angles: {{pendulum: -60 deg}}}}
run: {{duration: 1, sample: 2 ms}}
accuracy: {{tolerance: 1.0e-5}}
""")
    rate = swing * pace * np.cos(pace * result.time)
    supplied = 0.5 * moment * (rate**2 - rate[0] ** 2)
    np.testing.assert_allclose(result.energy.supplied, supplied, atol=1e-9)
