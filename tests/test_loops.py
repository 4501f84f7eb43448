"""Mechanisms with loops and welds, in minimal coordinates, against laws of their own."""

import re
from functools import cache

import numpy as np
import pytest
from benchmarks.others import CRANK, ROD, SPEED, START, motion
from cli_runs import MODELS
from results import scene_from
from scipy.integrate import solve_ivp

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import assemble_scene, load_scene
from exudyn_flexlink.mechanism.tree import tree_layout
from exudyn_flexlink.report import check_text
from exudyn_flexlink.source import SceneError


@cache
def run(model, *settings):
    result = simulate(load_scene(MODELS / model, settings))
    assert result.outcome.completed, result.outcome
    return result


def part(result, name):
    """Pose of a part (samples, 3)."""
    return result.poses[:, result.part_names.index(name)]


# --- published and closed forms -----------------------------------------------------------------


def test_n_four_bar_stays_a_row_of_squares_at_every_sample():
    """Where all rods lie in one line another shape branches off; no sample is on it."""
    result = run("benchmarks/n_four_bar.yaml", "run={duration: 10, sample: 1 ms}")
    rods = np.stack([part(result, name)[:, 2] for name in ("a0", "a1", "a2")])
    assert np.abs(rods - rods[0]).max() < 1e-9
    assert np.abs(part(result, "b1")[:, 2]).max() < 1e-9


def test_a_slider_crank_that_nothing_drives_keeps_its_tolerance():
    """Errors of its speed last to the end of the run, and count so."""
    start, keep = [START, SPEED], {"dense_output": True, "rtol": 1e-13, "atol": 1e-13}
    exact = solve_ivp(motion, (0, 1.5), start, "DOP853", **keep).sol
    for tolerance in (1e-3, 1e-5, 1e-8):
        asked = "run.duration=1.5", f"accuracy.tolerance={tolerance}"
        result = run("textbook/free_slider_crank.yaml", *asked)
        off = CRANK * np.abs(part(result, "crank")[:, 2] - exact(result.time)[0]).max()
        assert off < tolerance


def test_a_driven_slider_crank_follows_its_closed_form():
    result = run("textbook/slider_crank.yaml")
    a = 10 * result.time
    b = -np.arcsin(CRANK / ROD * np.sin(a))
    place = CRANK * np.cos(a) + ROD * np.cos(b)
    np.testing.assert_allclose(part(result, "slider")[:, 0], place, atol=1e-12)


def test_the_ram_of_a_quick_return_follows_its_closed_form():
    result = run("textbook/whitworth.yaml")
    a = 5 * result.time
    pin = np.stack([0.1 * np.cos(a), 0.2 + 0.1 * np.sin(a)])
    head = 0.5 * pin / np.hypot(*pin)
    ram = head[0] + np.sqrt(0.3**2 - (0.45 - head[1]) ** 2)
    np.testing.assert_allclose(part(result, "ram")[:, 0], ram, atol=1e-12)


# --- welds, redundant joints, and springs across hinges -----------------------------------------

BAR = (
    "{type: rigid, mass: 1, inertia: 0.1, centre_of_mass: [0.5, 0], points: {a: [0, 0], b: [1, 0]}}"
)


def scene(text):
    return scene_from(text)


@pytest.mark.parametrize(("formulation", "off"), [("minimal", 1e-9), ("redundant", 0.1)])
@pytest.mark.parametrize(("points", "way"), [("arm.end, ball.o", 1), ("ball.o, arm.end", -1)])
def test_a_weld_holds_what_turns_with_an_arm(formulation, off, points, way):
    """By weight and centripetal force, 100 N, on the body of its second point.

    The multipliers of the last, shorter step of a redundant run are off by 0.07 N.
    """
    turning = scene(f"""
title: a ball at the end of an arm
bodies:
  arm: {{type: rigid, mass: 1, inertia: 0.1, points: {{hub: [0, 0], end: [0.5, 0]}}}}
  ball: {{type: rigid, mass: 2, inertia: 0.1, points: {{o: [0, 0]}}}}
joints:
  hub: {{type: revolute, points: [ground, arm.hub], at: [0, 0]}}
  seam: {{type: weld, points: [{points}], angle: {way * 30} deg}}
drives: {{motor: {{type: speed, joint: hub, value: 10}}}}
initial: {{angles: {{arm: 0}}}}
gravity: [0, -9.81]
run: {{duration: 0.5, sample: 10 ms}}
solver: {{formulation: {formulation}}}
accuracy: {{tolerance: 1.0e-6}}
""")
    result = simulate(turning)
    a = 10 * result.time
    inward = -2 * 0.5 * 10**2 * np.stack([np.cos(a), np.sin(a)], axis=-1)
    expected = way * (inward + np.array([0, 2 * 9.81]))
    np.testing.assert_allclose(result.joint_forces["seam"], expected, rtol=0, atol=off)


def test_the_force_in_a_weld_of_a_loop_is_that_of_its_multipliers():
    """The bar of a Scotch yoke, against Exudyn in redundant coordinates."""
    model, short = "textbook/scotch_yoke.yaml", "run={duration: 0.1, sample: 1 ms}"
    minimal, redundant = (
        run(model, short, f"solver.formulation={one}") for one in ("minimal", "redundant")
    )
    found = minimal.joint_forces["yoke"]
    other = np.stack(
        [np.interp(minimal.time, redundant.time, own) for own in redundant.joint_forces["yoke"].T],
        axis=-1,
    )
    largest = np.abs(found).max()
    assert largest > 5  # N
    # Multipliers of the first steps, and of the last, shorter one, are off by more than others.
    assert np.abs(found - other)[5:].max() < 5e-3 * largest
    assert np.median(np.abs(found - other)) < 1e-4 * largest


def test_a_clamp_carries_the_weight_of_what_stands_on_it():
    result = run("textbook/toggle_press.yaml", "run.duration=0.1")
    weight = np.tile([0, 5 * 9.81], (len(result.time), 1))
    np.testing.assert_allclose(result.joint_forces["bed"], weight, atol=1e-9)


PARALLELOGRAM = """
title: parallelogram
bodies:
  left: &bar
    {type: rigid, mass: 1, inertia: 0.1, centre_of_mass: [0.5, 0], points: {a: [0, 0], b: [1, 0]}}
  right: *bar
  top:
    type: rigid
    mass: 1
    inertia: 0.1
    centre_of_mass: [1, 0]
    points: {a: [0, 0], b: [1, 0], c: [2, 0]}
  MIDDLE
joints:
  a: {type: revolute, points: [ground, left.a], at: [0, 0]}
  b: {type: revolute, points: [ground, right.a], at: [2, 0]}
  c: {type: revolute, points: [left.b, top.a]}
  d: {type: revolute, points: [right.b, top.c]}
  JOINTS
gravity: [0, -9.81]
initial: {angles: {left: 60 deg, right: 60 deg, top: 0 GUESS}}
run: {duration: 1, sample: 10 ms}
accuracy: {tolerance: 1.0e-8}
"""


def test_a_third_rod_in_a_parallelogram_is_redundant_and_runs():
    """Without mass of its own worth mentioning it changes nothing: one constraint is too many."""
    plain = simulate(scene(
        PARALLELOGRAM.replace("MIDDLE", "").replace("JOINTS", "").replace(" GUESS", "")
    ))  # fmt: skip
    third = "third: {type: rigid, mass: 1.0e-9, inertia: 1.0e-10, points: {a: [0, 0], b: [1, 0]}}"
    joints = "e: {type: revolute, points: [ground, third.a], at: [1, 0]}\n"
    joints += "  f: {type: revolute, points: [third.b, top.b]}"
    text = PARALLELOGRAM.replace("MIDDLE", third).replace("JOINTS", joints)
    doubled = scene(text.replace(" GUESS", ", third: 60 deg"))
    held = assemble_scene(doubled)
    assert sum(held.surplus.values()) == 1
    assert re.search(r"held twice\s+\w+: other joints hold the same", check_text(doubled, held))
    result = simulate(doubled)
    np.testing.assert_allclose(part(result, "left")[:, 2], part(plain, "left")[:, 2], atol=1e-7)


def test_the_force_in_the_joint_that_closes_a_loop_is_newtons():
    """The right rod of a parallelogram: forces at its ends are its mass times its acceleration."""
    text = PARALLELOGRAM.replace("MIDDLE", "").replace("JOINTS", "").replace(" GUESS", "")
    result = simulate(scene(text.replace("sample: 10 ms", "sample: 1 ms")))
    assert tree_layout(assemble_scene(result.scene).mechanism).closures
    pose = part(result, "right")
    centre = pose[:, :2] + 0.5 * np.stack([np.cos(pose[:, 2]), np.sin(pose[:, 2])], axis=-1)
    grid = np.isclose(result.time % 1e-3, 0, atol=1e-9) | np.isclose(result.time % 1e-3, 1e-3)
    place = centre[grid]
    step = 1e-3
    weights = np.array([-1, 16, -30, 16, -1]) / (12 * step**2)
    bend = sum(w * place[k : len(place) - 4 + k] for k, w in enumerate(weights))
    forces = (result.joint_forces["b"] - result.joint_forces["d"])[grid][2:-2]
    np.testing.assert_allclose(forces, bend + np.array([0, 9.81]), atol=1e-4)


SPRUNG = """
title: two bars with a spring from the second to the ground
bodies: {{one: {bar}, two: {bar}}}
joints:
  a: {{type: revolute, points: [ground, one.a], at: [0, 0]}}
  b: {{type: revolute, points: [one.b, two.a]}}
  c: {{type: revolute, points: [ground, two.b], at: [1.2, 0]}}
springs: {{k: {{type: torsional, joint: {joint}, stiffness: 20, damping: 0.1, rest_angle: 0.3}}}}
gravity: [0, -9.81]
initial: {{guesses: {{one: 60 deg, two: -60 deg}}}}
run: {{duration: 0.5, sample: 10 ms}}
"""


@pytest.mark.parametrize("joint", ["a", "b", "c"])
def test_a_spring_acts_on_any_hinge_of_a_loop(joint):
    """Also on the one that the tree leaves over: energy is kept, and Exudyn's own solver agrees."""
    text = SPRUNG.format(bar=BAR, joint=joint)
    held = "drives: {m: {type: torque, joint: " + joint + ", value: 0.0}}\n"
    tree = simulate(scene(text + held + "accuracy: {tolerance: 1.0e-9}\n"))
    other = simulate(scene(text + "accuracy: {step: 1.0e-4}\nsolver: {formulation: redundant}\n"))
    assert tree.outcome.completed
    np.testing.assert_allclose(
        np.interp(other.time, tree.time, part(tree, "one")[:, 2]), part(other, "one")[:, 2],
        atol=1e-4,
    )  # fmt: skip
    assert tree.checks.energy_residual < 1e-8


def test_a_loop_that_can_go_no_further_says_so():
    """A driven crank that coupler and rocker can't follow stops where those two lie in line."""
    text = """
title: a double rocker
bodies:
  crank: {type: rigid, mass: 1, inertia: 0.1, points: {a: [0, 0], b: [1, 0]}}
  coupler: {type: rigid, mass: 1, inertia: 0.1, points: {a: [0, 0], b: [0.6, 0]}}
  rocker: {type: rigid, mass: 1, inertia: 0.1, points: {a: [0, 0], b: [0.9, 0]}}
joints:
  a: {type: revolute, points: [ground, crank.a], at: [0, 0]}
  b: {type: revolute, points: [crank.b, coupler.a]}
  c: {type: revolute, points: [coupler.b, rocker.b]}
  d: {type: revolute, points: [ground, rocker.a], at: [1, 0]}
drives: {m: {type: speed, joint: a, value: 1 rad/s}}
initial: {angles: {crank: 60 deg}, guesses: {coupler: 0, rocker: 60 deg}}
run: {duration: 5, sample: 10 ms}
accuracy: {tolerance: 1.0e-6}
"""
    result = simulate(scene(text))
    # Coupler and rocker in line: 1.5^2 = 1 + 1 - 2 cos(a) at the crank's angle a.
    turned = np.arccos(1 - 1.5**2 / 2) - np.pi / 3
    assert not result.outcome.completed
    assert result.outcome.time == pytest.approx(turned, abs=1e-3)
    assert "dead centre" in result.outcome.reason or "stay closed" in result.outcome.reason
    assert result.time[-1] == pytest.approx(result.outcome.time)


TURNING_BACK = """
title: a slider that is driven nearly to the crank's dead centre, and back
materials: {steel: {density: 7850, youngs_modulus: 200 GPa}}
bodies:
  crank: {type: rod, length: 0.1, material: steel, section: {width: 10 mm, thickness: 10 mm}}
  rod: {type: rod, length: 0.3, material: steel, section: {width: 10 mm, thickness: 10 mm}}
  slider: {type: rigid, mass: 1, inertia: 1.0e-3, points: {pin: [0, 0]}}
joints:
  main: {type: revolute, points: [ground, crank.start], at: [0, 0]}
  knee: {type: revolute, points: [crank.end, rod.start]}
  wrist: {type: revolute, points: [rod.end, slider.pin]}
  way: {type: prismatic, points: [ground, slider.pin], at: [0, 0], axis: [1, 0]}
drives: {motion: {type: motion, joint: way, value: "0.3 + WIDE*cos(t)"}}
initial: {guesses: {crank: 3 deg, rod: -1 deg}}
run: {duration: 12}
accuracy: {tolerance: TOLERANCE}
"""


@pytest.mark.parametrize(
    ("wide", "tolerance"), [(0.09, "1.0e-9"), (0.0999, "1.0e-6"), (0.09999, "1.0e-9")]
)
def test_a_crank_that_turns_back_before_its_dead_centre_passed_none(wide, tolerance):
    """It comes within 3 deg of it, or 1: the law of cosines, always on one side, and no warning."""
    text = TURNING_BACK.replace("WIDE", str(wide)).replace("TOLERANCE", tolerance)
    result = simulate(scene_from(text))
    x = 0.3 + wide * np.cos(result.time)
    cosine = (CRANK**2 + x**2 - ROD**2) / (2 * CRANK * x)
    right = np.stack([CRANK * cosine, CRANK * np.sqrt(1 - cosine**2)], axis=1)
    assert np.abs(part(result, "rod")[:, :2] - right).max() < float(tolerance)
    assert result.warnings == ()


def test_a_crank_that_passes_its_dead_centre_says_so():
    """The way is as long as crank and rod allow, but for a rounding: the crank goes round."""
    text = TURNING_BACK.replace("WIDE", "0.1").replace("TOLERANCE", "1.0e-6")
    started = text.replace("cos(t)", "cos(t + 0.5)").replace("crank: 3 deg", "crank: 40 deg")
    result = simulate(scene_from(started))
    assert any("passed a dead centre" in line for line in result.warnings)


def test_a_loop_that_starts_at_its_dead_centre_is_refused_with_advice():
    text = TURNING_BACK.replace("WIDE", "0.1").replace("TOLERANCE", "1.0e-6")
    scene = scene_from(text.replace("crank: 3 deg", "crank: 1 deg"))
    with pytest.raises(SceneError, match="start at another angle"):
        simulate(scene)


def test_a_motor_may_turn_the_joint_that_closes_a_loop():
    """The same four-bar driven at one end of the chain or at the other moves the same."""
    text = PARALLELOGRAM.replace("MIDDLE", "").replace("JOINTS", "").replace(" GUESS", "")
    runs = [
        simulate(scene(text + f"drives: {{m: {{type: speed, joint: {joint}, value: 1}}}}\n"))
        for joint in ("a", "b")
    ]
    np.testing.assert_allclose(runs[0].poses, runs[1].poses, atol=1e-9)
    power = [result.energy.supplied[-1] for result in runs]
    assert power[0] == pytest.approx(power[1], rel=1e-9)


# --- samples where two ways of closing a loop meet ------------------------------------------------


WHEELS = """
title: two wheels coupled by a rod, as those of a locomotive
bodies:
  left: &wheel
    {{type: rigid, mass: 1, inertia: 0.1, centre_of_mass: [0.5, 0],
      points: {{a: [0, 0], b: [1, 0]}}}}
  right: *wheel
  rod:
    {{type: rigid, mass: 1, inertia: 0.1, centre_of_mass: [1, 0], points: {{a: [0, 0], c: [2, 0]}}}}
joints:
  a: {{type: revolute, points: [ground, left.a], at: [0, 0]}}
  b: {{type: revolute, points: [ground, right.a], at: [2, 0]}}
  c: {{type: revolute, points: [left.b, rod.a]}}
  d: {{type: revolute, points: [right.b, rod.c]}}
initial: {{angles: {{left: {angle} deg, right: {angle} deg, rod: 0}}{speeds}}}
{drives}
run: {{duration: 1, sample: 0.5 ms}}
accuracy: {{tolerance: 1.0e-6}}
"""
DRIVEN = "drives: {m: {type: speed, joint: a, value: 60 rpm}}"


@pytest.mark.parametrize(
    ("angle", "drives", "speeds"),
    [(90, DRIVEN, ""), (45, DRIVEN, ""), (90, "", ", speeds: {left: 60 rpm}"), (0.5, DRIVEN, "")],
)
def test_coupled_wheels_feel_the_force_of_circling_masses(angle, drives, speeds):
    """Also where samples fall on a dead centre, at which nothing follows from the loop.

    Half of the rod's mass is carried by each wheel, whose own is half as far out. With 0.5 deg the
    run ends so near to a dead centre that a step which may end elsewhere would not end there, and
    a sample is 0.04 deg from one: there rounding of angles is up to 4e-3 of a force.
    """
    result = simulate(scene_from(WHEELS.format(angle=angle, drives=drives, speeds=speeds)))
    assert result.outcome.completed, result.outcome
    towards = (2 * np.pi) ** 2  # N: 1 kg at 1 m
    for joint, share in (("a", 1.0), ("b", 1.0), ("c", 0.5), ("d", 0.5)):
        size = np.hypot(*result.joint_forces[joint].T)
        assert size == pytest.approx(share * towards, rel=6e-3)
    assert result.checks.energy_residual < 1e-6 * result.checks.largest_kinetic_energy
    assert np.all(np.diff(result.time) > 0)
