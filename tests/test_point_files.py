"""Files of points and tables: how they are written, what they hold, and where they may be."""

import json
import math
import os

import numpy as np
import pytest
from results import PENDULUM
from test_scene import scene

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import scene_of
from exudyn_flexlink.scene import SplineSpec, parse_scene
from exudyn_flexlink.source import SceneError, parse_document


def spline_scene(folder, file, **options):
    text = PENDULUM + f"curves:\n  outline: {{type: spline, file: '{file}'}}\n"
    return parse_scene(parse_document(text, "model.yaml", folder), **options)


SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))


@pytest.mark.parametrize(
    "content",
    [
        *(
            f"{header}\n0,0\n1,0\n1,1\n0,1"
            for header in ("x (m),y [m]", "x,y", "s(t),y", "x_P,y_P")
        ),
        "0,0\n1,0\n1,1\n0,1\n",
        "\ufeff0,0\r\n1,0\r\n1,1\r\n0,1",
        "# points of a square, by hand: 1 m wide\n0\t0\n1\t0\n1\t1\n0\t1",
        "x y\n0 0\n1  0\n 1 1\n0 1",
        "x [m];y [m]\n0,0;0,0\n1,0;0\n1;1,0\n0;1,0",
        "x_mm,y_mm\n0,0\n1000,0\n1e3,1000\n0,1000",
        "# X [MM], Y [MM]\n0,0\n1000,0\n1e3,1000\n0,1000",
        "x in cm, y in cm\n0,0\n100,0\n100,100\n0,100",
        "x,y\n(cm),(mm)\n0,0\n100,0\n100,1000\n0,1000",
        "y (mm) x (m)\n0 0\n0 1\n1000 1\n1000 0",
        '"x","y"\n"0","0"\n"1","0"\n"1","1"\n"0","1"',
    ],
)
def test_a_spline_reads_its_points(tmp_path, content):
    (tmp_path / "a.csv").write_text(content, encoding="utf-8", newline="")
    found = spline_scene(tmp_path, "a.csv")
    outline = found.curves["outline"]
    assert isinstance(outline, SplineSpec)
    assert outline.points == SQUARE
    assert scene(json.dumps(found.to_data())) == found


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("0,0\n1,0,5\n1,1\n0,1", "a.csv line 2: expected x, y, finite numbers; got '1,0,5'"),
        ("0,0\n1,1_0\n1,1\n0,1", "a.csv line 2: expected x, y, finite numbers; got '1,1_0'"),
        ("0,0\n1,0\n1,1\n0,1e21", "a.csv line 4: must not exceed 1e+20"),
        ("10,000;0\n1;0.5\n1;1\n0;1", "a.csv line 1: numbers with ',', others with '.'"),
        ("theta,r\n0,1\n1,1\n2,1\n3,1", "a.csv line 1: 'theta' and 'r' are polar"),
        ("outline\n0,0\n1,0\n1,1\n0,1", "a.csv line 1: expected names of x, y; got 'outline'"),
        ("\nx [mm],y\n0,0\n1,0\n1,1\n0,1", "a.csv line 2: 'x [mm]' and 'y': only one of them"),
        ("x_s,y_s\n0,0\n1,0\n1,1\n0,1", "a.csv line 1: 'x_s': 's' is no unit of a length"),
        ("x_in,y_in\n0,0\n1,0\n1,1\n0,1", "a.csv line 1: 'x_in': 'in' is no unit"),
        ("x (of the rim),y (up)\n0,0\n1,0\n1,1\n0,1", "unknown unit 'of the rim'"),
    ],
)
def test_what_a_point_file_must_not_hold(tmp_path, content, words):
    (tmp_path / "a.csv").write_text(content, encoding="utf-8")
    with pytest.raises(SceneError) as caught:
        spline_scene(tmp_path, "a.csv")
    assert words in str(caught.value)
    assert caught.value.mistakes[0].path == ("curves", "outline", "file")


# --- tables of springs ----------------------------------------------------------------------

SPRING = PENDULUM + "springs: {s: {type: torsional, joint: pin, torque: {file: a.csv}}}\n"


@pytest.mark.parametrize(
    ("header", "rows"),
    [
        ("phi [deg];M [N mm]", ((-math.pi / 2, -1e-3), (math.pi / 2, 2e-3))),
        ("", ((-90, -1), (90, 2))),
    ],
)
def test_a_spring_reads_its_table(tmp_path, header, rows):
    (tmp_path / "a.csv").write_text(f"{header}\n-90;-1\n90;2\n", encoding="utf-8")
    found = parse_scene(parse_document(SPRING, "model.yaml", tmp_path))
    np.testing.assert_allclose(found.springs["s"].torque.points, rows, rtol=1e-15)
    assert scene(json.dumps(found.to_data())) == found


def test_mistakes_of_a_springs_file_are_told_with_its_line(tmp_path):
    for content, words in (
        ("l [mm];M [Nm]\n1;1\n2;2\n", r"a.csv line 1: 'l \[mm\]': 'mm' is no unit of an angle"),
        ("1;1\n0;2\n", "torque.file: a.csv line 2: must increase from row to row"),
    ):
        (tmp_path / "a.csv").write_text(content, encoding="utf-8")
        with pytest.raises(SceneError, match=words):
            parse_scene(parse_document(SPRING, "model.yaml", tmp_path))


# --- tables of drives -----------------------------------------------------------------------

SHAFT = """
title: A shaft at a measured speed
bodies: {arm: {type: rigid, mass: 1, inertia: 1, points: {hub: [0, 0], tip: [0.1, 0]}}}
joints:
  axle: {type: revolute, points: [ground, arm.hub], at: [0, 0]}
run: {duration: 2}
accuracy: {tolerance: 1.0e-6}
"""
DRIVE = "drives: {{motor: {{type: {}, joint: axle, value: {{file: a.csv, rule: linear}}}}}}\n"


def driven(folder, content, kind="speed", text=SHAFT):
    (folder / "a.csv").write_text(content, encoding="utf-8")
    return scene_of(parse_document(text + DRIVE.format(kind), "model.yaml", folder))


def test_a_shaft_at_600_rpm_makes_20_turns_in_2_s(tmp_path):
    result = simulate(driven(tmp_path, "# t [s], n [rpm]\n0,600\n2,600\n"))
    turned = result.poses[-1, 0, 2] - result.poses[0, 0, 2]
    assert turned == pytest.approx(20 * 2 * math.pi, abs=1e-9)


RPM = [
    *(f"t [s],n [{unit}]" for unit in ("rpm", "RPM", "rev/min", "U/min", "min-1", "1/min", "Upm")),
    *(f"t [s],n ({unit})" for unit in ("min^-1", "min⁻¹", "r/min", "turns/min")),
    *("t,n_rpm", "# t [s], n [rpm]", "#t, n_RPM", "t/s,n/min-1", "s,rpm", "t [sec],speed in rpm"),
    *("time,[RPM]", "# run 5, 600 deg\nt,n\n# s, rpm", "# by A. Smith (bench 2), May\nt,n_rpm"),
]
TABLES = [
    *(f"{header}\n0,600\n2,660.5\n" for header in RPM),
    "t [ms];n [rpm]\n0;600\n2000;660,5\n",
    "t [ms]\tn [rpm]\n0\t600\n2000\t660.5\n",
    "t [ms] n [rpm]\n0 600\n2000 660,5\n",
    "t_ms n_rpm\n0 600\n2000 660.5\n",
    "n [rpm],t [msec]\n600,0\n660.5,2000\n",
    "omega (deg/s), time (ms)\n3600,0\n3963,2000\n",
    "t (min),n (turn/s)\n0,10\n0.03333333333333333,11.008333333333333\n",
    "Zeit / s;Drehzahl / U/min\n0;600\n2;660,5\n",
]


@pytest.mark.parametrize("content", TABLES)
def test_the_same_table_in_other_words(tmp_path, content):
    wanted = [[0, 20 * math.pi], [2, 660.5 * math.pi / 30]]
    found = driven(tmp_path, content).drives["motor"].value.points
    np.testing.assert_allclose(found, wanted, rtol=1e-15)


@pytest.mark.parametrize(
    ("kind", "header", "factors"),
    [
        ("torque", "t (ms),M (N mm)", (1e-3, 1e-3)),
        ("torque", "t [s],M(t)", (1, 1)),
        ("torque", "t (s),M (Nm)", (1, 1)),
        ("torque", "t [sec],M [lb-ft]", (1, 1.3558179483314004)),
        ("torque", "t,M [ft-lbs]", (1, 1.3558179483314004)),
        ("torque", "t,M_kNm", (1, 1e3)),
        ("motion", "(msec),phi [degrees]", (1e-3, math.pi / 180)),
        ("motion", "t,phi [°]", (1, math.pi / 180)),
        ("motion", "t [MS],phi [Grad]", (1e-3, math.pi / 180)),
        ("speed", "t,n [Grad/s]", (1, math.pi / 180)),
        ("speed", "t,n", (1, 1)),
    ],
)
def test_units_of_tables(tmp_path, kind, header, factors):
    text = DRIVE.format(kind).replace("linear", "cubic")
    (tmp_path / "a.csv").write_text(f"{header}\n0,0\n9,1\n", encoding="utf-8")
    document = parse_document(SHAFT + text, "model.yaml", tmp_path)
    found = parse_scene(document).drives["motor"].value.points
    np.testing.assert_allclose(found, [[0, 0], [9 * factors[0], factors[1]]], rtol=1e-12)


@pytest.mark.parametrize(
    ("kind", "header", "words"),
    [
        ("torque", "t (s),F (N)", "'F (N)': 'N' is no unit of a torque (N m)"),
        ("torque", "t (m),M (Nm)", "'t (m)': 'm' is no unit of a time (seconds)"),
        ("torque", "t,rpm", "'rpm': 'rpm' is no unit of a torque"),
        ("speed", "t [s],w [Hz]", "'w [Hz]': 'Hz' is no unit of an angular speed"),
        ("speed", "t [s],w [1/s]", "'w [1/s]': '1/s' is no unit of an angular speed"),
        ("speed", "t [s],v [m/s]", "'v [m/s]': 'm/s' is no unit of an angular speed (rad/s)"),
        ("motion", "t [s],phi [grad]", "'phi [grad]': 'grad' may be of degrees or of 400ths of a"),
        ("motion", "t [s],phi [Grad rad]", "'phi [Grad rad]': 'Grad rad' is no unit of an angle"),
        ("motion", "t,phi_grad", "'phi_grad': 'grad' may be of degrees or of 400ths of a turn"),
        ("speed", "# t [s], n [rmp]", "'n [rmp]': unknown unit 'rmp'; did you mean 'rpm'?"),
    ],
)
def test_units_that_do_not_fit(tmp_path, kind, header, words):
    with pytest.raises(SceneError) as caught:
        driven(tmp_path, f"{header}\n0,0\n9,1\n", kind)
    assert f"a.csv line 1: {words}" in str(caught.value)


def test_a_slide_takes_a_speed_in_metres(tmp_path):
    slide = SHAFT.replace("type: revolute", "type: prismatic, axis: [1, 0]")
    found = driven(tmp_path, "t,v [mm/s]\n0,500\n2,500\n", text=slide)
    assert found.drives["motor"].value.points == ((0, 0.5), (2, 0.5))
    with pytest.raises(SceneError, match="'rpm' is no unit of a speed"):
        driven(tmp_path, "t,v [rpm]\n0,500\n2,500\n", text=slide)


# --- where files are ------------------------------------------------------------------------


def test_point_files_stay_in_the_models_folder(tmp_path):
    inside = tmp_path / "model"
    inside.mkdir()
    outside = tmp_path / "secret.csv"
    outside.write_text("0,0\n1,0\n1,1\n0,1\n")
    os.symlink(outside, inside / "link.csv")
    sibling = tmp_path / "model_secret" / "x.csv"  # its path begins as the model's folder does
    sibling.parent.mkdir()
    sibling.write_text(outside.read_text())
    for file in ("../secret.csv", str(outside), "link.csv", "../model_secret/x.csv", str(sibling)):
        with pytest.raises(SceneError, match="must be in the model's folder"):
            spline_scene(inside, file)
        assert spline_scene(inside, file, allow_outside=True).curves
    for file in ("nowhere.csv", ".", "x" * 5000, "/dev/zero"):
        with pytest.raises(SceneError):
            spline_scene(inside, file, allow_outside=True)
