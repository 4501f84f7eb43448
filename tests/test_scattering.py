"""Strikes that part motions which were near each other: what they do to errors is measured."""

from __future__ import annotations

from math import log
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from exudyn_flexlink import load_scene
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.engines.diagnostics.amplification import LARGE_GROWTH
from exudyn_flexlink.engines.exudyn.minimal.closed import ClosedCoordinates
from exudyn_flexlink.engines.exudyn.minimal.scattering import Scattering
from exudyn_flexlink.loading import scene_of
from exudyn_flexlink.observables import path
from exudyn_flexlink.result import Event, Result, laps_begun
from exudyn_flexlink.source import parse_document

MODELS = Path(__file__).parent.parent / "models"
MASS, SPEED, LASTS = 2.0, 3.0, 2.0  # kg, m/s, s
RETURNED, NEAR = 0.5, 0.3  # m: where the ball starts, from the peg's edge

PEG = """title: a ball flies into the middle of a peg
bodies: {{ball: {{type: rigid, mass: {mass}, inertia: 0, points: {{c: [0, 0]}}}}}}
contacts:
  hit:
    type: circle_on_circle
    circles: [{{at: ball.c, radius: 0.01}}, {{at: ground, place: [0, 0], radius: {radius}}}]
    law: {law}
initial: {{positions: {{ball: [{start}, 0]}}, velocities: {{ball: [-{speed}, 0]}}}}
run: {{duration: {lasts}}}
accuracy: {{tolerance: 1.0e-6}}
"""
STRUCK_AND_ENDED = """title: a double pendulum strikes a table, and soon a torque has no value
bodies:
  upper: &bar {type: rigid, mass: 1, inertia: 0.1, centre_of_mass: [0.5, 0],
               points: {first: [0, 0], second: [1, 0]}}
  lower: *bar
  table: {type: rigid, mass: 1, inertia: 1, points: {left: [-4, -0.5], right: [4, -0.5]}}
joints:
  hung: {type: revolute, points: [ground, upper.first], at: [0, 0]}
  between: {type: revolute, points: [upper.second, lower.first]}
  fixed: {type: weld, points: [ground, table.left], at: [-4, -0.5]}
contacts:
  hit:
    type: point_on_line
    point: lower.second
    line: [table.left, table.right]
    law: {stiffness: 1.0e5, restitution: 0.5, transition_speed: 1 mm/s}
drives: {late: {type: torque, joint: hung, value: "where(t < 0.45, 0, sqrt(angle(between) - 5))"}}
gravity: 9.81
run: {duration: 1}
accuracy: {tolerance: 1.0e-5}
"""
PUSHED, STIFF, AROUND = 19.0, 1e7, 0.08  # N/m of the spring and of the peg; m, the spring's length
PEG_AT, REACH = (0.5834, 0.0576), 0.0094  # m: of the peg, with the radius of the ball
START, FROM = (0.8, 0.1), (-1.836, -1.934)
ON_A_SPRING = f"""title: a ball on a spring strikes a small peg, and once more after four seconds
bodies: {{ball: {{type: rigid, mass: 1, inertia: 0, points: {{c: [0, 0]}}}}}}
springs:
  s: {{type: linear, points: [ground, ball.c], at: [0, 0], stiffness: {PUSHED}, length: {AROUND}}}
contacts:
  hit:
    type: circle_on_circle
    circles:
      - {{at: ball.c, radius: 1 mm}}
      - {{at: ground, place: [{PEG_AT[0]}, {PEG_AT[1]}], radius: {REACH - 1e-3}}}
    law: {{stiffness: {STIFF}, restitution: 1}}
gravity: 9.81
initial:
  positions: {{ball: [{START[0]}, {START[1]}]}}
  velocities: {{ball: [{FROM[0]}, {FROM[1]}]}}
run: {{duration: 6}}
accuracy: {{tolerance: 1.0e-6}}
"""


def run(text: str) -> Result:
    return simulate(scene_of(parse_document(text, "pegs.yaml")), "exudyn")


@pytest.mark.parametrize(
    "law",
    [
        f"{{type: impulse, restitution: {RETURNED}}}",
        f"{{stiffness: 1.0e+9, restitution: {RETURNED}, transition_speed: 0.01 mm/s}}",
    ],
)
def test_a_strike_of_a_peg_parts_motions_by_its_curvature(law: str) -> None:
    """Beside the middle by s the normal is turned by s/R: it flies off by (1 + e) v s/R more."""
    radius = 0.04
    far = radius + 0.01
    start = far + NEAR
    found = run(
        PEG.format(mass=MASS, radius=radius, law=law, start=start, speed=SPEED, lasts=LASTS)
    )
    left = LASTS - NEAR / SPEED
    assert found.checks.e_folds == pytest.approx(
        log(1 + (1 + RETURNED) * SPEED * left / far), rel=1e-3
    )
    assert found.error is not None


def test_a_flat_wall_parts_nothing() -> None:
    text = PEG.format(
        mass=MASS, radius=1e9, law="{type: impulse, restitution: 1}", start=0, speed=SPEED, lasts=1
    ).replace("place: [0, 0]", f"place: [{-1e9 - 0.5}, 0]")
    found = run(text)
    assert len(found.contacts["hit"].touches) == 1
    assert found.checks.e_folds < 1e-6
    assert found.error is None


def on_a_spring(times: FloatArray) -> FloatArray:
    """Places (n, 2) of the ball, by an explicit method whose steps end where it touches."""
    peg = np.array(PEG_AT)

    def rates(_: float, y: FloatArray) -> FloatArray:
        far, away = np.hypot(*y[:2]), y[:2] - peg
        force = -PUSHED * (far - AROUND) * y[:2] / far + (0.0, -9.81)
        depth = REACH - np.hypot(*away)
        if depth > 0:
            force = force + STIFF * depth * away / np.hypot(*away)
        return np.array([*y[2:], *force])

    def gap(_: float, y: FloatArray) -> float:
        return float(np.hypot(*(y[:2] - peg)) - REACH)

    gap.terminal = True  # type: ignore[attr-defined]
    found, begin, y = np.full((len(times), 2), np.nan), 0.0, np.array([*START, *FROM])
    accuracy = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-15, "max_step": 2e-3}
    while begin < times[-1]:
        part = solve_ivp(rates, (begin, times[-1]), y, events=gap, dense_output=True, **accuracy)
        end = float(part.t[-1])
        own = (times >= begin) & (times <= end)
        found[own] = part.sol(times[own])[:2].T
        moment = 1e-12  # s: on to where the event is over
        y, begin = part.y[:, -1] + moment * rates(end, part.y[:, -1]), end + moment
    return found


def test_two_strikes_of_a_peg_are_measured() -> None:
    """They make it 2.7 tolerances off; two strikes in a row are too few to be measured for."""
    found = run(ON_A_SPRING)
    assert len(found.contacts["hit"].touches) == 2
    off = np.hypot(*(path(found, "ball.c").position - on_a_spring(found.time)).T)
    largest = float(np.nanmax(off))  # an event's own sample may fall between two parts
    assert largest > 1e-6
    assert found.error is not None
    assert found.error.largest >= largest
    assert any("strikes scatter" in line for line in found.warnings)


def test_the_papers_strike_parts_little() -> None:
    """It is not measured in vain; its laps count each by itself."""
    found = simulate(load_scene(MODELS / "no_clearance.yaml"), "exudyn")
    assert len(found.laps) > 1
    assert 0 < found.checks.e_folds < log(LARGE_GROWTH)
    assert found.error is None


def test_a_point_that_swings_over_the_seam_makes_no_lap_each_time():
    """Strikes of one lap count together, however often the seam is passed within it."""
    swings = [Event(float(t), "lap", "pin", {"lap": lap}) for t, lap in enumerate([-1, 1] * 5)]
    rounds = [Event(10.0 + t, "lap", "pin", {"lap": t + 2}) for t in range(3)]
    assert laps_begun(swings) == [0.0, 1.0]
    assert laps_begun([*swings, *rounds]) == [0.0, 1.0, 10.0, 11.0, 12.0]
    assert laps_begun([swings[0], Event(0.5, "lap", "other", {"lap": -1.0})]) == [0.0, 0.5]


FIVE_BARS = """title: a chain of four links, held at both ends, falls on a peg
bodies:
  a: {type: rigid, mass: 1, inertia: 0.1, centre_of_mass: [0.5, 0], points: {s: [0, 0], e: [1, 0]}}
  b: {type: rigid, mass: 1, inertia: 0.1, centre_of_mass: [0.5, 0],
      points: {s: [0, 0], m: [0.5, 0.4], e: [1.2, 0]}}
  c: {type: rigid, mass: 1, inertia: 0.1, centre_of_mass: [0.3, 0],
      points: {s: [0, 0], e: [0.6, 0]}}
  d: {type: rigid, mass: 1, inertia: 0.1, centre_of_mass: [0.5, 0],
      points: {s: [0, 0], e: [0.9, 0]}}
joints:
  ab: {type: revolute, points: [a.e, b.s]}
  bc: {type: revolute, points: [b.e, c.s]}
  cd: {type: revolute, points: [c.e, d.e]}
  left: {type: revolute, points: [ground, a.s], at: [0, 0]}
  right: {type: revolute, points: [ground, d.s], at: [1.1, 0]}
contacts:
  hit:
    type: circle_on_circle
    circles: [{at: b.m, radius: 0.02}, {at: ground, place: [0.5, 0.8], radius: 0.2}]
    law: {type: impulse, restitution: 0.7}
gravity: 9.81
initial: {angles: {a: 1.9, b: 0.3}}
run: {duration: 0.9}
accuracy: {tolerance: 1.0e-6}
"""


def test_it_does_not_matter_which_coordinates_of_a_loop_are_the_independent_ones(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """After an impact they are chosen anew: what was of the old ones was taken for the new ones."""
    scene, chosen = scene_of(parse_document(FIVE_BARS, "bars.yaml")), ClosedCoordinates._chosen
    splits: list[tuple[int, ...]] = []
    told, e_folds = [], Scattering.e_folds

    def of_strikes(self: Scattering, time: float) -> float:
        told.append(e_folds(self, time))
        return told[-1]

    monkeypatch.setattr(Scattering, "e_folds", of_strikes)

    def noted(self: ClosedCoordinates) -> object:
        split = chosen(self)
        splits.append(tuple(split.free))
        return split

    monkeypatch.setattr(ClosedCoordinates, "_chosen", noted)
    anew = simulate(scene, "exudyn", measure=False)
    assert len(anew.contacts["hit"].touches) == 1
    assert len(set(splits)) > 1

    def held(self: ClosedCoordinates) -> object:
        return getattr(self, "_split", None) or chosen(self)

    monkeypatch.setattr(ClosedCoordinates, "_chosen", held)
    simulate(scene, "exudyn", measure=False)
    assert told[0] == pytest.approx(told[1], rel=1e-6)
    assert told[0] > 3


def test_a_torque_without_a_value_ends_a_run_that_has_strikes_behind_it():
    """What strikes made of errors is asked for once more where the run ended."""
    found = simulate(scene_of(parse_document(STRUCK_AND_ENDED, "pendulum")), measure=False)
    assert len(found.contacts["hit"].touches) == 1
    assert found.outcome.time == pytest.approx(0.45)
    assert "has no value at t = 0.45 s" in found.outcome.reason
