"""Polygons and joined curves with rounded corners: closed forms, slots and rollers on them."""

from math import cos, hypot, pi, radians, sin, sqrt

import numpy as np
import pytest
from physics_tools import alone, scene

from exudyn_flexlink.curves import (
    Closest,
    CornerArc,
    CurveError,
    LineSegment,
    circle_arc,
    polygon,
    rounded,
)
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.report import check_text

ZIGZAG = [(0.0, 0.0), (0.3, 0.0), (0.3, 0.2), (0.6, 0.3)]
TRIANGLE = [(0.0, 0.0), (0.4, 0.0), (0.1, 0.3)]
TEETH = [  # roots and tips of a ratchet wheel
    (radius * cos(k * pi / 4), radius * sin(k * pi / 4))
    for k in range(8)
    for radius in (0.045, 0.06)
]
BEAD = """
bodies: {bead: {type: rigid, mass: 0.2, inertia: 0, points: {c: [0, 0]}}}
curves:
  track: {type: polygon, points: [[-0.3, 0.3], [0, 0], [0.3, 0.2], [0.33, 0.22]], round: 0.1}
joints: {groove: {type: slot, point: bead.c, curve: track}}
gravity: 9.81
initial: {positions: {bead: [-0.2, 0.2]}}
run: {duration: LASTS}
accuracy: {tolerance: 1.0e-9}
"""
CAM = """
bodies:
  cam: {type: rigid, mass: 1, inertia: 1.0e-3, points: {o: [0, 0]}}
  follower: {type: rigid, mass: 0.3, inertia: 1.0e-3, points: {c: [0, 0]}}
curves:
  rim:
    type: polygon
    on: cam
    points: [[-0.03, -0.03], [0.03, -0.03], [0.03, 0.03], [-0.03, 0.03]]
    closed: true
    round: 0.01
joints:
  shaft: {type: revolute, points: [ground, cam.o], at: [0, 0]}
  way: {type: prismatic, points: [ground, follower.c], at: [0, 0], axis: [0, 1]}
drives: {turn: {type: speed, joint: shaft, value: SPEED}}
springs: {push: {type: linear, joint: way, stiffness: 3000, length: 0.035}}
contacts:
  roll:
    type: point_on_curve
    point: follower.c
    curve: rim
    side: right
    radius: 12 mm
    law: {type: impulse, restitution: 0}
gravity: 9.81
initial: {along: {way: 0.042}, angles: {cam: 0}}
run: {duration: LASTS}
accuracy: {tolerance: 1.0e-9}
"""


def at_length(curve, length):
    """Place (2,) on a curve of lines and circles at a length (m) from its start."""
    for piece in curve.pieces:
        if length <= piece.length():
            return piece.point(piece.start + length / piece.length() * piece.period)
        length -= piece.length()
    raise AssertionError


def turns_of(curve):
    """Angles (rad) by which its corners turn, to the left."""
    return [piece.way * piece.period for piece in curve.pieces if isinstance(piece, CornerArc)]


def largest(points, *, closed):
    """The radius that a refusal of too large a one tells."""
    with pytest.raises(CurveError, match="do not fit at all corners: at most") as caught:
        polygon(points, 10.0, closed=closed)
    assert caught.value.key == "round"
    return float(caught.value.message.split()[-2])


def test_an_open_polygon_has_arcs_at_its_corners():
    curve = polygon(ZIGZAG, 0.05, closed=False)
    assert not curve.closed
    assert curve.length() == pytest.approx(0.785143949, abs=5e-10)
    assert turns_of(curve) == pytest.approx([pi / 2, -1.249045772], abs=5e-10)
    ends = [piece.point([piece.start, piece.end]) for piece in curve.pieces[1::2]]
    assert ends[0] == pytest.approx(np.array([[0.25, 0], [0.3, 0.05]]), abs=1e-12)
    second = np.array([[0.3, 0.163962039], [0.3341886117, 0.2113962039]])
    assert ends[1] == pytest.approx(second, abs=5e-11)
    for length, place in (
        (0.28, (0.2782321237, 0.008733219255)),
        (0.4, (0.3, 0.1214601837)),
        (0.6, (0.4243570279, 0.2414523426)),
    ):
        assert at_length(curve, length) == pytest.approx(place, abs=5e-11)
    assert largest(ZIGZAG, closed=False) == pytest.approx(0.116227766, abs=5e-10)


def test_a_closed_polygon_has_one_at_its_first_point_too():
    """Its length is that of all sides, less 2 R tan(turn/2) a corner, and a full turn of R."""
    curve = polygon(TRIANGLE, 0.03, closed=True)
    assert curve.closed
    assert curve.length() == pytest.approx(1.003806988, abs=5e-10)
    assert polygon([*TRIANGLE, TRIANGLE[0]], 0.03, closed=True) == curve
    incircle = 0.4 * 0.3 / (0.4 + hypot(0.3, 0.3) + hypot(0.1, 0.3))
    assert largest(TRIANGLE, closed=True) == pytest.approx(incircle, rel=1e-9)
    assert polygon(TRIANGLE, incircle, closed=True).length() == pytest.approx(2 * pi * incircle)


def test_points_in_one_line_have_no_corner():
    curve = polygon([(0, 0), (0.1, 0), (0.3, 0), (0.3, 0.2)], 0.05, closed=False)
    assert turns_of(curve) == pytest.approx([pi / 2])
    assert curve.length() == pytest.approx(0.5 - 2 * 0.05 + 0.05 * pi / 2)


def test_a_ratchet_wheel_has_hollows_and_bumps():
    wheel = polygon(TEETH, 0.003, closed=True)
    assert wheel.length() == pytest.approx(0.3995709435, abs=5e-11)
    assert sorted(set(np.round(turns_of(wheel), 9))) == [-1.510210394, 2.295608557]
    assert largest(TEETH, closed=True) == pytest.approx(0.004742962671, abs=5e-13)


@pytest.mark.parametrize("radius", [0.01, 0.04])
@pytest.mark.parametrize("inside", [False, True])
def test_an_arc_between_a_line_and_a_circle_touches_both(radius, inside):
    """Where a line ends on a circle, and where one begins there, and goes on inside."""
    x, y = -sqrt(0.08), 0.1
    angle = np.arctan2(y, x)
    pieces = [LineSegment((-0.6, y), (x, y)), circle_arc((0, 0), 0.3, angle, 4.0)]
    if inside:
        pieces = [circle_arc((0, 0), 0.3, 0.0, angle), LineSegment((x, y), (0.2, y))]
    curve = rounded(pieces, radius)
    corner = curve.pieces[1]
    assert isinstance(corner, CornerArc)
    way = 1 if inside else -1
    assert corner.centre[1] == pytest.approx(y + way * radius, abs=1e-12)
    assert hypot(*corner.centre) == pytest.approx(0.3 - way * radius, abs=1e-12)
    ends = np.array([piece.tangent(piece.end) for piece in curve.pieces[:-1]])
    starts = np.array([piece.tangent(piece.start) for piece in curve.pieces[1:]])
    assert ends == pytest.approx(starts, abs=1e-12)


def test_the_place_next_to_a_point_is_that_of_all():
    """Also between long sides, whose samples are far apart."""
    rng = np.random.default_rng(3)
    for points in (TEETH, [(0, 0), (1, 0.02), (0.02, 0.05), (1, 0.3)]):
        curve = polygon(points, 0.002, closed=True)
        search, box = Closest(curve), np.array(points)
        asked = rng.uniform(box.min(axis=0), box.max(axis=0), size=(400, 2))
        dense = np.concatenate(
            [piece.point(np.linspace(piece.start, piece.end, 400)) for piece in curve.pieces]
        )
        nearest = np.linalg.norm(asked[:, None] - dense, axis=2).min(axis=1)
        told = np.linalg.norm(curve.point(search.parameters(asked)) - asked, axis=1)
        assert (told <= nearest + 1e-12).all()
        assert told == pytest.approx(nearest, abs=2e-3)


@pytest.mark.parametrize(
    ("lasts", "place", "speed", "before", "after"),
    [
        (0.2406507573, (-0.05796888989, 0.05796888989), 1.669326325, 1.387343505, 6.960644266),
        (0.3174707204, (0.06821180786, 0.04547453857), 1.741203478, 7.696061784, 1.632482677),
    ],
)
def test_the_force_of_a_slot_jumps_where_an_arc_begins_and_ends(lasts, place, speed, before, after):
    for off, right in ((-1e-8, before), (1e-8, after)):
        bead = alone(BEAD.replace("LASTS", f"{lasts + off}"))
        force = np.hypot(*bead.slot_forces["groove"][-1])
        assert force == pytest.approx(right, abs=2e-6)
        assert bead.poses[-1, 0, :2] == pytest.approx(place, abs=2e-8)
        assert np.hypot(*bead.rates[-1, 0, :2]) == pytest.approx(speed, abs=2e-7)


def test_a_bead_swings_between_two_sides():
    bead = alone(BEAD.replace("LASTS", "1.274900505, sample: 0.31872512625"))
    half, whole = bead.poses[2, 0, :2], bead.poses[-1, 0, :2]
    assert bead.time[2] == pytest.approx(0.6374502526, abs=2e-10)
    assert half == pytest.approx((0.3, 0.2), abs=1e-9)
    assert whole == pytest.approx((-0.2, 0.2), abs=1e-8)
    assert bead.energy.kinetic[[2, -1]] == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize(
    ("angle", "y", "slope", "vertical", "torque"),
    [
        (radians(15), 0.04348159958, 0.01165085949, 34.3548319, 0.4002633193),
        (0.4444192099 - 1e-6, 0.0465188134, 0.0221518159, 45.61333391, None),
        (0.4444192099 + 1e-6, 0.0465188134, 0.0221518159, 29.5752, None),
        (radians(30), 0.04806683694, 0.01696076787, 34.32012086, 0.582095603),
        (radians(45), 0.05028427125, 0, 41.03806483, 0),
    ],
)
def test_a_roller_follows_a_square_cam(angle, y, slope, vertical, torque):
    found = alone(CAM.replace("LASTS", f"{angle / 20}").replace("SPEED", "20"))
    off = 0 if torque is not None else 1e-6  # rad, beside the edge
    assert found.poses[-1, 1, 1] == pytest.approx(y, abs=1e-9 + 0.03 * off)
    assert found.rates[-1, 1, 1] / 20 == pytest.approx(slope, abs=1e-8 + 0.07 * off)
    force = found.joint_forces["shaft"][-1, 1] - 9.81  # of which the cam's weight is a part
    assert force == pytest.approx(vertical, abs=1e-7 + 150 * off)
    assert torque is None or found.drive_torques["turn"][-1] == pytest.approx(torque, abs=1e-8)


@pytest.mark.parametrize(("speed", "leaves"), [(43.5, False), (43.53, True)])
def test_a_roller_leaves_a_square_cam_right_after_the_edge_of_an_arc(speed, leaves):
    found = alone(CAM.replace("LASTS", f"{pi / 4 / speed}").replace("SPEED", f"{speed}"))
    ends = found.intervals["roll"].end
    assert (ends[0] < found.time[-1]) == leaves
    assert not leaves or ends[0] * speed == pytest.approx(0.4444192099, abs=1e-9)


@pytest.mark.parametrize(
    ("angle", "away"),
    [
        (3, 0.05841552207),
        (10, 0.05504295985),
        (22.5, 0.04962941082),
        (35, 0.04722367811),
        (44, 0.05636596066),
    ],
)
def test_a_pawl_rests_on_the_offset_curve_of_a_ratchet_wheel(angle, away):
    """Where the spring presses it: as far from the axle as its roller lets it come."""
    text = CAM
    points = ", ".join(f"[{x}, {y}]" for x, y in TEETH)
    for part, other in (
        ("LASTS", "40 ms"),
        ("SPEED", f"{90 - angle} deg"),
        ("type: speed", "type: motion"),
        ("12 mm", "2 mm"),
        ("round: 0.01", "round: 3 mm"),
        ("[-0.03, -0.03], [0.03, -0.03], [0.03, 0.03], [-0.03, 0.03]", points),
        ("along: {way: 0.042}, angles: {cam: 0}", "along: {way: 0.062}"),
    ):
        text = text.replace(part, other)
    assert alone(text).poses[-1, 1, 1] == pytest.approx(away, abs=1e-9)


def test_check_tells_corners_and_radii():
    made = scene(BEAD.replace("LASTS", "1"))
    told = check_text(made, assemble_scene(made)).split("\nCurves\n")[1].split("\n\n")[0]
    rows = [" ".join(row.split()) for row in told.splitlines()]
    assert rows[0].startswith("track polygon, open 0.79")
    assert rows[2:] == ["smallest radius 0.1 m", "1 corners radius 0.1 m"]
