"""Laws of nature in a guide with clearance: momentum, friction, the four cases, walls that hold."""

import numpy as np
import pytest
from physics_tools import MODELS, scene, velocity, where

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.mechanism import build_mechanism
from exudyn_flexlink.observables import State, contact_states, separation

FREE = """
materials: {{steel: {{density: 7850, youngs_modulus: 200 GPa}}}}
bodies:
  guide: {{type: rod, length: 0.09, material: steel, section: {{width: 20 mm, thickness: 12 mm}}}}
  link: {{type: flexible, length: 0.07, material: steel, rods: 3,
         section: {{width: 10 mm, thickness: 0.5 mm}},
         hinges: {{stiffness: paper, damping: 2.0e-5}}}}
joints:
  crank: {{type: revolute, points: [ground, guide.start], at: [0.02, 0]}}
  sleeve: {{type: sleeve, guide: guide, link: link, clearance: 2 mm,
           law: {{stiffness: 1.0e5, restitution: 0.5, friction: {friction}}}}}
initial: {{speeds: {{guide: 10, link: 14}}, velocities: {{link: [0.1, 0.05]}}}}
run: {{duration: 0.1}}
accuracy: {{tolerance: 4.0e-5}}
"""

BLOCK = """
materials: {{steel: {{density: 7850, youngs_modulus: 200 GPa}}}}
bodies:
  guide: {{type: rod, length: 1.0, material: steel, section: {{width: 20 mm, thickness: 12 mm}}}}
  block: {{type: rod, length: 0.1, material: steel, section: {{width: 20 mm, thickness: 10 mm}}}}
joints:
  hold: {{type: weld, points: [ground, guide.start], at: [0, 0]}}
  sleeve: {{type: sleeve, guide: guide, link: block, clearance: {clearance},
           law: {{stiffness: 1.0e6, restitution: 0.3, friction: {friction}}}}}
gravity: [0, -{gravity}]
initial: {initial}
run: {{duration: {duration}, sample: 0.5 ms}}
accuracy: {{tolerance: 1.0e-5}}
"""


def angular_momentum(result, about):
    """Of all parts (N,), from their masses, places and speeds."""
    total = np.zeros(len(result.time))
    q, v = result.poses, result.rates
    for i, part in enumerate(build_mechanism(result.scene).parts):
        c, s = np.cos(q[:, i, 2]), np.sin(q[:, i, 2])
        rx = c * part.centre[0] - s * part.centre[1]
        ry = s * part.centre[0] + c * part.centre[1]
        x, y = q[:, i, 0] + rx - about[0], q[:, i, 1] + ry - about[1]
        vx, vy = v[:, i, 0] - v[:, i, 2] * ry, v[:, i, 1] + v[:, i, 2] * rx
        total += part.mass * (x * vy - y * vx) + part.inertia * v[:, i, 2]
    return total


@pytest.mark.parametrize("friction", [0, 0.2])
def test_contact_inside_keeps_angular_momentum(friction):
    """Guide on a frictionless pin and link: what one wall gives, the other body loses."""
    result = simulate(scene(FREE.format(friction=friction)))
    assert result.outcome.completed
    assert len(result.sleeves["sleeve"].touches.begin) > 20
    momentum = angular_momentum(result, (0.02, 0.0))
    assert np.abs(momentum / momentum[0] - 1).max() < 1e-6


def test_a_sliding_block_stops_where_coulomb_says():
    """v0^2/(2 mu g) = 0.2548 m, after v0/(mu g) = 0.5097 s; it has 0.01 mm to fall first."""
    text = BLOCK.format(
        clearance="0.01 mm", friction=0.2, gravity=9.81, duration=0.6,
        initial="{velocities: {block: [1.0, 0]}}",
    )  # fmt: skip
    result = simulate(scene(text))
    assert result.outcome.completed
    assert where(result, "block.start")[-1, 0] == pytest.approx(1 / (2 * 0.2 * 9.81), rel=1e-2)
    late = result.time > 0.52
    assert np.abs(velocity(result, "block.start")[late, 0]).max() < 1e-3
    halfway = np.searchsorted(result.time, 0.25)
    assert velocity(result, "block.start")[halfway, 0] == pytest.approx(
        1 - 0.2 * 9.81 * result.time[halfway], rel=1e-2
    )


def test_the_four_cases_of_flores():
    """A block that spins hits both walls; it tumbles on, touches with one corner, and lies down."""
    text = BLOCK.format(
        clearance="1 mm", friction=0, gravity=0.5, duration=0.5,
        initial="{speeds: {block: 2}, velocities: {block: [0.2, -0.1]}}",
    )  # fmt: skip
    result = simulate(scene(text))
    states = contact_states(result, "sleeve")
    assert set(states.state.tolist()) == set(State)
    assert states.state[0] == State.FREE
    # Both ends move at 0.1 m/s and gravity breaks the tie: the lower one first, both soon after.
    assert states.state[1:3].tolist() == [State.ONE_POINT, State.OPPOSITE_SIDES]
    assert states.time[1] == pytest.approx(0.01, abs=3e-4)
    assert states.state[-1] == State.SAME_SIDE  # it lies on the lower wall at last
    # Lying, it presses with its weight on the two nodes.
    weight = 7850 * 2e-4 * 0.1 * 0.5
    assert result.sleeves["sleeve"].force[-1].sum() == pytest.approx(weight, rel=1e-3)
    assert states.fractions(0.4, 0.5)[State.SAME_SIDE] == pytest.approx(1)


@pytest.mark.parametrize("engine", ["exudyn", "lagrangian"])
def test_soft_walls_are_warned_of_and_too_soft_ones_stop_the_run(engine):
    settings = ["bodies.link.rods=3", "joints.sleeve.clearance=0.1 mm", "run.turns=0.45"]
    law = "joints.sleeve.law.stiffness"
    soft = simulate(load_scene(MODELS / "clearance.yaml", [*settings, f"{law}=2000"]), engine)
    assert any("depends on their stiffness there" in warning for warning in soft.warnings)
    broken = simulate(load_scene(MODELS / "clearance.yaml", [*settings, f"{law}=5"]), engine)
    assert not broken.outcome.completed
    assert broken.outcome.reason == "the link broke through a wall of 'sleeve'"
    assert "stiffness" in broken.outcome.advice
    assert 0 < broken.time[-1] < soft.time[-1]


def test_a_closing_clearance_tends_to_the_supported_link():
    """S of 0.5 mm and of 0.05 mm, before the strike, against rods held on the axis."""
    common = ["bodies.link.rods=4", "run={duration: 0.15, sample: 1 ms}"]
    ends = {}
    for clearance in (5e-4, 5e-5):
        settings = [*common, f"joints.sleeve.clearance={clearance}"]
        ends[clearance] = simulate(load_scene(MODELS / "clearance.yaml", settings))
    held = simulate(load_scene(MODELS / "supported.yaml", common))
    times = np.arange(0, 0.15, 1e-3)

    def end(result):
        at = np.searchsorted(result.time, times - 1e-9)
        return where(result, "link.end")[at]

    wide, narrow = (np.linalg.norm(end(ends[c]) - end(held), axis=1).max() for c in (5e-4, 5e-5))
    assert narrow < 0.25 * wide
    assert wide < 3.5 * 5e-4


def test_the_link_stays_in_its_guide_at_high_speed():
    """Walls give way as deep in both engines."""
    settings = ["bodies.link.rods=2", "drives.motor.value=100", "run.turns=1"]
    scene = load_scene(MODELS / "clearance.yaml", [*settings, "accuracy.tolerance=1e-7"])
    one, other = (simulate(scene, engine) for engine in ("exudyn", "lagrangian"))
    assert one.outcome.completed
    assert other.outcome.completed
    deepest = one.sleeves["sleeve"].deepest
    assert 1e-4 < deepest == pytest.approx(other.sleeves["sleeve"].deepest, abs=1e-11)


def test_what_is_zero_by_rounding_is_no_touch():
    """Held on its axis the link leaves no wall, but rounding has its gap on either side of zero."""
    settings = [
        "drives.motor.value=57.26",
        "run.turns=12",
        "bodies.link.rods=1",
        "joints.sleeve.law={stiffness: 6.693e+05, restitution: 1, friction: 0.3}",
    ]

    def to(tolerance, engine="exudyn"):
        own = [*settings, f"accuracy.tolerance={tolerance}"]
        return simulate(load_scene(MODELS / "supported.yaml", own), engine)

    exact = to(1e-8, "lagrangian")
    times = np.linspace(0, exact.time[-1], 2001)
    for tolerance in (1e-4, 1e-6):
        found = to(tolerance)
        assert found.outcome.completed
        assert separation(found, exact, times, ["link.end"]).max() < tolerance
