"""Laws of nature: prismatic joints, alone, in loops and between bodies that move."""

from math import atan2, cos, pi, radians, sin

import numpy as np
import pytest
from test_physics_tools import STEEL, TRAMMEL, angle, rod, run, where

G = 9.81
TOLERANCES = (1e-3, 1e-5, 1e-6, 1e-8)


def tolerance(value):
    return f"accuracy={{tolerance: {value}}}"


# --- on the ground ------------------------------------------------------------------------------

INCLINE = """
bodies: {block: {type: rigid, mass: 2, inertia: 1.0e-3, points: {b: [0, 0]}}}
joints:
  way: {type: prismatic, points: [ground, block.b], at: [0.1, 0.2], axis: [4, -3], angle: 20 deg}
gravity: [0, -9.81]
run: {duration: 1}
accuracy: {tolerance: 1.0e-8}
"""


@pytest.mark.parametrize("formulation", ["minimal", "redundant"])
def test_block_slides_down_an_incline_as_galilei_says(formulation):
    block = run(INCLINE, f"solver.formulation={formulation}", tolerance(1e-6))
    gone = 0.5 * 0.6 * G * block.time[:, None] ** 2 * [0.8, -0.6]
    np.testing.assert_allclose(where(block, "block.b"), np.add(gone, [0.1, 0.2]), atol=1e-6)
    np.testing.assert_allclose(angle(block, "block"), radians(20), atol=1e-12)
    across = 2 * G * 0.8 * np.array([0.6, 0.8])  # N, on the block
    np.testing.assert_allclose(
        block.joint_forces["way"][5:], np.tile(across, (len(block.time) - 5, 1)), rtol=1e-5
    )


def test_the_line_may_be_the_body_that_slides_over_a_point_of_the_ground():
    """Then the axis is the body's, and the body moves the other way."""
    moved = "points: [block.b, ground], at: [0.1, 0.2], axis: [4, -3], angle: -20 deg"
    text = INCLINE.replace(
        "points: [ground, block.b], at: [0.1, 0.2], axis: [4, -3], angle: 20 deg", moved
    )
    block = run(text)
    along = atan2(-3, 4) + radians(20)
    fall = -G * sin(along)
    gone = 0.5 * fall * block.time[:, None] ** 2 * [cos(along), sin(along)]
    np.testing.assert_allclose(where(block, "block.b"), np.add(gone, [0.1, 0.2]), atol=1e-8)


# --- in loops -----------------------------------------------------------------------------------

TURNING = TRAMMEL + "initial: {angles: {beam: 2.0}, speeds: {beam: 3.0}}\nrun: {duration: 5}\n"


@pytest.mark.parametrize("allowed", TOLERANCES)
def test_free_elliptic_trammel_turns_evenly(allowed):
    """Two equal sliders, the beam's centre on a circle: the inertia is the same at every angle."""
    trammel = run(TURNING, tolerance(allowed))
    turned = 2.0 + 3.0 * trammel.time
    a = np.stack([-0.5 * np.cos(turned), 0 * turned], axis=-1)
    pen = a + np.stack(
        [0.7 * np.cos(turned) - 0.1 * np.sin(turned), 0.7 * np.sin(turned) + 0.1 * np.cos(turned)],
        axis=-1,
    )
    assert np.abs(where(trammel, "a.p") - a).max() < allowed
    assert np.abs(where(trammel, "beam.pen") - pen).max() < allowed
    assert trammel.checks.constraint_error < 1e-12


OLDHAM = """
bodies:
  one: {type: rigid, mass: 1, inertia: 1, points: {o: [0, 0]}}
  disc: {type: rigid, mass: 1, inertia: 0.5, points: {c: [0, 0]}}
  other: {type: rigid, mass: 1, inertia: 1, points: {o: [0, 0]}}
joints:
  shaft: {type: revolute, points: [ground, one.o], at: [0, 0]}
  offset: {type: revolute, points: [ground, other.o], at: [0.1, 0]}
  groove: {type: prismatic, points: [one.o, disc.c], axis: [1, 0]}
  tongue: {type: prismatic, points: [other.o, disc.c], axis: [0, 2]}
drives: {motor: {type: speed, joint: shaft, value: 4}}
initial: {angles: {one: 30 deg}}
run: {duration: 3}
accuracy: {tolerance: 1.0e-8}
"""


@pytest.mark.parametrize(("formulation", "allowed"), [("minimal", 1e-8), ("redundant", 1e-5)])
def test_oldham_coupling_turns_both_shafts_alike(formulation, allowed):
    """The disc's centre is where two lines through the shafts meet at right angles: on a circle."""
    coupling = run(OLDHAM, f"solver.formulation={formulation}", tolerance(allowed))
    turned = pi / 6 + 4 * coupling.time
    centre = 0.05 + 0.05 * np.stack([np.cos(2 * turned), np.sin(2 * turned)], axis=-1) - [0, 0.05]
    np.testing.assert_allclose(where(coupling, "disc.c"), centre, atol=allowed)
    np.testing.assert_allclose(angle(coupling, "other"), turned, atol=10 * allowed)
    # What holds the disc on its circle comes along both grooves.
    both = coupling.joint_forces["groove"] + coupling.joint_forces["tongue"]
    pull = -64 * (centre - [0.05, 0])  # m omega^2 r to the circle's middle, at 8 rad/s
    np.testing.assert_allclose(
        both[5:], pull[5:], atol=0.02 if formulation == "redundant" else 1e-6
    )


# --- one mechanism, said in other words ---------------------------------------------------------

SLIDER_CRANK = """
curves: {rail: {type: line, from: [-1, 0], to: [1, 0]}}
bodies:
  crank: {type: rigid, mass: 1, inertia: 0.01, points: {o: [0, 0], p: [0.1, 0]}}
  rod: {type: rigid, mass: 0.5, inertia: 0.01, centre_of_mass: [0.15, 0],
        points: {p: [0, 0], s: [0.3, 0]}}
  block: {type: rigid, mass: 0.7, inertia: 0.01, points: {s: [0, 0], front: [0.05, 0]}}
joints:
  shaft: {type: revolute, points: [ground, crank.o], at: [0, 0]}
  elbow: {type: revolute, points: [crank.p, rod.p]}
  wrist: {type: revolute, points: [rod.s, block.s]}
  WAY
gravity: [0, -9.81]
initial: {angles: {crank: 60 deg}, guesses: {rod: -17 deg}, speeds: {crank: 20}}
run: {duration: 1, sample: 1 ms}
accuracy: {tolerance: 1.0e-8}
"""
PRISMATIC = "way: {type: prismatic, points: [ground, block.s], at: [0, 0], axis: [1, 0]}"


def test_two_straight_slots_move_exactly_like_a_prismatic_joint():
    slots = """rear: {type: slot, point: block.s, curve: rail}
  ahead: {type: slot, point: block.front, curve: rail}"""
    slid, ran = (run(SLIDER_CRANK.replace("WAY", way)) for way in (PRISMATIC, slots))
    for point in ("block.s", "rod.p"):
        assert np.abs(where(slid, point) - where(ran, point)).max() < 2e-8
    both = ran.slot_forces["rear"] + ran.slot_forces["ahead"]
    np.testing.assert_allclose(slid.joint_forces["way"], both, atol=1e-4)


ELBOW = """
bodies: {upper: UPPER, lower: LOWER}
joints:
  shoulder: {type: revolute, points: [ground, upper.start], at: [0, 0]}
  elbow: {JOINT, points: [upper.end, lower.start]}
gravity: [0, -9.81]
initial: {angles: {upper: -20 deg, lower: 40 deg}}
run: {duration: 1, sample: 1 ms}
accuracy: {tolerance: 1.0e-8}
"""


def test_a_hinge_of_infinite_stiffness_is_a_weld():
    """It gives way by the moment over the stiffness: 1 N m over 1e9 N m/rad."""
    arms = STEEL + ELBOW.replace("UPPER", rod(0.4)).replace("LOWER", rod(0.3))
    stiff = "springs: {stiff: {type: torsional, joint: elbow, stiffness: 1.0e+9}}"
    welded = run(arms.replace("JOINT", "type: weld, angle: 60 deg"))
    sprung = run(arms.replace("JOINT", "type: revolute") + stiff)
    assert np.abs(where(welded, "lower.end") - where(sprung, "lower.end")).max() < 2e-8


SWINGING = """
bodies:
  guide: {type: rigid, mass: 1, inertia: 0.1,
          points: {o: [0, 0], start: [0.1, 0.02], end: [1, 0.02]}}
  link: {type: rod, length: 0.3, material: steel, section: {width: 10 mm, thickness: 10 mm}}
joints:
  shaft: {type: revolute, points: [ground, guide.o], at: [0, 0]}
  JOINT
gravity: [0, -9.81]
initial: {angles: {guide: 10 deg}, speeds: {guide: 1}}
run: {duration: 0.5, sample: 1 ms}
accuracy: {tolerance: 1.0e-8}
"""


def test_an_ideal_sleeve_is_a_prismatic_joint_along_its_guide():
    sleeve, way = (
        run(STEEL + SWINGING.replace("JOINT", joint))
        for joint in (
            "in: {type: sleeve, guide: guide, link: link}",
            "in: {type: prismatic, points: [guide.start, link.start], axis: [1, 0]}",
        )
    )
    assert np.array_equal(sleeve.poses, way.poses)


@pytest.mark.parametrize("formulation", ["minimal", "redundant"])
def test_axes_of_the_bodies_do_not_matter_between_two_that_move(formulation):
    """The same link said in axes that are turned by 70 deg, and the joint the other way round."""
    plain = run(
        STEEL
        + SWINGING.replace(
            "JOINT", "in: {type: prismatic, points: [guide.start, link.start], axis: [1, 0]}"
        ),
        f"solver.formulation={formulation}",
        tolerance(1e-5),
    )
    mass, inertia = 7850 * 1e-4 * 0.3, 7850 * 1e-4 * 0.3 * 0.09 / 12
    c, s = cos(radians(-70)), sin(radians(-70))
    body = f"""{{type: rigid, mass: {mass}, inertia: {inertia},
    centre_of_mass: [{0.15 * c}, {0.15 * s}],
    points: {{start: [0, 0], end: [{0.3 * c}, {0.3 * s}]}}}}"""
    text = SWINGING.replace(
        "{type: rod, length: 0.3, material: steel, section: {width: 10 mm, thickness: 10 mm}}", body
    )
    joint = f"""in: {{type: prismatic, points: [link.start, guide.start], axis: [{c}, {s}],
    angle: -70 deg}}"""
    turned = run(text.replace("JOINT", joint), tolerance(1e-8))
    for point in ("link.start", "link.end"):
        assert np.abs(where(plain, point) - where(turned, point)).max() < 1e-5
    forces = plain.joint_forces["in"] + turned.joint_forces["in"]  # on either of the two bodies
    assert np.abs(forces[5:]).max() < 2e-3 * np.abs(plain.joint_forces["in"]).max()


def test_bead_on_a_turning_rod_flees_outwards():
    """At constant speed omega r = r0 cosh(omega t)."""
    bead = run("""
bodies:
  spoke: {type: rigid, mass: 1, inertia: 1, points: {o: [0, 0], r: [0.1, 0]}}
  bead: {type: rigid, mass: 1, inertia: 1.0e-3, points: {c: [0, 0]}}
joints:
  hub: {type: revolute, points: [ground, spoke.o], at: [0, 0]}
  way: {type: prismatic, points: [spoke.r, bead.c], axis: [1, 0]}
drives: {motor: {type: speed, joint: hub, value: 5}}
run: {duration: 0.5}
accuracy: {tolerance: 1.0e-8}
""")
    away = np.hypot(*where(bead, "bead.c").T)
    np.testing.assert_allclose(away, 0.1 * np.cosh(5 * bead.time), atol=1e-8)
    # Coriolis: 2 m omega r', across the rod
    across = np.hypot(*bead.joint_forces["way"].T)
    np.testing.assert_allclose(across, 2 * 5 * 0.5 * np.sinh(5 * bead.time), atol=1e-6)
