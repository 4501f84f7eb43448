"""What is told of a struck body that slides, or is free: its displacement, in closed form."""

import json
from math import pi, sqrt

import numpy as np
import pytest

from exudyn_flexlink.comparison import compare
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import scene_of
from exudyn_flexlink.observables import DISPLACEMENT, lever_response
from exudyn_flexlink.report import response_table, strike_table
from exudyn_flexlink.source import parse_document
from exudyn_flexlink.storage import load, save
from exudyn_flexlink.storage.run import lever_columns, tables_of
from exudyn_flexlink.sweeps.rows import standard_row

BALL, BUMPER, STIFFNESS = 1.0, 4.0, 4e4  # kg, kg, N/m
SPEED, GAP, RESTITUTION = 2.0, 0.1, 0.8  # m/s, m
AXIS = np.array([0.6, 0.8])  # the ball flies along it
OMEGA = sqrt(STIFFNESS / BUMPER)  # 100 rad/s
# The ball leaves at 0.88 m/s, faster than the bumper ever is: it is struck once.
AMPLITUDE = BALL * (1 + RESTITUTION) * SPEED / (BALL + BUMPER) / OMEGA  # v/omega = 7.2 mm
STRUCK = GAP / SPEED  # s

FACE = "points: {c: [0, 0], up: [-0.4, 0.3], down: [0.4, -0.3]}"  # across the axis
SCENE = f"""
title: A ball strikes a sprung bumper
bodies:
  ball: {{type: rigid, mass: {BALL}, inertia: 0, points: {{c: [0, 0]}}}}
  bumper: {{type: rigid, mass: {BUMPER}, inertia: 1, {FACE}}}
joints:
  rail: {{type: prismatic, points: [POINTS], at: [0, 0], axis: [0.6, 0.8]}}
springs:
  buffer: {{type: linear, joint: rail, stiffness: {STIFFNESS}}}
contacts:
  hit: {{type: point_on_line, point: ball.c, line: [bumper.down, bumper.up], law: LAW}}
initial:
  positions: {{ball: [{-GAP * AXIS[0]}, {-GAP * AXIS[1]}]}}
  velocities: {{ball: [{SPEED * AXIS[0]}, {SPEED * AXIS[1]}]}}
run: {{duration: 0.15, sample: 10 ms}}
accuracy: {{tolerance: 1.0e-9}}
"""
IMPULSE = f"{{type: impulse, restitution: {RESTITUTION}}}"
PENALTY = f"{{stiffness: 1.0e9, restitution: {RESTITUTION}, transition_speed: 0.1 mm/s}}"
CARRIED, CARRYING = "ground, bumper.c", "bumper.c, ground"


def run(points=CARRIED, law=IMPULSE, *settings):
    text = SCENE.replace("POINTS", points).replace("LAW", law)
    return simulate(scene_of(parse_document(text, "bumper.yaml"), settings), measure=False)


@pytest.fixture(scope="module")
def struck():
    return run()


def motion(time):
    """Displacement of the bumper along the rail."""
    since = np.maximum(time - STRUCK, 0.0)
    return AMPLITUDE * np.sin(OMEGA * since)


# --- the response -----------------------------------------------------------------------------


@pytest.mark.parametrize("points", [CARRIED, CARRYING])
def test_a_bumper_swings_by_its_speed_over_its_frequency(points):
    seen = lever_response(run(points), "hit")
    assert seen.measure is DISPLACEMENT
    np.testing.assert_allclose(seen.value, motion(seen.time), atol=1e-9)
    after = seen.time > STRUCK + 1e-9
    speed = AMPLITUDE * OMEGA * np.cos(OMEGA * (seen.time[after] - STRUCK))
    np.testing.assert_allclose(seen.rate[after], speed, atol=1e-6)
    # The rail is square to the face: the tip goes as far, away from the free side.
    np.testing.assert_allclose(seen.tip_displacement, -seen.value, atol=1e-12)


def test_its_peaks_lie_between_the_samples():
    """Six samples a period miss a peak by up to 13 %; the polynomials of the steps do not."""
    result = run(CARRIED, IMPULSE, "run.sample=10.5 ms")
    seen = lever_response(result, "hit")
    for (value, time), sign, quarters in ((seen.greatest, 1, 1), (seen.least, -1, 3)):
        assert value == pytest.approx(sign * AMPLITUDE, abs=1e-9)
        period = (time - STRUCK) % (2 * pi / OMEGA)
        assert period == pytest.approx(quarters * pi / 2 / OMEGA, abs=1e-5)
    assert np.abs(seen.value - AMPLITUDE).min() > 1e-6
    fastest = result.extremes["bumper.rate_m_per_s"].greatest[0]
    assert fastest == pytest.approx(AMPLITUDE * OMEGA, abs=1e-7)


def test_a_stiff_penalty_moves_it_as_far_in_redundant_coordinates():
    """The touch lasts pi sqrt(m/k) = 9e-5 s, 0.9 % of a radian of the bumper's motion."""
    settings = "solver.formulation=redundant", "accuracy.tolerance=1.0e-7"
    seen = lever_response(run(CARRIED, PENALTY, *settings), "hit")
    assert seen.greatest[0] == pytest.approx(AMPLITUDE, rel=2e-3)
    assert seen.least[0] == pytest.approx(-AMPLITUDE, rel=2e-3)


def test_a_body_that_slides_on_a_moving_one_is_told_against_that():
    """Rail and spring ride on a carriage as heavy as can be: it coasts, the bumper swings on it."""
    coast = 0.5  # m/s along x
    text = SCENE.replace("POINTS", "carriage.c, bumper.c").replace("at: [0, 0], ", "")
    text = text.replace("LAW", IMPULSE)
    text = text.replace("  bumper:", "  carriage: {type: rigid, mass: 1.0e12, inertia: 1.0e12, "
                        "points: {c: [0, 0]}}\n  bumper:")  # fmt: skip
    across = np.array([AXIS[1], -AXIS[0]]) * coast
    velocity = SPEED * AXIS + across
    settings = [
        f"initial.velocities={{ball: [{velocity[0]}, {velocity[1]}], "
        f"carriage: [{across[0]}, {across[1]}]}}",
        f"initial.positions={{ball: [{-GAP * AXIS[0]}, {-GAP * AXIS[1]}], carriage: [0, 0]}}",
        "initial.angles={carriage: 0}",
    ]
    result = simulate(scene_of(parse_document(text, "carriage.yaml"), settings), measure=False)
    seen = lever_response(result, "hit")
    np.testing.assert_allclose(seen.value, motion(seen.time), atol=1e-8)


def test_a_free_body_goes_along_the_normal():
    """Without rail and spring it leaves at m (1 + e) v / (m + M), away from the free side."""
    text = SCENE.replace("LAW", IMPULSE)
    begin, end = text.index("joints:"), text.index("contacts:")
    document = parse_document(text[:begin] + text[end:], "free.yaml")
    seen = lever_response(simulate(scene_of(document), measure=False), "hit")
    assert seen.measure is DISPLACEMENT
    gone = AMPLITUDE * OMEGA * np.maximum(seen.time - STRUCK, 0.0)
    np.testing.assert_allclose(seen.value, -gone, atol=1e-9)
    np.testing.assert_allclose(seen.tip_displacement, seen.value, atol=1e-12)
    assert seen.least[0] == pytest.approx(-gone[-1], abs=1e-9)


# --- what is said, drawn and saved --------------------------------------------------------------


def test_tables_and_columns_are_named_by_what_they_hold(struck):
    (told,) = response_table(struck).rows
    assert told == ["bumper", "displacement from -0.0072 to +0.0072 m"]
    table = strike_table(struck, "hit", 5)
    assert table.units[table.head.index("bumper peak")] == "m"
    assert table.rows[0][table.head.index("bumper peak")] in ("-0.0072", "+0.0072")
    columns = lever_columns(struck, "hit")
    np.testing.assert_allclose(columns["displacement_m"], motion(struck.time), atol=1e-9)
    assert {"rate_m_per_s", "tip_displacement_m"} < set(columns)
    assert not [name for table in tables_of(struck).values() for name in table if "angle" in name]
    row = standard_row(struck)
    assert row["bumper.stroke_m"] == pytest.approx(2 * AMPLITUDE, abs=1e-8)
    assert row["bumper.greatest_displacement_m"] == pytest.approx(AMPLITUDE, abs=1e-9)
    assert row["bumper.greatest_rate_m_per_s"] == pytest.approx(AMPLITUDE * OMEGA, abs=1e-7)
    assert not [name for name in row if name.endswith("_rad")]


def test_a_saved_run_is_read_back(struck, tmp_path):
    save(struck, tmp_path)
    summary = json.loads((tmp_path / "summary.json").read_text())
    told = summary["levers"]["bumper"]
    assert told["greatest_displacement_m"] == pytest.approx(AMPLITUDE, abs=1e-9)
    assert STRUCK < told["greatest_displacement_at_s"] < 0.15
    again = lever_response(load(tmp_path), "hit")
    assert again.greatest == lever_response(struck, "hit").greatest
    assert again.measure is DISPLACEMENT


def test_two_runs_are_compared_in_metres(struck):
    other = run(CARRIED, IMPULSE, "accuracy.tolerance=1.0e-8")
    found = compare(struck, other)
    assert found.measures == {"bumper": DISPLACEMENT}
    assert np.abs(found.answer_differences["bumper"]).max() < 2e-8
