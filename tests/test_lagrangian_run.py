"""Runs of the hand-written equations: references, closed forms, the Exudyn engine, refusals.

SciPy's explicit method meets a reference (tests/data) within twice the uncertainty that its header
states, up to the strike; test_lagrangian_implicit holds it against the implicit one through a
strike, and that one against the reference to the second lap.
"""

import re
from pathlib import Path

import numpy as np
import pytest
from benchmarks.series import deviation, read_series
from cli_runs import MODELS

from exudyn_flexlink.engines import NotRepresentableError, simulate
from exudyn_flexlink.loading import assemble_scene, load_scene, scene_of
from exudyn_flexlink.mechanism import approach
from exudyn_flexlink.source import parse_document

HERE = Path(__file__).parent
BEAM, FIVE = "bodies.link.hinges.stiffness=beam", "bodies.link.rods=5"
TIGHT = ("solver.integrator=dop853", "accuracy.tolerance=1e-7")


def uncertainty(file):
    """Those of S (m) and of the lever (rad) in a reference's header."""
    found = re.search(r"S ([\d.e+-]+) m, lever ([\d.e+-]+) rad", file.read_text().splitlines()[0])
    return max(2 * float(found[1]), 1e-9), max(2 * float(found[2]), 1e-8)


def test_reference_is_met_within_twice_its_uncertainty():
    file = HERE / "data" / "strike_n5_beam.csv"
    series, (distance, angle) = read_series(file), uncertainty(file)
    settings = ["run.turns=0.17", "run.sample=1 ms", BEAM, FIVE, *TIGHT]
    result = simulate(load_scene(MODELS / "no_clearance.yaml", settings), "lagrangian")
    assert result.outcome.completed, result.outcome
    assert result.warnings == ()
    found = deviation(result, series.time, series.position, series.lever_angle)
    assert len(found.time) > 100
    assert found.largest < distance
    assert found.largest_angle < angle
    checks = result.checks
    assert checks.energy_residual < 1e-10 * checks.largest_kinetic_energy
    assert checks.constraint_error < 1e-14


def test_forces_and_energies_are_those_of_the_exudyn_engine():
    settings = ("run.turns=0.3", "run.sample=1 ms", "gravity=[1, -9.81]", "bodies.link.rods=3")
    scene = load_scene(MODELS / "smooth.yaml", [*settings, "accuracy.tolerance=1e-6"])
    ours, other = simulate(scene, "lagrangian"), simulate(scene)
    _, i, k = np.intersect1d(ours.time.round(9), other.time.round(9), return_indices=True)
    assert len(i) > 150
    assert ours.part_names == other.part_names
    assert ours.poses[i] == pytest.approx(other.poses[k], abs=3e-5)
    for name in ("drive_torques", "joint_forces", "slot_forces"):
        for key, values in getattr(ours, name).items():
            error = np.abs(values[i] - getattr(other, name)[key][k])
            assert np.median(error) < 3e-4 * np.abs(values).max(), (name, key)
    for name in ("kinetic", "stored", "dissipated", "supplied"):
        ours_of, other_of = getattr(ours.energy, name)[i], getattr(other.energy, name)[k]
        assert ours_of == pytest.approx(other_of, abs=1e-5), name


FLYWHEEL = """title: a guide of 90 mm with a block on a circle about its pin, driven by a torque
materials: {steel: {density: 7850, youngs_modulus: 200 GPa}}
curves: {ring: {type: circle, centre: [0.1, 0.2], radius: 0.05}}
bodies:
  guide: {type: rod, length: 0.09, material: steel, section: {width: 20 mm, thickness: 12 mm}}
  link: {type: rod, length: 0.07, material: steel, section: {width: 10 mm, thickness: 10 mm}}
joints:
  crank: {type: revolute, points: [ground, guide.start], at: [0.1, 0.2]}
  sleeve: {type: sleeve, guide: guide, link: link}
  pin: {type: slot, point: link.start, curve: ring}
drives: {motor: {type: torque, joint: crank, value: 0.002}}
initial: {speeds: {guide: 1.5}}
run: {duration: 2}
accuracy: {tolerance: 1.0e-5}
"""


def from_text(text, *settings):
    return scene_of(parse_document(text, "test.yaml"), settings)


def test_free_guide_under_a_torque_turns_like_a_flywheel():
    """On a circle about its own pin nothing slides: theta = w t + M t^2/(2 J)."""
    result = simulate(from_text(FLYWHEEL), "lagrangian")
    guide, link = 7850 * 0.02 * 0.012 * 0.09, 7850 * 0.01 * 0.01 * 0.07
    inertia = guide * 0.09**2 / 3 + link * (0.07**2 / 12 + 0.085**2)
    theta = 1.5 * result.time + 0.002 * result.time**2 / (2 * inertia)
    assert result.poses[:, 0, 2] == pytest.approx(theta, abs=1e-9)
    assert result.energy.supplied[-1] == pytest.approx(0.002 * theta[-1], rel=1e-9)
    laps = [event.time for event in result.events if event.kind == "lap"]
    assert len(laps) == int(theta[-1] / (2 * np.pi))
    assert np.interp(laps, result.time, theta) / (2 * np.pi) == pytest.approx(
        np.arange(1, len(laps) + 1), abs=1e-9
    )


def test_turns_clockwise_end_a_run_too():
    back = ("drives.motor.value=-0.002", "initial={speeds: {guide: -1.5}}")
    result = simulate(
        from_text(FLYWHEEL, *back, "run={turns: 1, of: crank, at_most: 9}"), "lagrangian"
    )
    assert result.outcome.completed
    assert result.poses[-1, 0, 2] == pytest.approx(-2 * np.pi, abs=1e-9)


def test_turns_of_a_free_guide_end_the_run():
    run_ = "run={turns: 1, of: crank, at_most: 5}"
    result = simulate(from_text(FLYWHEEL, run_), "lagrangian")
    assert result.outcome.completed
    assert result.poses[-1, 0, 2] == pytest.approx(2 * np.pi, abs=1e-10)
    short = simulate(from_text(FLYWHEEL, run_.replace("5", "0.5")), "lagrangian")
    made = short.poses[-1, 0, 2] / (2 * np.pi)
    assert f"'at_most' was reached when joint 'crank' had made {made:.3g} turns of 1" in (
        short.outcome.reason
    )


@pytest.mark.parametrize("start", [-1.1e-3, -1.3e-3, -1.7e-3, -2.6e-3])
def test_p_goes_on_from_the_seam_of_its_track_and_comes_back_within_one_step(start):
    """Thrown up to just beyond the seam, at 0 rad, by a torque that draws it back."""
    still = simulate(_thrown(0.0, 0.0), "lagrangian")
    braking = -2 * still.poses[-1, 0, 2] / still.time[-1] ** 2  # rad/s^2, nearly constant
    result = simulate(_thrown(start, np.sqrt(2 * braking * (4e-5 - start))), "lagrangian")
    assert result.outcome.completed, result.outcome
    assert [event.kind for event in result.events] == ["lap", "lap"]
    assert result.poses[:, 0, 2].max() == pytest.approx(4e-5, rel=0.3)


def _thrown(angle, speed):
    return load_scene(
        MODELS / "smooth.yaml",
        [
            "bodies.link.rods=1",
            "drives.motor={type: torque, joint: crank, value: -0.004}",
            "run={duration: 40 ms}",
            f"initial={{angles: {{guide: {angle}}}, speeds: {{guide: {speed}}}}}",
        ],
    )


@pytest.mark.parametrize(
    ("settings", "path"),
    [
        (("joints.pivot={type: weld, points: [ground, lever.start], at: [-0.138, 0]}",
          "springs={}"), ("joints", "pivot")),
        (("joints.pin.point=link.end",), ("joints", "pin")),
        (("contacts.strike.point=guide.end",), ("contacts", "strike", "point")),
        (("drives.motor.joint=pivot", "run={duration: 1}"), ("drives", "motor")),
    ],
)  # fmt: skip
def test_what_has_no_equations_is_refused_by_name(settings, path):
    with pytest.raises(NotRepresentableError) as caught:
        simulate(load_scene(MODELS / "no_clearance.yaml", settings), "lagrangian")
    assert caught.value.path == path


def test_friction_of_a_strike_acts_on_link_and_lever():
    """The lever's momentum, with push and rub by `approach` and the laws; energy for the link."""
    scene = load_scene(
        MODELS / "no_clearance.yaml",
        ["contacts.strike.law={stiffness: 2.0e4, restitution: 0.5, friction: 0.3}",
         "bodies.link.rods=3", "initial.angles.guide=179 deg",
         "run={duration: 5 ms, sample: 1 us}", *TIGHT],
    )  # fmt: skip
    result, mechanism = simulate(scene, "lagrangian"), assemble_scene(scene).mechanism
    (contact,), press = mechanism.contacts, result.contacts["strike"].force
    at = approach(contact, result.poses, result.rates, 0.0)
    rub = contact.friction.force(press, at.slip)
    assert np.abs(rub).max() > 0.2  # N
    part = contact.start.part
    lever, psi, rate = mechanism.parts[part], result.poses[:, part, 2], result.rates[:, part, 2]
    along, across = np.array([np.cos(psi), np.sin(psi)]), np.array([-np.sin(psi), np.cos(psi)])

    force = result.joint_forces["pivot"].T - press * across - rub * along
    momentum = lever.mass * lever.centre[0] * rate * across
    gained = momentum[:, -1] - momentum[:, 0]
    assert np.trapezoid(force, result.time) == pytest.approx(
        gained, abs=2e-4 * np.abs(gained).max()
    )

    (spring,) = [s for s in mechanism.springs if part in {s.first, s.second}]
    moment = rub * at.gap - press * at.place
    moment -= spring.stiffness * (psi - spring.rest_angle) + spring.damping * rate
    gained = lever.inertia_about_origin * (rate[-1] - rate[0])
    assert np.trapezoid(moment, result.time) == pytest.approx(gained, rel=1e-4)
    assert result.checks.energy_residual < 1e-10 * result.checks.largest_kinetic_energy
