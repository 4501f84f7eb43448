"""Where quantities turn within steps: against functions whose turns are known."""

import numpy as np
import pytest
from cli_runs import MODELS

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.integrate.events import StepPolynomial, TurnSeeker, first_fall, highest
from exudyn_flexlink.loading import load_scene

RADAU = np.array([0, 0.057104196, 0.276843014, 0.583590433, 0.860240136, 1])
ENDS = np.array([0.0, 1.0])


def seek(value, rate, edges, nodes, blocks=1):
    """Turns found of one quantity, in steps between the edges."""
    polynomial, seeker = StepPolynomial(nodes), TurnSeeker(1)
    for part in np.array_split(np.arange(len(edges) - 1), blocks):
        time, length = edges[part], edges[part + 1] - edges[part]
        at = time[:, None] + length[:, None] * nodes
        slopes = (length[:, None] * rate(at))[..., None]
        seeker.take(polynomial, (time, length), value(at)[..., None], slopes)
    return seeker.turning_points(0)


@pytest.mark.parametrize(("nodes", "off"), [(RADAU, 1e-10), (ENDS, 2e-5)])
@pytest.mark.parametrize("blocks", [1, 3])
def test_turns_of_a_sine_are_found_at_their_heights(nodes, off, blocks):
    edges = np.linspace(0.1, 9.7, 33)
    time, value = seek(np.sin, np.cos, edges, nodes, blocks)
    turns = np.pi * (np.arange(3) + 0.5)
    assert time[[0, -1]].tolist() == [0.1, 9.7]  # the ends of the run
    np.testing.assert_allclose(time[1:-1], turns, atol=1e-2 if nodes is ENDS else 1e-5)
    np.testing.assert_allclose(value[1:-1], [1, -1, 1], atol=off)


@pytest.mark.parametrize("blocks", [1, 4])
@pytest.mark.parametrize("nodes", [RADAU, ENDS])
def test_a_turn_right_where_a_step_ends_is_found(nodes, blocks):
    """There the slope of the sine is rounding on both sides."""
    time, value = seek(np.sin, np.cos, np.pi / 4 * np.arange(9), nodes, blocks)
    np.testing.assert_allclose(time, np.pi * np.array([0, 0.5, 1.5, 2]), atol=1e-15)
    np.testing.assert_allclose(value, [0, 1, -1, 0], atol=1e-15)


def test_an_impulse_leaves_both_values_it_jumps_between():
    edges = np.array([0.0, 1.0, 2.0])
    polynomial, seeker = StepPolynomial(ENDS), TurnSeeker(1)
    values = np.array([[0.0, 1.0], [-2.0, -1.0]])[..., None]  # a speed that rises, falls, rises
    seeker.take(polynomial, (edges[:-1], np.diff(edges)), values, polynomial.slopes(values))
    time, value = seeker.turning_points(0)
    assert value.tolist() == [0, 1, -2, -1]
    assert time.tolist() == [0, 1, 1, 2]


def test_what_is_a_difference_of_larger_numbers_stands_still_where_they_do():
    """0.3 and 0.1 + 0.2 differ by their rounding, which is no turn; a larger wave is one."""
    polynomial, edges = StepPolynomial(RADAU), np.linspace(0, 1, 101)
    time, length = edges[:-1], np.diff(edges)
    phase = 60 * (time[:, None] + length[:, None] * RADAU)[..., None]
    for height, count in ((1e-15, 2), (1e-10, 2 + 19)):
        seeker = TurnSeeker(1)
        values, slopes = height * np.sin(phase), height * 0.6 * np.cos(phase)
        seeker.take(polynomial, (time, length), values, slopes, np.array([1e-12]))
        assert len(seeker.turning_points(0)[0]) == count


@pytest.mark.parametrize("formulation", ["minimal", "redundant"])
@pytest.mark.parametrize(
    ("model", "name", "is_"),
    [("friction_wheels", "driver.rate_rad_per_s", 20), ("slider_crank", "slider.pin.y_m", 0)],
)
def test_what_a_joint_or_a_drive_holds_does_not_turn(formulation, model, name, is_):
    settings = [f"solver.formulation={formulation}", "run={duration: 0.1}"]
    scene = load_scene(MODELS / "textbook" / f"{model}.yaml", settings)
    found = simulate(scene, measure=False).extremes[name]
    assert len(found.time) == 2
    np.testing.assert_allclose(found.value, is_, atol=1e-9)


def test_the_highest_place_may_be_an_end():
    places = highest(lambda at: at * np.array([[1.0], [-1.0]]), np.zeros(2), np.ones(2))
    assert places.tolist() == [1, 0]


def test_a_peak_next_to_an_end_is_found():
    """Nearer than the last looks are apart."""
    tops = np.array([[1e-4], [1 - 1e-4]])
    places = highest(lambda at: -((at - tops) ** 2), np.zeros(2), np.ones(2))
    np.testing.assert_allclose(places, tops[:, 0], atol=1e-12)


@pytest.mark.parametrize("rate_is_zero_at", [0.03, 0.7, 0.88, 0.95])
def test_the_least_of_two_values_falls_where_one_does_whatever_the_rate_of_the_other_does(
    rate_is_zero_at,
):
    """A force that does not change has a rate of rounding, whose sign says nothing."""
    time = first_fall(
        lambda t: min(1.0, 0.9 - t), lambda t: 1e-15 * (t - rate_is_zero_at), (0.0, 1.0)
    )
    assert time == pytest.approx(0.9, abs=1e-12)
