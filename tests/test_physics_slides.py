"""Laws of nature: prismatic joints, alone, in loops and between bodies that move."""

from math import atan2, cos, pi, radians, sin

import numpy as np
import pytest
from physics_tools import TRAMMEL, angle, run, where

G = 9.81


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


@pytest.mark.parametrize("allowed", [1e-3, 1e-5, 1e-8])
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


# --- on a body that turns ----------------------------------------------------------------------


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
