"""Words of textbooks and of other programs lead to those of a model file."""

import re

import pytest

from exudyn_flexlink.loading import scene_of
from exudyn_flexlink.scene import json_schema
from exudyn_flexlink.scene.wording import OTHER_WORDS, did_you_mean_word
from exudyn_flexlink.source import SceneError, parse_document

MODEL = """
title: pendulum
materials: {steel: {density: 7850, youngs_modulus: 200 GPa}}
bodies:
  rod: {type: rod, length: 0.2, material: steel, section: {width: 10 mm, thickness: 2 mm}}
  bob: {type: rigid, mass: 1, inertia: 0.1}
joints:
  pin: {type: revolute, points: [ground, rod.start], at: [0, 0]}
  bolt: {type: weld, points: [rod.end, bob.centre]}
springs:
  coil: {type: torsional, joint: pin, stiffness: 1, damping: 0.1}
drives:
  motor: {type: torque, joint: pin, value: 1}
contacts:
  stop: {type: point_on_line, point: bob.centre, line: [rod.start, rod.end],
         law: {stiffness: 1.0e5, restitution: 0.5}}
initial: {speeds: {rod: 0}, velocities: {bob: [0, 0]}}
run: {duration: 1}
accuracy: {tolerance: 1.0e-5}
"""


def schema_words():
    """Sections, keys and types of a model file."""
    schema = json_schema()
    parts = [schema, *schema["$defs"].values()]
    keys = {key for part in parts for key in part["properties"]}
    kinds = [part["properties"].get("type", {}) for part in parts]
    return keys | {word for kind in kinds for word in kind.get("enum", [kind.get("const", "")])}


def told(model):
    with pytest.raises(SceneError) as caught:
        scene_of(parse_document(model, "pendulum.yaml"))
    return str(caught.value)


def test_every_word_that_is_suggested_is_one_of_a_model_file():
    assert set(OTHER_WORDS) <= schema_words()


SECTIONS = {
    "drives": "forces loads motors Actuators",
    "joints": "constraints",
    "springs": "dampers",
    "bodies": "links parts",
}
KEYS = {
    "density": "rho",
    "youngs_modulus": "E young",
    "inertia": "J moment_of_inertia mass_moment",
    "stiffness": "k",
    "damping": "c d",
    "restitution": "e cor",
    "value": "torque",
    "velocities": "velocity",
    "speeds": "omega",
    "duration": "t_end",
    "tolerance": "tol",
    "at": "position",
}


def pairs(table):
    return [(meant, wrong) for meant, words in table.items() for wrong in words.split()]


@pytest.mark.parametrize(("meant", "wrong"), pairs(SECTIONS | KEYS))
def test_sections_and_keys_by_other_words(meant, wrong):
    text = told(re.sub(rf"\b{meant}:", f"{wrong}:", MODEL, count=1))
    assert f"unknown key '{wrong}'; did you mean '{meant}'?" in text
    assert f"missing '{meant}'" not in text


@pytest.mark.parametrize(
    ("right", "wrong", "meant"),
    [
        *(("revolute", wrong, "revolute") for wrong in ("pin", "hinge", "pivot")),
        *(("weld", wrong, "weld") for wrong in ("fixed", "rigid joint")),
        *(("weld", wrong, "prismatic") for wrong in ("slider", "translational")),
        ("torsional", "torsion", "torsional"),
        ("torsional", "spring", "linear"),
        ("torque", "moment", "torque"),
        ("torque", "motor", "speed"),
        ("rod", "bar", "rod"),
        ("rigid", "point_mass", "rigid"),
    ],
)
def test_types_by_other_words(right, wrong, meant):
    text = told(MODEL.replace(f"type: {right}", f"type: {wrong}"))
    assert f"got '{wrong}'; did you mean '{meant}'?" in text


def test_a_key_that_stands_beside_the_sections_is_sent_to_its_own():
    text = told(MODEL.replace("run: {duration: 1}", "duration: 1"))
    assert "unknown key 'duration'; did you mean 'run.duration'?" in text


def test_a_word_that_means_nothing_known_gets_no_suggestion():
    assert did_you_mean_word("J", ["length", "width"]) == ""
