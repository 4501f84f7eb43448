"""Touches that are short, or many, drawn at random: closed forms, and runs that keep them."""

import numpy as np
import pytest
from benchmarks.verdicts import RIGHT, TOLD
from random_touches import KINDS, Ball, _circle, _line, judge


@pytest.mark.parametrize("kind", KINDS)
def test_no_touch_is_missed_without_a_word(kind):
    for number in range(1 if kind == "billiard" else 3):
        verdict = judge((kind, number), seed=1)
        assert verdict.kind in (RIGHT, TOLD), f"{kind} {number}: {verdict}"


def test_the_force_of_a_strike_is_off_by_no_more_than_is_told():
    verdict = judge(("strike", 8), seed=1)
    assert verdict.kind == RIGHT, verdict


def test_a_ball_hops_by_the_closed_form():
    """From 1 m above the floor, half of the speed is given back: a quarter of the height."""
    ball = Ball(1j, 0j, [_line(-1, 1, 0.0)], 0.9, 0.0, 0.5, 9.81)
    places, strikes = ball.flown()
    fall = np.sqrt(2 / 9.81)
    assert strikes == pytest.approx([fall], rel=1e-15)
    assert places(np.array([1.5 * fall])) == pytest.approx(0.25j, abs=1e-15)


def test_a_ball_that_meets_a_pin_aslant_is_turned_by_a_right_angle():
    aslant = 0.3 * np.sqrt(0.5)
    ball = Ball(-1 + 1j * aslant, 1 + 0j, [_circle(0j, 0.1, 0.2)], 3.0, 0.2)
    places, (strike,) = ball.flown()
    assert strike == pytest.approx(1 - aslant, rel=1e-15)
    assert places(np.array([strike + 1])) == pytest.approx(-aslant + 1j * (1 + aslant), abs=1e-14)
