"""Laws of gears, racks and belts: how they turn, what their teeth bear, that no energy is lost.

Right values are closed forms; the planetary train is that of R. Willis, Principles of Mechanism.
"""

import numpy as np
import pytest
from physics_tools import run, scene

from exudyn_flexlink.engines import NotRepresentableError, simulate
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.report import check_text
from exudyn_flexlink.source import SceneError
from exudyn_flexlink.storage import load, save

ARM = "{type: rigid, mass: 1, inertia: 6.0e-3, points: {hub: [0, 0], p0: [0.036, 0], p1: [-0.018, \
0.03117691453623979], p2: [-0.018, -0.03117691453623979]}}"
WHEEL = "{type: rigid, mass: 0.3, inertia: 3.84e-5, points: {o: [0, 0]}}"
END = "run: {duration: 0.1}\naccuracy: {tolerance: 1.0e-9}\n"
RACK = (
    """
bodies:
  pinion: {type: rigid, mass: 1, inertia: 3.0e-3, points: {o: [0, 0]}}
  rack: {type: rigid, mass: 1.5, inertia: 0.01, points: {o: [0, 0]}}
joints:
  shaft: {type: revolute, points: [ground, pinion.o], at: [0.04, 0]}
  way: {type: prismatic, points: WAY, at: [0, 0], axis: AXIS}
  teeth: {type: gear, joints: JOINTS, radius: 0.04}
"""
    + END
)
SPRING = (
    RACK
    + """
springs: {spring: {type: linear, joint: way, stiffness: 800}}
drives: {motor: {type: torque, joint: shaft, value: 6}}
"""
)
BOTH = pytest.mark.parametrize("formulation", ["minimal", "redundant"])


def planetary(planets):
    """Sun and arm on the ground, whose ring of 52 teeth is held; module 2 mm."""
    wheels = range(planets)
    bodies = {"arm": ARM, "sun": "{type: rigid, mass: 1, inertia: 4.0e-4, points: {o: [0, 0]}}"}
    bodies |= {f"planet{k}": WHEEL for k in wheels}
    joints = {
        "pivot": "{type: revolute, points: [ground, arm.hub], at: [0, 0]}",
        "shaft": "{type: revolute, points: [sun.o, ground], at: [0, 0]}",
    }
    for k in wheels:
        joints |= {
            f"pin{k}": f"{{type: revolute, points: [planet{k}.o, arm.p{k}]}}",
            f"mesh{k}": f"{{type: gear, joints: [shaft, pin{k}], teeth: [20, 16]}}",
            f"ring{k}": f"{{type: gear, joints: [pivot, pin{k}], ratio: {16 / 52!r}, "
            "internal: true}",
        }
    drives = {"motor": "{type: torque, joint: shaft, value: -2}"}  # its first body is the sun
    sections = {"bodies": bodies, "joints": joints, "drives": drives}
    return END + "\n".join(
        f"{name}:\n" + "\n".join(f"  {key}: {own}" for key, own in parts.items())
        for name, parts in sections.items()
    )


def rack(text=RACK, joints="[shaft, way]", way="[ground, rack.o]", axis="[1, 0]"):
    return text.replace("JOINTS", joints).replace("WAY", way).replace("AXIS", axis)


@pytest.mark.parametrize(
    ("planets", "formulation", "sun", "teeth"),
    [
        (1, "minimal", 2202.733021, (55.94533959, 52.64124006)),
        (1, "redundant", 2202.733021, (55.94533959, 52.64124006)),
        (3, "minimal", 2004.08239, (19.97278407, 16.96666048)),
    ],
)
def test_a_planetary_train_turns_as_willis_says_and_its_planets_share_the_load_alike(
    planets, formulation, sun, teeth
):
    result = run(planetary(planets), f"solver.formulation={formulation}")
    rates = result.rates[-1, :, 2]
    assert rates[1] / 0.1 == pytest.approx(sun, rel=1e-7)
    assert rates / rates[1] == pytest.approx([20 / 72, 1, *[-0.625] * planets], rel=1e-9)
    rel = 1e-7 if formulation == "minimal" else 1e-4  # of forces, by steps of second order
    for k in range(planets):
        assert -result.gear_forces[f"mesh{k}"] == pytest.approx(teeth[0], rel=rel)
        assert -result.gear_forces[f"ring{k}"] == pytest.approx(teeth[1], rel=rel)
    # Newton's law of a planet: both teeth push it, and its pin carries it round.
    across = sum(teeth) - 0.3 * 0.036 * rates[0] / 0.1
    held = np.hypot(across, 0.3 * 0.036 * rates[0] ** 2)
    assert np.linalg.norm(result.joint_forces["pin0"][-1]) == pytest.approx(held, rel=rel)
    assert result.energy.supplied[-1] == pytest.approx(result.energy.kinetic[-1], rel=1e-8)
    assert abs(result.energy.residual).max() < 1e-8 * result.energy.kinetic[-1]


def test_a_planet_more_than_needed_is_counted_and_its_load_told_as_the_least():
    own = scene(planetary(3))
    assembly = assemble_scene(own)
    assert assembly.degrees_of_freedom == 1
    assert sum(assembly.surplus.values()) == 2
    told = " ".join(check_text(own, assembly).split())
    assert "how they share it is not" in told
    with pytest.raises(SceneError, match="what others hold already"):
        assemble_scene(scene(planetary(3), "solver.formulation=redundant"))


@BOTH
@pytest.mark.parametrize(
    ("gear", "rate"),
    [
        ("type: gear, teeth: [20, 16]", 2.25),
        ("type: gear, teeth: [52, 16], internal: true", -2.25),
        ("type: belt, radii: [0.02, 0.016]", -0.25),
        ("type: belt, radii: [0.02, 0.02]", 0.0),
    ],
)
def test_a_gear_on_a_moving_arm_turns_relative_to_it(gear, rate, formulation):
    text = f"""
bodies: {{arm: {ARM}, wheel: {WHEEL}}}
joints:
  pivot: {{type: revolute, points: [ground, arm.hub], at: [0, 0]}}
  pin: {{type: revolute, points: [arm.p0, wheel.o]}}
  gear: {{joints: [pivot, pin], {gear}}}
drives: {{motor: {{type: speed, joint: pivot, value: 3}}}}
"""
    result = run(text + END, f"solver.formulation={formulation}")
    assert result.rates[:, 1, 2] == pytest.approx(3 * rate, abs=1e-9)
    assert result.poses[-1, 1, 2] == pytest.approx(0.3 * rate, abs=1e-9)


@BOTH
@pytest.mark.parametrize(
    ("joints", "way", "sign"),
    [("[shaft, way]", "[ground, rack.o]", 1), ("[way, shaft]", "[rack.o, ground]", -1)],
)
def test_a_rack_with_a_spring_swings(joints, way, sign, formulation):
    """As its pinion and it swing together; x counts the other way if the ground is second."""
    text = rack(SPRING, joints, way, f"[{sign}, 0]")
    result = run(text, f"solver.formulation={formulation}", "accuracy={tolerance: 1.0e-8}")
    rel = 1e-7 if formulation == "minimal" else 1e-3
    assert sign * result.poses[-1, 1, 0] == pytest.approx(0.181651772, rel=rel)
    assert sign * result.rates[-1, 1, 0] == pytest.approx(2.885346816, rel=rel)
    assert result.gear_forces["teeth"][-1] == pytest.approx(147.4007875, rel=rel)
    assert result.gear_forces["teeth"][0] == pytest.approx(66.66666667, rel=rel)
    assert result.joint_forces["way"][-1] == pytest.approx([0, 0], abs=1e-8)
    # The pinion stays: its pin bears the teeth.
    pin = sign * result.joint_forces["shaft"][-1, 0]
    assert pin == pytest.approx(147.4007875, rel=rel)


@BOTH
def test_a_rack_hangs_on_its_pinion(formulation):
    text = rack(axis="[0, -1]") + "gravity: 9.81"
    result = run(text, f"solver.formulation={formulation}")
    assert result.rates[-1, 1, 1] == pytest.approx(-0.436, rel=1e-6)
    assert result.gear_forces["teeth"] == pytest.approx(-8.175, rel=1e-6)
    assert result.joint_forces["shaft"][-1] == pytest.approx([0, 9.81 + 8.175], abs=1e-5)


def test_a_rack_on_a_moving_body_keeps_energy_and_momentum(tmp_path):
    """Of a cart on a rail that carries both; redundant coordinates refuse it by name."""
    text = rack(way="[cart.o, rack.o]").replace("at: [0, 0], axis", "axis").replace(
        "[ground, pinion.o], at: [0.04, 0]", "[cart.p, pinion.o]"
    ).replace("bodies:\n", "bodies:\n  cart: {type: rigid, mass: 4, inertia: 0.1, points: "
              "{o: [0, 0], p: [0.04, 0]}}\n").replace("joints:\n", "joints:\n  rail: {type: "
              "revolute, points: [ground, cart.o], at: [0, 0]}\n", 1)  # fmt: skip
    text += "drives: {motor: {type: torque, joint: shaft, value: '3*cos(20*t)'}}\n"
    result = run(text + "initial: {speeds: {cart: 5, pinion: 9}}")
    assert np.ptp(result.rates[:, 0, 2]) > 1  # it is not so steady that nothing is shown
    turned = result.poses[:, 1, 2] - result.poses[:, 0, 2]
    along = np.einsum(
        "ij,ij->i",
        result.poses[:, 2, :2],
        np.stack([np.cos(result.poses[:, 0, 2]), np.sin(result.poses[:, 0, 2])], 1),
    )
    assert along == pytest.approx(0.04 * turned, abs=1e-9)
    assert abs(result.energy.residual).max() < 1e-7 * result.energy.kinetic.max()
    save(result, tmp_path)
    assert load(tmp_path).gear_forces["teeth"] == pytest.approx(result.gear_forces["teeth"], abs=0)
    with pytest.raises(NotRepresentableError, match="no rack on a moving body"):
        simulate(scene(text, "solver.formulation=redundant"))


@BOTH
def test_coaxial_gears_have_a_torque_and_no_pitch_circle(formulation):
    text = f"""
bodies: {{fast: {WHEEL}, slow: {WHEEL}}}
joints:
  one: {{type: revolute, points: [ground, fast.o], at: [0, 0]}}
  two: {{type: revolute, points: [ground, slow.o], at: [0, 0]}}
  box: {{type: gear, joints: [one, two], ratio: 3, internal: true}}
drives: {{motor: {{type: torque, joint: one, value: 2}}}}
"""
    result = run(text + END, f"solver.formulation={formulation}", "run.duration=0.01")
    assert result.rates[-1, 0, 2] == pytest.approx(0.01 * 2 / (3.84e-5 * (1 + 1 / 9)), rel=1e-7)
    assert result.gear_torques["box"] == pytest.approx(-2 / 10, rel=1e-6)
    assert not result.gear_forces


@BOTH
@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("teeth", [(60, 20), (20, 60)])
def test_pins_bear_what_teeth_of_an_internal_gear_push(teeth, swapped, formulation):
    """Whichever is the ring: both turn one way, and their axes are 40 mm apart along x.

    Where they mesh, beyond the axis of the smaller one, teeth push along y.
    """
    first, second = teeth
    joints, counts = (["a", "b"], teeth) if not swapped else (["b", "a"], (second, first))
    text = f"""
bodies:
  one: {{type: rigid, mass: 1, inertia: 4.0e-3, points: {{o: [0, 0]}}}}
  two: {{type: rigid, mass: 1, inertia: 1.0e-3, points: {{o: [0, 0]}}}}
joints:
  a: {{type: revolute, points: [ground, one.o], at: [0, 0]}}
  b: {{type: revolute, points: [ground, two.o], at: [40 mm, 0]}}
  mesh: {{type: gear, joints: {joints}, teeth: {list(counts)}, internal: true}}
drives: {{motor: {{type: torque, joint: b, value: 2}}}}
"""
    result = run(text + END, f"solver.formulation={formulation}", "run.duration=0.01")
    ratio = second / first
    acceleration = 2 / (1e-3 + 4e-3 * ratio**2)
    assert result.rates[-1, :, 2] == pytest.approx(
        [0.01 * acceleration * ratio, 0.01 * acceleration], rel=1e-6
    )
    way = 1 if first > second else -1  # on which side of the first axis they mesh
    tooth = 4e-3 * acceleration * ratio / (1e-3 * first)
    assert abs(result.gear_forces["mesh"][-1]) == pytest.approx(tooth, rel=1e-6)
    assert result.joint_forces["a"][-1] == pytest.approx([0, -way * tooth], abs=1e-5)
    assert result.joint_forces["b"][-1] == pytest.approx([0, way * tooth], abs=1e-5)


PLAIN = (
    f"""
bodies: {{one: {WHEEL}, two: {WHEEL}, three: {WHEEL}}}
joints:
  a: {{type: revolute, points: [ground, one.o], at: [0, 0]}}
  b: {{type: revolute, points: [ground, two.o], at: [0.1, 0]}}
  c: {{type: revolute, points: [one.centre, three.o]}}
  d: {{type: prismatic, points: [ground, three.o], at: [0, 0], axis: [1, 0]}}
  mesh: {{type: gear, joints: [a, b], ratio: 2}}
  GEAR
"""
    + END
)


@pytest.mark.parametrize(
    ("gear", "key", "message"),
    [
        ("type: gear, joints: [b, a], ratio: 0.4", "x", "contradicts other gears"),
        ("type: gear, joints: [a, b], ratio: 2, internal: true", "x", "contradicts other gears"),
        ("type: gear, joints: [a, a], ratio: 2", "joints", "can't mesh with itself"),
        ("type: gear, joints: [b, c], ratio: 2", "joints", "no one body carries 'b' and 'c'"),
        ("type: gear, joints: [a, mesh], ratio: 2", "joints[1]", "is of type gear"),
        ("type: gear, joints: [a, d], ratio: 2", "ratio", "need a radius"),
        ("type: gear, joints: [a, b], radius: 2", "radius", "is for a rack"),
        ("type: gear, joints: [a, d], radius: 2, internal: true", "internal", "no inside"),
        ("type: belt, joints: [a, d], radii: [1, 1]", "joints", "two revolute joints"),
        ("type: gear, joints: [a, b], teeth: [20, 0]", "teeth[1]", "greater"),
        ("type: gear, joints: [a, b]", "x", "needs 'ratio'"),
    ],
)
def test_gears_that_cannot_be_meant_are_refused_at_their_line(gear, key, message):
    with pytest.raises(SceneError) as caught:
        scene(PLAIN.replace("GEAR", f"x: {{{gear}}}"))
    (mistake,) = caught.value.mistakes
    path = ".".join(str(part) for part in mistake.path[1:]).replace("joints.1", "joints[1]")
    assert path.replace("teeth.1", "teeth[1]").removeprefix("x.") == key
    assert message in mistake.message


def test_friction_by_a_force_that_lacks_that_of_teeth_is_refused():
    text = PLAIN.replace("at: [0.1, 0]", "at: [0.1, 0], friction: {coefficient: 1, radius: 1}")
    with pytest.raises(SceneError, match="lacks that of teeth"):
        scene(text.replace("GEAR", ""))


@pytest.mark.parametrize("joints", ["[pa, pb]", "[pb, pa]"])
@pytest.mark.parametrize("kind", ["gear", "belt"])
def test_the_force_of_teeth_is_that_on_the_first_wheel_counter_clockwise(kind, joints):
    """What it turns that wheel by is all that turns it, but for the motor of 1 N m on wheel a."""
    sizes = [0.1, 0.2] if joints == "[pa, pb]" else [0.2, 0.1]
    made = run(
        f"""
bodies:
  a: {{type: rigid, mass: 1, inertia: 1.0e-3, points: {{o: [0, 0]}}}}
  b: {{type: rigid, mass: 1, inertia: 4.0e-3, points: {{o: [0, 0]}}}}
joints:
  pa: {{type: revolute, points: [ground, a.o], at: [0, 0]}}
  pb: {{type: revolute, points: [ground, b.o], at: [0.3, 0]}}
  mesh: {{type: {kind}, joints: {joints}, {"teeth" if kind == "gear" else "radii"}: {
            [round(100 * size) for size in sizes] if kind == "gear" else sizes
        }}}
drives: {{motor: {{type: torque, joint: pa, value: 1}}}}
"""
        + END
    )
    first, inertia, motor = ("a", 1e-3, 1.0) if joints == "[pa, pb]" else ("b", 4e-3, 0.0)
    spin = made.rates[-1, made.part_names.index(first), 2] / made.time[-1]
    force = made.gear_forces["mesh"][-1]
    assert force * sizes[0] == pytest.approx(inertia * spin - motor, rel=1e-6)
