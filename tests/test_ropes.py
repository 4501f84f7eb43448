"""Ropes, buffers, springs by a table or a formula: closed forms and independent integrations."""

import re
from math import cos, pi, sqrt

import numpy as np
import pytest
from physics_tools import alone, scene
from test_physics_impulse import balanced

import exudyn_flexlink as fl
from exudyn_flexlink.continuing import continued, joined
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.mechanism import build_mechanism
from exudyn_flexlink.plots.outline import drawn_lines
from exudyn_flexlink.report import run_text

G = 9.81
CATCH = """
bodies:
  man: {{type: rigid, mass: 70, inertia: 1, points: {{c: [0, 0]}}}}
springs:
  rope:
    type: linear
    points: [ground, man.c]
    at: [0, 0]
    acts: tension
    length: 12
    stiffness: 1500
    {more}
gravity: 9.81
initial: {{positions: {{man: {at}}}, velocities: {{man: [0, 0]}}}}
run: {{duration: {time}, sample: {sample}}}
accuracy: {{tolerance: 1.0e-10}}
"""


def test_a_rope_catches_who_falls():
    """s = (m g/k)(1 + sqrt(1 + 2 k l/(m g))); the fall comes back to where it began."""
    period = 3.866205323
    result = alone(CATCH.format(more="", at="[0, 0]", time=period, sample=period / 4))
    (catch,) = result.intervals["rope"]
    assert catch.begin == pytest.approx(1.564123774, abs=1e-9)
    assert catch.approach_speed == pytest.approx(15.34405422, rel=1e-9)
    assert catch.penetration == pytest.approx(3.803959118, rel=1e-9)
    assert catch.peak_force == pytest.approx(5705.938676, rel=1e-9)
    assert catch.end - catch.begin == pytest.approx(0.7379577748, abs=1e-9)
    assert catch.energy_lost == pytest.approx(0, abs=1e-6)
    lowest = np.searchsorted(result.time, period / 2 - 1e-9)
    assert result.poses[lowest, 0, 1] == pytest.approx(-12 - 3.803959118, rel=1e-9)
    assert result.poses[-1, 0, 1] == pytest.approx(0, abs=1e-8)
    assert balanced(result)


def test_a_rope_with_a_damper_never_pushes():
    """It is slack where k s + c s' = 0, faster than one that pushes until s = 0 (7.0509 m/s)."""
    result = alone(CATCH.format(more="damping: 120", at="[0, 0]", time=3, sample=1))
    (catch,) = result.intervals["rope"]
    assert catch.penetration == pytest.approx(2.905401221, rel=1e-9)
    assert catch.separation_speed == pytest.approx(8.44986579, rel=1e-9)
    assert result.contacts["rope"].force.min() >= 0
    held = 120 * catch.separation_speed / 1500  # m, where it lets go
    lost = 70 * (G * (12 + held) - catch.separation_speed**2 / 2)
    assert catch.energy_lost == pytest.approx(lost, rel=1e-9)
    assert balanced(result)


def test_errors_of_forces_are_told_also_where_none_acts_but_in_contact():
    text = CATCH.format(more="", at="[0, 0]", time=2, sample=0.1).replace("1.0e-10", "1 mm")
    said = " ".join(run_text(fl.simulate(scene(text))).split())
    assert "(contact force of rope) in contact" in said
    assert "forces not measured" not in said


def test_a_buffer_along_a_slide_is_drawn_as_no_stop():
    own = scene(BUFFER.format(where=ALONG, force="stiffness: 2000", time=1, sample=1))
    assert "stop" not in {line.kind for line in drawn_lines(own, build_mechanism(own))}


def test_a_rope_that_starts_stretched_pulls_at_once():
    """From rest at s it throws up by k s^2/2 = m g h, if h is beyond the slack of s."""
    result = alone(CATCH.format(more="", at="[0, -16]", time=2, sample=0.01))
    (pull,) = result.intervals["rope"]
    assert pull.begin == 0
    assert result.energy.stored[0] == pytest.approx(1500 * 16 / 2 - 70 * G * 16)
    assert pull.separation_speed == pytest.approx(sqrt(1500 * 16 / 70 - 2 * G * 4), rel=1e-9)
    assert abs(result.energy.dissipated).max() < 1e-6
    assert balanced(result)


BUFFER = """
bodies:
  car: {{type: rigid, mass: 1.5, inertia: 1, points: {{c: [0, 0], d: [0.1, 0]}}}}
joints:
  way: {{type: prismatic, points: [ground, car.c], at: [0.3, 0.1], axis: [1, 0]}}
springs:
  buffer: {{type: linear, {where}, acts: compression, length: 0.2, {force}}}
initial: {{along: {{way: 0.3}}, speeds_along: {{way: -4}}}}
run: {{duration: {time}, sample: {sample}}}
accuracy: {{tolerance: 1.0e-11}}
"""
ALONG, BETWEEN = "joint: way", "points: [ground, car.c], at: [0.3, 0.1]"


@pytest.mark.parametrize("where", [ALONG, BETWEEN])
def test_a_preloaded_buffer_begins_with_its_preload(where):
    """50 N + 2000 x: the car comes back with the speed that it had."""
    force = "stiffness: 2000, preload: 50"
    result = alone(BUFFER.format(where=where, force=force, time=0.12, sample=0.01))
    (touch,) = result.intervals["buffer"]
    assert touch.begin == pytest.approx(0.025, abs=1e-12)
    assert touch.penetration == pytest.approx(0.08736102527, rel=1e-9)
    assert touch.end - touch.begin == pytest.approx(0.07374653284, abs=1e-9)
    assert touch.separation_speed == pytest.approx(4, rel=1e-9)
    assert touch.peak_force == pytest.approx(50 + 2000 * 0.08736102527, rel=1e-9)
    assert balanced(result)


def test_a_buffer_by_a_table_gives_back_what_it_took():
    """The area below the table is the car's energy where it turns: 12 J at 0.05549 m."""
    rows = [[0.12, -1200], [0.15, -400], [0.18, -120], [0.2, -40]]
    force = f"force: {{points: {rows}}}"
    for where in (ALONG, BETWEEN):
        result = alone(BUFFER.format(where=where, force=force, time=0.1, sample=0.01))
        (touch,) = result.intervals["buffer"]
        assert touch.begin == pytest.approx(0.025, abs=1e-12)
        assert touch.penetration == pytest.approx(0.05549390153, rel=1e-9)
        assert touch.peak_force == pytest.approx(546.5040409, rel=1e-9)
        assert touch.end - touch.begin == pytest.approx(0.04186227147, abs=1e-10)
        assert touch.separation_speed == pytest.approx(4, rel=1e-9)
        assert balanced(result)


WEIGHT = """
bodies:
  car: {{type: rigid, mass: 2, inertia: 1, points: {{c: [0, 0], d: [0.1, 0]}}}}
joints:
  way: {{type: prismatic, points: [ground, car.c], at: [0, 0], axis: [1, 0]}}
springs:
  spring: {{type: linear, {where}, force: {force}}}
initial: {{along: {{way: {start}}}, speeds_along: {{way: {speed}}}}}
run: {{duration: 0.5, sample: 0.005}}
accuracy: {{tolerance: 1.0e-11}}
"""
OVER = "points: [ground, car.c], at: [0, 0.3]"


@pytest.mark.parametrize(
    ("where", "force", "start", "speed", "energy"),
    [
        ("joint: way", "200*length + 4e4*length**3", 0.1, 0.3, lambda s: 100 * s**2 + 1e4 * s**4),
        (OVER, "900*(length - 0.4)", 0.1, 1.0, lambda s: 450 * (np.hypot(s, 0.3) - 0.4) ** 2),
        (
            "joint: way",
            "{points: [[-0.5, -90], [0, 0], [0.05, 5], [0.5, 200]]}",
            0.1,
            1.0,
            lambda s: np.where(
                s < 0,
                90 * s**2,
                np.where(s < 0.05, 50 * s**2, 0.125 + (s - 0.05) * (5 + (s - 0.05) * 195 / 0.9)),
            ),
        ),
    ],
)
def test_a_spring_by_a_table_or_a_formula_keeps_energy(where, force, start, speed, energy):
    """The integral of its force is stored: of every sample, with the kinetic energy, it is one."""
    result = alone(WEIGHT.format(where=where, force=force, start=start, speed=speed))
    place, rate = result.poses[:, 0, 0], result.rates[:, 0, 0]
    whole = rate**2 + energy(place)
    assert np.ptp(whole) < 1e-9 * whole[0]
    again = simulate(continued(result, 0.2), measure=False)
    end = again.rates[-1, 0, 0] ** 2 + energy(again.poses[-1, 0, 0])
    assert end == pytest.approx(whole[0], rel=1e-9)
    assert np.ptp(place) > 0.1
    assert result.energy.stored - result.energy.stored[0] == pytest.approx(
        energy(place) - energy(start), abs=1e-11
    )
    assert balanced(result)


def test_a_torsional_spring_by_a_formula_swings_like_a_pendulum():
    """Of torque m g l sin(angle), from 60 deg: the period by the arithmetic-geometric mean."""
    text = """
bodies:
  wheel: {type: rigid, mass: 1, inertia: 0.05, points: {c: [0, 0], rim: [0.1, 0]}}
joints:
  axle: {type: revolute, points: [ground, wheel.c], at: [0, 0]}
springs:
  spring: {type: torsional, joint: axle, torque: 4 N m * sin(angle)}
initial: {angles: {wheel: 60 deg}}
"""
    a, b = 1.0, cos(pi / 6)
    for _ in range(6):
        a, b = (a + b) / 2, sqrt(a * b)
    period = 2 * pi * sqrt(0.05 / 4) / a
    end = f"run: {{duration: {period!r}, sample: {period / 8!r}}}\naccuracy: {{tolerance: 1.0e-11}}"
    result = alone(text + end)
    assert result.poses[[2, 4, 8], 0, 2] == pytest.approx([0, -pi / 3, pi / 3], abs=1e-9)
    assert result.energy.stored[0] == 0
    assert result.energy.kinetic.max() == pytest.approx(2, rel=1e-9)
    assert balanced(result)
    part = alone(text + end, f"run.duration={period / 4!r}")
    assert abs(joined(part, simulate(continued(part), measure=False)).energy.stored[-1]) < 1e-8


@pytest.mark.parametrize("more", ["", ", acts: compression, length: 0.2"])
def test_a_run_stops_where_a_table_ends(more):
    force = "force: {points: [[0.15, -400], [0.2, -40]]}"
    text = BUFFER.format(where=ALONG, force=force, time=0.1, sample=0.01)
    text = text.replace(", acts: compression, length: 0.2", more)
    text = text.replace("way: 0.3}, ", "way: 0.19}, ")
    result = simulate(scene(text), measure=False)
    assert not result.outcome.completed
    assert re.search("the table of .*'buffer' ends", result.outcome.reason)
    assert result.poses[-1, 0, 0] == pytest.approx(0.3 + 0.15, abs=1e-6)
