"""Closest places and lengths of curves: many at once, one by one, against each other."""

from math import pi

import numpy as np
import pytest
from physics_tools import scene, tree_contacts
from scipy.special import ellipeinc

from exudyn_flexlink.curves import Arc, Closest, Joined, LineSegment, Spline, circle_arc
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.mechanism import approach
from exudyn_flexlink.mechanism.tree import tree_layout

STADIUM = Joined(
    (
        LineSegment((0, 0), (1, 0)),
        circle_arc((1, 0.5), 0.5, -pi / 2, pi / 2),
        LineSegment((1, 1), (0, 1)),
        circle_arc((0, 0.5), 0.5, pi / 2, 3 * pi / 2),
    )
)
CURVES = {
    "stadium": STADIUM,
    "ellipse": Arc((0.2, 0.1), (0.8, 0.3), 0.5),
    "arc": Arc((0.2, 0.1), (0.8, 0.3), 0.5, 0.2, 4.0),
    "circle": circle_arc((0, 0), 0.6, -1.0, 2.0),
    "line": LineSegment((-0.5, 0.2), (0.7, -0.1)),
    "spline": Spline(np.array([[0.5, 0], [0, 0.4], [-0.4, 0.2], [-0.2, -0.4], [0.3, -0.3]])),
    "open spline": Spline(np.array([[0.5, 0], [0, 0.4], [-0.4, 0.2], [-0.2, -0.4]]), closed=False),
}


@pytest.mark.parametrize("name", CURVES)
def test_all_ways_find_the_same_closest_places(name):
    curve = CURVES[name]
    points = np.random.default_rng(1).uniform(-1, 1.5, (200, 2))
    together = curve.point(curve.closest(points))
    search = Closest(curve)
    for point, found in zip(points, together, strict=True):
        far = np.linalg.norm(found - point)
        assert far == pytest.approx(
            np.linalg.norm(curve.point(curve.nearest(point)) - point), abs=1e-12
        )
        piece, u = search.on_curve(*point)
        one = search.at[piece](u)[:2]
        assert np.linalg.norm(np.array(one) - point) == pytest.approx(far, abs=1e-9)


def test_the_closest_place_of_a_point_beside_an_open_end_is_that_end():
    search = Closest(CURVES["line"])
    assert search.on_curve(-0.8, 0.2) == (0, 0.0)
    assert search.on_curve(0.9, -0.2) == (0, CURVES["line"].end)


@pytest.mark.parametrize("part", [1e-3, 0.03, 0.09, 0.5])
def test_the_closest_place_of_a_point_near_the_centre_of_curvature(part):
    """A part of the radius from a circle's middle, as of a roller that hardly has room in it."""
    curve = circle_arc((0.1, 0), 0.03)
    search = Closest(curve)
    for angle in np.linspace(0.01, 6.27, 50).tolist():
        x, y = 0.1 + part * 0.03 * np.cos(angle), part * 0.03 * np.sin(angle)
        assert search.on_piece(0, x, y, near=0.0) == pytest.approx(angle, abs=1e-11)


@pytest.mark.parametrize("name", ["arc", "open spline"])
def test_beyond_an_open_end_the_piece_goes_on_from_there(name):
    curve = CURVES[name]
    beyond = curve.end + 0.01
    place = np.array(Closest(curve).at[0](beyond)[:2])
    assert Closest(curve).on_piece(0, *place, near=curve.start) == pytest.approx(beyond, abs=1e-12)


@pytest.mark.parametrize("name", CURVES)
def test_lengths_are_the_same_one_by_one(name):
    curve = CURVES[name]
    search = Closest(curve)
    for u in np.linspace(curve.start, curve.end, 137)[:-1].tolist():
        exact = float(curve.arc_length.to(np.array(u)))
        assert search.length_to(*curve.locate(u)) == pytest.approx(exact, abs=1e-14)


def test_the_length_of_an_ellipse_is_its_elliptic_integral():
    a, b = 0.8, 0.3
    length = Arc((0, 0), (a, b)).arc_length
    u = np.array([0.1, 0.77, 1.5, 3.0, 6.0])
    exact = a * (ellipeinc(pi / 2, 1 - (b / a) ** 2) - ellipeinc(pi / 2 - u, 1 - (b / a) ** 2))
    np.testing.assert_allclose(length.to(u), exact, rtol=1e-14)
    assert length.to(np.array(0.0)) == 0.0


# --- gaps -----------------------------------------------------------------------------------------

SHAPES = {
    "ellipse": "type: ellipse, centre: [0.1, 0], semi_axes: [0.5, 0.2], rotation: 20 deg",
    "spline": "type: spline, points: [[0.5, 0], [0, 0.4], [-0.4, 0.2], [-0.2, -0.4], [0.3, -0.3]]",
    "open": "type: ellipse, centre: [0, 0], semi_axes: [0.5, 0.3], from: 10 deg, to: 350 deg",
}
FACES = {"face on ellipse": "ellipse", "face on spline": "spline"}
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


def moving(shape):
    """A bead inside a curve that moves, or a face to the right of which that is."""
    if shape not in FACES:
        return assemble_scene(scene(MOVING.format(shape=SHAPES[shape], side="left")))
    text = MOVING.format(shape=SHAPES[FACES[shape]], side="right")
    text = text.replace("point_on_curve", "line_on_curve").replace("    radius: 0.02\n", "")
    text = text.replace("point: bead.c", "line: [bead.c, bead.d]").replace("[0.05, 0.1]", "[0, 1]")
    return assemble_scene(scene(text.replace("02]}", "02], d: [0.3, 0.1]}")))


@pytest.mark.parametrize("shape", [*SHAPES, *FACES])
@pytest.mark.parametrize("held", [False, True])
def test_gap_place_and_their_rates_are_those_of_the_curve(shape, held):
    """Both ways that know them agree, rates are derivatives, also the curve's second one."""
    assembly = moving(shape)
    (own,) = assembly.mechanism.contacts
    layout, contacts = tree_layout(assembly.mechanism), tree_contacts(assembly.mechanism)
    rng = np.random.default_rng(3)
    x, v = rng.normal(scale=0.1, size=6), rng.normal(size=6)
    if held:
        contacts.follow(0, x, presses=True)
    h = 1e-6
    seen = [at_places(contacts, x + by * v, v) for by in (-h, 0.0, h)]
    assert seen[1].gap_rate == pytest.approx((seen[2].gap - seen[0].gap) / (2 * h), abs=1e-8)
    q, rate = poses(layout, x), poses(layout, v)
    at = approach(own, q, rate, 0.0)
    for mine, other in (
        (seen[1].gap, at.gap),
        (seen[1].place, at.place),
        (seen[1].gap_rate, at.gap_rate),
        (seen[1].slip, at.slip),
    ):
        assert mine == pytest.approx(float(other), abs=1e-12)
    _, rows = contacts.whole_group.look(contacts.kinematics.moving(x, v))
    assert rows.across[0] @ v == pytest.approx(seen[1].gap_rate, abs=1e-12)


def at_places(contacts, x, v):
    """The only contact, with its place."""
    return contacts.whole_group.seen(contacts.poses(x, v)).of(0)


def poses(layout, x):
    """Coordinates (parts, 3) of two free bodies, which the tree has in another order."""
    found = np.zeros((2, 3))
    for part in range(2):
        last = layout.frames[part].link
        links = layout.path(last)
        for i, axis in zip(links, (0, 1, 2), strict=True):
            found[part, axis] = x[i]
    return found
