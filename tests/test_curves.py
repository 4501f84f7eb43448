"""Curves against closed forms, and against differences of themselves."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import ellipe

from exudyn_flexlink.curves import (
    Arc,
    CurveError,
    Joined,
    Laps,
    LineSegment,
    Spline,
    circle_arc,
    ends_of_lap,
    next_piece,
    ray_crossings,
)

QUARTER = math.pi / 2
C = (0.02, 0.0)
ELLIPSE = Arc((0, 0), (0.04, 0.03))
EGG = Joined(
    (
        Arc((0, 0), (0.04, 0.03), 0, -QUARTER, QUARTER),
        circle_arc((0, 0), 0.03, QUARTER, 3 * QUARTER),
    )
)
TRACK = Laps((ELLIPSE, EGG))
STADIUM = Joined(
    (
        LineSegment((-0.02, -0.01), (0.02, -0.01)),
        circle_arc((0.02, 0), 0.01, -QUARTER, QUARTER),
        LineSegment((0.02, 0.01), (-0.02, 0.01)),
        circle_arc((-0.02, 0), 0.01, QUARTER, 3 * QUARTER),
    )
)


def ring(n, radius=0.03):
    angles = np.arange(n) * 2 * math.pi / n
    return radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def eight(n=40):
    """Figure of eight, x = 0.05 sin t, y = 0.05 sin t cos t; crosses itself at the origin."""
    t = (np.arange(n)) * 2 * math.pi / n
    return Spline(0.05 * np.stack([np.sin(t), np.sin(t) * np.cos(t)], axis=1), closed=True)


CURVES = {
    "ellipse": ELLIPSE,
    "turned": Arc((0.1, 0.2), (0.04, 0.01), 0.7, 0.3, 2.0),
    "line": LineSegment((0, 1), (3, 5)),
    "egg": EGG,
    "stadium": STADIUM,
    "track": TRACK,
    "ring": Spline(ring(12), closed=True),
    "open spline": Spline(ring(12)),
    "eight": eight(),
}
every_curve = pytest.mark.parametrize("curve", CURVES.values(), ids=CURVES.keys())


def inner(curve, n=40):
    """Places well inside the pieces, so that differences do not reach over a break."""
    shares = np.random.default_rng(0).uniform(0.01, 0.99, n)
    return (curve.breaks[:-1, None] + np.diff(curve.breaks)[:, None] * shares).ravel()


def everywhere(curve, n):
    """n places on every piece, without the end of the curve."""
    shares = np.linspace(0, 1, n, endpoint=False)
    return (curve.breaks[:-1, None] + np.diff(curve.breaks)[:, None] * shares).ravel()


@every_curve
def test_derivatives_are_those_of_the_point(curve):
    u, h = inner(curve), 1e-5 * curve.period
    scale = curve.size / curve.period
    first = (curve.point(u + h) - curve.point(u - h)) / (2 * h)
    second = (curve.derivative(u + h) - curve.derivative(u - h)) / (2 * h)
    np.testing.assert_allclose(curve.derivative(u), first, atol=1e-6 * scale)
    # of a spline the third derivative jumps at the points: first order there
    np.testing.assert_allclose(
        curve.derivatives(u)[2], second, atol=1e-2 * scale / curve.period, rtol=1e-2
    )


@every_curve
def test_curvature_turns_the_tangent_per_length(curve):
    u, h = inner(curve), 1e-5 * curve.period
    a, b = curve.tangent(u - h), curve.tangent(u + h)
    turn = np.arcsin(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    way = np.linalg.norm(curve.derivative(u), axis=1) * 2 * h
    np.testing.assert_allclose(curve.curvature(u), turn / way, atol=1e-2 / curve.size, rtol=1e-2)
    np.testing.assert_allclose(np.sum(curve.normal(u) * curve.tangent(u), axis=1), 0, atol=1e-15)


@every_curve
def test_foot_of_a_point_beside_the_curve_is_below_it(curve):
    step = 1e-2 * curve.size
    fine = everywhere(curve, 5000)
    for u in inner(curve, 4):
        target = curve.point(u) + step * curve.normal(u)
        assert curve.nearest(target, near=u + 0.01 * curve.period / len(curve.pieces)) == (
            pytest.approx(u, abs=1e-9 * curve.period)
        )
        brute = np.linalg.norm(curve.point(fine) - target, axis=1).min()
        away = np.linalg.norm(curve.point(curve.nearest(target)) - target)
        assert away <= brute + 1e-15
        assert away == pytest.approx(brute, rel=1e-3)


@every_curve
def test_length_is_that_of_a_fine_polygon(curve):
    u = everywhere(curve, 5000)
    points = np.concatenate([curve.point(u), curve.point(curve.end)[None]])
    polygon = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    assert curve.length() == pytest.approx(polygon, rel=1e-6)


def test_lengths_in_closed_form():
    assert ELLIPSE.length() == pytest.approx(4 * 0.04 * ellipe(1 - 0.75**2), rel=1e-12)
    assert STADIUM.length() == pytest.approx(0.08 + 2 * math.pi * 0.01, rel=1e-12)


def test_egg_curvature_jumps_where_its_halves_meet():
    assert EGG.closed
    np.testing.assert_allclose(EGG.breaks[:-1], [-QUARTER, QUARTER])
    np.testing.assert_allclose(EGG.point(EGG.breaks[:-1]), [[0, -0.03], [0, 0.03]], atol=1e-17)
    eps = 1e-12
    before, after = EGG.curvature([QUARTER - eps, QUARTER + eps])
    assert (before, after) == pytest.approx((18.75, 100 / 3), rel=1e-9)
    assert EGG.curvature([3 * QUARTER - eps, 3 * QUARTER + eps]) == pytest.approx([100 / 3, 18.75])


@pytest.mark.parametrize(("curve", "far"), [(ELLIPSE, 0.06), (EGG, 0.05)])
def test_distance_of_the_track_from_the_crank(curve, far):
    """r(0) = 0.02, r(pi/2) = 0.0259808, r(pi) = 0.06 on the ellipse, 0.05 on the circle."""
    across = curve.point(ray_crossings(curve, C, (1, 0)))
    np.testing.assert_allclose(sorted(across[:, 0]), [C[0] - far, 0.04])
    upright = curve.point(ray_crossings(curve, C, (0, -2)))
    np.testing.assert_allclose(sorted(upright[:, 1]), [-0.0259808, 0.0259808], atol=1e-7)


def test_laps_repeat_after_both_curves():
    assert TRACK.period == pytest.approx(4 * math.pi)
    first, second = (0, 2 * math.pi), (2 * math.pi, 4 * math.pi)
    for lap, ends in {1: first, 2: second, 3: first, -1: first, -2: second}.items():
        assert ends_of_lap(TRACK, lap) == pytest.approx(ends)
    u = np.linspace(0, 4 * math.pi, 50)
    np.testing.assert_allclose(TRACK.point(u + 3 * TRACK.period), TRACK.point(u), atol=1e-15)


@pytest.mark.parametrize("way", [1, -1])
def test_pieces_follow_one_another_lap_by_lap_and_the_same_way_back(way):
    """The ellipse is piece 0; the egg is 1 to 3, as its half of the ellipse is cut at the seam."""
    found = [(0, 1)]
    for _ in range(10):
        found.append(next_piece(TRACK, *found[-1], way))
    ahead = [(0, 1), (1, 2), (2, 2), (3, 2), (0, 3), (1, 4), (2, 4), (3, 4), (0, 5), (1, 6), (2, 6)]
    behind = [(0, 1), (0, -1), (3, -2), (2, -2), (1, -2), (0, -3), (3, -4), (2, -4), (1, -4)]
    expected = ahead if way > 0 else [*behind, (0, -5), (3, -6)]
    assert found == expected
    back = found[-1:]
    for _ in range(10):
        back.append(next_piece(TRACK, *back[-1], -way))
    assert back == expected[::-1]


@pytest.mark.parametrize("meet", [(0, 0.03), (0, -0.03)])
def test_laps_may_change_elsewhere(meet):
    laps = Laps((ELLIPSE, EGG), meet=meet)
    starts = [ends_of_lap(laps, lap)[0] for lap in (1, 2)]
    np.testing.assert_allclose(laps.point([*starts, laps.end]), [meet] * 3, atol=1e-16)
    # cut at a break of the egg: no sliver of a piece
    assert np.diff(laps.breaks).min() > 1
    assert len(distinct(ray_crossings(laps, (0, 0), (1, 1)), laps)) == 4
    rotated = Laps((EGG, ELLIPSE), meet=meet)
    np.testing.assert_allclose(rotated.point(1.0 + 2 * math.pi), laps.point(1.0), atol=1e-15)


def refused(build, *words, piece=None):
    with pytest.raises(CurveError) as caught:
        build()
    for word in words:
        assert word in caught.value.message + " | " + caught.value.hint
    assert caught.value.piece == piece


def test_laps_that_do_not_fit_are_refused():
    small, far = circle_arc((0, 0), 0.03), circle_arc((0.04, 0.04), 0.04)
    refused(lambda: Laps((ELLIPSE, small)), "curve 2", "(0.04, 0)", "0.01 m", piece=1)
    refused(lambda: Laps((ELLIPSE, far)), "curve 2", "90 degrees", piece=1)
    ways = Spline(ring(6), closed=True), Spline(np.roll(ring(6)[::-1], 1, axis=0), closed=True)
    refused(lambda: Laps(ways), "other way round", "opposite order", piece=1)
    refused(lambda: Laps((ELLIPSE, EGG.pieces[0])), "curve 2", "open", "0.06 m", piece=1)
    refused(lambda: Laps((ELLIPSE,), meet=(1, 1)), "curve 1", "(1, 1)", piece=0)


def test_what_closes_and_what_has_a_cusp_where_it_closes():
    """Gaps and kinks between pieces are refused by files of bad_models."""
    drop = (LineSegment((0, 0), (1, 0)), circle_arc((1, 0.5), 0.5, -QUARTER, QUARTER))
    back = (LineSegment((1, 1), (0, 1)), circle_arc((0, 0.5), 0.5, QUARTER, 3 * QUARTER))
    assert Joined((*drop, *back)).closed
    assert not Joined(drop).closed
    tear = circle_arc((0, 0), 1, 0, QUARTER)
    loop = Joined((tear, LineSegment((0, 1), (-1, 1))))
    assert len(Joined((loop, LineSegment((-1, 1), (-2, 1)))).pieces) == 3
    half = circle_arc((0, 0), 1, 0, math.pi)
    # this spiral closes with a half turn of the direction: a cusp at (1, 0)
    under = circle_arc((0.5, 0), 1.5, math.pi, 2 * math.pi)
    spiral = (half, under, circle_arc((1.5, 0), 0.5, 0, math.pi))
    refused(lambda: Joined(spiral), "pieces 3 and 1", "(1, 0)", "180 degrees", piece=0)


@pytest.mark.parametrize(
    "build",
    [
        *(lambda points=points: Spline(points) for points in (
            ring(3), np.zeros((5, 2)), ring(20_001), np.repeat(ring(6), 2, axis=0),
        )),
        lambda: Spline(np.concatenate([ring(6), ring(6)[:1]]), closed=True),
    ],
)  # fmt: skip
def test_degenerate_input_is_refused(build):
    with pytest.raises(CurveError):
        build()


def test_open_curve_ends():
    line = CURVES["line"]
    np.testing.assert_allclose(line.point(5 + 1e-12), (3, 5))
    for u in (-0.1, 5.1, [1, 6]):
        with pytest.raises(ValueError, match="open"):
            line.point(u)


def test_spline_through_twelve_points_of_a_circle():
    """A periodic cubic of span 30 degrees: about (pi/6)^4/384 = 2e-4 of the radius off."""
    spline = CURVES["ring"]
    u = np.linspace(0, spline.period, 500)
    radius = np.linalg.norm(spline.point(u), axis=1)
    np.testing.assert_allclose(radius, 0.03, rtol=3e-4)
    np.testing.assert_allclose(spline.curvature(u), 1 / 0.03, rtol=0.03)
    assert spline.length() == pytest.approx(2 * math.pi * 0.03, rel=2e-4)
    finer = Spline(ring(24), closed=True)
    v = np.linspace(0, finer.period, 500)
    gain = np.ptp(radius) / np.ptp(np.linalg.norm(finer.point(v), axis=1))
    assert math.log2(gain) == pytest.approx(4, abs=0.2)


def test_nearest_stays_on_its_branch_of_a_crossing():
    curve = eight()
    first, second = 0.0, 0.5 * curve.period
    np.testing.assert_allclose(curve.point([first, second]), np.zeros((2, 2)), atol=1e-15)
    for branch in (first, second):
        beside = curve.point(branch) + 1e-4 * curve.tangent(branch)
        for off in (-0.004, 0.004):
            foot = curve.nearest(beside, near=branch + off)
            assert foot == pytest.approx(branch + 1e-4, abs=1e-6)


def test_nearest_walks_from_angles_on_to_lengths():
    """From the arc (u in rad) on to the 0.04 m of line, whose end is less than a rad away."""
    on_line = float(STADIUM.breaks[2]) + 0.01
    target = STADIUM.point(on_line) + np.array([0, 0.001])
    for lap in (0, 2):
        shift = lap * STADIUM.period
        for near in (float(STADIUM.breaks[2]) - 0.3, float(STADIUM.breaks[3]) + 0.3):
            foot = STADIUM.nearest(target, near=near + shift)
            assert foot - shift == pytest.approx(on_line, abs=1e-12)


def distinct(u, curve):
    """Crossings without those that stand twice, next to a break or at the seam."""
    far = np.diff(u, append=u[:1] + curve.period) > 2e-7 * curve.period
    return u[far] if curve.closed else u


@settings(max_examples=60, deadline=None)
@given(
    angle=st.floats(0, 2 * math.pi),
    radius=st.floats(0, 0.009),
    heading=st.floats(0, 2 * math.pi),
)
def test_a_line_from_inside_crosses_a_convex_curve_twice(angle, radius, heading):
    origin = np.array([radius * math.cos(angle), radius * math.sin(angle)])
    along = np.array([math.cos(heading), math.sin(heading)])
    for curve, laps in ((ELLIPSE, 1), (EGG, 1), (STADIUM, 1), (CURVES["ring"], 1), (TRACK, 2)):
        u = distinct(ray_crossings(curve, origin, along), curve)
        assert len(u) == 2 * laps
        away = curve.point(u) - origin
        # next to a break the break itself is the answer, up to 1e-7 of a piece's range away
        np.testing.assert_allclose(away @ [-along[1], along[0]], 0, atol=2e-8)


@pytest.mark.parametrize("name", ["egg", "stadium", "track", "ring", "eight"])
def test_a_line_through_a_break_crosses_there(name):
    curve = CURVES[name]
    for u in curve.breaks[:-1]:
        found = ray_crossings(curve, curve.point(u), curve.normal(u))
        assert np.sum(np.abs(distinct(found, curve) - u) < 1e-6) == 1


def test_line_that_only_touches_or_misses():
    touch = distinct(ray_crossings(ELLIPSE, (0, 0.03), (1, 0)), ELLIPSE)
    assert touch == pytest.approx([QUARTER], abs=1e-7)
    assert ray_crossings(ELLIPSE, (0, 0.031), (1, 0)).size == 0
    assert ray_crossings(CURVES["line"], (0, 0), (3, 4)).size == 0
