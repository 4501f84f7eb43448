"""The cubic beam: mass, stiffness and damping against closed forms of Euler and Bernoulli."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exudyn_flexlink.chain import cantilever_roots
from exudyn_flexlink.engines.exudyn.redundant.beam import CubicBeam, Elastic

LENGTH, MASS, AXIAL, BENDING, LAG = 0.07, 0.03925, 1e6, 0.0208, 6.7e-6


def beam(elements, lag=LAG):
    return CubicBeam(LENGTH, elements, Elastic(MASS, AXIAL, BENDING, lag))


def straight(one):
    """Controls of the unbent beam along x, (1, controls, 2)."""
    controls = np.zeros((1, one.count, 2))
    controls[0, ::2, 0] = np.linspace(0, LENGTH, one.elements + 1)
    controls[0, 1::2, 0] = 1.0
    return controls


def stiffness_across(one, size=1e-8):
    """Second derivative of the stored energy by the controls across the straight beam."""
    n = one.count

    def energy(across):
        controls = straight(one)
        controls[0, :, 1] = across
        return one.stored(controls)[0]

    unit = size * np.eye(n)
    plus = [[energy(a + b) for b in unit] for a in unit]
    minus = [[energy(a - b) for b in unit] for a in unit]
    return (np.array(plus) - np.array(minus)) / (2 * size**2)


@pytest.mark.parametrize("elements", [1, 3])
def test_kinetic_energy_of_rigid_motions(elements):
    one = beam(elements)
    moving = np.zeros((1, one.count, 2))
    moving[0, ::2] = (3.0, -4.0)
    assert one.kinetic(moving)[0] == pytest.approx(0.5 * MASS * LENGTH * 25)
    turning = np.zeros((1, one.count, 2))
    turning[0, :, 1] = 7.0 * straight(one)[0, :, 0]
    assert one.kinetic(turning)[0] == pytest.approx(0.5 * MASS * LENGTH**3 / 3 * 49)
    assert one.weight_rows() @ straight(one)[0] == pytest.approx([LENGTH**2 / 2, 0])


@pytest.mark.parametrize(
    ("elements", "error"),
    # What textbooks give for cubic elements: +0.48 % and +0.85 % of the first two with one and two.
    [(1, [5e-3]), (2, [6e-4, 9e-3]), (4, [4e-5, 1.3e-3, 8e-3]), (8, [3e-6, 1e-4, 7e-4, 2.5e-3])],
)
def test_cantilever_frequencies(elements, error):
    one = beam(elements)
    free = [k for k in range(one.count) if k >= 2]  # start and its slope are held
    stiffness = stiffness_across(one)[np.ix_(free, free)]
    mass = one.mass[np.ix_(free, free)]
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real)
    exact = cantilever_roots(len(error)) ** 2 * np.sqrt(BENDING / MASS) / LENGTH**2
    deviations = np.sqrt(squares[: len(error)]) / exact - 1
    for deviation, most in zip(deviations, error, strict=True):
        assert -1e-6 < deviation < most


@pytest.mark.parametrize("elements", [1, 5])
def test_deflection_by_a_force_at_the_end(elements):
    stiffness = stiffness_across(beam(elements))[2:, 2:]
    force = np.zeros(len(stiffness))
    force[-2] = 0.01
    deflection = np.linalg.solve(stiffness, force)
    assert deflection[-2] == pytest.approx(0.01 * LENGTH**3 / (3 * BENDING), rel=1e-5)
    assert deflection[-1] == pytest.approx(0.01 * LENGTH**2 / (2 * BENDING), rel=1e-5)


def arc(one, curvature):
    """Controls of a beam bent to a circle."""
    s = np.linspace(0, LENGTH, one.elements + 1)
    controls = np.zeros((1, one.count, 2))
    controls[0, ::2] = np.stack([np.sin(curvature * s), 1 - np.cos(curvature * s)], -1) / curvature
    controls[0, 1::2] = np.stack([np.cos(curvature * s), np.sin(curvature * s)], axis=-1)
    return controls


def test_a_circle_stores_the_energy_of_its_curvature():
    errors = []
    for elements in (2, 4, 8):
        one = beam(elements)
        curvature = one.curvature(arc(one, 4.0))
        errors.append(abs(curvature - 4.0).max() / 4)
        assert abs(one.strain(arc(one, 4.0))).max() < 1e-5
    assert errors[-1] < 2e-4
    one = beam(16)
    assert one.stored(arc(one, 4.0))[0] == pytest.approx(0.5 * BENDING * 16 * LENGTH, rel=1e-4)


def test_stretching_stores_the_energy_of_the_strain():
    one = beam(3)
    assert one.stored(1.001 * straight(one))[0] == pytest.approx(0.5 * AXIAL * 1e-6 * LENGTH)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), elements=st.integers(1, 4))
def test_damping_takes_the_rate_of_strain_and_curvature(seed, elements):
    one = beam(elements)
    random = np.random.default_rng(seed)
    controls = straight(one) + random.normal(scale=3e-3, size=(1, one.count, 2))
    rates = random.normal(size=controls.shape)
    dt = 1e-7
    before, after = controls - dt * rates, controls + dt * rates
    strain = (one.strain(after) - one.strain(before)) / (2 * dt)
    bend = (one.curvature(after) - one.curvature(before)) / (2 * dt)
    spread = one.element * np.tile([1 / 6, 4 / 6, 1 / 6], elements)
    power = LAG * (AXIAL * strain**2 @ spread + BENDING * bend**2 @ np.full(2 * elements, 0.5)
                   * one.element)  # fmt: skip
    np.testing.assert_allclose(one.damping_power(controls, rates), power, rtol=1e-5)
    assert beam(elements, lag=0.0).damping_power(controls, rates) == 0


def test_rows_give_points_between_nodes():
    one = beam(4)
    s = np.linspace(0, LENGTH, 23)
    circle = np.stack([np.sin(4 * s), 1 - np.cos(4 * s)], axis=-1) / 4
    np.testing.assert_allclose(one.rows(s) @ arc(one, 4.0)[0], circle, atol=2e-8)
    slopes = one.rows(s, 1) @ arc(one, 4.0)[0]
    np.testing.assert_allclose(slopes, np.stack([np.cos(4 * s), np.sin(4 * s)], -1), atol=1e-5)
