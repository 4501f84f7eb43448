"""Impulses that joints bear in impacts: closed forms of the centre of percussion, and of chains."""

from math import cos, sin

import numpy as np
import pytest
from physics_tools import FLOOR, TRAMMEL, alone

from exudyn_flexlink.continuing import continued, joined
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.scene import Run
from exudyn_flexlink.storage import load, save

LENGTH, MASS, RESTITUTION = 1.2, 3.0, 0.5
LAW = f"{{type: impulse, restitution: {RESTITUTION}}}"

# A rod that swings about its upper end; a wall meets it so far below, and may rub.
SWING = """
curves: {{wall: {{type: line, from: [{wall}, 5], to: [{wall}, -5]}}}}
bodies:
  rod: {{type: rigid, mass: {mass}, inertia: {inertia}, centre_of_mass: [{half}, 0],
        points: {{top: [0, 0], hit: [{at}, 0]}}}}
joints:
  pivot: {{type: revolute, points: [ground, rod.top], at: [0, 0]}}
contacts:
  meet: {{type: point_on_curve, point: rod.hit, curve: wall, law: {law}}}
initial: {{angles: {{rod: {start}}}, speeds: {{rod: -1.5}}}}
gravity: [0, -9.81]
run: {{duration: 0.3}}
accuracy: {{tolerance: 1.0e-8}}
"""


def swing(at, angle=-1.5707963267948966, **more):
    given = {"mass": MASS, "inertia": MASS * LENGTH**2 / 12, "half": LENGTH / 2, "law": LAW}
    wall = at * cos(angle)
    return SWING.format(**given | {"at": at, "wall": wall, "start": angle + 0.2} | more)


@pytest.mark.parametrize("part", [0.4, 2 / 3, 1.0])
def test_a_rod_struck_at_its_centre_of_percussion_does_not_push_its_pivot(part):
    """I w = J d gives the rod's jump; its centre's momentum is J and the pivot's impulse."""
    result = alone(swing(part * LENGTH))
    (hit,) = (touch for touch in result.intervals["meet"] if touch.impact)
    (time,), (impulse,) = (
        getattr(result.joint_impulses["pivot"], name) for name in ("time", "impulse")
    )
    assert time == hit.begin
    pushed = hit.impulse * (1.5 * part - 1)  # m (L/2) (J d/I) - J, I = m L^2/3
    assert impulse == pytest.approx([pushed, 0], abs=1e-8 * hit.impulse)


def test_friction_pushes_the_pivot_along_the_rod():
    """At an angle the wall's normal and its friction, along x and y, both turn the rod."""
    law, angle = f"{{type: impulse, restitution: {RESTITUTION}, friction: 0.2}}", -1.0
    result = alone(swing(LENGTH, angle, law=law))
    (hit,) = (touch for touch in result.intervals["meet"] if touch.impact)
    along, across = np.array([cos(angle), sin(angle)]), np.array([-sin(angle), cos(angle)])
    blow = np.array([hit.impulse, -hit.tangential_impulse])  # places grow downwards
    assert blow[1] > 0
    momentum = MASS * LENGTH / 2 * (LENGTH * across @ blow) / (MASS * LENGTH**2 / 3)
    (impulse,) = result.joint_impulses["pivot"].impulse
    assert impulse == pytest.approx(momentum * across - blow, rel=1e-7)
    assert impulse @ along == pytest.approx(-blow @ along)


# A chain of two rods of 1 m straight across, whose end falls on the floor.
CHAIN = f"""
bodies:
  one: {{type: rigid, mass: 1, inertia: {1 / 12}, centre_of_mass: [0.5, 0],
        points: {{a: [0, 0], b: [1, 0]}}}}
  two: {{type: rigid, mass: 2, inertia: {2 / 12}, centre_of_mass: [0.5, 0],
        points: {{a: [0, 0], b: [1, 0]}}}}
{FLOOR}
  pivot: {{type: revolute, points: [ground, one.a], at: [0, 0]}}
  hinge: {{type: revolute, points: [one.b, two.a]}}
contacts:
  stop: {{type: point_on_line, point: two.b, line: [floor.a, floor.b], law: {LAW}}}
initial: {{angles: {{one: 0.2, two: 0.2}}, speeds: {{one: -1, two: -1}}}}
run: {{duration: 0.3}}
accuracy: {{tolerance: 1.0e-9}}
"""


def test_a_chain_passes_a_blow_on():
    """Momentum and its moment about the centre of each rod; the end leaves with e of its speed."""
    result = alone(CHAIN)
    first, second, (a, b) = 1.0, 2.0, (1 / 12, 2 / 12)
    # Unknown: jumps of both speeds, impulses upwards at the end, in the hinge, in the pivot.
    balance = np.array(
        [
            [second, second / 2, -1, -1, 0],
            [0, b, -0.5, 0.5, 0],
            [first / 2, 0, 0, 1, -1],
            [a, 0, 0, 0.5, 0.5],
            [1, 1, 0, 0, 0],
        ]
    )
    speed = (1 + RESTITUTION) * 2.0
    *_, blow, in_hinge, in_pivot = np.linalg.solve(balance, [0, 0, 0, 0, speed])
    assert result.intervals["stop"].impulse[0] == pytest.approx(blow, rel=1e-8)
    for name, impulse in (("hinge", in_hinge), ("pivot", in_pivot)):
        jumps = result.joint_impulses[name]
        assert jumps.impulse[0] == pytest.approx([0, impulse], abs=1e-7)
        assert jumps.size[0] == pytest.approx(abs(impulse), rel=1e-8)
    assert result.joint_impulses["ground"].impulse[0] == pytest.approx([0, blow])


def test_what_closes_a_loop_and_guides_bear_the_blow_of_a_stop():
    """A beam on two slides that cross: momentum of each body, and its moment about the beam's."""
    stop = "at: [0, 0], axis: [0, 1], limits: {from: 0.2, law: {type: impulse, restitution: 0.5}}}"
    text = TRAMMEL.replace("at: [0, 0], axis: [0, 1]}", stop)
    text += "initial: {angles: {beam: 2.2}, speeds: {beam: 2}}\nrun: {duration: 0.5}\n"
    result = alone(text)
    (hit,) = result.intervals["y.from"]
    impulses = {name: jumps.impulse[0] for name, jumps in result.joint_impulses.items()}
    after = int(np.searchsorted(result.time, hit.begin))
    after += int(result.time[after] == result.time[after - 1])
    (a, b, beam), angle = result.rates[after] - result.rates[after - 1], result.poses[after, 2, 2]
    blow = np.array([0, hit.impulse])
    assert a[:2] == pytest.approx(impulses["x"] - impulses["sa"], abs=1e-6)
    assert b[:2] == pytest.approx(impulses["y"] + impulses["sb"] + blow, abs=1e-6)
    arm = 0.25 * np.array([cos(angle), sin(angle)])
    centre = beam[:2] + beam[2] * np.array([-arm[1], arm[0]])
    assert 2 * centre == pytest.approx(impulses["sa"] - impulses["sb"], abs=1e-6)
    both = impulses["sa"] + impulses["sb"]
    assert 0.1 * beam[2] == pytest.approx(arm[1] * both[0] - arm[0] * both[1], abs=1e-6)


def test_impulses_outlive_a_file_and_a_run_that_goes_on(tmp_path):
    text = swing(LENGTH).replace("duration: 0.3", "duration: 0.1")
    first = alone(text)
    assert not first.joint_impulses
    second = simulate(continued(first).changed(run=Run(duration=0.2)))
    whole = joined(first, second)
    (hit,) = (touch for touch in whole.intervals["meet"] if touch.impact)
    assert whole.joint_impulses["pivot"].time == pytest.approx([hit.begin])
    save(whole, tmp_path)
    kept = load(tmp_path).joint_impulses["pivot"]
    np.testing.assert_array_equal(kept.impulse, whole.joint_impulses["pivot"].impulse)
    head, row = (tmp_path / "joint_impulses.csv").read_text().splitlines()
    assert head == "t_s,pivot.impulse_x_N_s,pivot.impulse_y_N_s,pivot.impulse_N_s"
    assert float(row.split(",")[-1]) == pytest.approx(kept.size[0], rel=1e-6)
