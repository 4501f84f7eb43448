"""Ramps, the end of a run and the instants it keeps."""

from math import pi

import numpy as np
import pytest

from exudyn_flexlink.loading import assemble_scene, scene_of
from exudyn_flexlink.mechanism import Ramp, end_of_run, sample_times
from exudyn_flexlink.source import parse_document

ROTOR = """title: rotor
bodies:
  rotor: {type: rigid, mass: 1, inertia: 0.1, points: {tip: [0.5, 0]}}
joints:
  pin: {type: revolute, points: [ground, rotor.centre], at: [0, 0]}
drives:
  motor: {type: speed, joint: pin, value: 4}
run: {turns: 3, of: pin}
accuracy: {tolerance: 1.0e-5}
"""


def scene(*settings):
    return scene_of(parse_document(ROTOR, "test"), settings)


@pytest.mark.parametrize("value", [3.0, -2.0])
@pytest.mark.parametrize("duration", [0.0, 0.5])
def test_a_ramp_is_the_derivative_of_its_integral(value, duration):
    ramp = Ramp(value, duration)
    step = 1e-5
    for time in np.linspace(0.01, 1, 23):
        slope = (ramp.integral(time + step) - ramp.integral(time - step)) / (2 * step)
        assert ramp.at(time) == pytest.approx(slope, abs=1e-7)
        slope = (ramp.at(time + step) - ramp.at(time - step)) / (2 * step)
        assert ramp.rates(np.array([time])) == pytest.approx(slope, abs=1e-6)


def test_a_ramp_starts_at_rest_and_reaches_its_value_smoothly():
    ramp = Ramp(2.0, 0.4)
    assert [ramp.at(t) for t in (-1, 0, 0.2, 0.4, 9)] == pytest.approx([0, 0, 1, 2, 2])
    assert ramp.rates(np.array([-1, 0, 0.4, 9])).tolist() == [0, 0, 0, 0]
    assert ramp.rates(np.array([1e-4]))[0] < 1e-4  # the acceleration starts without a jump
    assert ramp.integral(0.4) == pytest.approx(0.4)  # half of value x duration
    assert Ramp(2.0).at(0.0) == 2.0


@pytest.mark.parametrize(
    ("settings", "end"),
    [
        ([], 6 * pi / 4),
        (["drives.motor.value=-4"], 6 * pi / 4),
        (["drives.motor.ramp=0.5"], 6 * pi / 4 + 0.25),
        (["run.at_most=1"], 1.0),
        (["run.at_most=100"], 6 * pi / 4),
        (["run.duration=0.3"], 0.3),
        (["drives.motor.value=0", "run.at_most=2"], 2.0),
        (["drives.motor={type: torque, joint: pin, value: 1}", "run.at_most=2"], 2.0),
    ],
)
def test_the_end_of_a_run(settings, end):
    found = scene(*settings)
    assert end_of_run(found, assemble_scene(found).mechanism) == pytest.approx(end, rel=1e-12)


@pytest.mark.parametrize("end", [1.0, 0.37, 6 * pi / 4, 1e-4])
def test_samples_are_even_and_reach_the_end(end):
    found = scene()
    times = sample_times(found, assemble_scene(found).mechanism, end)
    assert times[0] == 0
    assert times[-1] == end
    steps = np.diff(times)
    assert steps[:-1] == pytest.approx(steps[0], rel=1e-9)
    assert 0 < steps[-1] <= steps[0] * (1 + 1e-9)
    assert 2000 <= len(times) <= 6000
    assert float(f"{steps[0]:.0e}") == pytest.approx(steps[0])  # a round number
