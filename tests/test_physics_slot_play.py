"""Pins in slots with play: closed forms, and integrations by other methods, refined at events."""

from math import pi

import numpy as np
import pytest
from physics_tools import alone, run, scene, where

from exudyn_flexlink.continuing import continued, free_spans
from exudyn_flexlink.effects import absent, idealise
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.observables import contact_totals
from exudyn_flexlink.plots.outline import slot_walls
from exudyn_flexlink.report import check_text
from exudyn_flexlink.scene import Run

# --- a disc in a straight level slot, under gravity -------------------------------------------

LEVEL = """
curves: {{track: {{type: line, from: [0, 0], to: [2, 0]}}}}
bodies: {{pin: {{type: rigid, mass: 0.5, inertia: 6.25e-6}}}}
joints:
  slot: {{type: slot, point: pin.centre, curve: track, clearance: 2 mm, radius: 5 mm, law: {law}}}
gravity: [0, -9.81]
initial: {{velocities: {{pin: [0.8, 0.3]}}}}
run: {{duration: {duration}}}
accuracy: {{tolerance: 1.0e-9}}
"""
TIMES = 0.007614699259, 0.02319842563, 0.07752930367, 0.249276772
SPEEDS = 0.2252998003, 0.3331161959, 0.2664929568, 0.05588762372
SMOOTH = 0.006091759407, 0.01855874051, 0.06202344293, 0.1994214176
ROUGH = 0.006091759407, 0.01792675863, 0.05593039941, 0.1570198758
AFTER = (0.759446036, 16.22158562), (0.6994851207, -7.762780489), (0.6515163885, -26.95027338)
LASTS = 0.2948528158


@pytest.mark.parametrize(
    ("friction", "places", "after", "last"),
    [
        ("", SMOOTH, [(0.8, 0.0)] * 4, (0.2358822526, 0.8, 0.0)),
        (
            ", friction: 0.1, slip_speed: 1.0e-6",
            ROUGH,
            [*AFTER, (0.4998805487, -87.60460929)],
            (0.1791826981, 0.4792613813, -95.85227625),
        ),
    ],
)
def test_a_pin_bounces_between_walls_and_each_turns_it_its_way(friction, places, after, last):
    """Free flights and Newton's impacts; the upper wall turns the pin one way, the lower back."""
    text = LEVEL.format(law=f"{{type: impulse, restitution: 0.8{friction}}}", duration=0.3)
    result = run(text)
    touches = list(result.sleeves["slot"].touches)
    assert [touch.pair for touch in touches[:3]] == [0, 1, 1]
    for number, time, speed, place, (vx, spin) in zip(
        (0, 1, 2, 9), TIMES, SPEEDS, places, after, strict=True
    ):
        touch = touches[number]
        assert touch.begin == pytest.approx(time, rel=1e-9)
        assert (touch.approach_speed, touch.place) == pytest.approx((speed, place), rel=2e-9)
        now = result.rates[result.sample_at(touch.begin), 0]
        assert (now[0], now[2]) == pytest.approx((vx, spin), rel=1e-8)
    # The rest rule ends the bounces at 1e-6 m/s: so much earlier, as it falls by e each time.
    assert touches[-1].lasts
    assert touches[-1].begin == pytest.approx(LASTS, abs=2e-6)
    now = result.sample_at(LASTS)
    now_at = result.poses[now, 0, 0] + result.rates[now, 0, 0] * (LASTS - result.time[now])
    assert now_at == pytest.approx(last[0], rel=1e-8)
    assert result.rates[now, 0, [0, 2]] == pytest.approx(last[1:], rel=1e-6)


def test_walls_that_give_way_bounce_a_pin_as_their_law_does():
    """Smooth penalty: two integrations by different methods (DOP853, Radau)."""
    law = "{stiffness: 1.0e6, restitution: 0.8, transition_speed: 5 mm/s}"
    result = alone(LEVEL.format(law=law, duration=0.09))
    expected = [
        (0, 0.007614699259, 0.2252998003, 0.000154487474, 0.01004846514, 0.1832624064),
        (1, 0.02549177464, 0.3347612725, 0.0002416720233, 0.0280330944, 0.2646181393),
        (1, 0.08198174666, 0.2646181393, 0.0001920879583, 0.08453433624, 0.2084848578),
    ]
    touches = list(result.sleeves["slot"].touches)
    for touch, (wall, *numbers) in zip(touches, expected, strict=True):
        assert touch.pair == wall
        told = touch.begin, touch.approach_speed, touch.penetration, touch.end
        assert (*told, touch.separation_speed) == pytest.approx(numbers, rel=1e-7)


# --- a bead in a straight slot that turns -----------------------------------------------------

TURNING = """
curves: {track: {type: line, from: [0, 0], to: [1, 0], on: arm}}
bodies:
  arm: {type: rigid, mass: 1, inertia: 1, points: {o: [0, 0]}}
  pin: {type: rigid, mass: 0.3, inertia: 0}
joints:
  pivot: {type: revolute, points: [ground, arm.o], at: [0, 0]}
  slot: {type: slot, point: pin.centre, curve: track, clearance: 1 mm,
         law: {type: impulse, restitution: 0.5}}
drives: {turn: {type: speed, joint: pivot, value: 5}}
initial: {angles: {arm: 0}, positions: {pin: [0.3, 0.001]}, velocities: {pin: [-1.205, 1.5]}}
run: {duration: 0.6}
accuracy: {tolerance: 1.0e-9}
"""


def test_a_pin_leaves_a_wall_that_turns_after_its_way_has_turned_back():
    """Straight flights, and the equation along a wall of a turning frame."""
    result = run(TURNING)

    def in_slot(time):
        k = result.sample_at(time)
        back = np.exp(-1j * result.poses[k, 0, 2])
        place, speed = (back * complex(*of[k, 1, :2]) for of in (result.poses, result.rates))
        return place, speed - 5j * place

    touches = list(result.sleeves["slot"].touches)
    first, last = touches[0], touches[-1]
    assert (first.pair, first.begin) == (0, 0.0)
    assert np.hypot(*result.slot_forces["slot"][0]) == pytest.approx(3.6075)
    assert first.end == pytest.approx(0.2202780126, rel=1e-9)
    place, speed = in_slot(first.end)
    assert place.real == pytest.approx(0.1800006944, rel=1e-9)
    assert speed.real == pytest.approx(0.0025, abs=1e-9)
    hits = [
        (0.2848635097, 0.1893070821, 0.2782399992, 0.09225934093),
        (0.3130414862, 0.1991207908, 0.4148277301, 0.0525485276),
        (0.3250450202, 0.2044683749, 0.4753657579, 0.02748552636),
        (0.3306819211, 0.2072302712, 0.5043726438, 0.0140152853),
    ]
    for touch, (time, xi, rate, closing) in zip(touches[1:5], hits, strict=True):
        place, speed = in_slot(touch.begin)
        told = touch.begin, touch.place, speed.real, touch.approach_speed
        assert touch.pair == 1
        assert told == pytest.approx((time, xi, rate, closing), rel=2e-8)
    assert last.lasts
    assert last.begin == pytest.approx(0.3361115236, abs=1e-6)
    place, speed = in_slot(0.6)
    assert (place.real, speed.real) == pytest.approx((0.6060561019, 2.89195108), rel=1e-8)
    assert np.hypot(*result.slot_forces["slot"][-1]) == pytest.approx(8.683353241, rel=1e-8)


# --- slots that bend ---------------------------------------------------------------------------

HOOP = """
curves: {{hoop: {{type: circle, centre: [0, 0], radius: 0.1}}}}
bodies: {{pin: {{type: rigid, mass: 0.2, inertia: 1.6e-6}}}}
joints:
  slot: {{type: slot, point: pin.centre, curve: hoop, clearance: 1 mm, radius: 4 mm,
         law: {{type: impulse, restitution: 0, friction: {friction}, slip_speed: 1.0e-7}}}}
initial: {{positions: {{pin: [0.101, 0]}}, velocities: {{pin: [0, 0.6]}}}}
run: {{duration: {duration}}}
accuracy: {{tolerance: 1.0e-8}}
"""


def test_the_outer_wall_of_a_round_slot_holds_a_pin_at_its_radius():
    """The pin's middle runs on a circle larger by the clearance: N = m v^2/(R + c)."""
    result = run(HOOP.format(friction=0, duration=1.2))
    np.testing.assert_allclose(np.hypot(*where(result, "pin.centre").T), 0.101, rtol=1e-9)
    force = np.hypot(*result.slot_forces["slot"].T)[result.time > 1e-6]
    np.testing.assert_allclose(force, 0.2 * 0.6**2 / 0.101, rtol=1e-7)
    assert [lap.details["lap"] for lap in result.laps] == [2.0]
    assert result.laps[0].time == pytest.approx(2 * pi * 0.101 / 0.6)


def test_friction_turns_a_pin_in_a_round_slot_until_it_rolls():
    """m v' = -mu N and I w' = -mu N r, with I = m r^2/2, until v + r w = 0: at two thirds of v."""
    mu, radius = 0.2, 0.101
    rolls = radius / mu * 0.5 / 0.6
    result = run(HOOP.format(friction=mu, duration=0.45))
    slips = result.time < rolls
    speed = np.hypot(*result.rates[:, 0, :2].T)
    expected = 1 / (1 / 0.6 + mu * result.time / radius)
    np.testing.assert_allclose(speed[slips], expected[slips], rtol=1e-6)
    np.testing.assert_allclose(speed[result.time > rolls + 0.01], 0.4, rtol=1e-5)
    assert 4e-3 * result.rates[-1, 0, 2] == pytest.approx(-0.4, rel=1e-5)


LAPS = """
curves:
  ellipse: {{type: ellipse, centre: [0, 0], semi_axes: [0.04, 0.03]}}
  egg:
    type: joined
    pieces:
      - {{type: ellipse, centre: [0, 0], semi_axes: [0.04, 0.03], from: -90 deg, to: 90 deg}}
      - {{type: circle, centre: [0, 0], radius: 0.03, from: 90 deg, to: 270 deg}}
  track: {{type: laps, curves: [ellipse, egg]}}
bodies: {{pin: {{type: rigid, mass: 0.2, inertia: 0}}}}
joints:
  slot: {{type: slot, point: pin.centre, curve: track, clearance: 0.5 mm, law: {law}}}
initial: {{velocities: {{pin: [0.05, {speed}]}}}}
run: {{duration: 0.45}}
accuracy: {{tolerance: 1.0e-7}}
"""


@pytest.mark.parametrize(
    ("law", "speed"),
    [
        ("{type: impulse, restitution: 0.5}", 1.0),
        ("{type: impulse, restitution: 0.5}", -1.0),
        ("{stiffness: 1.0e6, restitution: 0.2}", 1.0),
    ],
)
def test_a_pin_stays_between_the_walls_of_its_lap(law, speed):
    """Within the clearance of the curve of each lap, far from the others; energy is kept."""
    result = alone(LAPS.format(law=law, speed=speed))
    groove = assemble_scene(result.scene).mechanism.grooves[0]
    begun = [(0.0, 1), *((lap.time, int(lap.details["lap"])) for lap in result.laps)]
    ends = [*(time for time, _ in begun[1:]), np.inf]
    whole = 0
    for (begin, lap), end in zip(begun, ends, strict=True):
        inside = (result.time > begin) & (result.time < end)
        if not inside.any():  # it starts backwards, on the seam
            continue
        points = where(result, "pin.centre")[inside]
        mine, other = (groove.curves[(abs(lap) - 1 + k) % 2] for k in (0, 1))
        away, across = (
            np.linalg.norm(points - curve.point(curve.closest(points)), axis=1).max()
            for curve in (mine, other)
        )
        assert away <= 5e-4 + result.sleeves["slot"].deepest + 1e-9
        whole += across > 5e-3
    assert whole >= 2
    moved = result.energy.kinetic + result.energy.stored + result.energy.dissipated
    np.testing.assert_allclose(moved, moved[0], rtol=2e-8)


# --- ends, starts, effects -----------------------------------------------------------------------


def test_beyond_an_open_end_nothing_holds_and_the_run_says_so():
    text = LEVEL.format(law="{type: impulse, restitution: 0.5}", duration=0.3)
    result = simulate(scene(text.replace("to: [2, 0]", "to: [0.1, 0]")))
    assert result.outcome.completed
    assert "leaves its slot at t = 0.125" in " ".join(result.warnings)
    left = 0.1 / 0.8
    assert result.sleeves["slot"].touches.end.max() <= left + 1e-9
    flies = result.time > left
    fall = where(result, "pin.centre")[flies, 1]
    t = result.time[flies] - result.time[flies][0]
    vy = result.rates[flies][0, 0, 1]
    np.testing.assert_allclose(fall, fall[0] + vy * t - 9.81 * t**2 / 2, atol=1e-12)


def test_a_pin_starts_in_the_middle_and_moves_with_its_curve():
    text = TURNING.replace("positions: {pin: [0.3, 0.001]}, velocities: {pin: [-1.205, 1.5]}", "")
    state = assemble_scene(scene(text)).state
    ideal = idealise(scene(text), ["clearance"])
    np.testing.assert_allclose(state.q, assemble_scene(ideal).state.q, atol=1e-12)
    np.testing.assert_allclose(state.v, assemble_scene(ideal).state.v, atol=1e-9)
    assert absent(ideal, ["clearance"]) == ["clearance"]
    joint = ideal.joints["slot"]
    assert (joint.clearance, joint.law, joint.radius) == (0.0, None, 0.0)


def test_a_run_goes_on_in_the_lap_in_which_its_pin_was():
    """Continued while the pin flies, it comes to the same end as without a stop."""
    whole = alone(LAPS.format(law="{type: impulse, restitution: 1}", speed=1.0))
    second, third = (lap.time for lap in whole.laps)
    begin, end = next(span for span in free_spans(whole) if second < span[0] and span[1] < third)
    at = whole.time[(whole.time > begin) & (whole.time < end)][0]
    scene_on = continued(whole, float(at))
    assert scene_on.initial.laps == {"slot": 2}
    rest = simulate(scene_on.changed(run=Run(duration=float(whole.time[-1] - at))))
    assert rest.poses[-1] == pytest.approx(whole.poses[-1], abs=1e-5)
    assert [lap.details["lap"] for lap in rest.laps] == [3.0]


def test_the_slot_is_drawn_as_wide_as_it_is():
    mechanism = assemble_scene(scene(HOOP.format(friction=0, duration=1))).mechanism
    (groove,) = mechanism.grooves
    inner, outer = (np.hypot(*wall.places.T) for wall in slot_walls(groove))
    np.testing.assert_allclose(inner, 0.1 - 0.005, rtol=1e-12)
    np.testing.assert_allclose(outer, 0.1 + 0.005, rtol=1e-12)


def test_check_tells_play_pin_and_walls():
    whole = scene(HOOP.format(friction=0.2, duration=1))
    told = " ".join(check_text(whole, assemble_scene(whole)).split())
    assert "pin.centre on hoop, clearance 0.001 m on each side, pin of radius 0.004 m" in told
    assert "pin at pin.centre between" in told


def test_the_result_speaks_of_the_walls():
    result = run(TURNING)
    assert list(result.sleeves) == ["slot"] == list(result.intervals)
    assert result.sleeves["slot"].pairs == ("slot: left wall", "slot: right wall")
    assert contact_totals(result, "slot").touches == len(result.sleeves["slot"].touches)
