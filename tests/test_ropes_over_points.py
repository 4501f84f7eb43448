"""Ropes over points: closed forms, independent integrations, the same as ropes of two points."""

import numpy as np
import pytest
from physics_tools import alone, scene
from test_physics_impulse import balanced

import exudyn_flexlink as fl
from exudyn_flexlink.continuing import continued, joined
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.mechanism import build_mechanism
from exudyn_flexlink.plots.outline import drawn_lines
from exudyn_flexlink.source import SceneError

G = 9.81
HOIST = """
bodies:
  load: {{type: rigid, mass: {load}, inertia: 1, points: {{hook: [0, 0]}}}}
  weight: {{type: rigid, mass: {weight}, inertia: 1, points: {{c: [0, 0]}}}}
joints:
  down: {{type: prismatic, points: [ground, load.hook], at: [0, 0], axis: [0, -1]}}
  beside: {{type: prismatic, points: [ground, weight.c], at: [1, 0], axis: [0, -1]}}
springs:
  rope: {{type: rope, over: {over}, stiffness: 1.0e5, damping: 50}}
initial: {{along: {{down: 2, beside: 2}}}}
gravity: 9.81
run: {{duration: 0.5, sample: 0.01}}
accuracy: {{tolerance: 1.0e-9}}
"""
HOISTS = [
    (
        *(2, 3, "[load.hook, [0, 0], [1, 0], weight.c]"),
        *(42.49783587, (0.0001517836818, 0.0002646891212, 42.36479941)),
        (-0.2451087394, 0.2453441737, 23.54337328),
    ),
    (
        *(10, 6, "[[0, 0], load.hook, [0, 0], [1, 0], weight.c]"),
        *(95.30688268, (0.0002626043724, 0.000300586977, 86.30294561)),
        (-0.07194917664, 0.1444173528, 51.89715926),
    ),
    (
        *(12, 3.8, "[load.hook, [0, 0], load.hook, [0, 0], [1, 0], weight.c]"),
        *(69.25563715, (0.000176272105, 0.0001597337948, 68.70466401)),
        (0.01602089314, -0.04767537564, 38.73039884),
    ),
]


@pytest.mark.parametrize("hoist", HOISTS)
def test_n_parts_of_a_rope_carry_a_load_and_one_its_weight(hoist):
    """s'' = (n+1) g - T(n^2/M + 1/m) of the stretch s = n x + z, in closed form."""
    load, weight, over, largest, early, late = hoist
    result = alone(HOIST.format(load=load, weight=weight, over=over))
    for k, (x, z, tension) in ((np.searchsorted(result.time, 0.01 - 1e-9), early), (-1, late)):
        assert -2 - result.poses[k, :2, 1] == pytest.approx([x, z], abs=1e-9)
        assert result.contacts["rope"].force[k] == pytest.approx(tension, abs=1e-4)
    (pull,) = result.intervals["rope"]
    assert pull.begin == 0
    assert pull.peak_force == pytest.approx(largest, abs=1e-5)
    assert balanced(result)


WINCH = """
bodies:
  load: {{type: rigid, mass: 2, inertia: 0, points: {{c: [0, 0]}}}}
springs:
  rope: {{type: rope, over: [load.c, [0, 0], [0.5, 0]], stiffness: 2.0e4, damping: 50, {length}}}
gravity: 9.81
initial: {{positions: {{load: [{x!r}, {y!r}]}}, velocities: {{load: [{vx!r}, {vy!r}]}}}}
run: {{duration: {duration}, sample: 1}}
accuracy: {{tolerance: 1.0e-9}}
"""
WOUND = 'length: "2.0 m - 0.2 m/s * t"'
SWUNG = {"x": 1.5 * np.sin(0.3), "y": -1.5 * np.cos(0.3)}
SWUNG |= {"vx": -0.2 * np.sin(0.3), "vy": 0.2 * np.cos(0.3)}
SWUNG = {key: float(value) for key, value in SWUNG.items()}


def _polar(result, k):
    x, y = result.poses[k, 0, :2]
    away, angle = np.hypot(x, y), np.arctan2(x, -y)
    return away, angle, result.rates[k, 0, :2] @ [np.cos(angle), np.sin(angle)] / away


def test_a_winch_draws_a_swinging_load_to_its_eye():
    """Two integrations, in polar and cartesian coordinates; what the winch does is supplied."""
    result = alone(WINCH.format(length=WOUND, duration=4, **SWUNG))
    rows = np.searchsorted(result.time, [1 - 1e-9, 4 - 1e-9])
    first, last = (_polar(result, k) for k in rows)
    assert first == pytest.approx([1.300964616, -0.2980654022, -0.4473488], abs=2e-9)
    assert last == pytest.approx([0.7009554377, 0.4676565965, 1.046741097], abs=2e-9)
    tensions = result.contacts["rope"].force[rows]
    assert tensions == pytest.approx([19.27337256, 19.04177831], abs=2e-5)
    work = np.trapezoid(0.2 * result.contacts["rope"].force, result.time)
    assert result.energy.supplied[-1] == pytest.approx(work, rel=1e-4)
    assert balanced(result)


def test_a_run_with_a_winch_goes_on_as_if_it_had_not_ended():
    """It is continued before its rope, slack at first, catches the load."""
    later = 'length: "2.02 m - 0.2 m/s * t"'
    whole = alone(WINCH.format(length=later, duration=0.1, **SWUNG))
    part = alone(WINCH.format(length=later, duration=0.05, **SWUNG))
    both = joined(part, simulate(continued(part), measure=False))
    (catch,), (other,) = whole.intervals["rope"], both.intervals["rope"]
    assert catch.begin > 0.05
    assert other.begin == pytest.approx(catch.begin, abs=1e-9)
    assert _polar(both, -1) == pytest.approx(_polar(whole, -1), abs=1e-8)
    assert both.energy.supplied[-1] == pytest.approx(whole.energy.supplied[-1], abs=1e-6)


RING = """
bodies:
  ring: {type: rigid, mass: 3, inertia: 0, points: {eye: [0, 0]}}
springs:
  rope: {type: rope, over: [[-0.3, 0], ring.eye, [0.5, 0.1]], stiffness: 1.0e4, length: 1.2}
gravity: 9.81
initial: {at_rest: true, positions: {ring: [0.05, -0.4]}}
run: {duration: 0.1}
accuracy: {tolerance: 1.0e-10}
"""


def test_nothing_rests_on_a_winch_that_turns():
    text = RING.replace("length: 1.2", 'length: "1.2 m - 0.1 m/s * t"')
    with pytest.raises(SceneError, match=r"rope\.length: moves at -0\.1 m/s at first"):
        simulate(scene(text), measure=False)


def test_a_ring_on_a_rope_rests_where_both_pieces_lean_alike():
    """Its small motions are along the rope and, far faster, of its stretch."""
    result = alone(RING)
    assert result.poses[0, 0, :2] == pytest.approx([0.05541042598, -0.3985353457], abs=1e-9)
    assert result.contacts["rope"].force[0] == pytest.approx(19.71640905, rel=1e-8)
    assert 1.2 - result.contacts["rope"].gap[0] == pytest.approx(1.201971641, abs=1e-9)
    eigenvalues = fl.linearised(result, 0.0).eigenvalues
    turning = np.unique(np.abs(eigenvalues.imag).round(6))
    assert turning[-2:] == pytest.approx([3.512208755, 86.23597447], rel=1e-5)


THROWN = """
bodies:
  stone: {{type: rigid, mass: 1, inertia: 0, points: {{c: [0, 0]}}}}
springs:
  rope: {{type: rope, over: [stone.c, [0, 0], [2, 0]], stiffness: 1.0e3, length: {length!r}}}
gravity: 9.81
initial: {{positions: {{stone: [0, 0.5]}}, velocities: {{stone: [0, 3]}}}}
run: {{duration: 0.6, sample: 0.6}}
accuracy: {{tolerance: 1.0e-6}}
"""


def test_no_catch_is_stepped_over_however_long_a_step_is():
    """At the top of its flight, which one step may cover, a stone strains the rope by 1e-6 m."""
    top = 0.5 + 9 / (2 * G)
    result = alone(THROWN.format(length=2 + top - 1e-6))
    (catch,) = result.intervals["rope"]
    lasts = np.sqrt(2e-6 / G)
    assert catch.begin == pytest.approx(3 / G - lasts, abs=1e-9)
    assert catch.end - catch.begin == pytest.approx(2 * lasts, rel=1e-3)
    assert len(alone(THROWN.format(length=2 + top + 1e-9)).intervals["rope"]) == 0


def test_a_run_ends_where_a_load_is_drawn_into_its_eye():
    """The rope is longer by m g/k, and 0.5 m of it are beyond the eye."""
    at = {"x": 0.0, "y": -0.5, "vx": 0.0, "vy": 0.5}
    length = 'length: "1 m - 0.5 m/s * t"'
    result = simulate(scene(WINCH.format(length=length, duration=1.5, **at)), measure=False)
    assert not result.outcome.completed
    assert result.outcome.time == pytest.approx(1 + 2 * G / 2e4 / 0.5, abs=1e-5)
    assert result.outcome.reason == "a piece of the rope 'rope' has shrunk to length 0"


FALL = """
bodies:
  man: {{type: rigid, mass: 70, inertia: 1, points: {{c: [0, 0]}}}}
springs:
  rope: {{{rope}, stiffness: 1500, damping: 120, length: 12}}
gravity: 9.81
initial: {{positions: {{man: [0.2, 0]}}, velocities: {{man: [0, 0]}}}}
run: {{duration: 4, sample: 0.5}}
accuracy: {{tolerance: 1.0e-10}}
"""


def test_a_rope_over_two_points_is_a_spring_that_only_pulls():
    over = alone(FALL.format(rope="type: rope, over: [[0, 0], man.c]"))
    pulled = "type: linear, points: [ground, man.c], at: [0, 0], acts: tension"
    spring = alone(FALL.format(rope=pulled))
    assert over.poses[-1] == pytest.approx(spring.poses[-1], abs=1e-8)
    both = zip(over.intervals["rope"], spring.intervals["rope"], strict=True)
    for touch, other in both:
        for name in ("begin", "end", "peak_force", "penetration", "impulse", "energy_lost"):
            value = getattr(other, name)
            assert getattr(touch, name) == pytest.approx(value, rel=1e-7, abs=1e-7)


SHEAVE = """
bodies:
  load: {type: rigid, mass: 2, inertia: 1, points: {c: [0, 0]}}
  sheave: {type: rigid, mass: 0.1, inertia: 1e-4, points: {axle: [0, 0], stay: [0.1, 0]}}
joints:
  down: {type: prismatic, points: [ground, load.c], at: [0, 0], axis: [0, -1]}
  axle: {type: revolute, points: [ground, sheave.axle], at: [0, 1]}
springs:
  rope: {type: rope, over: [load.c, sheave.axle, [1, 1]], stiffness: 1.0e5, damping: 300}
initial: {along: {down: 0}}
gravity: 9.81
run: {duration: 2, sample: 1}
accuracy: {tolerance: 1.0e-9}
"""


def test_a_pulley_bears_both_pieces_of_its_rope():
    result = alone(SHEAVE)
    tension = 2 * G
    wanted = [-tension, tension + 0.1 * G]
    assert result.joint_forces["axle"][-1] == pytest.approx(wanted, abs=1e-4)


def test_a_rope_over_points_is_drawn_through_all_of_them():
    own = scene(HOIST.format(load=10, weight=6, over=HOISTS[1][2]))
    (line,) = (line for line in drawn_lines(own, build_mechanism(own)) if line.kind == "rope")
    assert len(line.line.at(np.zeros((2, 3)))) == 5


PULSED = """
bodies: {load: {type: rigid, mass: 2, inertia: 0.1, points: {hook: [0, 0]}}}
springs:
  rope: {type: rope, over: [load.hook, [0, 1]], stiffness: 500,
         length: "1 m + 0.05 m * sin(5 rad/s * t)"}
initial: {positions: {load: [0, -0.05]}}
gravity: 9.81
run: {duration: 0.3}
accuracy: {tolerance: 1.0e-8}
"""


def test_a_taut_rope_that_a_winch_moves_loses_nothing_up_to_the_end():
    """What it stores then follows from its length at that instant."""
    result = alone(PULSED)
    touches = result.contacts["rope"].touches
    assert touches.end[-1] == np.inf
    assert touches.energy_lost == pytest.approx(0, abs=1e-9)


def test_a_stage_begins_beside_a_taut_rope_that_a_winch_moves():
    stages = "stages=[{until: t - 0.1 s, set: {gravity: 9.81}}]"
    whole, staged = alone(PULSED), alone(PULSED, stages)
    assert staged.poses[-1] == pytest.approx(whole.poses[-1], abs=1e-8)
    assert len(staged.contacts["rope"].touches) == len(whole.contacts["rope"].touches)
