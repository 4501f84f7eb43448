"""Links that leave their guides, or hardly use them, and tolerances as large as what moves."""

from math import acos

import pytest
from results import scene_from

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.report import check_text

RADIUS, AWAY, SPEED = 0.04, 0.02, 10.0  # m, m, rad/s: of the track, of its centre, of the guide
TRACK = """
title: a link in a guide that turns beside the centre of a round track
materials: {steel: {density: 7850, youngs_modulus: 200 GPa}}
curves: {track: {type: circle, centre: [0, 0], radius: 40 mm}}
bodies:
  guide: {type: rod, length: LENGTH, material: steel, section: {width: 20 mm, thickness: 12 mm}}
  link: LINK
joints:
  crank: {type: revolute, points: [ground, guide.start], at: [20 mm, 0]}
  sleeve: {type: sleeve, guide: guide, link: link, FIT}
  pin: {type: slot, point: link.start, curve: track}
drives: {motor: {type: speed, joint: crank, value: 10 rad/s}}
run: {duration: 0.25, sample: 1 ms}
accuracy: {tolerance: 1.0e-6}
"""
EACH = 1e-3  # s, between samples
RIGID = "{type: rod, length: 70 mm, material: steel, section: {width: 10 mm, thickness: 1 mm}}"
BENDS = RIGID.replace("rod", "flexible").replace("}}", "}, rods: 3, hinges: {stiffness: beam}}")
LAW = "law: {stiffness: 1.0e5, restitution: 0.5}"
FITS = {"ideal": "clearance: 0", "supported": f"supported: true, {LAW}",
        "clearance": f"clearance: 0.2 mm, {LAW}"}  # fmt: skip


def scene(length, link=RIGID, fit="ideal", more=""):
    text = TRACK.replace("LENGTH", str(length)).replace("LINK", link).replace("FIT", FITS[fit])
    return scene_from(text + more)


def left_at(length):
    """Instant (s) at which the track is so far from the guide's pivot: the law of cosines."""
    return acos((RADIUS**2 - AWAY**2 - length**2) / (2 * AWAY * length)) / SPEED


@pytest.mark.parametrize(("length", "link"), [(0.025, RIGID), (0.05, BENDS)])
@pytest.mark.parametrize(
    ("engine", "fit", "more"),
    [
        ("exudyn", "ideal", ""),
        ("exudyn", "supported", ""),
        ("exudyn", "clearance", ""),
        ("exudyn", "ideal", "solver: {formulation: redundant}"),
        ("lagrangian", "ideal", ""),
        ("lagrangian", "clearance", ""),
    ],
)
def test_a_link_that_leaves_its_guide_is_told_with_the_instant(length, link, engine, fit, more):
    """With clearance it is off the axis by 0.2 mm, which makes a millisecond."""
    result = simulate(scene(length, link, fit, more), engine)
    (told,) = [line for line in result.warnings if "the link of 'sleeve' leaves its guide" in line]
    at = float(told.split("t = ")[1].split()[0])
    blur = 2e-3 if fit == "clearance" else 1e-4
    assert left_at(length) - blur <= at <= left_at(length) + EACH + blur


@pytest.mark.parametrize("fit", FITS)
@pytest.mark.parametrize("engine", ["exudyn", "lagrangian"])
def test_a_link_that_stays_in_its_guide_is_not_spoken_of(engine, fit):
    result = simulate(scene(0.061, RIGID, fit), engine)
    assert result.outcome.completed
    assert not [line for line in result.warnings if "guide" in line]


def test_a_guide_in_metres_for_millimetres_is_told():
    result = simulate(scene(90.0))
    assert "is inside only 0.0012 of its guide's length: check units" in " ".join(result.warnings)


@pytest.mark.parametrize(("tolerance", "coarse"), [(1.0, True), (0.02, True), (1e-3, False)])
@pytest.mark.parametrize("engine", ["exudyn", "lagrangian"])
def test_a_tolerance_that_is_no_small_part_of_the_mechanism_is_told(tolerance, coarse, engine):
    """It reaches 0.13 m."""
    from_file = TRACK.replace("1.0e-6", str(tolerance)).replace("LINK", RIGID)
    own = scene_from(from_file.replace("LENGTH", "0.09").replace("FIT", FITS["ideal"]))
    told = "is more than 10% of the size of the mechanism"
    said = " ".join(check_text(own, assemble_scene(own)).split())
    assert (told in said) == coarse
    assert (told in " ".join(simulate(own, engine).warnings)) == coarse


def test_a_small_body_that_goes_far_has_no_coarse_tolerance():
    """A ball of 10 mm falls 11 m: 1 mm is much of it, and little of its way."""
    ball = """
title: a ball falls
bodies: {ball: {type: rigid, mass: 1, inertia: 4.0e-5, points: {rim: [10 mm, 0]}}}
run: {duration: 1.5}
accuracy: {tolerance: 1 mm}
gravity: [0, -9.81]
"""
    assert simulate(scene_from(ball)).warnings == ()
