"""What can touch in a sleeve: numbers, gaps against hand computation, rates against differences."""

import numpy as np
import pytest
from cli_runs import MODELS

from exudyn_flexlink.loading import assemble_scene, load_scene, scene_of
from exudyn_flexlink.mechanism import approach
from exudyn_flexlink.source import parse_document


def assembled(*settings, model="clearance.yaml"):
    return assemble_scene(load_scene(MODELS / model, settings))


@pytest.mark.parametrize("model", ["clearance.yaml", "supported.yaml"])
def test_rates_are_those_of_the_gaps(model):
    assembly = assembled("bodies.link.rods=3", model=model)
    random = np.random.default_rng(2)
    q = assembly.state.q + random.uniform(-0.02, 0.02, assembly.state.q.shape)
    v = random.uniform(-1, 1, q.shape)
    h = 1e-6
    for contact in assembly.mechanism.channels[0].contacts:
        ahead, behind = approach(contact, q + h * v, v, 0.0), approach(contact, q - h * v, v, 0.0)
        at = approach(contact, q, v, 0.0)
        assert at.gap_rate == pytest.approx((ahead.gap - behind.gap) / (2 * h), abs=1e-8)
        assert at.slip == pytest.approx((ahead.place - behind.place) / (2 * h), abs=1e-8)


# --- geometry ---------------------------------------------------------------------------------

OFFSET = """title: a rod in a channel of a rigid body that starts beside the body's origin
materials:
  steel: {density: 7850, youngs_modulus: 200 GPa}
bodies:
  box: {type: rigid, mass: 1, inertia: 1, points: {start: [-0.1, 0.02], end: [0.2, 0.02]}}
  rod: {type: rod, length: 0.4, material: steel, section: {width: 10 mm, thickness: 2 mm}}
joints:
  pin: {type: revolute, points: [ground, box.centre], at: [0, 0]}
  sleeve: {type: sleeve, guide: box, link: rod, clearance: 10 mm,
           law: {stiffness: 1.0e5, restitution: 0.5}}
run: {duration: 0.1}
accuracy: {tolerance: 1.0e-4}
"""


def placed(rod, box=(0.0, 0.0, 0.0)):
    """Pairs of the rod in the box, by name, at a pose of the rod in the box's axes."""
    mechanism = assemble_scene(scene_of(parse_document(OFFSET, "test"))).mechanism
    x, y, turned = box
    c, s = np.cos(turned), np.sin(turned)
    q = np.array([box, [x + c * rod[0] - s * rod[1], y + s * rod[0] + c * rod[1], rod[2] + turned]])
    (channel,) = mechanism.channels
    return {
        p.name.removeprefix("sleeve: "): approach(p, q, np.zeros_like(q), 0.0)
        for p in channel.contacts
    }


def test_a_rod_that_is_moved_to_a_side_is_nearer_to_the_walls_of_that_side():
    (channel,) = assemble_scene(scene_of(parse_document(OFFSET, "test"))).mechanism.channels
    gaps = np.array([float(at.gap) for at in placed((-0.05, 0.025, 0.0)).values()])  # 5 mm up
    assert gaps[np.array(channel.sides) > 0] == pytest.approx(0.005)
    assert gaps[np.array(channel.sides) < 0] == pytest.approx(0.015)


@pytest.mark.parametrize("box", [(0, 0, 0), (1, 2, -3.0)])
def test_gaps_and_places_are_those_of_the_guides_axes(box):
    touch = placed((0.0, 0.023, 0.0), box)
    # 3 mm above the axis y = 0.02, 0.1 m behind the mouth at x = -0.1.
    assert touch["node 1 on upper wall"].gap == pytest.approx(0.01 - 0.003, abs=1e-15)
    assert touch["node 1 on lower wall"].gap == pytest.approx(0.01 + 0.003, abs=1e-15)
    assert touch["node 1 on upper wall"].place == pytest.approx(0.1, abs=1e-15)
    # The end is 0.2 m beyond the mouth at x = 0.2, whose corner the rod passes.
    assert touch["node 2 on upper wall"].place == pytest.approx(0.5, abs=1e-15)
    corner = touch["rod 1 on upper corner of the end"]
    assert corner.gap == pytest.approx(0.007, abs=1e-15)
    assert corner.place == pytest.approx(0.2, abs=1e-15)
    assert touch["rod 1 on upper corner of the start"].place == pytest.approx(-0.1, abs=1e-15)


@pytest.mark.parametrize("tilt", [0.03, -0.03])
def test_the_corner_a_tilted_rod_leans_on(tilt):
    """At x = 0.2 the rod through (0, 0.02) is at tan(tilt) 0.2, its distance less by the cosine."""
    touch = placed((0.0, 0.02, tilt))
    upper, lower = (touch[f"rod 1 on {side} corner of the end"] for side in ("upper", "lower"))
    for at, side in ((upper, 1), (lower, -1)):
        expected = (0.01 - side * np.tan(tilt) * 0.2) * np.cos(tilt)
        assert at.gap == pytest.approx(expected, abs=1e-15)
        # The normal pushes the corner from the rod: outwards, seen from the axis.
        assert side * at.normal[1] > 0.99
    place = 0.2 / np.cos(tilt) + (0.01 - np.tan(tilt) * 0.2) * np.sin(tilt)
    assert upper.place == pytest.approx(place, abs=1e-15)
    wall = touch["node 2 on upper wall"]
    assert wall.gap == pytest.approx(0.01 - 0.4 * np.sin(tilt), abs=1e-15)
    assert wall.normal == pytest.approx([0, -1], abs=1e-15)


@pytest.mark.parametrize("above", [2e-4, -2e-4])
def test_what_is_held_on_the_axis_is_pushed_back_from_either_side(above):
    assembly = assembled(model="supported.yaml")
    channel = assembly.mechanism.channels[0]
    q, v = assembly.state.q.copy(), np.zeros_like(assembly.state.q)
    for part in channel.rods:
        q[part, 1] += above
        v[part, 1] = 0.3
    touch = {p.name: approach(p, q, v, 0.0) for p in channel.contacts}
    node = touch["sleeve: node 4 on axis"]
    assert node.gap == pytest.approx(-2e-4, abs=1e-15)
    assert node.normal[1] == pytest.approx(-np.sign(above))
    assert node.gap_rate == pytest.approx(-0.3 * np.sign(above))
    # The middle of the mouth below the rod is pushed up by it, hence the rod down.
    middle = touch["sleeve: rod 10 on middle of the end"]
    assert middle.gap == pytest.approx(-2e-4, abs=1e-15)
    assert middle.normal[1] == pytest.approx(np.sign(above))


def test_the_slip_along_a_wall_is_that_of_the_points_that_touch():
    """A guide that turns carries its wall: the node slips against it, not against the ground."""
    assembly = assembled()
    channel = assembly.mechanism.channels[0]
    q, v = assembly.state.q.copy(), np.zeros_like(assembly.state.q)
    q[1:11, 1] += 3e-3
    v[0, 2] = 10.0  # the guide turns about (0.02, 0), the link stands still
    node = approach(channel.contacts[0], q, v, 0.0)
    # The guide's own point at the node, 3 mm above its axis and 20 mm from its start, moves by
    # -10 * 3e-3 m/s along the axis and 10 * 20e-3 m/s across it.
    assert node.gap == pytest.approx(2e-3, abs=1e-15)
    assert node.slip == pytest.approx(0.03)
    assert node.gap_rate == pytest.approx(0.2)  # the upper wall lifts off
