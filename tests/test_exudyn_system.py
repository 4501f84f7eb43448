"""Exudyn's own system of a scene, by the door for users: what it holds, and what it refuses."""

import doctest
import re
import runpy
from pathlib import Path

import exudyn
import numpy as np
import pytest
from pages_of_docs import DOCS, ROOT

import exudyn_flexlink as fl
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.report.check import check_text

ELLIPSE = {"joints.pin.curve": "ellipse"}


def test_its_page_shows_what_it_prints():
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    found = doctest.testfile(
        str(DOCS / "engines.md"), module_relative=False, globs={"fl": fl}, optionflags=flags
    )
    assert found.attempted > 2
    assert found.failed == 0


def test_exudyns_eigenvalues_are_the_frequencies_of_check():
    found = runpy.run_path(str(ROOT / "examples" / "exudyn_eigenvalues.py"))["frequencies"]
    scene = fl.load_scene("cantilever")
    told = re.findall(r"^  \d +([\d.]+) Hz", check_text(scene, assemble_scene(scene)), re.MULTILINE)
    assert len(told) == 4
    assert [f"{one:.2f}" for one in np.sort(found)[:4]] == told


def test_a_load_of_ones_own_moves_the_mechanism_as_the_models_drive_does():
    found = runpy.run_path(str(ROOT / "examples" / "exudyn_own_load.py"))
    assert found["apart"] < 2e-7
    without = fl.simulate(found["scene"].with_({"run.sample": 3e-3}), measure=False)
    without = without.path("link.end")
    assert np.abs(without.position - found["path"].position).max() > 1e-4  # that it does


@pytest.mark.parametrize("formulation", ["redundant", "beam"])
def test_names_lead_to_the_items_that_are_meant(formulation):
    changes = {**ELLIPSE, "solver.formulation": formulation, "gravity": 9.81}
    changes["bodies.link.hinges.stiffness"] = "beam"
    changes["drives.push"] = {"type": "force", "point": "lever.end", "value": [1, 2]}
    changes["drives.turn"] = {"type": "torque", "joint": "pivot", "value": 3}
    scene = fl.load_scene("no_clearance").with_(changes)
    system = fl.exudyn_system(scene)
    mbs = system.mbs
    kinds = {
        "crank": "JointRevolute2D",
        "sleeve": "JointPrismatic2D",
        "pin": "ConnectorCoordinateVector",
    }
    for name, kind in kinds.items():
        [number] = system.joints[name]
        assert mbs.GetObject(number)["objectType"] == kind
    [spring] = system.springs["lever_return"]
    kind = "ConnectorCoordinateSpringDamper"
    assert mbs.GetObject(spring)["objectType"] == kind
    [motor], [strike] = system.motors["motor"], system.contacts["strike"]
    assert mbs.GetObject(motor)["objectType"] == "ConnectorCoordinate"
    assert mbs.GetObject(strike)["activeConnector"] is False
    [push], [turn] = system.loads["push"], system.loads["turn"]
    assert list(mbs.GetLoad(push)["loadVector"]) == [1, 2, 0]
    assert mbs.GetLoad(turn)["load"] == 3
    link = {"redundant": "RigidBody2D", "beam": "ANCFCable2D"}[formulation]
    assert {mbs.GetObject(each)["objectType"] for each in system.bodies["link"]} == {link}
    assert len(system.bodies["link"]) == (10 if formulation == "redundant" else 2)
    assert len(system.nodes["link"]) == (10 if formulation == "redundant" else 3)
    assembly = assemble_scene(scene)
    position = exudyn.OutputVariableType.Position
    for name, (marker,) in system.points.items():
        anchor = assembly.mechanism.points[name]
        x, y, angle = assembly.state.q[anchor.part]
        c, s = np.cos(angle), np.sin(angle)
        place = [x + c * anchor.x - s * anchor.y, y + s * anchor.x + c * anchor.y]
        assert mbs.GetMarkerOutput(marker, position)[:2] == pytest.approx(place, abs=1e-12)


def test_what_exudyn_does_not_do_by_itself_is_named():
    of = {
        "no_clearance": (ELLIPSE, ["contacts strike"]),
        "spline_track": ({}, ["slot 'pin': its place"]),
        "hard/curvature_jump": ({}, ["slot 'pin': the piece"]),
        "slider_crank": ({}, ["slot 'way': nothing stops it"]),
        "spin_up_beam": ({}, ["drives jump or bend at 15 s"]),
        "kinked_drive": ({}, ["drive 'pull': no step ends"]),
        "double_pendulum": ({}, []),
    }
    for model, (changes, told) in of.items():
        system = fl.exudyn_system(fl.load_scene(model).with_(changes))
        assert len(system.not_followed) == len(told), model
        for shown, begin in zip(system.not_followed, told, strict=True):
            assert shown.startswith(begin)
            assert shown in repr(system)


@pytest.mark.parametrize(
    ("model", "changes", "key", "message"),
    [
        ("no_clearance", {}, "pin:", "joints.pin.curve: its curve has laps"),
        (
            "cam_follower",
            {},
            "point_on_curve",
            "contacts.cam_face: Exudyn's own solver has no contacts on curves",
        ),
        (
            "no_clearance",
            {**ELLIPSE, "solver.formulation": "beam"},
            "hinges:",
            "'paper' is no beam",
        ),
    ],
)
def test_what_it_can_not_be_is_refused_at_its_line(model, changes, key, message):
    scene = fl.load_scene(model).with_(changes)
    with pytest.raises(fl.NotRepresentableError, match=re.escape(message)) as refused:
        fl.exudyn_system(scene)
    file, line, _ = str(refused.value).rstrip(")").rsplit("(", 1)[1].rsplit(":", 2)
    assert key in Path(file).read_text().splitlines()[int(line) - 1]
    with pytest.raises(TypeError, match="load_scene"):
        fl.exudyn_system(model)
