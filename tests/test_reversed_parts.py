"""Parts of the reference's examples the other way round, or welded: minimal against redundant.

A sign, or an axis, that one of both formulations takes wrong shows as two motions.
"""

from copy import deepcopy
from dataclasses import replace
from math import cos, radians, sin
from pathlib import Path

import numpy as np
import pytest

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import scene_of
from exudyn_flexlink.source import load_document

EXAMPLES = Path(__file__).parent.parent / "docs" / "reference" / "examples"
# The guide of 'supported' holds the link at one angle alone.
FILES = [file for file in sorted(EXAMPLES.glob("*.yaml")) if file.stem != "supported"]
DOCUMENTS = {file.stem: load_document(file) for file in FILES}
TOLERANCE = 1e-5
NOT_IN_REDUNDANT = {"friction", "acts", "preload", "limits", "freewheel"}
NOT_IN_REDUNDANT |= {"stages", "pressing"}
LINEAR = {  # in place of tables and formulas
    "torque": {"stiffness": 2, "rest_angle": 0.5, "damping": 0.1},
    "force": {"stiffness": 300, "length": 0.1, "damping": 5},
}
WELDED = radians(40)


def without(data):
    """Data of a model without what the redundant formulation refuses."""
    if isinstance(data, list):
        return [without(item) for item in data]
    if not isinstance(data, dict):
        return data
    kept = {
        key: without(value)
        for key, value in data.items()
        if key not in NOT_IN_REDUNDANT
        and not (isinstance(value, dict) and value.get("type", "").endswith(("_on_curve", "rope")))
    }
    if kept.get("type") == "gear":
        kept = {key: kept[key] for key in kept.keys() - {"backlash", "start", "law"}}
    for key in LINEAR.keys() & kept.keys():
        if isinstance(kept.pop(key), dict) or kept.get("type") in {"linear", "torsional"}:
            kept |= LINEAR[key]
    if "law" in kept and kept["law"].get("type", "penalty") != "penalty":
        kept["law"] = {"stiffness": 1e5, "restitution": 0.5}
    return kept


def pairs():
    """Parts that name two points or joints."""
    for example, document in DOCUMENTS.items():
        for section in ("joints", "springs"):
            for name, part in document.data.get(section, {}).items():
                for key in ("points", "joints"):
                    if len(part.get(key, ())) == 2:
                        yield example, section, name, key


def bodies():
    """Rigid bodies whose points others name."""
    for example, document in DOCUMENTS.items():
        for name, body in document.data["bodies"].items():
            if body["type"] == "rigid" and body.get("points"):
                yield example, name


def scenes(document, data):
    """The scene of a model in both formulations."""
    settings = {"run": {"duration": 0.05}, "accuracy": {"tolerance": TOLERANCE}}
    for formulation in ("minimal", "redundant"):
        whole = without(data) | settings | {"solver": {"formulation": formulation}}
        yield scene_of(replace(document, data=whole))


def moves_alike(document, data):
    """Whether both formulations move a model in the same way."""
    minimal, redundant = (simulate(scene, measure=False) for scene in scenes(document, data))
    assert minimal.outcome.completed
    assert redundant.outcome.completed
    off = minimal.poses[-1] - redundant.poses[-1]
    return np.abs(off).max() <= 10 * TOLERANCE


@pytest.mark.parametrize(("example", "section", "name", "key"), list(pairs()))
def test_a_part_the_other_way_round_moves_alike_in_both_formulations(example, section, name, key):
    document = DOCUMENTS[example]
    data = deepcopy(document.data)
    data[section][name][key].reverse()
    assert moves_alike(document, data)


def renamed(data, before, after):
    """Data in which names of points of a body are those of another one, and its axes, too."""
    if isinstance(data, list):
        return [renamed(item, before, after) for item in data]
    if isinstance(data, dict):
        return {
            key: after if key == "axes" and value == before else renamed(value, before, after)
            for key, value in data.items()
        }
    points = isinstance(data, str) and data.startswith(f"{before}.") and data != f"{before}.centre"
    return data.replace(before, after, 1) if points else data


@pytest.mark.parametrize(("example", "name"), list(bodies()))
def test_a_part_on_a_body_that_is_welded_at_an_angle_moves_alike_in_both_formulations(
    example, name
):
    document = DOCUMENTS[example]
    whole = scene_of(document)
    points = whole.bodies[name].points
    data = renamed(deepcopy(document.data), name, "welded")
    turned = {
        point: [x * cos(WELDED) + y * sin(WELDED), y * cos(WELDED) - x * sin(WELDED)]
        for point, (x, y) in points.items()
    }
    data["bodies"][name].pop("points")
    data["bodies"]["welded"] = {"type": "rigid", "mass": 0.1, "inertia": 1e-4, "points": turned}
    data["joints"]["weld"] = {
        "type": "weld",
        "points": [f"{name}.centre", "welded.centre"],
        "angle": WELDED,
    }
    assert moves_alike(document, data)
