"""Scenes that are refused, each with advice that works when it is followed."""

import re
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

import exudyn_flexlink as fl
from exudyn_flexlink.curves import Spline
from exudyn_flexlink.source import SceneError
from exudyn_flexlink.sweeps.plan import ValuesError, range_of

RUN = "run: {duration: 0.05}\naccuracy: {tolerance: 1.0e-6}\ngravity: [0, -9.81]\n"


def scene(text):
    with TemporaryDirectory() as folder:
        file = Path(folder) / "model.yaml"
        file.write_text("title: t\n" + text + RUN, encoding="utf-8")
        return fl.load_scene(file)


def refused(text):
    """What is said of a scene, with its hints."""
    with pytest.raises(SceneError) as told:
        scene(text)
    return str(told.value)


LIFT = """
  c{k}: {{type: rigid, mass: 0.2, inertia: 0.001, points: {{o: [0, 0], m: [0.1, 0]}}}}
  r{k}: {{type: rigid, mass: 0.4, inertia: 0.005, points: {{b: [-0.1, 0], m: [0, 0], t: [0.1, 0]}}}}
  s{k}: {{type: rigid, mass: 0.2, inertia: 0.001, points: {{p: [0, 0]}}}}"""
LIFT_JOINTS = """
  o{k}: {{type: revolute, points: [ground, c{k}.o], at: [{x}, 0]}}
  m{k}: {{type: revolute, points: [c{k}.m, r{k}.m]}}
  w{k}: {{type: prismatic, points: [ground, s{k}.p], at: [{x}, 0], axis: [1, 0]}}
  b{k}: {{type: revolute, points: [s{k}.p, r{k}.b]}}"""
LIFTS = f"""
bodies:{LIFT.format(k=1)}{LIFT.format(k=2)}
  top: {{type: rigid, mass: 1, inertia: 0.1, points: {{l: [0, 0], r: [0.5, 0]}}}}
joints:{LIFT_JOINTS.format(k=1, x=0)}{LIFT_JOINTS.format(k=2, x=0.5)}
  tl: {{type: revolute, points: [r1.t, top.l]}}
  tr: {{type: revolute, points: [r2.t, top.r]}}
initial: {{angles: {{c1: 30 deg, c2: 30 deg, r1: 150 deg, r2: 150 deg}}}}
"""


def test_a_platform_pinned_to_two_lifts_gets_a_pin_that_slides():
    assert "let one pin slide along it, in a slot" in refused(LIFTS)
    slot = LIFTS.replace(
        "tr: {type: revolute, points: [r2.t, top.r]}", "tr: {type: slot, point: r2.t, curve: rail}"
    )
    rail = "curves: {rail: {type: line, from: [0.2, 0], to: [0.8, 0], on: top}}\n"
    assert fl.simulate(scene(rail + slot), measure=False).outcome.completed


FLOOR = """
bodies:
  floor: {type: rigid, mass: 1, inertia: 1, points: {l: [-1, 0], r: [1, 0]}}
  ball: {type: rigid, mass: 1, inertia: 0, points: {c: [0, 0]}}
joints:
  fix: {type: weld, points: [ground, floor.l], at: [-1, 0]}
  up: {type: prismatic, points: [ground, ball.c], at: [0, 0], axis: [0, 1]}
contacts:
  rest: {type: point_on_line, point: ball.c, line: [floor.l, floor.r],
         law: {stiffness: 9810, restitution: 0.5}}
initial: {along: {up: -1 mm}}
"""


def test_what_rests_on_an_elastic_floor_starts_where_both_touch():
    assert "start 0.001 m farther out, where both just touch" in refused(FLOOR)
    result = fl.simulate(scene(FLOOR.replace("-1 mm", "0")), measure=False)
    assert result.outcome.completed
    assert 0 < -result.path("ball.c").position[-1, 1] < 2.1e-3  # it swings about 1 mm


def test_bodies_without_mass_or_inertia_where_they_need_some():
    arm = """
bodies:
  arm: {type: rigid, mass: 0, inertia: 0, points: {h: [0, 0], t: [1, 0]}}
  bob: {type: rigid, mass: 1, inertia: 0, points: {c: [0, 0]}}
joints:
  h: {type: revolute, points: [ground, arm.h], at: [0, 0]}
  w: {type: weld, points: [arm.t, bob.c]}
"""
    assert "has a thousandth of what it moves" in refused(arm)
    assert fl.simulate(
        scene(arm.replace("mass: 0,", "mass: 1.0e-3,")), measure=False
    ).outcome.completed
    disc = """
bodies: {bob: {type: rigid, mass: 1, inertia: 0, points: {c: [0, 0]}}}
joints: {h: {type: revolute, points: [ground, bob.c], at: [0, 0]}}
springs: {s: {type: torsional, joint: h, stiffness: 1, rest_angle: 0}}
initial: {angles: {bob: 0.1}}
"""
    said = refused(disc)
    assert "'s' turns 'bob' about its own centre, where it has no inertia" in said
    assert "m r^2/2 of a disc" in said
    result = fl.simulate(scene(disc.replace("inertia: 0", "inertia: 0.5")), measure=False)
    angle = result.poses[-1, 0, 2]
    assert angle == pytest.approx(0.1 * np.cos(np.sqrt(2) * 0.05), abs=1e-7)


def test_a_loop_that_misses_names_all_its_joints():
    said = refused("""
bodies:
  a: {type: rigid, mass: 1, inertia: 0.1, points: {h: [0, 0], t: [1, 0]}}
  b: {type: rigid, mass: 1, inertia: 0.1, points: {h: [0, 0], t: [2, 0]}}
  c: {type: rigid, mass: 1, inertia: 0.1, points: {h: [0, 0], t: [1, 0]}}
joints:
  j1: {type: revolute, points: [ground, a.h], at: [0, 0]}
  j2: {type: revolute, points: [a.t, b.h]}
  j3: {type: revolute, points: [b.t, c.t]}
  j4: {type: revolute, points: [ground, c.h], at: [4.0000001, 0]}
""")
    # A stretched loop closes slowly: the way that is left is known by its first digit.
    missing = re.search(r"(\S+) m missing", said)
    assert missing is not None
    assert float(missing[1]) == pytest.approx(1e-7, rel=0.1)
    assert all(f"{joint}" in said for joint in ("j1", "j2", "j3", "j4"))


BEAD = """
curves: {g: {type: spline, closed: false, points: [[0, 0], [0.1, 0.03], [0.2, 0.02], [0.3, 0.05]]}}
bodies: {bead: {type: rigid, mass: 1, inertia: 0, points: {c: [0, 0]}}}
joints: {s: {type: slot, point: bead.c, curve: g}}
"""


def test_a_bead_given_by_few_digits_is_on_its_track():
    at = "initial: {{positions: {{bead: [{:.7f}, {:.7f}]}}}}\n"
    track = Spline(((0, 0), (0.1, 0.03), (0.2, 0.02), (0.3, 0.05)), closed=False)
    for u in np.linspace(track.start, track.end, 7)[1:-1]:
        place = track.point(u)
        start = fl.simulate(scene(BEAD + at.format(*place)), measure=False).poses[0, 0, :2]
        np.testing.assert_allclose(start, place, atol=1e-7)
    said = refused(BEAD + at.format(0.15, 0.0252))  # off by more than rounding
    assert "the joints allow [0.1499" in said


def test_a_place_that_gives_way_to_joints_is_told_with_its_amount():
    track = Spline(((0, 0), (0.1, 0.03), (0.2, 0.02), (0.3, 0.05)), closed=False)
    at = "initial: {{positions: {{bead: [{:.12f}, {:.12f}]}}}}\n"
    place = track.point(0.1)
    beside = place + 8e-8 * track.normal(0.1)
    for tolerance, told in ((1e-6, False), (1e-7, True), (1e-8, True)):
        asked = scene(BEAD + at.format(*beside)).with_({"accuracy.tolerance": tolerance})
        found = fl.simulate(asked, measure=False)
        said = [one for one in found.warnings if one.startswith("initial.positions.bead: moved")]
        assert bool(said) == told
        assert not told or "moved by 8e-08 m" in said[0]
        np.testing.assert_allclose(found.poses[0, 0, :2], place, atol=1e-10)
    said = refused(BEAD + at.format(*(place + np.array([0, 4.9e-7]))))
    assert "4.9e-07 m missing" in said


def test_yamls_merge_key_takes_over_what_a_section_does_not_say():
    found = scene("""
bodies:
  a: &rod {type: rigid, mass: 1, inertia: 0.1, points: {h: [0, 0], t: [1, 0]}}
  b:
    <<: *rod
    mass: 2
joints:
  h: {type: revolute, points: [ground, a.h], at: [0, 0]}
  k: {type: revolute, points: [a.t, b.h]}
""")
    assert (found.bodies["a"].mass, found.bodies["b"].mass) == (1, 2)
    assert found.bodies["b"].points == found.bodies["a"].points
    said = refused("bodies: {a: {<<: 5, type: rigid, mass: 1, inertia: 1, points: {c: [0, 0]}}}\n")
    assert "'<<' takes the keys of another section" in said


def test_files_of_points_and_backslashes_in_their_paths(tmp_path):
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "p.csv").write_text("0,0\n1,0\n2,1\n3,0\n")
    text = BEAD.replace(
        "points: [[0, 0], [0.1, 0.03], [0.2, 0.02], [0.3, 0.05]]", "file: data\\p.csv"
    )
    (tmp_path / "model.yaml").write_text("title: t\n" + text + RUN)
    assert len(fl.load_scene(tmp_path / "model.yaml").curves["g"].points) == 4
    (tmp_path / "model.yaml").write_text("title: t\n" + text.replace("file:", "points:") + RUN)
    with pytest.raises(SceneError, match=r"those of a file: 'file: data.p\.csv' in place"):
        fl.load_scene(tmp_path / "model.yaml")


def test_a_range_that_runs_backwards_is_refused():
    with pytest.raises(ValuesError, match="runs backwards"):
        range_of("2:1")
    assert range_of("1:2").low == 1


def test_a_guarded_script_may_come_from_standard_input():
    script = (
        "import exudyn_flexlink as fl\n"
        "if __name__ == '__main__':\n"
        "    scene = fl.load_scene('rigid', turns=0.02)\n"
        "    table = fl.sweep(scene, {'drives.motor.value': [5, 6]}, workers=2)\n"
        "    print(len(table.rows), 'rows')\n"
    )
    ran = subprocess.run(
        [sys.executable, "-"], input=script, capture_output=True, text=True, check=False,
        cwd=Path(__file__).parents[1], timeout=120,
    )  # fmt: skip
    assert ran.stdout == "2 rows\n", ran.stderr
