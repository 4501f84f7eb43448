"""Every part of the language is in what holds its promises.

In the table of tolerances, among the hard cases, and in the models that fuzzing changes.
"""

import pytest
import tolerance
from fuzzing.inputs import shipped_models
from hard.case import MODELS as HARD
from hard.catalogue import CASES
from pydantic import BaseModel

from exudyn_flexlink.expressions import Expression
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.scene import FlexibleBody, RevoluteJoint, RigidBody, json_schema

# Settings of a run, and sections, whose numbers alone count.
NO_PARTS = {"Accuracy", "Initial", "Material", "Outputs", "Run", "Solver"}
NO_PARTS |= {"GeneralSection", "RectangleSection", "RoundSection"}
PARTS = set(json_schema()["$defs"]) - NO_PARTS
WAYS = {"stretch", "point mass", "free body", "clearance in a joint", "carried curve", "expression"}
WAYS |= {"hollow circle", "gravity"}


def used(scene):
    """Parts of a scene, by their classes, and ways in which parts are used."""
    held = {name for name in scene.bodies if any(name in repr(j) for j in scene.joints.values())}
    bodies, joints = scene.bodies.values(), scene.joints.values()
    ways = {
        "stretch": any(isinstance(b, FlexibleBody) and b.stretch for b in bodies),
        "point mass": any(isinstance(b, RigidBody) and b.inertia == 0 for b in bodies),
        "free body": bool(set(scene.bodies) - held),
        "clearance in a joint": any(isinstance(j, RevoluteJoint) and j.clearance for j in joints),
        "carried curve": any(curve.on for curve in scene.curves.values()),
        "gravity": any(scene.gravity),
    }
    return {way for way, found in ways.items() if found} | set(_parts(scene))


def _parts(value):
    """Names of the classes of everything below a value."""
    if isinstance(value, Expression):
        yield "expression"
    elif isinstance(value, BaseModel):
        yield type(value).__name__
        if getattr(value, "inside", False):
            yield "hollow circle"
        for key in type(value).model_fields:
            yield from _parts(getattr(value, key))
    elif isinstance(value, dict) or hasattr(value, "values"):
        for one in value.values():
            yield from _parts(one)
    elif isinstance(value, (list, tuple)):
        for one in value:
            yield from _parts(one)


def missing(files):
    """Parts and ways that no model has."""
    return (PARTS | WAYS).difference(*(used(load_scene(file)) for file in files))


PLACES = {
    "tolerance": [
        *(tolerance.MODELS / file for file, _ in tolerance.SCENES.values()),
        *(tolerance.file_of(name) for name in tolerance.MECHANISMS),
    ],
    "hard cases": [HARD / f"{case.name}.yaml" for case in CASES],
    "fuzzing": shipped_models(),
}


@pytest.mark.parametrize("place", PLACES)
def test_every_part_is_tried(place):
    assert missing(file for file in PLACES[place] if file.exists()) == set()
