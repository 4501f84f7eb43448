"""How a link stands in its guide: a link that tilts in closed form, and touches made by hand."""

from dataclasses import replace
from math import asin, cos, pi
from types import SimpleNamespace

import numpy as np
import pytest
import results

from exudyn_flexlink.engines.touching import Change, Moment, Side, Touches
from exudyn_flexlink.laws import Impulse, RestitutionPenalty
from exudyn_flexlink.observables import (
    TWO_POINTS,
    State,
    contact_states,
    contact_totals,
    lap_contacts,
    lap_starts,
    laps,
    on_axis,
    pair_totals,
    path,
    perturbation,
)
from exudyn_flexlink.result import Interval, Intervals, SleeveHistory

LAP = 2 * pi / results.SPEED  # s
# Where the sine of the crank angle must be beyond for a point to touch: see results.tilting_link.
TILTED, LYING, CORNER, NODE = 1 / 3, 1 / 1.2, 1 / 1.8, 1 / 1.2


def beyond(sine):
    """Part of a lap in which the sine of its angle is beyond +- `sine`."""
    return 1 - 2 * asin(sine) / pi


def made(*touches, sides=(1.0, -1.0, 1.0, -1.0), end=1.0):
    """A run with touches (pair, begin, end); impulse 1, 2, 3 .. N s, each loses 0.5 J."""
    base = results.slider()
    found = Intervals.of(
        Interval(
            begin,
            until,
            pair=pair,
            impulse=float(i),
            energy_lost=0.5,
            peak_force=10.0 * i,
            approach_speed=float(i),
        )
        for i, (pair, begin, until) in enumerate(touches, start=1)
    )
    names = tuple(f"sleeve: pair {k}" for k in range(len(sides)))
    sleeve = SleeveHistory(names, sides, np.zeros((len(base.time), len(sides))), found, 0.0)
    return replace(base, sleeves={"sleeve": sleeve}, time=base.time * end)


# --- states over time


def test_the_four_cases(tilting):
    """Each lap shows its own case, for as long as the sine says."""
    states = contact_states(tilting, "sleeve")
    expected = [
        {},
        {State.ONE_POINT: beyond(TILTED)},
        {State.SAME_SIDE: beyond(LYING)},
        {State.ONE_POINT: beyond(CORNER) - beyond(NODE), State.OPPOSITE_SIDES: beyond(NODE)},
    ]
    for lap, cases in enumerate(expected):
        found = states.fractions(lap * LAP, (lap + 1) * LAP)
        wanted = {case: cases.get(case, 0.0) for case in State}
        wanted[State.FREE] = 1 - sum(cases.values())
        assert found == pytest.approx(wanted, abs=2e-4), f"lap {lap + 1}"
    assert len(states.state) == len(states.time) - 1


@pytest.mark.parametrize(
    ("pairs", "state"),
    [
        ([], State.FREE),
        ([0], State.ONE_POINT),
        ([1], State.ONE_POINT),
        ([0, 2], State.SAME_SIDE),
        ([1, 3], State.SAME_SIDE),
        ([0, 1], State.OPPOSITE_SIDES),
        ([0, 1, 2], State.OPPOSITE_SIDES),
        ([0, 2, 4], State.SAME_SIDE),
    ],
)
def test_sides_of_what_touches_decide(pairs, state):
    run = made(*((k, 0.2, 0.6) for k in pairs), sides=(1.0, -1.0, 1.0, -1.0, 1.0))
    states = contact_states(run, "sleeve")
    assert states.fractions(0.2, 0.6)[state] == pytest.approx(1)
    assert states.at(np.array([0.4]))[0] == state
    assert states.at(np.array([0.1, 0.8])).tolist() == [State.FREE, State.FREE]


def test_touches_that_overlap_and_meet():
    run = made((0, 0.1, 0.5), (1, 0.3, 0.4), (2, 0.5, 0.7), (0, 0.7, 0.7))
    states = contact_states(run, "sleeve")
    assert states.time.tolist() == [0, 0.1, 0.3, 0.4, 0.5, 0.7, 1.0]
    one, both = State.ONE_POINT, State.OPPOSITE_SIDES
    assert states.state.tolist() == [State.FREE, one, both, one, one, State.FREE]
    assert states.stretches([one]).tolist() == [[0.1, 0.3], [0.4, 0.7]]
    assert states.stretches([one, both]).tolist() == [[0.1, 0.7]]
    assert not len(states.stretches([State.SAME_SIDE]))


def test_the_link_meets_its_guide_from_free_flight_only():
    run = made((0, 0.0, 0.05), (0, 0.1, 0.3), (1, 0.2, 0.4), (2, 0.6, 0.7))
    states = contact_states(run, "sleeve")
    assert states.impacts() == 2  # at 0.1 and 0.6; at 0 it was not free before
    assert states.impacts(0.1, 0.6) == 1
    assert states.impacts(0.6, 1.0) == 1


def test_a_run_of_one_instant_has_no_state(tilting):
    first = results.first_samples(tilting, 1)
    states = contact_states(first, "sleeve")
    assert len(states.state) == 0
    assert set(states.fractions().values()) == {0.0}
    assert not len(states.stretches(State))
    assert states.at(np.zeros(2)).tolist() == [State.FREE, State.FREE]
    (lap,) = lap_contacts(first, "sleeve")
    assert (lap.touches, lap.impacts) == (0, 0)


# --- totals, by laps and by pairs


def test_laps_of_the_tilting_link(tilting):
    found = lap_contacts(tilting, "sleeve")
    assert [lap.touches for lap in found] == [0, 2, 4, 4]  # upper and lower, half a lap each
    assert [lap.impacts for lap in found] == [0, 2, 2, 2]
    on_two = [sum(lap.fractions[case] for case in TWO_POINTS) for lap in found]
    assert on_two[1] == 0
    assert on_two[2] == pytest.approx(beyond(LYING), abs=2e-4)
    half = LAP * beyond(TILTED) / 2
    assert found[1].longest == pytest.approx(half, rel=1e-3)
    # Two halves of F = k (3 mm sin - 1 mm) cos(tilt), with tilts so small that the cosine is one.
    a = asin(TILTED)
    area = 3e-3 * 2 * cos(a) - 1e-3 * (pi - 2 * a)
    assert found[1].impulse == pytest.approx(2 * 1e5 * area / results.SPEED, rel=2e-3)
    assert found[1].energy_lost == pytest.approx(0.1 * found[1].impulse)


def test_a_touch_belongs_to_the_time_in_which_it_begins():
    run = made((0, 0.1, 0.6), (1, 0.5, 0.7))
    first, second = contact_totals(run, "sleeve", 0, 0.5), contact_totals(run, "sleeve", 0.5, 1)
    assert (first.touches, second.touches) == (1, 1)
    assert (first.impulse, second.impulse) == (1.0, 2.0)
    assert first.fractions[State.ONE_POINT] == pytest.approx(0.8)
    assert second.fractions[State.OPPOSITE_SIDES] == pytest.approx(0.2)
    assert second.longest == pytest.approx(0.2)


def test_a_crank_that_swings_back_begins_no_lap_twice(tilting):
    """It turns 1.5 times forward, half a turn back, and on again."""
    turned = np.interp(tilting.time / tilting.time[-1], [0, 0.3, 0.4, 1], [0, 1.5, 1.0, 4.0])
    poses = tilting.poses.copy()
    poses[:, 0, 2] = 2 * pi * turned
    starts = lap_starts(replace(tilting, poses=poses))
    end = tilting.time[-1]
    assert starts == pytest.approx([0, 0.2 * end, 0.6 * end, 0.8 * end])


def test_the_last_lap_that_is_cut_short(tilting):
    part = results.first_samples(tilting, 2501)  # of 4001: two and a half laps
    assert len(lap_contacts(part, "sleeve")) == 3
    assert int(laps(part).max()) == 3
    assert lap_contacts(part, "sleeve")[2].touches == 2


def test_pairs_that_touch_longest_come_first(tilting):
    found = pair_totals(tilting, "sleeve")
    corners, nodes = found[:2], found[2:]
    assert {pair.pair for pair in corners} == {
        f"sleeve: rod 1 on {side} corner of the end" for side in ("upper", "lower")
    }
    assert {pair.pair for pair in nodes} == {
        f"sleeve: node 1 on {side} wall" for side in ("upper", "lower")
    }
    assert [pair.touches for pair in corners] == [3, 3]
    each = (beyond(TILTED) + beyond(LYING) + beyond(CORNER)) * LAP / 2
    assert [pair.time for pair in corners] == pytest.approx([each, each], rel=1e-3)
    assert corners[0].peak_force == pytest.approx(200, rel=5e-3)  # k (3 mm - 1 mm)


# --- how far S is from its ideal place


def test_the_end_of_a_tilted_link_is_off_its_ideal_place(tilting):
    """In the guide's axes: l (cos(tilt) - 1) along it, offset + l sin(tilt) across."""
    off = perturbation(tilting, "link.end", tilting.time)
    theta = results.SPEED * tilting.time
    lap = np.minimum(np.floor(theta / (2 * pi) + 1e-9) + 1, 4)
    start, slope = results.off_axis(lap, np.sin(theta))
    tilt = np.arctan(slope)
    along = results.LINK * (np.cos(tilt) - 1)
    across = start + results.LINK * np.sin(tilt)
    c, s = np.cos(theta), np.sin(theta)
    expected = np.stack([c * along - s * across, s * along + c * across], axis=1)
    np.testing.assert_allclose(off, expected, atol=1e-12)


def test_a_straight_link_on_the_axis_is_where_it_should_be():
    rigid = results.rigid_link(samples=101)
    np.testing.assert_allclose(
        on_axis(rigid, "link.end"), path(rigid, "link.end").position, atol=1e-12
    )


def test_only_the_end_of_a_link_has_an_ideal_place(tilting):
    assert on_axis(tilting, "link.start") is None
    assert on_axis(tilting, "guide.end") is None
    assert perturbation(results.slider(), "block.nose", np.zeros(1)) is None


# --- states of a touch ----------------------------------------------------------------------------

SOFT, RIGID = RestitutionPenalty(1e5, 0.5), Impulse(0.5)
FACE, WALL = 0, 1  # of two contacts the second one is a wall
NO_PEAKS = SimpleNamespace(peaks=lambda *_: (0.0, 0.0))


def two(law):
    return Touches([SimpleNamespace(law=law), SimpleNamespace(law=law)], faces=1)


def told(touches, k, place=0.0, totals=(0.0, 0.0)):
    return touches.intervals(k, [(place, totals)], NO_PEAKS)


# What an event is, by gap, its rate and how far inside the face (m, m/s), and where it leads.
WAYS = {
    "a strike": (SOFT, FACE, [
        (0.0, -1, 0.3, Change.CLOSES, Side.PRESSED), (0.0, 1, 0.2, Change.OPENS, Side.APART)]),
    "a strike that slides off, and comes back": (SOFT, FACE, [
        (0.0, -1, 0.3, Change.CLOSES, Side.PRESSED),
        (-1e-5, 1, -1e-13, Change.SLIDES_OFF, Side.BEHIND),
        (0.0, 1, -0.1, Change.PASSES, Side.APART),
        (0.0, -1, 0.1, Change.CLOSES, Side.PRESSED)]),
    "a strike that opens near the end": (SOFT, FACE, [
        (0.0, -1, 0.3, Change.CLOSES, Side.PRESSED), (-1e-13, 1, 1e-10, Change.OPENS, Side.APART)]),
    "a strike exactly at the end": (SOFT, FACE, [
        (3e-17, -1, 3e-17, Change.CLOSES, Side.PRESSED),
        (3e-17, -1, 3e-17, Change.SLIDES_OFF, Side.BEHIND)]),
    "a point that goes round its face": (SOFT, FACE, [
        (0.0, -1, -0.1, Change.PASSES, Side.BEHIND), (0.0, 1, 0.1, Change.PASSES, Side.APART)]),
    "a wall, where the corner slides off": (SOFT, WALL, [
        (-1e-6, 0, 0.0, Change.CLOSES, Side.PRESSED),
        (-1e-6, 0, -1e-13, Change.OPENS, Side.APART)]),
    "a bearing": (SOFT, FACE, [
        (0.0, -1, np.inf, Change.CLOSES, Side.PRESSED),
        (0.0, 1, np.inf, Change.OPENS, Side.APART)]),
    "what is held slides off": (RIGID, FACE, [
        (0.0, -1, 0.3, Change.CLOSES, Side.PRESSED),
        (1e-17, 1, 1e-13, Change.SLIDES_OFF, Side.BEHIND)]),
}  # fmt: skip


@pytest.mark.parametrize("way", WAYS)
def test_what_happens_leads_where_the_table_says(way):
    law, k, events = WAYS[way]
    touches = two(law)
    for gap, rate, inside, change, side in events:
        assert touches.crossing(k, gap, rate, inside) is change
        touches.change(k, change, Moment(0.0, inside, rate))
        assert touches.sides[k] is side
        assert touches.pressed[k] == (side is Side.PRESSED)
        assert not touches.pressed[1 - k]


def test_a_bounce_is_an_impact_and_what_is_held_tells_its_largest_force():
    """On the polynomial through the nodes of a step, between which it may be largest."""
    touches = two(RIGID)
    impact = Interval(1.0, 1.0, impulse=2.0, peak_force=np.inf)
    touches.bounce(FACE, impact)
    assert touches.sides[FACE] is Side.APART
    touches.change(FACE, Change.CLOSES, Moment(2.0, 0.1, -0.0, (2.0, 0.0)))
    nodes = np.array([0.0, 0.057104, 0.276843, 0.583590, 0.860240, 1.0])
    press = np.stack([1 - 4 * (nodes - 0.5) ** 2, 9 + 0 * nodes], axis=-1)
    touches.note(press[None])
    first, held = told(touches, FACE, 0.1, (3.0, 0.0))
    assert first == impact
    assert held.peak_force == pytest.approx(1.0, abs=1e-3)
    assert held.impulse == 1.0
