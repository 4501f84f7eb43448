"""Events of kind "impact", contacts without duration: what strikes and figures make of them."""

from dataclasses import replace
from math import inf, isnan, pi

import pytest
import results

from exudyn_flexlink.comparison import compare
from exudyn_flexlink.intervals import Interval
from exudyn_flexlink.observables import strikes
from exudyn_flexlink.report import comparison_text, run_text
from exudyn_flexlink.storage import load, save


def impact(time, impulse=1e-3, lost=1e-5):
    return Interval(time, time, 0.028, 0.028, 0.9, 0.45, impulse, lost, inf)


def lasting(begin, end=inf):
    return Interval(begin, end, 0.027, 0.027, 1e-4, impulse=4e-3)


def test_an_impact_is_a_contact_without_duration(rigid):
    (only,) = strikes(results.touched(rigid, impact(0.5)), "strike")
    assert (only.begin, only.end, only.contacts, only.ended) == (0.5, 0.5, 1, True)
    assert (only.impulse, only.energy_lost) == (1e-3, 1e-5)
    assert (only.approach_speed, only.place) == (0.9, 0.028)
    assert isnan(only.peak_force)


def test_a_burst_of_impacts_and_the_pushing_after_are_one_strike(rigid):
    burst = (impact(0.5), impact(0.501), impact(0.5012), lasting(0.5013, 0.51))
    (only,) = strikes(results.touched(rigid, *burst), "strike")
    assert (only.begin, only.end, only.contacts) == (0.5, 0.51, 4)
    assert only.impulse == pytest.approx(7e-3)
    assert only.energy_lost == pytest.approx(3e-5)
    assert isnan(only.peak_force)
    assert only.approach_speed == 0.9


def test_impacts_a_quarter_turn_apart_are_two_strikes(rigid):
    quarter = pi / 2 / results.SPEED
    for wait, count in ((0.99 * quarter, 1), (1.01 * quarter, 2)):
        pair = (impact(0.5), impact(0.5 + wait))
        assert len(strikes(results.touched(rigid, *pair), "strike")) == count


def test_an_impact_does_not_end_a_contact_that_lasts(rigid):
    events = (lasting(0.5, 0.51), impact(0.505))
    (only,) = strikes(results.touched(rigid, *events), "strike")
    assert (only.begin, only.end, only.contacts) == (0.5, 0.51, 2)
    assert only.impulse == pytest.approx(5e-3)


def test_an_unbounded_force_is_not_known(rigid):
    hit = replace(results.touched(rigid, impact(0.5)), engine="lagrangian")
    assert "not known" in comparison_text(compare(rigid, hit))


def test_impacts_survive_saving_and_are_told(rigid, tmp_path):
    hit = results.touched(rigid, impact(0.5))
    save(hit, tmp_path)
    assert load(tmp_path).events == hit.events
    assert "0.50000 s" in run_text(hit)
    assert "0.9000 m/s" in run_text(hit)
