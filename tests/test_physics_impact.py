"""Laws of nature: impacts of a point on a face."""

import numpy as np
import pytest
from cli_runs import MODELS
from physics_tools import (
    STEEL,
    impulses,
    rod,
    run,
    scene,
    speed,
    total_energy,
    where,
)

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.observables import common_times, separation

G = 9.81

# A point mass at the end of a light arm, falling on a rod that is welded to the ground.
HAMMER = """
materials: {steel: {density: 7850, youngs_modulus: 200 GPa}}
bodies:
  hammer:
    {type: rigid, mass: 2, inertia: 1.0e-9, points: {hinge: [0, 0], tip: [1, 0]},
     centre_of_mass: [1, 0]}
  anvil: {type: rod, length: 0.4, material: steel, section: {width: 10 mm, thickness: 10 mm}}
joints:
  hinge: {type: revolute, points: [ground, hammer.hinge], at: [0, 0]}
  fix: {type: weld, points: [ground, anvil.start], at: [0.8, 0]}
contacts:
  hit:
    type: point_on_line
    point: hammer.tip
    line: [anvil.start, anvil.end]
    law: {stiffness: 1.0e6, restitution: 0.5}
initial: {angles: {hammer: 0.2}, speeds: {hammer: -2}}
run: {duration: 0.3}
accuracy: {tolerance: 1.0e-4}
"""


@pytest.mark.parametrize("restitution", [0.3, 0.9, 1.0])
def test_impact_returns_e_times_the_speed(restitution):
    """No gravity: the hammer turns evenly before and after."""
    result = run(HAMMER, f"contacts.hit.law.restitution={restitution}")
    after = speed(result, "hammer")[-1]
    assert after == pytest.approx(2 * restitution, rel=0.012)
    (end,) = impulses(result, "hit")
    assert end.details["impulse"] == pytest.approx(2 * (2 + after), rel=1e-3)
    lost = 0.5 * 2 * (2**2 - after**2)
    assert end.details["energy_lost"] == pytest.approx(lost, abs=2e-3 * 4)
    assert end.details["energy_lost"] == pytest.approx((1 - restitution**2) * 4, abs=0.02 * 4)
    begin = next(e for e in result.events if e.kind == "contact begins")
    assert begin.time == pytest.approx(0.1, abs=1e-4)
    assert begin.details["approach_speed"] == pytest.approx(2, rel=1e-3)
    assert begin.details["place"] == pytest.approx(0.2, abs=1e-4)


def test_identical_runs_are_identical_bit_for_bit():
    one, other = run(HAMMER), run(HAMMER)
    for name in ("time", "poses", "rates"):
        assert np.array_equal(getattr(one, name), getattr(other, name))
    assert one.events == other.events


def test_point_beyond_the_end_of_the_face_passes():
    result = run(HAMMER, "joints.fix.at=[1.001, 0]")
    np.testing.assert_allclose(speed(result, "hammer"), -2, atol=1e-9)
    assert result.events == ()
    result = run(HAMMER, "joints.fix.at=[0.599, 0]")
    np.testing.assert_allclose(speed(result, "hammer"), -2, atol=1e-9)


def test_point_that_passed_behind_is_not_struck_from_behind():
    """It starts beside the face, swings behind it and comes through: struck only from above."""
    text = HAMMER.replace("hammer: 0.2}", "hammer: -0.7}").replace("hammer: -2}", "hammer: 4}")
    result = simulate(scene(text))
    np.testing.assert_allclose(speed(result, "hammer"), 4, atol=1e-9)
    assert result.events == ()


def test_hammer_bounces_elastically_without_losing_energy():
    """Nineteen bounces under gravity, e = 1; from the apex of each it must not be missed."""
    text = HAMMER.replace("initial:", "gravity: [0, -9.81]\ninitial:")
    settings = ["contacts.hit.law.restitution=1", "run.duration=8", "initial.speeds.hammer=0"]
    result = simulate(scene(text, *settings))
    energy = total_energy(result)
    begins = [e for e in result.events if e.kind == "contact begins"]
    assert len(begins) >= 19
    kinetic = 2 * G * np.sin(0.2)
    assert abs(energy - energy[0]).max() < 3e-3 * kinetic
    heights = where(result, "hammer.tip")[:, 1]
    assert heights[result.time > 7].max() == pytest.approx(np.sin(0.2), rel=5e-3)


RODS = f"""
{STEEL}
bodies: {{upper: {rod()}, lower: {rod()}}}
joints:
  left: {{type: revolute, points: [ground, upper.start], at: [0, 0]}}
  right: {{type: revolute, points: [ground, lower.start], at: [0, 0]}}
contacts:
  hit:
    type: point_on_line
    point: upper.end
    line: [lower.start, lower.end]
    law: {{stiffness: 1.0e5, restitution: 0.5}}
initial: {{angles: {{upper: 0.5, lower: 0}}, speeds: {{upper: -3, lower: 1}}}}
run: {{duration: 0.4}}
accuracy: {{tolerance: 1.0e-5}}
"""


def test_angular_momentum_about_the_pivot_survives_an_internal_impact():
    """Two rods on one hinge; the tip strikes just inside the other's end (0.999 m)."""
    text = RODS.replace("lower: {type: rod, length: 1.0", "lower: {type: rod, length: 1.2")
    text = text.replace(f"lower: {rod()}", f"lower: {rod(1.2)}")
    result = run(text)
    mass = 0.785
    one, two = mass / 3, mass * 1.2**3 / 3
    momentum = one * speed(result, "upper") + two * speed(result, "lower")
    np.testing.assert_allclose(momentum, momentum[0], atol=2e-5 * one * 3)
    relative = speed(result, "upper") - speed(result, "lower")
    assert relative[-1] == pytest.approx(0.5 * 4, rel=0.01)
    reduced = one * two / (one + two)
    (end,) = impulses(result, "hit")
    assert end.details["energy_lost"] == pytest.approx(0.5 * reduced * 16 * 0.75, rel=0.01)
    assert end.details["impulse"] == pytest.approx(reduced * 6, rel=0.01)


def test_warning_where_a_fixed_step_is_long_for_the_contact():
    """Half a period is 4.4 ms: neither nine steps nor two are taken, but those asked for."""
    text = HAMMER.replace("tolerance: 1.0e-4", "step: 5.0e-4")
    few = simulate(scene(text, "solver.steps_per_contact=9"))
    assert any("raise 'solver.steps_per_contact'" in warning for warning in few.warnings)
    for step in ("5.0e-4", "2.0e-3"):
        none = simulate(scene(text.replace("5.0e-4", step)))
        assert none.checks.steps_per_contact == 60
        assert any("in contact steps were" in warning for warning in none.warnings)
    fine = HAMMER.replace("tolerance: 1.0e-4", "step: 5.0e-5")
    assert simulate(scene(fine)).warnings == ()


def test_a_contact_is_resolved_whatever_the_fixed_step():
    """With 0.2 ms it was, with 0.1 ms, six steps for the strike, S was 1.6e-4 m off.

    What is left, 1.4e-5 m, is that of 60 steps for the strike.
    """
    rigid, short = MODELS / "rigid.yaml", ("initial.angles.guide=170 deg", "run.turns=0.125")
    right = simulate(load_scene(rigid, [*short, "accuracy.tolerance=1e-8"]))
    for step in (2e-4, 1e-4, 5e-5, 3.2e-5):
        run = simulate(load_scene(rigid, [*short, f"accuracy.step={step}"]))
        assert separation(run, right, common_times(right, run)).max() < 2e-5
