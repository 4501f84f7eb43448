"""Constraints and their Jacobians against differences of positions, at random states."""

import numpy as np
import pytest

from exudyn_flexlink.mechanism import (
    approach,
    build_mechanism,
)
from exudyn_flexlink.mechanism.constraints import (
    anchor_jacobian,
    anchor_position,
    anchor_velocity,
    constraint_rows,
    places_near,
)
from exudyn_flexlink.mechanism.joints import GROUND, Anchor
from exudyn_flexlink.scene import parse_scene
from exudyn_flexlink.source import parse_document

EVERYTHING = """title: one of every joint
materials:
  steel: {density: 7850, youngs_modulus: 200 GPa}
curves:
  ellipse: {type: ellipse, centre: [0.1, 0], semi_axes: [0.4, 0.3], rotation: 20 deg}
  spline: {type: spline, points: [[0.5, 0], [0, 0.4], [-0.5, 0.1], [0, -0.6]]}
  egg:
    type: joined
    pieces:
      - {type: ellipse, centre: [0, 0], semi_axes: [0.4, 0.3], from: -90 deg, to: 90 deg}
      - {type: circle, centre: [0, 0], radius: 0.3, from: 90 deg, to: 270 deg}
bodies:
  guide: {type: rod, length: 0.2, material: steel, section: {width: 10 mm, thickness: 2 mm}}
  link:
    {type: flexible, length: 0.3, material: steel, section: {width: 10 mm, thickness: 2 mm},
     rods: 3, hinges: {stiffness: beam}}
  plate: {type: rigid, mass: 1, inertia: 0.1, points: {a: [0.1, 0.2], b: [-0.3, 0.1]},
          centre_of_mass: [0.02, -0.03]}
  arm: {type: rod, length: 0.2, material: steel, section: {width: 10 mm, thickness: 2 mm}}
joints:
  crank: {type: revolute, points: [ground, guide.start], at: [0.02, 0.01]}
  knee: {type: revolute, points: [plate.a, arm.start]}
  back: {type: revolute, points: [arm.end, ground], at: [0.5, 0]}
  foot: {type: weld, points: [link.end, plate.b], angle: 30 deg}
  floor: {type: weld, points: [ground, plate.centre], at: [0.3, 0.4], angle: -50 deg}
  sleeve: {type: sleeve, guide: guide, link: link}
  on_ellipse: {type: slot, point: link.start, curve: ellipse}
  on_spline: {type: slot, point: plate.a, curve: spline}
  on_egg: {type: slot, point: arm.centre, curve: egg}
drives:
  turn: {type: speed, joint: crank, value: 3}
  fold: {type: speed, joint: knee, value: 2}
  pull: {type: speed, joint: back, value: 1}
contacts:
  strike:
    {type: point_on_line, point: arm.end, line: [plate.a, plate.b], side: right,
     law: {stiffness: 1.0e4, restitution: 0.5}}
run: {duration: 1}
accuracy: {tolerance: 1.0e-5}
"""
SEEDS = range(2)


@pytest.fixture(scope="module")
def mechanism():
    # As a whole it can't be assembled: it only has to have every joint once.
    return build_mechanism(parse_scene(parse_document(EVERYTHING, "test")))


def random_state(mechanism, seed):
    random = np.random.default_rng(seed)
    shape = (len(mechanism.parts), 3)
    return random.uniform(-1, 1, shape) * (0.3, 0.3, 3.0), random.uniform(-1, 1, shape)


def feet(mechanism, q):
    return np.array(
        [slot.curve.nearest(anchor_position(slot.anchor, q)) for slot in mechanism.slots]
    )


def rows_at(mechanism, q, near):
    """Constraints with every slot at the foot point of its own anchor: residuals as they are."""
    places = places_near(mechanism, q, near)
    return constraint_rows(mechanism, q, places)


@pytest.mark.parametrize("seed", SEEDS)
def test_every_jacobian_is_the_derivative_of_its_residual(mechanism, seed):
    q, _ = random_state(mechanism, seed)
    near = feet(mechanism, q)
    rows = rows_at(mechanism, q, near)
    assert set(rows.kinds) == {"revolute", "weld", "slide", "slot", "drive"}
    jacobian = rows.jacobian()
    step = 1e-6
    for column in range(q.size):
        change = np.zeros(q.size)
        change[column] = step
        ahead = rows_at(mechanism, q + change.reshape(q.shape), near)
        behind = rows_at(mechanism, q - change.reshape(q.shape), near)
        slope = (ahead.residual - behind.residual) / (2 * step)
        assert jacobian[:, column] == pytest.approx(slope, abs=2e-8)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("part", [0, 4, GROUND])
def test_velocities_of_anchors_are_derivatives(mechanism, seed, part):
    anchor = Anchor(part, 0.13, -0.07)
    q, v = random_state(mechanism, seed)
    step = 1e-6
    slope = (anchor_position(anchor, q + step * v) - anchor_position(anchor, q - step * v)) / (
        2 * step
    )
    assert anchor_velocity(anchor, q, v) == pytest.approx(slope, abs=1e-9)
    assert anchor_jacobian(anchor, q) @ v.ravel() == pytest.approx(slope, abs=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_rates_of_a_contact_are_derivatives(mechanism, seed):
    (contact,) = mechanism.contacts
    q, v = random_state(mechanism, seed)
    step = 1e-6
    here = approach(contact, q, v, 0.0)
    ahead, behind = (approach(contact, q + dt * v, v, 0.0) for dt in (step, -step))
    assert here.gap_rate == pytest.approx((ahead.gap - behind.gap) / (2 * step), abs=1e-8)
    assert here.slip == pytest.approx((ahead.place - behind.place) / (2 * step), abs=1e-8)
    assert np.hypot(*here.normal) == pytest.approx(1, abs=1e-14)
