"""From a file to a checked scene: mistakes of every kind at once."""

from math import cos, radians, sin
from pathlib import Path

import pytest

from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.mechanism import build_curves
from exudyn_flexlink.scene import (
    CircleSpec,
    JoinedSpec,
    LapsSpec,
    LineSpec,
)
from exudyn_flexlink.source import SceneError

MODEL = Path(__file__).parents[1] / "models" / "no_clearance.yaml"


def line(first, last):
    return LineSpec(from_=(first, 0.0), to=(last, 0.0))


def ring(radius):
    return CircleSpec(centre=(0.0, 0.0), radius=radius)


def test_a_setting_is_blamed_for_what_it_breaks():
    # The egg still passes (0.04, 0), the ellipse no longer: the laps do not meet. Both are told.
    with pytest.raises(SceneError) as found:
        load_scene(MODEL, ["curves.ellipse.semi_axes=[0.05, 0.03]", "run.turns=-1"])
    assert {mistake.path[0] for mistake in found.value.mistakes} == {"curves", "run"}
    assert "--set run.turns=-1: run.turns: must be greater than 0" in str(found.value)
    assert "passes the meeting point (0.05, 0)" in str(found.value)


@pytest.mark.parametrize("end", ["run.at_most=1", "run.duration=1"])
def test_a_drive_at_rest_is_right_where_the_run_ends_without_it(end):
    assert load_scene(MODEL, ["drives.motor.value=0", end]).drives["motor"].value == 0


def test_a_curve_is_built_from_those_it_names():
    curves, mistakes = build_curves(
        {"both": JoinedSpec(pieces=("one", line(1, 2))), "one": line(0, 1)}
    )
    assert mistakes == []
    assert curves["both"].point(curves["both"].end) == pytest.approx([2, 0])
    assert list(curves) == ["both", "one"]


def test_a_wrong_curve_is_told_once_and_those_that_contain_it_are_left_out_in_silence():
    specs = {
        "invalid": None,
        "of_invalid": JoinedSpec(pieces=("invalid",)),
        "of_unknown": JoinedSpec(pieces=("nobody", line(0, 1))),
        "cyclic": JoinedSpec(pieces=("cyclic2",)),
        "cyclic2": JoinedSpec(pieces=("cyclic",)),
        "of_laps": LapsSpec(curves=("laps",)),
        "laps": LapsSpec(curves=(ring(1),)),
        "whole": line(0, 1),
        "gap": JoinedSpec(pieces=(line(0, 1), line(2, 3))),
        "of_gap": JoinedSpec(pieces=("gap",)),
    }
    curves, mistakes = build_curves(specs)
    assert [mistake.path for mistake in mistakes] == [("curves", "gap", "pieces", 1)]
    assert set(curves) == {"laps", "whole"}


# --- links that start in a wall ---------------------------------------------------------------

CLEARANCE = MODEL.with_name("clearance.yaml")


def test_of_all_nodes_in_a_wall_the_deepest_is_named():
    # P is 20 mm from C, the end some 60 mm further is still inside the guide of 90 mm.
    short = "bodies.link.length=0.06"
    depth = 0.06 * sin(radians(10)) - 0.005
    with pytest.raises(SceneError) as found:
        load_scene(CLEARANCE, [short, "initial={angles: {guide: 0, link: 10 deg}}"])
    assert [mistake.path for mistake in found.value.mistakes] == [("joints", "sleeve")]
    said = f"starts {depth:.3g} m inside its guide's walls: node 11 on upper wall"
    assert said in str(found.value)
    with pytest.raises(SceneError, match="node 11 on lower wall"):
        load_scene(CLEARANCE, [short, "initial={angles: {guide: 0, link: -10 deg}}"])


def test_a_link_that_leans_on_a_corner_at_the_start():
    # P is 60 mm from C: the mouth is 30 mm ahead, on rod 5, whose nodes are clear of the walls.
    turned, ahead = radians(10), 0.03
    depth = ahead * sin(turned) - 0.005 * cos(turned)
    with pytest.raises(SceneError) as found:
        load_scene(CLEARANCE, ["initial={angles: {guide: 180 deg, link: 190 deg}}"])
    said = f"starts {depth:.3g} m inside its guide's walls: rod 5 on upper corner of the end"
    assert said in str(found.value)
    assert load_scene(
        CLEARANCE,
        ["initial={angles: {guide: 180 deg, link: 189 deg}}", "joints.pivot.at=[-0.3, 0]"],
    )
