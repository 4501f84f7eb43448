"""Bodies that nothing holds, point masses, weight, and where bodies stand at time 0."""

import re
from math import cos, pi, sin

import numpy as np
import pytest
from physics_tools import STEEL, angle, run, scene, total_energy, where

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import assemble_scene, other_ways, scene_of
from exudyn_flexlink.mechanism import anchor_position, equilibrium
from exudyn_flexlink.mechanism.joints import Anchor
from exudyn_flexlink.report import check_text
from exudyn_flexlink.source import SceneError, parse_document

G = 9.81
TOLERANCES = [1e-3, 1e-8]
END = "run: {duration: 1}\naccuracy: {tolerance: 1.0e-6}\n"


def assembled(text):
    found = scene_of(parse_document("title: test\n" + text + END, "test"))
    return found, assemble_scene(found)


# --- free bodies ----------------------------------------------------------------------------

THROWN = """
bodies:
  plate:
    {type: rigid, mass: 2, inertia: 0.03, points: {corner: [0.3, 0.1]}, centre_of_mass: [0.1, 0]}
gravity: 9.81 m/s^2
initial:
  positions: {plate: [0.5, 1]}
  angles: {plate: 30 deg}
  speeds: {plate: 4 rad/s}
  velocities: {plate: [1, 2]}
run: {duration: 2}
"""


@pytest.mark.parametrize(
    ("formulation", "tolerance"),
    [*(("minimal", tolerance) for tolerance in TOLERANCES), ("redundant", 1e-5)],
)
def test_a_thrown_plate_turns_evenly_and_its_centre_flies_a_parabola(formulation, tolerance):
    method = f"solver: {{formulation: {formulation}}}\n"
    found = run(THROWN + method + f"accuracy: {{tolerance: {tolerance}}}\n")
    t = found.time
    turned = pi / 6 + 4 * t
    arm = 0.1 * np.array([cos(pi / 6), sin(pi / 6)])
    start = np.array([0.5, 1]) + arm
    speed = np.array([1, 2]) + 4 * np.array([-arm[1], arm[0]])
    centre = start + np.outer(t, speed) + np.outer(t**2, [0, -G / 2])
    corner = centre + np.column_stack(
        [0.2 * np.cos(turned) - 0.1 * np.sin(turned), 0.2 * np.sin(turned) + 0.1 * np.cos(turned)]
    )
    allowed = tolerance if formulation == "minimal" else 10 * tolerance  # an aim there
    np.testing.assert_allclose(where(found, "plate.centre"), centre, atol=allowed)
    np.testing.assert_allclose(where(found, "plate.corner"), corner, atol=allowed)
    energy = total_energy(found)
    assert abs(energy - energy[0]).max() < 100 * max(tolerance, 1e-9)


# --- point masses ---------------------------------------------------------------------------


@pytest.mark.parametrize("inertia", ["0", "1.0e-12"])
def test_a_point_mass_on_a_string_without_mass_is_the_simple_pendulum(inertia):
    """IFToMM A01; after one elliptic period from the horizontal it is back."""
    period = 4 * (1 / G) ** 0.5 * 1.8540746773013719
    found = run(f"""
bodies:
  bob: {{type: rigid, mass: 1, inertia: {inertia}, points: {{hook: [-1, 0]}}}}
joints: {{pivot: {{type: revolute, points: [ground, bob.hook], at: [0, 0]}}}}
gravity: 9.81
run: {{duration: {period}}}
accuracy: {{tolerance: 1.0e-8}}
""")
    np.testing.assert_allclose(where(found, "bob.centre")[-1], [1, 0], atol=1e-8)


def test_a_point_mass_welded_to_a_rod_adds_no_inertia_of_its_own():
    """Torsional pendulum about a hinge: T = 2 pi sqrt((m l^2/3 + M l^2)/k)."""
    stiffness, length, mass = 10.0, 0.2, 3.0
    text = (
        STEEL
        + f"""
bodies:
  arm: {{type: rod, length: {length}, material: steel, section: {{width: 10 mm, thickness: 2 mm}}}}
  bob: {{type: rigid, mass: {mass}, inertia: 0}}
joints:
  pivot: {{type: revolute, points: [ground, arm.start], at: [0, 0]}}
  glue: {{type: weld, points: [arm.end, bob.centre]}}
springs: {{coil: {{type: torsional, joint: pivot, stiffness: {stiffness}, rest_angle: 0}}}}
initial: {{angles: {{arm: 0.3}}}}
accuracy: {{tolerance: 1.0e-8}}
"""
    )
    rod = 7850 * 0.01 * 0.002 * length
    inertia = (rod / 3 + mass) * length**2
    period = 2 * pi * (inertia / stiffness) ** 0.5
    found = run(text + f"run: {{duration: {2 * period}}}\n")
    expected = 0.3 * np.cos(2 * pi * found.time / period)
    np.testing.assert_allclose(angle(found, "arm"), expected, atol=1e-7)


def test_a_curve_that_a_point_mass_carries_gives_it_no_inertia():
    """What presses on the curve turns it: an inertia that no one gave must not resist."""
    carrier = """
bodies: {cam: {type: rigid, mass: 1, inertia: 0}, pin: {type: rigid, mass: 1, inertia: 0}}
curves: {groove: {type: line, from: [0, 0.2], to: [1, 0.2], on: cam}}
joints: {rides: {type: slot, point: pin.centre, curve: groove}}
initial: {positions: {cam: [0, 0], pin: [0.5, 0.2]}}
"""
    cam, pin = assembled(carrier)[1].mechanism.parts
    assert cam.inertia < 1e-9 * cam.mass * cam.reach**2
    assert pin.inertia == pytest.approx(pin.mass * pin.reach**2)  # nothing turns it


@pytest.mark.parametrize("speed", ["10", "0"])
def test_a_point_mass_has_no_angular_speed(speed):
    text = f"""bodies: {{bead: {{type: rigid, mass: 1, inertia: 0}}}}
initial: {{speeds: {{bead: {speed}}}, velocities: {{bead: [2, 0]}}}}
run: {{duration: 1}}
accuracy: {{tolerance: 1.0e-6}}
"""
    if float(speed):
        with pytest.raises(SceneError, match=r"initial\.speeds\.bead: .bead. is a point mass"):
            run(text)
    else:
        assert run(text).energy.kinetic == pytest.approx(2.0)  # m v^2/2


# --- links that stretch ---------------------------------------------------------------------

STRETCHES = (
    STEEL
    + """
bodies:
  link: {type: flexible, length: 1, material: steel, section: {width: 10 mm, thickness: 2 mm},
         rods: 3, stretch: true, hinges: {stiffness: beam}}
joints:
  one: {type: revolute, points: [ground, link.start], at: [0, 0]}
  other: {type: revolute, points: [ground, link.end], at: [FAR, 0]}
"""
)


def test_a_link_does_not_stretch_to_reach_its_joints_at_the_start():
    """Its rods are stiff: a link that is too short is a mistake of the model, not a start."""
    with pytest.raises(
        SceneError, match=r"joints\.other: the joint can't close .*: 0\.2 m missing"
    ):
        assembled(STRETCHES.replace("FAR", "1.2"))


def test_a_link_that_is_too_long_starts_bent_but_not_shortened():
    _, found = assembled(STRETCHES.replace("FAR", "0.9"))
    ends = np.vstack([found.state.q[:, :2], [0.9, 0]])
    halves = np.hypot(*np.diff(ends, axis=0).T)
    np.testing.assert_allclose(halves, 1 / 6, atol=1e-9)


# --- weight ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "vector"),
    [("9.81", (0, -9.81)), ("981 cm/s^2", (0, -9.81)), ("[1, 2]", (1, 2)), ("-2", (0, 2))],
)
def test_gravity_is_a_value_downwards_or_a_vector(given, vector):
    text = "bodies: {b: {type: rigid, mass: 1, inertia: 1}}\n" + END
    found = scene(text + f"gravity: {given}\n")
    assert found.gravity == pytest.approx(vector)
    assert scene_of(parse_document(str(found.to_data()), "again")) == found


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("[1]", "gravity: expected [x, y], got a list of 1"),
        ("down", "gravity: expected an acceleration"),
        ("9.81 m/s", "gravity: expected an acceleration"),
        ("{x: 1}", "gravity: expected [x, y], got a mapping"),
    ],
)
def test_what_is_no_gravity_is_refused(given, message):
    with pytest.raises(SceneError, match=re.escape(message)):
        scene("bodies: {b: {type: rigid, mass: 1, inertia: 1}}\n" + END + f"gravity: {given}\n")


# --- where bodies stand ---------------------------------------------------------------------

FOUR_BAR = """
bodies:
  crank: {type: rigid, mass: 1, inertia: 0.1, points: {a: [0, 0], b: [0.5, 0]}}
  coupler: {type: rigid, mass: 1, inertia: 0.1, points: {a: [0, 0], b: [1.2, 0]}}
  rocker: {type: rigid, mass: 1, inertia: 0.1, points: {a: [0, 0], b: [1, 0]}}
joints:
  o: {type: revolute, points: [ground, crank.a], at: [0, 0]}
  p: {type: revolute, points: [crank.b, coupler.a]}
  q: {type: revolute, points: [coupler.b, rocker.b]}
  r: {type: revolute, points: [ground, rocker.a], at: [1, 0]}
"""


@pytest.mark.parametrize("rocker", [70, 100, 130])
def test_a_four_bar_closes_from_the_angle_of_its_rocker(rocker):
    _, found = assembled(FOUR_BAR + f"initial: {{angles: {{rocker: {rocker} deg}}}}\n")
    end = anchor_position(Anchor(1, 1.2, 0), found.state.q)
    turned = np.deg2rad(rocker)
    np.testing.assert_allclose(end, [1 + cos(turned), sin(turned)], atol=1e-9)


def test_other_ways_to_close_are_told_and_a_guess_picks_one(monkeypatch):
    monkeypatch.setattr(equilibrium, "STARTS", 8)  # searches of 24
    text = FOUR_BAR + "initial: {angles: {crank: 60 deg}}\n"
    found, assembly = assembled(text)
    (way,) = other_ways(found, assembly)
    assert way["crank"] == pytest.approx(pi / 3)
    guesses = f"{{rocker: {way['rocker']}, coupler: {way['coupler']}}}"
    guesses = f"initial: {{angles: {{crank: 60 deg}}, guesses: {guesses}}}\n"
    other, there = assembled(FOUR_BAR + guesses)
    assert there.state.q[2, 2] == pytest.approx(way["rocker"], abs=1e-6)
    (back,) = other_ways(other, there)
    turned = (back["rocker"] - assembly.state.q[2, 2]) / (2 * pi)
    assert turned == pytest.approx(round(turned), abs=1e-6)
    assert "The joints close in other ways, too" in check_text(found, assembly)


def test_two_ways_of_a_four_bar_are_mirrored_at_the_diagonal():
    found, assembly = assembled(FOUR_BAR + "initial: {angles: {crank: 60 deg}}\n")
    (way,) = other_ways(found, assembly)
    tip = 0.5 * np.exp(1j * pi / 3)
    diagonal = np.angle(tip - 1)
    mirrored = 2 * diagonal - assembly.state.q[2, 2]
    assert np.exp(1j * way["rocker"]) == pytest.approx(np.exp(1j * mirrored), abs=1e-9)


def test_a_position_is_held_while_the_joints_close():
    """A rod between a ring and a place of its start."""
    _, found = assembled("""
bodies: {bar: {type: rigid, mass: 1, inertia: 0.1, points: {tip: [0.3, 0]}}}
curves: {ring: {type: circle, centre: [0, 0], radius: 0.2}}
joints: {pin: {type: slot, point: bar.tip, curve: ring}}
initial: {positions: {bar: [0.4, 0.1]}, guesses: {bar: 150 deg}}
""")
    np.testing.assert_allclose(found.state.q[0, :2], [0.4, 0.1], atol=1e-12)
    tip = anchor_position(Anchor(0, 0.3, 0), found.state.q)
    assert np.hypot(*tip) == pytest.approx(0.2, abs=1e-10)


def test_a_position_that_joints_do_not_allow_is_refused():
    with pytest.raises(SceneError, match=r"initial\.positions\.bob: the joints do not allow"):
        assembled("""
bodies: {bob: {type: rigid, mass: 1, inertia: 0, points: {hook: [-1, 0]}}}
joints: {pivot: {type: revolute, points: [ground, bob.hook], at: [0, 0]}}
initial: {positions: {bob: [3, 0]}}
""")


def test_a_point_deep_behind_its_face_is_refused_by_name():
    """Ever so deep, up to the length of the face: its contact would be dead from the start."""
    text = KILOGRAM_PLATE.format(y=-0.3)
    with pytest.raises(SceneError, match=r"contacts\.hit: starts with a penetration of 0\.3 m"):
        assembled(text)
    assembled(KILOGRAM_PLATE.format(y=0.3))


def test_what_should_rest_but_was_typed_with_few_digits_is_told_to_start_above():
    with pytest.raises(SceneError, match="may start that much above"):
        assembled(KILOGRAM_PLATE.format(y=-1e-8))


def test_a_point_farther_behind_its_face_than_that_is_long_is_told_to_check_and_run():
    """It flies 1.2 m behind a face of 1 m: its contact lets it pass, which no one may overlook."""
    found, assembly = assembled(KILOGRAM_PLATE.format(y=-1.2))
    told = "'hit' starts 1.2 m behind its line, which is 1 m long: it does not act"
    assert told in " ".join(check_text(found, assembly).split())
    (warning,) = simulate(found).warnings
    assert warning.startswith(told)
    found, assembly = assembled(KILOGRAM_PLATE.format(y=1.2))
    assert "does not act" not in check_text(found, assembly)
    assert simulate(found).warnings == ()


def test_a_point_that_comes_round_its_face_is_told_by_check_alone():
    """A spring swings it round the middle, past an end of the face: the contact acts from there."""
    spring = """
springs: {s: {type: linear, points: [ground, ball.centre], at: [0, 0], stiffness: 40, length: 0}}
"""
    text = KILOGRAM_PLATE.format(y=-1.2).replace("-1.2]}}", "-1.2]}, velocities: {ball: [5, 0]}}")
    found, assembly = assembled(text + spring)
    assert "does not act" in check_text(found, assembly)
    assert simulate(found).warnings == ()


KILOGRAM_PLATE = """
bodies:
  plate: {{type: rigid, mass: 1, inertia: 0.1, points: {{a: [-0.5, 0], b: [0.5, 0]}}}}
  ball: {{type: rigid, mass: 1, inertia: 0}}
joints: {{held: {{type: weld, points: [ground, plate.centre], at: [0, 0]}}}}
contacts:
  hit: {{type: point_on_line, point: ball.centre, line: [plate.a, plate.b],
        law: {{stiffness: 1.0e4, restitution: 1}}}}
initial: {{positions: {{ball: [0, {y}]}}}}
"""
