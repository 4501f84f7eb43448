"""From a file to a checked scene: mistakes of every kind at once."""

from math import cos, radians, sin
from pathlib import Path

import numpy as np
import pytest
from test_mechanism_assembly import assembled, pin, rods

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


# --- speeds that nothing decides ------------------------------------------------------------------


@pytest.mark.parametrize("up", [0.0, 4.0, -1.5])
@pytest.mark.parametrize(
    ("drive", "initial", "trolley", "load"),
    [
        ("drives: {go: {type: speed, joint: rail, value: 2}}\n", "", 2.0, 0.0),
        ("", "speeds: {load: 1}", 0.0, 1.0),
        ("", "speeds_along: {rail: 3}, speeds: {load: 1}", 3.0, 1.0),
    ],
)
def test_speeds_that_are_left_open_do_not_depend_on_a_body_s_axes(
    up, drive, initial, trolley, load
):
    """A load hangs on a trolley: it does not turn, and the trolley stands, unless they have to."""
    found = assembled(
        "bodies:\n"
        "  trolley: {type: rigid, mass: 500, inertia: 100, points: {pin: [0, 0]}}\n"
        f"  load: {{type: rigid, mass: 1000, inertia: 500, points: {{hook: [0, {up}]}},"
        f" centre_of_mass: [0, {up - 4}]}}\n"
        "joints:\n"
        "  rail: {type: prismatic, points: [ground, trolley.pin], at: [0, 0], axis: [1, 0]}\n"
        "  hook: {type: revolute, points: [trolley.pin, load.hook]}\n"
        f"{drive}initial: {{along: {{rail: 0}}, {initial}}}\n"
    )
    assert found.state.v == pytest.approx(
        np.array([[trolley, 0, 0], [trolley + up * load, 0, load]]), abs=1e-11
    )


def test_a_long_chain_whose_ends_are_told_to_turn_hangs_still_between_them():
    count = 60
    bars = "".join(
        f"  b{k}: {{type: rigid, mass: 1, inertia: 0.1, points: {{a: [0, 0], b: [1, 0]}}}}\n"
        for k in range(count)
    )
    joints = pin("j0", "ground", "b0.a", "[0, 0]")
    joints += "".join(pin(f"j{k}", f"b{k - 1}.b", f"b{k}.a") for k in range(1, count))
    told = f"initial: {{speeds: {{b0: 1, b{count - 1}: 3}}}}\n"
    found = assembled(f"bodies:\n{bars}joints:\n{joints}{told}")
    assert found.state.v[:, 2] == pytest.approx([1, *[0] * (count - 2), 3], abs=1e-10)


def test_a_loop_shares_what_it_leaves_open_of_its_angular_speeds():
    """Five bars: of two freedoms one is given; the sum of the squares of the others is least."""
    found = assembled(
        rods(a=0.1, b=0.3, c=0.2, d=0.25)
        + "joints:\n"
        + pin("A", "ground", "a.start", "[0, 0]")
        + pin("B", "a.end", "b.start")
        + pin("C", "b.end", "c.start")
        + pin("D", "c.end", "d.start")
        + pin("E", "ground", "d.end", "[0.45, 0]")
        + "initial: {angles: {a: 60 deg, b: 30 deg}, guesses: {c: -40 deg, d: -70 deg},"
        " speeds: {a: 2}}\n"
    )
    angles, speeds = found.state.q[:, 2], found.state.v[:, 2]
    arms = np.array([0.1, 0.3, 0.2, 0.25]) * np.array([-np.sin(angles), np.cos(angles)])
    free = -np.linalg.pinv(arms[:, 1:]) @ arms[:, 0] * 2  # least squares by another way
    assert speeds == pytest.approx([2, *free], abs=1e-12)
