"""A curve of which engines know nothing: it runs in slots and contacts, by its places alone."""

import numpy as np
import pytest
from cli_runs import MODELS
from physics_tools import scene
from scipy.special import gamma

from exudyn_flexlink.curves import Arc, Curve, Superellipse
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.observables import common_times, separation

PAD = Superellipse((0.1, -0.2), (0.3, 0.2), 4.0, rotation=0.4)
BEAD = """
bodies: {bead: {type: rigid, mass: 0.5, inertia: 1.0e-3}}
curves: {pad: {type: superellipse, centre: [0, 0], semi_axes: [0.3, 0.2], exponent: 4}}
joints: {groove: {type: slot, point: bead.centre, curve: pad}}
initial:
  {positions: {bead: [0.3, 0]}, velocities: {bead: [0, 1.5]}, angles: {bead: 0}, speeds: {bead: 0}}
run: {duration: 1.5}
accuracy: {tolerance: 1.0e-6}
"""


@pytest.mark.parametrize("exponent", [3.5, 4.0, 7.0])
def test_places_are_on_the_curve_and_slopes_are_those_of_the_places(exponent):
    curve = Superellipse((0.1, -0.2), (0.3, 0.2), exponent, rotation=0.4)
    u = np.linspace(0, 2 * np.pi, 50)
    x, y = (((curve.places(u)[0] - (0.1 - 0.2j)) * np.exp(-0.4j)) / 1).view(float).reshape(-1, 2).T
    assert np.abs(x / 0.3) ** exponent + np.abs(y / 0.2) ** exponent == pytest.approx(1)
    step = 1e-5
    before, after = curve.places(u - step), curve.places(u + step)
    for order in (1, 2):
        slope = (after[order - 1] - before[order - 1]) / (2 * step)
        assert curve.places(u)[order] == pytest.approx(slope, abs=1e-8)


def test_an_area_is_that_of_lames_curve():
    """4 a b Gamma(1 + 1/n)^2 / Gamma(1 + 2/n)."""
    u = np.linspace(0, 2 * np.pi, 4001)[:-1]
    place, along, _ = PAD.places(u)
    area = 0.5 * np.mean((np.conj(place - (0.1 - 0.2j)) * along).imag) * 2 * np.pi
    assert area == pytest.approx(4 * 0.3 * 0.2 * gamma(1.25) ** 2 / gamma(1.5), rel=1e-10)


@pytest.mark.parametrize("angle", [0.0, 0.3, 2.0])
def test_crossings_that_are_searched_are_those_of_a_formula(angle):
    arc = Arc((0.1, 0.0), (0.3, 0.2), 0.4, 0.2, 3.0)
    origin, direction = np.array([0.0, 0.05]), np.array([np.cos(angle), np.sin(angle)])
    found = Curve.crossings(arc, origin, direction)
    assert np.sort(found) == pytest.approx(np.sort(arc.crossings(origin, direction)), abs=1e-12)


def test_a_closed_curve_is_crossed_where_it_closes_too():
    """By a line along its first axis: at the start of its parameter, and half a lap from there."""
    along = np.array([np.cos(0.4), np.sin(0.4)])
    found = PAD.crossings(np.array([0.1, -0.2]), along)
    assert np.sort(np.mod(found + 0.1, 2 * np.pi)) == pytest.approx([0.1, np.pi + 0.1], abs=1e-12)


@pytest.mark.parametrize(("formulation", "duration"), [("minimal", 1.5), ("redundant", 0.4)])
def test_a_bead_coasts_along_a_superellipse_at_one_speed(formulation, duration):
    """Nothing slows it: its way is that along the curve, two laps or half of one."""
    asked = f"solver.formulation={formulation}", f"run.duration={duration}"
    result = simulate(scene(BEAD, *asked), measure=True)
    assert result.outcome.completed
    curve = Superellipse((0, 0), (0.3, 0.2), 4.0)
    u = np.linspace(0, 2 * np.pi, 20_001)
    whole = curve.arc_length.to(u)
    way = np.mod(1.5 * duration, whole[-1])
    right = curve.point(np.interp(way, whole, u))
    assert result.poses[-1, 0, :2] == pytest.approx(right, abs=3e-6)


def test_a_link_runs_in_a_superellipse_in_both_engines():
    track = (
        "curves={track: {type: superellipse, centre: [0, 0], semi_axes: [0.04, 0.03], exponent: 4}}"
    )
    settings = [track, "contacts={}", "run={turns: 1, of: crank}", "accuracy.tolerance=1e-7"]
    ours, other = (
        simulate(load_scene(MODELS / "rigid.yaml", settings), engine)
        for engine in ("exudyn", "lagrangian")
    )
    assert ours.outcome.completed
    assert separation(ours, other, common_times(ours, other)).max() < 2e-7


def test_a_ball_bounces_on_a_superellipse():
    """It falls on the top, where the curve is flat, from 0.3 m, and comes back as high."""
    text = """
bodies: {ball: {type: rigid, mass: 1, inertia: 1}}
curves: {pad: {type: superellipse, centre: [0, 0], semi_axes: [0.3, 0.2], exponent: 4}}
contacts:
  hit: {type: point_on_curve, point: ball.centre, radius: 0.05, curve: pad, side: right,
    law: {type: impulse, restitution: 1}}
gravity: 9.81
initial: {positions: {ball: [0, 0.55]}}
run: {duration: 0.4}
accuracy: {tolerance: 1.0e-7}
"""
    result = simulate(scene(text), measure=False)
    fall = np.sqrt(2 * 0.3 / 9.81)
    assert result.intervals["hit"].begin == pytest.approx([fall], abs=1e-7)
    later = 0.4 - fall
    assert result.poses[-1, 0, 1] == pytest.approx(0.25 + 9.81 * fall * later - 9.81 * later**2 / 2)
