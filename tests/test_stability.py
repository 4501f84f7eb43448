"""Laps held against earlier ones, sections, spectra: motions in closed form; the command."""

import json
import re
from math import pi

import numpy as np
import pytest
from physics_tools import MODELS, STEEL, scene

import exudyn_flexlink as fl
from exudyn_flexlink.cli import main
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.observables import vibration
from exudyn_flexlink.stability import (
    LapDistances,
    NoRhythmError,
    Rhythm,
    StoppedError,
    lap_distances,
    long_scene,
    repeating,
    rhythm_of,
    section_by_crank,
    section_by_time,
)

TURN = 2 * pi / 10


@pytest.fixture(scope="module")
def track():
    """Run the rigid link on the double track: P on the ellipse and on the egg in turn."""
    model = load_scene(MODELS / "rigid.yaml", ("outputs.watch=link.end",)).changed(contacts={})
    return simulate(long_scene(model, rhythm_of(model), 5, 1e-9), "lagrangian", measure=False)


def test_the_double_track_repeats_itself_every_two_laps(track):
    """The egg is nearer to C, by 10 mm at pi, and nowhere by more."""
    found = lap_distances(track, TURN)
    assert found.largest[0, 1:] == pytest.approx(0.01, rel=1e-6)
    assert np.nanmax(found.largest[1]) < 1e-12
    told = repeating(found, 1e-9)
    assert (told.laps, told.behaviour) == (2, "repeats itself every 2 laps")


def test_a_section_at_pi_sees_both_tracks(track):
    """S is 0.06 + 0.07 or 0.05 + 0.07 m to the left of C, which is at 0.02."""
    found = section_by_crank(track, pi)
    assert found.position[:, 0] == pytest.approx([-0.11, -0.10, -0.11, -0.10, -0.11], abs=1e-8)
    assert found.distinct(1e-6) == 2
    assert found.velocity[:, 1] == pytest.approx(10 * (found.position[:, 0] - 0.02), rel=1e-6)
    assert found.time == pytest.approx(TURN * (np.arange(5) + 0.5), abs=1e-9)
    later = section_by_time(track, TURN, 0.5, after=1.1 * TURN)
    assert later.position == pytest.approx(found.position[1:], abs=1e-8)


def laps(distance):
    """Distances of laps from each earlier one, by a function of both numbers."""
    number = np.arange(1, 21)
    table = [
        [distance(k, k - m) if k > m else np.nan for k in number.tolist()] for m in range(1, 9)
    ]
    return LapDistances("p", number, number.astype(float), np.arange(1, 9), np.array(table))


def test_laps_that_come_nearer_settle():
    """Laps 0.5^k off a motion of period 3, as long as no two are within the error."""

    def apart(k, other):
        return abs(0.5**k - 0.5**other) + (0.1 if (k - other) % 3 else 0.0)

    told = repeating(laps(apart), 1e-12)
    assert (told.laps, told.nearest) == (None, 3)
    assert told.settles == pytest.approx(0.125)
    assert told.behaviour == "settles to a period of 3 laps"
    assert repeating(laps(apart), 1e-3).laps == 3


def test_laps_that_are_as_they_like_repeat_nothing():
    places = np.random.default_rng(3).uniform(size=21)
    found = laps(lambda k, other: abs(places[k] - places[other]))
    told = repeating(found, 1e-9)
    assert (told.laps, told.settles) == (None, None)
    assert told.behaviour == "does not repeat itself within 8 laps"
    assert repeating(found, 1e-9, until=1.5) is None  # up to there one lap alone is known


SWING = """
bodies:
  bob: {type: rigid, mass: 2, inertia: 0.1, points: {p: [0, 0]}}
joints: {rail: {type: prismatic, points: [ground, bob.p], at: [0, 0], axis: [1, 0]}}
springs: {s: {type: linear, joint: rail, stiffness: 7895.68352, length: 0}}
initial: {along: {rail: 0.01}}
run: {duration: 10}
accuracy: {tolerance: 1.0e-7}
"""


def test_the_spectrum_of_a_swing_has_its_line():
    """k = m (2 pi 10 Hz)^2; a sine's mean square, half its amplitude's, is the spectrum's area."""
    found = vibration(simulate(scene(SWING)))
    assert not found.off_ideal
    assert found.x.lines[0] == pytest.approx(10.0, abs=found.x.resolution)
    assert found.y.lines == ()
    area = np.trapezoid(found.x.power, found.x.frequency)
    assert area == pytest.approx(0.01**2 / 2, rel=0.02)


# --- rhythm, scenes -------------------------------------------------------------------------


def test_what_a_lap_is():
    assert rhythm_of(load_scene(MODELS / "no_clearance.yaml")) == Rhythm(pytest.approx(TURN), 2)
    crank = load_scene(MODELS / "textbook" / "slider_crank.yaml")
    assert rhythm_of(crank).laps == 1
    with pytest.raises(NoRhythmError, match="say how long it takes"):
        rhythm_of(scene(SWING))
    assert rhythm_of(scene(SWING), 0.1) == Rhythm(0.1)


# --- Python and the command -----------------------------------------------------------------

HANGING = (
    STEEL
    + """
title: a rod that hangs, damped
bodies:
  rod: {type: rod, length: 0.6, material: steel, section: {width: 20 mm, thickness: 5 mm}}
joints: {pivot: {type: revolute, points: [ground, rod.start], at: [0, 0]}}
springs: {d: {type: torsional, joint: pivot, damping: 0.3}}
gravity: 9.81
initial: {angles: {rod: -80 deg}}
run: {duration: 1}
accuracy: {tolerance: 1.0e-9}
"""
)


def test_a_small_study(tmp_path, capsys):
    file, out = tmp_path / "rod.yaml", tmp_path / "out"
    file.write_text(HANGING)
    assert main(["stability", str(file), "--lap=1.3", "--laps=8", "--after=1", f"--out={out}"]) == 0
    told = capsys.readouterr().out
    assert re.search(r"laps; nearer than \S+ m count as one\n", told)
    assert "rod.end over 8 laps of 1.3 s, from lap 2 on: it repeats itself every lap." in told
    assert "neighbours approach each other" in " ".join(told.split())
    assert sorted(file.name for file in out.iterdir()) == [
        "growth.csv", "laps.csv", "manifest.json", "section.csv", "spectrum_x.csv",
        "spectrum_y.csv", "stability.json", "stability.png",
    ]  # fmt: skip
    data = json.loads((out / "stability.json").read_text())
    inertia = 7850 * 0.6 * 0.02 * 0.005 * 0.6**2 / 3
    off = abs(data["exponent"]["value_per_s"] + 0.3 / (2 * inertia))
    assert off < data["exponent"]["uncertainty_per_s"] + data["exponent"]["solver_per_s"]
    assert data["horizon_s"] is None  # errors do not grow
    assert data["told"] in told


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ([], "hint: '--lap SECONDS'"),
        (["--lap=1", "--laps=5"], "too few laps to tell an exponent: at least 11"),
        (["--lap=1e-9"], "a lap of 1e-09 s can't be run: each of 24 laps must take from"),
        (["--lap=1e30"], "a lap of 1e+30 s can't be run"),
        (["--lap=1", "--laps=900000"], "900000 laps of 1 s can't be run: the run would keep 9.2e+"),
    ],
)
def test_laps_that_no_run_can_have_are_told(options, told, tmp_path, capsys):
    file = tmp_path / "rod.yaml"
    file.write_text(HANGING)
    assert main(["stability", str(file), *options, f"--out={tmp_path / 'o'}"]) == 2
    assert told in capsys.readouterr().err
    assert not (tmp_path / "o").exists()


def test_a_run_too_short_to_be_solved_is_refused_at_its_place(tmp_path):
    """Times so near are one to the numerical methods: such a run would end where it began."""
    file = tmp_path / "rod.yaml"
    file.write_text(HANGING)
    with pytest.raises(fl.SceneError, match=r"run.duration: the run would last 1e-14 s, which is "):
        simulate(load_scene(file, ["run.duration=1.0e-14"]))
    assert simulate(load_scene(file, ["run.duration=1.0e-9"])).time[-1] == 1e-9


def test_from_python():
    settings = {"accuracy.tolerance": 1e-6, "run.turns": 1.2, "bodies.link.rods": 2}
    result = fl.simulate(fl.load_scene("smooth").with_(settings), "lagrangian", measure=False)
    again = result.continued(0.2)
    assert isinstance(again, fl.Scene)
    assert fl.simulate(again.with_({"run.turns": 0.1}), "lagrangian").outcome.completed
    assert result.poincare(0.5).distinct(1.0) == 1
    assert result.lap_distances().largest.shape == (0, 1)
    assert result.lap_distances(after=10.0).largest.shape == (0, 0)
    assert result.vibration().off_ideal


def test_a_bifurcation_from_python(tmp_path):
    """The egg's place at pi, of two turns: one branch each for both laps, whatever the speed.

    A crank at rest makes no laps; whether a study went on does not matter.
    """
    model = fl.idealise(fl.load_scene("rigid", tolerance=1e-6, duration=1), ["impact"])
    asked = {"laps": 3, "after": 1, "angle": pi}

    def made(speeds, **more):
        return fl.bifurcation(model, "drives.motor.value", speeds, "lagrangian", **asked, **more)

    found = made([5.0, 0.0, 10.0], workers=1, folder=tmp_path / "kept")
    values, places = found.points
    assert values.tolist() == [5, 5, 10, 10]
    assert places[:, 0] == pytest.approx([-0.10, -0.11] * 2, abs=1e-6)
    assert list(found.failed) == [0]
    assert "no drive turns a joint" in found.failed[0]
    assert found.plot().axes[0].lines
    (tmp_path / "kept" / "journal.jsonl").write_text("")
    again = made([5.0, 0.0, 10.0], workers=1, folder=tmp_path / "kept", resume=True)
    for one, other in zip(found.sections, again.sections, strict=True):
        assert one.time.tolist() == other.time.tolist()
        assert one.velocity.tolist() == other.velocity.tolist()
    with pytest.raises(StoppedError, match="has a section; at 0: NoRhythmError"):
        made([0.0], workers=1)
