"""What happens in a run, one by one: reversals, lift-offs, rests, flights; strikes as a table."""

from dataclasses import replace
from math import inf, pi, sqrt

import numpy as np
import pytest
import results
from physics_tools import run, scene
from test_joint_friction import ROD, rubbing

from exudyn_flexlink.api.results import api_result
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.mechanism import build_mechanism
from exudyn_flexlink.observables import flight_gaps, happenings
from exudyn_flexlink.result import Event, Interval, MeasuredError
from exudyn_flexlink.storage import save, touch_columns

G, E = 9.81, 0.6
BALL = f"""
bodies:
  ball: {{type: rigid, mass: 2, inertia: 0, points: {{c: [0, 0]}}}}
  floor: {{type: rigid, mass: 1, inertia: 1, points: {{a: [2, 0], b: [-2, 0], c: [0, 0]}}}}
joints: {{held: {{type: weld, points: [ground, floor.c], at: [0, 0]}}}}
contacts:
  hit: {{type: point_on_line, point: ball.c, line: [floor.b, floor.a],
        law: {{type: impulse, restitution: {E}}}}}
gravity: {G}
initial: {{positions: {{ball: [0, 1]}}}}
run: {{duration: 1.5, sample: 10 ms}}
accuracy: {{tolerance: 1.0e-6}}
"""


def named(seen, what):
    return [(h.time, h.where) for h in seen if h.what == what]


def test_a_pendulum_turns_back_at_the_ends_of_its_swings():
    time = [t for t, _ in named(happenings(results.pendulum(2001)), "turns back")]
    np.testing.assert_allclose(time[-1], pi / 5, atol=1e-3)
    assert len(time) <= 2  # at time 0 it stands, which central differences miss


def test_rests_of_friction_begin_and_end_as_it_tells():
    pendulum = run(rubbing(ROD, "{torque: 0.25 N m}"))
    seen = happenings(pendulum)
    back = [t for t, _ in named(seen, "turns back")]
    np.testing.assert_allclose(back[:3], [0.7803494419, 1.549089953, 2.308359094], atol=1e-8)
    assert len(back) == 8  # the ninth time it stays
    assert named(seen, "comes to rest") == [(pendulum.frictions["pin"].begin[0], "pin")]
    assert not named(seen, "moves again")


def test_touches_impacts_and_laps_are_told_in_order(rigid):
    ended = Interval(1.0, 1.1, 0.02, 0.03, 0.9, 0.4, 1e-3, 1e-5, 2.0, slides_off=True)
    free = Interval(1.15, 1.17, 0.02, 0.03, 0.9, 0.4, 1e-3, 1e-5, 2.0)
    impact = Interval(1.2, 1.2, 0.02, 0.02, 0.9, 0.4, 1e-3, 1e-5, inf)
    lap, lasting = Event(0.9, "lap", "pin", {"lap": 2.0}), Interval(1.3, place=0.01)
    made = replace(results.touched(rigid, lasting, impact, ended, free), laps=(lap,))
    assert [tuple(h) for h in happenings(made) if h.what != "turns back"] == [
        (0.9, "lap", "pin"),
        (1.0, "touches", "strike"),
        (1.1, "slides off the face", "strike"),
        (1.15, "touches", "strike"),
        (1.17, "lifts off", "strike"),
        (1.2, "impact", "strike"),
        (1.3, "touches", "strike"),
    ]


def test_a_touch_of_a_sleeve_says_which_pair_met():
    tilting = results.tilting_link()
    pairs = tilting.sleeves["sleeve"].pairs
    touching = {where for _, where in named(happenings(tilting), "touches")}
    assert touching
    assert touching <= set(pairs)


def test_a_ball_flies_as_high_as_its_restitution_lets_it():
    result = simulate(scene(BALL), measure=False)
    gaps = flight_gaps(result, "hit")
    np.testing.assert_allclose(gaps[:2], [E**2, E**4], rtol=1e-6)
    assert gaps[0] > touch_columns(result, "hit")["next_flight_gap_m"][1]
    impacts = [t for t, _ in named(happenings(result), "impact")]
    np.testing.assert_allclose(impacts[:2], sqrt(2 / G) * np.array([1, 1 + 2 * E]), rtol=1e-6)


def test_no_flight_follows_what_lasts_or_slid_off_its_face(rigid):
    lasting = results.touched(rigid, Interval(1.3))
    assert np.isnan(flight_gaps(lasting, "strike")).all()
    assert flight_gaps(results.tilting_link(), "sleeve") is None


def test_strikes_touches_and_happenings_are_tables(rigid, tmp_path):
    mine = api_result(rigid)
    strikes = mine.strikes("strike").to_dataframe()
    assert strikes["begin_s"].tolist() == [strike.begin for strike in mine.strikes("strike")]
    assert {"lap", "crank_angle_rad", "peak_force_N", "ended"} <= set(strikes.columns)
    touches = mine.touches("strike").to_dataframe()
    assert touches["impulse_N_s"].tolist() == mine.touches("strike").impulse.tolist()
    happened = mine.happenings().to_dataframe()
    assert list(happened.columns) == ["t_s", "what", "where"]
    assert np.all(np.diff(happened["t_s"]) >= 0)
    save(rigid, tmp_path)
    assert {"strikes_strike.csv", "touches_strike.csv", "happenings.csv"} <= {
        file.name for file in tmp_path.iterdir()
    }
    head, *rows = (tmp_path / "happenings.csv").read_text().splitlines()
    assert head == "t_s,what,where"
    assert [row for row in rows if row.endswith(",slides off the face,strike")]


@pytest.mark.parametrize("none", [results.slider(), results.pendulum(3)])
def test_where_nothing_happens_there_is_no_table(none, tmp_path):
    still = replace(none, rates=0 * none.rates)
    save(still, tmp_path)
    assert happenings(still) == []
    assert not (tmp_path / "happenings.csv").exists()


@pytest.mark.parametrize("off", [1e-3, 1e-5])
def test_reversals_within_the_error_of_the_run_are_not_told(off):
    """Of a swing that decays by e^-d from one end to the next, the ways between are in closed form.

    It shakes by less than the error, too, so that its rate changes its sign often.
    """
    swings, speed, d = results.pendulum(40001), 40 * pi, 0.4
    time, reach = swings.time, build_mechanism(swings.scene).parts[0].reach
    swing = np.exp((-d / pi + 1j) * speed * time).real
    poses, rates = np.zeros_like(swings.poses), np.zeros_like(swings.rates)
    poses[:, 0, 2] = swing + 0.1 * off / reach * np.sin(5e3 * time)
    rates[:, 0, 2] = np.gradient(poses[:, 0, 2], time)
    error = MeasuredError(("rod.end",), limit=1e-2, largest=off)
    told = happenings(replace(swings, poses=poses, rates=rates, error=error))

    late = np.arctan(d / pi)
    ends = np.arange(1, 40) - late / pi
    ways = np.cos(late) * np.exp(-d * ends) * (1 + np.exp(-d))
    told_ends = np.array([t for t, _ in named(told, "turns back")]) * speed / pi
    assert len(told_ends) in {np.sum(ways > 1.3 * off / reach), np.sum(ways > 0.7 * off / reach)}
    np.testing.assert_allclose(told_ends, ends[: len(told_ends)], atol=0.1)
