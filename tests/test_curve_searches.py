"""Closest places and lengths of curves: many at once, one by one, against each other."""

from math import pi

import numpy as np
import pytest
from scipy.special import ellipeinc

from exudyn_flexlink.curves import CircleArc, Closest, EllipseArc, Joined, LineSegment, Spline

STADIUM = Joined(
    (
        LineSegment((0, 0), (1, 0)),
        CircleArc((1, 0.5), 0.5, -pi / 2, pi / 2),
        LineSegment((1, 1), (0, 1)),
        CircleArc((0, 0.5), 0.5, pi / 2, 3 * pi / 2),
    )
)
CURVES = {
    "stadium": STADIUM,
    "ellipse": EllipseArc((0.2, 0.1), (0.8, 0.3), 0.5),
    "arc": EllipseArc((0.2, 0.1), (0.8, 0.3), 0.5, 0.2, 4.0),
    "clockwise": CircleArc((0, 0), 0.6, 2.0, -1.0),
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
        assert far == pytest.approx(curve.distance(point), abs=1e-12)
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
    curve = CircleArc((0.1, 0), 0.03)
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
    length = EllipseArc((0, 0), (a, b)).arc_length
    u = np.array([0.1, 0.77, 1.5, 3.0, 6.0])
    exact = a * (ellipeinc(pi / 2, 1 - (b / a) ** 2) - ellipeinc(pi / 2 - u, 1 - (b / a) ** 2))
    np.testing.assert_allclose(length.to(u), exact, rtol=1e-14)
    assert length.to(np.array(0.0)) == 0.0
