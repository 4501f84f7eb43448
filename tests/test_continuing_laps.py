"""A run on a track of laps goes on as if never stopped, whichever way its point passes the seam.

The mechanism of the paper with a rigid link and no strike: the crank's angle tells where P is, if
one knows the curve. P is 1 cm nearer to O on the egg than on the ellipse when the crank is at 180
degrees. Where the crank is at 0, P passes the seam.
"""

from functools import cache
from math import pi, radians

import numpy as np
import pytest
from physics_tools import MODELS
from test_continuing import BOTH, apart, rest_of

from exudyn_flexlink.continuing import continued
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.scene import Run

ALIKE = 1e-4  # m, of places that any other lap puts more than 1 mm off


@cache
def turned(case, speed, duration, start=0.0, sample=1e-3):
    """Run of a crank that turns from a start angle (rad), at a speed (rad/s) if one is given."""
    engine, settings = case
    asked = (
        *([] if speed is None else [f"drives.motor.value={speed}"]),
        f"run={{duration: {duration}, sample: {sample}}}",
        f"initial.angles.guide={start} rad",
        "contacts={}",
        "outputs.watch=link.end",
        "accuracy.tolerance=3e-5",
    )
    result = simulate(load_scene(MODELS / "rigid.yaml", (*asked, *settings)), engine, measure=False)
    assert result.outcome.completed, result.outcome
    return result


def laps_of(result):
    return [int(lap.details["lap"]) for lap in result.laps]


def radius(result, time):
    """Distance (m) from the crank's pivot to P."""
    k = result.sample_at(time)
    return float(np.hypot(*(result.poses[k, 1, :2] - [0.02, 0.0])))


@BOTH
def test_a_point_that_runs_backwards_goes_on_in_any_lap(engine, settings):
    """It passes the seam at 40, 400, 760 and 1120 degrees: on ellipse, ellipse, egg, ellipse.."""
    whole = turned((engine, settings), -10, radians(1200) / 10, radians(40))
    assert laps_of(whole) == [-1, -2, -3, -4]
    middles = [radius(whole, radians(220 + 360 * k) / 10) for k in range(3)]
    assert middles == pytest.approx([0.06, 0.05, 0.06], abs=1e-4)
    told = {20: 1, 390: -1, 410: -2, 770: -3, 1150: -4}
    for degrees, lap in told.items():
        again = rest_of(whole, radians(degrees) / 10)
        assert again.scene.initial.laps == {"pin": lap}
        assert laps_of(again) == [own for own in (-1, -2, -3, -4) if abs(own) > abs(lap) or lap > 0]
        assert apart(whole, again) < ALIKE


@BOTH
@pytest.mark.parametrize("way", [1, -1])
def test_a_run_goes_on_from_the_seam_itself(engine, settings, way):
    """Rounding decides whether a point that is on the seam at a sample has passed it.

    A crank that starts on the seam is there again after each turn, also where the run ends. With
    one sample a turn all are on the seam, so that the speed alone tells that it ran round.
    """
    turn = 2 * pi / 10
    case, speed = (engine, settings), 10 * way
    whole = turned(case, speed, 2.6 * turn, sample=turn / 200)
    begun = [continued(whole, k * turn) for k in (0, 1, 2)]
    begun += [continued(turned(case, speed, k * turn, sample=turn)) for k in (1, 2)]
    for k, start in zip((0, 1, 2, 1, 2), begun, strict=True):
        assert start.initial.laps == {"pin": k + 1 if way > 0 else (-k or 1)}
        again = simulate(start.changed(run=Run(duration=0.6 * turn)), engine, measure=False)
        there = whole.poses[whole.sample_at((k + 0.6) * turn)]
        assert again.poses[-1] == pytest.approx(there, abs=ALIKE)


@BOTH
@pytest.mark.parametrize(("start", "laps"), [(2.4, [-1, 1, -1, 1]), (-2.4, [2, 1, 2, 1])])
def test_a_point_that_swings_over_the_seam_goes_on(engine, settings, start, laps):
    """Gravity pulls the free crank to where P is on the seam."""
    free = ("drives={}", "gravity=[9.81, 0]", *settings)
    whole = turned((engine, free), None, 1.5, start)
    assert laps_of(whole) == laps
    for time in np.arange(0.1, 1.5, 0.4):
        passed = [1, *(lap.details["lap"] for lap in whole.laps if lap.time < time)]
        again = rest_of(whole, time)
        assert again.scene.initial.laps == {"pin": passed[-1]}
        assert apart(whole, again) < ALIKE


@BOTH
@pytest.mark.parametrize("down", [-9.81, 9.81])
def test_a_point_that_rests_on_the_seam_goes_on(engine, settings, down):
    """It hangs there at rest; then gravity turns, and it falls over, forwards or backwards."""
    free = ("drives={}", *settings)
    resting = turned((engine, (*free, "gravity=[9.81, 0]")), None, 0.5)
    fallen = turned((engine, (*free, f"gravity=[0, {down}]")), None, 0.4)
    for time in (0.0, 0.5):
        begun = continued(resting, time)
        assert begun.initial.laps == {"pin": 1}
        again = begun.changed(gravity=fallen.scene.gravity, run=Run(duration=0.4))
        assert apart(fallen, simulate(again, engine, measure=False)) < ALIKE


@pytest.mark.parametrize("settings", [(), ("solver.formulation=redundant",)])
@pytest.mark.parametrize("way", [1, -1])
def test_a_point_that_comes_to_rest_on_the_seam_goes_on(settings, way):
    """A crank that turns once, waits, and turns on: P is on the egg then, if it ran forwards."""
    full = 20 * way * pi  # rad/s: from rest to it and back again is a turn
    points = [[0, 0], [0.1, 0], [0.2, full], [0.3, 0], [0.4, 0], [0.6, full / 2]]
    whole = turned(("exudyn", settings), f"{{points: {points}, rule: linear}}", 0.6)
    for time in (0.0, 0.3, 0.35):
        assert apart(whole, rest_of(whole, time)) < ALIKE
