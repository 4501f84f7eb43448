"""The contact law is a wall that returns e, never pulls and never creates energy."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import nnls

from exudyn_flexlink.integrate.complementarity import complementary
from exudyn_flexlink.laws import RestitutionPenalty

MASS, STIFFNESS = 0.01, 2e4


def impact(law, speed):
    """Throw MASS at the wall; speed afterwards and time in contact."""

    def rates(_, y):
        return [y[1], -float(law.force(y[0], y[1], speed)) / MASS]

    def left(_, y):
        return y[0]

    left.terminal, left.direction = True, -1
    scale = speed * math.sqrt(MASS / STIFFNESS)
    run = solve_ivp(
        rates, (0, 1), [1e-12 * scale, speed], method="LSODA", events=left, rtol=1e-8,
        atol=[1e-10 * scale, 1e-8 * speed],
    )  # fmt: skip
    assert run.t_events[0].size == 1
    return -run.y_events[0][0][1], run.t_events[0][0]


@pytest.mark.parametrize("speed", [0.5, 1.0, 3.0])
@pytest.mark.parametrize("restitution", [0.3, 0.5, 0.9, 1.0])
def test_impact_reverses_the_velocity_by_e(restitution, speed):
    law = RestitutionPenalty(STIFFNESS, restitution)
    after, duration = impact(law, speed)
    assert after == pytest.approx(restitution * speed, rel=0.01)
    half = math.pi * math.sqrt(MASS / STIFFNESS)  # a quarter period by k, another by e^2 k
    assert duration == pytest.approx(half / 2 * (1 + 1 / restitution), rel=0.02)


@pytest.mark.parametrize("speed", [0.5, 3.0])
def test_without_restitution_the_mass_creeps_out_at_a_few_transition_speeds(speed):
    """Integrated by hand: v^2/2 + (v_s v/2 - v_s^2/4) exp(2v/v_s) + v_s^2/4 = v_in^2/2."""
    v_s = 5e-3
    after, _ = impact(RestitutionPenalty(STIFFNESS, 0.0, v_s), speed)
    left = after**2 / 2 + (v_s * after / 2 - v_s**2 / 4) * math.exp(2 * after / v_s) + v_s**2 / 4
    # the speed enters through a logarithm; an error in it shows exponentially in this balance
    assert left == pytest.approx(speed**2 / 2, rel=0.01)
    finer, _ = impact(RestitutionPenalty(STIFFNESS, 0.0, 5e-4), speed)
    assert finer / speed < 0.01


numbers = st.floats(-1e3, 1e3)


@given(d=numbers, rate=numbers, e=st.floats(0, 1))
def test_never_pulls_and_never_creates_energy(d, rate, e):
    law = RestitutionPenalty(STIFFNESS, e)
    assert law.force(d, rate, 0.0) >= 0
    storing = (1 + e**2) / 2 * STIFFNESS * max(d, 0.0) * rate  # dU/dt
    assert float(law.force(d, rate, 0.0)) * rate >= storing - 1e-12 * abs(storing)
    if d <= 0:
        assert law.force(d, rate, 0.0) == law.stored_energy(d) == 0


def test_power_of_the_force_is_stored_or_lost():
    """F d' - dU/dt = (1 - e^2)/2 k d d' tanh(d'/v_s)."""
    law = RestitutionPenalty(STIFFNESS, 0.5)
    d, rate = np.meshgrid(np.linspace(1e-6, 1e-3, 7), np.linspace(-0.02, 0.02, 9))
    step = 1e-9
    storing = (law.stored_energy(d + step) - law.stored_energy(d - step)) / (2 * step) * rate
    lost = 0.375 * STIFFNESS * d * rate * np.tanh(rate / 5e-3)
    np.testing.assert_allclose(law.force(d, rate, 0.0) * rate, storing + lost, rtol=1e-6, atol=1e-9)


def test_loading_follows_k_and_unloading_e_squared_k():
    law = RestitutionPenalty(STIFFNESS, 0.5)
    np.testing.assert_allclose(
        law.force(1e-3, [1.0, 0.0, -1.0], 1.0), [20.0, 12.5, 5.0], rtol=1e-12
    )


def test_half_a_period_is_that_of_a_mass_on_the_spring():
    law = RestitutionPenalty(STIFFNESS, 0.5)
    assert law.half_period(MASS) == pytest.approx(math.pi * math.sqrt(MASS / STIFFNESS))


# --- which of a few contacts act ------------------------------------------------------------------


def test_one_contact_acts_where_it_has_to():
    assert complementary(np.array([[2.0]]), np.array([-3.0])) == pytest.approx([1.5])
    assert complementary(np.array([[2.0]]), np.array([3.0])) == pytest.approx([0])
    assert complementary(np.zeros((0, 0)), np.zeros(0)).shape == (0,)


def test_a_contact_that_another_one_opens_does_not_act():
    """Two that push each other open: the second would have to pull."""
    push = complementary(np.array([[2.0, 1.0], [1.0, 1.0]]), np.array([-2.0, -0.5]))
    assert push == pytest.approx([1, 0])


@pytest.mark.parametrize("seed", range(20))
def test_independent_contacts_are_the_least_squares_with_no_negative_unknown(seed):
    """The minimum of p W p/2 + c p over p >= 0, with W = A^T A and c = -A^T b."""
    random = np.random.default_rng(seed)
    count = random.integers(1, 6)
    matrix, wanted = random.normal(size=(count + 2, count)), random.normal(size=count + 2)
    push = complementary(matrix.T @ matrix, -matrix.T @ wanted)
    assert push == pytest.approx(nnls(matrix, wanted)[0], abs=1e-9)


def test_contacts_that_depend_on_one_another_share_the_load():
    """Four legs of a table: any three would do."""
    legs = np.array([[1.0, x, y] for x in (-1, 1) for y in (-1, 1)])
    push = complementary(legs @ legs.T, -np.ones(4))
    assert push == pytest.approx(np.full(4, push[0]))
    assert legs @ legs.T @ push == pytest.approx(np.ones(4))


def test_of_two_contacts_at_one_place_the_one_that_asks_for_more_acts():
    push = complementary(np.ones((2, 2)), np.array([-1.0, -2.0]))
    assert push == pytest.approx([0, 2])


def test_what_nothing_lets_give_way_is_refused():
    with pytest.raises(ArithmeticError, match="can't hold"):
        complementary(np.zeros((1, 1)), np.array([-1.0]))
    wedged = np.array([[1.0, -1.0], [-1.0, 1.0]])
    with pytest.raises(ArithmeticError, match="can't hold"):
        complementary(wedged, np.array([-1.0, -1.0]))
