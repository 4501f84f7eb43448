"""What `check` says of the curves of a scene: how long, large and bent they are."""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.curves import Curve, Spline
from exudyn_flexlink.mechanism import build_curves
from exudyn_flexlink.report.text import number, table
from exudyn_flexlink.scene import Scene

STEPS = 16  # between two values of a curve's grid: peaks of its curvature are seen to 4 digits
ROUNDING = 1e-12  # of a curve's size: coordinates less than this are 0


def curve_lines(scene: Scene) -> list[str]:
    """Return the section of curves: length, extent, ends, smallest radius; of splines chords."""
    rows = []
    for name, curve in build_curves(scene.curves)[0].items():
        spec = scene.curves[name]
        carried = f" on {spec.on}" if spec.on else ""
        ends = "closed" if curve.closed else "open"
        rows.append([name, f"{spec.type}{carried}, {ends}", f"{number(curve.length())} m long"])
        points, bend = _looked_at(curve)
        points[np.abs(points) < ROUNDING * curve.size] = 0.0
        low, high = points.min(axis=0), points.max(axis=0)
        x, y = (f"{number(a)} to {number(b)} m" for a, b in zip(low, high, strict=True))
        rows.append(["", "extent", f"x {x}, y {y}"])
        if bend > 0:
            rows.append(["", "smallest radius", f"{number(1 / bend)} m"])
        if isinstance(curve, Spline):
            chords = np.linalg.norm(np.diff(curve.point(curve.cubics()[0]), axis=0), axis=1)
            between = f"{number(chords.min())} to {number(chords.max())} m apart"
            rows.append(["", f"{len(curve.points)} points", between])
    return ["Curves", *table(rows)] if rows else []


def _looked_at(curve: Curve) -> tuple[FloatArray, float]:
    """Points (n, 2) in m, close to each other, and the largest curvature there, 1/m."""
    points, bends = [], [0.0]
    for piece in curve.pieces:
        grid = piece.grid()
        steps = np.arange(STEPS) / STEPS
        u = np.append((grid[:-1, None] + np.diff(grid)[:, None] * steps).ravel(), grid[-1])
        points.append(piece.point(u))
        bends.append(float(np.abs(piece.curvature(u)).max()))
    return np.concatenate(points), max(bends)
