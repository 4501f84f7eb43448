"""What `check` and a run say, against closed forms and the model files."""

import json
import re
from dataclasses import replace
from math import inf, pi, sqrt

import numpy as np
import pytest
from cli_runs import NO_CLEARANCE, RIGID, row
from results import (
    LENGTH,
    LEVER_DAMPING,
    LEVER_FREQUENCY,
    LEVER_PEAK,
    rigid_link,
    scene_from,
    tilting_link,
)

from exudyn_flexlink.cli import main
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.engines.interrupts import radau
from exudyn_flexlink.loading import assemble_scene, load_scene, scene_of
from exudyn_flexlink.mechanism import resolutions
from exudyn_flexlink.report import idle_settings, run_text
from exudyn_flexlink.report.text import WIDTH, Column, Table, entries, instant, table_of_items
from exudyn_flexlink.result import EngineSettings
from exudyn_flexlink.source import parse_document
from exudyn_flexlink.storage import save

WAYS = ("minimal", "redundant")
BULLET = """
title: A bullet that hits a wall
curves: {wall: {type: line, from: [-1 mm, -1], to: [-1 mm, 1]}}
bodies: {bullet: {type: rigid, mass: 1 g, inertia: 1}}
joints: {way: {type: prismatic, points: [ground, bullet.centre], at: [0, 0], axis: [1, 0]}}
contacts:
  hit: {type: point_on_curve, point: bullet.centre, curve: wall, side: right,
        law: {type: impulse, restitution: 0.5}}
initial: {speeds_along: {way: -1 km/s}}
run: {duration: 2 us}
accuracy: {tolerance: 1 um}
"""


@pytest.fixture(autouse=True)
def closed_this_way(monkeypatch):
    """Search no other ways to close the joints, which takes most of a check; elsewhere they are."""
    monkeypatch.setattr("exudyn_flexlink.report.parts.other_ways", lambda *_: [])


# --- check ----------------------------------------------------------------------------------


def test_check_tells_parts_effects_and_freedom(capsys):
    assert main(["check", NO_CLEARANCE]) == 0
    shown = capsys.readouterr()
    assert row(shown.out, "link")[:6] == ["link", "flexible", "10", "rigid", "parts", "0.0027475"]
    assert "E I / length of link" in shown.out
    assert "k 0.2976 N m/rad" in shown.out  # E I / l_PS
    effects = {name: " ".join(row(shown.out, name)[1:]) for name in ("impact", "gravity")}
    assert effects == {"impact": "simulated strike", "gravity": "not in this scene"}
    assert row(shown.out, "flexibility") == ["flexibility", "simulated", "link"]
    assert "Degrees of freedom: 11" in shown.out  # 9 hinges, the lever, the driven crank
    assert "2.513 s (4 turns of crank)" in shown.out
    assert shown.err == ""


def test_strikes_of_a_run_of_microseconds_have_instants_of_their_own():
    """A bullet at 1 km/s, 1 mm before a wall."""
    run = simulate(scene_from(BULLET), measure=True)
    assert row(run_text(run), "0.0000010000")[1] == "s"
    assert instant(0.31415926, 0.7) == "0.31416"  # of other runs they are as before
    assert instant(1234.5, 2e3) == "1234.50000"
    assert instant(0.0, 0.0) == "0.00000"


def test_settings_without_a_use_are_named():
    run = rigid_link()
    scene = run.scene.changed(
        accuracy={"step": 1e-4}, solver={"spectral_radius": 0.5, "integrator": "dop853"}
    )
    tree, joints = (replace(run, scene=scene, settings=EngineSettings(radau(9), f)) for f in WAYS)
    local = replace(run, scene=scene, engine="lagrangian", settings=EngineSettings(radau(9)))
    names = [[text.split("'")[1] for text in idle_settings(r)] for r in (tree, joints, local)]
    both = ["solver.spectral_radius", "solver.integrator"]
    assert names == [both, both[1:], both[:1]]


def test_check_compares_the_link_with_a_beam(capsys):
    beam = ["--set", "bodies.link.hinges.stiffness=beam", "--set", "bodies.link.layout=half_ends"]
    assert main(["check", NO_CLEARANCE, *beam, "--set", "bodies.link.rods=16"]) == 0
    first = row(capsys.readouterr().out, "1")
    area, inertia = 10e-3 * 0.5e-3, 10e-3 * 0.5e-3**3 / 12
    clamped = 3.516015 * sqrt(200e9 * inertia / (7850 * area)) / LENGTH**2 / (2 * pi)
    assert float(first[3]) == pytest.approx(clamped, abs=0.01)
    assert float(first[5]) == pytest.approx(0.09, abs=0.005)  # % off, with 16 rods


def test_check_tells_the_frequency_of_the_lever(capsys):
    main(["check", NO_CLEARANCE, "--set", "springs.lever_return.stiffness=0.04462924"])
    lever = [line for line in capsys.readouterr().out.splitlines() if "about pivot" in line]
    assert [line.split()[3] for line in lever] == ["40.00"]


STEPS = "at most 3.142e-06 s in contact: 60 steps per contact, or more"


@pytest.mark.parametrize(
    ("asked", "told", "untold"),
    [
        ([RIGID], ["flexibility   not in this scene", "Degrees of freedom: 2\n"], "s of link"),
        ([NO_CLEARANCE, "--set", "accuracy.step=1e-4"], ["about 25,133 steps", STEPS], "control"),
        ([NO_CLEARANCE], ["error control"], " steps\n"),
    ],
    ids=["rigid", "fixed step", "error control"],
)
def test_check_tells_what_there_is(asked, told, untold, capsys):
    """No frequencies of a rigid link, and no guess at the number of steps that will be chosen."""
    assert main(["check", *asked]) == 0
    shown = re.sub(r"(?<=\S) {2,}", "   ", capsys.readouterr().out)
    assert all(words in shown for words in told)
    assert untold not in shown


# --- estimates ------------------------------------------------------------------------------


def step_in_contact(model, *settings):
    scene = load_scene(model, settings)
    return min((own.step for own in resolutions(scene, assemble_scene(scene))), default=inf)


def test_the_contact_step_follows_stiffness_and_steps_per_contact():
    # The link can't give way: the lever alone does, a rod about its end struck at its tip, m/3.
    expected = pi * sqrt(7850 * 0.03 * 10e-3 * 1e-3 / 3 / 2e4) / 60
    assert step_in_contact(RIGID) == pytest.approx(expected, rel=1e-6)
    stiffer = ("contacts.strike.law.stiffness=8e4", "solver.steps_per_contact=120")
    assert step_in_contact(RIGID, *stiffer) == pytest.approx(expected / 4, rel=1e-6)


# --- runs -----------------------------------------------------------------------------------


def test_the_peak_of_the_lever_is_found_between_samples():
    text = run_text(rigid_link(turns=1, samples=1201))
    # Turning point of p exp(-d w t) sin(w t), of which the samples miss up to 0.2 %.
    at = np.arctan(1 / LEVER_DAMPING) / LEVER_FREQUENCY
    decay = np.exp(-LEVER_DAMPING * LEVER_FREQUENCY * at)
    peak = -LEVER_PEAK * decay * np.sin(LEVER_FREQUENCY * at)
    assert float(row(text, "1")[9]) == pytest.approx(peak, rel=3e-4)
    assert float(row(text, "lever")[3]) == pytest.approx(peak, rel=3e-4)


def test_a_run_says_how_the_link_stood_in_its_guide():
    lines = run_text(tilting_link()).splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("Link in 'sleeve'"))
    named = ("1", "2", "3", "4", "all")
    rows = {
        words[0]: words for words in map(str.split, lines[start:]) if words and words[0] in named
    }
    assert rows["1"][1:5] == ["100.0", "0.0", "0.0", "0.0"]
    # Lap 2: one point while the sine of the angle is beyond a third.
    assert rows["2"][1:5] == ["21.6", "78.4", "0.0", "0.0"]
    assert [rows[lap][5] for lap in named] == ["0", "2", "4", "4", "10"]
    assert [rows[lap][6] for lap in named] == ["0", "2", "2", "2", "6"]
    told = "\n".join(lines)
    # At the guide's end, 3 mm off the axis of walls 1 mm off; three of the four laps touch there.
    assert "deepest in a wall  0.002 m, 200 % of the clearance" in told
    assert "corner of the end: 0.56 s in 3 touches" in told


# --- tables -------------------------------------------------------------------------------------


@pytest.mark.parametrize("run", [rigid_link(), tilting_link()], ids=["strikes", "touches"])
def test_tables_of_a_run_fit_a_terminal(run):
    assert max(len(line) for line in run_text(run).splitlines() if line[:1] == " ") <= WIDTH


def test_the_deepest_penetration_is_told_as_a_depth(tmp_path):
    """A ball of 2 kg at 0.5 m/s on a spring of 8e4 N/m, without losses: v sqrt(m/k) = 2.5 mm."""
    text = """title: ball
curves: {floor: {type: line, from: [-1, 0], to: [1, 0]}}
bodies: {ball: {type: rigid, mass: 2, inertia: 1.0e-3}}
contacts: {pad: {type: point_on_curve, point: ball.centre, curve: floor, side: left,
           law: {type: hertz, exponent: 1, stiffness: 8.0e4}}}
initial: {positions: {ball: [0, 0.01]}, velocities: {ball: [0, -0.5]}}
run: {duration: 0.1}
accuracy: {tolerance: 1.0e-8}
"""
    result = simulate(scene_of(parse_document(text, "ball.yaml")), measure=False)
    assert result.checks.largest_penetration == pytest.approx(2.5e-3, rel=1e-6)
    assert "penetration 0.0025 m at most" in " ".join(run_text(result).split())
    save(result, tmp_path)
    told = json.loads((tmp_path / "summary.json").read_text())
    assert told["checks"]["largest_penetration"] == pytest.approx(2.5e-3, rel=1e-6)
    assert result.intervals["pad"].penetration == pytest.approx([2.5e-3], rel=1e-6)


def test_a_column_stands_once_for_texts_and_for_files():
    columns = (
        Column("size", "real", "{:.1f}".format, "m", "size_m"),
        Column(None, lambda z: z.imag, key="angle_rad"),
        Column("doubt", lambda z: None if z.imag > 2 else "small"),
    )
    shown = table_of_items("points", columns, [1 + 2j, 3j], 5)
    rows = [["1.0", "small"], ["0.0", ""]]
    assert shown == Table("points", rows, ["size", "doubt"], ["m", ""], "and 3 more")
    assert [entries(columns, z) for z in (1 + 2j, 3j)] == [
        {"size_m": 1.0, "angle_rad": 2.0},
        {"size_m": 0.0, "angle_rad": 3.0},
    ]
