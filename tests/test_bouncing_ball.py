"""A ball that bounces in minimal coordinates; the published one on a stiff and a rigid floor."""

from math import inf, sqrt

import numpy as np
import pytest
from physics_tools import FLOOR, alone, scene, where
from test_physics_impulse import balanced, impacts

from exudyn_flexlink.engines import formulations, simulate

G = 9.81

BALL = f"""
bodies:
  ball: {{type: rigid, mass: 2, inertia: 0, points: {{c: [0, 0]}}}}
{FLOOR}
contacts:
  hit:
    type: point_on_line
    point: ball.c
    line: [floor.a, floor.b]
    law: {{type: impulse, restitution: 0.9}}
gravity: 9.81
initial: {{positions: {{ball: [0, 1]}}}}
run: {{duration: 10, sample: 5 ms}}
accuracy: {{tolerance: 1.0e-6}}
"""


def test_a_ball_bounces_until_it_rests():
    """Flights 2 v/g that get shorter by e: all are over at sqrt(2 h/g) (1 + e)/(1 - e)."""
    result = alone(BALL)
    *hits, rest = result.intervals["hit"]
    first, e = sqrt(2 / G), 0.9
    bounces = first * (1 + 2 * np.cumsum([0.0, *e ** np.arange(1, len(hits))]))
    assert hits[0].begin == pytest.approx(0.451524, abs=5e-7)  # published, to its last digit
    assert [hit.begin for hit in hits] == pytest.approx(bounces, abs=1e-9)
    assert all(hit.begin == hit.end and hit.peak_force == inf for hit in hits)
    speeds = sqrt(2 * G) * e ** np.arange(len(hits))
    assert [hit.approach_speed for hit in hits] == pytest.approx(speeds, rel=1e-6, abs=1e-10)
    assert [hit.impulse for hit in hits] == pytest.approx(2 * (1 + e) * speeds, rel=1e-6, abs=1e-9)
    losses = (1 - e * e) * speeds**2
    assert [hit.energy_lost for hit in hits] == pytest.approx(losses, rel=1e-6, abs=1e-12)
    # Bounces at less than 1e-6 m/s are cut off: 2e-6 s before the last of endlessly many.
    assert rest.begin == pytest.approx(8.578949, abs=1e-5)
    assert rest.lasts
    assert rest.peak_force == pytest.approx(2 * G, rel=1e-9)
    assert rest.impulse == pytest.approx(2 * G * (10 - rest.begin), rel=1e-6)
    still = result.time >= rest.begin
    assert abs(where(result, "ball.c")[still]).max() < 1e-12
    assert result.contacts["hit"].force[still] == pytest.approx(2 * G)
    assert balanced(result)
    assert result.energy.dissipated[-1] == pytest.approx(2 * G, rel=1e-9)


def test_a_ball_without_loss_bounces_on():
    result = alone(BALL.replace("0.9", "1"))
    hits = [hit.begin for hit in impacts(result, "hit")]
    assert hits == pytest.approx(sqrt(2 / G) * np.arange(1, 2 * len(hits), 2), abs=1e-9)
    assert len(hits) == 11
    assert sum(hit.energy_lost for hit in impacts(result, "hit")) == 0


def test_a_ball_without_restitution_stays():
    """The impact takes all energy at once; then the floor carries the ball."""
    result = alone(BALL.replace("0.9", "0"), "run.duration=1")
    hit, rest = result.intervals["hit"]
    assert (hit.begin, hit.energy_lost) == pytest.approx((sqrt(2 / G), 2 * G))
    assert (rest.begin, rest.approach_speed, rest.end) == (hit.begin, 0, inf)
    assert result.energy.kinetic[-1] < 1e-20
    assert [event.kind for event in result.events] == ["impact", "contact begins"]


@pytest.mark.parametrize("tolerance", [1e-3, 1e-8])
def test_impacts_are_as_exact_at_any_tolerance(tolerance):
    result = alone(BALL, "run.duration=2", f"accuracy.tolerance={tolerance}")
    assert impacts(result, "hit")[1].begin == pytest.approx(sqrt(2 / G) * 2.8, abs=1e-10)


def test_a_ball_that_starts_on_the_floor_is_carried_from_the_start():
    result = alone(BALL, "initial.positions.ball=[0, 0]", "run.duration=1")
    (rest,) = result.intervals["hit"]
    assert (rest.begin, rest.lasts) == (0, True)
    assert rest.impulse == pytest.approx(2 * G)


# --- what is said -----------------------------------------------------------------------------


def test_a_scene_with_impulses_is_run_in_minimal_coordinates():
    given = scene(BALL, "accuracy={step: 1 ms}", "run.duration=1")
    assert formulations(given, "exudyn") == ("minimal",)
    result = simulate(given, measure=False)
    assert result.settings.formulation == "minimal"
    assert impacts(result, "hit")[0].begin == pytest.approx(sqrt(2 / G), abs=1e-10)
