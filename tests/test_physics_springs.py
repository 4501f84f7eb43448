"""Laws of nature: linear springs and dampers, between points and along prismatic joints."""

from math import sqrt

import numpy as np
import pytest
from physics_tools import alone, angle, run, speed, velocity, where
from scipy.integrate import solve_ivp

TOLERANCES = (1e-4, 1e-8)

OSCILLATOR = """
bodies: {mass: {type: rigid, mass: 2, inertia: 1, points: {c: [0, 0]}}}
joints: {way: {type: prismatic, points: [ground, mass.c], at: [0.3, 0], axis: [1, 0]}}
springs: {s: SPRING}
run: {duration: 3}
accuracy: {tolerance: 1.0e-8}
"""
BETWEEN = (
    "{type: linear, points: [ground, mass.c], at: [-1, 0], stiffness: 50, damping: 4, length: 1.2}"
)
PUSHED = (
    "{type: linear, points: [mass.c, ground], at: [1.5, 0], stiffness: 50, damping: 4, length: 1.3}"
)
ALONG = "{type: linear, joint: way, stiffness: 50, damping: 4, length: -0.1}"
WAY = {BETWEEN: 1, PUSHED: -1, ALONG: 1}  # what is told acts on the second point's body


def swung(time):
    """From 0.1 m beyond the rest at 0.2 m, under critical damping 20 N s/m."""
    rate, omega = 4 / (2 * 2), sqrt(50 / 2 - 1)
    return 0.2 + 0.1 * np.exp(-rate * time) * (
        np.cos(omega * time) + rate / omega * np.sin(omega * time)
    )


@pytest.mark.parametrize("spring", [BETWEEN, PUSHED, ALONG])
@pytest.mark.parametrize("allowed", TOLERANCES)
def test_mass_on_a_damped_spring(spring, allowed):
    mass = run(OSCILLATOR.replace("SPRING", spring), f"accuracy={{tolerance: {allowed}}}")
    assert np.abs(where(mass, "mass.c")[:, 0] - swung(mass.time)).max() < allowed
    assert mass.checks.energy_residual < 100 * allowed
    told, x, v = mass.spring_forces["s"], where(mass, "mass.c")[:, 0], mass.rates[:, 0, 0]
    np.testing.assert_allclose(told[:, 0], WAY[spring] * (50 * (0.2 - x) - 4 * v), atol=1e-9)
    np.testing.assert_allclose(told[:, 1], 0, atol=1e-12)


@pytest.mark.parametrize("spring", [BETWEEN, PUSHED, ALONG])
def test_redundant_coordinates_have_the_same_spring(spring):
    mass = run(
        OSCILLATOR.replace("SPRING", spring),
        "solver.formulation=redundant",
        "accuracy.tolerance=1e-5",
    )
    assert np.abs(where(mass, "mass.c")[:, 0] - swung(mass.time)).max() < 1e-5
    assert mass.checks.energy_residual < 1e-4


@pytest.mark.parametrize("kind", ["points: [ground, mass.c], at: [-1, 0]", "joint: way"])
def test_a_spring_left_as_assembled_rests(kind):
    spring = f"{{type: linear, {kind}, stiffness: 50}}"
    mass = run(OSCILLATOR.replace("SPRING", spring))
    np.testing.assert_allclose(where(mass, "mass.c"), [[0.3, 0]] * len(mass.time), atol=1e-12)


# --- springs that turn --------------------------------------------------------------------------

PENDULUM = """
bodies:
  arm: {type: rigid, mass: 0.5, inertia: 0.02, centre_of_mass: [0.1, 0.05],
        points: {o: [0, 0], a: [0.1, 0]}}
  bob: {type: rigid, mass: 1, inertia: 0.01, points: {c: [0, 0], hook: [0.05, 0.1]}}
joints:
  pivot: {type: revolute, points: [ground, arm.o], at: [0, 0]}
  way: {type: prismatic, points: [arm.o, bob.c], axis: [1, 0]}
springs:
  pull: {type: linear, points: [ground, bob.hook], at: [0.3, 0.4], stiffness: 200, damping: 0.5,
         length: 0.2}
  hold: {type: linear, joint: way, stiffness: 100, length: 0.4}
  centre: {type: linear, points: [ground, arm.a], at: [0.05, 0.02], stiffness: 30, damping: 0.1,
           length: 0}
gravity: [0, -9.81]
initial: {angles: {arm: -40 deg}}
run: {duration: 2, sample: 2 ms}
accuracy: {tolerance: 1.0e-8}
"""


def rates(_, y):
    """Of angle and reach of the bob and their rates: Lagrange's equations by complex numbers."""
    turn, reach, omega, slide = y
    e = np.exp(1j * turn)
    # Places, their derivatives by (angle, reach), and accelerations at constant rates
    arm = (0.1 + 0.05j) * e
    bob, hook, a = reach * e, (reach + 0.05 + 0.1j) * e, 0.1 * e
    by_arm, by_bob = (1j * arm, 0), (1j * bob, e)
    by_hook, by_a = (1j * hook, e), (1j * a, 0)
    spin = 2j * omega * slide * e
    mass = np.array([[0.02 + 0.01, 0.0], [0.0, 0.0]])
    force = np.zeros(2)
    for m, by, away in ((0.5, by_arm, -arm * omega**2), (1.0, by_bob, -bob * omega**2 + spin)):
        rows = np.array(by)
        mass = mass + m * (rows[:, None] * rows.conj()).real
        force = force + m * (rows.conj() * (-9.81j - away)).real
    for by, place, there, k, c, length in (
        (by_hook, hook, 0.3 + 0.4j, 200, 0.5, 0.2),
        (by_a, a, 0.05 + 0.02j, 30, 0.1, 0),
    ):
        rows = np.array(by)
        moving, between = rows @ [omega, slide], place - there
        along = between / abs(between)
        pull = k * (abs(between) - length) * along
        pull += c * ((along.conj() * moving).real * along if length else moving)
        force = force - (rows.conj() * pull).real
    force[1] -= 100 * (reach - 0.4)
    return [omega, slide, *np.linalg.solve(mass, force)]


@pytest.fixture(scope="module")
def truth():
    start = [-np.radians(40), 0.0, 0.0, 0.0]
    return solve_ivp(rates, (0, 2), start, "DOP853", rtol=1e-13, atol=1e-13, dense_output=True).sol


@pytest.mark.parametrize("allowed", TOLERANCES)
def test_spring_pendulum_goes_as_its_own_equations_say(truth, allowed):
    bob = run(PENDULUM, f"accuracy={{tolerance: {allowed}}}")
    turn, reach, *_ = truth(bob.time)
    place = np.stack([reach * np.cos(turn), reach * np.sin(turn)], axis=-1)
    assert np.abs(where(bob, "bob.c") - place).max() < allowed
    assert bob.checks.energy_residual < 300 * allowed


def test_redundant_coordinates_agree_on_the_spring_pendulum(truth):
    bob = run(PENDULUM, "solver.formulation=redundant", "accuracy.tolerance=1e-4")
    turn, reach, *_ = truth(bob.time)
    place = np.stack([reach * np.cos(turn), reach * np.sin(turn)], axis=-1)
    assert np.abs(where(bob, "bob.c") - place).max() < 1e-4
    tight = run(PENDULUM)
    for name in ("pull", "hold", "centre"):
        np.testing.assert_allclose(bob.spring_forces[name], tight.spring_forces[name], atol=0.05)
    for name in ("pivot", "way"):
        one, other = bob.joint_forces[name][20:], tight.joint_forces[name][20:]
        np.testing.assert_allclose(one, other, atol=0.2)


def test_a_stiff_spring_is_a_rod():
    """At k = 1e9 N/m a bob swings on it as on a rod, to its stretch of m g / k = 1e-8 m."""
    text = """
bodies:
  cross: {type: rigid, mass: 1.0e-6, inertia: 1.0e-6, points: {c: [0, 0]}}
  bob: {type: rigid, mass: 1, inertia: 1.0e-3, points: {c: [0, 0]}}
joints:
  along: {type: prismatic, points: [ground, cross.c], at: [0, 0], axis: [1, 0]}
  across: {type: prismatic, points: [cross.c, bob.c], axis: [0, 1]}
springs: {stiff: {type: linear, points: [ground, bob.c], at: [-0.6, 0.8], stiffness: 1.0e+9}}
gravity: [0, -9.81]
run: {duration: 0.6}
accuracy: {tolerance: 1.0e-6}
"""
    bob = alone(text)
    start = np.arctan2(-0.8, 0.6)
    swing = solve_ivp(
        lambda _, y: [y[1], -9.81 * np.cos(y[0])], (0, 0.6), [start, 0], "DOP853",
        rtol=1e-12, atol=1e-12, t_eval=bob.time,
    ).y[0]  # fmt: skip
    place = np.stack([-0.6 + np.cos(swing), 0.8 + np.sin(swing)], axis=-1)
    assert np.abs(where(bob, "bob.c") - place).max() < 2e-6


# A table that turns about a pivot, and two wedges on it that push each other.
WEDGES = """
bodies:
  table: {type: rigid, mass: 1, inertia: 0.05, points: {o: [0, 0], x: [0.1, 0], y: [0, 0.1]}}
  one: {type: rigid, mass: 0.6, inertia: 4.0e-3, points: {c: [0, 0]}}
  two: {type: rigid, mass: 0.8, inertia: 6.0e-3, points: {c: [0, 0]}}
joints:
  pivot: {type: revolute, points: [ground, table.o], at: [0, 0]}
  x: {type: prismatic, points: [table.x, one.c], axis: [1, 0]}
  y: {type: prismatic, points: [table.y, two.c], axis: [0, 1]}
  face: {type: prismatic, points: [one.c, two.c], axis: [-1, 0.7]}
springs: {s: {type: linear, joint: JOINT, stiffness: 30, damping: 6, length: 0.15}}
initial: {angles: {table: 0.2}, along: {x: 0.1}, speeds: {table: 6}}
run: {duration: 0.6}
accuracy: {tolerance: 1.0e-6}
"""
ALONG_OF = {"x": 0.0, "y": np.pi / 2, "face": np.arctan2(0.7, -1)}


def assert_it_acts_along_its_joint(wedges, joint, bodies):
    """A spring within what turns freely: the angular momentum stays, no force is across."""
    spin = 0.05 * speed(wedges, "table")
    for body, mass, inertia in bodies:
        at, moving = where(wedges, f"{body}.c"), velocity(wedges, f"{body}.c")
        spin = spin + inertia * speed(wedges, body)
        spin = spin + mass * (at[:, 0] * moving[:, 1] - at[:, 1] * moving[:, 0])
    assert np.ptp(spin) < 1e-4 * spin[0]
    line = angle(wedges, "table") + ALONG_OF[joint]
    force = wedges.spring_forces["s"] @ [1, 1j]
    across = (force * np.exp(-1j * line)).imag
    assert np.abs(across).max() < 1e-9 * np.abs(force).max()
    assert wedges.checks.relative_energy_residual < 1e-3


@pytest.mark.parametrize("joint", ["x", "y", "face"])
def test_damper_between_parts_that_turn_gives_them_no_spin(joint):
    """Each joint in turn is one of the tree, and two of the three close the loop of slides."""
    wedges = run(WEDGES.replace("JOINT", joint))
    assert_it_acts_along_its_joint(wedges, joint, [("one", 0.6, 4e-3), ("two", 0.8, 6e-3)])


def test_redundant_coordinates_have_a_damper_along_a_line_that_turns():
    lines = WEDGES.replace("JOINT", "x").splitlines()
    without = [line for line in lines if not line.startswith(("  two:", "  y:", "  face:"))]
    wedges = run("\n".join(without), "solver.formulation=redundant", "accuracy.tolerance=1e-5")
    assert_it_acts_along_its_joint(wedges, "x", [("one", 0.6, 4e-3)])


# --- a structure ------------------------------------------------------------------------------


def test_a_spring_pulls_at_a_structure_that_nothing_moves():
    """All is welded to the ground: there is no coordinate, and the spring keeps its force."""
    still = run("""
bodies:
  post: {type: rigid, mass: 1, inertia: 1, points: {foot: [0, 0], head: [0, 3]}}
  arm: {type: rigid, mass: 1, inertia: 1, points: {root: [0, 0], tip: [4, 0]}}
joints:
  base: {type: weld, points: [ground, post.foot], at: [0, 0]}
  corner: {type: weld, points: [post.head, arm.root]}
springs: {rope: {type: linear, points: [ground, arm.tip], at: [0, 0], stiffness: 10, length: 4}}
gravity: 9.81
run: {duration: 1}
accuracy: {tolerance: 1.0e-6}
""")
    np.testing.assert_allclose(still.poses - still.poses[0], 0, atol=0)
    expected = np.broadcast_to([-8.0, -6.0], still.spring_forces["rope"].shape)
    np.testing.assert_allclose(still.spring_forces["rope"], expected, rtol=1e-14)
    assert still.energy.stored[0] == pytest.approx(5 + 9.81 * 3, rel=1e-14)


@pytest.mark.parametrize("formulation", ["minimal", "redundant"])
@pytest.mark.parametrize(("points", "way"), [("[ground, rod.o]", 1), ("[rod.o, ground]", -1)])
def test_a_torsional_spring_rests_at_the_angle_of_the_second_body(points, way, formulation):
    """Released at 0, J theta'' = -k (theta - 0.4): it swings about 0.4 rad, or -0.4."""
    text = f"""
bodies: {{rod: {{type: rigid, mass: 1, inertia: 0.2, points: {{o: [0, 0]}}}}}}
joints: {{pin: {{type: revolute, points: {points}, at: [0, 0]}}}}
springs: {{s: {{type: torsional, joint: pin, stiffness: 5, rest_angle: 0.4}}}}
initial: {{angles: {{rod: 0}}}}
run: {{duration: 1}}
accuracy: {{tolerance: 1.0e-8}}
"""
    rod = run(text, f"solver.formulation={formulation}")
    right = way * 0.4 * (1 - np.cos(sqrt(5 / 0.2) * rod.time))
    np.testing.assert_allclose(angle(rod, "rod"), right, atol=1e-7)
