"""Peaks belong to the run: whatever is sampled, however long it is, in every engine."""

from functools import cache

import numpy as np
import pytest
from cli_runs import MODELS

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.observables import lever_response, path, strikes

STIFF = ("bodies.link.rods=3", "bodies.link.hinges.stiffness=beam")
MINIMAL, REDUNDANT = ("exudyn", "minimal"), ("exudyn", "redundant")
LAGRANGIAN = ("lagrangian", "auto")
ENGINES = [MINIMAL, LAGRANGIAN]
STRIKING = ("bodies.link.rods=2", "initial.angles.guide=175 deg", "run.turns=0.06")
RAD = 1e-4  # of the lever's angle: the tolerance of 1e-6 m over its 30 mm is 3.3e-5


@cache
def run(by, *settings, model="no_clearance.yaml"):
    engine, formulation = by
    coarse = ["accuracy.tolerance=1e-5"] if by == REDUNDANT else []  # which takes many steps
    result = simulate(
        load_scene(MODELS / model, [f"solver.formulation={formulation}", *coarse, *settings]),
        engine,
        measure=False,
    )
    assert result.outcome.completed
    return result


def peaks(result):
    """Angle of the lever farthest from rest after each strike, as the program tells it."""
    response = lever_response(result, "strike")
    begins = [s.begin for s in strikes(result, "strike")]
    return [
        response.between(begin, end).farthest
        for begin, end in zip(begins, [*begins[1:], np.inf], strict=True)
    ]


@pytest.mark.parametrize("by", ENGINES)
def test_equal_strikes_have_equal_peaks(by):
    told = peaks(run(by, *STIFF, "run.turns=2.7", "run.sample=20 ms"))
    assert len(told) == 2
    np.testing.assert_allclose(told, peaks(run(LAGRANGIAN, *STIFF, "run.turns=1"))[0], atol=RAD)


@pytest.mark.parametrize("by", ENGINES)
def test_peaks_do_not_depend_on_samples(by):
    """Of runs of as few samples as there may be."""
    coarse, fine = (run(by, *STIFF, "run.turns=0.6", f"run.sample={s}") for s in ("1 s", "0.04 ms"))
    assert len(fine.time) > 50 * len(coarse.time)
    np.testing.assert_allclose(peaks(coarse), peaks(fine), atol=1e-9)
    for name, own in fine.extremes.items():
        seen = coarse.extremes[name]
        np.testing.assert_allclose([*own.least, *own.greatest], [*seen.least, *seen.greatest])
    one, other = (strikes(result, "strike") for result in (coarse, fine))
    assert [s.peak_force for s in one] == pytest.approx([s.peak_force for s in other])


@pytest.mark.parametrize("by", [*ENGINES, REDUNDANT])
def test_peaks_of_a_quick_lever_are_those_of_fine_samples(by):
    quick = ("springs.lever_return.frequency=200 Hz", *STRIKING)
    told = lever_response(run(by, *quick, "run.sample=1 ms"), "strike")
    fine = lever_response(run(by, *quick, "run.sample=5 us"), "strike")
    assert told.least[0] == pytest.approx(fine.value.min(), abs=1e-6)
    assert told.greatest[0] == pytest.approx(fine.value.max(), abs=1e-6)


@pytest.mark.parametrize("by", [*ENGINES, REDUNDANT])
def test_distance_and_speed_of_the_point_are_extremes_too(by):
    told = run(by, *STRIKING, "run.sample=50 ms").extremes
    seen = path(run(by, *STRIKING, "run.sample=5 us"), "link.end")
    for name, values, off in (
        ("link.end.x_m", seen.position[:, 0], 1e-8),
        ("link.end.y_m", seen.position[:, 1], 1e-8),
        ("link.end.distance_m", np.linalg.norm(seen.position, axis=1), 1e-8),
        ("link.end.speed_m_per_s", np.linalg.norm(seen.velocity, axis=1), 1e-4),
    ):
        ends = [told[name].least[0], told[name].greatest[0]]
        assert ends == pytest.approx([values.min(), values.max()], abs=off)


@pytest.mark.parametrize("by", [*ENGINES, REDUNDANT])
def test_the_least_speed_of_a_point_that_all_but_rests_is_not_lost(by):
    """Its square has a sharp bend there, and the root of what that is off by would be much."""
    result = run(by, "bodies.link.rods=2", "run.turns=1", "run.sample=0.01 ms")
    least, at = result.extremes["link.end.speed_m_per_s"].least
    seen = path(result, "link.end")
    near = np.argsort(np.abs(seen.time - at))[:5]
    square = np.sum(seen.velocity[near] ** 2, axis=1)
    bend, slope, value = np.polyfit(seen.time[near] - at, square, 2)
    assert least == pytest.approx(np.sqrt(value - slope**2 / (4 * bend)), rel=1e-3)


def test_a_strike_that_begins_as_the_run_ends_presses_as_deep_as_the_point_is():
    """Its law while it closes fast: stiffness times depth."""
    ball = "benchmarks/bouncing_ball.yaml"
    whole = run(REDUNDANT, "run.duration=0.5", model=ball)
    begin = strikes(whole, "hit")[0].begin
    cut = run(REDUNDANT, f"run.duration={begin!r}", model=ball)
    (last,) = strikes(cut, "hit")
    stiffness = cut.scene.contacts["hit"].law.stiffness
    assert last.peak_force == pytest.approx(-stiffness * cut.contacts["hit"].gap[-1], rel=1e-6)
    assert last.peak_force > 0
