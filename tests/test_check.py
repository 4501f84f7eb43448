"""What `check` says of sleeves, and of the effects that a scene has."""

from dataclasses import replace
from math import pi, sqrt

import pytest
from cli_runs import MODELS

from exudyn_flexlink.cli import main
from exudyn_flexlink.effects import EFFECTS, absent, idealise
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import assemble_scene, load_scene
from exudyn_flexlink.report import check_text, effects_table
from exudyn_flexlink.report.text import lines_of, number

MASS_PER_LENGTH = 7850 * 10e-3 * 0.5e-3  # kg/m, of the link


@pytest.fixture(autouse=True)
def closed_this_way(monkeypatch):
    """Search no other ways to close the joints, which takes most of a check; elsewhere they are."""
    monkeypatch.setattr("exudyn_flexlink.report.parts.other_ways", lambda *_: [])


def model(name, *settings):
    return load_scene(MODELS / f"{name}.yaml", settings)


def said_of(scene):
    return check_text(scene, assemble_scene(scene))


def effects_of(scene):
    return lines_of(effects_table(scene, assemble_scene(scene).mechanism))


def simulated(scene):
    """Effects that `check` lists as simulated."""
    lines = effects_of(scene)
    return {line.split("  ")[1] for line in lines if " simulated" in line}


@pytest.mark.parametrize("name", ["clearance_friction", "supported"])
def test_effects_said_to_be_simulated_are_those_that_can_be_left_out(name):
    scene = model(name)
    whole = simulated(scene)
    assert "\n".join(effects_of(scene)) in said_of(scene)
    assert whole & set(EFFECTS) == set(EFFECTS) - set(absent(scene, EFFECTS))
    for effect in EFFECTS:
        left = simulated(idealise(scene, [effect]))
        assert effect not in left
        assert left <= whole


def test_walls_are_told_with_their_law_and_the_pairs_that_can_touch():
    said = said_of(model("clearance_friction"))
    assert "link in guide, clearance 0.005 m on each side\n" in said
    row = said[said.index("  sleeve  link on the walls") :].split()
    # 11 nodes on two walls, 10 rods on four corners. The row is broken into two lines.
    assert " ".join(row[1:12]) == "link on the walls of guide, k 100000 N/m restitution 0.5"
    assert " ".join(row[12:18]) == "friction 62 pairs can touch 0.15"
    assert "Degrees of freedom: 13\n" in said  # 9 hinges, lever, place and angle of the link, crank


def test_a_supported_link_is_told_with_what_holds_it():
    said = said_of(model("supported"))
    assert "link in guide, every rod inside held on its axis\n" in said
    assert "link on the axis of guide, held at up  k 100000 N/m" in said
    assert " to 31 points\n" in said
    assert "Degrees of freedom: 11\n" in said


@pytest.mark.parametrize(
    ("name", "setting", "told"),
    [
        ("no_clearance", "run.turns=1", "minimal: "),
        ("no_clearance", "accuracy={step: 1.0e-4}", "redundant: "),
        ("smooth", "solver.formulation=beam", "beam: "),
    ],
)
def test_the_formulation_is_told(name, setting, told):
    assert f"  formulation  {told}" in " ".join(said_of(model(name, setting)).split("   "))


def half_period(said):
    words = next(line for line in said.splitlines() if "contact with a wall" in line).split()
    return float(words[words.index("about") + 1])


def test_a_touch_of_a_wall_lasts_half_a_period_of_the_lightest_node():
    """A free rod opposes m / 4 to a force at its end; its guide gives way like m l^2 / 3 / l^2."""
    text = (
        "bodies={guide: {type: rod, length: 0.09, material: steel, section: {width: 1, "
        "thickness: 1}}, link: {type: rod, length: 0.07, material: steel, section: "
        "{width: 10 mm, thickness: 0.5 mm}}}"
    )
    loose = ["joints={sleeve: {type: sleeve, guide: guide, link: link, clearance: 5 mm, "
             "law: {stiffness: 1.0e5, restitution: 0.5}}, "
             "crank: {type: revolute, points: [ground, guide.start], at: [0, 0]}}"]  # fmt: skip
    scene = model("smooth", text, *loose)
    mass = MASS_PER_LENGTH * 0.07 / 4
    assert half_period(said_of(scene)) == pytest.approx(pi * sqrt(mass / 1e5), rel=1e-3)
    stiff = model("smooth", text, *loose, "joints.sleeve.law.stiffness=9e5")
    assert half_period(said_of(stiff)) == pytest.approx(pi * sqrt(mass / 9e5), rel=1e-3)


RAILS = """
title: Bodies that springs hold
bodies:
  cart: {type: rigid, mass: 2, inertia: 0.3, points: {hook: [0.1, 0]}}
  top: {type: rigid, mass: 5, inertia: 0.3, points: {foot: [0, 0]}}
  bob: {type: rigid, mass: 3, inertia: 0.4, centre_of_mass: [0.5, 0], points: {eye: [0, 0]}}
joints:
  rail: {type: prismatic, points: [ground, cart.hook], at: [0, 0], axis: [3, 4]}
  riser: {type: prismatic, points: [cart.hook, top.foot], axis: [0, 1]}
  pivot: {type: revolute, points: [bob.eye, ground], at: [1, 0]}
springs:
  one: {type: linear, joint: rail, stiffness: 700, damping: 4}
  two: {type: linear, joint: rail, stiffness: 100, damping: 4}
  three: {type: linear, joint: riser, stiffness: 100}
  four: {type: torsional, joint: pivot, stiffness: 30, damping: 2}
  five: {type: torsional, joint: pivot, stiffness: 16}
run: {duration: 1}
accuracy: {tolerance: 1.0e-6}
"""


@pytest.mark.parametrize("alone", [True, False])
def test_frequencies_of_bodies_on_sprung_joints_are_told(tmp_path, alone):
    """omega^2 = k/m along a rail, k/J about a pivot, of all springs there; for what is alone."""
    text = RAILS
    if alone:
        lines = RAILS.splitlines(keepends=True)
        text = "".join(line for line in lines if not {"top:", "riser:", "three:"} & {*line.split()})
    (tmp_path / "model.yaml").write_text(text)
    said = said_of(load_scene(tmp_path / "model.yaml"))
    rail = f"along rail {sqrt(800 / 2) / (2 * pi):.2f} Hz damping ratio {8 / (2 * 40):.1f}"
    inertia = 0.4 + 3 * 0.5**2
    pivot = f"about pivot {sqrt(46 / inertia) / (2 * pi):.2f} Hz"
    told = " ".join(said.split())
    assert (rail in told) == alone
    assert pivot in told
    assert "riser" not in told.partition("Natural frequencies")[2].partition("Run")[0]


def test_check_leaves_effects_out(capsys):
    few = [str(MODELS / "clearance_friction.yaml"), "--set=bodies.link.rods=2"]
    assert main(["check", *few, "--without", "friction,clearance", "--without", "impact"]) == 0
    shown = capsys.readouterr()
    assert shown.err == ""
    assert "(without friction, clearance, impact)\n" in shown.out
    assert "lever" not in shown.out.split("Bodies")[1]
    assert "Contacts" not in shown.out


@pytest.mark.parametrize(
    ("name", "setting"),
    [
        ("no_clearance", "accuracy.step=3.2e-5"),
        ("no_clearance", "accuracy.step=2e-6"),
        ("clearance", "solver.formulation=redundant"),  # half as many for a wall as for a strike
        ("hard/undamped", "solver.formulation=redundant"),  # twice as many, to lose nothing
    ],
)
def test_check_names_the_steps_per_contact_of_the_run(name, setting):
    scene = model(name, setting, "run={duration: 1e-4}")
    found = simulate(scene, measure=False).checks.steps_per_contact
    assert f"in contact: {number(found)} steps per contact" in said_of(scene)


@pytest.mark.parametrize("formulation", ["redundant", "beam"])
@pytest.mark.parametrize(
    ("name", "stands", "said"),
    [
        ("textbook/cam_follower", "type: point_on_curve", "cam_face: Exudyn's own solver has no"),
        ("benchmarks/bouncing_ball_impulse", "{type: impulse", "hit.law: redundant coordinates"),
    ],
)
def test_check_refuses_a_formulation_that_a_contact_is_beyond(
    name, stands, said, formulation, capsys
):
    file = MODELS / f"{name}.yaml"
    assert main(["check", str(file), "--set", f"solver.formulation={formulation}"]) == 2
    shown = capsys.readouterr()
    lines = file.read_text().splitlines()
    line = next(i for i, text in enumerate(lines) if stands in text)
    place = f"{file.name}:{line + 1}:{lines[line].index(stands) + 1}"
    assert f"{place}: contacts.{said}" in shown.err
    assert shown.out == ""


CART = """
title: A cart on a slope
bodies: {cart: {type: rigid, mass: 1, inertia: 1}}
joints: {way: {type: prismatic, points: [ground, cart.centre], at: [1, 2], axis: [3, 4]}}
initial: {along: {way: 0.1}}
run: {duration: 1}
accuracy: {tolerance: 1.0e-6}
"""


def test_the_start_tells_places_along_slides_and_no_rounding(tmp_path):
    """A body that assembly has left turned by rounding is told to be at 0."""
    (tmp_path / "model.yaml").write_text(CART)
    scene = load_scene(tmp_path / "model.yaml")
    assembly = assemble_scene(scene)
    turned = assembly.state.q.copy()
    turned[0, 2] = -1e-19
    assembly = replace(assembly, state=replace(assembly.state, q=turned))
    start = check_text(scene, assembly).partition("\nStart\n")[2].splitlines()
    assert [line.strip() for line in start[:2]] == ["cart 0 deg", "along way 0.1 m"]


def test_it_says_where_springs_rest():
    """Those that rest as assembled say so."""
    rest = "springs.lever_return.rest_angle=-10 deg"
    assert "\nSprings rest at\n  lever_return  -10 deg\n" in said_of(model("rigid", rest))
    assert "\nSprings rest at\n  lever_return  0 deg, as assembled\n" in said_of(model("rigid"))
