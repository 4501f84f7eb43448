"""Points that slide off a face's end: how errors grow there, and what measures them after it."""

from dataclasses import replace
from math import acos, atan2, cos, exp, inf, pi, sin
from pathlib import Path

import numpy as np
import pytest
from random_strikes import MODEL, draw

import exudyn_flexlink as fl
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.engines.diagnostics.amplification import multiplying
from exudyn_flexlink.engines.diagnostics.bursts import bounced_apart
from exudyn_flexlink.engines.diagnostics.neighbour import HIGH_ORDER, measured_by
from exudyn_flexlink.engines.diagnostics.releases import releases
from exudyn_flexlink.engines.interrupts import LateInterruptError
from exudyn_flexlink.intervals import Interval, Intervals
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.observables import lever_response
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.sensitivity import SCATTER

CRANK, LEVER, PIVOT, FREQUENCY = 0.1, 0.03, 0.129, 40.0  # m, m, m left of the crank's joint, Hz
START = -2 * pi / 180  # rad, angle of the crank below the line from its joint to the lever's
SLOW, FAST = 0.5, 8.0  # rad/s

# A crank's end presses a lever aside, and slides off its end.
PUSHED = """
title: A crank that pushes a lever aside
materials:
  steel: {{density: 7850, youngs_modulus: 200 GPa}}
bodies:
  crank: {{type: rod, length: 0.1, material: steel, section: {{width: 20 mm, thickness: 12 mm}}}}
  lever: {{type: rigid, mass: 2.4 g, inertia: 1.8e-7, centre_of_mass: [0.015, 0],
          points: {{pivot: [0, 0], tip: [{tip}, 0]}}}}
joints:
  axle: {{type: revolute, points: [ground, crank.start], at: [0, 0]}}
  pivot: {{type: revolute, points: [ground, lever.pivot], at: [-0.129, 0]}}
springs:
  back: {{type: torsional, joint: pivot, frequency: 40 Hz, damping_ratio: 0.02}}
drives:
  motor: {{type: speed, joint: axle, value: {speed}}}
contacts:
  strike: {{type: point_on_line, point: crank.end, line: [lever.pivot, lever.tip],
           law: {{stiffness: 2.0e+4, restitution: 0}}}}
initial: {{angles: {{crank: 178 deg}}}}
run: {{duration: {duration}}}
accuracy: {{tolerance: 1.0e-6}}
"""


def pushed(folder: Path, speed: float, tip: float = LEVER) -> Result:
    """A run past the release, at a speed in rad/s."""
    model = folder / "model.yaml"
    model.write_text(PUSHED.format(speed=speed, tip=tip, duration=0.15 / speed))
    return simulate(load_scene(model), measure=False)


@pytest.fixture(scope="module")
def slow(tmp_path_factory: pytest.TempPathFactory) -> Result:
    return pushed(tmp_path_factory.mktemp("slow"), SLOW)


def test_growth_is_that_of_a_lever_that_springs_back_once_it_is_free(slow: Result) -> None:
    """The crank's end at an angle phi below the line leaves the face where it is LEVER from PIVOT.

    It then slides at PIVOT CRANK sin(phi) / LEVER times the crank's speed. The lever stands at psi,
    and its end is LEVER omega psi fast as it comes back to rest.
    """
    phi = acos((PIVOT**2 + CRANK**2 - LEVER**2) / (2 * PIVOT * CRANK))
    psi = atan2(CRANK * sin(phi), PIVOT - CRANK * cos(phi))
    damped = exp(-0.02 * pi / 2)  # in the quarter of a period from rest to the fastest
    (found,) = releases(slow)
    assert found.contact == "strike"
    assert found.time == pytest.approx((phi - START) / SLOW, rel=1e-3)
    assert found.creep == pytest.approx(SLOW * PIVOT * CRANK * sin(phi) / LEVER, rel=1e-2)
    assert found.spring_back == pytest.approx(LEVER * 2 * pi * FREQUENCY * psi * damped, rel=2e-2)


def test_an_error_of_the_place_grows_so_much(slow: Result, tmp_path: Path) -> None:
    """A face shorter by dx is left dx / creep earlier: its end is then off by growth times dx."""
    (release,) = releases(slow)
    dx = 1e-6
    time = np.linspace(release.time, release.time + 1 / FREQUENCY, 200)
    angles = [
        lever_response(run, "strike").value_at(time)
        for run in (slow, pushed(tmp_path, SLOW, LEVER - dx))
    ]
    off = LEVER * np.abs(angles[1] - angles[0]).max()
    assert off == pytest.approx(release.growth * dx, rel=0.1)


def test_a_release_that_multiplies_errors_says_how_and_has_them_measured(
    slow: Result, tmp_path: Path
) -> None:
    (release,) = releases(slow)
    assert multiplying(slow) == (
        f"the point of 'strike' crept off the end of its face at {release.time:.6g} s, at "
        f"{release.creep:.2g} m/s, and set free what it had pressed: errors are "
        f"{release.growth:.2g} times as large from then on"
    )
    fast = pushed(tmp_path, FAST)
    (brisk,) = releases(fast)
    assert brisk.growth == pytest.approx(release.growth * SLOW / FAST, rel=0.2)
    assert multiplying(fast) == ""


def cut_off(folder: Path, tip: float) -> Result:
    """A strike at 8 m/s that ends half-way, where the crank's end comes past the lever's."""
    model = folder / "model.yaml"
    written = PUSHED.format(speed=80, tip=tip, duration=0.02)
    model.write_text(written.replace("1.0e-6", "1.0e-9"))
    return simulate(load_scene(model), measure=False)


def test_a_strike_that_is_cut_off_leaves_an_error_of_speed_which_grows_within_a_swing(
    tmp_path: Path,
) -> None:
    """Here the lever's speed of 4 m/s tells a thirtieth of how errors grow.

    An error dt of the instant is one F tip^2 dt / J of the end's speed, and 1/omega times that of
    its place.
    """
    tip, dx = 0.02904, 1e-8
    run, shorter = (cut_off(tmp_path, length) for length in (tip, tip - dx))
    (release,) = releases(run)
    time = np.linspace(release.time, release.time + 0.5 / FREQUENCY, 200)
    angles = [lever_response(one, "strike").value_at(time) for one in (run, shorter)]
    grown = tip * np.abs(angles[1] - angles[0]).max() / dx
    assert release.growth == pytest.approx(grown, rel=0.1)
    assert release.growth > 20 * release.spring_back / release.creep
    assert multiplying(run) != ""


# --- runs that bounce differently


def test_both_engines_tell_the_force_that_a_short_touch_sets_free() -> None:
    """A touch of 77 microseconds has few samples, or none, near to its end."""
    settings = draw(np.random.default_rng([11, 32]), undamped=True)
    scene = fl.load_scene(MODEL, [*settings, "run.turns=0.6"])
    runs = [simulate(scene, engine, measure=False) for engine in ("exudyn", "lagrangian")]
    (first,), (second,) = map(releases, runs)
    assert first.time == pytest.approx(second.time, abs=1e-8)
    assert first.push == pytest.approx(second.push, rel=0.5)


@pytest.mark.parametrize(
    ("second", "parted"),
    [
        ([1.0, 2.0, 2.5], inf),
        ([1.4, 2.2, 2.6], inf),
        ([1.0, 2.3, 2.5], 2.0),  # nearer to another strike of the first
        ([1.0, 2.0], 2.5),
        ([1.0, 2.0, 2.5, 2.6], 2.6),
        ([], 1.0),
    ],
)
def test_runs_bounce_apart_where_a_strike_has_no_counterpart(
    second: list[float], parted: float
) -> None:
    assert bounced_apart(np.array([1.0, 2.0, 2.5]), np.array(second)) == parted


def bounced(run: Result, times: list[float]) -> Result:
    """The run, but with strikes at so many instants (s) before that one which ends in a release."""
    contact = run.contacts["strike"]
    (lasting,) = (touch for touch in contact.touches if touch.slides_off)
    rows = [Interval(time, time + 1e-5) for time in times]
    touches = Intervals.of([*rows, replace(lasting, begin=lasting.begin + 0.05)])
    return replace(run, contacts={"strike": replace(contact, touches=touches)})


def tilted(run: Result, off: float) -> Result:
    """The run, but with the lever's end off by so much (m) from the start."""
    poses = run.poses.copy()
    poses[:, run.part_names.index("lever"), 2] += off / LEVER
    return replace(run, poses=poses)


@pytest.mark.parametrize(
    ("times", "off", "neighbours"),
    [
        pytest.param([0.07, 0.09], 2e-7, 1, id="bounce alike"),
        pytest.param([0.07, 0.08, 0.09], 1e-9, 1, id="apart, and too near to matter"),
        pytest.param([0.07, 0.08, 0.09], 2e-7, 2, id="apart"),
    ],
)
def test_runs_that_bounced_apart_and_were_released_are_judged_by_a_finer_one(
    slow: Result, times: list[float], off: float, neighbours: int
) -> None:
    """Both may be wrong alike: only the second neighbour shows that the run is 1e-5 m off."""
    run = bounced(slow, [0.07, 0.09])
    made: list[float | None] = []

    def again(scene: Scene) -> Result:
        made.append(scene.accuracy.tolerance)
        return bounced(tilted(slow, off if len(made) == 1 else 1e-5), times)

    found = measured_by(run, again).result
    assert made == pytest.approx([1e-6 * HIGH_ORDER ** (k + 1) for k in range(neighbours)])
    shown = 1e-5 if neighbours == 2 else off
    assert found.error.largest == pytest.approx(shown * SCATTER, rel=0.1)
    assert len(found.warnings) == len(made) - 1


@pytest.mark.parametrize("ending", [KeyboardInterrupt, MemoryError])
def test_a_finer_neighbour_that_was_not_made_leaves_what_the_first_one_told(
    slow: Result, ending: type[BaseException]
) -> None:
    run, made = bounced(slow, [0.07, 0.09]), 0

    def again(scene: Scene) -> Result:
        nonlocal made
        made += 1
        if made == 2:
            raise ending
        return bounced(tilted(slow, 2e-7), [0.07, 0.08, 0.09])

    try:
        found = measured_by(run, again).result
    except LateInterruptError as error:
        found = error.result
    assert found.error is not None
    assert found.error.largest == pytest.approx(2e-7 * SCATTER, rel=0.1)
    assert found.error.missing == ""
    (told,) = found.warnings
    assert "both may be equally wrong, and no finer run judged them" in told
