"""Which of a few contacts act: solutions that are known, and SciPy's least squares as a judge."""

import numpy as np
import pytest
from scipy.optimize import nnls

from exudyn_flexlink.integrate.complementarity import complementary


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
