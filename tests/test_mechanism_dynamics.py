"""Masses, forces and accelerations against closed forms and conservation laws."""

from math import cos, sin

import numpy as np
import pytest

from exudyn_flexlink.loading import assemble_scene, scene_of
from exudyn_flexlink.mechanism import (
    EnergyMeter,
    contact_mass,
    swings,
)
from exudyn_flexlink.mechanism.dynamics import applied_forces, mass_blocks
from exudyn_flexlink.source import parse_document

GRAVITY = 9.81
ROD = "material: steel, section: {width: 10 mm, thickness: 2 mm}"
LENGTH = 0.2
MASS = 7850 * 0.01 * 0.002 * LENGTH
END = "run: {duration: 1}\naccuracy: {tolerance: 1.0e-5}\n"
STEEL = "title: test\nmaterials:\n  steel: {density: 7850, youngs_modulus: 200 GPa}\n"


def assembled(text):
    return assemble_scene(scene_of(parse_document(STEEL + text + END, "test")))


def rods(*names):
    lines = (f"  {name}: {{type: rod, length: {LENGTH}, {ROD}}}\n" for name in names)
    return "bodies:\n" + "".join(lines)


OFFSET = """bodies:
  body: {type: rigid, mass: 2, inertia: 0.03, points: {hole: [0.1, 0.05], nose: [-0.1, 0.3]},
         centre_of_mass: [-0.02, 0.04]}
joints:
  pin: {type: revolute, points: [body.hole, ground], at: [1, 2]}
"""
DOUBLE = """joints:
  a: {type: revolute, points: [ground, one.start], at: [0, 0]}
  b: {type: revolute, points: [one.end, two.start]}
gravity: [0, -9.81]
"""


@pytest.mark.parametrize(("angle", "speed"), [(0.0, 0.0), (0.7, 3.0), (-2.0, -5.0)])
def test_a_pendulum_whose_origin_is_neither_its_centre_nor_its_pivot(angle, speed):
    found = assembled(
        OFFSET
        + "gravity: [1.5, -9.81]\n"
        + f"initial: {{angles: {{body: {angle}}}, speeds: {{body: {speed}}}}}\n"
    )
    arm = np.array([-0.12, -0.01])  # from hole to centre of mass, in the body
    c, s = cos(angle), sin(angle)
    x, y = c * arm[0] - s * arm[1], s * arm[0] + c * arm[1]
    inertia = 0.03 + 2 * (arm @ arm)
    expected = 2 * (x * -GRAVITY - y * 1.5) / inertia
    assert found.state.a[0, 2] == pytest.approx(expected, rel=1e-8)
    # The origin turns about the hole: centripetal and tangential acceleration.
    back = np.array([c * -0.1 - s * -0.05, s * -0.1 + c * -0.05])
    turned = expected * np.array([-back[1], back[0]]) - speed**2 * back
    assert found.state.a[0, :2] == pytest.approx(turned, rel=1e-7, abs=1e-7)


def test_a_double_pendulum():
    first, second, omega, spin = -1.0, 0.4, 2.0, -3.0
    found = assembled(
        rods("one", "two")
        + DOUBLE
        + f"initial:\n  angles: {{one: {first}, two: {second}}}\n"
        + f"  speeds: {{one: {omega}, two: {spin}}}\n"
    )
    # Two uniform rods, angles from +x: m l^2 [4/3, cos/2; cos/2, 1/3] a = right, from Lagrange.
    c, s = cos(first - second) / 2, sin(first - second) / 2
    matrix = np.array([[4 / 3, c], [c, 1 / 3]])
    weight = GRAVITY / LENGTH
    right = np.array(
        [
            -s * spin**2 - 1.5 * weight * cos(first),
            s * omega**2 - 0.5 * weight * cos(second),
        ]
    )
    assert found.state.a[:, 2] == pytest.approx(np.linalg.solve(matrix, right), rel=1e-8)


@pytest.mark.parametrize("seed", range(4))
def test_the_mass_of_a_part_is_that_of_the_kinetic_energy(seed):
    mechanism = assembled(OFFSET).mechanism
    random = np.random.default_rng(seed)
    q, v = random.uniform(-2, 2, (1, 3)), random.uniform(-2, 2, (1, 3))
    energy = EnergyMeter(mechanism).kinetic(q, v)
    assert energy == pytest.approx(0.5 * v[0] @ mass_blocks(mechanism, q)[0] @ v[0])
    # And both that of the centre of mass: m |v_C|^2 / 2 + J w^2 / 2.
    c, s = cos(q[0, 2]), sin(q[0, 2])
    x, y = c * -0.02 - s * 0.04, s * -0.02 + c * 0.04
    centre = v[0, :2] + v[0, 2] * np.array([-y, x])
    assert energy == pytest.approx(centre @ centre + 0.015 * v[0, 2] ** 2)


def test_forces_are_the_slope_of_the_potential():
    springs = """springs:
  one: {type: torsional, joint: a, stiffness: 3, rest_angle: 0.2}
  two: {type: torsional, joint: b, stiffness: 2, rest_angle: -0.1}
"""
    mechanism = assembled(rods("one", "two") + DOUBLE + springs).mechanism
    meter = EnergyMeter(mechanism)
    q = np.random.default_rng(1).uniform(-1, 1, (2, 3))
    forces = applied_forces(mechanism, q, np.zeros((2, 3)), 0.0)
    for i in range(6):
        step = np.zeros(6)
        step[i] = 1e-6
        ahead, behind = (meter.potential(q + sign * step.reshape(2, 3)) for sign in (1, -1))
        assert forces[i] == pytest.approx(-(ahead - behind) / 2e-6, abs=1e-7)


def contact(bodies, joints):
    text = (
        bodies
        + "  wall: {type: rigid, mass: 1, inertia: 1, points: {a: [0, 0], b: [0, 1]}}\n"
        + "joints:\n  held: {type: weld, points: [ground, wall.a], at: [5, 0]}\n"
        + joints
        + "contacts:\n  strike:\n    type: point_on_line\n    point: rod.end\n"
        + "    line: [wall.a, wall.b]\n    law: {stiffness: 1.0e4, restitution: 0.5}\n"
    )
    found = assembled(text)
    state = found.state
    return contact_mass(found.mechanism, found.mechanism.contacts[0], state.q, state.places)


def test_contact_mass_of_a_pivoted_rod_is_its_inertia_over_the_length_squared():
    pivot = "  pin: {type: revolute, points: [ground, rod.start], at: [1, 2]}\n"
    assert contact(rods("rod"), pivot) == pytest.approx(MASS / 3, rel=1e-9)


def test_contact_mass_of_a_free_rod_is_a_quarter_of_its_mass():
    # A rod that a second, hinged one of next to no mass leads is as good as free.
    thin = "  thread: {type: rigid, mass: 1.0e-12, inertia: 1.0e-16, points: {b: [0.2, 0]}}\n"
    loose = """  far: {type: slot, point: thread.centre, curve: rail}
  b: {type: revolute, points: [thread.b, rod.start]}
"""
    rail = "curves:\n  rail: {type: line, from: [-1, 0], to: [1, 0]}\n"
    assert contact(rail + rods("rod") + thin, loose) == pytest.approx(MASS / 4, rel=1e-3)


def test_a_struck_lever_swings_with_what_is_welded_to_it():
    """By its time errors of its speed become those of its place: a heavy head makes it longer."""
    found = assembled(
        rods("lever", "striker")
        + "  head: {type: rigid, mass: 0.3, inertia: 2.0e-4}\n"
        + "joints:\n"
        + "  pivot: {type: revolute, points: [ground, lever.start], at: [0, 0]}\n"
        + "  tip: {type: weld, points: [lever.end, head.centre]}\n"
        + "  hub: {type: revolute, points: [ground, striker.start], at: [0.3, 0.1]}\n"
        + "springs: {back: {type: torsional, joint: pivot, stiffness: 2}}\n"
        + "contacts:\n  hit: {type: point_on_line, point: striker.end, side: left,"
        + " line: [lever.start, lever.end], law: {stiffness: 1.0e4, restitution: 0.5}}\n"
        + "initial: {angles: {lever: 0, striker: 170 deg}}\n"
    )
    inertia = MASS * LENGTH**2 / 3 + 2e-4 + 0.3 * LENGTH**2
    assert swings(found.mechanism) == pytest.approx([(inertia / 2) ** 0.5])
