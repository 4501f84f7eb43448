"""A scene without some of its effects: a scene in, a checked scene out."""

import json

import numpy as np
import pytest
from cli_runs import MODELS
from hypothesis import given, settings
from hypothesis import strategies as st
from results import scene_from

from exudyn_flexlink.effects import EFFECTS, absent, idealise
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import assemble_scene, document_of, load_scene, scene_of
from exudyn_flexlink.mechanism import build_mechanism
from exudyn_flexlink.observables import force_deviations
from exudyn_flexlink.report import check_text
from exudyn_flexlink.scene import check_document, parse_scene
from exudyn_flexlink.shipped import EFFECT_NAMES
from exudyn_flexlink.source import parse_document

FILES = sorted(MODELS.glob("*.yaml"))
ROUNDED = 1e-12  # N, or of the force: what rounding leaves, also in a tight run, with more steps


@pytest.fixture(scope="module")
def whole():
    return load_scene(MODELS / "clearance_friction.yaml")


def test_the_command_line_knows_all_effects_by_name():
    assert tuple(EFFECTS) == EFFECT_NAMES


@pytest.mark.parametrize("effect", EFFECTS)
def test_each_effect_goes_and_stays_away(whole, effect):
    without = idealise(whole, [effect])
    assert without != whole
    assert effect in absent(without, EFFECTS)
    assert idealise(without, [effect]) == without
    assert not assemble_scene(without).surplus


def test_without_an_effect_the_models_become_one_another(whole):
    def data(scene):
        """All but title and accuracy, which walls ask more of."""
        return {k: v for k, v in scene.to_data().items() if k not in {"title", "accuracy"}}

    def model(name):
        return data(load_scene(MODELS / f"{name}.yaml"))

    assert data(idealise(whole, ["friction"])) == model("clearance")
    assert data(idealise(whole, ["clearance"])) == model("no_clearance")
    assert data(idealise(whole, ["clearance", "flexibility"])) == model("rigid")
    smooth = idealise(load_scene(MODELS / "no_clearance.yaml",
                                 ["bodies.link.hinges.stiffness=beam"]), ["impact"])  # fmt: skip
    assert data(smooth) == model("smooth")


def test_an_effect_that_does_not_exist(whole):
    with pytest.raises(ValueError, match=r"no effect 'frction'; there is: clearance, "):
        idealise(whole, ["frction"])


# --- what goes with the impact ----------------------------------------------------------------

TWO_RODS = """title: a hammer and an anvil
materials:
  steel: {density: 7850, youngs_modulus: 200 GPa}
bodies:
  hammer: {type: rod, length: 0.2, material: steel, section: {width: 10 mm, thickness: 2 mm}}
  anvil: {type: rod, length: 0.2, material: steel, section: {width: 10 mm, thickness: 2 mm}}
  spare: {type: rod, length: 0.1, material: steel, section: {width: 10 mm, thickness: 2 mm}}
joints:
  one: {type: revolute, points: [ground, hammer.end], at: [0, 0]}
  two: {type: revolute, points: [ground, anvil.start], at: [-0.3, -0.1]}
  three: {type: revolute, points: [ground, spare.start], at: [0, 0]}
springs:
  of_anvil: {type: torsional, joint: two, stiffness: 1}
  of_spare: {type: torsional, joint: three, stiffness: 1}
contacts:
  hit: {type: point_on_line, point: hammer.start, line: [anvil.start, anvil.end],
        law: {stiffness: 1.0e4, restitution: 0.5}}
initial:
  angles: {anvil: 0, hammer: 0}
  speeds: {anvil: 0, hammer: 1}
run: {duration: 0.1}
accuracy: {tolerance: 1.0e-4}
"""


def two_rods(old="", new=""):
    assert old in TWO_RODS
    return scene_of(parse_document(TWO_RODS.replace(old, new), "test"))


def test_only_the_struck_body_goes_with_the_impact_and_all_that_names_it():
    bare = idealise(two_rods(), ["impact"])
    assert list(bare.bodies) == ["hammer", "spare"]
    assert list(bare.joints) == ["one", "three"]
    assert list(bare.springs) == ["of_spare"]
    assert bare.contacts == {}
    assert bare.initial.angles == {"hammer": 0}
    assert bare.initial.speeds == {"hammer": 1}


BUFFER = """title: a hammer and a sprung buffer, which carries a curve
curves:
  plate: {type: line, on: buffer, from: [0, -0.1], to: [0, 0.1]}
bodies:
  way: {type: rigid, mass: 1, inertia: 1, points: {tip: [0.1, 0], low: [0, -0.1]}}
  buffer: {type: rigid, mass: 1, inertia: 1, points: {c: [0, 0], low: [0, -0.1], high: [0, 0.1]}}
joints:
  pivot: {type: revolute, points: [ground, way.centre], at: [0, 0]}
  way: {type: prismatic, points: [ground, buffer.c], at: [0.2, 0], axis: [1, 0]}
springs:
  back: {type: linear, joint: way, stiffness: 100, length: 0}
contacts:
  hit: {type: point_on_line, point: way.tip, line: [buffer.low, buffer.high],
        law: {stiffness: 1.0e4, restitution: 0.5}}
  low: {type: point_on_curve, point: way.low, curve: plate,
        law: {stiffness: 1.0e4, restitution: 0.5}}
initial:
  angles: {way: 0}
  along: {way: 0}
  speeds_along: {way: 0}
  velocities: {buffer: [0, 0]}
run: {duration: 0.1}
accuracy: {tolerance: 1.0e-4}
"""


def test_what_is_given_of_a_joint_goes_with_it_though_a_body_has_its_name():
    scene = scene_of(parse_document(BUFFER, "test"))
    bare = idealise(scene, ["impact"])
    assert list(bare.bodies) == ["way"]
    assert not bare.curves
    assert not bare.springs
    given = {key for key, value in bare.initial if value}
    assert given == {"angles"}
    assert not assemble_scene(bare).surplus


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("run: {duration: 0.1}", "run: {turns: 1, of: two, at_most: 0.1}"),
        ("contacts:", "drives:\n  d: {type: torque, joint: two, value: 1}\ncontacts:"),
        ("[ground, spare.start], at: [0, 0]", "[anvil.end, spare.start]"),
        (
            "materials:",
            "curves:\n  c: {type: circle, centre: [-0.3, -0.1], radius: 0.2}\nmaterials:",
        ),
    ],
    ids=["turns that end the run", "drive", "another body", "slot"],
)
def test_a_struck_body_stays_where_something_else_needs_it(old, new):
    if "curves" in new:
        slot = "  track: {type: slot, point: anvil.end, curve: c}\nsprings:"
        text = TWO_RODS.replace(old, new).replace("springs:", slot)
        scene = check_document(parse_document(text, "test")).to_scene()
    else:
        scene = two_rods(old, new)
    bare = idealise(scene, ["impact"])
    assert set(bare.bodies) == set(scene.bodies)
    assert bare.contacts == {}


# --- what stays -------------------------------------------------------------------------------


def test_restitution_stays_without_damping(whole):
    undamped = idealise(whole, ["damping"])
    assert undamped.contacts == whole.contacts
    assert undamped.joints == whole.joints


def test_a_spring_without_damping_has_none_to_leave_out():
    """Whether that is said with a number or by silence."""
    for said in ("", ", damping: 0", ", damping_ratio: 0"):
        scene = two_rods("joint: two, stiffness: 1", f"joint: two, stiffness: 1{said}")
        assert absent(scene, ["damping"]) == ["damping"]
    scene = two_rods("joint: two, stiffness: 1", "joint: two, stiffness: 1, damping: 0.1")
    assert absent(scene, ["damping"]) == []
    assert idealise(scene, ["damping"]).springs["of_anvil"].damping is None


@pytest.mark.parametrize("layout", ["equal", "half_ends"])
@pytest.mark.parametrize("slender", ["true", "false"])
def test_a_rigid_link_has_the_mass_and_the_inertia_of_the_flexible_one(layout, slender):
    settings = [f"bodies.link.layout={layout}", f"bodies.link.slender={slender}"]
    flexible = load_scene(MODELS / "clearance.yaml", settings)
    rigid = idealise(flexible, ["flexibility"])
    assert rigid.bodies["link"].slender == (slender == "true")
    (one,) = (p for p in assemble_scene(rigid).mechanism.parts if p.body == "link")
    assembly = assemble_scene(flexible)
    rods = [(i, p) for i, p in enumerate(assembly.mechanism.parts) if p.body == "link"]
    start = assembly.state.q[rods[0][0], :2]
    # Rods in one line, about the start of the first: Steiner.
    arms = [np.linalg.norm(assembly.state.q[i, :2] - start) + p.centre[0] for i, p in rods]
    about = sum(p.inertia + p.mass * a**2 for (_, p), a in zip(rods, arms, strict=True))
    assert one.inertia_about_origin == pytest.approx(about, rel=1e-12)
    assert one.mass == pytest.approx(sum(p.mass for _, p in rods), rel=1e-12)
    assert assemble_scene(rigid).mechanism.channels[0].lengths[0] == pytest.approx(0.07)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.sampled_from(sorted(EFFECTS)), max_size=8), st.sampled_from(FILES))
def test_any_list_of_effects_does_what_its_set_does_in_any_order(effects, path):
    scene = load_scene(path)
    bare = idealise(scene, set(effects))
    for effect in effects:
        scene = idealise(scene, [effect])
    assert scene == bare
    assert set(effects) <= set(absent(bare, EFFECTS))
    assert parse_scene(parse_document(json.dumps(bare.to_data()), "test")) == bare
    assert bare.document is scene.document


@pytest.mark.parametrize("joint", ["sleeve", "crank"])
def test_at_clearance_0_a_law_is_idle(joint):
    """The mechanism is that without the law, from which a study goes on to any clearance."""
    law = "{stiffness: 1.0e5, restitution: 0.5, friction: 0.1}"
    more = ["joints.crank.radius=5 mm"] if joint == "crank" else []
    model = MODELS / "no_clearance.yaml"
    ideal = load_scene(model, ["joints.crank.clearance=0"])
    idle = load_scene(model, [f"joints.{joint}.clearance=0", f"joints.{joint}.law={law}", *more])
    assert idle.joints[joint].law is not None
    assert build_mechanism(idle) == build_mechanism(ideal)
    assert {"clearance", "friction"} <= set(absent(idle, EFFECTS))
    assert check_text(idle, assemble_scene(idle)).count("idle") == 1
    wider = scene_of(document_of(idle), [f"joints.{joint}.clearance=1 mm"])
    assert {"clearance", "friction"}.isdisjoint(absent(wider, EFFECTS))


# --- slides and springs ---------------------------------------------------------------------------

SPRUNG = """title: a buffer that a block strikes
bodies:
  block: {type: rigid, mass: 1, inertia: 1, points: {b: [0, 0]}}
  buffer: {type: rigid, mass: 1, inertia: 1, points: {p: [0, 0], low: [0, -1], high: [0, 1]}}
joints:
  way: {type: prismatic, points: [ground, block.b], at: [0, 0], axis: [1, 0.5]}
  stop: {type: prismatic, points: [ground, buffer.p], at: [1, 0.5], axis: [1, 0.5]}
springs:
  hold: {type: linear, joint: stop, stiffness: 100, damping: 3}
  pull: {type: linear, points: [ground, block.b], at: [-1, 0], stiffness: 20, length: 0.5}
contacts:
  strike: {type: point_on_line, point: block.b, line: [buffer.low, buffer.high],
           law: {stiffness: 1.0e4, restitution: 0.5}}
initial: {velocities: {block: [2, 1]}}
run: {duration: 0.2}
accuracy: {tolerance: 1.0e-6}
"""


@pytest.fixture(scope="module")
def scene():
    return scene_from(SPRUNG)


def test_forces_of_slides_and_springs_have_errors_that_bound_the_true_ones(scene):
    run = simulate(scene, measure=True)
    tight = scene.changed(accuracy=type(scene.accuracy).model_validate({"tolerance": 1e-10}))
    true = force_deviations(run, simulate(tight, measure=False))
    told = run.error.forces
    ours = {f"joint force of {name}" for name in ("way", "stop")}
    ours |= {f"spring force of {name}" for name in ("hold", "pull")}
    assert set(told) == ours | {"contact force of strike"}
    for name in ours:
        off, bound = true[name].free, told[name].free
        assert off is not None
        assert bound is not None
        assert off.largest <= max(bound.largest, ROUNDED * max(1.0, bound.size))
        assert bound.largest <= max(1e-3 * bound.size, ROUNDED)


def test_check_names_ways_and_springs(scene):
    lines = [
        " ".join(line.split()) for line in check_text(scene, assemble_scene(scene)).split("\n")
    ]
    assert "way prismatic ground and block.b at (0, 0) m along (1, 0.5)" in lines
    assert "hold along stop k 100 N/m c 3 N s/m" in lines
    assert "pull between ground and block.b at (-1, 0) m k 20 N/m no damper" in lines
    assert "damping simulated hold" in lines


def test_a_buffer_that_a_spring_ties_to_another_body_stays(scene):
    tie = "  tie: {type: linear, points: [block.b, buffer.p], stiffness: 1}\ncontacts:"
    tied = idealise(scene_from(SPRUNG.replace("contacts:", tie)), ["impact"])
    assert list(tied.bodies) == ["block", "buffer"]


def test_dampers_given_by_a_ratio_go_with_damping():
    """A lever on its spring then swings for ever: no energy is lost."""
    text = """title: lever
bodies: {lever: {type: rigid, mass: 1, inertia: 0.1, points: {hub: [0, 0]}}}
joints: {pivot: {type: revolute, points: [ground, lever.hub], at: [0, 0]}}
springs: {s: {type: torsional, joint: pivot, frequency: 5 Hz, damping_ratio: 0.2, rest_angle: 0}}
initial: {angles: {lever: 0.3}}
run: {duration: 0.5}
accuracy: {tolerance: 1.0e-7}
"""
    damped = scene_of(parse_document(text, "lever.yaml"))
    lost = [
        simulate(scene, measure=False).energy.dissipated[-1]
        for scene in (damped, idealise(damped, ["damping"]))
    ]
    assert lost[0] > 0.9 * 0.5 * 0.1 * (10 * np.pi) ** 2 * 0.3**2
    assert lost[1] == 0
