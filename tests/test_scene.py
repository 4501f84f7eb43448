import copy
import json
import pickle
from collections.abc import Mapping
from dataclasses import replace
from math import pi
from pathlib import Path

import pytest
import yaml
from pydantic import BaseModel
from results import PENDULUM

from exudyn_flexlink.scene import (
    GeneralSection,
    RectangleSection,
    RoundSection,
    Scene,
    apply_settings,
    json_schema,
    parse_scene,
    split_point,
)
from exudyn_flexlink.source import SceneError, parse_document

FOLDER = Path(__file__).parents[1] / "docs" / "reference" / "examples"
EXAMPLES = [path.read_text(encoding="utf-8") for path in sorted(FOLDER.glob("*.yaml"))]
"""Models that show every key, as a test of the documentation tells."""


def scene(text=PENDULUM, **options):
    return parse_scene(parse_document(text, "model.yaml", FOLDER), **options)


def refusal(text):
    with pytest.raises(SceneError) as caught:
        scene(text)
    return caught.value


def with_nothing(part, data):
    """Data of a part and those within, where every key that was left out is given as nothing."""
    if isinstance(part, Mapping):
        return {key: with_nothing(part[key], own) for key, own in data.items()}
    if not isinstance(part, BaseModel) or not isinstance(data, dict):
        return data
    fields = type(part).model_fields
    given = {key: with_nothing(getattr(part, key, None), own) for key, own in data.items()}
    names = [field.alias or key for key, field in fields.items() if not field.is_required()]
    return {**dict.fromkeys(names), **given}


@pytest.mark.parametrize("text", EXAMPLES)
def test_what_is_given_as_nothing_is_left_out(text):
    """A key of a section as well as a section, whatever it holds when it is left out."""
    whole = scene(text)
    data = with_nothing(whole, whole.to_data())
    assert None in data["run"].values()
    assert None in data.values()
    assert parse_scene(replace(parse_document(text, "m", FOLDER), data=data)) == whole


def test_sections_have_the_textbooks_area_and_second_moment():
    assert RectangleSection(width=2.0, thickness=3.0).area == 6.0
    assert RectangleSection(width=2.0, thickness=3.0).second_moment == 2 * 27 / 12
    assert RoundSection(diameter=2.0).area == pytest.approx(pi)
    assert RoundSection(diameter=2.0).second_moment == pytest.approx(pi / 4)
    assert GeneralSection(area=2.0, second_moment=3.0).area == 2.0


@pytest.mark.parametrize("text", EXAMPLES)
def test_a_scene_survives_writing_pickling_and_copying(text):
    found = scene(text)
    assert scene("# a comment\n" + json.dumps(found.to_data())) == found  # of another document
    assert scene(yaml.safe_dump(found.to_data())) == found
    for other in (pickle.loads(pickle.dumps(found)), copy.deepcopy(found)):
        assert other == found
        assert hash(other) == hash(found)
        assert other.document == found.document
    assert Scene.model_validate(found.model_dump()) == found


def test_a_changed_scene_is_checked_anew_and_keeps_its_document():
    found = scene(next(text for text in EXAMPLES if "hook:" in text))
    without = found.changed(drives={})
    assert without.document is found.document
    with pytest.raises(SceneError, match="unknown curve 'bend'"):
        found.changed(curves={name: found.curves[name] for name in ("rail", "hook")})


@pytest.mark.parametrize("name", ["Größe", "rod-2", "rod 2", "_x", "振り子", "rod_2"])
def test_names_may_be_of_any_language(name):
    assert name in scene(PENDULUM.replace("rod:", f"{name}:").replace("rod.", f"{name}.")).bodies


@pytest.mark.parametrize("name", ["2rod", "a/b", "-x", "'x '", "'a:b'", "''"])
def test_what_can_not_be_a_name(name):
    assert "can't be a name" in str(refusal(PENDULUM.replace("steel:", f"{name}:")))


@pytest.mark.parametrize("value", ["1", "'yes'"])
def test_a_flag_is_true_or_false(value):
    text = PENDULUM.replace("material: steel", f"material: steel, slender: {value}")
    assert f"slender: expected true or false, got {value}" in str(refusal(text))


def test_points():
    assert split_point("link.end") == ("link", "end")
    assert split_point("ground") == ("ground", "")
    for text in ("link", "", ".", "link.", ".end", "a.b.c", "ground.x"):
        with pytest.raises(ValueError, match="expected a point"):
            split_point(text)


@pytest.mark.parametrize(
    ("setting", "check"),
    [
        ("run.turns=2", "missing 'of'"),
        ("accuracy.step=1e-4", ""),
        ("run.duration=two", "--set run.duration=two: run.duration: expected a time, got 'two'"),
        ("bodies.rod.lenght=1", "unknown key 'lenght'; did you mean 'length'?"),
        ("accuracy.elements=3", "unknown key 'elements'; did you mean 'solver.elements'?"),
        ("gravity=[0, -9.81]", ""),
        ("initial.angles.rod=90 deg", ""),
        ("initial.angles.rodd=1", "unknown body 'rodd'"),
        ("initial.speeds.rod=1", ""),
        ("initial.speads.rod=1", "unknown key 'speads'; did you mean 'speeds'?"),
        ("joints.pni.points.0=ground", "joints.pni: no 'pni' in 'joints'; did you mean 'pin'?"),
        ("joints.pin.friction.coefficient=0.2", "joints.pin.friction: missing 'radius'"),
        ("joints.pin.frction.radius=0.2", "unknown key 'frction'; did you mean 'friction'?"),
    ],
)
def test_settings(setting, check):
    shown = ""
    try:
        parse_scene(apply_settings(parse_document(PENDULUM, "model.yaml"), [setting]))
    except SceneError as error:
        shown = str(error)
    assert bool(shown) == bool(check)
    assert check in shown


def test_settings_make_a_mapping_that_the_file_lacks():
    """Beside other keys, too: as 'initial' without 'speeds', and a joint without 'friction'."""
    document = parse_document(PENDULUM + "initial: {angles: {rod: 0.5}}\n", "model.yaml")
    friction = "joints.pin.friction"
    speed = [("initial.speeds.rod", 1.5)]
    rubbing = [f"{friction}.coefficient=0.2", (f"{friction}.radius", "5 mm")]
    found = parse_scene(apply_settings(document, speed + rubbing))
    assert (found.initial.angles["rod"], found.initial.speeds["rod"]) == (0.5, 1.5)
    friction = found.joints["pin"].friction
    assert (friction.coefficient, friction.radius) == (0.2, 5e-3)


def test_a_setting_replaces_the_key_it_excludes():
    document = parse_document(PENDULUM, "model.yaml")
    found = parse_scene(apply_settings(document, ["accuracy.step=1e-4"]))
    assert (found.accuracy.step, found.accuracy.tolerance) == (1e-4, None)
    both = ["accuracy.step=1e-4", "accuracy.tolerance=1e-5"]
    with pytest.raises(SceneError, match="exclude each other"):
        parse_scene(apply_settings(document, both))


def test_the_schema_describes_every_key():
    schema = json_schema()
    assert schema["$schema"].endswith("2020-12/schema")
    assert list(schema["properties"])[:2] == ["title", "source"]
    assert set(schema["required"]) == {"title", "bodies", "run", "accuracy"}
    for part in [schema, *schema["$defs"].values()]:
        assert part["additionalProperties"] is False
        for key, value in part["properties"].items():
            assert key == "type" or value.get("description"), (part, key)
    assert schema["$defs"]["RodBody"]["required"][0] == "type"
    assert "type" not in schema["$defs"]["RectangleSection"]["required"]
    assert "from" in schema["$defs"]["LineSpec"]["properties"]
    assert "null" not in json.dumps(schema)


def test_the_schema_accepts_and_refuses_what_the_program_does():
    jsonschema = pytest.importorskip("jsonschema")
    validator = jsonschema.Draft202012Validator(json_schema())
    validator.check_schema(json_schema())
    for text in EXAMPLES:
        assert not list(validator.iter_errors(parse_document(text, "x").data))
        assert not list(validator.iter_errors(scene(text).to_data()))
    for old, new in [
        ("length: 0.2", "lenght: 0.2"),
        ("length: 0.2", "length: -1"),
        ("length: 0.2", "length: '0.2'"),
        ("type: rod", "type: rood"),
        ("type: rod, ", ""),
        ("run: {duration: 1}", ""),
        ("at: [0.1, 0]", "at: [0, 0, 0]"),
    ]:
        data = parse_document(PENDULUM.replace(old, new), "x").data
        assert list(validator.iter_errors(data)), new
