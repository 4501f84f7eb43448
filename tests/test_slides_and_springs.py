"""What the rest of the program says and does with prismatic joints and linear springs."""

import pytest
from results import scene_from

from exudyn_flexlink.effects import idealise
from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.observables import force_deviations
from exudyn_flexlink.report import check_text

SPRUNG = """title: a buffer that a block strikes
bodies:
  block: {type: rigid, mass: 1, inertia: 1, points: {b: [0, 0]}}
  buffer: {type: rigid, mass: 1, inertia: 1, points: {p: [0, 0], low: [0, -1], high: [0, 1]}}
joints:
  way: {type: prismatic, points: [ground, block.b], at: [0, 0], axis: [1, 0.5]}
  stop: {type: prismatic, points: [ground, buffer.p], at: [1, 0.5], axis: [1, 0.5]}
springs:
  hold: {type: linear, joint: stop, stiffness: 100, damping: 3}
  pull: {type: linear, points: [ground, block.b], at: [-1, 0], stiffness: 20, length: 0.5}
contacts:
  strike: {type: point_on_line, point: block.b, line: [buffer.low, buffer.high],
           law: {stiffness: 1.0e4, restitution: 0.5}}
initial: {velocities: {block: [2, 1]}}
run: {duration: 0.2}
accuracy: {tolerance: 1.0e-6}
"""


@pytest.fixture(scope="module")
def scene():
    return scene_from(SPRUNG)


def test_forces_of_slides_and_springs_have_errors_that_bound_the_true_ones(scene):
    run = simulate(scene, measure=True)
    tight = scene.changed(accuracy=type(scene.accuracy).model_validate({"tolerance": 1e-10}))
    true = force_deviations(run, simulate(tight, measure=False))
    told = run.error.forces
    ours = {f"joint force of {name}" for name in ("way", "stop")}
    ours |= {f"spring force of {name}" for name in ("hold", "pull")}
    assert set(told) == ours | {"contact force of strike"}
    for name in ours:
        off, bound = true[name].free, told[name].free
        assert off is not None
        assert bound is not None
        assert off.largest <= bound.largest <= 1e-3 * bound.size


def test_check_names_ways_and_springs(scene):
    lines = [
        " ".join(line.split()) for line in check_text(scene, assemble_scene(scene)).split("\n")
    ]
    assert "way prismatic ground and block.b at (0, 0) m along (1, 0.5)" in lines
    assert "hold along stop k 100 N/m c 3 N s/m" in lines
    assert "pull between ground and block.b at (-1, 0) m k 20 N/m no damper" in lines
    assert "damping simulated hold" in lines


def test_a_buffer_that_a_spring_ties_to_another_body_stays(scene):
    tie = "  tie: {type: linear, points: [block.b, buffer.p], stiffness: 1}\ncontacts:"
    tied = idealise(scene_from(SPRUNG.replace("contacts:", tie)), ["impact"])
    assert list(tied.bodies) == ["block", "buffer"]
