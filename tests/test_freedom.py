"""What `check` says of freedoms and of the start; and a damper without a spring."""

import json
import time
from math import atan2, degrees, exp, hypot, pi

import pytest

from exudyn_flexlink.effects import idealise
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import assemble_scene, scene_of
from exudyn_flexlink.mechanism import moved_by_forces
from exudyn_flexlink.report import check_text, run_text
from exudyn_flexlink.scene import parse_scene
from exudyn_flexlink.source import Document, parse_document
from exudyn_flexlink.storage import save

FOUR_BAR = """
title: four-bar linkage
bodies:
  crank: {type: rigid, mass: 1, inertia: 0.1, points: {a: [0, 0], b: [0.1, 0]}}
  coupler: {type: rigid, mass: 1, inertia: 0.1, points: {b: [0, 0], c: [0.3, 0]}}
  rocker: {type: rigid, mass: 1, inertia: 0.1, points: {d: [0, 0], c: [0.25, 0]}}
joints:
  A: {type: revolute, points: [ground, crank.a], at: [0, 0]}
  B: {type: revolute, points: [crank.b, coupler.b]}
  C: {type: revolute, points: [coupler.c, rocker.c]}
  D: {type: revolute, points: [ground, rocker.d], at: [0.3, 0]}
initial: {angles: {crank: 90 deg}, guesses: {coupler: 30 deg, rocker: 90 deg}}
run: {duration: 1}
accuracy: {tolerance: 1.0e-6}
"""
MOTOR = "drives: {motor: {type: speed, joint: A, value: 60 rpm}}"
OIL = "springs: {oil: {type: torsional, joint: axle, damping: 2}}"
FLYWHEEL = f"""
title: flywheel on a damped axle
bodies: {{wheel: {{type: rigid, mass: 1, inertia: 0.5}}}}
joints: {{axle: {{type: revolute, points: [ground, wheel.centre], at: [0, 0]}}}}
{OIL}
initial: {{speeds: {{wheel: 3}}}}
run: {{duration: 1, sample: 0.1}}
accuracy: {{tolerance: 1.0e-9}}
"""


def scene(text):
    return scene_of(parse_document(text, "model.yaml"))


def block(text, first):
    """Lines of the block of what `check` says that begins with `first`, without double spaces."""
    found = scene(text)
    said = check_text(found, assemble_scene(found)).split("\n\n")
    (lines,) = (part.splitlines() for part in said if part.startswith(first))
    return [" ".join(line.split()) for line in lines]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (FOUR_BAR + MOTOR, [": 1", "prescribed 1, by motor"]),
        (FOUR_BAR, [": 1", "left to forces 1: they move crank, coupler, rocker"]),
        (
            FLYWHEEL.replace("revolute", "weld")
            .replace(OIL, "")
            .replace("initial: {speeds: {wheel: 3}}", ""),
            [": 0, nothing can move"],
        ),
    ],
)
def test_freedoms_are_prescribed_or_left_to_forces(text, told):
    assert block(text, "Degrees") == [f"Degrees of freedom{told[0]}", *told[1:]]


def test_what_a_drive_does_not_reach_is_moved_by_forces_alone():
    """A four-bar with the rocker cut in two is a five-bar, which one drive leaves half free."""
    five_bar = FOUR_BAR.replace("rocker.c]", "tip.d]").replace(
        "joints:", "  tip: {type: rigid, mass: 1, inertia: 0.1, points: {c: [0, 0], d: [0.1, 0]}}\n"
        "joints:\n  E: {type: revolute, points: [rocker.c, tip.c]}"
    ).replace("[0.25, 0]", "[0.2, 0]")  # fmt: skip
    assert block(five_bar + MOTOR, "Degrees") == [
        "Degrees of freedom: 2",
        "prescribed 1, by motor",
        "left to forces 1: they move coupler, rocker, tip",
    ]


def test_the_start_is_told_of_every_body():
    """By the law of cosines in the triangle of rocker, coupler and the line between their ends."""
    across = hypot(0.3, 0.1)
    down = atan2(-0.1, 0.3)  # from the crank's pin to the rocker's
    angle = across**2 + 0.3**2 - 0.25**2
    coupler = down + (pi / 2 - atan2(angle, ((2 * across * 0.3) ** 2 - angle**2) ** 0.5))
    start = block(FOUR_BAR, "Start")
    assert start[0] == "Start"
    assert start[1].startswith(f"crank 90 deg, coupler {degrees(coupler):.4g} deg, rocker ")
    assert start[2].startswith("The joints close in other ways, too")


def test_a_damper_needs_no_spring():
    """I dw/dt = -c w: the speed decays by exp(-c t / I), the angle tends to w0 I / c."""
    result = simulate(scene(FLYWHEEL), measure=False)
    turned = result.poses[:, 0, 2]
    expected = [3 * 0.25 * (1 - exp(-4 * t)) for t in result.time]
    assert turned == pytest.approx(expected, abs=1e-9)


def test_a_damper_without_damping_is_still_a_spring_of_a_model_file():
    bare = idealise(scene(FLYWHEEL), ["damping"])
    assert parse_scene(Document("again", data=bare.to_data())) == bare
    assert bare.springs["oil"].stiffness == 0


BALL = """
title: ball over a fixed bar
gravity: 9.81
bodies:
  ball: {type: rigid, mass: 1, inertia: 0}
  bar: {type: rigid, mass: 1, inertia: 0.1, points: {a: [-0.5, 0], b: [0.5, 0]}}
joints: {hold: {type: weld, points: [ground, bar.centre], at: [0, 0]}}
contacts:
  hit: {type: point_on_line, point: ball.centre, line: [bar.a, bar.b],
        law: {stiffness: 1.0e+5, restitution: 0.8}}
initial: {positions: {ball: [0.1, 0.2]}}
run: {duration: 0.4}
accuracy: {tolerance: 1.0e-6}
"""


def test_a_run_without_a_joint_that_turns_has_neither_laps_nor_crank(tmp_path):
    """Fallen from 0.2 m, the ball strikes at sqrt(2 h / g) = 0.20193 s."""
    result = simulate(scene(BALL), measure=False)
    text = run_text(result)
    head, row = text[text.index("Strikes of contact 'hit'") :].splitlines()[1:3]
    assert head.split() == ["time", "approach", "place", "bar", "peak"]
    assert row.split()[:3] == ["0.20193", "s", "1.9809"]
    assert "lap" not in text
    assert "crank" not in text
    save(result, tmp_path)
    (strike, *_) = json.loads((tmp_path / "summary.json").read_text())["strikes"]["hit"]
    assert not {"lap", "crank_angle_rad"} & set(strike)
    assert strike["begin_s"] == pytest.approx(0.20193, abs=1e-5)


def with_free_bodies(count, text, **initial):
    """A scene with so many free bodies more, at y = 3 m."""
    document = parse_document(text, "model.yaml")
    names = [f"b{i}" for i in range(count)]
    document.data["bodies"] |= {n: {"type": "rigid", "mass": 1, "inertia": 1} for n in names}
    for key, value in {"positions": [0, 3], **initial}.items():
        document.data["initial"][key] = dict.fromkeys(names, value)
    return scene_of(document)


def test_two_thousand_free_bodies_are_checked_in_seconds():
    began = time.process_time()
    found = with_free_bodies(2000, FOUR_BAR, velocities=[1, 2], speeds=3)
    assembly = assemble_scene(found)
    assert time.process_time() - began < 15
    assert assembly.degrees_of_freedom == 6001
    assert abs(assembly.state.v[3:] - [1, 2, 3]).max() == 0
    assert len(moved_by_forces(assembly)) == 2003
    assert time.process_time() - began < 20
