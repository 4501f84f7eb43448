"""One mechanism said in two ways moves alike: to the tolerance at 1e-8 m, and in both formulations.

Each pair is written of different parts, so that different equations are solved.
"""

from math import cos, radians, sin

import numpy as np
import pytest
from physics_tools import STEEL, angle, on_grid, rod, run, where

BOUND = 2e-8  # m: both runs may be off by the tolerance, to either side
COARSE = ("solver.formulation=redundant", "accuracy.tolerance=1e-4", "run.duration=0.2")
WAYS = [((), BOUND), (COARSE, 2e-4)]


def both(one, other):
    """Rows of two runs with the same instants; ends of laps are at instants of their own."""
    _, *rows = np.intersect1d(one.time, other.time, return_indices=True)
    assert len(rows[0]) > 0.99 * max(len(one.time), len(other.time))
    return rows


def apart(one, other, *points):
    """Largest distance (m) of points that have the same names in both runs."""
    mine, others = both(one, other)
    return max(np.abs(where(one, p)[mine] - where(other, p)[others]).max() for p in points)


# --- a circular slot is a crank -----------------------------------------------------------------

SWUNG = """
gravity: [0, -9.81]
run: {duration: 0.5, sample: 1 ms}
accuracy: {tolerance: 1.0e-8}
"""
IN_SLOT = """
curves: {way: {type: circle, centre: [0, 0], radius: 0.1}}
bodies: {rod: ROD}
joints: {pin: {type: slot, point: rod.POINT, curve: way}}
initial: {angles: {rod: 20 deg}, speeds: {rod: 0}}
"""
# A crank so light that it changes nothing, as far as the tolerance tells.
ON_CRANK = """
bodies:
  crank: {type: rigid, mass: 1.0e-12, inertia: 1.0e-14, points: {a: [0, 0], b: [0.1, 0]}}
  rod: ROD
joints:
  hub: {type: revolute, points: [ground, crank.a], at: [0, 0]}
  pin: {type: revolute, points: [crank.b, rod.POINT]}
initial: {angles: {crank: 0, rod: 20 deg}, speeds: {rod: 0, crank: 0}}
"""


def slot_and_crank(point, *settings):
    texts = (
        STEEL + text.replace("ROD", rod(0.3)).replace("POINT", point) + SWUNG
        for text in (IN_SLOT, ON_CRANK)
    )
    return [run(text, *settings) for text in texts]


@pytest.mark.parametrize(("settings", "bound"), WAYS)
@pytest.mark.parametrize("point", ["start", "end"])
def test_a_circular_slot_moves_exactly_like_a_crank(point, settings, bound):
    """Both natively (start: the origin) and by its foot point (end)."""
    slot, crank = slot_and_crank(point, *settings)
    assert apart(slot, crank, "rod.start", "rod.centre", "rod.end") < bound
    if not settings:  # in redundant coordinates a crank without mass shakes its joint's force
        np.testing.assert_allclose(slot.slot_forces["pin"], crank.joint_forces["pin"], atol=1e-6)


# --- a curve on a turning body is the inverted mechanism ----------------------------------------

OMEGA = 4.0  # rad/s, of the cam
CAM = "{type: ellipse, centre: [0.02, 0.01], semi_axes: [0.12, 0.08], rotation: 20 deg"
ARM = "{type: rigid, mass: 1, inertia: 0.01, points: {hinge: [0, 0], pin: [0.2, 0]}}"
CAM_TURNS = f"""
curves: {{groove: {CAM}, on: cam}}}}
bodies:
  cam: {{type: rigid, mass: 1, inertia: 0.1}}
  arm: {ARM}
joints:
  axle: {{type: revolute, points: [ground, cam.centre], at: [0, 0]}}
  hinge: {{type: revolute, points: [ground, arm.hinge], at: [0.2, 0.1]}}
  slot: {{type: slot, point: arm.pin, curve: groove}}
drives: {{motor: {{type: speed, joint: axle, value: {OMEGA} rad/s}}}}
initial: {{guesses: {{arm: 180 deg}}}}
run: {{duration: 0.7, sample: 1 ms}}
accuracy: {{tolerance: 1.0e-8}}
"""
FRAME_TURNS = f"""
curves: {{groove: {CAM}}}}}
bodies:
  frame: {{type: rigid, mass: 1, inertia: 0.1, points: {{axle: [0, 0], hinge: [0.2, 0.1]}}}}
  arm: {ARM}
joints:
  axle: {{type: revolute, points: [ground, frame.axle], at: [0, 0]}}
  hinge: {{type: revolute, points: [frame.hinge, arm.hinge]}}
  slot: {{type: slot, point: arm.pin, curve: groove}}
drives: {{motor: {{type: speed, joint: axle, value: -{OMEGA} rad/s}}}}
initial: {{guesses: {{arm: 180 deg}}}}
run: {{duration: 0.7, sample: 1 ms}}
accuracy: {{tolerance: 1.0e-8}}
"""


def in_the_cams_axes(result, point):
    """Places (N,) of a point as x + iy, seen from a cam that turns evenly from 0."""
    return where(result, point) @ [1, 1j] * np.exp(-1j * OMEGA * result.time)


@pytest.mark.parametrize(("settings", "bound"), WAYS)
def test_a_cam_that_turns_moves_its_follower_as_a_frame_that_turns_backwards(settings, bound):
    """Both are kinematic: the arm's pin is where the groove crosses the circle about its hinge."""
    cam, frame = run(CAM_TURNS, *settings), run(FRAME_TURNS, *settings)
    mine, others = both(cam, frame)
    for point in ("arm.hinge", "arm.pin"):
        at_rest = where(frame, point)[others] @ [1, 1j]
        assert np.abs(in_the_cams_axes(cam, point)[mine] - at_rest).max() < bound
    assert np.ptp(angle(cam, "arm")) > 0.05  # rad: it does swing


BEAD = "{type: rigid, mass: 0.3, inertia: 0}"
GROOVE_TURNS = f"""
curves: {{groove: {CAM}, on: cam}}}}
bodies: {{cam: {{type: rigid, mass: 1, inertia: 0.1}}, bead: {BEAD}}}
joints:
  axle: {{type: revolute, points: [ground, cam.centre], at: [0, 0]}}
  slot: {{type: slot, point: bead.centre, curve: groove}}
drives: {{motor: {{type: speed, joint: axle, value: {OMEGA} rad/s}}}}
gravity: 9.81
initial: {{positions: {{bead: PLACE}}, speeds_along: {{slot: 0.5}}}}
run: {{duration: 0.7, sample: 1 ms}}
accuracy: {{tolerance: 1.0e-8}}
"""
# Gravity turns backwards, and the bead feels m omega^2 r outwards. Coriolis' force is across the
# groove, which takes it.
GROOVE_RESTS = f"""
curves: {{groove: {CAM}}}}}
bodies: {{bead: {BEAD}}}
joints: {{slot: {{type: slot, point: bead.centre, curve: groove}}}}
drives:
  felt:
    type: force
    point: bead.centre
    value:
      - 0.3*({OMEGA}**2*place(bead.centre, x) - 9.81*sin({OMEGA}*t))
      - 0.3*({OMEGA}**2*place(bead.centre, y) - 9.81*cos({OMEGA}*t))
initial: {{positions: {{bead: PLACE}}, speeds_along: {{slot: 0.5}}}}
run: {{duration: 0.7, sample: 1 ms}}
accuracy: {{tolerance: 1.0e-8}}
"""


@pytest.mark.parametrize(("settings", "bound"), WAYS)
def test_a_bead_in_a_turning_groove_moves_as_by_what_it_feels_in_one_at_rest(settings, bound):
    c, s = cos(radians(20)), sin(radians(20))
    place = f"[{0.02 + 0.12 * c}, {0.01 + 0.12 * s}]"
    turns, rests = (
        run(text.replace("PLACE", place), *settings) for text in (GROOVE_TURNS, GROOVE_RESTS)
    )
    mine, others = both(turns, rests)
    at_rest = where(rests, "bead.centre")[others] @ [1, 1j]
    assert np.ptp(at_rest.imag) > 0.05  # m: it does run along the groove
    assert np.abs(in_the_cams_axes(turns, "bead.centre")[mine] - at_rest).max() < bound


# --- slots, hinges and sleeves as other joints ----------------------------------------------------


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
    joints = (
        "in: {type: sleeve, guide: guide, link: link}",
        "in: {type: prismatic, points: [guide.start, link.start], axis: [1, 0]}",
    )
    sleeve, way = (run(STEEL + SWINGING.replace("JOINT", joint)) for joint in joints)
    assert np.array_equal(sleeve.poses, way.poses)


# --- a flexible link is rods on sprung hinges ---------------------------------------------------

STRUCK = """
materials: {{soft: {{density: 1000, youngs_modulus: 1 GPa}}}}
bodies:
  ball: {{type: rigid, mass: 1, inertia: 0}}
{bodies}
joints:
{joints}
contacts:
  hit: {{type: point_on_line, point: ball.centre, line: [{line}],
        law: {{stiffness: 1.0e4, restitution: 0.5, friction: 0.1}}}}
gravity: [0, -9.81]
initial: {{positions: {{ball: [0.3, 0.05]}}, velocities: {{ball: [0.1, 0]}}, angles: {{{angles}}}}}
run: {{duration: 0.4, sample: 1 ms}}
accuracy: {{tolerance: 1.0e-8}}
"""
SOFT = "material: soft, section: {width: 20 mm, thickness: 20 mm}"
FLEXIBLE = STRUCK.format(
    bodies=f"  link: {{type: flexible, length: 0.4, {SOFT}, rods: 2, "
    "hinges: {stiffness: 50, damping: 0.1}, points: {knee: 0.2}}",
    joints="  base: {type: weld, points: [ground, link.start], at: [0, 0]}",
    line="LINE",
    angles="",
)
TWO_RODS = STRUCK.format(
    bodies=f"  one: {{type: rod, length: 0.2, {SOFT}}}\n  link: {{type: rod, length: 0.2, {SOFT}}}",
    joints="""\
  base: {type: weld, points: [ground, one.start], at: [0, 0]}
  knee: {type: revolute, points: [one.end, link.start]}
springs: {knee: {type: torsional, joint: knee, stiffness: 50, damping: 0.1, rest_angle: 0}}""",
    line="link.start, link.end",
    angles="link: 0",
)


def test_a_ball_strikes_the_rod_beyond_a_hinge_of_a_link():
    """A point on a hinge belongs to either rod: here to the one that is hit, either way round."""
    rods = run(TWO_RODS)
    for line, side in (("link.knee, link.end", "left"), ("link.end, link.knee", "right")):
        link = run(FLEXIBLE.replace("LINE]", f"{line}], side: {side}"))
        assert len(link.intervals["hit"]) == len(rods.intervals["hit"]) >= 1
        for point in ("ball.centre", "link.end"):
            one, other = (on_grid(result, where(result, point), 1e-3) for result in (link, rods))
            np.testing.assert_allclose(one, other, atol=BOUND)
