"""Gaps of points on curves: their rates, slopes and bends against the curve's and differences."""

from dataclasses import replace

import numpy as np
import pytest
from test_physics_tools import scene

from exudyn_flexlink.engines.exudyn.minimal.contacts import PenaltyContact, RigidContact
from exudyn_flexlink.laws import Impulse
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.mechanism import approach
from exudyn_flexlink.mechanism.tree import tree_layout

SHAPES = {
    "ellipse": "type: ellipse, centre: [0.1, 0], semi_axes: [0.5, 0.2], rotation: 20 deg",
    "spline": "type: spline, points: [[0.5, 0], [0, 0.4], [-0.4, 0.2], [-0.2, -0.4], [0.3, -0.3]]",
    "open": "type: ellipse, centre: [0, 0], semi_axes: [0.5, 0.3], from: 10 deg, to: 350 deg",
}
MOVING = """
curves: {{way: {{{shape}, on: plate}}}}
bodies:
  bead: {{type: rigid, mass: 1, inertia: 1.0e-3, points: {{c: [0.01, 0.02]}}}}
  plate: {{type: rigid, mass: 1, inertia: 1.0e-2, points: {{hub: [0, 0]}}}}
contacts:
  way:
    type: point_on_curve
    point: bead.c
    curve: way
    side: {side}
    radius: 0.02
    law: {{stiffness: 1.0e4, restitution: 1}}
initial: {{positions: {{bead: [0.05, 0.1], plate: [0, 0]}}, angles: {{bead: 0, plate: 0}}}}
run: {{duration: 1}}
accuracy: {{tolerance: 1.0e-6}}
"""


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("held", [False, True])
def test_gap_place_and_their_rates_are_those_of_the_curve(shape, held):
    """Both ways that know them agree, rates are derivatives, also the curve's second one."""
    assembly = assemble_scene(scene(MOVING.format(shape=SHAPES[shape], side="left")))
    (own,) = assembly.mechanism.contacts
    layout = tree_layout(assembly.mechanism)
    contact = PenaltyContact(layout, own, own.law)
    rng = np.random.default_rng(3)
    x, v = rng.normal(scale=0.1, size=6), rng.normal(size=6)
    if held:
        contact.follow(x, presses=True)
    h = 1e-6
    seen = [contact.touch(x + by * v, v) for by in (-h, 0.0, h)]
    assert seen[1].gap_rate == pytest.approx((seen[2].gap - seen[0].gap) / (2 * h), abs=1e-8)
    q, rate = poses(layout, x), poses(layout, v)
    at = approach(own, q, rate)
    for mine, other in (
        (seen[1].gap, at.gap),
        (seen[1].place, at.place),
        (seen[1].gap_rate, at.gap_rate),
        (seen[1].slip, at.slip),
    ):
        assert mine == pytest.approx(float(other), abs=1e-12)
    assert contact.gradient(x, v) @ v == pytest.approx(seen[1].gap_rate, abs=1e-12)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_gap_bends_with_the_motion_of_point_and_curve(shape):
    """Where no coordinate of the tree accelerates: the derivative of its rate."""
    assembly = assemble_scene(scene(MOVING.format(shape=SHAPES[shape], side="left")))
    own = replace(assembly.mechanism.contacts[0], law=Impulse(0.5))
    contact = RigidContact(tree_layout(assembly.mechanism), own, own.law)
    rng = np.random.default_rng(3)
    x, v, h = rng.normal(scale=0.1, size=6), rng.normal(size=6), 1e-5
    rates = [contact.touch(x + by * v, v).gap_rate for by in (-h, h)]
    bend = (rates[1] - rates[0]) / (2 * h)
    assert contact.moving_gap(x, v)[2] == pytest.approx(bend, rel=1e-6)


def poses(layout, x):
    """Coordinates (parts, 3) of two free bodies, which the tree has in another order."""
    found = np.zeros((2, 3))
    for part in range(2):
        last = layout.frames[part].link
        links = layout.path(last)
        for i, axis in zip(links, (0, 1, 2), strict=True):
            found[part, axis] = x[i]
    return found
