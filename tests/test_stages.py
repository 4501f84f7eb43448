"""Stages of a run: what lets go keeps its speed, what closes acts by an impulse.

Numbers are closed forms, or two integrations by different methods that agree to 1e-11.
"""

import numpy as np
import pytest
from physics_tools import FALLING_ROD as ROD
from physics_tools import PULLED_BOX as BOX
from physics_tools import alone, scene

from exudyn_flexlink.continuing import continued
from exudyn_flexlink.effects import idealise, with_impact
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.observables import joint_force
from exudyn_flexlink.report.check import check_text
from exudyn_flexlink.report.run import run_text
from exudyn_flexlink.source import SceneError
from exudyn_flexlink.storage import load, save

THROWN = ROD.replace(
    "run: {duration: 2}",
    """
initial: {angles: {rod: -160 deg}}
run: {duration: 2, until: "-1.2 m - place(rod.tip, y)"}
stages: [{until: "angle(pin) + 50 deg", remove: [joints.pin]}]
""",
)
SHEARED = ROD.replace(
    "run: {duration: 2}",
    """
run: {duration: 2, until: "t - 0.6215570326 s"}
stages: [{until: "force(pin) - 23.544 N", remove: [joints.pin]}]
""",
)
ARMS = """
bodies:
  arm: {type: rigid, mass: 1, inertia: 0.03, centre_of_mass: [0.3, 0],
        points: {hub: [0, 0], tip: [0.6, 0]}}
  other: {type: rigid, mass: 0.7, inertia: 0.014583333333333334, centre_of_mass: [0.25, 0],
          points: {hub: [0, 0], tip: [0.5, 0]}}
joints:
  first: {type: revolute, points: [ground, arm.hub], at: [0, 0]}
  second: {type: revolute, points: [ground, other.hub], at: [0, 0]}
gravity: 9.81
initial: {angles: {arm: 180 deg, other: -90 deg}}
run: {duration: 1.5, until: "-speed(first)"}
accuracy: {tolerance: 1.0e-10}
stages:
  - until: "angle(first) - angle(second) - 360 deg"
    remove: [joints.second]
    add: {joints: {latch: {type: weld, points: [arm.hub, other.hub]}}}
"""
CARTS = """
bodies:
  cart: {type: rigid, mass: 2, inertia: 1, points: {o: [0, 0], front: [0.2, 0]}}
  wagon: {type: rigid, mass: 1.5, inertia: 1, points: {o: [0, 0]}}
joints:
  way: {type: prismatic, points: [ground, cart.o], at: [0, 0], axis: [1, 0]}
  track: {type: prismatic, points: [ground, wagon.o], at: [0, 0], axis: [1, 0]}
springs: {pull: {type: linear, joint: way, stiffness: 300, length: 0}}
initial: {along: {way: -0.1, track: 0.2}}
run: {duration: 1}
accuracy: {tolerance: 1.0e-10}
stages:
  - until: "place(cart.front, x) - place(wagon.o, x)"
    remove: [joints.track]
    add: {joints: {hook: {type: weld, points: [cart.front, wagon.o]}}}
"""
ROTOR = """
bodies: {wheel: {type: rigid, mass: 1, inertia: 0.05, points: {hub: [0, 0]}}}
joints: {axle: {type: revolute, points: [ground, wheel.hub], at: [0, 0]}}
springs: {drag: {type: torsional, joint: axle, damping: 0.002}}
drives: {motor: {type: torque, joint: axle, value: 0.4}}
run: {duration: 60, until: "5 rad/s - speed(axle)"}
accuracy: {tolerance: 1.0e-9}
stages: [{until: "angle(axle) - 3*360 deg", set: {drives.motor.value: 0}}]
"""


def begins(result):
    """Instants (s) at which stages begin."""
    return [event.time for event in result.laps if event.kind == "stage"]


def test_a_rod_that_is_let_go_flies_on():
    """2A: the free end comes down through y = -1.2 on a parabola."""
    result = alone(THROWN)
    (let_go,) = begins(result)
    assert let_go == pytest.approx(0.5558819386, abs=2e-9)
    k = result.sample_at(let_go)
    assert result.rates[k, 0, 2] == pytest.approx(3.949530849, abs=2e-8)
    assert np.hypot(*result.joint_forces["pin"][k]) == pytest.approx(16.61335079, abs=2e-7)
    assert np.isnan(result.joint_forces["pin"][k + 1 :]).all()
    largest = np.linalg.norm(result.joint_forces["pin"][: k + 1], axis=1).max()
    assert f"to {largest:.5g} N" in repr(joint_force(result, "pin"))
    assert result.time[-1] == pytest.approx(1.183224211, abs=2e-9)
    x, y, angle = result.poses[-1, 0]
    centre = [x + 0.4 * np.cos(angle), y + 0.4 * np.sin(angle)]
    assert centre == pytest.approx([1.016328717, -1.599765456], abs=1e-8)
    assert angle + np.pi / 2 == pytest.approx(3.175839358, abs=1e-8)
    assert np.diff(result.time).min() > 1e-12
    assert np.abs(result.energy.residual).max() < 1e-8


def test_a_pin_shears_at_its_force():
    """2B: it breaks at 2 m g; 0.3 s later the rod has flown on."""
    result = alone(SHEARED)
    assert begins(result) == pytest.approx([0.3215570326], abs=2e-9)
    x, y, angle = result.poses[-1, 0]
    centre = [x + 0.4 * np.cos(angle), y + 0.4 * np.sin(angle)]
    assert centre == pytest.approx([-0.2773645198, -1.152544406], abs=1e-8)
    assert -angle == pytest.approx(2.54867749, abs=1e-8)


def test_what_is_pulled_flies_off_as_its_pin_breaks():
    """2B: 3 kg, pulled by 200 N/s t; the pin breaks at 120 N."""
    result = alone(BOX, 'stages=[{until: "force(pin) - 120 N", remove: [joints.pin]}]')
    assert begins(result) == pytest.approx([0.6], abs=1e-12)
    assert result.poses[-1, 0, 0] == pytest.approx(3.911111111, abs=1e-8)
    assert result.rates[-1, 0, 0] == pytest.approx(21.33333333, abs=1e-7)


def test_a_latch_takes_by_an_impulse_what_speeds_differ():
    """2C: an arm latches to one that hangs; they swing on as one."""
    result = alone(ARMS)
    (latched,) = begins(result)
    assert latched == pytest.approx(0.3743886847, abs=2e-9)
    k = result.sample_at(latched)
    assert result.rates[k, 0, 2] == pytest.approx(7.003570518, abs=2e-8)
    assert result.rates[k + 1, :, 2] == pytest.approx([4.712682965] * 2, rel=0.05)
    (event,) = (event for event in result.laps if event.kind == "stage")
    assert event.details["energy_lost"] == pytest.approx(0.9626635514, abs=1e-8)
    assert result.time[-1] == pytest.approx(0.7003036095, abs=2e-8)
    highest = result.poses[-1, 0, 2] - 1.5 * np.pi
    assert highest == pytest.approx(0.9581771484, abs=1e-8)
    assert np.abs(result.energy.residual).max() < 1e-8


def test_carts_that_couple_swing_on_together():
    """2C, level: 2 kg on a spring meets 1.5 kg that stands at the spring's rest."""
    result = alone(CARTS)
    (coupled,) = begins(result)
    assert coupled == pytest.approx(0.128254983, abs=2e-9)
    (event,) = (event for event in result.laps if event.kind == "stage")
    assert event.details["energy_lost"] == pytest.approx(0.6428571429, abs=1e-8)
    k = result.sample_at(coupled) + 1
    way, speed = result.poses[k, 0, 0], result.rates[k, 0, 0]
    assert np.hypot(way, speed * np.sqrt(3.5 / 300)) == pytest.approx(0.0755928946, abs=1e-8)


def test_a_motor_is_switched_off_and_the_wheel_runs_down():
    """2D: off at 3 turns, which are not counted anew; the end at 5 rad/s."""
    result = alone(ROTOR)
    assert begins(result) == pytest.approx([2.202679634], abs=1e-8)
    assert result.time[-1] == pytest.approx(32.60138222, abs=2e-7)
    assert result.poses[-1, 0, 2] == pytest.approx(315.5359268, abs=1e-6)


def test_what_presses_goes_on_to_press():
    """A plate that sinks by its load: a stage elsewhere changes nothing of the touch."""
    block = """
curves: {plate: {type: line, from: [-1, 0], to: [1, 0]}}
bodies:
  block: {type: rigid, mass: 1, inertia: 1, points: {o: [0, 0]}}
  rod: {type: rigid, mass: 1, inertia: 1, points: {o: [0, 0]}}
joints: {way: {type: prismatic, points: [ground, block.o], at: [0, 0.1], axis: [0, 1]},
         pin: {type: revolute, points: [ground, rod.o], at: [2, 0]}}
contacts: {rest: {type: point_on_curve, point: block.o, curve: plate, side: left,
                  law: {stiffness: 2000, restitution: 0.4}}}
gravity: 9.81
run: {duration: 0.5}
accuracy: {tolerance: 1.0e-9}
"""
    plain = alone(block)
    touch = next(iter(plain.contacts["rest"].touches))
    middle = touch.begin + 0.02
    staged = alone(
        block, f"stages=[{{until: t - {middle}, add: {{springs: {{s: {{type: torsional, "
        "joint: pin, stiffness: 1}}}}]"
    )  # fmt: skip
    both = [list(result.contacts["rest"].touches) for result in (plain, staged)]
    assert len(both[0]) == len(both[1])
    for key in ("begin", "end", "approach_speed", "impulse", "energy_lost", "peak_force"):
        values = [[getattr(touch, key) for touch in touches] for touches in both]
        assert values[1] == pytest.approx(values[0], rel=2e-7, abs=1e-8)


def test_a_formula_that_is_not_below_zero_waits_until_it_has_been():
    """A pendulum passes the middle; the next stage waits for the next time that it rises there."""
    stages = "stages=[{until: t - 0.1 s}, {until: angle(pin) + 90 deg, remove: [joints.pin]}]"
    start = "initial={angles: {rod: -80 deg}}"
    result = alone(ROD, stages, start)
    assert len(begins(result)) == 2
    k = result.sample_at(begins(result)[1])
    assert result.poses[k, 0, 2] == pytest.approx(-np.pi / 2, abs=1e-8)
    assert result.rates[k, 0, 2] > 0.5
    assert any("not below 0 as the run goes on at 0.1 s" in text for text in result.warnings)


def test_a_stage_that_never_comes_is_told():
    result = alone(ROD, "stages=[{until: angle(pin) - 10, remove: [joints.pin]}]")
    assert result.outcome.completed
    assert result.time[-1] == 2.0
    assert not begins(result)
    assert any("stage 1 never came" in warning for warning in result.warnings)
    assert "until   " not in run_text(result)


def test_a_stage_that_comes_as_the_run_ends_changes_nothing():
    stages = "stages=[{until: t - 0.1 s, remove: [joints.pin]}]"
    result = alone(ROD, "run={duration: 0.1 s}", stages)
    assert result.time[-1] == pytest.approx(0.1, abs=1e-12)
    assert np.isfinite(result.joint_forces["pin"]).all()


def test_what_closes_must_be_where_it_can():
    apart = "stages=[{until: t - 0.1, add: {joints: {stop: {type: weld, "
    result = simulate(scene(ROD, apart + "points: [ground, rod.tip], at: [0, -1]}}}}]"))
    assert not result.outcome.completed
    assert "stage 1 can't begin" in result.outcome.reason
    assert result.time[-1] == pytest.approx(0.1, abs=1e-12)


@pytest.mark.parametrize(
    "law", ["{type: impulse, restitution: 0}", "{stiffness: 1.0e6, restitution: 0.5}"]
)
def test_the_wall_of_what_presses_stays_where_it_is(law):
    pin = f"""
curves: {{way: {{type: line, from: [-1, 0], to: [3, 0]}}}}
bodies: {{pin: {{type: rigid, mass: 0.5, inertia: 1.0e-5, points: {{o: [0, 0]}}}}}}
joints: {{slot: {{type: slot, point: pin.o, curve: way, clearance: 2 mm, law: {law}}}}}
gravity: 9.81
run: {{duration: 0.05}}
accuracy: {{tolerance: 1.0e-8}}
"""
    stage = "stages=[{until: t - 0.022 s, set: {joints.slot.clearance: CLEARANCE}}]"
    assert alone(pin, stage.replace("CLEARANCE", "2 mm")).outcome.completed
    result = simulate(scene(pin, stage.replace("CLEARANCE", "1 mm")), measure=False)
    assert result.time[-1] == pytest.approx(0.022)
    assert "'slot' presses, and its wall would move by 0.001" in result.outcome.reason


def test_a_latch_that_turns_a_freewheel_back_ends_the_run_where_it_would_close():
    """The hanging arm comes to the other from above, whose hinge may turn forward alone."""
    kept = "stages.0.remove=[]"
    latched = "stages.0.add.joints.latch.points=[arm.hub, other.hub]"
    result = simulate(scene(ARMS, "joints.second.freewheel=backward", kept, latched))
    assert not result.outcome.completed
    assert result.time[-1] == pytest.approx(0.3743886847, abs=2e-9)
    locks = "freewheel 'second' is turned the way in which it locks"
    assert f"stage 1 can't begin: {locks}" in result.outcome.reason
    assert "turn it the other way" in result.outcome.advice


def test_a_run_goes_on_from_one_of_its_stages():
    """What was done in stages before is not done again."""
    result = alone(ARMS)
    rest = continued(result, at=0.5)
    assert not rest.stages
    assert list(rest.joints) == ["first", "latch"]
    again = simulate(rest)
    assert again.time[-1] + rest.initial.clock == pytest.approx(0.7003036095, abs=1e-7)


def test_a_result_of_stages_is_kept_and_read_back(tmp_path):
    result = alone(CARTS)
    assert list(result.scene.joints) == ["way", "track", "hook"]
    save(result, tmp_path / "run")
    loaded = load(tmp_path / "run")
    assert loaded.scene == result.scene
    assert loaded.stages == result.stages
    assert np.array_equal(loaded.joint_forces["hook"], result.joint_forces["hook"], equal_nan=True)
    again = simulate(loaded.scene)
    assert np.array_equal(again.poses, result.poses)


@pytest.mark.parametrize(
    ("stage", "message"),
    [
        ("{until: t - 1, remove: [joints.pim]}", "no 'pim' among joints; did you mean 'pin'"),
        ("{until: t - 1, remove: [bodies.rod]}", "'bodies.rod' can't be removed"),
        ("{until: t - 1, set: {drives.motor.value: 0}}", "no 'motor' among drives"),
        ("{until: t - 1, set: {run.duration: 3}}", "'run.duration' can't be set"),
        ("{until: t - 1, set: {joints.pin.clearance: -1}}", "stages.0.set.joints.pin.clearance"),
        ("{until: t - 1, add: {joints: {pin: {type: weld, points: [ground, rod.o], at: [0, 0]}}}}",
         "there is 'pin' among joints already"),
        ("{until: t - 1, remove: [joints.pin], add: {springs: {s: {type: torsional, joint: pin, "
         "stiffness: 1}}}}", "unknown joint 'pin'"),
        ("{until: t + 1}", "is 1 as the run begins: it must be below 0"),
    ],
)  # fmt: skip
def test_a_stage_that_can_not_be_is_refused(stage, message):
    with pytest.raises(SceneError) as error:
        scene(ROD, f"stages=[{stage}]")
    assert message in str(error.value)
    assert all(mistake.path[0] == "stages" for mistake in error.value.mistakes)


def test_turns_end_no_run_of_stages():
    with pytest.raises(SceneError, match="a run of stages has no turns"):
        scene(ROD, "run={turns: 1, of: pin, at_most: 2}", "stages=[{until: t - 1}]")


STRIKER = """
bodies:
  arm: {type: rigid, mass: 1, inertia: 0.1, centre_of_mass: [0.3, 0],
        points: {o: [0, 0], tip: [0.6, 0]}}
  bob: {type: rigid, mass: 1, inertia: 0.1, points: {o: [0, 0], rim: [0.2, 0]}}
joints:
  pin: {type: revolute, points: [ground, arm.o], at: [0, 0]}
  hook: {type: revolute, points: [arm.tip, bob.o],
         limits: {from: -40 deg, to: 40 deg, law: {type: impulse, restitution: 0.5}}}
drives: {motor: {type: speed, joint: pin, value: 2}}
initial: {speeds: {bob: 8}}
run: {duration: 0.6}
accuracy: {tolerance: 1.0e-8}
stages:
  - until: "t - 0.3"
    remove: [drives.motor]
    add:
      drives: {brake: {type: speed, joint: pin, value: 1}}
"""


def test_a_motor_takes_the_place_of_another(tmp_path):
    """Both would be refused in one scene; of both the result tells, and is kept."""
    result = alone(STRIKER)
    assert np.isfinite(result.drive_torques["motor"]).sum() > 1
    assert np.isfinite(result.drive_torques["brake"][-1])
    k = result.sample_at(begins(result)[0])
    assert result.rates[k, 0, 2] == pytest.approx(2.0)
    assert result.rates[-1, 0, 2] == pytest.approx(1.0)
    assert np.abs(result.energy.residual).max() < 1e-7
    save(result, tmp_path / "run")
    loaded = load(tmp_path / "run")
    assert list(loaded.scene.drives) == ["motor", "brake"]
    assert list(loaded.joint_impulses) == ["pin", "hook"]
    assert np.array_equal(loaded.joint_impulses["hook"].time, result.joint_impulses["hook"].time)


def test_all_stages_are_in_minimal_coordinates():
    """A given step alone would let the last stage be in redundant ones."""
    result = simulate(scene(THROWN, "accuracy={step: 1 ms}"))
    assert result.outcome.completed
    assert result.settings.formulation == "minimal"
    assert not any("redundant" in warning for warning in result.warnings)
    assert result.time[-1] == pytest.approx(1.183224211, abs=2e-9)


@pytest.mark.parametrize(
    ("pressing", "message"),
    [("{foo: [[0, 1]]}", "'foo' is no contact"), ("{way: [[0, 1]]}", "'way' is no contact")],
)
def test_what_is_said_to_press_must_be_there(pressing, message):
    states = "states: {cart: [[0, 0, 0, 0, 0, 0]], wagon: [[0.2, 0, 0, 0, 0, 0]]}"
    with pytest.raises(SceneError, match=message):
        scene(CARTS, "stages=[]", f"initial={{{states}, pressing: {pressing}}}")


def test_check_tells_what_stages_change():
    carts = scene(CARTS)
    text = " ".join(check_text(carts, assemble_scene(carts)).split())
    way = "place(cart.front, x) - place(wagon.o, x) rises through 0"
    assert f"stage 1 as {way}: without joints.track, with joints.hook" in text


CATCH = """
bodies: {rod: {type: rigid, mass: 1.2, inertia: 0.064, centre_of_mass: [0.4, 0],
               points: {o: [0, 0], tip: [0.8, 0]}},
         ball: {type: rigid, mass: 1, inertia: 0, points: {c: [0, 0]}}}
joints: {pin: {type: revolute, points: [ground, rod.o], at: [0, 0]}}
contacts: {hit: {type: point_on_line, point: ball.c, line: [rod.o, rod.tip],
                 law: {stiffness: 1.0e+4, restitution: 0.5, friction: 0.2}}}
initial: {positions: {ball: [0.5, 0.2]}}
gravity: 9.81
run: {duration: 1}
accuracy: {tolerance: 1.0e-8}
stages:
  - until: t - 0.1
    remove: [contacts.hit, joints.pin]
    add:
      joints: {limits: {type: revolute, points: [ground, rod.o], at: [0, 0], friction: {torque: 1},
                      limits: {from: -60 deg, law: {stiffness: 100, restitution: 0.4}}}}
      contacts: {again: {type: point_on_line, point: ball.c, line: [rod.o, rod.tip],
                         law: {stiffness: 1.0e+4, restitution: 0.5, friction: 0.2}}}
  - until: t - 0.2
    set: {joints.limits.limits.from: -80 deg, joints.limits.friction.torque: 2}
    remove: [contacts.again]
"""


def test_effects_reach_what_stages_add():
    """Limits go, and what sets them; a joint may have that name."""
    staged = scene(CATCH)
    smooth = idealise(staged, ["friction"]).stages[0].add
    assert smooth.joints["limits"].friction is None
    assert smooth.contacts["again"].law.friction == 0
    first, second = idealise(staged, ["impact"]).stages
    assert first.remove == ("joints.pin",)
    assert not first.add.contacts
    assert first.add.joints["limits"].limits is None
    assert second.remove == ()
    assert dict(second.set) == {"joints.limits.friction.torque": 2}
    rigid = with_impact(staged, "impulse").stages[0].add
    assert rigid.joints["limits"].limits.law.restitution == 0.4
    assert rigid.contacts["again"].law.type == "impulse"
    assert idealise(staged, ["clearance"]) == staged
