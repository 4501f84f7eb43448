from dataclasses import replace
from math import inf, isnan, pi

import numpy as np
import pytest
import results

from exudyn_flexlink.comparison import compare
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.observables import (
    ANGLE,
    LeverResponse,
    crank_angle,
    crank_joint,
    joint_angle,
    judged_points,
    laps,
    lever_response,
    path,
    strikes,
    struck_bodies,
    turns,
    watched_point,
)
from exudyn_flexlink.report import comparison_text, run_text
from exudyn_flexlink.result import Event, Extremes, Interval
from exudyn_flexlink.scene import SpeedDrive
from exudyn_flexlink.storage import load, save

NONE = Extremes(np.zeros(0), np.zeros(0))


@pytest.mark.parametrize(
    ("ask", "told"),
    [
        (lambda run: joint_angle(run, "pin"), "'pin' is no revolute joint"),
        (lambda run: path(run, "nothing.end"), "no point 'nothing.end'"),
        (lambda run: path(run, "link.endd"), r"no point 'link.endd'; did you mean 'link.end'\?"),
        (lambda run: lever_response(run, "bump"), "no contact 'bump'"),
        (lambda run: strikes(run, "bump"), "no contact 'bump'; there are: strike"),
    ],
)
def test_what_a_scene_does_not_have_is_told(rigid, ask, told):
    with pytest.raises(ValueError, match=told):
        ask(rigid)


# --- crank and laps


def test_the_crank_is_the_joint_of_the_turns_or_driven_or_the_first(rigid):
    assert crank_joint(rigid.scene) == "crank"
    assert crank_joint(load_scene(results.MODEL, ["run.duration=1"])) == "crank"
    assert crank_joint(results.pendulum().scene) == "pin"


def test_a_scene_without_revolute_joint_has_no_crank():
    slider = results.slider()
    assert crank_joint(slider.scene) is None
    assert not turns(slider)
    with pytest.raises(ValueError, match="no revolute joint"):
        crank_angle(slider)


def test_crank_angle_is_continuous(rigid):
    np.testing.assert_allclose(crank_angle(rigid), results.SPEED * rigid.time, atol=1e-12)


def test_joint_angle_is_second_body_relative_to_first():
    text = results.PENDULUM.replace("[ground, rod.start]", "[rod.start, ground]")
    turned = replace(results.pendulum(), scene=results.scene_from(text))
    np.testing.assert_array_equal(joint_angle(turned, "pin"), -turned.poses[:, 0, 2])


def test_laps_count_from_one_and_end_with_the_last(rigid):
    lap = laps(rigid)  # 400 samples a lap, and one at the very end
    assert [lap[0], lap[399], lap[400], lap[1200], lap[-1]] == [1, 1, 2, 4, 4]


def test_a_pendulum_stays_in_lap_one_and_a_crank_that_is_held_does_not_go_round():
    swing = results.pendulum()
    assert set(laps(swing)) == {1}
    assert not turns(swing)
    held = {"hold": SpeedDrive(type="speed", joint="pin", value=0.0)}
    assert not turns(replace(swing, scene=swing.scene.changed(drives=held)))


# --- points


def test_watched_point_strikes_or_moves_most_freely(rigid):
    assert watched_point(rigid.scene) == "link.end"
    assert watched_point(results.pendulum().scene) == "rod.end"
    assert watched_point(results.slider().scene) == "block.nose"
    pendulum = load_scene(results.MODEL.parent / "textbook" / "double_pendulum.yaml")
    assert watched_point(pendulum) == "lower.b"  # the free end, not the elbow
    on_its_pivot = {"bodies": {"upper": pendulum.bodies["upper"]}}
    on_its_pivot["joints"] = {"pivot": pendulum.joints["pivot"]}
    initial = type(pendulum.initial)()
    alone = pendulum.changed(**on_its_pivot, initial=initial)
    assert watched_point(alone) == "upper.b"  # not the first named one, which never moves


def test_a_point_that_the_scene_names_is_watched_and_judges_alone():
    scene = load_scene(results.MODEL, ["outputs.watch=guide.end"])
    assert watched_point(scene) == "guide.end"
    assert judged_points(scene) == ("guide.end",)
    every = judged_points(load_scene(results.MODEL))
    assert {"guide.start", "link.start", "link.end", "lever.end", "lever.centre"} < set(every)


def test_path_of_a_straight_link_is_the_closed_form(rigid):
    seen = path(rigid, "link.end")
    theta = results.SPEED * rigid.time
    reach = results.guide_distance(rigid.scene, theta) + results.LENGTH
    along = np.stack([np.cos(theta), np.sin(theta)], axis=-1)
    np.testing.assert_allclose(seen.position, results.CRANK + reach[:, None] * along, atol=1e-12)


def test_velocity_is_the_rate_of_the_position():
    swing = results.pendulum(2001)
    seen = path(swing, "rod.end")
    rate = np.gradient(seen.position, seen.time, axis=0)
    np.testing.assert_allclose(seen.velocity[5:-5], rate[5:-5], atol=1e-4)


# --- struck bodies


def test_tip_moves_by_the_sine_of_the_lever_angle(rigid):
    seen = lever_response(rigid, "strike")
    assert (seen.body, struck_bodies(rigid.scene)) == ("lever", {"lever": "strike"})
    np.testing.assert_allclose(seen.tip_displacement, 0.03 * np.sin(seen.value), atol=1e-15)
    assert np.min(seen.value) == pytest.approx(-results.LEVER_PEAK, rel=0.2)
    # Whichever way its line is drawn, the tip is the end far from the joint.
    drawn = load_scene(results.MODEL, ["contacts.strike.line=[lever.end, lever.start]"])
    turned = lever_response(replace(rigid, scene=drawn), "strike").tip_displacement
    assert np.ptp(turned) > 1e-3


# --- strikes


def test_contacts_of_one_burst_are_one_strike(rigid):
    first, second = strikes(rigid, "strike")
    assert (first.lap, second.lap) == (1, 3)
    assert first.crank_angle == pytest.approx(pi)
    assert second.crank_angle == pytest.approx(5 * pi)
    assert first.contacts == 2
    assert first.ended
    assert first.end - first.begin == pytest.approx(4e-3)
    assert first.impulse == pytest.approx(2 * results.IMPULSE)
    assert first.energy_lost == pytest.approx(2e-5)
    assert (first.approach_speed, first.place) == (0.9, 0.028)
    assert first.peak_force == pytest.approx(0.4)


def test_a_contact_that_lasts_to_the_end_is_not_ended(rigid):
    lasting = Interval(2.5, place=0.02, approach_speed=0.3, impulse=1e-3)
    (only,) = strikes(results.touched(rigid, lasting), "strike")
    assert not only.ended
    assert only.end == rigid.time[-1]
    assert isnan(only.impulse)
    assert (only.approach_speed, only.place) == (0.3, 0.02)


def test_events_tell_what_intervals_hold(rigid):
    ended = Interval(1.0, 1.1, 0.02, 0.03, 0.9, 0.4, 1e-3, 1e-5, 2.0, slides_off=True)
    impact = Interval(1.2, 1.2, 0.02, 0.02, 0.9, 0.4, 1e-3, 1e-5, inf, motor_work=1e-6)
    lap, lasting = Event(0.9, "lap", "pin", {"lap": 2.0}), Interval(1.3, place=0.01)
    found = replace(results.touched(rigid, lasting, impact, ended), laps=(lap,)).events
    assert [(event.time, event.kind) for event in found] == [
        (0.9, "lap"),
        (1.0, "contact begins"),
        (1.1, "leaves the face"),
        (1.2, "impact"),
        (1.3, "contact begins"),
    ]
    assert found[1].details == {"approach_speed": 0.9, "place": 0.02}
    assert found[2].details == {
        "place": 0.03,
        "separation_speed": 0.4,
        "impulse": 1e-3,
        "energy_lost": 1e-5,
        "peak_force": 2.0,
    }
    assert found[3].details["motor_work"] == 1e-6


def test_a_strike_between_samples_belongs_to_the_lap_in_which_it_begins():
    """Samples are 0.18 of a lap apart; the touch begins 0.04 of a lap before the second one."""
    run = results.rigid_link(samples=23)
    lap = 2 * pi / results.SPEED
    before = lap - 0.04 * lap
    assert run.time[np.searchsorted(run.time, before)] > lap
    touch = Interval(before, before + 1e-3, 0.03, 0.03, 1.0, 2e-3, 1e-5, 0.5)
    (only,) = strikes(results.touched(run, touch), "strike")
    assert only.lap == 1
    assert only.crank_angle == pytest.approx(2 * pi * 0.96)


# --- between samples


def swing(samples, until=1.0):
    """A lever whose angle is sin(7 t), with its turns, and few samples."""
    time, turns = np.linspace(0, until, samples), np.array([pi / 14, 3 * pi / 14])
    angle, rate = np.sin(7 * time), 7 * np.cos(7 * time)
    extremes = Extremes(turns, np.array([1.0, -1]))
    return LeverResponse("lever", ANGLE, time, angle, rate, 0 * time, extremes)


def test_peaks_are_where_the_lever_turns_whatever_is_sampled():
    for samples in (2, 3, 2001):
        assert swing(samples).least == (-1, 3 * pi / 14)
        assert swing(samples).greatest == (1, pi / 14)
        assert abs(swing(samples).farthest) == 1


def test_peaks_of_a_part_of_a_run_are_its_own_turns_and_its_ends():
    assert swing(2001).between(0.3, 0.9).least == (-1, 3 * pi / 14)
    assert swing(2001).between(0.0, 0.2).least == (0, 0)
    assert swing(3).between(0.51, 0.6).farthest == 0  # no sample, no turn


def test_an_impulse_between_samples_does_not_make_the_angle_overshoot():
    time = np.array([0.0, 0.1, 0.2])
    angle, rate = np.array([0, 0, 1.0]), np.array([0, 10.0, 10])
    hit = LeverResponse("lever", ANGLE, time, angle, rate, 0 * time, NONE)
    np.testing.assert_allclose(hit.at([0.05, 0.1, 0.15]).value, [0, 0, 0.5])


# --- impacts: contacts without duration -----------------------------------------------------------


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
