"""Points of splines that nearly repeat, and splines that are closed or open: told or refused."""

import numpy as np
import pytest

from exudyn_flexlink.engines import simulate
from exudyn_flexlink.loading import assemble_scene, scene_of
from exudyn_flexlink.mechanism import build_curves
from exudyn_flexlink.report import check_text
from exudyn_flexlink.source import SceneError, parse_document

RADIUS = 0.03
BEAD = """
title: A groove through points of a circle
bodies: {bead: {type: rigid, mass: 1, inertia: 1, points: {pin: [0, 0]}}}
initial: {velocities: {bead: [0, 0.1]}}
run: {duration: 0.5}
accuracy: {tolerance: 1.0e-6}
"""


def ring(count, turn=2 * np.pi):
    """Points of a circle; of a part of it with its end."""
    angles = np.linspace(0, turn, count, endpoint=turn < 6)
    return RADIUS * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def read(folder, points, closed=""):
    """The scene with a groove through points of a file, written with 7 decimals, as measured."""
    lines = [f"{x:.7f},{y:.7f}\n" for x, y in points]
    (folder / "ring.csv").write_text("".join(lines))
    groove = f"curves: {{groove: {{type: spline, file: ring.csv{closed}}}}}\n"
    return scene_of(parse_document(groove + BEAD, "model.yaml", folder))


@pytest.mark.parametrize(
    ("count", "gap", "closed"),
    [(12, 0.0, ""), (12, 3e-5, ", closed: true"), (48, 1e-7, ", closed: true"), (48, 1e-5, "")],
)
def test_a_last_point_near_the_first_closes_the_curve(tmp_path, count, gap, closed):
    """The circle is as round as without it, wherever the last point is, and the run says so."""
    points = np.concatenate([ring(count), [[RADIUS + gap, -gap / 2]]])
    scene = read(tmp_path, points, closed)
    curve = build_curves(scene.curves)[0]["groove"]
    radii = np.linalg.norm(curve.point(np.linspace(0, curve.period, 5000)), axis=1)
    # of a cubic spline through points of a circle: radius times h^4/384 + O(h^6), h in rad
    off = 1.1 * RADIUS * (2 * np.pi / count) ** 4 / 384 + 1e-7
    assert abs(radii - RADIUS).max() < off
    (told,) = [told for told in simulate(scene).warnings if "groove" in told]
    assert "closes the curve, and is left out" in told


@pytest.mark.parametrize("after", [0, 4, 11])
@pytest.mark.parametrize("off", [(0, 0), (0, -1e-6), (1e-4, 0)])
def test_a_row_that_nearly_repeats_is_refused_with_its_line(tmp_path, after, off):
    points = np.insert(ring(12), after + 1, ring(12)[after] + off, axis=0)
    if after == 11:  # no row that closes the curve
        points = np.concatenate([points, [[0.0299, -0.0033]]])
    with pytest.raises(SceneError, match=rf"ring.csv line {after + 2}: .* m from the point before"):
        read(tmp_path, points, ", closed: false" if after == 11 else "")


@pytest.mark.parametrize("count", [0, 3])
def test_a_spline_needs_four_points(tmp_path, count):
    with pytest.raises(SceneError, match=f"curves.groove: a spline needs 4 .* got {count}"):
        read(tmp_path, ring(12)[:count])
    with pytest.raises(SceneError, match=r"curves.groove: a spline needs 4 .* got 3"):
        read(tmp_path, ring(3)[[0, 1, 2, 0]])


def test_a_point_of_the_model_file_is_refused_at_its_line():
    rows = "".join(f"    - [{x:.6f}, {y:.6f}]\n" for x, y in np.insert(ring(12), 5, ring(12)[4], 0))
    text = "curves:\n  groove:\n   type: spline\n   points:\n" + rows + BEAD
    with pytest.raises(SceneError, match=r"model:10:7: curves.groove.points.5: 0 m from the point"):
        scene_of(parse_document(text, "model"))


@pytest.mark.parametrize("turn", [0.5, 1.5])
def test_an_arc_must_say_whether_it_is_closed(tmp_path, turn):
    arc = ring(19, turn * np.pi)
    with pytest.raises(SceneError, match=r"ring.csv line 19: .* m from the first point") as raised:
        read(tmp_path, arc)
    assert raised.value.mistakes[0].hint == "write 'closed: true' or 'closed: false'"
    opened = build_curves(read(tmp_path, arc, ", closed: false").curves)[0]["groove"]
    assert not opened.closed
    assert opened.length() == pytest.approx(turn * np.pi * RADIUS, rel=1e-4)
    assert build_curves(read(tmp_path, arc, ", closed: true").curves)[0]["groove"].closed


CURVES = """
curves:
  oval: {type: ellipse, centre: [1, 0], semi_axes: [0.2, 0.1]}
  half: {type: circle, centre: [0, 0], radius: 0.1, from: 0 deg, to: 180 deg}
  hook: {type: joined, pieces: [{type: line, from: [0.1, -1], to: [0.1, 0]}, half]}
  dense: {type: spline, on: bead, points: [[0, 0], [1, 0], [2, 0], [4, 0]], closed: false}
  groove: {type: line, from: [0.03, -3], to: [0.03, 4]}
"""


def test_check_tells_of_curves_what_closed_forms_say():
    scene = scene_of(parse_document(CURVES + BEAD, "model"))
    told = check_text(scene, assemble_scene(scene)).split("\nCurves\n")[1].split("\n\n")[0]
    rows = [" ".join(row.split()) for row in told.splitlines()]
    assert rows == [
        "oval ellipse, closed 0.9688 m long",  # 4 a E(e): 0.968844822
        "extent x 0.8 to 1.2 m, y -0.1 to 0.1 m",
        "smallest radius 0.05 m",  # b^2/a
        "half circle, open 0.3142 m long",
        "extent x -0.1 to 0.1 m, y 0 to 0.1 m",
        "smallest radius 0.1 m",
        "hook joined, open 1.314 m long",
        "extent x -0.1 to 0.1 m, y -1 to 0.1 m",
        "smallest radius 0.1 m",
        "dense spline on bead, open 4 m long",
        "extent x 0 to 4 m, y 0 to 0 m",
        "4 points 1 to 2 m apart",
        "groove line, open 7 m long",
        "extent x 0.03 to 0.03 m, y -3 to 4 m",
    ]
