"""Files of points that splines read: what they hold, and where they may be."""

import json
import os
from pathlib import Path
from typing import Any

import pytest
from test_scene import PENDULUM, scene

from exudyn_flexlink.scene import Scene, SplineSpec, parse_scene
from exudyn_flexlink.source import SceneError, parse_document


def spline_scene(folder: Path, file: str, **options: Any) -> Scene:
    text = PENDULUM + f"curves:\n  outline: {{type: spline, file: '{file}'}}\n"
    return parse_scene(parse_document(text, "model.yaml", folder), **options)


@pytest.mark.parametrize(
    "content",
    [
        "0,0\n1,0\n1,1\n0,1\n",
        "x,y\n0, 0\n1, 0\n\n# half\n1, 1\n0, 1",
        "\ufeff0,0\r\n1,0\r\n1,1\r\n0,1",
    ],
)
def test_a_spline_reads_its_points(tmp_path: Path, content: str) -> None:
    (tmp_path / "a.csv").write_text(content, encoding="utf-8", newline="")
    found = spline_scene(tmp_path, "a.csv")
    outline = found.curves["outline"]
    assert isinstance(outline, SplineSpec)
    assert outline.points == ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
    assert scene(json.dumps(found.to_data())) == found


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", "at least 4 points, the file has 0"),
        ("0,0\n1,0\n1,1\n", "at least 4 points, the file has 3"),
        ("0,0\n1,0,5\n1,1\n0,1", "a.csv line 2: expected x, y; got 3 columns"),
        ("0;0\n1;0\n1;1\n0;1", "a.csv line 2: expected x, y; got no comma in '1;0'"),
        ("0,0\n1,x\n1,1\n0,1", "a.csv line 2: 'x' is no number"),
        ("0,0\n1,1_0\n1,1\n0,1", "a.csv line 2: '1_0' is no number"),
        ("0,0\n1,inf\n1,1\n0,1", "a.csv line 2: must be finite numbers"),
        ("0,0\n1,0\n1,0\n0,1", "line 3: the same point twice"),
        ("0,0\n1,0\n1,1\n0,1\n0,0", "line 5: repeats the first point"),
    ],
)
def test_what_a_point_file_must_not_hold(tmp_path: Path, content: str, words: str) -> None:
    (tmp_path / "a.csv").write_text(content, encoding="utf-8")
    with pytest.raises(SceneError) as caught:
        spline_scene(tmp_path, "a.csv")
    assert words in str(caught.value)
    assert caught.value.mistakes[0].path == ("curves", "outline", "file")


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ("x (mm),y (mm)", "a.csv line 1: 'x (mm)': numbers must be in metres"),
        ("x (m), y [cm]", "a.csv line 1: 'y [cm]': numbers must be in metres"),
        ("x (s),y (m)", "a.csv line 1: 'x (s)': numbers must be in metres"),
    ],
)
def test_a_header_must_not_name_other_units(tmp_path: Path, header: str, words: str) -> None:
    (tmp_path / "a.csv").write_text(f"{header}\n0,0\n1,0\n1,1\n0,1")
    with pytest.raises(SceneError) as caught:
        spline_scene(tmp_path, "a.csv")
    assert words in str(caught.value)


@pytest.mark.parametrize("header", ["x (m),y [m]", "x (of the rim),y (up)", "x,y", "s(t),y"])
def test_a_header_may_name_si_units_or_none(tmp_path: Path, header: str) -> None:
    (tmp_path / "a.csv").write_text(f"{header}\n0,0\n1,0\n1,1\n0,1")
    assert spline_scene(tmp_path, "a.csv").curves


@pytest.mark.parametrize(
    ("drive", "header", "words"),
    [
        ("torque", "t (ms),M (N m)", "'t (ms)': numbers must be in seconds"),
        ("torque", "t (s),M (N mm)", "'M (N mm)': numbers must be in N m"),
        ("torque", "t (s),F (N)", "'F (N)': numbers must be in N m"),
        ("torque", "t (s),M (Nm)", ""),
        ("torque", "t [s],M(t)", ""),
        ("speed", "t [s],w [Hz]", "'w [Hz]': numbers must be in rad/s"),
    ],
)
def test_nor_may_that_of_a_table(tmp_path: Path, drive: str, header: str, words: str) -> None:
    (tmp_path / "a.csv").write_text(f"{header}\n0,0\n9,1\n")
    text = f"drives: {{d: {{type: {drive}, joint: pin, value: {{file: a.csv, rule: linear}}}}}}\n"
    document = parse_document(PENDULUM + text, "model.yaml", tmp_path)
    if not words:
        assert parse_scene(document).drives
        return
    with pytest.raises(SceneError) as caught:
        parse_scene(document)
    assert f"a.csv line 1: {words}" in str(caught.value)


def test_a_header_with_another_separator_is_told_that(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t [s]; w [rad/s]\n0; 0\n9; 1\n")
    drive = "drives: {d: {type: speed, joint: pin, value: {file: a.csv, rule: linear}}}\n"
    with pytest.raises(SceneError, match="no comma"):
        parse_scene(parse_document(PENDULUM + drive, "model.yaml", tmp_path))


def test_drives_that_are_a_list_are_a_mistake_and_no_traceback(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t (ms),M (N m)\n0,0\n9,1\n")
    drives = "drives: [{type: torque, joint: pin, value: {file: a.csv, rule: linear}}]\n"
    with pytest.raises(SceneError, match="numbers must be in seconds"):
        parse_scene(parse_document(PENDULUM + drives, "model.yaml", tmp_path))


def test_a_table_of_speeds_takes_either_unit(tmp_path: Path) -> None:
    drive = "drives: {d: {type: speed, joint: pin, value: {file: a.csv, rule: linear}}}\n"
    document = parse_document(PENDULUM + drive, "model.yaml", tmp_path)
    for unit in ("rad/s", "1/s", "m/s"):
        (tmp_path / "a.csv").write_text(f"t (s),n ({unit})\n0,0\n9,1\n")
        assert parse_scene(document).drives
    (tmp_path / "a.csv").write_text("t (s),n (rpm)\n0,0\n9,1\n")
    with pytest.raises(SceneError, match=r"'n \(rpm\)': numbers must be in rad/s or m/s"):
        parse_scene(document)


def test_point_files_stay_in_the_models_folder(tmp_path: Path) -> None:
    inside = tmp_path / "model"
    inside.mkdir()
    outside = tmp_path / "secret.csv"
    outside.write_text("0,0\n1,0\n1,1\n0,1\n")
    os.symlink(outside, inside / "link.csv")
    for file in ("../secret.csv", str(outside), "link.csv"):
        with pytest.raises(SceneError, match="must be in the model's folder"):
            spline_scene(inside, file)
        assert spline_scene(inside, file, allow_outside=True).curves
    for file in ("nowhere.csv", ".", "x" * 5000, "/dev/zero"):
        with pytest.raises(SceneError):
            spline_scene(inside, file, allow_outside=True)
