"""Bounds of formulas over intervals: they hold every value, and are as narrow as they may be."""

import numpy as np
import pytest

from exudyn_flexlink.expressions import Bounds, parse_expression

FORMULAS = (
    "3 + 2*t - t**2",
    "(t - 1)**2 * exp(-t)",
    "exp(-((t - 1)/0.01)**2)",
    "1/(0.001 + (t - 1.2)**2)",
    "sin(7*t) + cos(t)*tan(t/4)",
    "tanh(30*(t - 1)) - tanh(30*(t - 1.1))",
    "where(t < 1, t, 2 - t) + abs(t - 0.5)",
    "min(t, 1)*max(sin(3*t), 0.2)",
    "atan2(t - 1, t - 1.5) + atan(5*t)",
    "asin(t/4) + acos(t/4) + sqrt(t) + log(t + 0.1)",
    "(t - 1)**3 + t**-2 + (t + 0.5)**1.5 + 2**t",
    "sign(t - 1)*t",
    "angle(hub)*speed(hub) - t*angle(hub)**2",
    "place(hub)/(2 + sin(speed(hub)))",
)


@pytest.mark.parametrize("text", FORMULAS)
def test_no_value_is_outside_the_bounds(text):
    formula = parse_expression(text)
    rng = np.random.default_rng(1)
    begin = rng.uniform(0.01, 2, 200)
    end = begin + 10 ** rng.uniform(-4, 0, 200)
    low = rng.uniform(-2, 2, (len(formula.sensed), 200))
    high = low + rng.uniform(0, 1, low.shape)
    state = [Bounds(*pair) for pair in zip(low, high, strict=True)]
    for addend in formula.addends:
        least, most = addend.ranges(Bounds(begin, end), state)
        for part in rng.uniform(0, 1, (100, 1 + len(low))):
            values = addend.values(
                begin + part[0] * (end - begin), low + part[1:, None] * (high - low)
            )
            assert (values >= least - 1e-9 * abs(values)).all()
            assert (values <= most + 1e-9 * abs(values)).all()


@pytest.mark.parametrize(
    ("text", "least", "most"),
    [
        ("exp(-((t - 1)/0.01)**2)", 0.0, 1.0),
        ("sin(t)", np.sin(0.5), 1.0),
        ("cos(4*t)", -1.0, np.cos(2.0 * np.pi)),
        ("t**3", 0.125, 8.0),
        ("(t - 1)**2", 0.0, 1.0),
        ("where(t < 3, t, 50)", 0.5, 2.0),
        ("1/t", 0.5, 2.0),
    ],
)
def test_what_takes_its_argument_once_has_its_own_range(text, least, most):
    """Over 0.5 to 2 s."""
    (addend,) = parse_expression(text).addends
    found = addend.ranges(Bounds(np.array([0.5]), np.array([2.0])), [])
    assert found.low[0] == pytest.approx(least, abs=1e-12)
    assert found.high[0] == pytest.approx(most, abs=1e-12)


def test_a_formula_is_the_sum_of_its_addends():
    formula = parse_expression("5 + t*angle(hub) - (sin(t) - 3) - 2*(t + 1)")
    assert len(formula.addends) == 3
