"""Every model of the project loads, and the schema that editors use is that of the program."""

import json
from pathlib import Path

import numpy as np
import pytest

from exudyn_flexlink.cli import main
from exudyn_flexlink.loading import assemble_scene, load_scene
from exudyn_flexlink.scene import json_schema
from exudyn_flexlink.shipped import model_names
from exudyn_flexlink.source import load_document

FOLDER = Path(__file__).parents[1] / "models"
FILES = [FOLDER / f"{name}.yaml" for name in model_names()]
SCHEMA = FOLDER / "flexlink.schema.json"

any_model = pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)


def test_the_schema_file_is_current():
    assert json.loads(SCHEMA.read_text(encoding="utf-8")) == json_schema(), (
        "run: python -m exudyn_flexlink schema --out models/flexlink.schema.json"
    )


@any_model
def test_it_loads_and_moves(path):
    assert not assemble_scene(load_scene(path)).surplus


@any_model
def test_check_describes_it(path, capsys):
    assert main(["check", str(path)]) == 0
    shown = capsys.readouterr()
    assert shown.out.startswith(f"{path}: no mistakes\n\n{load_scene(path).title}\n")
    assert "Degrees of freedom: " in shown.out
    rows = [line for line in shown.out.splitlines() if line.startswith(" ")]
    assert max(map(len, rows)) <= 80
    assert shown.err == ""


@any_model
def test_it_names_the_schema_that_editors_use(path):
    first = path.read_text(encoding="utf-8").splitlines()[0]
    relative = first.removeprefix("# yaml-language-server: $schema=")
    assert (path.parent / relative).resolve() == SCHEMA.resolve()


@any_model
def test_it_says_where_its_numbers_come_from(path):
    assert load_scene(path).source


def scene(name):
    return load_scene(FOLDER / f"{name}.yaml")


def test_the_points_of_the_spline_track_are_those_of_its_formula():
    rows = (FOLDER / "track_points.csv").read_text(encoding="utf-8").splitlines()
    numbers = [line for line in rows if not line.startswith("#")][1:]
    points = np.array([[float(cell) for cell in line.split(",")] for line in numbers])
    angle = np.radians(15 * np.arange(24))
    radius = 0.04 - 0.02 * np.tanh(2 * np.cos(angle)) / np.tanh(2)
    expected = np.array([0.02, 0]) + radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], 1)
    assert np.abs(points - expected).max() <= 0.51e-7


def test_the_guide_always_covers_the_point_on_the_spline_track():
    curve = assemble_scene(scene("spline_track")).mechanism.slots[0].curve
    away = curve.point(np.linspace(curve.start, curve.end, 1000)) - np.array([0.02, 0])
    distance = np.hypot(*away.T)
    assert distance.min() > 0.012
    assert distance.max() < 0.075
    # One distance for every crank angle: the track goes round C without turning back.
    turned = np.diff(np.unwrap(np.arctan2(away[:, 1], away[:, 0])))
    assert turned.min() > 0
    assert turned.sum() == pytest.approx(2 * np.pi)


def test_models_mark_what_the_paper_leaves_open():
    for name in ("no_clearance", "smooth", "rigid", "clearance", "clearance_friction", "supported"):
        assert load_document(FOLDER / f"{name}.yaml").text.count("assumed") >= 4
