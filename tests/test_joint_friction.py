"""Laws of dry friction in joints: what rests is held, what slides is braked, all of it is told.

Right values are closed forms, or those of integrations by other methods and coordinates.
"""

from dataclasses import replace

import numpy as np
import pytest
from physics_tools import alone, run, scene

from exudyn_flexlink.continuing import continued, joined
from exudyn_flexlink.effects import idealise
from exudyn_flexlink.engines import NotRepresentableError, simulate
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.observables import force_deviations, force_of
from exudyn_flexlink.report import run_text
from exudyn_flexlink.source import SceneError
from exudyn_flexlink.storage import arrays_of, load, save
from exudyn_flexlink.storage.run import force_columns
from exudyn_flexlink.sweeps.rows import standard_row

ROD = """
bodies: {rod: {type: rigid, mass: 1.2, inertia: 0.064, centre_of_mass: [0.4, 0],
               points: {o: [0, 0], tip: [0.8, 0]}}}
joints: {pin: {type: revolute, points: [ground, rod.o], at: [0, 0], friction: FRICTION}}
gravity: [0, -9.81]
initial: {angles: {rod: -30 deg}}
run: {duration: 10}
accuracy: {tolerance: 1.0e-10}
"""
WHEEL = """
bodies: {wheel: {type: rigid, mass: 12, inertia: INERTIA, points: {o: [0, 0], rim: [0.1, 0]}}}
joints: {pin: {type: revolute, points: [ground, wheel.o], at: [0, 0], friction: FRICTION}}
run: {duration: 15}
accuracy: {tolerance: 1.0e-10}
"""
SLOPE = """
bodies: {block: {type: rigid, mass: 2, inertia: 0.01, points: {o: [0, 0]}}}
joints: {way: {type: prismatic, points: [ground, block.o], at: [0, 0],
               axis: [0.93969262078590838, 0.34202014332566873], friction: FRICTION}}
gravity: [0, -9.81]
initial: {speeds_along: {way: 1.5}}
run: {duration: 10}
accuracy: {tolerance: 1.0e-10}
"""
FOUR_BAR = """
bodies:
  crank: {type: rigid, mass: 0.4, inertia: 8.0e-4, centre_of_mass: [0.075, 0],
          points: {a: [0, 0], b: [0.15, 0]}}
  coupler: {type: rigid, mass: 0.8, inertia: 8.0e-3, centre_of_mass: [0.175, 0],
            points: {b: [0, 0], c: [0.35, 0]}}
  rocker: {type: rigid, mass: 0.5, inertia: 4.0e-3, centre_of_mass: [0.15, 0],
           points: {d: [0, 0], c: [0.3, 0]}}
joints:
  A: {type: revolute, points: [ground, crank.a], at: [0, 0], friction: OF_A}
  B: {type: revolute, points: [crank.b, coupler.b], friction: OF_B}
  D: {type: revolute, points: [ground, rocker.d], at: [0.4, 0], friction: OF_D}
  C: {type: revolute, points: [coupler.c, rocker.c], friction: OF_C}
gravity: [0, -9.81]
initial: {angles: {crank: 60 deg}, guesses: {coupler: 20 deg, rocker: 80 deg}}
run: {duration: 0.7}
accuracy: {tolerance: 1.0e-8}
"""
TURNING = {"A": (None, 0), "B": (0, 1), "D": (None, 2), "C": (1, 2)}
PISTON = """
bodies:
  crank: {type: rigid, mass: 0.4, inertia: 8.0e-4, points: {a: [0, 0], b: [0.1, 0]}}
  rod: {type: rigid, mass: 0.8, inertia: 8.0e-3, centre_of_mass: [0.15, 0],
        points: {b: [0, 0], c: [0.3, 0]}}
  piston: {type: rigid, mass: 0.6, inertia: 1.0e-3, points: {c: [0, 0]}}
joints:
  A: {type: revolute, points: [ground, crank.a], at: [0, 0]}
  B: {type: revolute, points: [crank.b, rod.b]}
  C: {type: revolute, points: [rod.c, piston.c]}
  way: {type: prismatic, points: [ground, piston.c], at: [0, 0], axis: [1, 0],
        friction: {coefficient: 0.2, force: 1}}
initial: {angles: {crank: 50 deg}, guesses: {rod: -15 deg}}
run: {duration: 0.4}
accuracy: {tolerance: 1.0e-8}
"""


def rubbing(text, friction):
    """Scene of inline YAML, with this friction."""
    return text.replace("FRICTION", friction)


def turns_back(result, column):
    """Instants at which the friction of the first joint jumps, and a coordinate there."""
    at = np.flatnonzero(np.diff(result.time) < 1e-12)
    return result.time[at], result.poses[at, 0, column]


def relative(result, joint):
    """How fast a pin of the four-bar turns."""
    first, second = TURNING[joint]
    return result.rates[:, second, 2] - (0.0 if first is None else result.rates[:, first, 2])


def test_pendulum_swings_nine_times_then_rests_for_good(tmp_path):
    """``cos b - cos a = (Tf/G) (a + b)``, and what is lost is Tf times the way."""
    pendulum = run(rubbing(ROD, "{torque: 0.25 N m}"))
    time, angle = turns_back(pendulum, 2)
    right = [0.9216221926, 0.8010034542, 0.6843253192, 0.570776507, 0.4596875276, 0.3504884674,
             0.242679279, 0.1358078049, 0.02945259045]  # fmt: skip
    np.testing.assert_allclose(angle + np.pi / 2, right * np.resize([-1, 1], 9), atol=1e-9)
    np.testing.assert_allclose(time[:3], [0.7803494419, 1.549089953, 2.308359094], atol=1e-9)
    friction = pendulum.frictions["pin"]
    np.testing.assert_allclose(friction.begin, [6.751166343], atol=1e-9)
    assert friction.end.tolist() == [np.inf]
    rest = pendulum.poses[pendulum.time > 6.7512, 0, 2]
    assert np.ptp(rest) < 1e-13  # no creep
    way = np.abs(np.diff([np.pi / 3, *(angle + np.pi / 2)])).sum()
    np.testing.assert_allclose(friction.lost[-1], 0.25 * way, rtol=1e-10)
    np.testing.assert_allclose(pendulum.energy.dissipated, friction.lost, atol=1e-12)
    save(pendulum, tmp_path)
    read = load(tmp_path)
    assert read.scene == pendulum.scene
    np.testing.assert_array_equal(read.frictions["pin"].lost, friction.lost)
    assert read.frictions["pin"].end.tolist() == [np.inf]
    assert standard_row(read)["pin.friction_loss_J"] == pytest.approx(2.352, abs=5e-4)
    assert "pin 2.352 J 3.249 s from 6.751 s on" in " ".join(run_text(read).split())
    for at in (0.5, 8.0):
        goes_on(pendulum, at)


def goes_on(whole, at):
    """As long as it rests it holds on; what slides goes on as if nothing had been."""
    later = simulate(
        continued(whole, at).changed(run=whole.scene.run.model_copy(update={"duration": 2.0}))
    )
    start = float(whole.time[whole.sample_at(at)])
    right = np.interp(start + 1.5, whole.time, whole.poses[:, 0, 2])
    found = np.interp(1.5, later.time, later.poses[:, 0, 2])
    assert abs(found - right) < (1e-13 if at > 7 else 1e-3)
    assert (later.frictions["pin"].rest_until(2.0) == 2.0) == (at > 7)


def test_friction_of_two_joined_runs_is_that_of_one(tmp_path):
    """The rest from 6.75 s on is one, also where the second run begins in it."""
    whole = alone(rubbing(ROD, "{torque: 0.25 N m}"), "run.duration=7.5", "accuracy.tolerance=1e-8")
    rest = continued(whole).changed(run=whole.scene.run.model_copy(update={"duration": 0.5}))
    both = joined(whole, simulate(rest))
    save(both, tmp_path)
    friction = load(tmp_path).frictions["pin"]
    np.testing.assert_allclose(friction.begin, [6.751166343], atol=1e-7)
    assert friction.end.tolist() == [np.inf]
    np.testing.assert_allclose(both.energy.dissipated, friction.lost, atol=1e-12)
    assert len(friction.torque) == len(both.time)


def test_friction_of_a_pin_follows_the_whole_force_in_it():
    pendulum = run(rubbing(ROD, "{coefficient: 0.3, radius: 20 mm}"), "run.duration=2.5")
    time, angle = turns_back(pendulum, 2)
    right = [-0.9999180646, 0.9542833768, -0.9101439542]
    np.testing.assert_allclose(angle + np.pi / 2, right, atol=1e-9)
    np.testing.assert_allclose(time, [0.7835772215, 1.562353988, 2.336753544], atol=1e-9)


def test_flywheel_on_a_journal_runs_out():
    flywheel = rubbing(WHEEL, "{coefficient: 0.1, radius: 15 mm}").replace("INERTIA", "0.08")
    found = alone(flywheel, "gravity=9.81", "initial={speeds: {wheel: 30}}",
                  "accuracy.tolerance=1e-9")  # fmt: skip
    time, angle = turns_back(found, 2)
    np.testing.assert_allclose(time, [13.59157322], rtol=1e-9)
    np.testing.assert_allclose(angle / (2 * np.pi), [32.44749095], rtol=1e-9)
    np.testing.assert_allclose(found.rates[found.time < 13, 0, 2],
                               30 - 2.20725 * found.time[found.time < 13], atol=1e-8)  # fmt: skip


@pytest.mark.parametrize("friction", ["{coefficient: 0.4}", "{force: 7.374707688 N}"])
def test_block_on_a_slope_is_held(friction):
    block = run(rubbing(SLOPE, friction))
    time, x = turns_back(block, 0)
    np.testing.assert_allclose(time, [0.2129903844], rtol=1e-9)
    np.testing.assert_allclose(x / np.cos(np.radians(20)), [0.1597427883], rtol=1e-9)
    still = block.time > time[0]
    assert np.ptp(block.poses[still, 0, 0]) < 1e-14
    np.testing.assert_allclose(block.frictions["way"].torque[-1], 6.710435212, rtol=1e-9)
    assert arrays_of(block)["frictions.way.torque"].attributes["units"] == "N"


def test_block_slides_back_where_friction_is_less_than_the_slope():
    block = run(rubbing(SLOPE, "{coefficient: 0.3}"), "run.duration=1.03460691")
    time, x = turns_back(block, 0)
    np.testing.assert_allclose(time, [0.2450686875], rtol=1e-9)
    np.testing.assert_allclose(x / np.cos(np.radians(20)), [0.1838015156], rtol=1e-9)
    assert abs(block.poses[-1, 0, 0]) < 1e-8
    np.testing.assert_allclose(np.hypot(*block.rates[-1, 0, :2]), 0.4655924449, rtol=1e-8)


def test_torques_spring_and_friction_add_up():
    """From centres (T -+ Tf)/k by half swings of pi sqrt(I/k); friction holds the sum."""
    spring = "springs={k: {type: torsional, joint: pin, stiffness: 4, rest_angle: 0}}"
    drives = "drives={a: {type: torque, joint: pin, value: 2}, " \
             "b: {type: torque, joint: pin, value: -0.5}}"  # fmt: skip
    rotor = rubbing(WHEEL, "{torque: 0.2}").replace("INERTIA", "0.05")
    found = run(rotor, spring, drives, "initial={angles: {wheel: 0}}", "run.duration=3")
    time, angle = turns_back(found, 2)
    np.testing.assert_allclose(time, 0.3512407366 * np.arange(1, 5), rtol=1e-9)
    np.testing.assert_allclose(angle, [0.65, 0.2, 0.45, 0.4], atol=1e-11)
    np.testing.assert_allclose(found.frictions["pin"].torque[-1], 0.1, atol=1e-10)


def test_motor_runs_up_and_out():
    damper = "springs={c: {type: torsional, joint: pin, damping: 2.0e-4}}"
    motor = (
        'drives={m: {type: torque, joint: pin, value: "where(t < 2, 1.2*(1 - speed(pin)/150), 0)"}}'
    )
    rotor = rubbing(WHEEL, "{torque: 0.15}").replace("INERTIA", "0.02")
    found = alone(rotor, damper, motor, "initial={angles: {wheel: 0}}", "accuracy.tolerance=1e-9")
    at = found.sample_at(2.0)
    assert abs(found.time[at] - 2.0) < 1e-12
    np.testing.assert_allclose(found.rates[at, 0, 2], 71.65204424, rtol=1e-8)
    np.testing.assert_allclose(found.poses[at, 0, 2], 81.33647746, rtol=1e-8)
    np.testing.assert_allclose(found.frictions["pin"].begin, [11.12437951], rtol=1e-8)
    np.testing.assert_allclose(found.poses[-1, 0, 2], 403.2562717, rtol=1e-8)


def test_friction_in_a_loop_follows_the_forces_that_newtons_law_tells():
    by_force = "{coefficient: 0.1, radius: 10 mm}"
    found = alone(FOUR_BAR.replace("OF_A", by_force).replace("OF_B", by_force)
                  .replace("OF_C", by_force).replace("OF_D", "{torque: 0.02}"))  # fmt: skip
    for joint in "ABC":  # B and C move, C closes the loop
        speed, size = relative(found, joint), np.hypot(*found.joint_forces[joint].T)
        moves = np.abs(speed) > 1e-6
        right = -1e-3 * np.sign(speed) * size
        np.testing.assert_allclose(found.frictions[joint].torque[moves], right[moves], atol=1e-12)
    assert found.checks.energy_residual < 1e-9
    lost = sum(own.lost for own in found.frictions.values())
    np.testing.assert_allclose(found.energy.dissipated, lost, atol=1e-12)


def test_friction_of_a_slide_follows_the_force_across_it():
    found = alone(PISTON, "drives={m: {type: torque, joint: A, value: 0.9}}")
    speed, across = found.rates[:, 2, 0], found.joint_forces["way"][:, 1]
    assert across.min() < -1 < 1 < across.max()  # it changes sides
    moves = np.abs(speed) > 1e-6
    right = -np.sign(speed) * (1 + 0.2 * np.abs(across))
    np.testing.assert_allclose(found.frictions["way"].torque[moves], right[moves], atol=1e-8)
    assert found.checks.energy_residual < 1e-9


def test_joints_of_a_loop_hold_together_and_slide_together():
    """They do so when a torque at the crank has the power of all: T w = sum(b_j |w_j|)."""
    bounds = {"A": 0.4, "B": 0.01, "C": 0.1, "D": 0.2}
    text = FOUR_BAR
    for joint, bound in bounds.items():
        text = text.replace(f"OF_{joint}", f"{{torque: {bound}}}")
    drive = "drives={m: {type: torque, joint: A, value: 3*t*sin(20*t)}}"
    found = alone(text, drive, "gravity=[0, 0]", "run.duration=0.35")
    at_once = assemble_scene(scene(text, "gravity=[0, 0]", "initial.speeds={crank: 1}"))
    speeds = {joint: abs(at_once.state.v[b, 2] - (0 if a is None else at_once.state.v[a, 2]))
              for joint, (a, b) in TURNING.items()}  # fmt: skip
    needed = sum(bound * speeds[joint] for joint, bound in bounds.items())
    slip = {own.end[0] for own in found.frictions.values()}
    assert len(slip) == 1
    assert slip != {np.inf}
    first = slip.pop()
    np.testing.assert_allclose(abs(3 * first * np.sin(20 * first)), needed, rtol=1e-9)
    for joint, bound in bounds.items():  # until then none is beyond its bound
        torque = found.frictions[joint].torque
        assert np.abs(torque).max() <= bound * (1 + 1e-9)
    assert found.checks.energy_residual < 1e-9


def test_a_drive_works_against_the_friction_of_its_joint():
    drive = "drives={m: {type: speed, joint: pin, value: 5, ramp: 0.1}}"
    with_it, without = (
        alone(rubbing(ROD, friction), drive, "run.duration=0.5", "initial.speeds={}")
        for friction in ("{torque: 0.25}", "{torque: 0}")
    )
    more = with_it.drive_torques["m"] - np.interp(
        with_it.time, without.time, without.drive_torques["m"]
    )
    np.testing.assert_allclose(more[with_it.time > 0.01], 0.25, atol=1e-2)
    np.testing.assert_allclose(with_it.energy.residual, 0, atol=1e-10)


def test_a_joint_rests_from_the_instant_at_which_its_drive_stops():
    stops = "drives={m: {type: speed, joint: pin, value: 'max(0, 0.7013 - t)'}}"
    found = alone(rubbing(ROD, "{torque: 0.25}"), stops, "run.duration=1", "initial.speeds={}")
    assert found.frictions["pin"].begin == pytest.approx([0.7013], abs=1e-9)


def test_redundant_coordinates_creep_and_say_so():
    """By tanh: the angle after 10 s, and a creep of vs artanh(load/bound)."""
    pendulum = alone(rubbing(ROD, "{torque: 0.25, slip_speed: 0.01}"),
                     "solver.formulation=redundant", "accuracy.tolerance=1e-6")  # fmt: skip
    assert abs(pendulum.poses[-1, 0, 2] + np.pi / 2 + 0.01539789852) < 1e-6
    block = alone(rubbing(SLOPE, "{force: 7.374707688, slip_speed: 1.0e-3}"), "run.duration=1",
                  "solver.formulation=redundant", "accuracy.tolerance=1e-6")  # fmt: skip
    creep = 0.001527091703
    np.testing.assert_allclose(np.hypot(*block.rates[-1, 0, :2]), creep, rtol=1e-6)
    at_10_s = np.hypot(*block.poses[-1, 0, :2]) - 9 * creep
    np.testing.assert_allclose(at_10_s, 0.1447985892, atol=2e-6)
    assert "it creeps by 0.0015 m/s" in block.warnings[0]
    assert block.frictions["way"].begin.size == 0
    assert pendulum.checks.energy_residual < 1e-5


def test_no_friction_is_the_scene_without_it_bit_for_bit():
    with_none = rubbing(ROD, "{torque: 0, coefficient: 0, radius: 1 mm}")
    dry, bare = (alone(text, "run.duration=1") for text in (
        with_none, ROD.replace(", friction: FRICTION", "")))  # fmt: skip
    assert np.array_equal(dry.poses, bare.poses)
    without = idealise(scene(rubbing(ROD, "{torque: 0.25}")), ["friction"])
    assert without.joints["pin"].friction is None
    assert dry.frictions == {}


def test_friction_that_no_engine_answers_is_refused():
    locks = scene(rubbing(ROD, "{coefficient: 10, radius: 60 mm}"))
    with pytest.raises(SceneError, match="friction locks joint 'pin'"):
        simulate(locks)
    for settings, engine in (["solver.formulation=redundant"], "exudyn"), ([], "lagrangian"):
        with pytest.raises(NotRepresentableError, match=r"joints\.pin\.friction"):
            simulate(scene(rubbing(ROD, "{coefficient: 0.1, radius: 1 mm}"), *settings), engine)


def test_the_torque_is_told_among_forces_with_an_error_that_holds():
    """Where two runs that turn back at other instants have opposite torques says nothing of it."""
    text = rubbing(ROD, "{coefficient: 0.1, radius: 0.1}")
    made = alone(text, "run.duration=4", "accuracy.tolerance=1e-6", "run.sample=1 ms")
    torque = force_of(made, "friction torque of pin")
    jumps = np.flatnonzero(torque.values[1:] * torque.values[:-1] < 0)
    assert len(jumps) > 3
    assert np.diff(torque.time)[jumps].max() < 1e-12
    slower = replace(made, time=made.time * 1.001)
    apart = force_deviations(made, slower)["friction torque of pin"].free
    assert 1e-5 < apart.largest < 0.02 * np.abs(torque.values).max()
    np.testing.assert_array_equal(
        force_columns(made)["pin.friction_torque_N_m"], made.frictions["pin"].torque
    )


def test_the_force_of_a_slide_is_no_torque():
    made = alone(rubbing(SLOPE, "{force: 12}"), "run.duration=0.1")
    assert force_columns(made)["way.friction_force_N"][0] == pytest.approx(-12)
