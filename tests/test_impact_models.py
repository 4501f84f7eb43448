"""Powers of the contact's stiffness that `scripts/impact_models.py` reads from differences."""

import numpy as np
import pytest
from impact_models import power_of

K = 2e4 * 4.0 ** np.arange(6)


def test_a_power_is_read_from_the_stiffest_contacts_of_one_sign():
    off = -1e-3 * (K / K[0]) ** -0.5
    off[0] = 4e-3  # of another sign, and so of no power
    told, line = power_of(K, off)
    assert told == f"falls as k^-0.50 from {K[1]:.2g} N/m on (5 points)"
    np.testing.assert_allclose(line[1], -off[1:])


@pytest.mark.parametrize("change", [3, 4, 5])
def test_no_power_is_read_across_a_change_of_sign(change):
    off = (K / K[0]) ** -0.5
    off[change:] *= -1
    told, line = power_of(K, off)
    assert told.startswith("no power: the sign changes")
    assert line is None
