"""Plane curves for slot joints: arcs, lines, splines, joined pieces, other curves each lap."""

from exudyn_flexlink.curves.base import Curve, CurveError, Knots, Places, ray_crossings
from exudyn_flexlink.curves.closest import Closest, Evaluator, evaluator, foot
from exudyn_flexlink.curves.farthest import Farthest, is_convex
from exudyn_flexlink.curves.joined import Joined, Laps, ends_of_lap, next_lap, next_piece
from exudyn_flexlink.curves.pieces import Arc, LineSegment, circle_arc
from exudyn_flexlink.curves.reach import reach
from exudyn_flexlink.curves.spline import Spline, SplinePiece, closing
