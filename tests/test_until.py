"""Runs that end as a formula of time, state and forces rises through zero.

Numbers are closed forms, or two integrations by different methods that agree to 1e-11.
"""

import numpy as np
import pytest
from physics_tools import FALLING_ROD as ROD
from physics_tools import PULLED_BOX as BOX
from physics_tools import alone, run_model, scene

from exudyn_flexlink.continuing import continued, joined
from exudyn_flexlink.engines import NotRepresentableError, simulate
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.report.check import check_text
from exudyn_flexlink.report.run import run_text
from exudyn_flexlink.source import SceneError

ROTOR = """
bodies: {wheel: {type: rigid, mass: 1, inertia: 0.05, points: {hub: [0, 0]}}}
joints: {axle: {type: revolute, points: [ground, wheel.hub], at: [0, 0]}}
springs: {drag: {type: torsional, joint: axle, damping: 0.002}}
initial: {speeds: {wheel: 16.86745484}}
run: {duration: 60, until: "5 rad/s - speed(axle)"}
accuracy: {tolerance: 1.0e-9}
"""
PAPER = ("bodies.link.rods=3", "run={duration: 0.1, sample: 1 ms}")
SLIDER = """
bodies: {box: {type: rigid, mass: 1, inertia: 1, points: {o: [0, 0]}}}
joints: {way: {type: prismatic, points: [ground, box.o], at: [0, 0], axis: [1, 0]}}
run: {duration: 2}
accuracy: {tolerance: 1.0e-9}
"""


def came(text, until, *settings):
    """Result of a run that its formula ended: its last sample is alone at that instant."""
    result = alone(text, f"run.until={until}", *settings)
    assert result.outcome.until
    assert np.diff(result.time).min() > 1e-12
    assert result.time[-1] == result.outcome.time
    return result


def state(result, body):
    """Pose and rate of a body at the end."""
    part = result.part_names.index(body)
    return result.poses[-1, part], result.rates[-1, part]


# --- when it ends ---------------------------------------------------------------------------------


def test_a_thrown_rod_ends_where_its_end_comes_down():
    """2A, from where the pin lets go: a parabola of the centre, and an even turn."""
    way = np.radians(40.0) - np.pi / 2
    centre = 0.4 * np.array([np.cos(way), np.sin(way)])
    speed = 3.949530849 * np.array([-centre[1], centre[0]])
    result = came(
        ROD,
        "-1.2 m - place(rod.tip, y)",
        "joints=",
        f"initial={{angles: {{rod: {way}}}, positions: {{rod: [0, 0]}}, "
        "speeds: {rod: 3.949530849}, velocities: {rod: [0, 0]}}",
    )
    assert np.allclose(centre + 0 * speed, 0.4 * np.array([np.cos(way), np.sin(way)]))
    pose, _ = state(result, "rod")
    assert result.outcome.time == pytest.approx(1.183224211 - 0.5558819386, abs=2e-9)
    end = pose[:2] + 0.4 * np.array([np.cos(pose[2]), np.sin(pose[2])])
    assert end == pytest.approx([1.016328717, -1.599765456], abs=4e-9)
    assert pose[2] + np.pi / 2 == pytest.approx(3.175839358, abs=4e-9)


def test_a_pin_is_reached_by_its_force():
    """2B: a rod falls from rest, level; its pin's force reaches 2 m g."""
    result = came(ROD, "force(pin) - 23.544 N")
    pose, rate = state(result, "rod")
    assert result.outcome.time == pytest.approx(0.3215570326, abs=2e-9)
    assert -pose[2] == pytest.approx(0.9235114788, abs=4e-9)
    assert -rate[2] == pytest.approx(5.417220039, abs=2e-8)
    assert np.hypot(*result.joint_forces["pin"][-1]) == pytest.approx(23.544, abs=1e-7)


def test_a_force_in_step_with_time_ends_a_run_at_its_instant():
    """2B: what is pulled by 200 N/s t breaks at 120 N, which is a sample of the grid, too."""
    result = came(BOX, "force(pin) - 120 N")
    assert result.outcome.time == pytest.approx(0.6, abs=1e-12)


def test_a_wheel_slows_down_to_a_speed():
    """2D, its second half: viscous, ``omega = omega0 exp(-c t/J)``."""
    result = alone(ROTOR)
    assert result.outcome.time == pytest.approx(32.60138222 - 2.202679634, abs=4e-8)
    turned = state(result, "wheel")[0][2]
    assert turned == pytest.approx(0.05 * (16.86745484 - 5) / 0.002, abs=2e-7)


def test_what_comes_first_ends_the_run():
    assert came(ROD, "t - 0.25 s").outcome.time == pytest.approx(0.25, abs=1e-13)
    never = alone(ROD, "run.until=angle(pin) - 1 rad")
    assert never.outcome.until is False
    assert never.outcome.time == 2.0
    assert "never came to 0" in run_text(never)
    turns = "run={turns: 0.1, of: pin, at_most: 2, until: "
    assert alone(ROD, turns + "t - 1}").outcome.until is False
    ended = alone(ROD, turns + "t - 0.1}")
    assert ended.outcome.until
    assert ended.outcome.time == pytest.approx(0.1, abs=1e-13)


def test_of_two_crossings_in_one_step_the_first_counts():
    """An even turn has long steps; the formula is above zero for a thousandth of a second."""
    spin = ("gravity=0", "initial={speeds: {rod: 1}}", "run.duration=3")
    result = came(ROD, "1e-3 - abs(angle(pin) - 1.2345)", *spin)
    assert result.outcome.time == pytest.approx(1.2335, abs=1e-10)
    result = came(ROD, "exp(-((t - 1.7)/1e-3)**2) - 0.5", *spin)
    assert result.outcome.time == pytest.approx(1.7 - 1e-3 * np.sqrt(np.log(2)), abs=1e-10)
    touches = alone(ROD, "run.until=-1e-9 - (angle(pin) - 1.2345)**2", *spin)
    assert touches.outcome.until is False


# --- jumps through zero ---------------------------------------------------------------------------


def test_a_force_that_jumps_at_a_knot_ends_the_run():
    pull = 'drives.pull.value=["where(t < 0.35, 10, 200)", 0]'
    result = came(BOX, "force(pin) - 120 N", pull)
    assert result.outcome.time == pytest.approx(0.35, abs=1e-12)
    assert np.hypot(*result.joint_forces["pin"][-1]) == pytest.approx(200)
    result = came(BOX, "where(t < 0.7, -1, 1)")
    assert result.outcome.time == pytest.approx(0.7, abs=1e-12)


def test_an_impact_that_turns_a_speed_ends_the_run():
    stop = "joints.way.limits={to: 0.5, law: {type: impulse, restitution: 0.5}}"
    speed = "initial={speeds_along: {way: 1}}"
    result = came(SLIDER, "-0.2 m/s - speed(way)", stop, speed)
    assert result.outcome.time == pytest.approx(0.5, abs=1e-12)
    assert state(result, "box")[1][0] == pytest.approx(-0.5)


def test_friction_that_changes_its_sign_ends_the_run():
    """A thrown rod is braked on its way up, and pushed on its way down."""
    rough = ("joints.pin.friction={torque: 0.5}", "initial={speeds: {rod: 3}}")
    result = came(ROD, "torque(pin)", *rough)
    tops = result.rates[-1, 0, 2]
    assert tops == pytest.approx(0, abs=1e-8)
    assert result.frictions["pin"].torque[-1] == pytest.approx(0.5)


def test_the_torque_of_a_joint_is_that_of_its_drive_and_friction():
    """A motor that holds a speed, with friction: a rod is lifted by ``m g l/2 cos + T``."""
    driven = (
        "joints.pin.friction={torque: 0.5}",
        "drives={motor: {type: speed, joint: pin, value: 1}}",
        "initial={angles: {rod: -1.5}}",
    )
    result = came(ROD, "torque(pin) - 3 N m", *driven)
    angle = -1.5 + result.outcome.time
    assert 1.2 * 9.81 * 0.4 * np.cos(angle) == pytest.approx(3, abs=1e-9)
    motor, friction = result.drive_torques["motor"][-1], result.frictions["pin"].torque[-1]
    assert motor + friction == pytest.approx(3, abs=1e-8)
    assert friction == pytest.approx(-0.5)


CHIMNEY = """
bodies:
  lower: {type: rigid, mass: 1, inertia: 0.0208333333333333333, centre_of_mass: [0.25, 0],
          points: {o: [0, 0], top: [0.5, 0]}}
  upper: {type: rigid, mass: 2, inertia: 0.1666666666666666667, centre_of_mass: [0.5, 0],
          points: {foot: [0, 0], tip: [1, 0]}}
joints:
  pin: {type: revolute, points: [ground, lower.o], at: [0, 0]}
  fixed: {type: weld, points: [lower.top, upper.foot]}
initial: {angles: {lower: 60 deg}}
gravity: 9.81
run: {duration: 1, sample: 10 ms}
accuracy: {tolerance: 1.0e-9}
"""
TURNED = ("joints.fixed.points=[upper.foot, lower.top]",)


@pytest.mark.parametrize("settings", [(), TURNED])
def test_a_falling_chimney_breaks_at_the_bending_moment_of_its_weld(settings):
    """It bends by m g cos(angle) x (L - x)^2 / (4 L^2), most at x = L/3."""
    sign = -1 if settings else 1
    result = came(CHIMNEY, f"{-sign:+d}*torque(fixed) - 1.2 N m", *settings)
    angles = result.poses[:, result.part_names.index("lower"), 2]
    torque = -sign * 3 * 9.81 * np.cos(angles) * 0.5 * 1.0**2 / (4 * 1.5**2)
    assert result.drive_torques["fixed (weld)"] == pytest.approx(torque, abs=1e-9)
    assert torque[-1] == pytest.approx(-sign * 1.2, abs=1e-9)


def test_forces_in_loops_and_slots_end_a_run_where_their_columns_say():
    """In the paper's mechanism, of a slot and a sleeve, on its drive and on a pin of the ground."""
    whole = run_model("no_clearance.yaml", *PAPER)
    for sensed, column in (
        ("force(pin)", lambda result: np.hypot(*result.slot_forces["pin"].T)),
        ("force(crank)", lambda result: np.hypot(*result.joint_forces["crank"].T)),
        ("torque(crank)", lambda result: result.drive_torques["motor"]),
    ):
        moved = column(whole) - column(whole)[0]
        farthest = moved[np.abs(moved).argmax()]
        wanted = column(whole)[0] + 0.7 * farthest
        first = whole.time[np.argmax(moved / farthest >= 0.7)]
        until = f"run.until=({sensed} - ({wanted}))/({farthest})"
        result = run_model("no_clearance.yaml", *PAPER, until)
        assert result.outcome.until
        assert column(result)[-1] == pytest.approx(wanted, rel=1e-6)
        assert first - 1e-3 < result.time[-1] <= first


@pytest.mark.parametrize(
    ("joint", "settings"),
    [
        (
            "pin",
            [
                "joints.pin={type: revolute, points: [ground, rod.o], at: [0, 0], "
                "clearance: 0.2 mm, radius: 5 mm, law: {stiffness: 1.0e6, restitution: 0.5}}"
            ],
        ),
        (
            "fixed",
            [
                "joints.fixed={type: weld, points: [rod.tip, end.o]}",
                "bodies.end={type: rigid, mass: 1, inertia: 0.1, points: {o: [0, 0]}}",
            ],
        ),
        ("pin", ["accuracy={step: 1 ms}"]),
    ],
    ids=["of a journal", "of a weld", "by steps of one length"],
)
def test_a_run_ends_at_a_force(joint, settings):
    result = came(ROD, f"force({joint}) - 15 N", *settings)
    assert np.hypot(*result.joint_forces[joint][-1]) == pytest.approx(15, abs=1e-6)


# --- what is refused ------------------------------------------------------------------------------


def refused(text, *settings):
    """The message of a scene that can't be run."""
    with pytest.raises(SceneError) as error:
        simulate(scene(text, *settings))
    return str(error.value)


@pytest.mark.parametrize(
    ("until", "message"),
    [
        ("angle(pin) + 1 rad", "is 1 as the run begins: it must be below 0"),
        ("angle(pin)", "is 0 as the run begins"),
        ("force(pin) - 1 N", "as the run begins: it must be below 0"),
        ("force(pi) - 1 N", "unknown joint 'pi'; did you mean 'pin'?"),
        ("torque(pin) - 1 N m", "no torque acts in 'pin': it has no drive and no friction"),
        ("speed(pin) - 1 N + 1 m", "can't go together"),
        ("5 N", "never changes"),
        ("force(rod.o) - 1 N", "unknown joint 'rod.o'"),
        ("place(pin) - 1 m", "needs a prismatic joint, or a sleeve; 'pin' is of type revolute"),
    ],
)
def test_what_can_end_no_run_is_refused_at_its_line(until, message):
    given = ROD.replace("{duration: 2}", f'{{duration: 2, until: "{until}"}}')
    text = refused(given)
    assert message in text
    assert text.startswith("law.yaml:7:27: run.until: ")


def test_forces_in_joints_are_for_the_end_of_a_run_alone():
    motor = "drives={motor: {type: torque, joint: pin, value: 'force(pin)*0.1'}}"
    assert "'force(pin)' is known in 'run: until' alone" in refused(ROD, motor)


def test_a_force_that_is_not_unique_is_refused():
    twice = "joints.other={type: revolute, points: [ground, rod.o], at: [0, 0]}"
    text = refused(ROD, twice, "run.until=force(pin) - 20 N")
    assert "the force in 'pin' is not known: other joints hold the same" in text


def test_the_torque_of_a_slide_is_refused_by_name():
    text = refused(SLIDER, "run.until=torque(way) - 1 N m")
    assert "needs a revolute joint or a weld; 'way' is of type prismatic" in text


def test_the_torque_of_a_weld_that_another_joint_shares_is_refused():
    base, fixed, other = (
        "bodies.base={type: rigid, mass: 1, inertia: 1, points: {o: [0, 0], p: [1, 0]}}",
        "joints.fixed={type: weld, points: [ground, base.o], at: [0, 0]}",
        "joints.other={type: weld, points: [ground, base.p], at: [1, 0]}",
    )
    text = refused(ROD, base, fixed, other, "run.until=torque(fixed) - 1 N m")
    assert "the force in 'fixed' is not known: other joints hold the same" in text


@pytest.mark.parametrize("formulation", ["redundant", "beam"])
def test_other_formulations_have_no_such_end(formulation):
    with pytest.raises(NotRepresentableError, match="no end at a formula"):
        simulate(scene(ROD, "run.until=t - 1", f"solver.formulation={formulation}"))


def test_the_other_engine_has_no_such_end():
    with pytest.raises(NotRepresentableError, match="no end at a formula"):
        simulate(scene(ROD, "run.until=t - 1"), "lagrangian")


# --- runs that go on ------------------------------------------------------------------------------


def test_a_run_that_goes_on_from_its_end_waits_for_its_formula_to_be_below_zero():
    until = "run={duration: 1, until: t - 0.25}"
    first = alone(ROD, until)
    third = simulate(continued(first).changed(run=scene(ROD, "run={duration: 0.1}").run))
    assert third.outcome.time == 0.1
    again = simulate(continued(first))
    assert again.outcome.until is False
    assert any("counts once it has been" in warning for warning in again.warnings)
    second = simulate(continued(first).changed(run=scene(ROD, "run.until=t - 0.5 s").run))
    assert second.outcome.time == pytest.approx(0.25, abs=1e-12)
    assert joined(first, second).scene.run.until is None
    early = alone(ROD, "run={duration: 0.1, until: t - 0.25}")
    whole = joined(early, simulate(continued(early).changed(run=first.scene.run)))
    assert whole.scene.run.until == first.scene.run.until
    assert whole.outcome.until
    assert whole.time[-1] == pytest.approx(0.25, abs=1e-12)


def test_check_tells_the_formula():
    checked = scene(ROD, "run.until=force(pin) - 23.544 N")
    assert "2 s, or until force(pin) - 23.544 N rises through 0" in check_text(
        checked, assemble_scene(checked)
    )
