"""Plane curves for slot joints: arcs, lines, splines, joined pieces, other curves each lap."""

from exudyn_flexlink.curves.base import Curve, CurveError, Knots, Places, ray_crossings
from exudyn_flexlink.curves.closest import (
    Closest,
    Evaluator,
    Farthest,
    evaluator,
    finer,
    foot,
    is_convex,
    reach,
)
from exudyn_flexlink.curves.pieces import (
    Arc,
    Joined,
    Laps,
    LineSegment,
    Spline,
    SplinePiece,
    Superellipse,
    circle_arc,
    closing,
    curves_of_laps,
    ends_of_lap,
    next_lap,
    next_piece,
)
from exudyn_flexlink.curves.rounding import CornerArc, polygon, rounded
