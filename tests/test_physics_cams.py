"""Followers on eccentric cams: closed forms of lift, separation and the speed that it takes."""

from math import cos, pi, sin, sqrt

import numpy as np
import pytest
from physics_tools import alone, energy_change, run_model, scene, where
from scipy.optimize import brentq

from exudyn_flexlink.engines.exudyn.run import formulations
from exudyn_flexlink.mechanism import formulation

G = 9.81
E, STIFF, PRELOAD, MASS = 0.01, 2000.0, 20.0, 0.5

FLAT = """
curves: {{sole: {{type: line, from: [-0.05, 0], to: [0.05, 0], on: follower}}}}
bodies:
  cam: {{type: rigid, mass: 1, inertia: 1.0e-3, points: {{hub: [0, 0], middle: [0.01, 0]}}}}
  follower: {{type: rigid, mass: 0.5, inertia: 1.0e-3, points: {{foot: [0, 0]}}}}
joints:
  shaft: {{type: revolute, points: [ground, cam.hub], at: [0, 0]}}
  guide: {{type: prismatic, points: [ground, follower.foot], at: [0, 0.02], axis: [0, 1]}}
springs:
  # Without force 10 mm below the guide's point: pressed by 20 N where the follower is lowest.
  spring: {{type: linear, joint: guide, stiffness: 2000, length: -0.01}}
drives: {{motor: {{type: speed, joint: shaft, value: {speed}}}}}
contacts:
  heel:
    type: point_on_curve
    point: cam.middle
    curve: sole
    side: right
    radius: 0.03
    law: {{stiffness: 1.0e9, restitution: 0, transition_speed: 0.02}}
initial: {{angles: {{cam: -90 deg}}, positions: {{follower: [0, 0.02]}}}}
run: {{duration: {duration}}}
accuracy: {{tolerance: 1.0e-9}}
"""
LIMIT = sqrt((PRELOAD + 2 * STIFF * E) / (MASS * E))  # rad/s: nothing presses as it is highest


def test_a_flat_follower_stays_on_an_eccentric_disc_below_the_limit_of_its_speed():
    """y = e (1 - cos wt), as the contact force of a rigid follower never vanishes."""
    speed_ = 0.99 * LIMIT
    result = alone(FLAT.format(speed=speed_, duration=2.2 * pi / speed_))
    lift = where(result, "follower.foot")[:, 1] - 0.02
    np.testing.assert_allclose(lift, E * (1 - np.cos(speed_ * result.time)), atol=2e-6)
    (touch,) = result.intervals["heel"]
    assert touch.lasts


def test_a_flat_follower_leaves_an_eccentric_disc_where_its_contact_force_vanishes():
    """And flies on its spring until it meets the disc again."""
    speed_ = 1.2 * LIMIT
    result = alone(FLAT.format(speed=speed_, duration=2 * pi / speed_))
    touches = list(result.intervals["heel"])
    leaves = np.arccos(-(PRELOAD + STIFF * E) / (E * (MASS * speed_**2 - STIFF))) / speed_
    # The tolerance of 1e-9 m is 1 N of a force that falls by 7 kN/s, 1.4e-4 s; steps do better.
    assert touches[0].end == pytest.approx(leaves, abs=1e-6)
    own, rest = sqrt(STIFF / MASS), -PRELOAD / STIFF
    y, v = E * (1 - cos(speed_ * leaves)), E * speed_ * sin(speed_ * leaves)

    def gap(t):
        flown = own * (t - leaves)
        flight = rest + (y - rest) * cos(flown) + v / own * sin(flown)
        return flight - E * (1 - cos(speed_ * t))

    meets = brentq(gap, leaves + 0.2 / speed_, 2 * pi / speed_)
    assert touches[1].begin == pytest.approx(meets, abs=1e-6)
    assert energy_change(result) < 1e-6 * result.energy.kinetic.max()


ROLLER = "textbook/cam_follower.yaml"


@pytest.mark.parametrize(("rpm", "stays"), [(990, True), (1030, False)])
def test_a_roller_jumps_off_an_eccentric_cam_above_the_speed_of_its_closed_form(rpm, stays):
    """Nothing presses at the top at w^2 = F/(m e (1 + e/L)), L both radii: 1007.5 rpm."""
    far, e, m, k = 0.042, 0.01, 0.5, 2000.0
    limit = sqrt((k * (far + e - 0.02) + m * G) / (m * e * (1 + e / far))) * 30 / pi
    assert limit == pytest.approx(1007.5, abs=0.05)
    # Lossy, so that what rings as it starts has died away as it comes to the top.
    law = "contacts.cam_face.law.restitution=0", "contacts.cam_face.law.transition_speed=0.02"
    stiff = "contacts.cam_face.law.stiffness=1.0e9"
    result = run_model(ROLLER, f"drives.motor.value={rpm} rpm", "run.turns=0.9", *law, stiff)
    touches = list(result.intervals["cam_face"])
    assert (len(touches) == 1 and touches[0].lasts) == stays
    a = (rpm * pi / 30) * result.time - pi / 2
    y = e * np.sin(a) + np.sqrt(far**2 - (e * np.cos(a)) ** 2)
    on = result.contacts["cam_face"].force > 0
    np.testing.assert_allclose(where(result, "follower.roller")[on, 1], y[on], atol=2e-6)


# --- engines and effects ----------------------------------------------------------------------


def test_a_given_step_does_not_ask_for_a_solver_that_has_no_points_on_curves():
    fixed = scene(FLAT.format(speed=50, duration=0.01).replace("tolerance: 1.0e-9", "step: 1.0e-5"))
    assert formulation(fixed) == "minimal"
    assert formulations(fixed) == ("minimal",)


@pytest.mark.parametrize(("speed", "lasts"), [("468.5 rpm", True), ("468.6 rpm", False)])
def test_the_benchmark_jumps_above_the_published_jump_speed(speed, lasts):
    """Of 468.54 rpm: sqrt((P + 2 k e)/(m e)), with P = 2.5 N, k = 1 N/mm, e = 15 mm, m = 0.9 kg."""
    result = run_model("benchmarks/cam_jump.yaml", f"drives.motor.value={speed}")
    assert next(iter(result.intervals["lift"])).lasts == lasts
