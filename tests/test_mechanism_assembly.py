"""The state at time 0 against closed forms, and mechanisms that are odd but right."""

from math import asin, cos, degrees, hypot, pi, radians, sin
from pathlib import Path

import numpy as np
import pytest

from exudyn_flexlink.loading import assemble_scene, load_scene, scene_of
from exudyn_flexlink.mechanism import anchor_position, joint_residuals
from exudyn_flexlink.mechanism.joints import Anchor
from exudyn_flexlink.source import SceneError, parse_document

PAPER = Path(__file__).parents[1] / "models" / "no_clearance.yaml"
SECTION = "material: steel, section: {width: 10 mm, thickness: 2 mm}"
STEEL = "title: test\nmaterials:\n  steel: {density: 7850, youngs_modulus: 200 GPa}\n"
END = "run: {duration: 1}\naccuracy: {tolerance: 1.0e-5}\n"
RING = "curves: {ring: {type: circle, centre: [0, 0], radius: 0.2}}\n"


def assembled(text):
    found = assemble_scene(scene_of(parse_document(STEEL + text + END, "test")))
    closed(found)
    return found


def paper(*settings):
    found = assemble_scene(load_scene(PAPER, settings))
    closed(found)
    return found


def closed(found):
    state = found.state
    residuals = joint_residuals(found.mechanism, state.q[None], state.places[None])
    assert residuals.max(initial=0) < 1e-10


def rods(**lengths):
    lines = (f"  {name}: {{type: rod, length: {x}, {SECTION}}}\n" for name, x in lengths.items())
    return "bodies:\n" + "".join(lines)


def pin(name, first, second, at=""):
    place = f", at: {at}" if at else ""
    return f"  {name}: {{type: revolute, points: [{first}, {second}]{place}}}\n"


FOUR_BAR = (
    rods(crank=0.1, coupler=0.3, rocker=0.25)
    + "joints:\n"
    + pin("a", "ground", "crank.start", "[0, 0]")
    + pin("b", "crank.end", "coupler.start")
    + pin("c", "coupler.end", "rocker.end")
    + pin("d", "ground", "rocker.start", "[0.3, 0]")
    + "drives:\n  m: {type: speed, joint: a, value: 2}\n"
)
# --- the paper's mechanism ------------------------------------------------------------------


def test_the_paper_at_time_0():
    found = paper()
    assert found.degrees_of_freedom == 10  # 9 hinges and the lever
    assert not found.surplus
    assert found.state.q[1] == pytest.approx([0.04, 0, 0], abs=1e-12)
    assert found.state.v[0] == pytest.approx([0, 0, 10], abs=1e-12)
    # P stays at the distance's extremum: it only turns about C, 0.02 m away.
    assert found.state.v[1] == pytest.approx([0, 0.2, 10], abs=1e-12)
    assert found.state.places == pytest.approx([0], abs=1e-12)


@pytest.mark.parametrize("angle", [45, 100, 225, 359, -60, 450])
def test_other_crank_angles_start_in_lap_1_on_the_ellipse(angle):
    found = paper(f"initial={{angles: {{guide: {angle} deg}}}}")
    x, y, turned = found.state.q[1]
    assert turned == pytest.approx(radians(angle))
    assert (x / 0.04) ** 2 + (y / 0.03) ** 2 == pytest.approx(1, abs=1e-9)
    along = (x - 0.02) * cos(turned) + y * sin(turned)
    assert along == pytest.approx(hypot(x - 0.02, y), abs=1e-12)  # ahead of C, not behind it
    # In lap 1 the parameter is the ellipse's own angle.
    expected = np.arctan2(y / 0.03, x / 0.04) % (2 * pi)
    assert found.state.places[0] == pytest.approx(expected, abs=1e-8)


def test_a_spring_rests_as_assembled():
    found = paper("initial={angles: {lever: 20 deg}}", "contacts={}")
    assert found.mechanism.springs[0].rest_angle == pytest.approx(radians(20))
    assert {spring.rest_angle for spring in found.mechanism.springs[1:]} == {0.0}
    told = paper("springs.lever_return.rest_angle=0.1")
    assert told.mechanism.springs[0].rest_angle == 0.1


# --- textbook mechanisms --------------------------------------------------------------------


@pytest.mark.parametrize("side", [1, -1])
def test_a_guess_picks_the_branch_of_a_four_bar(side):
    guess = f"initial: {{angles: {{crank: 60 deg}}, guesses: {{rocker: {side * 70} deg}}}}\n"
    found = assembled(FOUR_BAR + guess)
    assert found.degrees_of_freedom == 0
    joint = anchor_position(Anchor(2, 0.25, 0), found.state.q)
    end = 0.1 * np.array([cos(pi / 3), sin(pi / 3)])
    # Intersection of two circles about the crank's end and the rocker's pivot.
    base = np.array([0.3, 0]) - end
    distance = np.linalg.norm(base)
    along = (0.3**2 - 0.25**2 + distance**2) / (2 * distance)
    height = (0.3**2 - along**2) ** 0.5
    left = np.array([-base[1], base[0]]) / distance
    assert joint == pytest.approx(end + along * base / distance + side * height * left, abs=1e-10)


STEPHENSON = """bodies:
  crank: {type: rigid, mass: 1, inertia: 0.002, points: {A0: [0, 0], A: [0.06, 0]}}
  coupler: {type: rigid, mass: 2, inertia: 0.02, points: {A: [0, 0], B: [0.18, 0], C: [0.09, 0.08]}}
  rocker: {type: rigid, mass: 1, inertia: 0.01, points: {B0: [0, 0], B: [0.14, 0]}}
  link: {type: rigid, mass: 1, inertia: 0.005, points: {C: [0, 0], D: [0.2, 0]}}
  output: {type: rigid, mass: 2, inertia: 0.02, points: {D0: [0, 0], D: [0.15, 0]}}
joints:
""" + "".join(
    [
        pin("A0", "ground", "crank.A0", "[0, 0]"),
        pin("B0", "ground", "rocker.B0", "[0.2, 0]"),
        pin("D0", "ground", "output.D0", "[0.2, 0.15]"),
        pin("A", "crank.A", "coupler.A"),
        pin("B", "coupler.B", "rocker.B"),
        pin("C", "coupler.C", "link.C"),
        pin("D", "link.D", "output.D"),
    ]
)


@pytest.mark.parametrize("crank", [30, 130, 250])
@pytest.mark.parametrize("guesses", ["{}", "{coupler: 20 deg, rocker: 90 deg}"])
def test_a_load_at_the_output_of_a_six_bar_leaves_its_angle_open(crank, guesses):
    """The joints can't have the output at 0, where a drive's part stands if it can."""
    drives = """drives:
  motor: {type: speed, joint: A0, value: 10}
  fan: {type: torque, joint: D0, value: -0.05 * speed(D0)}
"""
    initial = f"initial: {{angles: {{crank: {crank} deg}}, guesses: {guesses}}}\n"
    state = assembled(STEPHENSON + drives + initial).state
    assert state.q[0, 2] == pytest.approx(radians(crank))


@pytest.mark.parametrize("angle", [0, 90, 180, 270])
def test_a_slot_that_runs_clockwise(angle):
    points = [
        (0.1 * cos(t), -0.1 * sin(t)) for t in np.linspace(0, 2 * pi, 24, endpoint=False).tolist()
    ]
    curve = f"curves:\n  c: {{type: spline, points: {[list(p) for p in points]}}}\n"
    text = (
        curve
        + rods(guide=0.2, link=0.1)
        + "joints:\n"
        + pin("crank", "ground", "guide.start", "[0.02, 0]")
        + "  sleeve: {type: sleeve, guide: guide, link: link}\n"
        + "  track: {type: slot, point: link.start, curve: c}\n"
        + f"initial: {{angles: {{guide: {angle} deg}}, speeds: {{guide: 3}}}}\n"
    )
    found = assembled(text)
    x, y, turned = found.state.q[1]
    assert hypot(x, y) == pytest.approx(0.1, abs=1e-6)
    assert (x - 0.02) * cos(turned) + y * sin(turned) > 0
    assert found.state.v[1, 2] == pytest.approx(3)


# --- flexible links -------------------------------------------------------------------------

STRIP = (
    f"  strip: {{type: flexible, length: 0.2, {SECTION}, rods: 5, hinges: {{stiffness: beam}}}}\n"
)


@pytest.mark.parametrize("guess", ["", "initial: {guesses: {rocker: 80 deg}}\n"])
def test_a_flexible_coupler_starts_straight(guess):
    joints = (
        pin("a", "ground", "crank.start", "[0, 0]")
        + pin("b", "crank.end", "strip.start")
        + pin("c", "strip.end", "rocker.end")
        + pin("d", "ground", "rocker.start", "[0.2, 0]")
    )
    drive = "drives:\n  m: {type: speed, joint: a, value: 3}\n"
    found = assembled(rods(crank=0.05, rocker=0.1) + STRIP + "joints:\n" + joints + drive + guess)
    angles = found.state.q[2:, 2]
    assert angles == pytest.approx(angles[0], abs=1e-9)
    assert abs(degrees(angles[0])) > 1
    assert found.state.v[2:, 2] == pytest.approx(found.state.v[2, 2], abs=1e-9)
    assert found.degrees_of_freedom == 4


def test_a_strip_too_long_between_its_pins_starts_bent():
    joints = "joints:\n" + pin("a", "ground", "strip.start", "[0, 0]")
    joints += pin("b", "ground", "strip.end", "[0.19, 0]")
    found = assembled("bodies:\n" + STRIP + joints)
    assert np.ptp(found.state.q[:, 2]) > 0.1
    assert found.degrees_of_freedom == 3


# --- what can't be --------------------------------------------------------------------------


def test_a_second_weld_is_named_with_its_surplus():
    welds = "joints:\n  one: {type: weld, points: [ground, rod.start], at: [0, 0]}\n"
    welds += "  two: {type: weld, points: [ground, rod.end], at: [0.2, 0]}\n"
    with pytest.raises(SceneError, match=r"joints\.two: this joint holds 3 times what others"):
        assembled(rods(rod=0.2) + welds)


def test_the_drive_that_contradicts_is_named_not_the_joint():
    drives = FOUR_BAR + "  n: {type: speed, joint: d, value: 70}\n"
    guess = "initial: {angles: {crank: 60 deg}, guesses: {rocker: 70 deg}}\n"
    with pytest.raises(SceneError, match=r"drives\.n: the mechanism can't follow"):
        assembled(drives + guess)


# --- a link with clearance --------------------------------------------------------------------


def loose(*settings, model="clearance"):
    found = assemble_scene(load_scene(PAPER.with_name(f"{model}.yaml"), settings))
    closed(found)
    return found


@pytest.mark.parametrize("model", ["clearance", "supported"])
@pytest.mark.parametrize("angle", [0, 45, 90, 179, 225, 300])
def test_a_link_in_walls_starts_as_one_on_the_axis(model, angle):
    turned = f"initial={{angles: {{guide: {angle} deg}}}}"
    found, ideal = loose(turned, model=model), paper(turned)
    assert found.state.q == pytest.approx(ideal.state.q, abs=1e-12)
    assert found.state.v == pytest.approx(ideal.state.v, abs=1e-10)
    assert found.state.places == pytest.approx(ideal.state.places, abs=1e-12)
    assert not found.surplus
    # 9 hinges and the lever; with clearance the place of P and the direction of the link too.
    assert found.degrees_of_freedom == {"clearance": 12, "supported": 10}[model]


def force_on_link(found):
    """Force (N) that accelerates the link, and its moment about P (N m)."""
    state, parts = found.state, found.mechanism.parts
    force, moment = np.zeros(2), 0.0
    for i in found.mechanism.bodies["link"]:
        angle, part = state.q[i, 2], parts[i]
        arm = part.centre[0] * np.array([cos(angle), sin(angle)])
        across = np.array([-arm[1], arm[0]])
        of_centre = state.a[i, :2] + state.a[i, 2] * across - state.v[i, 2] ** 2 * arm
        lever = state.q[i, :2] + arm - state.q[1, :2]
        force += part.mass * of_centre
        moment += part.mass * (lever[0] * of_centre[1] - lever[1] * of_centre[0])
        moment += part.inertia * state.a[i, 2]
    return force, moment


@pytest.mark.parametrize("angle", [60, 90, 200])
def test_only_the_track_acts_on_a_link_free_in_its_guide(angle):
    turned = f"initial={{angles: {{guide: {angle} deg}}}}"
    found = loose(turned)
    force, moment = force_on_link(found)
    along = found.mechanism.slots[0].curve.tangent(found.state.places[0])
    assert np.linalg.norm(force) > 1e-3
    assert force @ along == pytest.approx(0, abs=1e-12)
    assert moment == pytest.approx(0, abs=1e-14)
    assert abs(force_on_link(paper(turned))[1]) > 1e-6  # there the guide turns rod 1


@pytest.mark.parametrize("guide", [0, 90, 200])
def test_a_link_may_start_askew_in_its_guide(guide):
    angles = f"initial={{angles: {{guide: {guide} deg, link: {guide + 2} deg}}}}"
    found, ideal = loose(angles), paper(f"initial={{angles: {{guide: {guide} deg}}}}")
    assert found.state.q[1:11, 2] == pytest.approx(radians(guide + 2))
    assert found.state.q[0, 2] == pytest.approx(radians(guide))
    # P stays where it is without clearance: where the guide's axis meets the track.
    assert found.state.q[1, :2] == pytest.approx(ideal.state.q[1, :2], abs=1e-12)


@pytest.mark.parametrize("spin", [-3.0, 0.0, 10.0, 14.0])
def test_a_link_may_turn_against_its_guide_at_the_start(spin):
    found = loose(f"initial.speeds.link={spin}")
    assert found.state.v[1:11, 2] == pytest.approx(spin)
    assert found.state.v[0, 2] == pytest.approx(10)
    assert found.state.q[1:11, 2] == pytest.approx(0)


def test_the_start_of_the_link_may_run_along_its_track():
    found = loose("initial={velocities: {link: [0, -0.3]}, speeds: {link: 4}}")
    assert found.state.v[1] == pytest.approx([0, -0.3, 4], abs=1e-12)
    # The rods move as one: the start of rod k is 7 mm times k - 1 away.
    assert found.state.v[1:11, 1] == pytest.approx(-0.3 + 4 * 0.007 * np.arange(10))


# --- given velocities -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("initial", "place"),
    [
        ("{velocities: {link: [0.1, 0]}}", "velocities.link: this velocity"),
        ("{speeds: {link: 1}, velocities: {link: [0.1, 0]}}", "velocities.link: this velocity"),
        ("{speeds: {guide: 1, link: 2}}", "speeds.guide: this speed"),
        ("{speeds: {link: 2}, velocities: {guide: [0, 0.1]}}", "velocities.guide: this velocity"),
    ],
)
def test_what_contradicts_the_joints_is_named_where_it_stands(initial, place):
    with pytest.raises(SceneError, match=rf"initial\.{place} contradicts"):
        loose(f"initial={initial}")


def test_a_loop_with_one_angle_too_many_says_which_are_held():
    text = """bodies:
  crank: {type: rigid, mass: 1, inertia: 0.01, points: {a: [0, 0], b: [0.1, 0]}}
  coupler: {type: rigid, mass: 1, inertia: 0.01, points: {a: [0, 0], b: [0.3, 0]}}
  rocker: {type: rigid, mass: 1, inertia: 0.01, points: {a: [0, 0], b: [0.25, 0]}}
joints:
  a: {type: revolute, points: [ground, crank.a], at: [0, 0]}
  b: {type: revolute, points: [crank.b, coupler.a]}
  c: {type: revolute, points: [coupler.b, rocker.b]}
  d: {type: revolute, points: [ground, rocker.a], at: [0.35, 0]}
"""
    with pytest.raises(SceneError, match=r"holds one too many \('crank', 'rocker'\)"):
        assembled(text + "initial: {angles: {crank: 30 deg, rocker: 30 deg}}\n")
    state = assembled(
        text + "initial: {angles: {crank: 30 deg}, guesses: {rocker: 90 deg}}\n"
    ).state
    assert state.q[0, 2] == pytest.approx(radians(30))


def test_a_slot_whose_arm_reaches_beyond_its_end_is_refused():
    text = """curves: {rail: {type: line, from: [0, 0.1], to: [1, 0.1]}}
bodies: {arm: {type: rigid, mass: 1, inertia: 0.01, points: {foot: [0, 0], tip: [1.5, 0]}}}
joints:
  pivot: {type: revolute, points: [ground, arm.foot], at: [0, 0]}
  slot: {type: slot, point: arm.tip, curve: rail}
"""
    away = 1.5 * cos(asin(0.1 / 1.5)) - 1  # m
    with pytest.raises(SceneError, match=rf"joints\.slot: the point .*: {away:.3g} m missing"):
        assembled(text)


def test_a_place_beyond_the_end_of_a_curve_is_refused():
    text = """curves: {rail: {type: line, from: [0, 0], to: [1, 0]}}
bodies: {bead: {type: rigid, mass: 1, inertia: 0, points: {c: [0, 0]}}}
joints: {slot: {type: slot, point: bead.c, curve: rail}}
"""
    assert assembled(text + "initial: {positions: {bead: [1, 0]}}\n").state.q[0, 0] == 1
    with pytest.raises(SceneError, match=r"do not allow this position: 0\.2 m missing"):
        assembled(text + "initial: {positions: {bead: [1.2, 0]}}\n")


def test_a_rod_is_a_chord_of_a_ring():
    slots = "joints:\n  x: {type: slot, point: rod.start, curve: ring}\n"
    slots += "  y: {type: slot, point: rod.end, curve: ring}\n"
    x, y, turned = assembled(RING + rods(rod=0.2) + slots).state.q[0]
    middle = hypot(x + 0.1 * cos(turned), y + 0.1 * sin(turned))
    assert middle == pytest.approx(0.2 * cos(radians(30)), abs=1e-10)
