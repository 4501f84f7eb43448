"""What two runs share is told: the coarser one starts off by what rounding may be."""

import numpy as np
import pytest
from physics_tools import scene

from exudyn_flexlink import engines
from exudyn_flexlink.engines import measured, simulate

BALL = "bodies: {ball: {type: rigid, mass: 1, inertia: 1, points: {c: [0, 0]}}}"
BOUNCE = "law: {type: impulse, restitution: 1}"


def test_an_error_that_a_thin_pin_magnifies_is_told():
    """Deflected by 120 degrees: the strike is known to 3e-15 s, and what follows to no more."""
    text = f"""
{BALL}
contacts:
  hit:
    type: circle_on_circle
    circles: [{{at: ball.centre, radius: 1.0e-6}}, {{at: ground, place: [0, 0], radius: 1.0e-6}}]
    {BOUNCE}
initial: {{positions: {{ball: [-1, 1.0e-6]}}, velocities: {{ball: [1000, 0]}}}}
run: {{duration: 2.3e-3}}
accuracy: {{tolerance: 1.0e-8}}
"""
    result = simulate(scene(text), measure=True)
    true = np.linalg.norm(result.poses[-1, 0, :2] - [-0.650002598, 1.125835525])
    assert true < result.error.largest < 1e-3
    assert result.error.exceeds_from is not None


def test_a_billiard_is_told_before_it_is_over_its_tolerance():
    """By 200 digits its error passes 1e-6 m at 9.87 s; the first three strikes raise no alarm."""
    walls = {"b": ([-0.5, -0.5], [0.5, -0.5]), "r": ([0.5, -0.5], [0.5, 0.5]),
             "t": ([0.5, 0.5], [-0.5, 0.5]), "l": ([-0.5, 0.5], [-0.5, -0.5])}  # fmt: skip
    curves = [f"  {k}: {{type: line, from: {a}, to: {b}}}" for k, (a, b) in walls.items()]
    wall = f"type: point_on_curve, point: ball.c, side: left, radius: 0.0625, {BOUNCE}"
    contacts = [f"  w{k}: {{curve: {k}, {wall}}}" for k in walls]
    text = "\n".join([
        BALL, "curves:", *curves, "contacts:", *contacts,
        "  pin:", "    type: circle_on_circle", "    circles:",
        "      - {at: ball.centre, radius: 0.0625}",
        "      - {at: ground, place: [0.03125, 0.015625], radius: 0.125}", f"    {BOUNCE}",
        "initial:", "  positions: {ball: [-0.25, -0.25]}",
        "  velocities: {ball: [0.955336489125606, 0.29552020666133955]}",
        "run: {duration: 14}", "accuracy: {tolerance: 1.0e-6}",
    ])  # fmt: skip
    result = simulate(scene(text), measure=True)
    strikes = np.sort(np.concatenate([touches.begin for touches in result.intervals.values()]))
    assert strikes[2] < result.error.exceeds_from < 9.87


UPRIGHT = """
bodies: {rod: {type: rigid, mass: 1, inertia: 0.1, points: {foot: [-0.5, 0], tip: [0.5, 0]}}}
joints: {pin: {type: revolute, points: [ground, rod.foot], at: [0, 0]}}
gravity: 9.81
initial: {angles: {rod: 90 deg}}
run: {duration: 1}
accuracy: {tolerance: 1.0e-6}
"""


@pytest.mark.parametrize("tolerance", [1e-6, 1e-11])
def test_the_coarser_of_two_runs_is_the_one_that_starts_off(tolerance, monkeypatch):
    """Whichever is made first; a pendulum that stands upright does so in the result."""
    rooms, seeds = engines._loaded("exudyn"), {}
    run = rooms[0].run

    def noted(scene, progress, limits, *, seed):
        seeds[scene.accuracy.tolerance] = seed
        return run(scene, progress, limits, seed=seed)

    monkeypatch.setattr(rooms[0], "run", noted)
    upright = scene(UPRIGHT, f"accuracy.tolerance={tolerance}")
    result = simulate(upright, measure=True)
    assert [seeds[asked] for asked in sorted(seeds)] == [False, True]
    assert np.ptp(result.poses[:, 0, 2]) < 1e-14
    seeds.clear()
    measured(simulate(upright))
    assert seeds.pop(tolerance) is False
    assert list(seeds.values()) == [True]
